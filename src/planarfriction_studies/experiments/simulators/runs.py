"""The runs of the comparison of simulators: scenes with MuJoCo's own friction at several settings, and with patches.

Each function returns plain numbers.
"""

from __future__ import annotations

import dataclasses
import functools
import importlib.util
import time
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, Literal

import numpy as np

from planarfriction.models import DistributedModel, FrictionModel
from planarfriction_studies.bench import coulomb_disc, drake_scenes, mujoco_scenes
from planarfriction_studies.bench.drake_scenes import Way as DrakeWay
from planarfriction_studies.bench.mujoco_scenes import MujocoScene, Native
from planarfriction_studies.experiments import facts
from planarfriction_studies.experiments.experiment import Work

NATIVE = {
    "pyramid": Native("pyramidal", 1.0),
    "impratio 10": Native(),
    "noslip 3": Native(noslip=3),
    "noslip 10": Native(noslip=10),
    "stiff": Native(impratio=100.0, noslip=10, solref=4e-3),
}
"""MuJoCo's own friction: as it comes; with the elliptic cone and the ratio advised against slip; with iterations
against slip besides; and with stiffer contacts besides, which hold best while they are shaken."""

FRICTIONLESS = Native(condim=1)

PATCHES = "patches"
"""Name of our friction among the settings."""

WAYS: dict[str, Way] = {**NATIVE, PATCHES: None}

KINDS: dict[str, type | None] = {"patches, reduced": None, "patches, distributed": DistributedModel}
"""Models of the patches; None: the reduced one of the scene."""

DT = 2e-3

DROPPED = 0.05
"""A block that has sunk by this [m] is no longer held."""

Way = Native | None
"""Settings of MuJoCo's own friction, or None for patches."""

_disc, _plate = functools.cache(mujoco_scenes.disc), functools.cache(mujoco_scenes.plate)
_stop = functools.cache(coulomb_disc.stop)


def measured(work: Work, what: str, jobs: Mapping[str, Mapping[str, Callable[[], Any]]]) -> dict[str, dict[str, Any]]:
    """Return numbers by case and way, each a piece: an interrupted run continues after the last."""
    return {
        case: {way: work.piece(f"{what}, {case}, {way}", job) for way, job in ways.items()}
        for case, ways in jobs.items()
    }


def held(scene: MujocoScene, way: Way, dt: float = DT, body: int = 0) -> dict[str, float]:
    """Compute the speeds at which a held object, with pose `body` of qpos, creeps and turns in the second half."""
    m, d, step = scene.begin(way, dt)
    path = scene.run(m, d, step)[:, body : body + 7]
    places, turns = path[:, :3], 2.0 * path[:, 4:]  # half-angles about the axes of the world: it starts upright
    half, seconds = len(path) // 2, 0.5 * scene.time
    moved, turned = places[-1] - places[half], turns[-1] - turns[half]
    return {
        "creep": float(np.linalg.norm(moved) / seconds),
        "spin": float(np.linalg.norm(turned) / seconds),
        "moved": float(np.linalg.norm(places - places[0], axis=1).max()),
        "dropped": float(places[0, 2] - places[-1, 2] > DROPPED),
    }


def shaken(way: Way, integrator: str, scene: MujocoScene) -> dict[str, float]:
    """Compute the range of positions of the block in the hand while the hand is shaken [m]."""
    m, d, step = scene.begin(way, integrator=integrator)
    places = []

    def recorded() -> None:
        step()
        places.append(mujoco_scenes.in_the_hand(d))

    steps = len(scene.run(m, d, recorded)) - 1
    shaking = min(steps, round(mujoco_scenes.SHAKEN / m.opt.timestep))
    return {"slip": float(np.ptp(places[-steps:][:shaking], axis=0).max())}


def disc(
    way: Way, start: tuple[float, float], touch: Literal["face", "point"] = "face", kind: type | None = None
) -> dict[str, float]:
    """Return relative errors of distance and angle against the exact Coulomb disc, less the stepper's own `v dt/2`."""
    scene = _disc(*start, joint="free", touch=touch)
    m, d, step = scene.begin(way, model=_other(scene, kind))
    path = scene.run(m, d, step)
    angle = np.unwrap(2.0 * np.arctan2(path[:, 6], path[:, 3]))
    return stop_errors(start, float(np.hypot(*(path[-1, :2] - path[0, :2]))), float(angle[-1] - angle[0]))


