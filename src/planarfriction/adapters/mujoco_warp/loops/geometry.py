"""Places of patches in contact in the worlds of MuJoCo Warp, and the Jacobian of their twists, as kernels.

As `planarfriction.adapters.mujoco.loops.geometry`, one thread a world.
"""

# No `from __future__ import annotations` here: Warp reads the types themselves.

import mujoco
import warp as wp

from planarfriction._engine.coupled import placing
from planarfriction.adapters.mujoco.loops.records import Memory

FRICTIONLESS = wp.constant(int(mujoco.mjtConstraint.mjCNSTR_CONTACT_FRICTIONLESS))

onto_plane = wp.func(placing.onto_plane)
across = wp.func(placing.across)
x_axis = wp.func(placing.x_axis_with(wp.where))


@wp.struct
class PatchArrays:
    """Patches of a model: `count` and arrays [k]."""

    count: int
    states: int
    site: wp.array(dtype=int)
    own: wp.array(dtype=int)
    other: wp.array(dtype=int)
    owner: wp.array(dtype=int)
    support: wp.array(dtype=int)
    centre: wp.array(dtype=int)
    """Origins, as those of `placing`."""
    curved: wp.array(dtype=int)
    """Bits of their curved sides, as those of `placing`."""
    carrier: wp.array(dtype=int)
    """The smaller geoms, along with which patches go over the others."""
    reach: wp.array(dtype=wp.vec4)
    """Reaches of the patches (see `placing`) [m]."""
    scale: wp.array(dtype=int)
    """Columns of their sizes in the parameters of `CoupledPatches`."""
    bristles: wp.array(dtype=int)
    """Number of bristles of a patch: all x components come before all y."""
    first: wp.array(dtype=int)
    """First state."""
    surface: wp.array2d(dtype=wp.spatial_vector)
    """Velocities of the surfaces of both geoms in their frames (`surfacevel`) [k, 2]."""
    radius: wp.array(dtype=float)


@wp.struct
class Host:
    """Arrays of the model and the data of MuJoCo Warp: bodies, contacts and constraints of all worlds."""

    time: wp.array(dtype=float)
    timestep: wp.array(dtype=float)
    site_xpos: wp.array2d(dtype=wp.vec3)
    site_xmat: wp.array2d(dtype=wp.mat33)
    geom_xpos: wp.array2d(dtype=wp.vec3)
    geom_xmat: wp.array2d(dtype=wp.mat33)
    qvel: wp.array2d(dtype=float)
    passive: wp.array2d(dtype=float)
    smooth: wp.array2d(dtype=float)
    warmstart: wp.array2d(dtype=float)
    root: wp.array(dtype=int)
    ancestor: wp.array2d(dtype=int)
    centre: wp.array2d(dtype=wp.vec3)
    axis: wp.array2d(dtype=wp.spatial_vector)
    turned: wp.array2d(dtype=wp.spatial_vector)
    """Time derivatives of `axis` [E, nv]."""
    velocity: wp.array2d(dtype=wp.spatial_vector)
    """Spins of the bodies, and their velocities at `centre` [E, bodies]."""
    nefc: wp.array(dtype=int)
    type: wp.array2d(dtype=int)
    id: wp.array2d(dtype=int)
    geom: wp.array(dtype=wp.vec2i)
    frame: wp.array(dtype=wp.mat33)
    pos: wp.array(dtype=wp.vec3)
    force: wp.array2d(dtype=float)
    sparse: int
    """1 if the Jacobian of the constraints is sparse."""
    nnz: wp.array2d(dtype=int)
    first: wp.array2d(dtype=int)
    column: wp.array3d(dtype=int)
    jacobian: wp.array3d(dtype=float)
    stiffness: wp.array2d(dtype=float)
    aref: wp.array2d(dtype=float)
    loss: wp.array2d(dtype=float)
    inertia: wp.array2d(dtype=float)
    """M, and the metric of the integrator, below the diagonal, row by row."""
    metric: wp.array2d(dtype=float)
    inertia_nnz: wp.array(dtype=int)
    inertia_first: wp.array(dtype=int)
    inertia_column: wp.array(dtype=int)
    damping: wp.array2d(dtype=float)
    implicit: int
    """0: Euler, 1: Euler with damping, 2: `metric`."""


