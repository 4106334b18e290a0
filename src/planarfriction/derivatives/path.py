"""A motion whose derivatives are wanted: simulated as `simulate` does, with the path of its steps, and the way back."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from planarfriction._engine.body import adjoint, rosenbrock, tangent
from planarfriction._engine.body import path as paths
from planarfriction._engine.body.body import System
from planarfriction._engine.body.integration import Output
from planarfriction._engine.body.path import Path, Stretch, Tolerances
from planarfriction._engine.body.sdirk import workspace_for
from planarfriction._engine.body.tangent import Drives
from planarfriction._support import validation
from planarfriction._support.equality import ByValue
from planarfriction.derivatives.scene_inputs import SceneInputs
from planarfriction.errors import InvalidValueError, SolverError
from planarfriction.models.base import refuse_common
from planarfriction.scenes.packing import SegmentBatches
from planarfriction.scenes.scene import Scene, SolverOptions
from planarfriction.solvers import RODAS4
from planarfriction.solvers.structured import start_of

RTOL = 1e-9
"""Default relative tolerance of a motion whose derivatives are wanted [-]."""

SHARE = 0.1
"""Factor of the accuracy of each step of the derivatives, `SHARE rtol^POWER`, relative
and in nominal values."""

POWER = 2.0 / 3.0
"""Power of `rtol` in the accuracy of each step of the derivatives."""

NUMBERS = 4e6
"""Numbers of the states that a part of the path holds, and as many of their rates: 64 MB together."""

LEAST_NODES = 16
"""Least number of ends of steps that a part of the path holds."""

MOST_NODES = 4096
"""Largest number of ends of steps in a part of the path when all parts stay in
memory."""

ALLOWANCE = 20_000
"""Steps of the adjoint that a gradient may take besides `adjoint.PER_STEP` for each of the motion: half a second."""

PER_JUMP = 100
"""Steps that it may take besides for each instant that its cost sees: 60 follow a jump of the adjoint."""

TOO_SLOW = "the gradient takes many more steps than the motion: raise rtol, or use scene_sensitivities"
"""Message of a gradient that would cost far more than its motion."""

MOST_KEPT = 250_000_000
"""Largest number of numbers of the states along a path that stays in memory, with as many of their rates: 4 GB."""


@dataclass(frozen=True, eq=False)
class SceneDerivatives(ByValue):
    """A motion and the P numbers by which it is differentiated.

    Parameters are factors with the value 1: divide the derivative by the value of a parameter to get the derivative
    with respect to the parameter itself. Knots and initial values have the units of the signal and of the state.
    """

    names: tuple[str, ...]
    """Names of the numbers; `fingers.normal_force[2]` is knot 2 of a signal."""
    columns: dict[str, slice]
    """Derivatives that belong to a parameter, a signal (all its knots) or an initial value, by name."""
    time: np.ndarray
    """Times `[M]` [s]."""
    motion: np.ndarray
    """Motion of the body, vx, vy, omega, x, y, theta `[M, 6]`, as in a solution's data."""
    wrenches: np.ndarray
    """Wrench of one of the identical contacts `[M, C, 3]` [N, N, N m]."""


