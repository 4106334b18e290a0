"""Steady sliding of a patch from a stored map, in scaled coordinates `V_G = F V` (see `kernels.reduced`).

A map is eight numbers (faces, n, n of the Stribeck part, its levels, knee, least dissipation, 0, 0), the matrix K
[6, 6] of `<v^4> = m' K m` with `m = (x^2, y^2, s^2, x y, x s, y s)` of V_G, then two maps of `kernels.cube`: `h_0`,
steady sliding at `g = 1`, and the rest r of that at `g = e = exp(-|v/v_s|^gamma)`,

    sigma_0 z_ss = (mu_s - (mu_s - mu_c) t) h_0 + (mu_s - mu_c) r(t),   t = |V_G| / (|V_G| + knee v_s)
"""

from __future__ import annotations

import math

from planarfriction import formulas
from planarfriction.kernels import compiled_math as xp
from planarfriction.kernels import cube, inlined, kernel

QUARTIC = 8
"""Where K begins."""

FAR = 1e30
"""Steady state [m] of a patch at rest, where it has none: no bristle comes near it, so that nothing decays."""

HEADER = QUARTIC + 36
"""Numbers in front of a map."""


@inlined
def scaled_twist(shape, vx, vy, omega):
    """`V_G = F V`."""
    return shape[0] * vx + shape[1] * vy + shape[2] * omega, shape[3] * vy + shape[4] * omega, shape[5] * omega


@kernel
def _sliding(law, data, start, x, y, s, v):
    """`sigma_0 z_ss` of one map, and its least dissipation."""
    n, m, count, knee = int(data[start + 1]), int(data[start + 2]), int(data[start + 3]), data[start + 4]
    faces = int(data[start])
    spot = cube.locate(x, y, s, faces)
    t = v / (v + knee * law.v_s)
    drop = law.mu_s - law.mu_c
    outer = (law.mu_s - drop * t) * spot.sign
    inner = drop * spot.sign
    first = start + HEADER
    second = first + faces * (2 * n + 1) * (2 * n + 1) * 12
    p, q = cube.square(spot, n), cube.square(spot, m)
    level, w = cube.levels(t, count)
    return (
        outer * cube.read(data, first, n, 3, 0, p) + inner * cube.read_level(data, second, m, 3, count, 0, q, level, w),
        outer * cube.read(data, first, n, 3, 1, p) + inner * cube.read_level(data, second, m, 3, count, 1, q, level, w),
        outer * cube.read(data, first, n, 3, 2, p) + inner * cube.read_level(data, second, m, 3, count, 2, q, level, w),
        data[start + 5],
    )


@inlined
def steady(law, shape, surface, data, x, y, s, v):
    """`z_ss` [m] at the scaled twist, which moves at `v > 0`; its dissipation is never below the least."""
    qx, qy, qs, least = 0.0, 0.0, 0.0, 0.0
    for i in range(2 if shape[6] > 0.0 else 1):
        share = shape[6] if i == 1 else 1.0 - shape[6]
        hx, hy, hs, floor = _sliding(law, data, surface[i], x, y, s, v)
        qx, qy, qs, least = qx + share * hx, qy + share * hy, qs + share * hs, least + share * floor
    per_v = 1.0 / v
    power = (qx * x + qy * y + qs * s) * per_v
    raised = (formulas.floored(xp, power, law.mu_c * least) - power) * per_v
    per = 1.0 / law.sigma_0
    return (qx + raised * x) * per, (qy + raised * y) * per, (qs + raised * s) * per


