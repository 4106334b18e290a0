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

from planarfriction._engine.body.contacts import (
    WORLD,
    Contacts,
    contact_map,
    contact_map_slopes,
)
from planarfriction._engine.body.springs import add_spring_slopes, spring_wrench
from planarfriction._engine.cells import cells
from planarfriction._engine.codegen.small_matrices import applied, inverse
from planarfriction._engine.codegen.vectors import (
    Vector,
    applied_back,
    clear,
    copy,
    plus,
    put,
    put_all,
    three,
)
from planarfriction._engine.compiler import compiled_math as xp
from planarfriction._engine.compiler import entry, jit, kernel
from planarfriction._engine.compiler.calls import address_of, call
from planarfriction._engine.compiler.memory import (
    Doubles,
    Integers,
    Place,
    StructBuffer,
    arrays_at,
    at,
    exists,
    layout,
    reader,
)
from planarfriction._engine.protocol import (
    CALLS,
    SEEN,
    SEEN_SIZE,
    Addresses,
    Seen,
    addresses_at,
)

NO_LOAD = 1e-6
"""Share of the load at which a law would be as stiff as its pad, below which limits are not followed: 1e-12 m."""


class Motion(NamedTuple):
    """A planar body and its inputs on the S pieces between breaks, each linear in the time since the piece began."""

    inverse_mass: Doubles
    """1/m, 1/m, 1/I; zeros where the velocity is prescribed, [3]."""
    body_axes: bool
    """True if the velocity is prescribed, in body axes."""
    breaks: Doubles
    """Times [S + 1]."""
    load: Doubles
    """Normal force per contact, at the start of the piece and its slope, [S, 2, C]."""
    force: Doubles
    """Applied force and torque at the centre of mass, start and slope, [S, 2, 3]."""
    velocity: Doubles
    """Prescribed velocity at the start of each piece, [S, 3]; empty [0, 3] for a free body."""
    acceleration: Doubles
    """Gravity, or the slope of the prescribed velocity, [S, 3]."""
    row: Integers
    """Shape of each contact on each piece, [S, C]."""
    mover: Doubles
    """Displacement, velocity and acceleration `(x, y, angle)` of the world's side of each contact at the start of each
    piece, world axes, [S, C, 9]; empty [0, C, 9] where all stand still."""
    spring: Doubles
    """Constants of each spring (see `body.springs`), [K, 6]."""
    anchor: Doubles
    """Pose of the anchor of each spring at the start of each piece, and its velocity, [S, K, 6]."""
    stop_speed: float
    """Speed [m/s] of a body at rest: the run ends when its speed is below and stays so (see `termination`); 0:
    never."""
    stop_radius: float
    """Lever arm that turns spin into speed for that test [m]."""
    stop_time: float
    """Time of the bristles, sigma_1/sigma_0 [s]."""
    stop_length: float
    """Full deflection of the bristles [m]."""
    settled: float
    """Time at which the last of the inputs changes for the last time [s]."""


class Work(NamedTuple):
    """Workspace of the linear algebra for C contacts."""

    workspace: Doubles
    """Linearisations of the contacts, flat."""
    maps: Doubles
    """`A`, `G`, `H` of each contact (see `body.contacts`), [C, 3, 3, 3]."""
    wrench: Doubles
    """Wrench of each contact per unit load, [C, 3]."""
    twist: Doubles
    """Twist of one contact and what is behind it (see `protocol.Seen`), [10]."""
    load: Doubles
    """Loads of contacts as bristles of pads see them, as `rates` left them, [C]."""
    covered: Doubles
    """Share of the load of each contact that lies on the body (see `protocol.Seen`), as `rates` left it, [C]."""
    stiffness: Doubles
    """d wrench / d twist of one contact, and by the place behind it (see `protocol.ModelFunctions`), [2, 3, 3]."""
    matrix: Doubles
    """Matrix of the body, [3, 3]."""
    inverse: Doubles
    """Inverse of the matrix, [3, 3]."""
    to_pose: Doubles
    """Acceleration per residual of the pose, [3, 3]."""
    rows: Doubles
    """Twist and wrench of one contact and their changes (see `protocol.ChangeRows`), [4, 3]."""
    frame: Doubles
    """Place of each contact frame, as in `Contacts.place`, and the velocity that it sees (see `place_at`), with the
    spin of the world's side, where something moves, [C, 8]."""


class SystemRecord(NamedTuple):
    """A body on its contacts as compiled functions read it."""

    contacts: Contacts
    motion: Motion
    work: Work
    size: int
    """Number C of contacts."""
    bristles: int
    """Number of states of contacts."""
    pressures: int
    """Number of states at the end of the bristles that are the place of a pressure."""
    pieces: int
    """Number S of pieces."""
    springs: int
    """Number K of springs."""
    rates: int
    """Address of `rates`, and of the functions below."""
    linearise: int
    factor: int
    solve: int


