"""Forward sensitivities of a simulated scene: how its motion and wrenches change with friction, size, mass and load."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from planarfriction import validation
from planarfriction.equality import ByValue
from planarfriction.errors import InvalidValueError, SolverError
from planarfriction.kernels import rosenbrock, tangent
from planarfriction.kernels.integration import Output, run_of
from planarfriction.kernels.tangent import Path
from planarfriction.patch.metric import refuse_anisotropy
from planarfriction.scenes.packing import PackedScene, pack
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
    chosen = np.array([SCENE_PARAMETERS[validation.choice("names", name, SCENE_PARAMETERS)] for name in names], int)
    end = scene.t_end if t_end is None else validation.positive("t_end", t_end)
    if end > scene.t_end:
        raise InvalidValueError("t_end", f"be at most the scene's {scene.t_end:g} s", end)
    every = scene.save_every if save_every is None else validation.positive("save_every", save_every)
    for contact in scene.contacts:
        refuse_anisotropy(contact.model.patch, "scene_sensitivities")
    packed = pack(scene, end, sensitivities=True)
    times = recording_times(end, every, packed.system.motion.breaks)
    absolute = (
        validation.positive("rtol", rtol) if atol is None else validation.positive("atol", atol)
    ) * packed.natural
    path, until = _run(packed, times, rtol, absolute, chosen)
    return _carry(packed, path, until, tuple(names))


def _run(
    packed: PackedScene, times: np.ndarray, rtol: float, atol: np.ndarray, parameters: np.ndarray
) -> tuple[Path, np.ndarray]:
    """The accepted steps, one of which ends at each recording time, and how many steps lead to each time."""
    system, motion, progress = packed.system, packed.system.motion, start_of(packed.state)
    y, cursor, clock, counts = progress
    many = len(packed.models)
    nothing = Output(
        np.array([np.inf]), np.empty((1, 6)), np.empty((1, many, 3)), np.empty((1, many)), np.empty((0, 0))
    )
    run = run_of(system, RODAS4, nothing, progress, rtol=rtol, atol=atol)
    pieces, sinces, lengths, starts, ends, until = [], [], [], [], [], [0]
    outcome, breaks = rosenbrock.PAUSED, motion.breaks
    if len(motion.velocity):
        y[-6:-3] = motion.velocity[0]
    while outcome == rosenbrock.PAUSED:
        piece, since, proposed = int(cursor[0]), float(clock[0]), float(clock[1])
        begin, before, accepted = breaks[piece], y.copy(), int(counts[rosenbrock.STEPS])
        room = times[len(until)] - begin - since if times[len(until)] < breaks[piece + 1] else np.inf
        if 2.0 * proposed > room:  # end there, or halve what is left, as before a break
            clock[1] = room if proposed >= room else 0.5 * room
        outcome = rosenbrock.advance(run.address, 1)
        if int(counts[rosenbrock.STEPS]) == accepted:
            continue
        ended = int(cursor[0]) != piece
        length = (breaks[piece + 1] - begin if ended else float(clock[0])) - since
        pieces.append(piece)
        sinces.append(since)
        lengths.append(length)
        starts.append(before)
        ends.append(run.stages.new.copy())
        if 2.0 * proposed > room:
            clock[1] = max(clock[1], proposed)
        at_break = ended and times[len(until)] <= breaks[piece + 1]
        if at_break or length >= (1.0 - _CLOCK) * room or outcome == rosenbrock.AT_REST:
            until.append(len(pieces))
    if outcome == rosenbrock.STEP_TOO_SMALL:
        raise SolverError("the step size fell below the resolution of time: loosen rtol, or check the scene")
    path = Path(*map(np.array, (pieces, sinces, lengths, starts, ends)), parameters)  # pyright: ignore[reportCallIssue]
    return path, np.array(until)


def _carry(packed: PackedScene, path: Path, until: np.ndarray, names: tuple[str, ...]) -> SceneSensitivities:
    """Solve the variational equation along the steps, and evaluate it where `until` says."""
    system = packed.system
    n, count, many, instants = len(packed.state), len(names), len(packed.models), len(until)
    space, atol = tangent.slopes_for(count, n), _ACCURACY * packed.natural
    slope, scratch, times = np.zeros((count, n)), np.empty((2, n)), np.empty(instants)
    bodies, wrenches = np.empty((instants, 6)), np.empty((instants, many, 3))
    d_bodies, d_wrenches = np.zeros((instants, 6, count)), np.zeros((instants, many, 3, count))
    for m in range(instants):
        last, done = max(until[m] - 1, 0), 1.0
        if m:
            tangent.propagate(system.address, path, until[m - 1], until[m], slope, _ACCURACY, atol, space)
        else:
            done = 0.0
        piece, at = int(path.piece[last]), float(path.since[last] + done * path.step[last])
        state = path.end[last] if m else path.start[0]
        tangent.wrench_slopes(
            system.address, piece, at, state, path.parameters, slope, wrenches[m], d_wrenches[m], scratch
        )
        times[m], bodies[m], d_bodies[m] = system.motion.breaks[piece] + at, state[-6:], slope[:, -6:].T
    return SceneSensitivities(names, times, bodies, wrenches, d_bodies, d_wrenches)
