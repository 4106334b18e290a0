"""The in-hand experiment: a plate that slips and sticks between two fingers, distributed against reduced."""

from __future__ import annotations

from functools import partial
from typing import Any, Literal

import numpy as np

from planarfriction.plots.style import PlotFigure
from planarfriction.scenes.ready import FINE, GRAVITY
from planarfriction.scenes.scene import ATOL, RTOL
from planarfriction_studies.experiments import experiment, facts, looks
from planarfriction_studies.experiments.experiment import (
    POSE,
    UNITS,
    Arrays,
    Comparison,
    Result,
    Work,
    entry,
)
from planarfriction_studies.experiments.in_hand import figures, runs
from planarfriction_studies.experiments.in_hand.runs import (
    FRICTION_CHANGE,
    LESS,
    MORE,
    TIGHT,
    Case,
)
from planarfriction_studies.experiments.runs import NAMES, Kind, simulated
from planarfriction_studies.experiments.wording import report

LOADS: tuple[Literal[1, 2], ...] = (1, 2)

CASES = (
    *(
        Case(shape, load)
        for shape in ("Circle", "Square", "LineGradX")
        for load in LOADS
    ),
    *(Case("Circle", load, 2) for load in LOADS),
)
"""Cases in the order of the report."""

KINDS: tuple[Kind, Kind] = ("d", "r")

FINER = 63
"""Cells along a side of the grid that is three times finer."""

REDUCED, DEFAULTS, FINER_GRID = (
    "reduced model instead",
    "default tolerances",
    "three times finer grid",
)
CHANGES = {
    MORE: MORE,
    LESS: LESS,
    REDUCED: "r",
    DEFAULTS: "d, defaults",
    FINER_GRID: FINER_GRID,
}
"""Changes that shift the end -> the name of the run that has it."""

Runs = dict[tuple[Case, str], Arrays]


def run(work: Work) -> Result:
    """Carry out the experiment."""
    cases = CASES[:2] if work.quick else CASES
    found = _simulate_all(work, cases)
    numbers = {case.words: _numbers(case, found) for case in cases}
    accuracy = _accuracy(cases, found)
    groups = {
        f"{case.shape}_placement_{case.placement}": case
        for case in cases
        if case.load == 1
    }
    kept = {
        "cases": numbers,
        "accuracy": accuracy,
        "tolerances": {"report": TIGHT, "friction and grid": FINE},
    }
    words = {
        stem: {"words": case.group, "published": case.has_references}
        for stem, case in groups.items()
    }
    return report(
        "in_hand",
        _figures(cases, found, numbers, groups),
        kept,
        _template_values(cases, found, numbers, accuracy) | {"groups": words},
        comparisons=_comparisons(cases, found),
        tables=(_end_table(numbers), _shift_table(numbers), _accuracy_table(accuracy)),
        data={
            stem: _dataset(_group(case, cases), found) for stem, case in groups.items()
        },
    )


def _group(case: Case, cases: tuple[Case, ...]) -> list[Case]:
    """Return all loads of the shape and the placement of a case."""
    return [each for each in cases if each.group == case.group]


def _dataset(group: list[Case], found: Runs) -> Any:
    columns = {
        (NAMES[kind], f"load {each.load}"): found[each, kind]
        for kind in KINDS
        for each in group
    }
    return experiment.dataset(
        columns,
        runs.STORED,
        ("model", "load"),
        ("time", found[group[0], "d"]["time"], "s"),
    )


def _simulate_all(work: Work, cases: tuple[Case, ...]) -> Runs:
    """Simulate every run, by its case and a model's letter or the name of a change."""
    computes = {}
    for case in cases:
        for kind in KINDS:
            computes[case, kind] = partial(simulated, case.scene(kind), **TIGHT)
            computes[case, f"{kind}, defaults"] = partial(simulated, case.scene(kind))
        for words, law in runs.CHANGED.items():
            computes[case, words] = partial(simulated, case.scene("d", law), **FINE)
        if case.shape == "Square":
            computes[case, FINER_GRID] = partial(
                simulated, case.scene("d", cells=FINER), **FINE
            )
    return work.pieces(computes, lambda key: f"in-hand, {key[0].words}, {key[1]}")


def _numbers(case: Case, found: Runs) -> dict[str, Any]:
    distributed = found[case, "d"]
    reduced = found[case, "r"]
    changed = {
        words: found[case, name]
        for words, name in CHANGES.items()
        if (case, name) in found
    }
    shifts = {
        words: runs.end_distance(run, distributed) for words, run in changed.items()
    }
    return {
        "end": {NAMES[kind]: runs.end(found[case, kind]) for kind in KINDS},
        "shift of the end [m]": shifts,
        "largest distance between the models [m]": float(
            runs.distance(reduced, distributed).max()
        ),
        "angle between the models at the end [rad]": float(
            reduced["theta"][-1] - distributed["theta"][-1]
        ),
        "distance between the models as friction": (
            FRICTION_CHANGE * shifts[REDUCED] / (0.5 * (shifts[MORE] + shifts[LESS]))
        ),
        "default tolerances, reduced [m]": runs.end_distance(
            found[case, "r, defaults"], reduced
        ),
        "smallest load [N]": float(distributed["normal_force"].min()),
        "load that holds the start [N]": case.holding_load(float(distributed["x"][0])),
        "load that holds the end [N]": case.holding_load(float(distributed["x"][-1])),
    }