@kernel
def _sliding_slopes(law, data, start, x, y, s, v, share, j):
    """`_sliding`; adds `share` of its slopes by the scaled twist to `j` [9], row by row; `j[9:15]` is scratch."""
    n, m, count, knee = int(data[start + 1]), int(data[start + 2]), int(data[start + 3]), data[start + 4]
    faces = int(data[start])
    spot = cube.locate(x, y, s, faces)
    per = 1.0 / (v + knee * law.v_s)
    t = v * per
    by_v = knee * law.v_s * per * per / v  # dt/dV_G = by_v V_G
    drop = law.mu_s - law.mu_c
    outer = law.mu_s - drop * t
    first = start + HEADER
    second = first + faces * (2 * n + 1) * (2 * n + 1) * 12
    p, p_a, p_b = cube.squares(spot, n)
    q, q_a, q_b = cube.squares(spot, m)
    level, w = cube.levels(t, count)
    w_t = cube.level_slopes(t, count)
    for i in range(3):
        flat, rest = cube.read(data, first, n, 3, i, p), cube.read_level(data, second, m, 3, count, i, q, level, w)
        flat_a, flat_b = cube.read(data, first, n, 3, i, p_a), cube.read(data, first, n, 3, i, p_b)
        rest_a = cube.read_level(data, second, m, 3, count, i, q_a, level, w)
        rest_b = cube.read_level(data, second, m, 3, count, i, q_b, level, w)
        by_t = drop * spot.sign * (cube.read_level(data, second, m, 3, count, i, q, level, w_t) - flat)
        cube.gradient(spot, outer * flat_a + drop * rest_a, outer * flat_b + drop * rest_b, j, 9, 1)
        j[12 + i] = spot.sign * (outer * flat + drop * rest)
        j[3 * i] += share * (j[9] + by_t * by_v * x)
        j[3 * i + 1] += share * (j[10] + by_t * by_v * y)
        j[3 * i + 2] += share * (j[11] + by_t * by_v * s)
    return j[12], j[13], j[14], data[start + 5]


@kernel
def steady_slopes(law, shape, surface, data, x, y, s, v, j):
    """`dz_ss/dV_G` [s] into `j` [9], row by row; `j[9:15]` is scratch. Returns `z_ss`."""
    for i in range(9):
        j[i] = 0.0
    qx, qy, qs, least = 0.0, 0.0, 0.0, 0.0
    for i in range(2 if shape[6] > 0.0 else 1):
        share = shape[6] if i == 1 else 1.0 - shape[6]
        hx, hy, hs, floor = _sliding_slopes(law, data, surface[i], x, y, s, v, share, j)
        qx, qy, qs, least = qx + share * hx, qy + share * hy, qs + share * hs, least + share * floor
    per_v = 1.0 / v
    nx, ny, ns = x * per_v, y * per_v, s * per_v
    power = qx * nx + qy * ny + qs * ns
    raised = formulas.floored(xp, power, law.mu_c * least) - power
    stays = 1.0 - formulas.floored_slope(xp, power, law.mu_c * least)
    per = 1.0 / law.sigma_0
    if raised != 0.0:
        for i in range(3):
            n_i = nx if i == 0 else (ny if i == 1 else ns)
            q_i = qx if i == 0 else (qy if i == 1 else qs)
            # of the power by V_G, component i
            j[9 + i] = nx * j[i] + ny * j[3 + i] + ns * j[6 + i] + (q_i - power * n_i) * per_v
        for i in range(3):
            n_i = nx if i == 0 else (ny if i == 1 else ns)
            for k in range(3):
                n_k = nx if k == 0 else (ny if k == 1 else ns)
                turn = ((1.0 if i == k else 0.0) - n_i * n_k) * per_v
                j[3 * i + k] += raised * turn - stays * n_i * j[9 + k]
    for i in range(9):
        j[i] *= per
    return (qx + raised * nx) * per, (qy + raised * ny) * per, (qs + raised * ns) * per


@kernel
def _sliding_by_law(law, data, start, x, y, s, v, share, out):
    """Adds `share` of the slopes of `_sliding` by mu_c, mu_s and v_s to `out` [9], a row each."""
    n, m, count, knee = int(data[start + 1]), int(data[start + 2]), int(data[start + 3]), data[start + 4]
    faces = int(data[start])
    spot = cube.locate(x, y, s, faces)
    per = 1.0 / (v + knee * law.v_s)
    t = v * per
    first = start + HEADER
    second = first + faces * (2 * n + 1) * (2 * n + 1) * 12
    p, q = cube.square(spot, n), cube.square(spot, m)
    level, w = cube.levels(t, count)
    w_t = cube.level_slopes(t, count)
    part, drop = share * spot.sign, law.mu_s - law.mu_c
    by_v_s = -drop * knee * t * per
    for i in range(3):
        flat, rest = cube.read(data, first, n, 3, i, p), cube.read_level(data, second, m, 3, count, i, q, level, w)
        out[i] += part * (t * flat - rest)
        out[3 + i] += part * ((1.0 - t) * flat + rest)
        out[6 + i] += part * by_v_s * (cube.read_level(data, second, m, 3, count, i, q, level, w_t) - flat)
        out[9 + i] += part * ((law.mu_s - drop * t) * flat + drop * rest)
    return data[start + 5]


