"""
Where a pushed object turns
===========================

Push a square through a point of its edge and it turns about a centre that depends on
where you push. The way back through the limit surface, from a wrench to its twist, says
where.
"""

import matplotlib.pyplot as plt
import numpy as np

import planarfriction as pf

box = pf.ContactPatch.rectangle(0.1)
surface = pf.LimitSurfaceExact(box)
# Pushed upwards at the lower edge, at these distances from its middle:
offsets = np.linspace(0.004, 0.05, 24)
pushes = np.stack([np.zeros_like(offsets), np.ones_like(offsets), offsets], axis=1)
twists = surface.twist(-pushes)
centres = np.stack([-twists[:, 1], twists[:, 0]], axis=1) / twists[:, 2:]

# %%
# Where it is pushed (triangles), and what it then turns about (dots of the same
# colour):
figure, ax = plt.subplots(figsize=(6.4, 3.4), layout="constrained")
ax.add_patch(plt.Rectangle((-50, -50), 100, 100, fill=False))
points = ax.scatter(*1e3 * centres.T, c=1e3 * offsets, cmap="viridis")
ax.scatter(
    1e3 * offsets,
    np.full_like(offsets, -50),
    c=1e3 * offsets,
    cmap="viridis",
    marker="^",
)
ax.set(
    xlim=(-330, 80), ylim=(-70, 70), aspect="equal", xlabel="x [mm]", ylabel="y [mm]"
)
figure.colorbar(points, label="push at x [mm]", shrink=0.8)

# %%
# The further off the middle, the nearer the centre of rotation; it stays on the line
# across the push.
print(f"pushed at 50 mm, it turns about x = {1e3 * centres[-1, 0]:.1f} mm")
assert np.all(np.diff(centres[:, 0]) > 0.0) and np.abs(centres[:, 1]).max() < 1e-6
