"""
A puck stops translating and rotating at once
=============================================

Slide and spin of a disc with even pressure end in the same instant, whatever they began
with: as one slows down, it leaves more friction to the other.
"""

import matplotlib.pyplot as plt
import numpy as np

import planarfriction as pf

plt.style.use("planarfriction.plots.print")

law = pf.LuGre(
    mu_c=0.3, mu_s=0.3, sigma_0=1e5, sigma_1=20.0, sigma_2=0.0, elasto_plastic=0.9
)
model = pf.DistributedModel(pf.ContactPatch.disc(0.04), law)

# %%
# Four throws, each until rest:
figure, ax = plt.subplots(figsize=(5.4, 4.4), layout="constrained")
for speed, spin in ((1.0, 5.0), (0.3, 25.0), (0.1, 25.0), (0.7, 15.0)):
    scene = pf.scenes.free_slide(
        model, inertia=0.2 * 0.04**2 / 2, twist=(speed, 0.0, spin), save_every=1e-3
    )
    solution = pf.simulate(scene)
    slide = np.hypot(solution.data.vx, solution.data.vy)
    rim = 0.04 * solution.data.omega
    moving = (slide + rim > 0.01).values
    ax.loglog(slide[moving], rim[moving], label=f"{speed} m/s, {spin:.0f} rad/s")
ax.loglog([5e-3, 1.0], [5e-3 / 0.653, 1.0 / 0.653], "k:", label="0.653")
ax.set(xlabel="speed [m/s]", ylabel="speed of the rim from spin [m/s]", aspect="equal")
ax.legend()

# %%
# All paths bend towards one line, on which the speed is 0.653 of that of the rim
# (Farkas, Bartels, Unger, Wolf 2003).
ratio = float(slide[moving][-1] / rim[moving][-1])
print(f"{ratio:.3f}, {solution.status}")
assert solution.status == "at rest" and abs(ratio - 0.653) < 0.03
