"""Comparison of two limit surfaces: their wrenches of the same twist, and their twists of the same wrench."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from planarfriction._support import validation
from planarfriction._support.described import described

MOST_SAMPLES = 10_000
"""Directions at which surfaces are compared, in seconds: beyond them the figures hardly change any more."""

if TYPE_CHECKING:
    from planarfriction.limit_surface.base import LimitSurface


@dataclass(frozen=True)
class Spread:
    """Statistics of an error over the samples."""

    largest: float
    mean: float
    rms: float

    @classmethod
    def of(cls, values: np.ndarray) -> Spread:
        """Return the statistics of values `[M]`."""
        size = np.abs(values)
        return cls(
            float(size.max()), float(size.mean()), float(np.sqrt(np.mean(size**2)))
        )


@described
@dataclass(frozen=True)
class SurfaceComparison:
    """Differences of a limit surface from a reference, in the reference's scaled coordinates; `print` shows a table."""

    force: Spread
    """Difference between the forces of the same twists, per unit `mu f_N` [-]."""
    torque: Spread
    """Difference between their torques about the reference's centre of pressure, divided by its contact radius [-]."""
    radius: Spread
    """Distance of the surface from the origin along a wrench, over that of the reference, less one [-]."""
    angle: Spread
    """Angle between the twists `(vx, vy, r omega)` of the same wrench [deg]."""
    samples: int
    """Number of twists, and of wrenches."""

    def __str__(self) -> str:
        units = {
            "force": "-",
            "torque": "torque / r [-]",
            "radius": "-",
            "angle": "deg",
        }
        rows = [f"{'difference':<16}{'largest':>10}{'mean':>10}{'rms':>10}"]
        for name, unit in units.items():
            words = unit if "[" in unit else f"{name} [{unit}]"
            spread = getattr(self, name)
            rows.append(
                f"{words:<16}"
                + "".join(f"{value:>10.4g}" for value in dataclasses.astuple(spread))
            )
        return "\n".join(rows)


def directions(count: int) -> np.ndarray:
    """Return `count` unit vectors spread evenly over the sphere, always the same, `[count, 3]`.

    Points of a golden spiral: heights at equal steps, each turned from the last by the golden angle.
    """
    height = 1.0 - (2.0 * np.arange(count) + 1.0) / count
    azimuth = np.pi * (3.0 - np.sqrt(5.0)) * np.arange(count)
    across = np.sqrt(1.0 - height**2)
    return np.stack(
        [across * np.cos(azimuth), across * np.sin(azimuth), height], axis=1
    )


def compare(
    surface: LimitSurface, reference: LimitSurface, samples: int
) -> SurfaceComparison:
    """Implement `LimitSurface.compare`."""
    units = directions(validation.count("samples", samples, 2, MOST_SAMPLES))
    frame = reference._frame()  # V_S = frame V, and so W = frame' W_S
    twists = np.linalg.solve(frame, units.T).T
    wrenches = units @ frame
    apart = np.linalg.solve(
        frame.T, (surface.wrench(twists) - reference.wrench(twists)).T
    ).T
    found = surface.twist(wrenches)
    wanted = reference.twist(wrenches)  # of dissipation 1: -W . V = 1/radius
    further = (
        np.einsum("mi,mi->m", wanted, wrenches) / np.einsum("mi,mi->m", found, wrenches)
        - 1.0
    )
    return SurfaceComparison(
        force=Spread.of(np.hypot(apart[:, 0], apart[:, 1])),
        torque=Spread.of(apart[:, 2]),
        radius=Spread.of(further),
        angle=Spread.of(angles(found @ frame.T, wanted @ frame.T)),
        samples=len(units),
    )


def angles(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Return the angles between vectors `[..., 3]` [deg]."""
    across = np.linalg.norm(np.cross(first, second), axis=-1)
    return np.degrees(np.arctan2(across, np.einsum("...i,...i", first, second)))
