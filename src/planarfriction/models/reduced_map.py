"""Shape of a patch as the reduced model stores it: second moments of slip and steady sliding, a map over directions."""

from __future__ import annotations

import functools
import itertools
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from planarfriction.equality import by_parts
from planarfriction.kernels.moments import slopes_in
from planarfriction.kernels.steady import HEADER, QUARTIC
from planarfriction.models import cube_map
from planarfriction.models.steady_sums import ScaledCells, ScaledPoint
from planarfriction.patch import ContactPatch


class MapSizes(NamedTuple):
    """Sizes of a map, as `kernels.steady` names them."""

    faces: int
    segments: int
    coarse: int
    levels: int

    @property
    def middle(self) -> int:
        """Number of entries in front of the Stribeck part."""
        return HEADER + self.faces * 12 * (2 * self.segments + 1) ** 2

    @property
    def count(self) -> int:
        """Number of entries of the map."""
        return self.middle + self.faces * 12 * (2 * self.coarse + 1) ** 2 * self.levels


def sizes_of(data: Any) -> MapSizes:
    """Return the sizes of a map from its entries, which compiled loops read."""
    return MapSizes(*(int(value) for value in data[:4]))


def starts_of(sizes: Sequence[MapSizes]) -> list[int]:
    """Return the index of the first entry of each map, in an array of maps one behind the other."""
    return [0, *itertools.accumulate(size.count for size in sizes)][: len(sizes)]


def maps_of(data: Any, sizes: Sequence[MapSizes]) -> Iterator[Any]:
    """Yield the entries of each map from an array of maps one behind the other."""
    return (data[at : at + size.count] for at, size in zip(starts_of(sizes), sizes, strict=True))


KNEE = 5.0
"""`|V_G/v_s|^gamma` at the middle of the Stribeck part's third coordinate: 3 is best over all speeds, 6 where most of
the patch slides several times as fast as v_s, as in the velocity-driven runs."""

POINT = 1e-6
"""Share of the load beside its heaviest cell up to which a contact is a point, without torque about it."""

LEAST_SHARE = 0.25
"""The floor of the dissipation, over the least dissipation of all stored directions."""


