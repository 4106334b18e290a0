"""The compiled reader of cube maps, for batches."""

from __future__ import annotations

from planarfriction.kernels import cube, jit


@jit
def read_batch(data, n, faces, v, values, gradients):
    """Values [B, 3] and gradients [B, 9] of a map of one level and three components."""
    for b in range(v.shape[0]):
        spot = cube.locate(v[b, 0], v[b, 1], v[b, 2], faces)
        q, q_a, q_b = cube.squares(spot, n)
        for m in range(3):
            values[b, m] = spot.sign * cube.read(data, 0, n, 3, m, q)
            by_a, by_b = cube.read(data, 0, n, 3, m, q_a), cube.read(data, 0, n, 3, m, q_b)
            slopes = cube.gradient(spot, by_a, by_b)
            gradients[b, 3 * m], gradients[b, 3 * m + 1], gradients[b, 3 * m + 2] = slopes
