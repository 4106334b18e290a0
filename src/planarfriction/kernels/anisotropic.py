"""Loops over the cells of a distributed contact whose friction depends on the direction, per unit normal load.

As `kernels.distributed`, but each cell sees `u = B V` through its own map `B = [L | L J rho]` and its bristle rests at
`a/q` (`q = sigma_0/g`, the grip; `a` the asymmetry) where it slides; the wrench of a traction t is `B' t`:

    z_hat = z - a/q,      zdot = u - k z_hat,      d zdot/dz = -A = -k I - z_hat (x) k_z
    d zdot/du = I - z_hat (x) k_v + A a d(1/q)/du,      t = -(sigma_0 z + sigma_1 zdot + sigma_2 u)

`cells` holds L_xx, L_xy, L_yy, (L J rho)_x, (L J rho)_y, a_x, a_y of each cell, [7, n]. `lin` [12, n] holds A,
d zdot/du and the inverse of `shift I + A`, each row by row.
"""

from __future__ import annotations

import math

from planarfriction import formulas
from planarfriction.kernels import compiled_math as xp
from planarfriction.kernels import inlined, kernel
from planarfriction.kernels.law import grip, grip_slope

CELL_NUMBERS, LINEAR_NUMBERS = 7, 12


@inlined
def _seen(cells, i, vx, vy, omega):
    """What cell i sees of a twist."""
    ux = cells[0, i] * vx + cells[1, i] * vy + cells[3, i] * omega
    return ux, cells[1, i] * vx + cells[2, i] * vy + cells[4, i] * omega


@inlined
def _wrench(cells, i, tx, ty):
    """Wrench of a traction of cell i."""
    fx, fy = cells[0, i] * tx + cells[1, i] * ty, cells[1, i] * tx + cells[2, i] * ty
    return fx, fy, cells[3, i] * tx + cells[4, i] * ty


@kernel
def evaluate(law, z, vx, vy, omega, cells, w, zdot):
    """Write the bristle rates into `zdot` and return the wrench `(fx, fy, tau)`."""
    n = w.shape[0]
    fx, fy, tau = 0.0, 0.0, 0.0
    for i in range(n):
        ux, uy = _seen(cells, i, vx, vy, omega)
        speed = math.sqrt(ux * ux + uy * uy)
        q = grip(law, speed)
        hx, hy = z[i] - cells[5, i] / q, z[n + i] - cells[6, i] / q
        norm = math.sqrt(hx * hx + hy * hy)
        along = (hx * ux + hy * uy) / xp.where(norm > 0.0, norm, 1.0)
        k = formulas.bristle_decay(xp, norm * q, along, speed, q, law)
        zdot[i] = ux - k * hx
        zdot[n + i] = uy - k * hy
        tx = w[i] * formulas.traction(z[i], zdot[i], ux, law)
        ty = w[i] * formulas.traction(z[n + i], zdot[n + i], uy, law)
        wx, wy, wt = _wrench(cells, i, tx, ty)
        fx += wx
        fy += wy
        tau += wt
    return fx, fy, tau


@kernel
def linearise(law, z, vx, vy, omega, cells, lin):
    """Write `A` and `d zdot/du` of each cell into the rows 0 to 7 of `lin`."""
    n = lin.shape[1]
    for i in range(n):
        ux, uy = _seen(cells, i, vx, vy, omega)
        speed = math.sqrt(ux * ux + uy * uy)
        per_speed = 1.0 / xp.where(speed > 0.0, speed, 1.0)
        q = grip(law, speed)
        q_slope = grip_slope(law, speed, q)
        ax, ay = cells[5, i] / q, cells[6, i] / q
        hx, hy = z[i] - ax, z[n + i] - ay
        norm = math.sqrt(hx * hx + hy * hy)
        per_norm = 1.0 / xp.where(norm > 0.0, norm, 1.0)
        ex, ey = hx * per_norm, hy * per_norm
        along = ex * ux + ey * uy
        k, k_deflection, k_along, k_speed = formulas.bristle_decay_partials(xp, norm * q, along, speed, q, law)
        k_grip = k_deflection * norm + k / q
        turn = k_along * per_norm
        kzx = k_deflection * q * ex + turn * (ux - along * ex)
        kzy = k_deflection * q * ey + turn * (uy - along * ey)
        along_u = (k_speed + k_grip * q_slope) * per_speed
        kvx, kvy = k_along * ex + along_u * ux, k_along * ey + along_u * uy
        xx, xy, yx, yy = k + hx * kzx, hx * kzy, hy * kzx, k + hy * kzy
        lin[0, i], lin[1, i], lin[2, i], lin[3, i] = xx, xy, yx, yy
        c = -q_slope / q * per_speed  # of a/q, per a/q and u
        sx, sy = c * (xx * ax + xy * ay), c * (yx * ax + yy * ay)
        lin[4, i], lin[5, i] = 1.0 - hx * kvx + sx * ux, -hx * kvy + sx * uy
        lin[6, i], lin[7, i] = -hy * kvx + sy * ux, 1.0 - hy * kvy + sy * uy


