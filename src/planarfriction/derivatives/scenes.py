"""Derivatives of a simulated scene by friction, size, mass, loads and start: forward for all of its motion, and reverse
for one cost, whatever the number of knots."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from planarfriction._engine.body import path as paths
from planarfriction._engine.body import tangent
from planarfriction._engine.body.body import System
from planarfriction._engine.body.path import Path, Stretch, Tolerances
from planarfriction._engine.body.sdirk import workspace_for
from planarfriction._engine.body.tangent import Drives
from planarfriction._support import validation
from planarfriction.derivatives.path import (
    KeptMotion,
    MotionPath,
    SceneDerivatives,
    pieces_of,
)
from planarfriction.derivatives.scene_inputs import SceneInputs
from planarfriction.errors import InvalidValueError
from planarfriction.scenes.scene import Scene, SolverOptions


@dataclass(frozen=True, eq=False)
class SceneSensitivities(SceneDerivatives):
    """A motion and its derivatives with respect to P numbers (see `SceneDerivatives`)."""

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
    options: SolverOptions | None = None,
) -> SceneSensitivities:
    """Compute derivatives of a simulated motion by the scene's parameters, its signals and its initial state.

    `parameters` are factors (see `SCENE_PARAMETERS`). `signals` gives knots [s] by the name of a signal: `force`,
    `velocity`, or `NAME.normal_force` for the contact of that name. The derivative is with respect to a number added to
    the signal at the knot and interpolated in time like the signal's own samples (`hold`): `sum_k d_k hat_k(t)`. If the
    knots are the times of the samples, it is the derivative with respect to the sampled values. `initial` names
    components of the body's initial state: vx, vy, omega, x, y, theta.

    The scene is simulated with tight tolerances (`options`; 1e-9 by default). Along the accepted steps the variational
    equation `s' = J s + df/dp` is solved with the solver's own analytic Jacobian, by an L-stable method of order 4
    whose steps span several steps of the motion, each accurate to `0.1 rtol^(2/3)` of the derivatives. At the default
    tolerance the derivatives agree with central differences of tight simulations to 1e-5 of the largest, to 5e-5 with
    tables, whose Jacobian jumps from cell to cell, and to 5e-4 with elasto-plastic bristles that begin to yield.

    A bristle that begins to slip or to stick bends the right-hand side but does not make it jump: the derivative
    continues through such a transition, and describes a motion that makes the same transitions slightly earlier or
    later. It is large if the motion depends very sensitively on friction, as in a slip that barely happens. On a kink
    (a velocity that stays zero, the edge of a table's cell) it is the derivative of one side. The instants at which
    signals jump, and at which a slide counts as stopped, are held fixed.

    Raises `InvalidValueError` for unknown names or numbers out of range, and `SolverError` if the solver fails.
    """
    motion = MotionPath(
        scene, SceneInputs(scene, parameters, signals, initial), options
    )
    tangents = _Tangents(motion)
    for system, path in motion.steps():
        tangents.carry(system, path)
        del system, path  # the next batch of segments is packed when this one is gone
    slopes = (
        motion.inputs.in_order(values[: motion.reached]) for values in tangents.recorded
    )
    return SceneSensitivities(*motion.head, *slopes)


class _Tangents:
    """Derivatives of a motion `[P, n]`, carried along its steps and recorded at instants."""

    def __init__(self, motion: MotionPath) -> None:
        self._motion = motion
        self._inputs = motion.inputs
        self._slopes = motion.inputs.start(motion.batches)
        inputs = motion.inputs.inputs
        (count, n) = self._slopes.shape
        instants = motion.instants
        contacts = len(motion.batches.models)
        self._space = workspace_for(count, inputs, n)
        self._atol = motion.accuracy * motion.scale
        self._state = np.empty(n)
        self._scratch = np.empty((3, n))
        self._wrench = np.empty((contacts, 3))
        self.recorded = (
            np.zeros((instants, 6, count)),
            np.zeros((instants, contacts, 3, count)),
        )
        """Derivatives of motion and wrenches at the instants."""
        self._next = 0
        """Number of the instant to be recorded next."""

    def carry(self, system: System, path: Path) -> None:
        """Go along a part of the path, and record the instants that the motion has recorded on it."""
        breaks = system.motion.breaks
        instants = self._motion.time
        for first, last in pieces_of(path):
            piece = int(path.piece[first])
            since = float(path.since[first])
            reach = float(path.since[last])
            begin = breaks[piece]
            length = breaks[piece + 1] - breaks[piece]
            time = breaks[piece + 1] if reach == length else begin + reach
            drives = self._inputs.at(system, piece)
            if since == 0.0:
                self._inputs.begin(drives, self._slopes)
                tangent.settle(system.address, piece, self._slopes)
            while self._next < len(instants) and instants[self._next] <= time:
                goal = instants[self._next]
                instant = reach if goal == time else float(goal - begin)
                self._propagate(
                    system, path, drives, Stretch(first, last, since, instant)
                )
                self._record(system, path, drives, first, last, instant)
                since = instant
            self._propagate(system, path, drives, Stretch(first, last, since, reach))
            if reach == length:
                tangent.forget(system.address, piece, self._slopes)

    def _propagate(
        self, system: System, path: Path, drives: Drives, stretch: Stretch
    ) -> None:
        tolerances = Tolerances(self._motion.accuracy, self._atol)
        tangent.propagate(
            system.address,
            path,
            stretch,
            self._slopes,
            drives,
            tolerances,
            self._space.address,
        )

    def _record(
        self,
        system: System,
        path: Path,
        drives: Drives,
        first: int,
        last: int,
        since: float,
    ) -> None:
        d_motion, d_wrenches = (values[self._next] for values in self.recorded)
        paths.state_at(path, first, last, since, self._state)
        at = (
            system.address,
            int(path.piece[first]),
            since,
            self._state,
            drives,
            self._slopes,
        )
        tangent.wrench_slopes(*at, self._wrench, d_wrenches, self._scratch)
        d_motion[:] = self._slopes[:, -6:].T
        self._next += 1


# ---------------------------------------------------------------------- backwards

Cotangent = Callable[[np.ndarray, np.ndarray], np.ndarray]
"""Function of times `[M]` and recorded values `[M, ...]` that returns the derivatives of a cost by these values."""


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

    `parameters`, `signals`, `initial` and `options` are as in `scene_sensitivities`. `cotangent(time, motion)` takes
    the times `[M]` and the motion `[M, 6]` and returns `dcost/dmotion` `[M, 6]`; `wrench_cotangent(time, wrenches)`
    adds `dcost/dwrenches` `[M, C, 3]` for the wrench of one of the identical contacts. The adjoint `-l' = J' l` runs
    backwards over the accepted steps, jumps by these cotangents at each instant, and accumulates `int l' df/dp dt`. It
    takes as long as one derivative, whatever the number of knots.

    Raises `InvalidValueError` as `scene_sensitivities` does, and `SolverError` if the solver fails, or if the adjoint
    needs many more steps than the motion.
    """
    functions = {"cotangent": cotangent, "wrench_cotangent": wrench_cotangent}
    for name, function in functions.items():
        wrong = isinstance(function, type) or not callable(function)
        if wrong and (function is not None or cotangent is wrench_cotangent):
            raise InvalidValueError(
                name, "be a function of time and motion, or wrenches", function
            )
    motion = KeptMotion(
        scene, SceneInputs(scene, parameters, signals, initial), options
    )
    bars = [
        np.zeros_like(values)
        if function is None
        else validation.array(
            f"{name} of the cost", function(motion.time, values), values.shape
        )
        for (name, function), values in zip(
            functions.items(), motion.recorded, strict=True
        )
    ]
    return SceneGradient(*motion.head, gradient=motion.gradient(*bars))
