"""Beyond the paper: exact limit surfaces, another reduced model, few discs, loads, anisotropic friction."""

from __future__ import annotations

import statistics
from functools import partial
from typing import Any

import numpy as np

from planarfriction.plots.style import SHADES
from planarfriction_studies.experiments import looks
from planarfriction_studies.experiments.beyond import (
    cells,
    contacts,
    ladder,
    surfaces,
    tables,
)
from planarfriction_studies.experiments.beyond import shapes as new_shapes
from planarfriction_studies.experiments.experiment import (
    Numbers,
    Result,
    Work,
    median_and_quartiles,
)
from planarfriction_studies.experiments.in_hand.figures import end_shifts
from planarfriction_studies.experiments.runs import IN_WORDS, SIX_SHAPES
from planarfriction_studies.experiments.wording import report

SHAPES, QUICK_SHAPES, QUICK_TWISTS = (
    (*SIX_SHAPES, "LineGradX"),
    ("LineGrad", "NonConvex2"),
    500,
)
NEW_SHAPES, QUICK_NEW_SHAPES, QUICK_SEEDS = (
    tuple(new_shapes.SHAPES),
    ("three feet",),
    (0, 1),
)


SHOWN, UNSEEN = (
    ("8 discs", "reduced", ladder.ALL),
    ("8 discs", "16 discs", "reduced", "64 discs"),
)
"""Models of the findings: on the published patches, and on those that no table holds."""


def run(work: Work) -> Result:
    """Carry out the experiment."""
    shapes = QUICK_SHAPES if work.quick else SHAPES
    six = [shape for shape in shapes if shape in SIX_SHAPES]
    twists = QUICK_TWISTS if work.quick else surfaces.TWISTS
    new, seeds = (
        (QUICK_NEW_SHAPES, QUICK_SEEDS)
        if work.quick
        else (NEW_SHAPES, new_shapes.SEEDS)
    )
    rungs, shaken = (
        (("disc",), ("disc",))
        if work.quick
        else (tuple(cells.SHAPES), ("disc", "L", "two pads"))
    )
    found = work.pieces(
        {("models", shape): partial(_runs_of, shape) for shape in shapes}
        | {
            ("limit surface", shape): partial(surfaces.surface_errors, shape, twists)
            for shape in shapes
        }
        | {
            ("plateaus", ""): contacts.plateaus,
            ("grooves", ""): partial(contacts.grooves, work.quick),
            ("staircase", ""): surfaces.staircase,
            ("soft finger", ""): partial(contacts.soft_finger, work.quick),
        }
        | {("spin-up", shape): partial(ladder.spin_up, shape) for shape in six}
        | {
            ("new shapes", name): partial(new_shapes.largest_errors, name, seeds)
            for name in new
        }
        | {
            ("few discs", name): partial(cells.measured, name, work.quick)
            for name in rungs
        }
        | {("creep", name): partial(cells.held, name) for name in shaken}
        | {
            ("work returned", ""): partial(
                cells.gained, 10_000 if work.quick else 1_000_000
            )
        },
        lambda key: ", ".join((key[0], IN_WORDS.get(key[1], key[1]))),
    )
    # one after the other: these are measured with a clock
    times = work.piece(
        "time of runs", lambda: {shape: ladder.run_times(shape) for shape in shapes}
    )
    costs = ladder.step_numbers(work.piece("cost of a step", ladder.step_costs))

    def of(what: str) -> Numbers:
        return {which: each for (name, which), each in found.items() if name == what}

    rows = [
        ladder.Row(
            case,
            model,
            int(errors["states"]),
            errors["errors"],
            times[shape][case][model],
        )
        for shape, each in of("models").items()
        for case, models in each["runs"].items()
        for model, errors in models.items()
    ]
    shifts = {
        case: value
        for each in of("models").values()
        for case, value in each["shifts"].items()
    }
    stairs = found["staircase", ""]
    unseen = of("new shapes")
    errors = of("limit surface")
    numbers = _numbers(rows, shifts, errors) | {
        "jumps": surfaces.jumps(stairs),
        "plateaus": found["plateaus", ""],
        "grooves": {
            name: values.tolist() for name, values in found["grooves", ""].items()
        },
        "soft finger": found["soft finger", ""],
        "step": costs,
        "spin-up": of("spin-up"),
        "few discs": cells.pooled(of("few discs")),
        "creep": _last(of("creep")),
        "work returned": found["work returned", ""],
        "new shapes": {name: new_shapes.ratios(each) for name, each in unseen.items()},
    }
    return report(
        "beyond",
        {
            "surface_errors": tables.surface_errors(errors),
            "surface_staircase": tables.staircase(stairs),
            "driven_models": tables.driven_boxes(numbers["driven"]),
            "in_hand_ends": _ends_figure(numbers["in hand"]),
            "ladder": tables.draw_ladder(rows, shifts),
            "few_discs": cells.figure(numbers["few discs"]),
            "grooves": tables.grooves(numbers["grooves"]),
        },
        numbers,
        _template_values(numbers),
        comparisons=[
            *surfaces.comparisons(errors, stairs),
            *contacts.plateau_comparisons(numbers["plateaus"]),
            *contacts.grooves_comparisons(numbers["grooves"]),
        ],
        tables=(
            *tables.tables(rows, numbers),
            new_shapes.table(unseen),
            *cells.tables(numbers["few discs"], numbers["creep"]),
        ),
    )


