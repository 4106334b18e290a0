"""A planar body on its contacts: right-hand side, linearisation, and the solve that costs no more than either.

State vector: bristles of every contact, body velocity `u = (vx, vy, omega)`, pose `(x, y, theta)`. Bristles of
different cells do not see each other, they meet in the body's three accelerations: `(shift I - J) k = r` is solved by
eliminating the bristles contact by contact, which leaves a 3 x 3 system for the body. Loads and forces are linear in
time on a piece.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from planarfriction.kernels import inlined, jit, kernel
from planarfriction.kernels.contacts import (
    BACK_SUBSTITUTE,
    ELIMINATE,
    EVALUATE,
    FACTOR,
    LINEARISE,
    Contacts,
    contact_map,
    contact_map_slopes,
)
from planarfriction.kernels.pointers import call, place


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
    """The body's matrix, [3, 3]."""
    inverse: np.ndarray
    """Its inverse, [3, 3]."""
    to_pose: np.ndarray
    """Acceleration per residual of the pose, [3, 3]."""
    body: np.ndarray
    """A vector of the body, [3]."""
    rows: np.ndarray
    """Twist and wrench of one contact and their changes, [4, 3] (see `contacts.ModelFunctions`)."""


class System(NamedTuple):
    """A body on its contacts, with what its linear algebra works in."""

    contacts: Contacts
    motion: Motion
    work: Work


def system_of(contacts: Contacts, motion: Motion) -> System:
    """A system with its workspace (made outside compiled code, where an allocation costs compile time)."""
    n, square = len(contacts.count), (3, 3)
    work = Work(
        np.zeros(contacts.linear[n]),
        np.zeros((n, 3, 3, 3)),
        np.zeros((n, 3)),
        np.zeros(3),
        np.zeros(square),
        np.zeros(square),
        np.zeros(square),
        np.zeros(square),
        np.zeros(3),
        np.zeros((4, 3)),
    )
    return System(contacts, motion, work)


@inlined
def times(a, u, v):
    """`v = a u` for a 3 x 3 matrix."""
    for i in range(3):
        v[i] = 0.0
        for j in range(3):
            v[i] += a[i, j] * u[j]


@inlined
def load_of(system, piece, since, c):
    """Normal force of all the identical contacts that contact c stands for."""
    load = system.motion.load
    return system.contacts.count[c] * (load[piece, 0, c] + since * load[piece, 1, c])


@kernel
def rates(system, piece, since, y, dy):
    """Right-hand side `dy` at `since` seconds into a piece; wrenches per unit load into `work.wrench`."""
    contacts, motion, work = system
    o = y.shape[0] - 6
    u, pose = y[o : o + 3], y[o + 3 :]
    v, a, total = work.twist, work.stiffness, work.body
    for i in range(3):
        total[i] = motion.force[piece, 0, i] + since * motion.force[piece, 1, i]
    for c in range(contacts.count.shape[0]):
        first, w = contacts.state[c], work.wrench[c]
        contact_map(contacts.mount[c], contacts.place[c], pose, a)
        times(a, u, v)
        record = contacts.record[motion.row[piece, c]]
        call(contacts.calls[c, EVALUATE], (record, place(y, first), v, place(dy, first), w))
        load = load_of(system, piece, since, c)
        for i in range(3):
            for p in range(3):
                total[i] += load * a[p, i] * w[p]
    for i in range(3):
        dy[o + i] = motion.acceleration[piece, i] + motion.inverse_mass[i] * total[i]
    if motion.body_axes:
        cos, sin = math.cos(pose[2]), math.sin(pose[2])
        dy[o + 3] = cos * u[0] - sin * u[1]
        dy[o + 4] = sin * u[0] + cos * u[1]
    else:
        dy[o + 3] = u[0]
        dy[o + 4] = u[1]
    dy[o + 5] = u[2]


@kernel
def linearise(system, piece, y):
    """Linearise every contact about `y`, whose `rates` were evaluated last."""
    contacts, motion, work = system
    o = y.shape[0] - 6
    u, pose = y[o : o + 3], y[o + 3 :]
    v, w, maps = work.twist, work.wrench, work.maps
    for c in range(contacts.count.shape[0]):
        contact_map(contacts.mount[c], contacts.place[c], pose, maps[c, 0])
        contact_map_slopes(contacts.mount[c], maps[c, 0], u, w[c], maps[c, 1], maps[c, 2])
        times(maps[c, 0], u, v)
        record, lin = contacts.record[motion.row[piece, c]], place(work.linear, contacts.linear[c])
        call(contacts.calls[c, LINEARISE], (record, place(y, contacts.state[c]), v, lin))


