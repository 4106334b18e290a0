"""What goes beyond the paper shows, in words."""

from __future__ import annotations

import statistics
from typing import Any

from planarfriction.experiments.beyond.driven import STATISTICS
from planarfriction.experiments.beyond.in_hand import SHIFT, depends_on_friction
from planarfriction.experiments.beyond.ladder import AUTO
from planarfriction.experiments.beyond.others import GROOVED_MODELS
from planarfriction.experiments.beyond.shapes import QUANTITIES
from planarfriction.experiments.beyond.surfaces import QUARTIC_SHAPES
from planarfriction.experiments.runs import IN_WORDS

Numbers = dict[str, Any]

FRICTION = "0.1 % of friction"

PARTS = '`ReducedModel` with parts="auto"'

SURFACES = (
    "Error of every kind of limit surface from the exact one, mu f_N = 1 N: box from first to third "
    "quartile, median, whiskers from 5 to 95 %, and the largest as a cross."
)
STAIRCASE = (
    "Wrench of a spin about the centre of pressure's neighbours. Top: on a line of 21 cells the force of the sum jumps "
    "at every cell, that of the exact surface rises evenly. Bottom: on the disc of 317 cells only the difference shows."
)
DRIVEN = (
    "Errors from a converged grid in the velocity-driven runs, 500 samples: box from first to third quartile, median, "
    "whiskers to the last sample within 1.5 of the box's height, the maximum as a cross. Linear from zero to the first "
    "tick, logarithmic above."
)
IN_HAND = (
    "Distance of the end of the in-hand runs from the distributed model's, beside what a change of friction by 0.1 % "
    "does to the end."
)
LADDER = (
    "Error against the time of a run in the solver, each family of models a line: medians over the patches of a row, "
    "bars from the smallest to the largest. Numbers: parts of `ReducedModel`, cells of the distributed model. Left: "
    "velocity-driven, from a converged grid. Middle and right: in hand, from the distributed model of all cells, which "
    "stands at the dotted line."
)
GROOVES = "A block with a grooved sole on inclines: where it drifts to from rest, beside the closed form."


def findings(numbers: Numbers) -> list[str]:
    """What was done and what it shows, from the numbers of this run."""
    return [
        _surfaces(numbers["surfaces"], numbers["jumps"], numbers["quartic installed"]),
        _driven(numbers),
        _new_shapes(numbers["new shapes"]),
        _in_hand(numbers["in hand"], numbers["in hand score"]),
        _plateaus(numbers["plateaus"]),
        _ladder(numbers["run costs"], numbers["driven"], numbers["in hand"]),
        _family(numbers["load family"]),
        _grooves(numbers["grooves"]),
    ]


def _surfaces(errors: Numbers, jumps: dict[str, float], with_quartic: bool) -> str:
    def ratios(kind: str) -> list[float]:
        return [each[f"{kind}/force"]["mean"] / each["table/force"]["mean"] for each in errors.values()]

    cells, published = ratios("sum over cells"), ratios("published table")
    fitted = [IN_WORDS[shape] for shape in QUARTIC_SHAPES if shape in errors]
    quartic = (
        f"The quartic is fitted for {', '.join(fitted)} only, which takes seconds each. "
        if with_quartic and fitted
        else ""
        if with_quartic
        else "The quartic is left out: cvxpy is not installed (pip install 'planarfriction[quartic]'). "
    )
    return (
        "Limit surfaces. The reference is the exact surface of the patch: each cell a rectangle (on lines a segment) "
        "of uniform pressure, integrated in closed form. A stored table of it with 20 segments is "
        f"{min(cells):.0f} to {max(cells):.0f} times nearer to it, in the mean force, than the sum over the cells that "
        f"the paper calls exact, and {min(published):.0f} to {max(published):.0f} times nearer than the published "
        f"table. {quartic}The sum is a staircase: as the centre of rotation moves along the line, its force jumps by "
        f"{jumps['Line/sum']:.3f} N of 1 N at each of 21 cells; the exact one is continuous."
    )


