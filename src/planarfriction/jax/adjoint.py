"""Operations of `planarfriction.tensors.operations` as a primitive of JAX.

`run` has the linear `push`, forwards, as its derivative, whose transpose is `pull`, backwards. Derivatives beyond these
are left to operations of JAX if there are any. Operands are those that are held, the inputs, what `run` kept if
anything, and changes or cotangents; all have `outer` leading axes, those that `vmap` has put there.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax.core import ShapedArray
from jax.extend.core import Primitive
from jax.interpreters import ad, batching, mlir

from planarfriction.jax.callbacks import HostRollout, Numbers

_host = Primitive("planarfriction_host")
_host.multiple_results = True


def rollout(model: Any, state, twist, normal_force, dt, *, strict: bool) -> list[jax.Array]:
    """Return the last state and the wrenches `[..., T, 3]`; state, twist and normal_force have the same batch axes."""
    leaves, structure = jax.tree.flatten(model)
    count = len(model.parameters)
    operation = HostRollout(structure, count, len(model.state_shape), model.leaves[1], strict)
    held = jnp.asarray(dt), *map(jnp.asarray, leaves[count:])
    return call(operation, held, state, twist, normal_force, jnp.stack(leaves[:count]))


def call(operation: Any, held: Sequence[jax.Array], *inputs: jax.Array) -> list[jax.Array]:
    """Return the results of an operation, with derivatives by the inputs."""
    return _host.bind(*held, *inputs, operation=operation, name="run", outer=0, kept=False)


def _split(operands, operation, name: str, kept: bool) -> tuple[Any, Any, Any, Any]:
    """Return the operands that are held, the inputs, what was kept, and those in which the primitive is linear."""
    last = len(operands) - _linear(operation, name)
    middle = last - (kept and name != "run")
    first = middle - len(operation.inner)
    return operands[:first], operands[first:middle], operands[middle:last], operands[last:]


def _linear(operation, name: str) -> int:
    return {"run": 0, "push": len(operation.inner), "pull": len(operation.outer)}[name]


# ---------------------------------------------------------------------- values


def _shapes(*operands, operation, name: str, outer: int, kept: bool) -> list[Any]:
    lead = np.broadcast_shapes(*(value.shape[:outer] for value in operands))
    _, inputs, _, _ = _split(operands, operation, name, kept)
    found = [(value.shape, value.dtype) for value in inputs]
    if name != "pull":
        shapes, dtype = operation.shapes(*inputs), inputs[operation.like].dtype
        found = [(shape, dtype) for shape in shapes[: None if kept and name == "run" else len(operation.outer)]]
    return [ShapedArray((*lead, *shape[outer:]), dtype) for shape, dtype in found]


def _on_host(operands, found, *, operation, name: str, outer: int, kept: bool) -> tuple[np.ndarray, ...]:
    """Return the results, as arrays of NumPy of the shapes and types `found`."""
    held, *numbers = _split([np.asarray(array) for array in operands], operation, name, kept)
    numbers = Numbers(*([np.asarray(array, float) for array in each] for each in numbers))
    results = operation.on_host(name, outer, held, numbers, kept)
    return tuple(value.astype(of.dtype) for value, of in zip(results, found, strict=True))


def _now(*operands, **options) -> list[jax.Array]:
    """Return the results for operands that are known, as outside of `jit`: errors are those of this library."""
    return [jnp.asarray(result) for result in _on_host(operands, _shapes(*operands, **options), **options)]


def _later(*operands, **options) -> list[jax.Array]:
    found = _shapes(*operands, **options)
    shapes = [jax.ShapeDtypeStruct(of.shape, of.dtype) for of in found]
    return jax.pure_callback(lambda *arrays: _on_host(arrays, found, **options), shapes, *operands)


def _batch(operands, axes, *, outer: int, **options):
    fronted = [
        value[None] if axis is None else jnp.moveaxis(value, axis, 0)
        for value, axis in zip(operands, axes, strict=True)
    ]
    found = _host.bind(*fronted, outer=outer + 1, **options)
    return found, [0] * len(found)


# ---------------------------------------------------------------------- derivatives


def _jvp(primals, tangents, *, operation, name: str, outer: int, kept: bool):
    options = {"operation": operation, "outer": outer}
    dots, linear = [ad.instantiate_zeros(tangent) for tangent in tangents], _linear(operation, name)
    held = len(primals) - (linear or len(operation.inner))
    if any(type(tangent) is not ad.Zero for tangent in tangents[:held]):
        return _jvp_by_operations(primals, tangents, dots, name=name, kept=kept, **options)
    if linear:
        options |= {"name": name, "kept": kept}
        return _host.bind(*primals, **options), _host.bind(*primals[:held], *dots[held:], **options)
    # in less than double precision the states on the way are not those that the rollout had
    keep = operation.keeps and primals[held].dtype == np.float64
    found = _host.bind(*primals, **options, name="run", kept=keep)
    memory = found[len(operation.outer) :]
    changes = _host.bind(*primals, *memory, *dots[held:], **options, name="push", kept=keep)
    memory = memory[: int(kept)]
    return [*found[: len(operation.outer)], *memory], [*changes, *map(jnp.zeros_like, memory)]


def _jvp_by_operations(primals, tangents, dots, *, operation, name: str, outer: int, kept: bool):
    """Return values and changes by operations of JAX, for derivatives that the adjoint does not have."""
    operation.refuse_if_strict(name, by_dt=type(tangents[0]) is not ad.Zero)
    roll: Callable[..., Any] = operation.by_operations
    for _ in range(outer):
        roll = jax.vmap(roll)

    def function(*operands):
        held, inputs, _, linear = _split(operands, operation, name, False)
        if name == "run":
            return roll(*held, *inputs)
        if name == "push":
            return jax.jvp(lambda *x: roll(*held, *x), tuple(inputs), tuple(linear))[1]
        return jax.vjp(lambda *x: roll(*held, *x), *inputs)[1](tuple(linear))

    def full(operands):
        """Return the operands but the states on the way, with leading axes of full length."""
        held, inputs, _, linear = _split(operands, operation, name, kept)
        plain = *held, *inputs, *linear
        lead = jnp.broadcast_shapes(*(value.shape[:outer] for value in plain))
        return tuple(jnp.broadcast_to(value, (*lead, *value.shape[outer:])) for value in plain)

    results, changes = jax.jvp(function, full(primals), full(dots))
    if name != "run" or not kept:
        return list(results), list(changes)
    memory = _host.bind(*primals, operation=operation, name=name, outer=outer, kept=True)[len(operation.outer) :]
    return [*results, *memory], [*changes, *map(jnp.zeros_like, memory)]


def _transpose(bars, *operands, operation, name: str, **options):
    count, other = _linear(operation, name), {"push": "pull", "pull": "push"}[name]
    known, linear = operands[:-count], operands[-count:]
    slopes = _host.bind(*known, *map(ad.instantiate_zeros, bars), operation=operation, name=other, **options)
    found = [
        _sum_to(slope, each.aval.shape) if ad.is_undefined_primal(each) else None
        for slope, each in zip(slopes, linear, strict=True)
    ]
    return [None] * len(known) + found


def _sum_to(value: jax.Array, shape: tuple[int, ...]) -> jax.Array:
    """Return the sum over the axes along which an operand was broadcast."""
    axes = tuple(i for i, length in enumerate(shape) if length != value.shape[i])
    return value.sum(axes, keepdims=True) if axes else value


_host.def_impl(_now)
_host.def_abstract_eval(_shapes)
mlir.register_lowering(_host, mlir.lower_fun(_later, multiple_results=True))
batching.primitive_batchers[_host] = _batch
ad.primitive_jvps[_host] = _jvp
ad.primitive_transposes[_host] = _transpose
