"""Parts that all plots share: the figure class, the palette, and the units on the axes."""

from __future__ import annotations

import io
import textwrap
import warnings
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib import colormaps, rcParams
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import ListedColormap, Normalize
from matplotlib.figure import Figure

from planarfriction._support import validation
from planarfriction._support.shown import Unit, unit_for
from planarfriction.errors import InvalidValueError
from planarfriction.families import MODELS

REFERENCE = "#000000"
"""Colour of what is exact: a closed form, a fine grid; a thin dashed line on top."""

REDUCED = "#0072B2"
"""Colour of `ReducedModel`, the default of the library."""

DISTRIBUTED = "#56B4E9"
"""Colour of sums over cells and of their model: lines of 1.4 pt at least, no letters."""

PUBLISHED = "#CC79A7"
"""Colour of the published model and of its table."""

ELLIPSOID = "#009E73"
"""Colour of the ellipsoid."""

BUILT_IN = "#D55E00"
"""Colour of the friction that a simulator has built in."""

MEASURED = "0.62"
"""Colour of what was measured: a broad line or dots below the rest."""

OF_MODEL = {
    "distributed": DISTRIBUTED,
    "reduced": REDUCED,
    "reduced-published": PUBLISHED,
}
"""Name of a model -> its colour (Okabe and Ito: colour-blind readers tell them apart)."""

OTHER = "0.35"
"""Colour of a model or surface that has no role."""

SHADES = ("#A9CBE5", "#5E9FCF", REDUCED, "#00456B")
"""Shades of blue: few discs to many, little to much of what belongs to `ReducedModel`."""

LETTERS = {DISTRIBUTED: "#1B7DB0", PUBLISHED: "#A44C81", MEASURED: "0.4"}
"""Colour of a role -> that of words about it, if it is too pale for letters."""

LINES: dict[str, Any] = {
    REFERENCE: (0, (4, 2)),
    PUBLISHED: (0, (1.2, 1.2)),
    ELLIPSOID: (0, (5, 1.2, 1, 1.2)),
}
"""Colour of a role -> line style, if it is not solid."""

MARKERS = {
    REDUCED: "o",
    DISTRIBUTED: "s",
    PUBLISHED: "^",
    ELLIPSOID: "D",
    BUILT_IN: "X",
    MEASURED: ".",
}
"""Colour of a role -> its marker."""

SERIES = (REDUCED, "#000000", "0.55", "#00456B", "0.3", "#6C9CC4", "0.72")
"""Colours of runs, shapes or loads, which have no role: blue for the one that is meant, then black and greys."""

STICKS = "#B9D6EA"
"""Fill of what sticks."""

SLIPS = "#E69F00"
"""Fill of what slips."""

SLIP_DOT = "#7A4E00"
"""Colour of the dot in each cell that slips, which tells it in grey print."""

HOLDS = "#EAF3F9"
"""Fill of loads that friction holds."""

BEYOND = "#F3E2D8"
"""Fill of loads beyond the limit."""

BODY = "0.89"
"""Fill of bodies."""

PAD = "0.45"
"""Fill of contact patches in the plane."""

LINE_STYLES = ("-", (0, (5, 1.5)), (0, (1, 1.2)), (0, (5, 1.5, 1, 1.5)))
"""Line styles that tell contacts, or overlaid runs, apart in print."""

PRESSURE_MAP = ListedColormap(
    colormaps["cividis_r"](np.linspace(0.04, 1.0, 256)), "pressure"
)
"""Colour map of amounts from 0 on, as loads and pressures: dark is much."""

TIME_COLOURS = ListedColormap(colormaps["viridis"](np.linspace(0.0, 0.8, 256)), "time")
"""Colour map of time alone: the last greens and yellows of viridis are lost on white."""

COLUMN = 3.5
"""Width of a column of a paper [inch]."""

PAGE = 7.0
"""Width of a page [inch]; pictures for the web have 160 dots per inch of it."""

NARROW = 4.5
"""Width [inch] below which a figure, or axes and their share of it, have small titles and few ticks."""

WITHOUT_WINDOW = ("agg", "cairo", "pdf", "pgf", "ps", "svg", "template")
"""Backends of matplotlib that draw to files alone."""

LARGEST_SIDE = 100.0
"""Largest side of a figure [inch]: 12,000 dots, of which a square takes 0.6 GB."""


def paper() -> Any:
    """Return a context in which figures have the style sheet of a column or page of a paper."""
    from matplotlib.style import context  # reads dozens of files

    return context("planarfriction.plots.print")


