"""Tables for compiled loops of limit surfaces that Python evaluates."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np


def stored_potential(sums: Callable[[np.ndarray], tuple[np.ndarray, np.ndarray | None]], segments: int) -> np.ndarray:
    """Return the numbers of `kernels.surfaces.POTENTIAL`: at the nodes `phi` less the tilt and its derivatives along
    both angles and mixed, then the tilt.

    `sums` returns `h` `[M, 3]` at unit scaled twists `[M, 3]`, and `dh/dV_S` `[M, 3, 3]`, or None to take mixed
    derivatives from central differences. With the unit vectors `n` of a direction, `e` and `t` of growing polar angle p
    and azimuth: `dphi/dp = h . e`, `dphi/da = sin p (h . t)`,
    `d2phi/dp da = sin p (t . dh/dn e) + cos p (h . t)`.
    """
    segment = 0.5 * np.pi / segments
    polar, azimuth = segment * np.arange(segments + 1)[:, None], segment * np.arange(4 * segments)[None, :]
    sin_p, cos_p, sin_a, cos_a = np.sin(polar), np.cos(polar), np.sin(azimuth), np.cos(azimuth)
    cos_p[-1] = 0.0  # the equator is a translation, not nearly one
    flat = np.zeros_like(polar * azimuth)
    direction = np.stack([sin_p * cos_a, sin_p * sin_a, cos_p + flat], -1)
    along = np.stack([cos_p * cos_a, cos_p * sin_a, flat - sin_p], -1)
    across = np.stack([flat - sin_a, flat + cos_a, flat], -1)
    h, slope = sums(direction.reshape(-1, 3))
    h = h.reshape(direction.shape)
    h_across = np.einsum("pai,pai->pa", h, across)
    ax, ay, _ = h[0, 0]
    lean, lean_slope = ax * cos_a + ay * sin_a, ay * cos_a - ax * sin_a
    tilt, tilt_slope = sin_p * cos_p**2, cos_p * (cos_p**2 - 2.0 * sin_p**2)
    nodes = np.zeros((segments + 1, 4 * segments + 1, 4))
    inner = nodes[:, :-1]
    inner[..., 0] = np.einsum("pai,pai->pa", h, direction) - tilt * lean
    inner[..., 1] = np.einsum("pai,pai->pa", h, along) - tilt_slope * lean
    inner[..., 2] = sin_p * h_across - tilt * lean_slope
    if slope is None:  # beyond the equator the surface is mirrored, and the tilt has the other sign
        beyond = np.roll(inner[-2, :, 2], -2 * segments) - 2.0 * tilt[-2] * lean_slope
        inner[1:, :, 3] = (np.concatenate([inner[2:, :, 2], beyond]) - inner[:-1, :, 2]) / (2.0 * segment)
    else:
        mixed = np.einsum("pai,paij,paj->pa", across, slope.reshape(*direction.shape, 3), along)
        inner[1:, :, 3] = (sin_p * mixed + cos_p * h_across - tilt_slope * lean_slope)[1:]  # 0 at the axis
    nodes[:, -1] = nodes[:, 0]
    return np.append(nodes, (ax, ay))
