"""The published reduced model over `xp`: a bristle `[..., 3]` that steps as `kernels.bristle_step` says.

State and twist are `[..., 3]`; the parameters of law and shape and time steps are `[..., 1, 1]`, or plain numbers.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from planarfriction import formulas, models
from planarfriction.compiler import compiled_math
from planarfriction.formulas import LawNumbers
from planarfriction.kernels import bristle_step
from planarfriction.kernels.bristle_step import seen
from planarfriction.kernels.vectors import norm, plus
from planarfriction.laws import FrictionLaw
from planarfriction.limit_surface import LimitSurface
from planarfriction.models.reduced_published import PublishedShape
from planarfriction.patch import ContactPatch
from planarfriction.tensors import surfaces
from planarfriction.tensors.elements import Vector, joined, over, split


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
    """`U V`: velocity that viscous friction opposes."""


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
    """Return a shape at values of its parameters `[..., 1, 1]`; `surface` has its `kind`, `size` and `data`."""
    own = {name: values[name] for name in PublishedNumbers._fields[:4]}
    sliding = functools.partial(surfaces.sliding, xp, surface.kind, surface.size, surface.data)
    return PublishedNumbers(**own, surface=sliding, root=root)


def _through(root, x, y):
    return (x, y) if root is None else (root[0, 0] * x + root[0, 1] * y, root[0, 1] * x + root[1, 1] * y)


def centre(shape: PublishedNumbers) -> tuple[Any, Any]:
    """Return the centre of pressure [m]."""
    x, y = shape.centre_x[..., 0, 0], shape.centre_y[..., 0, 0]
    if shape.root is None:
        return x, y
    (a, b), (_, d) = shape.root
    one = a * d - b * b
    return (a * x + b * y) / one, (b * x + d * y) / one


def scale(xp, shape: PublishedNumbers):
    """Return `S = diag(1, 1, r)` as a vector `[..., 3, 1]`: bristles are scaled by 1/S for a step, their rates by S."""
    one = xp.ones_like(shape.contact_radius)
    return joined(xp, (one, one, shape.contact_radius))


# ---------------------------------------------------------------------- steps


def wide(state):
    """Return a state as a bristle `[..., 3, 1]`."""
    return state[..., None]


def narrow(z):
    """Return a bristle `[..., 3, 1]` as a state."""
    return z[..., 0]


def drive(xp, law: LawNumbers, shape: PublishedNumbers, twist) -> Drive:
    """Return the drive of the bristle at a twist."""
    vx, vy, omega = split(wide(twist))
    vx, vy = _through(shape.root, vx, vy)
    vx, vy = vx - omega * shape.centre_y, vy + omega * shape.centre_x
    scaled = joined(xp, (vx, vy, shape.contact_radius * omega))
    speed = xp.norm(scaled, -2)
    u = wide(shape.surface(narrow(scaled), narrow(speed)))
    u_norm = xp.norm(u, -2)
    slides = u_norm > 0.0
    per_h = xp.where(slides, speed, 1.0) / xp.where(slides, u_norm, 1.0)
    viscous = joined(xp, (vx, vy, shape.second_moment * omega))
    return Drive(u, speed, per_h, law.sigma_0 / formulas.stribeck(xp, speed, law), viscous)


def _rate(law, z, u, speed, per_h, grip):
    """Return z' of the scaled bristle."""
    deflection, along = seen(z, norm(z), u, per_h, grip)
    return plus(u, -formulas.bristle_decay(compiled_math, deflection, along, speed, grip, law), z)


def evaluate(xp, law: LawNumbers, shape: PublishedNumbers, z, by: Drive):
    """Return the rate of the bristle, and its pull (see `pull`)."""
    s = scale(xp, shape)
    rate = s * over(xp)(_rate)(law, Vector(z / s), Vector(by.velocity), *by[1:4]).array
    return rate, pull(law, z, rate, by)


def advance(xp, law: LawNumbers, shape: PublishedNumbers, z, by: Drive, dt):
    """Return the bristle after `dt` of a constant twist, and its pull (see `pull`)."""
    s = scale(xp, shape)
    new, k = over(xp)(bristle_step.step)(law, Vector(z / s), Vector(by.velocity), *by[1:4], dt)
    rate = by.velocity - k * new.array
    return s * new.array, pull(law, s * new.array, s * rate, by)


def pull(law: LawNumbers, z, rate, by: Drive):
    """Return the wrench per unit load about the centre of pressure, in the axes of the metric, `[..., 3, 1]`."""
    return formulas.traction(z, rate, by.viscous, law)


def wrench(xp, shape: PublishedNumbers, pull):
    """Return the wrench about the origin per unit load `[..., 3]`."""
    fx, fy, tau = split(pull)
    return narrow(joined(xp, (*_through(shape.root, fx, fy), tau + shape.centre_x * fy - shape.centre_y * fx)))
