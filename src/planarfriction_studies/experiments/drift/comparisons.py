"""The numbers of the drift experiment beside published, converged and closed ones."""

from __future__ import annotations

from typing import Any

import numpy as np

from planarfriction.scenes.ready import drift_force
from planarfriction.scenes.signal import sample_times
from planarfriction_studies.experiments import facts
from planarfriction_studies.experiments.drift.figures import WORDS
from planarfriction_studies.experiments.drift.runs import MOTION, PERIOD, WIDTH, WINDOWS, Runs
from planarfriction_studies.experiments.experiment import Comparison, compare, compare_converged, compare_curve


def comparisons(found: Runs, numbers: dict[str, Any], share: float) -> list[Comparison]:
    """Compare all quantities of the experiment; `share` is the error of our solver as a share of a curve's span."""
    return [
        *_applied_comparisons(),
        *_motion_comparisons(found, share),
        *_sideways_comparisons(found),
        *_plateau_comparisons(numbers["plateaus"]),
        *_creep_comparisons(found, numbers["creep"], share),
        compare(
            "width of the patch that the published angle implies",
            WIDTH,
            numbers["implied width"],
            "published",
            1e-5 * WIDTH,
            "m",
            _WIDTH,
        ),
    ]


def _applied_comparisons() -> list[Comparison]:
    time = sample_times(5.0)
    force = drift_force("tangential")(time)
    cause = "The same load, labelled with its own time: what is left is the error of reading the figure."
    return [
        compare_curve(f"applied {name}", time, values, f"drift/applied/{name}", allowance=1e-12, cause=cause)
        for name, values in zip(("fx", "fy", "tau"), force.T, strict=True)
    ]


def _motion_comparisons(found: Runs, share: float) -> list[Comparison]:
    rows = []
    for (load, model), run in found.items():
        if load == "normal":
            continue
        for name, unit in MOTION:
            reference = f"drift/{model}/{name}"
            words = f"tangential load, {WORDS[model]}, {name}"
            if name == "y":
                allowance = float(np.abs(run["x"]).max() * np.abs(run["theta"]).max())
                causes = (_SIDEWAYS, _SIDEWAYS)
            else:
                allowance, causes = share * float(np.ptp(run[name])), (_SOLVER, _TWICE)
            ours = run["time"], run[name]
            rows.append(compare_curve(words, *ours, reference, allowance=allowance, cause=causes[0]))
            rows.append(compare_converged(words, *ours, reference, unit=unit, allowance=allowance, cause=causes[1]))
    return rows


_SOLVER = "The figure's solver, and ours, each by its tolerance: it is as far from the converged solution."
_TWICE = "The same equations, solved twice: what is left is the error of our solver, which drift adds up."
_SIDEWAYS = (
    "Our patch is fixed to the table and the disc's centre moves over it, so that its bristles hold "
    r"$y = \int x\,\mathrm{d}\theta$; "
    "in the reference the patch goes with the centre and y is zero."
)


def _sideways_comparisons(found: Runs) -> list[Comparison]:
    """Compare the path of a disc that turns while its patch stays in place."""
    from scipy.integrate import cumulative_trapezoid

    cause = r"The integral is taken over samples 0.01 s apart, between which $x$ and $\theta$ oscillate."
    rows = []
    for (load, model), run in found.items():
        path = cumulative_trapezoid(run["x"], run["theta"], initial=0.0)
        words, tolerance = f"{load} load, {WORDS[model]}, y beside int x dtheta", 0.1 * float(np.abs(path).max())
        rows.append(compare(words, run["y"], path, "closed form", tolerance, "m", cause))
    return rows


_SPRING, _LEFT = r"$x = F/(\sigma_0 f_N)$", "what is left is our solver's error."


def _plateau_comparisons(plateaus: dict[str, Any]) -> list[Comparison]:
    units, rows = dict(MOTION), []
    closed_forms = {
        "d_ep": (1e-6, rf"{_SPRING}, $\theta = \tau/(\sigma_0 f_N \langle\rho^2\rangle)$: {_LEFT}"),
        "e_ep": (1e-5, rf"{_SPRING}, $\theta = \tau/(\sigma_0 f_N r^2)$: {_LEFT}"),
        "straight": (
            5e-4,
            "The deflection along the twist with $h$ parallel to the load: what is left is the disc's mass.",
        ),
    }
    for model, closed in plateaus["closed form"].items():
        share, cause = closed_forms[model]
        for name, value in closed.items():
            words = f"deflection at 1 s under force and torque, {WORDS[model]}, {name}"
            ours = plateaus["measured"][model][name]
            rows.append(compare(words, ours, value, "closed form", share * value, units[name], cause))
    spring = plateaus["closed form"]["d_ep"]["x"]
    for model, x in plateaus["in the tangential run"].items():
        words = f"deflection at 1 s under force alone, {WORDS[model]}, x"
        rows.append(compare(words, x, spring, "closed form", 1e-6 * x, "m", f"{_SPRING} with every model: {_LEFT}"))
    return rows


def _creep_comparisons(found: Runs, creep: dict[str, Any], share: float) -> list[Comparison]:
    """Compare the drift per period: that of plain bristles with converged solutions, none with elasto-plastic ones."""
    units, rows = dict(MOTION), []
    for what, (model, moved) in ((what, item) for what, models in creep.items() for item in models.items()):
        if (what, model) == ("normal force", "r_ep"):  # creeps a little: the table's own doing, see the findings
            continue
        load = "normal" if what == "normal force" else "tangential"
        for name, ours in moved.items():
            if (what, name) == ("force", "theta"):  # nothing turns the disc before 2.8 s
                continue
            words = f"drift per period, {what}, {WORDS[model]}, {name}"
            tolerance = share * float(np.ptp(found[load, model][name]))
            if model.endswith("_ep"):
                rows.append(compare(words, ours, 0.0, "closed form", tolerance, units[name], _NO_DRIFT))
            elif load == "tangential":
                theirs = _converged_creep(model, name, what)
                rows.append(compare(words, ours, theirs, "converged", tolerance, units[name], _TWICE))
    return rows


_WIDTH = (
    r"$\theta = \tau/(\sigma_0 f_N \langle\rho^2\rangle)$ at the largest torque: the patch of the figures is "
    "0.05 m wide, where the article gives 0.05 m as its radius."
)
_NO_DRIFT = "Below the breakaway deflection elasto-plastic bristles are springs: what is left is our solver's error."


def _converged_creep(model: str, name: str, what: str) -> float:
    reference, (start, end) = facts.converged(f"drift/{model}"), WINDOWS[what]
    first, last = (reference[name][np.abs(reference["time"] - time).argmin()] for time in (start, end))
    return float(last - first) / round((end - start) / PERIOD)
