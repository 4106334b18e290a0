"""A contact of the published reduced model as the solver calls it (see `kernels.moments`).

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
from planarfriction.compiler import kernel
from planarfriction.compiler.memory import Doubles, reader
from planarfriction.formulas import LawNumbers
from planarfriction.kernels import moments
from planarfriction.kernels.contacts import functions_of
from planarfriction.kernels.derive import derive
from planarfriction.kernels.rules import ratio
from planarfriction.kernels.small_matrices import applied
from planarfriction.kernels.surfaces import sliding, sliding_jacobian
from planarfriction.kernels.vectors import applied_back, dot, norm, plus


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


@kernel
def per_radius(radius):
    """Return one over the contact radius; 0 of a point."""
    return 1.0 / xp.where(radius > 0.0, radius, math.inf)


@kernel
def through(root, x, y):
    """Return a velocity in the axes of the metric, or a force out of them: times the symmetric root."""
    return root.xx * x + root.xy * y, root.xy * x + root.yy * y


@kernel
def _read(contact):
    return read(contact)


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
    (x, y, s), j = twist, m.scratch
    sliding_jacobian(own.kind, own.data, 0, own.size, x, y, s, norm(twist), j)
    (k,), tape = _forth(own.law, z, applied(j, twist), twist)
    by_z, by_u, by_twist = _back(tape, (1.0,))
    by_twist = plus(by_twist, 1.0, applied_back(j, by_u))
    for i in range(3):
        for p in range(3):
            m.by_z[3 * i + p] = (-k if i == p else 0.0) - z[i] * by_z[p]
            m.by_u[3 * i + p] = j[3 * i + p] - z[i] * by_twist[p]


_MODEL = moments.ThreeStates(_read, _seen, _wrench, _viscous, _scaled, _raw, 1.0, _rate, _slopes)
FUNCTIONS = functions_of("published", moments.TEMPLATES, model=_MODEL)