def _last(ways: Numbers) -> Numbers:
    """Return the last of the ways from cycle to cycle, by patch, level and model."""
    return {
        shape: {
            level: {model: float(each[-1]) for model, each in models.items()}
            for level, models in levels.items()
        }
        for shape, levels in ways.items()
    }


def _runs_of(shape: str) -> Numbers:
    """Compute a piece: every model of a shape in every run, and the effect of friction on the in-hand ones."""
    cases = ladder.cases_of(shape)
    rows = ladder.in_hand_rows(cases) + (
        ladder.driven_rows((shape,)) if shape in SIX_SHAPES else []
    )
    runs: dict[str, Numbers] = {}
    for row in rows:
        runs.setdefault(row.case, {})[row.model] = {
            "states": row.states,
            "errors": row.errors,
        }
    return {
        "runs": runs,
        "shifts": {case.words: ladder.friction_shift(case) for case in cases},
    }


def _ends_figure(ends: Numbers) -> Any:
    """Draw the ends of the in-hand runs, and how far a change of friction moves them."""
    words = ladder.ENDS | {ladder.SHIFT: "0.1 % of friction"}
    colours = (looks.PUBLISHED, SHADES[0], looks.REDUCED, SHADES[3])
    return end_shifts(
        {
            case: {words[name]: each[name] for name in words}
            for case, each in ends.items()
        },
        dict(zip(ladder.ENDS.values(), colours, strict=True)),
        "distance of the end from the distributed model's [mm]",
    )


def _numbers(
    rows: list[ladder.Row], shifts: dict[str, float], errors: Numbers
) -> Numbers:
    moved = ladder.driven_errors(rows)
    ends = ladder.end_distances(rows, shifts)
    models = dict.fromkeys(row.model for row in rows)
    published = {row.case: row.time for row in rows if row.model == "published"}
    return {
        "surfaces": {
            shape: {
                name: {
                    "median": float(np.median(values)),
                    "mean": float(values.mean()),
                    "max": float(values.max()),
                }
                for name, values in each.items()
            }
            for shape, each in errors.items()
        },
        "quartic installed": surfaces.has_quartic(),
        "driven": moved,
        "driven ratios": ladder.ratios(moved, "reduced"),
        "driven ratios, all": ladder.ratios(moved, ladder.ALL),
        "in hand": ends,
        "in hand score": {
            model: {f"load {load}": ladder.score(ends, load, model) for load in (1, 2)}
            for model in SHOWN
        },
        # median over all runs of the time in the solver over that of the distributed model
        "run costs": {
            name: float(np.median([row.time for row in rows if row.model == name]))
            for name in models
        },
        # median and quartiles of the same over that of the published model in the same run
        "run ratios": {
            name: median_and_quartiles(
                [row.time / published[row.case] for row in rows if row.model == name]
            )
            for name in models
        },
    }


