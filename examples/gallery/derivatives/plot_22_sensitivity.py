"""
Sensitivities of a slide
========================

The derivatives of a motion by friction, size and mass come with its simulation. A
thrown puck stops earlier with more friction, in proportion.
"""

import matplotlib.pyplot as plt

import planarfriction as pf
from planarfriction.derivatives import scene_sensitivities

plt.style.use("planarfriction.plots.print")

law = pf.LuGre(
    mu_c=0.3, mu_s=0.3, sigma_0=1e4, sigma_1=20.0, sigma_2=0.0, elasto_plastic=0.9
)
model = pf.ReducedModel(pf.ContactPatch.disc(0.04, cells=11), law)
scene = pf.scenes.free_slide(model, twist=(0.8, 0.0, 10.0), save_every=5e-3)
found = scene_sensitivities(
    scene, ("mu", "r"), options=pf.scenes.SolverOptions(t_end=0.2, rtol=1e-7)
)

# %%
# Above, how far the puck has slid. Below, what 1 % more of each does to it, to first
# order:
figure, (upper, lower) = plt.subplots(
    2, 1, figsize=(6.4, 4.4), layout="constrained", sharex=True
)
upper.plot(found.time, 1e3 * found.motion[:, 3])
upper.set(ylabel="x [mm]")
for i, name in enumerate(("friction", "size")):
    lower.plot(found.time, 10.0 * found.d_motion[:, 3, i], label=f"1 % more {name}")
lower.set(xlabel="time [s]", ylabel="change of x [mm]")
lower.legend()

# %%
# More friction shortens the slide, a larger disc hardly changes it.
slopes = found.d_motion[-1, 3]
print(slopes)
assert slopes[0] < 0.0 and abs(slopes[1]) < 0.3 * abs(slopes[0])
