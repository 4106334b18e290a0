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

from planarfriction.compiler import entry, jit, kernel
from planarfriction.kernels.contacts import (
    BACK_SUBSTITUTE,
    CALLS,
    ELIMINATE,
    EVALUATE,
    FACTOR,
    LINEARISE,
    WORLD,
    Contacts,
    contact_map,
    contact_map_slopes,
)
from planarfriction.kernels.pointers import address_of, at, call, doubles, integers, place_of
from planarfriction.kernels.records import addresses_in, reader, row_of


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
    mover: np.ndarray
    """Displacement, velocity and acceleration `(x, y, angle)` of the world's side of each contact at the start of each
    piece, world axes, [S, C, 9]; empty [0, C, 9] where all stand still."""
    stop_speed: float
    """End when the body is at rest: its speed is below this [m/s] and stays so (see `rosenbrock`); 0: never."""
    stop_radius: float
    """Lever arm that turns spin into speed for that test [m]."""
    stop_time: float
    """The bristles' time, sigma_1/sigma_0 [s]."""
    stop_length: float
    """The bristles' full deflection [m]."""
    settled: float
    """When the last of the inputs has changed for the last time [s]."""


class Work(NamedTuple):
    """Workspace of the linear algebra for C contacts."""

    workspace: np.ndarray
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
    moved: np.ndarray
    """Where each contact frame is, as in `Contacts.place`, and the velocity it sees (see `place_at`), with the spin of
    the world's side, where something moves, [C, 8]."""


SystemRecord = NamedTuple(
    "SystemRecord",
    [
        *((name, int) for name in ("contacts", "bristles", "pieces", "body_axes")),
        *((name, float) for name in ("stop_speed", "stop_radius", "stop_time", "stop_length", "settled")),
        *((name, int) for name in addresses_in(Contacts, Motion, Work)),
        *((name, int) for name in ("rates", "linearise", "factor", "solve")),
    ],
)
"""A body on its contacts as compiled functions read it: numbers, arrays by their addresses (0: a body is not driven by
a velocity, nothing it touches moves), and the functions of this module."""

read = reader(SystemRecord)


class System(NamedTuple):
    """A body on its contacts, with what its linear algebra works in."""

    contacts: Contacts
    motion: Motion
    work: Work
    words: np.ndarray
    """Its `SystemRecord`, as a row."""
    kept: tuple[np.ndarray, ...] = ()
    """Arrays whose addresses are in the records of the contacts: they live as long as this does."""

    @property
    def address(self) -> int:
        """What compiled functions take."""
        return place_of(self.words)


def system_of(contacts: Contacts, motion: Motion, kept: tuple[np.ndarray, ...] = ()) -> System:
    """A system with its workspace (made outside compiled code, where an allocation costs compile time)."""
    n = len(contacts.count)
    work = Work(
        workspace=np.zeros(contacts.linear[n]),
        maps=np.zeros((n, 3, 3, 3)),
        wrench=np.zeros((n, 3)),
        twist=np.zeros(3),
        stiffness=np.zeros((3, 3)),
        matrix=np.zeros((3, 3)),
        inverse=np.zeros((3, 3)),
        to_pose=np.zeros((3, 3)),
        body=np.zeros(3),
        rows=np.zeros((4, 3)),
        moved=np.zeros((n, 8)),
    )
    record = SystemRecord(
        contacts=n,
        bristles=int(contacts.state[n]),
        **{name: place_of(array) for name, array in contacts._asdict().items()},
        **{name: place_of(array) for name, array in motion._asdict().items() if isinstance(array, np.ndarray)},
        **{name: place_of(array) for name, array in work._asdict().items()},
        pieces=len(motion.breaks) - 1,
        body_axes=int(motion.body_axes),
        stop_speed=motion.stop_speed,
        stop_radius=motion.stop_radius,
        stop_time=motion.stop_time,
        stop_length=motion.stop_length,
        settled=motion.settled,
        rates=address_of(rates, "ppfpp"),
        linearise=address_of(linearise, "ppp"),
        factor=address_of(factor, "ppfpf"),
        solve=address_of(solve, "ppfpfpp"),
    )
    if not len(motion.velocity):
        record = record._replace(velocity=0)
    if not len(motion.mover):
        record = record._replace(mover=0)
    return System(contacts, motion, work, row_of(record), kept)


@kernel
def times(a, u, v):
    """`v = a u` for a 3 x 3 matrix."""
    for i in range(3):
        v[i] = a[3 * i] * u[0] + a[3 * i + 1] * u[1] + a[3 * i + 2] * u[2]


@kernel
def load_of(own, piece, since, c):
    """Normal force of one of the identical contacts that contact c stands for."""
    load, at = doubles(own.load), 2 * piece * own.contacts + c
    return load[at] + since * load[at + own.contacts]


@kernel
def record_of(own, piece, c):
    """Address of the record of contact c with the shape that it has on a piece."""
    return integers(own.record)[integers(own.row)[piece * own.contacts + c]]


