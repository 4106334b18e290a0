"""Twists of wrenches and sums of cells for surfaces that Python evaluates, and their tables for compiled loops."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from planarfriction._engine.published import surfaces
from planarfriction.limit_surface.loops import cell_twists as loops
from planarfriction.limit_surface.loops.twists import StoredPotential

if TYPE_CHECKING:
    from planarfriction.limit_surface.base import LimitSurface


ROUNDING = 1e-15
"""Relative length of a step of the search for a twist that counts as none [-]."""


def cell_sums(
    rows: tuple[np.ndarray, np.ndarray, np.ndarray], units: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return `h` `[M, 3]` and `dh/dV_S` `[M, 3, 3]` of cells (`LimitSurface._cell_rows`) at unit scaled twists."""
    h = np.empty((len(units), 3))
    slopes = np.empty((len(units), 3, 3))
    loops.cell_sums(*rows, units, h, slopes)
    return h, slopes


def stored_potential(
    sums: Callable[[np.ndarray], tuple[np.ndarray, np.ndarray | None]], segments: int
) -> np.ndarray:
    """Return the numbers of `published.surfaces.POTENTIAL`: at the nodes `phi` less the tilt and its derivatives along
    both angles and mixed, then the tilt.

    `sums` returns `h` `[M, 3]` at unit scaled twists `[M, 3]`, and `dh/dV_S` `[M, 3, 3]`, or None to take mixed
    derivatives from central differences. With the unit vectors `n` of a direction, `e` and `t` of growing polar angle p
    and azimuth: `dphi/dp = h . e`, `dphi/da = sin p (h . t)`,
    `d2phi/dp da = sin p (t . dh/dn e) + cos p (h . t)`.
    """
    segment = 0.5 * np.pi / segments
    polar = segment * np.arange(segments + 1)[:, None]
    azimuth = segment * np.arange(4 * segments)[None, :]
    sin_p = np.sin(polar)
    cos_p = np.cos(polar)
    sin_a = np.sin(azimuth)
    cos_a = np.cos(azimuth)
    cos_p[-1] = 0.0  # the equator is a translation, not nearly one
    flat = np.zeros_like(polar * azimuth)
    direction = np.stack([sin_p * cos_a, sin_p * sin_a, cos_p + flat], -1)
    along = np.stack([cos_p * cos_a, cos_p * sin_a, flat - sin_p], -1)
    across = np.stack([flat - sin_a, flat + cos_a, flat], -1)
    h, slope = sums(direction.reshape(-1, 3))
    h = h.reshape(direction.shape)
    h_across = np.einsum("pai,pai->pa", h, across)
    ax, ay, _ = h[0, 0]
    lean = ax * cos_a + ay * sin_a
    lean_slope = ay * cos_a - ax * sin_a
    tilt = sin_p * cos_p**2
    tilt_slope = cos_p * (cos_p**2 - 2.0 * sin_p**2)
    nodes = np.zeros((segments + 1, 4 * segments + 1, 4))
    inner = nodes[:, :-1]
    inner[..., 0] = np.einsum("pai,pai->pa", h, direction) - tilt * lean
    inner[..., 1] = np.einsum("pai,pai->pa", h, along) - tilt_slope * lean
    inner[..., 2] = sin_p * h_across - tilt * lean_slope
    # Beyond the equator the surface is mirrored, and the tilt has the other sign.
    if slope is None:
        beyond = np.roll(inner[-2, :, 2], -2 * segments) - 2.0 * tilt[-2] * lean_slope
        inner[1:, :, 3] = (
            np.concatenate([inner[2:, :, 2], beyond]) - inner[:-1, :, 2]
        ) / (2.0 * segment)
    else:
        mixed = np.einsum(
            "pai,paij,paj->pa", across, slope.reshape(*direction.shape, 3), along
        )
        # 0 at the axis.
        inner[1:, :, 3] = (sin_p * mixed + cos_p * h_across - tilt_slope * lean_slope)[
            1:
        ]
    nodes[:, -1] = nodes[:, 0]
    return np.append(nodes, (ax, ay))


def table_of(surface: LimitSurface) -> StoredPotential:
    """Return the stored potential of a surface, and its directions over their dissipation."""
    _, size, data = surface.numbers
    angle = 0.5 * np.pi / size * np.arange(4 * size)
    polar = angle[: size + 1, None]
    azimuth = angle[None, :]
    units = np.stack(
        [
            np.sin(polar) * np.cos(azimuth),
            np.sin(polar) * np.sin(azimuth),
            np.cos(polar) + 0.0 * azimuth,
        ]
    )
    lean = surface._lean
    if lean is not None:  # else the lower half mirrors the upper
        units = np.concatenate([units, -units], axis=1)
    flat = np.ascontiguousarray(units.reshape(3, -1).T)
    h = np.empty_like(flat)
    surfaces.sliding_batch(surfaces.POTENTIAL, data, 0, size, flat, h)
    power = np.einsum("ni,ni->n", h if lean is None else h + lean, flat).reshape(
        units.shape[1:]
    )
    duals = np.divide(units, power, out=np.zeros_like(units), where=power > 0.0)
    return StoredPotential(data, size, duals, -1.0 if lean is None else 1.0)


def descend(surface: LimitSurface, wrenches: np.ndarray, twists: np.ndarray) -> float:
    """Improve twists `[M, 3]` of wrenches `[M, 3]`; return the largest angle left in scaled coordinates [rad].

    As `limit_surface.loops.twists`: `Phi` is stationary in the plane `target . V = 1`.
    """
    from scipy.optimize import root

    scaling = surface._scaling
    worst = 0.0
    back = scaling[9:18].reshape(3, 3)
    for wrench, twist in zip(wrenches, twists, strict=True):
        target = scaling[:9].reshape(3, 3) @ (wrench / np.abs(wrench).max())
        target /= np.linalg.norm(target)
        basis = across(target)
        guess = np.linalg.solve(back, twist)

        def slope(
            place: np.ndarray, plane: np.ndarray, target: np.ndarray
        ) -> np.ndarray:
            return plane @ surface._direction((target + place @ plane)[None])[0]

        def bend(
            place: np.ndarray, plane: np.ndarray, target: np.ndarray
        ) -> np.ndarray:
            return (
                plane
                @ surface._direction_slope((target + place @ plane)[None])[0]
                @ plane.T
            )

        # A search that runs away: the angle says so.
        with np.errstate(over="ignore", invalid="ignore"):
            start = basis @ guess / (target @ guess)
            options = {"xtol": ROUNDING}
            place = root(slope, start, (basis, target), jac=bend, options=options).x
            found = target + place @ basis
            h = surface._direction(found[None])[0]
            angle = float(np.arctan2(np.linalg.norm(basis @ h), h @ target))
            twist[:] = back @ found / (h @ found)
        worst = float(np.fmax(worst, angle)) if angle == angle else angle
    return worst


def across(normal: np.ndarray) -> np.ndarray:
    """Return two unit vectors `[..., 2, 3]` that span the plane across the unit vector `normal` `[..., 3]`."""
    first = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal), axis=-1)])
    first /= np.linalg.norm(first, axis=-1)[..., None]
    return np.stack([first, np.cross(normal, first)], axis=-2)
