"""Forward sensitivities of a simulated scene: how its motion and wrenches change with friction, size, mass and load."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from planarfriction import validation
from planarfriction.errors import InvalidValueError, SolverError
from planarfriction.kernels import rosenbrock, tangent
from planarfriction.kernels.body import workspace
from planarfriction.kernels.rosenbrock import Output
from planarfriction.scenes.packing import PackedScene, pack
from planarfriction.scenes.scene import Scene
from planarfriction.scenes.simulation import recording_times
from planarfriction.solvers import RODAS4

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

_FIRST_STEP = 1e-6
"""First trial step [s], as in `solvers.structured`."""

_CLOCK = 1e-12
"""Share of a step by which adding times up may be off."""


@dataclass(frozen=True)
class SceneSensitivities:
    """A motion and its derivatives with respect to P factors; divide by a parameter's value for the derivative to it."""

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


class _Steps(NamedTuple):
    """Accepted steps of a run."""

    piece: np.ndarray
    """Piece between breaks that each step lies in, int [T]."""
    since: np.ndarray
    """Seconds into it at the start, [T]."""
    step: np.ndarray
    """Length [s], [T]."""
    start: np.ndarray
    """States at the start, [T, n]."""
    end: np.ndarray
    """States at the end, before a contact whose load ends forgets its bristles, [T, n]."""


def scene_sensitivities(
    scene: Scene,
    names: Sequence[str] = ("mu", "r", "mass", "load"),
    *,
    t_end: float | None = None,
    rtol: float = 1e-8,
    atol: float | None = None,
    save_every: float | None = None,
) -> SceneSensitivities:
    """Derivatives of a simulated motion with respect to factors on the scene's parameters (see `SCENE_PARAMETERS`).

    The scene is simulated with tight tolerances (`atol` as in `simulate`; default `rtol`); on the steps that were
    accepted the variational equation `s' = J s + df/dp` is then solved with the solver's own analytic Jacobian, to
    order 4. At every step of the motion this costs some five evaluations and, per factor, five solves.

    A bristle that begins to slip or sticks again bends the right-hand side but does not jump it, so that the
    derivative goes on through every transition: just before a slip it grows with the speed at which the bristles give
    way, and a late slip may leave it large, as the motion itself depends strongly on friction there. Where the motion
    meets a kink (the edge of a cell of the published table, a body at rest) it is the derivative of one side. The
    instants at which signals jump and at which a slide counts as stopped are held.

    Raises `InvalidValueError` for unknown names or numbers out of range, and `SolverError` where the solver gives up.
    """
    if not isinstance(scene, Scene):
        raise InvalidValueError("scene", "be a Scene", type(scene).__name__)
    chosen = np.array([SCENE_PARAMETERS[validation.choice("names", name, SCENE_PARAMETERS)] for name in names], int)
    end = scene.t_end if t_end is None else validation.positive("t_end", t_end)
    if end > scene.t_end:
        raise InvalidValueError("t_end", f"be at most the scene's {scene.t_end:g} s", end)
    every = scene.save_every if save_every is None else validation.positive("save_every", save_every)
    packed = pack(scene, end)
    times = recording_times(end, every, packed.motion.breaks)
    absolute = (validation.positive("rtol", rtol) if atol is None else validation.positive("atol", atol)) * packed.natural
    steps, last = _run(packed, times, rtol, absolute)
    return _carry(packed, steps, times[: len(last)], last, tuple(names), chosen)


def _run(packed: PackedScene, times: np.ndarray, rtol: float, atol: np.ndarray) -> tuple[_Steps, np.ndarray]:
    """The accepted steps, one of which ends at each recording time, and how many steps lead to each time."""
    contacts, motion, y = packed.contacts, packed.motion, packed.state.copy()
    stages, work = rosenbrock.stages_for(RODAS4, len(y)), workspace(contacts)
    cursor, clock, counts = np.zeros(2, np.int64), np.array([0.0, _FIRST_STEP, np.inf]), np.zeros(4, np.int64)
    many = len(contacts.kind)
    nothing = Output(np.array([np.inf]), np.empty((1, 6)), np.empty((1, many, 3)), np.empty((1, many)), np.empty((0, 0)))
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
        outcome = rosenbrock.advance(
            contacts, motion, RODAS4, nothing, y, cursor, clock, rtol, atol, 1, counts, stages, work
        )
        if int(counts[rosenbrock.STEPS]) == accepted:
            continue
        ended = int(cursor[0]) != piece
        length = (breaks[piece + 1] - begin if ended else float(clock[0])) - since
        pieces.append(piece)
        sinces.append(since)
        lengths.append(length)
        starts.append(before)
        ends.append(stages.new.copy())
        if 2.0 * proposed > room:
            clock[1] = max(clock[1], proposed)
        at_break = ended and times[len(until)] <= breaks[piece + 1]
        if at_break or length >= (1.0 - _CLOCK) * room or outcome == rosenbrock.AT_REST:
            until.append(len(pieces))
    if outcome == rosenbrock.STEP_TOO_SMALL:
        raise SolverError("the step size fell below the resolution of time: loosen rtol, or check the scene")
    steps = _Steps(np.array(pieces), np.array(sinces), np.array(lengths), np.array(starts), np.array(ends))
    return steps, np.array(until)


def _carry(
    packed: PackedScene, steps: _Steps, times: np.ndarray, until: np.ndarray, names: tuple[str, ...], chosen: np.ndarray
) -> SceneSensitivities:
    """Solve the variational equation along the steps, and evaluate it where `until` says."""
    contacts, motion = packed.contacts, packed.motion
    n, count, many = len(packed.state), len(chosen), len(contacts.kind)
    work, vectors = workspace(contacts), np.zeros((6, n))
    slope, forcing, stages = np.zeros((count, n)), np.zeros((count, n)), np.zeros((count, 5, n))
    bodies, wrenches = np.empty((len(times), 6)), np.empty((len(times), many, 3))
    d_bodies, d_wrenches = np.zeros((len(times), 6, count)), np.zeros((len(times), many, 3, count))
    reached = times.copy()
    for m in range(len(times)):
        if m:
            tangent.propagate(
                contacts, motion, *steps, until[m - 1], until[m], chosen, slope, forcing, stages, vectors, work
            )
        last = max(until[m] - 1, 0)
        piece, at = int(steps.piece[last]), steps.since[last] + (steps.step[last] if m else 0.0)
        state = steps.end[last] if m else steps.start[0]
        reached[m] = motion.breaks[piece] + at
        tangent.wrench_slopes(
            contacts, motion, piece, at, state, chosen, slope, wrenches[m], d_wrenches[m], vectors, work
        )
        bodies[m], d_bodies[m] = state[-6:], slope[:, -6:].T
    return SceneSensitivities(names, reached, bodies, wrenches, d_bodies, d_wrenches)