@kernel
def place_at(own, piece, since, c, state):
    """Address of where the frame of contact c is (see `Contacts.place`), and that of the velocity it sees [3].

    That is the body's at `state` (address of its velocity and pose), less the one that the world's side of the contact
    would have there. What carries the frame moves and turns it; ground under a patch on the body turns about the
    world's origin.
    """
    if own.mover == 0:
        return at(own.place, 4 * c), state
    mount, place, y = integers(own.mount)[c], doubles(at(own.place, 4 * c)), doubles(state)
    mover = doubles(at(own.mover, 9 * (piece * own.contacts + c)))
    moved = doubles(at(own.moved, 8 * c))
    vx, vy = mover[3] + since * mover[6], mover[4] + since * mover[7]
    omega, dx, dy = mover[5] + since * mover[8], y[3], y[4]
    for i in range(4):
        moved[i] = place[i]
    if mount == WORLD:
        half = 0.5 * since
        turned = mover[2] + since * (mover[5] + half * mover[8])
        c_t, s_t = math.cos(turned), math.sin(turned)
        moved[0] += mover[0] + since * (mover[3] + half * mover[6])
        moved[1] += mover[1] + since * (mover[4] + half * mover[7])
        moved[2], moved[3] = c_t * place[2] - s_t * place[3], s_t * place[2] + c_t * place[3]
        dx, dy = dx - moved[0], dy - moved[1]
    moved[4] = y[0] - (vx - omega * dy)
    moved[5] = y[1] - (vy + omega * dx)
    moved[6] = y[2] - omega
    moved[7] = omega
    return at(own.moved, 8 * c), at(own.moved, 8 * c + 4)


@kernel
def seen_by(own, c, y):
    """Address of the velocity that contact c sees [3], as `rates` of the state `y` left it."""
    return at(y, own.bristles) if own.mover == 0 else at(own.moved, 8 * c + 4)


@entry
def rates(system, piece, since, y, dy):
    """Right-hand side `dy` at `since` seconds into a piece; wrenches per unit load into the workspace."""
    own = read(system)
    o, six = own.bristles, 6 * piece
    u, pose, out = doubles(at(y, o)), doubles(at(y, o + 3)), doubles(at(dy, o))
    a, total, force = doubles(own.stiffness), doubles(own.body), doubles(own.force)
    for i in range(3):
        total[i] = force[six + i] + since * force[six + 3 + i]
    for c in range(own.contacts):
        first, w = integers(own.state)[c], at(own.wrench, 3 * c)
        place, seen = place_at(own, piece, since, c, at(y, o))
        contact_map(integers(own.mount)[c], doubles(place), pose, a)
        times(a, doubles(seen), doubles(own.twist))
        call(
            integers(own.calls)[CALLS * c + EVALUATE],
            (record_of(own, piece, c), at(y, first), own.twist, at(dy, first), w),
        )
        load = doubles(own.count)[c] * load_of(own, piece, since, c)
        for i in range(3):
            for p in range(3):
                total[i] += load * a[3 * p + i] * doubles(w)[p]
    for i in range(3):
        out[i] = doubles(own.acceleration)[3 * piece + i] + doubles(own.inverse_mass)[i] * total[i]
    if own.body_axes:
        cos, sin = math.cos(pose[2]), math.sin(pose[2])
        out[3] = cos * u[0] - sin * u[1]
        out[4] = sin * u[0] + cos * u[1]
    else:
        out[3] = u[0]
        out[4] = u[1]
    out[5] = u[2]


@entry
def linearise(system, piece, y):
    """Linearise every contact about `y`, whose `rates` were evaluated last."""
    own = read(system)
    o = own.bristles
    pose, v = doubles(at(y, o + 3)), doubles(own.twist)
    for c in range(own.contacts):
        mount, maps = integers(own.mount)[c], at(own.maps, 27 * c)
        a, g, h = doubles(maps), doubles(at(maps, 9)), doubles(at(maps, 18))
        place = at(own.place if own.mover == 0 else own.moved, (4 if own.mover == 0 else 8) * c)
        seen = seen_by(own, c, y)
        contact_map(mount, doubles(place), pose, a)
        contact_map_slopes(mount, a, doubles(seen), doubles(at(own.wrench, 3 * c)), g, h)
        if own.mover != 0:
            omega = doubles(own.moved)[8 * c + 7]  # elsewhere, the other side has another velocity
            for i in range(3):
                g[3 * i] -= omega * a[3 * i + 1]
                g[3 * i + 1] += omega * a[3 * i]
        times(a, doubles(seen), v)
        z, lin = at(y, integers(own.state)[c]), at(own.workspace, integers(own.linear)[c])
        call(integers(own.calls)[CALLS * c + LINEARISE], (record_of(own, piece, c), z, own.twist, lin))


