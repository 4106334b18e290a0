"""Forward sensitivities of a simulated scene: how its motion and wrenches change with friction, size, mass and load."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from planarfriction import validation
from planarfriction.equality import ByValue
from planarfriction.errors import InvalidValueError, SolverError
from planarfriction.kernels import rosenbrock, tangent
from planarfriction.kernels.body import System
from planarfriction.kernels.integration import Output, Run, run_of
from planarfriction.kernels.tangent import Path
from planarfriction.patch.metric import refuse_anisotropy
from planarfriction.scenes.packing import Windows
from planarfriction.scenes.scene import Scene
from planarfriction.scenes.simulation import recording_times
from planarfriction.solvers import RODAS4
from planarfriction.solvers.structured import start_of

SCENE_PARAMETERS = {
    "mu": tangent.FRICTION,
    "r": tangent.SIZE,
    "mass": tangent.MASS,
    "inertia": tangent.INERTIA,
    "load": tangent.LOAD,
}
"""What `scene_sensitivities` knows: factors, 1 as the scene is, of

- `mu`: mu_c and mu_s of every contact;
- `r`: the size of every patch, about the origin of its contact frame (positions, contact radius, second moment);
- `mass`, `inertia`: of the body, forces held (gravity pulls in proportion to the mass);
- `load`: every normal force, patches keeping the shape that they have.
"""

_ACCURACY = 1e-7
"""Accuracy of each step of the derivatives, relative and in natural scales."""

_NUMBERS = 4e6
"""Numbers of the states at which a part of the steps begins, and as many at which it ends: 64 MB together."""

_CLOCK = 1e-12
"""Share of a step by which adding times up may be off."""


@dataclass(frozen=True, eq=False)
class SceneSensitivities(ByValue):
    """A motion and its derivatives with respect to P factors.

    A factor is 1 as the scene is: divided by a parameter's value it is the derivative with respect to the parameter.
    """

    names: tuple[str, ...]
    """The factors."""
    time: np.ndarray
    """`[M]` [s]"""
    motion: np.ndarray
    """vx, vy, omega, x, y, theta of the body `[M, 6]`, as in a solution's data."""
    wrenches: np.ndarray
    """Wrench of one of the identical contacts `[M, C, 3]` [N, N, N m]."""
    d_motion: np.ndarray
    """`[M, 6, P]`"""
    d_wrenches: np.ndarray
    """`[M, C, 3, P]`"""


def scene_sensitivities(
    scene: Scene,
    names: Sequence[str] = ("mu", "r", "mass", "load"),
    *,
    t_end: float | None = None,
    rtol: float = 1e-9,
    atol: float | None = None,
    save_every: float | None = None,
) -> SceneSensitivities:
    """Derivatives of a simulated motion with respect to factors on the scene's parameters (see `SCENE_PARAMETERS`).

    The scene is simulated with tight tolerances (`atol` as in `simulate`; default `rtol`). Along the accepted steps the
    variational equation `s' = J s + df/dp` is then solved with the solver's own analytic Jacobian: by an L-stable
    method of order 4, each step halved until the derivatives are right to 1e-7 of themselves. At the default tolerance
    they agree with central differences of tight simulations to 1e-6 of the largest, with tables, whose Jacobian jumps
    from cell to cell, to 1e-4 (2e-5 for `rtol=1e-11`).

    A bristle that begins to slip or sticks again bends the right-hand side but does not make it jump: the derivative
    goes on through such a transition, and is the change of a motion that makes the same transitions a little earlier
    or later. It is large where the motion hangs on friction by a thread, as in a slip that barely happens. On a kink
    (a velocity that stays zero, the edge of a table's cell) it is the derivative of one side. The instants at which
    signals jump and at which a slide counts as stopped are held.

    Raises `InvalidValueError` for unknown names or numbers out of range, and `SolverError` where the solver gives up.
    """
    if not isinstance(scene, Scene):
        raise InvalidValueError("scene", "be a Scene", type(scene).__name__)
    names = validation.choices("names", names, SCENE_PARAMETERS)
    chosen = np.array([SCENE_PARAMETERS[name] for name in names], int)
    end = scene.t_end if t_end is None else validation.positive("t_end", t_end)
    if end > scene.t_end:
        raise InvalidValueError("t_end", f"be at most the scene's {scene.t_end:g} s", end)
    every = scene.save_every if save_every is None else validation.positive("save_every", save_every)
    for contact in scene.contacts:
        refuse_anisotropy(contact.model.patch, "scene_sensitivities")
    rtol = validation.positive("rtol", rtol)
    absolute = rtol if atol is None else validation.positive("atol", atol)
    times = recording_times(end, every)
    windows = Windows(scene, end, times=times, sensitivities=True)
    derivatives = _Derivatives(windows, len(times), chosen)
    for part in _parts(windows, times, rtol, absolute * windows.natural, chosen):
        derivatives.carry(*part)
    return SceneSensitivities(tuple(names), *derivatives.recorded())