def stop_errors(start: tuple[float, float], distance: float, angle: float) -> dict[str, float]:
    """Return relative errors of where a disc stopped [m, rad], less the `v dt/2` of a stepper of `DT`."""
    stop = _stop(*start)
    return {
        "distance": (distance + 0.5 * DT * start[0]) / stop.distance - 1.0,
        "angle": (angle + 0.5 * DT * start[1]) / stop.angle - 1.0,
    }


def in_hand(way: Way, load: Literal[1, 2], kind: type | None = None) -> dict[str, float]:
    """Compute the end of the plate of the published run, less the converged end of the distributed model."""
    scene, reference = _plate(load), facts.converged(f"in_hand/Circle/d{load}")
    m, d, step = scene.begin(way, model=_other(scene, kind))
    x, y, _, theta, _ = scene.run(m, d, step)[-1]
    end = {"x": x + 2e-3, "y": y, "theta": theta}
    return {name: value - reference[name][-1] for name, value in end.items()}


def _other(scene: MujocoScene, kind: type | None) -> FrictionModel | None:
    """Return a model of another kind with the patch and the law of the scene's own; None for its own."""
    return None if kind is None else kind(scene.model.patch, scene.model.law)


def cost(scene: MujocoScene, ways: Mapping[str, Way], *, steps: int, rounds: int) -> dict[str, dict[str, float]]:
    """Measure the seconds of a step by name: the least of `rounds`, in turns, of `steps` of a settled scene."""
    runs = {name: scene.begin(way) for name, way in ways.items()}
    for m, d, step in runs.values():
        dataclasses.replace(scene, time=0.0).run(m, d, step)
    least = dict.fromkeys(runs, np.inf)
    for i in range(rounds):
        for name, (m, d, step) in runs.items():
            controls = [scene.control((i * steps + j) * m.opt.timestep) for j in range(steps)]
            start = time.process_time()
            for control in controls:
                d.ctrl[:] = control
                step()
            least[name] = min(least[name], (time.process_time() - start) / steps)
    return {name: {"seconds": value} for name, value in least.items()}


# ---------------------------------------------------------------------- Drake

CONTACTS = ("point", "hydroelastic")

DRAKE_OWN = {
    f"{name}, {contact}": DrakeWay(contact, name) for name in ("sap", "similar", "lagged") for contact in CONTACTS
}
"""Drake's own friction."""

DRAKE_PATCHES = {f"patches, {contact}": DrakeWay(contact, patch=True) for contact in CONTACTS}

DRAKE_STEPS = (2e-3, 1e-2)


def has_drake() -> bool:
    """Return True if Drake is installed."""
    return importlib.util.find_spec("pydrake") is not None


def in_drake(work: Work) -> dict[str, Any]:
    """Measure all cases in Drake; return the numbers by kind, case and way."""
    ways = {**DRAKE_OWN, **DRAKE_PATCHES}
    if work.quick:
        ways = {name: ways[name] for name in ("lagged, point", "patches, point")}
    duration, size = (0.6, {"steps": 20, "rounds": 2}) if work.quick else (3.0, {"steps": 100, "rounds": 30})
    plain = {name: way for name, way in ways.items() if name.startswith(("lagged", "patches"))}
    times = work.piece("Drake, cost", lambda: drake_scenes.cost(plain, **size))
    creeps = {
        f"{1e3 * dt:g} ms": {name: partial(drake_scenes.creep, way, dt, duration) for name, way in ways.items()}
        for dt in DRAKE_STEPS
    }
    discs = {
        f"{start[0]:g} m/s, {start[1]:g} rad/s": {name: partial(_drake_disc, way, start) for name, way in ways.items()}
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


def _drake_disc(way: DrakeWay, start: tuple[float, float]) -> dict[str, float]:
    return stop_errors(start, *drake_scenes.slide(way, start))
