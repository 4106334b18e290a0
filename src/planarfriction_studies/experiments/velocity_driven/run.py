"""Six patches moved with a given velocity: the distributed model, the reduced one, and that on the ellipsoid."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from planarfriction.patch import PUBLISHED_PATCHES
from planarfriction.plots.style import PlotFigure
from planarfriction.scenes import simulate
from planarfriction.scenes.ready import driven, published_velocity
from planarfriction.scenes.signal import sample_times
from planarfriction_studies.experiments import facts, runs
from planarfriction_studies.experiments.experiment import (
    Arrays,
    Comparison,
    Result,
    Table,
    Work,
    compare,
    compare_converged,
    compare_curve,
    dataset,
    table,
)
from planarfriction_studies.experiments.velocity_driven import boxes, figures
from planarfriction_studies.experiments.wording import fill

if TYPE_CHECKING:
    import xarray as xr

QUICK_SHAPES = ("Circle", "NonConvex1")
"""Shapes whose curves are published."""

RTOL, ATOL = 1e-8, 3e-8
"""Tolerances that leave errors below `boxes.OWN`, so that what is seen are those of the references."""

COMPONENTS = (("fx", "N"), ("fy", "N"), ("tau", "N m"))

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


def drive(shape: str) -> Arrays:
    """Simulate a patch: time [s], and the wrench `[T, 3]` [N, N, N m] about the centre of pressure with each model."""
    patch = PUBLISHED_PATCHES[shape](width=boxes.WIDTH)
    result = {}
    for kind in ("d", "r", "e"):
        columns = runs.columns(simulate(driven(runs.published_model(kind, patch)), rtol=RTOL, atol=ATOL))
        result |= {"time": columns["time"], kind: runs.at_centre_of_pressure(columns, patch)}
    return result


def run(work: Work) -> Result:
    """Carry out the experiment."""
    shapes = QUICK_SHAPES if work.quick else runs.SIX_SHAPES
    computes = {shape: partial(drive, shape) for shape in shapes}
    found = work.pieces(computes, lambda shape: f"driven, {runs.IN_WORDS[shape]}")
    errors = {shape: boxes.errors(wrenches) for shape, wrenches in found.items()}
    numbers = _numbers(found, errors)
    velocity = published_velocity()
    return fill("velocity_driven", **_template_values(numbers)).result(
        _figures(found, errors),
        comparisons=[
            *_curve_comparisons(found),
            *_velocity_comparisons(velocity),
            _guard_comparison(found["Circle"]),
            *boxes.comparisons(errors),
        ],
        numbers=numbers,
        tables=(_error_table(numbers),),
        data={"wrenches": _dataset(found, velocity)},
    )


def _figures(found: dict[str, Arrays], errors: dict[str, boxes.Errors]) -> dict[str, PlotFigure]:
    result = {"velocity_profile": figures.profile(found["Circle"])}
    for shape, kind in (("Circle", "r"), ("Circle", "e"), ("NonConvex1", "r")):
        result[f"driven_{shape.lower()}_{kind}"] = figures.pair(shape, kind, found[shape])
    others = {shape: found[shape] for shape in found if shape not in QUICK_SHAPES}
    if others:
        result["driven_other_shapes"] = figures.page(others)
    return result | {"driven_errors": figures.box_plots(errors)}


# ------------------------------------------------------------------ comparisons


def _curve_comparisons(found: dict[str, Arrays]) -> list[Comparison]:
    rows = []
    for shape, wrenches in found.items():
        for kind, model in runs.NAMES.items():
            for column, (component, unit) in enumerate(COMPONENTS):
                ours = wrenches["time"], wrenches[kind][:, column]
                quantity = f"{runs.IN_WORDS[shape]}, {model}"
                for ending in PUBLISHED.get((shape, kind), ()):
                    name = f"driven/{shape}/{kind}{ending}/{component}"
                    words = f"{quantity}{ending}, {component}"
                    if kind == "e":
                        rows += _ellipsoid_comparisons(words, *ours, name, shape, unit)
                    else:
                        rows.append(compare_curve(words, *ours, name, boxes.OWN[unit] + _rounded(name), _SOLVER))
                if kind in "dr" and shape in CONVERGED:
                    name, words = f"driven/{shape}/{kind}/{component}", f"{quantity}, {component}"
                    rows.append(compare_converged(words, *ours, name, unit, boxes.OWN[unit], _TWICE))
    return rows


def _ellipsoid_comparisons(
    quantity: str, time: np.ndarray, values: np.ndarray, name: str, shape: str, unit: str
) -> list[Comparison]:
    """Compare a curve of the ellipsoid, whose own solver error is not known; of the torque, the spin-up apart."""
    guard = boxes.OWN[unit] + boxes.guard_effect(shape)[unit]
    table_model = facts.published_curve(name.replace("/e/", "/r/")).deviation or 0.0
    if unit == "N":
        return [compare_curve(quantity, time, values, name, guard + table_model, _GUARDED)]
    early, curve = time < SPIN_UP, facts.published_curve(name)
    late = curve.time > SPIN_UP
    ours = values[np.rint(curve.time[late] / 0.01).astype(int)]
    tolerance = guard + boxes.solver_error()[unit] + curve.reading
    return [
        compare_curve(f"{quantity}, spin-up", time[early], values[early], name, guard + table_model, _SPIN_UP),
        compare(f"{quantity}, after it", ours, curve.values[late], "published", tolerance, unit, _GUARDED),
    ]


def _rounded(name: str) -> float:
    """Return the rounding error of a figure's known error, which is kept to three digits."""
    return 5e-3 * (facts.published_curve(name).deviation or 0.0)


