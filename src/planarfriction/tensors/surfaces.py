"""Limit surfaces over `xp`: `kernels.surfaces` for arrays.

`kind`, `size` and `data` are the numbers of a surface. Derivatives are those of `kernels.surfaces`: at rest the
ellipsoid's, at the edge of a table's cell that of the cell in use, and close to the spin axis the one at `_AXIS`.
"""

from __future__ import annotations

import math

from planarfriction.kernels.surfaces import _AT_REST, _AXIS, BILINEAR, CELLS, ELLIPSOID

_ROUNDING = 2.0**-52
"""Rounding error of the numbers that `_AT_REST` is made for."""

_UNDER = 1.0 - 1e-10
"""Share of `sin(_AXIS)` that a direction moved out to `_AXIS` keeps: rounding takes 2e-11 of it."""


def sliding(xp, kind: int, size: int, data, scaled, speed):
    """Return `u = h(V) |V_S|` of scaled twists `[..., 3]` and their norms `[..., 1]`."""
    if kind == ELLIPSOID:
        return scaled
    moving = speed > 0.0
    safe = xp.where(moving, scaled, 1.0)  # at rest any twist will do: the result is not used
    u = _cells(xp, size, data, safe) if kind == CELLS else _table(xp, kind, size, data, safe)
    return xp.where(moving, u, scaled)


def _cells(xp, size: int, data, scaled):
    """Return `|V_S| sum w_i [v_i/|v_i| ; rho_i x v_i/|v_i|]`; a cell in the centre of rotation adds nothing."""
    px, py, weights = data[:size], data[size : 2 * size], data[2 * size : 3 * size]
    speed = xp.norm(scaled, -1)
    heading = scaled / speed
    x, y, s = heading[..., 0:1], heading[..., 1:2], heading[..., 2:3]
    ux, uy = x - s * py, y + s * px
    square = ux * ux + uy * uy
    slides = square > (_AT_REST * xp.epsilon(scaled) / _ROUNDING) ** 2
    share = xp.where(slides, weights / xp.root(xp.where(slides, square, 1.0)), 0.0)
    h = [(share * ux).sum(-1), (share * uy).sum(-1), (share * (px * uy - py * ux)).sum(-1)]
    return xp.stack(h, -1) * speed


# ---------------------------------------------------------------------- tables


def _table(xp, kind: int, size: int, data, scaled):
    """Return `u` of a table: near the spin axis its value at one place with the derivative at another.

    Both places are looked up at once.
    """
    lookup = _bilinear if kind == BILINEAR else _potential
    here = xp.stop_gradient(scaled)
    near, moved = _off_axis(xp, here)
    u = lookup(xp, size, data, xp.stack([scaled + xp.where(near, moved - here, 0.0), here], 0))
    return u[0] + xp.where(near, xp.stop_gradient(u[1] - u[0]), 0.0)


def _upper(xp, scaled):
    """Return a twist's length, and sign and components of its direction, mirrored into the upper half sphere."""
    length = xp.norm(scaled, -1)
    heading = scaled / length
    one = xp.ones_like(heading[..., 2])
    mirror = xp.where(heading[..., 2] < 0.0, -one, one)
    return length, mirror, mirror * heading[..., 0], mirror * heading[..., 1], mirror * heading[..., 2]


def _angles(xp, x, y, s):
    """Return the polar angle from the spin axis and azimuth, from 0 to 2 pi; 0 on the axis."""
    across = xp.root(x * x + y * y)
    on_axis = across == 0.0
    azimuth = xp.arctan2(xp.where(on_axis, 0.0, y), xp.where(on_axis, 1.0, x))
    return xp.arctan2(across, s), xp.where(azimuth < 0.0, azimuth + 2.0 * math.pi, azimuth)


def _off_axis(xp, scaled):
    """Return True for twists nearer to the spin axis than `_AXIS` [rad], `[..., 1]`, and all twists moved to it."""
    length, mirror, x, y, s = _upper(xp, scaled)
    polar, azimuth = _angles(xp, x, y, s)
    across = math.sin(_AXIS)
    moved = [across * xp.cos(azimuth), across * xp.sin(azimuth), math.cos(_AXIS) * xp.ones_like(s)]
    return (polar < _AXIS)[..., None], length * mirror[..., None] * xp.stack(moved, -1)


