"""The step of the distributed model, per unit normal load and about the contact frame's origin."""

from __future__ import annotations

import math

from planarfriction import formulas
from planarfriction.kernels import compiled_math as xp
from planarfriction.kernels import inlined, jit, kernel
from planarfriction.kernels.law import grip, squared


@inlined
def _step(law, z, vx, vy, omega, x, y, w, dt, out):
    n = x.shape[0]
    zx, zy, ox, oy = z[:n], z[n:], out[:n], out[n:]
    fx, fy, tau = 0.0, 0.0, 0.0
    for i in range(n):  # predicted end, and the mean decay into ox
        ux, uy = vx - omega * y[i], vy + omega * x[i]
        speed = math.sqrt(ux * ux + uy * uy)
        q = grip(law, speed)
        z_norm = math.sqrt(zx[i] * zx[i] + zy[i] * zy[i])
        along = (zx[i] * ux + zy[i] * uy) / xp.where(z_norm > 0.0, z_norm, 1.0)
        start = formulas.bristle_decay(xp, z_norm * q, along, speed, q, law)
        px, py = zx[i] + ux * dt, zy[i] + uy * dt  # times 1/(1 + k dt), which leaves the direction
        p_norm = math.sqrt(px * px + py * py)
        along = (px * ux + py * uy) / xp.where(p_norm > 0.0, p_norm, 1.0)
        deflection = xp.minimum(p_norm * q / (1.0 + start * dt), xp.maximum(z_norm * q, 1.0))
        end = formulas.bristle_decay(xp, deflection, along, speed, q, law)
        ox[i] = formulas.mean_decay(start, end, dt)
    for i in range(n):
        ux, uy = vx - omega * y[i], vy + omega * x[i]
        left, mean = formulas.relaxation(xp, ox[i] * dt)
        ox[i] = zx[i] * left + ux * dt * mean
        oy[i] = zy[i] * left + uy * dt * mean
    for i in range(n):
        ux, uy = vx - omega * y[i], vy + omega * x[i]
        speed = math.sqrt(ux * ux + uy * uy)
        q = grip(law, speed)
        largest = formulas.reachable_deflection(xp, math.sqrt(zx[i] * zx[i] + zy[i] * zy[i]) * q, law)
        norm = math.sqrt(ox[i] * ox[i] + oy[i] * oy[i])
        along = (ox[i] * ux + oy[i] * uy) / xp.where(norm > 0.0, norm, 1.0)
        back = formulas.cap(xp, norm * q, largest)
        nx, ny = ox[i] * back, oy[i] * back
        k = formulas.bristle_decay(xp, norm * q * back, along, speed, q, law)
        ox[i], oy[i] = nx, ny
        tx = w[i] * formulas.traction(nx, ux - k * nx, ux, law)
        ty = w[i] * formulas.traction(ny, uy - k * ny, uy, law)
        fx += tx
        fy += ty
        tau += x[i] * ty - y[i] * tx
    return fx, fy, tau


@kernel
def step(law, z, vx, vy, omega, x, y, w, dt, out):
    """Advance the bristles by `dt` at a held twist (see `formulas.relaxation`) and return the wrench at the end."""
    if law.gamma == 2.0:
        return _step(squared(law), z, vx, vy, omega, x, y, w, dt, out)
    return _step(law, z, vx, vy, omega, x, y, w, dt, out)


@jit
def step_batch(law, z, twist, x, y, w, load, dt, out, wrench):
    """`step` for a batch: `z`, `out` [B, 2n], `twist`, `wrench` [B, 3], `w` [B or 1, n], `load`, `dt` [B].

    Without load the bristles are forgotten.
    """
    for b in range(z.shape[0]):
        fx, fy, tau = step(
            law, z[b], twist[b, 0], twist[b, 1], twist[b, 2], x, y, w[min(b, w.shape[0] - 1)], dt[b], out[b]
        )
        wrench[b, 0], wrench[b, 1], wrench[b, 2] = load[b] * fx, load[b] * fy, load[b] * tau
        if load[b] == 0.0:
            out[b] = 0.0
            wrench[b] = 0.0


@jit
def step_sequence(law, z, twist, x, y, w, load, dt, out, wrench):
    """`step` through the twists [T, 3] of one contact, `z` in place (`out`: scratch), wrenches into `wrench` [T, 3]."""
    n = z.shape[0]
    for t in range(twist.shape[0]):
        fx, fy, tau = step(law, z, twist[t, 0], twist[t, 1], twist[t, 2], x, y, w, dt, out)
        wrench[t, 0], wrench[t, 1], wrench[t, 2] = load * fx, load * fy, load * tau
        for i in range(n):
            z[i] = out[i]
