"""Limit surfaces of the published patches, the ellipsoid beside them, and stored tables beside the exact surfaces."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from planarfriction import geometry
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
from planarfriction_studies.experiments import facts
from planarfriction_studies.experiments.experiment import (
    WRENCH,
    Numbers,
    Result,
    Table,
    Work,
    entry,
    table,
)
from planarfriction_studies.experiments.limit_surfaces import figures
from planarfriction_studies.experiments.limit_surfaces import patches as shapes
from planarfriction_studies.experiments.runs import IN_WORDS, SIX_SHAPES
from planarfriction_studies.experiments.wording import report, span

DIRECTIONS = (200, 400)
"""Polar angles and azimuths at which the errors are measured; a table's 20 segments fall between them."""

REFINEMENTS, REFINED = 30, 0.5
"""Number of further searches near a largest distance, and the share of its width that each covers."""

STORED = {
    "published": LimitSurfaceTablePublished,
    "smooth": LimitSurfaceTable,
    "sum over cells": LimitSurfaceCells,
}
"""Surfaces that are compared with the exact surface."""

COARSER = 2
"""The tables are measured at so many times fewer angles, and never at a node: an exact surface costs more."""


def run(work: Work) -> Result:
    """Carry out the experiment."""
    patches = {name: make() for name, make in PUBLISHED_PATCHES.items()}
    surfaces = {name: LimitSurfaceCells(patches[name]) for name in SIX_SHAPES}
    count = (DIRECTIONS[0] // 4, DIRECTIONS[1] // 4) if work.quick else DIRECTIONS
    computes = {
        name: lambda each=each: {
            "ellipsoid": ellipsoid_errors(each, count),
            **table_errors(each.patch, count),
        }
        for name, each in surfaces.items()
    }
    errors = work.pieces(computes, lambda name: f"{name}, {count[0]} polar angles")
    numbers = {
        "patches": shapes.patch_numbers(patches),
        "disc": shapes.disc_numbers(patches["Circle"]),
        "ellipsoid": {name: each["ellipsoid"] for name, each in errors.items()},
        "tables": {
            name: {key: each[key] for key in STORED} for name, each in errors.items()
        },
        "gradient": shapes.gradient_numbers(),
    }
    return report(
        "limit_surfaces",
        {
            "surfaces": figures.overview(surfaces, coarse=work.quick),
            "correspondence": figures.correspondence(surfaces),
            "gradient_line": figures.gradient_line(
                surfaces["LineGrad"], numbers["gradient"]
            ),
        },
        numbers,
        _template_values(numbers),
        comparisons=[
            *shapes.patch_comparisons(numbers["patches"]),
            *shapes.shape_comparisons(numbers),
            *shapes.gradient_comparisons(numbers["gradient"]),
        ],
        tables=(
            _patches(numbers["patches"]),
            _ellipsoid(numbers["ellipsoid"]),
            _stored(numbers["tables"]),
        ),
        data={"surfaces": _dataset(surfaces)},
    )


def _mesh(count: tuple[int, int]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return polar angles and azimuths of the middles of equal boxes on the sphere, and their shares of its area."""
    polar = np.pi * (np.arange(count[0])[:, None] + 0.5) / count[0]
    azimuth = 2.0 * np.pi * (np.arange(count[1])[None, :] + 0.5) / count[1]
    share = np.broadcast_to(np.sin(polar), count) / (np.sin(polar).sum() * count[1])
    return polar, azimuth, share


def ellipsoid_errors(surface: LimitSurface, count: tuple[int, int]) -> dict[str, float]:
    """Compute the distances of the ellipsoid from the sum over the cells: as a surface, and for the same twists.

    In the coordinates (fx, fy, tau/r) the ellipsoid is the unit sphere, and the distance of a point to it is
    `||h| - 1|`; the distance of corresponding points is `|h - V_S/|V_S||`. Both for mu f_N = 1, means over all
    directions of the twist.
    """
    sides = surface, LimitSurfaceEllipsoid(surface.patch)

    def of_surfaces(*direction: np.ndarray) -> np.ndarray:
        return np.abs(
            np.linalg.norm(scaled_samples(surface, *direction)[1], axis=-1) - 1.0
        )

    def of_points(*direction: np.ndarray) -> np.ndarray:
        return np.linalg.norm(
            np.subtract(*(scaled_samples(side, *direction)[1] for side in sides)),
            axis=-1,
        )

    polar, azimuth, share = _mesh(count)
    exact, beside = (scaled_samples(side, polar, azimuth)[1] for side in sides)
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
        result[f"{name}, max"] = _largest(
            distance, polar[row, 0], azimuth[0, column], np.pi / count[0]
        )
        result[f"{name}, mean"] = (share * values).sum()
    return {name: float(value) for name, value in result.items()}


def _largest(
    distance: Callable[..., np.ndarray], polar: float, azimuth: float, width: float
) -> float:
    """Return the largest distance near a direction: where the centre of rotation meets a cell it is a jump."""
    largest = float(distance(np.array([[polar]]), np.array([[azimuth]]))[0, 0])
    for _ in range(REFINEMENTS):
        offsets = width * np.linspace(-1.0, 1.0, 9)
        values = distance(polar + offsets[:, None], azimuth + offsets[None, :])
        row, column = np.unravel_index(values.argmax(), values.shape)
        if values[row, column] > largest:
            largest = float(values[row, column])
            polar = polar + offsets[row]
            azimuth = azimuth + offsets[column]
        width *= REFINED
    return largest


def table_errors(
    patch: ContactPatch, count: tuple[int, int]
) -> dict[str, dict[str, float]]:
    """Return the error of the tables of 20 segments and of the sum over the cells, from the exact surface of a patch.

    In the wrench at the centre of pressure for mu f_N = 1 N, over directions of the twist.
    """
    polar, azimuth, share = _mesh(
        (max(count[0] // COARSER, 1), max(count[1] // COARSER, 1))
    )
    surface = LimitSurfaceExact(patch)
    twists, exact = sample_limit_surface(surface, polar, azimuth)
    result: dict[str, dict[str, float]] = {}
    for name, kind in STORED.items():
        miss = geometry.wrench_at(
            kind(patch).wrench(twists) - exact, surface.centre_of_pressure
        )
        force = np.hypot(miss[..., 0], miss[..., 1])
        torque = np.abs(miss[..., 2])
        result[name] = {
            f"{quantity}, {statistic} [{unit}]": float(value)
            for quantity, unit, values in (
                ("force", "N", force),
                ("torque", "N m", torque),
            )
            for statistic, value in (
                ("max", values.max()),
                ("mean", (share * values).sum()),
            )
        }
    return result


def _dataset(surfaces: dict[str, LimitSurfaceCells]) -> Any:
    """Return limit surfaces for mu f_N = 1 N about the centres of pressure, over the direction of the scaled twist."""
    import xarray as xr

    polar = np.linspace(0.0, np.pi, 61)
    azimuth = np.linspace(0.0, 2.0 * np.pi, 121)
    points = np.array([
        scaled_samples(each, polar[:, None], azimuth[None, :])[1] * [1.0, 1.0, each.contact_radius]
        for each in surfaces.values()
    ])  # fmt: skip
    columns: dict[str, Any] = {
        name: (("shape", "polar", "azimuth"), points[..., i], {"units": unit})
        for i, (name, unit) in enumerate(WRENCH.items())
    }
    angles = {
        name: (name, values, {"units": "rad"})
        for name, values in (("polar", polar), ("azimuth", azimuth))
    }
    return xr.Dataset(columns, {"shape": list(surfaces), **angles})


def _template_values(numbers: Numbers) -> dict[str, Any]:
    """Return the values that the template names."""
    errors, stored, disc = (numbers[name] for name in ("ellipsoid", "tables", "disc"))
    ratio = {
        name: each["points, mean"] / each["surfaces, mean"]
        for name, each in errors.items()
    }
    least, most = (choose(ratio, key=ratio.__getitem__) for choose in (min, max))
    worst = max(errors, key=lambda name: errors[name]["points, max"])
    mask = numbers["patches"]["Circle"]
    radius = disc["radius"]

    def over(kind: str, quantity: str) -> str:
        """Return errors of a kind over those of the smooth table, from the best shape to the worst."""
        return span(
            [
                each[kind][quantity] / each["smooth"][quantity]
                for each in stored.values()
            ],
            ".0f",
        )

    return {
        "least": {"shape": IN_WORDS[least], "ratio": ratio[least]},
        "most": {"shape": IN_WORDS[most], "ratio": ratio[most]},
        "worst": {"shape": IN_WORDS[worst], **errors[worst]},
        "mask": mask,
        "lost": {
            "radius": 1.0 - 1.5 * mask["contact radius, plain sum [m]"] / radius,
            "second": 1.0 - 2.0 * mask["second moment [m^2]"] / radius**2,
            "cut": 1.0 - 1.5 * disc["contact radius on the grid"] / radius,
        },
        "over": over,
        "largest": {
            kind: max(each[kind]["force, max [N]"] for each in stored.values())
            for kind in STORED
        },
    }


def _patches(ours: dict[str, Numbers]) -> Table:
    """Return the table of our patches, with the largest difference from the published row in its last column."""
    published = facts.published_table("patches")
    headings = ("loaded cells", "CoP x [mm]", "CoP y [mm]", "r, plain sum [mm]", "r, as published [mm]",
                "second moment [mm^2]")  # fmt: skip
    factors = {"1": 1, "m": 1e3, "m^2": 1e6}
    columns: dict[str, Any] = {
        heading: lambda row, column=column, factor=factors[unit]: (
            round(factor * row[column], 9) + 0.0
        )
        for heading, (column, (_, unit, _)) in zip(
            headings, shapes.LAST_DIGIT.items(), strict=True
        )
    }
    lengths = [column for column in shapes.LAST_DIGIT if column.endswith("[m]")]
    miss = {
        name: max(abs(row[column] - published[name][column]) for column in lengths)
        for name, row in ours.items()
    }
    rows = {IN_WORDS[name]: row | {"miss": miss[name]} for name, row in ours.items()}
    columns["farthest from the paper [mm]"] = lambda row: 1e3 * row["miss"]
    note = "As published: $r$ averages spins about the corners of the cell that holds the centre of pressure."
    return table("Patches: 21 x 21 cells, 20 mm wide", rows, columns, "patch", note)


def _ellipsoid(errors: dict[str, Numbers]) -> Table:
    names = (
        "surfaces, mean",
        "surfaces, max",
        "points, mean",
        "points, max",
        "angle, max [deg]",
        "force, max [N]",
    )
    columns = {name: entry(name) for name in names} | {
        "torque, max [N mm]": entry("torque, max [N m]", scale=1e3)
    }
    note = "In $(f_x, f_y, \\tau/r)$ for $\\mu f_N = 1$. Surfaces: nearest points. Points: those of the same twist."
    rows = {IN_WORDS[name]: each for name, each in errors.items()}
    return table(
        "Distance of the ellipsoid from the sum over the cells",
        rows,
        columns,
        "patch",
        note,
    )


def _stored(errors: dict[str, Numbers]) -> Table:
    rows = {
        f"{IN_WORDS[name]}, {kind}": error
        for name, each in errors.items()
        for kind, error in each.items()
    }
    columns = {
        f"{quantity}, {statistic} [{shown}]": entry(
            f"{quantity}, {statistic} [{unit}]", scale=scale
        )
        for quantity, shown, unit, scale in (
            ("force", "N", "N", 1.0),
            ("torque", "N mm", "N m", 1e3),
        )
        for statistic in ("max", "mean")
    }
    title = "Error of tables of 20 segments, and of the sum, from the exact surface, mu f_N = 1 N"
    return table(title, rows, columns, "patch, surface")