_TWICE = "The same equations, solved twice: what is left is the error of both solvers."
_SOLVER = (
    "The figure's solver (relative tolerance $10^{-6}$, absolute $10^{-8}$ m, when a bristle bends by $10^{-6}$ m): it "
    "is as far from the converged solution where the velocity changes."
)
_GUARDED = (
    "The program behind the published ellipsoid adds $10^{-10}$ m to $|z|$ where it takes the angle between bristle "
    r"and velocity, which raises friction by $5 \times 10^{-5}$; the rest is its solver, as in the figures of the "
    "other models."
)
_SPIN_UP = (
    "The figure's solver misses the first samples of the spin-up, by as much as in the figure of the table model, "
    "which is the same there: with its tolerances and the guard of $10^{-10}$ m put in, the curve is met to "
    "$10^{-9}$ N m."
)


def _velocity_comparisons(velocity: Any) -> list[Comparison]:
    time = sample_times(5.0)
    cause = "The same profile, labelled with its own time: what is left is the error of reading the figure."
    return [
        compare_curve(f"velocity profile, {name}", time, values, f"driven/velocity/{name}", 1e-12, cause)
        for name, values in zip(("vx", "vy", "omega"), velocity(time).T, strict=True)
    ]


def _guard_comparison(disc: Arrays) -> Comparison:
    """Compare the published ellipsoid's surplus of friction in steady pure slide with what the guard explains."""
    return compare(
        "disc, surplus of the published ellipsoid's friction in a steady slide",
        _guard_surplus(disc),
        boxes.guard_effect("Circle")["N"],
        "closed form",
        boxes.OWN["N"],
        "N",
        r"With $|z| + \epsilon$ in the angle, $\epsilon = 10^{-10}$ m, $\beta$ is $(1 + |z|/(|z| + \epsilon))/2$ "
        r"in a steady slide, so the bristles bend by $\epsilon/2$ further: what is left is of second order in "
        "that length.",
    )


def _guard_surplus(disc: Arrays) -> float:
    curve = facts.published_curve("driven/Circle/e/fy")
    steady = int(np.flatnonzero((curve.time > PURE_SLIDE[0]) & (curve.time < PURE_SLIDE[1]))[0])
    ours = disc["e"][int(np.rint(curve.time[steady] / 0.01)), 1]
    return float(ours - curve.values[steady])


# ------------------------------------------------------------------ numbers and data


