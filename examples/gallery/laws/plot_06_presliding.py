"""
Presliding: hysteresis of force and displacement
================================================

A contact that is pushed to and fro by less than it takes to slide acts as a spring.
With elasto-plastic bristles small loops close on a line; larger ones open as bristles
begin to slip.
"""

import matplotlib.pyplot as plt
import numpy as np

import planarfriction as pf

plt.style.use("planarfriction.plots.print")

law = pf.LuGre(
    mu_c=0.5, mu_s=0.5, sigma_0=1e5, sigma_1=1.0, sigma_2=0.0, elasto_plastic=0.6
)
model = pf.DistributedModel(pf.ContactPatch.points([[0.0, 0.0]]), law)
time = np.linspace(0.0, 3.0, 3001)

# %%
# Three amplitudes of the displacement; the slope of the smallest is kept.
figure, ax = plt.subplots(figsize=(6.0, 4.0), layout="constrained")
for amplitude in (2e-6, 5e-6, 12e-6):
    displacement = amplitude * np.sin(2 * np.pi * time)
    twists = np.zeros((3000, 3))
    twists[:, 0] = np.diff(displacement) / 1e-3
    _, wrenches = pf.rollout(model, None, twists, 1.0, 1e-3)
    ax.plot(1e6 * displacement[1:], -wrenches[:, 0], label=f"{1e6 * amplitude:.0f} µm")
    if amplitude == 2e-6:
        stiffness = -wrenches[249, 0] / displacement[250]
ax.set(xlabel="displacement [µm]", ylabel="friction against the motion per load [-]")
ax.legend()

# %%
# The smallest loop is a spring with the stiffness of the bristles.
print(f"{stiffness:.4g} N/m at 1 N")
assert abs(stiffness / law.sigma_0 - 1) < 1e-3
