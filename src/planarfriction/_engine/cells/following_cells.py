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

from planarfriction._engine.cells.moment_pressure import SOFTNESS, tilt
from planarfriction._engine.codegen.vectors import Vector, plus, put, three, times
from planarfriction._engine.compiler import compiled_math as xp
from planarfriction._engine.compiler import entry, kernel
from planarfriction._engine.compiler.calls import call
from planarfriction._engine.compiler.memory import (
    Doubles,
    Layout,
    Place,
    arrays_at,
    at,
    reader,
)
from planarfriction._engine.protocol import ROWS, Addresses, ModelFunctions


class FollowingContact(NamedTuple):
    """A contact of n cells whose pressure follows the load."""

    count: int
    """n"""
    states: int
    """Number of states of the bristles."""
    x: Doubles
    y: Doubles
    weights: Doubles
    """Weights before the pressure moves, [n]."""
    middle: Doubles
    """Centre of pressure of these weights [m], [2]."""
    slope_x: Doubles
    """Relative slopes of weights by the centre of pressure, while all cells press [1/m], [n]."""
    slope_y: Doubles
    calls: Addresses
    """Addresses of the functions of the cells."""
    cells: int
    """Address of the record of the cells with the weights `pressed`."""
    trial_cells: int
    """Address of the record of the cells with the weights `trial`."""
    pressed: Doubles
    """Weights where the contact was linearised last, [n]."""
    trial: Doubles
    """Weights of anything else, [n]."""
    scratch: Doubles
    """[states]"""
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


class FollowingLinearisation(NamedTuple):
    """Numbers at the beginning of a linearisation, before the numbers of the cells."""

    by_x: Doubles
    """K, column by column, [3] each."""
    by_y: Doubles
    centre: Doubles
    """p [m], [2]."""
    inverse: Doubles
    """Inverse of N, row by row, [4]."""
    stiffness: Doubles
    """Rows x and y of dF/dV with the bristles eliminated, [6]."""
    residual: Doubles
    """dF_xy that the residual of the bristles causes, [2]."""


_LINEAR = Layout(
    FollowingLinearisation, by_x=3, by_y=3, centre=2, inverse=4, stiffness=6, residual=2
)
_PLACES = _LINEAR.offsets
OWN = _LINEAR.size


@kernel
def _centre(record: FollowingContact, z: Doubles) -> Vector:
    return record.centre_x + z[record.states], record.centre_y + z[record.states + 1]


@kernel
def _press(record: FollowingContact, z: Doubles, out: Doubles) -> bool:
    """Write the weights; return True if some cells lift."""
    n = record.count
    (x, y) = _centre(record, z)
    lowest = 1.0
    dx = x - record.middle[0]
    dy = y - record.middle[1]
    for i in range(n):
        share = 1.0 + record.slope_x[i] * dx + record.slope_y[i] * dy
        lowest = xp.minimum(lowest, share)
        out[i] = record.weights[i] * share
    if lowest < 0.0:
        tilt(record.x, record.y, record.weights, n, x, y, out)
    return lowest < 0.0


@kernel
def _slopes(
    record: FollowingContact, w: Doubles, along_x: float, along_y: float, out: Doubles
) -> None:
    """Write the slopes of weights w, some of which are 0, by their centre of pressure along a direction."""
    n = record.count
    pressing = 0.0
    mx = 0.0
    my = 0.0
    for i in range(n):
        share = record.weights[i] if w[i] > 0.0 else 0.0
        pressing = pressing + share
        mx = mx + share * record.x[i]
        my = my + share * record.y[i]
    mx = mx / pressing
    my = my / pressing
    least = SOFTNESS * record.radius * record.radius
    xx = least
    xy = 0.0
    yy = least
    for i in range(n):
        share = record.weights[i] if w[i] > 0.0 else 0.0
        dx = record.x[i] - mx
        dy = record.y[i] - my
        xx = xx + share * dx * dx
        xy = xy + share * dx * dy
        yy = yy + share * dy * dy
    one = xx * yy - xy * xy
    per = 1.0 / one if one > 0.0 else 0.0
    a = per * (yy * along_x - xy * along_y)
    b = per * (xx * along_y - xy * along_x)
    for i in range(n):
        share = record.weights[i] if w[i] > 0.0 else 0.0
        out[i] = share * (a * (record.x[i] - mx) + b * (record.y[i] - my))


