"""
A sweep over grip and mass
==========================

One function makes a scene of two numbers; a sweep simulates every combination and
returns a labelled dataset. Where does a plate that is held off its centre of mass slip?
"""

import matplotlib.pyplot as plt
import numpy as np

import planarfriction as pf
from planarfriction.plots import style

plt.style.use("planarfriction.plots.print")

law = pf.LuGre(mu_c=0.8, mu_s=0.8, sigma_0=1e5, sigma_1=3e2, elasto_plastic=0.9)
model = pf.ReducedModel(pf.ContactPatch.disc(0.01, cells=11), law)


def make_scene(grip, mass):
    return pf.scenes.in_hand(
        model, normal_force=grip, mass=mass, centre_of_mass=(0.02, 0.0), t_end=0.15
    )


def turned(solution):
    return {"turned": -np.degrees(solution.histories["theta"].values[-1])}


# %%
# All 231 combinations in one call:
data = pf.sweep(
    make_scene,
    {"grip": np.linspace(1.0, 6.0, 21), "mass": np.linspace(0.1, 0.3, 11)},
    measure=turned,
)

# %%
# Dark: the plate turns, as the grip is too weak for it.
figure, ax = plt.subplots(figsize=(6.2, 3.8), layout="constrained")
picture = ax.pcolormesh(
    data.grip, data.mass, data.turned.T, cmap=style.PRESSURE_MAP, shading="nearest"
)
ax.set(xlabel="grip [N]", ylabel="mass [kg]")
figure.colorbar(picture, label="turned within 0.15 s [°]")

# %%
# Harder grips hold heavier plates.
holds = (abs(data.turned) < 0.1).sum("mass").values
print(holds)
assert np.all(np.diff(holds) >= 0) and holds[0] < holds[-1]