@kernel
def factor(law, shift, cells, w, lin, stiffness):
    """Invert `D = shift I + A` (rows 8 to 11 of `lin`); write `d wrench/d twist` with the bristles eliminated.

    Per cell `B' [-(sigma_0 + sigma_1 shift) D^-1 d zdot/du - sigma_2 I] B`.
    """
    pull = law.sigma_0 + law.sigma_1 * shift
    xx, xy, xt, yx, yy, yt, tx, ty, tt = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(w.shape[0]):
        a, b, c, d = shift + lin[0, i], lin[1, i], lin[2, i], shift + lin[3, i]
        per_determinant = 1.0 / (a * d - b * c)
        a, b, c, d = d * per_determinant, -b * per_determinant, -c * per_determinant, a * per_determinant
        lin[8, i], lin[9, i], lin[10, i], lin[11, i] = a, b, c, d
        p, v = -w[i] * pull, -w[i] * law.sigma_2
        pxx, pxy = p * (a * lin[4, i] + b * lin[6, i]) + v, p * (a * lin[5, i] + b * lin[7, i])
        pyx, pyy = p * (c * lin[4, i] + d * lin[6, i]), p * (c * lin[5, i] + d * lin[7, i]) + v
        lxx, lxy, lyy, qx, qy = cells[0, i], cells[1, i], cells[2, i], cells[3, i], cells[4, i]
        ax, ay = pxx * lxx + pxy * lxy, pyx * lxx + pyy * lxy  # traction per vx
        bx, by = pxx * lxy + pxy * lyy, pyx * lxy + pyy * lyy  # per vy
        sx, sy = pxx * qx + pxy * qy, pyx * qx + pyy * qy  # per omega
        xx += lxx * ax + lxy * ay
        xy += lxx * bx + lxy * by
        xt += lxx * sx + lxy * sy
        yx += lxy * ax + lyy * ay
        yy += lxy * bx + lyy * by
        yt += lxy * sx + lyy * sy
        tx += qx * ax + qy * ay
        ty += qx * bx + qy * by
        tt += qx * sx + qy * sy
    stiffness[0, 0], stiffness[0, 1], stiffness[0, 2] = xx, xy, xt
    stiffness[1, 0], stiffness[1, 1], stiffness[1, 2] = yx, yy, yt
    stiffness[2, 0], stiffness[2, 1], stiffness[2, 2] = tx, ty, tt


@kernel
def eliminate(law, shift, r, cells, w, lin):
    """Wrench caused by the bristle residual `r`: `sum w B' [-(sigma_0 + sigma_1 shift) D^-1 r + sigma_1 r]`."""
    n = w.shape[0]
    pull = law.sigma_0 + law.sigma_1 * shift
    fx, fy, tau = 0.0, 0.0, 0.0
    for i in range(n):
        tx = w[i] * (law.sigma_1 * r[i] - pull * (lin[8, i] * r[i] + lin[9, i] * r[n + i]))
        ty = w[i] * (law.sigma_1 * r[n + i] - pull * (lin[10, i] * r[i] + lin[11, i] * r[n + i]))
        wx, wy, wt = _wrench(cells, i, tx, ty)
        fx += wx
        fy += wy
        tau += wt
    return fx, fy, tau


@kernel
def back_substitute(r, vx, vy, omega, cells, lin, out):
    """Solve `D out = r + d zdot/du B dV` for the change of the twist `(vx, vy, omega)`."""
    n = lin.shape[1]
    for i in range(n):
        ux, uy = _seen(cells, i, vx, vy, omega)
        ax = r[i] + lin[4, i] * ux + lin[5, i] * uy
        ay = r[n + i] + lin[6, i] * ux + lin[7, i] * uy
        out[i] = lin[8, i] * ax + lin[9, i] * ay
        out[n + i] = lin[10, i] * ax + lin[11, i] * ay
