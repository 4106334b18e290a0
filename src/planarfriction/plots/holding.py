"""Picture of a grip in motion: loads inside the limit surface, and the force that each direction needs."""

from __future__ import annotations

from typing import Any

import numpy as np

import planarfriction as pf
from planarfriction._support.shown import unit_for
from planarfriction.planning.holding import forces_needed, surface_at
from planarfriction.plots import style

DOTTED = (0, (1.0, 1.5))
"""Line of the limit with margin."""

WIDE = 5.0
"""Width [inch] from which on the panels stand next to each other."""

SAMPLES = 241
"""Points of a section of the limit surface."""

_LABEL: Any = {"fontsize": "small", "textcoords": "offset points"}


def plot_hold(plan: pf.planning.HoldPlan, *, size: Any = None) -> style.PlotFigure:
    """Draw the loads of a plan inside the limit surface of the grip, and the force that each direction needs.

    The limit is that of the given grip, or of the force that is needed, in the direction of the worst load's force.
    `size` is the width and the height of the figure [inch]. Raises InvalidValueError for a wrong size.
    """
    figure = style.new_figure(7.0, 3.1, size)
    if figure.get_figwidth() > WIDE:
        left, right = figure.subplots(1, 2)
    else:
        left, right = figure.subplots(2, 1)
    grip = plan.needed if plan.grip is None else plan.grip
    with_margin = grip / (1.0 + plan.margin)
    shape = grip if plan.patch.depends_on_load else None
    ellipsoid = pf.LimitSurfaceEllipsoid(plan.patch, normal_force=shape)
    _draw_section(left, plan, grip, with_margin, ellipsoid)
    _draw_directions(right, plan, grip, with_margin, ellipsoid)
    style.tidy(left, right)
    for axes in (left, right):
        axes.grid(False)
    return figure


def _draw_section(
    axes: Any,
    plan: pf.planning.HoldPlan,
    grip: float,
    with_margin: float,
    ellipsoid: Any,
) -> None:
    """Draw force and torque on a pad, with the limit that the grip sets."""
    surface = surface_at(plan.patch, grip if plan.patch.depends_on_load else None)
    worst = plan.loads[plan.worst]
    size = np.hypot(*worst[:2])
    along = worst[:2] / size if size > 0.0 else np.array([1.0, 0.0])
    force = np.hypot(*plan.loads[:, :2].T)
    sign = -1.0 if worst[2] < 0.0 else 1.0
    mixture = np.linspace(0.0, 0.5 * np.pi, SAMPLES)
    # The section in the plane of the worst force and the torque; the load of a slip is opposite to friction.
    rays = np.column_stack(
        [
            np.cos(mixture)[:, None] * along,
            sign * np.sin(mixture) * surface.contact_radius,
        ]
    )
    limits = {
        "limit": rays / forces_needed(rays, surface, plan.mu)[:, None],
        "ellipsoid": rays / forces_needed(rays, ellipsoid, plan.mu)[:, None],
    }
    unit = unit_for("torque", grip * limits["limit"][:, 2])
    x = np.hypot(*limits["limit"][:, :2].T)
    y = unit.factor * sign * limits["limit"][:, 2]
    right, top = 1.12 * grip * x.max(), 1.12 * grip * y.max()
    axes.set_facecolor(style.BEYOND)
    axes.fill(np.r_[0.0, grip * x], np.r_[0.0, grip * y], color="white", lw=0)
    axes.fill(
        np.r_[0.0, with_margin * x],
        np.r_[0.0, with_margin * y],
        color=style.HOLDS,
        lw=0,
    )
    axes.plot(grip * x, grip * y, color=style.REFERENCE, lw=1.5)
    if plan.margin:
        axes.plot(
            with_margin * x, with_margin * y, color=style.REFERENCE, lw=0.8, ls=DOTTED
        )
    other = limits["ellipsoid"]
    axes.plot(grip * np.hypot(*other[:, :2].T), grip * unit.factor * sign * other[:, 2],
              color=style.ELLIPSOID, ls=style.LINE_STYLES[3], lw=1.1)  # fmt: skip
    flat = plan.elevations == 0.0
    torque = unit.factor * sign * plan.loads[:, 2]
    loop = np.append(np.flatnonzero(flat), 0)
    axes.plot(force[loop], torque[loop], color=style.REDUCED, lw=1.6)
    axes.plot(force[plan.worst], torque[plan.worst], "o", ms=6, color="k", mec="white")
    axes.annotate("worst", (force[plan.worst], torque[plan.worst]), (7, -5), weight="bold",
                  **_LABEL)  # fmt: skip
    axes.text(0.98, 0.97, "slips", transform=axes.transAxes, ha="right", va="top",
              color="0.25")  # fmt: skip
    names = {
        "by the ellipsoid": ("ellipsoid", 0.6, 0.85, style.ELLIPSOID),
        f"limit at {grip:.3g} N": ("limit", 0.35, 0.72, style.REFERENCE),
    }
    for words, (name, place, height, colour) in names.items():
        point = grip * limits[name][int(place * SAMPLES)]
        at = np.hypot(*point[:2]), unit.factor * sign * point[2]
        axes.annotate(words, at, (0.98, height), textcoords="axes fraction", color=colour,
                      fontsize="small", ha="right", va="center",
                      arrowprops={"arrowstyle": "-", "lw": 0.5, "color": colour})  # fmt: skip
    axes.set(xlim=(0.0, right), ylim=(min(0.0, 1.1 * torque.min()), top))
    axes.set_xlabel("force on a pad [N]")
    axes.set_ylabel(f"torque on a pad [{unit.label}]")


