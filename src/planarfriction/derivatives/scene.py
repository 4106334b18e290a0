"""Forward sensitivities of a simulated scene: how its motion and wrenches change with friction, size, mass and load."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from planarfriction import validation
from planarfriction.derivatives.drives import Columns
from planarfriction.equality import ByValue
from planarfriction.errors import InvalidValueError, SolverError
from planarfriction.kernels import rosenbrock, tangent
from planarfriction.kernels.body import System
from planarfriction.kernels.integration import Output, run_of
from planarfriction.kernels.tangent import Drives, Path
from planarfriction.scenes.packing import SegmentBatches
from planarfriction.scenes.scene import Scene
from planarfriction.scenes.simulation import recording_times
from planarfriction.solvers import RODAS4
from planarfriction.solvers.structured import start_of

SHARE, POWER = 0.1, 2.0 / 3.0
"""Accuracy of each step of the derivatives, relative and in natural scales: a share of a power of `rtol`."""

NUMBERS = 4e6
"""Numbers of the states that a part of the motion holds, and as many of their rates: 64 MB together."""

LEAST_NODES = 16
"""Ends of steps that a part holds at least."""


@dataclass(frozen=True, eq=False)
class SceneSensitivities(ByValue):
    """A motion and its derivatives with respect to P numbers.

    Parameters are factors with the value 1: divide the derivative by the value of a parameter to get the derivative
    with respect to the parameter itself. Knots and initial values have the units of the signal and of the state.
    """

    names: tuple[str, ...]
    """What the derivatives are with respect to; `fingers.normal_force[2]` is knot 2 of a signal."""
    columns: dict[str, slice]
    """Which of the P derivatives belong to a parameter, a signal (all its knots) or an initial value, by name."""
    time: np.ndarray
    """Times `[M]` [s]."""
    motion: np.ndarray
    """vx, vy, omega, x, y, theta of the body `[M, 6]`, as in a solution's data."""
    wrenches: np.ndarray
    """Wrench of one of the identical contacts `[M, C, 3]` [N, N, N m]."""
    d_motion: np.ndarray
    """Derivatives of the motion `[M, 6, P]`."""
    d_wrenches: np.ndarray
    """Derivatives of the wrenches `[M, C, 3, P]`."""


def scene_sensitivities(
    scene: Scene,
    parameters: Sequence[str] = ("mu", "r", "mass", "load"),
    *,
    signals: Mapping[str, Any] | None = None,
    initial: Sequence[str] = (),
    t_end: float | None = None,
    rtol: float = 1e-9,
    atol: float | None = None,
    save_every: float | None = None,
) -> SceneSensitivities:
    """Derivatives of a simulated motion with respect to the scene's parameters, its signals and its initial state.

    `parameters` are factors (see `SCENE_PARAMETERS`). `signals` gives knots [s] by the name of a signal: `force`,
    `velocity`, or `NAME.normal_force` for the contact of that name. The derivative is with respect to a number added to
    the signal at the knot and interpolated in time like the signal's own samples (`hold`): `sum_k d_k hat_k(t)`. If the
    knots are the times of the samples, it is the derivative with respect to the sampled values. `initial` names
    components of the body's initial state: vx, vy, omega, x, y, theta.

    The scene is simulated with tight tolerances (`atol` as in `simulate`; default `rtol`). Along the accepted steps the
    variational equation `s' = J s + df/dp` is solved with the solver's own analytic Jacobian, by an L-stable method of
    order 4 whose steps span several steps of the motion, each accurate to `0.1 rtol^(2/3)` of the derivatives. At the
    default tolerance the derivatives agree with central differences of tight simulations to 5e-6 of the largest, and to
    2e-5 with tables, whose Jacobian jumps from cell to cell.

    A bristle that begins to slip or to stick bends the right-hand side but does not make it jump: the derivative
    continues through such a transition, and describes a motion that makes the same transitions slightly earlier or
    later. It is large if the motion depends very sensitively on friction, as in a slip that barely happens. On a kink
    (a velocity that stays zero, the edge of a table's cell) it is the derivative of one side. The instants at which
    signals jump, and at which a slide counts as stopped, are held fixed.

    Raises `InvalidValueError` for unknown names or numbers out of range, and `SolverError` if the solver fails.
    """
    columns = Columns(scene, parameters, signals, initial)
    windows, times, rtol, absolute = prepared(scene, columns, t_end, rtol, atol, save_every)
    derivatives = _Derivatives(windows, times, columns, rtol)
    columns.start(scene, windows, derivatives.slope)
    _integrate(windows, derivatives, rtol, absolute * windows.state_scale)
    return SceneSensitivities(columns.names, columns.of, *derivatives.recorded())


