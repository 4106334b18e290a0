"""Loops over the cells of the distributed model, all per unit normal load and about the contact frame's origin.

A contact of n cells has the state `z = [z_x (n), z_y (n)]`; `x, y, w` are positions and weights, `vx, vy, omega` the
twist. The bristle equation and its linearisation, with `k = bristle_decay`:

    zdot = v - k z,      d zdot/dz = -k I - z (x) k_z,      d zdot/dv = I - z (x) k_v

so that `D = 1/(h gamma) I - d zdot/dz` is a multiple of the identity plus a rank-one term and has a closed inverse.
Every function is linear in the number of cells.
"""

from __future__ import annotations

import math

from planarfriction import formulas
from planarfriction.kernels import compiled_math as xp
from planarfriction.kernels import inlined, kernel
from planarfriction.kernels.law import grip, grip_slope, squared


@inlined
def _evaluate(law, z, vx, vy, omega, x, y, w, zdot):
    n = x.shape[0]
    zx, zy, dx, dy = z[:n], z[n:], zdot[:n], zdot[n:]
    fx, fy, tau = 0.0, 0.0, 0.0
    for i in range(n):
        ux, uy = vx - omega * y[i], vy + omega * x[i]
        speed = math.sqrt(ux * ux + uy * uy)
        z_norm = math.sqrt(zx[i] * zx[i] + zy[i] * zy[i])
        along = (zx[i] * ux + zy[i] * uy) / xp.where(z_norm > 0.0, z_norm, 1.0)
        q = grip(law, speed)
        k = formulas.bristle_decay(xp, z_norm * q, along, speed, q, law)
        dx[i] = ux - k * zx[i]
        dy[i] = uy - k * zy[i]
        tx = w[i] * formulas.traction(zx[i], dx[i], ux, law)
        ty = w[i] * formulas.traction(zy[i], dy[i], uy, law)
        fx += tx
        fy += ty
        tau += x[i] * ty - y[i] * tx
    return fx, fy, tau


@kernel
def evaluate(law, z, vx, vy, omega, x, y, w, zdot):
    """Write the bristle rates into `zdot` and return the wrench `(fx, fy, tau)`."""
    if law.gamma == 2.0:
        return _evaluate(squared(law), z, vx, vy, omega, x, y, w, zdot)
    return _evaluate(law, z, vx, vy, omega, x, y, w, zdot)


@inlined
def _linearise(law, z, vx, vy, omega, x, y, k, kzx, kzy, kvx, kvy):
    n = x.shape[0]
    zx, zy = z[:n], z[n:]
    for i in range(n):
        ux, uy = vx - omega * y[i], vy + omega * x[i]
        speed = math.sqrt(ux * ux + uy * uy)
        z_norm = math.sqrt(zx[i] * zx[i] + zy[i] * zy[i])
        per_z = 1.0 / xp.where(z_norm > 0.0, z_norm, 1.0)
        per_speed = 1.0 / xp.where(speed > 0.0, speed, 1.0)
        ex, ey = zx[i] * per_z, zy[i] * per_z
        along = ex * ux + ey * uy
        q = grip(law, speed)
        decay, k_deflection, k_along, k_speed = formulas.bristle_decay_partials(xp, z_norm * q, along, speed, q, law)
        k_grip = k_deflection * z_norm + decay / q
        k_z_norm = k_deflection * q
        k_speed_total = (k_speed + k_grip * grip_slope(law, speed, q)) * per_speed
        k[i] = decay
        kzx[i] = k_z_norm * ex + k_along * per_z * (ux - along * ex)
        kzy[i] = k_z_norm * ey + k_along * per_z * (uy - along * ey)
        kvx[i] = k_along * ex + k_speed_total * ux
        kvy[i] = k_along * ey + k_speed_total * uy


@kernel
def linearise(law, z, vx, vy, omega, x, y, lin):
    """Write `k`, `k_z` and `k_v` of each cell into the rows 0 to 4 of `lin`."""
    if law.gamma == 2.0:
        _linearise(squared(law), z, vx, vy, omega, x, y, lin[0], lin[1], lin[2], lin[3], lin[4])
    else:
        _linearise(law, z, vx, vy, omega, x, y, lin[0], lin[1], lin[2], lin[3], lin[4])


