"""Numbers of limit surfaces and laws."""

from __future__ import annotations

from typing import Any

import numpy as np

import planarfriction as pf
from planarfriction.limit_surface.comparison import directions
from tests.models.golden import GRAIN, LAWS, PATCHES, TIP
from tests.support.rate_laws import BoucWen

RING = pf.ContactPatch.ring(0.006, 0.01, cells=9)
BOX = pf.ContactPatch.rectangle(0.02, 0.01, cells=7)
SOFT = pf.ContactPatch.disc(
    0.012, cells=9, pressure=pf.SoftFinger(c=0.006, n=0.3, k=2.5)
)
LEVEL = pf.ContactPatch.rectangle(
    0.02, 0.01, cells=7, pressure=pf.LinearGradient((30.0, -10.0))
)
SURFACES: dict[str, Any] = {
    "cells": lambda: pf.LimitSurfaceCells(BOX),
    "cells, metrics": lambda: pf.LimitSurfaceCells(PATCHES["metrics"]),
    "cells, leaning": lambda: pf.LimitSurfaceCells(PATCHES["leaning"]),
    "discs": lambda: pf.LimitSurfaceCells(PATCHES["discs"]),
    "exact box": lambda: pf.LimitSurfaceExact(LEVEL),
    "exact ring": lambda: pf.LimitSurfaceExact(RING),
    "exact soft": lambda: pf.LimitSurfaceExact(SOFT, normal_force=2.0),
    "exact metric": lambda: pf.LimitSurfaceExact(BOX.with_friction_metric(GRAIN)),
    "table": lambda: pf.LimitSurfaceTable(BOX),
    "table, leaning": lambda: pf.LimitSurfaceTable(PATCHES["leaning"]),
    "table by load": lambda: pf.LimitSurfaceTable(TIP, normal_force=1.0).at(3.0),
    "their table": lambda: pf.LimitSurfaceTablePublished(LEVEL),
    "ellipsoid": lambda: pf.LimitSurfaceEllipsoid(LEVEL),
}


def numbers_of_surface(make: Any) -> dict[str, Any]:
    """Compute wrenches, slopes and twists of a surface, and its differences from that of the cells."""
    surface = make()
    twists = 0.01 * directions(7) * [1.0, 1.0, 100.0]
    wrenches = surface.wrench(twists)
    numbers = surface.numbers
    cells = pf.LimitSurfaceCells(surface.patch, normal_force=surface.normal_force)
    return {
        "text": repr(surface), "centre": surface.centre_of_pressure, "radius": surface.contact_radius,
        "wrench": list(wrenches),
        "dissipation": surface.dissipation(twists), "jacobian": list(surface.jacobian(twists)),
        "twist": list(surface.twist(wrenches)),
        "rest": surface.wrench(np.zeros(3)), "numbers": [*numbers[:2], numbers[2]],
        "compared": str(surface.compare(cells, samples=9)),
    }  # fmt: skip


def numbers_of_laws() -> dict[str, Any]:
    """Compute friction, rates and forces of every law at loads of 2 N, and the wrench of rigid friction."""
    z = 1e-6 * np.array([[0.3, -0.2], [0.9, 0.5]])
    v = 0.01 * np.array([[1.0, 0.2], [-0.4, 1.0]])
    found: dict[str, Any] = {
        name: {
            "text": repr(law), "numbers": law.numbers, "steady": law.steady_friction([0.0, 1e-3, 0.1]),
            "rate": law.rate(z, v, 2.0, axis=-1), "force": law.force(z, v, 2.0, axis=-1),
            "one": [law.rate(1e-7, 0.01, 2.0), law.force(1e-7, 0.01, 2.0)],
            "stiffness": law.stiffness_factor([0.5, 2.0]), "bound": law.largest_deflection, "rest": law.holds_at_rest,
        }
        for name, law in {**LAWS, "stribeck": pf.CoulombStribeck(0.4, 0.6), "Bouc-Wen": BoucWen()}.items()
    }  # fmt: skip
    return found | {
        "coulomb": pf.Coulomb(0.4).wrench(
            pf.LimitSurfaceCells(BOX), [0.01, 0.002, 1.0], 2.0
        )
    }


SOURCES: dict[str, Any] = {
    **{
        name: (lambda make=make: numbers_of_surface(make))
        for name, make in SURFACES.items()
    },
    "laws": numbers_of_laws,
}
"""What is computed, by name."""
