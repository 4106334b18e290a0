"""A contact of the published reduced model as the solver calls it (see `contacts.ModelFunctions`).

The raw state `z` [m, m, m^2] is `S z_hat` with `S = diag(1, 1, r)`; in scaled coordinates the bristle obeys the
equation of a cell (docs/physics.md), `z_hat' = f = u - k z_hat`, driven by `u = h(V) v_n` instead of `v` and with
`z_max = |h| g/sigma_0`, at the scaled twist `V_S = G V`:

    f_z = -k I - z_hat (x) k_z,      f_V = du/dV_S - z_hat (x) k_V

The wrench is `W = G' t` with the traction `t = -(sigma_0 z_hat + sigma_1 f + sigma_2 U V)`. With `D = shift I - f_z` a
step needs `D^-1`, in closed form. A patch `l` times as large sees `l omega` and gives `l tau`, and its raw state grows
with it.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from planarfriction import formulas
from planarfriction.compiler import compiled_math as xp
from planarfriction.compiler import entry, kernel
from planarfriction.compiler.memory import Doubles, Layout, arrays_at, reader
from planarfriction.formulas import LawNumbers
from planarfriction.kernels.contacts import ROWS, ModelFunctions, traction
from planarfriction.kernels.derive import derive
from planarfriction.kernels.rules import ratio
from planarfriction.kernels.small_matrices import applied, inverse
from planarfriction.kernels.surfaces import sliding, sliding_jacobian
from planarfriction.kernels.vectors import applied_back, dot, norm, plus, put, put_all, three, times


class PublishedPatch(NamedTuple):
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
    shape: PublishedPatch
    root: Root
    kind: int
    """Kind of the limit surface (see `kernels.surfaces`)."""
    size: int
    """Size of the limit surface."""
    data: Doubles
    """Numbers of the limit surface."""


read = reader(PublishedContact)


class LinearPublished(NamedTuple):
    """Workspace of a linearisation, each [3, 3] row by row."""

    by_z: Doubles
    """f_z"""
    by_twist: Doubles
    """f_V"""
    inverse: Doubles
    """D^-1"""
    sliding: Doubles
    """du/dV_S"""


LINEAR = Layout(LinearPublished, by_z=9, by_twist=9, inverse=9, sliding=9)
_LINEAR = LINEAR.offsets


def slopes_in(lin: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return `f_z` and `f_V` [B, 3, 3] of linearisations [B, words]."""
    by_z, by_twist = (lin[:, LINEAR.slices[name]].reshape(-1, 3, 3) for name in ("by_z", "by_twist"))
    return by_z, by_twist


@kernel
def per_radius(radius):
    """Return one over the contact radius; 0 of a point."""
    return 1.0 / xp.where(radius > 0.0, radius, math.inf)


@kernel
def through(root, x, y):
    """Return a velocity in the axes of the metric, or a force out of them: times the symmetric root."""
    return root.xx * x + root.xy * y, root.xy * x + root.yy * y


@kernel
def _seen(own, v):
    """Return `V_S` of a twist."""
    (x, y), shape = through(own.root, v[0], v[1]), own.shape
    return x - v[2] * shape.centre_y, y + v[2] * shape.centre_x, shape.contact_radius * v[2]


@kernel
def _wrench(own, t):
    """Return the wrench about the origin of a scaled one about the centre of pressure."""
    shape = own.shape
    x, y = through(own.root, t[0], t[1])
    return x, y, shape.contact_radius * t[2] + shape.centre_x * t[1] - shape.centre_y * t[0]


@kernel
def _viscous(own, v):
    """Return `V_S` with the spin that the second moment has in the place of the squared radius."""
    x, y, _ = _seen(own, v)
    return x, y, own.shape.second_moment * per_radius(own.shape.contact_radius) * v[2]


@kernel
def _scaled(own, z):
    return z[0], z[1], z[2] * per_radius(own.shape.contact_radius)


@kernel
def _raw(own, z):
    return z[0], z[1], z[2] * own.shape.contact_radius


@kernel
def _decay(law, z, u, twist):
    """Return the decay of the bristle at the scaled twist for which the limit surface gives u."""
    v, size = norm(twist), norm(z)
    h = xp.where(norm(u) > 0.0, ratio(norm(u), v), 1.0)
    q = law.sigma_0 / formulas.stribeck(xp, v, law)
    return formulas.bristle_decay(xp, size * q / h, ratio(dot(z, u), size) / h, v, q, law)


_SLOPES = derive(_decay, ("z", "u", "twist"), ("z", "u", "twist"))
_forth, _back = _SLOPES.forth, _SLOPES.back


@kernel
def _rate(own, z, twist):
    x, y, s = twist
    u = sliding(own.kind, own.data, 0, own.size, x, y, s, norm(twist))
    return plus(u, -_decay(own.law, z, u, twist), z)


