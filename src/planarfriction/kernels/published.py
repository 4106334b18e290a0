"""The reduced model: one bristle in three dimensions, per unit normal load and about the contact frame's origin.

The raw state `z` [m, m, m^2] is `S z_hat` with `S = diag(1, 1, r)`; in scaled coordinates the bristle obeys the
equation of a cell, `z_hat' = u - k z_hat`, driven by `u = h(V) v_n` instead of `v` and with `z_max = |h| g/sigma_0`:

    d z_hat'/dz_hat = -k I - z_hat (x) k_z,      d z_hat'/dV_S = du/dV_S - z_hat (x) k_V

`shape` is `(cop_x, cop_y, r, <rho^2>)`; `surface` is `(kind, start, size)` of `kernels.surfaces`.
"""

from __future__ import annotations

import math

from planarfriction import formulas
from planarfriction.kernels import compiled_math as xp
from planarfriction.kernels import inlined, kernel
from planarfriction.kernels.law import grip, grip_slope
from planarfriction.kernels.surfaces import sliding, sliding_jacobian


@inlined
def scaled_twist(shape, vx, vy, omega):
    return vx - omega * shape[1], vy + omega * shape[0], shape[2] * omega


@inlined
def wrench(law, shape, zx, zy, zt, dx, dy, dt, vx, vy, omega):
    """Wrench about the origin, from raw bristles and rates and the twist at the centre of pressure."""
    fx = formulas.traction(zx, dx, vx, law)
    fy = formulas.traction(zy, dy, vy, law)
    tau = formulas.traction(zt, dt, shape[3] * omega, law)
    return fx, fy, tau + shape[0] * fy - shape[1] * fx


@inlined
def _decay(law, zx, zy, zs, ux, uy, us, v_n):
    """`k` of the scaled bristle `(zx, zy, zs)` driven by `u`."""
    u_norm = math.sqrt(ux * ux + uy * uy + us * us)
    h_norm = u_norm / v_n if v_n > 0.0 else 1.0
    z_norm = math.sqrt(zx * zx + zy * zy + zs * zs)
    along = (zx * ux + zy * uy + zs * us) / xp.where(z_norm * h_norm > 0.0, z_norm * h_norm, 1.0)
    q = grip(law, v_n)
    return formulas.bristle_decay(xp, z_norm * q / h_norm, along, v_n, q, law)


@kernel
def evaluate(law, z, vx, vy, omega, shape, surface, data, zdot):
    """Write the raw bristle rates into `zdot` and return the wrench `(fx, fy, tau)`."""
    x, y, s = scaled_twist(shape, vx, vy, omega)
    v_n = math.sqrt(x * x + y * y + s * s)
    ux, uy, us = sliding(surface[0], data, surface[1], surface[2], x, y, s, v_n)
    k = _decay(law, z[0], z[1], z[2] / shape[2], ux, uy, us, v_n)
    zdot[0], zdot[1], zdot[2] = ux - k * z[0], uy - k * z[1], shape[2] * us - k * z[2]
    return wrench(law, shape, z[0], z[1], z[2], zdot[0], zdot[1], zdot[2], x, y, omega)


