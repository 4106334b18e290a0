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
from planarfriction.experiments.drift.words import creep_table, findings
from planarfriction.experiments.experiment import Picture, Result, Work
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
    return Result(
        findings=findings(numbers),
        pictures=(
            Picture("drift_tangential", _TANGENTIAL, figures.motion("tangential", found)),
            Picture("drift_normal", _NORMAL, figures.motion("normal", found)),
            Picture("drift_plateaus", _PLATEAUS, figures.plateaus(found, straight, numbers["plateaus"])),
        ),
        comparisons=comparisons(found, numbers, share),
        numbers=numbers | {"rtol": rtol, "atol": atol},
        tables=(creep_table(numbers),),
        data={load: _dataset(load, found) for load in LOADS},
    )


_TANGENTIAL = (
    "Oscillating force, from 2.8 s on also torque, both below what friction holds: plain bristles creep away, "
    "elasto-plastic ones come back. Markers are vertices of the published curves."
)
_NORMAL = (
    "Constant force and torque under an oscillating normal force. The reduced model's deflections differ from the "
    "distributed one's already before the oscillation begins at 1 s."
)
_PLATEAUS = (
    "The deflections that force and torque reach together, elasto-plastic bristles. Dotted: closed forms. With the "
    "ellipsoid x is exact and theta has the stiffness sigma_0 r^2 in place of sigma_0 <rho^2>; with the table both "
    "depend on the path, and differ between a ramp in steps of 0.01 s and a straight one."
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
