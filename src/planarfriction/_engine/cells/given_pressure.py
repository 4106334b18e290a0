"""Cells whose pressure a source gives anew wherever the solver evaluates them (see `edge_cells`, `following_cells`).

A source has inputs s, the place of a body over its edge or a centre of pressure. It writes the weights of the cells at
s, and where levers move, these as well. The slopes by s of rates and wrench, `df/ds` and `dW/ds` at held bristles, are
differences; all else is left to the functions of the cells. The place is that of the body, so that

    dW/ds = dW/ds at held bristles + dW/dz D^-1 df/ds,     D dz = r + df/dV dV + df/ds ds

belongs to the stiffness (see `protocol.ModelFunctions`). A centre of pressure p is `c + e` with the centre of mass c,
in two states e behind the bristles, which do not see weights. With the friction f per unit load, no moment tips a body
whose weight, forces and inertia act at the height h if `e = -h f`, which e follows with a lag: `e' = -(e + h f)/T`. So
the pressure is one at any time, even if a body is about to tip, where more than one could balance the load. With
`K = dW/dp`, `N = (1 + shift T) I + h K_xy` and changes `dF` of the wrench at held weights,

    de = N^-1 (T r_e - h dF_xy),     dW = dF + K de

solves the equations of e for a residual r_e.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from planarfriction._engine.codegen.small_matrices import inverse_2
from planarfriction._engine.codegen.vectors import (
    Vector,
    copy,
    dot,
    matrix_applied,
    matrix_applied_back,
    plus,
    put,
    put_all,
    reader_of,
    three,
    times,
)
from planarfriction._engine.compiler import kernel
from planarfriction._engine.compiler.calls import call
from planarfriction._engine.compiler.memory import (
    Doubles,
    Layout,
    Place,
    arrays_at,
    at,
    reader,
)
from planarfriction._engine.protocol import (
    ROWS,
    Addresses,
)

NUDGE = 1e-6
"""Change of an input for differences, as a share of its natural scale."""


class Pressed(NamedTuple):
    """Cells at a pressure."""

    record: Doubles
    """Words of their record, whose arrays follow."""
    weights: Doubles
    cells: Doubles


class GivenPressure(NamedTuple):
    """Cells whose pressure is given anew: the beginning of the record of a contact, behind which is the source's."""

    count: int
    """Number n of cells."""
    numbers: int
    """Numbers of each cell."""
    states: int
    """Number of states of the bristles."""
    calls: Addresses
    """Addresses of the functions of the cells."""
    x: Doubles
    y: Doubles
    whole: Doubles
    """Words of the record of the cells where the inputs change nothing."""
    weights: Doubles
    """Weights of these, [n]."""
    held: Pressed
    """Cells as they were linearised last."""
    trial: Pressed
    """Cells anywhere else."""
    acts: Doubles
    """1 if the inputs change anything where the contact was evaluated last, else 0, [1]."""
    rate: Doubles
    """Rates of the bristles there, [states]."""
    wrench: Doubles
    """Wrench there, [3]."""
    by_input: Doubles
    """df/ds where the contact was linearised last, a row for each input, [inputs, states]."""
    zero: Doubles
    """Zeros, [states]."""
    rows: Doubles
    """Room for `protocol.ChangeRows`."""
    radius: float
    """Natural scale of lengths among the inputs [m]."""
    height: float
    """h [m]"""
    lag: float
    """T [s]"""


read_given = reader(GivenPressure)


class GivenLinearisation(NamedTuple):
    """Numbers at the beginning of a linearisation, before the numbers of the cells."""

    acts: Doubles
    """`GivenPressure.acts` where it was linearised, [1]."""
    slopes: Doubles
    """dW/ds at held bristles, a row for each input, [3, 3]."""
    inverse: Doubles
    """Inverse of N, row by row, [4]."""
    by_twist: Doubles
    """de/dV, a row for each component of V, [3, 2]."""
    residual: Doubles
    """Changes of e that the residual causes, [2]."""


_LINEAR = Layout(
    GivenLinearisation, acts=1, slopes=9, inverse=4, by_twist=6, residual=2
)
_PLACES = _LINEAR.offsets
OWN = _LINEAR.size

_two = reader_of(2)
_four = reader_of(4)


@kernel
def _held(given: GivenPressure, m: GivenLinearisation) -> Doubles:
    """Return the record of the cells as they were linearised last."""
    return given.held.record if m.acts[0] > 0.0 else given.whole


@kernel
def _caused(m: GivenLinearisation, e: Vector) -> Vector:
    """Return `K e`."""
    return plus(times(e[0], three(m.slopes)), e[1], three(at(m.slopes, 3)))


