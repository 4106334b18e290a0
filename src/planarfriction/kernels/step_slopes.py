"""A step of one contact with the slope of its wrench, called by its address: one function for each kind of model.

All have the arguments `(contact, z, V, dt, new, out)`: the address of the contact's record (that which the solver calls
its `contacts.ModelFunctions` with), addresses of doubles, and the number `dt`. They write the new state to `new` and to
`out` [12] the wrench at the end of the step and its slopes dW/dV row by row, per unit load.
"""

from __future__ import annotations

import math

from planarfriction.compiler import compiled_math as xp
from planarfriction.compiler import entry, kernel
from planarfriction.compiler.memory import at, doubles, floats
from planarfriction.kernels import (
    cells,
    published_contact,
    published_step,
    reduced_contact,
    reduced_step,
)
from planarfriction.kernels.distributed_step import cell_slopes
from planarfriction.kernels.law import grip, grip_slope, squared
from planarfriction.kernels.rollouts import Contact
from planarfriction.kernels.vectors import dot, norm, plus, put, three, times

WORDS = "pppfpp"
"""Arguments of these functions (see `calls.address_of`)."""

NUMBERS = 12
"""Numbers of `out`."""

# ---------------------------------------------------------------------- models of three states


@kernel
def _pull_rows(pull_back, contact, step, slopes, out):
    """Write the wrench of a step, and its slopes row by row."""
    put(out, step.wrench)
    for i in range(3):
        unit = (1.0 if i == 0 else 0.0), (1.0 if i == 1 else 0.0), (1.0 if i == 2 else 0.0)
        by_twist = pull_back(contact, step, slopes, (0.0, 0.0, 0.0), unit).twist
        out[3 + 3 * i], out[4 + 3 * i], out[5 + 3 * i] = by_twist


@entry
def reduced(contact, z, v, dt, new, out):
    """Step a contact of `ReducedModel`, or one of its parts."""
    own, out = reduced_contact.read(contact), doubles(out)
    contact = Contact(own.law, own.shape, (0, own.other, 0), floats(own.data))
    held, slopes = reduced_step.hold_slopes(contact, three(doubles(v)), out)
    step = reduced_step.taped_step(contact, held, three(doubles(z)), dt)
    put(doubles(new), step.new)
    _pull_rows(reduced_step.pull_back, contact, step, slopes, out)


@kernel
def _jacobian(hold_slopes, taped_step, pull_back, contact, z, v, dt, out):
    """Write derivatives of new state and wrench per unit load, by state, twist and load, to `out` [6, 7]."""
    held, slopes = hold_slopes(contact, three(doubles(v)), out)
    step = taped_step(contact, held, three(doubles(z)), dt)
    for i in range(6):
        unit = (1.0 if i % 3 == 0 else 0.0), (1.0 if i % 3 == 1 else 0.0), (1.0 if i % 3 == 2 else 0.0)
        of_state, of_wrench = times(1.0 if i < 3 else 0.0, unit), times(0.0 if i < 3 else 1.0, unit)
        bar = pull_back(contact, step, slopes, of_state, of_wrench)
        out[7 * i], out[7 * i + 1], out[7 * i + 2] = bar.state
        out[7 * i + 3], out[7 * i + 4], out[7 * i + 5] = bar.twist
        out[7 * i + 6] = dot(of_wrench, step.wrench)


@entry
def reduced_jacobian(contact, z, v, dt, out):
    """Write the `_jacobian` of a contact of `ReducedModel`, or of one of its parts."""
    own = reduced_contact.read(contact)
    contact = Contact(own.law, own.shape, (0, own.other, 0), floats(own.data))
    hold_slopes, taped_step, pull_back = reduced_step.hold_slopes, reduced_step.taped_step, reduced_step.pull_back
    _jacobian(hold_slopes, taped_step, pull_back, contact, z, v, dt, doubles(out))


@entry
def published_jacobian(contact, z, v, dt, out):
    """Write the `_jacobian` of a contact of `ReducedModelPublished`, no point, in the axes of its friction metric."""
    own = published_contact.read(contact)
    contact = Contact(own.law, own.shape, (own.kind, 0, own.size), doubles(own.data))
    hold_slopes, taped_step, pull_back = published_step.hold_slopes, published_step.taped_step, published_step.pull_back
    _jacobian(hold_slopes, taped_step, pull_back, contact, z, v, dt, doubles(out))


