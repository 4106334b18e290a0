"""Every kind of limit surface beside the exact one, over the same random twists, and the staircase of a sum."""

from __future__ import annotations

import importlib.util
from typing import Any

import numpy as np

from planarfriction import geometry
from planarfriction.limit_surface import (
    LimitSurface,
    LimitSurfaceCells,
    LimitSurfaceEllipsoid,
    LimitSurfaceExact,
    LimitSurfaceQuartic,
    LimitSurfaceTable,
    LimitSurfaceTablePublished,
)
from planarfriction.patch import PUBLISHED_PATCHES, ContactPatch
from planarfriction_studies.experiments.experiment import (
    Arrays,
    Comparison,
    compare_all,
)
from planarfriction_studies.experiments.runs import IN_WORDS, WIDTH

TWISTS = 2000
"""Random twists, their directions even over the sphere of (vx, vy, r omega) about the centre of pressure."""

KINDS: dict[str, type[LimitSurface]] = {
    "published table": LimitSurfaceTablePublished,
    "table": LimitSurfaceTable,
    "sum over cells": LimitSurfaceCells,
    "quartic": LimitSurfaceQuartic,
    "ellipsoid": LimitSurfaceEllipsoid,
}
"""Approximations of the exact surface, by their names in the report."""

QUARTIC_SHAPES = ("Circle", "NonConvex1")
"""Shapes with a quartic: a fit takes seconds."""

CHECKED, PARTS = ("Circle", "Square", "NonConvex1", "NonConvex2"), 5
"""Grids whose sum over cells is checked to come closer with smaller cells, and parts of a side they are cut into."""

STAIRS = 1501
"""Centres of rotation in the figure of the staircase."""


def has_quartic() -> bool:
    """Return True if the package that fits quartics is installed."""
    return importlib.util.find_spec("cvxpy") is not None


def random_twists(surface: LimitSurface, count: int) -> np.ndarray:
    """Return twists `[count, 3]` about the origin, always the same directions."""
    directions = np.random.default_rng(5).normal(size=(count, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    x, y = surface.centre_of_pressure
    omega = directions[:, 2] / surface.contact_radius
    return np.stack(
        [directions[:, 0] + omega * y, directions[:, 1] - omega * x, omega], axis=1
    )


def difference(
    surface: LimitSurface, exact: LimitSurface, twists: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return force [N] and torque [N m] at the exact centre of pressure between two surfaces, mu f_N = 1 N."""
    miss = geometry.wrench_at(
        surface.wrench(twists) - exact.wrench(twists), exact.centre_of_pressure
    )
    return np.hypot(miss[:, 0], miss[:, 1]), np.abs(miss[:, 2])


def surface_errors(shape: str, count: int) -> dict[str, Any]:
    """Return by kind the force errors `[count]` [N] and torque errors `[count]` [N m] of a published patch."""
    patch = PUBLISHED_PATCHES[shape]()
    exact = LimitSurfaceExact(patch)
    twists = random_twists(exact, count)
    result: dict[str, Any] = {}
    for name, kind in KINDS.items():
        if name != "quartic" or (has_quartic() and shape in QUARTIC_SHAPES):
            result[f"{name}/force"], result[f"{name}/torque"] = difference(
                kind(patch), exact, twists
            )
    if shape in CHECKED:
        finer = LimitSurfaceCells(patch.refined(PARTS))
        result["finer sum/force"], result["finer sum/torque"] = difference(
            finer, exact, twists
        )
    return result


def staircase(cells: int = 21) -> dict[str, Any]:
    """Return the torque [N m] and force [N] of unit spins of disc and line over their centre of rotation, mu f_N = 1 N.

    The centre of rotation moves along the x axis of the disc, and along the line; torque about the centre of pressure.
    """
    place = np.linspace(0.0, 0.5 * WIDTH, STAIRS)
    zero = np.zeros_like(place)
    one = np.ones_like(place)
    result = {"place": place}
    for shape, columns in (
        ("Circle", [zero, -place, one]),
        ("Line", [place, zero, one]),
    ):
        twists = np.stack(columns, axis=1)
        patch = PUBLISHED_PATCHES[shape](cells)
        for name, surface in (
            ("sum", LimitSurfaceCells(patch)),
            ("exact", LimitSurfaceExact(patch)),
        ):
            result[f"{shape}/{name}"] = -surface.wrench(twists)[:, 2]
            result[f"{shape}/{name}, force"] = np.hypot(
                *surface.wrench(twists)[:, :2].T
            )
    return result


def jumps(stairs: Arrays) -> dict[str, float]:
    """Return the largest change of force [N] between neighbouring centres of rotation, by shape and surface."""
    return {
        name.removesuffix(", force"): float(np.abs(np.diff(values)).max())
        for name, values in stairs.items()
        if name.endswith(", force")
    }


def comparisons(errors: dict[str, Arrays], stairs: Arrays) -> list[Comparison]:
    """Compare the exact surface with closed forms, sums over ever finer cells, and the errors of the table."""
    rows = compare_all("closed form", _closed_forms(stairs))
    finer = f"sum over cells cut in {PARTS} along each side, mean distance to the exact surface"
    cause = "A sum converges at least in proportion to the size of its cells; the tolerance is 1.6 times that."
    for shape, each in errors.items():
        if "finer sum/force" in each:
            fine = each["finer sum/force"]
            cells = each["sum over cells/force"]
            words = f"{IN_WORDS[shape]}: {finer}"
            within = 1.6 / PARTS * float(cells.mean())
            rows.append(
                Comparison(
                    words,
                    "converged",
                    float(fine.mean()),
                    within,
                    "N",
                    len(fine),
                    cause,
                )
            )
    return rows


def _closed_forms(stairs: Arrays) -> list[tuple[str, Any, Any, float, str, str]]:
    place = stairs["place"]
    half = 0.5 * WIDTH
    rounding = "A closed form beside another one: rounding."
    square = LimitSurfaceExact(ContactPatch.rectangle(WIDTH)).contact_radius
    disc = LimitSurfaceExact(ContactPatch.disc(half)).contact_radius
    # a line of half length a, spun about the point s on it: torque (a^2 - s^2)/(2 a) about its middle, force s/a
    torque = (half**2 - place**2) / (2.0 * half)
    words = "exact, line: {} over the centre of rotation"
    line = "Line/exact"
    exact = WIDTH * (np.sqrt(2.0) + np.arcsinh(1.0)) / 6.0, 2.0 * half / 3.0
    return [
        ("exact, contact radius of a square", square, exact[0], 1e-15, "m", rounding),
        ("exact, contact radius of a disc", disc, exact[1], 1e-14, "m", rounding),
        (words.format("torque"), stairs[line], torque, 1e-14, "N m", rounding),
        (
            words.format("force"),
            stairs[f"{line}, force"],
            place / half,
            1e-12,
            "N",
            rounding,
        ),
    ]
