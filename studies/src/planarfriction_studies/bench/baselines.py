"""Baseline solvers: SciPy's solver on the same compiled right-hand side over a window of a scene."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from planarfriction.extend import Method, Output, System
from planarfriction.scenes import Scene
from planarfriction.scenes.packing import MOST_PIECES, SegmentBatches
from planarfriction.solvers import RODAS4, Statistics, integrate

LSODA: dict[str, Any] = {
    "method": "LSODA",
    "rtol": 1e-6,
    "atol": 1e-8,
    "max_step": 1e-3,
}
"""Settings of the general solver, as published."""

START_TOLERANCE = 1e-8
"""Tolerance of the run up to the begin of a window [-]."""


class Poses(NamedTuple):
    """Poses found by a solver."""

    wall_time: float
    """Time in the solver, without compilation [s]."""
    poses: np.ndarray
    """x [m], y [m] and angle [rad] of the body at the end of each piece between jumps, [S, 3]."""
    evaluations: int
    """Evaluations of the right-hand side, those for differences in Jacobians included."""


class PackedScene(NamedTuple):
    """A scene as the solvers see it."""

    system: System
    state: np.ndarray
    """Bristles as the scene starts, body velocity, pose."""
    state_scale: np.ndarray
    """Natural scale of each state (see `SegmentBatches.state_scale`)."""
    contacts: int
    """Number of contacts."""


@dataclass(frozen=True)
class Window:
    """A scene between two jumps of its signals, as the solvers see it."""

    packed: PackedScene
    """Motion on the pieces of the window, and the state at its begin."""

    @classmethod
    def of(cls, scene: Scene, begin: float, end: float) -> Window:
        """Make the window from `begin` to `end` [s]: 0 or jumps of a signal, or the end of the scene."""
        whole = SegmentBatches(scene, end, most=MOST_PIECES)
        packed = PackedScene(
            next(iter(whole)), whole.state, whole.state_scale, len(whole.models)
        )
        breaks = packed.system.motion.breaks
        first = int(np.argmin(np.abs(breaks - begin)))
        assert abs(breaks[first] - begin) < 1e-9, f"no jump at {begin} s"
        if first == 0:
            return cls(packed)
        before = _pieces(packed, slice(0, first))
        output = _output(before, breaks[first : first + 1], bristles=True)
        tolerance = START_TOLERANCE * before.state_scale
        run = integrate(
            [before.system],
            output,
            before.state,
            method=RODAS4,
            rtol=START_TOLERANCE,
            atol=tolerance,
        )
        assert run.status == "success", run.message
        state = np.concatenate([run.output.bristles[-1], run.output.body[-1]])
        return cls(_pieces(packed._replace(state=state), slice(first, len(breaks) - 1)))

    @property
    def ends(self) -> np.ndarray:
        """Ends of the pieces between jumps [s], [S]."""
        return self.packed.system.motion.breaks[1:]

    @property
    def states(self) -> int:
        """Number of states."""
        return len(self.packed.state)

    def ours(
        self, *, rtol: float, atol: float, method: Method = RODAS4
    ) -> tuple[Poses, Statistics]:
        """Solve with the structured solver; `atol` is a share of the natural scales."""
        packed = self.packed
        output = _output(packed, self.ends, bristles=False)
        run = integrate(
            [packed.system],
            output,
            packed.state,
            method=method,
            rtol=rtol,
            atol=atol * packed.state_scale,
        )
        assert run.status == "success", run.message
        return Poses(
            run.statistics.wall_time, run.output.body[:, 3:], run.statistics.evaluations
        ), run.statistics

    def general(
        self, *, method: str, rtol: float, atol: Any, max_step: float = np.inf
    ) -> Poses:
        """Solve with a method of SciPy's `solve_ivp`, restarted at every jump; `atol` in the units of the states."""
        from scipy.integrate import solve_ivp

        from planarfriction.extend import right_hand_side

        system = self.packed.system
        y = self.packed.state.copy()

        def rate(since: float, y: np.ndarray, piece: int) -> np.ndarray:
            nonlocal evaluations
            evaluations += 1  # SciPy's own count leaves out what Radau's Jacobians need
            dy = np.empty(len(y))
            right_hand_side(system.address, piece, since, np.ascontiguousarray(y), dy)
            return dy

        options = {"method": method, "rtol": rtol, "atol": atol, "max_step": max_step}
        poses = []
        evaluations = -1
        rate(0.0, y, 0)  # compiles
        begin = time.perf_counter()
        for piece, length in enumerate(np.diff(system.motion.breaks)):
            solution = solve_ivp(
                rate, (0.0, length), y, t_eval=[length], args=(piece,), **options
            )
            assert solution.success, solution.message
            y = solution.y[:, -1]
            poses.append(y[-3:])
        return Poses(time.perf_counter() - begin, np.array(poses), evaluations)


def lsoda_time(scene: Scene, t_end: float) -> float:
    """Measure the processor time of SciPy's LSODA, as published, over the scene from 0 to `t_end` [s]."""
    window = Window.of(scene, 0.0, t_end)
    begin = time.process_time()
    window.general(**LSODA)
    return time.process_time() - begin


def _pieces(packed: PackedScene, kept: slice) -> PackedScene:
    """Return the pieces `kept` of the motion."""
    motion = packed.system.motion
    per_piece = {
        name: getattr(motion, name)[kept]
        for name in ("load", "force", "acceleration", "row")
    }
    velocity = motion.velocity[kept] if len(motion.velocity) else motion.velocity
    breaks = motion.breaks[kept.start : kept.stop + 1]
    motion = motion._replace(breaks=breaks, velocity=velocity, **per_piece)
    return packed._replace(
        system=System(packed.system.contacts, motion, packed.system.keepalive)
    )


def _output(packed: PackedScene, times: np.ndarray, *, bristles: bool) -> Output:
    count = len(times)
    contacts = packed.contacts
    states = (count, len(packed.state) - 6) if bristles else (0, 0)
    return Output(
        times.copy(),
        *map(np.empty, ((count, 6), (count, contacts, 3), (count, contacts), states)),
    )
