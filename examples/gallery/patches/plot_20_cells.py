"""
More discs, smaller errors
==========================

`cells` is the number of discs of a reduced model. An L slides while it turns about
points inside: the largest error of the force falls with the number of discs, until each
cell has its own, which is far better than as many points.
"""

import matplotlib.pyplot as plt
import numpy as np

import planarfriction as pf

plt.style.use("planarfriction.plots.print")

shape = np.zeros((20, 20))
shape[:, :5] = shape[15:, :] = 1.0
patch = pf.ContactPatch.from_pressure(shape, cell_size=1e-3)
law = pf.LuGre(mu_s=1.2, elasto_plastic=0.9)
rng = np.random.default_rng(0)
centres = patch.positions[rng.choice(patch.cells, 300)]
centres += rng.uniform(-5e-4, 5e-4, (300, 2))
twists = np.column_stack([centres[:, 1], -centres[:, 0], np.ones(300)])


# %%
# Errors are those of the force in a steady turn about each of 300 centres of rotation.
def steady_force(model):
    """Force [N] of a steady turn about each centre, at 1 N."""
    _, wrench = model.step(model.rest(), twists, 1.0, 1.0)
    return wrench[:, :2]


def largest_error(model):
    """Largest distance of these forces from those of finer cells, in % of the load."""
    return 100 * np.linalg.norm(steady_force(model) - exact, axis=1).max()


# %%
# The reference is a distributed model with nine times as many cells:
exact = steady_force(pf.DistributedModel(patch.refined(3), law))
cells = [1, 2, 4, 8, 16, 24, 32, 64, 128, patch.cells]
errors = [largest_error(pf.ReducedModel(patch, law, cells=n)) for n in cells]
points = largest_error(pf.DistributedModel(patch, law))
figure, ax = plt.subplots(figsize=(6.0, 3.6), layout="constrained")
ax.loglog(cells, errors, "o-", label="discs")
ax.loglog(patch.cells, points, "s", label="a point in every cell")
ax.set(xlabel="cells", ylabel="largest error of the force [% of the load]")
ax.set_xticks(cells, cells)
ax.minorticks_off()
ax.legend()

# %%
# In numbers:
print(
    {n: f"{error:.2f} %" for n, error in zip(cells, errors, strict=True)},
    f"points {points:.2f} %",
)
error = dict(zip(cells, errors, strict=True))
assert error[patch.cells] < 0.3 * points < error[24] < 0.5 * error[8] < 0.1 * error[1]
