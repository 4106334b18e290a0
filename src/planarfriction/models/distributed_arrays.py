"""The distributed model for arrays of PyTorch and JAX (see `bristle_arrays`): a bristle `[..., 2, N]` in every cell.

Twists are `[..., 3]`; the law's parameters and time steps are `[..., 1, 1]`, or plain numbers.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from planarfriction import formulas
from planarfriction.formulas import LawNumbers
from planarfriction.models import bristle_arrays
from planarfriction.models.bristle_arrays import Drive

AXIS = -2
"""Of the components of a bristle."""


class Cells(NamedTuple):
    """A patch as arrays."""

    positions: Any
    """x then y [m], `[2, N]`."""
    weights: Any
    """Share of the load that each cell carries [-], `[N]`."""


def held(xp, law: LawNumbers, cells: Cells, twist) -> Drive:
    """What drives the bristles: the velocities of the cells."""
    x, y = cells.positions[0], cells.positions[1]
    vx, vy, omega = twist[..., 0, None], twist[..., 1, None], twist[..., 2, None]
    velocity = xp.stack([vx - omega * y, vy + omega * x], -2)
    return bristle_arrays.drive(xp, law, velocity, xp.norm(velocity, AXIS), 1.0, velocity)


def rate(xp, law: LawNumbers, cells: Cells, z, by: Drive):
    """`zdot = v - k z`."""
    return bristle_arrays.rate(xp, law, z, by, AXIS)


def advance(xp, law: LawNumbers, cells: Cells, z, by: Drive, dt):
    """Bristles and their rates after `dt` of a held twist."""
    return bristle_arrays.step(xp, law, z, by, dt, AXIS)


def wrench(xp, law: LawNumbers, cells: Cells, z, zdot, by: Drive):
    """Wrench about the origin per unit load `[..., 3]`: `sum w_i [t_i ; rho_i x t_i]`."""
    x, y = cells.positions[0], cells.positions[1]
    force = cells.weights * formulas.traction(z, zdot, by.viscous, law)
    fx, fy = force[..., 0, :], force[..., 1, :]
    return xp.stack([fx.sum(-1), fy.sum(-1), (x * fy - y * fx).sum(-1)], -1)
