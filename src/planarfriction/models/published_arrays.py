"""The published reduced model for arrays of PyTorch and JAX (see `bristle_arrays`): a bristle `[..., 3]`.

State and twist are `[..., 3]`; the parameters of law and shape and time steps are `[..., 1]`, or plain numbers.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

from planarfriction import formulas
from planarfriction.formulas import LawNumbers
from planarfriction.models import bristle_arrays
from planarfriction.models.bristle_arrays import Drive

AXIS = -1
"""Of the components of the bristle."""


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


def _through(root, x, y):
    return (x, y) if root is None else (root[0, 0] * x + root[0, 1] * y, root[0, 1] * x + root[1, 1] * y)


def scale(xp, shape: PublishedNumbers):
    """`S = diag(1, 1, r)` as a vector `[..., 3]`: the bristle is scaled by 1/S to be moved, and its rate by S."""
    one = xp.ones_like(shape.contact_radius)
    return _joined(xp, one, one, shape.contact_radius)


def held(xp, law: LawNumbers, shape: PublishedNumbers, twist) -> Drive:
    """What drives the scaled bristle: `u = h(V) v_n`."""
    vx, vy, omega = twist[..., 0:1], twist[..., 1:2], twist[..., 2:3]
    vx, vy = _through(shape.root, vx, vy)
    vx, vy = vx - omega * shape.centre_y, vy + omega * shape.centre_x
    scaled = _joined(xp, vx, vy, shape.contact_radius * omega)
    speed = xp.norm(scaled, AXIS)
    u = shape.surface(scaled, speed)
    u_norm = xp.norm(u, AXIS)
    slides = u_norm > 0.0
    size = xp.where(slides, u_norm / xp.where(slides, speed, 1.0), 1.0)
    return bristle_arrays.drive(xp, law, u, speed, size, _joined(xp, vx, vy, shape.second_moment * omega))


def rate(xp, law: LawNumbers, shape: PublishedNumbers, z, by: Drive):
    """`zdot = S u - k z`."""
    s = scale(xp, shape)
    return s * bristle_arrays.rate(xp, law, z / s, by, AXIS)


def advance(xp, law: LawNumbers, shape: PublishedNumbers, z, by: Drive, dt):
    """The bristle and its rate after `dt` of a held twist."""
    s = scale(xp, shape)
    new, zdot = bristle_arrays.step(xp, law, z / s, by, dt, AXIS)
    return s * new, s * zdot


def wrench(xp, law: LawNumbers, shape: PublishedNumbers, z, zdot, by: Drive):
    """Wrench about the origin per unit load `[..., 3]`."""
    force = formulas.traction(z, zdot, by.viscous, law)
    fx, fy, tau = force[..., 0:1], force[..., 1:2], force[..., 2:3]
    return _joined(xp, *_through(shape.root, fx, fy), tau + shape.centre_x * fy - shape.centre_y * fx)


def _joined(xp, x, y, s):
    """Components `[..., 1]` as a vector `[..., 3]`; they broadcast."""
    return xp.concatenate(xp.broadcast_arrays(x, y, s), -1)
