"""A contact of the distributed model as the solver calls it (see `contacts.ModelFunctions`).

A contact of n cells has the state `z = [z_x (n), z_y (n)]`. The bristle equation of a cell and its linearisation, with
`k = bristle_decay` (docs/physics.md, docs/solver.md):

    zdot = v - k z,      d zdot/dz = -k I - z (x) k_z,      d zdot/dv = I - z (x) k_v

so that `D = shift I - d zdot/dz` is a multiple of the identity plus a rank-one term and has a closed inverse. Every
function is linear in the number of cells.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from planarfriction import formulas
from planarfriction.compiler import compiled_math as xp
from planarfriction.compiler import entry, kernel
from planarfriction.formulas import LawNumbers
from planarfriction.kernels.contacts import ModelFunctions
from planarfriction.kernels.law import grip, grip_slope, squared
from planarfriction.kernels.pointers import at, doubles
from planarfriction.kernels.records import reader

LINEAR = 7
"""Numbers of a cell's linearisation: rows k, k_z (2), k_v (2), and of D one over its diagonal and its rank-one part."""


class DistributedContact(NamedTuple):
    """A contact of n cells."""

    law: LawNumbers
    count: int
    """n"""
    x: int
    """Where the positions of the cells are [m], and their weights."""
    y: int
    weights: int


read = reader(DistributedContact)


@kernel
def _cells(own):
    return doubles(own.x), doubles(own.y), doubles(own.weights)


@kernel
def _linear(own, lin):
    """The rows of a linearisation."""
    n = own.count
    return (
        doubles(lin), doubles(at(lin, n)), doubles(at(lin, 2 * n)), doubles(at(lin, 3 * n)), doubles(at(lin, 4 * n)),
        doubles(at(lin, 5 * n)), doubles(at(lin, 6 * n)),
    )  # fmt: skip


@kernel
def _evaluate(law, own, z, v, zdot, w):
    n, (x, y, weights) = own.count, _cells(own)
    vx, vy, omega = v[0], v[1], v[2]
    fx, fy, tau = 0.0, 0.0, 0.0
    for i in range(n):
        zx, zy = z[i], z[n + i]
        ux, uy = vx - omega * y[i], vy + omega * x[i]
        speed = math.sqrt(ux * ux + uy * uy)
        z_norm = math.sqrt(zx * zx + zy * zy)
        along = (zx * ux + zy * uy) / xp.where(z_norm > 0.0, z_norm, 1.0)
        q = grip(law, speed)
        k = formulas.bristle_decay(xp, z_norm * q, along, speed, q, law)
        dx, dy = ux - k * zx, uy - k * zy
        zdot[i], zdot[n + i] = dx, dy
        tx = weights[i] * formulas.traction(zx, dx, ux, law)
        ty = weights[i] * formulas.traction(zy, dy, uy, law)
        fx += tx
        fy += ty
        tau += x[i] * ty - y[i] * tx
    w[0], w[1], w[2] = fx, fy, tau


@entry
def evaluate(contact, z, v, zdot, w):
    """See `ModelFunctions`: `zdot`, and `W = sum w_i [t_i ; rho_i x t_i]`."""
    own = read(contact)
    if own.law.gamma == 2.0:
        _evaluate(squared(own.law), own, doubles(z), doubles(v), doubles(zdot), doubles(w))
    else:
        _evaluate(own.law, own, doubles(z), doubles(v), doubles(zdot), doubles(w))


@kernel
def _linearise(law, own, z, v, lin):
    n, (x, y, _), (k, kzx, kzy, kvx, kvy, _, _) = own.count, _cells(own), _linear(own, lin)
    vx, vy, omega = v[0], v[1], v[2]
    for i in range(n):
        ux, uy = vx - omega * y[i], vy + omega * x[i]
        speed = math.sqrt(ux * ux + uy * uy)
        z_norm = math.sqrt(z[i] * z[i] + z[n + i] * z[n + i])
        per_z = 1.0 / xp.where(z_norm > 0.0, z_norm, 1.0)
        per_speed = 1.0 / xp.where(speed > 0.0, speed, 1.0)
        ex, ey = z[i] * per_z, z[n + i] * per_z
        along = ex * ux + ey * uy
        q = grip(law, speed)
        decay, by_deflection, by_along, by_speed = formulas.bristle_decay_partials(xp, z_norm * q, along, speed, q, law)
        by_grip = by_deflection * z_norm + decay / q
        by_norm = by_deflection * q
        along_v = (by_speed + by_grip * grip_slope(law, speed, q)) * per_speed
        k[i] = decay
        kzx[i] = by_norm * ex + by_along * per_z * (ux - along * ex)
        kzy[i] = by_norm * ey + by_along * per_z * (uy - along * ey)
        kvx[i] = by_along * ex + along_v * ux
        kvy[i] = by_along * ey + along_v * uy


