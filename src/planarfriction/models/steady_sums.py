"""Steady sliding summed over the cells of a patch, in the scaled coordinates `V_G = F V` of the reduced model.

A cell sees `u = C V_G` with `C = B F^-1`, slides against `u/|u| + a`, and its wrench is C' times that.
"""

from __future__ import annotations

import numpy as np

from planarfriction.kernels.cell_sums import steady_sums
from planarfriction.patch import ContactPatch

_BLOCK = 128
"""Number of directions that are summed at once."""

_PRODUCTS = (0, 1, 2, 0, 0, 1), (0, 1, 2, 1, 2, 2)
"""Factors of the products m of three components."""

EVEN = 0.5
"""Mean distance from the centre of pressure over its root mean square above which maps need no stretch (disc: 0.94)."""

_GAUSS = 0.5 / np.sqrt(3.0)


class ScaledCells:
    """The loaded cells of a patch at a load, as scaled twists see them."""

    def __init__(self, patch: ContactPatch, normal_force: float | None, factor: np.ndarray) -> None:
        self.asymmetric = patch.asymmetric
        """True if `sums` has a part that is even in the direction."""
        one_metric = patch.root is None or patch.root.ndim == 2
        weights = patch.tile_weights(normal_force)
        loaded = weights > 0.0
        share, self.stretch = _spread(patch, weights)
        """Stretch of `s` in the map (see `kernels.steady`)."""
        extents = share * patch.cell_extents()[loaded]
        self._cells = _parallelograms(patch, normal_force, factor, loaded, extents) if one_metric else None
        self._levers = patch.levers()[loaded] @ np.linalg.inv(factor), weights[loaded]
        self._points = None if one_metric and not self.asymmetric else _points(patch, weights, factor, loaded, extents)

    def sums(self, directions: np.ndarray, exponents: np.ndarray, gamma: float) -> np.ndarray:
        """Return `sum(w e C'(u/|u| + a))` `[..., 1 + E, 3]` of scaled twists `[..., 3]` of any length.

        `e` is 1, then `exp(-exponents[k] |u|^gamma)` for the unit directions; `exponents` [E] ascend.
        """
        flat = np.ascontiguousarray(directions.reshape(-1, 3))
        out = np.zeros((len(flat), 1 + len(exponents), 3))
        if self._cells is not None:
            steady_sums(flat, self._cells, np.ascontiguousarray(exponents), gamma, out)
        if self._points is not None:
            unit = flat / np.linalg.norm(flat, axis=1, keepdims=True)
            for first in range(0, len(flat), _BLOCK):
                block = slice(first, first + _BLOCK)
                out[block] += self._point_sums(unit[block], exponents, gamma)
        return out.reshape(*directions.shape[:-1], -1, 3)

    def fourth_moments(self) -> np.ndarray:
        """Return the coefficients of `<u^4>` `[15]` (see `kernels.steady`), cells as points."""
        levers, weights = self._levers
        square = np.swapaxes(levers, 1, 2) @ levers  # |u|^2 = V_G' square V_G
        products = square[:, *_PRODUCTS] * np.array([1.0, 1.0, 1.0, 2.0, 2.0, 2.0])
        return _collected(np.einsum("n,ni,nj->ij", weights, products, products))

    def _point_sums(self, unit: np.ndarray, exponents: np.ndarray, gamma: float) -> np.ndarray:
        """Return the whole sum for a metric per cell, else its even part; `[M, 1 + E, 3]`."""
        assert self._points is not None
        levers, lean, weights = self._points
        u = np.einsum("mc,nic->mni", unit, levers, optimize=True)
        speed = np.hypot(u[..., 0], u[..., 1])
        if self._cells is None:
            pull = u / np.where(speed > 0.0, speed, 1.0)[..., None] + lean
        else:
            pull = np.broadcast_to(lean, u.shape)
        wrench = np.einsum("mni,nic,n->mnc", pull, levers, weights, optimize=True)
        shares = np.exp(-(speed[:, None] ** gamma) * np.concatenate([[0.0], exponents])[:, None])
        return shares @ wrench


