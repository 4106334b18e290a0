"""The table of patches beside ours, moments with closed forms, and the spin of the gradient line that has no force."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from planarfriction import geometry
from planarfriction.limit_surface import (
    LimitSurfaceCells,
    LimitSurfaceEllipsoid,
    LimitSurfaceTablePublished,
)
from planarfriction.patch import PUBLISHED_PATCHES, ContactPatch
from planarfriction_studies.experiments import facts
from planarfriction_studies.experiments.experiment import (
    Comparison,
    Numbers,
    compare_all,
)
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
    published = facts.published_table("patches")
    rows = []
    for column, rest in LAST_DIGIT.items():
        found, expected = (
            np.array([each[name][column] for name in published])
            for each in (ours, published)
        )
        rows.append(
            (f"table of patches, {column.partition(' [')[0]}", found, expected, *rest)
        )
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
    disc = numbers["disc"]
    mask = numbers["patches"]["Circle"]
    rows = []
    cell = disc["cell"]
    ragged = "Its cells stand in whole rows: the rim is ragged, and each cell's load stands at its middle."
    lumped = "Each cell's load stands at its middle: a cell's own second moment, $c^2/6$ for the width $c$, is missing."
    grid = disc["contact radius on the grid"], disc["second moment on the grid"]
    for name, radius, (first, second), causes in (
        (
            "mask of 317 cells",
            disc["equal-area radius"],
            (mask[_RADIUS], mask[_MOMENT]),
            (ragged, ragged),
        ),
        ("disc cut by its rim", disc["radius"], grid, (LUMPED, lumped)),
    ):
        rows.append(
            (
                f"contact radius, {name}",
                first,
                2.0 * radius / 3.0,
                cell**2 / (12.0 * first),
                "m",
                causes[0],
            )
        )
        rows.append(
            (
                f"second moment, {name}",
                second,
                0.5 * radius**2,
                cell**2 / 6.0,
                "m^2",
                causes[1],
            )
        )
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
    radii = {
        "Square": WIDTH * (math.sqrt(2.0) + math.asinh(1.0)) / 6.0,
        "Line": 0.25 * WIDTH,
    }
    rows: list[_Row] = [
        (
            f"second moment, {IN_WORDS[name]}",
            patches[name][_MOMENT],
            value,
            1e-17,
            "m^2",
            exact,
        )
        for name, value in seconds.items()
    ]
    for name, value in radii.items():
        found = patches[name][_RADIUS]
        words = f"contact radius, {IN_WORDS[name]}, without cells"
        rows.append((words, found, value, cell**2 / (12.0 * found), "m", LUMPED))
    return rows


def _line_rows(numbers: Numbers) -> list[_Row]:
    """Return the largest distance of corresponding points: a whole line slides, the ellipsoid still sees a spin."""
    cell = WIDTH / CELLS
    rows = []
    cause = "Centre of rotation just beyond the last cell: the force is 1 and the torque 0, of what the search finds."
    for name in ("Line", "LineGrad"):
        row = numbers["patches"][name]
        # The nearer one, at the heavy end.
        end = 0.5 * (CELLS - 1) * cell - row["centre of pressure y [m]"]
        expected = math.sqrt(2.0 - 2.0 * end / math.hypot(end, row[_RADIUS]))
        words = f"ellipsoid, largest distance of corresponding points, {IN_WORDS[name]}"
        rows.append(
            (
                words,
                numbers["ellipsoid"][name]["points, max"],
                expected,
                1e-5,
                "1",
                cause,
            )
        )
    return rows


def linear_line(length: float, floor: float = 0.0) -> dict[str, float]:
    """Return the closed forms of a line whose pressure grows as `s + floor` [m] from its light end, s from 0 to
    `length` [m].

    Places are measured from the middle towards the heavy end [m]: the centre of pressure, and the centre of rotation
    that splits the load into equal halves, `s^2/2 + floor s = load/2`. `radius` and `torque` [m] are the torques of
    spins about the two for mu f_N = 1, `force` is the force of the first; the second has none.
    """
    load = 0.5 * length**2 + floor * length
    middle = (length**3 / 3.0 + 0.5 * floor * length**2) / load
    halves = math.sqrt(floor**2 + load) - floor

    def beyond(place: float) -> tuple[float, float]:
        """Return the share of the load nearer to the light end than `place`, and mean distance of the load from it."""
        below = (0.5 * place**2 + floor * place) / load
        lever = 2.0 * (place**3 / 6.0 + 0.5 * floor * place**2) / load + middle - place
        return below, lever

    (below, radius) = beyond(middle)
    (_, torque) = beyond(halves)
    return {
        "centre of pressure": middle - 0.5 * length,
        "equal halves": halves - 0.5 * length,
        "radius": radius,
        "torque": torque,
        "force": 1.0 - 2.0 * below,
    }


def spin_about(surface: Any, y: Any) -> np.ndarray:
    """Return wrenches `[..., 3]` [1, 1, m] at the centre of pressure of unit spins about points (0, y) [m]."""
    y = np.asarray(y)
    return geometry.wrench_at(
        surface.wrench(np.stack([y, 0.0 * y, 0.0 * y + 1.0], -1)),
        surface.centre_of_pressure,
    )


def gradient_numbers() -> Numbers:
    """Return the two spins of the line of 21 cells, of the ellipsoid, and of continuous lines; places along y [m]."""
    patch = PUBLISHED_PATCHES["LineGrad"]()
    cells = LimitSurfaceCells(patch)
    ellipsoid = LimitSurfaceEllipsoid(patch)
    middle = float(patch.centre_of_pressure()[1])
    # the twist that belongs to a torque without a force, found by the library
    vx, _, omega = cells.twist([0.0, 0.0, -1.0])
    halves = float(vx / omega)
    cell = WIDTH / CELLS
    on_cell = cell * np.rint(halves / cell)  # a spin exactly about it
    return {
        "cell": cell,
        "loads": patch.weights().tolist(),
        "places": patch.positions[:, 1].tolist(),
        "cells": {
            "centre of pressure": middle,
            "equal halves": halves,
            "middle cell": float(on_cell),
            "radius": float(patch.contact_radius()),
            "torque": float(patch.weights() @ np.abs(patch.positions[:, 1] - halves)),
            "force": float(spin_about(cells, middle)[0]),
            "force at equal halves": float(spin_about(cells, on_cell)[0]),
        },
        "ellipsoid": {
            "force at equal halves": float(spin_about(ellipsoid, halves)[0]),
            "torque at equal halves": float(-spin_about(ellipsoid, halves)[2]),
        },
        "continuous": linear_line(WIDTH),
        "continuous, as the cells": linear_line(WIDTH, 0.5 * cell),
    }


def half_load_cell(cells: int) -> int:
    """Return the number of the cell, 1 to `cells` from the light end, that holds the middle of weights 1, 2, ...,
    `cells`.

    The smallest k with `k (k + 1) >= cells (cells + 1)/2`.
    """
    return math.ceil(0.5 * (math.sqrt(1.0 + 2.0 * cells * (cells + 1)) - 1.0))


def gradient_comparisons(numbers: Numbers) -> list[Comparison]:
    """Compare the spins of the gradient line with their closed forms."""
    ours = numbers["cells"]
    smooth = numbers["continuous, as the cells"]
    cell = numbers["cell"]
    total = CELLS * (CELLS + 1) // 2
    k = half_load_cell(CELLS)
    beyond = total - k * (k + 1) // 2  # weights between that cell and the heavy end
    # The centre of pressure lies at (2 N + 1)/3.
    above = sum(range(math.ceil((2 * CELLS + 1) / 3), CELLS + 1))
    lumped = cell**2 / (12.0 * ours["radius"])
    rounding = "Weights on both sides of {}: rounding."
    rows: list[tuple[str, float, float, float, str, str]] = [
        (
            "centre of the spin without force", ours["equal halves"], (k - 0.5 * (CELLS + 1)) * cell, 1e-9, "m",
            "The search for the twist of a torque ends next to the cell that holds the middle of the load.",
        ),
        (
            "force of the spin about that cell", ours["force at equal halves"], (2 * beyond + k - total) / total, 1e-12,
            "N", rounding.format("a cell that adds nothing"),
        ),
        (
            "force of the spin about the centre of pressure", ours["force"], (2 * above - total) / total, 1e-12, "N",
            rounding.format("the centre of pressure"),
        ),
        (
            "centre of the spin without force, line, linear pressure, beside a continuous one",
            ours["equal halves"], smooth["equal halves"], 0.5 * cell, "m",
            "A sum over cells can change the sign of its force at a cell only: up to half a cell.",
        ),
        (
            "centre of pressure, line, linear pressure, beside a continuous one",
            ours["centre of pressure"], smooth["centre of pressure"], cell / (6.0 * (CELLS + 1)) + 1e-12, "m",
            "Each cell's load stands at its middle, that of a continuous line a little nearer to the heavy end.",
        ),
        (
            "contact radius, line, linear pressure, beside a continuous one",
            ours["radius"], smooth["radius"], lumped, "m", LUMPED,
        ),
        (
            "torque of the spin without force, line, linear pressure",
            ours["torque"], smooth["torque"], lumped, "m", LUMPED,
        ),
    ]  # fmt: skip
    return compare_all("closed form", rows)