@kernel
def factor(law, z, shift, x, y, w, lin, stiffness):
    """Prepare `D = shift I - d zdot/dz` (rows 5, 6 of `lin`); write `d wrench/d twist` with the bristles eliminated.

    Per cell `-(sigma_0 + sigma_1 shift) D^-1 d zdot/dv - sigma_2 I`, with
    `D^-1 d zdot/dv = (I - z (x) m)/(shift + k)` and `m = ((shift + k) k_v + k_z)/(shift + k + k_z.z)`.
    """
    n = x.shape[0]
    zx, zy = z[:n], z[n:]
    k, kzx, kzy, kvx, kvy, per_diagonal, per_rank_one = lin[0], lin[1], lin[2], lin[3], lin[4], lin[5], lin[6]
    pull = law.sigma_0 + law.sigma_1 * shift
    xx, xy, xt, yx, yy, yt, tx, ty, tt = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(n):
        diagonal = shift + k[i]
        per_diagonal[i] = 1.0 / diagonal
        per_rank_one[i] = 1.0 / (diagonal + kzx[i] * zx[i] + kzy[i] * zy[i])
        mx = (diagonal * kvx[i] + kzx[i]) * per_rank_one[i]
        my = (diagonal * kvy[i] + kzy[i]) * per_rank_one[i]
        c = -w[i] * pull * per_diagonal[i]
        d = -w[i] * law.sigma_2
        sxx, sxy = c * (1.0 - zx[i] * mx) + d, -c * zx[i] * my
        syx, syy = -c * zy[i] * mx, c * (1.0 - zy[i] * my) + d
        sxt, syt = sxy * x[i] - sxx * y[i], syy * x[i] - syx * y[i]
        xx += sxx
        xy += sxy
        xt += sxt
        yx += syx
        yy += syy
        yt += syt
        tx += x[i] * syx - y[i] * sxx
        ty += x[i] * syy - y[i] * sxy
        tt += x[i] * syt - y[i] * sxt
    stiffness[0, 0], stiffness[0, 1], stiffness[0, 2] = xx, xy, xt
    stiffness[1, 0], stiffness[1, 1], stiffness[1, 2] = yx, yy, yt
    stiffness[2, 0], stiffness[2, 1], stiffness[2, 2] = tx, ty, tt


@kernel
def eliminate(law, z, shift, r, x, y, w, lin):
    """Wrench caused by the bristle residual `r`: `sum w P' [-(sigma_0 + sigma_1 shift) D^-1 r + sigma_1 r]`."""
    n = x.shape[0]
    zx, zy, rx, ry = z[:n], z[n:], r[:n], r[n:]
    kzx, kzy, per_diagonal, per_rank_one = lin[1], lin[2], lin[5], lin[6]
    pull = law.sigma_0 + law.sigma_1 * shift
    fx, fy, tau = 0.0, 0.0, 0.0
    for i in range(n):
        c = (kzx[i] * rx[i] + kzy[i] * ry[i]) * per_rank_one[i]
        tx = w[i] * (law.sigma_1 * rx[i] - pull * per_diagonal[i] * (rx[i] - zx[i] * c))
        ty = w[i] * (law.sigma_1 * ry[i] - pull * per_diagonal[i] * (ry[i] - zy[i] * c))
        fx += tx
        fy += ty
        tau += x[i] * ty - y[i] * tx
    return fx, fy, tau


@kernel
def back_substitute(z, r, vx, vy, omega, x, y, lin, out):
    """Solve `D out = r + d zdot/dv dv` for the change of the twist `(vx, vy, omega)`."""
    n = x.shape[0]
    zx, zy, rx, ry, ox, oy = z[:n], z[n:], r[:n], r[n:], out[:n], out[n:]
    kzx, kzy, kvx, kvy, per_diagonal, per_rank_one = lin[1], lin[2], lin[3], lin[4], lin[5], lin[6]
    for i in range(n):
        ux, uy = vx - omega * y[i], vy + omega * x[i]
        c = kvx[i] * ux + kvy[i] * uy
        ax, ay = rx[i] + ux - zx[i] * c, ry[i] + uy - zy[i] * c
        b = (kzx[i] * ax + kzy[i] * ay) * per_rank_one[i]
        ox[i] = (ax - zx[i] * b) * per_diagonal[i]
        oy[i] = (ay - zy[i] * b) * per_diagonal[i]