@entry
def linearise(contact, z, v, lin):
    """See `ModelFunctions`: `k`, `k_z` and `k_v` of each cell."""
    own = read(contact)
    if own.law.gamma == 2.0:
        _linearise(squared(own.law), own, doubles(z), doubles(v), lin)
    else:
        _linearise(own.law, own, doubles(z), doubles(v), lin)


@entry
def factor(contact, z, shift, lin, stiffness):
    """See `ModelFunctions`.

    Per cell `-(sigma_0 + sigma_1 shift) D^-1 d zdot/dv - sigma_2 I`, with
    `D^-1 d zdot/dv = (I - z (x) m)/(shift + k)` and `m = ((shift + k) k_v + k_z)/(shift + k + k_z.z)`.
    """
    own, z, s = read(contact), doubles(z), doubles(stiffness)
    n, law, (x, y, weights) = own.count, own.law, _cells(own)
    k, kzx, kzy, kvx, kvy, per_diagonal, per_rank_one = _linear(own, lin)
    pull = law.sigma_0 + law.sigma_1 * shift
    xx, xy, xt, yx, yy, yt, tx, ty, tt = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(n):
        zx, zy = z[i], z[n + i]
        diagonal = shift + k[i]
        per_diagonal[i] = 1.0 / diagonal
        per_rank_one[i] = 1.0 / (diagonal + kzx[i] * zx + kzy[i] * zy)
        mx = (diagonal * kvx[i] + kzx[i]) * per_rank_one[i]
        my = (diagonal * kvy[i] + kzy[i]) * per_rank_one[i]
        c = -weights[i] * pull * per_diagonal[i]
        d = -weights[i] * law.sigma_2
        sxx, sxy = c * (1.0 - zx * mx) + d, -c * zx * my
        syx, syy = -c * zy * mx, c * (1.0 - zy * my) + d
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
    s[0], s[1], s[2] = xx, xy, xt
    s[3], s[4], s[5] = yx, yy, yt
    s[6], s[7], s[8] = tx, ty, tt


@entry
def eliminate(contact, z, shift, r, lin, w):
    """See `ModelFunctions`: `sum w P' [-(sigma_0 + sigma_1 shift) D^-1 r + sigma_1 r]`."""
    own, z, r, w = read(contact), doubles(z), doubles(r), doubles(w)
    n, law, (x, y, weights) = own.count, own.law, _cells(own)
    _, kzx, kzy, _, _, per_diagonal, per_rank_one = _linear(own, lin)
    pull = law.sigma_0 + law.sigma_1 * shift
    fx, fy, tau = 0.0, 0.0, 0.0
    for i in range(n):
        rx, ry = r[i], r[n + i]
        c = (kzx[i] * rx + kzy[i] * ry) * per_rank_one[i]
        tx = weights[i] * (law.sigma_1 * rx - pull * per_diagonal[i] * (rx - z[i] * c))
        ty = weights[i] * (law.sigma_1 * ry - pull * per_diagonal[i] * (ry - z[n + i] * c))
        fx += tx
        fy += ty
        tau += x[i] * ty - y[i] * tx
    w[0], w[1], w[2] = fx, fy, tau