def _parts(
    windows: Windows, times: np.ndarray, rtol: float, atol: np.ndarray, parameters: np.ndarray
) -> Iterator[tuple[System, Path, list[int], bool]]:
    """The accepted steps, one of which ends at each recording time, a part of the motion after another.

    With each part come the window that it lies in, how many of its steps lead to each time on it, and whether its last
    step ends at a break.
    """
    now, many, recorded = start_of(windows.state), len(windows.models), 1
    most = max(int(_NUMBERS / len(windows.state)), 1)
    nothing = Output(
        np.array([np.inf]), np.empty((1, 6)), np.empty((1, many, 3)), np.empty((1, many)), np.empty((0, 0))
    )
    outcome = rosenbrock.DONE
    for system in windows:
        run = run_of(system, RODAS4, nothing, now, rtol=rtol, atol=atol)
        now.cursor[0], outcome = 0, rosenbrock.PAUSED
        while outcome == rosenbrock.PAUSED:
            steps: list[tuple] = []
            until: list[int] = []
            while outcome == rosenbrock.PAUSED and len(steps) < most:
                outcome, step, reached = _trial(run, times[recorded])
                steps += step
                if reached:
                    until.append(len(steps))
                    recorded += 1
            if steps:
                ended = int(now.cursor[0]) != steps[-1][0]
                path = Path(*map(np.array, zip(*steps, strict=True)), parameters)  # pyright: ignore[reportCallIssue]
                yield system, path, until, ended
        del system, run
        if outcome != rosenbrock.DONE:
            break
    if outcome == rosenbrock.STEP_TOO_SMALL:
        raise SolverError("the step size fell below the resolution of time: loosen rtol, or check the scene")


def _trial(run: Run, time: float) -> tuple[int, list[tuple], bool]:
    """Try one step, which ends at the next recording `time` at the latest.

    Returns the outcome; of an accepted step the piece, the seconds into it, its length and the states at both ends; and
    whether the time is reached.
    """
    y, cursor, clock, counts = run.progress
    motion = run.system.motion
    piece, since, proposed, accepted = int(cursor[0]), float(clock[0]), float(clock[1]), int(counts[rosenbrock.STEPS])
    begin, end = motion.breaks[piece], motion.breaks[piece + 1]
    if since == 0.0 and len(motion.velocity):
        y[-6:-3] = motion.velocity[piece]
    before, room = y.copy(), time - begin - since if time < end else np.inf
    if 2.0 * proposed > room:  # end there, or halve what is left, as before a break
        clock[1] = room if proposed >= room else 0.5 * room
    outcome = rosenbrock.advance(run.address, 1)
    if int(counts[rosenbrock.STEPS]) == accepted:
        return outcome, [], False
    ended = int(cursor[0]) != piece
    length = (end - begin if ended else float(clock[0])) - since
    if 2.0 * proposed > room:
        clock[1] = max(clock[1], proposed)
    reached = (ended and time <= end) or length >= (1.0 - _CLOCK) * room or outcome == rosenbrock.AT_REST
    return outcome, [(piece, since, length, before, run.stages.new.copy())], bool(reached)


class _Derivatives:
    """The derivatives of a motion, carried along its steps as they come, and what is recorded of both."""

    def __init__(self, windows: Windows, instants: int, parameters: np.ndarray) -> None:
        n, count, many = len(windows.state), len(parameters), len(windows.models)
        self._parameters, self._bristles = parameters, windows.bristles
        self._space, self._atol = tangent.slopes_for(count, n), _ACCURACY * windows.natural
        self._slope, self._scratch = np.zeros((count, n)), np.empty((2, n))
        self._time, self._body, self._wrench = (
            np.empty(instants),
            np.empty((instants, 6)),
            np.empty((instants, many, 3)),
        )
        self._d_body, self._d_wrench = np.zeros((instants, 6, count)), np.zeros((instants, many, 3, count))
        self._count = 0

    def carry(self, system: System, path: Path, until: list[int], ended: bool) -> None:
        """Go along steps of one window and record behind `until` of them; what `_parts` gives."""
        if self._count == 0:
            self._record(system, int(path.piece[0]), float(path.since[0]), path.start[0])
        done = 0
        for last in until:
            self._propagate(system, path, done, last)
            done, step = last, last - 1
            self._record(system, int(path.piece[step]), float(path.since[step] + path.step[step]), path.end[step])
        self._propagate(system, path, done, len(path.piece))
        if ended:  # within a path `propagate` does so
            load = system.motion.load[path.piece[-1]]
            for c in np.flatnonzero((load == 0.0).all(axis=0)):
                self._slope[:, self._bristles[c] : self._bristles[c + 1]] = 0.0

    def _propagate(self, system: System, path: Path, first: int, last: int) -> None:
        tangent.propagate(system.address, path, first, last, self._slope, _ACCURACY, self._atol, self._space)

    def _record(self, system: System, piece: int, since: float, state: np.ndarray) -> None:
        m, at = self._count, (system.address, piece, since, state, self._parameters, self._slope)
        tangent.wrench_slopes(*at, self._wrench[m], self._d_wrench[m], self._scratch)
        self._time[m], self._body[m] = system.motion.breaks[piece] + since, state[-6:]
        self._d_body[m] = self._slope[:, -6:].T
        self._count += 1

    def recorded(self) -> tuple[np.ndarray, ...]:
        """Times, motion, wrenches, and the derivatives of both."""
        every = self._time, self._body, self._wrench, self._d_body, self._d_wrench
        return tuple(values[: self._count] for values in every)