def _numbers(found: dict[str, Arrays], errors: dict[str, boxes.Errors]) -> dict[str, Any]:
    statistics = {
        shape: {
            quantity: {model: _statistics(shape, values) for model, values in models.items()}
            for quantity, models in each.items()
        }
        for shape, each in errors.items()
    }
    return {
        "errors": statistics,
        "samples": boxes.SAMPLES,
        "solver": {"rtol": RTOL, "atol": ATOL},
        "guard": {"length": boxes.GUARD, "surplus": _guard_surplus(found["Circle"])},
        "spin_up_error_of_the_figures": boxes.spin_up_error(),
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
    """Return the distances of the centre of rotation from the centre of pressure and from the nearest loaded cell [m]
    at a sample; None in a slide."""
    vx, vy, omega = published_velocity().left(0.01 * sample - 0.005)
    if omega == 0.0:
        return None
    patch = PUBLISHED_PATCHES[shape](width=boxes.WIDTH)
    cells = patch.positions[patch.weights() > 0.0] - patch.centre_of_pressure()
    centre = np.array([-vy, vx]) / omega
    nearest = np.hypot(*(cells - centre).T).min()
    return {"from the centre of pressure": float(np.hypot(*centre)), "from the nearest cell": float(nearest)}


def _dataset(found: dict[str, Arrays], velocity: Any) -> xr.Dataset:
    time = next(iter(found.values()))["time"]
    wrenches = {
        (shape, name): dict(zip(dict(COMPONENTS), each[kind].T, strict=True))
        for shape, each in found.items()
        for kind, name in runs.NAMES.items()
    }
    result = dataset(wrenches, dict(COMPONENTS), ("shape", "model"), ("time", time, "s"))
    before = velocity.left(time).T  # a sampled wrench belongs to the velocity of the step just ended
    speeds = zip(("vx", "vy", "omega"), ("m/s", "m/s", "rad/s"), before, strict=True)
    return result.assign({name: ("time", values, {"units": unit}) for name, unit, values in speeds})


# ------------------------------------------------------------------ words and table


def _template_values(numbers: dict[str, Any]) -> dict[str, Any]:
    """Return the values that the template names."""
    errors = numbers["errors"]
    quartiles: list[dict[str, Any]] = [
        {"shape": runs.IN_WORDS[shape]}
        | {name: each["ft"][model]["third quartile"] for name, model in (("table", "corrected"), ("ellipsoid",) * 2)}
        for shape, each in errors.items()
    ]
    tables = {shape: each["ft"]["corrected"] for shape, each in errors.items()}
    worst = max(tables, key=lambda shape: tables[shape]["maximum"] / tables[shape]["whisker high"])
    convention, *others = numbers["misses_of_other_conventions"].values()
    above = (
        box["samples above the whisker"]
        for quantities in errors.values()
        for models in quantities.values()
        for box in models.values()
    )
    return {
        "shapes": [each["shape"] for each in quartiles],
        "quartiles": quartiles,
        "factors": [each["ellipsoid"] / each["table"] for each in quartiles],
        "worst": {
            "shape": runs.IN_WORDS[worst],
            "box": tables[worst],
            "centre": tables[worst]["centre of rotation at maximum"],
        },
        "most": max(above),
        "samples": numbers["samples"],
        "convention": convention,
        "others": others,
        "guard": numbers["guard"],
        "spin_up": numbers["spin_up_error_of_the_figures"],
    }


def _error_table(numbers: dict[str, Any]) -> Table:
    """Return errors of both reduced models against the distributed one."""
    rows = {
        f"{runs.IN_WORDS[shape]}, {figures.BOX_WORDS[model]}": {name: each[model] for name, each in quantities.items()}
        for shape, quantities in numbers["errors"].items()
        for model in boxes.MODELS
    }
    columns = {
        f"{words}, {column} [{unit}]": lambda each, quantity=quantity, column=column: float(
            f"{1e3 * each[quantity][column]:.4g}"
        )
        for quantity, words, unit in (("ft", "force", "mN"), ("tau", "torque", "N mm"))
        for column in ("median", "third quartile", "whisker high", "maximum")
    }
    return table("Errors against the distributed model, at 1 N", rows, columns, "shape, model")