def _template_values(numbers: Numbers) -> Numbers:
    """Return the values that the template names."""
    exact, ends, drifts, unseen = (
        numbers[name] for name in ("surfaces", "in hand", "grooves", "new shapes")
    )
    ratios = {
        "reduced": numbers["driven ratios"],
        ladder.ALL: numbers["driven ratios, all"],
    }
    misses = [
        np.subtract(drifts[kind], drifts["closed form"])
        for kind in contacts.GROOVED_MODELS
    ]
    return {
        "nearer": {
            name: [
                each[f"{kind}/force"]["mean"] / each["table/force"]["mean"]
                for each in exact.values()
            ]
            for name, kind in (
                ("cells", "sum over cells"),
                ("published", "published table"),
            )
        },
        "fitted": [
            IN_WORDS[shape] for shape in surfaces.QUARTIC_SHAPES if shape in exact
        ],
        "driven": {
            "shapes": len(numbers["driven"]),
            "ratios": {model: _by_statistic(each) for model, each in ratios.items()},
        },
        "unseen": {
            "twists": len(next(iter(unseen.values()))["reduced"]["force"]),
            "worst": {
                model: {
                    name: max(max(each[model][name]) for each in unseen.values())
                    for name in new_shapes.QUANTITIES
                }
                for model in UNSEEN
            },
        },
        "held": {
            model: {load: _score(each) for load, each in found.items()}
            for model, found in numbers["in hand score"].items()
        },
        "friction": {
            model: _friction_shares(ends, model) for model in (*SHOWN, "published")
        },
        "furthest": {
            model: max(each[model] for each in ends.values())
            for model in ("published", *SHOWN)
        },
        "default": ladder.DEFAULT,
        "discs": {
            model: _over_all(numbers, model)
            for model in (*ladder.NAMES.values(), ladder.ALL)
        },
        "grooves": {"models": len(misses), "miss": float(np.abs(misses).max())},
    }


def _over_all(numbers: Numbers, model: str) -> Numbers:
    """Return what discs cost and how far they are off, on the patches that have more cells than any number of them."""
    moved, ends = (
        [each for each in numbers[name].values() if "64 discs" in each]
        for name in ("driven", "in hand")
    )
    over = lambda name: float(
        np.median([each[model][name] / each["published"][name] for each in moved])
    )
    return {
        "driven": over("third quartile"),
        "largest": over("maximum"),
        "end": max(each[model] for each in ends),
        "time": numbers["run ratios"][model][0],
    }


def _by_statistic(
    ratios: dict[str, dict[str, float]],
) -> dict[str, dict[str, list[float]]]:
    """Return ratios of all shapes by quantity and statistic."""
    return {
        quantity: {
            name: [each[before + name] for each in ratios.values()]
            for name in ladder.STATISTICS
        }
        for quantity, before in (("force", ""), ("torque", "torque "))
    }


def _score(found: Numbers) -> Numbers:
    """Return a score with the runs in which the published model ends nearer, and the median of the ratios."""
    ratios = found["ratios"]
    worse = [case for case, ratio in ratios.items() if ratio >= 1.0]
    return found | {
        "worse": worse,
        "ratios": list(ratios.values()),
        "median": statistics.median(ratios.values()),
    }


def _friction_shares(
    ends: dict[str, dict[str, float]], model: str
) -> tuple[float, float]:
    """Return the median and largest distance of an end, as the share of friction that does the same."""
    shares = sorted(
        1e-3 * each[model] / each[ladder.SHIFT]
        for each in ends.values()
        if ladder.depends_on_friction(each)
    )
    return shares[len(shares) // 2], shares[-1]
