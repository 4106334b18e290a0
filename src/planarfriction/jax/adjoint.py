"""The compiled roll-out with its derivatives (`planarfriction.derivatives`) as primitives that JAX differentiates.

`roll` has the linear `push`, forwards, as its derivative, whose transpose is `pull`, backwards: the discrete adjoint.
What they do not do, higher derivatives and those by dt and by the numbers of the patch, is left to the roll-out of
operations of JAX. All operands have `outer` leading axes, those that `vmap` has put there.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax.core import ShapedArray
from jax.extend.core import Primitive
from jax.interpreters import ad, batching, mlir

from planarfriction.errors import FrictionError, InvalidValueError
from planarfriction.jax import callbacks
from planarfriction.jax.callbacks import Kind

_RESULTS, _INPUTS = 2, 4
"""Last state and wrenches; parameters, state, twists and loads."""


def rollout(model: Any, state, twist, normal_force, dt, *, strict: bool) -> tuple[jax.Array, jax.Array]:
    """Last state and wrenches `[..., T, 3]`; state, twist and normal_force have the same batch axes."""
    leaves, structure = jax.tree.flatten(model)
    count = len(model.parameters)
    kind = Kind(structure, count, model.rest().ndim, model.leaves[1], strict)
    held = (jnp.asarray(dt), *map(jnp.asarray, leaves[count:]))
    inputs = jnp.stack(leaves[:count]), state, twist, normal_force
    end, wrenches, *_ = _roll.bind(*held, *inputs, kind=kind, outer=0, kept=False)
    return end, wrenches


def _eager(kind: Kind, outer: int) -> Callable[..., tuple[jax.Array, jax.Array]]:
    """Last state and wrenches of held numbers and inputs by operations of JAX."""

    def roll(dt, *arrays):
        held, (parameters, *inputs) = arrays[:-_INPUTS], arrays[-_INPUTS:]
        return kind.model(held, tuple(parameters)).roll(*inputs, dt)

    for _ in range(outer):
        roll = jax.vmap(roll)
    return roll


def _full(outer: int, operands) -> list[jax.Array]:
    """Operands whose leading axes have their whole lengths."""
    lead = jnp.broadcast_shapes(*(value.shape[:outer] for value in operands))
    return [jnp.broadcast_to(value, (*lead, *value.shape[outer:])) for value in operands]


def primitive_of(name: str, callback: Callable[..., Any], results: Callable[..., list[Any]]) -> Primitive:
    """A primitive that calls back to NumPy; `results(operands, kept)` have the shapes and types of its results."""
    primitive = Primitive(f"planarfriction_{name}")
    primitive.multiple_results = True

    def shapes(*operands, kind: Any, outer: int, kept: bool) -> list[Any]:
        lead = np.broadcast_shapes(*(value.shape[:outer] for value in operands))
        return [ShapedArray((*lead, *shape[outer:]), dtype) for shape, dtype in results(operands, kept, kind)]

    def call(*operands, kind: Any, outer: int, kept: bool) -> list[jax.Array]:
        found = shapes(*operands, kind=kind, outer=outer, kept=kept)
        outputs = [jax.ShapeDtypeStruct(value.shape, value.dtype) for value in found]
        dtypes = tuple(value.dtype for value in found)
        return jax.pure_callback(functools.partial(callback, kind, kept, dtypes), outputs, *operands)

    def batch(operands, axes, *, kind: Any, outer: int, kept: bool):
        fronted = [
            value[None] if axis is None else jnp.moveaxis(value, axis, 0)
            for value, axis in zip(operands, axes, strict=True)
        ]
        found = primitive.bind(*fronted, kind=kind, outer=outer + 1, kept=kept)
        return found, [0] * len(found)

    primitive.def_impl(call)
    primitive.def_abstract_eval(shapes)
    batching.primitive_batchers[primitive] = batch
    mlir.register_lowering(primitive, mlir.lower_fun(call, multiple_results=True))
    return primitive


def _rolled(operands, kept: bool, kind: Kind):
    _, state, twist, _ = operands[-_INPUTS:]
    steps = (*twist.shape[:-1], *state.shape[state.ndim - kind.axes :])
    found = [(state.shape, twist.dtype), (twist.shape, twist.dtype)]
    return [*found, (steps, twist.dtype)] if kept else found


def _pushed(operands, kept: bool, kind: Kind):
    return [(operands[i].shape, operands[-2].dtype) for i in (-3, -2)]


def _pulled(operands, kept: bool, kind: Kind):
    inputs = operands[-_RESULTS - kept - _INPUTS : -_RESULTS - kept]
    return [(value.shape, value.dtype) for value in inputs]


_roll = primitive_of("roll", callbacks.forward, _rolled)
_push = primitive_of("push", callbacks.push, _pushed)
_pull = primitive_of("pull", callbacks.pull, _pulled)


# ---------------------------------------------------------------------- derivatives


def _known(tangents) -> bool:
    return all(type(tangent) is ad.Zero for tangent in tangents)


def _roll_jvp(primals, tangents, *, kind: Kind, outer: int, kept: bool):
    held, dots = tangents[:-_INPUTS], [ad.instantiate_zeros(tangent) for tangent in tangents[-_INPUTS:]]
    if _known(held):
        # in less than double precision the states on the way are not those that the roll-out had
        keep = primals[-2].dtype == np.float64
        end, wrenches, *states = _roll.bind(*primals, kind=kind, outer=outer, kept=keep)
        changes = _push.bind(*primals, *states, *dots, kind=kind, outer=outer, kept=keep)
        states = states[: int(kept)]
    else:
        if kind.strict:
            _refuse(held, kind)
        dots = [ad.instantiate_zeros(tangent) for tangent in tangents]
        at, along = (tuple(_full(outer, values)) for values in (primals, dots))
        (end, wrenches), changes = jax.jvp(_eager(kind, outer), at, along)
        states = _roll.bind(*primals, kind=kind, outer=outer, kept=True)[2:] if kept else []
    return [end, wrenches, *states], [*changes, *(jnp.zeros_like(value) for value in states)]


def _refuse(held, kind: Kind) -> None:
    """Raise for a derivative that the adjoint does not have."""
    name = kind.leaf if type(held[0]) is ad.Zero else "dt"
    rule = (
        "be held fixed with method='adjoint': differentiate with respect to the parameters, state, twist and "
        "normal_force, or leave method out"
    )
    raise InvalidValueError(name, rule, "a derivative of it")


def _linear_jvp(primitive: Primitive, count: int, by_operations: Callable[..., Any]):
    """The derivative of a function that is linear in its last `count` operands."""

    def jvp(primals, tangents, *, kind: Kind, outer: int, kept: bool):
        dots = [ad.instantiate_zeros(tangent) for tangent in tangents]
        if _known(tangents[:-count]):
            options = {"kind": kind, "outer": outer, "kept": kept}
            changed = (*primals[:-count], *dots[-count:])
            return primitive.bind(*primals, **options), primitive.bind(*changed, **options)
        if kind.strict:
            raise FrictionError(
                "the adjoint gives first derivatives only: leave method out, or use 'eager', to differentiate twice"
            )
        end = -count - kept  # without the states on the way
        at, along = (tuple(_full(outer, (*values[:end], *values[-count:]))) for values in (primals, dots))
        return jax.jvp(by_operations(_eager(kind, outer)), at, along)

    ad.primitive_jvps[primitive] = jvp


def _push_by_operations(roll: Callable[..., Any]) -> Callable[..., Any]:
    def push(*operands):
        primals, dots = operands[:-_INPUTS], operands[-_INPUTS:]
        held, inputs = primals[:-_INPUTS], primals[-_INPUTS:]
        return list(jax.jvp(lambda *x: roll(*held, *x), inputs, dots)[1])

    return push


def _pull_by_operations(roll: Callable[..., Any]) -> Callable[..., Any]:
    def pull(*operands):
        primals, bars = operands[:-_RESULTS], operands[-_RESULTS:]
        held, inputs = primals[:-_INPUTS], primals[-_INPUTS:]
        return list(jax.vjp(lambda *x: roll(*held, *x), *inputs)[1](tuple(bars)))

    return pull


def transposed(primitive: Primitive, other: Primitive, count: int):
    """`other` is the transpose of `primitive`, which is linear in its last `count` operands."""

    def transpose(bars, *operands, **options):
        known, linear = operands[:-count], operands[-count:]
        slopes = other.bind(*known, *map(ad.instantiate_zeros, bars), **options)
        found = [
            _sum_to(slope, each.aval.shape) if ad.is_undefined_primal(each) else None
            for slope, each in zip(slopes, linear, strict=True)
        ]
        return [None] * len(known) + found

    ad.primitive_transposes[primitive] = transpose


def _sum_to(value: jax.Array, shape: tuple[int, ...]) -> jax.Array:
    """Sum over the axes along which an operand was broadcast."""
    axes = tuple(i for i, length in enumerate(shape) if length != value.shape[i])
    return value.sum(axes, keepdims=True) if axes else value


ad.primitive_jvps[_roll] = _roll_jvp
_linear_jvp(_push, _INPUTS, _push_by_operations)
_linear_jvp(_pull, _RESULTS, _pull_by_operations)
transposed(_push, _pull, _INPUTS)
transposed(_pull, _push, _RESULTS)