@entry
def factor(system, piece, since, y, shift):
    """Eliminate bristles and pose from `shift I - J`, and invert the 3 x 3 matrix that is left for the velocity.

    A free body's pose follows from its velocity, `pose = (r_pose + u)/shift`, so that the twist of a contact changes by
    `(A + G/shift) u + G r_pose/shift`. (A prescribed velocity does not see the pose at all.)
    """
    own = read(system)
    s, m, to_pose = doubles(own.stiffness), doubles(own.matrix), doubles(own.to_pose)
    b, v, inverse, inverse_mass = doubles(own.body), doubles(own.twist), doubles(own.inverse), doubles(own.inverse_mass)
    for i in range(9):
        m[i] = shift if i % 4 == 0 else 0.0
        to_pose[i] = 0.0
    for c in range(own.contacts):
        z, lin = at(y, integers(own.state)[c]), at(own.workspace, integers(own.linear)[c])
        call(integers(own.calls)[CALLS * c + FACTOR], (record_of(own, piece, c), z, shift, lin, own.stiffness))
        load = doubles(own.count)[c] * load_of(own, piece, since, c)
        maps = at(own.maps, 27 * c)
        a, g, h = doubles(maps), doubles(at(maps, 9)), doubles(at(maps, 18))
        for j in range(3):
            for p in range(3):
                b[p] = s[3 * p] * a[j] + s[3 * p + 1] * a[3 + j] + s[3 * p + 2] * a[6 + j]
                v[p] = s[3 * p] * g[j] + s[3 * p + 1] * g[3 + j] + s[3 * p + 2] * g[6 + j]
            for i in range(3):
                per_velocity = a[i] * b[0] + a[3 + i] * b[1] + a[6 + i] * b[2]
                per_pose = h[3 * i + j] + a[i] * v[0] + a[3 + i] * v[1] + a[6 + i] * v[2]
                weight = inverse_mass[i] * load
                to_pose[3 * i + j] += weight * per_pose / shift
                m[3 * i + j] -= weight * (per_velocity + per_pose / shift)
    for i in range(3):
        for j in range(3):
            inverse[3 * i + j] = _cofactor(m, j, i)
    determinant = m[0] * inverse[0] + m[1] * inverse[3] + m[2] * inverse[6]
    for i in range(9):
        inverse[i] /= determinant


@kernel
def _cofactor(m, i, j):
    """Signed cofactor of a 3 x 3 matrix; cyclic neighbours carry the sign."""
    i1, i2, j1, j2 = (i + 1) % 3, (i + 2) % 3, (j + 1) % 3, (j + 2) % 3
    return m[3 * i1 + j1] * m[3 * i2 + j2] - m[3 * i1 + j2] * m[3 * i2 + j1]


@entry
def solve(system, piece, since, y, shift, r, out):
    """Solve `(shift I - J) out = r` with the matrix that `factor` prepared."""
    own = read(system)
    o, state, linear, calls = own.bristles, integers(own.state), integers(own.linear), integers(own.calls)
    w, v, b = doubles(own.stiffness), doubles(own.twist), doubles(own.body)
    r_body, r_pose, to_pose = doubles(at(r, o)), doubles(at(r, o + 3)), doubles(own.to_pose)
    times(to_pose, r_pose, b)
    for i in range(3):
        b[i] += r_body[i]
    for c in range(own.contacts):
        first, lin = state[c], at(own.workspace, linear[c])
        call(
            calls[CALLS * c + ELIMINATE],
            (record_of(own, piece, c), at(y, first), shift, at(r, first), lin, own.stiffness),
        )
        load = doubles(own.count)[c] * load_of(own, piece, since, c)
        a = doubles(at(own.maps, 27 * c))
        for i in range(3):
            force = a[i] * w[0] + a[3 + i] * w[1] + a[6 + i] * w[2]
            b[i] += doubles(own.inverse_mass)[i] * load * force
    u, pose, held = doubles(at(out, o)), doubles(at(out, o + 3)), doubles(at(y, o))
    times(doubles(own.inverse), b, u)
    per_shift = 1.0 / shift
    pose[2] = per_shift * (r_pose[2] + u[2])
    if own.body_axes:
        cos, sin = math.cos(held[5]), math.sin(held[5])
        pose[0] = per_shift * (r_pose[0] + cos * u[0] - sin * u[1] - (sin * held[0] + cos * held[1]) * pose[2])
        pose[1] = per_shift * (r_pose[1] + sin * u[0] + cos * u[1] + (cos * held[0] - sin * held[1]) * pose[2])
    else:
        pose[0] = per_shift * (r_pose[0] + u[0])
        pose[1] = per_shift * (r_pose[1] + u[1])
    for c in range(own.contacts):
        first, lin, maps = state[c], at(own.workspace, linear[c]), at(own.maps, 27 * c)
        a, g = doubles(maps), doubles(at(maps, 9))
        for i in range(3):
            turn = g[3 * i] * pose[0] + g[3 * i + 1] * pose[1] + g[3 * i + 2] * pose[2]
            v[i] = a[3 * i] * u[0] + a[3 * i + 1] * u[1] + a[3 * i + 2] * u[2] + turn
        record = record_of(own, piece, c)
        call(calls[CALLS * c + BACK_SUBSTITUTE], (record, at(y, first), at(r, first), own.twist, lin, at(out, first)))


@jit
def right_hand_side(system, piece, since, y, dy):
    """`rates` for callers in Python, as an explicit or a general implicit solver needs it; contiguous arrays."""
    call(read(system).rates, (system, piece, since, y, dy))
