"""The array namespace of PyTorch."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np
import torch
from torch import Tensor

from planarfriction._support import validation
from planarfriction.errors import InvalidValueError
from planarfriction.tensors.elements import over
from planarfriction.tensors.namespace import Namespace


class _Pressing(torch.autograd.Function):
    """Cells that press (see `Namespace.pressing`), as if they were constants."""

    @staticmethod
    def forward(u, v, share, x, y, narrow):
        from planarfriction._engine.cells.moment_pressure import tilt_many

        rows = [
            np.array(each.detach().cpu().double().reshape(-1, each.shape[-1]).numpy())
            for each in (u, v, share)
        ]
        centres = (
            torch.cat([x, y], -1)
            .detach()
            .cpu()
            .double()
            .reshape(-1, 2)
            .contiguous()
            .numpy()
        )
        out = np.empty_like(rows[2])
        tilt_many(*rows, centres, out)
        return (
            torch.from_numpy((out > 0.0) | (rows[2] == 0.0))
            .reshape(share.shape)
            .to(share.device)
        )

    @staticmethod
    def setup_context(ctx, inputs, output):
        ctx.mark_non_differentiable(output)

    @staticmethod
    def vmap(info, in_dims, *tensors):
        fronted = [
            each.unsqueeze(0).expand(info.batch_size, *each.shape)
            if dim is None
            else each.movedim(dim, 0)
            for each, dim in zip(tensors, in_dims, strict=True)
        ]
        return _Pressing.apply(*fronted), 0


def _real(name: str, value: Any, like: Tensor | None = None) -> Tensor:
    dtype, device = (torch.float64, None) if like is None else (like.dtype, like.device)
    if isinstance(value, Tensor):
        if value.is_floating_point():
            return value
        if value.is_complex() or value.dtype == torch.bool:
            raise InvalidValueError(
                name, "be a tensor of real numbers", f"one of {value.dtype}"
            )
        return value.to(dtype)
    plain = value if type(value) is float else validation.numbers(name, value)
    # Which tensors do not support.
    if isinstance(plain, np.ndarray) and min(plain.strides, default=0) < 0:
        plain = plain.copy()
    return torch.as_tensor(plain, dtype=dtype, device=device)


def _extremes(name: str, value: Tensor) -> tuple[float, float] | None:
    if torch.compiler.is_compiling() or value.device.type != "cpu" or not value.numel():
        return None
    try:
        low, high = (each.item() for each in torch.aminmax(value.detach()))
    except RuntimeError:  # inside vmap
        return None
    validation.within_range(name, low, high)
    return low, high


def _widened(x: Tensor) -> Tensor:
    """Return the numbers of a step in double precision, and with them all that follows, if the device has it.

    In steady sliding the rate of a bristle is the difference of two large numbers; sigma_1 times its rounding in single
    precision would be 1e-4 of the load at 1 m/s.
    """
    return x if x.device.type == "mps" else x.double()


def _narrowed(result: Tensor, *inputs: Tensor) -> Tensor:
    return result.to(
        functools.reduce(torch.promote_types, (each.dtype for each in inputs))
    )


def _in_double(function: Any, *arrays: Tensor) -> Tensor:
    return _narrowed(function(*map(_widened, arrays)), *arrays)


def _until(body: Any, state: Any, most: int) -> Any:
    for _ in range(most):
        done, state = body(state)
        if not torch.compiler.is_compiling() and _holds(done):
            break
    return state


def _repeat(body: Any, state: Any, times: int) -> Any:
    result = None
    for _ in range(times):
        state, result = body(state)
    return result


def _slopes(function: Any, x: Tensor, units: Tensor) -> Tensor:
    """Return `Namespace.slopes` backwards, as dual numbers cannot be nested."""
    pull = torch.func.vjp(function, x.expand(units.shape))[1]
    return pull(units)[0]


def _holds(condition: Tensor) -> bool:
    try:
        return bool(condition)
    except RuntimeError:  # inside vmap
        return False


class _Twins:
    """Functions over tensors by the names of `_name_of`: `torch.compile` calls what it finds in a place."""


@torch.compiler.assume_constant_result
def _name_of(function: Any) -> str:
    """Return the name of a function among the twins; it is made if it is not there."""
    name = f"of_{id(function)}"
    setattr(_Twins, name, staticmethod(over(xp)(function)))
    return name


def _over(function: Any) -> Any:
    return getattr(_Twins, _name_of(getattr(function, "py_func", function)))


xp = Namespace(
    torch,
    over=_over,
    broadcast_arrays=torch.broadcast_tensors,
    stop_gradient=torch.detach,
    integers=lambda x: x.long(),
    real=_real,
    extremes=_extremes,
    pressing=_Pressing.apply,
    until=_until,
    repeat=_repeat,
    compiled=lambda function, record: function(xp, record),
    slopes=_slopes,
    to_numpy=lambda value: (
        value.detach().cpu().numpy() if isinstance(value, Tensor) else value
    ),
    from_numpy=lambda array, like: torch.tensor(
        array, dtype=like.dtype, device=like.device
    ),
    in_double=_in_double,
    widened=_widened,
    narrowed=_narrowed,
)