def _driven(numbers: Numbers) -> str:
    one, auto, over = (numbers[f"driven ratios{ending}"] for ending in ("", ", auto", ", parts"))
    step, costs = numbers["step"], numbers["run costs"]
    worse = {shape: [name for name, value in each.items() if value > 1.05] for shape, each in over.items()}
    except_for = "; ".join(f"{IN_WORDS[shape]}: {', '.join(names)}" for shape, names in worse.items() if names)
    return (
        "Moved with a given velocity. The reference is the distributed model with its cells cut finely; the reduced "
        "model as published sees the grid's table, `ReducedModel` the moments of the bristle field. Its error over "
        f"the published model's on {len(one)} shapes: {_ranges(one)}; the largest of the torque comes just after the "
        f'velocity jumps. With parts="auto": {_ranges(auto)}. {_more_than_one_part(except_for)} '
        f"A step costs {_times(step, 'reduced')} times a published one in a compiled loop "
        f"({1e6 * step['reduced']:.2f} µs), one of four parts {_times(step, '4 parts')} and one of six "
        f"{_times(step, '6 parts')} times; a whole run {costs['reduced'] / costs['published']:.2f} and with "
        f'parts="auto" {costs[AUTO] / costs["published"]:.2f} times, for the solver picks its own steps. The '
        "distributed model of 21 x 21 cells is no reference here: its own staircase is often the largest error of all. "
        "Much of the gain is that of the exact table: see the published model with LimitSurfaceTable in the table of "
        "combinations."
    )


def _ranges(ratios: dict[str, dict[str, float]]) -> str:
    """From the best shape to the worst, by statistic."""
    words = []
    for before in ("", "torque "):
        spans = []
        for name in STATISTICS:
            values = [each[before + name] for each in ratios.values()]
            spans.append(f"{name} {min(values):.2g} to {max(values):.2g}")
        words.append(f"{before.strip() or 'force'} {', '.join(spans)}")
    return "; ".join(words)


def _new_shapes(ratios: Numbers) -> str:
    def worst(model: str) -> str:
        return ", ".join(
            f"{quantity} {max(max(each[model][quantity]) for each in ratios.values()):.2f}" for quantity in QUANTITIES
        )

    twists = len(next(iter(ratios.values()))["reduced"]["force"])
    return (
        f"Patches that no table holds ({', '.join(ratios)}), moved by {twists} smooth random twists each. The largest "
        f"errors over the published model's in the same run, at worst: one part {worst('reduced')}; four parts "
        f"{worst('4 parts')}; {PARTS} {worst(AUTO)}."
    )


def _more_than_one_part(except_for: str) -> str:
    """What parts do to the errors of one part."""
    if not except_for:
        return "No statistic is more than 5 % worse than with one part."
    return f"More than 5 % worse than with one part are only: {except_for}."


def _times(step: dict[str, float], model: str) -> str:
    return f"{step[model] / step['published']:.2f}"


def _in_hand(ends: dict[str, dict[str, float]], score: Numbers) -> str:
    shares = {name: _friction_shares(ends, name) for name in ("reduced", AUTO, "published")}
    return (
        "In hand, distances of the end from the distributed model's. "
        f"{_nearer(score['reduced'], '`ReducedModel`')} {_nearer(score[AUTO], PARTS)} Under load 1 "
        "the grip barely passes the threshold, and sections of the patch creep before the whole slips: one part does "
        "not hold that, each of several breaks away by itself. In units of friction, over the runs that depend on it, "
        f"`ReducedModel` is off by what {shares['reduced'][0]:.2%} (median) to {shares['reduced'][1]:.2%} (most) of "
        f'friction would do, with parts="auto" by {shares[AUTO][0]:.2%} to {shares[AUTO][1]:.2%}, the published model '
        f"by {shares['published'][0]:.2%} to {shares['published'][1]:.2%}."
    )


