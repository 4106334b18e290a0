"""A contact pressure that follows the load: distributed, and reduced with all kept, the table rescaled, or rebuilt."""

from __future__ import annotations

import dataclasses
import math
from functools import partial
from typing import Any, Literal

import numpy as np

from planarfriction import scenes
from planarfriction.laws import LuGre
from planarfriction.limit_surface import LimitSurfaceTablePublished
from planarfriction.models import DistributedModel, ReducedModelPublished
from planarfriction.patch import ContactPatch, SoftFinger
from planarfriction.plots.style import LINE_STYLES, PlotFigure, new_figure, tidy
from planarfriction.scenes import Scene
from planarfriction.scenes.ready import FINE, IN_HAND_LOADS
from planarfriction_studies.experiments import experiment, looks
from planarfriction_studies.experiments.experiment import (
    POSE,
    Arrays,
    Comparison,
    Result,
    Work,
    entry,
)
from planarfriction_studies.experiments.in_hand import figures, runs
from planarfriction_studies.experiments.in_hand.runs import (
    FRICTION_CHANGE,
    LESS,
    MORE,
    TIGHT,
)
from planarfriction_studies.experiments.runs import CELLS, LAW, WIDTH, simulated
from planarfriction_studies.experiments.wording import report

RADIUS_AT_1_N = 6.0 * WIDTH / CELLS
"""Contact radius at 1 N [m]: six cells; it grows with the cube root of the load up to half the width."""

LARGEST_CONTACT = 6.0
"""A load at which the contact has its largest radius [N]: the published table is made there."""

MEAN_LOAD = IN_HAND_LOADS[1, 1][0]
"""Mean load of the run [N]."""

PRESSURES = {1: "k = 2", 2: "k = 2 f_N"}
"""Pressure law of the paper -> its exponent (per newton where the load stands in it)."""

DISTRIBUTED, REBUILT, RESCALED = "distributed", "reduced, rebuilt", "reduced, rescaled"
KEPT, KEPT_LARGEST = "reduced, kept (mean load)", "reduced, kept (largest contact)"

VARIANTS: dict[
    str, tuple[Literal["rebuild", "rescale", "keep"] | None, float | None]
] = {
    DISTRIBUTED: (None, None),
    REBUILT: ("rebuild", None),
    RESCALED: ("rescale", LARGEST_CONTACT),
    KEPT: ("keep", MEAN_LOAD),
    KEPT_LARGEST: ("keep", LARGEST_CONTACT),
}
"""Variant -> what its reduced model does as the load changes, and the load at which its table is made [N]."""

PUBLISHED_DISTANCE = 0.11
"""Distance of the published curve of the reduced model from the converged solution of the published equations [-]."""

REFERENCES = {DISTRIBUTED: "load_dependent/d1", RESCALED: "load_dependent/r1"}
"""Variants with a converged solution under the first law."""

Runs = dict[tuple[int, str], Arrays]


def finger(pressure: int) -> SoftFinger:
    """Return the soft finger of a pressure law of the paper."""
    exponent: dict[str, float] = {"k": 2.0} if pressure == 1 else {"k_per_newton": 2.0}
    return SoftFinger(c=RADIUS_AT_1_N, n=1.0 / 3.0, radius_max=0.5 * WIDTH, **exponent)


def soft_patch(pressure: int, *, cells: int = CELLS) -> ContactPatch:
    """Return the square grid under a soft finger."""
    return ContactPatch.rectangle(WIDTH, cells=cells, pressure=finger(pressure))


def profile_moment(k: float, power: int) -> float:
    """Return `int_0^1 s^power (1 - s^k)^(1/k) ds = B((power + 1)/k, 1 + 1/k)/k`."""
    a = (power + 1.0) / k
    b = 1.0 + 1.0 / k
    return math.exp(math.lgamma(a) + math.lgamma(b) - math.lgamma(a + b)) / k


