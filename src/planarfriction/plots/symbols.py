"""Symbols of quantities in the plane, one for each: the colour says which model, the shape says which quantity."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.patches import Circle, Wedge
from matplotlib.patheffects import Normal, Stroke

from planarfriction.plots import style

HALO = (Stroke(linewidth=3.0, foreground="white"), Normal())
"""White rim that lifts words off what lies below them."""

Point = Sequence[float] | np.ndarray
"""Point or vector (x, y) in the units of the axes."""


def friction(
    axes: Any, at: Point, vector: Point, colour: str = style.REDUCED, size: float = 1.0
) -> None:
    """Draw friction on the body as a thick arrow with a filled head, its tail `at` the point where it acts."""
    head = f"-|>,head_width={0.3 * size:g},head_length={0.55 * size:g}"
    _arrow(axes, at, vector, arrowstyle=head, lw=2.0 * size, color=colour)


def velocity(axes: Any, at: Point, vector: Point, size: float = 1.0) -> None:
    """Draw a velocity of slip as a thin grey arrow with an open head."""
    head = f"->,head_width={0.2 * size:g},head_length={0.35 * size:g}"
    _arrow(axes, at, vector, arrowstyle=head, lw=0.9 * size, color="0.25")


def load(axes: Any, at: Point, vector: Point, words: str = "") -> None:
    """Draw a weight, push or load as a hollow arrow with its words below the head."""
    head = "simple,head_width=0.8,head_length=0.7,tail_width=0.3"
    _arrow(axes, at, vector, arrowstyle=head, lw=0.9, fc="white", ec="0.35")
    if words:
        place = {"xytext": (0, -2), "textcoords": "offset points"}
        axes.annotate(
            words, np.add(at, vector), **place, ha="center", va="top", color="0.3"
        )


def _arrow(axes: Any, at: Point, vector: Point, **look: Any) -> None:
    look |= {"shrinkA": 0.0, "shrinkB": 0.0}
    axes.annotate("", np.add(at, vector), at, arrowprops=look, zorder=8)


def centre_of_rotation(axes: Any, at: Point, size: float = 8.0, **look: Any) -> Any:
    """Draw a ring with a dot and return it, a line of one point."""
    look = {"mfc": "white", "mec": "black", "mew": 1.3, "zorder": 9} | look
    ring = axes.plot([at[0]], [at[1]], "o", ms=size, **look)[0]
    axes.plot([at[0]], [at[1]], "o", ms=0.3 * size, color="black", zorder=10)
    return ring


def centre_of_pressure(axes: Any, at: Point, size: float = 9.0, **look: Any) -> None:
    """Draw an upright plus with a white rim."""
    axes.plot([at[0]], [at[1]], "+", ms=size + 3.0, color="white", mew=4.0, zorder=8)
    axes.plot([at[0]], [at[1]], "+", ms=size, color="black", mew=1.6, zorder=9, **look)


def centre_of_mass(axes: Any, at: Point, radius: float) -> None:
    """Draw a quartered disc of a radius in units of the axes."""
    at = (float(at[0]), float(at[1]))
    axes.add_patch(Circle(at, radius, fc="white", ec="black", lw=0.9, zorder=9))
    for start in (0.0, 180.0):
        quarter = Wedge(at, radius, start, start + 90.0, fc="black", lw=0.0, zorder=10)
        axes.add_patch(quarter)


def scale_bar(axes: Any, at: Point, length: float, words: str) -> None:
    """Draw a bar of a length in units of the axes to the right of `at`, with its words above it."""
    end = at[0] + length
    axes.plot([at[0], end], [at[1]] * 2, color="black", lw=2.0, solid_capstyle="butt")
    place = {"xytext": (0, 2), "textcoords": "offset points"}
    middle = (0.5 * (at[0] + end), at[1])
    axes.annotate(words, middle, **place, ha="center", va="bottom", fontsize="small")
