"""Loads of cells under the contact surface of a simulator: polygons, each with a pressure that is linear over it."""

from __future__ import annotations

import math

import numpy as np

from planarfriction._engine.cells.edge_cells import covered_part
from planarfriction._engine.compiler import jit
from planarfriction._engine.compiler.calls import pointer
from planarfriction._engine.compiler.memory import at


@jit
def press(
    corners: np.ndarray, begins: np.ndarray, planes: np.ndarray, x: np.ndarray, y: np.ndarray, radii: np.ndarray,
    loads: np.ndarray, cover: np.ndarray,
) -> None:  # fmt: skip
    """Add loads [N] [N] and pressed shares of cells at x, y, which stand for discs of these `radii`.

    Polygon f has the `corners` `begins[f]` to `begins[f + 1]` of `[V, 2]`, counter-clockwise, and the pressure
    `a + b x + c y` of row f of `planes` `[F, 3]` [Pa]. Where it pulls, it counts as covered and presses with nothing.
    """
    for f in range(planes.shape[0]):
        polygon = corners[begins[f] : begins[f + 1]]
        (left, low) = polygon[0]
        (right, high) = polygon[0]
        for k in range(1, polygon.shape[0]):
            left = min(left, polygon[k, 0])
            right = max(right, polygon[k, 0])
            low = min(low, polygon[k, 1])
            high = max(high, polygon[k, 1])
        place = at(pointer(corners), 2 * begins[f])
        (level, along_x, along_y) = planes[f]
        for i in range(x.shape[0]):
            beside = max(left - x[i], x[i] - right, low - y[i], y[i] - high)
            if beside < radii[i]:
                share, dx, dy = covered_part(
                    place, polygon.shape[0], x[i], y[i], radii[i]
                )
                pressure = level + along_x * (x[i] + dx) + along_y * (y[i] + dy)
                area = share * math.pi * radii[i] ** 2
                loads[i] += area * max(pressure, 0.0)
                cover[i] = min(cover[i] + share, 1.0)
