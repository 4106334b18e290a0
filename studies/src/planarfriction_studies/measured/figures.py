"""Figures of the comparison on measured data."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from planarfriction.plots import style
from planarfriction_studies.measured import pushes, slides
from planarfriction_studies.measured.benchmark import Benchmark, Result
from planarfriction_studies.measured.questions import Case
from planarfriction_studies.measured.tasks import TASKS

DRAWN = ("uncoupled", "ellipsoid", "exact surface", "toss by toss")
"""Models of an example, where they took part, besides those of the user."""

COLOURS: dict[str, str] = {
    "uncoupled": style.OTHER,
    "ellipsoid": style.ELLIPSOID,
    "exact surface": style.REFERENCE,
    "toss by toss": style.REDUCED,
}
"""Model of an example -> its colour; the others take what is left, one after the other."""

ROLES = COLOURS | {
    "reduced": style.REDUCED,
    "distributed": style.DISTRIBUTED,
    "MuJoCo box": style.BUILT_IN,
    "toss by toss": "0.45",
}
"""Model -> its colour among all models; the others are grey."""

PEAKS = (0.8, 1.6)
"""Peaks of the force over its level that are drawn; a few lie outside."""

PAIRS = 5
"""Centres of rotation of which measured and predicted ones are joined."""

INSIDE = 0.98
"""Largest coordinate of these, as a share of the view [-]."""


def draw(benchmark: Benchmark, task: str) -> dict[str, style.PlotFigure]:
    """Return the pictures of a task by their names; the first one has the name of the task."""
    rows = len(benchmark.results[task])
    with style.paper():
        if task == "slides":
            figure = style.new_figure(style.PAGE, 0.9 + 0.21 * rows)
            _errors(figure, benchmark, task)
            paths = style.new_figure(style.PAGE, 3.6)
            _draw_slides(paths, benchmark)
            return {task: figure, f"{task}-paths": paths}
        figure = style.new_figure(style.PAGE, max(2.8, 0.9 + 0.21 * rows))
        # An array of them, which its annotation does not say.
        parts: Any = figure.subfigures
        left, right = parts(1, 2, width_ratios=(1.5, 1.0))
        _dots(left, benchmark, task)
        {"pushes": _draw_centres, "series": _draw_series, "onsets": _draw_onsets}[task](
            right, benchmark
        )
    return {task: figure}


def _measures(benchmark: Benchmark, task: str) -> list[Any]:
    """Return the measures that all models have."""
    results = benchmark.results[task].values()
    measures = TASKS[task].measures
    return [m for m in measures if all(m.key in each.scores for each in results)]


def _errors(figure: Any, benchmark: Benchmark, task: str) -> None:
    """Draw the measures of each model, a panel for each unit: filled dots for the first one, open dots for the next."""
    results = benchmark.results[task]
    of_unit: dict[str, list[Any]] = {}
    for measure in _measures(benchmark, task):
        name, _, unit = measure.heading.partition(" [")
        of_unit.setdefault(unit.rstrip("]"), []).append((name, measure))
    panels = figure.subplots(1, len(of_unit), sharey=True, squeeze=False)[0]
    for axes, (unit, measures) in zip(panels, of_unit.items(), strict=True):
        for (_, measure), open_dot in zip(measures, (False, True), strict=False):
            scores = [result.scores[measure.key] for result in results.values()]
            _intervals(axes, list(results), scores, open_dot=open_dot)
        sign = unit.replace("deg", "\N{DEGREE SIGN}")
        what = f"{measures[0][1].total.__name__} {measures[0][1].quantity}"
        axes.set(xlim=(0.0, None), xlabel=f"{what} [{sign}]")
        style.tidy(axes)
    names = [name for name, _ in next(iter(of_unit.values()))]
    look = {"ls": "", "marker": "o", "color": "0.3"}
    handles = [
        panels[0].plot([], [], **look, mfc=fill, label=name)[0]
        for name, fill in zip(names, ("0.3", "white"), strict=False)
    ]
    figure.legend(handles=handles, loc="outside upper center", ncols=2, frameon=False)


def _intervals(
    axes: Any, names: Sequence[str], scores: Sequence[Any], *, open_dot: bool
) -> None:
    """Draw the value of each score with its interval, in the colour of its model."""
    for place, (name, score) in enumerate(zip(names, scores, strict=True)):
        colour = ROLES.get(name, "0.45")
        ends = [[score.value - score.low], [score.high - score.value]]
        look = {"color": colour, "markersize": 4, "elinewidth": 1.1}
        fill = "white" if open_dot else colour
        axes.errorbar(
            score.value, -place, xerr=np.maximum(ends, 0.0), fmt="o", mfc=fill, **look
        )
    axes.set(yticks=-np.arange(len(names)), yticklabels=names)


def _dots(part: Any, benchmark: Benchmark, task: str) -> None:
    """Draw each measure of each model, with its interval."""
    results = benchmark.results[task]
    measures = _measures(benchmark, task)
    every = part.subplots(1, len(measures), sharey=True, squeeze=False)[0]
    for axes, measure in zip(every, measures, strict=True):
        scores = [result.scores[measure.key] for result in results.values()]
        _intervals(axes, list(results), scores, open_dot=False)
        axes.set_xlim(left=0.0)
        name, _, unit = measure.heading.partition(" [")
        axes.set_title(name.replace(", ", "\n").replace(" on ", "\non "), loc="left")
        sign = unit.replace("deg", "\N{DEGREE SIGN}")
        what = f"{measure.total.__name__} {measure.quantity}"
        axes.set_xlabel(f"{what}{sign and f' [{sign}'}")
        style.tidy(axes)
    # One label below all axes of one quantity: several would meet.
    if len({axes.get_xlabel() for axes in every}) == 1:
        for axes in np.delete(every, len(every) // 2):
            axes.set_xlabel("")


def _chosen(benchmark: Benchmark, task: str) -> dict[str, Any]:
    """Return the results that an example shows: a few of the library, and those of the user."""
    from planarfriction_studies.measured.library import LIBRARY

    results = benchmark.results[task]
    own = [name for name in results if name not in LIBRARY]
    wanted = [name for name in (*DRAWN, *own) if name in results] or list(results)
    return {name: results[name] for name in wanted[: len(style.SERIES)]}


def _colours(chosen: Mapping[str, Any]) -> dict[str, str]:
    """Return the colour of each of the chosen models."""
    left = iter(colour for colour in style.SERIES if colour not in COLOURS.values())
    return {name: COLOURS.get(name) or next(left, style.OTHER) for name in chosen}


def _draw_slides(part: Any, benchmark: Benchmark, count: int = 3) -> None:
    """Draw a few slides, measured and predicted: path and angle."""
    test = benchmark.test("slides")
    chosen = _chosen(benchmark, "slides")
    shown = slides.by_spin(test, count)
    sure = next(
        (name for name, result in chosen.items() if result.regions is not None), None
    )
    colours = _colours(chosen)
    grid = part.add_gridspec(2, count + 1, height_ratios=(1.3, 1.0))
    places = [grid[row, column] for column in range(count) for row in range(2)]
    every = [part.add_subplot(each) for each in places]
    if sure is not None:
        ends = part.add_subplot(grid[0, count])
        _draw_ends(ends, test, chosen[sure], colours[sure])
        style.tidy(ends)
    for i, case in enumerate(shown):
        way, turn = every[2 * i : 2 * i + 2]
        index = next(j for j, each in enumerate(test) if each is case)
        first = case.answer[0]
        time = case.question.time
        way.plot(
            *_shift(case.answer, first),
            color=style.MEASURED,
            linewidth=3.0,
            label="measured",
        )
        turn.plot(
            time,
            np.degrees(case.answer[:, 2] - first[2]),
            color=style.MEASURED,
            linewidth=3.0,
        )
        for name, result in chosen.items():
            colour = colours[name]
            poses = result.answers[index]
            turned = np.degrees(poses[:, 2] - first[2])
            way.plot(*_shift(poses, first), color=colour, linewidth=1.2, label=name)
            turn.plot(time, turned, color=colour, linewidth=1.2)
            if result.regions is not None:
                edge = 1e3 * (
                    poses[-1, :2] - first[:2] + ellipse(result.regions[index])
                )
                way.plot(*edge.T, color=colour, linewidth=0.9)
                half = float(np.degrees(np.sqrt(result.regions[index][2, 2])))
                turn.errorbar(
                    time[-1],
                    turned[-1],
                    yerr=half,
                    color=colour,
                    elinewidth=0.9,
                    capsize=2.5,
                )
        way.set(aspect="equal", xlabel="x [mm]", ylabel="y [mm]")
        way.set_adjustable("datalim")
        turn.set(xlabel="time [s]", ylabel="rotation [\N{DEGREE SIGN}]")
        way.set_title(case.name, loc="left")
        if i:
            way.set_ylabel("")
            turn.set_ylabel("")
    for axes in every:
        style.tidy(axes)
    key = part.add_subplot(grid[1, count])
    key.axis("off")
    key.legend(*every[0].get_legend_handles_labels(), loc="center")


def _finish(part: Any, every: Any, columns: int) -> None:
    """Tidy all axes of a part, with small letters, and put the legend of the first below it."""
    for axes in every:
        style.tidy(axes)
        axes.tick_params(labelsize="small")
        axes.xaxis.label.set_fontsize("small")
        axes.yaxis.label.set_fontsize("small")
    look = {
        "loc": "outside lower center",
        "ncols": columns,
        "frameon": False,
        "fontsize": "small",
    }
    part.legend(*every[0].get_legend_handles_labels(), **look)


def ellipse(region: np.ndarray) -> np.ndarray:
    """Return points `[P, 2]` on the edge of the region of a place, `d' S^-1 d = 1`."""
    angle = np.linspace(0.0, 2.0 * np.pi, 61)
    return (
        np.stack([np.cos(angle), np.sin(angle)], axis=1)
        @ np.linalg.cholesky(region[:2, :2]).T
    )


def _draw_ends(axes: Any, test: Sequence[Case], result: Result, colour: str) -> None:
    """Draw the measured ends of all slides about the predicted ones, each in half axes of its own ellipse."""
    assert result.regions is not None
    off = np.array(
        [
            case.answer[-1] - poses[-1]
            for case, poses in zip(test, result.answers, strict=True)
        ]
    )[:, :2]
    squares, ways = np.linalg.eigh(result.regions[:, :2, :2])
    off = np.einsum("kij,ki->kj", ways, off) / np.sqrt(squares)
    axes.plot(*off[:, ::-1].T, ".", color="0.2", markersize=3)
    axes.plot(*ellipse(np.eye(3)).T, color=colour, linewidth=1.2)
    axes.set(aspect="equal", xlabel="along", ylabel="across")
    axes.set_title(f"{len(test)} ends, in half axes", loc="left", color=colour)


def _shift(poses: np.ndarray, first: np.ndarray) -> np.ndarray:
    """Return x and y from the start [mm], `[2, T]`."""
    return 1e3 * (poses[:, :2] - first[:2]).T


def _draw_centres(part: Any, benchmark: Benchmark) -> None:
    """Draw the measured and predicted centres of rotation of the pushes of one layout on feet."""
    test = benchmark.test("pushes")
    axes = part.subplots()
    number = next((i for i, case in enumerate(test) if "hard_10_90_10" in case.name), 0)
    case = test[number]
    corners = case.question.patch.positions
    chosen = _chosen(benchmark, "pushes")
    name = "exact surface" if "exact surface" in chosen else list(chosen)[-1]
    measured = 1e3 * centres(case.answer)
    predicted = 1e3 * centres(chosen[name].answers[number])
    limit = 1.6e3 * np.abs(corners).max()
    inside = (
        np.maximum(np.abs(measured), np.abs(predicted)).max(axis=1) < INSIDE * limit
    )
    some = np.flatnonzero(inside)
    some = some[style.evenly(len(some), PAIRS)] if len(some) else some
    for start, end in zip(measured[some], predicted[some], strict=True):
        axes.plot(*np.stack([start, end], axis=1), color="0.6", linewidth=0.9, zorder=1)
    shown = measured[some].T
    axes.plot(*shown, "o", color=style.MEASURED, markersize=6, label="measured")
    shown = predicted[some].T
    axes.plot(*shown, "x", color=ROLES.get(name, "0.45"), markersize=5, label=name)
    if len(corners) < 10:
        axes.plot(
            *1e3 * corners.T,
            "o",
            color="0.2",
            markersize=13,
            fillstyle="none",
            label="foot",
        )
    axes.set(
        xlim=(-limit, limit),
        ylim=(-limit, limit),
        aspect="equal",
        xlabel="x [mm]",
        ylabel="y [mm]",
    )
    axes.set_title(
        f"centres of rotation, {case.question.layout}",
        fontsize="small",
        loc="left",
    )
    _finish(part, [axes], 3)


def centres(twists: np.ndarray) -> np.ndarray:
    """Return centres of rotation `[M, 2]` [m] of twists; far away where there is no spin."""
    scale = np.linalg.norm(twists * [1.0, 1.0, pushes.LENGTH], axis=1)
    spin = twists[:, 2] + 1e-9 * scale / pushes.LENGTH
    return np.stack([-twists[:, 1], twists[:, 0]], axis=1) / spin[:, None]


def _draw_series(part: Any, benchmark: Benchmark) -> None:
    """Draw the direction of the wrench over time in the longest push: torque over force, as an angle."""
    from planarfriction_studies.measured.push_series import LENGTH

    test = benchmark.test("series")
    number = max(
        range(len(test)),
        key=lambda i: len(test[i].scored) * (test[i].question.wanted == "wrenches"),
    )
    case = test[number]
    axes = part.subplots(2, 1, sharex=True)
    time = case.question.time[case.scored]
    rows = case.scored
    chosen = _chosen(benchmark, "series")
    colours = {"measured": style.MEASURED} | _colours(chosen)
    for name, answer in {
        "measured": case.answer,
        **{n: r.answers[number] for n, r in chosen.items()},
    }.items():
        fx, fy, tau = answer[rows].T
        way = np.unwrap(np.arctan2(fy, fx))
        turns = np.median(way) - np.median(np.arctan2(*case.answer[rows, 1::-1].T))
        way -= 2.0 * np.pi * np.round(turns / (2.0 * np.pi))
        colour = colours[name]
        width = 3.0 if name == "measured" else 1.2
        axes[0].plot(time, np.degrees(way), color=colour, linewidth=width, label=name)
        axes[1].plot(
            time,
            np.degrees(np.arctan2(tau / LENGTH, np.hypot(fx, fy))),
            color=colour,
            linewidth=width,
        )
    axes[0].set(ylabel="direction of force [\N{DEGREE SIGN}]")
    axes[1].set(xlabel="time [s]", ylabel="torque against force [\N{DEGREE SIGN}]")
    axes[0].set_title(
        case.name.removesuffix(", wrenches"), fontsize="small", loc="left"
    )
    _finish(part, axes, 2)


def _draw_onsets(part: Any, benchmark: Benchmark) -> None:
    """Draw the peak of the force at breakaway over its level: measured against predicted, feet and flat faces."""
    test = benchmark.test("onsets")
    axes = part.subplots()
    results = benchmark.results["onsets"]
    name = next(
        (name for name in ("distributed", "reduced") if name in results),
        list(results)[-1],
    )
    for board, colour in (("feet", style.REDUCED), ("flat", "0.45")):
        rows = [i for i, case in enumerate(test) if case.board == board]
        pairs = np.array(
            [[results[name].answers[i][3], test[i].answer[3]] for i in rows]
        )
        axes.plot(*pairs.T, ".", color=colour, label=board)
        axes.plot(
            *np.median(pairs, axis=0),
            "o",
            color=colour,
            markersize=9,
            markeredgecolor="0.1",
        )
    axes.plot(PEAKS, PEAKS, color="0.7", linewidth=0.8, zorder=1)
    axes.set(
        xlim=PEAKS,
        ylim=PEAKS,
        aspect="equal",
        xlabel=f"peak over level, {name}",
        ylabel="measured",
    )
    axes.set_title("breakaway; rings: medians", fontsize="small", loc="left")
    _finish(part, [axes], 2)
