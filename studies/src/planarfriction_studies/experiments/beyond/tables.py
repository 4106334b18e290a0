"""Tables and figures beyond the paper."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterable
from typing import Any

import numpy as np

from planarfriction.plots.style import (
    LETTERS,
    PAGE,
    SHADES,
    PlotFigure,
    new_figure,
    paper,
    tidy,
)
from planarfriction.plots.symbols import HALO
from planarfriction_studies.experiments import looks
from planarfriction_studies.experiments.beyond import contacts
from planarfriction_studies.experiments.beyond.ladder import (
    ALL,
    ENDS,
    MOVED,
    NAMES,
    SHIFT,
    STATISTICS,
    Row,
    shape_of,
)
from planarfriction_studies.experiments.beyond.surfaces import KINDS
from planarfriction_studies.experiments.experiment import (
    Arrays,
    Numbers,
    Table,
    entry,
    table,
)
from planarfriction_studies.experiments.runs import IN_WORDS, SIX_SHAPES
from planarfriction_studies.experiments.velocity_driven import boxes
from planarfriction_studies.experiments.wording import fmt, short

MODEL_WORDS = {
    "full": "distributed, 21 x 21 cells",
    "published": "published reduced, published table",
    "published, smooth": "published reduced, LimitSurfaceTable",
    "published, ellipsoid": "published reduced, ellipsoid",
    **{name: f"ReducedModel, {n} disc{'s' * (n > 1)}" for n, name in NAMES.items()},
    ALL: MOVED[ALL],
}
"""Model of the ladder -> model and surface, in words."""


shown = functools.partial(short, digits=2)


def tables(rows: list[Row], numbers: Numbers) -> tuple[Table, ...]:
    """Return surfaces, models in both kinds of runs, every combination, spin-up, costs and plateaus."""
    surfaces = numbers["surfaces"]
    ends = numbers["in hand"]
    kinds = [
        kind
        for kind in KINDS
        if any(f"{kind}/force" in each for each in surfaces.values())
    ]
    spins = numbers["spin-up"]
    steps = numbers["step"]
    angles = numbers["plateaus"]
    return (
        table(
            "Error of the force from the exact surface, mean / largest [mN]",
            _by_shape(surfaces),
            {
                kind: lambda each, kind=kind: _mean_and_largest(
                    each.get(f"{kind}/force")
                )
                for kind in kinds
            },
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
        _ratios(
            numbers["driven ratios"],
            "Error of ReducedModel over the published reduced model's",
        ),
        table(
            "In hand: distance of the end from the distributed model's",
            ends,
            {
                f"{words} [mm]": _scaled(name)
                for name, words in (ENDS | {SHIFT: "0.1 % of friction"}).items()
            }
            | {
                "default / published": lambda each: shown(
                    each["reduced"] / each["published"]
                )
            },
            "run",
        ),
        _combinations(
            rows, "third quartile", "driven", "error of the force, third quartile [mN]"
        ),
        *(
            _combinations(
                rows,
                "end",
                load,
                f"in hand, {load}: end from the distributed model [mm]",
            )
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
                "time [µs]": lambda each: _spread(
                    1e6 * value for value in each["time"]
                ),
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
                "off": lambda angle: (
                    f"{fmt(100.0 * (angle / angles['closed form'] - 1.0), '+.3f')} %"
                ),
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
    return (
        ""
        if each is None
        else f"{shown(1e3 * each['mean'])} / {shown(1e3 * each['max'])}"
    )


def _ratios(ratios: dict[str, dict[str, float]], title: str) -> Table:
    names = list(next(iter(ratios.values())))
    return table(
        title,
        _by_shape(ratios),
        {name: lambda each, name=name: shown(each[name]) for name in names},
        "patch",
    )


def _combinations(rows: list[Row], quantity: str, run: str, title: str) -> Table:
    """Return a table of every model on the six shapes: one statistic of one kind of run, and the costs of the runs."""
    chosen = [
        row
        for row in rows
        if run in row.case and quantity in row.errors and "far" not in row.case
    ]
    shapes = [
        shape
        for shape in SIX_SHAPES
        if any(shape_of(row.case) == IN_WORDS[shape] for row in chosen)
    ]
    result = []
    for model in (
        model for model in MODEL_WORDS if any(row.model == model for row in chosen)
    ):
        own = [row for row in chosen if row.model == model]
        by_shape = {shape_of(row.case): row for row in own}
        values = (by_shape.get(IN_WORDS[shape]) for shape in shapes)
        cells = [
            "as full" if row is None else shown(1e3 * row.errors[quantity])
            for row in values
        ]
        costs = [row.time for row in own]
        states = [row.states for row in own]
        result.append(
            (MODEL_WORDS[model], _span(states, str), _span(costs, shown), *cells)
        )
    words = [IN_WORDS[shape] for shape in shapes]
    note = "Time: in the solver, over the distributed model's. As full: no more cells than asked for."
    return Table(
        f"Every combination, {title}",
        ("model and surface", "bristles", "time", *words),
        result,
        note,
    )


def _span(values: list[Any], words: Callable[[Any], str]) -> str:
    low = words(min(values))
    high = words(max(values))
    return low if low == high else f"{low} to {high}"


def _spread(values: Iterable[float]) -> str:
    middle, first, third = map(shown, values)
    return f"{middle} ({first} to {third})"


COLOURS = dict(
    zip(
        KINDS,
        (
            looks.PUBLISHED,
            looks.REDUCED,
            looks.DISTRIBUTED,
            looks.QUARTIC,
            looks.ELLIPSOID,
        ),
        strict=True,
    )
)

MODEL_COLOURS = dict(
    zip(
        MOVED,
        (looks.PUBLISHED, SHADES[0], looks.REDUCED, SHADES[3], looks.DISTRIBUTED),
        strict=True,
    )
)


def surface_errors(errors: dict[str, Arrays]) -> PlotFigure:
    """Draw errors of force [N] and torque [N mm] of each kind of surface from the exact one."""
    figure, panels = looks.box_panels(
        [IN_WORDS[shape].replace(", ", ",\n") for shape in errors], 6.8
    )
    rows = (
        ("force", 1.0, "error of the force [N]"),
        ("torque", 1e3, "error of the torque [N mm]"),
    )
    for axes, (quantity, factor, label) in zip(panels, rows, strict=True):
        for place, each in enumerate(errors.values()):
            kinds = [kind for kind in KINDS if f"{kind}/{quantity}" in each]
            for i, kind in enumerate(kinds):
                at = place + 0.15 * (i - 0.5 * (len(kinds) - 1))
                numbers = np.percentile(
                    factor * each[f"{kind}/{quantity}"], [5, 25, 50, 75, 95, 100]
                )
                looks.box(axes, at, numbers, COLOURS[kind], 0.12)
        axes.set(yscale="log", ylabel=label)
    shown = {
        kind: COLOURS[kind]
        for kind in KINDS
        if any(f"{kind}/force" in each for each in errors.values())
    }
    looks.box_legend(figure, shown, 6)
    return figure


def staircase(stairs: Arrays) -> PlotFigure:
    """Draw the torque [N mm] and force [N] of a spin over its centre [mm], summed and exact, for line and disc."""
    figure, panels = looks.panels(9.6, 6.0, 2, 2, sharex=True)
    place = 1e3 * stairs["place"]
    for row, shape in zip(panels, ("Line", "Circle"), strict=True):
        for axes, ending, factor, label, from_exact in (
            (row[0], "", 1e3, "torque [N mm]", "torque, from the exact one [N µm]"),
            (row[1], ", force", 1.0, "force [N]", "force, from the exact one [mN]"),
        ):
            cells = factor * stairs[f"{shape}/sum{ending}"]
            exact = factor * stairs[f"{shape}/exact{ending}"]
            # Steps of a few thousandths do not show beside the curve itself.
            if shape == "Circle":
                cells = 1e3 * (cells - exact)
                exact = 0.0 * exact
                label = from_exact
            axes.plot(
                place,
                cells,
                color=looks.DISTRIBUTED,
                lw=1.1,
                label="sum over the 21 x 21 grid's cells",
            )
            axes.plot(place, exact, color=looks.REFERENCE, lw=1.3, label="exact")
            axes.set(ylabel=label, xlim=(0.0, place[-1]))
            axes.set_title(IN_WORDS[shape], fontsize="medium", loc="left")
    for axes in panels[1]:
        axes.set_xlabel("centre of rotation from the middle [mm]")
    figure.align_ylabels(panels)
    looks.legend(figure, panels[0, 0], 2)
    return figure


def driven_boxes(errors: dict[str, dict[str, dict[str, float]]]) -> PlotFigure:
    """Draw errors of force [mN] and torque [N mm] of the models, from the finer grid."""
    figure, panels = looks.box_panels([IN_WORDS[shape] for shape in errors], 7.0)
    rows = (
        ("", "error of the force [mN]", 1e-2),
        ("torque ", "error of the torque [N mm]", 1e-4),
    )
    for axes, (before, label, linear) in zip(panels, rows, strict=True):
        axes.set_yscale("symlog", linthresh=linear, linscale=0.4)
        for place, each in enumerate(errors.values()):
            for offset, (model, colour) in zip(
                (-0.32, -0.16, 0.0, 0.16, 0.32), MODEL_COLOURS.items(), strict=True
            ):
                values = [1e3 * each[model][before + name] for name in boxes.COLUMNS]
                looks.box(axes, place + offset, values, colour, 0.13)
        axes.set(ylabel=label, ylim=(0.0, None))
    looks.box_legend(
        figure, {MOVED[model]: colour for model, colour in MODEL_COLOURS.items()}, 3
    )
    return figure


def grooves(numbers: dict[str, Any]) -> PlotFigure:
    """Draw the drift of the grooved block [deg] over the slope [deg], simulated and in closed form."""
    figure, axes = looks.panels(5.4, 3.6)
    slopes = np.array(numbers["slope"])
    fine = np.linspace(slopes[0], slopes[-1], 100)
    closed = np.degrees([contacts.closed_drift(slope) for slope in fine])
    axes.plot(np.degrees(fine), closed, color=looks.REFERENCE, label="closed form")
    colours = (looks.DISTRIBUTED, looks.REDUCED, looks.PUBLISHED)
    for kind, marker, colour in zip(
        contacts.GROOVED_MODELS, "ox+", colours, strict=True
    ):
        look = {"color": colour, "label": kind, "fillstyle": "none", "ms": 7}
        axes.plot(np.degrees(slopes), np.degrees(numbers[kind]), marker, **look)
    axes.set(
        xlabel="slope [deg]", ylabel="drift from the fall line [deg]", ylim=(0.0, None)
    )
    axes.legend(frameon=False)
    return figure


RUNGS = {name: str(count) for count, name in NAMES.items()}
RUNGS |= {"1 discs": "1 disc", ALL: "one disc\nper cell"}
"""Model of the ladder -> words beside its marker."""

BESIDE = {
    "1 discs": (-5, 0),
    "4 discs": (-5, -5),
    "8 discs": (6, 4),
    "reduced": (-7, -8),
    "64 discs": (5, 5),
    ALL: (0, 9),
}
"""Model -> offset of its words from its marker [points]; the others have none."""

KINDS_OF_RUN = (
    ("driven, ", "third quartile", 100.0, "force error [% of the normal force]",
     "prescribed velocity"),
    ("load 2", "end", 1e3, "error of the final position [mm]", "in-hand slip"),
)  # fmt: skip
"""Part of the name of the cases, the error that is shown, its unit, its axis and the title of the panel."""

FLOOR = 1e-4
"""Smallest error that is drawn [%, mm]."""

TICKS = (0.05, 0.1, 0.2, 0.5, 1, 2, 5)


def draw_ladder(rows: list[Row], shifts: dict[str, float]) -> PlotFigure:
    """Draw the error over the time of a run, for patches of many cells; bars from the least to the largest error.

    `shifts` says by case how far 0.1 % of friction moves the end [m]; the smallest one is drawn.
    """
    from matplotlib.ticker import FixedLocator, NullLocator

    many = {shape_of(row.case) for row in rows if row.model == "64 discs"}
    kept = [row for row in rows if not many or shape_of(row.case) in many]
    with paper():
        figure = new_figure(PAGE, 3.3)
        panels = figure.subplots(1, 2)
        for axes, (case, name, unit, label, title) in zip(
            panels, KINDS_OF_RUN, strict=True
        ):
            some = [row for row in kept if case in row.case]
            errors = lambda model, some=some, name=name, unit=unit: (
                [row.time for row in some if row.model == model],
                [
                    max(unit * row.errors[name], FLOOR)
                    for row in some
                    if row.model == model
                ],
            )
            _draw_rungs(axes, errors)
            _draw_whole(axes, errors("full"), reference=name == "end")
            found = [1e3 * shifts[row.case] for row in some if row.case in shifts]
            if found:
                _draw_shift(axes, min(found))
            axes.set(xscale="log", yscale="log", ylabel=label)
            axes.set_xlabel("time of a run, all cells = 1")
            axes.set_title(title, loc="left")
            axes.margins(x=0.12, y=0.1)
            if some:
                axes.set_xlim(left=0.3 * axes.dataLim.x0)
            axes.xaxis.set_major_locator(FixedLocator(TICKS))
            axes.xaxis.set_major_formatter("{x:g}")
            axes.xaxis.set_minor_locator(NullLocator())
            axes.yaxis.set_major_formatter("{x:g}")
            axes.yaxis.set_minor_locator(NullLocator())
        tidy(*panels)
    return figure


def _draw_rungs(axes: Any, errors: Callable[[str], tuple[list, list]]) -> None:
    """Draw the models of the ladder as one line, and the published one."""
    medians = []
    for model, words in RUNGS.items():
        times, values = errors(model)
        if not values:
            continue
        at = (float(np.median(times)), float(np.median(values)))
        _bar(axes, at[0], values, looks.REDUCED)
        medians.append(at)
        if model in BESIDE:
            words = f"{words},\ndefault" if model == "reduced" else words
            _name(axes, words, at, BESIDE[model], looks.REDUCED)
        if model == "reduced":
            axes.plot(*at, "o", ms=8, color=looks.REDUCED, mec="black", zorder=5)
    if medians:
        look = {"color": looks.REDUCED, "ms": 4.5, "mec": "white", "lw": 1.4}
        axes.plot(*np.transpose(medians), "-o", **look, zorder=4)
    times, values = errors("published")
    if values:
        at = (float(np.median(times)), float(np.median(values)))
        _bar(axes, at[0], values, looks.PUBLISHED)
        axes.plot(*at, "^", color=looks.PUBLISHED, ms=7, mec="white", zorder=5)
        rising = max(values) > 2.0 * at[1]  # where its bar is
        _name(
            axes,
            "3 states",
            at,
            (-6, 0) if rising else (0, 6),
            LETTERS[looks.PUBLISHED],
        )


def _draw_whole(axes: Any, errors: tuple[list, list], *, reference: bool) -> None:
    """Draw the model of all cells: a line where it is the reference, whose errors are zero."""
    times, values = errors
    if not values:
        return
    at = (float(np.median(times)), float(np.median(values)))
    letters = LETTERS[looks.DISTRIBUTED]
    if reference:
        axes.axvline(at[0], color=looks.DISTRIBUTED, lw=1.4)
        place = {"xycoords": ("data", "axes fraction"), "rotation": 90}
        axes.annotate("all cells: the reference", (at[0], 0.0), (3, 4),
                      textcoords="offset points", fontsize=7, color=letters, **place)  # fmt: skip
        return
    _bar(axes, at[0], values, looks.DISTRIBUTED)
    axes.plot(*at, "s", color=looks.DISTRIBUTED, ms=6.5, mec="black", mew=0.6, zorder=5)
    _name(axes, "all cells", at, (6, 2), letters)


def _draw_shift(axes: Any, shift: float) -> None:
    """Draw how far a change of friction moves the end."""
    axes.axhline(shift, color="black", lw=0.8, ls=":")
    place = {"xycoords": ("axes fraction", "data"), "ha": "right", "va": "top"}
    words = axes.annotate("effect of 0.1 % of friction", (0.99, shift), (0, -2),
                          textcoords="offset points", fontsize=7, **place)  # fmt: skip
    words.set_path_effects(list(HALO))


def _bar(axes: Any, at: float, values: list[float], colour: str) -> None:
    axes.vlines(at, min(values), max(values), color=colour, lw=3.5, alpha=0.25)


def _name(
    axes: Any, words: str, at: tuple[float, float], offset: tuple[int, int], colour: str
) -> None:
    """Write words beside a marker."""
    sides = {-1: "right", 0: "center", 1: "left"}
    heights = {-1: "top", 0: "center", 1: "bottom"}
    name = axes.annotate(
        words,
        at,
        offset,
        textcoords="offset points",
        ha=sides[int(np.sign(offset[0]))],
        va=heights[int(np.sign(offset[1]))],
        color=colour,
        fontsize=7,
        linespacing=1.15,
        zorder=9,
    )
    name.set_path_effects(list(HALO))
