"""
The gradient of a rollout
=========================

How does the work of friction depend on each twist of a motion? One pass back through
the steps (the adjoint) says so for all of them; differences need a rollout for each.
"""

import matplotlib.pyplot as plt
import numpy as np

import planarfriction as pf
from planarfriction import derivatives

plt.style.use("planarfriction.plots.print")

patch = pf.ContactPatch.disc(0.01, cells=11)
model = pf.ReducedModel(patch, pf.LuGre(mu_c=1.0, mu_s=1.2, elasto_plastic=0.9))

# %%
# A motion to and fro, the forces of its steps, and one pass back through them:
dt, steps = 1e-3, 400
twists = np.outer(np.sin(np.linspace(0.0, 9.0, steps)), (0.01, 0.0, 1.0))
wrenches = pf.rollout(model, None, twists, 2.0, dt).wrenches
gradient = derivatives.rollout_vjp(
    model, model.rest(), twists, 2.0, dt, np.tile([1.0, 0.0, 0.0], (steps, 1))
)

# %%
# Above, the friction force over time. Below, how much the sum of all forces changes
# with the velocity at each instant:
figure, (upper, lower) = plt.subplots(
    2, 1, figsize=(6.4, 4.6), layout="constrained", sharex=True
)
upper.plot(dt * np.arange(steps), wrenches[:, 0])
upper.set(ylabel="fx [N]")
lower.plot(dt * np.arange(steps), gradient.twist[:, 0])
lower.set(xlabel="time [s]", ylabel="d sum(fx) / d vx [N s/m]")

# %%
# The same for one twist by a difference:
step, at = 1e-7, 150
sums = []
for sign in (1, -1):
    moved = twists.copy()
    moved[at, 0] += sign * step
    sums.append(pf.rollout(model, None, moved, 2.0, dt).wrenches[:, 0].sum())
difference = (sums[0] - sums[1]) / (2 * step)
print(difference, gradient.twist[at, 0])
assert abs(difference - gradient.twist[at, 0]) < 1e-3 * abs(gradient.twist[:, 0]).max()
