"""Six patches moved with a given velocity: the distributed model, the reduced one, and that on the ellipsoid."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from planarfriction.experiments import facts, runs
from planarfriction.experiments.experiment import (
    Arrays,
    Comparison,
    Result,
    Work,
    compare_converged,
    compare_curve,
    compare_number,
)
from planarfriction.experiments.velocity_driven import boxes, figures
from planarfriction.experiments.velocity_driven.tables import error_table, told
from planarfriction.experiments.wording import fill
from planarfriction.patch import PUBLISHED_PATCHES
from planarfriction.plots.style import PlotFigure
from planarfriction.scenes import simulate
from planarfriction.scenes.ready import driven, published_velocity
from planarfriction.scenes.signal import sample_times

if TYPE_CHECKING:
    import xarray as xr

QUICK_SHAPES = ("Circle", "NonConvex1")
"""Those whose curves are published."""

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
    """Time [s], and the wrench `[T, 3]` [N, N, N m] about the centre of pressure with each model of a patch."""
    patch = PUBLISHED_PATCHES[shape](width=boxes.WIDTH)
    result = {}
    for kind in ("d", "r", "e"):
        columns = runs.columns(simulate(driven(runs.published_model(kind, patch)), rtol=RTOL, atol=ATOL))
        result |= {"time": columns["time"], kind: runs.at_centre_of_pressure(columns, patch)}
    return result


def run(work: Work) -> Result:
    """Carry out the experiment."""
    shapes = QUICK_SHAPES if work.quick else runs.SIX_SHAPES
    pieces = work.pieces({f"driven, {runs.IN_WORDS[shape]}": lambda shape=shape: drive(shape) for shape in shapes})
    found: dict[str, Arrays] = dict(zip(shapes, pieces.values(), strict=True))
    errors = {shape: boxes.errors(wrenches) for shape, wrenches in found.items()}
    numbers = _numbers(found, errors)
    velocity = published_velocity()
    return fill("velocity_driven", **told(numbers)).result(
        _figures(found, errors),
        comparisons=[
            *_curve_comparisons(found),
            *_velocity_comparisons(velocity),
            _guard_comparison(found["Circle"]),
            *boxes.comparisons(errors),
        ],
        numbers=numbers,
        tables=(error_table(numbers),),
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
                        allowance = boxes.OWN[unit] + _rounded(name)
                        rows.append(compare_curve(words, *ours, name, allowance=allowance, cause=_SOLVER))
                if kind in "dr" and shape in CONVERGED:
                    name, words = f"driven/{shape}/{kind}/{component}", f"{quantity}, {component}"
                    rows.append(
                        compare_converged(words, *ours, name, unit=unit, allowance=boxes.OWN[unit], cause=_TWICE)
                    )
    return rows


def _ellipsoid_comparisons(
    quantity: str, time: np.ndarray, values: np.ndarray, name: str, shape: str, unit: str
) -> list[Comparison]:
    """A curve of the ellipsoid, whose own solver error is not known; of the torque, the spin-up apart."""
    guard = boxes.OWN[unit] + boxes.guard_effect(shape)[unit]
    table_model = facts.published_curve(name.replace("/e/", "/r/")).deviation or 0.0
    if unit == "N":
        return [compare_curve(quantity, time, values, name, allowance=guard + table_model, cause=_GUARDED)]
    early, curve = time < SPIN_UP, facts.published_curve(name)
    late = curve.time > SPIN_UP
    difference = np.abs(values[np.rint(curve.time[late] / 0.01).astype(int)] - curve.values[late])
    tolerance = guard + boxes.solver_error()[unit] + curve.reading
    spin_up = compare_curve(
        f"{quantity}, spin-up", time[early], values[early], name, allowance=guard + table_model, cause=_SPIN_UP
    )
    after = Comparison(
        f"{quantity}, after it", "published", float(difference.max()), tolerance, unit, int(late.sum()), _GUARDED
    )
    return [spin_up, after]


def _rounded(name: str) -> float:
    """What the known error of a figure, which is kept to three digits, may have lost."""
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
    rows = []
    for column, name in enumerate(("vx", "vy", "omega")):
        rows.append(
            compare_curve(
                f"velocity profile, {name}",
                time,
                velocity(time)[:, column],
                f"driven/velocity/{name}",
                allowance=1e-12,
                cause="The same profile, labelled with its own time: what is left is the error of reading the figure.",
            )
        )
    return rows


def _guard_comparison(disc: Arrays) -> Comparison:
    """The published ellipsoid's surplus of friction in steady pure slide beside what the guard explains."""
    return compare_number(
        "disc, surplus of the published ellipsoid's friction in a steady slide",
        _guard_surplus(disc),
        boxes.guard_effect("Circle")["N"],
        reference="closed form",
        tolerance=boxes.OWN["N"],
        unit="N",
        cause=r"With $|z| + \epsilon$ in the angle, $\epsilon = 10^{-10}$ m, $\beta$ is $(1 + |z|/(|z| + \epsilon))/2$ "
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
    """Its distances from the centre of pressure and from the nearest loaded cell [m] at a sample; None in a slide."""
    vx, vy, omega = published_velocity().left(0.01 * sample - 0.005)
    if omega == 0.0:
        return None
    patch = PUBLISHED_PATCHES[shape](width=boxes.WIDTH)
    cells = patch.positions[patch.weights() > 0.0] - patch.centre_of_pressure()
    centre = np.array([-vy, vx]) / omega
    nearest = np.hypot(*(cells - centre).T).min()
    return {"from the centre of pressure": float(np.hypot(*centre)), "from the nearest cell": float(nearest)}


def _dataset(found: dict[str, Arrays], velocity: Any) -> xr.Dataset:
    import xarray as xr

    time = next(iter(found.values()))["time"]
    wrench = np.array([[wrenches[kind] for kind in runs.NAMES] for wrenches in found.values()])
    columns: dict[str, Any] = {
        name: (("shape", "model", "time"), wrench[..., column], {"units": unit})
        for column, (name, unit) in enumerate(COMPONENTS)
    }
    before = velocity.left(time)  # a sampled wrench belongs to the velocity of the step just ended
    for name, unit, values in zip(("vx", "vy", "omega"), ("m/s", "m/s", "rad/s"), before.T, strict=True):
        columns[name] = ("time", values, {"units": unit})
    coordinates = {"shape": list(found), "model": list(runs.NAMES.values()), "time": ("time", time, {"units": "s"})}
    return xr.Dataset(columns, coordinates)
