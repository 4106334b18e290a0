"""
Asymmetric friction
===================

A brushed surface is easier to slide on one way than back. The friction of each heading
is drawn around the origin.
"""

import matplotlib.pyplot as plt
import numpy as np

import planarfriction as pf

plt.style.use("planarfriction.plots.print")

plain = pf.ContactPatch.disc(0.02, cells=11)
brushed = plain.with_friction_metric(np.eye(2), asymmetry=(0.4, 0.0))
heading = np.linspace(0.0, 2 * np.pi, 181)
twists = np.stack([np.cos(heading), np.sin(heading), 0 * heading], axis=1)

# %%
# Friction over the heading:
figure, ax = plt.subplots(
    figsize=(4.6, 4.6), layout="constrained", subplot_kw={"projection": "polar"}
)
for name, patch in (("plain", plain), ("brushed", brushed)):
    ax.plot(heading, pf.LimitSurfaceCells(patch).dissipation(twists), label=name)
ax.legend(loc="lower left")

# %%
# Along x it takes 1.4 times, against it 0.6 times the plain friction.
there, back = pf.LimitSurfaceCells(brushed).dissipation(
    [(1.0, 0.0, 0.0), (-1.0, 0.0, 0.0)]
)
print(there, back)
assert abs(there - 1.4) < 1e-12 and abs(back - 0.6) < 1e-12
