"""Evaluation of limit surfaces in compiled loops: `u = h(V) |V_S|` and its Jacobian for a scaled twist `V_S`.

See docs/physics.md, "Limit surfaces"; `published.spin_sums` describes the published table.

`V_S = (vx, vy, r omega)` at the centre of pressure; `h` is the direction of the friction wrench with its sign
reversed and its torque divided by `r`. `u` is homogeneous of degree 1 in `V_S` and zero at rest. A surface is a kind,
and numbers in a flat array from `start` on; `size` is the number of segments of a quadrant (tables) or of cells:

- `BILINEAR`: nodes `[size + 1, 4 size + 1, 4]` over polar angle (from the spin axis) and azimuth: `h`, and a spare;
- `POTENTIAL`: nodes of the same shape: `phi`, `d phi/d polar`, `d phi/d azimuth` and the mixed derivative, then the two
  numbers of a `_tilt`. The dissipation is `|V_S| (phi + tilt)(direction)`, so that `h` is exactly its gradient;
- `ELLIPSOID`: no numbers, `u = V_S`;
- `CELLS`: rows x / r, y / r, w of the cells.
"""

from __future__ import annotations

import math

import numpy as np

from planarfriction._engine.codegen.vectors import Vector, clear
from planarfriction._engine.compiler import compiled_math as xp
from planarfriction._engine.compiler import jit, kernel
from planarfriction._engine.compiler.memory import Doubles

BILINEAR = 0
"""Kind of surface: a table, bilinear between its nodes."""

POTENTIAL = 1
"""Kind of surface: a table of the dissipation whose gradient is the wrench."""

ELLIPSOID = 2
"""Kind of surface: the ellipsoid."""

CELLS = 3
"""Kind of surface: the sum over cells."""

# Nearer to the spin axis [rad] the azimuth's slopes are taken at this polar angle: they differ from their limit by
# about as much, and rounding, which the Jacobian divides by its square, stays below 1e-5 too.
_AXIS = 1e-5
_SIN_AXIS = math.sin(_AXIS)
_COS_AXIS = math.cos(_AXIS)

# A cell slower than this share of the twist stands in the centre of rotation: what is left of its speed is rounding.
_AT_REST = 1e-14


@kernel
def place(size: int, x: float, y: float, s: float) -> tuple:
    """Table coordinates of a direction with `s >= 0`: polar and azimuth cell, position within it, and the angles."""
    per_segment = size / (0.5 * math.pi)
    polar = xp.atan2(math.sqrt(x * x + y * y), s)
    azimuth = xp.atan2(y, x)
    if azimuth < 0.0:
        azimuth += 2.0 * math.pi
    a = polar * per_segment
    b = azimuth * per_segment
    i = xp.minimum(int(a), size - 1)
    j = xp.minimum(int(b), 4 * size - 1)
    return i, j, a - i, b - j, polar, azimuth


@kernel
def _sines(x: float, y: float, s: float, polar: float) -> Vector:
    """Sine and cosine of the polar angle, which stays `_AXIS` away from the axis, and of the azimuth."""
    across = math.sqrt(x * x + y * y)
    per_across = 1.0 / xp.where(across > 0.0, across, 1.0)
    norm = math.sqrt(x * x + y * y + s * s)
    per_norm = 1.0 / xp.where(norm > 0.0, norm, 1.0)
    inside = polar < _AXIS
    sin_p = xp.where(inside, _SIN_AXIS, across * per_norm)
    cos_p = xp.where(inside, _COS_AXIS, s * per_norm)
    return sin_p, cos_p, y * per_across, xp.where(across > 0.0, x * per_across, 1.0)


@kernel
def _corners(data: Doubles, p: int, row: int, a: float, b: float) -> Vector:
    """Bilinear value of one component at a place in a table, and differences along polar angle and azimuth."""
    low = data[p] + b * (data[p + 4] - data[p])
    high = data[p + row] + b * (data[p + row + 4] - data[p + row])
    left = data[p] + a * (data[p + row] - data[p])
    right = data[p + 4] + a * (data[p + row + 4] - data[p + 4])
    return low + a * (high - low), high - low, right - left


