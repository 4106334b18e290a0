"""Arcs along which points of patches move in a step of MuJoCo Warp, as a kernel, one thread a world."""

# No `from __future__ import annotations` here: Warp reads the types themselves.

import warp as wp

from planarfriction._engine.coupled import placing
from planarfriction.adapters.mujoco_warp.loops.geometry import Frames, Host, PatchArrays

gained = wp.func(placing.bend)


@wp.func
def motion_of(
    host: Host, w: int, point: wp.vec3, body: int, geom: int, surface: wp.spatial_vector
):
    """Return the velocity and spin of the surface of a geom at a point, and their rates without accelerations.

    The surface moves on the body: `v = v_b + u` and `a = a_b + (2 w_b + w) x u`, with `u = s + w x away`.
    """
    velocity = host.velocity[w, body]
    bend = wp.spatial_vector()
    for i in range(host.qvel.shape[1]):
        if host.ancestor[body, i] != 0:
            bend += host.qvel[w, i] * host.turned[w, i]
    spin = wp.spatial_top(velocity)
    away = point - host.centre[w, host.root[body]]
    v = wp.spatial_bottom(velocity) + wp.cross(spin, away)
    a = (
        wp.spatial_bottom(bend)
        + wp.cross(wp.spatial_top(bend), away)
        + wp.cross(spin, v)
    )
    frame = host.geom_xmat[w, geom]
    turn = frame * wp.spatial_bottom(surface)
    u = frame * wp.spatial_top(surface) + wp.cross(
        turn, point - host.geom_xpos[w, geom]
    )
    rate = wp.spatial_vector(
        a + wp.cross(2.0 * spin + turn, u), wp.spatial_top(bend) + wp.cross(spin, turn)
    )
    return wp.spatial_vector(v + u, spin + turn), rate


@wp.func
def over_centre(host: Host, w: int, move: wp.vec3, body: int, geom: int) -> wp.vec3:
    """Return a velocity less that of the centre of a geom on a body."""
    velocity = host.velocity[w, body]
    away = host.geom_xpos[w, geom] - host.centre[w, host.root[body]]
    return move - wp.spatial_bottom(velocity) - wp.cross(wp.spatial_top(velocity), away)


@wp.kernel(enable_backward=False)
def bend(patches: PatchArrays, host: Host, frames: Frames):
    """Add to the drifts what patches move in the step, per dt, beyond their twists at its velocities.

    Points of what turns go along arcs: to second order, `x_1 - x_0 = dt J v + dt^2 / 2 Jdot v`. The contact moves on,
    and its normal turns (see `placing.bend`).
    """
    w = wp.tid()
    dt = host.timestep[w % host.timestep.shape[0]]
    for p in range(patches.count):
        if frames.touching[w, p] == 0:
            continue
        point = frames.origin[w, p]
        axes = frames.axes[w, p]
        own, own_rate = motion_of(
            host, w, point, patches.owner[p], patches.own[p], patches.surface[p, 0]
        )
        other, other_rate = motion_of(
            host, w, point, patches.support[p], patches.other[p], patches.surface[p, 1]
        )
        rate = 0.5 * dt * (own_rate - other_rate)
        normal = wp.vec3(axes[2, 0], axes[2, 1], axes[2, 2])
        apart = wp.dot(normal, wp.spatial_top(own - other - rate))
        over = over_centre(
            host, w, wp.spatial_top(own), patches.owner[p], patches.own[p]
        )
        if patches.carrier[p] != patches.own[p]:
            over = over_centre(
                host, w, wp.spatial_top(other), patches.support[p], patches.other[p]
            )
        tilt = wp.spatial_bottom(own - other)
        x, y, z = gained(
            over, tilt, wp.spatial_bottom(own + other), normal, apart, -1.0, dt
        )
        move = axes * (wp.spatial_top(rate) + wp.vec3(x, y, z))
        turn = wp.dot(normal, wp.spatial_bottom(rate))
        frames.drift[w, p] = frames.drift[w, p] + wp.vec3(move[0], move[1], turn)