@entry
def back_substitute(contact, z, r, dv, lin, out):
    """See `ModelFunctions`."""
    own, z, r, v, out = read(contact), doubles(z), doubles(r), doubles(dv), doubles(out)
    n, (x, y, _) = own.count, _cells(own)
    vx, vy, omega = v[0], v[1], v[2]
    _, kzx, kzy, kvx, kvy, per_diagonal, per_rank_one = _linear(own, lin)
    for i in range(n):
        zx, zy = z[i], z[n + i]
        ux, uy = vx - omega * y[i], vy + omega * x[i]
        c = kvx[i] * ux + kvy[i] * uy
        ax, ay = r[i] + ux - zx * c, r[n + i] + uy - zy * c
        b = (kzx[i] * ax + kzy[i] * ay) * per_rank_one[i]
        out[i] = (ax - zx * b) * per_diagonal[i]
        out[n + i] = (ay - zy * b) * per_diagonal[i]


@entry
def change(contact, z, zdot, lin, dz, dzdot, rows, friction, size):
    """See `ModelFunctions`."""
    own, z, dz, dzdot, rows = read(contact), doubles(z), doubles(dz), doubles(dzdot), doubles(rows)
    n, law, (x, y, weights) = own.count, own.law, _cells(own)
    k, kzx, kzy, kvx, kvy, _, _ = _linear(own, lin)
    vx, vy, spin = rows[6], rows[7], rows[8] + size * rows[2]
    fx, fy, tau = 0.0, 0.0, size * rows[5]
    for i in range(n):
        ux, uy = vx - spin * y[i], vy + spin * x[i]
        ax, ay = dz[i] - friction * z[i], dz[n + i] - friction * z[n + i]
        dk = kzx[i] * ax + kzy[i] * ay + kvx[i] * ux + kvy[i] * uy
        dx, dy = ux - k[i] * ax - z[i] * dk, uy - k[i] * ay - z[n + i] * dk
        dzdot[i], dzdot[n + i] = dx, dy
        tx = weights[i] * formulas.traction(dz[i], dx, ux, law)
        ty = weights[i] * formulas.traction(dz[n + i], dy, uy, law)
        fx += tx
        fy += ty
        tau += x[i] * ty - y[i] * tx
    rows[9], rows[10], rows[11] = fx, fy, tau


@entry
def solve_transposed(contact, z, r, lin, out):
    """See `ModelFunctions`: `D = (shift + k) I + z (x) k_z`."""
    own, z, r, out = read(contact), doubles(z), doubles(r), doubles(out)
    n, (_, kzx, kzy, _, _, per_diagonal, per_rank_one) = own.count, _linear(own, lin)
    for i in range(n):
        c = (z[i] * r[i] + z[n + i] * r[n + i]) * per_rank_one[i]
        out[i], out[n + i] = (r[i] - kzx[i] * c) * per_diagonal[i], (r[n + i] - kzy[i] * c) * per_diagonal[i]


@entry
def pull_back(contact, z, lin, dzdot, rows, out):
    """See `ModelFunctions`: with the share t of a cell in the wrench, its z' gets `l - sigma_1 t`."""
    own, z, given, out, rows = read(contact), doubles(z), doubles(dzdot), doubles(out), doubles(rows)
    n, law, (x, y, weights) = own.count, own.law, _cells(own)
    k, kzx, kzy, kvx, kvy, _, _ = _linear(own, lin)
    fx, fy, tau = rows[9], rows[10], rows[11]
    vx, vy, omega = 0.0, 0.0, 0.0
    for i in range(n):
        tx, ty = weights[i] * (fx - tau * y[i]), weights[i] * (fy + tau * x[i])
        lx, ly = given[i] - law.sigma_1 * tx, given[n + i] - law.sigma_1 * ty
        c = z[i] * lx + z[n + i] * ly
        out[i] = -k[i] * lx - kzx[i] * c - law.sigma_0 * tx
        out[n + i] = -k[i] * ly - kzy[i] * c - law.sigma_0 * ty
        ux, uy = lx - kvx[i] * c - law.sigma_2 * tx, ly - kvy[i] * c - law.sigma_2 * ty
        vx += ux
        vy += uy
        omega += x[i] * uy - y[i] * ux
    rows[6], rows[7], rows[8] = vx, vy, omega


FUNCTIONS = ModelFunctions(evaluate, linearise, factor, eliminate, back_substitute, change, solve_transposed, pull_back)
