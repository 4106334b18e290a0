"""A contact of the published reduced model as the solver calls it (see `contacts.ModelFunctions`).

The raw state `z` [m, m, m^2] is `S z_hat` with `S = diag(1, 1, r)`; in scaled coordinates the bristle obeys the
equation of a cell (docs/physics.md), `z_hat' = u - k z_hat`, driven by `u = h(V) v_n` instead of `v` and with
`z_max = |h| g/sigma_0`:

    d z_hat'/dz_hat = -k I - z_hat (x) k_z,      d z_hat'/dV_S = du/dV_S - z_hat (x) k_V
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
from planarfriction.kernels.pointers import at, doubles
from planarfriction.kernels.records import reader
from planarfriction.kernels.surfaces import sliding, sliding_jacobian

DECAY, BY_Z, SCALED, BY_V, DIAGONAL, RANK_ONE, SLIDING = 0, 1, 4, 7, 16, 17, 18
"""Where a linearisation holds k, k_z (3), z_hat (3), d z_hat'/dV_S (9), one over the diagonal of D and over its
rank-one part, and du/dV_S (9)."""

LINEAR = 27
"""Numbers of a linearisation."""


class Shape(NamedTuple):
    """A patch about its centre of pressure, in the axes of its friction metric."""

    centre_x: float
    centre_y: float
    contact_radius: float
    """0 of a point: its third state stays as it is, without effect."""
    second_moment: float


class Root(NamedTuple):
    """Symmetric root of the friction metric."""

    xx: float
    xy: float
    yy: float


class PublishedContact(NamedTuple):
    """A contact of the published reduced model."""

    law: LawNumbers
    shape: Shape
    root: Root
    kind: int
    """Of the limit surface (see `kernels.surfaces`)."""
    size: int
    data: int
    """Where its numbers are."""


read = reader(PublishedContact)


@kernel
def per_radius(radius):
    """One over the contact radius; 0 of a point."""
    return 1.0 / xp.where(radius > 0.0, radius, math.inf)


@kernel
def _through(root, x, y):
    """A velocity in the axes of the metric, or a force out of them: times the symmetric root."""
    return root.xx * x + root.xy * y, root.xy * x + root.yy * y


@kernel
def _scaled(own, v):
    """`V_S` of a twist."""
    vx, vy = _through(own.root, v[0], v[1])
    shape = own.shape
    return vx - v[2] * shape.centre_y, vy + v[2] * shape.centre_x, shape.contact_radius * v[2]


@kernel
def _to_origin(own, fx, fy, tau):
    """Wrench about the origin from that about the centre of pressure."""
    tau += own.shape.centre_x * fy - own.shape.centre_y * fx
    wx, wy = _through(own.root, fx, fy)
    return wx, wy, tau


@entry
def evaluate(contact, z, v, zdot, w):
    """See `ModelFunctions`: `zdot = S h v_n - k z`."""
    own, z, v, zdot, w = read(contact), doubles(z), doubles(v), doubles(zdot), doubles(w)
    law, r = own.law, own.shape.contact_radius
    x, y, s = _scaled(own, v)
    v_n = math.sqrt(x * x + y * y + s * s)
    ux, uy, us = sliding(own.kind, doubles(own.data), 0, own.size, x, y, s, v_n)
    zx, zy, zs = z[0], z[1], z[2] * per_radius(r)
    u_norm, z_norm = math.sqrt(ux * ux + uy * uy + us * us), math.sqrt(zx * zx + zy * zy + zs * zs)
    h_norm = u_norm / v_n if v_n > 0.0 else 1.0
    along = (zx * ux + zy * uy + zs * us) / xp.where(z_norm * h_norm > 0.0, z_norm * h_norm, 1.0)
    q = grip(law, v_n)
    k = formulas.bristle_decay(xp, z_norm * q / h_norm, along, v_n, q, law)
    ds = us - k * zs
    zdot[0], zdot[1], zdot[2] = ux - k * z[0], uy - k * z[1], r * ds
    fx, fy = formulas.traction(z[0], zdot[0], x, law), formulas.traction(z[1], zdot[1], y, law)
    tau = r * formulas.traction(zs, ds, 0.0, law) + formulas.traction(0.0, 0.0, own.shape.second_moment * v[2], law)
    w[0], w[1], w[2] = _to_origin(own, fx, fy, tau)


@entry
def linearise(contact, z, v, lin):
    """See `ModelFunctions`."""
    own, z, out, j = read(contact), doubles(z), doubles(lin), doubles(at(lin, SLIDING))
    law = own.law
    x, y, s = _scaled(own, doubles(v))
    v_n = math.sqrt(x * x + y * y + s * s)
    per_v = 1.0 / v_n if v_n > 0.0 else 0.0
    sliding_jacobian(own.kind, doubles(own.data), 0, own.size, x, y, s, v_n, j)
    ux, uy, us = j[0] * x + j[1] * y + j[2] * s, j[3] * x + j[4] * y + j[5] * s, j[6] * x + j[7] * y + j[8] * s
    zx, zy, zs = z[0], z[1], z[2] * per_radius(own.shape.contact_radius)
    u_norm, z_norm = math.sqrt(ux * ux + uy * uy + us * us), math.sqrt(zx * zx + zy * zy + zs * zs)
    h_norm = u_norm * per_v if u_norm > 0.0 else 1.0
    per_z = 1.0 / z_norm if z_norm > 0.0 else 0.0
    per_u = 1.0 / u_norm if u_norm > 0.0 else 0.0
    per_h = 1.0 / h_norm
    ex, ey, es = zx * per_z, zy * per_z, zs * per_z
    qx, qy, qs = ux * per_h, uy * per_h, us * per_h  # v_n times the unit vector of h
    along = ex * qx + ey * qy + es * qs
    q = grip(law, v_n)
    deflection = z_norm * q * per_h
    k, by_deflection, by_along, by_speed = formulas.bristle_decay_partials(xp, deflection, along, v_n, q, law)
    by_norm = by_deflection * q * per_h
    c = by_along * per_z
    out[DECAY] = k
    out[BY_Z] = by_norm * ex + c * (qx - along * ex)
    out[BY_Z + 1] = by_norm * ey + c * (qy - along * ey)
    out[BY_Z + 2] = by_norm * es + c * (qs - along * es)
    out[SCALED], out[SCALED + 1], out[SCALED + 2] = zx, zy, zs
    # gradients with respect to V_S: of v_n, of |h|, and of `along` = e.u/|h|
    speed_total = by_speed + (by_deflection * z_norm * per_h + k / q) * grip_slope(law, v_n, q)
    for m in range(3):
        n_m = (x if m == 0 else (y if m == 1 else s)) * per_v
        u_m = (ux * j[m] + uy * j[3 + m] + us * j[6 + m]) * per_u  # of |u|
        h_m = (u_m - h_norm * n_m) * per_v
        along_m = (ex * j[m] + ey * j[3 + m] + es * j[6 + m] - along * h_m) * per_h
        k_m = speed_total * n_m - by_deflection * deflection * per_h * h_m + by_along * along_m
        out[BY_V + m] = j[m] - zx * k_m
        out[BY_V + 3 + m] = j[3 + m] - zy * k_m
        out[BY_V + 6 + m] = j[6 + m] - zs * k_m


@kernel
def _solve(lin, ax, ay, a_s):
    """`D^-1 a` in scaled coordinates, `D = (shift + k) I + z_hat (x) k_z`, once `factor` has prepared it."""
    c = (lin[BY_Z] * ax + lin[BY_Z + 1] * ay + lin[BY_Z + 2] * a_s) * lin[RANK_ONE]
    per = lin[DIAGONAL]
    return (ax - c * lin[SCALED]) * per, (ay - c * lin[SCALED + 1]) * per, (a_s - c * lin[SCALED + 2]) * per


@kernel
def _driven(lin, x, y, s):
    """`d z_hat'/dV_S` times a scaled twist."""
    return (
        lin[BY_V] * x + lin[BY_V + 1] * y + lin[BY_V + 2] * s,
        lin[BY_V + 3] * x + lin[BY_V + 4] * y + lin[BY_V + 5] * s,
        lin[BY_V + 6] * x + lin[BY_V + 7] * y + lin[BY_V + 8] * s,
    )


@entry
def factor(contact, z, shift, lin, stiffness):
    """See `ModelFunctions`: `-(sigma_0 + sigma_1 shift) S D^-1 d z_hat'/dV_S S - sigma_2 U` about the centre."""
    own, lin, out = read(contact), doubles(lin), doubles(stiffness)
    law, r, k = own.law, own.shape.contact_radius, lin[DECAY]
    lin[DIAGONAL] = 1.0 / (shift + k)
    along = lin[BY_Z] * lin[SCALED] + lin[BY_Z + 1] * lin[SCALED + 1] + lin[BY_Z + 2] * lin[SCALED + 2]
    lin[RANK_ONE] = 1.0 / (shift + k + along)
    pull = law.sigma_0 + law.sigma_1 * shift
    for m in range(3):  # the wrench of a unit of each component of the twist
        one, two, three = 1.0 if m == 0 else 0.0, 1.0 if m == 1 else 0.0, 1.0 if m == 2 else 0.0
        vx, vy = _through(own.root, one, two)
        x, y = vx - three * own.shape.centre_y, vy + three * own.shape.centre_x
        bx, by, bs = _driven(lin, x, y, r * three)
        bx, by, bs = _solve(lin, bx, by, bs)
        tau = -pull * r * bs - law.sigma_2 * own.shape.second_moment * three
        fx, fy = -pull * bx - law.sigma_2 * x, -pull * by - law.sigma_2 * y
        out[m], out[3 + m], out[6 + m] = _to_origin(own, fx, fy, tau)


@entry
def eliminate(contact, z, shift, r, lin, w):
    """See `ModelFunctions`."""
    own, r, w = read(contact), doubles(r), doubles(w)
    radius, sigma_1 = own.shape.contact_radius, own.law.sigma_1
    pull = own.law.sigma_0 + sigma_1 * shift
    bx, by, bs = _solve(doubles(lin), r[0], r[1], r[2] * per_radius(radius))
    fx, fy, tau = sigma_1 * r[0] - pull * bx, sigma_1 * r[1] - pull * by, sigma_1 * r[2] - pull * radius * bs
    w[0], w[1], w[2] = _to_origin(own, fx, fy, tau)


@entry
def back_substitute(contact, z, r, dv, lin, out):
    """See `ModelFunctions`."""
    own, r, lin, out = read(contact), doubles(r), doubles(lin), doubles(out)
    radius = own.shape.contact_radius
    x, y, s = _scaled(own, doubles(dv))
    x, y, s = _driven(lin, x, y, s)
    out[0], out[1], bs = _solve(lin, r[0] + x, r[1] + y, r[2] * per_radius(radius) + s)
    out[2] = radius * bs


@entry
def change(contact, z, zdot, lin, dz, dzdot, rows, friction, size):
    """See `ModelFunctions`."""
    own, lin, zdot, dz = read(contact), doubles(lin), doubles(zdot), doubles(dz)
    z, out, rows = doubles(z), doubles(dzdot), doubles(rows)
    law, shape = own.law, own.shape
    cx, cy, r = shape.centre_x, shape.centre_y, shape.contact_radius
    spin = rows[8] + size * rows[2]
    ux, uy = _through(own.root, rows[6], rows[7])
    ux, uy = ux - spin * cy, uy + spin * cx
    vx, vy, _ = _scaled(own, rows)
    gx, gy = formulas.traction(z[0], zdot[0], vx, law), formulas.traction(z[1], zdot[1], vy, law)
    zx, zy, zs = lin[SCALED], lin[SCALED + 1], lin[SCALED + 2]
    ax, ay, a_s = dz[0] - friction * zx, dz[1] - friction * zy, dz[2] * per_radius(r) - (size + friction) * zs
    dk = lin[BY_Z] * ax + lin[BY_Z + 1] * ay + lin[BY_Z + 2] * a_s
    bx, by, bs = _driven(lin, ux, uy, r * spin)
    out[0] = bx - lin[DECAY] * ax - zx * dk
    out[1] = by - lin[DECAY] * ay - zy * dk
    out[2] = r * (bs - lin[DECAY] * a_s - zs * dk) + size * zdot[2]
    fx, fy = formulas.traction(dz[0], out[0], ux, law), formulas.traction(dz[1], out[1], uy, law)
    tau = formulas.traction(xp.where(r > 0.0, dz[2], 0.0), out[2], shape.second_moment * (spin + size * rows[2]), law)
    rows[9], rows[10] = _through(own.root, fx, fy)
    rows[11] = tau + cx * fy - cy * fx + size * (cx * gy - cy * gx)


@entry
def solve_transposed(contact, z, r, lin, out):
    """See `ModelFunctions`."""
    own, r, lin, out = read(contact), doubles(r), doubles(lin), doubles(out)
    radius, per = own.shape.contact_radius, lin[DIAGONAL]
    x, y, s = r[0], r[1], radius * r[2]
    c = (lin[SCALED] * x + lin[SCALED + 1] * y + lin[SCALED + 2] * s) * lin[RANK_ONE]
    out[0], out[1] = (x - c * lin[BY_Z]) * per, (y - c * lin[BY_Z + 1]) * per
    out[2] = per_radius(radius) * (s - c * lin[BY_Z + 2]) * per


@entry
def pull_back(contact, z, lin, dzdot, rows, out):
    """See `ModelFunctions`; transposes of `_scaled` and `_to_origin` are each other's but for the contact radius."""
    own, given, lin, out = read(contact), doubles(dzdot), doubles(lin), doubles(out)
    x, y, _ = _scaled(own, doubles(at(rows, 9)))
    rows = doubles(rows)
    law, shape, r, tau = own.law, own.shape, own.shape.contact_radius, rows[11]
    lx, ly, ls = given[0] - law.sigma_1 * x, given[1] - law.sigma_1 * y, r * (given[2] - law.sigma_1 * tau)
    c = lin[SCALED] * lx + lin[SCALED + 1] * ly + lin[SCALED + 2] * ls
    k, per = lin[DECAY], per_radius(r)
    out[0] = -k * lx - lin[BY_Z] * c - law.sigma_0 * x
    out[1] = -k * ly - lin[BY_Z + 1] * c - law.sigma_0 * y
    out[2] = -per * (k * ls + lin[BY_Z + 2] * c) - xp.where(r > 0.0, law.sigma_0 * tau, 0.0)
    ux = lin[BY_V] * lx + lin[BY_V + 3] * ly + lin[BY_V + 6] * ls - law.sigma_2 * x
    uy = lin[BY_V + 1] * lx + lin[BY_V + 4] * ly + lin[BY_V + 7] * ls - law.sigma_2 * y
    us = lin[BY_V + 2] * lx + lin[BY_V + 5] * ly + lin[BY_V + 8] * ls
    spin = r * us - law.sigma_2 * shape.second_moment * tau
    rows[6], rows[7], rows[8] = _to_origin(own, ux, uy, spin)


FUNCTIONS = ModelFunctions(evaluate, linearise, factor, eliminate, back_substitute, change, solve_transposed, pull_back)
