"""Runs of the drift experiment, and closed forms of its equations."""

from __future__ import annotations

import dataclasses
from typing import Any, Literal

import numpy as np

from planarfriction.patch import PUBLISHED_PATCHES
from planarfriction.scenes import Signal, simulate
from planarfriction.scenes.ready import GRAVITY, drift
from planarfriction_studies.experiments import facts, runs
from planarfriction_studies.experiments.experiment import Arrays

WIDTH = 0.05
"""Width of the patch [m]; the article says radius."""

FORCE, TORQUE, GREATEST_TORQUE = 1.0, 0.03, 0.04
"""Mean of the applied force [N] and torque [N m], and the largest torque [N m], which 3.75 s is a sample of."""

Load = Literal["tangential", "normal"]

LOADS: tuple[Load, ...] = ("tangential", "normal")

MODELS = {"tangential": ("d", "d_ep", "r", "r_ep"), "normal": ("d", "d_ep", "r", "r_ep", "e_ep")}
"""Load -> models that are run, each with the ending of its law."""

LAWS = {"": runs.PLAIN, "_ep": runs.LAW}
"""Ending of the names of curves -> friction law."""

MOTION = (("x", "m"), ("y", "m"), ("theta", "rad"))

PERIOD = 1.0 / 3.0
"""Period of the oscillating load [s]."""

WINDOWS = {"force": (1.67, 2.67), "force and torque": (4.0, 5.0), "normal force": (4.0, 5.0)}
"""Windows by oscillating load: start and end [s] of three whole periods over which drift is measured."""

QUICK, TIGHT = (1e-6, 3e-6, 2e-4), (1e-8, 3e-8, 5e-6)
"""Tolerances `rtol`, `atol`, and the error that they leave in 5 s as a share of a curve's span: drift adds up."""

Runs = dict[tuple[str, str], Arrays]
"""Load, model ("d", "r", "e", with the ending of its law) -> columns of the run [SI]."""


def move(load: Load, model: str, rtol: float, atol: float) -> Arrays:
    """Simulate one run of the disc, given by its load and by its model with the ending of its law."""
    law = LAWS[model[1:]]
    scene = drift(runs.published_model(model[0], "Circle", law, width=WIDTH), load=load)  # pyright: ignore[reportArgumentType]
    return runs.columns(simulate(scene, rtol=rtol, atol=atol))


def straight_ramp(rtol: float, atol: float) -> Arrays:
    """Simulate the reduced model under force and torque that rise in proportion, slowly beside its vibrations."""
    scene = drift(runs.published_model("r", "Circle", width=WIDTH), load="normal", t_end=1.0)
    ramp = Signal.sampled([0.0, 0.8], [[0.0, 0.0, 0.0], [FORCE, 0.0, TORQUE]], "linear")
    return runs.columns(simulate(dataclasses.replace(scene, force=ramp), rtol=rtol, atol=atol))


def measure(found: Runs, straight: Arrays) -> dict[str, Any]:
    """Compute every number of the experiment except its comparisons."""
    at = 100  # the last sample before the normal force begins to oscillate
    measured = {model: _place(found["normal", model], at) for model in ("d_ep", "r_ep", "e_ep")}
    measured["straight"] = _place(straight, at)
    return {
        "plateaus": {"measured": measured, "closed form": _closed_forms(), "in the tangential run": {
            model: float(found["tangential", model]["x"][at]) for model in ("d_ep", "r_ep")}},
        "creep": _creep(found),
        "patch": _patch_numbers(),
        "implied width": implied_width(),
        "sideways": max(float(np.abs(run["y"]).max()) for run in found.values()),
    }  # fmt: skip


def _place(run: Arrays, at: int) -> dict[str, float]:
    return {"x": float(run["x"][at]), "theta": float(run["theta"][at])}


def _patch_numbers() -> dict[str, float]:
    patch = PUBLISHED_PATCHES["Circle"](width=WIDTH)
    return {
        "second moment": float(patch.second_moment()),
        "contact radius of the table": runs.published_model("r", patch).surface.contact_radius,
        "contact radius of the ellipsoid": runs.published_model("e", patch).surface.contact_radius,
    }


def _closed_forms() -> dict[str, dict[str, float]]:
    """Return deflections `x` [m], `theta` [rad] under both loads, bristles elastic: by model, where the path does not
    matter.

    The table's: along a straight path of the load the velocity keeps the direction whose h is parallel to the load.
    """
    numbers, stiffness = _patch_numbers(), runs.LAW.sigma_0 * GRAVITY
    x = FORCE / stiffness
    surface = runs.published_model("r", "Circle", width=WIDTH).surface
    twist = surface.twist(np.array([-FORCE, 0.0, -TORQUE]))  # of unit dissipation, against a balancing friction
    scaled = twist * [1.0, 1.0, surface.contact_radius]
    duration = x / (-surface.wrench(twist)[0] * np.linalg.norm(scaled))  # z = h |V_S| t
    return {
        "d_ep": {"x": x, "theta": TORQUE / (stiffness * numbers["second moment"])},
        "e_ep": {"x": x, "theta": TORQUE / (stiffness * numbers["contact radius of the ellipsoid"] ** 2)},
        "straight": {"x": float(twist[0] * duration), "theta": float(twist[2] * duration)},
    }


def _creep(found: Runs) -> dict[str, dict[str, dict[str, float]]]:
    """Return the motion per period of the load: what oscillates -> model -> x [m], theta [rad]."""
    result = {}
    for what, (start, end) in WINDOWS.items():
        first, last = round(100 * start), round(100 * end)
        periods = round((end - start) / PERIOD)
        load = "normal" if what == "normal force" else "tangential"
        result[what] = {
            model: {name: float(run[name][last] - run[name][first]) / periods for name in ("x", "theta")}
            for (each, model), run in found.items()
            if each == load
        }
    return result


def implied_width() -> float:
    """Return the width of the patch that the published angle at the largest torque implies [m], bristles elastic."""
    curve = facts.published_curve("drift/d_ep/theta")
    moment = GREATEST_TORQUE / (runs.LAW.sigma_0 * GRAVITY * curve.values.max())
    return WIDTH * float(np.sqrt(moment / _patch_numbers()["second moment"]))