@kernel
def _bilinear(
    data: Doubles, start: int, size: int, x: float, y: float, s: float, speed: float
) -> Vector:
    i, j, a, b, _, _ = place(size, x, y, s)
    row = 4 * (4 * size + 1)
    p = start + i * row + 4 * j
    hx = _corners(data, p, row, a, b)
    hy = _corners(data, p + 1, row, a, b)
    hs = _corners(data, p + 2, row, a, b)
    return hx[0] * speed, hy[0] * speed, hs[0] * speed


@kernel
def _bilinear_jacobian(
    data: Doubles, start: int, size: int, x: float, y: float, s: float, out: Doubles
) -> None:
    i, j, a, b, polar, _ = place(size, x, y, s)
    row = 4 * (4 * size + 1)
    p = start + i * row + 4 * j
    per_segment = size / (0.5 * math.pi)
    sin_p, cos_p, sin_a, cos_a = _sines(x, y, s, polar)
    radial = (sin_p * cos_a, sin_p * sin_a, cos_p)
    per_azimuth = per_segment / sin_p
    polar_slope = (
        per_segment * cos_p * cos_a,
        per_segment * cos_p * sin_a,
        -per_segment * sin_p,
    )
    azimuth_slope = (-per_azimuth * sin_a, per_azimuth * cos_a, 0.0)
    # The axis has no slope by the azimuth.
    a = xp.where(polar < _AXIS, _AXIS * per_segment, a)
    for i in range(3):
        h, h_polar, h_azimuth = _corners(data, p + i, row, a, b)
        for j in range(3):
            out[3 * i + j] = (
                h * radial[j] + h_polar * polar_slope[j] + h_azimuth * azimuth_slope[j]
            )


@kernel
def _hermite(t: float) -> tuple[Vector, Vector, Vector]:
    """Cubic Hermite basis on [0, 1]: values, first and second derivatives; order value 0, value 1, slope 0, slope 1."""
    u = 1.0 - t
    value = ((1.0 + 2.0 * t) * u * u, t * t * (3.0 - 2.0 * t), t * u * u, -t * t * u)
    first = (-6.0 * t * u, 6.0 * t * u, u * (1.0 - 3.0 * t), t * (3.0 * t - 2.0))
    second = (12.0 * t - 6.0, 6.0 - 12.0 * t, 6.0 * t - 4.0, 6.0 * t - 2.0)
    return value, first, second


@kernel
def _blend(
    data: Doubles, p: int, row: int, segment: float, a: Vector, b: Vector, whole: float
) -> float:
    """Bicubic value from the basis `a` along the polar angle and `b` along the azimuth.

    Azimuth's neighbours enter by their differences: near the spin axis, where they are equal but for little, its second
    derivative is divided by the square of the distance, and the rounding of two large terms would be too. `whole` is
    `b[0] + b[1]` without rounding: 1 for the value, 0 for a derivative along the azimuth.
    """
    total = 0.0
    for i in range(2):
        q = p + i * row
        low = a[i] * data[q] + a[i + 2] * segment * data[q + 1]
        change = a[i] * (data[q + 4] - data[q]) + a[i + 2] * segment * (
            data[q + 5] - data[q + 1]
        )
        total += whole * low + b[1] * change
        for j in range(2):
            total += (
                segment
                * b[j + 2]
                * (
                    a[i] * data[q + 4 * j + 2]
                    + a[i + 2] * segment * data[q + 4 * j + 3]
                )
            )
    return total


@kernel
def _tilt(ax: float, ay: float, x: float, y: float, s: float) -> tuple[float, Vector]:
    """`c = (a . V) s^2/|V|^2` at a unit vector with `s >= 0`, and `n`: the gradient of c is `n - 2 c V`.

    The force in a pure spin tilts the dissipation about the spin axis, where polar coordinates cannot hold a slope: an
    error of its azimuth derivatives, divided by the distance, would grow without bound. This function has that slope,
    is smooth there, and vanishes with its gradient at the equator, where the two halves of the surface meet.
    """
    lean = ax * x + ay * y
    return lean * s * s, (ax * s * s, ay * s * s, 2.0 * lean * s)