def round_moments(pressure: int, loads: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the contact radius r [m] and <rho^2> [m^2] of the round contact without a grid, in closed form."""
    law = finger(pressure)
    radius = law.radius(loads)
    first, second = (
        np.array(
            [
                profile_moment(k, power) / profile_moment(k, 1)
                for k in law.exponent(loads).tolist()
            ]
        )
        for power in (2, 3)
    )
    return first * radius, second * radius**2


def soft_scene(pressure: int, variant: str, law: LuGre = LAW) -> Scene:
    """Return the in-hand scene under load 1, with a model that has computed nothing yet."""
    on_load_change, load = VARIANTS[variant]
    patch = soft_patch(pressure)
    if on_load_change is None:
        return scenes.in_hand(DistributedModel(patch, law))
    surface = LimitSurfaceTablePublished(patch, normal_force=load)
    return scenes.in_hand(
        ReducedModelPublished(
            patch, law, surface=surface, on_load_change=on_load_change
        )
    )


def run(work: Work) -> Result:
    """Carry out the experiment."""
    pressures = (1,) if work.quick else (1, 2)
    found = _simulate_all(work, pressures)
    loads = np.unique(found[1, DISTRIBUTED]["normal_force"])
    numbers = {
        PRESSURES[pressure]: _numbers(pressure, found, loads) for pressure in pressures
    }
    stored = {
        (PRESSURES[p], variant): found[p, variant]
        for p in pressures
        for variant in VARIANTS
    }
    time = "time", found[1, DISTRIBUTED]["time"], "s"
    miss = {
        variant: runs.errors(found[1, variant], key)
        for variant, key in REFERENCES.items()
    }
    gap = {
        words: [
            each["variants"][name]["distance at the end [m]"]
            for each in numbers.values()
        ]
        for words, name in (("rescaled", RESCALED), ("kept", KEPT))
    }
    return report(
        "load_dependent",
        _figures(pressures, found, loads),
        {"pressure laws": numbers, "tolerances": TIGHT},
        {
            "loads": len(loads),
            "miss": {
                name: max(each[name] for each in miss.values())
                for name in ("y", "theta")
            },
            "rescaled_miss": max(miss[RESCALED][name] for name in ("x", "y")),
            "gap": gap,
            "change": FRICTION_CHANGE,
            "published_distance": PUBLISHED_DISTANCE,
        },
        comparisons=_comparisons(pressures, found, loads),
        tables=[_table(numbers)],
        data={
            "in_hand": experiment.dataset(
                stored, runs.STORED, ("pressure", "variant"), time
            )
        },
    )


def _simulate_all(work: Work, pressures: tuple[int, ...]) -> Runs:
    computes = {}
    for pressure in pressures:
        for variant in VARIANTS:
            computes[pressure, variant] = partial(
                simulated, soft_scene(pressure, variant), **TIGHT
            )
        for variant in REFERENCES if pressure == 1 else ():
            computes[pressure, f"{variant}, defaults"] = partial(
                simulated, soft_scene(pressure, variant)
            )
        for words, law in runs.CHANGED.items():
            computes[pressure, words] = partial(
                simulated, soft_scene(pressure, DISTRIBUTED, law), **FINE
            )
    return work.pieces(computes, lambda key: f"load-dependent, law {key[0]}, {key[1]}")


def _numbers(pressure: int, found: Runs, loads: np.ndarray) -> dict[str, Any]:
    base = found[pressure, DISTRIBUTED]
    friction = [
        runs.end_distance(found[pressure, words], base) for words in (MORE, LESS)
    ]
    law = finger(pressure)
    ends = np.array([loads[0], loads[-1]])
    variants = {}
    for variant in VARIANTS:
        distance = runs.distance(found[pressure, variant], base)
        variants[variant] = {
            "end": runs.end(found[pressure, variant]),
            "distance at the end [m]": float(distance[-1]),
            "largest distance [m]": float(distance.max()),
            "distance as friction": FRICTION_CHANGE
            * float(distance[-1])
            / (0.5 * sum(friction)),
        }
    return {
        "smallest and largest load [N]": ends.tolist(),
        "contact radius R [m]": law.radius(ends).tolist(),
        "exponent k": law.exponent(ends).tolist(),
        "r [m]": np.asarray(soft_patch(pressure).contact_radius(ends)).tolist(),
        "shift of the end by more and by less friction [m]": friction,
        "variants": variants,
    }


def _comparisons(
    pressures: tuple[int, ...], found: Runs, loads: np.ndarray
) -> list[Comparison]:
    rows = []
    for variant, key in REFERENCES.items():
        words = f"{PRESSURES[1]}, {variant}"
        rows += runs.compare_with_converged(found[1, variant], key, words)
        rows += runs.compare_with_converged(
            found[1, f"{variant}, defaults"], key, words, default=True
        )
    for pressure in pressures:
        for cells in (CELLS, 5 * CELLS):
            rows += _compare_moments(pressure, cells, loads)
    return rows


def _compare_moments(pressure: int, cells: int, loads: np.ndarray) -> list[Comparison]:
    """Compare r and <rho^2> of a grid with those of the round contact."""
    patch = soft_patch(pressure, cells=cells)
    cause = (
        "Profiles are sampled at the centres of cells; a round rim on a grid errs by a share of $(c/R)^{1.5}$ for the "
        "width $c$ of cells, half of it for $r$, all of it for $\\langle\\rho^2\\rangle$, as an estimate."
    )
    share = 0.5 * (WIDTH / cells / finger(pressure).radius(loads)) ** 1.5
    rows = []
    measured = patch.contact_radius(loads), patch.second_moment(loads)
    kinds = (("r", 1.0, "m"), ("<rho^2>", 2.0, "m^2"))
    for ours, theirs, (name, factor, unit) in zip(
        measured, round_moments(pressure, loads), kinds, strict=True
    ):
        tolerance = factor * share * theirs
        at = int((np.abs(ours - theirs) / tolerance).argmax())
        quantity = f"{PRESSURES[pressure]}, {cells} x {cells} cells, {name} over the load, the worst"
        within = float(tolerance[at])
        worst = experiment.compare(
            quantity, [ours[at]], theirs[at], "closed form", within, unit, cause
        )
        rows.append(dataclasses.replace(worst, samples=len(loads)))
    return rows


def _table(numbers: dict[str, Any]) -> experiment.Table:
    columns = {
        f"{name} [{unit}]": entry("end", name, scale=looks.AXES[name][1])
        for name, unit in zip(POSE, ("mm", "mm", "deg"), strict=True)
    } | {
        "distance at the end [mm]": entry("distance at the end [m]", scale=1e3),
        "largest [mm]": entry("largest distance [m]", scale=1e3),
        "as friction [%]": entry("distance as friction", scale=1e2),
    }
    rows = {
        f"{law}, {variant}": row
        for law, each in numbers.items()
        for variant, row in each["variants"].items()
    }
    note = (
        "Distances from the distributed model with the same pressure; as friction: the share that moves its end as "
        f"far. Largest contact: at {LARGEST_CONTACT:g} N."
    )
    return experiment.table(
        "Where the plate is after 2 s", rows, columns, "pressure, variant", note
    )


def _figures(
    pressures: tuple[int, ...], found: Runs, loads: np.ndarray
) -> dict[str, PlotFigure]:
    titles = {
        pressure: f"pressure law {pressure}: ${PRESSURES[pressure]}$"
        for pressure in pressures
    }
    first, *reduced = VARIANTS
    styles: dict[str, Any] = {first: {"color": looks.DISTRIBUTED, "linewidth": 1.5}} | {
        variant: {"color": looks.PUBLISHED, "linestyle": style, "linewidth": 1.5}
        for variant, style in zip(reduced, LINE_STYLES, strict=True)
    }
    shown = {
        title: {variant: found[pressure, variant] for variant in VARIANTS}
        for pressure, title in titles.items()
    }
    apart = {
        title: {
            name: (each["time"], runs.distance(each, panel[first]))
            for name, each in panel.items()
            if name != first
        }
        for title, panel in shown.items()
    }
    return {
        "profiles": _profiles(titles, loads),
        "motion": figures.histories(shown, ("normal_force", *POSE), styles=styles),
        "distance": figures.distances(
            apart, "distance from distributed [mm]", styles=styles
        ),
    }


def _profiles(titles: dict[int, str], loads: np.ndarray) -> PlotFigure:
    """Draw cuts through the patches at some loads [N], r and <rho^2> over the load with their closed forms."""
    figure = new_figure(9.6, 6.6)
    parts: Any = figure.subfigures(2, 1)
    row = parts[0].subplots(1, len(titles), sharey=True, squeeze=False)[0]
    for axes, (pressure, title) in zip(row, titles.items(), strict=True):
        _draw_cuts(
            axes, soft_patch(pressure), (float(loads[0]), MEAN_LOAD, float(loads[-1]))
        )
        axes.set_title(title, fontsize="medium")
        axes.set_xlabel("$x$ [mm]")
        tidy(axes)
    row[0].set_ylabel("pressure [kPa]")
    # After all lines: it ends the scaling of the shared axis.
    row[0].set_ylim(bottom=0.0)
    row[0].legend(frameon=False, fontsize="small")
    _draw_moments(
        parts[1].subplots(1, 2), titles, np.linspace(loads[0], loads[-1], 101)
    )
    return figure


def _draw_cuts(axes: Any, patch: ContactPatch, loads: tuple[float, ...]) -> None:
    grid = patch.grid
    law = patch.pressure
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
        axes.plot(
            1e3 * fine[:, 0],
            pressure[centre] * relative,
            color=colour,
            linewidth=1.4,
            label=f"{load:.2f} N",
        )


def _draw_moments(panels: Any, titles: dict[int, str], loads: np.ndarray) -> None:
    """Draw r [mm] and <rho^2> [mm^2] over the load: closed forms as lines, those of the grid as markers."""
    some = loads[::5]
    (radius, moment) = panels
    for (pressure, title), colour, marker in zip(
        titles.items(), ("0.1", "0.6"), "os", strict=False
    ):
        patch = soft_patch(pressure)
        (r, second) = round_moments(pressure, loads)
        dots = {
            "linestyle": "none",
            "marker": marker,
            "markersize": 3.5,
            "color": colour,
        }
        radius.plot(loads, 1e3 * r, color=colour, linewidth=1.3, label=f"$r$, {title}")
        radius.plot(some, 1e3 * np.asarray(patch.contact_radius(some)), **dots)
        moment.plot(loads, 1e6 * second, color=colour, linewidth=1.3, label=title)
        moment.plot(some, 1e6 * np.asarray(patch.second_moment(some)), **dots)
    radius.plot(
        loads,
        1e3 * finger(1).radius(loads),
        color="0.25",
        linestyle=LINE_STYLES[1],
        label="$R$, both laws",
    )
    radius.set(xlabel="normal force [N]", ylabel="radius [mm]", ylim=(0.0, None))
    moment.set(
        xlabel="normal force [N]", ylabel="second moment [mm$^2$]", ylim=(0.0, None)
    )
    for axes in panels:
        axes.legend(frameon=False, fontsize="small", loc="best")
        tidy(axes)
