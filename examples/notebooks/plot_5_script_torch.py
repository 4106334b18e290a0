"""
From a PyTorch script to a contact patch
========================================

Scripts that use the paper's reduced model often build it as one PyTorch module from eight numbers. Such a script runs
with this library after one changed import. Here it gets a better limit surface, and then a model of the contact patch.
"""

import numpy as np
import torch

import planarfriction as pf
from planarfriction.plots.style import ELLIPSOID, REDUCED, REFERENCE, new_figure
from planarfriction.torch.reduced_planar import (
    ReducedPlanarLuGre,
    simulate,
    tracking_loss,
)

# %%
# Change the import
# -----------------
#
# The calls of the script stay as they are. What differs behind them: the torque has the right radius (a widespread
# version omits one factor r), `step` is exact for a constant twist at any `dt`, `simulate` is compiled, and parameters
# cannot leave their range while an optimiser changes them.
model = ReducedPlanarLuGre(
    mu_c=1.0,
    mu_s=1.2,
    v_s=1e-3,
    gamma=2.0,
    sigma_0=1e6,
    sigma_1=8e2,
    sigma_2=0.2,
    radius=0.05,
)
z, v = torch.zeros(3), torch.tensor([0.0, 0.0, 0.1])
for _ in range(500):
    z, wrench = model.step(z, v, 1.0, dt=1e-4)
print(
    f"torque {wrench[2].item():.4f} N m; g r = {(model.g(0.1 * 0.05) * model.radius).item():.4f} N m"
)

# %%
# Measure a pad
# -------------
#
# A pad of 40 x 20 mm rubs on a plane for 2 s, with movements from too small to slide up to millimetres. The distributed
# model, with bristles in every cell, takes the place of a measurement. One movement is for the fit, one for the test.
pad = pf.ContactPatch.rectangle(0.04, 0.02, cells=14)
law = pf.LuGre(mu_c=0.8, mu_s=0.8, v_s=2e-3, sigma_0=1e5, sigma_1=5.0, sigma_2=0.1)
load, dt, time = 2.0, 1e-3, np.arange(2000) * 1e-3


def movement(seed):
    """Return twists `[2000, 3]`: six sines in each component, whose amplitude grows 200-fold up to 4 mm/s."""
    random = np.random.default_rng(seed)
    sizes, phases = random.normal(size=(6, 3)), random.uniform(0.0, 2.0 * np.pi, (6, 3))
    frequencies = np.array([0.5, 0.8, 1.1, 1.7, 2.3, 3.1])[:, None]
    sines = (
        sizes * np.sin(2.0 * np.pi * frequencies * time[:, None, None] + phases)
    ).sum(axis=1)
    growing = 200.0 ** (time / time[-1] - 1.0)[:, None]
    return sines / sines.std(axis=0) * growing * 4e-3 / [1.0, 1.0, pad.contact_radius()]


seen, unseen = movement(0), movement(1)
measured, truth = (
    pf.rollout(pf.DistributedModel(pad, law), None, each, load, dt).wrenches
    for each in (seen, unseen)
)

# %%
# Fit with two limit surfaces
# ---------------------------
#
# A model built from numbers is a ring of radius r with the ellipsoid as its limit surface. Any other surface can be
# passed, best that of the contact. Friction, stiffness and radius are fitted from the same poor guess with each.
fitted = {}
for name, surface in (
    ("ellipsoid", None),
    ("exact surface", pf.LimitSurfaceTable(pad)),
):
    guess = ReducedPlanarLuGre(
        mu_c=0.5, mu_s=0.5, v_s=2e-3, gamma=2.0, sigma_0=4e4, sigma_1=5.0, sigma_2=0.1, radius=0.02,
        surface=surface, dtype=torch.float64,
    )  # fmt: skip
    changed = [
        guess.physical.raw[each] for each in ("mu_c", "sigma_0", "contact_radius")
    ]
    optimiser = torch.optim.Adam(changed, lr=0.1)
    schedule = torch.optim.lr_scheduler.CosineAnnealingLR(optimiser, 200)
    for _ in range(200):
        optimiser.zero_grad()
        tracking_loss(
            guess, torch.tensor(seen), torch.tensor(measured), load, dt
        ).backward()
        optimiser.step()
        schedule.step()
    print(
        f"{name}: mu_c {guess.mu_c:.3f}, sigma_0 {guess.sigma_0:.3g} 1/m, radius {1e3 * guess.radius:.2f} mm"
    )
    fitted[name] = simulate(guess, torch.tensor(unseen), load, dt).detach().numpy()

# %%
# Build models from the contact patch
# -----------------------------------
#
# If the contact is known, neither radius nor limit surface has to be fitted: a patch and a law make a model, with the
# same calls in NumPy, PyTorch and JAX. Errors are RMS values of the unseen movement.
fitted["ReducedModel, nothing fitted"] = pf.rollout(
    pf.ReducedModel(pad, law), None, unseen, load, dt
).wrenches
errors = {}
for name, wrenches in fitted.items():
    errors[name] = (
        np.sqrt(((wrenches - truth) ** 2).mean(axis=0))
        / load
        / [1.0, 1.0, pad.contact_radius()]
    )
    print(
        "{}: fx {:.1f} %, fy {:.1f} %, torque {:.1f} %".format(
            name, *100.0 * errors[name]
        )
    )
assert errors["exact surface"][2] < 0.5 * errors["ellipsoid"][2]
assert errors["ReducedModel, nothing fitted"].max() < 0.005

# %%
# The ellipsoid misses the torque because it does not distinguish directions: a pad that slides along y, across its long
# side, hardly resists a slow turn.
figure = new_figure(8.6, 3.4)
axes = figure.subplots()
axes.plot(
    time,
    1e3 * truth[:, 2],
    color=REDUCED,
    linewidth=2.6,
    label="distributed, the truth",
)
for name, colour in (("ellipsoid", ELLIPSOID), ("exact surface", REFERENCE)):
    axes.plot(
        time,
        1e3 * fitted[name][:, 2],
        color=colour,
        linewidth=1.0,
        label=f"fitted, {name}",
    )
axes.set(xlabel="time [s]", ylabel="torque [N mm]", xlim=(1.0, 2.0))
axes.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=3, frameon=False)
