"""Convergence of both models in the number of cells, and of the reduced one in the segments of its table."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from planarfriction.patch import ContactPatch
from planarfriction.plots.style import PlotFigure
from planarfriction_studies.experiments import facts
from planarfriction_studies.experiments.convergence import figures, runs
from planarfriction_studies.experiments.convergence.figures import QUANTITIES
from planarfriction_studies.experiments.convergence.runs import Case, Errors
from planarfriction_studies.experiments.experiment import (
    Comparison,
    Result,
    Table,
    Work,
    compare,
    compare_curve,
    dataset,
    table,
)
from planarfriction_studies.experiments.runs import IN_WORDS
from planarfriction_studies.experiments.wording import fill

if TYPE_CHECKING:
    import xarray as xr

RADIUS = 0.01
"""Radius of the disc [m]."""

Slopes = Mapping[str, Mapping[str, Mapping[str, float]]]
"""Family -> case -> slope of log error over log count, of force and torque."""

TOLERANCE = {runs.PUBLISHED_INTERVAL: 1e-3, runs.COARSE_INTERVAL: 1e-2}
"""Time between samples [s] -> allowed relative difference of an error from the published one.

The published errors contain those of explicit Euler steps of 1e-5 s, and our samples may be fewer.
"""

EULER_TOLERANCE = 1e-6
"""The same for the published method itself: rounding, and sums over cells in another order."""

_WORDS: dict[str, str] = {
    "cells_distributed": "distributed, cells",
    "cells_distributed_again": "distributed, cells, second figure",
    "cells_reduced": "reduced, cells",
    "segments": "reduced, segments",
}
_QUANTITY_WORDS = {"ft": "force", "tau": "torque"}


def run(work: Work) -> Result:
    """Carry out the experiment."""
    cases = [case for case in runs.CASES if case[0] == "LineGrad" or not work.quick]
    counts = (5, 15, 25, 35) if work.quick else runs.COUNTS
    errors = runs.solve(cases, counts, work)
    euler = runs.solve_by_euler(cases, counts, work) if work.full else {}
    mask, cut = radius_errors(counts)
    slopes = {family: {key(case): _slopes(counts, errors[case][family]) for case in cases} for family in runs.FAMILIES}
    comparisons = [*_profile_comparisons(), *_comparisons(counts, errors, work), *_euler_comparisons(counts, euler)]
    return fill("convergence", **_template_values(counts, errors, slopes, comparisons)).result(
        _figures(counts, errors, mask, cut),
        comparisons=[*comparisons, _cut_radius_comparison(counts)],
        numbers={
            "counts": list(counts),
            "slopes": slopes,
            "errors": {
                family: {
                    key(case): dict(zip(QUANTITIES, errors[case][family].T.tolist(), strict=True)) for case in cases
                }
                for family in runs.FAMILIES
            },
            "disc_radius_errors": {"mask": mask.tolist(), "cut": cut.tolist()},
            "base_disc_radius_error": base_radius_error(),
        },
        tables=[_slope_table(slopes, counts)],
        data={"errors": _dataset(counts, errors)},
    )


def _slopes(counts: Sequence[int], errors: np.ndarray) -> dict[str, float]:
    """Return the slope of log error over log count, for force and torque: minus the order of convergence."""
    fits = [np.polyfit(np.log(counts), np.log(errors[:, i]), 1)[0] for i in range(2)]
    return dict(zip(QUANTITIES, map(float, fits), strict=True))


# ---------------------------------------------------------------------- comparisons


def _cut_radius_comparison(counts: Sequence[int]) -> Comparison:
    finest = ContactPatch.disc(RADIUS, counts[-1])
    words = f"contact radius of the disc with cells cut by the rim, {counts[-1]} x {counts[-1]}"
    cause = "Each cell's pressure acts at its centroid: an error of second order in the size of the cells."
    ours, within = float(finest.contact_radius()), 0.5 * RADIUS / counts[-1] ** 2
    return compare(words, ours, 2.0 * RADIUS / 3.0, "closed form", within, "m", cause)


def _profile_comparisons() -> list[Comparison]:
    velocity = runs.profile()
    cause = "None: straight lines between the same kinks, the velocity is not held over 0.01 s."
    rows = []
    for i, name in enumerate(("vx", "vy", "omega")):
        curve = f"convergence/velocity/{name}"
        times = facts.published_curve(curve).time
        rows.append(compare_curve(f"velocity profile, {name}", times, velocity(times)[:, i], curve, 0.0, cause))
    return rows


def _comparisons(counts: Sequence[int], errors: Mapping[Case, Errors], work: Work) -> list[Comparison]:
    found = []
    for name in _WORDS:
        family = "cells_distributed" if name == "cells_distributed_again" else name
        for case in errors:
            every = runs.interval(case, family, work)
            cause = "Explicit Euler steps of $10^{-5}$ s in the figure"
            if every > runs.PUBLISHED_INTERVAL:
                cause += f", and means over samples every {every:g} s here, {runs.PUBLISHED_INTERVAL:g} s there"
            found += _against_figure(name, counts, case, errors[case][family], TOLERANCE[every], f"{cause}.")
    return found


def _euler_comparisons(counts: Sequence[int], errors: Mapping[Case, Errors]) -> list[Comparison]:
    cause = "None: the same explicit Euler steps of $10^{-5}$ s and the same samples; rounding and reading the figure."
    found = []
    for case, each in errors.items():
        for family in runs.FAMILIES:
            found += _against_figure(family, counts, case, each[family], EULER_TOLERANCE, cause, "explicit Euler, ")
    return found


def _against_figure(
    name: str, counts: Sequence[int], case: Case, errors: np.ndarray, tolerance: float, cause: str, method: str = ""
) -> list[Comparison]:
    """Compare the force and torque of one case with the figure, relative to the published error at each count."""
    found = []
    for i, quantity in enumerate(QUANTITIES):
        curve = facts.published_curve(f"convergence/{name}/{key(case)}/{quantity}")
        published = curve.values[np.searchsorted(curve.time, counts)]
        words = f"{method}{_WORDS[name]}: {_QUANTITY_WORDS[quantity]} error, {_words(case)}"
        within, unit = tolerance + curve.reading / float(published.min()), "of the published error"
        found.append(compare(words, errors[:, i] / published, 1.0, "published", within, unit, cause))
    return found


def _words(case: Case) -> str:
    return f"{IN_WORDS[case[0]]}, p = {case[1][1:]}"


# ---------------------------------------------------------------------- figures, tables


def _figures(
    counts: Sequence[int], errors: Mapping[Case, Errors], mask: np.ndarray, cut: np.ndarray
) -> dict[str, PlotFigure]:
    result = {
        "convergence_cells_distributed": figures.errors_over_counts(
            "cells_distributed", counts, errors, with_profile=True
        ),
        "convergence_cells_reduced": figures.errors_over_counts("cells_reduced", counts, errors),
        "convergence_segments": figures.errors_over_counts("segments", counts, errors),
    }
    if ("Circle", "p0") in errors:
        torque = errors["Circle", "p0"]["cells_distributed"][:, 1]
        result["convergence_disc_radius"] = figures.radius_errors(counts, mask, cut, torque)
    return result


def _slope_table(slopes: Mapping[str, Mapping[str, Mapping[str, float]]], counts: Sequence[int]) -> Table:
    cases = {_words(case): key(case) for case in runs.CASES if key(case) in slopes[runs.FAMILIES[0]]}
    columns = {
        f"{_WORDS[family]}, {_QUANTITY_WORDS[q]}": lambda case, family=family, q=q: round(slopes[family][case][q], 2)
        for family in slopes
        for q in QUANTITIES
    }
    note = f"Straight lines through log error over log count, {counts[0]} to {counts[-1]}."
    return table("Slope of the error", cases, columns, "", note)


def _dataset(counts: Sequence[int], errors: Mapping[Case, Errors]) -> xr.Dataset:
    """Return the relative errors over shape, parameters and count, one variable for each family and quantity."""
    columns = {
        case: {
            f"{family}_{quantity}": each[family][:, i]
            for family in runs.FAMILIES
            for i, quantity in enumerate(QUANTITIES)
        }
        for case, each in errors.items()
    }
    units = dict.fromkeys(next(iter(columns.values())), "1")
    return dataset(columns, units, ("shape", "parameters"), ("count", np.array(counts), "1"))


# ---------------------------------------------------------------------- words


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


def _template_values(
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