def prepared(
    scene: Scene, columns: Columns, t_end, rtol, atol, save_every
) -> tuple[SegmentBatches, np.ndarray, float, float]:
    """The windows of a motion whose derivatives are wanted, the instants to record, tolerances."""
    end = scene.t_end if t_end is None else validation.positive("t_end", t_end)
    if end > scene.t_end:
        raise InvalidValueError("t_end", f"be at most the scene's {scene.t_end:g} s", end)
    every = scene.save_every if save_every is None else validation.positive("save_every", save_every)
    rtol = validation.positive("rtol", rtol)
    absolute = rtol if atol is None else validation.positive("atol", atol)
    times = recording_times(end, every)
    windows = SegmentBatches(scene, end, times=times, sensitivities=True, marks=columns.marks)
    for contact, model in zip(scene.contacts, windows.models, strict=True):
        if None in model.functions:
            rule = "have all functions of kernels.contacts.ModelFunctions for derivatives of scenes"
            raise InvalidValueError(f"model of contact {contact.name!r}", rule, type(contact.model).__name__)
    return windows, times, rtol, absolute


def _integrate(windows: SegmentBatches, derivatives: _Derivatives, rtol: float, atol: np.ndarray) -> None:
    """Integrate the motion as `simulate` does, and carry the derivatives along a part of its steps after another."""
    now, n, outcome = start_of(windows.state), len(windows.state), rosenbrock.DONE
    path = tangent.path_for(max(int(NUMBERS / n), LEAST_NODES), n)
    for system in windows:
        run = run_of(system, RODAS4, derivatives.output, now, rtol=rtol, atol=atol)
        now.cursor[0], outcome = 0, rosenbrock.PAUSED
        derivatives.columns.enter(system)
        while outcome == rosenbrock.PAUSED:
            nodes, outcome = tangent.follow(run.address, path)
            derivatives.carry(system, path, nodes, int(now.cursor[1]))
        del system, run
        if outcome != rosenbrock.DONE:
            break
    check_outcome(outcome)


def check_outcome(outcome: int) -> None:
    """Raise `SolverError` where the solver gave up."""
    if outcome == rosenbrock.STEP_TOO_SMALL:
        raise SolverError("the step size fell below the resolution of time: loosen rtol, or check the scene")


class _Derivatives:
    """The derivatives of a motion, carried along its steps as they come, and what is recorded of both."""

    def __init__(self, windows: SegmentBatches, times: np.ndarray, columns: Columns, rtol: float) -> None:
        n, count, many, instants = len(windows.state), len(columns.names), len(windows.models), len(times)
        body, wrench, load = np.empty((instants, 6)), np.empty((instants, many, 3)), np.empty((instants, many))
        self.output = Output(times, body, wrench, load, np.empty((0, 0)))
        """What the integration of the motion records."""
        self.columns, self._accuracy = columns, SHARE * rtol**POWER
        self._space, self._atol = tangent.slopes_for(count, columns.inputs, n), self._accuracy * windows.state_scale
        self.slope, self._state, self._scratch = np.zeros((count, n)), np.empty(n), np.empty((2, n))
        self._d_body, self._d_wrench = np.zeros((instants, 6, count)), np.zeros((instants, many, 3, count))
        self._count, self._wrench = 0, np.empty((many, 3))

    def carry(self, system: System, path: Path, nodes: int, reached: int) -> None:
        """Go along the nodes of a path and fill what belongs to the `reached` instants that the motion has recorded."""
        pieces, breaks = path.piece[:nodes], system.motion.breaks
        ends = np.append(np.flatnonzero(np.diff(pieces)), nodes - 1)
        first = 0
        for last in ends.tolist() if nodes else []:
            piece, since, reach = int(pieces[last]), float(path.since[first]), float(path.since[last])
            begin, length = breaks[piece], breaks[piece + 1] - breaks[piece]
            time = breaks[piece + 1] if reach == length else begin + reach
            drives = self.columns.at(piece, float(breaks[piece + 1]))
            if since == 0.0:
                self.columns.begin(drives, self.slope)
            while self._count < reached and self.output.time[self._count] <= time:
                instant = self.output.time[self._count]
                here = reach if instant == time else float(instant - begin)
                self._propagate(system, path, drives, first, last, since, here)
                self._record(system, path, drives, first, last, here)
                since = here
            self._propagate(system, path, drives, first, last, since, reach)
            if reach == length:
                tangent.forget(system.address, piece, self.slope)
            first = last + 1

    def _propagate(self, system: System, path: Path, drives: Drives, *span: float) -> None:
        along = self.slope, drives, self._accuracy, self._atol, self._space
        tangent.propagate(system.address, path, *span, *along)

    def _record(self, system: System, path: Path, drives: Drives, first: int, last: int, since: float) -> None:
        m, piece = self._count, int(path.piece[first])
        tangent.state_at(path, first, last, since, self._state)
        at = system.address, piece, since, self._state, drives, self.slope
        tangent.wrench_slopes(*at, self._wrench, self._d_wrench[m], self._scratch)
        self._d_body[m] = self.slope[:, -6:].T
        self._count += 1

    def recorded(self) -> tuple[np.ndarray, ...]:
        """Times, motion, wrenches, and the derivatives of both."""
        slopes = self.columns.sorted(self._d_body), self.columns.sorted(self._d_wrench)
        every = self.output.time, self.output.body, self.output.wrench, *slopes
        return tuple(values[: self._count] for values in every)
