"""A contact of the reduced model as the solver calls it (see `contacts.ModelFunctions`; equations: `kernels.reduced`).

In scaled coordinates `V_G = F V`, with `g = -(sigma_0 z + sigma_1 z' + sigma_2 V_G)`, the wrench is `F' g`.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from numba import types

from planarfriction import formulas
from planarfriction.compiler import compiled_math as xp
from planarfriction.compiler import entry, kernel
from planarfriction.formulas import LawNumbers
from planarfriction.kernels.contacts import ModelFunctions
from planarfriction.kernels.pointers import at, doubles, floats
from planarfriction.kernels.records import reader
from planarfriction.kernels.reduced import closure, closure_partials, part_rate, to_origin, wrench
from planarfriction.kernels.steady import STILL, evenness, fourth_moments, scaled_twist, sliding, steady_slopes

BY_Z, BY_V, INVERSE, STEADY, EVENNESS, TWIST, REST = 0, 9, 18, 27, 42, 45, 48
"""Where a linearisation holds dz'/dz, dz'/dV_G, the inverse of D and dz_ss/dV_G (9 each; 6 of scratch behind the last),
the slopes of the evenness by z (3), V_G (3) and z_ss (3)."""

LINEAR = 51
"""Numbers of a linearisation."""


class Shape(NamedTuple):
    """A patch: F, upper triangular, and the share of the other map in its steady sliding."""

    f_00: float
    f_01: float
    f_02: float
    f_11: float
    f_12: float
    f_22: float
    blend: float


class ReducedContact(NamedTuple):
    """A contact of the reduced model."""

    law: LawNumbers
    shape: Shape
    data: int
    """Where the map of steady sliding is (see `kernels.steady`)."""
    other: int
    """How many numbers further on the other map is."""


read = reader(ReducedContact)


@kernel
def _maps(own):
    return types.int64(0), own.other


@entry
def evaluate(contact, z, v, zdot, w):
    """See `ModelFunctions`: `z' = V_G - beta (lambda z + s m)`."""
    own, z, twist, zdot, w = read(contact), doubles(z), doubles(v), doubles(zdot), doubles(w)
    law, data = own.law, floats(own.data)
    x, y, s, v, qx, qy, qs = sliding(law, twist[0], twist[1], twist[2], own.shape, _maps(own), data)
    power, per_q2 = x * qx + y * qy + s * qs, 1.0 / (qx * qx + qy * qy + qs * qs)
    decay = v * v / xp.where(power > 0.0, power, 1.0)
    share = (z[0] * qx + z[1] * qy + z[2] * qs) * per_q2
    even = evenness(law, fourth_moments(own.shape, _maps(own), data), (z[0], z[1], z[2]))[0]
    beta = closure(law, math.sqrt((z[0] * z[0] + z[1] * z[1] + z[2] * z[2]) * per_q2), share, even)
    zdot[0] = part_rate(beta, share, decay, z[0], x, qx)
    zdot[1] = part_rate(beta, share, decay, z[1], y, qy)
    zdot[2] = part_rate(beta, share, decay, z[2], s, qs)
    w[0], w[1], w[2] = wrench(law, own.shape, z[0], z[1], z[2], zdot[0], zdot[1], zdot[2], x, y, s)


@kernel
def _slopes(law, z, v, even, lin):
    """`dz'/dz` and `dz'/dV_G` from V_G, z_ss, the evenness of z and their slopes."""
    u, q, j, j_even = (
        doubles(at(lin, TWIST)),
        doubles(at(lin, REST)),
        doubles(at(lin, STEADY)),
        doubles(at(lin, EVENNESS)),
    )
    by_z, by_v = doubles(at(lin, BY_Z)), doubles(at(lin, BY_V))
    per_power = 1.0 / (u[0] * q[0] + u[1] * q[1] + u[2] * q[2])
    per_q2 = 1.0 / (q[0] * q[0] + q[1] * q[1] + q[2] * q[2])
    decay = v * v * per_power
    share = (z[0] * q[0] + z[1] * q[1] + z[2] * q[2]) * per_q2
    deflection = math.sqrt((z[0] * z[0] + z[1] * z[1] + z[2] * z[2]) * per_q2)
    per_deflection = 1.0 / deflection if deflection > 0.0 else 0.0
    beta, by_deflection, by_share, by_breakaway = closure_partials(law, deflection, share, even)
    by_even = law.breakaway_ratio * by_breakaway
    for k in range(3):
        by_z_k = (by_deflection * per_deflection * z[k] + by_share * q[k]) * per_q2 + by_even * j_even[k]
        z_j = z[0] * j[k] + z[1] * j[3 + k] + z[2] * j[6 + k]
        q_j = (q[0] * j[k] + q[1] * j[3 + k] + q[2] * j[6 + k]) * per_q2
        u_j = u[0] * j[k] + u[1] * j[3 + k] + u[2] * j[6 + k]
        decay_k = (2.0 * u[k] - decay * (q[k] + u_j)) * per_power
        share_k = z_j * per_q2 - 2.0 * share * q_j
        by_v_k = by_share * share_k - by_deflection * deflection * q_j
        for i in range(3):
            same = 1.0 if i == k else 0.0
            m_i = u[i] - decay * q[i]
            g_i = decay * z[i] + share * m_i
            g_k = (z[i] - share * q[i]) * decay_k + m_i * share_k + share * (same - decay * j[3 * i + k])
            by_z[3 * i + k] = -beta * (decay * same + m_i * q[k] * per_q2) - g_i * by_z_k
            by_v[3 * i + k] = same - g_i * by_v_k - beta * g_k


@entry
def linearise(contact, z, v, lin):
    """See `ModelFunctions`; at rest the rates do not depend on z and follow the twist."""
    own, twist, out = read(contact), doubles(v), doubles(lin)
    law, shape, data = own.law, own.shape, floats(own.data)
    x, y, s = scaled_twist(shape, twist[0], twist[1], twist[2])
    v = math.sqrt(x * x + y * y + s * s)
    if v > STILL:
        j = doubles(at(lin, STEADY))
        out[TWIST], out[TWIST + 1], out[TWIST + 2] = x, y, s
        out[REST], out[REST + 1], out[REST + 2] = steady_slopes(law, shape, _maps(own), data, x, y, s, v, j)
        z = doubles(z)
        even, by_z = evenness(law, fourth_moments(shape, _maps(own), data), (z[0], z[1], z[2]))
        out[EVENNESS], out[EVENNESS + 1], out[EVENNESS + 2] = by_z
        _slopes(law, z, v, even, lin)
    else:
        for i in range(9):
            out[BY_Z + i], out[BY_V + i] = 0.0, 1.0 if i % 4 == 0 else 0.0


@kernel
def _times(m, x, y, s):
    """A matrix times a vector."""
    return (
        m[0] * x + m[1] * y + m[2] * s,
        m[3] * x + m[4] * y + m[5] * s,
        m[6] * x + m[7] * y + m[8] * s,
    )


@entry
def factor(contact, z, shift, lin, stiffness):
    """See `ModelFunctions`: `S = -F' ((sigma_0 + sigma_1 shift) D^-1 dz'/dV_G + sigma_2) F`."""
    own, m, by_v, inverse = read(contact), doubles(lin), doubles(at(lin, BY_V)), doubles(at(lin, INVERSE))
    law, shape, out = own.law, own.shape, doubles(stiffness)
    a, b, c = shift - m[0], -m[1], -m[2]
    d, e, f = -m[3], shift - m[4], -m[5]
    g, h, i = -m[6], -m[7], shift - m[8]
    r, p, w = e * i - f * h, f * g - d * i, d * h - e * g
    per = 1.0 / (a * r + b * p + c * w)
    inverse[0], inverse[1], inverse[2] = r * per, (c * h - b * i) * per, (b * f - c * e) * per
    inverse[3], inverse[4], inverse[5] = p * per, (a * i - c * g) * per, (c * d - a * f) * per
    inverse[6], inverse[7], inverse[8] = w * per, (b * g - a * h) * per, (a * e - b * d) * per
    pull = law.sigma_0 + law.sigma_1 * shift
    for k in range(3):
        x, y, s = scaled_twist(shape, 1.0 if k == 0 else 0.0, 1.0 if k == 1 else 0.0, 1.0 if k == 2 else 0.0)
        nx, ny, ns = _times(by_v, x, y, s)
        nx, ny, ns = _times(inverse, nx, ny, ns)
        out[k], out[3 + k], out[6 + k] = to_origin(
            shape, -pull * nx - law.sigma_2 * x, -pull * ny - law.sigma_2 * y, -pull * ns - law.sigma_2 * s
        )


@entry
def eliminate(contact, z, shift, r, lin, w):
    """See `ModelFunctions`: `F' (sigma_1 - (sigma_0 + sigma_1 shift) D^-1) r`."""
    own, r, w = read(contact), doubles(r), doubles(w)
    sigma_1, pull = own.law.sigma_1, own.law.sigma_0 + own.law.sigma_1 * shift
    x, y, s = _times(doubles(at(lin, INVERSE)), r[0], r[1], r[2])
    w[0], w[1], w[2] = to_origin(
        own.shape, sigma_1 * r[0] - pull * x, sigma_1 * r[1] - pull * y, sigma_1 * r[2] - pull * s
    )


@entry
def back_substitute(contact, z, r, dv, lin, out):
    """See `ModelFunctions`."""
    own, r, v, out = read(contact), doubles(r), doubles(dv), doubles(out)
    x, y, s = scaled_twist(own.shape, v[0], v[1], v[2])
    x, y, s = _times(doubles(at(lin, BY_V)), x, y, s)
    out[0], out[1], out[2] = _times(doubles(at(lin, INVERSE)), r[0] + x, r[1] + y, r[2] + s)


@entry
def change(contact, z, zdot, lin, dz, dzdot, rows, friction, size):
    """See `ModelFunctions`."""
    own, z, dz, out, rows = read(contact), doubles(z), doubles(dz), doubles(dzdot), doubles(rows)
    law, shape = own.law, own.shape
    x, y, s = scaled_twist(shape, rows[6], rows[7], rows[8] + size * rows[2])
    ax, ay, a_s = dz[0] - friction * z[0], dz[1] - friction * z[1], dz[2] - friction * z[2]
    ax, ay, a_s = _times(doubles(lin), ax, ay, a_s)
    bx, by, bs = _times(doubles(at(lin, BY_V)), x, y, s)
    out[0], out[1], out[2] = ax + bx, ay + by, a_s + bs
    gx = formulas.traction(dz[0], out[0], x, law)
    gy = formulas.traction(dz[1], out[1], y, law)
    gs = formulas.traction(dz[2], out[2], s, law)
    rows[9], rows[10], tau = to_origin(shape, gx, gy, gs)
    rows[11] = tau + size * rows[5]


@kernel
def _transposed_times(m, x, y, s):
    """The transpose of a matrix times a vector."""
    return (
        m[0] * x + m[3] * y + m[6] * s,
        m[1] * x + m[4] * y + m[7] * s,
        m[2] * x + m[5] * y + m[8] * s,
    )


@entry
def solve_transposed(contact, z, r, lin, out):
    """See `ModelFunctions`."""
    r, out = doubles(r), doubles(out)
    out[0], out[1], out[2] = _transposed_times(doubles(at(lin, INVERSE)), r[0], r[1], r[2])


@entry
def pull_back(contact, z, lin, dzdot, rows, out):
    """See `ModelFunctions`; the transpose of `F' g` is F."""
    own, given, out, rows = read(contact), doubles(dzdot), doubles(out), doubles(rows)
    law, shape = own.law, own.shape
    x, y, s = scaled_twist(shape, rows[9], rows[10], rows[11])
    lx, ly, ls = given[0] - law.sigma_1 * x, given[1] - law.sigma_1 * y, given[2] - law.sigma_1 * s
    zx, zy, zs = _transposed_times(doubles(lin), lx, ly, ls)
    out[0], out[1], out[2] = zx - law.sigma_0 * x, zy - law.sigma_0 * y, zs - law.sigma_0 * s
    vx, vy, vs = _transposed_times(doubles(at(lin, BY_V)), lx, ly, ls)
    rows[6], rows[7], rows[8] = to_origin(shape, vx - law.sigma_2 * x, vy - law.sigma_2 * y, vs - law.sigma_2 * s)


FUNCTIONS = ModelFunctions(evaluate, linearise, factor, eliminate, back_substitute, change, solve_transposed, pull_back)
