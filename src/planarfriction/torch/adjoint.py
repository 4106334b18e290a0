"""Operations of `planarfriction.tensors.operations` as functions of PyTorch with their first derivatives."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from typing import Any

import torch
from torch import Tensor

from planarfriction.errors import FrictionError


def call(operation: Any, held: Sequence[Tensor], *inputs: Tensor) -> tuple[Tensor, ...]:
    """Return the results of an operation, with derivatives by the inputs; `held` are tensors without."""
    keep = torch.is_grad_enabled() and any(tensor.requires_grad for tensor in inputs)
    found: Any = _Run.apply(operation, keep, *inputs, *held)
    return found[: len(operation.outer)]


class _Run(torch.autograd.Function):
    """The results and, if `keep`, the operation's arrays for the way back in double precision."""

    @staticmethod
    def forward(operation, keep, *tensors):
        count = len(operation.inner)
        results, kept = operation.run(
            _arrays(tensors[count:]), _doubles(tensors[:count]), keep
        )
        return *_like(results, tensors[:count]), *map(torch.from_numpy, kept)

    @staticmethod
    def setup_context(ctx, inputs, output):
        ctx.operation = inputs[0]
        kept = output[len(inputs[0].outer) :]
        ctx.given = len(inputs) - 2
        ctx.kept = len(kept)
        ctx.mark_non_differentiable(*kept)
        ctx.save_for_backward(*inputs[2:], *kept)
        ctx.save_for_forward(*inputs[2:])

    @staticmethod
    def backward(ctx, *bars):
        tensors = ctx.saved_tensors[: ctx.given]
        kept = ctx.saved_tensors[ctx.given :]
        count = len(ctx.operation.inner)
        numbers = *tensors[:count], *bars[: len(ctx.operation.outer)], *kept
        found: Any = _Linear.apply(
            ctx.operation, "pull", len(numbers), *numbers, *tensors[count:]
        )
        return None, None, *found, *(None for _ in tensors[count:])

    @staticmethod
    def jvp(ctx, *tangents):
        tensors = ctx.saved_tensors[: ctx.given]
        count = len(ctx.operation.inner)
        dots = zip(tensors[:count], tangents[2 : 2 + count], strict=True)
        changes = [torch.zeros_like(x) if dot is None else dot for x, dot in dots]
        found: Any = _Linear.apply(
            ctx.operation,
            "push",
            2 * count,
            *tensors[:count],
            *changes,
            *tensors[count:],
        )
        return *found, *(None for _ in range(ctx.kept))

    @staticmethod
    def vmap(info, in_dims, operation, keep, *tensors):
        return _mapped(
            _Run,
            info.batch_size,
            in_dims[2:],
            (operation, keep),
            tensors,
            operation.inner,
        )


class _Linear(torch.autograd.Function):
    """A first derivative, `push` or `pull`, itself without derivative.

    The first `count` tensors are the inputs, and changes of these, or cotangents of the results with kept arrays.
    """

    @staticmethod
    def forward(operation, name: str, count: int, *tensors):
        own = len(operation.inner)
        held = _arrays(tensors[count:])
        numbers = _doubles(tensors[:count])
        if name == "push":
            return _like(
                operation.push(held, numbers[:own], numbers[own:]), tensors[:own]
            )
        bars = numbers[own : own + len(operation.outer)]
        found = operation.pull(held, numbers[:own], bars, numbers[own + len(bars) :])
        return tuple(
            _like([array], [tensor])[0]
            for array, tensor in zip(found, tensors[:own], strict=True)
        )

    @staticmethod
    def setup_context(ctx, inputs, output):
        pass

    @staticmethod
    def backward(ctx, *bars):
        raise FrictionError(
            "the adjoint gives first derivatives only: use method='eager' to differentiate twice"
        )

    jvp = backward

    @staticmethod
    def vmap(info, in_dims, operation, name: str, count: int, *tensors):
        size = info.batch_size
        dims = in_dims[3:]
        own = len(operation.inner)
        inner = (
            *operation.inner,
            *(operation.inner if name == "push" else operation.outer),
        )
        # States before each step.
        inner += (1 + operation.outer[0],) * (count - len(inner))
        found, out = _mapped(
            _Linear, size, dims, (operation, name, count), tensors, inner
        )
        if name == "push":
            return found, out
        shapes = [
            [length for axis, length in enumerate(tensor.shape) if axis != dim]
            for tensor, dim in zip(tensors[:own], dims[:own], strict=True)
        ]
        return tuple(
            bar.reshape(size, *shape) for bar, shape in zip(found, shapes, strict=True)
        ), out


def _doubles(tensors: Sequence[Tensor]) -> list[Any]:
    return [tensor.detach().cpu().double().numpy() for tensor in tensors]


def _arrays(tensors: Sequence[Tensor]) -> list[Any]:
    return [tensor.detach().cpu().numpy() for tensor in tensors]


def _like(arrays: Sequence[Any], tensors: Sequence[Tensor]) -> tuple[Tensor, ...]:
    """Return arrays as tensors of the number type that the given ones have together."""
    dtype = functools.reduce(torch.promote_types, (tensor.dtype for tensor in tensors))
    return tuple(
        torch.from_numpy(array).to(tensors[0].device, dtype) for array in arrays
    )


def _mapped(
    function: Any, size: int, dims, fixed: tuple, tensors, inner: tuple[int, ...]
):
    """Return a function's results for a mapped axis, which becomes the first batch axis; held tensors come last.

    The mapped axis is put in front of every tensor, with axes of length 1 behind it until the batch axes match. If a
    held tensor is mapped, the function is called once for each of its values.
    """
    count = len(inner)
    if any(dim is not None for dim in dims[count:]):
        each = [
            function.apply(
                *fixed,
                *(
                    t if d is None else t.select(d, i)
                    for t, d in zip(tensors, dims, strict=True)
                ),
            )
            for i in range(size)
        ]
        found = tuple(map(torch.stack, zip(*each, strict=True)))
        return found, (0,) * len(found)
    fronted = [
        tensor[None].expand(size, *tensor.shape)
        if dim is None
        else tensor.movedim(dim, 0)
        for tensor, dim in zip(tensors[:count], dims[:count], strict=True)
    ]
    own = [tensor.ndim - axes for tensor, axes in zip(fronted, inner, strict=True)]
    aligned = [
        tensor.reshape(size, *(1,) * (max(own) - axes), *tensor.shape[1:])
        for tensor, axes in zip(fronted, own, strict=True)
    ]
    found = function.apply(*fixed, *aligned, *tensors[count:])
    return found, (0,) * len(found)
