"""Operations on the NumPy arrays that JAX hands to a callback.

Arrays have `outer` leading axes that `vmap` has put there, of length 1 where it did not map that array. No error can be
raised to a caller: NaN comes out where NaN went in, as from the operations of JAX.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import jax
import numpy as np

from planarfriction.derivatives.scene_function import SceneFunction
from planarfriction.formulas import LARGEST
from planarfriction.tensors.operations import Arrays, RolloutOperation, SceneOperation

_PARAMETERS = 3
"""Index of the parameters among the inputs of a rollout: state, twist, load, parameters."""


class HostScene(NamedTuple):
    """Motion and wrenches of a scene, of its numbers; fixed when a function is compiled."""

    function: SceneFunction
    inner, outer = SceneOperation.inner, SceneOperation.outer
    like, keeps, strict = 0, False, True
    first_only = "the motion of a scene has first derivatives only"

    def shapes(self, numbers: Any) -> list[tuple[int, ...]]:
        """Return the shapes of motion and wrenches."""
        return [(*numbers.shape[:-1], *shape) for shape in self.function.results]

    def host(self, name: str, outer: int, held: Arrays, inputs: Arrays, memory: Arrays, last: Arrays, kept: bool):
        """Return the results of a method of `SceneOperation`."""
        operation = SceneOperation(self.function)
        if name == "run":
            return operation.run(held, inputs, kept)[0]
        return operation.push(held, inputs, last) if name == "push" else operation.pull(held, inputs, last, memory)


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
    first_only = "the adjoint gives first derivatives only: leave method out, or use 'eager', to differentiate twice"

    @property
    def inner(self) -> tuple[int, ...]:
        """Number of inner axes of each input."""
        return self.axes, 2, 1, 1

    @property
    def outer(self) -> tuple[int, ...]:
        """Number of inner axes of last state and wrenches."""
        return self.axes, 2

    def shapes(self, state: Any, twist: Any, load: Any, parameters: Any) -> list[tuple[int, ...]]:
        """Return the shapes of last state, wrenches and the states before each step."""
        return [state.shape, twist.shape, (*twist.shape[:-1], *state.shape[state.ndim - self.axes :])]

    def refusal(self, by_dt: bool) -> tuple[str, str]:
        """Return the name of an operand without derivative, and the rule for it."""
        rule = (
            "be held fixed with method='adjoint': differentiate with respect to the parameters, state, twist and "
            "normal_force, or leave method out"
        )
        return "dt" if by_dt else self.leaf, rule

    def by_operations(self, dt: Any, *arrays: Any) -> Any:
        """Return last state and wrenches by operations of JAX."""
        *held, state, twist, load, parameters = arrays
        return self._model(held, tuple(parameters)).rollout(state, twist, load, dt)

    def _model(self, held: Sequence[Any], parameters: Sequence[Any]) -> Any:
        return jax.tree.unflatten(self.structure, [*parameters, *held])

    def host(self, name: str, outer: int, held: Arrays, inputs: Arrays, memory: Arrays, last: Arrays, kept: bool):
        """Return the results of a method of `RolloutOperation`, NaN for contacts without usable inputs."""

        def run(operation: RolloutOperation, held: Arrays, inputs: Arrays) -> Sequence[np.ndarray]:
            good, held, usable = _usable(operation, held, inputs)
            results, states = operation.run(held, usable, kept)
            return _spoilt(good, *results, *states)

        def push(operation: RolloutOperation, held: Arrays, arrays: Arrays) -> Sequence[np.ndarray]:
            good, held, usable = _usable(operation, held, arrays, operation.inner)
            return _spoilt(good, *operation.push(held, usable[:4], usable[4:]))

        def pull(operation: RolloutOperation, held: Arrays, arrays: Arrays) -> Sequence[np.ndarray]:
            more = *operation.outer, *(1 + operation.axes for _ in memory)
            good, held, usable = _usable(operation, held, arrays, more)
            *found, slopes = operation.pull(held, usable[:4], usable[4:6], usable[6:])
            lengths = usable[_PARAMETERS].shape[:-1]
            shared = tuple(i for i, length in enumerate(lengths) if length == 1)
            (slopes,) = _spoilt(np.asarray(good.all(axis=shared, keepdims=True)), slopes)
            return *_spoilt(good, *found), slopes.reshape(arrays[_PARAMETERS].shape)

        if name == "run":
            return self._by_contact(run, outer, held, inputs)
        if name == "push":  # the states before each step are not needed
            return self._by_contact(push, outer, held, [*inputs, *last])
        return self._by_contact(pull, outer, held, [*inputs, *last, *memory])

    def _by_contact(self, function: Callable[..., Any], outer: int, held: Arrays, arrays: Arrays) -> Arrays:
        """Return `function(operation, held, arrays)` of all contacts; one call each if what is held differs."""
        lead = np.broadcast_shapes(*(value.shape[:outer] for value in (*held, *arrays)))
        wide = [np.broadcast_to(value, (*lead, *value.shape[outer:])) for value in arrays]

        def alone(index, arrays):
            pack = lambda *leaves: self._model(leaves, [1.0] * self.parameters).compiled()  # noqa: E731
            return function(RolloutOperation(pack, self.axes), [value[index] for value in held], arrays)

        if all(value.shape[:outer] == (1,) * outer for value in held):
            return alone((0,) * outer, wide)
        held = [np.broadcast_to(value, (*lead, *value.shape[outer:])) for value in held]
        found = [alone(index, [value[index] for value in wide]) for index in np.ndindex(lead)]
        return [np.stack(part).reshape(*lead, *part[0].shape) for part in zip(*found, strict=True)]


def _usable(operation: RolloutOperation, held: Arrays, arrays: Arrays, more: tuple[int, ...] = ()):
    """Return True for contacts that are given numbers, `[...]`, what is held, and all arrays with harmless numbers.

    `more` are the inner axes of the arrays behind the inputs. Parameters, and changes of them, get axes of length 1 for
    the batch axes that only contacts have.
    """
    inner, wide = (*operation.inner, *more), list(arrays)
    own = wide[0].ndim - operation.axes - (wide[_PARAMETERS].ndim - 1)
    for i in (_PARAMETERS, _PARAMETERS + 4) if more == operation.inner else (_PARAMETERS,):
        wide[i] = wide[i].reshape(*wide[i].shape[:-1], *(1,) * own, wide[i].shape[-1])
    fit = [(np.abs(value) <= LARGEST).all(axis=tuple(range(-axes, 0))) for value, axes in zip(wide, inner, strict=True)]
    good = functools.reduce(np.logical_and, fit) & (held[0] <= LARGEST)
    if good.all():
        return good, held, wide
    harmless = [0.5 if i == _PARAMETERS else 0.0 for i in range(len(wide))]
    usable = [
        np.where(own.reshape(own.shape + (1,) * axes), value, number)
        for own, value, axes, number in zip(fit, wide, inner, harmless, strict=True)
    ]
    return good, [held[0] if held[0] <= LARGEST else 0.0, *held[1:]], usable


def _spoilt(good: np.ndarray, *results: np.ndarray) -> list[np.ndarray]:
    """Return the results, NaN for contacts that are not good."""
    if good.all():
        return list(results)
    return [np.where(good.reshape(good.shape + (1,) * (r.ndim - good.ndim)), r, np.nan) for r in results]
