"""Time histories of one or several solutions, overlaid for comparison."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from matplotlib import rcParams
from matplotlib.font_manager import FontProperties

import planarfriction as pf
from planarfriction._support import validation
from planarfriction._support.shown import Unit, unit_for
from planarfriction.errors import InvalidValueError, shown
from planarfriction.plots import style

if TYPE_CHECKING:
    import xarray as xr

LEAST_SPAN = 0.02
"""Least height of a panel, as a share of the largest value of its kind: what is nearly nothing looks like it."""

KICK = 5.0
"""A first sample this many times larger than all others does not set the height of its panel."""

NAMED = 6
"""Runs that the legend names where there are more than colours."""

LONGEST = 60
"""Letters in a line of the legend."""

LETTER = 6.6
"""Width of a letter of 10 pt [pt]."""

HANDLE = 48.0
"""Width of a line of the legend with its gaps [pt]."""


TITLES = "body: position, angle, speed", "contacts: friction on the body, normal force"
"""Titles of the columns of all panels; short ones end before the colon."""

LOW = 1.0
"""Height of a panel, with its share of all that is around it, below which labels have
two lines [inch]."""

NARROW = 6.0
"""Width of a figure below which titles are short [inch]."""


class _Panel(NamedTuple):
    title: str
    kind: str
    """Kind of unit."""
    of_contacts: bool


_PANELS = {
    "x": _Panel("x", "length", False),
    "y": _Panel("y", "length", False),
    "theta": _Panel("θ", "angle", False),
    "speed": _Panel("speed", "speed", False),
    "fx": _Panel("fx", "force", True),
    "fy": _Panel("fy", "force", True),
    "tau": _Panel("τ", "torque", True),
    "normal_force": _Panel("normal force", "force", True),
}


def plot_histories(
    solutions: pf.Solution | Mapping[str, pf.Solution],
    *,
    panels: Sequence[str] | None = None,
    size: Any = None,
    axes: Any = None,
) -> style.PlotFigure:
    """Plot position, angle, speed, forces, torque and normal force against time.

    `solutions` is one solution or a mapping from label to solution; several are overlaid. Colours distinguish the runs,
    the same for a model in every figure, line styles their contacts; with more than 7 runs the colours go from the
    first to the last, and the legend names some. Left the body (world axes, centre of mass), right the contacts: the
    friction wrench on the body about the origin of the contact frame, and the normal force.

    `panels` chooses among "x", "y", "theta", "speed", "fx", "fy", "tau" and "normal_force", drawn one below the other.
    `size` is the width and the height of the figure [inch]; `axes` are axes to draw into, one for each of `panels`,
    instead of a new figure, without a legend of their own.

    Raises InvalidValueError for what is not a solution, and for unknown panels, a wrong size or wrong axes.
    """
    known = as_runs(solutions)
    chosen = validation.choices(
        "panels", [*_PANELS] if panels is None else panels, _PANELS
    )
    if not chosen:
        rule = f"name at least one of {', '.join(_PANELS)}"
        raise InvalidValueError("panels", rule, panels)
    if axes is not None:
        drawn: Any = axes if isinstance(axes, list | tuple) else [axes]
        if isinstance(axes, np.ndarray) and axes.dtype == object:
            drawn = axes.ravel().tolist()
        for each in drawn:
            style.check_axes("axes", each, size)
        if len(drawn) != len(chosen):
            rule = f"be one for each of {len(chosen)} panels"
            raise InvalidValueError("axes", rule, f"{len(drawn)}")
        _draw_panels(drawn, chosen, known)
        return drawn[0].figure
    if panels is None:
        figure = style.new_figure(9.6, 8.0, size)
        draw_histories(figure, known)
        return figure
    figure = style.new_figure(5.6, 1.0 + 1.8 * len(chosen), size)
    column = list(figure.subplots(len(chosen), sharex=True, squeeze=False)[:, 0])
    _draw_panels(column, chosen, known)
    _finish(figure, column, chosen, known)
    return figure


def draw_histories(
    figure: Any, solutions: pf.Solution | Mapping[str, pf.Solution]
) -> None:
    """Draw the eight panels of `plot_histories` into a figure or subfigure."""
    known = as_runs(solutions)
    panels = figure.subplots(4, 2, sharex=True)
    axes = list(panels.T.ravel())
    chosen = list(_PANELS)
    _draw_panels(axes, chosen, known)
    for each in panels[:-1].ravel():
        each.set_xlabel("")
    for each, title in zip(panels[0], TITLES, strict=True):
        short = figure.bbox.width < NARROW * figure.dpi
        each.set_title(title.partition(":")[0] if short else title, fontsize="medium")
    _finish(figure, axes, chosen, known)


def _draw_panels(
    axes: Sequence[Any], chosen: Sequence[str], known: Mapping[str, pf.Solution]
) -> None:
    """Draw each of the chosen panels into its axes; panels of the same kind and side share a unit."""
    runs = {label: each.data for label, each in known.items()}
    colours = _colours(list(known.values()))
    panels = [_PANELS[name] for name in chosen]
    clock = unit_for("time", *(data["time"] for data in runs.values()))
    lines = [_lines(runs, name) for name in chosen]
    for place, panel, own in zip(axes, panels, lines, strict=True):
        sides = zip(panels, lines, strict=True)
        alike = [
            line.shown
            for other, each in sides
            if (other.kind, other.of_contacts) == panel[1:3]
            for line in each
        ]
        _draw_panel(place, panel.title, panel.kind, own, alike, clock, colours)
        place.set_xlabel(f"time [{clock.label}]")


def _finish(
    figure: Any,
    axes: Sequence[Any],
    chosen: Sequence[str],
    known: Mapping[str, pf.Solution],
) -> None:
    """Align labels, keep those of time in the last row, and add a legend."""
    if figure.bbox.height < LOW * figure.dpi * axes[0].get_gridspec().nrows:
        for each in axes:
            each.set_ylabel(each.get_ylabel().replace(" ", "\n", 1))
    figure.align_ylabels(axes)
    for above in axes[:-1] if len(chosen) < len(_PANELS) else ():
        above.set_xlabel("")
    of_contacts = [_PANELS[name].of_contacts for name in chosen]
    named = axes[of_contacts.index(True)] if any(of_contacts) else None
    runs = {
        label: each.data if named else each.data.isel(contact=[0])
        for label, each in known.items()
    }
    _legend(figure, named or axes[0], runs)


def as_runs(
    solutions: pf.Solution | Mapping[str, pf.Solution],
) -> dict[str, pf.Solution]:
    """Return the solutions by label; a single one is labelled with the name of its scene."""
    if not isinstance(solutions, Mapping):
        solution = validation.instance(
            "solutions", solutions, pf.Solution, "a Solution or a table of them by name"
        )
        return {str(solution.scene.name): solution}
    for name, each in solutions.items():
        validation.instance(
            "solutions", each, pf.Solution, f"Solutions, under {shown(name)!r} too"
        )
    if not solutions:
        raise InvalidValueError("solutions", "hold at least one Solution", solutions)
    return {str(name): each for name, each in solutions.items()}


class _Line(NamedTuple):
    run: int
    contact: int
    time: np.ndarray
    values: np.ndarray

    @property
    def shown(self) -> np.ndarray:
        """The values that the axes must hold: all, or all but a first one that dwarfs the others.

        Bristles that start at rest under a moving body kick once (`sigma_1 v f_N`), for microseconds.
        """
        first, *_ = self.values
        rest = self.values[1:]
        kicks = len(rest) > 1 and abs(first) > KICK * np.abs(rest).max() > 0.0
        return rest if kicks else self.values


def _lines(runs: Mapping[str, xr.Dataset], name: str) -> list[_Line]:
    """Return one line of a panel for each run, or for each contact of each run."""
    lines = []
    for run, data in enumerate(runs.values()):
        speed = name == "speed"
        found = (
            np.hypot(data["vx"].values, data["vy"].values)
            if speed
            else data[name].values
        )
        values = found.reshape(data.sizes["time"], -1)
        lines += [
            _Line(run, contact, data["time"].values, each)
            for contact, each in enumerate(values.T)
        ]
    return lines


def _draw_panel(
    axes: Any,
    title: str,
    kind: str,
    lines: list[_Line],
    alike: list[np.ndarray],
    clock: Unit,
    colours: list[Any],
) -> None:
    """Draw one panel; `alike` are the values of all panels of its kind in this column, which share their unit."""
    unit = unit_for(kind, *alike)
    for line in lines:
        look = _look(line.run, line.contact, colours)
        if len(line.time) == 1:
            look["marker"] = "o"
        axes.plot(clock.factor * line.time, unit.factor * line.values, **look)
    low = unit.factor * min(line.shown.min() for line in lines)
    high = unit.factor * max(line.shown.max() for line in lines)
    least = LEAST_SPAN * unit.factor * max(np.abs(values).max() for values in alike)
    span = max(1.1 * (high - low), least) or 1.0
    axes.set_ylim(0.5 * (low + high - span), 0.5 * (low + high + span))
    axes.set_ylabel(style.with_unit(title, unit))
    axes.ticklabel_format(axis="y", useOffset=False)
    axes.margins(x=0.01)
    style.tidy(axes)


def _colours(solutions: Sequence[pf.Solution]) -> list[Any]:
    """Choose colours: one per model if all models differ, otherwise in order."""
    if len(solutions) > len(style.SERIES):
        return list(style.TIME_COLOURS(np.linspace(0.0, 1.0, len(solutions))))
    own = [
        each.scene and style.model_colour(each.scene.contacts[0].model)
        for each in solutions
    ]
    different = None not in own and len(set(own)) == len(own)
    return own if different else list(style.SERIES[: len(solutions)])


def _look(run: int, contact: int, colours: list[Any]) -> dict[str, Any]:
    # Later runs are drawn dashed over the earlier ones, so that curves that coincide are both seen.
    many = len(colours) > len(style.SERIES)
    which = contact if many else run + contact
    line = style.LINE_STYLES[which % len(style.LINE_STYLES)]
    width = 0.9 if many else None
    return {"color": colours[run], "linestyle": line, "linewidth": width}


def _legend(figure: Any, axes: Any, runs: dict[str, xr.Dataset]) -> None:
    """Add one entry for each line of a contact panel, a row for each run; none where there is a single line."""
    lines = iter(axes.get_lines())
    table = [
        [
            (next(lines), label if data.sizes["contact"] == 1 else f"{label}, {name}")
            for name in data["contact"].values
        ]
        for label, data in runs.items()
    ]
    title = None
    if len(table) > len(style.SERIES):
        some = style.evenly(len(table), NAMED)
        title = f"{len(some)} of {len(table)} runs, coloured in their order"
        table = [table[each] for each in some]
    columns = max(len(row) for row in table)
    # Matplotlib fills a legend column by column: runs of the same contact stand below each other.
    entries = [
        row[column] for column in range(columns) for row in table if column < len(row)
    ]
    if len(entries) == 1:
        return
    entries = [(line, style.wrapped(words, LONGEST)) for line, words in entries]
    longest = max(len(line) for _, words in entries for line in words.splitlines())
    size = FontProperties(size=rcParams["legend.fontsize"]).get_size_in_points() / 10.0
    width = 72.0 * figure.bbox.width / figure.dpi
    room = int(width / (LETTER * longest + HANDLE) / size)
    ncols = max(1, min(4, room, len(entries) if columns == 1 else columns))
    figure.legend(
        *zip(*entries, strict=True), loc="outside upper center", ncols=ncols, frameon=False, title=title,
        title_fontsize="medium",
    )  # fmt: skip
