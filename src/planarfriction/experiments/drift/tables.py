"""The table of the drift experiment, and what its template names."""

from __future__ import annotations

from typing import Any

from planarfriction.experiments.drift.figures import WORDS
from planarfriction.experiments.experiment import Table


def told(numbers: dict[str, Any]) -> dict[str, Any]:
    """What the template names."""
    creep, plateaus = numbers["creep"], numbers["plateaus"]
    table = creep["normal force"]
    return {
        "creep": creep,
        "still": {name: max(abs(each["d_ep"][name]) for each in creep.values()) for name in ("x", "theta")},
        "share": max(abs(table["r_ep"][name] / table["r"][name]) for name in ("x", "theta")),
        "measured": plateaus["measured"],
        "closed": plateaus["closed form"],
        "patch": numbers["patch"],
        "width": numbers["implied width"],
        "sideways": numbers["sideways"],
    }


def creep_table(numbers: dict[str, Any]) -> Table:
    """Drift per period of the load, by what oscillates."""
    rows: list[list[str | float]] = []
    for what, models in numbers["creep"].items():
        for model, moved in models.items():
            shown = [float(f"{factor * moved[name]:.4g}") for name, factor in (("x", 1e9), ("theta", 1e6))]
            rows.append([f"{what}; {WORDS[model]}", *shown])
    return Table("Drift per period of 1/3 s", ["what oscillates; model", "x [nm]", "theta [µrad]"], rows)
