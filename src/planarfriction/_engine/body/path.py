"""The path of a computed motion: the ends of its steps, between which derivatives interpolate its state."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planarfriction._engine.body.body import read, settle_all
from planarfriction._engine.body.integration import read_run
from planarfriction._engine.body.rosenbrock import PAUSED, PIECE, SINCE, STEPS, advance
from planarfriction._engine.body.sdirk import Workspace
from planarfriction._engine.codegen.vectors import copy, put, three
from planarfriction._engine.compiler import jit, kernel
from planarfriction._engine.compiler.calls import call
from planarfriction._engine.compiler.memory import Doubles, Place, at, exists


class Path(NamedTuple):
    """Ends of K accepted steps of a motion; between two of the same piece lies a step."""

    piece: np.ndarray
    """Piece between breaks, int [K]."""
    since: np.ndarray
    """Seconds into the piece, [K]."""
    state: np.ndarray
    """[K, n]; at the end of a piece before a contact whose load ends forgets its bristles."""
    rate: np.ndarray
    """Rate of the state, [K, n]."""


class Stretch(NamedTuple):
    """Part of a piece that derivatives are carried along, in either direction."""

    first: int
    """Nodes of the piece: this one up to `last`."""
    last: int
    begin: float
    """Seconds into the piece."""
    until: float


class Tolerances(NamedTuple):
    """Largest error of derivatives in a step, `rtol |s| + atol`."""

    rtol: float
    atol: np.ndarray
    """[n]"""


@jit
def follow(run: Place, path: Path) -> tuple[int, int]:
    """Go on with the run at an address until it ends or `path` is full; return its number of nodes and the outcome."""
    integration = read_run(run)
    count = 0
    outcome = PAUSED
    system = read(integration.system)
    n = integration.states
    progress = integration.progress
    cursor = progress.cursor
    clock = progress.clock
    counts = progress.statistics
    breaks = system.motion.breaks
    while outcome == PAUSED and count + 2 <= path.piece.shape[0]:
        piece = cursor[PIECE]
        since = clock[SINCE]
        accepted = counts[STEPS]
        starting = count == 0 or path.piece[count - 1] != piece
        if starting:
            if since == 0.0 and exists(system.motion.velocity):
                put(at(progress.y, n - 6), three(at(system.motion.velocity, 3 * piece)))
            if since == 0.0:
                settle_all(system, piece, progress.y)
            path.piece[count] = piece
            path.since[count] = since
            copy(progress.y, path.state[count], n)
        outcome = advance(run, 1)
        if counts[STEPS] == accepted:
            continue
        count += starting
        ended = cursor[PIECE] != piece
        path.piece[count] = piece
        path.since[count] = breaks[piece + 1] - breaks[piece] if ended else clock[SINCE]
        copy(integration.stages.start_rate, path.rate[count - 1], n)
        copy(integration.stages.new, path.state[count], n)
        # Else the next trial evaluates it.
        if ended or outcome != PAUSED or count + 3 > path.piece.shape[0]:
            call(
                system.rates,
                (
                    integration.system,
                    piece,
                    path.since[count],
                    path.state[count],
                    path.rate[count],
                ),
            )
        count += 1
    return count, outcome


@kernel
def interpolate(path: Path, k: int, since: float, state: Doubles) -> None:
    """Write the state at `since` seconds into the piece, in the step after node k: the cubic Hermite interpolant."""
    h = path.since[k + 1] - path.since[k]
    right = (since - path.since[k]) / h
    left = 1.0 - right
    start = path.state[k]
    end = path.state[k + 1]
    start_rate = path.rate[k]
    end_rate = path.rate[k + 1]
    for m in range(path.state.shape[1]):
        bend = (left - right) * (end[m] - start[m]) + h * (
            right * end_rate[m] - left * start_rate[m]
        )
        state[m] = left * start[m] + right * end[m] - left * right * bend


@kernel
def node_after(path: Path, k: int, last: int, since: float) -> int:
    """Return the last node from k on, but for `last`, that is not behind `since`."""
    while k + 1 < last and path.since[k + 1] <= since:
        k += 1
    return k


@kernel
def node_before(path: Path, k: int, first: int, since: float) -> int:
    """Return the last node up to k, but from `first` on, that is before `since`."""
    while k > first and path.since[k] >= since:
        k -= 1
    return k


@kernel
def hold(
    address: Place, path: Path, k: int, since: float, shift: float, w: Workspace
) -> None:
    """Hold the state in the step after node k: interpolate it into `w.state`, linearise there, factor."""
    system = read(address)
    piece = path.piece[k]
    interpolate(path, k, since, w.state)
    call(system.linearise, (address, piece, since, w.state, w.rate))
    call(system.factor, (address, piece, since, w.state, shift))


@jit
def state_at(
    path: Path, first: int, last: int, since: float, state: np.ndarray
) -> None:
    """Write the state at `since` seconds into the piece whose nodes are `first` to `last` of a path."""
    interpolate(path, node_after(path, first, last, since), since, state)
