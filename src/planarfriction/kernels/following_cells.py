"""Cells whose pressure follows the load of a body that moves in a plane: weight, and the lever of friction itself.

The weight acts at the centre of mass, at c in the contact frame and a height h above the contact; so do applied forces
and inertia. With the friction f per unit load, no moment tips the body if the centre of pressure is at `c - h f`. It
follows with a lag T, by `e = p - c`, two states behind the bristles: `e' = -(e + h f)/T`. So the pressure is one at any
time, even if a body is about to tip, where more than one could balance the load.

The wrench is that of the cells with the weights of `kernels.tilt` at p, `W = sum w_i(p) W_i`; bristles do not see them.
With `K = sum dw_i/dp W_i`, `N = (1 + shift T) I + h K_xy` and changes `dF` of the wrench at held weights,

    de = N^-1 (T r_e - h dF_xy),     dW = dF + K de

solves the equations of e for a residual r_e; all that concerns the bristles is left to the functions of the cells.
"""

from __future__ import annotations

from typing import NamedTuple

from planarfriction.compiler import compiled_math as xp
from planarfriction.compiler import entry, kernel
from planarfriction.compiler.calls import call
from planarfriction.compiler.memory import Doubles, Integers, Layout, arrays_at, at, reader
from planarfriction.kernels.contacts import (
    BACK_SUBSTITUTE,
    CHANGE,
    ELIMINATE,
    EVALUATE,
    FACTOR,
    LINEARISE,
    PULL_BACK,
    ROWS,
    SOLVE_TRANSPOSED,
    ModelFunctions,
)
from planarfriction.kernels.tilt import SOFTNESS, tilt
from planarfriction.kernels.vectors import plus, put, three, times


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
    """Their centre of pressure [m], [2]."""
    slope_x: Doubles
    """Their relative slopes by the centre of pressure, while all cells press [1/m], [n]."""
    slope_y: Doubles
    calls: Integers
    """Addresses of the functions of the cells, [8]."""
    held: int
    """Address of the record of the cells with the weights `pressed`."""
    tried: int
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
    """Room for `contacts.Rows`."""
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


class Linear(NamedTuple):
    """Numbers at the beginning of a linearisation, before those of the cells."""

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


_LINEAR = Layout(Linear, by_x=3, by_y=3, centre=2, inverse=4, stiffness=6, residual=2)
_PLACES, OWN = _LINEAR.offsets, _LINEAR.size


@kernel
def _centre(own, z):
    return own.centre_x + z[own.states], own.centre_y + z[own.states + 1]


@kernel
def _press(own, z, out):
    """Write the weights; return True if some cells lift."""
    n, (x, y), lowest = own.count, _centre(own, z), 1.0
    dx, dy = x - own.middle[0], y - own.middle[1]
    for i in range(n):
        share = 1.0 + own.slope_x[i] * dx + own.slope_y[i] * dy
        lowest = xp.minimum(lowest, share)
        out[i] = own.weights[i] * share
    if lowest < 0.0:
        tilt(own.x, own.y, own.weights, n, x, y, out)
    return lowest < 0.0


@kernel
def _slopes(own, w, along_x, along_y, out):
    """Write the slopes of weights w, some of which are 0, by their centre of pressure along a direction."""
    n, pressing, mx, my = own.count, 0.0, 0.0, 0.0
    for i in range(n):
        share = own.weights[i] if w[i] > 0.0 else 0.0
        pressing, mx, my = pressing + share, mx + share * own.x[i], my + share * own.y[i]
    mx, my, least = mx / pressing, my / pressing, SOFTNESS * own.radius * own.radius
    xx, xy, yy = least, 0.0, least
    for i in range(n):
        share, dx, dy = own.weights[i] if w[i] > 0.0 else 0.0, own.x[i] - mx, own.y[i] - my
        xx, xy, yy = xx + share * dx * dx, xy + share * dx * dy, yy + share * dy * dy
    one = xx * yy - xy * xy
    per = 1.0 / one if one > 0.0 else 0.0
    a, b = per * (yy * along_x - xy * along_y), per * (xx * along_y - xy * along_x)
    for i in range(n):
        share = own.weights[i] if w[i] > 0.0 else 0.0
        out[i] = share * (a * (own.x[i] - mx) + b * (own.y[i] - my))


@kernel
def _pulls_to(own, z, w, zdot):
    """Write the rate of the two states of the pressure under a wrench."""
    n = own.states
    zdot[n], zdot[n + 1] = -(z[n] + own.height * w[0]) / own.lag, -(z[n + 1] + own.height * w[1]) / own.lag


@kernel
def _moved(m, a, b):
    """Return `K (a, b)`."""
    return plus(times(a, three(m.by_x)), b, three(m.by_y))


@kernel
def _solved(own, m, r, x, y):
    """Return `N^-1 (T r_e - h (x, y))`."""
    x, y = own.lag * r[own.states] - own.height * x, own.lag * r[own.states + 1] - own.height * y
    return m.inverse[0] * x + m.inverse[1] * y, m.inverse[2] * x + m.inverse[3] * y


@entry
def evaluate(contact, z, v, zdot, w):
    """Write z' and the wrench."""
    own = read(contact)
    _press(own, z, own.trial)
    call(own.calls[EVALUATE], (own.tried, z, v, zdot, w))
    _pulls_to(own, z, w, zdot)