class ScaledPoint:
    """A contact that is a point, as `ScaledCells`: `V_G/|V_G| + a`, whose last component its twists do not have."""

    stretch = 1.0

    def __init__(self, lean: np.ndarray, asymmetric: bool) -> None:
        self.asymmetric, self._lean = asymmetric, lean

    def sums(self, directions: np.ndarray, exponents: np.ndarray, gamma: float) -> np.ndarray:
        """See `ScaledCells`; the point moves at the speed 1 in all unit directions."""
        pull = directions / np.linalg.norm(directions, axis=-1, keepdims=True) + self._lean
        return pull[..., None, :] * np.exp(-np.concatenate([[0.0], exponents]))[:, None]

    def fourth_moments(self) -> np.ndarray:
        """Return the coefficients of `|V_G|^4`."""
        moments = np.zeros((6, 6))
        moments[:3, :3] = 1.0
        return _collected(moments)


def _collected(matrix: np.ndarray) -> np.ndarray:
    """Return the coefficients of `m' K m` `[15]` from K `[6, 6]` (see `kernels.steady`)."""
    powers = np.eye(3, dtype=int)[np.array(_PRODUCTS)].sum(0)
    products = powers[:, None] + powers
    rows, columns = np.triu_indices(3, m=6)
    same = (products[rows, columns][:, None, None] == products).all(-1)
    return (same * matrix).sum((1, 2))


def _spread(patch: ContactPatch, weights: np.ndarray) -> tuple[float, float]:
    """Return the share of their extents over which cells spread their load, and the stretch of the map.

    No cell spreads its load further than the patch does: one that carries nearly all of it becomes a point as the rest
    goes. Where most of the load is that close to the centre of pressure, most of what turns is far from it, and all
    that happens close to the spin is drawn apart by the ratio of the mean distance to that of the squares.
    """
    square = ((patch.positions - weights @ patch.positions) ** 2).sum(1)
    own = (patch.cell_extents() ** 2).sum(1) / 12.0
    gyration, spread = np.sqrt(weights @ square), np.sqrt(weights @ own)
    share = min(1.0, gyration / spread) if spread > 0.0 else 1.0
    ratio = float(weights @ np.sqrt(square + share**2 * own) / gyration)
    return share, ratio if ratio < EVEN else 1.0


def _parallelograms(
    patch: ContactPatch, normal_force, factor: np.ndarray, loaded: np.ndarray, extents: np.ndarray
) -> np.ndarray:
    """Return the cells `[N, 7]` of a patch with one metric, as `kernels.cell_sums` reads them.

    With T the upper left block of F and rho_g its last entry, a cell at `rho` about the centre of pressure sees
    `u = (V_G,x - V_G,s p_y, V_G,y + V_G,s p_x)` at `p = (T_11 rho_x, T_00 rho_y - T_01 rho_x)/rho_g`.
    """
    offset = patch.positions[loaded] - patch.centre_of_pressure(normal_force)
    width, height = extents.T
    zero = np.zeros_like(width)
    x = np.stack([offset[:, 0], width, zero], -1)
    y = np.stack([offset[:, 1], zero, height], -1)
    if patch.root is not None:
        x, y = factor[1, 1] * x, factor[0, 0] * y - factor[0, 1] * x
    places = np.stack([x, y], -1).reshape(-1, 6) / factor[2, 2]
    return np.ascontiguousarray(np.concatenate([places, patch.tile_weights(normal_force)[loaded, None]], axis=1))


def _points(patch: ContactPatch, weights: np.ndarray, factor: np.ndarray, loaded: np.ndarray, extents: np.ndarray):
    """Return `C` `[P, 2, 3]`, asymmetries `[P, 2]` and weights `[P]` of a 2 x 2 Gauss rule in each loaded cell."""
    along = [np.array([-_GAUSS, _GAUSS]) if side > 0.0 else np.zeros(1) for side in extents.max(axis=0)]
    inside = np.stack([axis.ravel() for axis in np.meshgrid(*along)], -1)
    count = len(inside)
    move = np.zeros((len(extents), count, 3, 3))  # from the point of a cell to its centre
    move[..., :, :] = np.eye(3)
    dx, dy = np.moveaxis(inside * extents[:, None], -1, 0)
    move[..., 0, 2], move[..., 1, 2] = -dy, dx
    levers = (patch.levers()[loaded][:, None] @ move @ np.linalg.inv(factor)).reshape(-1, 2, 3)
    lean = np.repeat(patch.asymmetries()[loaded], count, axis=0)
    return levers, lean, np.repeat(weights[loaded] / count, count)