@entry
def published(contact, z, v, dt, new, out):
    """Step a contact of `ReducedModelPublished`; a point slides as a patch of any size that does not spin."""
    own, given, v, moved, out = published_contact.read(contact), doubles(z), doubles(v), doubles(new), doubles(out)
    (cx, cy, r, second_moment), root = own.shape, own.root
    spins = 1.0 if r > 0.0 else 0.0
    shape = published_contact.Shape(0.0, 0.0, r + 1.0 - spins, spins * second_moment)
    contact = Contact(own.law, shape, (own.kind, 0, own.size), doubles(own.data))
    twist = root.xx * v[0] + root.xy * v[1] - cy * v[2], root.xy * v[0] + root.yy * v[1] + cx * v[2], spins * v[2]
    held, slopes = published_step.hold_slopes(contact, twist, out)
    step = published_step.taped_step(contact, held, (given[0], given[1], spins * given[2]), dt)
    moved[0], moved[1] = step.new[0], step.new[1]
    moved[2] = step.new[2] if r > 0.0 else given[2]
    _pull_rows(published_step.pull_back, contact, step, slopes, out)
    # through the same map T as the twist: T' w and T' P T, columns first
    for i in range(4):
        x, y, s = out[3 * i], out[3 * i + 1], out[3 * i + 2]
        out[3 * i] = root.xx * x + root.xy * y
        out[3 * i + 1] = root.xy * x + root.yy * y
        out[3 * i + 2] = cx * y - cy * x + spins * s
    for i in range(3):
        x, y, s = out[3 + i], out[6 + i], out[9 + i]
        out[3 + i] = root.xx * x + root.xy * y
        out[6 + i] = root.xy * x + root.yy * y
        out[9 + i] = cx * y - cy * x + spins * s


# ---------------------------------------------------------------------- the distributed model


@kernel
def _distributed(law, own, z, v, dt, new, out):
    n, x, y, weights = own.count, own.cells, at(own.cells, own.count), own.weights
    vx, vy, omega = v[0], v[1], v[2]
    fx, fy, tau = 0.0, 0.0, 0.0
    xx, xy, xt, yx, yy, yt, tx, ty, tt = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(n):
        px, py, w = x[i], y[i], weights[i]
        cell = cell_slopes(law, (z[i], z[n + i]), (vx - omega * py, vy + omega * px), dt)
        new[i], new[n + i] = cell.new
        ax, ay = times(w, cell.traction)
        fx += ax
        fy += ay
        tau += px * ay - py * ax
        axx, axy, ayx, ayy = times(w, cell.traction_u)
        axt, ayt = px * axy - py * axx, px * ayy - py * ayx
        xx += axx
        xy += axy
        xt += axt
        yx += ayx
        yy += ayy
        yt += ayt
        tx += px * ayx - py * axx
        ty += px * ayy - py * axy
        tt += px * ayt - py * axt
    out[0], out[1], out[2] = fx, fy, tau
    out[3], out[4], out[5] = xx, xy, xt
    out[6], out[7], out[8] = yx, yy, yt
    out[9], out[10], out[11] = tx, ty, tt


@entry
def distributed(contact, z, v, dt, new, out):
    """Step a contact of `DistributedModel`."""
    own = cells.read(contact)
    if own.law.gamma == 2.0:
        _distributed(squared(own.law), own, doubles(z), doubles(v), dt, doubles(new), doubles(out))
    else:
        _distributed(own.law, own, doubles(z), doubles(v), dt, doubles(new), doubles(out))


@entry
def anisotropic(contact, z, v, dt, new, out):
    """Step a contact of `DistributedModel` with friction that depends on the direction (see `kernels.cells`).

    `z - c` with `c = a/q`, which the twist holds, steps as the bristle of an isotropic cell does, and the traction is
    that of one less `sigma_0 c`.
    """
    own, z, v, new, out = cells.read(contact), doubles(z), three(doubles(v)), doubles(new), doubles(out)
    n, law, numbers, weights = own.count, own.law, own.cells, own.weights
    for i in range(NUMBERS):
        out[i] = 0.0
    for i in range(n):
        one = numbers[i], numbers[n + i], numbers[3 * n + i]
        other = numbers[n + i], numbers[2 * n + i], numbers[4 * n + i]
        a, u = (numbers[5 * n + i], numbers[6 * n + i]), (dot(one, v), dot(other, v))
        speed = norm(u)
        q = grip(law, speed)
        c = times(1.0 / q, a)
        cell = cell_slopes(law, plus((z[i], z[n + i]), -1.0, c), u, dt)
        new[i], new[n + i] = plus(cell.new, 1.0, c)
        x, y = times(weights[i], plus(cell.traction, -law.sigma_0, c))
        # c changes with the speed, and the start of the step with it
        back = grip_slope(law, speed, q) / (q * q * xp.where(speed > 0.0, speed, math.inf))
        (xx, xy, yx, yy), (zxx, zxy, zyx, zyy) = cell.traction_u, cell.traction_z
        by_x = times(weights[i], plus((xx, xy), back * (dot((zxx, zxy), a) + law.sigma_0 * a[0]), u))
        by_y = times(weights[i], plus((yx, yy), back * (dot((zyx, zyy), a) + law.sigma_0 * a[1]), u))
        across, along = plus(times(by_x[0], one), by_x[1], other), plus(times(by_y[0], one), by_y[1], other)
        for k in range(3):
            p, q = one[k], other[k]
            out[k] += p * x + q * y
            row = plus(times(p, across), q, along)
            out[3 + 3 * k] += row[0]
            out[4 + 3 * k] += row[1]
            out[5 + 3 * k] += row[2]
