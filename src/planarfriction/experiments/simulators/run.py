"""Patch friction inside simulators beside their own at its best settings: held, shaken, stopped, turned, timed.

Needs MuJoCo; Drake is compared with where it is installed.
"""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Mapping
from typing import Any, Literal

from planarfriction.bench import mujoco_scenes
from planarfriction.errors import MissingExtraError
from planarfriction.experiments.experiment import Picture, Result, Work
from planarfriction.experiments.simulators import drake as simulators_drake
from planarfriction.experiments.simulators import runs, words
from planarfriction.experiments.simulators.figure import overview
from planarfriction.experiments.simulators.runs import NATIVE, PATCHES, Way
from planarfriction.experiments.simulators.words import Numbers

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
    return Result(
        findings=words.findings(found, versions),
        pictures=[
            Picture(
                "simulators",
                "Each point is a case; patches are ours. What lies beyond an axis is drawn at its edge.",
                overview(found, words.OWN),
            )
        ],
        comparisons=words.comparisons(found),
        numbers={"versions": versions, **found},
        tables=words.tables(found),
    )


# ---------------------------------------------------------------------- runs


def _measure(work: Work, case: str, jobs: Mapping[str, Any]) -> dict[str, dict[str, float]]:
    """Way -> numbers, each a piece: an interrupted run goes on from the last."""
    return {
        way: {key: float(value) for key, value in work.piece(f"{case}, {way}", job).items()}
        for way, job in jobs.items()
    }


def _shortened(scene: mujoco_scenes.MujocoScene, work: Work) -> mujoco_scenes.MujocoScene:
    return dataclasses.replace(scene, time=0.5) if work.quick else scene


def _held(work: Work) -> Numbers:
    scenes = {f"grip, {pad} pads": (mujoco_scenes.grip(pad), 0) for pad in mujoco_scenes.PADS}
    scenes = {"capsule": (mujoco_scenes.capsule(), 2), **scenes}
    if work.quick:
        scenes = {"grip, box pads": scenes["grip, box pads"]}
    return {
        case: _measure(
            work,
            case,
            {
                name: lambda way=way, scene=scene, body=body: runs.held(_shortened(scene, work), way, body=body)
                for name, way in WAYS.items()
            },
        )
        for case, (scene, body) in scenes.items()
    }


def _steps(work: Work) -> Numbers:
    found = {}
    for pad in ("box",) if work.quick else mujoco_scenes.PADS:
        scene = _shortened(mujoco_scenes.grip(pad), work)
        jobs = {f"{1e3 * dt:g} ms": lambda dt=dt, scene=scene: runs.held(scene, PATCHES, dt) for dt in TIME_STEPS}
        found[f"grip, {pad} pads"] = _measure(work, f"patches at other time steps, {pad}", jobs)
    return found


def _shaken(work: Work) -> Numbers:
    scene = _shortened(mujoco_scenes.shaken(), work)
    return {
        integrator: _measure(
            work,
            f"shaken, {integrator}",
            {
                name: lambda way=way, integrator=integrator: runs.shaken(way, integrator, scene)
                for name, way in WAYS.items()
            },
        )
        for integrator in INTEGRATORS
    }


def _disc(work: Work) -> Numbers:
    ways: dict[str, Any] = {
        f"{name}, {touch}": (way, touch, None) for touch in ("face", "point") for name, way in words.TOUCHING
    }
    ways |= {name: (PATCHES, "face", kind) for name, kind in runs.KINDS.items()}
    return {
        f"{speed:g} m/s, {spin:g} rad/s": _measure(
            work,
            f"disc, {speed:g} m/s, {spin:g} rad/s",
            {
                name: lambda speed=speed, spin=spin, job=job: runs.disc(job[0], (speed, spin), job[1], job[2])
                for name, job in ways.items()
            },
        )
        for speed, spin in mujoco_scenes.STARTS[: 1 if work.quick else None]
    }


def _in_hand(work: Work) -> Numbers:
    ways: dict[str, Any] = {name: (way, None) for name, way in NATIVE.items()}
    ways |= {name: (PATCHES, kind) for name, kind in runs.KINDS.items()}
    loads: tuple[Literal[1, 2], ...] = (2,) if work.quick else (1, 2)
    return {
        f"load {load}": _measure(
            work,
            f"in hand, load {load}",
            {name: functools.partial(runs.in_hand, way, load, kind) for name, (way, kind) in ways.items()},
        )
        for load in loads
    }


def _cost(work: Work) -> Numbers:
    scenes = {f"tray, {blocks} block{'s' * (blocks > 1)}": mujoco_scenes.tray(blocks) for blocks in (1, 2, 8)}
    scenes["grip at rest, box pads"] = mujoco_scenes.grip("box")
    names = list(scenes)[:1] if work.quick else list(scenes)
    ways = {"without friction": runs.FRICTIONLESS, **{name: WAYS[name] for name in COSTLY}}
    size = {"steps": 50, "rounds": 3} if work.quick else {"steps": 200, "rounds": 40}
    found = {}
    for name in names:
        times = work.piece(f"cost, {name}", lambda name=name: runs.cost(scenes[name], ways, **size))
        found[name] = {way: {"seconds": float(value)} for way, value in times.items()}
    return found
