"""The reverse of scene sensitivities: the slope of one cost of a motion, whatever the number of knots."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from planarfriction import validation
from planarfriction.autodiff.drives import Columns
from planarfriction.autodiff.scene import LEAST_NODES, NUMBERS, POWER, SHARE, check_outcome, prepared
from planarfriction.equality import ByValue
from planarfriction.errors import InvalidValueError
from planarfriction.kernels import adjoint, rosenbrock, tangent
from planarfriction.kernels.body import System
from planarfriction.kernels.integration import Output, run_of
from planarfriction.kernels.tangent import Path
from planarfriction.scenes.packing import Windows
from planarfriction.scenes.scene import Scene
from planarfriction.solvers import RODAS4
from planarfriction.solvers.structured import start_of

MOST_STATES = 60
"""Bristle states of all contacts together that `scene_gradient` takes: its matrices are dense."""


@dataclass(frozen=True, eq=False)
class SceneGradient(ByValue):
    """A motion and the slope of a cost with respect to P numbers (see `SceneSensitivities`)."""

    names: tuple[str, ...]
    """What it is with respect to."""
    columns: dict[str, slice]
    """Where the slopes of a parameter, a signal (all its knots) or a component of the start stand."""
    time: np.ndarray
    """`[M]` [s]"""
    motion: np.ndarray
    """vx, vy, omega, x, y, theta of the body `[M, 6]`."""
    gradient: np.ndarray
    """`[P]`"""


def scene_gradient(
    scene: Scene,
    slope: Callable[[np.ndarray, np.ndarray], np.ndarray],
    parameters: Sequence[str] = (),
    *,
    signals: Mapping[str, Any] | None = None,
    initial: Sequence[str] = (),
    t_end: float | None = None,
    rtol: float = 1e-9,
    atol: float | None = None,
    save_every: float | None = None,
) -> SceneGradient:
    """Slope of a cost of the motion with respect to parameters, signals and start, as in `scene_sensitivities`.

    `slope(time, motion)` takes the times `[M]` and the motion `[M, 6]` and returns `dcost/dmotion` `[M, 6]`. The
    adjoint `-l' = J' l` runs back over the accepted steps, jumps by the slope at each instant, and gathers
    `int l' df/dp dt`: it takes the time of one derivative, whatever the number of knots.

    Raises `InvalidValueError` as `scene_sensitivities` does, and where the contacts have more than `MOST_STATES` states
    together (a `DistributedModel` of many cells); `SolverError` where the solver gives up.
    """
    if not callable(slope):
        raise InvalidValueError("slope", "be a function of time and motion", slope)
    columns = Columns(scene, parameters, signals, initial)
    windows, times, rtol, absolute = prepared(scene, columns, t_end, rtol, atol, save_every)
    if windows.bristles[-1] > MOST_STATES:
        rule = f"have contacts of at most {MOST_STATES} states together"
        raise InvalidValueError("scene", rule, int(windows.bristles[-1]))
    output, segments, count = _followed(windows, times, rtol, absolute)
    time, motion = output.time[:count], output.body[:count]
    seeds = validation.array("slope of the cost", slope(time, motion), (count, 6))
    gradient = _Adjoint(scene, windows, columns, seeds, rtol).back(segments, time)
    return SceneGradient(columns.names, columns.of, time, motion, gradient)


def _followed(windows: Windows, times: np.ndarray, rtol: float, absolute: float):
    """The motion: what is recorded, its path in parts with the system of each, and how many instants it has."""
    instants, many, n = len(times), len(windows.models), len(windows.state)
    output = Output(
        times, np.empty((instants, 6)), np.empty((instants, many, 3)), np.empty((instants, many)), np.empty((0, 0))
    )
    now, outcome, parts = start_of(windows.state), rosenbrock.DONE, []
    room = tangent.path_for(max(min(int(NUMBERS / n), 4096), LEAST_NODES), n)
    for system in windows:
        run = run_of(system, RODAS4, output, now, rtol=rtol, atol=absolute * windows.natural)
        now.cursor[0], outcome = 0, rosenbrock.PAUSED
        while outcome == rosenbrock.PAUSED:
            nodes, outcome = tangent.follow(run.address, room)
            parts.append((system, Path(*(each[:nodes].copy() for each in room))))
        if outcome != rosenbrock.DONE:
            break
    check_outcome(outcome)
    return output, parts, int(now.cursor[1])


class _Adjoint:
    """The adjoint of a motion on its way back, and what the cost gains by then."""

    def __init__(self, scene: Scene, windows: Windows, columns: Columns, seeds: np.ndarray, rtol: float) -> None:
        n = len(windows.state)
        self._columns, self._seeds, self._driven = columns, seeds, scene.velocity is not None
        self._state, self._initial = np.zeros(n), np.zeros((len(columns.names), n))
        columns.start(scene, windows, self._initial)
        self._inputs, self._which = columns.inputs()
        self._gain, self._moments = np.zeros(len(columns.names)), np.zeros((len(self._inputs.kind), 2))
        self._accuracy = SHARE * rtol**POWER
        level = np.abs(seeds * windows.natural[-6:]).max(initial=0.0) or 1.0
        self._atol = self._accuracy * level / windows.natural
        self._space, self._known = adjoint.workspace_for(len(self._inputs.kind), n), 0.0

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
        self._moments[:] = 0.0
        while m >= 0 and (time[m] > begin + reach or time[m] == begin == 0.0 == reach):
            here = min(float(time[m]) - begin, since)
            if self._seeds[m].any():
                self._propagate(system, path, first, last, since, here)
                self._state[-6:] += self._seeds[m]
                since, self._known = here, 0.0
            m -= 1
        self._propagate(system, path, first, last, since, reach)
        drives = self._columns.at(piece, end)
        self._gain[: len(drives.kind)] += self._columns.gained(drives, self._moments[self._which[: len(drives.kind)]])
        if reach == 0.0 and self._driven:
            of_velocity = drives.kind == tangent.VELOCITY
            here = np.flatnonzero(of_velocity)
            self._gain[here] += drives.weight[here, 0] * self._state[len(self._state) - 6 + drives.place[here]]
            self._state[-6:-3], self._known = 0.0, 0.0
        return m

    def _propagate(self, system: System, path: Path, first: int, last: int, since: float, until: float) -> None:
        if until < since:
            numbers = self._state, self._inputs, self._moments, self._known, self._accuracy, self._atol, self._space
            adjoint.propagate_back(system.address, path, first, last, since, until, *numbers)
            self._known = 1.0
