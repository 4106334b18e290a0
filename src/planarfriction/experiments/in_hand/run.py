"""The in-hand experiment: a plate that slips and sticks between two fingers, distributed against reduced."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np

from planarfriction.experiments import facts
from planarfriction.experiments.experiment import (
    Arrays,
    Comparison,
    Result,
    Work,
    compare_curve,
    compare_number,
)
from planarfriction.experiments.in_hand import figures
from planarfriction.experiments.in_hand.runs import (
    CENTRES_OF_MASS,
    FRICTION_CHANGE,
    TIGHT,
    Case,
    compare_with_converged,
    compare_with_published,
    dataset,
    distance,
    end,
    end_distance,
    errors,
    simulated,
    with_friction,
)
from planarfriction.experiments.in_hand.tables import (
    DEFAULTS,
    FINER_GRID,
    LESS,
    MORE,
    REDUCED,
    accuracy_table,
    end_table,
    shift_table,
)
from planarfriction.experiments.runs import NAMES, Kind
from planarfriction.experiments.wording import fill
from planarfriction.plots.style import PlotFigure
from planarfriction.scenes.ready import FINE, GRAVITY
from planarfriction.scenes.scene import ATOL, RTOL

LOADS: tuple[Literal[1, 2], ...] = (1, 2)

CASES = (
    *(Case(shape, load) for shape in ("Circle", "Square", "LineGradX") for load in LOADS),
    *(Case("Circle", load, 2) for load in LOADS),
)
"""In the order of the report."""

KINDS: tuple[Kind, Kind] = ("d", "r")

FINER = 63
"""Cells along a side of the grid that is three times finer."""

Runs = dict[tuple[Case, str], Arrays]


def run(work: Work) -> Result:
    """Carry out the experiment."""
    cases = CASES[:2] if work.quick else CASES
    runs = _simulate_all(work, cases)
    shifts = {case: _shifts(case, runs) for case in cases}
    numbers = {case.words: _numbers(case, runs, shifts[case]) for case in cases}
    accuracy = _accuracy(cases, runs)
    said = fill("in_hand", **_told(cases, runs, numbers, accuracy))
    return said.result(
        _figures(cases, runs, shifts),
        comparisons=_comparisons(cases, runs),
        numbers={"cases": numbers, "accuracy": accuracy, "tolerances": {"report": TIGHT, "friction and grid": FINE}},
        tables=(end_table(numbers), shift_table(numbers), accuracy_table(accuracy)),
        data={
            f"{case.shape}_placement_{case.placement}": dataset(
                {
                    (NAMES[kind], f"load {each.load}"): runs[each, kind]
                    for kind in KINDS
                    for each in _group(case, cases)
                },
                ("model", "load"),
            )
            for case in cases
            if case.load == 1
        },
    )


def _group(case: Case, cases: tuple[Case, ...]) -> list[Case]:
    """All loads of the shape and the placement of a case."""
    return [each for each in cases if each.group == case.group]


def _simulate_all(work: Work, cases: tuple[Case, ...]) -> Runs:
    """Every run by its case and what it is: a model's letter, or the name of a change."""
    keys: dict[str, tuple[Case, str]] = {}
    computes = {}
    for case in cases:
        scenes: dict[str, tuple[Any, dict[str, float]]] = {kind: (case.scene(kind), TIGHT) for kind in KINDS}
        scenes |= {f"{kind}, defaults": (case.scene(kind), {}) for kind in KINDS}
        scenes |= {
            words: (case.scene("d", with_friction(sign * FRICTION_CHANGE)), FINE)
            for words, sign in ((MORE, 1), (LESS, -1))
        }
        if case.shape == "Square":
            scenes[FINER_GRID] = (case.scene("d", cells=FINER), FINE)
        for name, (scene, tolerances) in scenes.items():
            label = f"in-hand, {case.words}, {name}"
            keys[label], computes[label] = (case, name), simulated(scene, **tolerances)
    return {keys[label]: found for label, found in work.pieces(computes).items()}


