"""Beyond the paper: exact limit surfaces, another reduced model, few cells, loads, friction with a grain."""

from __future__ import annotations

import statistics
from functools import partial
from typing import Any

import numpy as np

from planarfriction.plots.style import PlotFigure
from planarfriction_studies.experiments import looks
from planarfriction_studies.experiments.beyond import (
    driven,
    figures,
    grooves,
    in_hand,
    ladder,
    load_family,
    plateaus,
    surfaces,
    tables,
)
from planarfriction_studies.experiments.beyond import shapes as new_shapes
from planarfriction_studies.experiments.beyond.ladder_figure import draw_ladder
from planarfriction_studies.experiments.experiment import Arrays, Result, Work
from planarfriction_studies.experiments.in_hand.figures import end_shifts
from planarfriction_studies.experiments.runs import IN_WORDS, SIX_SHAPES
from planarfriction_studies.experiments.wording import fill

Numbers = dict[str, Any]

SHAPES = (*SIX_SHAPES, "LineGradX")

QUICK_SHAPES = ("LineGrad", "NonConvex2")

QUICK_TWISTS = 500

FRICTION = "0.1 % of friction"
"""Label of the friction, which moves the end as the models do, in the figure of the ends."""

NEW_SHAPES, QUICK_NEW_SHAPES, QUICK_SEEDS = tuple(new_shapes.shapes()), ("three feet",), (0, 1)


def run(work: Work) -> Result:
    """Carry out the experiment."""
    shapes = QUICK_SHAPES if work.quick else SHAPES
    six = [shape for shape in shapes if shape in SIX_SHAPES]
    twists = QUICK_TWISTS if work.quick else surfaces.TWISTS
    new, seeds = (QUICK_NEW_SHAPES, QUICK_SEEDS) if work.quick else (NEW_SHAPES, new_shapes.SEEDS)
    found = work.pieces(
        {("models", shape): partial(_runs_of, shape) for shape in shapes}
        | {("limit surface", shape): partial(surfaces.surface_errors, shape, twists) for shape in shapes}
        | {
            ("plateaus", ""): plateaus.plateaus,
            ("grooves", ""): partial(grooves.grooves, work.quick),
            ("staircase", ""): surfaces.staircase,
            ("soft finger", ""): partial(load_family.load_family, work.quick),
        }
        | {("spin-up", shape): partial(driven.spin_up, shape) for shape in six}
        | {("new shapes", name): partial(new_shapes.largest_errors, name, seeds) for name in new},
        lambda key: ", ".join((key[0], IN_WORDS.get(key[1], key[1]))),
    )
    # one after the other: these are measured with a clock
    times = work.piece("time of runs", lambda: {shape: ladder.run_times(shape) for shape in shapes})
    costs = driven.step_numbers(work.piece("cost of a step", driven.step_costs))

    def of(what: str) -> dict[str, Numbers]:
        return {which: each for (name, which), each in found.items() if name == what}

    rows = [
        ladder.Row(case, model, int(errors["states"]), errors["errors"], times[shape][case][model])
        for shape, each in of("models").items()
        for case, models in each["runs"].items()
        for model, errors in models.items()
    ]
    shifts = {case: value for each in of("models").values() for case, value in each["shifts"].items()}
    stairs, unseen, errors = found["staircase", ""], of("new shapes"), of("limit surface")
    grooved = {name: values.tolist() for name, values in found["grooves", ""].items()}
    numbers = _numbers(rows, shifts, errors) | {
        "jumps": surfaces.jumps(stairs),
        "plateaus": found["plateaus", ""],
        "grooves": grooved,
        "load family": found["soft finger", ""],
        "step": costs,
        "spin-up": of("spin-up"),
        "new shapes": {name: new_shapes.ratios(each) for name, each in unseen.items()},
    }
    return fill("beyond", **_template_values(numbers)).result(
        _figures(rows, errors, stairs, numbers),
        comparisons=[
            *surfaces.comparisons(errors, stairs),
            *plateaus.comparisons(numbers["plateaus"]),
            *grooves.comparisons(grooved),
        ],
        numbers=numbers,
        tables=(*tables.tables(rows, numbers), new_shapes.table(unseen)),
    )


def _runs_of(shape: str) -> Numbers:
    """Compute a piece: every model of a shape in every run, and the effect of friction on the in-hand ones."""
    cases = in_hand.cases_of(shape)
    rows = ladder.in_hand_rows(cases) + (ladder.driven_rows((shape,)) if shape in SIX_SHAPES else [])
    runs: dict[str, Numbers] = {}
    for row in rows:
        runs.setdefault(row.case, {})[row.model] = {"states": row.states, "errors": row.errors}
    return {"runs": runs, "shifts": {case.words: in_hand.friction_shift(case) for case in cases}}


def _figures(
    rows: list[ladder.Row], errors: dict[str, Arrays], stairs: Arrays, numbers: Numbers
) -> dict[str, PlotFigure]:
    ends = {
        case: {in_hand.ENDS.get(name, FRICTION): each[name] for name in (*in_hand.ENDS, in_hand.SHIFT)}
        for case, each in numbers["in hand"].items()
    }
    colours = dict(
        zip(in_hand.ENDS.values(), (looks.REDUCED, looks.MOMENTS, looks.OTHERS[3], looks.PARTS), strict=True)
    )
    return {
        "surface_errors": figures.surface_errors(errors),
        "surface_staircase": figures.staircase(stairs),
        "driven_models": figures.driven_boxes(numbers["driven"]),
        "in_hand_ends": end_shifts(ends, colours, "distance of the end from the distributed model's [mm]"),
        "ladder": draw_ladder(rows),
        "grooves": figures.grooves(numbers["grooves"]),
    }


