"""The compiled reader of cube maps, for batches."""

from __future__ import annotations

from planarfriction.compiler import jit
from planarfriction.kernels import cube


@jit
def read_batch(data, n, faces, v, values, gradients):
    """Values [B, 3] and gradients [B, 9] of a map of one level and three components."""
    for b in range(v.shape[0]):
        spot = cube.locate(v[b, 0], v[b, 1], v[b, 2], float(faces))
        q = cube.square(spot, float(n))
        value, by_a, by_b = cube.read(data, float(n), cube.Square(cube.NODE * q.at, q.u, q.v))
        for m in range(3):
            values[b, m] = spot.sign * value[m]
            slopes = cube.gradient(spot, by_a[m], by_b[m])
            gradients[b, 3 * m], gradients[b, 3 * m + 1], gradients[b, 3 * m + 2] = slopes
