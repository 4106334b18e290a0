"""
Discretization error: steps of a sum over cells
===============================================

Sum the friction over points, and each point that the centre of rotation crosses turns
its force round: the wrench moves in steps. Integrated exactly, it is smooth; over cells
that are small discs nearly so.
"""

import dataclasses

import matplotlib.pyplot as plt
import numpy as np

import planarfriction as pf

plt.style.use("planarfriction.plots.print")

line = pf.ContactPatch.line(0.02, cells=9)
points = dataclasses.replace(line, radii=None)
centres = np.linspace(-0.012, 0.012, 601)  # of rotation, along the line
# about (0, y): vx = y omega
twists = np.stack([centres, np.zeros_like(centres), np.ones_like(centres)], axis=1)

# %%
# Four ways to the same wrench:
figure, ax = plt.subplots(figsize=(6.0, 3.6), layout="constrained")
for name, style, surface in (
    ("sum over 9 points", "-", pf.LimitSurfaceCells(points)),
    ("sum over 9 discs", "-", pf.LimitSurfaceCells(line)),
    ("exact", "-", pf.LimitSurfaceExact(line)),
    ("table of the exact surface", "k:", pf.LimitSurfaceTable(line)),
):
    ax.plot(1e3 * centres, surface.wrench(twists)[:, 0], style, label=name)
ax.set(xlabel="centre of rotation, y [mm]", ylabel="fx over mu f_N [-]")
ax.legend()

# %%
# Exact: the force is the share of the line on one side less that on the other.
exact = pf.LimitSurfaceExact(line).wrench((0.004, 0.0, 1.0))[0]
print(exact)
assert abs(exact + 0.4) < 1e-9
