"""Limit surfaces of the published patches, the ellipsoid beside them, and stored tables beside the exact surfaces."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from planarfriction import geometry
from planarfriction.experiments.experiment import Result, Work
from planarfriction.experiments.limit_surfaces import figures
from planarfriction.experiments.limit_surfaces.gradient import gradient_comparisons, gradient_numbers
from planarfriction.experiments.limit_surfaces.patches import (
    disc_numbers,
    patch_comparisons,
    patch_numbers,
    shape_comparisons,
)
from planarfriction.experiments.limit_surfaces.tables import tables, told
from planarfriction.experiments.runs import SIX_SHAPES
from planarfriction.experiments.wording import fill
from planarfriction.limit_surface import (
    LimitSurface,
    LimitSurfaceCells,
    LimitSurfaceEllipsoid,
    LimitSurfaceExact,
    LimitSurfaceTable,
    LimitSurfaceTablePublished,
)
from planarfriction.patch import PUBLISHED_PATCHES, ContactPatch
from planarfriction.plots.limit_surface import sample_limit_surface, scaled_samples

if TYPE_CHECKING:
    import xarray as xr

DIRECTIONS = (200, 400)
"""Polar angles and azimuths at which the errors are measured; a table's 20 segments fall between them."""

REFINEMENTS, REFINED = 30, 0.5
"""How often the neighbourhood of a largest distance is searched again, each time over this share of its width."""

STORED = {"published": LimitSurfaceTablePublished, "smooth": LimitSurfaceTable, "sum over cells": LimitSurfaceCells}
"""What is measured beside the exact surface."""

COARSER = 2
"""The tables are measured at so many times fewer angles, and never at a node: an exact surface costs more."""


