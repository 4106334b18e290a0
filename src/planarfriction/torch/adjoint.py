"""Compiled computations with their derivatives, backwards and forwards, as functions of PyTorch; first derivatives."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from typing import Any

import torch
from torch import Tensor

from planarfriction.errors import FrictionError
from planarfriction.tensors.operations import Operation, RolloutOperation
from planarfriction.torch.base import Compiled


def rollout(
    model: Compiled, axes: int, state: Tensor, twist: Tensor, load: Tensor, parameters: Tensor, dt: Tensor
) -> tuple[Tensor, ...]:
    """Return the last state and the wrenches `[..., T, 3]` of a model whose state has `axes`, by compiled loops.

    Shapes are `[..., *state_shape]`, `[..., T, 3]`, `[..., T]` and `[..., P]`, whose batch axes broadcast; tensors are
    on the processor.
    """
    return call(RolloutOperation(model.pack, axes), (dt, *model.buffers), state, twist, load, parameters)


def call(operation: Operation, held: Sequence[Tensor], *inputs: Tensor) -> tuple[Tensor, ...]:
    """Return the results of an operation, with derivatives by the inputs; `held` are tensors without."""
    keep = torch.is_grad_enabled() and any(tensor.requires_grad for tensor in inputs)
    found: Any = _Run.apply(operation, keep, *inputs, *held)
    return found[: len(operation.outer)]


class _Run(torch.autograd.Function):
    """The results and, if `keep`, the operation's array for the way back in double precision."""

    @staticmethod
    def forward(operation: Operation, keep, *tensors):
        count = len(operation.inner)
        results, kept = operation.run(_plain(tensors[count:]), _doubles(tensors[:count]), keep)
        return *_like(results, tensors[:count]), *(torch.from_numpy(array) for array in kept)

    @staticmethod
    def setup_context(ctx, inputs, output):
        ctx.operation = inputs[0]
        kept = output[len(ctx.operation.outer) :]
        ctx.mark_non_differentiable(*kept)
        ctx.save_for_backward(*inputs[2:], *kept)
        ctx.save_for_forward(*inputs[2:])
        ctx.count, ctx.kept = len(inputs) - 2, len(kept)

    @staticmethod
    def backward(ctx, *bars):
        count, tensors, kept = len(ctx.operation.inner), ctx.saved_tensors[: ctx.count], ctx.saved_tensors[ctx.count :]
        given = *tensors[:count], *bars[: len(ctx.operation.outer)], *kept
        found: Any = _Pull.apply(ctx.operation, len(given), *given, *tensors[count:])
        return None, None, *found, *(None for _ in tensors[count:])

    @staticmethod
    def jvp(ctx, *tangents):
        count, tensors = len(ctx.operation.inner), ctx.saved_tensors
        inputs, dots = tensors[:count], tangents[2 : 2 + count]
        changes = [torch.zeros_like(x) if dot is None else dot for x, dot in zip(inputs, dots, strict=True)]
        found: Any = _Push.apply(ctx.operation, 2 * count, *inputs, *changes, *tensors[count : ctx.count])
        return *found, *(None for _ in range(ctx.kept))

    @staticmethod
    def vmap(info, in_dims, operation: Operation, keep, *tensors):
        return _mapped(_Run, info, in_dims[2:], (operation, keep), tensors, operation.inner)


class _First(torch.autograd.Function):
    """A first derivative, itself without derivative."""

    @staticmethod
    def setup_context(ctx, inputs, output):
        pass

    @staticmethod
    def backward(ctx, *bars):
        raise FrictionError("the adjoint gives first derivatives only: use method='eager' to differentiate twice")

    jvp = backward


class _Pull(_First):
    """Cotangents of the inputs; the first `count` tensors are inputs, cotangents of the results and what was kept."""

    @staticmethod
    def forward(operation: Operation, count: int, *tensors):
        own, several = len(operation.inner), len(operation.inner) + len(operation.outer)
        numbers = _doubles(tensors[:count])
        found = operation.pull(_plain(tensors[count:]), numbers[:own], numbers[own:several], numbers[several:])
        return tuple(_like([array], [tensor])[0] for array, tensor in zip(found, tensors[:own], strict=True))

    @staticmethod
    def vmap(info, in_dims, operation: Operation, count: int, *tensors):
        own, dims = len(operation.inner), in_dims[2:]
        inner = *operation.inner, *operation.outer
        inner += tuple(1 + operation.outer[0] for _ in range(count - len(inner)))  # states before each step
        found, out = _mapped(_Pull, info, dims, (operation, count), tensors, inner)
        shapes = [
            [length for axis, length in enumerate(tensor.shape) if axis != dim]
            for tensor, dim in zip(tensors[:own], dims[:own], strict=True)
        ]
        return tuple(g.reshape(info.batch_size, *shape) for g, shape in zip(found, shapes, strict=True)), out


class _Push(_First):
    """Changes of the results; the first `count` tensors are the inputs and their changes."""

    @staticmethod
    def forward(operation: Operation, count: int, *tensors):
        own, numbers = len(operation.inner), _doubles(tensors[:count])
        return _like(operation.push(_plain(tensors[count:]), numbers[:own], numbers[own:]), tensors[:own])

    @staticmethod
    def vmap(info, in_dims, operation: Operation, count: int, *tensors):
        return _mapped(_Push, info, in_dims[2:], (operation, count), tensors, operation.inner * 2)


def _doubles(tensors: Sequence[Tensor]) -> list[Any]:
    return [tensor.detach().to("cpu", torch.float64).numpy() for tensor in tensors]


def _plain(tensors: Sequence[Tensor]) -> list[Any]:
    return [tensor.detach().cpu().numpy() for tensor in tensors]


def _like(arrays: Sequence[Any], tensors: Sequence[Tensor]) -> tuple[Tensor, ...]:
    """Return arrays as tensors of the number type that the given ones have together."""
    dtype = functools.reduce(torch.promote_types, (tensor.dtype for tensor in tensors))
    return tuple(torch.from_numpy(array).to(tensors[0].device, dtype) for array in arrays)


def _mapped(function: Any, info, dims, fixed: tuple, tensors, inner: tuple[int, ...]):
    """Return a function's results for a mapped axis, which becomes the first batch axis; held tensors come last.

    The mapped axis is put in front of every tensor, with axes of length 1 behind it until the batch axes match. If a
    held tensor is mapped, the function is called once for each of its values.
    """
    size, count = info.batch_size, len(inner)
    if any(dim is not None for dim in dims[count:]):
        each = [
            function.apply(*fixed, *(t if d is None else t.select(d, i) for t, d in zip(tensors, dims, strict=True)))
            for i in range(size)
        ]
        found = tuple(torch.stack(part) for part in zip(*each, strict=True))
        return found, (0,) * len(found)
    fronted = [
        tensor[None].expand(size, *tensor.shape) if dim is None else tensor.movedim(dim, 0)
        for tensor, dim in zip(tensors[:count], dims[:count], strict=True)
    ]
    rank = max(tensor.ndim - axes for tensor, axes in zip(fronted, inner, strict=True))
    aligned = [
        tensor.reshape(size, *(1,) * (rank - (tensor.ndim - axes)), *tensor.shape[1:])
        for tensor, axes in zip(fronted, inner, strict=True)
    ]
    found = function.apply(*fixed, *aligned, *tensors[count:])
    return found, (0,) * len(found)
