"""What the comparison of simulators says: its tables, our numbers beside those of theory, and its findings."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from planarfriction.experiments.experiment import Comparison, Table, compare_number
from planarfriction.experiments.simulators import runs
from planarfriction.experiments.simulators.runs import NATIVE, PATCHES

OWN = "impratio 10"
"""The setting that costs are relative to."""

TOUCHING = tuple((name, NATIVE[name]) for name in (OWN, "noslip 10"))
"""Settings that a disc slides with, on its face and on one point."""

TOLERANCES = {
    "creep": (1e-3, "um/s"), "turning": (1e-6, "deg/s"), "displacement": (1.0, "um"), "slip": (1.0, "um"),
    "distance": (0.05, "%"), "angle": (0.2, "%"), "end": (2.5, "mm"), "turned": (0.5, "deg"),
}  # fmt: skip
"""How far patches may be from the closed form, or from the converged run, before it is said."""

Numbers = dict[str, dict[str, dict[str, float]]]
"""Case -> way -> quantity."""


def comparisons(found: Mapping[str, Any]) -> list[Comparison]:
    """Our numbers against rest, and against the exact disc and the converged run."""
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
    return [
        compare_number(
            quantity,
            value,
            0.0,
            reference="converged" if kind in ("end", "turned") else "closed form",
            tolerance=TOLERANCES[kind][0],
            unit=TOLERANCES[kind][1],
            cause="the time step, and the normal contact of the simulator",
        )
        for quantity, value, kind in rows
    ]


def tables(found: Mapping[str, Any]) -> list[Table]:
    """Ways as rows, cases as columns, each number with its unit."""
    return [
        _table("What is held: creep and turning", found["held"], _creep),
        Table(
            "Patches at other time steps: creep, turning and largest displacement",
            ["", *next(iter(found["steps"].values()))],
            [
                [case, *(f"{_creep(values)}; {1e6 * values['moved']:.2f} um" for values in ways.values())]
                for case, ways in found["steps"].items()
            ],
        ),
        _table("A gripper shaken for 3 s: slip in the hand", found["shaken"], lambda v: _length(v["slip"])),
        _table(
            "A disc that slides and spins to rest: errors of distance and angle",
            found["disc"],
            _stop,
        ),
        _table("The published in-hand run: errors of the end in height and angle", found["in hand"], _end),
        _table(
            "Time of a step, over that with impratio 10", _ratios(found["cost"], OWN), lambda v: f"{v['ratio']:.2f}"
        ),
        *(_drake_tables(found["drake"]) if "drake" in found else ()),
    ]


def _drake_tables(found: Mapping[str, Any]) -> list[Table]:
    return [
        _table(
            "Drake, a box on an incline of 0.3 rad: creep",
            found["creep"],
            lambda v: _speed(v["creep"]),
        ),
        _table("Drake, the disc: errors of distance and angle", found["disc"], _stop),
        _table(
            "Drake, time of a step of the box, over that without patches",
            _ratios(found["cost"], "lagged"),
            lambda v: f"{v['ratio']:.1f}",
        ),
    ]


def _ratios(cases: Numbers, own: str) -> Numbers:
    """Times over those of one way."""
    return {
        f"{case} ({1e6 * ways[own]['seconds']:.0f} us)": {
            way: {"ratio": values["seconds"] / ways[own]["seconds"]} for way, values in ways.items()
        }
        for case, ways in cases.items()
    }


def _table(title: str, cases: Numbers, words: Callable[[Mapping[str, float]], str]) -> Table:
    """Ways as rows, cases as columns."""
    ways = next(iter(cases.values()))
    rows = [[way, *(words(case[way]) for case in cases.values())] for way in ways]
    return Table(title, ["", *cases], rows)


def _creep(values: Mapping[str, float]) -> str:
    if values["dropped"]:
        return "dropped"
    turning = abs(float(np.degrees(values["spin"])))
    turns = f"{_short(turning)} deg/s" if turning >= 1e-3 else "< 0.001 deg/s"
    return f"{_speed(values['creep'])}, {turns}"


def _stop(values: Mapping[str, float]) -> str:
    return f"{100 * values['distance']:+.2f} %, {100 * values['angle']:+.2f} %"


def _end(values: Mapping[str, float]) -> str:
    if abs(values["y"]) > runs.DROPPED:
        return "dropped"
    return f"{1e3 * values['y']:+.1f} mm, {np.degrees(values['theta']):+.1f} deg"


def _length(metres: float) -> str:
    """The size of a length in mm, um or nm, whichever reads best."""
    size = abs(metres)
    if size < 1e-12:
        return "< 0.001 nm"
    unit, scale = ("mm", 1e3) if size >= 1e-3 else ("um", 1e6) if size >= 1e-8 else ("nm", 1e9)
    return f"{_short(scale * size) if unit != 'nm' else f'{scale * size:.1g}'} {unit}"


def _speed(metres_per_second: float) -> str:
    """The size of a speed in mm/s, um/s or nm/s."""
    return f"{_length(metres_per_second)}/s"


def _short(value: float) -> str:
    """A number with as many digits as are worth reading."""
    if value < 1e-2:
        return f"{value:.1g}"
    return f"{value:.0f}" if value >= 100.0 else f"{value:.3g}"


def findings(found: Mapping[str, Any], versions: Mapping[str, str]) -> Sequence[str]:
    """Where the simulator's own friction suffices, and where not, with the numbers of this run."""

    def worst(kind: str, way: str, *keys: str) -> float:
        return max(abs(case[way][key]) for case in found[kind].values() for key in keys)

    noslip, reduced = "noslip 10", next(iter(runs.KINDS))
    creep = {way: _speed(worst("held", way, "creep")) for way in (OWN, noslip, PATCHES)}
    slip = _length(min(worst("shaken", way, "slip") for way in NATIVE))
    touching = [f"{name}, {touch}" for touch in ("face", "point") for name, _ in TOUCHING]
    stops = 100.0 * min(worst("disc", way, "distance", "angle") for way in touching)
    ends = 1e3 * min(worst("in hand", way, "y") for way in NATIVE)
    ratios = [ways[PATCHES]["seconds"] / ways[OWN]["seconds"] for ways in found["cost"].values()]
    said = [
        f"MuJoCo {versions['mujoco']}, steps of 2 ms. For an object that is only held, noslip is enough: with 10"
        f" iterations it creeps at {creep[noslip]} at most, with patches at {creep[PATCHES]}. With the elliptic cone"
        f" alone it creeps at up to {creep[OWN]}.",
        f"While the hand is shaken, noslip is not enough: with the best settings the block slips by {slip}, with"
        f" patches by {_length(worst('shaken', PATCHES, 'slip'))}, which is the elastic deflection of their bristles.",
        f"An object that slides and turns at once needs the shape of the patch. With any settings, MuJoCo's own"
        f" friction has an error of {stops:.0f} % in distance or angle for one of the discs, patches"
        f" {100.0 * worst('disc', reduced, 'distance', 'angle'):.2f} %; in the hand the error is {ends:.1f} mm, with"
        f" patches {1e3 * worst('in hand', reduced, 'y'):.1f} mm.",
        f"A step with patches takes {min(ratios):.2f} to {max(ratios):.2f} times as long as with the elliptic cone.",
    ]
    if "drake" in found:
        cases = found["drake"]["creep"].values()
        own = min(abs(value["creep"]) for case in cases for way, value in case.items() if not way.startswith(PATCHES))
        ours = max(abs(value["creep"]) for case in cases for way, value in case.items() if way.startswith(PATCHES))
        said.append(
            f"Drake {versions['drake']}: a box on an incline creeps at {_speed(own)} at least, with patches at"
            f" {_speed(ours)} at most."
        )
    return said
