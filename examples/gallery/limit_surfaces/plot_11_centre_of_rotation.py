"""
Centre of rotation of a pushed object
=====================================

Push a square through a point of its edge and it turns about a centre that depends on
where you push. The way back through the limit surface, from a wrench to its twist, says
where.
"""

import matplotlib.pyplot as plt
import numpy as np

import planarfriction as pf
from planarfriction.plots import style, symbols

plt.style.use("planarfriction.plots.print")

box = pf.ContactPatch.rectangle(0.1)
surface = pf.LimitSurfaceExact(box)
# Pushed upwards at the lower edge, at these distances from its middle:
offsets = np.linspace(0.004, 0.05, 24)
pushes = np.stack([np.zeros_like(offsets), np.ones_like(offsets), offsets], axis=1)
twists = surface.twist(-pushes)
centres = np.stack([-twists[:, 1], twists[:, 0]], axis=1) / twists[:, 2:]

# %%
# Three of these pushes, as hollow arrows, and what the box then turns about:
figure, ax = plt.subplots(figsize=(6.4, 2.6), layout="constrained")
ax.add_patch(plt.Rectangle((-50, -50), 100, 100, fc=style.BODY, ec="0.4"))
ax.plot(*1e3 * centres.T, color="0.6", zorder=1)
for k in (1, 6, 23):
    x, at = 1e3 * centres[k, 0], 1e3 * offsets[k]
    symbols.load(ax, (at, -85), (0, 33))
    symbols.centre_of_rotation(ax, (x, 0))
    ax.annotate(f"{at:.0f} mm", (x, 9), ha="center")
    ax.annotate(f"{at:.0f}", (at, -48), ha="center")
ax.set(xlim=(-330, 80), ylim=(-90, 60), aspect="equal", xlabel="x [mm]")
ax.set_ylabel("y [mm]")

# %%
# The further off the middle, the nearer the centre of rotation; it stays on the line
# across the push.
print(f"pushed at 50 mm, it turns about x = {1e3 * centres[-1, 0]:.1f} mm")
assert np.all(np.diff(centres[:, 0]) > 0.0) and np.abs(centres[:, 1]).max() < 1e-6
