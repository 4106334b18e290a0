"""Compiled computations on NumPy arrays with their derivatives, as front ends make operations of autodiff of them.

Inputs, results and their derivatives have batch axes in front of their inner axes, which broadcast.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple, Protocol

import numpy as np

from planarfriction import derivatives
from planarfriction.derivatives.parameters import Packed
from planarfriction.derivatives.scene_function import SceneFunction

Arrays = Sequence[Any]


class Operation(Protocol):
    """A function of arrays with its Jacobian-vector and vector-Jacobian products."""

    @property
    def inner(self) -> tuple[int, ...]:
        """Number of inner axes of each input."""
        ...

    @property
    def outer(self) -> tuple[int, ...]:
        """Number of inner axes of each result."""
        ...

    def run(self, held: Arrays, inputs: Arrays, keep: bool) -> tuple[Arrays, Arrays]:
        """Return the results, and if `keep` one array that shortens `pull`; `held` are arrays without derivative."""
        ...

    def push(self, held: Arrays, inputs: Arrays, changes: Arrays) -> Arrays:
        """Return the changes of the results for changes of the inputs."""
        ...

    def pull(self, held: Arrays, inputs: Arrays, bars: Arrays, kept: Arrays) -> Arrays:
        """Return the cotangents of the inputs, of their shapes, for those of the results."""
        ...


class RolloutOperation(NamedTuple):
    """Last state and wrenches of a rollout, of state, twist, load and parameters; `held` is `dt` and the buffers."""

    pack: Callable[..., tuple[Packed, ...]]
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
        """Return the last state and the wrenches, and if `keep` the states before each step."""
        state, twist, load, parameters = inputs
        roll = derivatives.rollout_states if keep else derivatives.rollout
        found = roll(self._model(held), state, twist, load, float(held[0]), parameters=parameters)
        return found[:2], found[2:]

    def push(self, held: Arrays, inputs: Arrays, changes: Arrays) -> Arrays:
        """Return the changes of the last state and of the wrenches."""
        state, twist, load, parameters = inputs
        model, dt = self._model(held), float(held[0])
        tangent = derivatives.RolloutTangent(*changes)
        return derivatives.rollout_jvp(model, state, twist, load, dt, tangent, parameters=parameters)[2:]

    def pull(self, held: Arrays, inputs: Arrays, bars: Arrays, kept: Arrays) -> Arrays:
        """Return the cotangents of state, twist, load and parameters."""
        (state, twist, load, parameters), (of_state, of_wrenches) = inputs, bars
        model, dt, states = self._model(held), float(held[0]), kept[0] if kept else None
        return derivatives.rollout_vjp(
            model, state, twist, load, dt, of_wrenches, of_state, parameters=parameters, states=states
        )

    def _model(self, held: Arrays) -> tuple[Packed, ...]:
        return self.pack(*held[1:])


class SceneOperation(NamedTuple):
    """Motion and wrenches of a scene, of its numbers `[..., P]`."""

    function: SceneFunction
    memory: dict | None = None
    """Runs that have been followed, for `pull`; None to simulate once more."""
    inner = (1,)
    outer = (2, 3)

    def run(self, held: Arrays, inputs: Arrays, keep: bool) -> tuple[Arrays, Arrays]:
        """Return motion `[..., M, 6]` and wrenches `[..., M, C, 3]`."""
        batch, rows = _rows(inputs, self.inner)
        return _shaped(batch, self.function.run(rows[0], self.memory if keep else None)), ()

    def push(self, held: Arrays, inputs: Arrays, changes: Arrays) -> Arrays:
        """Return the changes of motion and wrenches."""
        batch, rows = _rows((*inputs, *changes), self.inner * 2)
        return _shaped(batch, self.function.push(rows[0], rows[1]))

    def pull(self, held: Arrays, inputs: Arrays, bars: Arrays, kept: Arrays) -> Arrays:
        """Return the cotangent of the numbers."""
        batch, rows = _rows((*inputs, *bars), (*self.inner, *self.outer))
        return _shaped(batch, (self.function.pull(*rows[:3], self.memory),))


def _rows(arrays: Arrays, inner: Sequence[int]) -> tuple[tuple[int, ...], list[np.ndarray]]:
    """Return the common batch axes of arrays, and the arrays with one axis instead of these."""
    shapes = [array.shape[array.ndim - axes :] for array, axes in zip(arrays, inner, strict=True)]
    batches = [array.shape[: array.ndim - axes] for array, axes in zip(arrays, inner, strict=True)]
    batch = np.broadcast_shapes(*batches)
    full = [np.broadcast_to(array, (*batch, *shape)) for array, shape in zip(arrays, shapes, strict=True)]
    return batch, [np.ascontiguousarray(a).reshape(-1, *shape) for a, shape in zip(full, shapes, strict=True)]


def _shaped(batch: tuple[int, ...], arrays: Arrays) -> Arrays:
    return [array.reshape(*batch, *array.shape[1:]) for array in arrays]
