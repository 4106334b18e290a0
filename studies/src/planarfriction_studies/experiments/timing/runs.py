"""Timed runs: whole in-hand runs as in the paper's table, and solvers against each other on a window."""

from __future__ import annotations

import functools
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from planarfriction.scenes import Scene, in_hand, simulate
from planarfriction.solvers import RODAS3, RODAS4
from planarfriction_studies.bench.baselines import LSODA, Poses, Window
from planarfriction_studies.experiments.experiment import (
    Arrays,
    Work,
    median_and_quartiles,
)
from planarfriction_studies.experiments.load_dependent.run import (
    DISTRIBUTED,
    REBUILT,
    RESCALED,
    soft_scene,
)
from planarfriction_studies.experiments.runs import published_model

ATOL_PER_RTOL = 30.0
"""Absolute tolerance, as a share of the natural scales, over the relative one: between those of the ready scenes."""

REFERENCE = 1e-10
"""Relative tolerance of the solution that errors are measured from."""

ENOUGH, MOST_REPEATS = 1.0, 9
"""Runs are repeated until this time [s] is spent, so that what takes longer runs once, and at most so often."""

BREAKAWAY, QUICK_WINDOW = (0.36, 0.38), (0.36, 0.37)
"""Window [s] in which the plate breaks away, for general solvers of the distributed model, and that of a quick look."""

STRUCTURED = {"RODAS3": RODAS3, "RODAS4": RODAS4}
"""Our methods by name."""


ROWS: dict[str, dict[str, Callable[[], Scene]]] = {
    row: {"distributed": distributed, "reduced": reduced}
    for row, distributed, reduced in (
        ("disc, shape independent of the load",
         lambda: in_hand(published_model("d", "Circle")), lambda: in_hand(published_model("r", "Circle"))),
        ("k = 2", lambda: soft_scene(1, DISTRIBUTED), lambda: soft_scene(1, RESCALED)),
        ("k = 2 f_N", lambda: soft_scene(2, DISTRIBUTED), lambda: soft_scene(2, REBUILT)),
    )
}  # fmt: skip
"""Rows of the published table, and what makes their scenes: with models that have computed nothing yet."""

CIRCLE = next(iter(ROWS))
"""The row without a load-dependent shape."""


@dataclass(frozen=True, eq=False)
class Problem:
    """Problem that solvers are compared on."""

    kind: str
    """"distributed" or "reduced"."""
    span: tuple[float, float]
    """Begin and end [s]."""
    tolerances: dict[str, tuple[float, ...]]
    """Solver -> relative tolerances."""

    @property
    def name(self) -> str:
        """Model and span in words."""
        return f"{self.kind}, {self.span[0]:g} to {self.span[1]:g} s"

    @functools.cached_property
    def window(self) -> Window:
        """The scene between the two times."""
        return Window.of(ROWS[CIRCLE][self.kind](), *self.span)


def problems(work: Work) -> list[Problem]:
    """Return the problems. Reduced: the whole run; distributed: a short window, without Radau, which takes a minute for
    it, unless all is wanted. A quick look takes a short window for both."""
    if work.quick:
        tolerances = {"RODAS4": (1e-6,), "LSODA": (1e-6,)}
        with_radau = {**tolerances, "Radau": (1e-6,)}
        return [
            Problem("reduced", QUICK_WINDOW, with_radau),
            Problem("distributed", QUICK_WINDOW, tolerances),
        ]
    several = dict.fromkeys(STRUCTURED, (1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8)) | {
        "LSODA": (1e-4, 1e-6, 1e-8)
    }
    reduced, distributed = (
        ((1e-4, 1e-6, 1e-8),) * 2 if work.full else ((1e-4, 1e-6), ())
    )
    return [
        Problem("reduced", (0.0, 2.0), {**several, "Radau": reduced}),
        Problem(
            "distributed",
            BREAKAWAY,
            several | ({"Radau": distributed} if distributed else {}),
        ),
    ]


