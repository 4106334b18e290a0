"""
Parts of a patch
================

A reduced model may be cut into parts, each with three states of its own. The split follows the shape: pads come out
whole.
"""

import matplotlib.pyplot as plt

import planarfriction as pf
from planarfriction.patch import PUBLISHED_PATCHES
from planarfriction.patch.parts import split

figure, axes = plt.subplots(1, 3, figsize=(8.4, 3.2), layout="constrained", sharex=True, sharey=True)
for ax, name in zip(axes, ("Circle", "NonConvex1", "NonConvex2"), strict=True):
    patch = PUBLISHED_PATCHES[name]()
    parts = pf.ReducedModel(patch, pf.LuGre(mu_s=1.2, elasto_plastic=0.9), parts="auto").parts
    labels = split(patch.positions, patch.weights(), parts)
    ax.scatter(*1e3 * patch.positions.T, c=labels, cmap="tab10", s=14, marker="s")
    ax.set(aspect="equal", title=f"{patch.name}: {parts} parts", xlabel="x [mm]")
    assert len(set(labels)) == parts
