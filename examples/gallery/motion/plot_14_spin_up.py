"""
Breakaway in pure rotation
==========================

Two pads at rest are turned together at a constant rate; of each the outer cells slip
first. One threshold for all is the approximation of three states; each of a few discs
has its own.
"""

import matplotlib.pyplot as plt
import numpy as np

import planarfriction as pf
from planarfriction.patch import PUBLISHED_PATCHES
from planarfriction.plots import style

plt.style.use("planarfriction.plots.print")

patch = PUBLISHED_PATCHES["NonConvex1"]().refined(3)
law = pf.LuGre(mu_c=1.0, mu_s=1.2, elasto_plastic=0.9)
models = {
    "distributed": pf.DistributedModel(patch, law),
    "reduced, 8 discs": pf.ReducedModel(patch, law, cells=8),
    "reduced": pf.ReducedModel(patch, law),
    "published reduced": pf.ReducedModelPublished(patch, law),
}

# %%
# The same spin for all four:
dt, twists = 2e-5, np.tile([0.0, 0.0, 0.02], (1500, 1))
time = dt * np.arange(1, 1501)
figure, ax = plt.subplots(figsize=(6.4, 3.8), layout="constrained")
torque = {}
for name, model in models.items():
    torque[name] = -1e3 * pf.rollout(model, None, twists, 1.0, dt).wrenches[:, 2]
    colour = style.SHADES[0] if "8" in name else style.model_colour(model)
    ax.plot(1e3 * time, torque[name], color=colour, label=name)
ax.set(
    xlim=(5.0, 9.0), ylim=(8.5, 10.8), xlabel="time [ms]", ylabel="torque [N mm] at 1 N"
)
ax.legend()

# %%
# Largest distance from the distributed model:
error = {
    name: np.abs(each - torque["distributed"]).max() for name, each in torque.items()
}
print({name: f"{value:.2f} N mm" for name, value in error.items()})
assert error["reduced"] < error["reduced, 8 discs"] < 0.5 * error["published reduced"]
