"""A contact of the distributed model whose friction depends on the direction (see `contacts.ModelFunctions`).

As `kernels.distributed_contact`, but each cell sees `u = B V` through its own map `B = [L | L J rho]` and its bristle
rests at `a/q` (`q = sigma_0/g`, the grip; `a` the asymmetry) where it slides; the wrench of a traction t is `B' t`
(docs/anisotropy.md):

    z_hat = z - a/q,      zdot = u - k z_hat,      d zdot/dz = -A = -k I - z_hat (x) k_z
    d zdot/du = I - z_hat (x) k_v + A a d(1/q)/du,      t = -(sigma_0 z + sigma_1 zdot + sigma_2 u)
"""

from __future__ import annotations

import math
from typing import NamedTuple

from planarfriction import formulas
from planarfriction.compiler import compiled_math as xp
from planarfriction.compiler import entry, kernel
from planarfriction.formulas import LawNumbers
from planarfriction.kernels.contacts import ModelFunctions
from planarfriction.kernels.law import grip, grip_slope
from planarfriction.kernels.pointers import doubles
from planarfriction.kernels.records import reader

CELL_NUMBERS = 7
"""L_xx, L_xy, L_yy, (L J rho)_x, (L J rho)_y, a_x, a_y of each cell, a row each."""

LINEAR_NUMBERS = 12
"""A, d zdot/du and the inverse of `shift I + A`, each row by row, of each cell."""


class AnisotropicContact(NamedTuple):
    """A contact of n cells."""

    law: LawNumbers
    count: int
    """n"""
    cells: int
    """Where the numbers of the cells are, [7, n]."""
    weights: int
    """Where their weights are."""


read = reader(AnisotropicContact)


@kernel
def _lever(cells, n, i):
    """Map of cell i, `B = [(xx, xy, x), (xy, yy, y)]`."""
    return cells[i], cells[n + i], cells[2 * n + i], cells[3 * n + i], cells[4 * n + i]


@kernel
def _seen(lever, vx, vy, omega):
    """What a cell sees of a twist."""
    xx, xy, yy, x, y = lever
    return xx * vx + xy * vy + x * omega, xy * vx + yy * vy + y * omega


@kernel
def _wrench(lever, tx, ty):
    """Wrench of a traction of a cell."""
    xx, xy, yy, x, y = lever
    return xx * tx + xy * ty, xy * tx + yy * ty, x * tx + y * ty


@entry
def evaluate(contact, z, v, zdot, w):
    """See `ModelFunctions`."""
    own, z, v, zdot, w = read(contact), doubles(z), doubles(v), doubles(zdot), doubles(w)
    n, law, cells, weights = own.count, own.law, doubles(own.cells), doubles(own.weights)
    fx, fy, tau = 0.0, 0.0, 0.0
    for i in range(n):
        lever = _lever(cells, n, i)
        ux, uy = _seen(lever, v[0], v[1], v[2])
        speed = math.sqrt(ux * ux + uy * uy)
        q = grip(law, speed)
        hx, hy = z[i] - cells[5 * n + i] / q, z[n + i] - cells[6 * n + i] / q
        norm = math.sqrt(hx * hx + hy * hy)
        along = (hx * ux + hy * uy) / xp.where(norm > 0.0, norm, 1.0)
        k = formulas.bristle_decay(xp, norm * q, along, speed, q, law)
        dx, dy = ux - k * hx, uy - k * hy
        zdot[i], zdot[n + i] = dx, dy
        tx = weights[i] * formulas.traction(z[i], dx, ux, law)
        ty = weights[i] * formulas.traction(z[n + i], dy, uy, law)
        wx, wy, wt = _wrench(lever, tx, ty)
        fx += wx
        fy += wy
        tau += wt
    w[0], w[1], w[2] = fx, fy, tau


