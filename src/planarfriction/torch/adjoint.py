"""The compiled roll-out and its discrete adjoint as functions of PyTorch: processor tensors, first derivatives."""

from __future__ import annotations

from typing import Any

import torch
from torch import Tensor

from planarfriction import autodiff
from planarfriction.autodiff.parameters import Packed
from planarfriction.errors import FrictionError

_INNER = (1, 2, 1, 1)
"""Axes of state `[3]`, twist `[T, 3]`, normal_force `[T]` and parameters `[P]` behind the batch axes."""


def roll_out(model: Packed, dt: float, *inputs: Tensor) -> tuple[Tensor, Tensor]:
    """The last state `[..., 3]` and wrenches `[..., T, 3]` of `autodiff.rollout`.

    `inputs` are state `[..., 3]`, twist `[..., T, 3]`, normal_force `[..., T]` and parameters `[..., P]`, whose batch
    axes broadcast.
    """
    return _Rollout.apply(model, dt, *inputs)  # pyright: ignore[reportReturnType]


class _Rollout(torch.autograd.Function):
    @staticmethod
    def forward(model, dt, *inputs):
        state, twist, load, parameters = map(_to_numpy, inputs)
        result = autodiff.rollout(model, state, twist, load, dt, parameters=parameters)
        return tuple(_like(array, inputs) for array in result)

    @staticmethod
    def setup_context(ctx, inputs, output):
        ctx.model, ctx.dt = inputs[:2]
        ctx.save_for_backward(*inputs[2:])

    @staticmethod
    def backward(ctx, *bars):
        return (None, None, *_Gradient.apply(ctx.model, ctx.dt, *ctx.saved_tensors, *bars))  # pyright: ignore

    @staticmethod
    def vmap(info, in_dims, model, dt, *inputs):
        return _Rollout.apply(model, dt, *_aligned(info.batch_size, in_dims[2:], inputs, _INNER)), (0, 0)


class _Gradient(torch.autograd.Function):
    """Cotangents of the inputs from those of last state and wrenches; itself without derivative."""

    @staticmethod
    def forward(model, dt, *tensors):
        state, twist, load, parameters, state_bar, wrenches_bar = map(_to_numpy, tensors)
        gradient = autodiff.rollout_gradient(
            model, state, twist, load, dt, wrenches_bar, state_bar, parameters=parameters
        )
        return tuple(_like(array, (tensor,)) for array, tensor in zip(gradient, tensors[:4], strict=True))

    @staticmethod
    def setup_context(ctx, inputs, output):
        pass

    @staticmethod
    def backward(ctx, *bars):
        raise FrictionError("the adjoint gives first derivatives: take method='eager' to differentiate twice")

    @staticmethod
    def vmap(info, in_dims, model, dt, *tensors):
        size = info.batch_size
        aligned = _aligned(size, in_dims[2:], tensors, (*_INNER, 1, 2))
        shapes = [_logical(tensor, dim) for tensor, dim in zip(tensors[:4], in_dims[2:6], strict=True)]
        gradients: Any = _Gradient.apply(model, dt, *aligned)
        return tuple(g.reshape(size, *shape) for g, shape in zip(gradients, shapes, strict=True)), (0,) * 4


def _to_numpy(tensor: Tensor):
    return tensor.detach().to(torch.float64).numpy()


def _like(array, tensors: tuple[Tensor, ...]) -> Tensor:
    kind = tensors[0].dtype
    for tensor in tensors[1:]:
        kind = torch.promote_types(kind, tensor.dtype)
    return torch.from_numpy(array).to(kind)


def _logical(tensor: Tensor, dim: int | None) -> list[int]:
    """Shape as the mapped function sees it."""
    return [length for axis, length in enumerate(tensor.shape) if axis != dim]


def _aligned(size: int, dims, tensors, inner: tuple[int, ...]) -> list[Tensor]:
    """Put the mapped axis in front of every tensor, and axes of length 1 behind it until the batch axes match."""
    fronted = [
        tensor[None].expand(size, *tensor.shape) if dim is None else tensor.movedim(dim, 0)
        for tensor, dim in zip(tensors, dims, strict=True)
    ]
    rank = max(tensor.ndim - axes for tensor, axes in zip(fronted, inner, strict=True))
    return [
        tensor.reshape(size, *(1,) * (rank - (tensor.ndim - axes)), *tensor.shape[1:])
        for tensor, axes in zip(fronted, inner, strict=True)
    ]
