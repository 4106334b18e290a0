"""
A patch from a measured pressure map
====================================

An array of pressures makes a patch; only their ratios count. Row 0 of the map is its
top. This fingertip presses harder with one side, so that its centre of pressure is off
the middle.
"""

import numpy as np

import planarfriction as pf

y, x = np.mgrid[0:16, 0:24] - np.array([7.5, 11.5])[:, None, None]
pressure = np.clip(1.0 - (x / 11.0) ** 2 - (y / 7.0) ** 2, 0.0, None) ** 0.5 * (
    1.0 + 0.045 * x - 0.04 * y
)
patch = pf.ContactPatch.from_pressure(pressure, cell_size=1e-3, name="fingertip")
figure = patch.plot(normal_force=5.0)

# %%
# The moments follow from the cells.
print(f"centre of pressure {1e3 * patch.centre_of_pressure()} mm")
print(f"contact radius {1e3 * patch.contact_radius():.2f} mm")
assert patch.centre_of_pressure()[0] > 1e-3
