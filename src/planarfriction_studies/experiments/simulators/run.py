"""Patch friction inside simulators beside their own at its best settings: held, shaken, stopped, turned, timed.

Needs MuJoCo; Drake is compared with where it is installed.
"""

from __future__ import annotations

import dataclasses
from functools import partial
from typing import Any, Literal

from planarfriction.errors import MissingExtraError
from planarfriction_studies.bench import mujoco_scenes
from planarfriction_studies.experiments.experiment import Result, Work
from planarfriction_studies.experiments.simulators import drake as simulators_drake
from planarfriction_studies.experiments.simulators import runs, words
from planarfriction_studies.experiments.simulators.figure import overview
from planarfriction_studies.experiments.simulators.runs import NATIVE, PATCHES, Way
from planarfriction_studies.experiments.simulators.words import Numbers
from planarfriction_studies.experiments.wording import fill

WAYS: dict[str, Way] = {**NATIVE, PATCHES: PATCHES}

TIME_STEPS = (1e-3, 2e-3, 5e-3, 1e-2)
"""At which the grip is held [s]."""

INTEGRATORS = ("Euler", "implicitfast")

COSTLY = (words.OWN, "noslip 3", "noslip 10", PATCHES)
"""Ways whose time is taken: things on the tray fall through pyramids, and hop where contacts are stiff."""


def run(work: Work) -> Result:
    """Carry out the comparison."""
    try:
        import mujoco
    except ImportError as error:
        raise MissingExtraError("mujoco", "mujoco") from error
    found: dict[str, Any] = {
        "held": _held(work),
        "steps": _steps(work),
        "shaken": _shaken(work),
        "disc": _disc(work),
        "in hand": _in_hand(work),
        "cost": _cost(work),
    }
    versions = {"mujoco": mujoco.__version__}
    if simulators_drake.installed():
        found["drake"] = simulators_drake.run(work)
        versions["drake"] = simulators_drake.version()
    return fill("simulators", **words.template_values(found, versions)).result(
        {"simulators": overview(found, words.OWN)},
        comparisons=words.comparisons(found),
        numbers={"versions": versions, **found},
        tables=words.tables(found),
    )


# ---------------------------------------------------------------------- runs


def _shortened(scene: mujoco_scenes.MujocoScene, work: Work) -> mujoco_scenes.MujocoScene:
    return dataclasses.replace(scene, time=0.5) if work.quick else scene


def _held(work: Work) -> Numbers:
    scenes = {f"grip, {pad} pads": (mujoco_scenes.grip(pad), 0) for pad in mujoco_scenes.PADS}
    scenes = {"capsule": (mujoco_scenes.capsule(), 2), **scenes}
    if work.quick:
        scenes = {"grip, box pads": scenes["grip, box pads"]}
    jobs = {
        case: {name: partial(runs.held, _shortened(scene, work), way, body=body) for name, way in WAYS.items()}
        for case, (scene, body) in scenes.items()
    }
    return runs.measured(work, "held", jobs)


def _steps(work: Work) -> Numbers:
    pads = ("box",) if work.quick else mujoco_scenes.PADS
    scenes = {f"grip, {pad} pads": _shortened(mujoco_scenes.grip(pad), work) for pad in pads}
    jobs = {
        case: {f"{1e3 * dt:g} ms": partial(runs.held, scene, PATCHES, dt) for dt in TIME_STEPS}
        for case, scene in scenes.items()
    }
    return runs.measured(work, "patches at other time steps", jobs)


def _shaken(work: Work) -> Numbers:
    scene = _shortened(mujoco_scenes.shaken(), work)
    jobs = {
        integrator: {name: partial(runs.shaken, way, integrator, scene) for name, way in WAYS.items()}
        for integrator in INTEGRATORS
    }
    return runs.measured(work, "shaken", jobs)


def _disc(work: Work) -> Numbers:
    ways: dict[str, Any] = {
        f"{name}, {touch}": (way, touch, None) for touch in ("face", "point") for name, way in words.TOUCHING
    }
    ways |= {name: (PATCHES, "face", kind) for name, kind in runs.KINDS.items()}
    jobs = {
        f"{speed:g} m/s, {spin:g} rad/s": {
            name: partial(runs.disc, way, (speed, spin), touch, kind) for name, (way, touch, kind) in ways.items()
        }
        for speed, spin in mujoco_scenes.STARTS[: 1 if work.quick else None]
    }
    return runs.measured(work, "disc", jobs)


def _in_hand(work: Work) -> Numbers:
    ways: dict[str, Any] = {name: (way, None) for name, way in NATIVE.items()}
    ways |= {name: (PATCHES, kind) for name, kind in runs.KINDS.items()}
    loads: tuple[Literal[1, 2], ...] = (2,) if work.quick else (1, 2)
    jobs = {
        f"load {load}": {name: partial(runs.in_hand, way, load, kind) for name, (way, kind) in ways.items()}
        for load in loads
    }
    return runs.measured(work, "in hand", jobs)


def _cost(work: Work) -> Numbers:
    scenes = {f"tray, {blocks} block{'s' * (blocks > 1)}": mujoco_scenes.tray(blocks) for blocks in (1, 2, 8)}
    scenes["grip at rest, box pads"] = mujoco_scenes.grip("box")
    if work.quick:
        scenes = dict(list(scenes.items())[:1])
    ways = {"without friction": runs.FRICTIONLESS, **{name: WAYS[name] for name in COSTLY}}
    size = {"steps": 50, "rounds": 3} if work.quick else {"steps": 200, "rounds": 40}
    return {
        name: work.piece(f"cost, {name}", partial(runs.cost, scene, ways, **size)) for name, scene in scenes.items()
    }
