"""
Section of a limit surface: force and torque
============================================

The more a patch spins while it slides, the less force is left, and the more torque.
Each shape trades them along its own curve; the ellipse is a circle here.
"""

import matplotlib.pyplot as plt
import numpy as np

import planarfriction as pf
from planarfriction.plots import style

plt.style.use("planarfriction.plots.print")

patches = {
    "disc": pf.ContactPatch.disc(0.01),
    "square": pf.ContactPatch.rectangle(0.02),
    "ring": pf.ContactPatch.ring(0.008, 0.01, cells=41),
    "two feet, across": pf.ContactPatch.points([[0.01, 0.0], [-0.01, 0.0]]),
}

# %%
# From pure sliding to pure spin, in steps of a degree:
mix = np.linspace(0.0, np.pi / 2, 91)
figure, ax = plt.subplots(figsize=(5.2, 4.6), layout="constrained")
for name, patch in patches.items():
    r = patch.contact_radius()
    twists = np.stack([np.zeros_like(mix), np.cos(mix), np.sin(mix) / r], axis=1)
    surface = (
        pf.LimitSurfaceCells(patch) if "feet" in name else pf.LimitSurfaceExact(patch)
    )
    wrench = -surface.wrench(twists)
    ax.plot(wrench[:, 1], wrench[:, 2] / r, label=name)
ax.plot(np.cos(mix), np.sin(mix), "-.", color=style.ELLIPSOID, label="ellipsoid")
ax.set(
    xlabel="force over mu f_N [-]", ylabel="torque over mu f_N r [-]", aspect="equal"
)
ax.legend()

# %%
# Pure sliding has all the force, pure spin all the torque.
surface = pf.LimitSurfaceExact(patches["disc"])
assert abs(surface.wrench((0.0, 1.0, 0.0))[1] + 1.0) < 1e-9
assert abs(surface.wrench((0.0, 0.0, 1.0))[2] / surface.contact_radius + 1.0) < 1e-9
