"""Operations on the NumPy arrays that JAX hands to a callback.

Arrays have `outer` leading axes that `vmap` has put there, of length 1 where it did not map that array. No error can be
raised to a caller: NaN comes out where NaN went in, as from the operations of JAX.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from typing import Any, NamedTuple

import jax
import numpy as np

from planarfriction.derivatives.scene_function import SceneFunction
from planarfriction.errors import FrictionError, InvalidValueError
from planarfriction.formulas import LARGEST
from planarfriction.tensors.operations import Arrays, RolloutOperation, SceneOperation

_PARAMETERS = 3
"""Index of the parameters among the inputs of a rollout: state, twist, load, parameters."""


class Numbers(NamedTuple):
    """Operands in double precision that are not held."""

    inputs: Arrays
    memory: Arrays
    """Arrays that `run` kept for `pull`, if any."""
    linear: Arrays
    """Changes of the inputs, or cotangents of the results."""


def _called(operation: Any, name: str, held: Arrays, numbers: Numbers, kept: bool) -> Arrays:
    """Return the results of a method of an operation, and what it keeps."""
    inputs, memory, linear = numbers
    if name == "run":
        results, states = operation.run(held, inputs, kept)
        return *results, *states
    return operation.push(held, inputs, linear) if name == "push" else operation.pull(held, inputs, linear, memory)


class HostScene(NamedTuple):
    """Motion and wrenches of a scene, of its numbers; fixed when a function is compiled."""

    function: SceneFunction
    inner, outer = SceneOperation.inner, SceneOperation.outer
    like, keeps = 0, False

    def shapes(self, numbers: Any) -> list[tuple[int, ...]]:
        """Return the shapes of motion and wrenches."""
        return [(*numbers.shape[:-1], *shape) for shape in self.function.results]

    def refuse_if_strict(self, name: str, by_dt: bool) -> None:
        """Raise FrictionError for a second derivative."""
        raise FrictionError("the motion of a scene has first derivatives only")

    def on_host(self, name: str, outer: int, held: Arrays, numbers: Numbers, kept: bool) -> Arrays:
        """Return the results of a method of `SceneOperation`."""
        return _called(SceneOperation(self.function), name, held, numbers, kept)


class HostRollout(NamedTuple):
    """Last state and wrenches of a rollout; fixed when a function is compiled, as all else are arrays.

    Inputs are state, twist, load and parameters; `dt` and the model's other leaves are held.
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
    like, keeps = 1, True
    inner, outer = RolloutOperation.inner, RolloutOperation.outer

    def shapes(self, state: Any, twist: Any, load: Any, parameters: Any) -> list[tuple[int, ...]]:
        """Return the shapes of last state, wrenches and the states before each step."""
        return [state.shape, twist.shape, (*twist.shape[:-1], *state.shape[state.ndim - self.axes :])]

    def refuse_if_strict(self, name: str, by_dt: bool) -> None:
        """Raise FrictionError, if strict, for a derivative that the adjoint does not have."""
        if self.strict and name == "run":
            rule = (
                "be held fixed with method='adjoint': differentiate with respect to the parameters, state, twist and "
                "normal_force, or leave method out"
            )
            raise InvalidValueError("dt" if by_dt else self.leaf, rule, "a derivative of it")
        if self.strict:
            raise FrictionError(
                "the adjoint gives first derivatives only: leave method out, or use 'eager', to differentiate twice"
            )

    def by_operations(self, dt: Any, *arrays: Any) -> Any:
        """Return last state and wrenches by operations of JAX."""
        *held, state, twist, load, parameters = arrays
        return self._model(tuple(parameters), held).rollout(state, twist, load, dt)

    def on_host(self, name: str, outer: int, held: Arrays, numbers: Numbers, kept: bool) -> Arrays:
        """Return the results of a method of `RolloutOperation`, one call for each contact if what is held differs."""
        lead = np.broadcast_shapes(*(value.shape[:outer] for each in (held, *numbers) for value in each))
        wide = [[np.broadcast_to(value, (*lead, *value.shape[outer:])) for value in each] for each in numbers]
        if all(value.shape[:outer] == (1,) * outer for value in held):
            return self._results(name, [value[(0,) * outer] for value in held], Numbers(*wide), kept)
        held = [np.broadcast_to(value, (*lead, *value.shape[outer:])) for value in held]
        found = [
            self._results(name, [v[i] for v in held], Numbers(*([v[i] for v in each] for each in wide)), kept)
            for i in np.ndindex(lead)
        ]
        return [np.stack(part).reshape(*lead, *part[0].shape) for part in zip(*found, strict=True)]

    def _results(self, name: str, held: Arrays, numbers: Numbers, kept: bool) -> Arrays:
        """Return the results of a method, NaN for contacts that are not given numbers."""
        operation = RolloutOperation(lambda *leaves: self._model([1.0] * self.parameters, leaves).compiled(), self.axes)
        numbers = numbers if name == "pull" else numbers._replace(memory=())
        inner = self.inner, (1 + self.axes,) * len(numbers.memory), self.inner if name == "push" else self.outer
        good, usable = _usable(self.axes, numbers, inner)
        good, dt = good & (held[0] <= LARGEST), held[0] if held[0] <= LARGEST else 0.0
        found = _called(operation, name, [dt, *held[1:]], usable, kept)
        if name != "pull":
            return [_spoilt(good, value) for value in found]
        *found, slopes = found
        shared = tuple(i for i, length in enumerate(slopes.shape[:-1]) if length == 1)
        slopes = _spoilt(np.asarray(good.all(axis=shared, keepdims=True)), slopes)
        return [*(_spoilt(good, value) for value in found), slopes.reshape(numbers.inputs[_PARAMETERS].shape)]

    def _model(self, parameters: Sequence[Any], held: Sequence[Any]) -> Any:
        return jax.tree.unflatten(self.structure, [*parameters, *held])


def _usable(axes: int, numbers: Numbers, inner: Sequence[Sequence[int]]) -> tuple[np.ndarray, Numbers]:
    """Return True for contacts that are given numbers, `[...]`, and all arrays, with harmless numbers for the others.

    Parameters, and changes of them, get axes of length 1 for the batch axes that only contacts have.
    """
    (state, *_, parameters), found, fit = numbers.inputs, [], []
    own = (1,) * (state.ndim - axes - (parameters.ndim - 1))
    for each, of_each in zip(numbers, inner, strict=True):
        found.append([])
        for i, (value, count) in enumerate(zip(each, of_each, strict=len(each) > 0)):
            if i == _PARAMETERS:
                value = value.reshape(*value.shape[:-1], *own, value.shape[-1])
            fit.append((np.abs(value) <= LARGEST).all(axis=tuple(range(-count, 0))))
            if not fit[-1].all():
                harmless = 0.5 if i == _PARAMETERS and each is numbers.inputs else 0.0
                value = np.where(fit[-1].reshape(fit[-1].shape + (1,) * count), value, harmless)
            found[-1].append(value)
    return functools.reduce(np.logical_and, fit), Numbers(*found)


def _spoilt(good: np.ndarray, result: np.ndarray) -> np.ndarray:
    """Return the result, NaN for contacts that are not good."""
    if good.all():
        return result
    return np.where(good.reshape(good.shape + (1,) * (result.ndim - good.ndim)), result, np.nan)
