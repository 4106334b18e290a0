"""The step of the published reduced model, per unit normal load and about the contact frame's origin."""

from __future__ import annotations

import math

from planarfriction import formulas
from planarfriction.kernels import compiled_math as xp
from planarfriction.kernels import inlined, jit
from planarfriction.kernels.law import LAW, grip, law_of
from planarfriction.kernels.published import scaled_twist, wrench
from planarfriction.kernels.surfaces import sliding


@inlined
def step(law, z, vx, vy, omega, shape, surface, data, dt, out):
    """Advance the bristle by `dt` at a held twist (see `formulas.relaxation`) and return the wrench at the end."""
    x, y, s = scaled_twist(shape, vx, vy, omega)
    r = shape[2]
    v_n = math.sqrt(x * x + y * y + s * s)
    ux, uy, us = sliding(surface[0], data, surface[1], surface[2], x, y, s, v_n)
    zx, zy, zs = z[0], z[1], z[2] / r
    u_norm = math.sqrt(ux * ux + uy * uy + us * us)
    h_norm = u_norm / v_n if v_n > 0.0 else 1.0
    per_h = 1.0 / h_norm
    q = grip(law, v_n)
    to_deflection = q * per_h
    z_norm = math.sqrt(zx * zx + zy * zy + zs * zs)
    along = per_h * (zx * ux + zy * uy + zs * us) / xp.where(z_norm > 0.0, z_norm, 1.0)
    start = formulas.bristle_decay(xp, z_norm * to_deflection, along, v_n, q, law)
    px, py, ps = zx + ux * dt, zy + uy * dt, zs + us * dt  # times 1/(1 + k dt), which leaves the direction
    p_norm = math.sqrt(px * px + py * py + ps * ps)
    along = per_h * (px * ux + py * uy + ps * us) / xp.where(p_norm > 0.0, p_norm, 1.0)
    deflection = xp.minimum(p_norm * to_deflection / (1.0 + start * dt), xp.maximum(z_norm * to_deflection, 1.0))
    end = formulas.bristle_decay(xp, deflection, along, v_n, q, law)
    left, mean = formulas.relaxation(xp, formulas.mean_decay(start, end, dt) * dt)
    nx, ny, ns = zx * left + ux * dt * mean, zy * left + uy * dt * mean, zs * left + us * dt * mean
    n_norm = math.sqrt(nx * nx + ny * ny + ns * ns)
    along = per_h * (nx * ux + ny * uy + ns * us) / xp.where(n_norm > 0.0, n_norm, 1.0)
    largest = formulas.reachable_deflection(xp, z_norm * to_deflection, law)
    back = formulas.cap(xp, n_norm * to_deflection, largest)
    nx, ny, ns = nx * back, ny * back, ns * back
    k = formulas.bristle_decay(xp, n_norm * back * to_deflection, along, v_n, q, law)
    out[0], out[1], out[2] = nx, ny, r * ns
    return wrench(law, shape, nx, ny, r * ns, ux - k * nx, uy - k * ny, r * (us - k * ns), x, y, omega)


@jit
def step_batch(law_row, shape, surface, data, z, twist, load, dt, out, wrench):
    """`step` for a batch: `z`, `twist`, `out`, `wrench` [B, 3], `load`, `dt` [B]; without load z is forgotten."""
    law = law_of(law_row)
    for b in range(z.shape[0]):
        fx, fy, tau = step(law, z[b], twist[b, 0], twist[b, 1], twist[b, 2], shape, surface, data, dt[b], out[b])
        wrench[b, 0], wrench[b, 1], wrench[b, 2] = load[b] * fx, load[b] * fy, load[b] * tau
        if load[b] == 0.0:
            out[b] = 0.0
            wrench[b] = 0.0


@jit
def step_one(numbers, data, z, vx, vy, omega, load, dt, result):
    """`step` of one contact for callers in Python: new state and wrench into `result` [6]; false for invalid inputs.

    `numbers` holds law, shape (4) and surface (3): every argument costs a quarter of a microsecond on the way in.
    """
    finite = xp.is_finite(vx) and xp.is_finite(vy) and xp.is_finite(omega) and xp.is_finite(load) and xp.is_finite(dt)
    finite = finite and xp.is_finite(z[0]) and xp.is_finite(z[1]) and xp.is_finite(z[2])
    if not (finite and load > 0.0 and dt >= 0.0):
        return False
    surface = (int(numbers[LAW + 4]), int(numbers[LAW + 5]), int(numbers[LAW + 6]))
    wrench = step(law_of(numbers), z, vx, vy, omega, numbers[LAW:], surface, data, dt, result)
    result[3], result[4], result[5] = load * wrench[0], load * wrench[1], load * wrench[2]
    return True


@jit
def step_sequence(law_row, shape, surface, data, z, twist, load, dt, wrench):
    """`step` through the twists [T, 3] of one contact, `z` in place, wrenches into `wrench` [T, 3]."""
    law = law_of(law_row)
    for t in range(twist.shape[0]):
        fx, fy, tau = step(law, z, twist[t, 0], twist[t, 1], twist[t, 2], shape, surface, data, dt, z)
        wrench[t, 0], wrench[t, 1], wrench[t, 2] = load * fx, load * fy, load * tau
