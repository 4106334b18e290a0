"""A planar body on its contacts: right-hand side, linearisation, and the solve that costs no more than either.

State vector: bristles of every contact, body velocity `u = (vx, vy, omega)`, pose `(x, y, theta)`. Bristles of different
cells do not see each other, they meet in the body's three accelerations: `(shift I - J) k = r` is solved by eliminating
the bristles contact by contact, which leaves a 6 x 6 system for the body. Loads and forces are linear in time on a piece.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from planarfriction.kernels import contacts as ct
from planarfriction.kernels import jit, kernel


class Motion(NamedTuple):
    """A planar body and its inputs on the S pieces between breaks, each linear in the time since the piece began."""

    inverse_mass: np.ndarray
    """1/m, 1/m, 1/I; zeros where the velocity is prescribed, [3]."""
    body_axes: bool
    """The velocity is prescribed, in body axes."""
    breaks: np.ndarray
    """Times [S + 1]."""
    load: np.ndarray
    """Normal force per contact, at the start of the piece and its slope, [S, 2, C]."""
    force: np.ndarray
    """Applied force and torque at the centre of mass, start and slope, [S, 2, 3]."""
    velocity: np.ndarray
    """Prescribed velocity at the start of each piece, [S, 3]; empty [0, 3] for a free body."""
    acceleration: np.ndarray
    """Gravity, or the slope of the prescribed velocity, [S, 3]."""
    row: np.ndarray
    """Shape of each contact on each piece, int [S, C]."""
    stop_speed: float
    """End when the body's speed and its change within the bristles' time are below this [m/s]; 0: never."""
    stop_radius: float
    """Lever arm that turns spin into speed for that test [m]."""
    stop_time: float
    """The bristles' time, sigma_1/sigma_0 [s]."""


class Work(NamedTuple):
    """Workspace of the linear algebra for C contacts."""

    linear: np.ndarray
    """Linearisations of the contacts, flat."""
    maps: np.ndarray
    """`A`, `G`, `H` of each contact (see `kernels.contacts`), [C, 3, 3, 3]."""
    wrench: np.ndarray
    """Wrench of each contact per unit load, [C, 3]."""
    twist: np.ndarray
    """Twist of one contact, [3]."""
    stiffness: np.ndarray
    """d wrench / d twist of one contact, [3, 3]."""
    matrix: np.ndarray
    """Factors of the body's matrix, [6, 6]."""
    pivot: np.ndarray
    """Its row exchanges, [6]."""
    right: np.ndarray
    """Its right-hand side, [6]."""


@jit
def workspace(contacts):
    """Workspace for a set of contacts."""
    n = contacts.kind.shape[0]
    return Work(
        np.empty(contacts.linear[n]),
        np.zeros((n, 3, 3, 3)),
        np.zeros((n, 3)),
        np.zeros(3),
        np.zeros((3, 3)),
        np.zeros((6, 6)),
        np.zeros(6, np.int64),
        np.zeros(6),
    )


@kernel
def _contact_twist(a, u, v):
    for i in range(3):
        v[i] = a[i, 0] * u[0] + a[i, 1] * u[1] + a[i, 2] * u[2]


@kernel
def rates(contacts, motion, piece, since, y, dy, work):
    """Right-hand side `dy` at `since` seconds into a piece; wrenches per unit load into `work.wrench`."""
    o = y.shape[0] - 6
    u, pose = y[o : o + 3], y[o + 3 :]
    v, w, a = work.twist, work.wrench, work.stiffness
    fx, fy, tau = 0.0, 0.0, 0.0
    for c in range(contacts.kind.shape[0]):
        first, last = contacts.state[c], contacts.state[c + 1]
        ct.contact_map(contacts.mount[c], contacts.place[c], pose, a)
        _contact_twist(a, u, v)
        ct.evaluate(contacts, c, motion.row[piece, c], y[first:last], v, dy[first:last], w[c])
        load = contacts.count[c] * (motion.load[piece, 0, c] + since * motion.load[piece, 1, c])
        fx += load * (a[0, 0] * w[c, 0] + a[1, 0] * w[c, 1])
        fy += load * (a[0, 1] * w[c, 0] + a[1, 1] * w[c, 1])
        tau += load * (a[0, 2] * w[c, 0] + a[1, 2] * w[c, 1] + w[c, 2])
    force = motion.force[piece]
    gravity = motion.acceleration[piece]
    dy[o] = gravity[0] + motion.inverse_mass[0] * (force[0, 0] + since * force[1, 0] + fx)
    dy[o + 1] = gravity[1] + motion.inverse_mass[1] * (force[0, 1] + since * force[1, 1] + fy)
    dy[o + 2] = gravity[2] + motion.inverse_mass[2] * (force[0, 2] + since * force[1, 2] + tau)
    if motion.body_axes:
        cos, sin = math.cos(pose[2]), math.sin(pose[2])
        dy[o + 3] = cos * u[0] - sin * u[1]
        dy[o + 4] = sin * u[0] + cos * u[1]
    else:
        dy[o + 3] = u[0]
        dy[o + 4] = u[1]
    dy[o + 5] = u[2]


