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


def cell_sums(levers: np.ndarray, weights: np.ndarray, units: np.ndarray) -> np.ndarray:
    """Return `h` of unit scaled twists `[M, 3]`, shape `[M, 3]`."""
    parts = _parts(units, levers)
    return np.concatenate([_direction(levers, weights, _headings(levers, each)[1]) for each in parts])


def cell_slopes(levers: np.ndarray, weights: np.ndarray, units: np.ndarray) -> np.ndarray:
    """Return `dh/dV_S` of unit scaled twists `[M, 3]`, shape `[M, 3, 3]`."""
    found = []
    for part in _parts(units, levers):
        size, heading = _headings(levers, part)
        turn = heading[:, None, :, 0] * levers[:, 1].T - heading[:, None, :, 1] * levers[:, 0].T  # [m, 3, n]
        share = np.divide(weights, size, out=np.zeros_like(size), where=size > 0.0)
        found.append(np.einsum("min,mjn->mij", share[:, None] * turn, turn))
    return np.concatenate(found)


def _parts(units: np.ndarray, levers: np.ndarray) -> list[np.ndarray]:
    rows = max(1, _AT_ONCE // len(levers))
    return [units[start : start + rows] for start in range(0, max(len(units), 1), rows)]


def _direction(levers: np.ndarray, weights: np.ndarray, heading: np.ndarray) -> np.ndarray:
    """Return `h` `[m, 3]` of `u_i/|u_i|` `[m, n, 2]`: sums that run over the cells alike for one twist and for many."""
    pull = np.ascontiguousarray((weights[:, None, None] * levers).reshape(-1, 3).T)
    return np.einsum("mk,dk->md", heading.reshape(-1, pull.shape[1]), pull)


def _headings(levers: np.ndarray, units: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return `|u_i|` `[m, n]` and `u_i/|u_i|` `[m, n, 2]` of unit scaled twists, both zero for cells at rest."""
    seen = np.einsum("ncd,md->mnc", levers, units)
    size = np.hypot(seen[..., 0], seen[..., 1])
    size[size <= _AT_REST] = 0.0
    return size, seen * np.divide(1.0, size, out=np.zeros_like(size), where=size > 0.0)[..., None]
