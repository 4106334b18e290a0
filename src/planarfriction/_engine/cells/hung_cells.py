"""Cells of a pad whose face hangs on its back by a compliance that they have in common, as the solver sees them.

The face is displaced by b, three states behind the bristles, against the back, whose twist is V. With the compliance C,
the lag T, the load f, the wrench of springs `f P(z) = -sum K B' z` and viscous friction D per unit load, the face has
the twist V_f, which the bristles see:

    (T I + f C D) V_f = T V + b + f C P(z),     b' = V - V_f.

A change of the wrench per unit load is `dW = S dV_f + w_r`, with the bristles eliminated. Together with
`shift db = r_b + dV - dV_f` that is, with `t = T + 1/shift` and `M = (t I - f C S)^-1`,

    dV_f = t M dV + M (r_b/shift + f C w_r),     dW = t S M dV + w_r + S M (r_b/shift + f C w_r).
"""

from __future__ import annotations

from typing import NamedTuple

from planarfriction._engine.cells.cells import CellsContact
from planarfriction._engine.codegen.small_matrices import applied, inverse
from planarfriction._engine.codegen.vectors import (
    copy,
    plus,
    put,
    put_all,
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
from planarfriction._engine.protocol import SEEN, Addresses, functions_of


class HungContact(NamedTuple):
    """A contact of cells on a face."""

    cells: CellsContact
    calls: Addresses
    """Addresses of the functions of the cells."""
    states: int
    """Number of states of the bristles."""
    compliance: Doubles
    """C, [3, 3]."""
    viscous: Doubles
    """D, [3, 3]."""
    springs: Doubles
    """Wrench of the springs per deflection, with its load, [states, 3]."""
    lag: float
    """T [s]"""
    seen: Doubles
    """Room for what the cells see, `protocol.SEEN_SIZE`."""


read = reader(HungContact)


class HungLinearisation(NamedTuple):
    """Numbers at the beginning of a linearisation, before those of the cells."""

    load: Doubles
    """f, [1]."""
    shift: Doubles
    """[1]"""
    stiffness: Doubles
    """S, [3, 3]."""
    inverse: Doubles
    """M, [3, 3]."""
    product: Doubles
    """f C S, [3, 3]."""
    residual: Doubles
    """Change of V_f that the residual causes, [3]."""


_LINEAR = Layout(
    HungLinearisation, load=1, shift=1, stiffness=9, inverse=9, product=9, residual=3
)
_PLACES = _LINEAR.offsets
OWN = _LINEAR.size
"""Numbers of a linearisation before those of the cells."""


@kernel
def _see(own: HungContact, z: Doubles, v: Doubles) -> None:
    """Write what the cells see: the twist of the face, and the rest as the contact sees it."""
    n = own.states
    load = arrays_at(SEEN, v).load[0]
    arrays_at(SEEN, own.seen).load[0] = load
    fx = 0.0
    fy = 0.0
    tau = 0.0
    for i in range(n):
        fx += own.springs[3 * i] * z[i]
        fy += own.springs[3 * i + 1] * z[i]
        tau += own.springs[3 * i + 2] * z[i]
    bent = plus(three(at(z, n)), 1.0, applied(own.compliance, (fx, fy, tau)))
    right = plus(bent, own.lag, three(v))
    put(own.seen, applied(_solver(own, load), right))


@kernel
def _solver(own: HungContact, load: float) -> tuple:
    """Return the inverse of `T I + f C D`, nine numbers."""
    c = own.compliance
    d = own.viscous
    x = applied(c, (d[0], d[3], d[6]))
    y = applied(c, (d[1], d[4], d[7]))
    s = applied(c, (d[2], d[5], d[8]))
    columns = (x[0], y[0], s[0], x[1], y[1], s[1], x[2], y[2], s[2])
    return inverse(own.lag, times(-load, columns))


def evaluate(contact: Place, z: Doubles, v: Doubles, zdot: Doubles, w: Doubles) -> None:
    """Write z' and b', and the wrench."""
    own = read(contact)
    _see(own, z, v)
    call(own.calls.evaluate, (contact, z, own.seen, zdot, w))
    put(at(zdot, own.states), plus(three(v), -1.0, three(own.seen)))


def linearise(
    contact: Place, z: Doubles, v: Doubles, zdot: Doubles, w: Doubles, lin: Doubles
) -> None:
    """Evaluate, and linearise the cells at the twist of the face."""
    own = read(contact)
    _see(own, z, v)
    arrays_at(_PLACES, lin).load[0] = arrays_at(SEEN, v).load[0]
    call(own.calls.linearise, (contact, z, own.seen, zdot, w, at(lin, OWN)))
    put(at(zdot, own.states), plus(three(v), -1.0, three(own.seen)))


def factor(
    contact: Place, z: Doubles, shift: float, lin: Doubles, stiffness: Doubles
) -> None:
    """Prepare D of the cells and M, and write the stiffness of all."""
    own = read(contact)
    m = arrays_at(_PLACES, lin)
    s = m.stiffness
    call(own.calls.factor, (contact, z, shift, at(lin, OWN), stiffness))
    copy(stiffness, s, 9)
    m.shift[0] = shift
    late = own.lag + 1.0 / shift
    for j in range(3):
        column = applied(own.compliance, (s[j], s[3 + j], s[6 + j]))
        for i in range(3):
            m.product[3 * i + j] = m.load[0] * column[i]
    put_all(m.inverse, inverse(late, m.product))
    for j in range(3):
        moved = m.inverse[j], m.inverse[3 + j], m.inverse[6 + j]
        column = applied(s, moved)
        for i in range(3):
            stiffness[3 * i + j] = late * column[i]


def eliminate(
    contact: Place, z: Doubles, shift: float, r: Doubles, lin: Doubles, w: Doubles
) -> None:
    """Write the wrench that a residual causes."""
    own = read(contact)
    m = arrays_at(_PLACES, lin)
    call(own.calls.eliminate, (contact, z, shift, r, at(lin, OWN), w))
    right = times(m.load[0], applied(own.compliance, three(w)))
    right = plus(right, 1.0 / shift, three(at(r, own.states)))
    put(m.residual, applied(m.inverse, right))
    put(w, plus(three(w), 1.0, applied(m.stiffness, three(m.residual))))


def back_substitute(
    contact: Place, z: Doubles, r: Doubles, dv: Doubles, lin: Doubles, out: Doubles
) -> None:
    """Solve for the states, after `eliminate` of the same residual."""
    own = read(contact)
    m = arrays_at(_PLACES, lin)
    n = own.states
    late = own.lag + 1.0 / m.shift[0]
    copy(dv, own.seen, 6)
    moved = plus(three(m.residual), late, applied(m.inverse, three(dv)))
    put(own.seen, moved)
    call(own.calls.back_substitute, (contact, z, r, own.seen, at(lin, OWN), out))
    b = plus(plus(three(at(r, n)), 1.0, three(dv)), -1.0, moved)
    put(at(out, n), times(1.0 / m.shift[0], b))


FUNCTIONS = functions_of(
    "hung", (evaluate, linearise, factor, eliminate, back_substitute)
)
"""Functions of contacts on a face; none are there for derivatives of scenes."""
