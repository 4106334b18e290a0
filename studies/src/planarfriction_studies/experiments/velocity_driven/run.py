"""Six patches moved with a given velocity: the distributed model, the reduced one, and that on the ellipsoid."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from planarfriction.patch import PUBLISHED_PATCHES
from planarfriction.plots.style import (
    LINE_STYLES,
    MEASURED,
    PAGE,
    PlotFigure,
    new_figure,
    paper,
    tidy,
)
from planarfriction.scenes.ready import driven, published_velocity
from planarfriction_studies.experiments import experiment, facts, looks, runs
from planarfriction_studies.experiments.experiment import (
    TWIST,
    WRENCH,
    Arrays,
    Comparison,
    Result,
    Work,
    entry,
)
from planarfriction_studies.experiments.velocity_driven import boxes
from planarfriction_studies.experiments.wording import report

QUICK_SHAPES = ("Circle", "NonConvex1")
"""Shapes whose curves are published."""

RTOL, ATOL = 1e-8, 3e-8
"""Tolerances that leave errors below `boxes.OWN`, so that what is seen are those of the references."""

SPIN_UP = 0.055
"""End of the time in which the figures' solver misses the torque of reduced models by more than it does later [s]."""

PURE_SLIDE = (4.005, 4.3)
"""Times of pure sliding along y at constant speed [s]."""

PUBLISHED = {
    ("Circle", "d"): ("", ", alone", ", beside the ellipsoid"),
    ("Circle", "r"): ("",),
    ("Circle", "e"): ("",),
    ("NonConvex1", "d"): ("",),
    ("NonConvex1", "r"): ("",),
}
"""Shape and model -> endings of the names of its published curves: some are drawn in several figures."""

CONVERGED = ("Circle", "Square", "Line", "NonConvex1")
"""Shapes with converged solutions, distributed and reduced."""

MODELS = {"corrected": "table", "ellipsoid": "ellipsoid"}
"""Name in the box plots -> words."""


def drive(shape: str) -> Arrays:
    """Simulate a patch: time [s], and the wrench `[T, 3]` [N, N, N m] about the centre of pressure with each model."""
    patch = PUBLISHED_PATCHES[shape]()
    result = {}
    for kind in ("d", "r", "e"):
        columns = runs.simulated(
            driven(runs.published_model(kind, patch)), rtol=RTOL, atol=ATOL
        )
        result |= {
            "time": columns["time"],
            kind: runs.at_centre_of_pressure(columns, patch),
        }
    return result


def run(work: Work) -> Result:
    """Carry out the experiment."""
    shapes = QUICK_SHAPES if work.quick else runs.SIX_SHAPES
    computes = {shape: partial(drive, shape) for shape in shapes}
    found = work.pieces(computes, lambda shape: f"driven, {runs.IN_WORDS[shape]}")
    errors = {shape: boxes.errors(wrenches) for shape, wrenches in found.items()}
    numbers = _numbers(found, errors)
    return report(
        "velocity_driven",
        _figures(found, errors),
        numbers,
        _template_values(numbers),
        comparisons=[
            *_curve_comparisons(found),
            *experiment.compare_profile(
                published_velocity(), "driven/velocity", TWIST, _READING
            ),
            _guard_comparison(found["Circle"]),
            *boxes.comparisons(errors),
        ],
        tables=(_error_table(numbers),),
        data={"wrenches": _dataset(found)},
    )


_READING = "The same profile, labelled with its own time: what is left is the error of reading the figure."

_GUARDED = (
    "The program behind the published ellipsoid adds $10^{-10}$ m to $|z|$ where it takes the angle between bristle "
    r"and velocity, which raises friction by $5 \times 10^{-5}$; the rest is its solver, as in the figures of the "
    "other models."
)


def _curve_comparisons(found: dict[str, Arrays]) -> list[Comparison]:
    solver = (
        "The figure's solver (relative tolerance $10^{-6}$, absolute $10^{-8}$ m, when a bristle bends by $10^{-6}$ "
        "m): it is as far from the converged solution where the velocity changes."
    )
    twice = (
        "The same equations, solved twice: what is left is the error of both solvers."
    )
    rows = []
    for shape, wrenches in found.items():
        for kind, model in runs.NAMES.items():
            for (component, unit), values in zip(
                WRENCH.items(), wrenches[kind].T, strict=True
            ):
                ours = (wrenches["time"], values)
                quantity = f"{runs.IN_WORDS[shape]}, {model}"
                for ending in PUBLISHED.get((shape, kind), ()):
                    name = f"driven/{shape}/{kind}{ending}/{component}"
                    words = f"{quantity}{ending}, {component}"
                    if kind == "e":
                        rows += _ellipsoid_comparisons(words, *ours, name, shape, unit)
                    else:  # known errors are kept to three digits
                        allowance = boxes.OWN[unit] + 5e-3 * (
                            facts.published_curve(name).deviation or 0.0
                        )
                        rows.append(
                            experiment.compare_curve(
                                words, *ours, name, allowance, solver
                            )
                        )
                if kind in "dr" and shape in CONVERGED:
                    name = f"driven/{shape}/{kind}/{component}"
                    words = f"{quantity}, {component}"
                    rows.append(
                        experiment.compare_converged(
                            words, *ours, name, boxes.OWN[unit], twice
                        )
                    )
    return rows