@entry
def linearise(contact, z, v, lin):
    """See `ModelFunctions`: `A` and `d zdot/du` of each cell."""
    own, z, v, lin = read(contact), doubles(z), doubles(v), doubles(lin)
    n, law, cells = own.count, own.law, doubles(own.cells)
    for i in range(n):
        ux, uy = _seen(_lever(cells, n, i), v[0], v[1], v[2])
        speed = math.sqrt(ux * ux + uy * uy)
        per_speed = 1.0 / xp.where(speed > 0.0, speed, 1.0)
        q = grip(law, speed)
        q_slope = grip_slope(law, speed, q)
        ax, ay = cells[5 * n + i] / q, cells[6 * n + i] / q
        hx, hy = z[i] - ax, z[n + i] - ay
        norm = math.sqrt(hx * hx + hy * hy)
        per_norm = 1.0 / xp.where(norm > 0.0, norm, 1.0)
        ex, ey = hx * per_norm, hy * per_norm
        along = ex * ux + ey * uy
        k, by_deflection, by_along, by_speed = formulas.bristle_decay_partials(xp, norm * q, along, speed, q, law)
        turn = by_along * per_norm
        kzx = by_deflection * q * ex + turn * (ux - along * ex)
        kzy = by_deflection * q * ey + turn * (uy - along * ey)
        along_u = (by_speed + (by_deflection * norm + k / q) * q_slope) * per_speed
        kvx, kvy = by_along * ex + along_u * ux, by_along * ey + along_u * uy
        xx, xy, yx, yy = k + hx * kzx, hx * kzy, hy * kzx, k + hy * kzy
        lin[i], lin[n + i], lin[2 * n + i], lin[3 * n + i] = xx, xy, yx, yy
        c = -q_slope / q * per_speed  # of a/q, per a/q and u
        sx, sy = c * (xx * ax + xy * ay), c * (yx * ax + yy * ay)
        lin[4 * n + i], lin[5 * n + i] = 1.0 - hx * kvx + sx * ux, -hx * kvy + sx * uy
        lin[6 * n + i], lin[7 * n + i] = -hy * kvx + sy * ux, 1.0 - hy * kvy + sy * uy


@entry
def factor(contact, z, shift, lin, stiffness):
    """See `ModelFunctions`: per cell `B' [-(sigma_0 + sigma_1 shift) D^-1 d zdot/du - sigma_2 I] B`."""
    own, lin, s = read(contact), doubles(lin), doubles(stiffness)
    n, law, cells, weights = own.count, own.law, doubles(own.cells), doubles(own.weights)
    pull = law.sigma_0 + law.sigma_1 * shift
    for i in range(9):
        s[i] = 0.0
    for i in range(n):
        a, b, c, d = shift + lin[i], lin[n + i], lin[2 * n + i], shift + lin[3 * n + i]
        per_determinant = 1.0 / (a * d - b * c)
        a, b, c, d = d * per_determinant, -b * per_determinant, -c * per_determinant, a * per_determinant
        lin[8 * n + i], lin[9 * n + i], lin[10 * n + i], lin[11 * n + i] = a, b, c, d
        p, v = -weights[i] * pull, -weights[i] * law.sigma_2
        uxx, uxy, uyx, uyy = lin[4 * n + i], lin[5 * n + i], lin[6 * n + i], lin[7 * n + i]
        pxx, pxy = p * (a * uxx + b * uyx) + v, p * (a * uxy + b * uyy)
        pyx, pyy = p * (c * uxx + d * uyx), p * (c * uxy + d * uyy) + v
        lever = _lever(cells, n, i)
        for m in range(3):
            ux, uy = _seen(lever, 1.0 if m == 0 else 0.0, 1.0 if m == 1 else 0.0, 1.0 if m == 2 else 0.0)
            wx, wy, wt = _wrench(lever, pxx * ux + pxy * uy, pyx * ux + pyy * uy)
            s[m] += wx
            s[3 + m] += wy
            s[6 + m] += wt


@entry
def eliminate(contact, z, shift, r, lin, w):
    """See `ModelFunctions`: `sum w B' [-(sigma_0 + sigma_1 shift) D^-1 r + sigma_1 r]`."""
    own, r, lin, w = read(contact), doubles(r), doubles(lin), doubles(w)
    n, law, cells, weights = own.count, own.law, doubles(own.cells), doubles(own.weights)
    pull = law.sigma_0 + law.sigma_1 * shift
    fx, fy, tau = 0.0, 0.0, 0.0
    for i in range(n):
        rx, ry = r[i], r[n + i]
        tx = weights[i] * (law.sigma_1 * rx - pull * (lin[8 * n + i] * rx + lin[9 * n + i] * ry))
        ty = weights[i] * (law.sigma_1 * ry - pull * (lin[10 * n + i] * rx + lin[11 * n + i] * ry))
        wx, wy, wt = _wrench(_lever(cells, n, i), tx, ty)
        fx += wx
        fy += wy
        tau += wt
    w[0], w[1], w[2] = fx, fy, tau