def _draw_directions(
    axes: Any,
    plan: pf.planning.HoldPlan,
    grip: float,
    with_margin: float,
    ellipsoid: Any,
) -> None:
    """Draw the force that each direction of the acceleration needs, at its worst elevation."""
    angles, where = np.unique(plan.angles, return_inverse=True)
    needed = np.zeros(len(angles))
    np.maximum.at(needed, where, plan.forces)
    surface = surface_at(plan.patch, grip if plan.patch.depends_on_load else None)
    lost = plan.forces - forces_needed(plan.loads, surface, plan.mu)
    approximate = np.zeros(len(angles))
    np.maximum.at(
        approximate, where, forces_needed(plan.loads, ellipsoid, plan.mu) + lost
    )
    degrees = np.append(np.degrees(angles), 360.0)
    top = 1.15 * max(grip, needed.max())
    axes.axhspan(0.0, with_margin, color=style.HOLDS, lw=0)
    axes.axhspan(grip, top, color=style.BEYOND, lw=0)
    axes.axhline(grip, color=style.REFERENCE, lw=1.5)
    if plan.margin:
        axes.axhline(with_margin, color=style.REFERENCE, lw=0.8, ls=DOTTED)
    axes.plot(degrees, np.append(needed, needed[0]), color=style.REDUCED, lw=1.6)
    axes.plot(degrees, np.append(approximate, approximate[0]), color=style.ELLIPSOID,
              ls=style.LINE_STYLES[3], lw=1.1)  # fmt: skip
    at = np.degrees(plan.angles[plan.worst])
    axes.plot(at, plan.forces[plan.worst], "o", ms=6, color="k", mec="white")
    side = "left" if at < 75.0 else "right" if at > 285.0 else "center"
    axes.annotate(f"worst: {plan.forces.max():.3g} N", (at, plan.forces[plan.worst]), (0, -22),
                  ha=side, va="top", weight="bold", **_LABEL)  # fmt: skip
    axes.annotate(f"grip {grip:.3g} N", (360.0, grip), (-3, 2), ha="right", va="bottom",
                  **_LABEL)  # fmt: skip
    axes.set(xlim=(0.0, 360.0), ylim=(0.0, top), xticks=range(0, 361, 90))
    axes.set_xlabel("direction of the acceleration [°]")
    axes.set_ylabel("grip needed [N]")
