"""
The paper in ten minutes
========================

Waltersson and Karayiannidis (2024) ask how a flat contact resists a motion that slides and spins at once, and how a
simulation gets that cheaply. This walk goes from one bristle to a plate in a gripper, with the paper's numbers.
"""

import matplotlib.pyplot as plt
import numpy as np

import planarfriction as pf
from planarfriction.patch import PUBLISHED_PATCHES

# %%
# One bristle
# -----------
#
# A contact is full of bristles, which bend like springs until they slip: the LuGre law. Pushed from rest, the force
# grows over a few micrometres, peaks a little above the static coefficient and falls to that of sliding as the motion
# gets faster.
law = pf.LuGre(
    mu_c=1.0,
    mu_s=1.2,
    v_s=1e-3,
    sigma_0=1e6,
    sigma_1=8e2,
    sigma_2=0.2,
    elasto_plastic=0.9,
)
bristle = pf.DistributedModel(pf.ContactPatch.points([[0.0, 0.0]]), law)

dt, steps = 1e-4, 5000
twists = np.zeros((steps, 3))
twists[:, 0] = np.linspace(0.0, 4e-3, steps)
force = -pf.rollout(bristle, None, twists, 1.0, dt).wrenches[:, 0]

figure, ax = plt.subplots(figsize=(6.0, 3.2), layout="constrained")
ax.semilogx(1e6 * dt * twists[1:, 0].cumsum(), force[1:])
ax.set(xlabel="displacement [um]", ylabel="friction per load [-]", xlim=(0.01, None))

# %%
# A patch of bristles
# -------------------
#
# The distributed model puts a bristle into each cell of the contact. When the patch spins, each cell moves in its own
# direction: force and torque are sums over all of them. Spin leaves little friction against sliding.
disc = PUBLISHED_PATCHES["Circle"]()
distributed = pf.DistributedModel(disc, law)
driven = pf.simulate(pf.scenes.driven(distributed), t_end=5.0)
histories = driven.plot()

# %%
# The limit surface
# -----------------
#
# All wrenches of steady sliding form a closed surface. An ellipsoid is often put in its place; it is right for pure
# sliding and pure spin of a round patch and wrong in between.
pads = PUBLISHED_PATCHES["NonConvex1"]()
surfaces = pf.plots.plot_limit_surface(pf.LimitSurfaceTablePublished(pads))

# %%
# Three bristles instead of 634
# -----------------------------
#
# The reduced model has three bristles that are driven along the limit surface, stored in a table. In the run above it
# gives nearly the same force for a fraction of the work. Errors are relative to cells cut in three, since the grid
# has an error of its own. `ReducedModel` has three bristles on each of a few discs: one disc resembles the paper's
# model, without a table, and 24, its default, err less than points in all cells and let go where these do.
reduced = {
    "published, ellipsoid": pf.ReducedModelPublished(
        disc, law, surface=pf.LimitSurfaceEllipsoid(disc)
    ),
    "published": pf.ReducedModelPublished(disc, law),
    "one disc": pf.ReducedModel(disc, law, cells=1),
    "24 discs": pf.ReducedModel(disc, law),
}
fine = pf.simulate(
    pf.scenes.driven(pf.DistributedModel(disc.refined(3), law)), t_end=5.0
)
errors = {}
for name, model in {"distributed": distributed, **reduced}.items():
    run = pf.simulate(pf.scenes.driven(model), t_end=5.0)
    off = np.hypot(run.data.fx - fine.data.fx, run.data.fy - fine.data.fy)
    errors[name] = float(off.quantile(0.75))
    print(
        f"{name:21} third quartile of the error of the force {1e3 * errors[name]:6.2f} mN"
    )
assert (
    max(errors["published"], errors["24 discs"])
    < errors["distributed"]
    < 10e-3
    < errors["published, ellipsoid"]
)

# %%
# A plate in a gripper
# --------------------
#
# Two fingers hold a plate a little beside its centre of mass. Their grip weakens twice a second, and each time the
# plate slips down and turns: what a robot has to foresee when it regrasps.
held = pf.simulate(pf.scenes.in_hand(pf.ReducedModel(disc, law)))
motion = pf.plots.plot_motion(held)
end = held.data.isel(time=-1)
print(
    f"down by {-1e3 * float(end.y):.1f} mm, rotated by {np.degrees(float(end.theta)):.1f} deg"
)

# %%
# All experiments of the paper, with its numbers beside ours: `planarfriction reproduce`.
