"""Units in which quantities are shown: the one in which the largest value reads well."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Unit:
    """Unit in which an SI quantity is shown: `shown = factor * value`, labelled `label`."""

    factor: float
    label: str


# Each row: the largest absolute SI value from which on the unit is used, then the unit; the last row is the rest.
_UNITS = {
    "length": (
        (2e4, 1e-3, "km"),
        (2.0, 1.0, "m"),
        (2e-5, 1e3, "mm"),
        (2e-8, 1e6, "µm"),
        (0.0, 1e9, "nm"),
    ),
    "speed": (
        (2e4, 1e-3, "km/s"),
        (2.0, 1.0, "m/s"),
        (2e-5, 1e3, "mm/s"),
        (2e-8, 1e6, "µm/s"),
        (0.0, 1e9, "nm/s"),
    ),
    "angle": ((2e-3, 180 / np.pi, "deg"), (0.0, 1e6, "µrad")),
    "force": (
        (2e3, 1e-3, "kN"),
        (1e-2, 1.0, "N"),
        (1e-5, 1e3, "mN"),
        (1e-8, 1e6, "µN"),
        (0.0, 1e9, "nN"),
    ),
    "torque": (
        (2e3, 1e-3, "kN m"),
        (2.0, 1.0, "N m"),
        (2e-5, 1e3, "N mm"),
        (2e-8, 1e6, "N µm"),
        (0.0, 1e9, "N nm"),
    ),
    "pressure": (
        (2e9, 1e-9, "GPa"),
        (2e6, 1e-6, "MPa"),
        (2e2, 1e-3, "kPa"),
        (0.0, 1.0, "Pa"),
    ),
    "time": (
        (2e4, 1.0 / 3600.0, "h"),
        (2e-2, 1.0, "s"),
        (2e-5, 1e3, "ms"),
        (2e-8, 1e6, "µs"),
        (0.0, 1e9, "ns"),
    ),
}

# What fills no axis of its own (all zero) is shown in the unit that the reader expects.
_USUAL = {"length": "mm", "speed": "mm/s", "angle": "deg", "force": "N", "torque": "N mm", "pressure": "kPa",
          "time": "s"}  # fmt: skip


def unit_for(kind: str, *values) -> Unit:
    """Return the unit in which the arrays `values` of one `kind` of quantity, such as "length", read well."""
    largest = max(
        (float(np.max(np.abs(value))) for value in values if np.size(value)),
        default=0.0,
    )
    rows = _UNITS[kind]
    if largest == 0.0:
        return next(
            Unit(factor, label) for _, factor, label in rows if label == _USUAL[kind]
        )
    return next(
        Unit(factor, label) for least, factor, label in rows if largest >= least
    )
