"""Results of a step of MuJoCo, from its contacts and velocities, compared with the solved step."""

from __future__ import annotations

import mujoco
import numpy as np


def twists_and_loads(friction, d, before) -> tuple[np.ndarray, np.ndarray]:
    """Return twists `[k, 3]` and loads `[k]` of all patches after a step; positions in the data are those before it.

    Twists are means of the step: what turns adds half of what it gains at the velocities `before`.
    """
    m = friction.m
    k = len(friction.patches)
    dt = friction.m.opt.timestep
    at = friction._memory
    twists = np.zeros((k, 3))
    loads = np.zeros(k)
    for p, placed in enumerate(friction.placed):
        chosen, _ = placed.contacts(d)
        if not len(chosen):
            continue
        centre, axes = friction.frame(d, p)
        loads[p] = d.efc_force[d.contact.efc_address[chosen]].sum()
        # origins that follow the contact moved in its plane after velocities were known
        held, now = (d.userdata[first + 3 * p :][:3] for first in (at.held, at.centre))
        went = (
            d.site_xmat[placed.site].reshape(3, 3) @ (now - held)
            if held.any()
            else np.zeros(3)
        )
        shift = friction.parameters(d.model)
        went += shift["centre_x"][p] * axes[0] + shift["centre_y"][p] * axes[1]
        went -= (axes[2] @ went) * axes[2]
        begin = centre - went
        velocities = []
        spins = []
        gain = np.zeros(3)
        apart = 0.0
        for side, body in zip((1.0, -1.0), (placed.owner, placed.support), strict=True):
            moves, turns, gains, gained = np.zeros((4, 3, m.nv))
            mujoco.mj_jac(m, d, moves, turns, centre, body)
            twists[p] += side * np.array(
                [*(axes[:2] @ moves @ d.qvel), axes[2] @ turns @ d.qvel]
            )
            mujoco.mj_jac(m, d, moves, None, begin, body)
            mujoco.mj_jacDot(m, d, gains, gained, begin, body)
            velocities.append(moves @ before)
            spins.append(turns @ before)
            gain += side * np.array(
                [*(axes[:2] @ gains @ before), axes[2] @ gained @ before]
            )
            apart += side * axes[2] @ (moves - 0.5 * dt * gains) @ before
        # the contact goes along with the smaller geom: over its surface, and away from it
        goes = 0 if placed.carrier == placed.own else 1
        body = (placed.owner, placed.support)[goes]
        spin = spins[0] - spins[1]
        mujoco.mj_jac(m, d, moves, None, d.geom_xpos[placed.carrier], body)
        over = velocities[goes] - moves @ before
        over -= (axes[2] @ over) * axes[2]
        moved = np.cross(over, spin)
        # what has left in the last step, leaves along the normal, which turns with both bodies
        apart -= 0.5 * dt * axes[2] @ moved
        moved += apart * np.cross(axes[2], spins[0] + spins[1])
        gain[:2] += axes[:2] @ (np.cross(gain[2] * axes[2], went) + moved)
        twists[p] += 0.5 * dt * gain
    return twists, loads


def misfit(friction, d, before) -> float:
    """Largest difference of twists [m/s], spins at a lever arm of 1 cm, and of loads in thousands of newtons."""
    twists, loads = twists_and_loads(friction, d, before)
    missed = abs(twists - friction.twists(d)) * [1.0, 1.0, 0.01]
    return max(missed.max(), 1e-3 * abs(loads - friction.loads(d)).max())


def step_checked(friction, d, most: float) -> None:
    """A step after which nothing misfits by more than `most`."""
    before = d.qvel.copy()
    friction.step(d)
    assert friction.report(d).converged
    assert misfit(friction, d, before) <= most, d.time
