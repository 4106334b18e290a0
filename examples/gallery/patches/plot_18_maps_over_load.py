"""
Pressure maps at several normal forces
======================================

A contact whose pressure was measured at two loads has a limit surface of its own at
every load between.
"""

import matplotlib.pyplot as plt
import numpy as np

import planarfriction as pf

plt.style.use("planarfriction.plots.print")

x, y = np.meshgrid(np.arange(-6, 7) * 1e-3, np.arange(6, -7, -1) * 1e-3)
light = np.maximum(1.0 - (x**2 + y**2) / 0.003**2, 0.0)
heavy = np.sqrt(np.maximum(1.0 - (x**2 + (y - 1e-3) ** 2) / 0.005**2, 0.0))
patch = pf.ContactPatch.from_pressure(
    {0.5: light, 3.0: heavy}, cell_size=1e-3, name="fingertip"
)

# %%
# Force against torque at four loads, two of them between the maps:
mix = np.linspace(0.0, np.pi / 2, 61)
figure, ax = plt.subplots(figsize=(5.6, 3.8), layout="constrained")
for load in (0.5, 1.0, 2.0, 3.0):
    surface = pf.LimitSurfaceExact(patch, normal_force=load)
    twists = np.stack([np.zeros_like(mix), np.cos(mix), np.sin(mix) / 0.002], axis=1)
    wrench = -surface.wrench(twists)
    ax.plot(wrench[:, 1], 1e3 * wrench[:, 2], label=f"{load:g} N")
ax.set(xlabel="force over mu f_N [-]", ylabel="torque over mu f_N [mm]")
ax.legend()

# %%
# Between two maps the share of each cell is linear in the load, and so is the contact
# radius of centred maps.
radius = [float(patch.contact_radius(load)) for load in (0.5, 3.0)]
print(radius)
assert radius[1] > 1.5 * radius[0]