def _accuracy(
    cases: tuple[Case, ...], found: Runs
) -> dict[str, dict[str, dict[str, float]]]:
    """Return the largest distance from the converged solution by run: ours at two tolerances, and the published one."""
    result = {}
    for case in (case for case in cases if case.has_references):
        for kind in KINDS:
            key = case.key(kind)
            ours, defaults = (
                runs.errors(found[case, kind + ending], key)
                for ending in ("", ", defaults")
            )
            figure = {
                name: float(facts.published_curve(f"{key}/{name}").deviation or 0.0)
                for name in ours
            }
            result[f"{case.words}, {NAMES[kind]}"] = {
                "report": ours,
                "default": defaults,
                "published": figure,
            }
    return result


def _comparisons(cases: tuple[Case, ...], found: Runs) -> list[Comparison]:
    rows = [
        _compare_load(case, found)
        for case in cases
        if case.has_references and case.shape == "Circle"
    ]
    for case in cases:
        for kind in KINDS:
            run = found[case, kind]
            words = f"{case.words}, {NAMES[kind]}"
            if case.has_references:
                rows += runs.compare_with_published(run, case.key(kind), words)
                rows += runs.compare_with_converged(run, case.key(kind), words)
                defaults = found[case, f"{kind}, defaults"]
                rows += runs.compare_with_converged(
                    defaults, case.key(kind), words, default=True
                )
            if case.load == 2:
                rows += _compare_rest(case, run, words)
    return rows


def _compare_load(case: Case, found: Runs) -> Comparison:
    """Compare the published load with ours at its own labels: a value holds until the next sample, which records it."""
    run = found[case, "d"]
    words = f"load {case.load}"
    cause = "The same samples: what is left is the error of reading the figure, known to a third or so."
    curve = f"in_hand/load/{case.load}"
    return experiment.compare_curve(
        words, run["time"][:-1], run["normal_force"][1:], curve, 1e-8, cause
    )


def _compare_rest(case: Case, run: Arrays, words: str) -> list[Comparison]:
    """Compare the wrench of one finger on the plate at rest, at the end of load 2: it carries half the weight."""
    scene = case.scene("d")
    weight = scene.body.mass * GRAVITY / scene.contacts[0].count
    closed = {
        "fx": (0.0, 1e-9),
        "fy": (weight, 1e-9),
        "tau": (weight * float(run["x"][-1]), 1e-11),
    }
    cause = "Each finger carries half the weight: what is left is rounding, and the bristles' last settling."
    rows = (
        (f"{words}, at rest, {name}", run[name][-1], *each, UNITS[name], cause)
        for name, each in closed.items()
    )
    return experiment.compare_all("closed form", rows)


def _template_values(
    cases: tuple[Case, ...],
    found: Runs,
    numbers: dict[str, dict[str, Any]],
    accuracy: dict[str, Any],
) -> dict[str, Any]:
    """Return the values that the template names."""
    shifts = {case: each["shift of the end [m]"] for case, each in numbers.items()}
    apart = sorted((each[REDUCED], case) for case, each in shifts.items())
    friction = {case: max(each[MORE], each[LESS]) for case, each in shifts.items()}
    touchiest = max(friction, key=friction.__getitem__)
    more = shifts[touchiest][MORE]
    less = shifts[touchiest][LESS]
    loads = numbers[touchiest]
    return {
        "worst": {
            who: {
                name: max(row[who][name] for row in accuracy.values())
                for name in ("y", "theta", "fy")
            }
            for who in ("report", "default", "published")
        },
        "nearest": apart[0][::-1],
        "farthest": apart[-1][::-1],
        "solver": max(each[DEFAULTS] for each in shifts.values()),
        "friction": friction,
        "touchiest": touchiest,
        "one_sided": {"more": more, "less": less}
        if max(more, less) > 1.5 * min(more, less)
        else None,
        "shares": [
            each["distance between the models as friction"] for each in numbers.values()
        ],
        "change": FRICTION_CHANGE,
        "margin": abs(
            loads["load that holds the end [N]"] / loads["smallest load [N]"] - 1.0
        ),
        "where": _where_forces_differ(cases, found),
        "starts": runs.CENTRES_OF_MASS,
        "default_tolerances": (RTOL, ATOL),
        "far": any(case.placement == 2 for case in cases),
    }


