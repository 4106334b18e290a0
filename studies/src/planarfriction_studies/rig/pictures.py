"""Pictures of a part that a gripper holds: the part, the grip force, and the friction that an observer finds."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.patches import Circle, Polygon

from planarfriction._support.writing import replacing
from planarfriction.plots import style
from planarfriction.plots.film_files import check_kind, write_frames

if TYPE_CHECKING:
    from planarfriction_studies.rig.demo import GripRecord

HALF = np.array([0.035, 0.022])
"""Half sides of the part that is drawn [m]."""

VIEW = 62.0
"""Half side of the view [mm]."""

FPS = 20.0
"""Frames a second of a film."""


def plot_grip(record: GripRecord, row: int = -1) -> style.PlotFigure:
    """Draw a record up to one of its rows: the part in the hand, the grip force, and mu_c with its 95 % band."""
    figure = style.PlotFigure(figsize=(9.6, 4.8), layout="constrained", dpi=100)
    axes = figure.subplot_mosaic(
        [["part", "grip"], ["part", "mu"]], width_ratios=(1.0, 1.25)
    )
    row = range(len(record.time))[row]
    _draw_part(axes["part"], record, row)
    past = slice(0, row + 1)
    end = record.time[-1]
    time = record.time[past]
    truth = float(record.parts.mu_c[0])
    slips = record.slips[past] > 0.5
    axes["grip"].plot(time, record.grip[past], color=style.REDUCED)
    axes["grip"].set(
        ylabel="grip force [N]", xlim=(0.0, end), ylim=(0.0, 1.08 * record.grip.max())
    )
    mean, low, high = record.mu_c[past].T
    axes["mu"].fill_between(
        time, low, high, color=style.REDUCED, alpha=0.25, lw=0, label="95 % interval"
    )
    axes["mu"].plot(time, mean, color=style.REDUCED, label="estimate")
    axes["mu"].axhline(truth, color="k", ls=style.LINE_STYLES[1], lw=1.0, label="truth")
    axes["mu"].set(
        xlabel="time [s]", ylabel="$\\mu_c$", xlim=(0.0, end), ylim=(0.0, 2.0 * truth)
    )
    axes["mu"].legend(loc="lower right", ncols=3)
    for each in (axes["grip"], axes["mu"]):
        each.fill_between(
            time,
            0.0,
            1.0,
            where=slips,
            transform=each.get_xaxis_transform(),
            color=style.REFERENCE,
            alpha=0.2,
            lw=0,
        )
    axes["grip"].set_title("shaded: the observer sees a slip", fontsize="medium")
    return figure


def _draw_part(axes, record: GripRecord, row: int) -> None:
    """Draw the part, where it was gripped at first, and the contact, with gravity downwards."""
    (x, y, angle) = record.slip[row]
    tilt = record.tilt[row]
    turn = np.array([[np.cos(tilt), -np.sin(tilt)], [np.sin(tilt), np.cos(tilt)]])
    spin = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    corners = HALF * [(-1, -1), (1, -1), (1, 1), (-1, 1)]
    centre = record.centre[row]
    axes.add_patch(
        Polygon(1e3 * (centre + corners @ spin.T) @ turn.T, fc="0.85", ec="0.3")
    )
    axes.plot(*(1e3 * turn @ centre), "o", color="0.3", ms=5)
    first = 1e3 * turn @ (centre - spin @ record.parts.centre[0])
    axes.add_patch(
        Circle((0.0, 0.0), 1e3 * record.radius[row], fc=style.PAD, alpha=0.6, ec="k")
    )
    axes.plot(*first, "+", color="k", ms=12, mew=1.5)
    axes.set(
        xlim=(-VIEW, VIEW),
        ylim=(-VIEW, VIEW),
        aspect="equal",
        xlabel="[mm]",
        ylabel="[mm]",
    )
    words = f"slip {1e3 * np.hypot(x, y):.2f} mm, {np.degrees(angle):.1f} deg"
    axes.set_title(words.replace("-", "\N{MINUS SIGN}"), fontsize="medium")


def write_grip_film(path: Path, record: GripRecord) -> Path:
    """Write the film of a record: `.gif`, `.mp4` or `.html`, at the pace of the clock.

    Raises FileError for a file of another kind, or one that cannot be written.
    """
    check_kind(path)
    rows = np.searchsorted(
        record.time, np.arange(record.time[0], record.time[-1], 1.0 / FPS)
    )

    def frame(number: int) -> np.ndarray:
        canvas = FigureCanvasAgg(plot_grip(record, int(rows[number])))
        canvas.draw()
        return np.asarray(canvas.buffer_rgba())[..., :3]

    with replacing(path) as file:
        write_frames(path, file, frame, len(rows), FPS)
    return path
