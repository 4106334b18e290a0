"""Patch friction inside simulators beside their own at its best settings: held, shaken, stopped, turned, timed.

Needs MuJoCo; Drake is compared with where it is installed.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, Literal

import numpy as np

from planarfriction.errors import MissingExtraError
from planarfriction_studies.bench import mujoco_scenes
from planarfriction_studies.experiments.experiment import Comparison, Result, Table, Work, compare, table
from planarfriction_studies.experiments.simulators import drake as simulators_drake
from planarfriction_studies.experiments.simulators import runs
from planarfriction_studies.experiments.simulators.figure import overview
from planarfriction_studies.experiments.simulators.runs import NATIVE, PATCHES, Way
from planarfriction_studies.experiments.wording import fill, length, readable

WAYS: dict[str, Way] = {**NATIVE, PATCHES: PATCHES}

TIME_STEPS = (1e-3, 2e-3, 5e-3, 1e-2)
"""Time steps at which the grip is held [s]."""

INTEGRATORS = ("Euler", "implicitfast")

OWN = "impratio 10"
"""The setting that costs are relative to."""

TOUCHING = tuple((name, NATIVE[name]) for name in (OWN, "noslip 10"))
"""Settings that a disc slides with, on its face and on one point."""

TOLERANCES = {
    "creep": (1e-3, "um/s"), "turning": (1e-6, "deg/s"), "displacement": (1.0, "um"), "slip": (1.0, "um"),
    "distance": (0.05, "%"), "angle": (0.2, "%"), "end": (2.5, "mm"), "turned": (0.5, "deg"),
}  # fmt: skip
"""Tolerances of patches against the closed form or the converged run."""

Numbers = dict[str, dict[str, dict[str, float]]]
"""Case -> way -> quantity."""

COSTLY = (OWN, "noslip 3", "noslip 10", PATCHES)
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
    return fill("simulators", **_template_values(found, versions)).result(
        {"simulators": overview(found, OWN)},
        comparisons=_comparisons(found),
        numbers={"versions": versions, **found},
        tables=_tables(found),
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
        f"{name}, {touch}": (way, touch, None) for touch in ("face", "point") for name, way in TOUCHING
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


# ---------------------------------------------------------------------- comparisons, tables, words


def _comparisons(found: Mapping[str, Any]) -> list[Comparison]:
    """Compare our numbers with rest, with the exact disc and with the converged run."""
    rows: list[tuple[str, float, str]] = []
    for case, ways in found["steps"].items():
        for dt, values in ways.items():
            label = f"{case}, dt {dt}"
            rows += [
                (f"creep, {label}", 1e6 * values["creep"], "creep"),
                (f"turning, {label}", float(np.degrees(values["spin"])), "turning"),
                (f"displacement, {label}", 1e6 * values["moved"], "displacement"),
            ]
    if "capsule" in found["held"]:
        rows.append(("creep, capsule", 1e6 * found["held"]["capsule"][PATCHES]["creep"], "creep"))
    rows += [(f"slip, shaken, {name}", 1e6 * ways[PATCHES]["slip"], "slip") for name, ways in found["shaken"].items()]
    for start, ways in found["disc"].items():
        for kind in runs.KINDS:
            rows += [
                (f"{what} of the disc, {start}, {kind}", 100 * ways[kind][what], what) for what in ("distance", "angle")
            ]
    for load, ways in found["in hand"].items():
        values = ways[next(iter(runs.KINDS))]
        rows += [
            (f"end in the hand, {load}", 1e3 * float(np.hypot(values["x"], values["y"])), "end"),
            (f"angle in the hand, {load}", float(np.degrees(values["theta"])), "turned"),
        ]
    if "drake" in found:
        for dt, ways in found["drake"]["creep"].items():
            rows += [
                (f"creep, Drake, {way}, dt {dt}", 1e6 * values["creep"], "creep")
                for way, values in ways.items()
                if way.startswith(PATCHES)
            ]
        for start, ways in found["drake"]["disc"].items():
            for way in (way for way in ways if way.startswith(PATCHES)):
                rows += [
                    (f"{what} of the disc, Drake, {start}, {way}", 100 * ways[way][what], what)
                    for what in ("distance", "angle")
                ]
    cause = "The time step, and the normal contact of the simulator."
    return [
        compare(name, value, 0.0, "converged" if kind in ("end", "turned") else "closed form", *TOLERANCES[kind], cause)
        for name, value, kind in rows
    ]


def _tables(found: Mapping[str, Any]) -> list[Table]:
    """Return the tables: ways as rows, cases as columns, each number with its unit."""
    drake = found.get("drake")
    return [
        _by_way("What is held: creep and turning", found["held"], _creep),
        table(
            "Patches at other time steps: creep, turning and largest displacement",
            found["steps"],
            {
                dt: lambda ways, dt=dt: f"{_creep(ways[dt])}; {1e6 * ways[dt]['moved']:.2f} um"
                for dt in next(iter(found["steps"].values()))
            },
        ),
        _by_way("A gripper shaken for 3 s: slip in the hand", found["shaken"], lambda v: length(v["slip"])),
        _by_way("A disc that slides and spins to rest: errors of distance and angle", found["disc"], _stop),
        _by_way("The published in-hand run: errors of the end in height and angle", found["in hand"], _end),
        _by_way(
            "Time of a step, over that with impratio 10", _ratios(found["cost"], OWN), lambda v: f"{v['ratio']:.2f}"
        ),
    ] + (
        []
        if drake is None
        else [
            _by_way(
                "Drake, a box on an incline of 0.3 rad: creep",
                drake["creep"],
                lambda v: f"{length(v['creep'])}/s",
            ),
            _by_way("Drake, the disc: errors of distance and angle", drake["disc"], _stop),
            _by_way(
                "Drake, time of a step of the box, over that without patches",
                _ratios(drake["cost"], "lagged"),
                lambda v: f"{v['ratio']:.1f}",
            ),
        ]
    )


def _ratios(cases: Numbers, own: str) -> Numbers:
    """Return times over those of one way."""
    return {
        f"{case} ({1e6 * ways[own]['seconds']:.0f} us)": {
            way: {"ratio": values["seconds"] / ways[own]["seconds"]} for way, values in ways.items()
        }
        for case, ways in cases.items()
    }


def _by_way(title: str, cases: Numbers, words: Callable[[Mapping[str, float]], str]) -> Table:
    """Return a table with ways as rows and cases as columns."""
    ways = {way: way for way in next(iter(cases.values()))}
    return table(title, ways, {name: lambda way, case=case: words(case[way]) for name, case in cases.items()})


def _creep(values: Mapping[str, float]) -> str:
    if values["dropped"]:
        return "dropped"
    turning = abs(float(np.degrees(values["spin"])))
    turns = f"{readable(turning)} deg/s" if turning >= 1e-3 else "< 0.001 deg/s"
    return f"{length(values['creep'])}/s, {turns}"


def _stop(values: Mapping[str, float]) -> str:
    return f"{100 * values['distance']:+.2f} %, {100 * values['angle']:+.2f} %"


def _end(values: Mapping[str, float]) -> str:
    if abs(values["y"]) > runs.DROPPED:
        return "dropped"
    return f"{1e3 * values['y']:+.1f} mm, {np.degrees(values['theta']):+.1f} deg"


def _template_values(found: Mapping[str, Any], versions: Mapping[str, str]) -> dict[str, Any]:
    """Return the values that the template names."""

    def worst(kind: str, way: str, *keys: str) -> float:
        return max(abs(case[way][key]) for case in found[kind].values() for key in keys)

    reduced = next(iter(runs.KINDS))
    touching = [f"{name}, {touch}" for touch in ("face", "point") for name, _ in TOUCHING]
    creeps = [item for case in found.get("drake", {"creep": {}})["creep"].values() for item in case.items()]
    drake = {
        "own": min((abs(each["creep"]) for way, each in creeps if not way.startswith(PATCHES)), default=0.0),
        "patches": max((abs(each["creep"]) for way, each in creeps if way.startswith(PATCHES)), default=0.0),
    }
    return {
        "versions": versions,
        "creep": {way: worst("held", way, "creep") for way in (OWN, "noslip 10", PATCHES)},
        "slip": {
            "own": min(worst("shaken", way, "slip") for way in NATIVE),
            "patches": worst("shaken", PATCHES, "slip"),
        },
        "stops": {
            "own": min(worst("disc", way, "distance", "angle") for way in touching),
            "patches": worst("disc", reduced, "distance", "angle"),
        },
        "ends": {"own": min(worst("in hand", way, "y") for way in NATIVE), "patches": worst("in hand", reduced, "y")},
        "ratios": [ways[PATCHES]["seconds"] / ways[OWN]["seconds"] for ways in found["cost"].values()],
        "drake": drake if creeps else None,
    }