def _place(xp, size: int, data, polar, azimuth):
    """Return the numbers at the corners of the table cell, `[..., 2, 2, 4]`, polar angle first, and the place in it."""
    per_segment = size / (0.5 * math.pi)
    a, b = polar * per_segment, azimuth * per_segment
    i, j = xp.whole(a, size - 1), xp.whole(b, 4 * size - 1)
    nodes = data[: 4 * (size + 1) * (4 * size + 1)].reshape(size + 1, 4 * size + 1, 4)
    rows, columns = xp.stack([i, i + 1], -1), xp.stack([j, j + 1], -1)
    return nodes[rows[..., :, None], columns[..., None, :]], a - i, b - j


def _bilinear(xp, size: int, data, scaled):
    """Return `u` of the published table: `h` bilinear in the two angles."""
    length, mirror, x, y, s = _upper(xp, scaled)
    corners, a, b = _place(xp, size, data, *_angles(xp, x, y, s))
    a, b = a[..., None], b[..., None]
    low = corners[..., 0, 0, :3] + b * (corners[..., 0, 1, :3] - corners[..., 0, 0, :3])
    high = corners[..., 1, 0, :3] + b * (corners[..., 1, 1, :3] - corners[..., 1, 0, :3])
    return length * mirror[..., None] * (low + a * (high - low))


def _potential(xp, size: int, data, scaled):
    """Return `u` of the smooth table: the gradient of the dissipation, bicubic in the two angles, and of its tilt."""
    length, mirror, x, y, s = _upper(xp, scaled)
    polar, azimuth = _angles(xp, x, y, s)
    corners, a, b = _place(xp, size, data, polar, azimuth)
    phi, d_polar, d_azimuth = _blend(xp, corners, a, b, 0.5 * math.pi / size)
    sin_p, cos_p, sin_a, cos_a = xp.sin(polar), xp.cos(polar), xp.sin(azimuth), xp.cos(azimuth)
    across = d_azimuth / xp.where(sin_p > _UNDER * _AXIS, sin_p, _AXIS)
    radial = phi * sin_p + d_polar * cos_p
    ax, ay = data[-2], data[-1]
    lean = ax * x + ay * y
    turn = 2.0 * lean * s * s  # the gradient of the tilt, lean s^2/|V|^2, is (ax s^2, ay s^2, 2 lean s) - turn V
    h = [
        ax * s * s - turn * x + radial * cos_a - across * sin_a,
        ay * s * s - turn * y + radial * sin_a + across * cos_a,
        2.0 * lean * s - turn * s + phi * cos_p - d_polar * sin_p,
    ]
    return length * mirror[..., None] * xp.stack(h, -1)


def _blend(xp, corners, a, b, segment: float):
    """Return the value of the bicubic patch and its derivatives along polar angle and azimuth, `[...]`.

    Neighbours enter by their differences: near the spin axis, where they are equal but for little, the azimuth's second
    derivative is divided by the square of the distance, and the rounding of two large terms would be too.
    """
    numbers = corners.reshape(*corners.shape[:-1], 2, 2)  # [..., i, j, slope by azimuth, slope by polar angle]
    numbers = xp.moveaxis(numbers, (-1, -4, -2, -3), (-4, -3, -2, -1)).reshape(*corners.shape[:-3], 4, 4)
    numbers = xp.stack([numbers[..., 0, :], numbers[..., 1, :] - numbers[..., 0, :], *_last(numbers)], -2)
    numbers = numbers.swapaxes(-1, -2)
    numbers = xp.stack([numbers[..., 0, :], numbers[..., 1, :] - numbers[..., 0, :], *_last(numbers)], -2)
    along, across = _hermite(xp, a, segment), _hermite(xp, b, segment)
    numbers = (across[..., :, :, None] * numbers[..., None, :, :]).sum(-2)  # [..., order by azimuth, 4]
    numbers = (along[..., :, None, :] * numbers[..., None, :, :]).sum(-1)
    return numbers[..., 0, 0], numbers[..., 1, 0], numbers[..., 0, 1]


def _last(numbers):
    """Return the slopes at both ends, behind the values."""
    return numbers[..., 2, :], numbers[..., 3, :]


def _hermite(xp, t, segment: float):
    """Return the cubic Hermite basis on [0, 1] and its slope `[..., 2, 4]`.

    Its members multiply value 0, value 1 less value 0, slope 0 and slope 1.
    """
    u, one = 1.0 - t, xp.ones_like(t)
    value = [one, t * t * (3.0 - 2.0 * t), segment * t * u * u, -segment * t * t * u]
    slope = [0.0 * one, 6.0 * t * u / segment, u * (1.0 - 3.0 * t), t * (3.0 * t - 2.0)]
    return xp.stack([xp.stack(value, -1), xp.stack(slope, -1)], -2)
