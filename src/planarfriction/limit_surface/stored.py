"""Twists of wrenches and sums of cells for surfaces that Python evaluates, and their tables for compiled loops."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from planarfriction.kernels import surfaces
from planarfriction.limit_surface.loops.twists import StoredPotential
from planarfriction.patch.disc_friction import disc_curvature, disc_friction

if TYPE_CHECKING:
    from planarfriction.limit_surface.base import LimitSurface

_AT_REST = 1e-14
"""Share of the twist below which a cell stands in the centre of rotation and adds nothing, as in compiled sums."""

_AT_ONCE = 500_000
"""Cells times twists that one array holds."""


def scaled_levers(x: np.ndarray, y: np.ndarray, root: np.ndarray | None, frame: np.ndarray) -> np.ndarray:
    """Return `C_i = [L_i frame^-1 | (-y_i, x_i)]`, shape `[n, 2, 3]`, of lever coordinates in contact radii.

    `root` holds the `L_i` `[n, 2, 2]`, None where all of them are `frame` `[2, 2]`.
    """
    levers = np.empty((len(x), 2, 3))
    levers[:, :, :2] = np.eye(2) if root is None else np.linalg.solve(frame.T, np.swapaxes(root, 1, 2)).swapaxes(1, 2)
    levers[:, 0, 2], levers[:, 1, 2] = -y, x
    return levers


def cell_sums(levers: np.ndarray, weights: np.ndarray, units: np.ndarray) -> np.ndarray:
    """Return `h` of unit scaled twists `[M, 3]`, shape `[M, 3]`."""
    parts = _parts(units, levers)
    return np.concatenate([_direction(levers, weights, _headings(levers, each)[1]) for each in parts])


def cell_slopes(levers: np.ndarray, weights: np.ndarray, units: np.ndarray) -> np.ndarray:
    """Return `dh/dV_S` of unit scaled twists `[M, 3]`, shape `[M, 3, 3]`."""
    if levers.shape[1] == 3:
        return _disc_slopes(levers, weights, units)
    found = []
    for part in _parts(units, levers):
        size, heading = _headings(levers, part)
        turn = heading[:, None, :, 0] * levers[:, 1].T - heading[:, None, :, 1] * levers[:, 0].T  # [m, 3, n]
        share = np.divide(weights, size, out=np.zeros_like(size), where=size > 0.0)
        found.append(np.einsum("min,mjn->mij", share[:, None] * turn, turn))
    return np.concatenate(found)


def _disc_slopes(levers: np.ndarray, weights: np.ndarray, units: np.ndarray) -> np.ndarray:
    """Return `dh/dV_S` of discs: `sum w B' (dW/du - W W'/S^2)/S B`."""
    found = []
    for part in _parts(units, levers):
        seen = np.einsum("ncd,md->mnc", levers, part)
        c_t, c_s, speed = disc_friction(seen[..., 0] ** 2 + seen[..., 1] ** 2, 2.0 * seen[..., 2] ** 2)
        moving = speed > _AT_REST
        share = np.divide(weights, speed, out=np.zeros_like(speed), where=moving)
        pull = seen * np.stack([c_t, c_t, c_s], -1) * (share / np.where(weights > 0.0, weights, 1.0))[..., None]
        bent, along = disc_curvature(seen)
        terms = (share * c_t, levers[:, 0]), (share * c_t, levers[:, 1]), (share * c_s, levers[:, 2])
        slope = sum(np.einsum("mn,ni,nj->mij", factor, row, row) for factor, row in terms)
        for factor, each in ((share * bent, along), (-share, pull)):
            turned = np.einsum("mnc,nci->mni", each, levers)
            slope = slope + np.einsum("mn,mni,mnj->mij", factor, turned, turned)
        found.append(slope)
    return np.concatenate(found)


def _parts(units: np.ndarray, levers: np.ndarray) -> list[np.ndarray]:
    rows = max(1, _AT_ONCE // len(levers))
    return [units[start : start + rows] for start in range(0, max(len(units), 1), rows)]


def _direction(levers: np.ndarray, weights: np.ndarray, heading: np.ndarray) -> np.ndarray:
    """Return `h` `[m, 3]` of headings `[m, n, 2 or 3]`: sums over the cells are the same for one twist as for many."""
    pull = np.ascontiguousarray((weights[:, None, None] * levers).reshape(-1, 3).T)
    return np.einsum("mk,dk->md", heading.reshape(-1, pull.shape[1]), pull)


def _headings(levers: np.ndarray, units: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return speeds `[m, n]` and headings of unit scaled twists, both zero for cells at rest.

    Those of points are `|u_i|` and `u_i/|u_i|` `[m, n, 2]`, those of discs S and `W/S` `[m, n, 3]`.
    """
    seen = np.einsum("ncd,md->mnc", levers, units)
    if levers.shape[1] == 3:
        c_t, c_s, size = disc_friction(seen[..., 0] ** 2 + seen[..., 1] ** 2, 2.0 * seen[..., 2] ** 2)
        seen *= np.stack([c_t, c_t, c_s], -1)
    else:
        size = np.hypot(seen[..., 0], seen[..., 1])
    size[size <= _AT_REST] = 0.0
    return size, seen * np.divide(1.0, size, out=np.zeros_like(size), where=size > 0.0)[..., None]


