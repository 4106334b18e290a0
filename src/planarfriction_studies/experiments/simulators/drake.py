"""The part of the comparison of simulators that Drake is needed for."""

from __future__ import annotations

import importlib.util
from functools import partial
from typing import Any

from planarfriction_studies.bench import drake_scenes, mujoco_scenes
from planarfriction_studies.bench.drake_scenes import Way
from planarfriction_studies.experiments.experiment import Work
from planarfriction_studies.experiments.simulators.runs import measured, stop_errors

CONTACTS = ("point", "hydroelastic")

OWN = {f"{name}, {contact}": Way(contact, name) for name in ("sap", "similar", "lagged") for contact in CONTACTS}
"""Drake's own friction."""

PATCHES = {f"patches, {contact}": Way(contact, patch=True) for contact in CONTACTS}

TIME_STEPS = (2e-3, 1e-2)


def installed() -> bool:
    """Return True if Drake is installed."""
    return importlib.util.find_spec("pydrake") is not None


def run(work: Work) -> dict[str, Any]:
    """Measure all cases in Drake; return the numbers by kind, case and way."""
    ways = {**OWN, **PATCHES}
    if work.quick:
        ways = {name: ways[name] for name in ("lagged, point", "patches, point")}
    duration, size = (0.6, {"steps": 20, "rounds": 2}) if work.quick else (3.0, {"steps": 100, "rounds": 30})
    plain = {name: way for name, way in ways.items() if name.startswith(("lagged", "patches"))}
    times = work.piece("Drake, cost", lambda: drake_scenes.cost(plain, **size))
    creeps = {
        f"{1e3 * dt:g} ms": {name: partial(drake_scenes.creep, way, dt, duration) for name, way in ways.items()}
        for dt in TIME_STEPS
    }
    discs = {
        f"{start[0]:g} m/s, {start[1]:g} rad/s": {name: partial(_disc, way, start) for name, way in ways.items()}
        for start in mujoco_scenes.STARTS[: 1 if work.quick else None]
    }
    return {
        "creep": measured(work, "Drake, incline", creeps),
        "disc": measured(work, "Drake, disc", discs),
        "cost": {
            f"{contact} contact": {kind: {"seconds": times[f"{kind}, {contact}"]} for kind in ("lagged", "patches")}
            for contact in CONTACTS
            if f"lagged, {contact}" in plain
        },
    }


def _disc(way: Way, start: tuple[float, float]) -> dict[str, float]:
    return stop_errors(start, *drake_scenes.slide(way, start))