def _ellipsoid_comparisons(
    quantity: str,
    time: np.ndarray,
    values: np.ndarray,
    name: str,
    shape: str,
    unit: str,
) -> list[Comparison]:
    """Compare a curve of the ellipsoid, whose own solver error is not known; of the torque, the spin-up apart."""
    guard = boxes.OWN[unit] + boxes.guard_effect(shape)[unit]
    allowance = guard + (
        facts.published_curve(name.replace("/e/", "/r/")).deviation or 0.0
    )
    if unit == "N":
        return [
            experiment.compare_curve(quantity, time, values, name, allowance, _GUARDED)
        ]
    spin_up = (
        "The figure's solver misses the first samples of the spin-up, by as much as in the figure of the table model, "
        "which is the same there: with its tolerances and the guard of $10^{-10}$ m put in, the curve is met to "
        "$10^{-9}$ N m."
    )
    early = time < SPIN_UP
    curve = facts.published_curve(name)
    late = curve.time > SPIN_UP
    ours = values[np.rint(curve.time[late] / 0.01).astype(int)]
    theirs = curve.values[late]
    words = f"{quantity}, after it"
    within = guard + boxes.solver_error("d/tau") + curve.reading
    first = f"{quantity}, spin-up", time[early], values[early], name, allowance, spin_up
    return [
        experiment.compare_curve(*first),
        experiment.compare(words, ours, theirs, "published", within, unit, _GUARDED),
    ]


def _guard_comparison(disc: Arrays) -> Comparison:
    """Compare the published ellipsoid's surplus of friction in steady pure slide with what the guard explains."""
    words = "disc, surplus of the published ellipsoid's friction in a steady slide"
    cause = (
        r"With $|z| + \epsilon$ in the angle, $\epsilon = 10^{-10}$ m, $\beta$ is $(1 + |z|/(|z| + \epsilon))/2$ "
        r"in a steady slide, so the bristles bend by $\epsilon/2$ further: what is left is of second order in "
        "that length."
    )
    explained = boxes.guard_effect("Circle")["N"]
    return experiment.compare(
        words,
        _guard_surplus(disc),
        explained,
        "closed form",
        boxes.OWN["N"],
        "N",
        cause,
    )


def _guard_surplus(disc: Arrays) -> float:
    curve = facts.published_curve("driven/Circle/e/fy")
    steady = int(
        np.flatnonzero((curve.time > PURE_SLIDE[0]) & (curve.time < PURE_SLIDE[1]))[0]
    )
    ours = disc["e"][int(np.rint(curve.time[steady] / 0.01)), 1]
    return float(ours - curve.values[steady])


def _numbers(
    found: dict[str, Arrays], errors: dict[str, boxes.Errors]
) -> dict[str, Any]:
    statistics = {
        shape: {
            quantity: {
                model: _statistics(shape, values) for model, values in models.items()
            }
            for quantity, models in each.items()
        }
        for shape, each in errors.items()
    }
    return {
        "errors": statistics,
        "samples": boxes.SAMPLES,
        "solver": {"rtol": RTOL, "atol": ATOL},
        "guard": {"length": boxes.GUARD, "surplus": _guard_surplus(found["Circle"])},
        "spin_up_error_of_the_figures": boxes.solver_error("r/tau"),
        "misses_of_other_conventions": boxes.convention_misses(errors),
    }


def _statistics(shape: str, errors: np.ndarray) -> dict[str, Any]:
    box = boxes.statistics(errors)
    worst = int(errors.argmax()) + 1
    return box | {
        "samples above the whisker": int((errors > box["whisker high"]).sum()),
        "time of maximum": round(0.01 * worst, 2),
        "centre of rotation at maximum": _centre_of_rotation(shape, worst),
    }