@kernel
def _pulls_to(record: FollowingContact, z: Doubles, w: Doubles, zdot: Doubles) -> None:
    """Write the rate of the two states of the pressure under a wrench."""
    n = record.states
    zdot[n] = -(z[n] + record.height * w[0]) / record.lag
    zdot[n + 1] = -(z[n + 1] + record.height * w[1]) / record.lag


@kernel
def _by_pressure(m: FollowingLinearisation, a: float, b: float) -> Vector:
    """Return `K (a, b)`."""
    return plus(times(a, three(m.by_x)), b, three(m.by_y))


@kernel
def _solved(
    record: FollowingContact, m: FollowingLinearisation, r: Doubles, x: float, y: float
) -> Vector:
    """Return `N^-1 (T r_e - h (x, y))`."""
    x = record.lag * r[record.states] - record.height * x
    y = record.lag * r[record.states + 1] - record.height * y
    return m.inverse[0] * x + m.inverse[1] * y, m.inverse[2] * x + m.inverse[3] * y


@entry
def evaluate(contact: Place, z: Doubles, v: Doubles, zdot: Doubles, w: Doubles) -> None:
    """Write z' and the wrench."""
    record = read(contact)
    _press(record, z, record.trial)
    call(record.calls.evaluate, (record.trial_cells, z, v, zdot, w))
    _pulls_to(record, z, w, zdot)


@entry
def linearise(contact: Place, z: Doubles, v: Doubles, lin: Doubles) -> None:
    """Hold the weights, write K and p, and linearise the cells; a wrench is linear in the weights."""
    record = read(contact)
    m = arrays_at(_PLACES, lin)
    lifts = _press(record, z, record.pressed)
    for j in range(2):
        slope = record.slope_x if j == 0 else record.slope_y
        if lifts:
            _slopes(record, record.pressed, 1.0 - j, float(j), record.trial)
        else:
            for i in range(record.count):
                record.trial[i] = record.weights[i] * slope[i]
        call(
            record.calls.evaluate,
            (record.trial_cells, z, v, record.scratch, m.by_x if j == 0 else m.by_y),
        )
    m.centre[0], m.centre[1] = _centre(record, z)
    call(record.calls.linearise, (record.cells, z, v, at(lin, OWN)))


@entry
def factor(
    contact: Place, z: Doubles, shift: float, lin: Doubles, stiffness: Doubles
) -> None:
    """Prepare D, and write the stiffness."""
    record = read(contact)
    m = arrays_at(_PLACES, lin)
    s = stiffness
    call(record.calls.factor, (record.cells, z, shift, at(lin, OWN), s))
    h = record.height
    one = 1.0 + shift * record.lag
    xx = one + h * m.by_x[0]
    xy = h * m.by_y[0]
    yx = h * m.by_x[1]
    yy = one + h * m.by_y[1]
    per = xx * yy - xy * yx
    per = 1.0 / (per if per != 0.0 else 1.0)
    m.inverse[0] = per * yy
    m.inverse[1] = -per * xy
    m.inverse[2] = -per * yx
    m.inverse[3] = per * xx
    for j in range(3):
        m.stiffness[j] = s[j]
        m.stiffness[3 + j] = s[3 + j]
        a, b = _solved(record, m, record.zero, s[j], s[3 + j])
        for i in range(3):
            s[3 * i + j] += m.by_x[i] * a + m.by_y[i] * b


