"""Compiled computations on NumPy arrays with their derivatives, of which front ends make differentiable operations.

An operation has the numbers of inner axes of its inputs, `inner`, and of its results, `outer`, behind batch axes that
broadcast. `run(held, inputs, keep)` returns the results, and with `keep` also arrays that shorten `pull`; `held` are
arrays without derivative. `push(held, inputs, changes)` returns the changes of the results, `pull(held, inputs, bars,
kept)` the cotangents of the inputs for those of the results.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from planarfriction import derivatives
from planarfriction.derivatives.parameters import Packed
from planarfriction.derivatives.scene_function import SceneFunction

Arrays = Sequence[Any]


class RolloutOperation(NamedTuple):
    """Last state and wrenches of a rollout, of state, twist, load and parameters; `held` is `dt` and the buffers."""

    pack: Callable[..., Packed]
    """Function that makes the parts of the model from the buffers."""
    axes: int
    """Axes of the state of a contact."""

    @property
    def inner(self) -> tuple[int, ...]:
        """Number of inner axes of state, twist, load and parameters."""
        return self.axes, 2, 1, 1

    @property
    def outer(self) -> tuple[int, ...]:
        """Number of inner axes of the last state and of the wrenches."""
        return self.axes, 2

    def run(self, held: Arrays, inputs: Arrays, keep: bool) -> tuple[Arrays, Arrays]:
        """Return the last state and the wrenches, and with `keep` the states before each step."""
        state, twist, load, parameters = inputs
        roll = derivatives.rollout_states if keep else derivatives.rollout
        found = roll(self.pack(*held[1:]), state, twist, load, float(held[0]), parameters=parameters)
        return found[:2], found[2:]

    def push(self, held: Arrays, inputs: Arrays, changes: Arrays) -> Arrays:
        """Return the changes of the last state and of the wrenches."""
        (state, twist, load, parameters), model = inputs, self.pack(*held[1:])
        tangent = derivatives.RolloutTangent(*changes)
        return derivatives.rollout_jvp(model, state, twist, load, float(held[0]), tangent, parameters=parameters)[2:]

    def pull(self, held: Arrays, inputs: Arrays, bars: Arrays, kept: Arrays) -> Arrays:
        """Return the cotangents of state, twist, load and parameters."""
        (state, twist, load, parameters), model = inputs, self.pack(*held[1:])
        more = {"parameters": parameters, "states": kept[0] if kept else None}
        return derivatives.rollout_vjp(model, state, twist, load, float(held[0]), bars[1], bars[0], **more)


class SceneOperation(NamedTuple):
    """Motion `[..., M, 6]` and wrenches `[..., M, C, 3]` of a scene, of its numbers `[..., P]`."""

    function: SceneFunction
    memory: dict | None = None
    """Simulations that have been run, for `pull`; None to simulate once more."""
    inner = (1,)
    outer = (2, 3)

    def run(self, held: Arrays, inputs: Arrays, keep: bool) -> tuple[Arrays, Arrays]:
        """Return motion and wrenches."""
        batch, rows = _rows(inputs, self.inner)
        return _shaped(batch, self.function.run(rows[0], self.memory if keep else None)), ()

    def push(self, held: Arrays, inputs: Arrays, changes: Arrays) -> Arrays:
        """Return the changes of motion and wrenches."""
        batch, rows = _rows((*inputs, *changes), self.inner * 2)
        return _shaped(batch, self.function.push(rows[0], rows[1]))

    def pull(self, held: Arrays, inputs: Arrays, bars: Arrays, kept: Arrays) -> Arrays:
        """Return the cotangent of the numbers."""
        batch, rows = _rows((*inputs, *bars), (*self.inner, *self.outer))
        return _shaped(batch, (self.function.pull(rows[0], rows[1], rows[2], self.memory),))


def _rows(arrays: Arrays, inner: Sequence[int]) -> tuple[tuple[int, ...], list[np.ndarray]]:
    """Return the common batch axes of arrays, and the arrays with one axis instead of these."""
    each = [(array, array.ndim - axes) for array, axes in zip(arrays, inner, strict=True)]
    batch = np.broadcast_shapes(*(array.shape[:own] for array, own in each))
    full = [(np.broadcast_to(array, (*batch, *array.shape[own:])), array.shape[own:]) for array, own in each]
    return batch, [np.ascontiguousarray(array).reshape(-1, *shape) for array, shape in full]


def _shaped(batch: tuple[int, ...], arrays: Arrays) -> Arrays:
    return [array.reshape(*batch, *array.shape[1:]) for array in arrays]
