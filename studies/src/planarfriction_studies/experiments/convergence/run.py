"""Convergence of both models in the number of cells, and of the reduced one in the segments of its table."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from planarfriction.patch import ContactPatch
from planarfriction.plots.style import LINE_STYLES, PlotFigure
from planarfriction_studies.experiments import experiment, facts, looks
from planarfriction_studies.experiments.convergence import runs
from planarfriction_studies.experiments.convergence.runs import Case, Errors, Family
from planarfriction_studies.experiments.experiment import (
    TWIST,
    Comparison,
    Result,
    Work,
)
from planarfriction_studies.experiments.runs import IN_WORDS
from planarfriction_studies.experiments.wording import report

RADIUS = 0.01
"""Radius of the disc [m]."""

TOLERANCE = {runs.PUBLISHED_INTERVAL: 1e-3, runs.COARSE_INTERVAL: 1e-2}
"""Time between samples [s] -> allowed relative difference of an error from the published one.

The published errors contain those of explicit Euler steps of 1e-5 s, and our samples may be fewer.
"""

EULER_TOLERANCE = 1e-6
"""The same for the published method itself: rounding, and sums over cells in another order."""

QUANTITIES = {"ft": "force", "tau": "torque"}
"""Name of a quantity in the names of the published curves -> words."""

_WORDS: dict[Family, str] = {
    "cells_distributed": "distributed, cells",
    "cells_distributed_again": "distributed, cells, second figure",
    "cells_reduced": "reduced, cells",
    "segments": "reduced, segments",
}


def run(work: Work) -> Result:
    """Carry out the experiment."""
    cases = [case for case in runs.CASES if case[0] == "LineGrad" or not work.quick]
    counts = (5, 15, 25, 35) if work.quick else runs.COUNTS
    errors = runs.solve(cases, counts, work)
    euler = runs.solve_by_euler(cases, counts, work) if work.full else {}
    radii = radius_errors(counts)
    slopes = {
        family: {key(case): _slopes(counts, errors[case][family]) for case in cases}
        for family in runs.FAMILIES
    }
    measured = _comparisons(counts, errors, work)
    stepped = _euler_comparisons(counts, euler)
    listed = {
        family: {
            key(case): dict(
                zip(QUANTITIES, errors[case][family].T.tolist(), strict=True)
            )
            for case in cases
        }
        for family in runs.FAMILIES
    }
    numbers = {
        "counts": list(counts),
        "slopes": slopes,
        "errors": listed,
        "disc_radius_errors": {name: each.tolist() for name, each in radii.items()},
        "base_disc_radius_error": float(
            runs.patch("Circle", runs.BASE_CELLS).contact_radius()
        )
        * 1.5
        / RADIUS
        - 1.0,
    }
    cause = "None: straight lines between the same kinks, the velocity is not held over 0.01 s."
    profile = experiment.compare_profile(
        runs.profile(), "convergence/velocity", TWIST, cause, dt=1e-4, allowance=0.0
    )
    figures = {
        f"convergence_{family}": _errors_over_counts(family, counts, errors)
        for family in runs.FAMILIES
    }
    if not work.quick:
        torque = errors["Circle", "p0"]["cells_distributed"][:, 1]
        figures["convergence_disc_radius"] = _radius_errors(counts, radii, torque)
    return report(
        "convergence",
        figures,
        numbers,
        {
            "samples": sum(each.samples for each in measured),
            "met": max(each.difference for each in measured),
            "coarse": (runs.COARSE_INTERVAL, runs.PUBLISHED_INTERVAL)
            if any("means over" in each.cause for each in measured)
            else None,
            "euler": max((each.difference for each in stepped), default=None),
            "base_cells": runs.BASE_CELLS,
            "base_segments": runs.BASE_SEGMENTS,
            "on_cell": _on_cell(counts, errors),
        }
        | _of_every_shape(errors, radii),
        comparisons=[*profile, *measured, *stepped, _cut_radius_comparison(counts)],
        tables=[_slope_table(slopes, counts)],
        data={"errors": _dataset(counts, errors)},
    )


def key(case: Case) -> str:
    """Return the name of a case in the names of the published curves."""
    return "/".join(case)


def _words(case: Case) -> str:
    return f"{IN_WORDS[case[0]]}, p = {case[1][1:]}"


def _slopes(counts: Sequence[int], errors: np.ndarray) -> dict[str, float]:
    """Return the slope of log error over log count, for force and torque: minus the order of convergence."""
    fits = [np.polyfit(np.log(counts), np.log(errors[:, i]), 1)[0] for i in range(2)]
    return dict(zip(QUANTITIES, map(float, fits), strict=True))


def radius_errors(counts: Sequence[int]) -> dict[str, np.ndarray]:
    """Return relative errors of a disc's contact radius: of its `mask` from the base's, of a `cut` disc from 2 R/3."""
    masks = np.array(
        [
            float(runs.patch("Circle", count).contact_radius())
            for count in (*counts, runs.BASE_CELLS)
        ]
    )
    cut = np.array(
        [float(ContactPatch.disc(RADIUS, count).contact_radius()) for count in counts]
    )
    return {"mask": masks[:-1] / masks[-1] - 1.0, "cut": cut * 1.5 / RADIUS - 1.0}


def _cut_radius_comparison(counts: Sequence[int]) -> Comparison:
    finest = ContactPatch.disc(RADIUS, counts[-1])
    words = f"contact radius of the disc with cells cut by the rim, {counts[-1]} x {counts[-1]}"
    cause = "Each cell's pressure acts at its centroid: an error of second order in the size of the cells."
    ours = float(finest.contact_radius())
    within = 0.5 * RADIUS / counts[-1] ** 2
    return experiment.compare(
        words, ours, 2.0 * RADIUS / 3.0, "closed form", within, "m", cause
    )


def _comparisons(
    counts: Sequence[int], errors: Mapping[Case, Errors], work: Work
) -> list[Comparison]:
    found = []
    for name in _WORDS:
        family = name.removesuffix("_again")
        for case in errors:
            every = runs.interval(case, family, work)
            cause = "Explicit Euler steps of $10^{-5}$ s in the figure"
            if every > runs.PUBLISHED_INTERVAL:
                cause += f", and means over samples every {every:g} s here, {runs.PUBLISHED_INTERVAL:g} s there"
            found += _against_figure(
                name, counts, case, errors[case][family], TOLERANCE[every], f"{cause}."
            )
    return found


def _euler_comparisons(
    counts: Sequence[int], errors: Mapping[Case, Errors]
) -> list[Comparison]:
    cause = "None: the same explicit Euler steps of $10^{-5}$ s and the same samples; rounding and reading the figure."
    found = []
    for case, each in errors.items():
        for family in runs.FAMILIES:
            found += _against_figure(
                family,
                counts,
                case,
                each[family],
                EULER_TOLERANCE,
                cause,
                "explicit Euler, ",
            )
    return found


def _against_figure(
    name: str,
    counts: Sequence[int],
    case: Case,
    errors: np.ndarray,
    tolerance: float,
    cause: str,
    method: str = "",
) -> list[Comparison]:
    """Compare the force and torque of one case with the figure, relative to the published error at each count."""
    rows = []
    for i, (quantity, words) in enumerate(QUANTITIES.items()):
        curve = facts.published_curve(f"convergence/{name}/{key(case)}/{quantity}")
        published = curve.values[np.searchsorted(curve.time, counts)]
        words = f"{method}{_WORDS[name]}: {words} error, {_words(case)}"
        within = tolerance + curve.reading / float(published.min())
        unit = "of the published error"
        rows.append((words, errors[:, i] / published, 1.0, within, unit, cause))
    return experiment.compare_all("published", rows)


def _on_cell(
    counts: Sequence[int], errors: Mapping[Case, Errors]
) -> dict[str, Any] | None:
    """Return grids of the line with the centre of pressure in the middle of a cell, and their errors over the trend."""
    force = errors["LineGrad", "p0"]["cells_distributed"][:, 0]
    all_counts = np.array(counts)
    through = []
    for count in counts:
        line = runs.patch("LineGrad", count)
        distance = np.abs(line.positions[:, 1] - line.centre_of_pressure()[1])
        through.append(distance.min() < 1e-6 * RADIUS)
    on = np.array(through)
    if on.sum() < 2 or (~on).sum() < 2:
        return None
    smooth = np.polyfit(np.log(all_counts)[~on], np.log(force)[~on], 1)
    excess = force[on] / np.exp(np.polyval(smooth, np.log(all_counts)[on]))
    return {"counts": all_counts[on].tolist(), "excess": float(np.median(excess))}


def _of_every_shape(
    errors: Mapping[Case, Errors], radii: Mapping[str, np.ndarray]
) -> dict[str, Any]:
    """Return what is said of disc and square; None without them."""
    if ("Square", "p0") not in errors:
        return {"disc": None, "square": None}
    torque = errors["Circle", "p0"]["cells_distributed"][:, 1]
    square = errors["Square", "p0"]
    mask = np.abs(radii["mask"])
    cut = np.abs(radii["cut"])
    return {
        "disc": {
            "over_radius": float(np.median(torque / mask)),
            "correlation": float(np.corrcoef(np.log(mask), np.log(torque))[0, 1]),
            "cut": float(cut.max()),
            "cut_finest": float(cut[-1]),
            "mask_finest": float(mask[-1]),
        },
        "square": {
            "finest": float(square["cells_reduced"][-1, 0]),
            "best": float(square["cells_reduced"][:, 0].min()),
            "distributed": float(square["cells_distributed"][-1, 0]),
        },
    }


def _slope_table(
    slopes: Mapping[str, Mapping[str, Mapping[str, float]]], counts: Sequence[int]
) -> experiment.Table:
    cases = {
        _words(case): key(case)
        for case in runs.CASES
        if key(case) in slopes[runs.FAMILIES[0]]
    }
    columns = {
        f"{_WORDS[family]}, {words}": lambda case, family=family, name=name: round(
            slopes[family][case][name], 2
        )
        for family in slopes
        for name, words in QUANTITIES.items()
    }
    note = "Straight lines through log error over log count."
    return experiment.table("Slope of the error", cases, columns, "", note)


def _dataset(counts: Sequence[int], errors: Mapping[Case, Errors]) -> Any:
    """Return the relative errors over shape, parameters and count, one variable for each family and quantity."""
    columns = {
        case: {
            f"{family}_{name}": each[family][:, i]
            for family in runs.FAMILIES
            for i, name in enumerate(QUANTITIES)
        }
        for case, each in errors.items()
    }
    units = dict.fromkeys(next(iter(columns.values())), "1")
    return experiment.dataset(
        columns, units, ("shape", "parameters"), ("count", np.array(counts), "1")
    )


_CELLS, _SEGMENTS = "cells along the width", "table segments of a quadrant"


def _errors_over_counts(
    family: Family, counts: Sequence[int], errors: Mapping[Case, Errors]
) -> PlotFigure:
    """Draw relative errors of force and torque of one family, all shapes and parameters; the first with the profile."""
    with_profile = family == runs.FAMILIES[0]
    figure, panels = looks.panels(
        10.0 if with_profile else 9.6, 4.2, 1, 3 if with_profile else 2
    )
    for i, (quantity, words) in enumerate(QUANTITIES.items()):
        axes = panels[i]
        for (shape, parameters), found in errors.items():
            look = {
                "color": looks.OTHERS[runs.SHAPES.index(shape)],
                "linestyle": LINE_STYLES[list(runs.LAWS).index(parameters)],
                "label": f"{IN_WORDS[shape]}, $p$ = {parameters[1:]}",
            }
            axes.semilogy(counts, found[family][:, i], linewidth=1.3, **look)
            curve = f"convergence/{family}/{shape}/{parameters}/{quantity}"
            looks.vertices(
                axes,
                curve,
                1.0,
                "black",
                marker=".",
                ms=2.5,
                mfc="black",
                label="published",
            )
        axes.set(
            xlabel=_SEGMENTS if family == "segments" else _CELLS,
            ylabel=f"{words} error / largest {words} [-]",
        )
    if with_profile:
        _draw_profile(panels[2])
    # Each label once.
    handles = dict(zip(*reversed(panels[0].get_legend_handles_labels()), strict=True))
    published = handles.pop("published")
    figure.legend([*handles.values(), published], [*handles, "published"], loc="outside lower center", ncols=4,
                  frameon=False, fontsize="small")  # fmt: skip
    return figure


def _radius_errors(
    counts: Sequence[int], radii: Mapping[str, np.ndarray], torque: np.ndarray
) -> PlotFigure:
    """Draw the error of the contact radius of the disc, as a mask and cut by its rim, beside that of the torque."""
    figure, axes = looks.panels(6.4, 3.6)
    lines = (
        (np.abs(radii["mask"]), "o-", "contact radius, mask"),
        (torque, "s--", "torque over the run, mask"),
        (np.abs(radii["cut"]), "^-", "contact radius, cells cut by the rim"),
    )
    for (values, look, label), colour in zip(lines, looks.OTHERS, strict=False):
        axes.semilogy(counts, values, look, color=colour, markersize=4, label=label)
    axes.set(xlabel=_CELLS, ylabel="relative error [-]")
    axes.legend(
        loc="center left", bbox_to_anchor=(1.0, 0.5), frameon=False, fontsize="small"
    )
    return figure


def _draw_profile(axes: Any) -> None:
    velocity = runs.profile()
    rows = (
        ("vx", "$v_x$ [cm/s]", 1e2),
        ("vy", "$v_y$ [cm/s]", 1e2),
        ("omega", "$\\omega$ [rad/s]", 1.0),
    )
    for i, (name, label, factor) in enumerate(rows):
        axes.plot(
            velocity.times,
            factor * velocity.values[:, i],
            color=looks.OTHERS[i],
            label=label,
        )
        looks.vertices(
            axes,
            f"convergence/velocity/{name}",
            factor,
            "black",
            marker=".",
            mfc="black",
        )
    axes.set(
        xlabel="time [s]", ylabel="velocity of the centre of pressure", ylim=(-0.1, 2.1)
    )
    axes.legend(loc="upper right", frameon=False, fontsize="small")
