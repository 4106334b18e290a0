"""
A few small discs instead of many cells
=======================================

24 discs stand for the 441 cells of a square, with the same load, centre and second
moment, and so with the same stiffness before sliding.
"""

import matplotlib.pyplot as plt

import planarfriction as pf

plt.style.use("planarfriction.plots.print")

patch = pf.ContactPatch.rectangle(0.02)
few = patch.discs(24)

# %%
# Cells as dots; the darker a disc, the more load it carries.
figure, ax = plt.subplots(figsize=(4.6, 4.6), layout="constrained")
ax.scatter(*1e3 * patch.positions.T, s=3, color="0.7")
for (x, y), radius, weight in zip(
    1e3 * few.positions, 1e3 * few.radii, few.weights(), strict=True
):
    ax.add_patch(plt.Circle((x, y), radius, alpha=8.0 * weight))
ax.set(aspect="equal", xlabel="x [mm]", ylabel="y [mm]")
ax.set_title(f"{few.cells} discs for {patch.cells} cells")

# %%
# How well they stand for the cells:
error = abs(few.contact_radius() / patch.contact_radius() - 1)
print(f"contact radius off by {100 * error:.2f} %")
assert few.cells <= 24 and abs(few.second_moment() / patch.second_moment() - 1) < 1e-9
assert error < 2e-3
