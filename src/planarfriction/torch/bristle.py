"""Rate and step of bristles in tensors: the formulas, and the norms and projections that they ask for.

One code for both models: a bristle lies along `axis`, three components of the reduced model or two of every cell.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import torch
from torch import Tensor

from planarfriction import formulas
from planarfriction.formulas import LawNumbers
from planarfriction.torch import namespace as xp

ROUNDING = 256.0
"""Excess over the largest deflection, in units of the rounding error, that is taken for rounding.

Steady sliding sits on the largest deflection to the last bit. Whether rounding lifts a bristle over it must not decide
about a derivative.
"""


class Drive(NamedTuple):
    """What drives bristles; all but the first keep the axis of the components with length 1."""

    velocity: Tensor
    """`u`: velocity of a cell, `h(V) v_n` in the reduced model [m/s]."""
    speed: Tensor
    """`|v|` of a cell, `v_n` in the reduced model [m/s]."""
    size: Tensor
    """`|u|/speed`: 1 for a cell, `|h|` in the reduced model [-]."""
    grip: Tensor
    """`sigma_0/g(speed)` [1/m]."""


def drive(law: LawNumbers, velocity: Tensor, speed: Tensor, size: Tensor) -> Drive:
    """The drive of bristles, with the grip at its speed."""
    return Drive(velocity, speed, size, law.sigma_0 / formulas.stribeck(xp, speed, law))


def rate(law: LawNumbers, z: Tensor, by: Drive, axis: int) -> Tensor:
    """`zdot = u - k z`."""
    z_norm = xp.norm(z, axis)
    return by.velocity - _decay(law, z_norm * (by.grip / by.size), _along(z, z_norm, by, axis), by) * z


def step(law: LawNumbers, z: Tensor, by: Drive, dt: Tensor, axis: int) -> tuple[Tensor, Tensor]:
    """Bristles and their rates after `dt` of a held drive (see `formulas.relaxation`)."""
    u, to_deflection = by.velocity, by.grip / by.size
    z_norm = xp.norm(z, axis)
    deflection = z_norm * to_deflection
    start = _decay(law, deflection, _along(z, z_norm, by, axis), by)
    end = start
    if law.elasto_plastic:
        predicted = z + u * dt  # times 1/(1 + k dt), which leaves the direction
        p_norm = xp.norm(predicted, axis)
        bound = xp.minimum(p_norm * to_deflection / (1.0 + start * dt), xp.maximum(deflection, 1.0))
        end = _decay(law, bound, _along(predicted, p_norm, by, axis), by)
    left, mean = formulas.relaxation(xp, formulas.mean_decay(start, end, dt) * dt)
    new = z * left + u * dt * mean
    norm = xp.norm(new, axis)
    along = _along(new, norm, by, axis)
    if law.elasto_plastic:
        back = _back(norm * to_deflection, formulas.reachable_deflection(xp, deflection, law))
        new, norm = new * back, norm * back
    return new, u - _decay(law, norm * to_deflection, along, by) * new


def traction(law: LawNumbers, z: Tensor, zdot: Tensor, velocity: Tensor) -> Tensor:
    """Friction per unit normal load, per component."""
    return formulas.traction(z, zdot, velocity, law)


def _decay(law: LawNumbers, deflection: Tensor, along: Tensor, by: Drive) -> Tensor:
    return formulas.bristle_decay(xp, deflection, along, by.speed, by.grip, law)


def _along(z: Tensor, z_norm: Tensor, by: Drive, axis: int) -> Tensor:
    """Speed at which a bristle is stretched, `z/|z| . u/size`; 0 with derivative 0 for a bristle at rest."""
    deflected = z_norm > 0.0
    stretch = (z * by.velocity).sum(axis, keepdim=True) / (by.size * torch.where(deflected, z_norm, 1.0))
    return torch.where(deflected, stretch, 0.0)


def _back(deflection: Tensor, largest: Any) -> Any:
    """Factor that brings bristles back onto the ball they may not leave; rounding is no excess."""
    margin = 1.0 + ROUNDING * torch.finfo(deflection.dtype).eps
    return formulas.cap(xp, torch.where(deflection > margin * largest, deflection, 0.0), largest)