def _numbers(rows: list[ladder.Row], shifts: dict[str, float], errors: dict[str, Arrays]) -> Numbers:
    moved = driven.driven_errors(rows)
    ends = in_hand.end_distances(rows, shifts)
    models = dict.fromkeys(row.model for row in rows)
    times = {(row.case, row.model): row.time for row in rows}
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
        # median over all runs of the time in the solver over that of the distributed model
        "run costs": {name: float(np.median([row.time for row in rows if row.model == name])) for name in models},
        # median and quartiles of the same over that of the published model in the same run
        "run ratios": {
            name: driven.median_and_quartiles(
                [value / times[case, "published"] for (case, other), value in times.items() if other == name]
            )
            for name in models
        },
    }


def _statistics(errors: Arrays) -> dict[str, dict[str, float]]:
    return {
        name: {"median": float(np.median(each)), "mean": float(each.mean()), "max": float(each.max())}
        for name, each in errors.items()
    }


# ---------------------------------------------------------------------- words


def _template_values(numbers: Numbers) -> Numbers:
    """Return the values that the template names."""
    exact, ends, drifts = (numbers[name] for name in ("surfaces", "in hand", "grooves"))
    few = [each for each in ends.values() if "degree 5" in each]
    moved = [each for each in numbers["driven"].values() if "degree 5" in each]
    return {
        "nearer": {
            name: [each[f"{kind}/force"]["mean"] / each["table/force"]["mean"] for each in exact.values()]
            for name, kind in (("cells", "sum over cells"), ("published", "published table"))
        },
        "quartic_installed": numbers["quartic installed"],
        "fitted": [IN_WORDS[shape] for shape in surfaces.QUARTIC_SHAPES if shape in exact],
        "jump": numbers["jumps"]["Line/sum"],
        "driven": _driven(numbers),
        "step": numbers["step"],
        "rounds": driven.ROUNDS,
        "runs": numbers["run ratios"],
        "unseen": _unseen(numbers["new shapes"]),
        "held": {model: {load: _score(each) for load, each in found.items()}
                 for model, found in numbers["in hand score"].items()},
        "friction": {model: _friction_shares(ends, model) for model in ("reduced", ladder.AUTO, "published")},
        "plateaus": numbers["plateaus"],
        "few": {model: max(each[model] for each in few)
                for model in ("degree 5", "published", "reduced", ladder.AUTO, "16 parts")},
        "share_of_time": numbers["run costs"]["degree 5"],
        "quartile": [each["degree 5"]["third quartile"] / each["full"]["third quartile"] for each in moved],
        "family": numbers["load family"],
        "grooves": {
            "models": len(grooves.MODELS),
            "miss": max(abs(a - b) for kind in grooves.MODELS
                        for a, b in zip(drifts[kind], drifts["closed form"], strict=True)),
        },
    }  # fmt: skip


def _driven(numbers: Numbers) -> Numbers:
    one, auto, over = (numbers[f"driven ratios{ending}"] for ending in ("", ", auto", ", parts"))
    worse = {IN_WORDS[shape]: [name for name, value in each.items() if value > 1.05] for shape, each in over.items()}
    return {
        "shapes": len(one),
        "one": _by_statistic(one),
        "auto": _by_statistic(auto),
        "worse": {shape: names for shape, names in worse.items() if names},
    }


def _by_statistic(ratios: dict[str, dict[str, float]]) -> dict[str, dict[str, list[float]]]:
    """Return ratios of all shapes by quantity and statistic."""
    return {
        quantity: {name: [each[before + name] for each in ratios.values()] for name in driven.STATISTICS}
        for quantity, before in (("force", ""), ("torque", "torque "))
    }


def _unseen(ratios: Numbers) -> Numbers:
    return {
        "names": list(ratios),
        "twists": len(next(iter(ratios.values()))["reduced"]["force"]),
        "worst": {
            model: {name: max(max(each[model][name]) for each in ratios.values()) for name in new_shapes.QUANTITIES}
            for model in ("reduced", "4 parts", ladder.AUTO)
        },
    }


def _score(found: Numbers) -> Numbers:
    """Count the runs in which a model ends nearer than the published one; return those in which it does not, and the
    ratios."""
    ratios = found["ratios"]
    return {
        "nearer": found["nearer"],
        "runs": found["runs"],
        "worse": [case for case, ratio in ratios.items() if ratio >= 1.0],
        "ratios": list(ratios.values()),
        "median": statistics.median(ratios.values()),
    }


def _friction_shares(ends: dict[str, dict[str, float]], model: str) -> tuple[float, float]:
    """Return the median and largest distance of an end, as the share of friction that does the same."""
    shares = sorted(
        1e-3 * each[model] / each[in_hand.SHIFT] for each in ends.values() if in_hand.depends_on_friction(each)
    )
    return shares[len(shares) // 2], shares[-1]
