"""
Friction laws: force over speed
===============================

Three laws in steady sliding. LuGre falls from static to sliding friction (Stribeck) and
rises again with viscous friction; Dahl does not depend on the speed; the regularised
Coulomb law has no friction at rest.
"""

import matplotlib.pyplot as plt
import numpy as np

import planarfriction as pf

plt.style.use("planarfriction.plots.print")

laws = {
    "LuGre": pf.LuGre(mu_c=0.5, mu_s=0.7, v_s=2e-3, sigma_2=0.6),
    "Dahl": pf.Dahl(mu_c=0.5),
    "CoulombStribeck": pf.CoulombStribeck(
        mu_c=0.5, mu_s=0.7, v_s=2e-3, sigma_2=0.6, creep_speed=1e-4
    ),
}

# %%
# Friction over the speed, on a logarithmic axis:
speed = np.geomspace(1e-5, 0.3, 400)
figure, ax = plt.subplots(figsize=(6.4, 3.6), layout="constrained")
for name, law in laws.items():
    ax.semilogx(speed, law.steady_friction(speed), label=name)
ax.set(xlabel="speed [m/s]", ylabel="friction per load [-]", ylim=(0.0, None))
ax.legend()

# %%
# At the Stribeck speed the excess of static friction has fallen to 1/e.
at = laws["LuGre"].steady_friction(2e-3) - 0.6 * 2e-3
assert abs(at - (0.5 + 0.2 / np.e)) < 1e-12