@entry
def eliminate(
    contact: Place, z: Doubles, shift: float, r: Doubles, lin: Doubles, w: Doubles
) -> None:
    """Write the wrench that a residual causes."""
    record = read(contact)
    m = arrays_at(_PLACES, lin)
    call(record.calls.eliminate, (record.cells, z, shift, r, at(lin, OWN), w))
    m.residual[0] = w[0]
    m.residual[1] = w[1]
    a, b = _solved(record, m, r, w[0], w[1])
    put(w, plus(three(w), 1.0, _by_pressure(m, a, b)))


@entry
def back_substitute(
    contact: Place, z: Doubles, r: Doubles, dv: Doubles, lin: Doubles, out: Doubles
) -> None:
    """Solve for the states, after `eliminate` of the same residual."""
    record = read(contact)
    m = arrays_at(_PLACES, lin)
    call(record.calls.back_substitute, (record.cells, z, r, dv, at(lin, OWN), out))
    x = m.residual[0]
    y = m.residual[1]
    for j in range(3):
        x = x + m.stiffness[j] * dv[j]
        y = y + m.stiffness[3 + j] * dv[j]
    out[record.states], out[record.states + 1] = _solved(record, m, r, x, y)


@entry
def change(
    contact: Place, z: Doubles, zdot: Doubles, lin: Doubles, dz: Doubles, dzdot: Doubles, rows: Doubles,
    friction: float, size: float,
) -> None:  # fmt: skip
    """Write the changes of z' and of the wrench; in a patch that has grown, p is nearer to the middle."""
    record = read(contact)
    changes = arrays_at(ROWS, rows)
    m = arrays_at(_PLACES, lin)
    call(
        record.calls.change,
        (record.cells, z, zdot, at(lin, OWN), dz, dzdot, rows, friction, size),
    )
    n = record.states
    by_pressure = _by_pressure(
        m, dz[n] - size * m.centre[0], dz[n + 1] - size * m.centre[1]
    )
    put(changes.d_wrench, plus(three(changes.d_wrench), 1.0, by_pressure))
    _pulls_to(record, dz, changes.d_wrench, dzdot)


@entry
def solve_transposed(
    contact: Place, z: Doubles, r: Doubles, lin: Doubles, out: Doubles
) -> None:
    """Solve `D' out = r`: first for the pressure, then for the bristles that it sees."""
    record = read(contact)
    m = arrays_at(_PLACES, lin)
    rows = arrays_at(ROWS, read(contact).rows)
    n = record.states
    a = r[n]
    b = r[n + 1]
    a, b = (
        record.lag * (m.inverse[0] * a + m.inverse[2] * b),
        record.lag * (m.inverse[1] * a + m.inverse[3] * b),
    )
    put(rows.d_wrench, times(-record.height / record.lag, (a, b, 0.0)))
    call(
        record.calls.pull_back,
        (record.cells, z, at(lin, OWN), record.zero, record.rows, record.scratch),
    )
    for i in range(n):
        record.scratch[i] += r[i]
    call(
        record.calls.solve_transposed,
        (record.cells, z, record.scratch, at(lin, OWN), out),
    )
    out[n] = a
    out[n + 1] = b


@entry
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
    changes = arrays_at(ROWS, rows)
    m = arrays_at(_PLACES, lin)
    n = record.states
    d_wrench = three(changes.d_wrench)
    per = 1.0 / record.lag
    wrench = plus(d_wrench, -per * record.height, (dzdot[n], dzdot[n + 1], 0.0))
    put(changes.d_wrench, wrench)
    call(record.calls.pull_back, (record.cells, z, at(lin, OWN), dzdot, rows, out))
    put(changes.d_wrench, d_wrench)
    out[n] = -per * dzdot[n]
    out[n + 1] = -per * dzdot[n + 1]
    for i in range(3):
        out[n], out[n + 1] = (
            out[n] + m.by_x[i] * wrench[i],
            out[n + 1] + m.by_y[i] * wrench[i],
        )


FUNCTIONS = ModelFunctions(
    evaluate,
    linearise,
    factor,
    eliminate,
    back_substitute,
    change,
    solve_transposed,
    pull_back,
)