@kernel
def steady_by_law(law, shape, surface, data, x, y, s, v, out):
    """Slopes of `z_ss` by mu_c, mu_s and v_s into `out` [9], a row each; `out[9:12]` is scratch."""
    for i in range(12):
        out[i] = 0.0
    least = 0.0
    for i in range(2 if shape[6] > 0.0 else 1):
        share = shape[6] if i == 1 else 1.0 - shape[6]
        least += share * _sliding_by_law(law, data, surface[i], x, y, s, v, share, out)
    per_v, per = 1.0 / v, 1.0 / law.sigma_0
    nx, ny, ns = x * per_v, y * per_v, s * per_v
    power = out[9] * nx + out[10] * ny + out[11] * ns
    stays = 1.0 - formulas.floored_slope(xp, power, law.mu_c * least)
    for i in range(3):
        raised = -stays * (out[3 * i] * nx + out[3 * i + 1] * ny + out[3 * i + 2] * ns)
        if i == 0:
            raised += formulas.floored_by_least(xp, power, law.mu_c * least) * least
        out[3 * i] = (out[3 * i] + raised * nx) * per
        out[3 * i + 1] = (out[3 * i + 1] + raised * ny) * per
        out[3 * i + 2] = (out[3 * i + 2] + raised * ns) * per


@inlined
def _fourth(data, start, m):
    """`K m`."""
    k = start + QUARTIC
    return (
        _row(data, k, m),
        _row(data, k + 6, m),
        _row(data, k + 12, m),
        _row(data, k + 18, m),
        _row(data, k + 24, m),
        _row(data, k + 30, m),
    )


@inlined
def _row(data, k, m):
    low = data[k] * m[0] + data[k + 1] * m[1] + data[k + 2] * m[2]
    return low + data[k + 3] * m[3] + data[k + 4] * m[4] + data[k + 5] * m[5]


@inlined
def _blended(one, other, share):
    return (
        one[0] + share * (other[0] - one[0]),
        one[1] + share * (other[1] - one[1]),
        one[2] + share * (other[2] - one[2]),
        one[3] + share * (other[3] - one[3]),
        one[4] + share * (other[4] - one[4]),
        one[5] + share * (other[5] - one[5]),
    )


@inlined
def evenness(shape, surface, data, x, y, s, v):
    """`<v^2>/sqrt(<v^4>)` of the cells' speeds at the scaled twist, and its slopes by that, for `v > 0`."""
    per = 1.0 / v
    x, y, s = x * per, y * per, s * per
    m = (x * x, y * y, s * s, x * y, x * s, y * s)
    k = _fourth(data, surface[0], m)
    if shape[6] > 0.0:
        k = _blended(k, _fourth(data, surface[1], m), shape[6])
    square = 1.0 / (k[0] * m[0] + k[1] * m[1] + k[2] * m[2] + k[3] * m[3] + k[4] * m[4] + k[5] * m[5])
    even = math.sqrt(square)
    c = 2.0 * even * per
    by_x = x - square * (k[0] * x + 0.5 * (k[3] * y + k[4] * s))
    by_y = y - square * (k[1] * y + 0.5 * (k[3] * x + k[5] * s))
    by_s = s - square * (k[2] * s + 0.5 * (k[4] * x + k[5] * y))
    return even, c * by_x, c * by_y, c * by_s


@inlined
def sliding(law, vx, vy, omega, shape, surface, data):
    """Scaled twist, its norm, its steady state and evenness (any where the patch is at rest): what `advance` holds."""
    x, y, s = scaled_twist(shape, vx, vy, omega)
    v = math.sqrt(x * x + y * y + s * s)
    if v > 0.0:
        qx, qy, qs = steady(law, shape, surface, data, x, y, s, v)
        even = evenness(shape, surface, data, x, y, s, v)[0] if law.elasto_plastic > 0.0 else 1.0
        return x, y, s, v, qx, qy, qs, even
    return 0.0, 0.0, 0.0, 0.0, FAR, 0.0, 0.0, 1.0
