"""Contacts of cells that are small discs: their levers, and the functions that solver and steps call.

The lever B of a disc at (x, y) gives `u = (v_x - omega y, v_y + omega x, kappa a omega)` (see `discs`); with a friction
metric the map L of the cell turns the first two, and a is the radius in the space of the metric.
"""

from __future__ import annotations

from planarfriction import formulas
from planarfriction.compiler import compiled_math as xp
from planarfriction.compiler import kernel
from planarfriction.kernels import cells, discs
from planarfriction.kernels.cells import Lever
from planarfriction.kernels.contacts import functions_of
from planarfriction.kernels.general_cells import RATES, STEPS, bristle
from planarfriction.kernels.leaning_cells import Leaning
from planarfriction.kernels.steps import step_functions
from planarfriction.kernels.vectors import dot, plus


@kernel
def _law(own, i):
    return own.law


@kernel
def _place(own, i):
    """Return x, y and kappa a."""
    return own.cells[i], own.cells[own.count + i], own.cells[2 * own.count + i]


@kernel
def _seen(cell, v):
    x, y, a = cell
    return v[0] - v[2] * y, v[1] + v[2] * x, a * v[2]


@kernel
def _wrench(cell, t):
    x, y, a = cell
    return t[0], t[1], x * t[1] - y * t[0] + a * t[2]


@kernel
def _around(cell, p):
    (x, y, a), (xx, xy, xs, yx, yy, ys, sx, sy, ss) = cell, p
    xt, yt, st = x * xy - y * xx + a * xs, x * yy - y * yx + a * ys, x * sy - y * sx + a * ss
    return xx, xy, xt, yx, yy, yt, x * yx - y * xx + a * sx, x * yy - y * xy + a * sy, x * yt - y * xt + a * st


@kernel
def _map(own, i):
    """Return xx, xy, yy, x, y, kappa a of `B = [(xx, xy, x), (xy, yy, y), (0, 0, kappa a)]`."""
    c, n = own.cells, own.count
    return c[i], c[n + i], c[2 * n + i], c[3 * n + i], c[4 * n + i], c[5 * n + i]


@kernel
def _seen_by_map(cell, v):
    xx, xy, yy, x, y, a = cell
    return xx * v[0] + xy * v[1] + x * v[2], xy * v[0] + yy * v[1] + y * v[2], a * v[2]


@kernel
def _wrench_by_map(cell, t):
    xx, xy, yy, x, y, a = cell
    return xx * t[0] + xy * t[1], xy * t[0] + yy * t[1], x * t[0] + y * t[1] + a * t[2]


@kernel
def _around_by_map(cell, p):
    xx, xy, yy, x, y, a = cell
    by_x = xx * p[0] + xy * p[1], xx * p[3] + xy * p[4], xx * p[6] + xy * p[7]
    by_y = xy * p[0] + yy * p[1], xy * p[3] + yy * p[4], xy * p[6] + yy * p[7]
    spin = x * p[0] + y * p[1] + a * p[2], x * p[3] + y * p[4] + a * p[5], x * p[6] + y * p[7] + a * p[8]
    one, other, last = (xx, xy, 0.0), (xy, yy, 0.0), (x, y, a)
    return (
        dot(one, by_x), dot(one, by_y), dot(one, spin), dot(other, by_x), dot(other, by_y), dot(other, spin),
        dot(last, by_x), dot(last, by_y), dot(last, spin),
    )  # fmt: skip


POSITIONS = Lever(_place, _seen, _wrench, _around, _law)
LEVERS = Lever(_map, _seen_by_map, _wrench_by_map, _around_by_map, _law)

# ---------------------------------------------------------------------- asymmetric friction


@kernel
def _leaning_law(own, i):
    c, n = own.cells, own.count
    return Leaning(own.law, (c[6 * n + i], c[7 * n + i]))


@kernel
def _centre(lean, u):
    """Return `a g(S)/sigma_0`, towards which a bristle decays; spin does not lean."""
    size = formulas.stribeck(xp, discs.mean_speed(u), lean.law) / lean.law.sigma_0
    return size * lean.a[0], size * lean.a[1], 0.0


@kernel
def evaluate_leaning(lean, z, u):
    """Return z' and the traction of a disc with asymmetric friction (see `leaning_cells`)."""
    c = _centre(lean, u)
    rate, pull = discs.evaluate(lean.law, plus(z, -1.0, c), u)
    return rate, plus(pull, -lean.law.sigma_0, c)


@kernel
def step_leaning(lean, z, u, dt):
    """Return the new bristle and the traction of a disc with asymmetric friction."""
    c = _centre(lean, u)
    new, pull = discs.step(lean.law, plus(z, -1.0, c), u, dt)
    return plus(new, 1.0, c), plus(pull, -lean.law.sigma_0, c)


# ---------------------------------------------------------------------- bound to the levers

_LEANING = {
    "lever": LEVERS._replace(law=_leaning_law),
    "bristle": bristle(evaluate_leaning, step_leaning, 3, linear=True),
    "read": cells.read,
}
RATES_OF_LEANING_DISCS = functions_of("leaning_discs", RATES, **_LEANING)
STEPS_OF_LEANING_DISCS = step_functions("leaning_discs", STEPS, **_LEANING)
