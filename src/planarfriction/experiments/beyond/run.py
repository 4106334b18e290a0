"""Beyond the paper: exact limit surfaces, another reduced model, few cells, loads, friction with a grain."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable
from typing import Any

import numpy as np

from planarfriction.experiments.beyond import driven, figures, in_hand, ladder, others, surfaces, tables
from planarfriction.experiments.beyond import shapes as new_shapes
from planarfriction.experiments.beyond.ladder_figure import draw_ladder
from planarfriction.experiments.beyond.told import told
from planarfriction.experiments.experiment import Arrays, Result, Work
from planarfriction.experiments.in_hand.figures import end_shifts
from planarfriction.experiments.runs import IN_WORDS, SIX_SHAPES
from planarfriction.experiments.wording import fill
from planarfriction.plots.style import PlotFigure

SHAPES = (*SIX_SHAPES, "LineGradX")

QUICK_SHAPES = ("LineGrad", "NonConvex2")

QUICK_TWISTS = 500

FRICTION = "0.1 % of friction"
"""What moves the end beside the models, in the figure of the ends."""

NEW_SHAPES, QUICK_NEW_SHAPES, QUICK_SEEDS = tuple(new_shapes.shapes()), ("three feet",), (0, 1)


def run(work: Work) -> Result:
    """Carry out the experiment."""
    shapes = QUICK_SHAPES if work.quick else SHAPES
    found = work.pieces(
        {f"models, {IN_WORDS[shape]}": _runs_of(shape) for shape in shapes}
        | {f"limit surface, {IN_WORDS[shape]}": _surface_of(shape, work.quick) for shape in shapes}
    )
    rows = [row for shape in shapes for row in _rows_of(found[f"models, {IN_WORDS[shape]}"])]
    errors = {shape: found[f"limit surface, {IN_WORDS[shape]}"] for shape in shapes}
    single: dict[str, Callable[[], dict[str, Any]]] = {
        "plateaus": others.plateaus,
        "grooves": lambda: others.grooves(work.quick),
        "staircase": surfaces.staircase,
    }
    pieces = work.pieces(single)
    spun = work.pieces(
        {f"spin-up, {IN_WORDS[s]}": functools.partial(driven.spin_up, s) for s in shapes if s in SIX_SHAPES}
    )
    unseen = work.pieces(
        {
            f"new shapes, {name}": _new_shape(name, work.quick)
            for name in (QUICK_NEW_SHAPES if work.quick else NEW_SHAPES)
        }
    )
    unseen = {name.removeprefix("new shapes, "): each for name, each in unseen.items()}
    # one after the other: these are measured with a clock
    times = work.piece("time of runs", lambda: _times_of(shapes))
    rows = [dataclasses.replace(row, time=float(times[f"{row.case}|{row.model}"])) for row in rows]
    costs = driven.step_numbers(work.piece("cost of a step", driven.step_costs))
    family = work.piece("soft finger", lambda: others.load_family(work.quick))
    grooved = {name: values.tolist() for name, values in pieces["grooves"].items()}
    numbers = _numbers(rows, found, errors) | {
        "jumps": surfaces.jumps(pieces["staircase"]),
        "plateaus": _floats(pieces["plateaus"]),
        "grooves": grooved,
        "load family": _floats(family),
        "step": costs,
        "spin-up": {shape: _floats(spun[f"spin-up, {IN_WORDS[shape]}"]) for shape in shapes if shape in SIX_SHAPES},
        "new shapes": {name: new_shapes.ratios(each) for name, each in unseen.items()},
    }
    return fill("beyond", **told(numbers)).result(
        _figures(rows, errors, pieces["staircase"], numbers),
        comparisons=[
            *surfaces.comparisons(errors, pieces["staircase"]),
            *driven.comparisons(numbers["driven"]),
            *in_hand.comparisons(numbers["in hand"]),
            *new_shapes.comparisons(unseen),
            *others.comparisons(numbers["plateaus"], grooved),
        ],
        numbers=numbers,
        tables=(*tables.tables(rows, numbers), new_shapes.table(unseen)),
    )


def _figures(
    rows: list[ladder.Row], errors: dict[str, Arrays], stairs: Arrays, numbers: dict[str, Any]
) -> dict[str, PlotFigure]:
    ends = {
        case: {in_hand.ENDS.get(name, FRICTION): each[name] for name in (*in_hand.ENDS, in_hand.SHIFT)}
        for case, each in numbers["in hand"].items()
    }
    return {
        "surface_errors": figures.surface_errors(errors),
        "surface_staircase": figures.staircase(stairs),
        "driven_models": figures.driven_boxes(numbers["driven"]),
        "in_hand_ends": end_shifts(ends),
        "ladder": draw_ladder(rows),
        "grooves": figures.grooves(numbers["grooves"]),
    }


# ------------------------------------------------------------------ pieces


def _surface_of(shape: str, quick: bool) -> Callable[[], dict[str, Any]]:
    with_quartic = surfaces.has_quartic() and shape in surfaces.QUARTIC_SHAPES
    kinds = tuple(name for name in surfaces.KINDS if name != "quartic" or with_quartic)
    return lambda: surfaces.surface_errors(shape, QUICK_TWISTS if quick else surfaces.TWISTS, kinds)


def _new_shape(name: str, quick: bool) -> Callable[[], dict[str, Any]]:
    return lambda: new_shapes.largest_errors(name, QUICK_SEEDS if quick else new_shapes.SEEDS)


def _runs_of(shape: str) -> Callable[[], dict[str, Any]]:
    """A piece: every model of a shape in every run, and what friction does to the in-hand ones."""

    def compute() -> dict[str, Any]:
        cases = in_hand.cases_of(shape)
        rows = ladder.in_hand_rows(cases)
        if shape in SIX_SHAPES:
            rows += ladder.driven_rows((shape,))
        result: dict[str, Any] = {f"shift|{case.words}": in_hand.friction_shift(case) for case in cases}
        for row in rows:
            values = {"states": row.states, **row.errors}
            result |= {f"{row.case}|{row.model}|{name}": value for name, value in values.items()}
        return result

    return compute


def _floats(piece: Arrays) -> dict[str, float]:
    return {name: float(value) for name, value in piece.items()}


def _times_of(shapes: tuple[str, ...]) -> dict[str, float]:
    measured = (ladder.run_times(shape) for shape in shapes)
    return {f"{case}|{model}": value for each in measured for (case, model), value in each.items()}


def _rows_of(piece: Arrays) -> list[ladder.Row]:
    """The rows that a piece holds."""
    runs: dict[tuple[str, str], dict[str, float]] = {}
    for key, value in piece.items():
        parts = key.split("|")
        if len(parts) == 3:
            runs.setdefault((parts[0], parts[1]), {})[parts[2]] = float(value)
    return [ladder.Row(case, model, int(values.pop("states")), values) for (case, model), values in runs.items()]


def _numbers(rows: list[ladder.Row], found: dict[str, Arrays], errors: dict[str, Arrays]) -> dict[str, Any]:
    shifts = {
        key.removeprefix("shift|"): float(value)
        for piece in found.values()
        for key, value in piece.items()
        if key.startswith("shift|")
    }
    moved = driven.driven_errors(rows)
    ends = in_hand.end_distances(rows, shifts)
    return {
        "surfaces": {shape: _statistics(each) for shape, each in errors.items()},
        "quartic installed": surfaces.has_quartic(),
        "driven": moved,
        "driven ratios": driven.ratios(moved),
        "driven ratios, auto": driven.ratios(moved, ladder.AUTO),
        "driven ratios, parts": driven.ratios(moved, ladder.AUTO, "reduced"),
        "in hand": ends,
        "in hand score": {
            model: {f"load {load}": in_hand.score(ends, load, model) for load in (1, 2)}
            for model in ("reduced", ladder.AUTO)
        },
        "run costs": _run_costs(rows),
        "run ratios": _run_ratios(rows),
    }


def _statistics(errors: Arrays) -> dict[str, dict[str, float]]:
    return {
        name: {"median": float(np.median(each)), "mean": float(each.mean()), "max": float(each.max())}
        for name, each in errors.items()
    }


def _run_costs(rows: list[ladder.Row]) -> dict[str, float]:
    """Median over all runs of the time in the solver over that of the distributed model."""
    models = dict.fromkeys(row.model for row in rows)
    return {model: float(np.median([row.time for row in rows if row.model == model])) for model in models}


def _run_ratios(rows: list[ladder.Row]) -> dict[str, list[float]]:
    """Median and quartiles over all runs of the time in the solver over that of the published model in the same run."""
    times = {(row.case, row.model): row.time for row in rows}
    return {
        model: driven.median_and_quartiles(
            [value / times[case, "published"] for (case, other), value in times.items() if other == model]
        )
        for model in dict.fromkeys(row.model for row in rows)
    }
