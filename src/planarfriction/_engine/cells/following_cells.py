"""Cells whose pressure follows the load of a body that moves in a plane: weight, and the lever of friction itself.

The weight acts at the centre of mass, at c in the contact frame and a height h above the contact; so do applied forces
and inertia. With the friction f per unit load, no moment tips the body if the centre of pressure is at `c - h f`. It
follows with a lag T, by `e = p - c`, two states behind the bristles: `e' = -(e + h f)/T`. So the pressure is one at any
time, even if a body is about to tip, where more than one could balance the load.

The cells cause the wrench with the weights of `cells.tilt` at p, `W = sum w_i(p) W_i`; bristles do not see weights.
With `K = sum dw_i/dp W_i`, `N = (1 + shift T) I + h K_xy` and changes `dF` of the wrench at held weights,

    de = N^-1 (T r_e - h dF_xy),     dW = dF + K de

solves the equations of e for a residual r_e; all that concerns the bristles is left to the functions of the cells.
"""

from __future__ import annotations

from typing import NamedTuple

from planarfriction._engine.cells.given_pressure import (
    OWN,
    PLACES,
    TEMPLATES,
    GivenLinearisation,
    GivenPressure,
    Pressed,
    Source,
)
from planarfriction._engine.cells.moment_pressure import tilt
from planarfriction._engine.codegen.small_matrices import inverse_2
from planarfriction._engine.codegen.vectors import (
    Vector,
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
from planarfriction._engine.compiler import compiled_math as xp
from planarfriction._engine.compiler import kernel
from planarfriction._engine.compiler.calls import call
from planarfriction._engine.compiler.memory import (
    Doubles,
    Place,
    arrays_at,
    at,
    reader,
)
from planarfriction._engine.protocol import ROWS, functions_of


class FollowingContact(NamedTuple):
    """A contact of n cells whose pressure follows the load."""

    given: GivenPressure
    middle: Doubles
    """Centre of pressure of the weights before it moves [m], [2]."""
    slope_x: Doubles
    """Relative slopes of weights by the centre of pressure, while all cells press [1/m], [n]."""
    slope_y: Doubles
    zero: Doubles
    """Zeros, [states]."""
    rows: Doubles
    """Room for `protocol.ChangeRows`."""
    radius: float
    """Radius of gyration of the weights [m]."""
    centre_x: float
    """c [m]"""
    centre_y: float
    height: float
    """h [m]"""
    lag: float
    """T [s]"""


read = reader(FollowingContact)

_two = reader_of(2)
_four = reader_of(4)


@kernel
def _inputs(record: FollowingContact, z: Doubles, v: Doubles) -> Vector:
    """Return the centre of pressure p."""
    n = record.given.states
    return record.centre_x + z[n], record.centre_y + z[n + 1]


@kernel
def _moved(record: FollowingContact, p: Vector, i: int, share: float) -> Vector:
    by = share * record.radius
    x, y = p
    return (x + (by if i == 0 else 0.0), y + (by if i == 1 else 0.0)), by


@kernel
def _press(record: FollowingContact, p: Vector, v: Doubles, to: Pressed) -> bool:
    """Write the weights with their centre at p."""
    given = record.given
    n = given.count
    (x, y) = p
    lowest = 1.0
    dx = x - record.middle[0]
    dy = y - record.middle[1]
    for i in range(n):
        share = 1.0 + record.slope_x[i] * dx + record.slope_y[i] * dy
        lowest = xp.minimum(lowest, share)
        to.weights[i] = given.weights[i] * share
    if lowest < 0.0:
        tilt(given.x, given.y, given.weights, n, x, y, to.weights)
    return True


@kernel
def _rates(record: FollowingContact, z: Doubles, w: Doubles, zdot: Doubles) -> None:
    """Write the rate of the two states of the pressure under a wrench."""
    n = record.given.states
    zdot[n] = -(z[n] + record.height * w[0]) / record.lag
    zdot[n + 1] = -(z[n + 1] + record.height * w[1]) / record.lag


@kernel
def _caused(m: GivenLinearisation, e: Vector) -> Vector:
    """Return `K e`."""
    return plus(times(e[0], three(m.slopes)), e[1], three(at(m.slopes, 3)))


@kernel
def _solved(
    record: FollowingContact, m: GivenLinearisation, r: Vector, pull: Vector
) -> Vector:
    """Return `N^-1 (T r - h pull)`."""
    right = plus(times(record.lag, r), -record.height, pull)
    return matrix_applied(_four(m.inverse, 0, 1), right)


def factor(
    contact: Place, z: Doubles, shift: float, lin: Doubles, stiffness: Doubles
) -> None:
    """Prepare D, and write the stiffness."""
    record = read(contact)
    given = record.given
    m = arrays_at(PLACES, lin)
    s = stiffness
    k = m.slopes
    call(given.calls.factor, (given.held.record, z, shift, at(lin, OWN), s))
    by_pull = times(-record.height, (k[0], k[3], k[1], k[4]))
    put_all(m.inverse, inverse_2(1.0 + shift * record.lag, by_pull))
    for j in range(3):
        e = _solved(record, m, (0.0, 0.0), (s[j], s[3 + j]))
        put_all(at(m.by_twist, 2 * j), e)
        caused = _caused(m, e)
        for i in range(3):
            s[3 * i + j] += caused[i]


def eliminate(
    contact: Place, z: Doubles, shift: float, r: Doubles, lin: Doubles, w: Doubles
) -> None:
    """Write the wrench that a residual causes."""
    record = read(contact)
    given = record.given
    m = arrays_at(PLACES, lin)
    call(given.calls.eliminate, (given.held.record, z, shift, r, at(lin, OWN), w))
    e = _solved(record, m, _two(r, given.states, 1), (w[0], w[1]))
    put_all(m.residual, e)
    put(w, plus(three(w), 1.0, _caused(m, e)))


def back_substitute(
    contact: Place, z: Doubles, r: Doubles, dv: Doubles, lin: Doubles, out: Doubles
) -> None:
    """Solve for the states, after `eliminate` of the same residual."""
    given = read(contact).given
    m = arrays_at(PLACES, lin)
    states = given.held.record, z, r, dv, at(lin, OWN), out
    call(given.calls.back_substitute, states)
    e = _two(m.residual, 0, 1)
    for j in range(3):
        e = plus(e, dv[j], _two(m.by_twist, 2 * j, 1))
    put_all(at(out, given.states), e)


def change(
    contact: Place, z: Doubles, zdot: Doubles, lin: Doubles, dz: Doubles, dzdot: Doubles, rows: Doubles,
    friction: float, size: float,
) -> None:  # fmt: skip
    """Write the changes of z' and of the wrench; in a patch that has grown, p is nearer to the middle."""
    record = read(contact)
    given = record.given
    wrench = arrays_at(ROWS, rows).d_wrench
    m = arrays_at(PLACES, lin)
    states = given.held.record, z, zdot, at(lin, OWN), dz, dzdot, rows
    call(given.calls.change, (*states, friction, size))
    moved = plus(_two(dz, given.states, 1), -size, _inputs(record, z, dz))
    put(wrench, plus(three(wrench), 1.0, _caused(m, moved)))
    _rates(record, dz, wrench, dzdot)


def solve_transposed(
    contact: Place, z: Doubles, r: Doubles, lin: Doubles, out: Doubles
) -> None:
    """Solve `D' out = r`: first for the pressure, then for the bristles that it sees."""
    record = read(contact)
    given = record.given
    m = arrays_at(PLACES, lin)
    cells = given.held.record
    right = given.rate
    e = matrix_applied_back(_four(m.inverse, 0, 1), _two(r, given.states, 1))
    put(arrays_at(ROWS, record.rows).d_wrench, times(-record.height, (*e, 0.0)))
    states = cells, z, at(lin, OWN), record.zero, record.rows, right
    call(given.calls.pull_back, states)
    for i in range(given.states):
        right[i] += r[i]
    call(given.calls.solve_transposed, (cells, z, right, at(lin, OWN), out))
    put_all(at(out, given.states), times(record.lag, e))


def pull_back(
    contact: Place,
    z: Doubles,
    lin: Doubles,
    dzdot: Doubles,
    rows: Doubles,
    out: Doubles,
) -> None:
    """Write the transpose of `change`."""
    record = read(contact)
    given = record.given
    wrench = arrays_at(ROWS, rows).d_wrench
    m = arrays_at(PLACES, lin)
    n = given.states
    own = times(-1.0 / record.lag, _two(dzdot, n, 1))
    asked = three(wrench)
    put(wrench, plus(asked, record.height, (*own, 0.0)))
    states = given.held.record, z, at(lin, OWN), dzdot, rows, out
    call(given.calls.pull_back, states)
    for j in range(2):
        out[n + j] = own[j] + dot(three(wrench), three(at(m.slopes, 3 * j)))
    put(wrench, asked)


FUNCTIONS = functions_of(
    "following",
    (
        *TEMPLATES,
        factor,
        eliminate,
        back_substitute,
        change,
        solve_transposed,
        pull_back,
    ),
    source=Source(2, False, _inputs, _moved, _press, _rates),
    read=read,
)
