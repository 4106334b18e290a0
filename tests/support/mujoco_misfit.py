"""Results of a step of MuJoCo, from its contacts and velocities, compared with the solved step."""

from __future__ import annotations

import mujoco
import numpy as np


def twists_and_loads(friction, d) -> tuple[np.ndarray, np.ndarray]:
    """Return twists `[k, 3]` and loads `[k]` of all patches after a step; positions in the data are those before it."""
    m, k = friction.m, len(friction.patches)
    twists, loads = np.zeros((k, 3)), np.zeros(k)
    for p, placed in enumerate(friction.placed):
        chosen, _ = placed.contacts(d)
        if not len(chosen):
            continue
        centre, axes = friction.frame(d, p)
        loads[p] = d.efc_force[d.contact.efc_address[chosen]].sum()
        for side, body in zip((-1.0, 1.0), (placed.support, placed.owner), strict=True):
            moves, turns = np.zeros((3, m.nv)), np.zeros((3, m.nv))
            mujoco.mj_jac(m, d, moves, turns, centre, body)
            twists[p] += side * np.array([*(axes[:2] @ moves @ d.qvel), axes[2] @ turns @ d.qvel])
    return twists, loads


def misfit(friction, d) -> float:
    """Largest difference of twists [m/s], spins at a lever arm of 1 cm, and of loads in thousands of newtons."""
    twists, loads = twists_and_loads(friction, d)
    missed = abs(twists - friction.twists(d)) * [1.0, 1.0, 0.01]
    return max(missed.max(), 1e-3 * abs(loads - friction.loads(d)).max())


def step_checked(friction, d, most: float) -> None:
    """A step after which nothing misfits by more than `most`."""
    friction.step(d)
    assert friction.report(d).converged
    assert misfit(friction, d) <= most, d.time
