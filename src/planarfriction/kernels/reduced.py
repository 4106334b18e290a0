"""Moments of the bristles of a patch: three states, per unit normal load, twists about the contact frame's origin.

In scaled coordinates `V_G = F V` (F upper triangular, `F'F` the patch's second moments of slip, so that `|V_G|` is the
root mean square of the cells' speeds) the state z [3] [m], conjugate to V_G, obeys

    z' = V_G - beta (lambda z + s m),   s = z . z_ss / |z_ss|^2,   lambda = |V_G|^2 / (V_G . z_ss),
    m = V_G - lambda z_ss,   W = -F' (sigma_0 z + sigma_1 z' + sigma_2 V_G)

`shape` is `(F_00, F_01, F_02, F_11, F_12, F_22, blend)`; `surface` is `(start, other)`, where in `data` the map of the
shape begins and, if `blend > 0`, that of the other shape which has this share in the steady state.
"""

from __future__ import annotations

import math

from planarfriction import formulas
from planarfriction.kernels import compiled_math as xp
from planarfriction.kernels import inlined, kernel
from planarfriction.kernels.steady import evenness, scaled_twist, sliding, steady_slopes

LINEAR = 43
"""Numbers of a linearisation: `beta`, dz'/dz (1:10), dz'/dV_G (10:19), the inverse of D (19:28), dz_ss/dV_G (28:37),
and the slopes of the evenness (37:40)."""


@inlined
def wrench(law, shape, zx, zy, zs, dx, dy, ds, x, y, s):
    """Wrench about the origin from state, rate and twist in scaled coordinates."""
    gx = formulas.traction(zx, dx, x, law)
    gy = formulas.traction(zy, dy, y, law)
    gs = formulas.traction(zs, ds, s, law)
    return to_origin(shape, gx, gy, gs)


@inlined
def to_origin(shape, gx, gy, gs):
    """`F' g`."""
    return shape[0] * gx, shape[1] * gx + shape[3] * gy, shape[2] * gx + shape[4] * gy + shape[5] * gs


# ---------------------------------------------------------------------- the closure


@inlined
def closure(law, deflection, share, even):
    """`beta` of a state z: `deflection = |z|/|z_ss|`, `share` = s, `even` as in `steady.evenness`."""
    cosine = share / xp.where(deflection > 0.0, deflection, 1.0)
    return formulas.slip_share(xp, deflection, cosine, even, law)


@inlined
def closure_partials(law, deflection, share, even):
    """`beta` and its partial derivatives with respect to `deflection`, `share` and the breakaway `s_ba even`."""
    per = xp.where(deflection > 0.0, 1.0 / xp.where(deflection > 0.0, deflection, 1.0), 0.0)
    beta, by_deflection, by_cosine, by_breakaway = formulas.slip_share_partials(xp, deflection, share * per, even, law)
    return beta, by_deflection - by_cosine * share * per * per, by_cosine * per, by_breakaway


@inlined
def part_rate(beta, share, decay, z, u, q):
    """One component of `z'`."""
    return u - beta * (decay * z + share * (u - decay * q))


@kernel
def evaluate(law, z, vx, vy, omega, shape, surface, data, zdot):
    """Write the rates of the moments into `zdot` and return the wrench `(fx, fy, tau)`."""
    x, y, s, v, qx, qy, qs, even = sliding(law, vx, vy, omega, shape, surface, data)
    power, per_q2 = x * qx + y * qy + s * qs, 1.0 / (qx * qx + qy * qy + qs * qs)
    decay = v * v / xp.where(power > 0.0, power, 1.0)
    share = (z[0] * qx + z[1] * qy + z[2] * qs) * per_q2
    beta = closure(law, math.sqrt((z[0] * z[0] + z[1] * z[1] + z[2] * z[2]) * per_q2), share, even)
    zdot[0] = part_rate(beta, share, decay, z[0], x, qx)
    zdot[1] = part_rate(beta, share, decay, z[1], y, qy)
    zdot[2] = part_rate(beta, share, decay, z[2], s, qs)
    return wrench(law, shape, z[0], z[1], z[2], zdot[0], zdot[1], zdot[2], x, y, s)


# ---------------------------------------------------------------------- the linearised equation