@kernel
def _slopes(own, z, twist, m):
    (x, y, s), j = twist, m.sliding
    sliding_jacobian(own.kind, own.data, 0, own.size, x, y, s, norm(twist), j)
    (k,), tape = _forth(own.law, z, applied(j, twist), twist)
    by_z, by_u, by_twist = _back(tape, (1.0,))
    by_twist = plus(by_twist, 1.0, applied_back(j, by_u))
    for i in range(3):
        for p in range(3):
            m.by_z[3 * i + p] = (-k if i == p else 0.0) - z[i] * by_z[p]
            m.by_twist[3 * i + p] = j[3 * i + p] - z[i] * by_twist[p]


# ---------------------------------------------------------------------- functions of the solver


@entry
def evaluate(contact, z, v, zdot, w):
    """Write `z'` and the wrench."""
    own, v = read(contact), three(v)
    z = _scaled(own, three(z))
    rate = _rate(own, z, _seen(own, v))
    put(zdot, _raw(own, rate))
    put(w, _wrench(own, traction(own.law, z, rate, _viscous(own, v))))


@entry
def linearise(contact, z, v, lin):
    """Write `f_z` and `f_V`."""
    own = read(contact)
    _slopes(own, _scaled(own, three(z)), _seen(own, three(v)), arrays_at(_LINEAR, lin))


@entry
def factor(contact, z, shift, lin, stiffness):
    """Prepare `D^-1`, write `-G' ((sigma_0 + sigma_1 shift) D^-1 f_V G + sigma_2 G)`."""
    own, m = read(contact), arrays_at(_LINEAR, lin)
    put_all(m.inverse, inverse(shift, m.by_z))
    pull = own.law.sigma_0 + own.law.sigma_1 * shift
    for k in range(3):
        unit = (1.0 if k == 0 else 0.0), (1.0 if k == 1 else 0.0), (1.0 if k == 2 else 0.0)
        z = applied(m.inverse, applied(m.by_twist, _seen(own, unit)))
        t = plus(times(-pull, z), -own.law.sigma_2, _viscous(own, unit))
        stiffness[k], stiffness[3 + k], stiffness[6 + k] = _wrench(own, t)


@entry
def eliminate(contact, z, shift, r, lin, w):
    """Write `G' (sigma_1 - (sigma_0 + sigma_1 shift) D^-1) r`."""
    own, m = read(contact), arrays_at(_LINEAR, lin)
    r, pull = _scaled(own, three(r)), own.law.sigma_0 + own.law.sigma_1 * shift
    put(w, _wrench(own, plus(times(own.law.sigma_1, r), -pull, applied(m.inverse, r))))


@entry
def back_substitute(contact, z, r, dv, lin, out):
    """Solve `D out = r + f_V G dV`."""
    own, m = read(contact), arrays_at(_LINEAR, lin)
    driven = applied(m.by_twist, _seen(own, three(dv)))
    put(out, _raw(own, applied(m.inverse, plus(_scaled(own, three(r)), 1.0, driven))))


@entry
def change(contact, z, zdot, lin, dz, dzdot, rows, friction, size):
    """Write the changes of `z'` and of the wrench."""
    own, m, rows = read(contact), arrays_at(_LINEAR, lin), arrays_at(ROWS, rows)
    turns = 0.0, 0.0, 1.0
    v, z = plus(three(rows.d_twist), size * rows.twist[2], turns), _scaled(own, three(z))
    dz = plus(_scaled(own, three(dz)), -size * z[2], turns)
    rate = plus(applied(m.by_z, plus(dz, -friction, z)), 1.0, applied(m.by_twist, _seen(own, v)))
    put(dzdot, plus(_raw(own, rate), size * zdot[2], turns))
    w = _wrench(own, traction(own.law, dz, rate, _viscous(own, v)))
    put(rows.d_wrench, plus(w, size * rows.wrench[2], turns))


@entry
def solve_transposed(contact, z, r, lin, out):
    """Solve `D' out = r`; a cotangent is scaled as a state is made raw."""
    own, m = read(contact), arrays_at(_LINEAR, lin)
    put(out, _scaled(own, applied_back(m.inverse, _raw(own, three(r)))))


@entry
def pull_back(contact, z, lin, dzdot, rows, out):
    """Write the transpose of `change`; that of `G' t` is G."""
    own, m, rows = read(contact), arrays_at(_LINEAR, lin), arrays_at(ROWS, rows)
    law, wrench = own.law, three(rows.d_wrench)
    t = _seen(own, wrench)
    rate = plus(_raw(own, three(dzdot)), -law.sigma_1, t)
    put(out, _scaled(own, plus(applied_back(m.by_z, rate), -law.sigma_0, t)))
    u = plus(applied_back(m.by_twist, rate), -law.sigma_2, _viscous(own, wrench))
    put(rows.d_twist, _wrench(own, u))


FUNCTIONS = ModelFunctions(evaluate, linearise, factor, eliminate, back_substitute, change, solve_transposed, pull_back)