def _shifts(case: Case, runs: Runs) -> dict[str, float]:
    """How far each change moves the end of the distributed model's run [m]."""
    changed = {MORE: MORE, LESS: LESS, REDUCED: "r", DEFAULTS: "d, defaults", FINER_GRID: FINER_GRID}
    base = runs[case, "d"]
    return {words: end_distance(runs[case, name], base) for words, name in changed.items() if (case, name) in runs}


def _numbers(case: Case, runs: Runs, shifts: dict[str, float]) -> dict[str, Any]:
    distributed, reduced = runs[case, "d"], runs[case, "r"]
    friction = 0.5 * (shifts[MORE] + shifts[LESS])
    return {
        "end": {NAMES[kind]: end(runs[case, kind]) for kind in KINDS},
        "shift of the end [m]": shifts,
        "largest distance between the models [m]": float(distance(reduced, distributed).max()),
        "angle between the models at the end [rad]": float(reduced["theta"][-1] - distributed["theta"][-1]),
        "distance between the models as friction": FRICTION_CHANGE * shifts[REDUCED] / friction,
        "default tolerances, reduced [m]": end_distance(runs[case, "r, defaults"], reduced),
        "smallest load [N]": float(distributed["normal_force"].min()),
        "load that holds the start [N]": case.holding_load(float(distributed["x"][0])),
        "load that holds the end [N]": case.holding_load(float(distributed["x"][-1])),
    }


def _accuracy(cases: tuple[Case, ...], runs: Runs) -> dict[str, dict[str, dict[str, float]]]:
    """Largest distance from the converged solution by run: ours at two tolerances, and the published curve's."""
    result = {}
    for case in cases:
        for kind in KINDS if case.has_references else ():
            key = case.key(kind)
            ours = errors(runs[case, kind], key)
            figure = {name: float(facts.published_curve(f"{key}/{name}").deviation or 0.0) for name in ours}
            defaults = errors(runs[case, f"{kind}, defaults"], key)
            result[f"{case.words}, {NAMES[kind]}"] = {"report": ours, "default": defaults, "published": figure}
    return result


def _comparisons(cases: tuple[Case, ...], runs: Runs) -> list[Comparison]:
    rows = [_compare_load(case, runs) for case in cases if case.has_references and case.shape == "Circle"]
    for case in cases:
        for kind in KINDS:
            words = f"{case.words}, {NAMES[kind]}"
            if case.has_references:
                rows += compare_with_published(runs[case, kind], case.key(kind), words)
                rows += compare_with_converged(runs[case, kind], case.key(kind), words)
                rows += compare_with_converged(runs[case, f"{kind}, defaults"], case.key(kind), words, default=True)
            if case.load == 2:
                rows += _compare_rest(case, runs[case, kind], words)
    return rows


def _compare_load(case: Case, runs: Runs) -> Comparison:
    """The published load at its own labels: each value holds until the next sample, where it is recorded."""
    run = runs[case, "d"]
    return compare_curve(
        f"load {case.load}", run["time"][:-1], run["normal_force"][1:], f"in_hand/load/{case.load}", allowance=1e-8,
        cause="The same samples: what is left is the error of reading the figure, known to a third or so.",
    )  # fmt: skip


def _compare_rest(case: Case, run: Arrays, words: str) -> list[Comparison]:
    """The wrench of one finger on the plate at rest, at the end of load 2: it carries its share of the weight."""
    scene = case.scene("d")
    weight = scene.body.mass * GRAVITY / scene.contacts[0].count
    closed = {"fx": (0.0, "N"), "fy": (weight, "N"), "tau": (weight * float(run["x"][-1]), "N m")}
    return [
        compare_number(
            f"{words}, at rest, {name}", run[name][-1], value, reference="closed form", tolerance=tolerance, unit=unit,
            cause="Each finger carries half the weight: what is left is rounding, and the bristles' last settling.",
        )
        for (name, (value, unit)), tolerance in zip(closed.items(), (1e-9, 1e-9, 1e-11), strict=True)
    ]  # fmt: skip


