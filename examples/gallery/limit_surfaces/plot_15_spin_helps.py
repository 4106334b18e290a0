"""
Rotation reduces the friction force
===================================

Spin takes away the friction against sliding: that is why one turns a chair to move it.
At a fixed spin the force falls to nothing as the sliding becomes slow.
"""

import matplotlib.pyplot as plt
import numpy as np

import planarfriction as pf

plt.style.use("planarfriction.plots.print")

surface = pf.LimitSurfaceExact(pf.ContactPatch.disc(0.05))
ratio = np.geomspace(0.01, 100.0, 81)  # rim speed over sliding speed
twists = np.stack([np.ones_like(ratio), 0 * ratio, ratio / 0.05], axis=1)
force = -surface.wrench(twists)[:, 0]

# %%
# From sliding, on the left, to spinning, on the right:
figure, ax = plt.subplots(figsize=(6.0, 3.4), layout="constrained")
ax.semilogx(ratio, force)
ax.set(
    xlabel="rim speed over sliding speed [-]",
    ylabel="friction against sliding over mu f_N [-]",
)

# %%
# Where the rim is much faster the force is the sliding speed over that of the rim: the
# limit of the closed form.
print(force[-1] * ratio[-1])
assert abs(force[-1] * ratio[-1] - 1.0) < 1e-3
