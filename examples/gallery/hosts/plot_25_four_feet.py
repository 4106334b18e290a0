"""
A box on four feet in a custom time-stepping loop
=================================================

A host that steps bodies finds the wrenches of all its patches in one implicit call,
stable at any time step. A box on four feet is pushed and turned, at time steps from 1
to 20 ms.
"""

import matplotlib.pyplot as plt
import numpy as np

import planarfriction as pf
from planarfriction.coupling import CoupledPatches, HostStep

plt.style.use("planarfriction.plots.print")

feet = [(0.05, 0.03), (0.05, -0.03), (-0.05, 0.03), (-0.05, -0.03)]
mass = np.array([0.2, 0.2, 2e-4])
J = np.concatenate([[[1.0, 0.0, -y], [0.0, 1.0, x], [0.0, 0.0, 1.0]] for x, y in feet])
foot = pf.ReducedModel(
    pf.ContactPatch.disc(0.005, cells=11),
    pf.LuGre(mu_c=0.5, mu_s=0.5, elasto_plastic=0.9),
)
patches = CoupledPatches([foot] * 4)


# %%
# A step of the host: the velocity without friction, the response of the box to wrenches
# on its feet, and one call for all four feet.
def path(dt):
    """Positions of the box `[T, 2]` over 0.4 s."""
    bristles, wrench = patches.rest(), np.zeros((4, 3))
    velocity, pose = np.zeros(3), np.zeros(3)
    response, places = dt * J @ np.diag(1.0 / mass) @ J.T, [pose[:2].copy()]
    for k in range(round(0.4 / dt)):
        angle = pose[2] + 0.5 * dt * velocity[2]
        push = np.array([1.5, 0.2, 0.05]) if k * dt < 0.2 else np.zeros(3)
        pushed = pf.geometry.rotate(velocity + dt * push / mass, -angle)
        free = pushed + dt * J.T @ wrench.ravel() / mass
        host = HostStep((J @ free).reshape(4, 3), np.full(4, 0.5), wrench, response)
        step = patches.step(bristles, host, dt)
        bristles, wrench, before = step.state, step.wrench, velocity
        velocity = pf.geometry.rotate(pushed + dt * J.T @ wrench.ravel() / mass, angle)
        pose = pose + 0.5 * dt * (before + velocity)
        places.append(pose[:2].copy())
    return np.array(places)


# %%
# The same push at three time steps:
figure, ax = plt.subplots(figsize=(6.4, 3.2), layout="constrained")
ends = []
for dt in (1e-3, 5e-3, 2e-2):
    places = path(dt)
    ends.append(places[-1])
    ax.plot(*1e3 * places.T, ".-" if dt > 1e-3 else "-", label=f"{1e3 * dt:g} ms")
ax.set(xlabel="x [mm]", ylabel="y [mm]")
ax.legend(title="time step")

# %%
# Twenty times the time step moves the end by a few per cent.
print(1e3 * np.array(ends))
assert np.linalg.norm(ends[2] - ends[0]) < 0.15 * np.linalg.norm(ends[0])
