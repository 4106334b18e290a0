"""Figures of the convergence experiment: errors over the number of cells or segments, published samples on top."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from planarfriction.plots.style import LINE_STYLES, PlotFigure, new_figure, tidy
from planarfriction_studies.experiments import looks
from planarfriction_studies.experiments.convergence.runs import LAWS, SHAPES, Case, Errors, Family, profile
from planarfriction_studies.experiments.looks import OTHERS
from planarfriction_studies.experiments.runs import IN_WORDS

QUANTITIES = ("ft", "tau")
"""Force and torque in the names of the published curves."""

_ERROR_LABELS = ("force error / largest force [-]", "torque error / largest torque [-]")
_ABSCISSAE: dict[Family, str] = {
    "cells_distributed": "cells along the width",
    "cells_reduced": "cells along the width",
    "segments": "table segments of a quadrant",
}


def errors_over_counts(
    family: Family, counts: Sequence[int], errors: Mapping[Case, Errors], *, with_profile: bool = False
) -> PlotFigure:
    """Draw the relative errors of force and torque of one family, all shapes and parameters; on demand with the
    profile."""
    figure = new_figure(10.0 if with_profile else 9.6, 4.2)
    panels = figure.subplots(1, 3 if with_profile else 2)
    _draw_errors(panels[:2], family, counts, errors)
    if with_profile:
        _draw_profile(panels[2])
    handles = dict(zip(*reversed(panels[0].get_legend_handles_labels()), strict=True))  # each label once
    published = handles.pop("published")
    figure.legend([*handles.values(), published], [*handles, "published"], loc="outside lower center", ncols=4,
                  frameon=False, fontsize="small")  # fmt: skip
    return figure


def radius_errors(counts: Sequence[int], mask: np.ndarray, cut: np.ndarray, torque: np.ndarray) -> PlotFigure:
    """Draw the error of the contact radius of the disc, as a mask and cut by its rim, beside the error of the
    torque."""
    figure = new_figure(6.4, 3.6)
    axes = figure.subplots()
    axes.semilogy(counts, np.abs(mask), "o-", color=OTHERS[0], markersize=4, label="contact radius, mask")
    axes.semilogy(counts, torque, "s--", color=OTHERS[1], markersize=4, label="torque over the run, mask")
    axes.semilogy(
        counts, np.abs(cut), "^-", color=OTHERS[2], markersize=4, label="contact radius, cells cut by the rim"
    )
    axes.set(xlabel=_ABSCISSAE["cells_distributed"], ylabel="relative error [-]")
    axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), frameon=False, fontsize="small")
    tidy(axes)
    return figure


def _draw_errors(panels: Any, family: Family, counts: Sequence[int], errors: Mapping[Case, Errors]) -> None:
    for i, (axes, quantity, label) in enumerate(zip(panels, QUANTITIES, _ERROR_LABELS, strict=True)):
        for (shape, parameters), found in errors.items():
            look = {
                "color": OTHERS[SHAPES.index(shape)],
                "linestyle": LINE_STYLES[list(LAWS).index(parameters)],
                "label": f"{IN_WORDS[shape]}, $p$ = {parameters[1:]}",
            }
            axes.semilogy(counts, found[family][:, i], linewidth=1.3, **look)
            curve = f"convergence/{family}/{shape}/{parameters}/{quantity}"
            looks.vertices(axes, curve, 1.0, "black", marker=".", ms=2.5, mfc="black", label="published")
        axes.set(xlabel=_ABSCISSAE[family], ylabel=label)
        tidy(axes)


def _draw_profile(axes: Any) -> None:
    velocity = profile()
    rows = (("vx", "$v_x$ [cm/s]", 1e2), ("vy", "$v_y$ [cm/s]", 1e2), ("omega", "$\\omega$ [rad/s]", 1.0))
    for i, (name, label, factor) in enumerate(rows):
        axes.plot(velocity.times, factor * velocity.values[:, i], color=OTHERS[i], label=label)
        looks.vertices(axes, f"convergence/velocity/{name}", factor, "black", marker=".", mfc="black")
    axes.set(xlabel="time [s]", ylabel="velocity of the centre of pressure", ylim=(-0.1, 2.1))
    axes.legend(loc="upper right", frameon=False, fontsize="small")
    tidy(axes)