@entry
def linearise(contact, z, v, lin):
    """Hold the weights, write K and p, and linearise the cells; a wrench is linear in the weights."""
    own, m = read(contact), arrays_at(_PLACES, lin)
    if _press(own, z, own.pressed):
        _slopes(own, own.pressed, 1.0, 0.0, own.trial)
        call(own.calls[EVALUATE], (own.tried, z, v, own.scratch, m.by_x))
        _slopes(own, own.pressed, 0.0, 1.0, own.trial)
    else:
        for i in range(own.count):
            own.trial[i] = own.weights[i] * own.slope_x[i]
        call(own.calls[EVALUATE], (own.tried, z, v, own.scratch, m.by_x))
        for i in range(own.count):
            own.trial[i] = own.weights[i] * own.slope_y[i]
    call(own.calls[EVALUATE], (own.tried, z, v, own.scratch, m.by_y))
    m.centre[0], m.centre[1] = _centre(own, z)
    call(own.calls[LINEARISE], (own.held, z, v, at(lin, OWN)))


@entry
def factor(contact, z, shift, lin, stiffness):
    """Prepare D, and write the stiffness."""
    own, m, s = read(contact), arrays_at(_PLACES, lin), stiffness
    call(own.calls[FACTOR], (own.held, z, shift, at(lin, OWN), s))
    h, one = own.height, 1.0 + shift * own.lag
    xx, xy, yx, yy = one + h * m.by_x[0], h * m.by_y[0], h * m.by_x[1], one + h * m.by_y[1]
    per = xx * yy - xy * yx
    per = 1.0 / (per if per != 0.0 else 1.0)
    m.inverse[0], m.inverse[1], m.inverse[2], m.inverse[3] = per * yy, -per * xy, -per * yx, per * xx
    for j in range(3):
        m.stiffness[j], m.stiffness[3 + j] = s[j], s[3 + j]
        a, b = _solved(own, m, own.zero, s[j], s[3 + j])
        for i in range(3):
            s[3 * i + j] += m.by_x[i] * a + m.by_y[i] * b


@entry
def eliminate(contact, z, shift, r, lin, w):
    """Write the wrench that a residual causes."""
    own, m = read(contact), arrays_at(_PLACES, lin)
    call(own.calls[ELIMINATE], (own.held, z, shift, r, at(lin, OWN), w))
    m.residual[0], m.residual[1] = w[0], w[1]
    a, b = _solved(own, m, r, w[0], w[1])
    put(w, plus(three(w), 1.0, _moved(m, a, b)))


@entry
def back_substitute(contact, z, r, dv, lin, out):
    """Solve for the states, after `eliminate` of the same residual."""
    own, m = read(contact), arrays_at(_PLACES, lin)
    call(own.calls[BACK_SUBSTITUTE], (own.held, z, r, dv, at(lin, OWN), out))
    x, y = m.residual[0], m.residual[1]
    for j in range(3):
        x, y = x + m.stiffness[j] * dv[j], y + m.stiffness[3 + j] * dv[j]
    out[own.states], out[own.states + 1] = _solved(own, m, r, x, y)


@entry
def change(contact, z, zdot, lin, dz, dzdot, rows, friction, size):
    """Write the changes of z' and of the wrench; in a patch that has grown, p is nearer to the middle."""
    own, changes, m = read(contact), arrays_at(ROWS, rows), arrays_at(_PLACES, lin)
    call(own.calls[CHANGE], (own.held, z, zdot, at(lin, OWN), dz, dzdot, rows, friction, size))
    n = own.states
    moved = _moved(m, dz[n] - size * m.centre[0], dz[n + 1] - size * m.centre[1])
    put(changes.d_wrench, plus(three(changes.d_wrench), 1.0, moved))
    _pulls_to(own, dz, changes.d_wrench, dzdot)


@entry
def solve_transposed(contact, z, r, lin, out):
    """Solve `D' out = r`: first for the pressure, then for the bristles that it sees."""
    own, m, rows = read(contact), arrays_at(_PLACES, lin), arrays_at(ROWS, read(contact).rows)
    n = own.states
    a, b = r[n], r[n + 1]
    a, b = own.lag * (m.inverse[0] * a + m.inverse[2] * b), own.lag * (m.inverse[1] * a + m.inverse[3] * b)
    put(rows.d_wrench, times(-own.height / own.lag, (a, b, 0.0)))
    call(own.calls[PULL_BACK], (own.held, z, at(lin, OWN), own.zero, own.rows, own.scratch))
    for i in range(n):
        own.scratch[i] += r[i]
    call(own.calls[SOLVE_TRANSPOSED], (own.held, z, own.scratch, at(lin, OWN), out))
    out[n], out[n + 1] = a, b


@entry
def pull_back(contact, z, lin, dzdot, rows, out):
    """Write the transpose of `change`."""
    own, changes, m = read(contact), arrays_at(ROWS, rows), arrays_at(_PLACES, lin)
    n, given = own.states, three(changes.d_wrench)
    per = 1.0 / own.lag
    wrench = plus(given, -per * own.height, (dzdot[n], dzdot[n + 1], 0.0))
    put(changes.d_wrench, wrench)
    call(own.calls[PULL_BACK], (own.held, z, at(lin, OWN), dzdot, rows, out))
    put(changes.d_wrench, given)
    out[n], out[n + 1] = -per * dzdot[n], -per * dzdot[n + 1]
    for i in range(3):
        out[n], out[n + 1] = out[n] + m.by_x[i] * wrench[i], out[n + 1] + m.by_y[i] * wrench[i]


FUNCTIONS = ModelFunctions(evaluate, linearise, factor, eliminate, back_substitute, change, solve_transposed, pull_back)