@by_parts
class ReducedShape(NamedTuple):
    """A patch at one load, as the reduced model knows it."""

    factor: np.ndarray
    """F [3, 3], upper triangular: `|F V|` is the root mean square of the cells' speeds."""
    data: np.ndarray
    """Steady sliding, as `kernels.steady` reads it: single precision, which a map's own error exceeds 30 times."""
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
        """Radius of gyration [m]: turns spins into speeds; 0 of a point."""
        return float(self.factor[2, 2])

    @property
    def lever(self) -> np.ndarray:
        """Map `[3, 3]` of twists to `V_G`: F."""
        return self.factor

    viscous_lever = lever

    def rate_slopes(self, lin: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return d rate / d state and d rate / d twist `[B, 3, 3]` from linearisations `[B, L]`."""
        by_z, by_v = slopes_in(lin)
        return by_z, by_v @ self.factor


def reduced_shape(
    patch: ContactPatch, normal_force: float | None, gamma: float, segments: int, speeds: int
) -> ReducedShape:
    """Build the shape of a patch at a load; `segments` and `speeds` as in `ReducedModel`."""
    factor = slip_factor(patch, normal_force)
    if factor[2, 2] == 0.0:
        return ReducedShape(factor, point_map(patch, normal_force, factor, gamma, segments, speeds))
    return ReducedShape(factor, reduced_map(ScaledCells(patch, normal_force, factor), gamma, segments, speeds))


def is_point(patch: ContactPatch, normal_force: ArrayLike | None = None):
    """Return True, `[...]`, if one cell carries the load but for a share `POINT` of it."""
    return _one_carries(patch.weights(normal_force))


def _one_carries(weights: np.ndarray):
    return 1.0 - weights.max(-1) <= POINT


def slip_factor(patch: ContactPatch, normal_force: ArrayLike | None = None) -> np.ndarray:
    """Return F `[..., 3, 3]`, upper triangular, with `F'F = sum(w B'B)`, where a cell moves at `B V` under a twist V.

    Cells as points, as the distributed model takes them: docs/reduced-model.md, "Cells as points or as areas".

    `normal_force` `[...]` [N], all > 0 where the patch depends on it. The last row is that of spins about the centre of
    pressure: zero of a point.
    """
    weights = patch.weights(normal_force)
    x, y = ((weights * coordinate).sum(-1) for coordinate in patch.positions.T)
    dx, dy = (p - c[..., None] for p, c in zip(patch.positions.T, (x, y), strict=True))
    gyration = np.where(_one_carries(weights), 0.0, np.sqrt((weights * (dx**2 + dy**2)).sum(-1)))
    if patch.root is not None:
        return _metric_factor(patch, weights, gyration)
    factor = np.zeros((*np.shape(x), 3, 3))
    factor[..., 0, 0] = factor[..., 1, 1] = 1.0
    factor[..., 0, 2], factor[..., 1, 2], factor[..., 2, 2] = -y, x, gyration
    return factor


def _metric_factor(patch: ContactPatch, weights: np.ndarray, gyration: np.ndarray) -> np.ndarray:
    """Return F from Cholesky's factor of the second moments about the middle of the cells, which cancels no digits.

    That of a point has rank 2: QR of what its cell sees.
    """
    x, y = patch.positions.mean(axis=0)
    shift = np.array([[1.0, 0.0, -y], [0.0, 1.0, x], [0.0, 0.0, 1.0]])
    levers = patch.levers() @ np.linalg.inv(shift)
    second = np.einsum("...n,nij->...ij", weights, np.swapaxes(levers, 1, 2) @ levers)
    points = gyration == 0.0
    second[points] = np.eye(3)
    factor = np.swapaxes(np.linalg.cholesky(second), -1, -2) @ shift
    upper = np.linalg.qr(patch.levers()[weights[points].argmax(-1)])[1]
    factor[points, :2] = upper * np.sign(np.diagonal(upper, axis1=-2, axis2=-1))[..., None]
    factor[points, 2] = 0.0
    return factor


def point_map(
    patch: ContactPatch, normal_force: float | None, factor: np.ndarray, gamma: float, segments: int, speeds: int
) -> np.ndarray:
    """Return the map of a point, which is the same for all points of one asymmetry."""
    heaviest = int(patch.weights(normal_force).argmax())
    lean = (0.0, 0.0)
    if patch.asymmetric:
        turn = patch.levers()[heaviest][:, :2] @ np.linalg.inv(factor[:2, :2])
        lean = tuple((turn.T @ patch.asymmetries()[heaviest]).tolist())
    return _point_map(lean, patch.asymmetric, gamma, segments, speeds)


@functools.lru_cache(maxsize=8)
def _point_map(lean: tuple[float, float], asymmetric: bool, gamma: float, segments: int, speeds: int) -> np.ndarray:
    return reduced_map(ScaledPoint(np.array([*lean, 0.0]), asymmetric), gamma, segments, speeds)


def reduced_map(cells: ScaledCells | ScaledPoint, gamma: float, segments: int, speeds: int) -> np.ndarray:
    """Return the numbers of the map of `cells`, as `kernels.steady` reads them; with an asymmetry for all six faces.

    `h_0`, which has the kinks, takes `segments` squares each way on a quarter of a face; the rest
    `r = h_1 - (1 - t) h_0` of the Stribeck part, which is smooth, a third of them, with `speeds` nodes in t.
    """
    coarse, faces = max(segments // 3, 2), 6 if cells.asymmetric else 3
    stretch = float(np.float32(cells.stretch))
    per_stretch = np.array([1.0, 1.0, 1.0 / stretch])
    directions = cube_map.face_nodes(segments)[:faces] * per_stretch
    steady = cells.sums(directions, np.empty(0), gamma)
    unit = directions / np.linalg.norm(directions, axis=-1, keepdims=True)
    least = float(np.einsum("fijc,fijc->fij", steady[..., 0, :], unit).min())
    t = np.linspace(0.0, 1.0, speeds)
    raised = KNEE * t[1:-1] / (1.0 - t[1:-1])
    sums = cells.sums(cube_map.face_nodes(coarse)[:faces] * per_stretch, raised, gamma)
    rest = np.zeros((*sums.shape[:-2], speeds, 3))
    rest[..., 1:-1, :] = sums[..., 1:, :] - (1.0 - t[1:-1, None]) * sums[..., :1, :]
    levels = np.einsum("lt,fijtc->fijlc", cube_map.level_matrix(speeds), rest, optimize=True)
    header = np.zeros(HEADER, dtype=np.float32)
    header[:8] = faces, segments, coarse, speeds + 2, KNEE, LEAST_SHARE * least, stretch, gamma
    header[QUARTIC:] = cells.fourth_moments()
    return np.concatenate([header, *(_numbers(values) for values in (steady, levels))])


def _numbers(values: np.ndarray) -> np.ndarray:
    """Return the stored numbers of a map from its values `[faces, K, K, levels, 3]`; an odd one has three faces."""
    faces = len(values)
    flat = values.reshape(*values.shape[:3], -1)
    return cube_map.flat(cube_map.hermite(flat if faces == 6 else cube_map.mirrored(flat)), 3, faces)
