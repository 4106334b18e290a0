"""Search of the cells that press where the pressure follows its load, for PyTorch: the compiled search."""

from __future__ import annotations

import numpy as np
import torch
from torch import Tensor


def pressing(u: Tensor, v: Tensor, share: Tensor, x: Tensor, y: Tensor, narrow: Tensor) -> Tensor:
    """Return the cells that press, bool `[..., N]` (see `Namespace.pressing`)."""
    return _Pressing.apply(u, v, share, x, y)  # pyright: ignore[reportReturnType]


class _Pressing(torch.autograd.Function):
    """Cells that press, as if they were constants."""

    @staticmethod
    def forward(u, v, share, x, y):
        from planarfriction.kernels.tilt import tilt_many

        rows = [np.array(each.detach().cpu().double().reshape(-1, each.shape[-1]).numpy()) for each in (u, v, share)]
        centres = torch.cat([x, y], -1).detach().cpu().double().reshape(-1, 2).contiguous().numpy()
        out = np.empty_like(rows[2])
        tilt_many(*rows, centres, out)
        return torch.from_numpy((out > 0.0) | (rows[2] == 0.0)).reshape(share.shape).to(share.device)

    @staticmethod
    def setup_context(ctx, inputs, output):
        ctx.mark_non_differentiable(output)

    @staticmethod
    def backward(ctx, *bars):
        return (None,) * 5

    @staticmethod
    def jvp(ctx, *tangents):
        return None

    @staticmethod
    def vmap(info, in_dims, *tensors):
        fronted = [
            each.unsqueeze(0).expand(info.batch_size, *each.shape) if dim is None else each.movedim(dim, 0)
            for each, dim in zip(tensors, in_dims, strict=True)
        ]
        return _Pressing.apply(*fronted), 0
