"""Problems of the step in contact space as rows of words (see `coupled.coupling`)."""

from __future__ import annotations

from typing import NamedTuple

from planarfriction._engine.compiler.memory import (
    Doubles,
    Integers,
    Layout,
    offsets_of,
    reader,
)
from planarfriction._engine.protocol import SLOPES


class ContactSolve(NamedTuple):
    """A problem of k patches."""

    dt: Doubles
    """Length of the step [s], [1]."""
    tolerance: Doubles
    """Tolerance of the twists [m/s], [1]."""
    most: Doubles
    """Iterations of an attempt at most, [1]."""
    again: Doubles
    """1 if what does not converge is tried again, and restrained if that fails too, else 0, [1]."""
    response: Doubles
    """A, [3k, 3k]."""
    mobility: Doubles
    """Velocities that the body under patches which are `rigid` gains by a unit wrench, [3]."""
    load_response: Doubles
    """B, [k, 3k]."""
    free_twist: Doubles
    """V_0, [3k]."""
    free_load: Doubles
    """N_0, [k]."""
    guess: Doubles
    """W_0, [3k]."""
    moments: Doubles
    """Moments of the normal forces at W_0, about the patches' origins, [2k] (see `following`)."""
    support: Doubles
    """Rectangle that bears each patch whose pressure follows: centre, cosine and sine of its first axis, half widths,
    [6k]; half widths of 0 for all of it."""
    follows: Doubles
    """1 of patches whose pressure follows these, -1 of those that keep that of the last solution, else 0, [k]."""
    state: Doubles
    """State at the start of the step."""
    records: Integers
    """Addresses of the patches' records, [k]; 0 of one that carries nothing at its load."""
    wrench: Doubles
    """W, [3k]; comes in as a first guess."""
    twist: Doubles
    """V, [3k]."""
    load: Doubles
    """N, [k]."""
    new: Doubles
    """State at the end of the step."""
    iterations: Doubles
    """Number of iterations, [1]; `INVALID` where a number is out of range, or negative where it must not be."""
    residual: Doubles
    """Residual [m/s], [1]."""
    converged: Doubles
    """1 or 0, [1]."""
    unit: Doubles
    """Wrenches of the models per unit load, [3k]; this and all that follows is scratch."""
    unit_loaded: Doubles
    """Slopes of the wrenches by the loads, [3k]: `unit` but for pads."""
    unit_slopes: Doubles
    """Slopes of the wrenches per unit load, [k, 9]."""
    slopes: Doubles
    """P, [k, 9]."""
    twist_0: Doubles
    """V at W = 0, [3k]."""
    load_0: Doubles
    """N at W = 0, [k]."""
    scale: Doubles
    """Twists of unit energy, [3k]."""
    gap: Doubles
    """Difference between the twists that wrenches cause and V, [3k]."""
    change: Doubles
    """dW, [3k]."""
    move: Doubles
    """A dW, [3k]."""
    start: Doubles
    """W before a step, [3k]."""
    best_twist: Doubles
    """V of the least residual so far, [3k]."""
    best_load: Doubles
    """N of the least residual so far, [k]."""
    kept_twist: Doubles
    """V of the first attempt, [3k]."""
    kept_load: Doubles
    """N of the first attempt, [k]."""
    matrix: Doubles
    """Matrix of the Newton step, [3k, 3k]."""
    step: Doubles
    """Result of a patch's step (see `protocol.StepFunctions`)."""
    seen: Doubles
    """Twist that a patch sees and its load, [4]."""
    turned: Doubles
    """Scratch of `leave_out_rising`, [2, 9]."""
    host: Doubles
    """Numbers of the host while faces of pads are in their place (see `face`), [k, 12]."""
    acting: Integers
    """Addresses of the records that act in this step, [k]."""
    shift: Doubles
    """Displacements of patches that follow as a whole, [2k]."""
    weights: Doubles
    """Weights of the points of all patches that can follow."""
    copies: Integers
    """Records of the patches among these whose points are cells."""
    moved: Doubles
    """Numbers of the discs of these."""


