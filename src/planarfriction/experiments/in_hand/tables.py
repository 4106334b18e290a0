"""Tables of the in-hand experiment."""

from __future__ import annotations

from typing import Any

import numpy as np

from planarfriction.experiments.experiment import Table
from planarfriction.experiments.in_hand.figures import AXES
from planarfriction.experiments.in_hand.runs import FRICTION_CHANGE

MORE, LESS = f"{FRICTION_CHANGE:.1%} more friction", f"{FRICTION_CHANGE:.1%} less friction"
REDUCED, DEFAULTS, FINER_GRID = "reduced model instead", "default tolerances", "three times finer grid"
"""What is changed to see how far the end moves."""


def end_table(numbers: dict[str, dict[str, Any]]) -> Table:
    models = ("distributed", "reduced")
    headings = (
        "case",
        *(f"{name}, {kind}" for kind in models for name in ("x [mm]", "y [mm]", "θ [deg]")),
        "distance at the end [mm]",
        "largest [mm]",
        "angle [deg]",
    )
    rows = [
        (
            words,
            *(_shown(name, each["end"][kind][name]) for kind in models for name in ("x", "y", "theta")),
            1e3 * each["shift of the end [m]"][REDUCED],
            1e3 * each["largest distance between the models [m]"],
            float(np.degrees(each["angle between the models at the end [rad]"])),
        )
        for words, each in numbers.items()
    ]
    return Table("Where the plate is after 2 s, and how far the models are apart", headings, rows)


def _shown(name: str, value: float) -> float:
    return AXES[name][1] * value


def shift_table(numbers: dict[str, dict[str, Any]]) -> Table:
    causes = (MORE, LESS, REDUCED, DEFAULTS, FINER_GRID)
    loads = ("load that holds the start [N]", "load that holds the end [N]", "smallest load [N]")
    headings = (
        "case",
        *(f"{cause} [mm]" for cause in causes),
        "default tolerances, reduced [mm]",
        "models apart, as friction [%]",
        *loads,
    )
    rows = []
    for words, each in numbers.items():
        shifts = each["shift of the end [m]"]
        row = [1e3 * shifts[cause] if cause in shifts else "" for cause in causes]
        row += [1e3 * each["default tolerances, reduced [m]"], 1e2 * each["distance between the models as friction"]]
        row += [each[name] for name in loads]
        rows.append((words, *row))
    note = (
        "Shifts of the distributed model's end, unless said otherwise. A plate is held by the load that puts its "
        "weight on the limit surface of the cells, with mu_s."
    )
    return Table("What moves the end", headings, rows, note)


def accuracy_table(accuracy: dict[str, dict[str, dict[str, float]]]) -> Table:
    whose = {"default": "default tolerances", "report": "tolerances of this report", "published": "published curve"}
    headings = (
        "run",
        *(f"{words}: {unit}" for words in whose.values() for unit in ("position [µm]", "θ [µrad]", "force [mN]")),
    )
    rows = [(words, *(value for who in whose for value in _largest(each[who]))) for words, each in accuracy.items()]
    return Table("Largest distance from the converged solution of the same model, one coordinate", headings, rows)


def _largest(error: dict[str, float]) -> tuple[float, float, float]:
    """Position [µm], angle [µrad], force [mN]."""
    return 1e6 * max(error["x"], error["y"]), 1e6 * error["theta"], 1e3 * max(error["fx"], error["fy"])