read = reader(SystemRecord)


class System(StructBuffer):
    """A body on its contacts, with the memory that its linear algebra works in.

    `keepalive` are arrays whose addresses are in the records of the contacts: they live as long as this does.
    """

    def __init__(
        self,
        contacts: Contacts,
        motion: Motion,
        keepalive: tuple[np.ndarray, ...] = (),
        pressures: int = 0,
    ) -> None:
        n = len(contacts.count)
        square = (3, 3)
        work = layout(
            Work, workspace=int(contacts.linear[n]), maps=(n, 3, 3, 3), wrench=(n, 3), twist=SEEN_SIZE, load=n,
            covered=n, stiffness=18, matrix=square, inverse=square, to_pose=square, rows=(4, 3), frame=(n, 8),
        )  # fmt: skip
        self._block = np.zeros(work.size)
        addresses = [address_of(each) for each in BODY_FUNCTIONS]
        sizes = (
            n,
            int(contacts.state[n]),
            pressures,
            len(motion.breaks) - 1,
            len(motion.spring),
        )
        super().__init__(
            SystemRecord(contacts, motion, work.placed(self._block), *sizes, *addresses)
        )
        self.contacts = contacts
        self.motion = motion
        self.keepalive = keepalive
        self.wrench = self._block[work.slices["wrench"]].reshape(n, 3)
        """Wrenches of the contacts per unit load, as they were last evaluated."""


@kernel
def load_of(system: SystemRecord, piece: int, since: float, c: int) -> float:
    """Return the normal force of one of the identical contacts that contact c stands for."""
    load = system.motion.load
    first = 2 * piece * system.size + c
    return load[first] + since * load[first + system.size]


@kernel
def total_load(system: SystemRecord, piece: int, since: float, c: int) -> float:
    """Return the normal force of all identical contacts that contact c stands for."""
    return system.contacts.count[c] * load_of(system, piece, since, c)


@kernel
def record_of(system: SystemRecord, piece: int, c: int) -> Place:
    """Return the address of the record of contact c with the shape that it has on a piece."""
    return system.contacts.record[system.motion.row[piece * system.size + c]]


@kernel
def hardly_loaded(system: SystemRecord, piece: int, c: int) -> bool:
    """Return True if contact c is one of a pad and starts a piece with hardly any load."""
    return load_of(system, piece, 0.0, c) < NO_LOAD * system.contacts.stiff[c]


@kernel
def settle_all(system: SystemRecord, piece: int, y: Doubles) -> None:
    """Bring bristles back onto their limits where a piece starts with hardly any load.

    Elsewhere bristles return by themselves, too fast to be followed only where they are heavily loaded.
    """
    for c in range(system.size):
        if hardly_loaded(system, piece, c):
            contact = cells.read(record_of(system, piece, c))
            size = system.contacts.bristle[c]
            load = NO_LOAD * system.contacts.stiff[c]
            cells.settle(contact, size, load, at(y, system.contacts.state[c]))


@kernel
def functions_of(system: SystemRecord, c: int) -> Addresses:
    """Return the addresses of the functions of contact c."""
    return addresses_at(at(system.contacts.calls, CALLS * c))


@kernel
def maps_of(system: SystemRecord, c: int) -> tuple[Doubles, Doubles, Doubles]:
    """Return the places of A, G and H of contact c."""
    maps = at(system.work.maps, 27 * c)
    return maps, at(maps, 9), at(maps, 18)


@kernel
def linearisation_of(system: SystemRecord, c: int) -> Doubles:
    """Return the workspace of the linearisation of contact c."""
    return at(system.work.workspace, system.contacts.linear[c])