def _centre_of_rotation(shape: str, sample: int) -> dict[str, float] | None:
    """Return distances [m] of the centre of rotation, if any, from the centre of pressure and the nearest cell."""
    vx, vy, omega = published_velocity().left(0.01 * sample - 0.005)
    if omega == 0.0:
        return None
    patch = PUBLISHED_PATCHES[shape]()
    cells = patch.positions[patch.weights() > 0.0] - patch.centre_of_pressure()
    centre = np.array([-vy, vx]) / omega
    nearest = np.hypot(*(cells - centre).T).min()
    return {
        "from the centre of pressure": float(np.hypot(*centre)),
        "from the nearest cell": float(nearest),
    }


def _template_values(numbers: dict[str, Any]) -> dict[str, Any]:
    """Return the values that the template names."""
    errors = numbers["errors"]
    tables = {shape: each["ft"]["corrected"] for shape, each in errors.items()}
    worst = max(
        tables,
        key=lambda shape: tables[shape]["maximum"] / tables[shape]["whisker high"],
    )
    boxes_of_all = [
        box
        for each in errors.values()
        for models in each.values()
        for box in models.values()
    ]
    return {
        "factors": [
            each["ft"]["ellipsoid"]["third quartile"]
            / each["ft"]["corrected"]["third quartile"]
            for each in errors.values()
        ],
        "worst": tables[worst] | {"shape": runs.IN_WORDS[worst]},
        "most": max(box["samples above the whisker"] for box in boxes_of_all),
    }


def _error_table(numbers: dict[str, Any]) -> experiment.Table:
    """Return errors of both reduced models against the distributed one."""
    rows = {
        f"{runs.IN_WORDS[shape]}, {words}": {
            name: each[model] for name, each in quantities.items()
        }
        for shape, quantities in numbers["errors"].items()
        for model, words in MODELS.items()
    }
    columns = {
        f"{words}, {column} [{unit}]": entry(quantity, column, scale=1e3, digits=4)
        for quantity, words, unit in (("ft", "force", "mN"), ("tau", "torque", "N mm"))
        for column in ("median", "third quartile", "whisker high", "maximum")
    }
    return experiment.table(
        "Errors against the distributed model, at 1 N", rows, columns, "shape, model"
    )


def _dataset(found: dict[str, Arrays]) -> Any:
    time = next(iter(found.values()))["time"]
    wrenches = {
        (shape, name): experiment.columns_of(time, each[kind], WRENCH)
        for shape, each in found.items()
        for kind, name in runs.NAMES.items()
    }
    # a sampled wrench belongs to the velocity of the step just ended
    speeds = experiment.with_units(published_velocity().left(time), TWIST)
    return experiment.dataset(
        wrenches, WRENCH, ("shape", "model"), ("time", time, "s"), speeds
    )


LOOKS: dict[str, dict[str, Any]] = {
    kind: {
        "ls": LINE_STYLES[style],
        "lw": width,
        "alpha": opacity,
        "color": looks.OF_MODEL[kind],
    }
    for kind, style, width, opacity in (
        ("d", 0, 2.6, 0.45),
        ("r", 1, 1.3, 1.0),
        ("e", 2, 1.5, 1.0),
    )
}
"""Letter of a model -> how its line looks: the distributed model broad and pale below the others."""

MARKERS = {"d": "o", "r": "s", "e": "^"}
"""Letter of a model -> marker of its published curves."""

SHOWN = (
    ("ft", "force error [% of the load]", 100.0),
    ("tau", "torque error [N mm]", 1e3),
)
"""Quantity of the errors, label of its axis, and shown units per SI unit."""

SHOWN_FLOOR = 1e-3
"""Least error that is shown [%, N mm]: many are zero but for rounding."""

SPEEDS = (
    ("vx", "$v_x$ [mm/s]", 1e3),
    ("vy", "$v_y$ [mm/s]", 1e3),
    ("omega", "$\\omega$ [rad/s]", 1.0),
)


def _figures(
    found: dict[str, Arrays], errors: dict[str, boxes.Errors]
) -> dict[str, PlotFigure]:
    result = {"velocity_profile": _profile(found["Circle"])}
    for shape, kind in (("Circle", "r"), ("Circle", "e"), ("NonConvex1", "r")):
        endings = {"d": ", beside the ellipsoid" if kind == "e" else "", kind: ""}
        result[f"driven_{shape.lower()}_{kind}"] = _page(
            {shape: found[shape]}, f"d{kind}", 3.4, endings
        )
    others = {shape: found[shape] for shape in found if shape not in QUICK_SHAPES}
    if others:
        result["driven_other_shapes"] = _page(others, "dre", 2.1 * len(others) + 0.7)
    return result | {"driven_errors": _box_plots(errors)}