@kernel
def _solved(
    given: GivenPressure, m: GivenLinearisation, r: Vector, pull: Vector
) -> Vector:
    """Return `N^-1 (T r - h pull)`."""
    right = plus(times(given.lag, r), -given.height, pull)
    return matrix_applied(_four(m.inverse, 0, 1), right)


@kernel
def _moved(place: Vector, i: int, by: float) -> Vector:
    """Return a place with the i-th input changed."""
    x, y, cos, sin = place
    turn = by if i == 2 else 0.0
    x += by if i == 0 else 0.0
    y += by if i == 1 else 0.0
    return x, y, cos - turn * sin, sin + turn * cos


@kernel
def _follow(given: GivenPressure, z: Doubles, w: Doubles, zdot: Doubles) -> None:
    """Write the rate of e under a wrench."""
    right = plus(_two(z, given.states, 1), given.height, (w[0], w[1]))
    put_all(at(zdot, given.states), times(-1.0 / given.lag, right))


@kernel
def _keep(
    given: GivenPressure, z: Doubles, zdot: Doubles, w: Doubles, follows: bool
) -> None:
    """Complete the rates of the cells, and keep what the slopes by the inputs start from."""
    copy(w, given.wrench, 3)
    if follows:
        _follow(given, z, w, zdot)
    else:
        copy(zdot, given.rate, given.states if given.acts[0] > 0.0 else 0)


def evaluate(
    contact: Place, z: Doubles, v: Doubles, zdot: Doubles, w: Doubles, *, read: Any, place: Any, press: Any,
    follows: bool,
) -> None:  # fmt: skip
    """Write z' and the wrench."""
    record = read(contact)
    given = record.given
    acts = press(record, place(record, z, v), v, given.trial)
    given.acts[0] = 1.0 if acts else 0.0
    cells = given.trial.record if acts else given.whole
    call(given.calls.evaluate, (cells, z, v, zdot, w))
    _keep(given, z, zdot, w, follows)


def linearise(
    contact: Place, z: Doubles, v: Doubles, zdot: Doubles, w: Doubles, lin: Doubles, *, read: Any, place: Any,
    press: Any, follows: bool,
) -> None:  # fmt: skip
    """Evaluate and linearise the cells, which are held there, and write the slopes by the inputs."""
    record = read(contact)
    given = record.given
    m = arrays_at(_PLACES, lin)
    s = place(record, z, v)
    acts = press(record, s, v, given.held)
    given.acts[0] = 1.0 if acts else 0.0
    m.acts[0] = given.acts[0]
    call(given.calls.linearise, (_held(given, m), z, v, zdot, w, at(lin, OWN)))
    _keep(given, z, zdot, w, follows)
    for j in range((2 if follows else 3) if acts else 0):
        by = NUDGE * (given.radius if j < 2 else 1.0)
        press(record, _moved(s, j, by), v, given.trial)
        slope = at(m.slopes, 3 * j)
        by_input = at(given.by_input, j * given.states)
        call(given.calls.evaluate, (given.trial.record, z, v, by_input, slope))
        per = 1.0 / by
        for i in range(3):
            slope[i] = per * (slope[i] - given.wrench[i])
        for i in range(0 if follows else given.states):
            by_input[i] = per * (by_input[i] - given.rate[i])


def factor(
    contact: Place, z: Doubles, shift: float, lin: Doubles, stiffness: Doubles, *, follows: bool,
) -> None:  # fmt: skip
    """Prepare D, and write the stiffness, with the slopes by the place behind it."""
    given = read_given(contact)
    m = arrays_at(_PLACES, lin)
    s = stiffness
    k = m.slopes
    cells = _held(given, m)
    call(given.calls.factor, (cells, z, shift, at(lin, OWN), s))
    if follows:
        by_pull = times(-given.height, (k[0], k[3], k[1], k[4]))
        put_all(m.inverse, inverse_2(1.0 + shift * given.lag, by_pull))
    for j in range(3 if m.acts[0] > 0.0 else 0):
        if follows:
            e = _solved(given, m, (0.0, 0.0), (s[j], s[3 + j]))
            put_all(at(m.by_twist, 2 * j), e)
            caused = _caused(m, e)
            for i in range(3):
                s[3 * i + j] += caused[i]
        else:
            by_place = at(given.by_input, j * given.states)
            states = cells, z, shift, by_place, at(lin, OWN), given.wrench
            call(given.calls.eliminate, states)
            for i in range(3):
                s[9 + 3 * i + j] = k[3 * j + i] + given.wrench[i]


