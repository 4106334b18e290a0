"""The published reduced model over `xp`: a bristle `[..., 3]`, as `kernels.published_step` steps it.

State and twist are `[..., 3]`; the parameters of law and shape and time steps are `[..., 1]`, or plain numbers.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from planarfriction import models
from planarfriction.formulas import LawNumbers
from planarfriction.kernels import published_contact, published_step
from planarfriction.kernels.contacts import traction
from planarfriction.kernels.vectors import plus
from planarfriction.laws import FrictionLaw
from planarfriction.limit_surface import LimitSurface
from planarfriction.models.reduced_published import PublishedShape
from planarfriction.patch import ContactPatch
from planarfriction.tensors import surfaces
from planarfriction.tensors.elements import over


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
    """A twist, and what the limit surface makes of it; components `[..., 1]`."""

    x: Any
    """`V_S`"""
    y: Any
    s: Any
    omega: Any
    u_x: Any
    """`h(V) |V_S|`"""
    u_y: Any
    u_s: Any


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
    """Return `S = diag(1, 1, r)` as a vector `[..., 3]`."""
    one = xp.ones_like(shape.contact_radius)
    return joined(xp, (one, one, shape.contact_radius))


# ---------------------------------------------------------------------- steps


def split(state) -> tuple[Any, ...]:
    """Return a state as a vector of arrays `[..., 1]`."""
    return tuple(state[..., k, None] for k in range(3))


def joined(xp, z):
    """Return a state, or a twist, of a vector of arrays."""
    return xp.concatenate(xp.broadcast_arrays(*z), -1)


def drive(xp, law: LawNumbers, shape: PublishedNumbers, twist) -> Drive:
    """Return the drive of the bristle at a twist."""
    vx, vy, omega = split(twist)
    vx, vy = _through(shape.root, vx, vy)
    scaled = joined(xp, (vx - omega * shape.centre_y, vy + omega * shape.centre_x, shape.contact_radius * omega))
    return Drive(*split(scaled), omega, *split(shape.surface(scaled, xp.norm(scaled, -1))))


def _rate(law, shape, twist, u, z):
    """Return the rate of the state at V_S = `twist`, where the limit surface gives u."""
    r = shape.contact_radius
    scaled = z[0], z[1], z[2] / r
    rate = plus(u, -published_contact._decay(law, scaled, u, twist), scaled)
    return rate[0], rate[1], r * rate[2]


def pull(xp, law: LawNumbers, shape: PublishedNumbers, z, rate, by: Drive):
    """Return the wrench per unit load, in the axes of the metric."""
    fx, fy, tau = over(xp)(traction)(law, z, rate, (by.x, by.y, shape.second_moment * by.omega))
    return fx, fy, tau + shape.centre_x * fy - shape.centre_y * fx


def evaluate(xp, law: LawNumbers, shape: PublishedNumbers, z, by: Drive):
    """Return the rate of the bristle, and the wrench per unit load."""
    rate = over(xp)(_rate)(law, shape, by[:3], by[4:], z)
    return rate, pull(xp, law, shape, z, rate, by)


def advance(xp, law: LawNumbers, shape: PublishedNumbers, z, by: Drive, dt):
    """Return the bristle after `dt` of a constant twist, and the wrench per unit load."""
    return over(xp)(published_step._step)(law, shape, by[:3], by.omega, by[4:], z, dt)


def wrench(xp, shape: PublishedNumbers, pull):
    """Return the wrench about the origin per unit load `[..., 3]`."""
    fx, fy, tau = pull
    return joined(xp, (*_through(shape.root, fx, fy), tau))