@wp.struct
class ContactSolveArrays:
    """Problem in contact space of all worlds (see `coupling.HostStep`), with the state at the start of the step."""

    state: wp.array2d(dtype=float)
    twist: wp.array3d(dtype=float)
    load: wp.array2d(dtype=float)
    guess: wp.array3d(dtype=float)
    response: wp.array3d(dtype=float)
    load_response: wp.array3d(dtype=float)
    moments: wp.array3d(dtype=float)


@wp.struct
class Frames:
    """Places of patches in all worlds, as `place` writes them."""

    owner: wp.array2d(dtype=int)
    """Patch of each constraint, -1 of others [E, njmax]."""
    lever: wp.array2d(dtype=wp.vec2)
    """Place of each of its contacts in its frame [E, njmax]."""
    touching: wp.array2d(dtype=int)
    axes: wp.array2d(dtype=wp.mat33)
    """Axes x, y and normal of the patches, as rows [E, k]."""
    origin: wp.array2d(dtype=wp.vec3)
    rolling: wp.array2d(dtype=float)
    """Speed at which the bodies roll on each other [rad/s], [E, k]."""
    jacobian: wp.array3d(dtype=float)
    """[E, 3k, nv]"""
    at_contact: wp.array2d(dtype=int)
    """1 of patches whose origin follows the contact forces [E, k]."""
    fault: wp.array2d(dtype=int)
    """Faults of the places of the patches, as those of `placing` [E, k]."""
    held: wp.array2d(dtype=wp.vec3)
    """Origins at the beginning of the step in the frames of the sites; 0 for none [E, k]."""
    centre: wp.array2d(dtype=wp.vec3)
    """Origins in the step [E, k]."""
    before: wp.array2d(dtype=wp.vec3)
    """x axes at the beginning of the step in the frames of the sites; 0 before the first contact [E, k]."""
    axis: wp.array2d(dtype=wp.vec3)
    """x axes in the step [E, k]."""
    drift: wp.array2d(dtype=wp.vec3)
    """Twists of the surfaces relative to the bodies, and what points move beyond their velocities, per dt: of the own
    one less those of the other [E, k]."""


Places = wp.struct(
    type("Places", (), {"__annotations__": dict.fromkeys(Memory._fields, int)})
)
"""Places of what patches remember (see `Memory`)."""


@wp.kernel(enable_backward=False)
def recall(
    patches: PatchArrays,
    at: Places,
    host: Host,
    frames: Frames,
    problem: ContactSolveArrays,
    memory: wp.array2d(dtype=float),
):
    """Bring states, guesses and origins to the times of the worlds: those of the last step's end, or of its start."""
    w = wp.tid()
    time = host.time[w]
    goes_on = time == memory[w, at.next]
    if goes_on or time != memory[w, at.time]:
        for i in range(patches.states + 9 * patches.count):
            memory[w, at.before + i] = wp.where(goes_on, memory[w, at.axis + i], 0.0)
    memory[w, at.time] = time
    memory[w, at.next] = time + host.timestep[w % host.timestep.shape[0]]
    for i in range(patches.states):
        problem.state[w, i] = memory[w, at.state + i]
    for p in range(patches.count):
        first = at.held + 3 * p
        frames.held[w, p] = wp.vec3(
            memory[w, first], memory[w, first + 1], memory[w, first + 2]
        )
        first = at.before + 3 * p
        frames.before[w, p] = wp.vec3(
            memory[w, first], memory[w, first + 1], memory[w, first + 2]
        )
        for i in range(3):
            problem.guess[w, p, i] = memory[w, at.guess + 3 * p + i]


@wp.func
def jacobian_of(
    host: Host, w: int, point: wp.vec3, body: int, dof: int
) -> wp.spatial_vector:
    """Return the velocity of a point of a body, and its spin, by a degree of freedom."""
    if host.ancestor[body, dof] == 0:
        return wp.spatial_vector()
    axis = host.axis[w, dof]
    turn = wp.spatial_top(axis)
    move = wp.spatial_bottom(axis) + wp.cross(
        turn, point - host.centre[w, host.root[body]]
    )
    return wp.spatial_vector(move, turn)


