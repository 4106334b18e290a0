"""The table of patches beside ours, the size of the disc mask, and moments with closed forms."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from planarfriction.limit_surface import LimitSurfaceTablePublished
from planarfriction.patch import ContactPatch
from planarfriction_studies.experiments import facts
from planarfriction_studies.experiments.experiment import Comparison, Numbers, compare_all
from planarfriction_studies.experiments.runs import CELLS, IN_WORDS, WIDTH

_LENGTH = (6e-12, "m", "Printed to $10^{-11}$ m: rounding.")
_PLACE = (6e-10, "m", "Printed to $10^{-9}$ m: rounding.")

LAST_DIGIT = {
    "loaded cells": (0.0, "1", "A count."),
    "centre of pressure x [m]": _PLACE,
    "centre of pressure y [m]": _PLACE,
    "contact radius, plain sum [m]": _LENGTH,
    "contact radius, as published [m]": _LENGTH,
    "second moment [m^2]": (6e-12, "m^2", "Printed to $10^{-11}$ m²: rounding."),
}
"""Column of the table of patches -> half a unit of its last digit and a little, unit, cause."""


def patch_numbers(patches: Mapping[str, ContactPatch]) -> dict[str, Numbers]:
    """Return the columns of the published table of patches, as ours."""
    result = {}
    for name, patch in patches.items():
        x, y = patch.centre_of_pressure()
        values = (
            int((patch.weights() > 0.0).sum()),
            float(x),
            float(y),
            float(patch.contact_radius()),
            LimitSurfaceTablePublished(patch).contact_radius,
            float(patch.second_moment()),
        )
        result[name] = dict(zip(LAST_DIGIT, values, strict=True))
    return result


def patch_comparisons(ours: Mapping[str, Numbers]) -> list[Comparison]:
    """Compare each column of the table of patches over all its rows."""
    published, rows = facts.published_table("patches"), []
    for column, rest in LAST_DIGIT.items():
        found, expected = (np.array([each[name][column] for name in published]) for each in (ours, published))
        rows.append((f"table of patches, {column.partition(' [')[0]}", found, expected, *rest))
    return compare_all("published", rows)


def disc_numbers(mask: ContactPatch) -> Numbers:
    """Return the size of the published disc mask [m], and the moments of a true disc on the same grid."""
    disc = ContactPatch.disc(0.5 * WIDTH, CELLS)
    grid = mask.grid
    assert grid is not None, "the mask is cut from a grid"
    radius = math.sqrt(float(mask.area()) / math.pi)
    return {
        "cell": grid.cell_width,
        "equal-area radius": radius,
        "equal-area radius in cells": radius / grid.cell_width,
        "half width in cells": 0.5 * grid.columns,
        "radius": 0.5 * WIDTH,
        "contact radius on the grid": float(disc.contact_radius()),
        "second moment on the grid": float(disc.second_moment()),
    }


def shape_comparisons(numbers: Numbers) -> list[Comparison]:
    """Compare moments of discs, square and lines with closed forms; the ellipsoid's largest error on the lines too."""
    rows = [*_disc_rows(numbers), *_grid_rows(numbers["patches"]), *_line_rows(numbers)]
    return compare_all("closed form", rows)


_Row = tuple[str, float, float, float, str, str]

LUMPED = (
    r"Each cell's load stands at its middle: at the distance $d$ the mean distance lacks about $c^2/(24\,d)$, for "
    "cells of width $c$."
)


def _disc_rows(numbers: Numbers) -> list[_Row]:
    """Return `r = 2 R/3` and `<rho^2> = R^2/2`: of the mask with the radius of equal area, of a disc cut by its rim."""
    disc, mask, rows = numbers["disc"], numbers["patches"]["Circle"], []
    cell = disc["cell"]
    ragged = "Its cells stand in whole rows: the rim is ragged, and each cell's load stands at its middle."
    lumped = "Each cell's load stands at its middle: a cell's own second moment, $c^2/6$ for the width $c$, is missing."
    grid = disc["contact radius on the grid"], disc["second moment on the grid"]
    for name, radius, (first, second), causes in (
        ("mask of 317 cells", disc["equal-area radius"], (mask[_RADIUS], mask[_MOMENT]), (ragged, ragged)),
        ("disc cut by its rim", disc["radius"], grid, (LUMPED, lumped)),
    ):
        rows.append((f"contact radius, {name}", first, 2.0 * radius / 3.0, cell**2 / (12.0 * first), "m", causes[0]))
        rows.append((f"second moment, {name}", second, 0.5 * radius**2, cell**2 / 6.0, "m^2", causes[1]))
    return rows


_RADIUS, _MOMENT = "contact radius, plain sum [m]", "second moment [m^2]"


def _grid_rows(patches: Mapping[str, Numbers]) -> list[_Row]:
    """Return second moments of regular grids, exactly; contact radii of square and rod, whose cells lack a little."""
    cell = WIDTH / CELLS
    exact = "Sums of squares of whole numbers: rounding."
    seconds = {
        "Square": (CELLS**2 - 1) * cell**2 / 6.0,
        "Line": (CELLS**2 - 1) * cell**2 / 12.0,
        "LineGrad": (CELLS - 1) * (CELLS + 2) * cell**2 / 18.0,
    }
    radii = {"Square": WIDTH * (math.sqrt(2.0) + math.asinh(1.0)) / 6.0, "Line": 0.25 * WIDTH}
    rows: list[_Row] = [
        (f"second moment, {IN_WORDS[name]}", patches[name][_MOMENT], value, 1e-17, "m^2", exact)
        for name, value in seconds.items()
    ]
    for name, value in radii.items():
        found, words = patches[name][_RADIUS], f"contact radius, {IN_WORDS[name]}, without cells"
        rows.append((words, found, value, cell**2 / (12.0 * found), "m", LUMPED))
    return rows


def _line_rows(numbers: Numbers) -> list[_Row]:
    """Return the largest distance of corresponding points: a whole line slides, the ellipsoid still sees a spin."""
    cell, rows = WIDTH / CELLS, []
    cause = "Centre of rotation just beyond the last cell: the force is 1 and the torque 0, of what the search finds."
    for name in ("Line", "LineGrad"):
        row = numbers["patches"][name]
        end = 0.5 * (CELLS - 1) * cell - row["centre of pressure y [m]"]  # the nearer one, at the heavy end
        expected = math.sqrt(2.0 - 2.0 * end / math.hypot(end, row[_RADIUS]))
        words = f"ellipsoid, largest distance of corresponding points, {IN_WORDS[name]}"
        rows.append((words, numbers["ellipsoid"][name]["points, max"], expected, 1e-5, "1", cause))
    return rows
