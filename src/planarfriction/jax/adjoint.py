"""Operations of `planarfriction.tensors.operations` as a primitive of JAX.

`run` has the linear `push`, forwards, as its derivative, whose transpose is `pull`, backwards. Derivatives beyond these
are left to operations of JAX if there are any. Operands are those that are held, the inputs, what `run` kept if
anything, and changes or cotangents; all have `outer` leading axes, those that `vmap` has put there.

The arrays that JAX hands to a callback have length 1 along leading axes that `vmap` did not map for them. No error can
be raised to a caller there: NaN comes out where NaN went in, as from the operations of JAX.
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
from planarfriction.formulas import LARGEST
from planarfriction.tensors.operations import Arrays, RolloutOperation, SceneOperation

_PARAMETERS = 3
"""Index of the parameters among the inputs of a rollout: state, twist, load, parameters, and any weights of cells."""


class Numbers(NamedTuple):
    """Operands in double precision that are not held."""

    inputs: Arrays
    memory: Arrays
    """Arrays that `run` kept for `pull`, if any."""
    linear: Arrays
    """Changes of the inputs, or cotangents of the results."""


def _called(
    operation: Any, name: str, held: Arrays, numbers: Numbers, kept: bool
) -> Arrays:
    """Return the results of a method of an operation, and what it keeps."""
    inputs, memory, linear = numbers
    if name == "run":
        results, states = operation.run(held, inputs, kept)
        return *results, *states
    return (
        operation.push(held, inputs, linear)
        if name == "push"
        else operation.pull(held, inputs, linear, memory)
    )


class HostRollout(NamedTuple):
    """Last state and wrenches of a rollout; fixed when a function is compiled, as all else are arrays.

    Inputs are state, twist, load, parameters and any weights; `dt` and the model's other leaves are held.
    """

    structure: Any
    """Structure of the model as a pytree: its parameters, then the leaves that are held."""
    parameters: int
    """Number of parameters."""
    axes: int
    """Axes of the state of a contact."""
    leaf: str
    """Name of the leaf with the numbers of the patch."""
    strict: bool
    """True if a derivative that the adjoint does not have is an error, and not left to operations of JAX."""
    cells: bool
    """True for a model of cells whose weights, its last leaf, are an input."""
    weighs: bool = False
    """True if the cotangent of the weights is wanted."""
    like = 1
    keeps = True
    inner = RolloutOperation.inner
    outer = RolloutOperation.outer

    def shapes(self, state: Any, twist: Any, *inputs: Any) -> list[tuple[int, ...]]:
        """Return the shapes of last state, wrenches and the states before each step."""
        return [
            state.shape,
            twist.shape,
            (*twist.shape[:-1], *state.shape[state.ndim - self.axes :]),
        ]

    def by_operations(self, dt: Any, *arrays: Any) -> Any:
        """Return last state and wrenches by operations of JAX."""
        first = len(arrays) - len(self.inner)
        state, twist, load, parameters, *weights = arrays[first:]
        return self._model(tuple(parameters), (*arrays[:first], *weights)).rollout(
            state, twist, load, dt
        )

    def on_host(
        self, name: str, outer: int, held: Arrays, numbers: Numbers, kept: bool
    ) -> Arrays:
        """Return the results of a method of `RolloutOperation`, one call for each contact if what is held differs."""
        lead = np.broadcast_shapes(
            *(value.shape[:outer] for each in (held, *numbers) for value in each)
        )
        wide = [
            [np.broadcast_to(value, (*lead, *value.shape[outer:])) for value in each]
            for each in numbers
        ]
        if all(value.shape[:outer] == (1,) * outer for value in held):
            return self._results(
                name, [value[(0,) * outer] for value in held], Numbers(*wide), kept
            )
        held = [np.broadcast_to(value, (*lead, *value.shape[outer:])) for value in held]
        found = [
            self._results(
                name,
                [v[i] for v in held],
                Numbers(*([v[i] for v in each] for each in wide)),
                kept,
            )
            for i in np.ndindex(lead)
        ]
        return [
            np.stack(part).reshape(*lead, *part[0].shape)
            for part in zip(*found, strict=True)
        ]

    def _results(self, name: str, held: Arrays, numbers: Numbers, kept: bool) -> Arrays:
        """Return the results of a method, NaN for contacts that are not given numbers."""
        operation = RolloutOperation(self._packed, self.axes, self.cells, self.weighs)
        numbers = numbers if name == "pull" else numbers._replace(memory=())
        inner = (
            self.inner,
            (1 + self.axes,) * len(numbers.memory),
            self.inner if name == "push" else self.outer,
        )
        good, usable = _usable(self.axes, numbers, inner)
        dt = float(held[0])
        good = good & (dt <= LARGEST)
        dt = dt if dt <= LARGEST else 0.0
        found = _called(operation, name, [dt, *held[1:]], usable, kept)
        if name != "pull":
            return [_spoilt(good, value) for value in found]
        results = [_spoilt(good, value) for value in found[:_PARAMETERS]]
        for slopes, like in zip(
            found[_PARAMETERS:], numbers.inputs[_PARAMETERS:], strict=True
        ):
            shared = tuple(
                i for i, length in enumerate(slopes.shape[:-1]) if length == 1
            )
            slopes = _spoilt(np.asarray(good.all(axis=shared, keepdims=True)), slopes)
            results.append(slopes.reshape(like.shape))
        return results

    def _packed(self, *leaves: Any) -> Any:
        """Return the model of its leaves but the parameters, weights of cells first, as compiled rollouts take it."""
        first = int(self.cells)
        return self._model(
            [1.0] * self.parameters, (*leaves[first:], *leaves[:first])
        ).compiled()

    def _model(self, parameters: Sequence[Any], held: Sequence[Any]) -> Any:
        return jax.tree.unflatten(self.structure, [*parameters, *held])


def _usable(
    axes: int, numbers: Numbers, inner: Sequence[Sequence[int]]
) -> tuple[np.ndarray, Numbers]:
    """Return True for contacts that are given numbers, `[...]`, and all arrays, with harmless numbers for the others.

    Parameters, weights, and changes of them, get axes of length 1 for the batch axes that only contacts have.
    """
    state = numbers.inputs[0]
    parameters = numbers.inputs[_PARAMETERS]
    found = []
    fit = []
    own = (1,) * (state.ndim - axes - (parameters.ndim - 1))
    for each, of_each in zip(numbers, inner, strict=True):
        found.append([])
        for i, (value, count) in enumerate(zip(each, of_each, strict=len(each) > 0)):
            if i >= _PARAMETERS:
                value = value.reshape(*value.shape[:-1], *own, value.shape[-1])
            fit.append((np.abs(value) <= LARGEST).all(axis=tuple(range(-count, 0))))
            if not fit[-1].all():
                harmless = 0.5 if i >= _PARAMETERS and each is numbers.inputs else 0.0
                value = np.where(
                    fit[-1].reshape(fit[-1].shape + (1,) * count), value, harmless
                )
            found[-1].append(value)
    return functools.reduce(np.logical_and, fit), Numbers(*found)


def _spoilt(good: np.ndarray, result: np.ndarray) -> np.ndarray:
    """Return the result, NaN for contacts that are not good."""
    if good.all():
        return result
    return np.where(
        good.reshape(good.shape + (1,) * (result.ndim - good.ndim)), result, np.nan
    )


_host = Primitive("planarfriction_host")
_host.multiple_results = True


def rollout(
    model: Any, state, twist, normal_force, dt, *, strict: bool
) -> list[jax.Array]:
    """Return the last state and the wrenches `[..., T, 3]`; state, twist and normal_force have the same batch axes."""
    leaves, structure = jax.tree.flatten(model)
    count = len(model.parameters)
    # Stiffnesses of a pad that are its own hold whatever the weights are, which has no adjoint.
    cells = "weights" in model.leaves and model.of_law
    operation = HostRollout(
        structure, count, len(model.state_shape), model.leaves[1], strict, cells
    )
    held = (jnp.asarray(dt), *map(jnp.asarray, leaves[count:]))
    last = -1 if cells else len(leaves)
    return call(
        operation,
        held[:last],
        state,
        twist,
        normal_force,
        jnp.stack(leaves[:count]),
        *held[last:],
    )


def call(
    operation: Any, held: Sequence[jax.Array], *inputs: jax.Array
) -> list[jax.Array]:
    """Return the results of an operation, with derivatives by the inputs."""
    return _host.bind(
        *held, *inputs, operation=operation, name="run", outer=0, kept=False
    )


def _split(operands, operation, name: str, kept: bool) -> tuple[Any, Any, Any, Any]:
    """Return the operands that are held, the inputs, what was kept, and those in which the primitive is linear."""
    last = len(operands) - _linear(operation, name)
    middle = last - (kept and name != "run")
    first = middle - len(operation.inner)
    return (
        operands[:first],
        operands[first:middle],
        operands[middle:last],
        operands[last:],
    )


def _linear(operation, name: str) -> int:
    return {"run": 0, "push": len(operation.inner), "pull": len(operation.outer)}[name]


# ---------------------------------------------------------------------- values


def _shapes(*operands, operation, name: str, outer: int, kept: bool) -> list[Any]:
    lead = np.broadcast_shapes(*(value.shape[:outer] for value in operands))
    _, inputs, _, _ = _split(operands, operation, name, kept)
    found = [(value.shape, value.dtype) for value in inputs]
    if name != "pull":
        shapes = operation.shapes(*inputs)
        dtype = inputs[operation.like].dtype
        found = [
            (shape, dtype)
            for shape in shapes[
                : None if kept and name == "run" else len(operation.outer)
            ]
        ]
    return [ShapedArray((*lead, *shape[outer:]), dtype) for shape, dtype in found]


def _on_host(
    operands, found, *, operation, name: str, outer: int, kept: bool
) -> tuple[np.ndarray, ...]:
    """Return the results, as arrays of NumPy of the shapes and types `found`."""
    held, *numbers = _split(
        [np.asarray(array) for array in operands], operation, name, kept
    )
    numbers = Numbers(
        *([np.asarray(array, float) for array in each] for each in numbers)
    )
    if isinstance(operation, HostRollout):
        results = operation.on_host(name, outer, held, numbers, kept)
    else:
        results = _called(operation, name, held, numbers, kept)
    return tuple(
        value.astype(of.dtype) for value, of in zip(results, found, strict=True)
    )


def _now(*operands, **options) -> list[jax.Array]:
    """Return the results for operands that are known, as outside of `jit`: errors are those of this library."""
    return [
        jnp.asarray(result)
        for result in _on_host(operands, _shapes(*operands, **options), **options)
    ]


def _later(*operands, **options) -> list[jax.Array]:
    found = _shapes(*operands, **options)
    shapes = [jax.ShapeDtypeStruct(of.shape, of.dtype) for of in found]
    return jax.pure_callback(
        lambda *arrays: _on_host(arrays, found, **options), shapes, *operands
    )


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
    dots = [ad.instantiate_zeros(tangent) for tangent in tangents]
    linear = _linear(operation, name)
    held = len(primals) - (linear or len(operation.inner))
    if any(type(tangent) is not ad.Zero for tangent in tangents[:held]):
        return _jvp_by_operations(
            primals, tangents, dots, name=name, kept=kept, **options
        )
    if linear:
        options |= {"name": name, "kept": kept}
        return _host.bind(*primals, **options), _host.bind(
            *primals[:held], *dots[held:], **options
        )
    # in less than double precision the states on the way are not those that the rollout had
    keep = operation.keeps and primals[held].dtype == np.float64
    found = _host.bind(*primals, **options, name="run", kept=keep)
    memory = found[len(operation.outer) :]
    changes = _host.bind(
        *primals, *memory, *dots[held:], **options, name="push", kept=keep
    )
    memory = memory[: int(kept)]
    return [*found[: len(operation.outer)], *memory], [
        *changes,
        *map(jnp.zeros_like, memory),
    ]


def _jvp_by_operations(
    primals, tangents, dots, *, operation, name: str, outer: int, kept: bool
):
    """Return values and changes by operations of JAX, for derivatives that the adjoint does not have."""
    if isinstance(operation, SceneOperation):
        raise FrictionError("the motion of a scene has first derivatives only")
    if operation.strict and name == "run":
        rule = (
            "be held fixed with method='adjoint': differentiate with respect to the parameters, weights, state, "
            "twist and normal_force, or leave method out"
        )
        by_dt = type(tangents[0]) is not ad.Zero
        raise InvalidValueError(
            "dt" if by_dt else operation.leaf, rule, "a derivative of it"
        )
    if operation.strict:
        raise FrictionError(
            "the adjoint gives first derivatives only: leave method out, or use 'eager', to differentiate twice"
        )
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
        return tuple(
            jnp.broadcast_to(value, (*lead, *value.shape[outer:])) for value in plain
        )

    results, changes = jax.jvp(function, full(primals), full(dots))
    if name != "run" or not kept:
        return list(results), list(changes)
    memory = _host.bind(
        *primals, operation=operation, name=name, outer=outer, kept=True
    )[len(operation.outer) :]
    return [*results, *memory], [*changes, *map(jnp.zeros_like, memory)]


def _transpose(bars, *operands, operation, name: str, **options):
    count = _linear(operation, name)
    other = {"push": "pull", "pull": "push"}[name]
    known = operands[:-count]
    linear = operands[-count:]
    if other == "pull" and isinstance(operation, HostRollout):
        operation = operation._replace(
            weighs=operation.cells and ad.is_undefined_primal(linear[-1])
        )
    slopes = _host.bind(
        *known,
        *map(ad.instantiate_zeros, bars),
        operation=operation,
        name=other,
        **options,
    )
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
