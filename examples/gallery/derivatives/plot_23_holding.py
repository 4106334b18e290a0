"""
Grip force for an off-centre grasp
==================================

The further from its centre of mass a plate is held, the harder two fingers must grip,
since they hold a torque too. The ellipsoid asks for less grip than is needed in
between.
"""

import matplotlib.pyplot as plt
import numpy as np

import planarfriction as pf
from planarfriction.planning import holding_load
from planarfriction.plots import style

plt.style.use("planarfriction.plots.print")

pad = pf.ContactPatch.rectangle(0.018)
weight = 0.5 * 0.2 * 9.81  # of a plate of 0.2 kg, on each of two fingers

# %%
# The grip for each lever: by the exact surface, by an ellipse of force and torque, and
# for the force alone.
levers = np.linspace(0.0, 0.02, 21)
exact = np.array(
    [holding_load((0.0, -weight, -weight * lever), pad, mu=0.6) for lever in levers]
)
ellipsoid = weight / 0.6 * np.hypot(1.0, levers / pad.contact_radius())
figure, ax = plt.subplots(figsize=(6.0, 3.6), layout="constrained")
ax.plot(1e3 * levers, exact, color="black", label="exact")
ax.plot(1e3 * levers, ellipsoid, "-.", color=style.ELLIPSOID, label="ellipsoid")
ax.plot(
    1e3 * levers,
    np.full_like(levers, weight / 0.6),
    ":",
    color="0.5",
    label="force alone",
)
ax.set(xlabel="lever [mm]", ylabel="grip of a finger [N]")
ax.legend()

# %%
# Without a lever it is the weight over the coefficient of friction.
print(exact[0], exact[-1])
assert abs(exact[0] - weight / 0.6) < 1e-6 and exact[-1] > 2 * exact[0]
