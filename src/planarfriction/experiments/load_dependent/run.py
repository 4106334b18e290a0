"""A contact pressure that follows the load: distributed, and reduced with all kept, the table rescaled, or rebuilt."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from planarfriction.experiments.experiment import Arrays, Comparison, Result, Table, Work
from planarfriction.experiments.in_hand import figures as in_hand_figures
from planarfriction.experiments.in_hand.runs import (
    FRICTION_CHANGE,
    TIGHT,
    compare_with_converged,
    dataset,
    distance,
    end,
    end_distance,
    errors,
    simulated,
    with_friction,
)
from planarfriction.experiments.in_hand.tables import LESS, MORE
from planarfriction.experiments.load_dependent import figures
from planarfriction.experiments.load_dependent.models import (
    CELLS,
    DISTRIBUTED,
    KEPT,
    KEPT_LARGEST,
    LARGEST_CONTACT,
    MEAN_LOAD,
    PRESSURES,
    REBUILT,
    RESCALED,
    VARIANTS,
    WIDTH,
    finger,
    round_moments,
    soft_patch,
    soft_scene,
)
from planarfriction.experiments.wording import fill
from planarfriction.plots.style import PlotFigure
from planarfriction.scenes.ready import FINE

PUBLISHED_DISTANCE = 0.11
"""Distance of the published curve of the reduced model from the converged solution of the published equations [-]."""

REFERENCES = {(1, DISTRIBUTED): "load_dependent/d1", (1, RESCALED): "load_dependent/r1"}
"""Runs with a converged solution."""

Runs = dict[tuple[int, str], Arrays]


def run(work: Work) -> Result:
    """Carry out the experiment."""
    pressures = (1,) if work.quick else (1, 2)
    runs = _simulate_all(work, pressures)
    loads = np.unique(runs[1, DISTRIBUTED]["normal_force"])
    numbers = {PRESSURES[pressure]: _numbers(pressure, runs, loads) for pressure in pressures}
    return fill("load_dependent", **_told(numbers, runs, loads)).result(
        _figures(pressures, runs, loads),
        comparisons=_comparisons(pressures, runs, loads),
        numbers={"pressure laws": numbers, "tolerances": TIGHT},
        tables=[_table(numbers)],
        data={
            "in_hand": dataset(
                {
                    (PRESSURES[pressure], variant): runs[pressure, variant]
                    for pressure in pressures
                    for variant in VARIANTS
                },
                ("pressure", "variant"),
            )
        },
    )


def _simulate_all(work: Work, pressures: tuple[int, ...]) -> Runs:
    keys: dict[str, tuple[int, str]] = {}
    computes: dict[str, Callable[[], Arrays]] = {}
    for pressure in pressures:
        every = {variant: simulated(soft_scene(pressure, variant), **TIGHT) for variant in VARIANTS}
        every |= {f"{v}, defaults": simulated(soft_scene(p, v)) for p, v in REFERENCES if p == pressure}
        every |= {
            words: simulated(soft_scene(pressure, DISTRIBUTED, with_friction(sign * FRICTION_CHANGE)), **FINE)
            for words, sign in ((MORE, 1), (LESS, -1))
        }
        for name, compute in every.items():
            label = f"load-dependent, law {pressure}, {name}"
            keys[label], computes[label] = (pressure, name), compute
    return {keys[label]: found for label, found in work.pieces(computes).items()}


def _numbers(pressure: int, runs: Runs, loads: np.ndarray) -> dict[str, Any]:
    base = runs[pressure, DISTRIBUTED]
    friction = [end_distance(runs[pressure, words], base) for words in (MORE, LESS)]
    shift = 0.5 * sum(friction)
    law, patch = finger(pressure), soft_patch(pressure)
    ends = np.array([loads[0], loads[-1]])
    return {
        "smallest and largest load [N]": ends.tolist(),
        "contact radius R [m]": law.radius(ends).tolist(),
        "exponent k": law.exponent(ends).tolist(),
        "r [m]": np.asarray(patch.contact_radius(ends)).tolist(),
        "shift of the end by more and by less friction [m]": friction,
        "variants": {
            variant: {
                "end": end(runs[pressure, variant]),
                "distance at the end [m]": end_distance(runs[pressure, variant], base),
                "largest distance [m]": float(distance(runs[pressure, variant], base).max()),
                "distance as friction": FRICTION_CHANGE * end_distance(runs[pressure, variant], base) / shift,
            }
            for variant in VARIANTS
        },
    }


def _comparisons(pressures: tuple[int, ...], runs: Runs, loads: np.ndarray) -> list[Comparison]:
    rows = []
    for (pressure, variant), key in REFERENCES.items():
        words = f"{PRESSURES[pressure]}, {variant}"
        rows += compare_with_converged(runs[pressure, variant], key, words)
        rows += compare_with_converged(runs[pressure, f"{variant}, defaults"], key, words, default=True)
    for pressure in pressures:
        for cells in (CELLS, 5 * CELLS):
            rows += _compare_moments(pressure, cells, loads)
    return rows


def _compare_moments(pressure: int, cells: int, loads: np.ndarray) -> list[Comparison]:
    """r and <rho^2> of a grid beside those of the round contact."""
    patch = soft_patch(pressure, cells=cells)
    cause = (
        "Profiles are sampled at the centres of cells; a round rim on a grid errs by a share of $(c/R)^{1.5}$ for the "
        "width $c$ of cells, half of it for $r$, all of it for $\\langle\\rho^2\\rangle$, as an estimate."
    )
    share = 0.5 * (WIDTH / cells / finger(pressure).radius(loads)) ** 1.5
    rows = []
    for name, ours, theirs, factor, unit in zip(
        ("r", "<rho^2>"),
        (patch.contact_radius(loads), patch.second_moment(loads)),
        round_moments(pressure, loads),
        (1.0, 2.0),
        ("m", "m^2"),
        strict=True,
    ):
        difference, tolerance = np.abs(ours - theirs), factor * share * theirs
        at = int((difference / tolerance).argmax())
        quantity = f"{PRESSURES[pressure]}, {cells} x {cells} cells, {name} over the load, the worst"
        rows.append(
            Comparison(quantity, "closed form", float(difference[at]), float(tolerance[at]), unit, len(loads), cause)
        )
    return rows


def _told(numbers: dict[str, Any], runs: Runs, loads: np.ndarray) -> dict[str, Any]:
    """What the template names."""
    first, *others = numbers.values()
    miss = {variant: errors(runs[1, variant], key) for (_, variant), key in REFERENCES.items()}
    return {
        "first": first,
        "others": others,
        "loads": len(loads),
        "miss": {name: max(each[name] for each in miss.values()) for name in ("y", "theta")},
        "rescaled_miss": max(miss[RESCALED][name] for name in ("x", "y")),
        "gap": {
            variant: [each["variants"][variant]["distance at the end [m]"] for each in numbers.values()]
            for variant in VARIANTS
        },
        "rebuilt": REBUILT,
        "rescaled": RESCALED,
        "kept": KEPT,
        "kept_largest": KEPT_LARGEST,
        "change": FRICTION_CHANGE,
        "friction": 0.5 * sum(first["shift of the end by more and by less friction [m]"]),
        "published_distance": PUBLISHED_DISTANCE,
    }


def _figures(pressures: tuple[int, ...], runs: Runs, loads: np.ndarray) -> dict[str, PlotFigure]:
    titles = {pressure: f"pressure law {pressure}: {PRESSURES[pressure]}" for pressure in pressures}
    looks = figures.lines(tuple(VARIANTS))
    profiles = figures.profiles(
        {
            title: (soft_patch(pressure), lambda f, p=pressure: round_moments(p, f))
            for pressure, title in titles.items()
        },
        (float(loads[0]), MEAN_LOAD, float(loads[-1])),
    )
    motion = in_hand_figures.histories(
        {title: {variant: runs[pressure, variant] for variant in VARIANTS} for pressure, title in titles.items()},
        ("normal_force", "x", "y", "theta"),
        looks=looks,
    )
    lines = {
        title: {
            variant: (runs[pressure, variant]["time"], distance(runs[pressure, variant], runs[pressure, DISTRIBUTED]))
            for variant in list(VARIANTS)[1:]
        }
        for pressure, title in titles.items()
    }
    apart = in_hand_figures.distances(lines, "distance from distributed [mm]", looks=looks)
    return {"profiles": profiles, "motion": motion, "distance": apart}


def _table(numbers: dict[str, Any]) -> Table:
    headings = ("pressure, variant", "x [mm]", "y [mm]", "θ [deg]", "distance at the end [mm]", "largest [mm]",
                "as friction [%]")  # fmt: skip
    rows = [
        (
            f"{pressure}, {variant}",
            *(in_hand_figures.AXES[name][1] * each["end"][name] for name in ("x", "y", "theta")),
            1e3 * each["distance at the end [m]"],
            1e3 * each["largest distance [m]"],
            1e2 * each["distance as friction"],
        )
        for pressure, law in numbers.items()
        for variant, each in law["variants"].items()
    ]
    note = (
        "Distances from the distributed model with the same pressure; as friction: the share of friction that moves "
        f"its end as far. The largest contact is that at {LARGEST_CONTACT:g} N."
    )
    return Table("Where the plate is after 2 s", headings, rows, note)
