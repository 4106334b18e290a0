"""Drift: a disc under a load that friction holds, with plain and with elasto-plastic bristles."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from planarfriction.experiments.drift import figures
from planarfriction.experiments.drift.comparisons import comparisons
from planarfriction.experiments.drift.runs import (
    LAWS,
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
from planarfriction.experiments.drift.tables import creep_table, told
from planarfriction.experiments.experiment import Result, Work
from planarfriction.experiments.wording import fill
from planarfriction.scenes.ready import drift_force

if TYPE_CHECKING:
    import xarray as xr


def run(work: Work) -> Result:
    """Carry out the experiment."""
    rtol, atol, share = QUICK if work.quick else TIGHT
    keys: list[tuple[Load, str]] = [(load, model) for load in LOADS for model in MODELS[load]]
    pieces = work.pieces(
        {
            f"drift, {load}, {model}": lambda load=load, model=model: move(load, model, rtol, atol)
            for load, model in keys
        }
    )
    found: Runs = dict(zip(keys, pieces.values(), strict=True))
    straight = work.piece("drift, straight ramp", lambda: straight_ramp(rtol, atol))
    numbers = measure(found, straight)
    return fill("drift", **told(numbers)).result(
        {
            "drift_tangential": figures.motion("tangential", found),
            "drift_normal": figures.motion("normal", found),
            "drift_plateaus": figures.plateaus(found, straight, numbers["plateaus"]),
        },
        comparisons=comparisons(found, numbers, share),
        numbers=numbers | {"rtol": rtol, "atol": atol},
        tables=(creep_table(numbers),),
        data={load: _dataset(load, found) for load in LOADS},
    )


def _dataset(load: Load, found: Runs) -> xr.Dataset:
    import xarray as xr

    time = found[load, "d"]["time"]
    columns: dict[str, Any] = {}
    for name, unit in MOTION:
        values = [[found[load, kind + law][name] for law in LAWS] for kind in "dr"]
        columns[name] = (("model", "bristles", "time"), np.array(values), {"units": unit})
    applied = drift_force(load).left(time)
    for name, unit, values in zip(("fx", "fy", "tau"), ("N", "N", "N m"), applied.T, strict=True):
        columns[f"applied_{name}"] = ("time", values, {"units": unit})
    columns["normal_force"] = ("time", found[load, "d"]["normal_force"], {"units": "N"})
    coordinates = {"model": ["distributed", "reduced"], "bristles": ["plain", "elasto-plastic"]}
    return xr.Dataset(columns, coordinates | {"time": ("time", time, {"units": "s"})})
