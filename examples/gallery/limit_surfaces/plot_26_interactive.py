"""
An interactive limit surface
============================

The surface of a strip in 3-D: force in x and y, torque over contact radius, with the
ellipsoid that is often put in its place. Below, the same as a plotly figure: drag it,
zoom, read values off it.
"""

import planarfriction as pf

strip = pf.ContactPatch.rectangle(0.03, 0.004, cells=(31, 5), name="strip")
exact, ellipsoid = pf.LimitSurfaceExact(strip), pf.LimitSurfaceEllipsoid(strip)
figure = pf.plots.plot_limit_surface(exact, beside=ellipsoid)

# %%
# The same as a figure of plotly:
interactive = pf.plots.interactive_limit_surface(exact, beside=None)

# %%
# In pure sliding and pure spin the two agree; between them the force is off by much.
for twist in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)):
    assert abs(exact.dissipation(twist) / ellipsoid.dissipation(twist) - 1) < 0.01
print(ellipsoid.compare(exact))