def stored_potential(sums: Callable[[np.ndarray], tuple[np.ndarray, np.ndarray | None]], segments: int) -> np.ndarray:
    """Return the numbers of `kernels.surfaces.POTENTIAL`: at the nodes `phi` less the tilt and its derivatives along
    both angles and mixed, then the tilt.

    `sums` returns `h` `[M, 3]` at unit scaled twists `[M, 3]`, and `dh/dV_S` `[M, 3, 3]`, or None to take mixed
    derivatives from central differences. With the unit vectors `n` of a direction, `e` and `t` of growing polar angle p
    and azimuth: `dphi/dp = h . e`, `dphi/da = sin p (h . t)`,
    `d2phi/dp da = sin p (t . dh/dn e) + cos p (h . t)`.
    """
    segment = 0.5 * np.pi / segments
    polar, azimuth = segment * np.arange(segments + 1)[:, None], segment * np.arange(4 * segments)[None, :]
    sin_p, cos_p, sin_a, cos_a = np.sin(polar), np.cos(polar), np.sin(azimuth), np.cos(azimuth)
    cos_p[-1] = 0.0  # the equator is a translation, not nearly one
    flat = np.zeros_like(polar * azimuth)
    direction = np.stack([sin_p * cos_a, sin_p * sin_a, cos_p + flat], -1)
    along = np.stack([cos_p * cos_a, cos_p * sin_a, flat - sin_p], -1)
    across = np.stack([flat - sin_a, flat + cos_a, flat], -1)
    h, slope = sums(direction.reshape(-1, 3))
    h = h.reshape(direction.shape)
    h_across = np.einsum("pai,pai->pa", h, across)
    ax, ay, _ = h[0, 0]
    lean, lean_slope = ax * cos_a + ay * sin_a, ay * cos_a - ax * sin_a
    tilt, tilt_slope = sin_p * cos_p**2, cos_p * (cos_p**2 - 2.0 * sin_p**2)
    nodes = np.zeros((segments + 1, 4 * segments + 1, 4))
    inner = nodes[:, :-1]
    inner[..., 0] = np.einsum("pai,pai->pa", h, direction) - tilt * lean
    inner[..., 1] = np.einsum("pai,pai->pa", h, along) - tilt_slope * lean
    inner[..., 2] = sin_p * h_across - tilt * lean_slope
    if slope is None:  # beyond the equator the surface is mirrored, and the tilt has the other sign
        beyond = np.roll(inner[-2, :, 2], -2 * segments) - 2.0 * tilt[-2] * lean_slope
        inner[1:, :, 3] = (np.concatenate([inner[2:, :, 2], beyond]) - inner[:-1, :, 2]) / (2.0 * segment)
    else:
        mixed = np.einsum("pai,paij,paj->pa", across, slope.reshape(*direction.shape, 3), along)
        inner[1:, :, 3] = (sin_p * mixed + cos_p * h_across - tilt_slope * lean_slope)[1:]  # 0 at the axis
    nodes[:, -1] = nodes[:, 0]
    return np.append(nodes, (ax, ay))


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
