"""The in-hand experiment: a plate that slips and sticks between two fingers, distributed against reduced."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np

from planarfriction.experiments import facts
from planarfriction.experiments.experiment import (
    Arrays,
    Comparison,
    Picture,
    Result,
    Work,
    compare_curve,
    compare_number,
)
from planarfriction.experiments.in_hand import figures as in_hand_figures
from planarfriction.experiments.in_hand.runs import (
    CENTRES_OF_MASS,
    DEFAULT_ALLOWANCE,
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
    return Result(
        findings=_findings(cases, runs, numbers, accuracy),
        pictures=_pictures(cases, runs, shifts),
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


def _findings(
    cases: tuple[Case, ...], runs: Runs, numbers: dict[str, dict[str, Any]], accuracy: dict[str, Any]
) -> list[str]:
    worst = {
        who: {name: max(row[who][name] for row in accuracy.values()) for name in ("y", "theta", "fy")}
        for who in ("report", "default", "published")
    }
    ours, theirs, default = worst["report"], worst["published"], worst["default"]
    distances = {words: each["shift of the end [m]"][REDUCED] for words, each in numbers.items()}
    nearest, farthest = min(distances, key=distances.__getitem__), max(distances, key=distances.__getitem__)
    friction = {words: _friction_shift(each) for words, each in numbers.items()}
    touchiest = max(friction, key=friction.__getitem__)
    shares = [each["distance between the models as friction"] for each in numbers.values()]
    solver = max(each["shift of the end [m]"][DEFAULTS] for each in numbers.values())
    first = numbers[cases[0].words]
    x = {placement: 1e3 * start[0] for placement, start in CENTRES_OF_MASS.items()}
    return [
        "A plate hangs between two finger pads whose grip varies: each time it is too weak, the plate slips and "
        f"turns, then sticks again. Its centre of mass starts {x[1]:g} mm beside the pads, in the far placement "
        f"{x[2]:g} mm. All curves here are computed with rtol = {TIGHT['rtol']:.0e}, atol = {TIGHT['atol']:.0e}. They "
        f"lie within {ours['y'] * 1e9:.0f} nm, {ours['theta'] * 1e6:.2f} µrad and {ours['fy'] * 1e6:.1f} µN (fy) of "
        f"the converged solutions; the published curves lie within {theirs['y'] * 1e9:.0f} nm, "
        f"{theirs['theta'] * 1e6:.2f} µrad and {theirs['fy'] * 1e6:.0f} µN of them. So what is left between us and "
        "the paper is the error of its solver.",
        "The distance between the two models is another matter: it belongs to the reduced model and no solver "
        f"removes it. At the end it is {distances[nearest] * 1e3:.2f} mm ({nearest}) to "
        f"{distances[farthest] * 1e3:.2f} mm ({farthest}); the default tolerances move the end of the distributed "
        f"model by {solver * 1e3:.4f} mm at most.",
        f"That distance is best read beside what friction does. {FRICTION_CHANGE:.1%} more or less of both friction "
        f"coefficients moves the end by {min(friction.values()) * 1e3:.2f} to {max(friction.values()) * 1e3:.2f} mm, "
        f"the most for {touchiest}{_one_sided(numbers[touchiest])}; the distance between the models is that of "
        f"{min(shares):.2%} to {max(shares):.2%} of friction. No measured coefficient is that well known.",
        "Where this sensitivity comes from: the load that holds the plate falls as its centre of mass comes under "
        f"the fingers ({cases[0].words}: from {first['load that holds the start [N]']:.3f} N to "
        f"{first['load that holds the end [N]']:.3f} N), towards the smallest load there is "
        f"({first['smallest load [N]']:.3f} N). Friction then exceeds or misses what is needed by very little: at the "
        f"end of {touchiest} the two loads differ by {_margin(numbers[touchiest]):.2%}.",
        f"At the default tolerances (rtol = {RTOL:.0e}, atol = {ATOL:.0e}) motions are within "
        f"{default['y'] * 1e6:.1f} µm and {default['theta'] * 1e6:.1f} µrad of the converged ones (promised: "
        f"{DEFAULT_ALLOWANCE['m'] * 1e6:.0f} µm, {DEFAULT_ALLOWANCE['rad'] * 1e6:.0f} µrad), single samples of fy "
        f"only within {default['fy'] * 1e3:.1f} mN: {_where_forces_differ(cases, runs)} Near a slip the force follows "
        "the velocity, and a small shift in time shows.",
    ]


def _friction_shift(numbers: dict[str, Any]) -> float:
    shifts = numbers["shift of the end [m]"]
    return max(shifts[MORE], shifts[LESS])


def _margin(numbers: dict[str, Any]) -> float:
    """Difference between the smallest load and the one that holds the end, as a share of the former."""
    return abs(numbers["load that holds the end [N]"] / numbers["smallest load [N]"] - 1.0)


def _one_sided(numbers: dict[str, Any]) -> str:
    """Says so where more and less friction do not move the end alike."""
    shifts = numbers["shift of the end [m]"]
    if max(shifts[MORE], shifts[LESS]) < 1.5 * min(shifts[MORE], shifts[LESS]):
        return ""
    return f" ({shifts[MORE] * 1e3:.2f} mm with more, {shifts[LESS] * 1e3:.2f} mm with less: far from linear)"


def _where_forces_differ(cases: tuple[Case, ...], runs: Runs) -> str:
    """When fy at the default tolerances is farthest from the converged one, and how fast it changes there."""
    found = []
    for case in cases:
        for kind in KINDS if case.has_references else ():
            run, reference = runs[case, f"{kind}, defaults"], facts.converged(case.key(kind))
            difference = np.abs(run["fy"][1:] - reference["fy"])
            at = int(difference.argmax())
            found.append((float(difference[at]), f"{case.words}, {NAMES[kind]}", float(reference["time"][at])))
    _, words, time = max(found)
    return f"the largest difference is that of {words} at {time:.2f} s."


def _pictures(cases: tuple[Case, ...], runs: Runs, shifts: dict[Case, dict[str, float]]) -> list[Picture]:
    shown = [case for case in cases if case.shape == "Circle" and case.load == 1]
    panels = {case.words: (case.scene("d"), runs[case, "d"]) for case in shown}
    pictures = [Picture("motion", _MOTION, in_hand_figures.strobes(panels))]
    for case in cases:
        if case.load == 1:
            pictures += _histories(case, _group(case, cases), runs)
    lines = {
        f"load {load}": {
            case.group: (runs[case, "d"]["time"], distance(runs[case, "r"], runs[case, "d"]))
            for case in cases
            if case.load == load
        }
        for load in LOADS
    }
    figure = in_hand_figures.distances(lines, "reduced from distributed [mm]")
    pictures.append(Picture("distance", "Distance of the centre of mass between the two models over time.", figure))
    figure = in_hand_figures.end_shifts({case.words: shifts[case] for case in cases})
    return [*pictures, Picture("what_moves_the_end", _END, figure)]


def _histories(case: Case, group: list[Case], runs: Runs) -> list[Picture]:
    """Motion and forces of one shape and placement under both loads."""
    panels = {f"load {each.load}": {NAMES[kind]: runs[each, kind] for kind in KINDS} for each in group}
    published = {
        f"load {each.load}": {NAMES[kind]: each.key(kind) for kind in KINDS} for each in group if each.has_references
    }
    note = " Markers: vertices of the published curves." if published else ""
    stem = f"{case.shape}_placement_{case.placement}"
    motion = in_hand_figures.histories(panels, ("normal_force", "x", "y", "theta"), published=published)
    forces = in_hand_figures.histories(panels, ("fx", "fy", "tau"), published=published)
    return [
        Picture(f"{stem}_motion", f"{case.group.capitalize()}: load of one finger and motion.{note}", motion),
        Picture(
            f"{stem}_forces", f"{case.group.capitalize()}: friction wrench of one finger on the plate.{note}", forces
        ),
    ]


_MOTION = (
    "The plate at twelve instants under load 1, distributed model; in orange the pads, which neither move nor turn. "
    "Left the centre of mass starts near the pads, right (far placement) well beside them."
)
_END = (
    "What moves the end of the distributed model's run. The distance to the reduced model is comparable to what a "
    "change of friction does that nobody could measure; grid and tolerances matter far less."
)
