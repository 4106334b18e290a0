"""
A thousand contacts at once
===========================

Leading axes are batches: a thousand random twists from one state are one call. Their
wrenches lie on the limit surface, seen from the side here.
"""

import matplotlib.pyplot as plt
import numpy as np

import planarfriction as pf
from planarfriction.plots import style

plt.style.use("planarfriction.plots.print")

patch = pf.ContactPatch.rectangle(0.02)
law = pf.LuGre(mu_c=0.5, mu_s=0.5, sigma_2=0.0, elasto_plastic=0.9)
model = pf.ReducedModel(patch, law)
twists = np.random.default_rng(0).normal(size=(1000, 3)) * (0.02, 0.02, 3.0)
_, wrenches = model.step(model.rest(), twists, 2.0, 0.1)

# %%
# Force against torque of all of them; dotted, the ellipsoid:
r = patch.contact_radius()
force = np.hypot(wrenches[:, 0], wrenches[:, 1])
figure, ax = plt.subplots(figsize=(4.6, 4.4), layout="constrained")
ax.scatter(force, wrenches[:, 2] / r, s=4)
angle = np.linspace(-np.pi / 2, np.pi / 2, 100)
ax.plot(np.cos(angle), np.sin(angle), "-.", color=style.ELLIPSOID, label="ellipsoid")
ax.set(aspect="equal", xlabel="force [N]", ylabel="torque over contact radius [N]")
ax.legend()

# %%
# No force exceeds mu f_N = 1 N, no torque mu f_N r, and all take energy out.
assert force.max() < 1.001 and np.abs(wrenches[:, 2] / r).max() < 1.001
assert np.all((wrenches * twists).sum(axis=1) < 0.0)
