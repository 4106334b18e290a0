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
        _table(
            "A gripper shaken for 3 s: slip in the hand", found["shaken"], lambda v: f"{_short(1e6 * v['slip'])} um"
        ),
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
            lambda v: f"{_short(1e6 * abs(v['creep']))} um/s",
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
    return f"{_short(1e6 * values['creep'])} um/s, {_short(float(np.degrees(values['spin'])))} deg/s"


def _stop(values: Mapping[str, float]) -> str:
    return f"{100 * values['distance']:+.2f} %, {100 * values['angle']:+.2f} %"


def _end(values: Mapping[str, float]) -> str:
    if abs(values["y"]) > runs.DROPPED:
        return "dropped"
    return f"{1e3 * values['y']:+.1f} mm, {np.degrees(values['theta']):+.1f} deg"


def _short(value: float) -> str:
    """A number that is large, readable, or merely small."""
    if value < 1e-2:
        return f"{value:.0e}"
    return f"{value:.0f}" if value >= 100.0 else f"{value:.3g}"


def findings(found: Mapping[str, Any], versions: Mapping[str, str]) -> Sequence[str]:
    """Where the simulator's own friction suffices, and where not, with the numbers of this run."""

    def worst(kind: str, way: str, *keys: str) -> float:
        return max(abs(case[way][key]) for case in found[kind].values() for key in keys)

    noslip, reduced = "noslip 10", next(iter(runs.KINDS))
    creep = {way: _short(1e6 * worst("held", way, "creep")) for way in (OWN, noslip, PATCHES)}
    slip = _short(1e6 * min(worst("shaken", way, "slip") for way in NATIVE))
    touching = [f"{name}, {touch}" for touch in ("face", "point") for name, _ in TOUCHING]
    stops = 100.0 * min(worst("disc", way, "distance", "angle") for way in touching)
    ends = 1e3 * min(worst("in hand", way, "y") for way in NATIVE)
    ratios = [ways[PATCHES]["seconds"] / ways[OWN]["seconds"] for ways in found["cost"].values()]
    said = [
        f"MuJoCo {versions['mujoco']}, steps of 2 ms. Where a thing is only held, noslip suffices: with 10 iterations"
        f" it creeps by {creep[noslip]} um/s at most, with patches by {creep[PATCHES]} um/s. The elliptic cone alone"
        f" lets it creep by up to {creep[OWN]} um/s.",
        f"While the hand is shaken it does not: the best settings let the block slip by {slip} um, patches by "
        f"{_short(1e6 * worst('shaken', PATCHES, 'slip'))} um, which is the yield of their bristles.",
        f"What slides and turns at once needs the shape of the patch. Whatever its settings, MuJoCo's own friction is"
        f" off by {stops:.0f} % in distance or angle of one of the discs, patches by "
        f"{100.0 * worst('disc', reduced, 'distance', 'angle'):.2f} %; in the hand by {ends:.1f} mm, patches by "
        f"{1e3 * worst('in hand', reduced, 'y'):.1f} mm.",
        f"A step with patches takes {min(ratios):.2f} to {max(ratios):.2f} times that of the elliptic cone.",
    ]
    if "drake" in found:
        cases = found["drake"]["creep"].values()
        own = min(abs(value["creep"]) for case in cases for way, value in case.items() if not way.startswith(PATCHES))
        ours = max(abs(value["creep"]) for case in cases for way, value in case.items() if way.startswith(PATCHES))
        said.append(
            f"Drake {versions['drake']}: a box on an incline creeps by {_short(1e6 * own)} um/s at least, with patches"
            f" by {_short(1e6 * ours)} um/s at most."
        )
    return said
