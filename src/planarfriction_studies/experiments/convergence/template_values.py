"""Values that the template of the convergence experiment names, and the effect of the size of the disc's mask."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from planarfriction.patch import ContactPatch
from planarfriction_studies.experiments.convergence import runs
from planarfriction_studies.experiments.convergence.runs import Case, Errors
from planarfriction_studies.experiments.experiment import Comparison

RADIUS = 0.01
"""Radius of the disc [m]."""

Slopes = Mapping[str, Mapping[str, Mapping[str, float]]]
"""Family -> case -> slope of log error over log count, of force and torque."""


def key(case: Case) -> str:
    """Return the name of a case in the names of the published curves."""
    return "/".join(case)


def radius_errors(counts: Sequence[int]) -> tuple[np.ndarray, np.ndarray]:
    """Return the relative errors of the contact radius: of the mask from the base's mask, of the cut disc from 2
    R/3."""
    base = float(runs.patch("Circle", runs.BASE_CELLS).contact_radius())
    mask = [float(runs.patch("Circle", count).contact_radius()) / base - 1.0 for count in counts]
    cut = [float(ContactPatch.disc(RADIUS, count).contact_radius()) * 1.5 / RADIUS - 1.0 for count in counts]
    return np.array(mask), np.array(cut)


def base_radius_error() -> float:
    """Return the relative error of the contact radius of the base's mask, from the disc that it stands for."""
    return float(runs.patch("Circle", runs.BASE_CELLS).contact_radius()) * 1.5 / RADIUS - 1.0


def template_values(
    counts: Sequence[int], errors: Mapping[Case, Errors], slopes: Slopes, comparisons: Sequence[Comparison]
) -> dict[str, Any]:
    """Return the values that the template names."""
    measured = [c for c in comparisons if c.unit == "of the published error" and not c.quantity.startswith("explicit")]
    euler = [c.difference for c in comparisons if c.quantity.startswith("explicit")]
    thinned = any("means over" in c.cause for c in measured)
    every = ("Square", "p0") in errors
    return {
        "counts": counts,
        "samples": sum(c.samples for c in measured),
        "met": max(c.difference for c in measured),
        "coarse": (runs.COARSE_INTERVAL, runs.PUBLISHED_INTERVAL) if thinned else None,
        "euler": max(euler, default=None),
        "base_cells": runs.BASE_CELLS,
        "base_segments": runs.BASE_SEGMENTS,
        "line": slopes["cells_distributed"]["LineGrad/p0"],
        "on_cell": _on_cell(counts, errors),
        "disc": _disc(counts, errors, slopes) if every else None,
        "square": _square(errors, slopes) if every else None,
    }


def _on_cell(counts: Sequence[int], errors: Mapping[Case, Errors]) -> dict[str, Any] | None:
    """Return the grids of the line whose centre of pressure is the middle of a cell, and their errors over the
    trend."""
    force, all_counts = errors["LineGrad", "p0"]["cells_distributed"][:, 0], np.array(counts)
    through = np.array([_centre_on_cell(count) for count in counts])
    if through.sum() < 2 or (~through).sum() < 2:
        return None
    smooth = np.polyfit(np.log(all_counts)[~through], np.log(force)[~through], 1)
    excess = force[through] / np.exp(np.polyval(smooth, np.log(all_counts)[through]))
    return {"counts": all_counts[through].tolist(), "excess": float(np.median(excess))}


def _centre_on_cell(count: int) -> bool:
    """Return True if the centre of pressure of the line with linear pressure is the middle of one of its cells."""
    line = runs.patch("LineGrad", count)
    distance = np.abs(line.positions[:, 1] - line.centre_of_pressure()[1])
    return bool(distance.min() < 1e-6 * RADIUS)


def _disc(counts: Sequence[int], errors: Mapping[Case, Errors], slopes: Slopes) -> dict[str, Any]:
    mask, cut = radius_errors(counts)
    torque = errors["Circle", "p0"]["cells_distributed"][:, 1]
    return {
        "orders": {shape: slopes["cells_distributed"][f"{shape}/p0"]["tau"] for shape in runs.SHAPES},
        "over_radius": float(np.median(torque / np.abs(mask))),
        "correlation": float(np.corrcoef(np.log(np.abs(mask)), np.log(torque))[0, 1]),
        "base": -base_radius_error(),
        "cut": float(np.abs(cut).max()),
        "cut_finest": abs(float(cut[-1])),
        "mask_finest": abs(float(mask[-1])),
    }


def _square(errors: Mapping[Case, Errors], slopes: Slopes) -> dict[str, float]:
    square = errors["Square", "p0"]
    orders = [slopes["segments"][key(case)]["ft"] for case in errors if case[1] == "p0"]
    return {
        "finest": float(square["cells_reduced"][-1, 0]),
        "best": float(square["cells_reduced"][:, 0].min()),
        "distributed": float(square["cells_distributed"][-1, 0]),
        "steepest": min(orders),
        "flattest": max(orders),
    }