@wp.func
def axis_of(turned: wp.mat33, i: int) -> wp.vec3:
    """Return an axis of a frame in the world."""
    return wp.vec3(turned[0, i], turned[1, i], turned[2, i])


@wp.func
def across_of(vector: wp.vec3, normal: wp.vec3) -> wp.vec3:
    """Return the part of a vector across the normal."""
    return vector - wp.dot(vector, normal) * normal


@wp.func
def drift_of(
    frame: wp.mat33, away: wp.vec3, surface: wp.spatial_vector, axes: wp.mat33
) -> wp.vec3:
    """Return the twist of the surface of a geom relative to it, at a place away from its origin, in some axes."""
    turn = frame * wp.spatial_bottom(surface)
    move = axes * (frame * wp.spatial_top(surface) + wp.cross(turn, away))
    return wp.vec3(
        move[0], move[1], wp.dot(wp.vec3(axes[2, 0], axes[2, 1], axes[2, 2]), turn)
    )


@wp.func
def touch(patches: PatchArrays, host: Host, frames: Frames, w: int, p: int, nefc: int):
    """Mark the rows of a patch's contacts; return the sums of their normals and places, and their number."""
    normal = wp.vec3()
    middle = wp.vec3()
    count = int(0)
    for r in range(nefc):
        if host.type[w, r] == FRICTIONLESS:
            c = host.id[w, r]
            geoms = host.geom[c]
            sign = float(0.0)
            if geoms[0] == patches.other[p] and geoms[1] == patches.own[p]:
                sign = 1.0
            if geoms[1] == patches.other[p] and geoms[0] == patches.own[p]:
                sign = -1.0
            if sign != 0.0:
                frames.owner[w, r] = p
                frame = host.frame[c]
                normal += sign * wp.vec3(frame[0, 0], frame[0, 1], frame[0, 2])
                middle += host.pos[c]
                count += 1
    return normal, middle, count


@wp.func
def is_curved(
    patches: PatchArrays, host: Host, w: int, p: int, normal: wp.vec3
) -> bool:
    """Return True if a patch lies on a curved side, of either geom."""
    sides = patches.curved[p]
    if (sides & wp.static(placing.ROUND)) != 0:
        return True
    own = across(axis_of(host.geom_xmat[w, patches.own[p]], 2), normal)
    other = across(axis_of(host.geom_xmat[w, patches.other[p]], 2), normal)
    if (sides & wp.static(placing.OWN)) != 0 and own > wp.static(placing.CURVED):
        return True
    return (sides & wp.static(placing.OTHER)) != 0 and other > wp.static(placing.CURVED)


@wp.func
def carry(
    patches: PatchArrays,
    problem: ContactSolveArrays,
    w: int,
    p: int,
    cosine: float,
    sine: float,
):
    """Write bristles and guess of a patch in its axes of this step instead of the last ones, if there are any."""
    if cosine != 1.0 or sine != 0.0:
        fx = problem.guess[w, p, 0]
        fy = problem.guess[w, p, 1]
        problem.guess[w, p, 0] = cosine * fx + sine * fy
        problem.guess[w, p, 1] = cosine * fy - sine * fx
        for i in range(patches.bristles[p]):
            one = patches.first[p] + i
            two = one + patches.bristles[p]
            zx = problem.state[w, one]
            zy = problem.state[w, two]
            problem.state[w, one] = cosine * zx + sine * zy
            problem.state[w, two] = cosine * zy - sine * zx


