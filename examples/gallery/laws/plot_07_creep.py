"""
Sticking without creep under cyclic load
========================================

A disc on a table is pushed by less than friction holds, with a force that oscillates.
Plain LuGre bristles let it creep; elasto-plastic bristles do not.
"""

import matplotlib.pyplot as plt

import planarfriction as pf

plt.style.use("planarfriction.plots.print")

patch = pf.ContactPatch.disc(0.05, cells=11)

# %%
# The same scene with both kinds of bristles:
figure, ax = plt.subplots(figsize=(6.4, 3.4), layout="constrained")
end = {}
for name, share in (("plain LuGre", None), ("elasto-plastic", 0.9)):
    law = pf.LuGre(mu_c=0.2, mu_s=0.24, sigma_0=1e4, sigma_1=80.0, elasto_plastic=share)
    data = pf.simulate(pf.scenes.drift(pf.ReducedModel(patch, law), t_end=2.5)).data
    ax.plot(data.time, 1e6 * data.x, label=name)
    end[name] = 1e6 * float(data.x[-1] - data.x.sel(time=1.25, method="nearest"))
ax.set(xlabel="time [s]", ylabel="x [µm]")
ax.legend()

# %%
# How far each went since 1.25 s, several periods ago:
print({name: f"{way:.2f} µm" for name, way in end.items()})
assert end["plain LuGre"] > 5 * abs(end["elasto-plastic"])
