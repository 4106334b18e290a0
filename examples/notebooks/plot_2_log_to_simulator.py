"""
From a log to a simulator
=========================

A rig moves a pad over a surface and logs motion and wrench. This walk fits a friction law to the log, looks at what the
data cannot determine, and puts the fitted pad into a simulation.
"""

import numpy as np

import planarfriction as pf
from planarfriction.identify import Log, identify_lugre

# %%
# The log
# -------
#
# Read yours with `planarfriction.identify.Log.from_csv`, if it has such columns, or from arrays as here. This one is
# made, with noise of 1 %, by a pad whose parameters are known, so that the fit can be judged.
pad = pf.ContactPatch.disc(radius=0.01, cells=11)
truth = pf.LuGre(
    mu_c=0.5,
    mu_s=0.65,
    v_s=2e-3,
    gamma=1.4,
    sigma_0=2e4,
    sigma_1=30.0,
    sigma_2=0.8,
    elasto_plastic=0.9,
)
load = 2.0

time = np.arange(1500) / 1000
grown = 0.03 + 0.97 * (time / time[-1]) ** 2
sines = np.stack(
    [np.sin(2 * np.pi * hertz * time) for hertz in (2.3, 1.7, 3.1)], axis=-1
)
twist = grown[:, None] * [0.03, 0.02, 2.0] * sines
fine = np.stack(
    [np.interp(np.arange(14990) / 10000, time, column) for column in twist.T], axis=1
)
model = pf.ReducedModelPublished(pad, truth)
wrench = pf.rollout(model, None, fine, load, 1e-4).wrenches[9::10]
wrench = np.concatenate([np.zeros((1, 3)), wrench])[:1499]
wrench = wrench + [0.01, 0.01, 5e-5] * np.random.default_rng(0).standard_normal(
    wrench.shape
)
log = Log(time[:1499], twist[:1499], wrench, normal_force=load)

# %%
# The fit
# -------
#
# Every parameter comes with its error and a verdict in words.
found = identify_lugre(log, pad, model="reduced-published")
print(found)

# %%
# The picture shows the fit, its residuals and the parts that were held out.
figure = found.plot()

# %%
for name in ("mu_c", "mu_s", "sigma_0"):
    print(f"{name}: {found.estimates[name]:.4g}, truth {getattr(truth, name):.4g}")
assert abs(found.estimates["mu_c"] / truth.mu_c - 1) < 0.03

# %%
# Into a simulation
# -----------------
#
# `found.model` is a model like any other. Here two such pads hold a plate of 60 g while the grip fades.
grip = pf.Signal.sampled([0.0, 0.6, 0.8], [1.3, 0.4, 1.3], hold="linear")
solutions = {
    name: pf.simulate(
        pf.scenes.in_hand(
            each, normal_force=grip, mass=0.06, size=(0.08, 0.05), t_end=1.0
        )
    )
    for name, each in (("fitted", found.model), ("truth", model))
}
histories = pf.plots.plot_histories(solutions)
ends = {name: 1e3 * float(solution.data.y[-1]) for name, solution in solutions.items()}
print({name: f"{y:.1f} mm" for name, y in ends.items()})
