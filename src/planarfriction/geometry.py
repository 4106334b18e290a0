"""Planar rigid motions: twists `(vx, vy, omega)` and wrenches `(fx, fy, tau)` moved between points and frames.

All functions broadcast over leading axes; the last axis has length 3 (or 2 for points). SI units.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike


def twist_at(twist: ArrayLike, offset: ArrayLike) -> np.ndarray:
    """Return the twist at the point displaced by `offset` [m] from the reference point.

    `vx' = vx - omega dy`, `vy' = vy + omega dx`, `omega' = omega`; shapes `[..., 3]` and `[..., 2]`.
    """
    twist = np.asarray(twist, dtype=float)
    offset = np.asarray(offset, dtype=float)
    omega = twist[..., 2]
    vx = twist[..., 0] - omega * offset[..., 1]
    vy = twist[..., 1] + omega * offset[..., 0]
    return np.stack(np.broadcast_arrays(vx, vy, omega), -1)


def wrench_at(wrench: ArrayLike, offset: ArrayLike) -> np.ndarray:
    """Return the wrench about the point displaced by `offset` [m] from the reference point.

    `tau' = tau - (dx fy - dy fx)`; the forces do not change. `wrench . twist` is the same at every point.
    """
    wrench = np.asarray(wrench, dtype=float)
    offset = np.asarray(offset, dtype=float)
    fx = wrench[..., 0]
    fy = wrench[..., 1]
    return np.stack(
        np.broadcast_arrays(
            fx, fy, wrench[..., 2] - (offset[..., 0] * fy - offset[..., 1] * fx)
        ),
        -1,
    )


def transformed(matrix: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """Return `matrix @ v` for each v in `vectors` `[..., 3]`, rounded in the same way for one vector as for many.

    Only products and sums of single numbers are rounded in the same way everywhere; the rounding of BLAS depends on the
    number of rows and on the processor.
    """
    x, y, z = (vectors[..., i, None] for i in range(3))
    return np.ascontiguousarray(x * matrix[:, 0] + y * matrix[:, 1] + z * matrix[:, 2])


def rotate(vector: ArrayLike, angle: ArrayLike) -> np.ndarray:
    """Rotate the first two components of a twist, wrench or point by `angle` [rad], counter-clockwise."""
    vector = np.asarray(vector, dtype=float)
    angle = np.asarray(angle, dtype=float)
    c = np.cos(angle)
    s = np.sin(angle)
    x = vector[..., 0]
    y = vector[..., 1]
    turned = np.broadcast_arrays(
        c * x - s * y,
        s * x + c * y,
        *(vector[..., i] for i in range(2, vector.shape[-1])),
    )
    return np.stack(turned, -1)


def chord(twist: ArrayLike, dt: ArrayLike) -> np.ndarray:
    """Return the mean over `dt` [s] of the twist of a point whose body keeps its twist in its own axes, `[..., 3]`.

    The point runs along an arc, `v dt` along its tangent; `vx' = a vx - b vy`, `vy' = b vx + a vy` is along its chord,
    with `a = sin(q)/q`, `b = (1 - cos(q))/q`, `q = omega dt`. For a point at p about the centre of a turntable it is
    `(R(q) - I) p/dt` instead of `omega x p`.
    """
    twist = np.asarray(twist, dtype=float)
    half = 0.5 * np.asarray(dt, dtype=float) * twist[..., 2]
    a = np.sinc(2.0 * half / np.pi)
    b = half * np.sinc(half / np.pi) ** 2
    vx = twist[..., 0]
    vy = twist[..., 1]
    return np.stack(
        np.broadcast_arrays(a * vx - b * vy, b * vx + a * vy, twist[..., 2]), -1
    )
