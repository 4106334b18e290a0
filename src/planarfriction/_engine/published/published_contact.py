"""A contact of the published reduced model as the solver calls it (see `protocol.ModelFunctions`).

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
from planarfriction._engine.bristles.bristle_step import seen
from planarfriction._engine.bristles.law import inverse_deflection, traction
from planarfriction._engine.codegen.derivatives import derive
from planarfriction._engine.codegen.ratios import ratio
from planarfriction._engine.codegen.small_matrices import applied, inverse
from planarfriction._engine.codegen.vectors import (
    Vector,
    applied_back,
    norm,
    plus,
    put,
    put_all,
    three,
    times,
)
from planarfriction._engine.compiler import compiled_math as xp
from planarfriction._engine.compiler import entry, kernel
from planarfriction._engine.compiler.memory import (
    Doubles,
    Layout,
    Place,
    arrays_at,
    reader,
)
from planarfriction._engine.protocol import ROWS, ModelFunctions
from planarfriction._engine.published.surfaces import sliding, sliding_jacobian
from planarfriction.formulas import LawNumbers


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
    """Kind of the limit surface (see `published.surfaces`)."""
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
    by_z, by_twist = (
        lin[:, LINEAR.slices[name]].reshape(-1, 3, 3) for name in ("by_z", "by_twist")
    )
    return by_z, by_twist


@kernel
def per_radius(radius: float) -> float:
    """Return one over the contact radius; 0 of a point."""
    return 1.0 / xp.where(radius > 0.0, radius, math.inf)


@kernel
def through(root: Root, x: float, y: float) -> Vector:
    """Turn a velocity into the axes of the metric, or a force back: multiply by the symmetric root."""
    return root.xx * x + root.xy * y, root.xy * x + root.yy * y


@kernel
def _seen(record: PublishedContact, v: Vector) -> Vector:
    """Return `V_S` of a twist."""
    (x, y) = through(record.root, v[0], v[1])
    shape = record.shape
    return (
        x - v[2] * shape.centre_y,
        y + v[2] * shape.centre_x,
        shape.contact_radius * v[2],
    )


@kernel
def _wrench(record: PublishedContact, t: Vector) -> Vector:
    """Return the wrench about the origin of a scaled one about the centre of pressure."""
    shape = record.shape
    x, y = through(record.root, t[0], t[1])
    return (
        x,
        y,
        shape.contact_radius * t[2] + shape.centre_x * t[1] - shape.centre_y * t[0],
    )


@kernel
def _viscous(record: PublishedContact, v: Vector) -> Vector:
    """Return `V_S` with the spin that the second moment has in the place of the squared radius."""
    x, y, _ = _seen(record, v)
    return (
        x,
        y,
        record.shape.second_moment * per_radius(record.shape.contact_radius) * v[2],
    )


@kernel
def _scaled(record: PublishedContact, z: Vector) -> Vector:
    return z[0], z[1], z[2] * per_radius(record.shape.contact_radius)


@kernel
def _raw(record: PublishedContact, z: Vector) -> Vector:
    return z[0], z[1], z[2] * record.shape.contact_radius


@kernel
def per_h(u: Vector, v: float) -> float:
    """Return `1/|h|` where the limit surface gives `u = h v`; 1 at rest."""
    return 1.0 / xp.where(norm(u) > 0.0, ratio(norm(u), v), 1.0)


@kernel
def decay_of(
    law: LawNumbers, z: Vector, u: Vector, v: float, per: float, q: float
) -> float:
    """Return the decay of a scaled bristle at the scaled speed v; `per` is `1/|h|`, q the inverse deflection."""
    deflection, along = seen(z, norm(z), u, per, q)
    return formulas.bristle_decay(xp, deflection, along, v, q, law)


@kernel
def _decay(law: LawNumbers, z: Vector, u: Vector, twist: Vector) -> float:
    """Return the decay of the bristle at the scaled twist for which the limit surface gives u."""
    v = norm(twist)
    return decay_of(law, z, u, v, per_h(u, v), inverse_deflection(law, v))


_SLOPES = derive(_decay, ("z", "u", "twist"), {"z": 3, "u": 3, "twist": 3})
_forth = _SLOPES.forth
_back = _SLOPES.back


@kernel
def _rate(record: PublishedContact, z: Vector, twist: Vector) -> Vector:
    x, y, s = twist
    u = sliding(record.kind, record.data, 0, record.size, x, y, s, norm(twist))
    return plus(u, -_decay(record.law, z, u, twist), z)


@kernel
def _slopes(
    record: PublishedContact, z: Vector, twist: Vector, m: LinearPublished
) -> Vector:
    """Write the derivatives of the scaled rate, and return it; u grows with the twist, so it is `du/dV_S V_S`."""
    (x, y, s) = twist
    j = m.sliding
    sliding_jacobian(record.kind, record.data, 0, record.size, x, y, s, norm(twist), j)
    u = applied(j, twist)
    k, tape = _forth(record.law, z, u, twist)
    by_z, by_u, by_twist = _back(tape, 1.0)
    by_twist = plus(by_twist, 1.0, applied_back(j, by_u))
    for i in range(3):
        for p in range(3):
            m.by_z[3 * i + p] = (-k if i == p else 0.0) - z[i] * by_z[p]
            m.by_twist[3 * i + p] = j[3 * i + p] - z[i] * by_twist[p]
    return plus(u, -k, z)


@kernel
def _write(
    record: PublishedContact,
    z: Vector,
    v: Vector,
    rate: Vector,
    zdot: Doubles,
    w: Doubles,
) -> None:
    """Write the rate of a scaled bristle, and the wrench of the contact."""
    put(zdot, _raw(record, rate))
    put(w, _wrench(record, traction(record.law, z, rate, _viscous(record, v))))


# ---------------------------------------------------------------------- functions of the solver


@entry
def evaluate(contact: Place, z: Doubles, v: Doubles, zdot: Doubles, w: Doubles) -> None:
    """Write `z'` and the wrench."""
    record = read(contact)
    v = three(v)
    z = _scaled(record, three(z))
    _write(record, z, v, _rate(record, z, _seen(record, v)), zdot, w)


@entry
def linearise(
    contact: Place, z: Doubles, v: Doubles, zdot: Doubles, w: Doubles, lin: Doubles
) -> None:
    """Write `z'`, the wrench, `f_z` and `f_V`."""
    record = read(contact)
    v = three(v)
    z = _scaled(record, three(z))
    rate = _slopes(record, z, _seen(record, v), arrays_at(_LINEAR, lin))
    _write(record, z, v, rate, zdot, w)


@entry
def factor(
    contact: Place, z: Doubles, shift: float, lin: Doubles, stiffness: Doubles
) -> None:
    """Prepare `D^-1`, write `-G' ((sigma_0 + sigma_1 shift) D^-1 f_V G + sigma_2 G)`."""
    record = read(contact)
    m = arrays_at(_LINEAR, lin)
    put_all(m.inverse, inverse(shift, m.by_z))
    pull = record.law.sigma_0 + record.law.sigma_1 * shift
    for k in range(3):
        unit = (
            (1.0 if k == 0 else 0.0),
            (1.0 if k == 1 else 0.0),
            (1.0 if k == 2 else 0.0),
        )
        z = applied(m.inverse, applied(m.by_twist, _seen(record, unit)))
        t = plus(times(-pull, z), -record.law.sigma_2, _viscous(record, unit))
        stiffness[k], stiffness[3 + k], stiffness[6 + k] = _wrench(record, t)


@entry
def eliminate(
    contact: Place, z: Doubles, shift: float, r: Doubles, lin: Doubles, w: Doubles
) -> None:
    """Write `G' (sigma_1 - (sigma_0 + sigma_1 shift) D^-1) r`."""
    record = read(contact)
    m = arrays_at(_LINEAR, lin)
    r = _scaled(record, three(r))
    pull = record.law.sigma_0 + record.law.sigma_1 * shift
    put(
        w,
        _wrench(
            record, plus(times(record.law.sigma_1, r), -pull, applied(m.inverse, r))
        ),
    )


@entry
def back_substitute(
    contact: Place, z: Doubles, r: Doubles, dv: Doubles, lin: Doubles, out: Doubles
) -> None:
    """Solve `D out = r + f_V G dV`."""
    record = read(contact)
    m = arrays_at(_LINEAR, lin)
    driven = applied(m.by_twist, _seen(record, three(dv)))
    put(
        out,
        _raw(record, applied(m.inverse, plus(_scaled(record, three(r)), 1.0, driven))),
    )


@entry
def change(
    contact: Place, z: Doubles, zdot: Doubles, lin: Doubles, dz: Doubles, dzdot: Doubles, rows: Doubles,
    friction: float, size: float,
) -> None:  # fmt: skip
    """Write the changes of `z'` and of the wrench."""
    record = read(contact)
    m = arrays_at(_LINEAR, lin)
    rows = arrays_at(ROWS, rows)
    turns = 0.0, 0.0, 1.0
    v = plus(three(rows.d_twist), size * rows.twist[2], turns)
    z = _scaled(record, three(z))
    dz = plus(_scaled(record, three(dz)), -size * z[2], turns)
    rate = plus(
        applied(m.by_z, plus(dz, -friction, z)),
        1.0,
        applied(m.by_twist, _seen(record, v)),
    )
    put(dzdot, plus(_raw(record, rate), size * zdot[2], turns))
    w = _wrench(record, traction(record.law, dz, rate, _viscous(record, v)))
    put(rows.d_wrench, plus(w, size * rows.wrench[2], turns))


@entry
def solve_transposed(
    contact: Place, z: Doubles, r: Doubles, lin: Doubles, out: Doubles
) -> None:
    """Solve `D' out = r`; a cotangent is scaled as a state is made raw."""
    record = read(contact)
    m = arrays_at(_LINEAR, lin)
    put(out, _scaled(record, applied_back(m.inverse, _raw(record, three(r)))))


@entry
def pull_back(
    contact: Place,
    z: Doubles,
    lin: Doubles,
    dzdot: Doubles,
    rows: Doubles,
    out: Doubles,
) -> None:
    """Write the transpose of `change`; the transpose of `G' t` is G."""
    record = read(contact)
    m = arrays_at(_LINEAR, lin)
    rows = arrays_at(ROWS, rows)
    law = record.law
    wrench = three(rows.d_wrench)
    t = _seen(record, wrench)
    rate = plus(_raw(record, three(dzdot)), -law.sigma_1, t)
    put(out, _scaled(record, plus(applied_back(m.by_z, rate), -law.sigma_0, t)))
    u = plus(applied_back(m.by_twist, rate), -law.sigma_2, _viscous(record, wrench))
    put(rows.d_twist, _wrench(record, u))


FUNCTIONS = ModelFunctions(
    evaluate,
    linearise,
    factor,
    eliminate,
    back_substitute,
    change,
    solve_transposed,
    pull_back,
)
