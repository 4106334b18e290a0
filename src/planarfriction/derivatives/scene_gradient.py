"""Reverse derivatives of a simulated scene: the gradient of one cost of its motion, whatever the number of knots."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from planarfriction import validation
from planarfriction.derivatives.path import MotionPath, SceneDerivatives, pieces_of
from planarfriction.derivatives.scene_inputs import SceneInputs
from planarfriction.errors import InvalidValueError
from planarfriction.kernels import adjoint, tangent
from planarfriction.kernels import path as paths
from planarfriction.kernels.body import System
from planarfriction.kernels.path import Path
from planarfriction.kernels.sdirk import workspace_for
from planarfriction.kernels.tangent import Drives
from planarfriction.scenes.options import SolverOptions
from planarfriction.scenes.scene import Scene

Cotangent = Callable[[np.ndarray, np.ndarray], np.ndarray]
"""Function of times `[M]` and recorded values `[M, ...]` that returns the derivatives of a cost by these values."""

_MOST_NODES = 4096
"""Largest number of ends of steps in a part of the path, which stays in memory."""


@dataclass(frozen=True, eq=False)
class SceneGradient(SceneDerivatives):
    """A motion and the gradient of a cost with respect to P numbers (see `SceneDerivatives`)."""

    gradient: np.ndarray
    """Gradient of the cost `[P]`."""


def scene_gradient(
    scene: Scene,
    cotangent: Cotangent | None,
    parameters: Sequence[str] = (),
    *,
    wrench_cotangent: Cotangent | None = None,
    signals: Mapping[str, Any] | None = None,
    initial: Sequence[str] = (),
    options: SolverOptions | None = None,
) -> SceneGradient:
    """Compute the gradient of a cost of a motion by parameters, signals and initial state.

    `parameters`, `signals`, `initial` and `options` are those of `scene_sensitivities`. `cotangent(time, motion)` takes
    the times `[M]` and the motion `[M, 6]` and returns `dcost/dmotion` `[M, 6]`; `wrench_cotangent(time, wrenches)`
    adds `dcost/dwrenches` `[M, C, 3]` for the wrench of one of the identical contacts. The adjoint `-l' = J' l` runs
    backwards over the accepted steps, jumps by these cotangents at each instant, and accumulates `int l' df/dp dt`. It
    takes as long as one derivative, whatever the number of knots.

    Raises `InvalidValueError` as `scene_sensitivities` does, and `SolverError` if the solver fails.
    """
    functions = {"cotangent": cotangent, "wrench_cotangent": wrench_cotangent}
    for name, function in functions.items():
        if not callable(function) and (function is not None or cotangent is wrench_cotangent):
            raise InvalidValueError(name, "be a function of time and motion, or wrenches", function)
    motion = KeptMotion(scene, SceneInputs(scene, parameters, signals, initial), options)
    bars = [
        np.zeros_like(values)
        if function is None
        else validation.array(f"{name} of the cost", function(motion.time, values), values.shape)
        for (name, function), values in zip(functions.items(), motion.recorded, strict=True)
    ]
    return SceneGradient(*motion.head, motion.gradient(*bars))


class KeptMotion(MotionPath):
    """A simulated motion with its whole path, along which gradients of costs go back; not for several threads."""

    def __init__(self, scene: Scene, inputs: SceneInputs, options: SolverOptions | None) -> None:
        super().__init__(scene, inputs, options)
        steps = self.steps(_MOST_NODES)
        self._parts = [(system, Path(*(each.copy() for each in path))) for system, path in steps]

    def gradient(self, of_motion: np.ndarray, of_wrenches: np.ndarray) -> np.ndarray:
        """Return the gradient `[P]` of a cost from its derivatives by motion `[M, 6]` and wrenches `[M, C, 3]`."""
        return _Adjoint(self, of_motion, of_wrenches).back(self._parts)


class _Adjoint:
    """The adjoint of a motion on its way back, and the gain of the cost by then."""

    def __init__(self, motion: KeptMotion, of_motion: np.ndarray, of_wrenches: np.ndarray) -> None:
        self._bars, self._wrench_bars, self._time = of_motion, of_wrenches, motion.time
        self._inputs, self._accuracy = motion.inputs, motion.accuracy
        self._initial, scale = motion.inputs.start(motion.batches), motion.scale
        count, n = self._initial.shape
        self._state, self._gain, self._moments = np.zeros(n), np.zeros(count), np.zeros((self._inputs.inputs, 2))
        grip = max(np.abs(contact.normal_force.values).max() for contact in motion.scene.contacts)
        of_forces = of_wrenches * grip * np.array([1.0, 1.0, scale[-3] / scale[-1]])
        level = np.abs(np.append(of_motion * scale[-6:], of_forces)).max(initial=0.0) or 1.0
        self._atol = self._accuracy * level / scale
        self._space, self._known = workspace_for(1, self._inputs.inputs, n), 0.0
        self._next = len(self._time) - 1
        """Number of the instant whose cotangents come next."""

    def back(self, parts: list[tuple[System, Path]]) -> np.ndarray:
        """Return the gradient `[P]`, from the path of the motion."""
        for system, path in reversed(parts):
            for first, last in reversed(pieces_of(path)):
                if last > first:
                    self._piece(system, path, first, last)
        return self._inputs.in_order(self._gain + (self._initial * self._state).sum(axis=1))

    def _piece(self, system: System, path: Path, first: int, last: int) -> None:
        piece, breaks = int(path.piece[first]), system.motion.breaks
        begin, end = float(breaks[piece]), float(breaks[piece + 1])
        since, reach = float(path.since[last]), float(path.since[first])
        if since == end - begin:
            tangent.forget(system.address, piece, self._state[None, :])
            self._known = 0.0
        drives, place = self._inputs.at(system, piece), (system, path, first, last)
        self._moments[:] = 0.0
        while (m := self._next) >= 0 and (self._time[m] > begin + reach or self._time[m] == begin == 0.0 == reach):
            here = min(float(self._time[m]) - begin, since)
            if self._bars[m].any() or self._wrench_bars[m].any():
                self._propagate(*place, drives, since, here)
                self._jump(*place, drives, here)
                since, self._known = here, 0.0
            self._next -= 1
        self._propagate(*place, drives, since, reach)
        self._gain[: len(drives.kind)] += self._inputs.gained(drives, self._moments)
        if reach == 0.0 and system.motion.body_axes:
            here = np.flatnonzero(drives.kind == tangent.VELOCITY)
            self._gain[here] += drives.weight[here, 0] * self._state[drives.place[here] - 6]
            self._state[-6:-3], self._known = 0.0, 0.0

    def _jump(self, system: System, path: Path, first: int, last: int, drives: Drives, here: float) -> None:
        """Add the cotangents at the next instant, `here` seconds into the piece."""
        wrenches = self._wrench_bars[self._next]
        if wrenches.any():
            paths.state_at(path, first, last, here, self._space.record.state)
            at = system.address, int(path.piece[first]), here, wrenches
            adjoint.jump(*at, self._state, drives, self._moments, self._space.address)
        self._state[-6:] += self._bars[self._next]

    def _propagate(self, system: System, path: Path, first: int, last: int, drives: Drives, *span: float) -> None:
        since, until = span
        if until < since:
            numbers = self._state, drives, self._moments, self._known, self._accuracy, self._atol, self._space.address
            adjoint.propagate_back(system.address, path, first, last, since, until, *numbers)
            self._known = 1.0
