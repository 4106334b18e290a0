"""The published reduced model over `xp`: a bristle `[..., 3]`.

State and twist are `[..., 3]`; the parameters of law and shape and time steps are `[..., 1]`, or plain numbers.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from planarfriction import formulas, models
from planarfriction.formulas import LawNumbers
from planarfriction.laws import FrictionLaw
from planarfriction.limit_surface import LimitSurface
from planarfriction.models.reduced_published import PublishedShape
from planarfriction.patch import ContactPatch
from planarfriction.tensors import bristles, surfaces
from planarfriction.tensors.bristles import Drive

AXIS = -1
"""Axis of the components of the bristle, the only axis of a state."""


class PublishedNumbers(NamedTuple):
    """A `PublishedShape` as arrays."""

    contact_radius: Any
    """r [m]"""
    second_moment: Any
    """<rho^2> [m^2]"""
    centre_x: Any
    """Centre of pressure [m]."""
    centre_y: Any
    surface: Callable[..., Any]
    """`u = h(V) |V_S|` of the scaled twist `[..., 3]` and its norm `[..., 1]`."""
    root: Any = None
    """Symmetric root of the friction metric `[2, 2]`, or None: velocities go in through it, forces come out."""


def shape_of(patch: ContactPatch, law: FrictionLaw, surface: LimitSurface | None) -> PublishedShape:
    """Return the shape of a patch at the load of `surface`, and with None the published table's."""
    when = "keep" if surface is not None else "rebuild"
    return models.ReducedModelPublished(patch, law, surface, on_load_change=when).shapes.reference  # pyright: ignore


def values_of(law: FrictionLaw, shape: PublishedShape) -> dict[str, float]:
    """Return the physical parameters of law and shape by name."""
    x, y = shape.centre_of_pressure.tolist()
    own = {"contact_radius": shape.contact_radius, "second_moment": shape.second_moment}
    return law.numbers._asdict() | own | {"centre_x": x, "centre_y": y}


def numbers_of(xp, values: Mapping[str, Any], surface: Any, root: Any) -> PublishedNumbers:
    """Return a shape at values of its parameters `[..., 1]`; `surface` has the `kind`, `size` and `data` of its law."""
    own = {name: values[name] for name in PublishedNumbers._fields[:4]}
    sliding = functools.partial(surfaces.sliding, xp, surface.kind, surface.size, surface.data)
    return PublishedNumbers(**own, surface=sliding, root=root)


def _through(root, x, y):
    return (x, y) if root is None else (root[0, 0] * x + root[0, 1] * y, root[0, 1] * x + root[1, 1] * y)


def centre(shape: PublishedNumbers) -> tuple[Any, Any]:
    """Return the centre of pressure [m]."""
    x, y = shape.centre_x[..., 0], shape.centre_y[..., 0]
    if shape.root is None:
        return x, y
    (a, b), (_, d) = shape.root
    one = a * d - b * b
    return (a * x + b * y) / one, (b * x + d * y) / one


def scale(xp, shape: PublishedNumbers):
    """Return `S = diag(1, 1, r)` as a vector `[..., 3]`: bristles are scaled by 1/S for a step, their rates by S."""
    one = xp.ones_like(shape.contact_radius)
    return _joined(xp, one, one, shape.contact_radius)


def drive(xp, law: LawNumbers, shape: PublishedNumbers, twist) -> Drive:
    """Return the drive of the scaled bristle at a twist: `u = h(V) v_n`."""
    vx, vy, omega = twist[..., 0:1], twist[..., 1:2], twist[..., 2:3]
    vx, vy = _through(shape.root, vx, vy)
    vx, vy = vx - omega * shape.centre_y, vy + omega * shape.centre_x
    scaled = _joined(xp, vx, vy, shape.contact_radius * omega)
    speed = xp.norm(scaled, AXIS)
    u = shape.surface(scaled, speed)
    u_norm = xp.norm(u, AXIS)
    slides = u_norm > 0.0
    size = xp.where(slides, u_norm / xp.where(slides, speed, 1.0), 1.0)
    return bristles.drive(xp, law, u, speed, size, _joined(xp, vx, vy, shape.second_moment * omega))


def rate(xp, law: LawNumbers, shape: PublishedNumbers, z, by: Drive):
    """Return `zdot = S u - k z`."""
    s = scale(xp, shape)
    return s * bristles.rate(xp, law, z / s, by, AXIS)


def advance(xp, law: LawNumbers, shape: PublishedNumbers, z, by: Drive, dt):
    """Return the bristle after `dt` of a constant twist, and its rate."""
    s = scale(xp, shape)
    new, zdot = bristles.step(xp, law, z / s, by, dt, AXIS)
    return s * new, s * zdot


def wrench(xp, law: LawNumbers, shape: PublishedNumbers, z, zdot, by: Drive):
    """Return the wrench about the origin per unit load `[..., 3]`."""
    force = formulas.traction(z, zdot, by.viscous, law)
    fx, fy, tau = force[..., 0:1], force[..., 1:2], force[..., 2:3]
    return _joined(xp, *_through(shape.root, fx, fy), tau + shape.centre_x * fy - shape.centre_y * fx)


def _joined(xp, x, y, s):
    """Return components `[..., 1]`, which broadcast, as a vector `[..., 3]`."""
    return xp.concatenate(xp.broadcast_arrays(x, y, s), -1)
