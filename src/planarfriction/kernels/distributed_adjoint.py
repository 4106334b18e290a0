"""Derivatives of the step of the distributed model, cell by cell, per unit normal load (see `bristle_step`)."""

from __future__ import annotations

import math

from planarfriction import formulas
from planarfriction.kernels import bristle_step, inlined, jit
from planarfriction.kernels import compiled_math as xp
from planarfriction.kernels.law import law_of


@inlined
def _cell(law, zx, zy, ux, uy, dt):
    """Linearised step of a cell's bristle; one over its speed; one over its grip; and the slope of the grip."""
    v = math.sqrt(ux * ux + uy * uy)
    g, by_speed, _, _, _, _ = formulas.stribeck_partials(xp, v, law)
    q = law.sigma_0 / g
    step = bristle_step.linearise(law, zx, zy, 0.0, ux, uy, 0.0, v, 1.0, q, dt)
    return step, q, -q / g * by_speed, 1.0 / v if v > 0.0 else 0.0


@inlined
def _pull_back(cell, zx, zy, ux, uy, dt, bx, by, k_bar):
    """Cotangents of `z` and of the cell's velocity from those of the new bristle and of its decay."""
    step, q, q_slope, per_v = cell
    zx, zy, _, vx, vy, _, v_bar, _, q_bar, _ = bristle_step.pull_back(
        step, zx, zy, 0.0, ux, uy, 0.0, 1.0, q, dt, bx, by, 0.0, k_bar
    )
    along = (v_bar + q_bar * q_slope) * per_v
    return zx, zy, vx + along * ux, vy + along * uy


@jit
def jacobians(law_row, z, twist, x, y, w, load, dt, new_z, new_twist, wrench_z, wrench_twist, wrench_load):
    """Derivatives of a step for a batch: `z` [B, 2, n], `twist` [B, 3], `w` [B or 1, n], `load`, `dt` [B].

    Of the new bristles to the old `new_z` [B, 2, 2, n] and to the twist `new_twist` [B, 2, n, 3]; of the wrench
    `wrench_z` [B, 3, 2, n], `wrench_twist` [B, 3, 3] and `wrench_load` [B, 3]. All come in as zeros.
    """
    law = law_of(law_row)
    for b in range(z.shape[0]):
        weights = w[min(b, w.shape[0] - 1)]
        for m in range(x.shape[0]):
            zx, zy, px, py = z[b, 0, m], z[b, 1, m], x[m], y[m]
            ux, uy = twist[b, 0] - twist[b, 2] * py, twist[b, 1] + twist[b, 2] * px
            cell = _cell(law, zx, zy, ux, uy, dt[b])
            step = cell[0]
            fx = weights[m] * formulas.traction(step.nx, ux - step.k * step.nx, ux, law)
            fy = weights[m] * formulas.traction(step.ny, uy - step.k * step.ny, uy, law)
            wrench_load[b, 0] += fx
            wrench_load[b, 1] += fy
            wrench_load[b, 2] += px * fy - py * fx
            if load[b] == 0.0:
                continue
            share = load[b] * weights[m]
            pull = share * (law.sigma_0 - law.sigma_1 * step.k)
            for i in range(2):
                one, other = (1.0, 0.0) if i == 0 else (0.0, 1.0)
                ax, ay, bx, by = _pull_back(cell, zx, zy, ux, uy, dt[b], one, other, 0.0)
                new_z[b, i, 0, m], new_z[b, i, 1, m] = ax, ay
                new_twist[b, i, m, 0], new_twist[b, i, m, 1], new_twist[b, i, m, 2] = bx, by, px * by - py * bx
                # the force of the cell, -(sigma_0 n + sigma_1 (u - k n) + sigma_2 u)
                k_bar = share * law.sigma_1 * (step.nx if i == 0 else step.ny)
                ax, ay, bx, by = _pull_back(cell, zx, zy, ux, uy, dt[b], -pull * one, -pull * other, k_bar)
                bx -= share * (law.sigma_1 + law.sigma_2) * one
                by -= share * (law.sigma_1 + law.sigma_2) * other
                lever = -py if i == 0 else px
                wrench_z[b, i, 0, m], wrench_z[b, i, 1, m] = ax, ay
                wrench_z[b, 2, 0, m] += lever * ax
                wrench_z[b, 2, 1, m] += lever * ay
                turn = px * by - py * bx
                wrench_twist[b, i, 0] += bx
                wrench_twist[b, i, 1] += by
                wrench_twist[b, i, 2] += turn
                wrench_twist[b, 2, 0] += lever * bx
                wrench_twist[b, 2, 1] += lever * by
                wrench_twist[b, 2, 2] += lever * turn