def solve(problem: Problem, solver: str, tolerance: float) -> Poses:
    """Solve one run; absolute tolerances are the same share of the natural scales for all solvers."""
    window = problem.window
    atol = ATOL_PER_RTOL * tolerance
    if solver in STRUCTURED:
        return window.ours(rtol=tolerance, atol=atol, method=STRUCTURED[solver])[0]
    return window.general(
        method=solver, rtol=tolerance, atol=atol * window.packed.state_scale
    )


def reference(problem: Problem, work: Work) -> np.ndarray:
    """Return poses at the ends of the window's pieces, [S, 3], by RODAS4 at a tight tolerance."""
    label = f"timing, {problem.name}, reference"
    return work.piece(
        label, lambda: {"poses": solve(problem, "RODAS4", REFERENCE).poses}
    )["poses"]


def work_precision(problem: Problem, work: Work) -> dict[tuple[str, float], Arrays]:
    """Return by solver and tolerance `time` [s] (median, quartiles), `poses`, `evaluations`, `repeats`."""
    found = {}
    for solver, tolerances in problem.tolerances.items():
        for tolerance in tolerances:
            label = f"timing, {problem.name}, {solver} at {tolerance:.0e}"
            action = functools.partial(solve, problem, solver, tolerance)
            compute = functools.partial(
                _repeated, action, 1 if work.quick else MOST_REPEATS
            )
            found[solver, tolerance] = work.piece(label, compute)
    return found


def _repeated(action: Callable[[], Poses], repeats: int) -> dict[str, Any]:
    poses = action()
    times = [poses.wall_time]
    while sum(times) < ENOUGH and len(times) < repeats:
        times.append(action().wall_time)
    return {
        "time": median_and_quartiles(times),
        "poses": poses.poses,
        "evaluations": poses.evaluations,
        "repeats": len(times),
    }


def whole_runs(scene: Callable[[], Scene], repeats: int) -> dict[str, Any]:
    """Time `simulate` at default tolerances, tables included: `time`, `solver` [s] (median, quartiles), `trials`."""
    simulate(scene(), t_end=0.02)  # compiles
    totals = []
    solver = []
    trials = 0
    while sum(totals) < ENOUGH and len(totals) < repeats:
        fresh = scene()
        begin = time.perf_counter()
        run = simulate(fresh).statistics
        totals.append(time.perf_counter() - begin - run.compile_time)
        solver.append(run.wall_time)
        trials = run.steps + run.rejections
    return {
        "time": median_and_quartiles(totals),
        "solver": median_and_quartiles(solver),
        "trials": trials,
    }


def beside_lsoda(
    scene: Callable[[], Scene], begin: float, end: float
) -> dict[str, Any]:
    """Time `lsoda` as published and `ours` at default tolerances over a window [s] (median, quartiles)."""
    fresh = scene()
    window = Window.of(fresh, begin, end)
    ours = [
        window.ours(rtol=fresh.rtol, atol=fresh.atol)[0].wall_time
        for _ in range(MOST_REPEATS)
    ]
    lsoda = _repeated(lambda: window.general(**LSODA), MOST_REPEATS)["time"]
    return {"lsoda": lsoda, "ours": median_and_quartiles(ours)}


def position_error(poses: np.ndarray, reference: np.ndarray) -> float:
    """Return the largest distance between two histories of the centre of mass [m]."""
    return float(np.hypot(*(poses - reference)[:, :2].T).max())


def angle_error(poses: np.ndarray, reference: np.ndarray) -> float:
    """Return the largest difference of the angle [rad]."""
    return float(np.abs(poses - reference)[:, 2].max())


def cheapest(
    points: Sequence[tuple[float, list[float]]], error: float
) -> list[float] | None:
    """Return the shortest times (median first) among points (error, times) at least as good as `error`, or None."""
    return min((times for found, times in points if found <= error), default=None)
