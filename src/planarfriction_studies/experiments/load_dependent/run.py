"""A contact pressure that follows the load: distributed, and reduced with all kept, the table rescaled, or rebuilt."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from planarfriction.plots.style import PlotFigure
from planarfriction.scenes.ready import FINE
from planarfriction_studies.experiments.experiment import Comparison, Result, Table, Work, compare, dataset, table
from planarfriction_studies.experiments.in_hand import figures as in_hand_figures
from planarfriction_studies.experiments.in_hand import runs
from planarfriction_studies.experiments.in_hand.runs import FRICTION_CHANGE, LESS, MORE, TIGHT
from planarfriction_studies.experiments.load_dependent import figures, models
from planarfriction_studies.experiments.load_dependent.models import (
    DISTRIBUTED,
    PRESSURES,
    VARIANTS,
    finger,
    soft_patch,
)
from planarfriction_studies.experiments.wording import fill

PUBLISHED_DISTANCE = 0.11
"""Distance of the published curve of the reduced model from the converged solution of the published equations [-]."""

REFERENCES = {(1, DISTRIBUTED): "load_dependent/d1", (1, models.RESCALED): "load_dependent/r1"}
"""Runs with a converged solution."""

Runs = dict[tuple[int, str], dict[str, np.ndarray]]


def run(work: Work) -> Result:
    """Carry out the experiment."""
    pressures = (1,) if work.quick else (1, 2)
    found = _simulate_all(work, pressures)
    loads = np.unique(found[1, DISTRIBUTED]["normal_force"])
    numbers = {PRESSURES[pressure]: _numbers(pressure, found, loads) for pressure in pressures}
    stored = {(PRESSURES[p], variant): found[p, variant] for p in pressures for variant in VARIANTS}
    time = "time", found[1, DISTRIBUTED]["time"], "s"
    return fill("load_dependent", **_template_values(numbers, found, loads)).result(
        _figures(pressures, found, loads),
        comparisons=_comparisons(pressures, found, loads),
        numbers={"pressure laws": numbers, "tolerances": TIGHT},
        tables=[_table(numbers)],
        data={"in_hand": dataset(stored, runs.STORED, ("pressure", "variant"), time)},
    )


def _simulate_all(work: Work, pressures: tuple[int, ...]) -> Runs:
    computes = {}
    for pressure in pressures:
        for variant in VARIANTS:
            computes[pressure, variant] = runs.simulated(models.soft_scene(pressure, variant), **TIGHT)
            if (pressure, variant) in REFERENCES:
                computes[pressure, f"{variant}, defaults"] = runs.simulated(models.soft_scene(pressure, variant))
        for words, sign in ((MORE, 1), (LESS, -1)):
            scene = models.soft_scene(pressure, DISTRIBUTED, runs.with_friction(sign * FRICTION_CHANGE))
            computes[pressure, words] = runs.simulated(scene, **FINE)
    return work.pieces(computes, lambda key: f"load-dependent, law {key[0]}, {key[1]}")


def _numbers(pressure: int, found: Runs, loads: np.ndarray) -> dict[str, Any]:
    base = found[pressure, DISTRIBUTED]
    friction = [runs.end_distance(found[pressure, words], base) for words in (MORE, LESS)]
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
                "end": runs.end(found[pressure, variant]),
                "distance at the end [m]": runs.end_distance(found[pressure, variant], base),
                "largest distance [m]": float(runs.distance(found[pressure, variant], base).max()),
                "distance as friction": FRICTION_CHANGE * runs.end_distance(found[pressure, variant], base) / shift,
            }
            for variant in VARIANTS
        },
    }


def _comparisons(pressures: tuple[int, ...], found: Runs, loads: np.ndarray) -> list[Comparison]:
    rows = []
    for (pressure, variant), key in REFERENCES.items():
        words = f"{PRESSURES[pressure]}, {variant}"
        rows += runs.compare_with_converged(found[pressure, variant], key, words)
        rows += runs.compare_with_converged(found[pressure, f"{variant}, defaults"], key, words, default=True)
    for pressure in pressures:
        for cells in (models.CELLS, 5 * models.CELLS):
            rows += _compare_moments(pressure, cells, loads)
    return rows


def _compare_moments(pressure: int, cells: int, loads: np.ndarray) -> list[Comparison]:
    """Compare r and <rho^2> of a grid with those of the round contact."""
    patch = soft_patch(pressure, cells=cells)
    cause = (
        "Profiles are sampled at the centres of cells; a round rim on a grid errs by a share of $(c/R)^{1.5}$ for the "
        "width $c$ of cells, half of it for $r$, all of it for $\\langle\\rho^2\\rangle$, as an estimate."
    )
    share = 0.5 * (models.WIDTH / cells / finger(pressure).radius(loads)) ** 1.5
    rows = []
    closed = models.round_moments(pressure, loads)
    for name, ours, theirs, factor, unit in (
        ("r", np.asarray(patch.contact_radius(loads)), closed[0], 1.0, "m"),
        ("<rho^2>", np.asarray(patch.second_moment(loads)), closed[1], 2.0, "m^2"),
    ):
        difference, tolerance = np.abs(ours - theirs), factor * share * theirs
        at = int((difference / tolerance).argmax())
        quantity = f"{PRESSURES[pressure]}, {cells} x {cells} cells, {name} over the load, the worst"
        worst = compare(quantity, [ours[at]], theirs[at], "closed form", float(tolerance[at]), unit, cause)
        rows.append(dataclasses.replace(worst, samples=len(loads)))
    return rows


def _template_values(numbers: dict[str, Any], found: Runs, loads: np.ndarray) -> dict[str, Any]:
    """Return the values that the template names."""
    first, *others = numbers.values()
    miss = {variant: runs.errors(found[1, variant], key) for (_, variant), key in REFERENCES.items()}
    return {
        "first": first,
        "others": others,
        "loads": len(loads),
        "miss": {name: max(each[name] for each in miss.values()) for name in ("y", "theta")},
        "rescaled_miss": max(miss[models.RESCALED][name] for name in ("x", "y")),
        "gap": {
            variant: [each["variants"][variant]["distance at the end [m]"] for each in numbers.values()]
            for variant in VARIANTS
        },
        "rebuilt": models.REBUILT,
        "rescaled": models.RESCALED,
        "kept": models.KEPT,
        "kept_largest": models.KEPT_LARGEST,
        "change": FRICTION_CHANGE,
        "friction": 0.5 * sum(first["shift of the end by more and by less friction [m]"]),
        "published_distance": PUBLISHED_DISTANCE,
    }


def _figures(pressures: tuple[int, ...], found: Runs, loads: np.ndarray) -> dict[str, PlotFigure]:
    titles = {pressure: f"pressure law {pressure}: ${PRESSURES[pressure]}$" for pressure in pressures}
    looks = figures.lines(tuple(VARIANTS))
    profiles = figures.profiles(
        {
            title: (soft_patch(pressure), lambda f, p=pressure: models.round_moments(p, f))
            for pressure, title in titles.items()
        },
        (float(loads[0]), models.MEAN_LOAD, float(loads[-1])),
    )
    motion = in_hand_figures.histories(
        {title: {variant: found[pressure, variant] for variant in VARIANTS} for pressure, title in titles.items()},
        ("normal_force", "x", "y", "theta"),
        looks=looks,
    )
    lines = {
        title: {
            variant: (
                found[pressure, variant]["time"],
                runs.distance(found[pressure, variant], found[pressure, DISTRIBUTED]),
            )
            for variant in list(VARIANTS)[1:]
        }
        for pressure, title in titles.items()
    }
    apart = in_hand_figures.distances(lines, "distance from distributed [mm]", looks=looks)
    return {"profiles": profiles, "motion": motion, "distance": apart}


def _table(numbers: dict[str, Any]) -> Table:
    ends = {
        f"{name} [{unit}]": lambda each, name=name, factor=factor: factor * each["end"][name]
        for name, unit, factor in (("x", "mm", 1e3), ("y", "mm", 1e3), ("theta", "deg", 180.0 / np.pi))
    }
    columns = ends | {
        "distance at the end [mm]": lambda each: 1e3 * each["distance at the end [m]"],
        "largest [mm]": lambda each: 1e3 * each["largest distance [m]"],
        "as friction [%]": lambda each: 1e2 * each["distance as friction"],
    }
    rows = {
        f"{pressure}, {variant}": each for pressure, law in numbers.items() for variant, each in law["variants"].items()
    }
    note = (
        "Distances from the distributed model with the same pressure; as friction: the share of friction that moves "
        f"its end as far. The largest contact is that at {models.LARGEST_CONTACT:g} N."
    )
    return table("Where the plate is after 2 s", rows, columns, "pressure, variant", note)