@kernel
def place_at(
    system: SystemRecord, piece: int, since: float, c: int, body: Doubles
) -> tuple[Doubles, Doubles]:
    """Return the place of the frame of contact c (see `Contacts.place`), and the velocity [3] that the contact sees.

    It is the velocity at `body` (velocity and pose), less the velocity that the world's side of the contact would have
    at that place. A mover moves and turns the frame; ground under a patch on the body turns about the world's origin.
    """
    if not exists(system.motion.mover):
        return at(system.contacts.place, 4 * c), body
    place = at(system.contacts.place, 4 * c)
    frame = at(system.work.frame, 8 * c)
    mover = at(system.motion.mover, 9 * (piece * system.size + c))
    vx = mover[3] + since * mover[6]
    vy = mover[4] + since * mover[7]
    omega = mover[5] + since * mover[8]
    dx = body[3]
    dy = body[4]
    copy(place, frame, 4)
    if system.contacts.mount[c] == WORLD:
        half = 0.5 * since
        turned = mover[2] + since * (mover[5] + half * mover[8])
        cos = math.cos(turned)
        sin = math.sin(turned)
        frame[0] += mover[0] + since * (mover[3] + half * mover[6])
        frame[1] += mover[1] + since * (mover[4] + half * mover[7])
        frame[2] = cos * place[2] - sin * place[3]
        frame[3] = sin * place[2] + cos * place[3]
        dx = dx - frame[0]
        dy = dy - frame[1]
    frame[4] = body[0] - (vx - omega * dy)
    frame[5] = body[1] - (vy + omega * dx)
    frame[6] = body[2] - omega
    frame[7] = omega
    return frame, at(frame, 4)


@kernel
def seen_by(system: SystemRecord, c: int, y: Doubles) -> Doubles:
    """Return the velocity [3] that contact c sees, as `rates` of the state `y` left it."""
    return (
        at(system.work.frame, 8 * c + 4)
        if exists(system.motion.mover)
        else at(y, system.bristles)
    )


@kernel
def _placed(a: Doubles, x: float, y: float, angle: float) -> Vector:
    """Return a way of the body, or a change of its pose, in the axes of a contact fixed to the world."""
    return a[0] * x + a[1] * y, a[3] * x + a[4] * y, angle


@kernel
def _seen_from(
    work: Work, c: int, place: Doubles, pose: Doubles, a: Doubles, u: Doubles
) -> Seen:
    """Write what contact c sees of a body: twist, load, place and axes, with all of the contact covered."""
    seen = arrays_at(SEEN, work.twist)
    put(seen.twist, applied(a, u))
    put(seen.place, _placed(a, pose[0] - place[0], pose[1] - place[1], pose[2]))
    seen.load[0] = work.load[c]
    seen.axes[0] = place[2]
    seen.axes[1] = place[3]
    seen.covered[0] = 1.0
    return seen


@kernel
def _rates(
    system: SystemRecord, piece: int, since: float, y: Doubles, dy: Doubles, keep: bool
) -> None:
    """Write `rates`; keep the linearisation of every contact if asked for."""
    work = system.work
    body = at(y, system.bristles)
    out = at(dy, system.bristles)
    force = at(system.motion.force, 6 * piece)
    total = plus(three(force), since, three(at(force, 3)))
    total = plus(total, 1.0, spring_wrench(system, piece, since, body))
    for c in range(system.size):
        first = system.contacts.state[c]
        w = at(work.wrench, 3 * c)
        mount = system.contacts.mount[c]
        place, seen = place_at(system, piece, since, c, body)
        (a, g, h) = maps_of(system, c)
        a = a if keep else work.stiffness
        contact_map(mount, place, at(body, 3), a)
        load = load_of(system, piece, since, c)
        work.load[c] = xp.maximum(load, NO_LOAD * system.contacts.stiff[c])
        inputs = _seen_from(work, c, place, at(body, 3), a, seen)
        states = record_of(system, piece, c), at(y, first), work.twist, at(dy, first), w
        if keep:
            call(
                functions_of(system, c).linearise,
                (*states, linearisation_of(system, c)),
            )
            contact_map_slopes(mount, a, seen, w, g, h)
            if exists(system.motion.mover):
                # Elsewhere, the other side has another velocity.
                omega = work.frame[8 * c + 7]
                for i in range(3):
                    g[3 * i] -= omega * a[3 * i + 1]
                    g[3 * i + 1] += omega * a[3 * i]
        else:
            call(functions_of(system, c).evaluate, states)
        work.covered[c] = inputs.covered[0]
        total = plus(total, total_load(system, piece, since, c), applied_back(a, w))
    for i in range(3):
        out[i] = (
            system.motion.acceleration[3 * piece + i]
            + system.motion.inverse_mass[i] * total[i]
        )
    put(at(out, 3), _turned(system, body, three(body)))


@kernel
def _turned(system: SystemRecord, body: Doubles, u: Vector) -> Vector:
    """Return a velocity of the body in world axes."""
    x, y, s = u
    if system.motion.body_axes:
        cos = math.cos(body[5])
        sin = math.sin(body[5])
        x, y = cos * x - sin * y, sin * x + cos * y
    return x, y, s


@entry
def rates(address: Place, piece: int, since: float, y: Doubles, dy: Doubles) -> None:
    """Write the right-hand side `dy` at `since` seconds into a piece, and wrenches per unit load into the workspace."""
    _rates(read(address), piece, since, y, dy, False)