def _told(
    cases: tuple[Case, ...], runs: Runs, numbers: dict[str, dict[str, Any]], accuracy: dict[str, Any]
) -> dict[str, Any]:
    """What the template names."""
    worst = {
        who: {name: max(row[who][name] for row in accuracy.values()) for name in ("y", "theta", "fy")}
        for who in ("report", "default", "published")
    }
    shifts = {case: each["shift of the end [m]"] for case, each in numbers.items()}
    apart = sorted((each[REDUCED], case) for case, each in shifts.items())
    friction = {case: max(each[MORE], each[LESS]) for case, each in shifts.items()}
    touchiest = max(friction, key=friction.__getitem__)
    more, less = shifts[touchiest][MORE], shifts[touchiest][LESS]
    loads = numbers[touchiest]
    return {
        "ours": worst["report"],
        "theirs": worst["published"],
        "default": worst["default"],
        "nearest": apart[0][::-1],
        "farthest": apart[-1][::-1],
        "solver": max(each[DEFAULTS] for each in shifts.values()),
        "friction": friction,
        "touchiest": touchiest,
        "one_sided": {"more": more, "less": less} if max(more, less) > 1.5 * min(more, less) else None,
        "shares": [each["distance between the models as friction"] for each in numbers.values()],
        "change": FRICTION_CHANGE,
        "first_case": cases[0].words,
        "first": numbers[cases[0].words],
        "margin": abs(loads["load that holds the end [N]"] / loads["smallest load [N]"] - 1.0),
        "where": _where_forces_differ(cases, runs),
        "starts": CENTRES_OF_MASS,
        "tight": TIGHT,
        "rtol": RTOL,
        "atol": ATOL,
        "far": any(case.placement == 2 for case in cases),
        "groups": {
            _stem(case): {"words": case.group, "published": case.has_references} for case in cases if case.load == 1
        },
    }


def _stem(case: Case) -> str:
    return f"{case.shape}_placement_{case.placement}"


def _where_forces_differ(cases: tuple[Case, ...], runs: Runs) -> dict[str, Any]:
    """The run and the time [s] at which fy at the default tolerances is farthest from the converged one."""
    found = []
    for case in cases:
        for kind in KINDS if case.has_references else ():
            run, reference = runs[case, f"{kind}, defaults"], facts.converged(case.key(kind))
            difference = np.abs(run["fy"][1:] - reference["fy"])
            at = int(difference.argmax())
            found.append((float(difference[at]), f"{case.words}, {NAMES[kind]}", float(reference["time"][at])))
    _, case, time = max(found)
    return {"words": case, "time": time}


def _figures(cases: tuple[Case, ...], runs: Runs, shifts: dict[Case, dict[str, float]]) -> dict[str, PlotFigure]:
    shown = [case for case in cases if case.shape == "Circle" and case.load == 1]
    result = {"motion": figures.strobes({case.words: (case.scene("d"), runs[case, "d"]) for case in shown})}
    for case in cases:
        if case.load == 1:
            result |= _histories(case, _group(case, cases), runs)
    lines = {
        f"load {load}": {
            case.group: (runs[case, "d"]["time"], distance(runs[case, "r"], runs[case, "d"]))
            for case in cases
            if case.load == load
        }
        for load in LOADS
    }
    result["distance"] = figures.distances(lines, "reduced from distributed [mm]")
    result["what_moves_the_end"] = figures.end_shifts({case.words: shifts[case] for case in cases})
    return result


def _histories(case: Case, group: list[Case], runs: Runs) -> dict[str, PlotFigure]:
    """Motion and forces of one shape and placement under both loads."""
    panels = {f"load {each.load}": {NAMES[kind]: runs[each, kind] for kind in KINDS} for each in group}
    published = {
        f"load {each.load}": {NAMES[kind]: each.key(kind) for kind in KINDS} for each in group if each.has_references
    }
    columns = {"motion": ("normal_force", "x", "y", "theta"), "forces": ("fx", "fy", "tau")}
    return {
        f"{_stem(case)}_{what}": figures.histories(panels, names, published=published)
        for what, names in columns.items()
    }
