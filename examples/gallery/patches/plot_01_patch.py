"""
A contact patch from a shape
============================

A patch is a set of cells with a share of the load each. The picture shows where a disc
that is pressed hardest in its middle carries it.
"""

import planarfriction as pf

patch = pf.ContactPatch.disc(0.01, cells=41, pressure=pf.SoftFinger(c=0.01, k=2.0))
figure = patch.plot(normal_force=1.0)

# %%
# A pure spin has the torque ``mu f_N r``, r the contact radius: for this pressure ``3
# pi/16`` of the outer radius.
ratio = patch.contact_radius(1.0) / 0.01
print(f"r/R = {ratio:.4f}")
assert abs(ratio - 0.5890) < 2e-3
