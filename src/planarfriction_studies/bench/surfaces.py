"""Costs of a table of a limit surface, and of the twist of a wrench."""

from __future__ import annotations

import numpy as np

from planarfriction.limit_surface import LimitSurface, LimitSurfaceTablePublished
from planarfriction.patch import ContactPatch
from planarfriction_studies.bench.measurement import Measurement, line, median
from planarfriction_studies.bench.workloads import disc


def table_build(full: bool) -> Measurement:
    """Measure the construction of the published table of 20 segments."""
    patch = disc()
    value = median(lambda: LimitSurfaceTablePublished(patch).numbers, 31)
    return line(value, "s", "the same nodes by NumPy, node by node", median(lambda: numpy_table(patch), 3))


def twist(full: bool, kind: type[LimitSurface], count: int | None = None) -> Measurement:
    """Measure the twist of a wrench, of an L that is a polygon: one a call, or `count` in a call."""
    corners = [(0.0, 0.0), (0.03, 0.0), (0.03, 0.005), (0.005, 0.005), (0.005, 0.02), (0.0, 0.02)]
    surface = kind(ContactPatch.polygon(corners, 21))
    wrenches = np.random.default_rng(7).normal(size=(count or 1, 3)) * [1.0, 1.0, 0.01]
    asked = wrenches[0] if count is None else wrenches
    value = median(lambda: surface.twist(asked), 15, 1 if count else 500) / len(wrenches)
    theirs = median(lambda: scipy_twist(surface, wrenches[0]), 5)
    words = "SciPy (trust-exact) on the dissipation over the plane of unit power, one wrench"
    return line(value * 1e6, "us per wrench", words, theirs * 1e6)


def scipy_twist(surface: LimitSurface, wrench: np.ndarray) -> np.ndarray:
    """Compute `surface.twist(wrench)` as one would write it with the surface's dissipation, wrench and Jacobian."""
    from scipy import optimize

    scale = np.array([1.0, 1.0, surface.contact_radius])
    target = -wrench / scale
    start = target / (target @ target) / scale  # of unit power
    basis = np.linalg.svd(target[None])[2][1:] / scale
    solution = optimize.minimize(
        lambda place: float(surface.dissipation(start + place @ basis)),
        np.zeros(2),
        jac=lambda place: -basis @ surface.wrench(start + place @ basis),
        hess=lambda place: -basis @ surface.jacobian(start + place @ basis) @ basis.T,
        method="trust-exact",
        options={"gtol": 1e-10},
    )
    twist = start + solution.x @ basis
    return twist / surface.dissipation(twist)


def numpy_table(patch: ContactPatch, segments: int = 20) -> np.ndarray:
    """Return the smoothed nodes of the published table as one would write them: four sums over the cells at every
    node."""
    grid, radius, weights = patch.grid, patch.contact_radius(), patch.weights()
    assert grid is not None
    x, y = (patch.positions - patch.centre_of_pressure()).T
    nodes = np.zeros((segments + 1, 4 * segments, 3))
    for i in range(segments):
        for j in range(4 * segments):
            azimuth, distance = 0.5 * np.pi * j / segments, radius * np.tan(0.5 * np.pi * i / segments)
            centre = np.array([-distance * np.sin(azimuth), distance * np.cos(azimuth)])
            a, b = (centre - (grid.x_min, grid.y_min)) / (grid.cell_width, grid.cell_height)
            for corner in range(4):
                p, q = int(a) + corner % 2, int(b) + corner // 2
                share = (1.0 - abs(a - p)) * (1.0 - abs(b - q))
                dx = x - (grid.x_min + p * grid.cell_width)
                dy = y - (grid.y_min + q * grid.cell_height)
                scale = share * weights / np.hypot(dx, dy)
                nodes[i, j] += -(scale @ dy), scale @ dx, scale @ (x * dx + y * dy) / radius
    return nodes
