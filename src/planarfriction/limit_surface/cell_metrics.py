"""Sums over cells whose friction has a metric of its own in each: `u_i = C_i V_S`, `h = sum w_i C_i' u_i/|u_i|`."""

from __future__ import annotations

import numpy as np

_AT_REST = 1e-14
"""Share of the twist below which a cell stands in the centre of rotation and adds nothing, as in compiled sums."""

_AT_ONCE = 500_000
"""Cells times twists that one array holds."""


def scaled_levers(x: np.ndarray, y: np.ndarray, root: np.ndarray | None, frame: np.ndarray) -> np.ndarray:
    """Return `C_i = [L_i frame^-1 | (-y_i, x_i)]`, shape `[n, 2, 3]`, of lever coordinates in contact radii.

    `root` holds the `L_i` `[n, 2, 2]`, None where all of them are `frame` `[2, 2]`.
    """
    levers = np.empty((len(x), 2, 3))
    levers[:, :, :2] = np.eye(2) if root is None else np.linalg.solve(frame.T, np.swapaxes(root, 1, 2)).swapaxes(1, 2)
    levers[:, 0, 2], levers[:, 1, 2] = -y, x
    return levers


def cell_sums(levers: np.ndarray, weights: np.ndarray, scaled: np.ndarray) -> np.ndarray:
    """Return `u = h |V_S|` for scaled twists `[M, 3]`, shape `[M, 3]`."""
    result = np.empty((len(scaled), 3))
    for part in _parts(scaled, levers):
        speed, _, unit = _headings(levers, scaled[part])
        result[part] = _direction(levers, weights, unit) * speed
    return result


def cell_slopes(levers: np.ndarray, weights: np.ndarray, scaled: np.ndarray) -> np.ndarray:
    """Return `du/dV_S` for scaled twists `[M, 3]`, shape `[M, 3, 3]`; at rest the unit matrix."""
    result = np.empty((len(scaled), 3, 3))
    for part in _parts(scaled, levers):
        twist = scaled[part]
        speed, size, unit = _headings(levers, twist)
        turn = unit[:, None, :, 0] * levers[:, 1].T - unit[:, None, :, 1] * levers[:, 0].T  # [m, 3, n]
        share = np.divide(weights * speed, size, out=np.zeros_like(size), where=size > 0.0)
        h = _direction(levers, weights, unit)
        along = np.einsum("mi,mj->mij", h, twist / np.where(speed > 0.0, speed, 1.0))
        result[part] = along + np.einsum("min,mjn->mij", share[:, None] * turn, turn)
        result[part][speed[:, 0] == 0.0] = np.eye(3)
    return result


def potential_table(levers: np.ndarray, weights: np.ndarray, segments: int) -> np.ndarray:
    """Return the numbers of a `POTENTIAL` surface of `kernels.surfaces`, flat, from sums over the cells."""
    segment = 0.5 * np.pi / segments
    polar, azimuth = np.arange(segments + 1)[:, None] * segment, np.arange(4 * segments) * segment
    sin_p, cos_p = np.sin(polar), np.cos(polar)
    cos_p[-1] = 0.0
    sin_a, cos_a = np.sin(azimuth), np.cos(azimuth)
    directions = np.stack(np.broadcast_arrays(sin_p * cos_a, sin_p * sin_a, cos_p), -1)
    h = cell_sums(levers, weights, directions.reshape(-1, 3)).reshape(directions.shape)
    tilt = h[0, 0, :2]
    along, across = h[..., 0] * cos_a + h[..., 1] * sin_a, h[..., 1] * cos_a - h[..., 0] * sin_a
    lean, lean_slope = tilt[0] * cos_a + tilt[1] * sin_a, tilt[1] * cos_a - tilt[0] * sin_a
    leaning = sin_p * cos_p**2
    nodes = np.zeros((segments + 1, 4 * segments + 1, 4))
    inner = nodes[:, :-1]
    inner[..., 0] = along * sin_p + h[..., 2] * cos_p - leaning * lean
    inner[..., 1] = along * cos_p - h[..., 2] * sin_p - cos_p * (cos_p**2 - 2.0 * sin_p**2) * lean
    inner[..., 2] = across * sin_p - leaning * lean_slope
    # beyond the equator the surface is mirrored, the tilt with the other sign
    beyond = np.roll(inner[-2, :, 2], -2 * segments) - 2.0 * leaning[-2] * lean_slope
    inner[1:, :, 3] = (np.concatenate([inner[2:, :, 2], beyond[None]]) - inner[:-1, :, 2]) / (2.0 * segment)
    nodes[:, -1] = nodes[:, 0]
    return np.append(nodes, tilt)


def _parts(scaled: np.ndarray, levers: np.ndarray) -> list[slice]:
    rows = max(1, _AT_ONCE // len(levers))
    return [slice(start, start + rows) for start in range(0, len(scaled), rows)]


def _direction(levers: np.ndarray, weights: np.ndarray, unit: np.ndarray) -> np.ndarray:
    """Return `h` `[m, 3]` of `u_i/|u_i|` `[m, n, 2]`: sums that run over the cells alike for one twist and for many."""
    pull = np.ascontiguousarray((weights[:, None, None] * levers).reshape(-1, 3).T)
    return np.einsum("mk,dk->md", unit.reshape(len(unit), -1), pull)


def _headings(levers: np.ndarray, scaled: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return `|V_S|` `[m, 1]`, and `|u_i|` `[m, n]` and `u_i/|u_i|` `[m, n, 2]`, both zero for cells at rest."""
    speed = np.linalg.norm(scaled, axis=1)[:, None]
    seen = np.einsum("ncd,md->mnc", levers, scaled)
    size = np.hypot(seen[..., 0], seen[..., 1])
    size[size <= _AT_REST * speed] = 0.0
    return speed, size, seen * np.divide(1.0, size, out=np.zeros_like(size), where=size > 0.0)[..., None]