def _nearer(score: Numbers, who: str) -> str:
    """In how many runs it ends nearer than the published model, by load."""
    first, second = score["load 1"], score["load 2"]
    worse = [case for case, ratio in second["ratios"].items() if ratio >= 1.0]
    except_for = f" (not: {'; '.join(worse)})" if worse else ""
    return (
        f"{who} ends nearer than the published model in {second['nearer']} of {second['runs']} runs under load "
        f"2{except_for}, ratios {_spread(second['ratios'])}; under load 1 in {first['nearer']} of {first['runs']}, "
        f"ratios {_spread(first['ratios'])}."
    )


def _spread(ratios: dict[str, float]) -> str:
    """Least, middle and largest ratio."""
    values = list(ratios.values())
    return f"{min(values):.2f} to {max(values):.2f}, median {statistics.median(values):.2f}"


def _friction_shares(ends: dict[str, dict[str, float]], model: str) -> tuple[float, float]:
    """Median and largest distance of an end, as the share of friction that does the same."""
    shares = sorted(1e-3 * each[model] / each[SHIFT] for each in ends.values() if depends_on_friction(each))
    return shares[len(shares) // 2], shares[-1]


def _plateaus(angles: dict[str, float]) -> str:
    exact = angles["closed form"]
    off = {name: angle / exact - 1.0 for name, angle in angles.items()}
    return (
        f"A torque that friction holds turns the disc by {1e6 * exact:.3f} µrad in closed form. Distributed: "
        f"{off['distributed']:+.4%}; `ReducedModel`: {off['ReducedModel']:+.4%}; published reduced: "
        f"{off['published reduced']:+.1%}, for its torsional stiffness is sigma_0 r^2 instead of sigma_0 <rho^2>."
    )


def _ladder(costs: dict[str, float], driven: Numbers, ends: dict[str, dict[str, float]]) -> str:
    few = [each for each in ends.values() if "degree 5" in each]
    moved = [each for each in driven.values() if "degree 5" in each]
    quartile = [each["degree 5"]["third quartile"] / each["full"]["third quartile"] for each in moved]

    def worst(model: str) -> str:
        return f"{1e3 * max(each[model] for each in few):.2f} mm"

    return (
        "Between 3 bristles and 882. On the patches with more than 45 cells, 45 compressed ones end at most "
        f"{worst('degree 5')} from the full grid in hand (published reduced: {worst('published')}, `ReducedModel`: "
        f'{worst("reduced")}, with parts="auto": {worst(AUTO)}, 16 parts: {worst("16 parts")}), in '
        f"{costs['degree 5']:.2f} of its time. Moved with a given velocity they are {min(quartile):.1f} to "
        f"{max(quartile):.1f} times as far from the converged grid as the full one (third quartile of the force): the "
        "staircase of few cells is coarse, and parts have none."
    )


def _family(numbers: dict[str, float]) -> str:
    return (
        f"A contact whose pressure flattens with the load (k = 2 f_N), in hand, {numbers['end [s]']:g} s with a new "
        f"load every 0.01 s: `ReducedModel` builds {numbers['maps']:.0f} maps and takes "
        f"{numbers['first time [s]']:.2g} s, once they are there {1e3 * numbers['time [s]']:.2g} ms (published "
        f"reduced: {numbers['published, first time [s]']:.2g} s and "
        f"{1e3 * numbers['published, time [s]']:.0f} ms; `ReducedModel` on a square of fixed shape: "
        f"{1e3 * numbers['fixed shape, time [s]']:.2g} ms; all of `simulate`). From a map built at every load, its "
        f"steady wrenches are off by {numbers['force from rebuilding [N]']:.1e} N and "
        f"{numbers['torque from rebuilding [N m]']:.1e} N m per newton at most."
    )


def _grooves(numbers: dict[str, list[float]]) -> str:
    miss = max(
        abs(a - b) for kind in GROOVED_MODELS for a, b in zip(numbers[kind], numbers["closed form"], strict=True)
    )
    return (
        "Friction with a grain: a block with a grooved sole, released on inclines, drifts sideways as the closed form "
        f"says, within {miss:.1e} rad with all {len(GROOVED_MODELS)} models; the published theory has friction alike "
        "in all directions."
    )
