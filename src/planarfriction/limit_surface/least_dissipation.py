"""Twists of wrenches for surfaces that compiled loops know as stored tables only: their own `direction` has the say."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planarfriction.kernels import surfaces
from planarfriction.limit_surface.loops.twists import StoredPotential

if TYPE_CHECKING:
    from planarfriction.limit_surface.base import LimitSurface

_BALANCED = 1e-12
"""Angle [rad] between the wrench of a twist and the given one at which it is found."""

_GOOD = 1e-10
"""Angle [rad] below which a step that does not help ends the search: rounding has the rest."""

_MOST_STEPS = 60
"""Newton steps; a few are usual from the table's answer."""


def table_of(surface: LimitSurface) -> StoredPotential:
    """Return the stored potential of a surface, and its directions over their dissipation."""
    _, size, data = surface.numbers
    angle = 0.5 * np.pi / size * np.arange(4 * size)
    polar, azimuth = angle[: size + 1, None], angle[None, :]
    units = np.stack([np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar) + 0.0 * azimuth])
    lean = surface._lean
    if lean is not None:  # else the lower half mirrors the upper
        units = np.concatenate([units, -units], axis=1)
    flat = np.ascontiguousarray(units.reshape(3, -1).T)
    h = np.empty_like(flat)
    surfaces.sliding_batch(surfaces.POTENTIAL, data, 0, size, flat, h)
    power = np.einsum("ni,ni->n", h if lean is None else h + lean, flat).reshape(units.shape[1:])
    duals = np.divide(units, power, out=np.zeros_like(units), where=power > 0.0)
    return StoredPotential(data, size, duals, -1.0 if lean is None else 1.0)


def descend(surface: LimitSurface, wrenches: np.ndarray, twists: np.ndarray) -> float:
    """Improve twists `[M, 3]` of wrenches `[M, 3]`; return the largest angle left in scaled coordinates [rad]."""
    scaling, worst = surface._scaling, 0.0
    back = scaling[9:18].reshape(3, 3)
    for wrench, twist in zip(wrenches, twists, strict=True):
        target = scaling[:9].reshape(3, 3) @ (wrench / np.abs(wrench).max())
        with np.errstate(over="ignore", invalid="ignore"):  # a search that runs away: the angle says so
            found, angle = _least(surface, target / np.linalg.norm(target), np.linalg.solve(back, twist))
        twist[:] = back @ found
        worst = float(np.fmax(worst, angle)) if angle == angle else angle
    return worst


def _least(surface: LimitSurface, target: np.ndarray, guess: np.ndarray) -> tuple[np.ndarray, float]:
    """Return the scaled twist of unit dissipation with `h` along the unit vector `target`, and the angle left [rad].

    As `limit_surface.loops.twists`: minimises the convex `Phi` over the plane `target . V = 1` by damped Newton steps.
    """
    basis = across(target)
    place = basis @ guess / (target @ guess)
    value, slope, angle = _dissipation_over(surface, target, basis, place)
    for _ in range(_MOST_STEPS):
        if not angle > _BALANCED:
            break
        point = target + place @ basis
        hessian = basis @ surface._direction_slope(point[None])[0] @ basis.T
        # where a surface curves downwards, the same step along that direction, but downhill
        curvature, axes = np.linalg.eigh(hessian)
        curvature = np.maximum(np.abs(curvature), 1e-12 * np.abs(curvature).max())
        if not curvature.max() > 0.0:
            break
        move = -axes @ ((axes.T @ slope) / curvature)
        length = 1.0
        while length > 1e-14:
            trial, trial_slope, trial_angle = _dissipation_over(surface, target, basis, place + length * move)
            gain = value - trial
            # near the minimum the gain drowns in rounding; there a better balance shows progress
            level = abs(gain) < 1e-9 * value and np.linalg.norm(trial_slope) < 0.5 * np.linalg.norm(slope)
            if level or gain > 1e-4 * length * abs(move @ slope):
                break
            length *= 0.5 if angle > _GOOD else 0.0
        else:
            break
        place, value, slope, angle = place + length * move, trial, trial_slope, trial_angle
    return (target + place @ basis) / value, angle


def _dissipation_over(surface: LimitSurface, target, basis, place) -> tuple[float, np.ndarray, float]:
    """Return `Phi`, its slope `[2]` and the angle between h and the target at a place in the plane `target . V = 1`."""
    point = target + place @ basis
    h = surface._direction(point[None])[0]
    slope = basis @ h
    return float(h @ point), slope, float(np.arctan2(np.linalg.norm(slope), h @ target))


def across(normal: np.ndarray) -> np.ndarray:
    """Return two unit vectors `[..., 2, 3]` that span the plane across the unit vector `normal` `[..., 3]`."""
    first = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal), axis=-1)])
    first /= np.linalg.norm(first, axis=-1)[..., None]
    return np.stack([first, np.cross(normal, first)], axis=-2)
