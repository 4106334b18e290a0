"""
A friction law from a log
=========================

A contact is moved, force and torque are logged with noise, and a fit finds the law:
each number with its interval, and which parameters the data cannot determine. Here the
log is simulated, so that the truth is known.
"""

import matplotlib.pyplot as plt
import numpy as np

import planarfriction as pf
from planarfriction.identify import FitOptions, Log, identify_lugre

plt.style.use("planarfriction.plots.print")

patch = pf.ContactPatch.disc(0.01, cells=11)
truth = pf.LuGre(
    mu_c=0.5,
    mu_s=0.65,
    v_s=2e-3,
    sigma_0=2e4,
    sigma_1=30.0,
    sigma_2=0.8,
    elasto_plastic=0.9,
)
start = pf.LuGre(
    mu_c=0.4,
    mu_s=0.5,
    v_s=1e-3,
    sigma_0=2e4,
    sigma_1=30.0,
    sigma_2=0.5,
    elasto_plastic=0.9,
)


# %%
# The motion is three sines that grow. The log keeps every tenth step of a simulation,
# with noise.
def twist_at(time):
    """Sines that grow [T, 3]."""
    sines = np.stack(
        [np.sin(2 * np.pi * hertz * time) for hertz in (2.3, 1.7, 3.1)], axis=1
    )
    return (0.03 + 0.97 * (time / 0.8) ** 2)[:, None] * [0.03, 0.02, 2.0] * sines


fine = (np.arange(8000) + 0.5) * 1e-4  # ten steps between two samples of the log
wrench = pf.rollout(
    pf.ReducedModel(patch, truth), None, twist_at(fine), 2.0, 1e-4
).wrenches[9::10]
wrench += [0.01, 0.01, 5e-5] * np.random.default_rng(0).standard_normal(wrench.shape)
time = np.arange(1, 801) * 1e-3
log = Log(time, twist_at(time), wrench, normal_force=2.0)

# %%
# The fit begins a fifth and more off the truth, and estimates the four parameters that
# are named:
names = ("mu_c", "mu_s", "v_s", "sigma_2")
found = identify_lugre(
    log,
    patch,
    model="reduced",
    parameters=names,
    start=start,
    options=FitOptions(nuisance=()),
)
print(found)

# %%
# The fitted law against the true one, in steady sliding:
speed = np.geomspace(1e-5, 0.05, 200)
figure, ax = plt.subplots(figsize=(6.4, 3.6), layout="constrained")
ax.semilogx(speed, truth.steady_friction(speed), "k:", label="truth")
ax.semilogx(speed, found.law.steady_friction(speed), label="fitted", linewidth=1)
ax.semilogx(
    speed, start.steady_friction(speed), "--", label="where the fit began", linewidth=1
)
ax.set(xlabel="speed [m/s]", ylabel="friction per load [-]", ylim=(0.0, None))
ax.legend()
assert all(
    abs(getattr(found.law, name) / getattr(truth, name) - 1) < 0.1 for name in names
)