@kernel
def _potential(
    data: Doubles, start: int, size: int, x: float, y: float, s: float, speed: float
) -> Vector:
    i, j, a, b, polar, azimuth = place(size, x, y, s)
    row = 4 * (4 * size + 1)
    p = start + i * row + 4 * j
    segment = 0.5 * math.pi / size
    av, af, _ = _hermite(a)
    bv, bf, _ = _hermite(b)
    phi = _blend(data, p, row, segment, av, bv, 1.0)
    d_polar = _blend(data, p, row, segment, af, bv, 1.0) / segment
    d_azimuth = _blend(data, p, row, segment, av, bf, 0.0) / segment
    sin_p = math.sin(polar)
    cos_p = math.cos(polar)
    sin_a = math.sin(azimuth)
    cos_a = math.cos(azimuth)
    across = d_azimuth / xp.maximum(sin_p, _AXIS)
    radial = phi * sin_p + d_polar * cos_p
    end = start + (size + 1) * row
    nx = x / speed
    ny = y / speed
    ns = s / speed
    c, tilt = _tilt(data[end], data[end + 1], nx, ny, ns)
    return (
        speed * (tilt[0] - 2.0 * c * nx + radial * cos_a - across * sin_a),
        speed * (tilt[1] - 2.0 * c * ny + radial * sin_a + across * cos_a),
        speed * (tilt[2] - 2.0 * c * ns + phi * cos_p - d_polar * sin_p),
    )


@kernel
def _potential_jacobian(
    data: Doubles, start: int, size: int, x: float, y: float, s: float, out: Doubles
) -> None:
    i, j, a, b, polar, _ = place(size, x, y, s)
    row = 4 * (4 * size + 1)
    p = start + i * row + 4 * j
    end = start + (size + 1) * row
    segment = 0.5 * math.pi / size
    if polar < _AXIS:
        a = _AXIS / segment
    av, af, a2 = _hermite(a)
    bv, bf, b2 = _hermite(b)
    phi = _blend(data, p, row, segment, av, bv, 1.0)
    d_p = _blend(data, p, row, segment, af, bv, 1.0) / segment
    d_a = _blend(data, p, row, segment, av, bf, 0.0) / segment
    d_pp = _blend(data, p, row, segment, a2, bv, 1.0) / segment**2
    d_pa = _blend(data, p, row, segment, af, bf, 0.0) / segment**2
    d_aa = _blend(data, p, row, segment, av, b2, 0.0) / segment**2
    sin_p, cos_p, sin_a, cos_a = _sines(x, y, s, polar)
    radial = (sin_p * cos_a, sin_p * sin_a, cos_p)
    along = (cos_p * cos_a, cos_p * sin_a, -sin_p)  # unit vector of growing polar angle
    across = (-sin_a, cos_a, 0.0)  # unit vector of growing azimuth
    axis = (0.0, 0.0, 1.0)
    lean = (data[end], data[end + 1], 0.0)
    c, n = _tilt(lean[0], lean[1], radial[0], radial[1], radial[2])
    h_across = d_a / sin_p
    m_pp = phi + d_pp
    m_pa = (d_pa - d_a * cos_p / sin_p) / sin_p
    m_aa = phi + (d_p * cos_p + d_aa / sin_p) / sin_p
    for i in range(3):
        h = (
            phi * radial[i]
            + d_p * along[i]
            + h_across * across[i]
            + n[i]
            - 2.0 * c * radial[i]
        )
        to_radial = h + 8.0 * c * radial[i] - 2.0 * n[i]
        to_along = m_pp * along[i] + m_pa * across[i]
        to_across = m_pa * along[i] + m_aa * across[i]
        to_axis = (
            2.0 * cos_p * lean[i]
            + 2.0 * (lean[0] * radial[0] + lean[1] * radial[1]) * axis[i]
        )
        for j in range(3):
            out[3 * i + j] = (
                to_radial * radial[j] + to_along * along[j] + to_across * across[j]
            )
            out[3 * i + j] += (
                to_axis * axis[j]
                - 2.0 * radial[i] * n[j]
                + 2.0 * cos_p * axis[i] * lean[j]
            )
        out[4 * i] -= 2.0 * c


@kernel
def _cells(
    data: Doubles, start: int, size: int, x: float, y: float, s: float, speed: float
) -> Vector:
    hx = 0.0
    hy = 0.0
    hs = 0.0
    for i in range(size):
        px = data[start + i]
        py = data[start + size + i]
        w = data[start + 2 * size + i]
        ux = x - s * py
        uy = y + s * px
        norm = math.sqrt(ux * ux + uy * uy)
        c = w / norm if norm > _AT_REST * speed else 0.0
        hx += c * ux
        hy += c * uy
        hs += c * (px * uy - py * ux)
    return hx * speed, hy * speed, hs * speed


