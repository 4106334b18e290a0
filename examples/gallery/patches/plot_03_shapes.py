"""
Six shapes and their contact radius
===================================

The contact radius is the mean distance of the load from its centre. It says how much
torque a patch has for its force, and it differs by a factor of two and more among
shapes of the same area.
"""

import matplotlib.pyplot as plt
import numpy as np

import planarfriction as pf

plt.style.use("planarfriction.plots.print")

area = 1e-4  # of each [m^2]
side = np.sqrt(area)
patches = [
    pf.ContactPatch.disc(np.sqrt(area / np.pi), name="disc"),
    pf.ContactPatch.rectangle(side, name="square"),
    pf.ContactPatch.rectangle(3 * side, side / 3, cells=(63, 7), name="strip"),
    pf.ContactPatch.ring(np.sqrt(area / np.pi), np.sqrt(2 * area / np.pi), name="ring"),
    pf.ContactPatch.polygon(
        side * np.array([[0, 0], [1.52, 0], [0, 1.52]]), name="triangle"
    ),
    pf.ContactPatch.points(
        1.1 * side * np.array([[1, 0], [-0.5, 0.866], [-0.5, -0.866]]),
        name="three feet",
    ),
]

# %%
# Cells as dots, the contact radius as a circle:
figure, axes = plt.subplots(
    2, 3, figsize=(8.5, 5.4), layout="constrained", sharex=True, sharey=True
)
for ax, patch in zip(axes.flat, patches, strict=True):
    at = 1e3 * (patch.positions - patch.centre_of_pressure())
    size, radius = 600 * patch.weights() ** 0.5, 1e3 * patch.contact_radius()
    ax.scatter(*at.T, s=size, color="0.6", edgecolor="none")
    ax.add_patch(
        plt.Circle((0, 0), radius, fill=False, color="black", ls="--", zorder=3)
    )
    ax.set(title=f"{patch.name}: {radius:.1f} mm", aspect="equal")
figure.supxlabel("x [mm], dashed: contact radius")

# %%
# A disc of radius R has 2R/3.
disc = patches[0]
assert abs(disc.contact_radius() / np.sqrt(area / np.pi) - 2 / 3) < 2e-3
