"""Limit surfaces for JAX: `u = h(V) |V_S|` of a scaled twist, from the numbers of `planarfriction.kernels.surfaces`.

The derivative is that of the compiled `sliding_jacobian`: in the table cell that the lookup uses; within a small angle
of the spin axis the one at that angle; at rest, where there is none, the ellipsoid's, which is the identity.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax.custom_derivatives import SymbolicZero

from planarfriction.jax import namespace as xp
from planarfriction.kernels import surfaces as kernels


def _arithmetic(kernel: Any) -> Callable:
    """The Python behind a kernel of plain arithmetic (it calls no other kernel), which takes arrays as well."""
    return getattr(kernel, "py_func", kernel)


_bilinear_blend, _blend, _hermite, _tilt = map(
    _arithmetic, (kernels.bilinear_blend, kernels._blend, kernels._hermite, kernels._tilt)
)


@functools.partial(jax.custom_jvp, nondiff_argnums=(0, 1))
def sliding(kind: int, size: int, data, twist):
    """`u` of scaled twists `[..., 3]`; `kind`, `size` and `data` as in `kernels.surfaces`; zero at rest."""
    if kind == kernels.ELLIPSOID:
        return twist
    moving = xp.norm(twist, -1)[..., None] > 0.0
    return jnp.where(moving, _KINDS[kind](size, data, _or_spin(moving, twist)), 0.0)


@functools.partial(sliding.defjvp, symbolic_zeros=True)
def _sliding_jvp(kind: int, size: int, primals, tangents):
    data, twist = primals
    d_data, d_twist = tangents
    value = sliding(kind, size, data, twist)
    change = jnp.zeros_like(value)
    if not isinstance(d_twist, SymbolicZero):
        change = change + _directional(kind, size, data, twist, d_twist)
    if not isinstance(d_data, SymbolicZero) and kind != kernels.ELLIPSOID:
        change = change + _of_numbers(kind, size, data, d_data, twist)
    return value, change


def _directional(kind: int, size: int, data, twist, d_twist):
    """`du/dV_S dV_S`; it does not depend on the length of the twist."""
    if kind == kernels.ELLIPSOID:
        return d_twist
    speed = xp.norm(twist, -1)[..., None]
    moving = speed > 0.0
    heading = _or_spin(moving, twist / jnp.where(moving, speed, 1.0))
    if kind != kernels.CELLS:
        heading = _off_axis(heading)
    function = functools.partial(_KINDS[kind], size, data)
    return jnp.where(moving, jax.jvp(function, (heading,), (d_twist,))[1], d_twist)


def _of_numbers(kind: int, size: int, data, d_data, twist):
    """Change of `u` with the stored numbers; zero at rest."""
    moving = xp.norm(twist, -1)[..., None] > 0.0
    safe = _or_spin(moving, twist)
    change = jax.jvp(lambda numbers: _KINDS[kind](size, numbers, safe), (data,), (d_data,))[1]
    return jnp.where(moving, change, 0.0)


# ------------------------------------------------------------------ directions


def _or_spin(moving, twist):
    """The twist where it moves, else a spin, so that a lookup at rest has something to look up."""
    return jnp.where(moving, twist, jnp.array([0.0, 0.0, 1.0], twist.dtype))


def _mirrored(twist):
    """Sign and components of the twist in the upper half sphere."""
    mirror = jnp.where(twist[..., 2] < 0.0, -1.0, 1.0)
    x, y, s = (mirror * twist[..., i] for i in range(3))
    # a negative zero would turn the azimuth of a pure spin by half a turn
    return mirror, x - jax.lax.stop_gradient(jnp.where(x == 0.0, x, 0.0)), y, s


def _off_axis(heading):
    """Unit vectors, those nearer to the spin axis than `kernels._AXIS` [rad] moved out to it."""
    mirror, x, y, s = _mirrored(heading)
    near = jnp.arctan2(jnp.sqrt(x * x + y * y), s) < kernels._AXIS
    azimuth = jnp.arctan2(y, x)
    across = math.sin(kernels._AXIS)
    moved = jnp.stack(
        [across * jnp.cos(azimuth), across * jnp.sin(azimuth), jnp.full_like(s, math.cos(kernels._AXIS))], axis=-1
    )
    return jnp.where(near[..., None], mirror[..., None] * moved, heading)


def _place(size: int, data, x, y, s):
    """Numbers at the corners of the table cell, position within it, and the angles (see `kernels.surfaces._place`).

    The 16 numbers are laid out as a table of one cell: rows of two nodes with four numbers each.
    """
    per_segment = size / (0.5 * math.pi)
    polar = jnp.arctan2(jnp.sqrt(x * x + y * y), s)
    azimuth = jnp.arctan2(y, x)
    azimuth = jnp.where(azimuth < 0.0, azimuth + 2.0 * math.pi, azimuth)
    a, b = polar * per_segment, azimuth * per_segment
    i = jnp.minimum(a.astype(jnp.int32), size - 1)
    j = jnp.minimum(b.astype(jnp.int32), 4 * size - 1)
    row = 4 * (4 * size + 1)
    numbers = data[(i * row + 4 * j)[..., None] + np.concatenate([np.arange(8), row + np.arange(8)])]
    return [numbers[..., k] for k in range(16)], a - i, b - j, polar, azimuth


# ------------------------------------------------------------------ kinds

_ROW = 8
"""Numbers from one row of a single table cell to the next."""


def _bilinear(size: int, data, twist):
    mirror, x, y, s = _mirrored(twist)
    cell, a, b, _, _ = _place(size, data, x, y, s)
    h = jnp.stack([_bilinear_blend(*cell[i::4], a, b)[0] for i in range(3)], axis=-1)
    return h * (mirror * jnp.sqrt(x * x + y * y + s * s))[..., None]


def _potential(size: int, data, twist):
    mirror, x, y, s = _mirrored(twist)
    speed = jnp.sqrt(x * x + y * y + s * s)
    cell, a, b, polar, azimuth = _place(size, data, x, y, s)
    segment = 0.5 * math.pi / size
    (av, af, _), (bv, bf, _) = _hermite(a), _hermite(b)
    phi = _blend(cell, 0, _ROW, segment, av, bv, 1.0)
    d_polar = _blend(cell, 0, _ROW, segment, af, bv, 1.0) / segment
    d_azimuth = _blend(cell, 0, _ROW, segment, av, bf, 0.0) / segment
    sin_p, cos_p, sin_a, cos_a = jnp.sin(polar), jnp.cos(polar), jnp.sin(azimuth), jnp.cos(azimuth)
    # directions moved out to that angle keep their own sine, which is smaller by 2e-11 of itself
    across = d_azimuth / jnp.where(sin_p > (1.0 - 1e-10) * kernels._AXIS, sin_p, kernels._AXIS)
    radial = phi * sin_p + d_polar * cos_p
    end = 4 * (size + 1) * (4 * size + 1)
    nx, ny, ns = x / speed, y / speed, s / speed
    c, tilt = _tilt(data[end], data[end + 1], nx, ny, ns)
    h = [
        tilt[0] - 2.0 * c * nx + radial * cos_a - across * sin_a,
        tilt[1] - 2.0 * c * ny + radial * sin_a + across * cos_a,
        tilt[2] - 2.0 * c * ns + phi * cos_p - d_polar * sin_p,
    ]
    return jnp.stack(h, axis=-1) * (mirror * speed)[..., None]


def _cells(size: int, data, twist):
    px, py, w = data[:size], data[size : 2 * size], data[2 * size : 3 * size]
    x, y, s = (twist[..., i, None] for i in range(3))
    speed = jnp.sqrt(x * x + y * y + s * s)
    ux, uy = x - s * py, y + s * px
    square = ux * ux + uy * uy
    turns = square > (kernels._AT_REST * speed) ** 2
    c = jnp.where(turns, w / jnp.sqrt(jnp.where(turns, square, 1.0)), 0.0)
    h = [jnp.sum(c * ux, axis=-1), jnp.sum(c * uy, axis=-1), jnp.sum(c * (px * uy - py * ux), axis=-1)]
    return jnp.stack(h, axis=-1) * speed


_KINDS = {kernels.BILINEAR: _bilinear, kernels.POTENTIAL: _potential, kernels.CELLS: _cells}
