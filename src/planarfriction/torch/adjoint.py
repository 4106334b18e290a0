"""The compiled roll-out with its derivatives, backwards and forwards, as functions of PyTorch.

For tensors on the processor, and first derivatives.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import torch
from torch import Tensor

from planarfriction import derivatives
from planarfriction.derivatives.parameters import Packed
from planarfriction.errors import FrictionError
from planarfriction.torch.base import Compiled

_INNER = (2, 1, 1)
"""Axes of twist `[T, 3]`, normal_force `[T]` and parameters `[P]` behind the batch axes."""

_INPUTS = 1 + len(_INNER)
"""The state comes first."""


class _Kind(NamedTuple):
    """What a model is without its tensors (see `Compiled`)."""

    pack: Callable[..., tuple[Packed, ...]]
    axes: int


def roll_out(model: Compiled, dt: float, *inputs: Tensor) -> tuple[Tensor, Tensor]:
    """The last state and wrenches `[..., T, 3]` of `derivatives.rollout`.

    `inputs` are state `[..., 3]`, of several parts `[..., P, 3]`, twist `[..., T, 3]`, normal_force `[..., T]` and
    parameters `[..., P]`, whose batch axes broadcast.
    """
    kept = torch.is_grad_enabled() and any(tensor.requires_grad for tensor in inputs)
    found: Any = _Rollout.apply(_Kind(model.pack, model.axes), dt, kept, *inputs, *model.buffers)
    return found[0], found[1]


class _Rollout(torch.autograd.Function):
    """Last state, wrenches and, if they are `kept` for the way back, the states before each step in float64."""

    @staticmethod
    def forward(kind: _Kind, dt, kept, *tensors):
        (state, twist, load, parameters), model = _numbers(kind, tensors, _INPUTS)
        roll = derivatives.rollout_states if kept else derivatives.rollout
        end, wrenches, *states = roll(model, state, twist, load, dt, parameters=parameters)
        both = (_like(array, tensors[:_INPUTS]) for array in (end, wrenches))
        return *both, torch.from_numpy(states[0]) if kept else torch.empty(0)

    @staticmethod
    def setup_context(ctx, inputs, output):
        ctx.kind, ctx.dt, ctx.kept = inputs[:3]
        ctx.mark_non_differentiable(output[2])
        ctx.save_for_backward(*inputs[3:], output[2])
        ctx.save_for_forward(*inputs[3:])

    @staticmethod
    def backward(ctx, *bars):
        *tensors, states = ctx.saved_tensors
        inputs, buffers = tensors[:_INPUTS], tensors[_INPUTS:]
        given = (*inputs, *bars[:2], states) if ctx.kept else (*inputs, *bars[:2])
        slopes: Any = _Gradient.apply(ctx.kind, ctx.dt, len(given), *given, *buffers)
        return None, None, None, *slopes, *(None for _ in buffers)

    @staticmethod
    def jvp(ctx, *tangents):
        inputs, buffers = ctx.saved_tensors[:_INPUTS], ctx.saved_tensors[_INPUTS:]
        changes = (
            torch.zeros_like(x) if dot is None else dot
            for x, dot in zip(inputs, tangents[3 : 3 + _INPUTS], strict=True)
        )
        found: Any = _Tangent.apply(ctx.kind, ctx.dt, *inputs, *changes, *buffers)
        return *found, None

    @staticmethod
    def vmap(info, in_dims, kind, dt, kept, *tensors):
        size, dims = info.batch_size, in_dims[3:]
        if any(dim is not None for dim in dims[_INPUTS:]):
            return _one_by_one(_Rollout, size, dims, (kind, dt, kept), tensors)
        aligned = _aligned(size, dims[:_INPUTS], tensors[:_INPUTS], (kind.axes, *_INNER))
        end, wrenches, states = _Rollout.apply(kind, dt, kept, *aligned, *tensors[_INPUTS:])  # pyright: ignore
        return (end, wrenches, states), (0, 0, 0 if kept else None)


class First(torch.autograd.Function):
    """A first derivative, itself without derivative."""

    @staticmethod
    def setup_context(ctx, inputs, output):
        pass

    @staticmethod
    def backward(ctx, *bars):
        raise FrictionError("the adjoint gives first derivatives only: use method='eager' to differentiate twice")

    jvp = backward


class _Gradient(First):
    """Cotangents of the inputs from those of last state and wrenches.

    The first `count` tensors are the inputs, both cotangents and, if they were kept, the states before each step.
    """

    @staticmethod
    def forward(kind: _Kind, dt, count, *tensors):
        (state, twist, load, parameters, state_bar, wrenches_bar, *states), model = _numbers(kind, tensors, count)
        gradient = derivatives.rollout_vjp(
            model, state, twist, load, dt, wrenches_bar, state_bar, parameters=parameters, states=(*states, None)[0]
        )
        return tuple(_like(array, (tensor,)) for array, tensor in zip(gradient, tensors[:_INPUTS], strict=True))

    @staticmethod
    def vmap(info, in_dims, kind, dt, count, *tensors):
        size, dims = info.batch_size, in_dims[3:]
        if any(dim is not None for dim in dims[count:]):
            return _one_by_one(_Gradient, size, dims, (kind, dt, count), tensors)
        aligned = _aligned(
            size, dims[:count], tensors[:count], (kind.axes, *_INNER, kind.axes, 2, 1 + kind.axes)[:count]
        )
        gradients: Any = _Gradient.apply(kind, dt, count, *aligned, *tensors[count:])
        shapes = [_logical(tensor, dim) for tensor, dim in zip(tensors[:_INPUTS], dims, strict=False)]
        return tuple(g.reshape(size, *shape) for g, shape in zip(gradients, shapes, strict=True)), (0,) * _INPUTS


class _Tangent(First):
    """Changes of last state and wrenches along those of the inputs, which follow these."""

    @staticmethod
    def forward(kind: _Kind, dt, *tensors):
        (state, twist, load, parameters, *changes), model = _numbers(kind, tensors, 2 * _INPUTS)
        found = derivatives.rollout_jvp(model, state, twist, load, dt, *changes, parameters=parameters)
        return tuple(_like(array, tensors[:_INPUTS]) for array in found[2:])

    @staticmethod
    def vmap(info, in_dims, kind, dt, *tensors):
        size, dims, count = info.batch_size, in_dims[2:], 2 * _INPUTS
        if any(dim is not None for dim in dims[count:]):
            return _one_by_one(_Tangent, size, dims, (kind, dt), tensors)
        aligned = _aligned(size, dims[:count], tensors[:count], (kind.axes, *_INNER) * 2)
        return _Tangent.apply(kind, dt, *aligned, *tensors[count:]), (0, 0)


def _numbers(kind: _Kind, tensors, count: int) -> tuple[list[Any], tuple[Packed, ...]]:
    """The first `count` tensors in NumPy, and the model from its buffers behind them."""
    inputs = [tensor.detach().to(torch.float64).numpy() for tensor in tensors[:count]]
    return inputs, kind.pack(*(buffer.detach().numpy() for buffer in tensors[count:]))


def _one_by_one(function: Any, size: int, dims, fixed: tuple, tensors) -> tuple[tuple[Tensor, ...], tuple[int, ...]]:
    """A `vmap` over different models: a call for each."""
    parts = [
        function.apply(*fixed, *(t if dim is None else t.select(dim, i) for t, dim in zip(tensors, dims, strict=True)))
        for i in range(size)
    ]
    together = tuple(torch.stack(part) for part in zip(*parts, strict=True))
    return together, (0,) * len(together)


def _like(array, tensors) -> Tensor:
    dtype = tensors[0].dtype
    for tensor in tensors[1:]:
        dtype = torch.promote_types(dtype, tensor.dtype)
    return torch.from_numpy(array).to(dtype)


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
