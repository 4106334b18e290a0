"""
A limit surface and its ellipsoid
=================================

All wrenches with which two pads can slide, in force and torque over contact radius, and
the ellipsoid that is often put in its place. The surface of two separate pads is far
from round.
"""

import planarfriction as pf
from planarfriction.patch import PUBLISHED_PATCHES

pads = PUBLISHED_PATCHES["NonConvex1"]()
exact, ellipsoid = pf.LimitSurfaceExact(pads), pf.LimitSurfaceEllipsoid(pads)
figure = pf.plots.plot_sections(exact, beside=ellipsoid)

# %%
# How far the two are apart, over directions all around:
difference = ellipsoid.compare(exact)
print(difference)
assert difference.angle.largest > 20.0
