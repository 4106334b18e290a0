"""The step of the reduced model, per unit normal load and about the contact frame's origin."""

from __future__ import annotations

import math

from planarfriction import formulas
from planarfriction.kernels import compiled_math as xp
from planarfriction.kernels import inlined, jit
from planarfriction.kernels.law import LAW, law_of
from planarfriction.kernels.reduced import closure, evaluate, linearise, part_rate, wrench
from planarfriction.kernels.steady import sliding


@inlined
def advance(law, z, held, shape, dt, out):
    """Advance the moments by `dt` at a held twist (see `sliding`) and return the wrench at the end.

    With beta held the equation is linear, its matrix `lambda I + m (x) z_ss/|z_ss|^2`, and this is its exponential: of
    s with the rate `mu = lambda cos^2(V_G, z_ss)` and of the rest with lambda. Plain LuGre is exact; elasto-plastic
    moments take the mean of beta at the start and at an end predicted by an implicit Euler step, which is second order.
    """
    x, y, s, v, qx, qy, qs, even = held
    zx, zy, zs = z[0], z[1], z[2]
    per_q2 = 1.0 / (qx * qx + qy * qy + qs * qs)
    power = x * qx + y * qy + s * qs
    moves = power > 0.0
    safe = xp.where(moves, power, 1.0)
    decay = v * v / safe
    slow = power * per_q2
    mx, my, ms = x - decay * qx, y - decay * qy, s - decay * qs
    share = (zx * qx + zy * qy + zs * qs) * per_q2
    size = math.sqrt((zx * zx + zy * zy + zs * zs) * per_q2)
    start = closure(law, size, share, even)
    per = 1.0 / (1.0 + start * decay * dt)
    pull = dt * start * (share + slow * dt) / (1.0 + start * slow * dt)
    px, py, ps = zx + dt * x - pull * mx, zy + dt * y - pull * my, zs + dt * s - pull * ms
    predicted = per * math.sqrt((px * px + py * py + ps * ps) * per_q2)
    end = closure(law, predicted, (share + slow * dt) / (1.0 + start * slow * dt), even)
    beta = formulas.mean_decay(start, end, decay * dt)
    rate = beta * decay * dt
    slow_rate = beta * slow * dt
    left_slow, mean_slow = formulas.relaxation(xp, slow_rate)
    left_gap, mean_gap = formulas.relaxation(xp, rate - slow_rate)
    left = left_slow * left_gap
    mean = (slow_rate * mean_slow + (rate - slow_rate) * mean_gap * left_slow) / xp.where(rate > 0.0, rate, 1.0)
    along = xp.where(rate > 0.0, mean, 1.0) * decay * dt
    across = (1.0 - beta * share) * dt * left_slow * mean_gap
    nx = left * zx + along * qx + across * mx
    ny = left * zy + along * qy + across * my
    ns = left * zs + along * qs + across * ms
    new = math.sqrt((nx * nx + ny * ny + ns * ns) * per_q2)
    back = formulas.cap(xp, new, formulas.reachable_deflection(xp, size, law))
    back = xp.where(moves, back, 1.0)
    share = (nx * qx + ny * qy + ns * qs) * per_q2 * back
    beta = closure(law, new * back, share, even)
    nx, ny, ns = nx * back, ny * back, ns * back
    out[0], out[1], out[2] = nx, ny, ns
    dx, dy = part_rate(beta, share, decay, nx, x, qx), part_rate(beta, share, decay, ny, y, qy)
    return wrench(law, shape, nx, ny, ns, dx, dy, part_rate(beta, share, decay, ns, s, qs), x, y, s)


@inlined
def step(law, z, vx, vy, omega, shape, surface, data, dt, out):
    """`advance` from a twist."""
    return advance(law, z, sliding(law, vx, vy, omega, shape, surface, data), shape, dt, out)


@jit
def evaluate_batch(law_row, shape, surface, data, z, twist, zdot, wrench):
    """`evaluate` for a batch: all [B, 3], the wrench per unit load."""
    law = law_of(law_row)
    for b in range(z.shape[0]):
        wrench[b, 0], wrench[b, 1], wrench[b, 2] = evaluate(
            law, z[b], twist[b, 0], twist[b, 1], twist[b, 2], shape, surface, data, zdot[b]
        )


@jit
def linearise_batch(law_row, shape, surface, data, z, twist, lin):
    """`linearise` for a batch: `z`, `twist` [B, 3], `lin` [B, LINEAR]."""
    law = law_of(law_row)
    for b in range(z.shape[0]):
        linearise(law, z[b], twist[b, 0], twist[b, 1], twist[b, 2], shape, surface, data, lin[b])


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

    `numbers` holds law and shape (7); its map begins `data`.
    """
    finite = xp.is_finite(vx) and xp.is_finite(vy) and xp.is_finite(omega) and xp.is_finite(load) and xp.is_finite(dt)
    finite = finite and xp.is_finite(z[0]) and xp.is_finite(z[1]) and xp.is_finite(z[2])
    if not (finite and load > 0.0 and dt >= 0.0):
        return False
    wrench = step(law_of(numbers), z, vx, vy, omega, numbers[LAW:], (0, 0), data, dt, result)
    result[3], result[4], result[5] = load * wrench[0], load * wrench[1], load * wrench[2]
    return True


@jit
def step_sequence(law_row, shape, surface, data, z, twist, load, dt, wrench):
    """`step` through the twists [T, 3] of one contact, `z` in place, wrenches into `wrench` [T, 3].

    The steady state of the next twist is read before this one's step, which waits for the last one's state: the
    processor does both at once.
    """
    law, last = law_of(law_row), twist.shape[0] - 1
    if last < 0:
        return
    held = sliding(law, twist[0, 0], twist[0, 1], twist[0, 2], shape, surface, data)
    for t in range(last + 1):
        n = min(t + 1, last)
        following = sliding(law, twist[n, 0], twist[n, 1], twist[n, 2], shape, surface, data)
        fx, fy, tau = advance(law, z, held, shape, dt, z)
        wrench[t, 0], wrench[t, 1], wrench[t, 2] = load * fx, load * fy, load * tau
        held = following