@kernel
def linearise(law, z, vx, vy, omega, shape, surface, data, lin):
    """Write into `lin`: `k` (0), `k_z` (1:4), `z_hat` (4:7) and `d z_hat'/dV_S` (7:16, row by row)."""
    x, y, s = scaled_twist(shape, vx, vy, omega)
    v_n = math.sqrt(x * x + y * y + s * s)
    per_v = 1.0 / v_n if v_n > 0.0 else 0.0
    j = lin[18:27]
    sliding_jacobian(surface[0], data, surface[1], surface[2], x, y, s, v_n, j)
    ux, uy, us = j[0] * x + j[1] * y + j[2] * s, j[3] * x + j[4] * y + j[5] * s, j[6] * x + j[7] * y + j[8] * s
    zx, zy, zs = z[0], z[1], z[2] / shape[2]
    u_norm = math.sqrt(ux * ux + uy * uy + us * us)
    h_norm = u_norm * per_v if u_norm > 0.0 else 1.0
    z_norm = math.sqrt(zx * zx + zy * zy + zs * zs)
    per_z = 1.0 / z_norm if z_norm > 0.0 else 0.0
    per_u = 1.0 / u_norm if u_norm > 0.0 else 0.0
    per_h = 1.0 / h_norm
    ex, ey, es = zx * per_z, zy * per_z, zs * per_z
    qx, qy, qs = ux * per_h, uy * per_h, us * per_h  # v_n times the unit vector of h
    along = ex * qx + ey * qy + es * qs
    q = grip(law, v_n)
    deflection = z_norm * q * per_h
    k, k_deflection, k_along, k_speed = formulas.bristle_decay_partials(xp, deflection, along, v_n, q, law)
    k_z_norm = k_deflection * q * per_h
    lin[0] = k
    c = k_along * per_z
    lin[1] = k_z_norm * ex + c * (qx - along * ex)
    lin[2] = k_z_norm * ey + c * (qy - along * ey)
    lin[3] = k_z_norm * es + c * (qs - along * es)
    lin[4], lin[5], lin[6] = zx, zy, zs
    # gradients with respect to V_S: of v_n, of |h|, and of `along` = e.u/|h|
    k_grip = k_deflection * z_norm * per_h + k / q
    speed_total = k_speed + k_grip * grip_slope(law, v_n, q)
    for m in range(3):
        n_m = (x if m == 0 else (y if m == 1 else s)) * per_v
        u_m = (ux * j[m] + uy * j[3 + m] + us * j[6 + m]) * per_u  # of |u|
        h_m = (u_m - h_norm * n_m) * per_v
        along_m = (ex * j[m] + ey * j[3 + m] + es * j[6 + m] - along * h_m) * per_h
        k_m = speed_total * n_m - k_deflection * deflection * per_h * h_m + k_along * along_m
        lin[7 + m] = j[m] - zx * k_m
        lin[10 + m] = j[3 + m] - zy * k_m
        lin[13 + m] = j[6 + m] - zs * k_m


@inlined
def _solve(lin, ax, ay, a_s):
    """`D^-1 a` in scaled coordinates, `D = (shift + k) I + z_hat (x) k_z`, once `factor` has prepared it."""
    c = (lin[1] * ax + lin[2] * ay + lin[3] * a_s) * lin[17]
    return (ax - c * lin[4]) * lin[16], (ay - c * lin[5]) * lin[16], (a_s - c * lin[6]) * lin[16]


@kernel
def factor(law, shift, shape, lin, stiffness):
    """Prepare `D` (16, 17 of `lin`) and write `d wrench/d twist` with the bristle eliminated.

    It is `-(sigma_0 + sigma_1 shift) S D^-1 F S - sigma_2 U` about the centre of pressure.
    """
    lin[16] = 1.0 / (shift + lin[0])
    lin[17] = 1.0 / (shift + lin[0] + lin[1] * lin[4] + lin[2] * lin[5] + lin[3] * lin[6])
    pull = law.sigma_0 + law.sigma_1 * shift
    r = shape[2]
    for m in range(3):
        scale = r if m == 2 else 1.0
        bx, by, bs = _solve(lin, lin[7 + m], lin[10 + m], lin[13 + m])
        stiffness[0, m] = -pull * scale * bx
        stiffness[1, m] = -pull * scale * by
        stiffness[2, m] = -pull * scale * r * bs
    stiffness[0, 0] -= law.sigma_2
    stiffness[1, 1] -= law.sigma_2
    stiffness[2, 2] -= law.sigma_2 * shape[3]
    # from the centre of pressure to the origin: T' stiffness T
    cx, cy = shape[0], shape[1]
    for m in range(3):
        stiffness[m, 2] += cx * stiffness[m, 1] - cy * stiffness[m, 0]
    for m in range(3):
        stiffness[2, m] += cx * stiffness[1, m] - cy * stiffness[0, m]


@kernel
def eliminate(law, shift, r, shape, lin):
    """Wrench about the origin caused by the raw bristle residual `r`."""
    pull = law.sigma_0 + law.sigma_1 * shift
    bx, by, bs = _solve(lin, r[0], r[1], r[2] / shape[2])
    fx, fy = law.sigma_1 * r[0] - pull * bx, law.sigma_1 * r[1] - pull * by
    tau = law.sigma_1 * r[2] - pull * shape[2] * bs
    return fx, fy, tau + shape[0] * fy - shape[1] * fx


@kernel
def back_substitute(r, vx, vy, omega, shape, lin, out):
    """Solve `D out = r + d zdot/dV dV` for the change of the twist about the origin."""
    x, y, s = scaled_twist(shape, vx, vy, omega)
    out[0], out[1], bs = _solve(
        lin,
        r[0] + lin[7] * x + lin[8] * y + lin[9] * s,
        r[1] + lin[10] * x + lin[11] * y + lin[12] * s,
        r[2] / shape[2] + lin[13] * x + lin[14] * y + lin[15] * s,
    )
    out[2] = shape[2] * bs