@kernel
def linearise(contacts, motion, piece, y, work):
    """Linearise every contact about `y`, whose `rates` were evaluated last."""
    o = y.shape[0] - 6
    u, pose = y[o : o + 3], y[o + 3 :]
    v, w, lin, maps = work.twist, work.wrench, work.linear, work.maps
    for c in range(contacts.kind.shape[0]):
        ct.contact_map(contacts.mount[c], contacts.place[c], pose, maps[c, 0])
        ct.contact_map_slopes(contacts.mount[c], maps[c, 0], u, w[c], maps[c, 1], maps[c, 2])
        _contact_twist(maps[c, 0], u, v)
        ct.linearise(
            contacts,
            c,
            motion.row[piece, c],
            y[contacts.state[c] : contacts.state[c + 1]],
            v,
            lin[contacts.linear[c] : contacts.linear[c + 1]],
        )


@kernel
def factor(contacts, motion, piece, since, y, shift, work):
    """Eliminate the bristles from `shift I - J` and factor the 6 x 6 matrix of the body."""
    o = y.shape[0] - 6
    lin, maps, stiffness, matrix, pivot = work.linear, work.maps, work.stiffness, work.matrix, work.pivot
    matrix[:] = 0.0
    for c in range(contacts.kind.shape[0]):
        ct.factor(
            contacts,
            c,
            motion.row[piece, c],
            y[contacts.state[c] : contacts.state[c + 1]],
            shift,
            lin[contacts.linear[c] : contacts.linear[c + 1]],
            stiffness,
        )
        load = contacts.count[c] * (motion.load[piece, 0, c] + since * motion.load[piece, 1, c])
        a, g, h = maps[c, 0], maps[c, 1], maps[c, 2]
        for i in range(3):
            for j in range(3):
                to_velocity, to_pose = 0.0, h[i, j]
                for p in range(3):
                    for q in range(3):
                        to_velocity += a[p, i] * stiffness[p, q] * a[q, j]
                        to_pose += a[p, i] * stiffness[p, q] * g[q, j]
                matrix[i, j] -= motion.inverse_mass[i] * load * to_velocity
                matrix[i, 3 + j] -= motion.inverse_mass[i] * load * to_pose
    if motion.body_axes:
        cos, sin = math.cos(y[o + 5]), math.sin(y[o + 5])
        matrix[3, 0], matrix[3, 1], matrix[4, 0], matrix[4, 1] = -cos, sin, -sin, -cos
        matrix[3, 5] = sin * y[o] + cos * y[o + 1]
        matrix[4, 5] = sin * y[o + 1] - cos * y[o]
    else:
        matrix[3, 0] = -1.0
        matrix[4, 1] = -1.0
    matrix[5, 2] = -1.0
    for i in range(6):
        matrix[i, i] += shift
    for k in range(6):
        best = k
        for i in range(k + 1, 6):
            if abs(matrix[i, k]) > abs(matrix[best, k]):
                best = i
        pivot[k] = best
        if best != k:
            for j in range(6):
                matrix[k, j], matrix[best, j] = matrix[best, j], matrix[k, j]
        for i in range(k + 1, 6):
            matrix[i, k] /= matrix[k, k]
            for j in range(k + 1, 6):
                matrix[i, j] -= matrix[i, k] * matrix[k, j]


@kernel
def solve(contacts, motion, piece, since, y, shift, r, out, work):
    """Solve `(shift I - J) out = r` with the matrix that `factor` prepared."""
    o = y.shape[0] - 6
    lin, maps, matrix, pivot = work.linear, work.maps, work.matrix, work.pivot
    w, v, b = work.stiffness[0], work.twist, work.right
    for i in range(6):
        b[i] = r[o + i]
    for c in range(contacts.kind.shape[0]):
        first, last = contacts.state[c], contacts.state[c + 1]
        ct.eliminate(
            contacts,
            c,
            motion.row[piece, c],
            y[first:last],
            shift,
            r[first:last],
            lin[contacts.linear[c] : contacts.linear[c + 1]],
            w,
        )
        load = contacts.count[c] * (motion.load[piece, 0, c] + since * motion.load[piece, 1, c])
        a = maps[c, 0]
        for i in range(3):
            b[i] += motion.inverse_mass[i] * load * (a[0, i] * w[0] + a[1, i] * w[1] + a[2, i] * w[2])
    for k in range(6):
        p = pivot[k]
        b[k], b[p] = b[p], b[k]
        for i in range(k + 1, 6):
            b[i] -= matrix[i, k] * b[k]
    for i in range(5, -1, -1):
        for j in range(i + 1, 6):
            b[i] -= matrix[i, j] * b[j]
        b[i] /= matrix[i, i]
        out[o + i] = b[i]
    for c in range(contacts.kind.shape[0]):
        first, last = contacts.state[c], contacts.state[c + 1]
        a, g = maps[c, 0], maps[c, 1]
        for i in range(3):
            v[i] = 0.0
            for j in range(3):
                v[i] += a[i, j] * b[j] + g[i, j] * b[3 + j]
        ct.back_substitute(
            contacts,
            c,
            motion.row[piece, c],
            y[first:last],
            shift,
            r[first:last],
            v,
            lin[contacts.linear[c] : contacts.linear[c + 1]],
            out[first:last],
        )