class MotionPath:
    """A motion of a scene on its way, with its recorded samples."""

    def __init__(
        self, scene: Scene, inputs: SceneInputs, options: SolverOptions | None
    ) -> None:
        options = SolverOptions() if options is None else options
        plan = validation.instance(
            "options", options, SolverOptions, "SolverOptions"
        ).plan(scene, RTOL)
        self.scene = scene
        self.inputs = inputs
        for contact in scene.contacts:
            refuse_common(contact.model, "derivatives of scenes")
            if contact.edge:
                raise InvalidValueError(
                    f"edge of contact {contact.name!r}",
                    "be False for derivatives of scenes",
                    True,
                )
        self.batches = SegmentBatches(
            scene, plan.end, times=plan.times, sensitivities=True, marks=inputs.marks
        )
        for contact, model in zip(scene.contacts, self.batches.models, strict=True):
            if None in model.functions:
                rule = "have all functions of protocol.ModelFunctions for derivatives of scenes"
                raise InvalidValueError(
                    f"model of contact {contact.name!r}",
                    rule,
                    type(contact.model).__name__,
                )
        self.instants = len(plan.times)
        contacts = len(scene.contacts)
        self._rtol = plan.rtol
        self._atol = plan.atol * self.batches.state_scale
        self.scale = self.batches.state_scale
        self.accuracy = SHARE * plan.rtol**POWER
        """Relative accuracy of each step of the derivatives."""
        wrenches = np.empty((self.instants, contacts, 3))
        loads = np.empty((self.instants, contacts))
        self._output = Output(
            plan.times, np.empty((self.instants, 6)), wrenches, loads, np.empty((0, 0))
        )
        self._limit = (
            plan.max_steps,
            "max_steps steps were taken before the end: raise it, or check the scene",
        )
        self.reached = 0
        """Number of instants that have been recorded."""

    def steps(self, most: float = np.inf) -> Iterator[tuple[System, Path]]:
        """Simulate; yield the ends of the next steps, at most `most`, in arrays that are used again afterwards.

        Raises SolverError if the solver fails, or takes too many steps.
        """
        now = start_of(self.batches.state)
        outcome = rosenbrock.DONE
        n = len(self.scale)
        (left, too_many) = self._limit
        nodes = max(int(min(NUMBERS / n, most)), LEAST_NODES)
        path = Path(
            np.zeros(nodes, np.int64),
            np.zeros(nodes),
            np.zeros((nodes, n)),
            np.zeros((nodes, n)),
        )
        for system in self.batches:
            run = rosenbrock.Run(
                system, RODAS4, self._output, now, rtol=self._rtol, atol=self._atol
            )
            now.cursor[0] = 0
            outcome = rosenbrock.PAUSED
            while outcome == rosenbrock.PAUSED:
                nodes, outcome = paths.follow(run.address, path)
                self.reached = int(now.cursor[1])
                left -= nodes - 1
                if left < 0:
                    raise SolverError(too_many)
                yield system, Path(*(each[:nodes] for each in path))
            del system, run
            if outcome != rosenbrock.DONE:
                break
        if outcome == rosenbrock.STEP_TOO_SMALL:
            raise SolverError(
                "the step size fell below the resolution of time: loosen rtol, or check the scene"
            )

    @property
    def time(self) -> np.ndarray:
        """Instants that have been recorded `[M]` [s]."""
        return self._output.time[: self.reached]

    @property
    def recorded(self) -> tuple[np.ndarray, np.ndarray]:
        """Motion of the body `[M, 6]` and wrenches of the contacts `[M, C, 3]` at these instants."""
        return self._output.body[: self.reached], self._output.wrench[: self.reached]

    @property
    def head(self) -> tuple[Any, ...]:
        """First fields of a `SceneDerivatives` of this motion."""
        return self.inputs.names, self.inputs.columns, self.time, *self.recorded


def pieces_of(path: Path) -> list[tuple[int, int]]:
    """Return the first and the last node on each piece between two breaks that a part of a path crosses."""
    nodes = np.split(
        np.arange(len(path.piece)), np.flatnonzero(np.diff(path.piece)) + 1
    )
    return [(int(each[0]), int(each[-1])) for each in nodes if len(each)]


# ---------------------------------------------------------------------- back along the path