@kernel
def slopes(law, z, u, v, q, j, even, j_even, by_z, by_v):
    """`dz'/dz` and `dz'/dV_G` [9] at the scaled twist `u`, from `q = z_ss`, the evenness and their slopes.

    Returns `beta`.
    """
    zx, zy, zs = z[0], z[1], z[2]
    per_power = 1.0 / (u[0] * q[0] + u[1] * q[1] + u[2] * q[2])
    per_q2 = 1.0 / (q[0] * q[0] + q[1] * q[1] + q[2] * q[2])
    decay = v * v * per_power
    share = (zx * q[0] + zy * q[1] + zs * q[2]) * per_q2
    deflection = math.sqrt((zx * zx + zy * zy + zs * zs) * per_q2)
    per_deflection = 1.0 / deflection if deflection > 0.0 else 0.0
    beta, by_deflection, by_share, by_breakaway = closure_partials(law, deflection, share, even)
    by_even = law.breakaway_ratio * by_breakaway
    for i in range(3):
        m_i = u[i] - decay * q[i]
        g_i = decay * z[i] + share * m_i
        for k in range(3):
            same = 1.0 if i == k else 0.0
            beta_k = (by_deflection * per_deflection * z[k] + by_share * q[k]) * per_q2
            by_z[3 * i + k] = -beta * (decay * same + m_i * q[k] * per_q2) - g_i * beta_k
            z_j = zx * j[k] + zy * j[3 + k] + zs * j[6 + k]
            q_j = (q[0] * j[k] + q[1] * j[3 + k] + q[2] * j[6 + k]) * per_q2
            u_j = u[0] * j[k] + u[1] * j[3 + k] + u[2] * j[6 + k]
            decay_k = (2.0 * u[k] - decay * (q[k] + u_j)) * per_power
            share_k = z_j * per_q2 - 2.0 * share * q_j
            beta_k = by_share * share_k - by_deflection * deflection * q_j + by_even * j_even[k]
            g_k = (z[i] - share * q[i]) * decay_k + m_i * share_k + share * (same - decay * j[3 * i + k])
            by_v[3 * i + k] = same - g_i * beta_k - beta * g_k
    return beta


@kernel
def linearise(law, z, vx, vy, omega, shape, surface, data, lin):
    """Linearise the rates into `lin` [43] (see `LINEAR`); at rest they do not depend on z and follow the twist."""
    x, y, s = scaled_twist(shape, vx, vy, omega)
    v = math.sqrt(x * x + y * y + s * s)
    if v > 0.0:
        q = steady_slopes(law, shape, surface, data, x, y, s, v, lin[28:43])
        even, lin[37], lin[38], lin[39] = evenness(shape, surface, data, x, y, s, v)
        lin[0] = slopes(law, z, (x, y, s), v, q, lin[28:37], even, lin[37:40], lin[1:10], lin[10:19])
    else:
        for i in range(19):
            lin[i] = 0.0
        lin[10], lin[14], lin[18] = 1.0, 1.0, 1.0


@inlined
def _solve(lin, a, b, c):
    """`D^-1 (a, b, c)` with `D = shift I - dz'/dz`, once `factor` has prepared it."""
    return (
        lin[19] * a + lin[20] * b + lin[21] * c,
        lin[22] * a + lin[23] * b + lin[24] * c,
        lin[25] * a + lin[26] * b + lin[27] * c,
    )


@kernel
def factor(law, shift, shape, lin, stiffness):
    """Prepare `D^-1` in `lin` and write `d wrench/d twist` with the moments eliminated.

    It is `-F' ((sigma_0 + sigma_1 shift) D^-1 dz'/dV_G + sigma_2) F`.
    """
    a, b, c = shift - lin[1], -lin[2], -lin[3]
    d, e, f = -lin[4], shift - lin[5], -lin[6]
    g, h, i = -lin[7], -lin[8], shift - lin[9]
    r, p, w = e * i - f * h, f * g - d * i, d * h - e * g
    per = 1.0 / (a * r + b * p + c * w)
    lin[19], lin[20], lin[21] = r * per, (c * h - b * i) * per, (b * f - c * e) * per
    lin[22], lin[23], lin[24] = p * per, (a * i - c * g) * per, (c * d - a * f) * per
    lin[25], lin[26], lin[27] = w * per, (b * g - a * h) * per, (a * e - b * d) * per
    pull = law.sigma_0 + law.sigma_1 * shift
    for m in range(3):
        # column m of F
        x, y, s = shape[m], (0.0 if m == 0 else shape[2 + m]), (shape[5] if m == 2 else 0.0)
        nx, ny, ns = _solve(
            lin,
            lin[10] * x + lin[11] * y + lin[12] * s,
            lin[13] * x + lin[14] * y + lin[15] * s,
            lin[16] * x + lin[17] * y + lin[18] * s,
        )
        stiffness[0, m], stiffness[1, m], stiffness[2, m] = to_origin(
            shape, -pull * nx - law.sigma_2 * x, -pull * ny - law.sigma_2 * y, -pull * ns - law.sigma_2 * s
        )


@kernel
def eliminate(law, shift, r, shape, lin):
    """Wrench about the origin caused by the residual `r` of the moments."""
    pull = law.sigma_0 + law.sigma_1 * shift
    x, y, s = _solve(lin, r[0], r[1], r[2])
    return to_origin(shape, law.sigma_1 * r[0] - pull * x, law.sigma_1 * r[1] - pull * y, law.sigma_1 * r[2] - pull * s)


@kernel
def back_substitute(r, vx, vy, omega, shape, lin, out):
    """Solve `D out = r + dz'/dV_G F dV` for the change of the twist about the origin."""
    x, y, s = scaled_twist(shape, vx, vy, omega)
    out[0], out[1], out[2] = _solve(
        lin,
        r[0] + lin[10] * x + lin[11] * y + lin[12] * s,
        r[1] + lin[13] * x + lin[14] * y + lin[15] * s,
        r[2] + lin[16] * x + lin[17] * y + lin[18] * s,
    )