@kernel
def _cells_jacobian(
    data: Doubles,
    start: int,
    size: int,
    x: float,
    y: float,
    s: float,
    speed: float,
    out: Doubles,
) -> None:
    radial = (x / speed, y / speed, s / speed)
    clear(out, 9)
    for m in range(size):
        px = data[start + m]
        py = data[start + size + m]
        w = data[start + 2 * size + m]
        ux = x - s * py
        uy = y + s * px
        norm = math.sqrt(ux * ux + uy * uy)
        per_norm = 1.0 / norm if norm > _AT_REST * speed else 0.0
        ex = per_norm * ux
        ey = per_norm * uy
        # the velocity turns across e only: d e/dV = t t' P / |v| with t normal to e
        along = (ex, ey, px * ey - py * ex)
        across = (-ey, ex, px * ex + py * ey)
        turn = speed * per_norm
        for i in range(3):
            for j in range(3):
                out[3 * i + j] += w * (
                    along[i] * radial[j] + turn * across[i] * across[j]
                )


@kernel
def sliding(
    kind: int,
    data: Doubles,
    start: int,
    size: int,
    x: float,
    y: float,
    s: float,
    speed: float,
) -> Vector:
    """`u = h(V) |V_S|` of the scaled twist `(x, y, s)` of norm `speed`; the lower half sphere mirrors the upper."""
    if kind == ELLIPSOID:
        return x, y, s
    if speed == 0.0:
        return 0.0, 0.0, 0.0
    if kind == CELLS:
        return _cells(data, start, size, x, y, s, speed)
    mirror = -1.0 if s < 0.0 else 1.0
    if kind == BILINEAR:
        u = _bilinear(data, start, size, mirror * x, mirror * y, mirror * s, speed)
    else:
        u = _potential(data, start, size, mirror * x, mirror * y, mirror * s, speed)
    return mirror * u[0], mirror * u[1], mirror * u[2]


@kernel
def sliding_jacobian(
    kind: int,
    data: Doubles,
    start: int,
    size: int,
    x: float,
    y: float,
    s: float,
    speed: float,
    out: Doubles,
) -> None:
    """Write `du/dV_S`, nine numbers row by row; at rest, where it has no value, the ellipsoid's.

    `u` is homogeneous, so that `u = du/dV_S V_S`.
    """
    mirror = -1.0 if s < 0.0 else 1.0
    if kind == ELLIPSOID or speed == 0.0:
        for i in range(9):
            out[i] = 1.0 if i % 4 == 0 else 0.0
    elif kind == CELLS:
        _cells_jacobian(data, start, size, x, y, s, speed, out)
    elif kind == BILINEAR:
        _bilinear_jacobian(data, start, size, mirror * x, mirror * y, mirror * s, out)
    else:
        _potential_jacobian(data, start, size, mirror * x, mirror * y, mirror * s, out)


@kernel
def _norm(twist: np.ndarray) -> float:
    return math.sqrt(twist[0] * twist[0] + twist[1] * twist[1] + twist[2] * twist[2])


@jit
def sliding_batch(
    kind: int, data: np.ndarray, start: int, size: int, twist: np.ndarray, u: np.ndarray
) -> None:
    """`sliding` for scaled twists `[M, 3]` into `u [M, 3]`."""
    for m in range(twist.shape[0]):
        v = twist[m]
        u[m, 0], u[m, 1], u[m, 2] = sliding(
            kind, data, start, size, v[0], v[1], v[2], _norm(v)
        )


@jit
def sliding_jacobian_batch(
    kind: int,
    data: np.ndarray,
    start: int,
    size: int,
    twist: np.ndarray,
    jacobian: np.ndarray,
) -> None:
    """`sliding_jacobian` for scaled twists `[M, 3]` into `jacobian [M, 9]`."""
    for m in range(twist.shape[0]):
        v = twist[m]
        sliding_jacobian(
            kind, data, start, size, v[0], v[1], v[2], _norm(v), jacobian[m]
        )
