"""A table for compiled loops of a limit surface that is given by a Python function."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np


def stored_potential(direction: Callable[[np.ndarray], np.ndarray], segments: int) -> np.ndarray:
    """Return the numbers of kind `POTENTIAL` from `h(V_S)` `[..., 3]`: potential, its slopes and the mixed one, then
    the tilt.

    What `limit_surface.cell_metrics.potential_table` makes of sums over cells, from any `direction`.
    """
    segment = 0.5 * np.pi / segments
    polar, azimuth = np.meshgrid(np.arange(segments + 1) * segment, np.arange(4 * segments) * segment, indexing="ij")
    sin_p, cos_p, sin_a, cos_a = np.sin(polar), np.cos(polar), np.sin(azimuth), np.cos(azimuth)
    h = direction(np.stack([sin_p * cos_a, sin_p * sin_a, cos_p], axis=-1))
    ax, ay, _ = h[0, 0]
    lean, lean_slope = ax * cos_a + ay * sin_a, ay * cos_a - ax * sin_a
    along, across = h[..., 0] * cos_a + h[..., 1] * sin_a, h[..., 1] * cos_a - h[..., 0] * sin_a
    tilt = sin_p * cos_p**2
    nodes = np.zeros((segments + 1, 4 * segments + 1, 4))
    nodes[:, :-1, 0] = along * sin_p + h[..., 2] * cos_p - tilt * lean
    nodes[:, :-1, 1] = along * cos_p - h[..., 2] * sin_p - cos_p * (cos_p**2 - 2.0 * sin_p**2) * lean
    nodes[:, :-1, 2] = across * sin_p - tilt * lean_slope
    # beyond the equator the surface is mirrored, and the tilt has the other sign
    beyond = np.roll(nodes[segments - 1, :-1, 2], -2 * segments) - 2.0 * tilt[segments - 1] * lean_slope[segments]
    slopes = np.concatenate([nodes[:, :-1, 2], beyond[None]])
    nodes[1:, :-1, 3] = (slopes[2:] - slopes[:-2]) / (2.0 * segment)
    nodes[:, -1] = nodes[:, 0]
    return np.append(nodes, [ax, ay])
