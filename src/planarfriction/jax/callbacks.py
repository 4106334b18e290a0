"""Compiled roll-outs and their derivatives on the arrays that JAX hands to a callback, in NumPy.

Arrays have leading axes that `vmap` has put there, of length 1 where it did not map that array. There is nobody to whom
an error could be raised: NaN comes out where NaN went in, as from the operations of JAX.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import jax
import numpy as np

from planarfriction import derivatives
from planarfriction.formulas import LARGEST


class Kind(NamedTuple):
    """What is fixed when a function is compiled; all else are arrays."""

    structure: Any
    """Of the model as a pytree: its parameters, then what is held."""
    parameters: int
    """How many it has."""
    axes: int
    """Of the state of a contact."""
    leaf: str
    """What the model knows of its patch."""
    strict: bool
    """Whether what the adjoint does not do is an error, and not left to operations of JAX."""

    @property
    def inner(self) -> tuple[int, int, int, int]:
        """Axes of parameters, state, twists and loads behind those of the batch."""
        return 1, self.axes, 2, 1

    def model(self, held: Sequence[Any], parameters: Sequence[Any]) -> Any:
        """The model from its leaves."""
        return jax.tree.unflatten(self.structure, [*parameters, *held])


def forward(kind: Kind, kept: bool, dtypes: Sequence[Any], *arrays: Any) -> tuple[np.ndarray, ...]:
    """Last state, wrenches and, if `kept`, the states before each step."""

    def run(parts, dt, *inputs):
        good, dt, (parameters, state, twist, load) = _usable(kind, kind.inner, dt, inputs)
        roll = derivatives.rollout_states if kept else derivatives.rollout
        return _spoilt(good, *roll(parts, state, twist, load, dt, parameters=parameters))

    return _by_contact(kind, run, dtypes, arrays, 4)


def push(kind: Kind, kept: bool, dtypes: Sequence[Any], *arrays: Any) -> tuple[np.ndarray, ...]:
    """Changes of last state and wrenches; the states before each step, if `kept`, are not needed."""

    def run(parts, dt, *inputs):
        inputs = (*inputs[:4], *inputs[-4:])
        good, dt, usable = _usable(kind, kind.inner * 2, dt, inputs)
        (parameters, state, twist, load), (by, z, turns, pushes) = usable[:4], usable[4:]
        found = derivatives.rollout_jvp(parts, state, twist, load, dt, z, turns, pushes, by, parameters=parameters)
        return _spoilt(good, found.state_dot, found.wrenches_dot)

    return _by_contact(kind, run, dtypes, arrays, 8 + kept)


def pull(kind: Kind, kept: bool, dtypes: Sequence[Any], *arrays: Any) -> tuple[np.ndarray, ...]:
    """Cotangents of parameters, state, twists and loads from those of last state and wrenches."""

    def run(parts, dt, *inputs):
        inner = (*kind.inner, *(1 + kind.axes,) * kept, kind.axes, 2)
        good, dt, usable = _usable(kind, inner, dt, inputs)
        (parameters, state, twist, load), states, (state_bar, bar) = usable[:4], usable[4:-2], usable[-2:]
        found = derivatives.rollout_vjp(
            parts, state, twist, load, dt, bar, state_bar, parameters=parameters, states=(*states, None)[0]
        )
        shared = tuple(i for i, length in enumerate(parameters.shape[:-1]) if length == 1)
        (slopes,) = _spoilt(np.asarray(good.all(axis=shared, keepdims=True)), found.parameters)
        return slopes.reshape(inputs[0].shape), *_spoilt(good, found.state, found.twist, found.normal_force)

    return _by_contact(kind, run, dtypes, arrays, 6 + kept)


def _usable(kind: Kind, inner: Sequence[int], dt, inputs) -> tuple[np.ndarray, Any, list[np.ndarray]]:
    """Which contacts are given numbers, bool `[...]`, and all inputs with harmless ones for the other contacts.

    Parameters get axes of length 1 for the batch axes that only contacts have, and so do changes of them, which are the
    fifth of eight.
    """
    own = inputs[1].ndim - kind.axes - (inputs[0].ndim - 1)
    wide = list(inputs)
    for i in range(0, len(inputs), 4) if len(inputs) == 8 else (0,):
        wide[i] = wide[i].reshape(*wide[i].shape[:-1], *(1,) * own, wide[i].shape[-1])
    fit = [(np.abs(value) <= LARGEST).all(axis=tuple(range(-axes, 0))) for value, axes in zip(wide, inner, strict=True)]
    good = functools.reduce(np.logical_and, fit) & (dt <= LARGEST)
    if good.all():
        return good, dt, wide
    harmless = (0.5, *(0.0 for _ in wide[1:]))
    usable = [
        np.where(own.reshape(own.shape + (1,) * axes), value, number)
        for own, value, axes, number in zip(fit, wide, inner, harmless, strict=True)
    ]
    return good, dt if dt <= LARGEST else 0.0, usable


def _spoilt(good: np.ndarray, *results: np.ndarray) -> list[np.ndarray]:
    """Results, NaN for contacts that are not good."""
    if good.all():
        return list(results)
    return [np.where(good.reshape(good.shape + (1,) * (r.ndim - good.ndim)), r, np.nan) for r in results]


def _by_contact(kind: Kind, run: Callable[..., Any], dtypes: Sequence[Any], arrays, count: int):
    """`run` on the parts of the model, dt and the last `count` arrays; before those come dt and what is held.

    One call for all contacts; only if what is held or dt differ between contacts, one for each.
    """
    axes = arrays[0].ndim
    dt, *held = (np.asarray(value) for value in arrays[:-count])
    wide = [np.asarray(value, float) for value in arrays[-count:]]
    outer = np.broadcast_shapes(*(value.shape[:axes] for value in (dt, *held, *wide)))
    wide = [np.broadcast_to(value, (*outer, *value.shape[axes:])) for value in wide]

    def alone(index, inputs):
        model = kind.model([value[index] for value in held], [1.0] * kind.parameters)
        return run(model.compiled(), float(dt[index]), *inputs)

    if all(value.shape[:axes] == (1,) * axes for value in (dt, *held)):
        results = alone((0,) * axes, wide)
    else:
        dt, *held = (np.broadcast_to(value, (*outer, *value.shape[axes:])) for value in (dt, *held))
        found = [alone(index, [value[index] for value in wide]) for index in np.ndindex(outer)]
        results = [np.stack(part).reshape(*outer, *part[0].shape) for part in zip(*found, strict=True)]
    return tuple(value.astype(dtype) for value, dtype in zip(results, dtypes, strict=True))
