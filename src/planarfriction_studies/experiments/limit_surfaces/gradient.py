"""The line with linear pressure: a spin without tangential force that is not the spin about the centre of pressure."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from planarfriction import geometry
from planarfriction.limit_surface import LimitSurfaceCells, LimitSurfaceEllipsoid
from planarfriction.patch import PUBLISHED_PATCHES
from planarfriction_studies.experiments.experiment import Comparison, Numbers, compare_all
from planarfriction_studies.experiments.limit_surfaces.patches import LUMPED
from planarfriction_studies.experiments.runs import CELLS, WIDTH


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

    (below, radius), (_, torque) = beyond(middle), beyond(halves)
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
    return geometry.wrench_at(surface.wrench(np.stack([y, 0.0 * y, 0.0 * y + 1.0], -1)), surface.centre_of_pressure)


def gradient_numbers() -> Numbers:
    """Return the two spins of the line of 21 cells, of the ellipsoid, and of continuous lines; places along y [m]."""
    patch = PUBLISHED_PATCHES["LineGrad"]()
    cells, ellipsoid = LimitSurfaceCells(patch), LimitSurfaceEllipsoid(patch)
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
    ours, smooth, cell = numbers["cells"], numbers["continuous, as the cells"], numbers["cell"]
    total = CELLS * (CELLS + 1) // 2
    k = half_load_cell(CELLS)
    beyond = total - k * (k + 1) // 2  # weights between that cell and the heavy end
    above = sum(range(math.ceil((2 * CELLS + 1) / 3), CELLS + 1))  # the centre of pressure lies at (2 N + 1)/3
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
