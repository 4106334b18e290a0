"""The distributed model over `xp`: a bristle `[..., 2, N]` in every cell.

Twists are `[..., 3]`; the law's parameters and time steps are `[..., 1, 1]`, or plain numbers.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from planarfriction import formulas
from planarfriction.errors import InvalidValueError
from planarfriction.formulas import LawNumbers
from planarfriction.patch import ContactPatch
from planarfriction.tensors import bristles
from planarfriction.tensors.bristles import Drive

AXIS = -2
"""Axis of the components of a bristle, the first axis of a state."""

LEVER = (0, 0), (0, 1), (1, 1), (0, 2), (1, 2)
"""Entries of the lever B `[2, 3]` of a cell with a friction metric (see `ContactPatch.levers`) that are kept."""


class Cells(NamedTuple):
    """A patch as arrays."""

    levers: Any
    """Positions, x then y [m], `[2, N]`; with a friction metric the entries `LEVER` of the levers, `[5, N]`."""
    weights: Any
    """Share of the load that each cell carries [-], `[N]`."""


def cells_of(patch: ContactPatch, normal_force: float | None, front: str) -> Cells:
    """Return the cells of a patch at a load [N] as NumPy arrays; `front` names the front end in messages."""
    if patch.asymmetric:
        by = f"{front}.DistributedModel (ReducedModel in parts takes any)"
        raise InvalidValueError("patch", f"have the same friction forwards and backwards for {by}", "an asymmetry")
    if not patch.anisotropic:
        return Cells(np.ascontiguousarray(patch.positions.T), patch.weights(normal_force))
    maps = patch.levers()
    return Cells(np.array([maps[:, i, j] for i, j in LEVER]), patch.weights(normal_force))


def positions_of(xp, cells: Cells):
    """Return the positions of the cells, x then y [m], `[2, N]`."""
    if len(cells.levers) == 2:
        return cells.levers
    xx, xy, yy, x, y = (cells.levers[k] for k in range(len(LEVER)))
    return xp.stack([xx * y - xy * x, xy * y - yy * x], 0) / (xx * yy - xy * xy)


def drive(xp, law: LawNumbers, cells: Cells, twist) -> Drive:
    """Return the drive of the bristles at a twist: the velocities of the cells."""
    vx, vy, omega = twist[..., 0, None], twist[..., 1, None], twist[..., 2, None]
    if len(cells.levers) == 2:
        x, y = cells.levers[0], cells.levers[1]
        velocity = xp.stack([vx - omega * y, vy + omega * x], -2)
    else:
        xx, xy, yy, x, y = (cells.levers[k] for k in range(len(LEVER)))
        velocity = xp.stack([xx * vx + xy * vy + x * omega, xy * vx + yy * vy + y * omega], -2)
    return bristles.drive(xp, law, velocity, xp.norm(velocity, AXIS), 1.0, velocity)


def rate(xp, law: LawNumbers, cells: Cells, z, by: Drive):
    """Return `zdot = v - k z`."""
    return bristles.rate(xp, law, z, by, AXIS)


def advance(xp, law: LawNumbers, cells: Cells, z, by: Drive, dt):
    """Return the bristles after `dt` of a constant twist, and their rates."""
    return bristles.step(xp, law, z, by, dt, AXIS)


def wrench(xp, law: LawNumbers, cells: Cells, z, zdot, by: Drive):
    """Return the wrench about the origin per unit load `[..., 3]`: `sum w_i [t_i ; rho_i x t_i]`."""
    force = cells.weights * formulas.traction(z, zdot, by.viscous, law)
    fx, fy = force[..., 0, :], force[..., 1, :]
    if len(cells.levers) == 2:
        x, y = cells.levers[0], cells.levers[1]
        return xp.stack([fx.sum(-1), fy.sum(-1), (x * fy - y * fx).sum(-1)], -1)
    xx, xy, yy, x, y = (cells.levers[k] for k in range(len(LEVER)))
    sums = xx * fx + xy * fy, xy * fx + yy * fy, x * fx + y * fy
    return xp.stack([each.sum(-1) for each in sums], -1)