def eliminate(
    contact: Place, z: Doubles, shift: float, r: Doubles, lin: Doubles, w: Doubles, *, follows: bool,
) -> None:  # fmt: skip
    """Write the wrench that a residual causes."""
    given = read_given(contact)
    m = arrays_at(_PLACES, lin)
    call(given.calls.eliminate, (_held(given, m), z, shift, r, at(lin, OWN), w))
    if follows:
        e = _solved(given, m, _two(r, given.states, 1), (w[0], w[1]))
        put_all(m.residual, e)
        put(w, plus(three(w), 1.0, _caused(m, e)))


def back_substitute(
    contact: Place, z: Doubles, r: Doubles, dv: Doubles, lin: Doubles, out: Doubles, *, follows: bool,
) -> None:  # fmt: skip
    """Solve for the states, after `eliminate` of the same residual."""
    given = read_given(contact)
    m = arrays_at(_PLACES, lin)
    moves = not follows and m.acts[0] > 0.0
    right = given.rate if moves else r
    for i in range(given.states if moves else 0):
        right[i] = r[i]
        for j in range(3):
            right[i] += dv[3 + j] * given.by_input[j * given.states + i]
    states = _held(given, m), z, right, dv, at(lin, OWN), out
    call(given.calls.back_substitute, states)
    if follows:
        e = _two(m.residual, 0, 1)
        for j in range(3):
            e = plus(e, dv[j], _two(m.by_twist, 2 * j, 1))
        put_all(at(out, given.states), e)


def change(
    contact: Place, z: Doubles, zdot: Doubles, lin: Doubles, dz: Doubles, dzdot: Doubles, rows: Doubles,
    friction: float, size: float, *, read: Any, place: Any,
) -> None:  # fmt: skip
    """Write the changes of z' and of the wrench; in a patch that has grown, p is nearer to the middle."""
    given = read_given(contact)
    wrench = arrays_at(ROWS, rows).d_wrench
    m = arrays_at(_PLACES, lin)
    states = given.held.record, z, zdot, at(lin, OWN), dz, dzdot, rows
    call(given.calls.change, (*states, friction, size))
    centre = place(read(contact), z, z)
    moved = plus(_two(dz, given.states, 1), -size, centre[:2])
    put(wrench, plus(three(wrench), 1.0, _caused(m, moved)))
    _follow(given, dz, wrench, dzdot)


def solve_transposed(
    contact: Place, z: Doubles, r: Doubles, lin: Doubles, out: Doubles
) -> None:
    """Solve `D' out = r`: first for the pressure, then for the bristles that it sees."""
    given = read_given(contact)
    m = arrays_at(_PLACES, lin)
    cells = given.held.record
    right = given.rate
    e = matrix_applied_back(_four(m.inverse, 0, 1), _two(r, given.states, 1))
    put(arrays_at(ROWS, given.rows).d_wrench, times(-given.height, (*e, 0.0)))
    states = cells, z, at(lin, OWN), given.zero, given.rows, right
    call(given.calls.pull_back, states)
    for i in range(given.states):
        right[i] += r[i]
    call(given.calls.solve_transposed, (cells, z, right, at(lin, OWN), out))
    put_all(at(out, given.states), times(given.lag, e))


def pull_back(
    contact: Place, z: Doubles, lin: Doubles, dzdot: Doubles, rows: Doubles, out: Doubles,
) -> None:  # fmt: skip
    """Write the transpose of `change`."""
    given = read_given(contact)
    wrench = arrays_at(ROWS, rows).d_wrench
    m = arrays_at(_PLACES, lin)
    own = times(-1.0 / given.lag, _two(dzdot, given.states, 1))
    asked = three(wrench)
    put(wrench, plus(asked, given.height, (*own, 0.0)))
    states = given.held.record, z, at(lin, OWN), dzdot, rows, out
    call(given.calls.pull_back, states)
    for j in range(2):
        slope = three(at(m.slopes, 3 * j))
        out[given.states + j] = own[j] + dot(three(wrench), slope)
    put(wrench, asked)


RATES = evaluate, linearise, factor, eliminate, back_substitute
FOLLOWING = *RATES, change, solve_transposed, pull_back
"""Functions of contacts with a source; only where the pressure follows there are derivatives.

Sources give them a reader of their record; `place`, `(contact, z, V)`, which returns the inputs as a place: x, y, and
cosine and sine of an angle; and `press`, `(contact, place, V, pressed)`, which writes weights and levers of cells and
returns True if the inputs change anything. `follows` is true of a centre of pressure, whose angle stays 0.
"""