class PlotFigure(Figure):
    """A matplotlib figure without pyplot that notebooks show by themselves."""

    def show(self, warn: bool = True) -> None:
        """Show the figure: in a window, which a script waits for, or in the notebook.

        Loads pyplot, as nothing else here does. Where no window can open, `warn` says so in one line.
        """
        from matplotlib import pyplot

        if pyplot.get_backend().lower() in WITHOUT_WINDOW:
            if warn:
                words = f"no window can open here ({pyplot.get_backend()}): use savefig"
                warnings.warn(words, stacklevel=2)
            return
        manager = self.canvas.manager
        if manager is None or not pyplot.fignum_exists(manager.num):
            adopt: Any = lambda *_, **__: self
            pyplot.figure(FigureClass=adopt)  # the figure that pyplot makes is this one
        pyplot.show()

    if TYPE_CHECKING:  # matplotlib leaves this one half open

        def savefig(self, fname: Any, **options: Any) -> None: ...

    def _repr_png_(self) -> bytes:
        buffer = io.BytesIO()
        self.savefig(buffer, format="png")
        return buffer.getvalue()


def new_figure(width: float, height: float, size: Any = None) -> PlotFigure:
    """Return an empty figure of `width` x `height` inches, or of a `size` that a user asks for.

    It has at least 120 dots per inch. Letters larger than 10 pt, as on slides, enlarge the figure unless it has a
    `size`.

    Raises InvalidValueError unless `size` is two numbers > 0 and at most `LARGEST_SIDE`.
    """
    if size is None:
        larger = max(1.0, rcParams["font.size"] / 10.0)
        width = larger * width
        height = larger * height
    else:
        width, height = validation.positive_array("size", size, (2,))
        if max(width, height) > LARGEST_SIDE:
            rule = f"be in inches, each side at most {LARGEST_SIDE:g}"
            raise InvalidValueError("size", rule, size)
    dpi = max(120.0, rcParams["figure.dpi"])
    return PlotFigure(figsize=(width, height), layout="constrained", dpi=dpi)


def place(ax: Any, width: float, height: float, size: Any) -> tuple[Any, Any]:
    """Return a new figure with its axes, or the `ax` of a user with its figure.

    Raises InvalidValueError for a wrong `size`, for both, and for what is no axes.
    """
    if ax is None:
        figure = new_figure(width, height, size)
        return figure, figure.add_subplot()
    check_axes("ax", ax, size)
    return ax.figure, ax


def check_axes(name: str, ax: Any, size: Any, *, three: bool = False) -> None:
    """Raise InvalidValueError unless `ax` are axes of matplotlib, whose figure has its size already.

    They are those of a plane, or have `three` dimensions.
    """
    if not isinstance(ax, Axes):
        raise InvalidValueError(name, "be axes of matplotlib", ax)
    if (ax.name == "3d") != three:
        of_three = 'have three dimensions (projection="3d")'
        raise InvalidValueError(name, of_three if three else "be those of a plane", ax)
    if size is not None:
        rule = f"be left out with {name}: the figure has a size"
        raise InvalidValueError("size", rule, size)


def axes_width(axes: Any) -> float:
    """Return the width of axes [inch]."""
    return axes.get_position().width * axes.figure.bbox.width / axes.figure.dpi


def ticks(axes: Any, most: int) -> int:
    """Return the number of ticks of an axis: `most`, or fewer where axes are narrow."""
    width = axes_width(axes)
    return most if width > 0.75 * NARROW else max(2, round(most * width / NARROW))


def model_colour(model: Any) -> str | None:
    """Return the colour of a friction model; None if it is not one of the library's."""
    return OF_MODEL.get(MODELS.name_of(model) or "")


def with_unit(name: str, unit: Unit) -> str:
    """Return the label of an axis: the name of a quantity with its unit in brackets."""
    return f"{name} [{unit.label.replace('deg', '°')}]"


def show_lengths(axes: Any, largest: float) -> None:
    """Name the axes of a plane that is drawn in mm, with ticks in the unit in which `largest` [m] reads well."""
    unit = unit_for("length", largest)
    for name, axis in (("x", axes.xaxis), ("y", axes.yaxis)):
        axis.set_label_text(f"{name} [{unit.label}]")
        axis.set_major_formatter(
            lambda value, _: f"{1e-3 * unit.factor * value:.10g}".replace(
                "-", "\N{MINUS SIGN}"
            )
        )


def show_times(axes: Any, times: Any) -> None:
    """Add the colour bar of `TIME_COLOURS` from the first to the last of `times` [s]."""
    clock = unit_for("time", times)
    shown = ScalarMappable(
        Normalize(clock.factor * times[0], clock.factor * times[-1]), TIME_COLOURS
    )
    axes.figure.colorbar(shown, ax=axes, label=f"time [{clock.label}]", aspect=30)


def wrapped(text: str, width: int) -> str:
    """Return the text in lines of at most `width` letters; a word that is longer is cut."""
    return "\n".join(textwrap.wrap(text, width)) or text


def tidy(*axes: Any) -> None:
    """Draw a light grid below the data of all `axes`, and no box around it."""
    for each in axes:
        each.grid(True, color="0.88", linewidth=0.6)
        each.set_axisbelow(True)
        each.spines[["top", "right"]].set_visible(False)


def evenly(count: int, most: int) -> np.ndarray:
    """Return at most so many indices of `count` things, evenly spaced, with the first and the last."""
    return np.unique(np.linspace(0, count - 1, most).round().astype(int))
