"""Drift: a disc under a load that friction holds, with plain and with elasto-plastic bristles."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

from planarfriction.scenes.ready import drift_force
from planarfriction_studies.experiments.drift import figures
from planarfriction_studies.experiments.drift.comparisons import comparisons
from planarfriction_studies.experiments.drift.figures import LAW_WORDS, WORDS
from planarfriction_studies.experiments.drift.runs import (
    LOADS,
    MODELS,
    MOTION,
    QUICK,
    TIGHT,
    Load,
    Runs,
    measure,
    move,
    straight_ramp,
)
from planarfriction_studies.experiments.experiment import Result, Table, Work, dataset, table
from planarfriction_studies.experiments.runs import NAMES
from planarfriction_studies.experiments.wording import fill

if TYPE_CHECKING:
    import xarray as xr


def run(work: Work) -> Result:
    """Carry out the experiment."""
    rtol, atol, share = QUICK if work.quick else TIGHT
    moved = {(load, model): partial(move, load, model, rtol, atol) for load in LOADS for model in MODELS[load]}
    found = work.pieces(moved, lambda key: f"drift, {', '.join(key)}")
    straight = work.piece("drift, straight ramp", lambda: straight_ramp(rtol, atol))
    numbers = measure(found, straight)
    return fill("drift", **_template_values(numbers)).result(
        {
            "drift_tangential": figures.motion("tangential", found),
            "drift_normal": figures.motion("normal", found),
            "drift_plateaus": figures.plateaus(found, straight, numbers["plateaus"]),
        },
        comparisons=comparisons(found, numbers, share),
        numbers=numbers | {"rtol": rtol, "atol": atol},
        tables=(_creep_table(numbers),),
        data={load: _dataset(load, found) for load in LOADS},
    )


def _template_values(numbers: dict[str, Any]) -> dict[str, Any]:
    """Return the values that the template names."""
    creep = numbers["creep"]
    grown = creep["normal force"]
    return numbers | {
        "still": {name: max(abs(each["d_ep"][name]) for each in creep.values()) for name in ("x", "theta")},
        "share": max(abs(grown["r_ep"][name] / grown["r"][name]) for name in ("x", "theta")),
        "measured": numbers["plateaus"]["measured"],
        "closed": numbers["plateaus"]["closed form"],
        "width": numbers["implied width"],
    }


def _creep_table(numbers: dict[str, Any]) -> Table:
    """Return the drift per period of the load, by what oscillates."""
    moved = {
        f"{what}; {WORDS[model]}": each for what, models in numbers["creep"].items() for model, each in models.items()
    }
    columns = {
        "x [nm]": lambda each: float(f"{1e9 * each['x']:.4g}"),
        "theta [µrad]": lambda each: float(f"{1e6 * each['theta']:.4g}"),
    }
    return table("Drift per period of 1/3 s", moved, columns, "what oscillates; model")


def _dataset(load: Load, found: Runs) -> xr.Dataset:
    time = found[load, "d"]["time"]
    runs = {(NAMES[kind], words): found[load, kind + law] for kind in "dr" for law, words in LAW_WORDS.items()}
    result = dataset(runs, dict(MOTION), ("model", "bristles"), ("time", time, "s"))
    applied = zip(("fx", "fy", "tau"), ("N", "N", "N m"), drift_force(load).left(time).T, strict=True)
    columns = {f"applied_{name}": ("time", values, {"units": unit}) for name, unit, values in applied}
    return result.assign(columns | {"normal_force": ("time", found[load, "d"]["normal_force"], {"units": "N"})})