@kernel
def factor(system, piece, since, y, shift):
    """Eliminate bristles and pose from `shift I - J`, and invert the 3 x 3 matrix that is left for the velocity.

    A free body's pose follows from its velocity, `pose = (r_pose + u)/shift`, so that the twist of a contact changes by
    `(A + G/shift) u + G r_pose/shift`. (A prescribed velocity does not see the pose at all.)
    """
    contacts, motion, work = system
    stiffness, m = work.stiffness, work.matrix
    for i in range(3):
        for j in range(3):
            m[i, j] = shift if i == j else 0.0
            work.to_pose[i, j] = 0.0
    for c in range(contacts.count.shape[0]):
        record, lin = contacts.record[motion.row[piece, c]], place(work.linear, contacts.linear[c])
        call(contacts.calls[c, FACTOR], (record, place(y, contacts.state[c]), shift, lin, stiffness))
        load = load_of(system, piece, since, c)
        a, g, h = work.maps[c, 0], work.maps[c, 1], work.maps[c, 2]
        for j in range(3):
            for p in range(3):
                work.body[p], work.twist[p] = 0.0, 0.0
                for q in range(3):
                    work.body[p] += stiffness[p, q] * a[q, j]
                    work.twist[p] += stiffness[p, q] * g[q, j]
            for i in range(3):
                per_velocity, per_pose = 0.0, h[i, j]
                for p in range(3):
                    per_velocity += a[p, i] * work.body[p]
                    per_pose += a[p, i] * work.twist[p]
                weight = motion.inverse_mass[i] * load
                work.to_pose[i, j] += weight * per_pose / shift
                m[i, j] -= weight * (per_velocity + per_pose / shift)
    determinant = 0.0
    for i in range(3):
        work.body[i] = _cofactor(m, 0, i)
        determinant += m[0, i] * work.body[i]
    for i in range(3):
        for j in range(3):
            work.inverse[i, j] = _cofactor(m, j, i) / determinant


@inlined
def _cofactor(m, i, j):
    """Signed cofactor of a 3 x 3 matrix; cyclic neighbours carry the sign."""
    i1, i2, j1, j2 = (i + 1) % 3, (i + 2) % 3, (j + 1) % 3, (j + 2) % 3
    return m[i1, j1] * m[i2, j2] - m[i1, j2] * m[i2, j1]


@kernel
def solve(system, piece, since, y, shift, r, out):
    """Solve `(shift I - J) out = r` with the matrix that `factor` prepared."""
    contacts, motion, work = system
    o = y.shape[0] - 6
    w, v, b = work.stiffness[0], work.twist, work.body
    r_pose = r[o + 3 :]
    for i in range(3):
        b[i] = r[o + i]
        for j in range(3):
            b[i] += work.to_pose[i, j] * r_pose[j]
    for c in range(contacts.count.shape[0]):
        first, lin = contacts.state[c], place(work.linear, contacts.linear[c])
        record = contacts.record[motion.row[piece, c]]
        call(contacts.calls[c, ELIMINATE], (record, place(y, first), shift, place(r, first), lin, w))
        load = load_of(system, piece, since, c)
        a = work.maps[c, 0]
        for i in range(3):
            for p in range(3):
                b[i] += motion.inverse_mass[i] * load * a[p, i] * w[p]
    u, pose = out[o : o + 3], out[o + 3 :]
    times(work.inverse, b, u)
    per_shift = 1.0 / shift
    pose[2] = per_shift * (r_pose[2] + u[2])
    if motion.body_axes:
        cos, sin = math.cos(y[o + 5]), math.sin(y[o + 5])
        pose[0] = per_shift * (r_pose[0] + cos * u[0] - sin * u[1] - (sin * y[o] + cos * y[o + 1]) * pose[2])
        pose[1] = per_shift * (r_pose[1] + sin * u[0] + cos * u[1] + (cos * y[o] - sin * y[o + 1]) * pose[2])
    else:
        pose[0] = per_shift * (r_pose[0] + u[0])
        pose[1] = per_shift * (r_pose[1] + u[1])
    for c in range(contacts.count.shape[0]):
        first, lin = contacts.state[c], place(work.linear, contacts.linear[c])
        a, g = work.maps[c, 0], work.maps[c, 1]
        for i in range(3):
            v[i] = 0.0
            for j in range(3):
                v[i] += a[i, j] * u[j] + g[i, j] * pose[j]
        record = contacts.record[motion.row[piece, c]]
        call(contacts.calls[c, BACK_SUBSTITUTE], (record, place(y, first), place(r, first), v, lin, place(out, first)))


@jit
def right_hand_side(system, piece, since, y, dy):
    """`rates` for callers in Python, as an explicit or a general implicit solver needs it."""
    rates(system, piece, since, y, dy)