@entry
def linearise(
    address: Place, piece: int, since: float, y: Doubles, dy: Doubles
) -> None:
    """Write what `rates` does, and linearise every contact about `y`."""
    _rates(read(address), piece, since, y, dy, True)


@entry
def factor(address: Place, piece: int, since: float, y: Doubles, shift: float) -> None:
    """Eliminate bristles and pose from `shift I - J`, and invert the 3 x 3 matrix that is left for the velocity.

    A free body's pose follows from its velocity, `pose = (r_pose + u)/shift`, so that the twist of a contact changes by
    `(A + G/shift) u + G r_pose/shift`. (A prescribed velocity does not see the pose at all.)
    """
    system = read(address)
    s = system.work.stiffness
    m = system.work.matrix
    to_pose = system.work.to_pose
    clear(m, 9)
    clear(to_pose, 9)
    for c in range(system.size):
        z = at(y, system.contacts.state[c])
        (a, g, h) = maps_of(system, c)
        clear(at(s, 9), 9)
        call(
            functions_of(system, c).factor,
            (record_of(system, piece, c), z, shift, linearisation_of(system, c), s),
        )
        load = total_load(system, piece, since, c)
        for j in range(3):
            by_u = applied_back(a, applied(s, (a[j], a[3 + j], a[6 + j])))
            place = applied(
                at(s, 9), (a[j], a[3 + j], 0.0) if j < 2 else (0.0, 0.0, 1.0)
            )
            bpy = applied_back(
                a, plus(applied(s, (g[j], g[3 + j], g[6 + j])), 1.0, place)
            )
            for i in range(3):
                weight = system.motion.inverse_mass[i] * load
                per_pose = (h[3 * i + j] + bpy[i]) / shift
                to_pose[3 * i + j] += weight * per_pose
                m[3 * i + j] += weight * (by_u[i] + per_pose)
    add_spring_slopes(
        system, piece, since, at(y, system.bristles), 1.0 / shift, to_pose, m
    )
    put_all(system.work.inverse, inverse(shift, m))


@entry
def solve(
    address: Place,
    piece: int,
    since: float,
    y: Doubles,
    shift: float,
    r: Doubles,
    out: Doubles,
) -> None:
    """Solve `(shift I - J) out = r` with the matrix that `factor` prepared."""
    system = read(address)
    w = system.work.stiffness
    v = system.work.twist
    inverse_mass = system.motion.inverse_mass
    body = at(y, system.bristles)
    r_body = at(r, system.bristles)
    r_pose = at(r, system.bristles + 3)
    b = plus(three(r_body), 1.0, applied(system.work.to_pose, r_pose))
    for c in range(system.size):
        first = system.contacts.state[c]
        states = (
            record_of(system, piece, c),
            at(y, first),
            shift,
            at(r, first),
            linearisation_of(system, c),
            w,
        )
        call(functions_of(system, c).eliminate, states)
        load = total_load(system, piece, since, c)
        force = applied_back(maps_of(system, c)[0], w)
        b = plus(
            b,
            load,
            (
                inverse_mass[0] * force[0],
                inverse_mass[1] * force[1],
                inverse_mass[2] * force[2],
            ),
        )
    u = at(out, system.bristles)
    pose = at(out, system.bristles + 3)
    per_shift = 1.0 / shift
    put(u, applied(system.work.inverse, b))
    px, py, s = plus(three(r_pose), 1.0, _turned(system, body, three(u)))
    pose[2] = per_shift * s
    if system.motion.body_axes:
        cos = math.cos(body[5])
        sin = math.sin(body[5])
        px -= (sin * body[0] + cos * body[1]) * pose[2]
        py += (cos * body[0] - sin * body[1]) * pose[2]
    pose[0] = per_shift * px
    pose[1] = per_shift * py
    for c in range(system.size):
        first = system.contacts.state[c]
        (a, g, _) = maps_of(system, c)
        put(v, plus(applied(a, u), 1.0, applied(g, pose)))
        put(at(v, 3), _placed(a, pose[0], pose[1], pose[2]))
        states = (
            record_of(system, piece, c),
            at(y, first),
            at(r, first),
            v,
            linearisation_of(system, c),
            at(out, first),
        )
        call(functions_of(system, c).back_substitute, states)


BODY_FUNCTIONS = rates, linearise, factor, solve
"""Functions of `SystemRecord`."""


@jit
def right_hand_side(
    address: Place, piece: int, since: float, y: np.ndarray, dy: np.ndarray
) -> None:
    """Write `rates` for callers in Python, as an explicit or a general implicit solver needs it; contiguous arrays."""
    call(read(address).rates, (address, piece, since, y, dy))
