"""The reverse of scene sensitivities: the gradient of one cost of a motion, whatever the number of knots."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from planarfriction import validation
from planarfriction.derivatives.drives import Columns
from planarfriction.derivatives.scene import LEAST_NODES, NUMBERS, POWER, SHARE, check_outcome, prepared
from planarfriction.equality import ByValue
from planarfriction.errors import InvalidValueError
from planarfriction.kernels import adjoint, rosenbrock, tangent
from planarfriction.kernels.body import System
from planarfriction.kernels.integration import Output, run_of
from planarfriction.kernels.tangent import Drives, Path
from planarfriction.scenes.packing import SegmentBatches
from planarfriction.scenes.scene import Scene
from planarfriction.solvers import RODAS4
from planarfriction.solvers.structured import start_of


@dataclass(frozen=True, eq=False)
class SceneGradient(ByValue):
    """A motion and the gradient of a cost with respect to P numbers (see `SceneSensitivities`)."""

    names: tuple[str, ...]
    """What the gradient is with respect to."""
    columns: dict[str, slice]
    """Which components of the gradient belong to a parameter, a signal (all its knots) or an initial value, by name."""
    time: np.ndarray
    """Times `[M]` [s]."""
    motion: np.ndarray
    """vx, vy, omega, x, y, theta of the body `[M, 6]`."""
    wrenches: np.ndarray
    """Wrench of one of the identical contacts `[M, C, 3]` [N, N, N m]."""
    gradient: np.ndarray
    """Gradient of the cost `[P]`."""


def scene_gradient(
    scene: Scene,
    slope: Callable[[np.ndarray, np.ndarray], np.ndarray] | None,
    parameters: Sequence[str] = (),
    *,
    wrench_slope: Callable[[np.ndarray, np.ndarray], np.ndarray] | None = None,
    signals: Mapping[str, Any] | None = None,
    initial: Sequence[str] = (),
    t_end: float | None = None,
    rtol: float = 1e-9,
    atol: float | None = None,
    save_every: float | None = None,
) -> SceneGradient:
    """Gradient of a cost of a motion with respect to parameters, signals and initial state, as in
    `scene_sensitivities`.

    `slope(time, motion)` takes the times `[M]` and the motion `[M, 6]` and returns `dcost/dmotion` `[M, 6]`;
    `wrench_slope(time, wrenches)` adds `dcost/dwrenches` `[M, C, 3]` for the wrench of one of the identical contacts.
    The adjoint `-l' = J' l` runs backwards over the accepted steps, jumps by these slopes at each instant, and
    accumulates `int l' df/dp dt`. It takes as long as one derivative, whatever the number of knots.

    Raises `InvalidValueError` as `scene_sensitivities` does, and `SolverError` if the solver fails.
    """
    for name, function in (("slope", slope), ("wrench_slope", wrench_slope)):
        if not callable(function) and (function is not None or (slope is None and wrench_slope is None)):
            raise InvalidValueError(name, "be a function of time and motion, or wrenches", function)
    done = Followed(scene, parameters, signals, initial, t_end, rtol, atol, save_every)
    of_motion, of_wrenches = np.zeros_like(done.motion), None
    if slope is not None:
        of_motion = validation.array("slope of the cost", slope(done.time, done.motion), done.motion.shape)
    if wrench_slope is not None:
        of_wrenches = wrench_slope(done.time, done.wrenches)
        of_wrenches = validation.array("wrench_slope of the cost", of_wrenches, done.wrenches.shape)
    return SceneGradient(
        done.columns.names, done.columns.of, done.time, done.motion, done.wrenches, done.back(of_motion, of_wrenches)
    )


class Followed:
    """A simulated motion with the way that it took, along which slopes of costs go back; not for several threads."""

    def __init__(self, scene: Scene, parameters, signals, initial, t_end, rtol, atol, save_every) -> None:
        self.columns = Columns(scene, parameters, signals, initial)
        windows, times, self._rtol, absolute = prepared(scene, self.columns, t_end, rtol, atol, save_every)
        self._scene, self._windows = scene, windows
        instants, many, n = len(times), len(windows.models), len(windows.state)
        body, wrenches, load = np.empty((instants, 6)), np.empty((instants, many, 3)), np.empty((instants, many))
        output = Output(times, body, wrenches, load, np.empty((0, 0)))
        now, outcome = start_of(windows.state), rosenbrock.DONE
        self._parts: list[tuple[System, Path]] = []
        room = tangent.path_for(max(min(int(NUMBERS / n), 4096), LEAST_NODES), n)
        for system in windows:
            run = run_of(system, RODAS4, output, now, rtol=self._rtol, atol=absolute * windows.state_scale)
            now.cursor[0], outcome = 0, rosenbrock.PAUSED
            while outcome == rosenbrock.PAUSED:
                nodes, outcome = tangent.follow(run.address, room)
                self._parts.append((system, Path(*(each[:nodes].copy() for each in room))))
            if outcome != rosenbrock.DONE:
                break
        check_outcome(outcome)
        count = int(now.cursor[1])
        self.time, self.motion, self.wrenches = times[:count], body[:count], wrenches[:count]

    def back(self, of_motion: np.ndarray, of_wrenches: np.ndarray | None) -> np.ndarray:
        """The gradient [P] of a cost from its slopes by the motion [M, 6] and by the wrenches [M, C, 3]."""
        seeds = of_motion, np.zeros_like(self.wrenches) if of_wrenches is None else of_wrenches
        return _Adjoint(self._scene, self._windows, self.columns, seeds, self._rtol).back(self._parts, self.time)


class _Adjoint:
    """The adjoint of a motion on its way back, and what the cost gains by then."""

    def __init__(
        self, scene: Scene, windows: SegmentBatches, columns: Columns, seeds: tuple[np.ndarray, np.ndarray], rtol: float
    ) -> None:
        n = len(windows.state)
        (self._seeds, self._wrench_seeds), self._columns = seeds, columns
        self._driven = scene.velocity is not None
        self._state, self._initial = np.zeros(n), np.zeros((len(columns.names), n))
        columns.start(scene, windows, self._initial)
        self._gain, self._moments = np.zeros(len(columns.names)), np.zeros((columns.inputs, 2))
        self._accuracy = SHARE * rtol**POWER
        grip = max(np.abs(contact.normal_force.values).max() for contact in scene.contacts)
        wrench = grip * np.array([1.0, 1.0, windows.state_scale[-3] / windows.state_scale[-1]])
        scaled = np.append(self._seeds * windows.state_scale[-6:], self._wrench_seeds * wrench)
        level = np.abs(scaled).max(initial=0.0) or 1.0
        self._atol = self._accuracy * level / windows.state_scale
        self._space, self._known = adjoint.workspace_for(columns.inputs, n), 0.0

    def back(self, parts: list[tuple[System, Path]], time: np.ndarray) -> np.ndarray:
        """The gradient [P], from the path of the motion and the instants at which the cost sees it."""
        m, entered = len(time) - 1, None
        for system, path in reversed(parts):
            if system is not entered:
                self._columns.enter(system)
                entered = system
            starts = np.append(0, np.flatnonzero(np.diff(path.piece)) + 1)
            ends = np.append(starts[1:], len(path.piece)) - 1
            for first, last in zip(starts[::-1].tolist(), ends[::-1].tolist(), strict=True):
                if last > first:
                    m = self._piece(system, path, first, last, time, m)
        return self._columns.sorted(self._gain + (self._initial * self._state).sum(axis=1))

    def _piece(self, system: System, path: Path, first: int, last: int, time: np.ndarray, m: int) -> int:
        piece, breaks = int(path.piece[first]), system.motion.breaks
        begin, end = float(breaks[piece]), float(breaks[piece + 1])
        since, reach = float(path.since[last]), float(path.since[first])
        if since == end - begin:
            tangent.forget(system.address, piece, self._state[None, :])
            self._known = 0.0
        drives = self._columns.at(piece, end)
        self._moments[:] = 0.0
        while m >= 0 and (time[m] > begin + reach or time[m] == begin == 0.0 == reach):
            here = min(float(time[m]) - begin, since)
            if self._seeds[m].any() or self._wrench_seeds[m].any():
                self._propagate(system, path, drives, first, last, since, here)
                if self._wrench_seeds[m].any():
                    tangent.state_at(path, first, last, here, self._space.state)
                    at = system.address, piece, here, self._wrench_seeds[m]
                    adjoint.jump(*at, self._state, drives, self._moments, self._space)
                self._state[-6:] += self._seeds[m]
                since, self._known = here, 0.0
            m -= 1
        self._propagate(system, path, drives, first, last, since, reach)
        self._gain[: len(drives.kind)] += self._columns.gained(drives, self._moments)
        if reach == 0.0 and self._driven:
            of_velocity = drives.kind == tangent.VELOCITY
            here = np.flatnonzero(of_velocity)
            self._gain[here] += drives.weight[here, 0] * self._state[len(self._state) - 6 + drives.place[here]]
            self._state[-6:-3], self._known = 0.0, 0.0
        return m

    def _propagate(self, system: System, path: Path, drives: Drives, first: int, last: int, *span: float) -> None:
        since, until = span
        if until < since:
            numbers = self._state, drives, self._moments, self._known, self._accuracy, self._atol, self._space
            adjoint.propagate_back(system.address, path, first, last, since, until, *numbers)
            self._known = 1.0