def run(work: Work) -> Result:
    """Carry out the experiment."""
    patches = {name: make() for name, make in PUBLISHED_PATCHES.items()}
    surfaces = {name: LimitSurfaceCells(patches[name]) for name in SIX_SHAPES}
    count = (DIRECTIONS[0] // 4, DIRECTIONS[1] // 4) if work.quick else DIRECTIONS
    found = work.pieces({f"{name}, {count[0]} polar angles": _measured(surfaces[name], count) for name in surfaces})
    errors = {name: _by_name(arrays) for name, arrays in zip(surfaces, found.values(), strict=True)}
    gradient = gradient_numbers()
    numbers = {
        "patches": patch_numbers(patches),
        "disc": disc_numbers(patches["Circle"]),
        "ellipsoid": {name: each["ellipsoid"] for name, each in errors.items()},
        "tables": {name: {key: each[key] for key in STORED} for name, each in errors.items()},
        "gradient": gradient,
    }
    return fill("limit_surfaces", **told(numbers)).result(
        {
            "surfaces": figures.overview(surfaces, coarse=work.quick),
            "correspondence": figures.correspondence(surfaces),
            "gradient_line": figures.gradient_line(surfaces["LineGrad"], gradient),
        },
        comparisons=[
            *patch_comparisons(numbers["patches"]),
            *shape_comparisons(numbers),
            *gradient_comparisons(gradient),
        ],
        numbers=numbers,
        tables=tables(numbers),
        data={"surfaces": _dataset(surfaces)},
    )


def _measured(surface: LimitSurfaceCells, count: tuple[int, int]) -> Callable[[], dict[str, float]]:
    return lambda: ellipsoid_errors(surface, count) | table_errors(surface.patch, count)


def _by_name(arrays: dict[str, np.ndarray]) -> dict[str, dict[str, float]]:
    """`{"a/b": value}` as `{"a": {"b": value}}`."""
    result: dict[str, dict[str, float]] = {}
    for key, value in arrays.items():
        group, _, name = key.partition("/")
        result.setdefault(group, {})[name] = float(value)
    return result


def _mesh(count: tuple[int, int]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Polar angles and azimuths of the middles of equal boxes on the direction sphere, and their shares of its area."""
    polar = np.pi * (np.arange(count[0])[:, None] + 0.5) / count[0]
    azimuth = 2.0 * np.pi * (np.arange(count[1])[None, :] + 0.5) / count[1]
    share = np.broadcast_to(np.sin(polar), count) / (np.sin(polar).sum() * count[1])
    return polar, azimuth, share


def ellipsoid_errors(surface: LimitSurface, count: tuple[int, int]) -> dict[str, float]:
    """How far the ellipsoid is from the sum over the cells: as a surface, and point by point of the same twist.

    In the coordinates (fx, fy, tau/r) the ellipsoid is the unit sphere, and the distance of a point to it is
    `||h| - 1|`; the distance of corresponding points is `|h - V_S/|V_S||`. Both for mu f_N = 1, means over all
    directions of the twist.
    """
    ellipsoid = LimitSurfaceEllipsoid(surface.patch)

    def between(polar: np.ndarray, azimuth: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return scaled_samples(surface, polar, azimuth)[1], scaled_samples(ellipsoid, polar, azimuth)[1]

    def of_surfaces(polar: np.ndarray, azimuth: np.ndarray) -> np.ndarray:
        return np.abs(np.linalg.norm(between(polar, azimuth)[0], axis=-1) - 1.0)

    def of_points(polar: np.ndarray, azimuth: np.ndarray) -> np.ndarray:
        exact, beside = between(polar, azimuth)
        return np.linalg.norm(exact - beside, axis=-1)

    polar, azimuth, share = _mesh(count)
    exact, beside = between(polar, azimuth)
    apart = exact - beside
    cosine = (exact * beside).sum(-1) / np.linalg.norm(exact, axis=-1)
    result = {
        "angle, max [deg]": np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))).max(),
        "force, max [N]": np.hypot(apart[..., 0], apart[..., 1]).max(),
        "torque, max [N m]": surface.contact_radius * np.abs(apart[..., 2]).max(),
    }
    for name, distance in (("surfaces", of_surfaces), ("points", of_points)):
        values = distance(polar, azimuth)
        row, column = np.unravel_index(values.argmax(), values.shape)
        result[f"{name}, max"] = _largest(distance, polar[row, 0], azimuth[0, column], np.pi / count[0])
        result[f"{name}, mean"] = (share * values).sum()
    return {f"ellipsoid/{name}": float(value) for name, value in result.items()}


def _largest(distance: Callable[..., np.ndarray], polar: float, azimuth: float, width: float) -> float:
    """Largest distance in the neighbourhood of a direction: where the centre of rotation meets a cell it is a jump."""
    largest = float(distance(np.array([[polar]]), np.array([[azimuth]]))[0, 0])
    for _ in range(REFINEMENTS):
        offsets = width * np.linspace(-1.0, 1.0, 9)
        values = distance(polar + offsets[:, None], azimuth + offsets[None, :])
        row, column = np.unravel_index(values.argmax(), values.shape)
        if values[row, column] > largest:
            largest, polar, azimuth = float(values[row, column]), polar + offsets[row], azimuth + offsets[column]
        width *= REFINED
    return largest


def table_errors(patch: ContactPatch, count: tuple[int, int]) -> dict[str, float]:
    """Error of the tables of 20 segments, and of the sum over the cells, from the exact surface of the patch.

    In the wrench at the centre of pressure for mu f_N = 1 N, over directions of the twist.
    """
    polar, azimuth, share = _mesh((max(count[0] // COARSER, 1), max(count[1] // COARSER, 1)))
    surface = LimitSurfaceExact(patch)
    twists, exact = sample_limit_surface(surface, polar, azimuth)
    result = {}
    for name, kind in STORED.items():
        miss = geometry.wrench_at(kind(patch).wrench(twists) - exact, surface.centre_of_pressure)
        force, torque = np.hypot(miss[..., 0], miss[..., 1]), np.abs(miss[..., 2])
        for quantity, unit, values in (("force", "N", force), ("torque", "N m", torque)):
            result[f"{name}/{quantity}, max [{unit}]"] = float(values.max())
            result[f"{name}/{quantity}, mean [{unit}]"] = float((share * values).sum())
    return result


def _dataset(surfaces: dict[str, LimitSurfaceCells]) -> xr.Dataset:
    """Limit surfaces for mu f_N = 1 N about the centres of pressure, over the direction of the scaled twist."""
    import xarray as xr

    polar, azimuth = np.linspace(0.0, np.pi, 61), np.linspace(0.0, 2.0 * np.pi, 121)
    columns: dict[str, Any] = {}
    for name, surface in surfaces.items():
        points = scaled_samples(surface, polar[:, None], azimuth[None, :])[1]
        units = (("fx", "N", 1.0), ("fy", "N", 1.0), ("tau", "N m", surface.contact_radius))
        for column, (component, unit, factor) in enumerate(units):
            values = factor * points[..., column]
            columns[f"{component}_{name}"] = (("polar", "azimuth"), values, {"units": unit})
    angles = {name: (name, values, {"units": "rad"}) for name, values in (("polar", polar), ("azimuth", azimuth))}
    return xr.Dataset(columns, angles)
