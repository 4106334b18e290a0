"""The table of the staircase, and what its template names."""

from __future__ import annotations

from typing import Any

import numpy as np

from planarfriction.experiments.experiment import Table


def told(numbers: dict[str, Any]) -> dict[str, Any]:
    """What the template names."""
    radius, by_cells = numbers["radius"], numbers["error_against_the_rod"]
    few, *_, many = by_cells
    sums = ("plain", "bilinear")
    return {
        "sample_time": numbers["sample_time"],
        "thinned": numbers["published_vertices_around_a_step"],
        "steps": numbers["steps"],
        "edge": numbers["edge"],
        "shifts": numbers["miss_if_labels_mean_the_state"],
        "kink": numbers["kink_of_tau"],
        "radius": radius,
        "lost": {name: 1.0 - radius[name] / radius["rod"] for name in sums},
        "by_cells": by_cells,
        "few": few,
        "many": many,
        "order": {name: _orders(by_cells, name) for name in sums},
    }


def _orders(by_cells: dict[str, dict[str, list[float]]], name: str) -> list[float]:
    """Powers of the number of cells with which the largest and the mean error in force fall [-]."""
    few, *_, many = by_cells
    ratio = np.log(np.array(by_cells[few][name]) / by_cells[many][name]) / np.log(int(few) / int(many))
    return ratio[:2].tolist()


def error_table(errors: dict[int, dict[str, list[float]]]) -> Table:
    """Largest and mean errors of both sums against the rod, by the number of cells."""
    headings = ("cells, sum", "force, max [N]", "force, mean [N]", "torque, max [N mm]", "torque, mean [N mm]")
    rows = [
        (f"{count}, {name}", *values[:2], *(1e3 * value for value in values[2:]))
        for count, error in errors.items()
        for name, values in error.items()
    ]
    return Table("Distance from the exact rod along the profile", headings, rows)
