"""
Planning a regrasp
==================

A plate hangs between two fingers and should hang at another angle. This walk finds the grip that holds it, plans a
profile that lets it turn by as much as wanted, and looks at what a wrong coefficient of friction does to that.
"""

import numpy as np

import planarfriction as pf
from planarfriction.planning import holding_load, plan_grip

# %%
# What holds
# ----------
#
# The pads press 8 mm beside the centre of mass. Each of the two fingers carries half of the weight and of its torque.
pad = pf.ContactPatch.rectangle(0.018, cells=11)
law = pf.LuGre(
    mu_c=0.6, mu_s=0.6, sigma_0=1e5, sigma_1=3e2, sigma_2=0.1, elasto_plastic=0.9
)
model = pf.ReducedModel(pad, law)
weight, lever = 0.2 * 9.81, 0.008
needed = holding_load((0.0, -0.5 * weight, -0.5 * weight * lever), pad, mu=0.6)
print(f"slips below {needed:.2f} N a finger")

# %%
# A profile that lets go and catches
# ----------------------------------
#
# The plate shall turn by 30 degrees about the fingers. `plan_grip` searches the grip over time; a body that hangs
# beside the fingers turns by itself when they loosen.
plate = pf.scenes.in_hand(
    model, centre_of_mass=(lever, 0.0), normal_force=2.0 * needed, t_end=1.0
)
plan = plan_grip(plate, goal={"angle": np.radians(-30.0)}, knots=12)
print(plan)
figure = plan.plot()

# %%
# Does it do what it says? `plan.scene` is the scene with the profile in place.
end = pf.simulate(plan.scene).data.isel(time=-1)
print(f"turned by {np.degrees(float(end.theta)):.1f} deg")
assert abs(np.degrees(float(end.theta)) + 30.0) < 1.0

# %%
# What a wrong friction does
# --------------------------
#
# A plan is as good as the coefficient it was made with. Five per cent of friction more or less end elsewhere:
for factor, angle in zip(plan.report.frictions, plan.report.angles, strict=True):
    print(f"friction {factor:.2f}: {np.degrees(angle):6.1f} deg")

# %%
# So look while it turns: measure the angle, and plan the rest from where the plate is. `aim="worst"` makes the
# plan whose worst case misses least.
motion = pf.plots.plot_motion(pf.simulate(plan.scene))
