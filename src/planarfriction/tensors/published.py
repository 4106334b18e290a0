"""The published reduced model over `xp`: a bristle `[..., 3]` that steps as `bristles.bristle_step` says.

State and twist are `[..., 3]`; the parameters of law and shape and time steps are `[..., 1, 1]`, or plain numbers.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from planarfriction import formulas, models
from planarfriction._engine.bristles import bristle_step
from planarfriction._engine.bristles.law import inverse_deflection
from planarfriction._engine.published import published_contact
from planarfriction._engine.published.published_contact import PublishedPatch, Root
from planarfriction.formulas import LawNumbers
from planarfriction.laws import FrictionLaw
from planarfriction.limit_surface import LimitSurface
from planarfriction.models.reduced_published import PublishedShape
from planarfriction.patch import ContactPatch
from planarfriction.tensors import surfaces
from planarfriction.tensors.elements import Vector, joined, split


class PublishedNumbers(NamedTuple):
    """A `PublishedShape` as arrays."""

    shape: Any
    """`PublishedPatch` of arrays."""
    surface: Callable[..., Any]
    """`u = h(V) |V_S|` of the scaled twist `[..., 3]` and its norm `[..., 1]`."""
    root: Any = None
    """Symmetric root of the friction metric (`Root`), or None: velocities go in through it, forces come out."""


class Drive(NamedTuple):
    """Velocities that drive the bristle in scaled coordinates, `[..., 3, 1]`, and numbers `[..., 1, 1]`."""

    velocity: Any
    """`u = h(V) v_n` [m/s]"""
    speed: Any
    """`v_n` [m/s]"""
    per_h: Any
    """`1/|h|` [-]"""
    grip: Any
    """`sigma_0/g(v_n)` [1/m]"""
    viscous: Any
    """Velocity that viscous friction opposes [m/s]."""


def shape_of(
    patch: ContactPatch, law: FrictionLaw, surface: LimitSurface | None
) -> PublishedShape:
    """Return the shape of a patch at the load of `surface`, and with None the published table's."""
    when = "keep" if surface is not None else "rebuild"
    model = models.ReducedModelPublished(
        patch,
        law,
        surface,  # pyright: ignore[reportArgumentType]
        on_load_change=when,
    )
    return model.shapes.reference


def values_of(law: FrictionLaw, shape: PublishedShape) -> dict[str, float]:
    """Return the physical parameters of law and shape by name."""
    x, y = shape.centre_of_pressure.tolist()
    own = {"contact_radius": shape.contact_radius, "second_moment": shape.second_moment}
    return law.numbers._asdict() | own | {"centre_x": x, "centre_y": y}


def numbers_of(
    xp, values: Mapping[str, Any], surface: Any, root: Any
) -> PublishedNumbers:
    """Return a shape at values of its parameters `[..., 1, 1]`; `surface` has its `kind`, `size` and `data`."""
    shape = PublishedPatch(*(values[name] for name in PublishedPatch._fields))
    sliding = functools.partial(
        surfaces.sliding, xp, surface.kind, surface.size, surface.data
    )
    return PublishedNumbers(
        shape,
        sliding,
        None if root is None else Root(root[0, 0], root[0, 1], root[1, 1]),
    )


def centre(own: PublishedNumbers) -> tuple[Any, Any]:
    """Return the centre of pressure [m]."""
    x = own.shape.centre_x[..., 0, 0]
    y = own.shape.centre_y[..., 0, 0]
    if own.root is None:
        return x, y
    a, b, d = own.root
    one = a * d - b * b
    return (a * x + b * y) / one, (b * x + d * y) / one


# ---------------------------------------------------------------------- steps


def wide(state):
    """Return a state as a bristle `[..., 3, 1]`."""
    return state[..., None]


def narrow(z):
    """Return a bristle `[..., 3, 1]` as a state."""
    return z[..., 0]


def _mapped(xp, function, own: PublishedNumbers, vector):
    """Return a function of a contact and a vector, at a vector `[..., 3, 1]`."""
    return joined(xp, xp.over(function)(own, split(vector)))


def raw(xp, own: PublishedNumbers, z):
    """Return a scaled bristle as states have it, times `S = diag(1, 1, r)`."""
    return _mapped(xp, published_contact._raw, own, z)


def scaled(xp, own: PublishedNumbers, z):
    """Return a bristle as it steps, over S."""
    return _mapped(xp, published_contact._scaled, own, z)


def drive(xp, law: LawNumbers, own: PublishedNumbers, twist) -> Drive:
    """Return the drive of the bristle at a twist."""
    twist, viscous = (
        _mapped(xp, each, own, wide(twist))
        for each in (published_contact._seen, published_contact._viscous)
    )
    speed = xp.norm(twist, -2)
    u = wide(own.surface(narrow(twist), narrow(speed)))
    per_h = xp.over(published_contact.per_h)(Vector(u), speed)
    return Drive(u, speed, per_h, xp.over(inverse_deflection)(law, speed), viscous)


def evaluate(xp, law: LawNumbers, own: PublishedNumbers, z, by: Drive, load):
    """Return the rate of the bristle, and its pull (see `wrench`)."""
    z = scaled(xp, own, z)
    rate = (
        by.velocity
        - xp.over(published_contact.decay_of)(
            law, Vector(z), Vector(by.velocity), *by[1:4]
        )
        * z
    )
    return raw(xp, own, rate), formulas.traction(z, rate, by.viscous, law)


def advance(xp, law: LawNumbers, own: PublishedNumbers, z, by: Drive, load, dt):
    """Return the bristle after `dt` of a constant twist, and its pull (see `wrench`)."""
    z = scaled(xp, own, z)
    new, k = xp.over(bristle_step.step)(
        law, Vector(z), Vector(by.velocity), *by[1:4], dt
    )
    new = new.array
    return raw(xp, own, new), formulas.traction(
        new, by.velocity - k * new, by.viscous, law
    )


def wrench(xp, own: PublishedNumbers, pull):
    """Return the wrench about the origin per unit load `[..., 3]`, of a scaled one `[..., 3, 1]` (its pull)."""
    return narrow(_mapped(xp, published_contact._wrench, own, pull))