def _where_forces_differ(cases: tuple[Case, ...], found: Runs) -> dict[str, Any]:
    """Return the run and the time [s] at which fy at the default tolerances is farthest from the converged one."""
    every = []
    for case in (case for case in cases if case.has_references):
        for kind in KINDS:
            run = found[case, f"{kind}, defaults"]
            reference = facts.converged(case.key(kind))
            difference = np.abs(run["fy"][1:] - reference["fy"])
            at = int(difference.argmax())
            every.append(
                (
                    float(difference[at]),
                    f"{case.words}, {NAMES[kind]}",
                    float(reference["time"][at]),
                )
            )
    _, case, time = max(every)
    return {"words": case, "time": time}


def _figures(
    cases: tuple[Case, ...],
    found: Runs,
    numbers: dict[str, Any],
    groups: dict[str, Case],
) -> dict[str, PlotFigure]:
    """Return the motion and forces of each shape and placement under both loads, and the distances of the models."""
    shown = [case for case in groups.values() if case.shape == "Circle"]
    result = {
        "motion": figures.strobes(
            {case.words: (case.scene("d"), found[case, "d"]) for case in shown}
        )
    }
    for stem, case in groups.items():
        group = {f"load {each.load}": each for each in _group(case, cases)}
        panels = {
            load: {NAMES[kind]: found[each, kind] for kind in KINDS}
            for load, each in group.items()
        }
        keys = {
            load: {NAMES[kind]: each.key(kind) for kind in KINDS}
            for load, each in group.items()
        }
        published = keys if case.has_references else None
        for what, names in (
            ("motion", ("normal_force", "x", "y", "theta")),
            ("forces", ("fx", "fy", "tau")),
        ):
            result[f"{stem}_{what}"] = figures.histories(
                panels, names, published=published
            )
    lines = {
        f"load {load}": {
            case.group: (
                found[case, "d"]["time"],
                runs.distance(found[case, "r"], found[case, "d"]),
            )
            for case in cases
            if case.load == load
        }
        for load in LOADS
    }
    shifts = {case: each["shift of the end [m]"] for case, each in numbers.items()}
    colours = {
        REDUCED: looks.PUBLISHED,
        DEFAULTS: looks.OTHERS[0],
        FINER_GRID: looks.OTHERS[2],
    }
    return result | {
        "distance": figures.distances(lines, "reduced from distributed [mm]"),
        "what_moves_the_end": figures.end_shifts(
            shifts, colours, "shift of the end [mm]"
        ),
    }


def _end_table(numbers: dict[str, dict[str, Any]]) -> experiment.Table:
    axes = {name: looks.AXES[name] for name in POSE}
    columns = {
        f"{label.replace('$', '')}, {NAMES[kind]}": entry(
            "end", NAMES[kind], name, scale=factor
        )
        for kind in KINDS
        for name, (label, factor) in axes.items()
    } | {
        "distance at the end [mm]": entry("shift of the end [m]", REDUCED, scale=1e3),
        "largest [mm]": entry("largest distance between the models [m]", scale=1e3),
        "angle [deg]": lambda each: float(
            np.degrees(each["angle between the models at the end [rad]"])
        ),
    }
    title = "Where the plate is after 2 s, and how far the models are apart"
    return experiment.table(title, numbers, columns, "case")


def _shift_table(numbers: dict[str, dict[str, Any]]) -> experiment.Table:
    def shift(each: dict[str, Any], cause: str) -> float | str:
        shifts = each["shift of the end [m]"]
        return 1e3 * shifts[cause] if cause in shifts else ""

    loads = (
        "load that holds the start [N]",
        "load that holds the end [N]",
        "smallest load [N]",
    )
    columns: dict[str, Any] = {
        f"{cause} [mm]": partial(shift, cause=cause) for cause in CHANGES
    } | {
        "default tolerances, reduced [mm]": entry(
            "default tolerances, reduced [m]", scale=1e3
        ),
        "models apart, as friction [%]": entry(
            "distance between the models as friction", scale=1e2
        ),
    }
    note = (
        "Shifts are those of the distributed model's end. A load holds the plate if its weight lies on the limit "
        "surface of the cells, with $\\mu_s$."
    )
    columns |= {name: entry(name) for name in loads}
    return experiment.table("What moves the end", numbers, columns, "case", note)


def _accuracy_table(
    accuracy: dict[str, dict[str, dict[str, float]]],
) -> experiment.Table:
    whose = {
        "default": "default tolerances",
        "report": "tolerances of this report",
        "published": "published curve",
    }
    units = {
        "position [µm]": (1e6, ("x", "y")),
        "θ [µrad]": (1e6, ("theta",)),
        "force [mN]": (1e3, ("fx", "fy")),
    }
    columns = {
        f"{words}: {unit}": lambda each, who=who, factor=factor, names=names: (
            factor * max(each[who][n] for n in names)
        )
        for who, words in whose.items()
        for unit, (factor, names) in units.items()
    }
    title = (
        "Largest distance from the converged solution of the same model, one coordinate"
    )
    return experiment.table(title, accuracy, columns, "run")
