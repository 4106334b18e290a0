"""What the reduced model stores of a patch: second moments of slip and steady sliding, a map over directions."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planarfriction.equality import by_parts
from planarfriction.errors import InvalidValueError
from planarfriction.kernels.steady import HEADER, QUARTIC
from planarfriction.models import cube_map
from planarfriction.models.steady_sums import ScaledCells
from planarfriction.patch import ContactPatch

KNEE = 1.5
"""`|V_G|/v_s` at the middle of the Stribeck part's third coordinate: the best of 0.5..3 on the published patches."""

LEAST_SHARE = 0.25
"""The floor of the dissipation, over the least dissipation of all stored directions."""


@by_parts
class ReducedShape(NamedTuple):
    """What the reduced model knows of its patch at one load."""

    factor: np.ndarray
    """F [3, 3], upper triangular: `|F V|` is the root mean square of the cells' speeds."""
    data: np.ndarray
    """Steady sliding, as `kernels.steady` reads it."""
    other: np.ndarray | None = None
    """Steady sliding of another shape to blend with, or None."""
    blend: float = 0.0
    """Share of the other shape."""

    @property
    def numbers(self) -> np.ndarray:
        """The shape as compiled loops see it."""
        f = self.factor
        return np.array([f[0, 0], f[0, 1], f[0, 2], f[1, 1], f[1, 2], f[2, 2], self.blend])

    @property
    def contact_radius(self) -> float:
        """Radius of gyration [m]: turns spins into speeds."""
        return float(self.factor[2, 2])


def reduced_shape(
    patch: ContactPatch, normal_force: float | None, gamma: float, segments: int, speeds: int
) -> ReducedShape:
    """What a patch is at a load; `segments` and `speeds` as in `ReducedModel`."""
    factor = slip_factor(patch, normal_force)
    return ReducedShape(factor, reduced_map(ScaledCells(patch, normal_force, factor), gamma, segments, speeds))


def slip_factor(patch: ContactPatch, normal_force=None) -> np.ndarray:
    """F `[..., 3, 3]`, upper triangular, with `F'F = sum(w B'B)`: what the cells see of a twist V is `B V`.

    `normal_force` `[...]` [N], all > 0 where the patch depends on it. Raises `InvalidValueError` for one loaded point.
    """
    weights = patch.weights(normal_force)
    x, y = ((weights * coordinate).sum(-1) for coordinate in patch.positions.T)
    dx, dy = (p - c[..., None] for p, c in zip(patch.positions.T, (x, y), strict=True))
    gyration = np.sqrt((weights * (dx**2 + dy**2)).sum(-1))
    if not np.all(gyration > 0.0):
        shown = f"a radius of gyration of {np.min(gyration)} m"
        raise InvalidValueError("patch", "have more than one loaded point", shown)
    if patch.root is not None:
        return _metric_factor(patch, weights)
    factor = np.zeros((*np.shape(x), 3, 3))
    factor[..., 0, 0] = factor[..., 1, 1] = 1.0
    factor[..., 0, 2], factor[..., 1, 2], factor[..., 2, 2] = -y, x, gyration
    return factor


def _metric_factor(patch: ContactPatch, weights: np.ndarray) -> np.ndarray:
    """F from Cholesky's factor of the second moments about the middle of the cells, which cancels no digits."""
    x, y = patch.positions.mean(axis=0)
    shift = np.array([[1.0, 0.0, -y], [0.0, 1.0, x], [0.0, 0.0, 1.0]])
    levers = patch.levers() @ np.linalg.inv(shift)
    second = np.einsum("...n,nij->...ij", weights, np.swapaxes(levers, 1, 2) @ levers)
    return np.swapaxes(np.linalg.cholesky(second), -1, -2) @ shift


def reduced_map(cells: ScaledCells, gamma: float, segments: int, speeds: int) -> np.ndarray:
    """Numbers of the map of `cells`, as `kernels.steady` reads them; with an asymmetry for all six faces.

    `h_0`, which has the kinks, takes `segments` squares each way on a quarter of a face; the rest
    `r = h_1 - (1 - t) h_0` of the Stribeck part, which is smooth, a third of them, with `speeds` nodes in t.
    """
    coarse, faces = max(segments // 3, 2), 6 if cells.asymmetric else 3
    directions = cube_map.face_nodes(segments)[:faces]
    steady = cells.sums(directions, np.empty(0), gamma)
    unit = directions / np.linalg.norm(directions, axis=-1, keepdims=True)
    least = float(np.einsum("fijc,fijc->fij", steady[..., 0, :], unit).min())
    t = np.linspace(0.0, 1.0, speeds)
    relative = KNEE * t[1:-1] / (1.0 - t[1:-1])
    sums = cells.sums(cube_map.face_nodes(coarse)[:faces], relative**gamma, gamma)
    rest = np.zeros((*sums.shape[:-2], speeds, 3))
    rest[..., 1:-1, :] = sums[..., 1:, :] - (1.0 - t[1:-1, None]) * sums[..., :1, :]
    levels = np.einsum("lt,fijtc->fijlc", cube_map.level_matrix(speeds), rest, optimize=True)
    header = np.zeros(HEADER)
    header[:6] = faces, segments, coarse, speeds + 2, KNEE, LEAST_SHARE * least
    header[QUARTIC:] = cells.fourth_moments().ravel()
    return np.concatenate([header, *(_numbers(values) for values in (steady, levels))])


def _numbers(values: np.ndarray) -> np.ndarray:
    """Stored numbers of a map from its values `[faces, K, K, levels, 3]`; an odd one has three faces."""
    faces = len(values)
    flat = values.reshape(*values.shape[:3], -1)
    return cube_map.flat(cube_map.hermite(flat if faces == 6 else cube_map.mirrored(flat)), 3, faces)
