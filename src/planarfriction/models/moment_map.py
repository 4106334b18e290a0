"""What the moment model stores of a patch: its second moments of slip and its steady sliding, a map over directions."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planarfriction.errors import InvalidValueError
from planarfriction.kernels.cell_sums import steady_sums
from planarfriction.kernels.steady import HEADER, QUARTIC
from planarfriction.models import cube_map
from planarfriction.patch import ContactPatch

KNEE = 1.5
"""`|V_G|/v_s` at the middle of the Stribeck part's third coordinate: the best of 0.5..3 on the published patches."""

LEAST_SHARE = 0.25
"""The floor of the dissipation, over the least dissipation of all stored directions."""


class MomentShape(NamedTuple):
    """What the moment model knows of its patch at one load."""

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


def moment_shape(
    patch: ContactPatch, normal_force: float | None, gamma: float, segments: int, speeds: int
) -> MomentShape:
    """What a patch is at a load; `segments` and `speeds` as in `ReducedModel`."""
    factor = slip_factor(patch, normal_force)
    return MomentShape(factor, moment_map(scaled_cells(patch, normal_force, factor), gamma, segments, speeds))


def slip_factor(patch: ContactPatch, normal_force: float | None) -> np.ndarray:
    """F [3, 3], upper triangular, with `F'F = sum(w B'B)`: the cells' velocities are `B V`."""
    x, y = patch.centre_of_pressure(normal_force)
    gyration = float(np.sqrt(patch.second_moment(normal_force)))
    if not gyration > 0.0:
        raise InvalidValueError("patch", "have more than one loaded point", f"a radius of gyration of {gyration} m")
    return np.array([[1.0, 0.0, -y], [0.0, 1.0, x], [0.0, 0.0, gyration]])


def scaled_cells(patch: ContactPatch, normal_force: float | None, factor: np.ndarray) -> np.ndarray:
    """Loaded cells `[N, 5]`: position about the centre of pressure and extents over rho_g, weight."""
    weights = patch.weights(normal_force)
    loaded = weights > 0.0
    offset = patch.positions[loaded] - patch.centre_of_pressure(normal_force)
    lengths = np.concatenate([offset, patch.cell_extents()[loaded]], axis=1) / factor[2, 2]
    return np.ascontiguousarray(np.concatenate([lengths, weights[loaded, None]], axis=1))


def moment_map(cells: np.ndarray, gamma: float, segments: int, speeds: int) -> np.ndarray:
    """Numbers of the map of `cells` `[N, 5]`, as `kernels.steady` reads them.

    `h_0`, which has the kinks, takes `segments` squares each way on a quarter of a face; the rest
    `r = h_1 - (1 - t) h_0` of the Stribeck part, which is smooth, a third of them, with `speeds` nodes in t.
    """
    coarse = max(segments // 3, 2)
    steady = _sums(cells, segments, np.empty(0), gamma)
    directions = cube_map.face_nodes(segments)[:3]
    unit = directions / np.linalg.norm(directions, axis=-1, keepdims=True)
    least = float(np.einsum("fijc,fijc->fij", steady[..., 0, :], unit).min())
    t = np.linspace(0.0, 1.0, speeds)
    relative = KNEE * t[1:-1] / (1.0 - t[1:-1])
    sums = _sums(cells, coarse, relative**gamma, gamma)
    rest = np.zeros((*sums.shape[:-2], speeds, 3))
    rest[..., 1:-1, :] = sums[..., 1:, :] - (1.0 - t[1:-1, None]) * sums[..., :1, :]
    levels = np.einsum("lt,fijtc->fijlc", cube_map.level_matrix(speeds), rest, optimize=True)
    header = np.zeros(HEADER)
    header[:6] = 3, segments, coarse, speeds + 2, KNEE, LEAST_SHARE * least
    header[QUARTIC:] = fourth_moments(cells).ravel()
    return np.concatenate([header, *(_numbers(values) for values in (steady, levels))])


def fourth_moments(cells: np.ndarray) -> np.ndarray:
    """K [6, 6] of `<v^4> = m' K m`, m the products of a scaled twist (see `kernels.steady`), of `cells` `[N, 5]`."""
    x, y, weights = cells[:, 0], cells[:, 1], cells[:, 4]
    zero, one = np.zeros_like(x), np.ones_like(x)
    squares = np.stack([one, one, x * x + y * y, zero, -2.0 * y, 2.0 * x])  # |u|^2 = squares . m
    return np.einsum("n,in,jn->ij", weights, squares, squares)


def _sums(cells: np.ndarray, n: int, exponents: np.ndarray, gamma: float) -> np.ndarray:
    """`steady_sums` at the nodes of the three positive faces, `[3, K, K, 1 + E, 3]`."""
    directions = np.ascontiguousarray(cube_map.face_nodes(n)[:3])
    out = np.empty((directions.size // 3, 1 + len(exponents), 3))
    steady_sums(directions.reshape(-1, 3), cells, np.ascontiguousarray(exponents), gamma, out)
    return out.reshape(*directions.shape[:3], -1, 3)


def _numbers(values: np.ndarray) -> np.ndarray:
    """Stored numbers of an odd map from its values `[3, K, K, levels, 3]`."""
    every = cube_map.mirrored(values.reshape(*values.shape[:3], -1))
    return cube_map.flat(cube_map.hermite(every), 3, 3)