def _profile(disc: Arrays) -> PlotFigure:
    """Draw the velocity profile [mm/s, rad/s], and the wrench of the distributed model of the disc [N, N mm]."""
    figure, (above, below) = looks.panels(9.6, 4.6, 2, 3, sharex=True)
    time = np.arange(0.0, 5.0, 0.001)
    for axes, (name, label, factor), values in zip(
        above, SPEEDS, published_velocity()(time).T, strict=True
    ):
        axes.plot(time, factor * values, color="0.15", lw=1.4)
        looks.vertices(axes, f"driven/velocity/{name}", factor, "0.15")
        axes.set_ylabel(label)
    for axes, name, values in zip(below, WRENCH, disc["d"].T, strict=True):
        label, factor = looks.AXES[name]
        axes.plot(disc["time"], factor * values, color=looks.DISTRIBUTED, lw=1.4)
        looks.vertices(
            axes, f"driven/Circle/d, alone/{name}", factor, looks.DISTRIBUTED
        )
        axes.set(xlabel="time [s]", ylabel=label, xlim=(0.0, 5.0))
    return figure


def _page(
    found: dict[str, Arrays],
    kinds: str,
    height: float,
    endings: dict[str, str] | None = None,
) -> PlotFigure:
    """Draw forces [N] and torque [N mm] of some models, a row for each shape.

    Published curves are those of the models in `endings`, which hold the ends of their names.
    """
    figure, panels = looks.panels(
        9.6, height, len(found), 3, sharex=True, squeeze=False
    )
    endings = endings or {}
    for row, (shape, wrenches) in zip(panels, found.items(), strict=True):
        row[0].set_title(runs.IN_WORDS[shape], fontsize="medium", loc="left")
        for column, (axes, name) in enumerate(zip(row, WRENCH, strict=True)):
            label, factor = looks.AXES[name]
            for kind in kinds:
                axes.plot(
                    wrenches["time"], factor * wrenches[kind][:, column], **LOOKS[kind]
                )
            for kind, ending in endings.items():
                curve = f"driven/{shape}/{kind}{ending}/{name}"
                looks.vertices(
                    axes, curve, factor, looks.OF_MODEL[kind], marker=MARKERS[kind]
                )
            axes.set(xlim=(0.0, 5.0), ylabel=label)
    for axes in panels[-1]:
        axes.set_xlabel("time [s]")
    figure.align_ylabels(panels)
    key = [looks.line_key(runs.NAMES[kind], **LOOKS[kind]) for kind in kinds]
    for kind in endings:
        marks = {
            "marker": MARKERS[kind],
            "mec": looks.OF_MODEL[kind],
            "ls": "",
            "ms": 4,
            "mfc": "white",
        }
        key.append(looks.line_key(f"{runs.NAMES[kind]}, published", **marks))
    looks.legend(figure, key, 4 if endings else 3, fontsize=9)
    return figure


def _box_plots(every: dict[str, boxes.Errors]) -> PlotFigure:
    """Draw errors of force and torque of all shapes: medians, quartiles, ranges and maxima; grey: as published."""
    colours = {"corrected": looks.PUBLISHED, "ellipsoid": looks.ELLIPSOID}
    table = facts.published_table("box")
    with paper():
        figure = new_figure(PAGE, 4.2)
        panels = figure.subplots(2, 1, sharex=True)
        for axes, (quantity, label, factor) in zip(panels, SHOWN, strict=True):
            for place, (shape, each) in enumerate(every.items()):
                for offset, (model, values) in zip(
                    (-0.24, 0.12), each[quantity].items(), strict=True
                ):
                    found = factor * np.array([*boxes.statistics(values).values()])
                    at = place + offset
                    looks.span(axes, at, found, colours[model])
                    if published := table.get(f"{quantity}/{shape}/{model}"):
                        theirs = [
                            factor * published[name] for name in boxes.COLUMNS[:5]
                        ]
                        looks.span(axes, at + 0.12, theirs, MEASURED)
            axes.set(yscale="log", ylabel=label)
            axes.set_ylim(bottom=SHOWN_FLOOR)
            axes.yaxis.set_major_formatter("{x:g}")
            tidy(axes)
            axes.grid(False, axis="x")
        panels[1].set_xticks(range(len(every)), [runs.IN_WORDS[name] for name in every])
        figure.align_ylabels(panels)
        key = [
            looks.line_key(MODELS[model], color=colour, marker="o", ms=5, lw=2.5)
            for model, colour in colours.items()
        ]
        key += [
            looks.line_key("as published", color=MEASURED, marker="o", ms=5, lw=2.5),
            looks.line_key("maximum", ls="", marker="x", ms=4, mew=1.1, color="0.3"),
        ]
        looks.legend(figure, key, 4)
    return figure
