"""Limit surfaces over `xp`: the source of `published.surfaces`, whose sums over cells are sums of arrays here.

`kind`, `size` and `data` are the numbers of a surface. Derivatives are those of `published.surfaces`: at rest the
ellipsoid's, at the edge of a table's cell that of the cell in use, and close to the spin axis the one at `_AXIS`.
"""

from __future__ import annotations

import math
from typing import Any

from planarfriction._engine.published import surfaces as kernel
from planarfriction.tensors.elements import Placed

_ROUNDING = 2.0**-52
"""Rounding error of the numbers that `_AT_REST` is made for."""

_MOVED = (1.0 + 1e-10) * kernel._AXIS
"""Angle [rad] to which twists near the spin axis are moved: its sine is above `_AXIS`, below which none has a slope."""


def sliding(xp, kind: int, size: int, data, scaled, speed):
    """Return `u = h(V) |V_S|` of scaled twists `[..., 3]` and their norms `[..., 1]`."""
    if kind == kernel.ELLIPSOID:
        return scaled
    moving = speed > 0.0
    # At rest any twist will do: the result is not used.
    safe = xp.where(moving, scaled, 1.0)
    u = (
        _cells(xp, size, data, safe)
        if kind == kernel.CELLS
        else _table(xp, kind, size, data, safe)
    )
    return xp.where(moving, u, scaled)


def _cells(xp, size: int, data, scaled):
    """Return `|V_S| sum w_i [v_i/|v_i| ; rho_i x v_i/|v_i|]`; a cell in the centre of rotation adds nothing."""
    px = data[:size]
    py = data[size : 2 * size]
    weights = data[2 * size : 3 * size]
    speed = xp.norm(scaled, -1)
    heading = scaled / speed
    x = heading[..., 0:1]
    y = heading[..., 1:2]
    s = heading[..., 2:3]
    ux = x - s * py
    uy = y + s * px
    square = ux * ux + uy * uy
    slides = square > (kernel._AT_REST * xp.epsilon(scaled) / _ROUNDING) ** 2
    share = xp.where(slides, weights / xp.root(xp.where(slides, square, 1.0)), 0.0)
    h = [
        (share * ux).sum(-1),
        (share * uy).sum(-1),
        (share * (px * uy - py * ux)).sum(-1),
    ]
    return xp.stack(h, -1) * speed


# ---------------------------------------------------------------------- tables


def _table(xp, kind: int, size: int, data, scaled):
    """Return `u` of a table: near the spin axis its value at one place with the derivative at another."""
    here = xp.stop_gradient(scaled)
    near, moved = _off_axis(xp, size, here)
    length, *heading = _upper(
        xp, xp.stack([scaled + xp.where(near, moved - here, 0.0), here], 0)
    )
    lookup = xp.over(kernel._bilinear if kind == kernel.BILINEAR else kernel._potential)
    at = Placed(size, xp.over(kernel.place)(size, *heading))
    u = length * xp.stack(lookup(_Corners(xp, at, data), 0, at, *heading, 1.0), -1)
    return u[0] + xp.where(near, xp.stop_gradient(u[1] - u[0]), 0.0)


class _Corners:
    """Numbers of the four nodes about places in a table, as if these were the first nodes, and those behind all."""

    def __init__(self, xp: Any, at: Placed, data: Any) -> None:
        self._data = data
        self._row = 4 * (4 * at + 1)
        i, j = at.cell
        nodes = data[: (at + 1) * self._row].reshape(at + 1, 4 * at + 1, 4)
        rows = xp.stack([i, i + 1], -1)
        columns = xp.stack([j, j + 1], -1)
        self._nodes = nodes[rows[..., :, None], columns[..., None, :]]

    def __getitem__(self, q: int) -> Any:
        i, j = divmod(q, self._row)
        return self._nodes[..., i, j // 4, j % 4] if i < 2 else self._data[q]


def _upper(xp, scaled):
    """Return a twist's length, negative in the lower half sphere, and its direction mirrored into the upper one."""
    length = xp.norm(scaled, -1)
    length = xp.where(scaled[..., 2:] < 0.0, -length, length)
    heading = scaled / length
    return length, heading[..., 0], heading[..., 1], heading[..., 2]


def _off_axis(xp, size: int, scaled):
    """Return True for twists nearer to the spin axis than `_AXIS` [rad], `[..., 1]`, and all twists moved off it."""
    length, x, y, s = _upper(xp, scaled)
    *_, polar, azimuth = xp.over(kernel.place)(size, x, y, s)
    across = math.sin(_MOVED)
    moved = [
        across * xp.cos(azimuth),
        across * xp.sin(azimuth),
        math.cos(_MOVED) * xp.ones_like(s),
    ]
    return (polar < kernel._AXIS)[..., None], length * xp.stack(moved, -1)
