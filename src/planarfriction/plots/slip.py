"""Slip of a contact: its cells at some instants, and below them friction and the load that slips."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.patches import Patch

import planarfriction as pf
from planarfriction._support import validation
from planarfriction._support.shown import unit_for
from planarfriction.errors import InvalidValueError
from planarfriction.plots import panels, style
from planarfriction.plots.track import ContactTrack, track_of

INSTANTS = (0.2, 0.45, 0.7, 0.95)
"""Shares of the largest slip at whose first instants cells are drawn, if no times are given [-]."""

MOST_TIMES = 6
"""Instants that are drawn at most."""

SAMPLES = 400
"""Instants at most between which slip is found."""


def plot_slip(
    solution: pf.Solution,
    contact: str | None = None,
    *,
    times: Any = None,
    size: Any = None,
) -> style.PlotFigure:
    """Draw which cells of a contact stick and slip at `times` [s], and friction and the load that slips over time.

    Cells are paler than blue where their bristles are less deflected, orange with a dot where they slip: where bristles
    take up less than half of the motion (see `animate_solution`). `contact` is a name; None takes the only one. Without
    `times`, they are those at which slip has spread a fifth, a half, two thirds and nearly all of the way to its
    largest extent. `size` is the width and the height of the figure [inch].

    Raises InvalidValueError for what is not a solution, a contact that does not exist or has no bristles, more than 6
    times or times beyond those of the solution, and a wrong size; FileError for a solution without its scene.
    """
    from planarfriction.scenes.solution import scene_of

    words = "a Solution"
    scene_of(validation.instance("solution", solution, pf.Solution, words), "the plot")
    index = solution.contact_index(contact)
    sampled = solution.histories["time"].values
    every = np.unique(np.linspace(0, len(sampled) - 1, SAMPLES).astype(int))
    clock = sampled[every]
    if times is not None:
        times = _checked(times, sampled)
        clock = np.unique(np.concatenate([clock, times]))
    track = track_of(solution, clock).contacts[index]
    if track.slip is None:
        rule = "have bristles that are known"
        raise InvalidValueError("contact", rule, track.contact.name)
    weights = np.array([track.shape(frame)[0] for frame in range(len(clock))])
    slipping = (weights * track.slip.slips).sum(axis=1)
    frames = _instants(slipping) if times is None else np.searchsorted(clock, times)
    figure = style.new_figure(style.PAGE, 3.6, size)
    grid = figure.add_gridspec(2, len(frames), height_ratios=(1.5, 1.0))
    unit = unit_for("time", clock[-1])
    for column, frame in enumerate(frames):
        axes = figure.add_subplot(grid[0, column])
        _draw_cells(axes, track, int(frame))
        share = 100.0 * slipping[frame]
        at = f"{unit.factor * clock[frame]:.3g} {unit.label}"
        axes.set_title(f"{at}: {share:.0f} % slips", fontsize="medium")
    below = figure.add_subplot(grid[1, :])
    _draw_course(below, track, unit.factor * clock, slipping, frames)
    below.set_xlabel(f"time [{unit.label}]")
    handles = [Patch(color=style.STICKS, label="sticks")]
    handles.append(Patch(color=style.SLIPS, label="slips"))
    figure.legend(handles=handles, loc="outside upper right", ncols=2, frameon=False)
    return figure


def _checked(times: Any, sampled: np.ndarray) -> np.ndarray:
    times = validation.array("times", times, (None,))
    if not 1 <= len(times) <= MOST_TIMES:
        raise InvalidValueError("times", f"be 1 to {MOST_TIMES}", len(times))
    if times.min() < sampled[0] or times.max() > sampled[-1]:
        rule = f"lie between {sampled[0]:g} and {sampled[-1]:g}"
        raise InvalidValueError("times", rule, times.tolist())
    return times


def _instants(slipping: np.ndarray) -> np.ndarray:
    """Return the frames at which slip has reached shares of its largest extent; evenly spread ones without slip."""
    most = slipping.max()
    if most == 0.0:
        return np.linspace(0, len(slipping) - 1, len(INSTANTS)).astype(int)
    first = [int(np.argmax(slipping >= share * most)) for share in INSTANTS]
    return np.unique(first)


def _draw_cells(axes: Any, track: ContactTrack, frame: int) -> None:
    cells = panels.cells_of(track, edge="face")
    panels.colour_cells(cells, track, frame)
    axes.add_collection(cells)
    patch = track.contact.model.patch
    slips = track.slip is not None and track.slip.slips[frame]
    dots = 1e3 * patch.positions[slips & (track.shape(frame)[0] > 0.0)]
    size = min(1.5, (120.0 / patch.cells) ** 0.5)
    axes.plot(*dots.T, ".", color=style.SLIP_DOT, ms=3.0 * size, mew=0.0)
    axes.autoscale_view()
    axes.set_aspect("equal")
    axes.axis("off")


def _draw_course(
    axes: Any,
    track: ContactTrack,
    clock: np.ndarray,
    slipping: np.ndarray,
    frames: np.ndarray,
) -> None:
    """Draw the friction force over its limit, the load that slips, and marks at frames."""
    limit = float(track.contact.model.law.numbers.mu_c) * track.loads
    force = np.hypot(*track.wrenches[:, :2].T)
    share = np.divide(force, limit, out=np.zeros_like(force), where=limit > 0.0)
    axes.fill_between(clock, 100.0 * slipping, color=style.SLIPS, lw=0.0)
    axes.plot(clock, 100.0 * share, color=style.REDUCED)
    for frame in frames:
        axes.axvline(clock[frame], color="0.4", lw=0.6, ls=(0, (3, 2)))
    axes.set(xlim=(clock[0], clock[-1]), ylim=(0.0, None))
    axes.set_ylabel("share [%]")
    end = len(clock) - 1
    early = len(clock) // 20
    place: dict[str, Any] = {"textcoords": "offset points", "va": "bottom"}
    words = r"friction / $\mu_c f_N$"
    start = (clock[early], 100.0 * share[: 4 * early + 1].max())
    axes.annotate(words, start, (0, 4), **place, color=style.REDUCED)
    middle = (clock[end], 50.0 * slipping[end])
    axes.annotate("load that slips", middle, (-3, -4), **place, ha="right")
    style.tidy(axes)
