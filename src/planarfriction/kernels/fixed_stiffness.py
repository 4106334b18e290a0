"""Rates of cells whose stiffness does not grow with the load, as the solver sees them (docs/physics.md, "Stiffness and
load").

They are those of the published law at `l z`, `l = f_ref/f` (see `settle`), and that of bristles which a falling load
has left beyond their limit. Derivatives of rates and tractions by z are l times as large, so that what is done with the
matrices of a linearisation is that of `general_cells`.
"""

from __future__ import annotations

from planarfriction import formulas
from planarfriction.compiler import compiled_math as xp
from planarfriction.compiler import kernel
from planarfriction.compiler.memory import arrays_at
from planarfriction.kernels import cells, disc_cells, discs, general_cells
from planarfriction.kernels.contacts import ROWS, functions_of, traction
from planarfriction.kernels.general_cells import MATRICES, A, C, E, F, bristle
from planarfriction.kernels.law import grip
from planarfriction.kernels.rules import ratio
from planarfriction.kernels.settle import recovery
from planarfriction.kernels.vectors import dot, matrix_applied, norm, plus, put, scatter, three, times


@kernel
def evaluate_point(law, z, u):
    """Return z' and the traction of a point."""
    speed, size = norm(u), norm(z)
    q = grip(law, speed)
    k = formulas.bristle_decay(xp, size * q, ratio(dot(z, u), size), speed, q, law) + recovery(law, z, speed)
    rate = plus(u, -k, z)
    return rate, traction(law, z, rate, u)


@kernel
def evaluate_disc(law, z, u):
    """Return z' and the traction of a disc."""
    rate, pull = discs.evaluate(law, z, u)
    k = recovery(law, z, norm(u))
    return plus(rate, -k, z), plus(pull, law.sigma_1 * k, z)


def evaluate(contact, z, v, zdot, w, *, lever, bristle, read):
    """Write `z'`, and `W`; l comes behind the twist, `v` [4]."""
    own, twist, factor, total = read(contact), three(v), v[3], (0.0, 0.0, 0.0)
    n = own.count
    for i in range(n):
        cell = lever.of(own, i)
        bent = times(factor, bristle.vector(z, i, n))
        rate, t = bristle.evaluate(lever.law(own, i), bent, lever.seen(cell, twist))
        scatter(zdot, i, n, rate)
        total = plus(total, own.weights[i], lever.wrench(cell, t))
    put(w, total)


def linearise(contact, z, v, lin, *, lever, bristle, read):
    """Write A, F, C and E of each cell, and l in a row [n] behind all; `v` as in `evaluate`."""
    own, twist, factor = read(contact), three(v), v[3]
    n = own.count
    for i in range(n):
        bent, u = times(factor, bristle.vector(z, i, n)), lever.seen(lever.of(own, i), twist)
        found = bristle.linearise(lever.law(own, i), bent, u)
        place = C * bristle.size * bristle.size * n + i
        scatter(lin, i, n, (times(factor, found.new_z), found.new_u))
        scatter(lin, place, n, (times(factor, found.traction_z), found.traction_u))
    lin[MATRICES * bristle.size * bristle.size * n] = factor


def change(contact, z, zdot, lin, dz, dzdot, rows, friction, size, *, lever, bristle, read):
    """Write the changes of `z'` and of the wrench, as `general_cells.change` does."""
    own, rows, total = read(contact), arrays_at(ROWS, rows), (0.0, 0.0, 0.0)
    n, twist = own.count, (rows.d_twist[0], rows.d_twist[1], rows.d_twist[2] + size * rows.twist[2])
    stiffness = own.law.sigma_0 * lin[MATRICES * bristle.size * bristle.size * n]
    for i in range(n):
        cell, b = lever.of(own, i), bristle.vector(z, i, n)
        u, a = lever.seen(cell, twist), plus(bristle.vector(dz, i, n), -friction, b)
        rate = matrix_applied(general_cells._matrix(bristle, lin, A, i, n), a)
        scatter(dzdot, i, n, plus(rate, 1.0, matrix_applied(general_cells._matrix(bristle, lin, F, i, n), u)))
        t = matrix_applied(general_cells._matrix(bristle, lin, C, i, n), a)
        t = plus(t, 1.0, matrix_applied(general_cells._matrix(bristle, lin, E, i, n), u))
        total = plus(total, own.weights[i], lever.wrench(cell, plus(t, -friction * stiffness, b)))
    put(rows.d_wrench, plus(total, size * rows.wrench[2], (0.0, 0.0, 1.0)))


_OWN = {each.__name__: each for each in (evaluate, linearise, change)}
RATES = tuple(_OWN.get(each.__name__, each) for each in general_cells.RATES)
"""Loops over cells, those of `general_cells` but for three."""

_POINT, _DISC = bristle(evaluate_point, None, 2), bristle(evaluate_disc, None, 3)
_KINDS = (
    ("points", cells.POSITIONS, _POINT),
    ("turned_points", cells.LEVERS, _POINT),
    ("discs", disc_cells.POSITIONS, _DISC),
    ("turned_discs", disc_cells.LEVERS, _DISC),
)
RATES_OF = {
    (each.size, "turned" in name): functions_of(f"fixed_{name}", RATES, lever=lever, bristle=each, read=cells.read)
    for name, lever, each in _KINDS
}
"""Functions of contacts by the components of a bristle and whether there is a metric."""
