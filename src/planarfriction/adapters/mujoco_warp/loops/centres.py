"""Origins of patches that follow the contact forces, and patches beside these, in the worlds of MuJoCo Warp.

As `planarfriction.adapters.mujoco.loops.centres`, one thread a world.
"""

# No `from __future__ import annotations` here: Warp reads the types themselves.

import warp as wp

from planarfriction._engine.coupled import placing
from planarfriction.adapters.mujoco.loops.centres import FOLLOWS
from planarfriction.adapters.mujoco_warp.loops.geometry import (
    ContactSolveArrays,
    Frames,
    Host,
    PatchArrays,
)

excess = wp.func(placing.excess)


@wp.func
def speed_of(host: Host, frames: Frames, w: int, p: int) -> float:
    """Return the speed at which a patch slides [m/s]."""
    v = wp.vec2(frames.drift[w, p][0], frames.drift[w, p][1])
    for i in range(frames.jacobian.shape[2]):
        v += host.qvel[w, i] * wp.vec2(
            frames.jacobian[w, 3 * p, i], frames.jacobian[w, 3 * p + 1, i]
        )
    return wp.length(v)


@wp.kernel(enable_backward=False)
def follow_centres(
    patches: PatchArrays,
    host: Host,
    frames: Frames,
    problem: ContactSolveArrays,
    parameters: wp.array2d(dtype=float),
):
    """Move origins towards the centres of the contact forces, as far as bodies move on each other, and note them.

    Note patches that lie beside these forces, too.
    """
    w = wp.tid()
    nefc = wp.min(host.nefc[w], frames.owner.shape[1])
    for p in range(patches.count):
        frames.centre[w, p] = wp.vec3()
        if frames.touching[w, p] == 0:
            frames.fault[w, p] = 0
            continue
        total = float(0.0)
        sum = wp.vec2()
        for r in range(nefc):
            if frames.owner[w, r] == p:
                total += host.force[w, r]
                sum += host.force[w, r] * frames.lever[w, r]
        if total <= 0.0:
            frames.fault[w, p] = 0
        elif frames.at_contact[w, p] == 0:
            scale = parameters[w % parameters.shape[0], patches.scale[p]]
            e_x, e_y = excess(sum[0] / total, sum[1] / total, scale, patches.reach[p])
            if wp.max(e_x, e_y) > 0.0:
                frames.fault[w, p] = wp.static(placing.BEYOND)
        else:
            held = frames.held[w, p]
            share = float(1.0)
            if held[0] != 0.0 or held[1] != 0.0 or held[2] != 0.0:
                rate = frames.rolling[w, p]
                if patches.radius[p] > 0.0:
                    rate += speed_of(host, frames, w, p) / patches.radius[p]
                share = wp.min(
                    1.0,
                    host.timestep[w % host.timestep.shape[0]]
                    * rate
                    / wp.static(FOLLOWS),
                )
            move = (share / total) * sum
            for i in range(frames.jacobian.shape[2]):
                spin = frames.jacobian[w, 3 * p + 2, i]
                frames.jacobian[w, 3 * p, i] = (
                    frames.jacobian[w, 3 * p, i] - move[1] * spin
                )
                frames.jacobian[w, 3 * p + 1, i] = (
                    frames.jacobian[w, 3 * p + 1, i] + move[0] * spin
                )
            drift = frames.drift[w, p]
            frames.drift[w, p] = drift + drift[2] * wp.vec3(-move[1], move[0], 0.0)
            guess = (
                problem.guess[w, p, 2]
                - move[0] * problem.guess[w, p, 1]
                + move[1] * problem.guess[w, p, 0]
            )
            problem.guess[w, p, 2] = guess
            for r in range(nefc):
                if frames.owner[w, r] == p:
                    frames.lever[w, r] = frames.lever[w, r] - move
            axes = frames.axes[w, p]
            frames.origin[w, p] = frames.origin[w, p] + wp.transpose(axes) * wp.vec3(
                move[0], move[1], 0.0
            )
        site = patches.site[p]
        frames.centre[w, p] = wp.transpose(host.site_xmat[w, site]) * (
            frames.origin[w, p] - host.site_xpos[w, site]
        )
