"""Tables beyond the paper."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

import numpy as np

from planarfriction.experiments.beyond.driven import MODELS, STATISTICS
from planarfriction.experiments.beyond.in_hand import ENDS, SHIFT
from planarfriction.experiments.beyond.ladder import AUTO, Row
from planarfriction.experiments.beyond.surfaces import KINDS
from planarfriction.experiments.experiment import Table
from planarfriction.experiments.runs import IN_WORDS, SIX_SHAPES
from planarfriction.experiments.wording import fmt

Numbers = dict[str, Any]

MODEL_WORDS = {
    "full": "distributed, 21 x 21 cells",
    "published": "published reduced, published table",
    "published, smooth": "published reduced, LimitSurfaceTable",
    "published, ellipsoid": "published reduced, ellipsoid",
    "reduced": "ReducedModel",
    "4 parts": "ReducedModel, 4 parts",
    "6 parts": "ReducedModel, 6 parts",
    "16 parts": "ReducedModel, 16 parts",
    "auto": 'ReducedModel, parts="auto"',
    "degree 3": "distributed, 28 compressed cells",
    "degree 5": "distributed, 45 compressed cells",
}
"""Model of the ladder -> model and surface, in words."""


def model_words(model: str) -> str:
    """The model in words."""
    return MODEL_WORDS[model]


def shown(value: float) -> str:
    """Two digits, without an exponent where the number is easily read so."""
    rounded = float(f"{value:.2g}")
    return np.format_float_positional(rounded, trim="-") if 1e-4 <= abs(rounded) < 1e5 else f"{rounded:.2g}"


def tables(rows: list[Row], numbers: Numbers) -> tuple[Table, ...]:
    """Surfaces, models in both kinds of runs, every combination, spin-up, costs and plateaus."""
    return (
        _surfaces(numbers["surfaces"]),
        _driven(numbers["driven"]),
        _ratios(numbers["driven ratios"], "Error of ReducedModel over the published reduced model's"),
        _ratios(numbers["driven ratios, parts"], 'Error of ReducedModel with parts="auto" over that with one part'),
        _in_hand(numbers["in hand"]),
        _combinations(rows, "third quartile", "driven", 1e3, "error of the force, third quartile [mN]"),
        _combinations(rows, "end", "load 2", 1e3, "in hand, load 2: end from the distributed model [mm]"),
        _combinations(rows, "end", "load 1", 1e3, "in hand, load 1: end from the distributed model [mm]"),
        _spin_up(numbers["spin-up"]),
        _step(numbers["step"]),
        _plateaus(numbers["plateaus"]),
    )


def _surfaces(errors: dict[str, Any]) -> Table:
    kinds = [kind for kind in KINDS if any(f"{kind}/force" in each for each in errors.values())]
    rows = [
        (
            IN_WORDS[shape],
            *(
                f"{shown(1e3 * each[f'{kind}/force']['mean'])} / {shown(1e3 * each[f'{kind}/force']['max'])}"
                if f"{kind}/force" in each
                else ""
                for kind in kinds
            ),
        )
        for shape, each in errors.items()
    ]
    note = "Same random twists, mu f_N = 1 N. The exact surface: each cell a rectangle (on lines a segment)."
    return Table("Error of the force from the exact surface, mean / largest [mN]", ("patch", *kinds), rows, note)


def _driven(errors: dict[str, Any]) -> Table:
    headings = [f"{before}{name}" for before in ("", "torque ") for name in STATISTICS]
    rows = [
        (f"{IN_WORDS[shape]}, {words}", *(shown(1e3 * each[model][name]) for name in headings))
        for shape, each in errors.items()
        for model, words in MODELS.items()
    ]
    units = [f"{name} [{'N mm' if name.startswith('torque') else 'mN'}]" for name in headings]
    return Table("Velocity-driven: error from a converged grid, at the centre of pressure", ("run", *units), rows)


def _ratios(ratios: dict[str, dict[str, float]], title: str) -> Table:
    names = list(next(iter(ratios.values())))
    return Table(
        title, ("patch", *names), [(IN_WORDS[shape], *map(shown, each.values())) for shape, each in ratios.items()]
    )


def _in_hand(ends: dict[str, dict[str, float]]) -> Table:
    rows = [
        (case, *(shown(1e3 * each[name]) for name in (*ENDS, SHIFT)), shown(each[AUTO] / each["published"]))
        for case, each in ends.items()
    ]
    headings = ("run", *(f"{words} [mm]" for words in ENDS.values()), "0.1 % of friction [mm]", "auto / published")
    return Table("In hand: distance of the end from the distributed model's", headings, rows)


def _combinations(rows: list[Row], quantity: str, run: str, factor: float, title: str) -> Table:
    """Every model on the six shapes: one statistic of one kind of run, and what the runs cost."""
    chosen = [row for row in rows if run in row.case and quantity in row.errors and "far" not in row.case]
    shapes = [shape for shape in SIX_SHAPES if any(_shape_of(row) == IN_WORDS[shape] for row in chosen)]
    result = []
    for model in (model for model in MODEL_WORDS if any(row.model == model for row in chosen)):
        own = [row for row in chosen if row.model == model]
        by_shape = {_shape_of(row): row for row in own}
        values = (by_shape.get(IN_WORDS[shape]) for shape in shapes)
        cells = ["as full" if row is None else shown(factor * row.errors[quantity]) for row in values]
        costs, states = [row.time for row in own], [row.states for row in own]
        result.append((model_words(model), _span(states, str), _span(costs, shown), *cells))
    words = [IN_WORDS[shape] for shape in shapes]
    note = (
        "Time: in the solver, over that of the distributed model of the same patch. "
        "'As full': the patch has no more cells than asked for."
    )
    return Table(f"Every combination, {title}", ("model and surface", "bristles", "time", *words), result, note)


def _shape_of(row: Row) -> str:
    """The shape of a row in words."""
    if row.case.startswith("driven, "):
        return IN_WORDS[row.case.removeprefix("driven, ")]
    return row.case.rpartition(", load")[0]


def _span(values: list[Any], words: Callable[[Any], str]) -> str:
    low, high = words(min(values)), words(max(values))
    return low if low == high else f"{low} to {high}"


def _spin_up(errors: dict[str, dict[str, float]]) -> Table:
    models = list(next(iter(errors.values())))
    rows = [(IN_WORDS[shape], *(shown(1e3 * each[model]) for model in models)) for shape, each in errors.items()]
    headings = ("patch", *(MODELS[model] for model in models))
    note = "A spin at 0.02 rad/s from rest, in steps of a hundredth of a deflection, from the same cells."
    return Table("Spin-up from rest: largest error of the torque [N mm]", headings, rows, note)


def _step(costs: dict[str, dict[str, list[float]]]) -> Table:
    rows = [
        (model_words(model), _spread(1e6 * value for value in each["time"]), _spread(each["ratio"]))
        for model, each in costs.items()
    ]
    note = "Medians, in brackets the quartiles; ratios within a round, in which all models take part."
    return Table("Step in a compiled loop, disc", ("model", "time [µs]", "relative to the published model"), rows, note)


def _spread(values: Iterable[float]) -> str:
    middle, first, third = map(shown, values)
    return f"{middle} ({first} to {third})"


def _plateaus(angles: dict[str, float]) -> Table:
    exact = angles["closed form"]
    rows = [(name, 1e6 * angle, f"{fmt(100.0 * (angle / exact - 1.0), '+.3f')} %") for name, angle in angles.items()]
    return Table("Angle of the disc under a torque that friction holds", ("model", "angle [µrad]", "off"), rows)
