"""Figures of the load-dependent pressure: profiles and moments over the load."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from planarfriction.patch import ContactPatch
from planarfriction.plots.style import LINE_STYLES, PlotFigure, new_figure, tidy
from planarfriction_studies.experiments import looks

Moments = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]


def lines(labels: tuple[str, ...]) -> dict[str, dict[str, Any]]:
    """Draw lines of the distributed model, the first, and of the reduced ones, which differ in style."""
    first, *reduced = labels
    return {first: {"color": looks.DISTRIBUTED, "linewidth": 1.5}} | {
        label: {"color": looks.REDUCED, "linestyle": style, "linewidth": 1.5}
        for label, style in zip(reduced, LINE_STYLES, strict=True)
    }


def profiles(panels: Mapping[str, tuple[ContactPatch, Moments]], loads: tuple[float, ...]) -> PlotFigure:
    """Draw cuts through the patches at some loads [N], r and <rho^2> over the load with their closed forms."""
    figure = new_figure(9.6, 6.6)
    parts: Any = figure.subfigures(2, 1)
    cuts, below = parts
    row = cuts.subplots(1, len(panels), sharey=True, squeeze=False)[0]
    for axes, (title, (patch, _)) in zip(row, panels.items(), strict=True):
        _draw_cuts(axes, patch, loads)
        axes.set(title=title, xlabel="$x$ [mm]")
        axes.title.set_fontsize("medium")
    row[0].set_ylabel("pressure [kPa]")
    row[0].set_ylim(bottom=0.0)  # after all lines: it ends the scaling of the shared axis
    row[0].legend(frameon=False, fontsize="small")
    radius, moment = below.subplots(1, 2)
    _draw_moments(radius, moment, panels, np.linspace(loads[0], loads[-1], 101))
    return figure


def _draw_cuts(axes: Any, patch: ContactPatch, loads: tuple[float, ...]) -> None:
    grid, law = patch.grid, patch.pressure
    assert grid is not None, "the cut needs a grid"
    middle = np.abs(patch.positions[:, 1]) < 0.1 * grid.cell_height
    x = patch.positions[middle, 0]
    edges = np.append(x - 0.5 * grid.cell_width, x[-1] + 0.5 * grid.cell_width)
    fine = np.stack([np.linspace(edges[0], edges[-1], 801), np.zeros(801)], axis=1)
    centre = int(np.abs(x).argmin())
    for load, colour in zip(loads, looks.OTHERS, strict=False):
        pressure = 1e-3 * patch.pressure_values(load)[middle]
        relative = law.relative(fine, np.array(load))
        axes.stairs(pressure, 1e3 * edges, color=colour, linewidth=1.0, alpha=0.75)
        axes.plot(1e3 * fine[:, 0], pressure[centre] * relative, color=colour, linewidth=1.4, label=f"{load:.2f} N")
    tidy(axes)


def _draw_moments(
    radius: Any, moment: Any, panels: Mapping[str, tuple[ContactPatch, Moments]], loads: np.ndarray
) -> None:
    some = loads[::5]
    for (title, (patch, closed)), colour, marker in zip(panels.items(), ("0.1", "0.6"), "os", strict=False):
        r, second = closed(loads)
        dots = {"linestyle": "none", "marker": marker, "markersize": 3.5, "color": colour}
        radius.plot(loads, 1e3 * r, color=colour, linewidth=1.3, label=f"$r$, {title}")
        radius.plot(some, 1e3 * np.asarray(patch.contact_radius(some)), **dots)
        moment.plot(loads, 1e6 * second, color=colour, linewidth=1.3, label=title)
        moment.plot(some, 1e6 * np.asarray(patch.second_moment(some)), **dots)
    patch = next(iter(panels.values()))[0]
    radius.plot(
        loads, 1e3 * patch.pressure.radius(loads), color="0.25", linestyle=LINE_STYLES[1], label="$R$, both laws"
    )
    radius.set(xlabel="normal force [N]", ylabel="radius [mm]", ylim=(0.0, None))
    moment.set(xlabel="normal force [N]", ylabel="second moment [mm$^2$]", ylim=(0.0, None))
    for axes in (radius, moment):
        axes.legend(frameon=False, fontsize="small", loc="best")
        tidy(axes)
