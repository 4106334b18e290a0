"""
Friction along and across grooves
=================================

A grooved sole slides more easily along its grooves. Friction is then not opposite to
the motion: it leans away from the grooves, and so pushes the sole towards them.
"""

import matplotlib.pyplot as plt
import numpy as np

import planarfriction as pf

plt.style.use("planarfriction.plots.print")

metric = pf.friction_metric(np.radians(40.0), along=0.5, across=1.0)
sole = pf.ContactPatch.rectangle(0.06, 0.04, 9).with_friction_metric(metric)
heading = np.radians(np.arange(0, 360, 5))
twists = np.stack([np.cos(heading), np.sin(heading), 0 * heading], axis=1)
wrench = pf.LimitSurfaceCells(sole).wrench(twists)

# %%
# Each arrow is the friction, with its sign reversed, of sliding along the grey line
# beside it:
figure, ax = plt.subplots(figsize=(5.0, 5.0), layout="constrained")
ax.plot(-wrench[:, 0], -wrench[:, 1], label="friction, sign reversed")
for i in range(0, 72, 6):
    ax.annotate(
        "",
        xytext=(0, 0),
        xy=-wrench[i, :2],
        arrowprops={"arrowstyle": "->", "color": "tab:blue"},
    )
    ax.plot(
        [0, 1.1 * twists[i, 0]], [0, 1.1 * twists[i, 1]], color="0.7", linewidth=0.8
    )
ax.plot([], [], color="0.7", label="direction of sliding")
ax.set(aspect="equal", xlabel="fx over mu f_N [-]", ylabel="fy over mu f_N [-]")
ax.legend(loc="upper left")

# %%
# Along the grooves half of the friction is left.
along = np.array([np.cos(np.radians(40)), np.sin(np.radians(40)), 0.0])
print(pf.LimitSurfaceCells(sole).dissipation(along))
assert abs(pf.LimitSurfaceCells(sole).dissipation(along) - 0.5) < 1e-12