@entry
def back_substitute(contact, z, r, dv, lin, out):
    """See `ModelFunctions`."""
    own, r, v, lin, out = read(contact), doubles(r), doubles(dv), doubles(lin), doubles(out)
    n, cells = own.count, doubles(own.cells)
    for i in range(n):
        ux, uy = _seen(_lever(cells, n, i), v[0], v[1], v[2])
        ax = r[i] + lin[4 * n + i] * ux + lin[5 * n + i] * uy
        ay = r[n + i] + lin[6 * n + i] * ux + lin[7 * n + i] * uy
        out[i] = lin[8 * n + i] * ax + lin[9 * n + i] * ay
        out[n + i] = lin[10 * n + i] * ax + lin[11 * n + i] * ay


@entry
def change(contact, z, zdot, lin, dz, dzdot, rows, friction, size):
    """See `ModelFunctions`; `a/q` grows with friction as z does."""
    own, z, lin, dz, out = read(contact), doubles(z), doubles(lin), doubles(dz), doubles(dzdot)
    rows = doubles(rows)
    n, law, cells, weights = own.count, own.law, doubles(own.cells), doubles(own.weights)
    spin = rows[8] + size * rows[2]
    fx, fy, tau = 0.0, 0.0, size * rows[5]
    for i in range(n):
        lever = _lever(cells, n, i)
        ux, uy = _seen(lever, rows[6], rows[7], spin)
        ax, ay = dz[i] - friction * z[i], dz[n + i] - friction * z[n + i]
        dx = lin[4 * n + i] * ux + lin[5 * n + i] * uy - lin[i] * ax - lin[n + i] * ay
        dy = lin[6 * n + i] * ux + lin[7 * n + i] * uy - lin[2 * n + i] * ax - lin[3 * n + i] * ay
        out[i], out[n + i] = dx, dy
        tx = weights[i] * formulas.traction(dz[i], dx, ux, law)
        ty = weights[i] * formulas.traction(dz[n + i], dy, uy, law)
        wx, wy, wt = _wrench(lever, tx, ty)
        fx += wx
        fy += wy
        tau += wt
    rows[9], rows[10], rows[11] = fx, fy, tau


@entry
def solve_transposed(contact, z, r, lin, out):
    """See `ModelFunctions`."""
    own, r, lin, out = read(contact), doubles(r), doubles(lin), doubles(out)
    n = own.count
    for i in range(n):
        x, y = r[i], r[n + i]
        out[i], out[n + i] = lin[8 * n + i] * x + lin[10 * n + i] * y, lin[9 * n + i] * x + lin[11 * n + i] * y


@entry
def pull_back(contact, z, lin, dzdot, rows, out):
    """See `ModelFunctions`; as `distributed_contact`."""
    own, given, lin, out, rows = read(contact), doubles(dzdot), doubles(lin), doubles(out), doubles(rows)
    n, law, cells, weights = own.count, own.law, doubles(own.cells), doubles(own.weights)
    vx, vy, omega = 0.0, 0.0, 0.0
    for i in range(n):
        lever = _lever(cells, n, i)
        tx, ty = _seen(lever, rows[9], rows[10], rows[11])
        tx, ty = weights[i] * tx, weights[i] * ty
        lx, ly = given[i] - law.sigma_1 * tx, given[n + i] - law.sigma_1 * ty
        out[i] = -lin[i] * lx - lin[2 * n + i] * ly - law.sigma_0 * tx
        out[n + i] = -lin[n + i] * lx - lin[3 * n + i] * ly - law.sigma_0 * ty
        ux = lin[4 * n + i] * lx + lin[6 * n + i] * ly - law.sigma_2 * tx
        uy = lin[5 * n + i] * lx + lin[7 * n + i] * ly - law.sigma_2 * ty
        wx, wy, wt = _wrench(lever, ux, uy)
        vx += wx
        vy += wy
        omega += wt
    rows[6], rows[7], rows[8] = vx, vy, omega


FUNCTIONS = ModelFunctions(evaluate, linearise, factor, eliminate, back_substitute, change, solve_transposed, pull_back)
