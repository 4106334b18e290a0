"""Tables beyond the paper."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterable
from typing import Any

from planarfriction_studies.experiments.beyond.ladder import AUTO, ENDS, MOVED, SHIFT, STATISTICS, Row, shape_of
from planarfriction_studies.experiments.beyond.surfaces import KINDS
from planarfriction_studies.experiments.experiment import Numbers, Table, entry, table
from planarfriction_studies.experiments.runs import IN_WORDS, SIX_SHAPES
from planarfriction_studies.experiments.wording import fmt, short

MODEL_WORDS = {
    "full": "distributed, 21 x 21 cells",
    "published": "published reduced, published table",
    "published, smooth": "published reduced, LimitSurfaceTable",
    "published, ellipsoid": "published reduced, ellipsoid",
    "reduced": "ReducedModel",
    "one part": "ReducedModel, 1 part",
    **{f"{count} parts": f"ReducedModel, {count} parts" for count in (4, 6, 16)},
    "auto": 'ReducedModel, parts="auto"',
    "degree 3": "distributed, 28 compressed cells",
    "degree 5": "distributed, 45 compressed cells",
}
"""Model of the ladder -> model and surface, in words."""


shown = functools.partial(short, digits=2)


def tables(rows: list[Row], numbers: Numbers) -> tuple[Table, ...]:
    """Return surfaces, models in both kinds of runs, every combination, spin-up, costs and plateaus."""
    surfaces, ends = numbers["surfaces"], numbers["in hand"]
    kinds = [kind for kind in KINDS if any(f"{kind}/force" in each for each in surfaces.values())]
    spins, steps, angles = numbers["spin-up"], numbers["step"], numbers["plateaus"]
    return (
        table(
            "Error of the force from the exact surface, mean / largest [mN]",
            _by_shape(surfaces),
            {kind: lambda each, kind=kind: _mean_and_largest(each.get(f"{kind}/force")) for kind in kinds},
            "patch",
            "$\\mu f_N$ = 1 N.",
        ),
        table(
            "Velocity-driven: error from a converged grid, at the centre of pressure",
            {
                f"{IN_WORDS[shape]}, {words}": each[model]
                for shape, each in numbers["driven"].items()
                for model, words in MOVED.items()
            },
            {
                f"{before}{name} [{unit}]": _scaled(f"{before}{name}")
                for before, unit in (("", "mN"), ("torque ", "N mm"))
                for name in STATISTICS
            },
            "run",
        ),
        _ratios(numbers["driven ratios"], "Error of ReducedModel with one part over the published reduced model's"),
        _ratios(numbers["driven ratios, parts"], 'Error of ReducedModel with parts="auto" over that with one part'),
        table(
            "In hand: distance of the end from the distributed model's",
            ends,
            {f"{words} [mm]": _scaled(name) for name, words in (ENDS | {SHIFT: "0.1 % of friction"}).items()}
            | {"auto / published": lambda each: shown(each[AUTO] / each["published"])},
            "run",
        ),
        _combinations(rows, "third quartile", "driven", "error of the force, third quartile [mN]"),
        *(
            _combinations(rows, "end", load, f"in hand, {load}: end from the distributed model [mm]")
            for load in ("load 2", "load 1")
        ),
        table(
            "Spin-up from rest: largest error of the torque [N mm]",
            _by_shape(spins),
            {MOVED[model]: _scaled(model) for model in next(iter(spins.values()))},
            "patch",
            "At 0.02 rad/s, in steps of a hundredth of a deflection, from the same cells.",
        ),
        table(
            "Step in a compiled loop, disc",
            {MODEL_WORDS[model]: each for model, each in steps.items()},
            {
                "time [µs]": lambda each: _spread(1e6 * value for value in each["time"]),
                "relative to the published model": lambda each: _spread(each["ratio"]),
            },
            "model",
            "Medians and quartiles over rounds in which all models take part.",
        ),
        table(
            "Angle of the disc under a torque that friction holds",
            angles,
            {
                "angle [µrad]": entry(scale=1e6),
                "off": lambda angle: f"{fmt(100.0 * (angle / angles['closed form'] - 1.0), '+.3f')} %",
            },
            "model",
        ),
    )


def _by_shape(found: dict[str, Any]) -> dict[str, Any]:
    return {IN_WORDS[shape]: each for shape, each in found.items()}


def _scaled(name: str) -> Callable[[dict[str, float]], str]:
    """Return the entry `name` in thousandths of its unit."""
    return lambda each: shown(1e3 * each[name])


def _mean_and_largest(each: dict[str, float] | None) -> str:
    return "" if each is None else f"{shown(1e3 * each['mean'])} / {shown(1e3 * each['max'])}"


def _ratios(ratios: dict[str, dict[str, float]], title: str) -> Table:
    names = list(next(iter(ratios.values())))
    return table(title, _by_shape(ratios), {name: lambda each, name=name: shown(each[name]) for name in names}, "patch")


def _combinations(rows: list[Row], quantity: str, run: str, title: str) -> Table:
    """Return a table of every model on the six shapes: one statistic of one kind of run, and the costs of the runs."""
    chosen = [row for row in rows if run in row.case and quantity in row.errors and "far" not in row.case]
    shapes = [shape for shape in SIX_SHAPES if any(shape_of(row.case) == IN_WORDS[shape] for row in chosen)]
    result = []
    for model in (model for model in MODEL_WORDS if any(row.model == model for row in chosen)):
        own = [row for row in chosen if row.model == model]
        by_shape = {shape_of(row.case): row for row in own}
        values = (by_shape.get(IN_WORDS[shape]) for shape in shapes)
        cells = ["as full" if row is None else shown(1e3 * row.errors[quantity]) for row in values]
        costs, states = [row.time for row in own], [row.states for row in own]
        result.append((MODEL_WORDS[model], _span(states, str), _span(costs, shown), *cells))
    words = [IN_WORDS[shape] for shape in shapes]
    note = "Time: in the solver, over the distributed model's. As full: no more cells than asked for."
    return Table(f"Every combination, {title}", ("model and surface", "bristles", "time", *words), result, note)


def _span(values: list[Any], words: Callable[[Any], str]) -> str:
    low, high = words(min(values)), words(max(values))
    return low if low == high else f"{low} to {high}"


def _spread(values: Iterable[float]) -> str:
    middle, first, third = map(shown, values)
    return f"{middle} ({first} to {third})"