@wp.func
def write_rows(
    patches: PatchArrays,
    host: Host,
    frames: Frames,
    problem: ContactSolveArrays,
    w: int,
    p: int,
    origin: wp.vec3,
    axes: wp.mat33,
) -> wp.vec3:
    """Write the Jacobian of a patch, add its guess to the passive forces, and return the spin in its axes."""
    tilt = wp.vec3()
    w_x = problem.guess[w, p, 0]
    w_y = problem.guess[w, p, 1]
    w_spin = problem.guess[w, p, 2]
    for i in range(frames.jacobian.shape[2]):
        both = jacobian_of(host, w, origin, patches.owner[p], i)
        both -= jacobian_of(host, w, origin, patches.support[p], i)
        move = axes * wp.spatial_top(both)
        turn = axes * wp.spatial_bottom(both)
        frames.jacobian[w, 3 * p, i] = move[0]
        frames.jacobian[w, 3 * p + 1, i] = move[1]
        frames.jacobian[w, 3 * p + 2, i] = turn[2]
        tilt += host.qvel[w, i] * turn
        host.passive[w, i] = (
            host.passive[w, i] + move[0] * w_x + move[1] * w_y + turn[2] * w_spin
        )
    return tilt


@wp.kernel(enable_backward=False)
def place(
    patches: PatchArrays, host: Host, frames: Frames, problem: ContactSolveArrays
):
    """Write the frames of the patches, the Jacobian of their twists, and add the guesses to the passive forces."""
    w = wp.tid()
    nv = frames.jacobian.shape[2]
    nefc = wp.min(host.nefc[w], frames.owner.shape[1])
    for r in range(nefc):
        frames.owner[w, r] = -1
    for p in range(patches.count):
        normal, middle, count = touch(patches, host, frames, w, p, nefc)
        frames.touching[w, p] = count
        frames.axis[w, p] = frames.before[w, p]
        frames.drift[w, p] = wp.vec3()
        if count == 0:
            for j in range(3):
                problem.guess[w, p, j] = 0.0
                for i in range(nv):
                    frames.jacobian[w, 3 * p + j, i] = 0.0
            continue
        normal = wp.normalize(normal)
        middle = middle / float(count)
        site = patches.site[p]
        turned = host.site_xmat[w, site]
        one = across_of(axis_of(turned, 0), normal)
        two = across_of(axis_of(turned, 1), normal)
        last = across_of(turned * frames.before[w, p], normal)
        x_0, x_1, x_2, cosine, sine = x_axis(one, two, last, normal)
        x = wp.vec3(x_0, x_1, x_2)
        axes = wp.matrix_from_rows(x, wp.cross(normal, x), normal)
        frames.axis[w, p] = wp.transpose(turned) * x
        carry(patches, problem, w, p, cosine, sine)
        origin = host.site_xpos[w, site]
        held = frames.held[w, p]
        curved = is_curved(patches, host, w, p, normal)
        centre = patches.centre[p]
        frames.at_contact[w, p] = 0
        if centre == wp.static(placing.AT_CONTACT) or (
            centre == wp.static(placing.AUTO) and curved
        ):
            frames.at_contact[w, p] = 1
            if held[0] == 0.0 and held[1] == 0.0 and held[2] == 0.0:
                origin = middle
            else:
                origin += turned * held
        frames.fault[w, p] = 0
        if not curved and across(axis_of(turned, 0), normal) < wp.static(
            placing.MARGIN**2
        ):
            frames.fault[w, p] = wp.static(placing.ALONG_X)
        o_x, o_y, o_z = onto_plane(origin, middle, normal)
        origin = wp.vec3(o_x, o_y, o_z)
        own = patches.own[p]
        other = patches.other[p]
        drift = drift_of(
            host.geom_xmat[w, own],
            origin - host.geom_xpos[w, own],
            patches.surface[p, 0],
            axes,
        )
        drift -= drift_of(
            host.geom_xmat[w, other],
            origin - host.geom_xpos[w, other],
            patches.surface[p, 1],
            axes,
        )
        frames.drift[w, p] = drift
        tilt = write_rows(patches, host, frames, problem, w, p, origin, axes)
        frames.rolling[w, p] = wp.sqrt(tilt[0] * tilt[0] + tilt[1] * tilt[1])
        frames.axes[w, p] = axes
        frames.origin[w, p] = origin
        for r in range(nefc):
            if frames.owner[w, r] == p:
                away = axes * (host.pos[host.id[w, r]] - origin)
                frames.lever[w, r] = wp.vec2(away[0], away[1])