Offsets = offsets_of(ContactSolve)
"""Places of the arrays of a problem in its row."""

INVALID = -1.0
"""Stands in place of a number of iterations."""


def layout(
    patches: int, states: int, points: int = 0, copies: int = 0, moved: int = 0
) -> Layout:
    """Return the layout of rows for k patches, of so many `points` to share loads, words of records to copy, and
    numbers of discs that move."""
    k = patches
    n = 3 * patches
    shapes = dict.fromkeys(ContactSolve._fields, n)
    shapes |= dict.fromkeys(
        ("dt", "tolerance", "most", "again", "iterations", "residual", "converged"), 1
    )
    shapes["mobility"] = 3
    shapes |= dict.fromkeys(
        ("free_load", "load", "load_0", "best_load", "kept_load"), k
    )
    shapes |= dict.fromkeys(("follows", "records", "acting"), k)
    shapes |= dict.fromkeys(("moments", "shift"), 2 * k) | {
        "weights": points,
        "copies": copies,
        "moved": moved,
        "support": 6 * patches,
    }
    shapes |= dict.fromkeys(("state", "new"), states) | {"host": 12 * k}
    shapes |= dict.fromkeys(("unit_slopes", "slopes"), 9 * k) | dict.fromkeys(
        ("response", "matrix"), n * n
    )
    return Layout(
        ContactSolve,
        **shapes | {"load_response": k * n, "step": SLOPES, "turned": 18, "seen": 4},
    )


class Followers(NamedTuple):
    """Points of each patch that share its load: its cells, or its centre of pressure if it moves as a whole."""

    x: Doubles
    """Coordinates of the points of all patches [m]."""
    y: Doubles
    width: Doubles
    """Widths of the cells, over which an edge uncovers them [m]."""
    firsts: Integers
    """First point of each patch, and behind the last the count of all, [k + 1]."""
    words: Integers
    """Words of the record of a patch whose points are cells, of which the last is the address of the weights; 0 of one
    that moves as a whole, [k]."""
    moves: Integers
    """Numbers of each disc of a patch, as `CompiledModel.moves`, [k]."""


class Patches(NamedTuple):
    """Data that all problems of the same patches share."""

    count: int
    """Number k of patches."""
    states: int
    """Number of states."""
    solve: int
    """Address of `coupling.solve`."""
    steps: Integers
    """Addresses of the patches' steps (see `protocol.StepFunctions`), [k]."""
    slopes: Integers
    """Addresses of those that write slopes, [k]."""
    firsts: Integers
    """First state of each patch, and behind the last the number of all, [k + 1]."""
    radius: Doubles
    """Lever arms of the patches that turn spins into speeds [m], [k]."""
    pad: Integers
    """1 of pads, whose bristles see their loads; 0 of others, [k]."""
    soft: int
    """1 if all of them are pads, else 0."""
    linear: int
    """1 if the slopes of all patches that stick are known, else 0."""
    stuck: Doubles
    """Stiffnesses of the bristles while all of them stick, of pads, and per unit load of others, [k, 9]."""
    viscous: Doubles
    """Damping of these per unit load, [k, 9]."""
    bristle: Integers
    """Components of the bristles of each patch, [k]."""
    compliance: Doubles
    """Common compliances of pads, [k, 9] (see `face`)."""
    back: Doubles
    """Stiffnesses of the common parts of pads, inverse to these, [k, 9]."""
    lag: Doubles
    """Lags [s] of these, [k]; 0 where the face is the back."""
    rigid: int
    """1 of patches on one rigid body, whose loads are given, else 0."""
    rows: Doubles
    """Rows that give the twists of these from that of the body, in its axes, [3k, 3]."""
    followers: Followers
    row: Offsets


read = reader(Patches)
