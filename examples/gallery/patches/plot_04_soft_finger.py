"""
A soft fingertip: contact area over normal force
================================================

A soft fingertip pressed harder spreads: its radius grows with a power of the load, and
with it the torque that the contact can hold, faster than the load itself.
"""

import matplotlib.pyplot as plt
import numpy as np

import planarfriction as pf

plt.style.use("planarfriction.plots.print")

finger = pf.SoftFinger(c=0.005, n=1 / 3, k=2.0, radius_max=0.02)
patch = pf.ContactPatch.disc(0.012, cells=61, pressure=finger)
loads = np.geomspace(0.5, 8.0, 25)
radii = np.array([patch.contact_radius(load) for load in loads])

# %%
# Pressure along the middle at three loads, and the torque of a spin over the load:
figure, (left, right) = plt.subplots(1, 2, figsize=(8.5, 3.4), layout="constrained")
for load in (1.0, 3.0, 8.0):
    middle = np.abs(patch.positions[:, 1]) < 1e-5
    left.plot(
        1e3 * patch.positions[middle, 0],
        1e-3 * patch.pressure_values(load)[middle],
        label=f"{load:g} N",
    )
left.set(xlabel="x [mm]", ylabel="pressure [kPa]")
left.legend()
right.plot(loads, 1e3 * loads * radii, ".-", label="torque of a spin, mu = 1")
right.plot(loads, 1e3 * loads * radii[0], ":", label="in proportion to the load")
right.set(xlabel="normal force [N]", ylabel="torque [N mm]")
right.legend()

# %%
# The radius follows the load to the power n, here 1/3.
slope = np.polyfit(np.log(loads), np.log(radii), 1)[0]
print(f"slope {slope:.3f}")
assert abs(slope - 1 / 3) < 0.01
