"""Compiled computations with their derivatives as primitives that JAX differentiates.

`run` has the linear `push`, forwards, as its derivative, whose transpose is `pull`, backwards. Derivatives beyond these
are left to operations of JAX if there are any. Operands are those that are held, the inputs, one that was kept by `run`
if any, and changes or cotangents; all have `outer` leading axes, those that `vmap` has put there.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax.core import ShapedArray
from jax.extend.core import Primitive
from jax.interpreters import ad, batching, mlir

from planarfriction.errors import FrictionError, InvalidValueError
from planarfriction.jax.callbacks import HostRollout


def rollout(model: Any, state, twist, normal_force, dt, *, strict: bool) -> tuple[jax.Array, jax.Array]:
    """Return the last state and the wrenches `[..., T, 3]`; state, twist and normal_force have the same batch axes."""
    leaves, structure = jax.tree.flatten(model)
    count = len(model.parameters)
    operation = HostRollout(structure, count, len(model.state_shape), model.leaves[1], strict)
    held = jnp.asarray(dt), *map(jnp.asarray, leaves[count:])
    end, wrenches = call(operation, held, state, twist, normal_force, jnp.stack(leaves[:count]))
    return end, wrenches


def call(operation: Any, held: Sequence[jax.Array], *inputs: jax.Array) -> list[jax.Array]:
    """Return the results of an operation (see `planarfriction.tensors.operations`), with derivatives by the inputs."""
    return _run.bind(*held, *inputs, operation=operation, outer=0, kept=False)


class _Operands(NamedTuple):
    """Operands of a primitive, by what they are."""

    held: Sequence[Any]
    inputs: Sequence[Any]
    kept: Sequence[Any]
    linear: Sequence[Any]
    """Changes of the inputs, or cotangents of the results."""


def _split(operands, operation, kept: bool, linear: int) -> _Operands:
    last = len(operands) - linear
    middle = last - kept
    first = middle - len(operation.inner)
    return _Operands(operands[:first], operands[first:middle], operands[middle:last], operands[last:])


# ---------------------------------------------------------------------- primitives


def _primitive(name: str, linear: Callable[[Any], int], results: Callable[..., list[Any]]) -> Primitive:
    """Return a primitive that calls the method `name` of its operation on NumPy arrays.

    `linear(operation)` is the number of last operands in which it is linear; `results(operation, operands, kept)` are
    shapes of its results, and the operands whose number types these have.
    """
    primitive = Primitive(f"planarfriction_{name}")
    primitive.multiple_results = True

    def split(operands, operation, kept: bool) -> _Operands:
        return _split(operands, operation, kept and name != "run", linear(operation))

    def shapes(*operands, operation: Any, outer: int, kept: bool) -> list[Any]:
        lead = np.broadcast_shapes(*(value.shape[:outer] for value in operands))
        found = results(operation, split(operands, operation, kept), kept)
        return [ShapedArray((*lead, *shape[outer:]), like.dtype) for shape, like in found]

    def host(operation, outer: int, kept: bool, dtypes, *arrays) -> tuple[np.ndarray, ...]:
        held, inputs, memory, last = split([np.asarray(array) for array in arrays], operation, kept)
        wide = [[np.asarray(array, float) for array in each] for each in (inputs, memory, last)]
        found = operation.host(name, outer, held, *wide, kept)
        return tuple(value.astype(dtype) for value, dtype in zip(found, dtypes, strict=True))

    def apply(*operands, operation: Any, outer: int, kept: bool) -> list[jax.Array]:
        found = shapes(*operands, operation=operation, outer=outer, kept=kept)
        outputs = [jax.ShapeDtypeStruct(value.shape, value.dtype) for value in found]
        dtypes = tuple(value.dtype for value in found)
        return jax.pure_callback(functools.partial(host, operation, outer, kept, dtypes), outputs, *operands)

    def batch(operands, axes, *, operation: Any, outer: int, kept: bool):
        fronted = [
            value[None] if axis is None else jnp.moveaxis(value, axis, 0)
            for value, axis in zip(operands, axes, strict=True)
        ]
        found = primitive.bind(*fronted, operation=operation, outer=outer + 1, kept=kept)
        return found, [0] * len(found)

    primitive.def_impl(apply)
    primitive.def_abstract_eval(shapes)
    batching.primitive_batchers[primitive] = batch
    mlir.register_lowering(primitive, mlir.lower_fun(apply, multiple_results=True))
    return primitive


def _run_results(operation, operands: _Operands, kept: bool):
    shapes = operation.shapes(*operands.inputs)
    return [(shape, operands.inputs[operation.like]) for shape in (shapes if kept else shapes[: len(operation.outer)])]


def _push_results(operation, operands: _Operands, kept: bool):
    return _run_results(operation, operands, False)


def _pull_results(operation, operands: _Operands, kept: bool):
    return [(value.shape, value) for value in operands.inputs]


_run = _primitive("run", lambda operation: 0, _run_results)
_push = _primitive("push", lambda operation: len(operation.inner), _push_results)
_pull = _primitive("pull", lambda operation: len(operation.outer), _pull_results)


# ---------------------------------------------------------------------- derivatives


def _full(outer: int, operands) -> tuple[jax.Array, ...]:
    """Return the operands with leading axes of full length."""
    lead = jnp.broadcast_shapes(*(value.shape[:outer] for value in operands))
    return tuple(jnp.broadcast_to(value, (*lead, *value.shape[outer:])) for value in operands)


def _by_operations(operation, outer: int) -> Callable[..., tuple[jax.Array, jax.Array]]:
    """Return the operation as operations of JAX, under `outer` maps."""
    eager = operation.by_operations
    for _ in range(outer):
        eager = jax.vmap(eager)
    return eager


def _known(tangents) -> bool:
    return all(type(tangent) is ad.Zero for tangent in tangents)


def _run_jvp(primals, tangents, *, operation, outer: int, kept: bool):
    dots = [ad.instantiate_zeros(tangent) for tangent in tangents]
    options = {"operation": operation, "outer": outer}
    count = len(primals) - len(operation.inner)
    if _known(tangents[:count]):
        # in less than double precision the states on the way are not those that the rollout had
        keep = operation.keeps and primals[count].dtype == np.float64
        found = _run.bind(*primals, **options, kept=keep)
        results, memory = found[: len(operation.outer)], found[len(operation.outer) :]
        changes = _push.bind(*primals, *memory, *dots[count:], **options, kept=keep)
        memory = memory[: int(kept)]
    else:
        if operation.strict:
            name, rule = operation.refusal(type(tangents[0]) is not ad.Zero)
            raise InvalidValueError(name, rule, "a derivative of it")
        results, changes = jax.jvp(_by_operations(operation, outer), _full(outer, primals), _full(outer, dots))
        memory = _run.bind(*primals, **options, kept=True)[len(operation.outer) :] if kept else []
    return [*results, *memory], [*changes, *(jnp.zeros_like(value) for value in memory)]


def _linear_jvp(primitive: Primitive, linear: Callable[[Any], int], by_operations: Callable[..., Any]) -> None:
    """Set the derivative of a primitive that is linear in its last operands."""

    def jvp(primals, tangents, *, operation, outer: int, kept: bool):
        dots, count = [ad.instantiate_zeros(tangent) for tangent in tangents], linear(operation)
        if _known(tangents[:-count]):
            options = {"operation": operation, "outer": outer, "kept": kept}
            changed = (*primals[:-count], *dots[-count:])
            return primitive.bind(*primals, **options), primitive.bind(*changed, **options)
        if operation.strict:
            raise FrictionError(operation.first_only)
        end = -count - kept  # without the states on the way
        at, along = (_full(outer, (*values[:end], *values[-count:])) for values in (primals, dots))
        function = functools.partial(by_operations, operation, _by_operations(operation, outer))
        return jax.jvp(lambda *operands: function(_split(operands, operation, False, count)), at, along)

    ad.primitive_jvps[primitive] = jvp


def _push_by_operations(operation, roll: Callable[..., Any], operands: _Operands) -> list[jax.Array]:
    held, inputs, _, changes = operands
    return list(jax.jvp(lambda *x: roll(*held, *x), tuple(inputs), tuple(changes))[1])


def _pull_by_operations(operation, roll: Callable[..., Any], operands: _Operands) -> list[jax.Array]:
    held, inputs, _, bars = operands
    return list(jax.vjp(lambda *x: roll(*held, *x), *inputs)[1](tuple(bars)))


def _transposed(primitive: Primitive, other: Primitive, linear: Callable[[Any], int]) -> None:
    """Set `other` as the transpose of `primitive`, which is linear in its last operands."""

    def transpose(bars, *operands, operation, **options):
        count = linear(operation)
        known, last = operands[:-count], operands[-count:]
        slopes = other.bind(*known, *map(ad.instantiate_zeros, bars), operation=operation, **options)
        found = [
            _sum_to(slope, each.aval.shape) if ad.is_undefined_primal(each) else None
            for slope, each in zip(slopes, last, strict=True)
        ]
        return [None] * len(known) + found

    ad.primitive_transposes[primitive] = transpose


def _sum_to(value: jax.Array, shape: tuple[int, ...]) -> jax.Array:
    """Return the sum over the axes along which an operand was broadcast."""
    axes = tuple(i for i, length in enumerate(shape) if length != value.shape[i])
    return value.sum(axes, keepdims=True) if axes else value


ad.primitive_jvps[_run] = _run_jvp
for _primal, _dual, _count, _eager in (
    (_push, _pull, lambda operation: len(operation.inner), _push_by_operations),
    (_pull, _push, lambda operation: len(operation.outer), _pull_by_operations),
):
    _linear_jvp(_primal, _count, _eager)
    _transposed(_primal, _dual, _count)
