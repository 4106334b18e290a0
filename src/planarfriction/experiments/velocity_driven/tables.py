"""The table of the velocity-driven experiment, and what its template names."""

from __future__ import annotations

from typing import Any

from planarfriction.experiments import runs
from planarfriction.experiments.experiment import Table


def told(numbers: dict[str, Any]) -> dict[str, Any]:
    """What the template names."""
    errors = numbers["errors"]
    quartiles: list[dict[str, Any]] = [
        {"shape": runs.IN_WORDS[shape]}
        | {name: each["ft"][model]["third quartile"] for name, model in (("table", "corrected"), ("ellipsoid",) * 2)}
        for shape, each in errors.items()
    ]
    tables = {shape: each["ft"]["corrected"] for shape, each in errors.items()}
    worst = max(tables, key=lambda shape: tables[shape]["maximum"] / tables[shape]["whisker high"])
    convention, *others = numbers["misses_of_other_conventions"].values()
    above = (
        box["samples above the whisker"]
        for quantities in errors.values()
        for models in quantities.values()
        for box in models.values()
    )
    return {
        "shapes": [each["shape"] for each in quartiles],
        "quartiles": quartiles,
        "factors": [each["ellipsoid"] / each["table"] for each in quartiles],
        "worst": {
            "shape": runs.IN_WORDS[worst],
            "box": tables[worst],
            "centre": tables[worst]["centre of rotation at maximum"],
        },
        "most": max(above),
        "samples": numbers["samples"],
        "convention": convention,
        "others": others,
        "guard": numbers["guard"],
        "spin_up": numbers["spin_up_error_of_the_figures"],
    }


def error_table(numbers: dict[str, Any]) -> Table:
    """Errors of both reduced models against the distributed one."""
    rows = []
    for shape, quantities in numbers["errors"].items():
        for model, words in (("corrected", "table"), ("ellipsoid", "ellipsoid")):
            force, torque = quantities["ft"][model], quantities["tau"][model]
            row: list[str | float] = [f"{runs.IN_WORDS[shape]}, {words}"]
            row += [float(f"{1e3 * force[column]:.4g}") for column in _SHOWN]
            row += [float(f"{1e3 * torque[column]:.4g}") for column in _SHOWN]
            rows.append(row)
    headings = ["shape, model"] + [f"force, {column} [mN]" for column in _SHOWN]
    headings += [f"torque, {column} [N mm]" for column in _SHOWN]
    return Table("Errors against the distributed model, at 1 N", headings, rows)


_SHOWN = ("median", "third quartile", "whisker high", "maximum")