class KeptMotion(MotionPath):
    """A simulated motion with its whole path, along which gradients of costs go back; not for several threads."""

    def __init__(
        self, scene: Scene, inputs: SceneInputs, options: SolverOptions | None
    ) -> None:
        super().__init__(scene, inputs, options)
        if (most := MOST_KEPT // len(self.scale)) < self._limit[0]:
            self._limit = (
                most,
                f"the path has more than {most} steps, too many to keep: lower t_end, or raise rtol",
            )
        steps = self.steps(MOST_NODES)
        self._parts = [
            (system, Path(*(each.copy() for each in path))) for system, path in steps
        ]

    def gradient(self, of_motion: np.ndarray, of_wrenches: np.ndarray) -> np.ndarray:
        """Return the gradient `[P]` of a cost from its derivatives by motion `[M, 6]` and wrenches `[M, C, 3]`."""
        return _Adjoint(self, of_motion, of_wrenches).back(self._parts)


class _Adjoint:
    """The adjoint of a motion on its way back, and the gain of the cost by then."""

    def __init__(
        self, motion: KeptMotion, of_motion: np.ndarray, of_wrenches: np.ndarray
    ) -> None:
        self._bars = of_motion
        self._wrench_bars = of_wrenches
        self._time = motion.time
        self._inputs = motion.inputs
        self._accuracy = motion.accuracy
        self._initial = motion.inputs.start(motion.batches)
        scale = motion.scale
        count, n = self._initial.shape
        self._state = np.zeros(n)
        self._gain = np.zeros(count)
        self._moments = np.zeros((self._inputs.inputs, 2))
        grip = max(
            np.abs(contact.normal_force.values).max()
            for contact in motion.scene.contacts
        )
        of_forces = of_wrenches * grip * np.array([1.0, 1.0, scale[-3] / scale[-1]])
        level = (
            np.abs(np.append(of_motion * scale[-6:], of_forces)).max(initial=0.0) or 1.0
        )
        self._atol = self._accuracy * level / scale
        self._space = workspace_for(1, self._inputs.inputs, n)
        self._known = 0.0
        self._space.record.most[:] = level / self._inputs.input_scale
        self._space.record.left[:] = ALLOWANCE
        self._next = len(self._time) - 1
        """Number of the instant whose cotangents come next."""

    def back(self, parts: list[tuple[System, Path]]) -> np.ndarray:
        """Return the gradient `[P]`, from the path of the motion."""
        for system, path in reversed(parts):
            for first, last in reversed(pieces_of(path)):
                if last > first:
                    self._piece(system, path, first, last)
        return self._inputs.in_order(
            self._gain + (self._initial * self._state).sum(axis=1)
        )

    def _piece(self, system: System, path: Path, first: int, last: int) -> None:
        piece = int(path.piece[first])
        breaks = system.motion.breaks
        begin = float(breaks[piece])
        end = float(breaks[piece + 1])
        since = float(path.since[last])
        reach = float(path.since[first])
        if since == end - begin:
            tangent.forget(system.address, piece, self._state[None, :])
            self._known = 0.0
        drives = self._inputs.at(system, piece)
        place = (system, path, first, last)
        self._moments[:] = 0.0
        while (m := self._next) >= 0 and (
            self._time[m] > begin + reach or self._time[m] == begin == 0.0 == reach
        ):
            instant = min(float(self._time[m]) - begin, since)
            if self._bars[m].any() or self._wrench_bars[m].any():
                self._propagate(*place, drives, since, instant)
                self._jump(*place, drives, instant)
                since = instant
                self._known = 0.0
            self._next -= 1
        self._propagate(*place, drives, since, reach)
        self._gain[: len(drives.kind)] += self._inputs.gained(drives, self._moments)
        if reach == 0.0:
            tangent.settle(system.address, piece, self._state[None, :])
        if reach == 0.0 and system.motion.body_axes:
            columns = np.flatnonzero(drives.kind == tangent.VELOCITY)
            self._gain[columns] += (
                drives.weight[columns, 0] * self._state[drives.place[columns] - 6]
            )
            self._state[-6:-3] = 0.0
            self._known = 0.0

    def _jump(
        self,
        system: System,
        path: Path,
        first: int,
        last: int,
        drives: Drives,
        instant: float,
    ) -> None:
        """Add the cotangents at the next instant, `instant` seconds into the piece."""
        wrenches = self._wrench_bars[self._next]
        if wrenches.any():
            paths.state_at(path, first, last, instant, self._space.record.state)
            at = system.address, int(path.piece[first]), instant, wrenches
            adjoint.jump(*at, self._state, drives, self._moments, self._space.address)
        self._state[-6:] += self._bars[self._next]
        self._space.record.left[:] += PER_JUMP

    def _propagate(
        self,
        system: System,
        path: Path,
        first: int,
        last: int,
        drives: Drives,
        *span: float,
    ) -> None:
        since, until = span
        if until < since:
            stretch = Stretch(first, last, since, until)
            tolerances = Tolerances(self._accuracy, self._atol)
            numbers = (
                self._state,
                drives,
                self._moments,
                self._known,
                tolerances,
                self._space.address,
            )
            adjoint.propagate_back(system.address, path, stretch, *numbers)
            self._known = 1.0
            if self._space.record.left[0] <= 0.0:
                raise SolverError(TOO_SLOW)
