"""Patch friction inside simulators beside their own at its best settings: held, shaken, stopped, turned, timed.

Needs MuJoCo; Drake is compared with where it is installed.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from functools import partial
from importlib import metadata
from typing import Any

import numpy as np

from planarfriction.errors import MissingExtraError
from planarfriction.plots.style import PlotFigure, new_figure, tidy
from planarfriction_studies.bench import mujoco_scenes
from planarfriction_studies.experiments import looks
from planarfriction_studies.experiments.experiment import Comparison, Result, Table, Work, compare, table
from planarfriction_studies.experiments.simulators import runs
from planarfriction_studies.experiments.simulators.runs import NATIVE, PATCHES, WAYS
from planarfriction_studies.experiments.wording import length, readable, report

TIME_STEPS = (1e-3, 2e-3, 5e-3, 1e-2)
"""Time steps at which the grip is held [s]."""

INTEGRATORS = ("Euler", "implicitfast")

OWN = "impratio 10"
"""The setting that costs are relative to."""

TOUCHES, TOUCHING = ("face", "point"), (OWN, "noslip 10")
"""Places that a disc touches with, and the settings that it slides with."""

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
        import mujoco  # noqa: F401
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
    packages = ["mujoco"]
    if runs.has_drake():
        found["drake"] = runs.in_drake(work)
        packages.append("drake")
    return report(
        "simulators",
        {"simulators": _overview(found)},
        {"versions": {package: metadata.version(package) for package in packages}, **found},
        _template_values(found),
        comparisons=_comparisons(found),
        tables=_tables(found),
    )


# ---------------------------------------------------------------------- runs


def _grips(work: Work) -> dict[str, mujoco_scenes.MujocoScene]:
    """Return grips with pads of all forms; for a quick look one, and half a second of it."""
    pads = ("box",) if work.quick else mujoco_scenes.PADS
    scenes = {f"grip, {pad} pads": mujoco_scenes.grip(pad) for pad in pads}
    return {name: _shortened(scene, work) for name, scene in scenes.items()}


def _shortened(scene: mujoco_scenes.MujocoScene, work: Work) -> mujoco_scenes.MujocoScene:
    return dataclasses.replace(scene, time=0.5) if work.quick else scene


def _held(work: Work) -> Numbers:
    scenes = {} if work.quick else {"capsule": (mujoco_scenes.capsule(), 2)}
    scenes |= {case: (scene, 0) for case, scene in _grips(work).items()}
    jobs = {
        case: {name: partial(runs.held, scene, way, body=body) for name, way in WAYS.items()}
        for case, (scene, body) in scenes.items()
    }
    return runs.measured(work, "held", jobs)


def _steps(work: Work) -> Numbers:
    jobs = {
        case: {f"{1e3 * dt:g} ms": partial(runs.held, scene, None, dt) for dt in TIME_STEPS}
        for case, scene in _grips(work).items()
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
    ways: dict[str, Any] = {f"{name}, {touch}": (NATIVE[name], touch) for touch in TOUCHES for name in TOUCHING}
    ways |= {name: (None, "face", kind) for name, kind in runs.KINDS.items()}
    jobs = {
        f"{start[0]:g} m/s, {start[1]:g} rad/s": {
            name: partial(runs.disc, way, start, *rest) for name, (way, *rest) in ways.items()
        }
        for start in mujoco_scenes.STARTS[: 1 if work.quick else None]
    }
    return runs.measured(work, "disc", jobs)


def _in_hand(work: Work) -> Numbers:
    ways: dict[str, Any] = {name: (way, None) for name, way in NATIVE.items()}
    ways |= {name: (None, kind) for name, kind in runs.KINDS.items()}
    loads: Any = (1,) if work.quick else (1, 2)
    jobs = {
        f"load {load}": {name: partial(runs.in_hand, way, load, kind) for name, (way, kind) in ways.items()}
        for load in loads
    }
    return runs.measured(work, "in hand", jobs)


def _cost(work: Work) -> Numbers:
    counts = (1,) if work.quick else (1, 2, 8)
    scenes = {f"tray, {blocks} block{'s' * (blocks > 1)}": mujoco_scenes.tray(blocks) for blocks in counts}
    if not work.quick:
        scenes["grip at rest, box pads"] = mujoco_scenes.grip("box")
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
    rows += _stops("", found["disc"])
    for load, ways in found["in hand"].items():
        values = ways[next(iter(runs.KINDS))]
        rows += [
            (f"end in the hand, {load}", 1e3 * float(np.hypot(values["x"], values["y"])), "end"),
            (f"angle in the hand, {load}", float(np.degrees(values["theta"])), "turned"),
        ]
    if "drake" in found:
        rows += [
            (f"creep, Drake, {way}, dt {dt}", 1e6 * values["creep"], "creep")
            for dt, ways in found["drake"]["creep"].items()
            for way, values in ways.items()
            if way.startswith(PATCHES)
        ]
        rows += _stops("Drake, ", found["drake"]["disc"])
    cause = "The time step, and the normal contact of the simulator."
    return [
        compare(name, value, 0.0, "converged" if kind in ("end", "turned") else "closed form", *TOLERANCES[kind], cause)
        for name, value, kind in rows
    ]


def _stops(where: str, discs: Numbers) -> list[tuple[str, float, str]]:
    """Return rows of the errors of discs on patches."""
    return [
        (f"{what} of the disc, {where}{start}, {way}", 100 * values[what], what)
        for start, ways in discs.items()
        for way, values in ways.items()
        if way.startswith(PATCHES)
        for what in ("distance", "angle")
    ]


def _tables(found: Mapping[str, Any]) -> list[Table]:
    """Return the tables: ways as rows, cases as columns, each number with its unit."""
    result = [
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
        _costs("Time of a step, over that with impratio 10", found["cost"], OWN, ".2f"),
    ]
    if drake := found.get("drake"):
        creep = lambda values: f"{length(values['creep'])}/s"  # noqa: E731
        result += [
            _by_way("Drake, a box on an incline of 0.3 rad: creep", drake["creep"], creep),
            _by_way("Drake, the disc: errors of distance and angle", drake["disc"], _stop),
            _costs("Drake, time of a step of the box, over that without patches", drake["cost"], "lagged", ".1f"),
        ]
    return result


def _costs(title: str, cases: Numbers, own: str, spec: str) -> Table:
    """Return a table of times over those of one way."""
    shares = {
        f"{case} ({1e6 * ways[own]['seconds']:.0f} us)": {
            way: {"ratio": values["seconds"] / ways[own]["seconds"]} for way, values in ways.items()
        }
        for case, ways in cases.items()
    }
    return _by_way(title, shares, lambda values: format(values["ratio"], spec))


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


def _template_values(found: Mapping[str, Any]) -> dict[str, Any]:
    """Return the values that the template names."""

    def worst(kind: str, way: str, *keys: str) -> float:
        return max(abs(case[way][key]) for case in found[kind].values() for key in keys)

    reduced = next(iter(runs.KINDS))
    touching = [f"{name}, {touch}" for touch in TOUCHES for name in TOUCHING]
    creeps = [item for case in found.get("drake", {"creep": {}})["creep"].values() for item in case.items()]
    sides = {ours: [abs(v["creep"]) for way, v in creeps if way.startswith(PATCHES) is ours] for ours in (True, False)}
    return {
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
        "drake": {"own": min(sides[False]), "patches": max(sides[True])} if creeps else None,
    }


# ---------------------------------------------------------------------- figure

COLOURS = {"patches, distributed": looks.DISTRIBUTED, "patches": looks.MOMENTS, "without": looks.EXACT}
"""Colours by the beginning of a way's name; the simulator's own friction has another one."""


def _overview(found: Mapping[str, Any]) -> PlotFigure:
    """Draw what each kind of friction gets wrong and costs in six panels: a row for each way, a point for each case."""
    percent, height = (1e-3, 1e2), lambda v, _: 1e3 * float(np.hypot(v["x"], v["y"]))
    creep = lambda v, _: np.inf if v["dropped"] else 1e6 * v["creep"]  # noqa: E731
    panels: tuple[tuple[str, str, tuple[float, float], Callable[..., float]], ...] = (
        ("held", "creep of what is held [µm/s]", (1e-6, 1e5), creep),
        ("shaken", "slip while shaken [µm]", (1e-2, 1e5), lambda v, _: 1e6 * v["slip"]),
        ("in hand", "end in the hand, error [mm]", (0.1, 1e3), height),
        ("disc", "distance of the disc, error [%]", percent, lambda v, _: 100.0 * abs(v["distance"])),
        ("disc", "angle of the disc, error [%]", percent, lambda v, _: 100.0 * abs(v["angle"])),
        ("cost", "time of a step, ratio", (0.1, 10.0), lambda v, case: v["seconds"] / case[OWN]["seconds"]),
    )
    figure = new_figure(11.0, 6.0)
    for axes, (kind, label, limits, value) in zip(figure.subplots(2, 3).flat, panels, strict=True):
        ways = list(next(iter(found[kind].values())))
        for row, way in enumerate(ways):
            shown = [value(case[way], case) for case in found[kind].values()]
            colour = next((COLOURS[begin] for begin in COLOURS if way.startswith(begin)), looks.OTHERS[2])
            # beyond the axis: at its edge, an arrow
            for x in shown:
                marker = "<" if x < limits[0] else ">" if x > limits[1] else "o"
                axes.plot(np.clip(x, *limits), row, marker, color=colour, ms=6, alpha=0.75, clip_on=False, mew=0)
        axes.set(xscale="log", xlim=limits, xlabel=label, ylim=(len(ways) - 0.5, -0.5))
        axes.set_yticks(range(len(ways)), ways, fontsize="small")
        tidy(axes)
    return figure
