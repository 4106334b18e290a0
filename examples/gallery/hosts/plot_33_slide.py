"""
Controlled in-hand slip by 20 mm
================================

A gripper lets three parts of different friction slide down by 20 mm in two seconds. It
does not know their friction: it opens until they slip, then follows the speed that it
wants, with force, torque and slip velocity that come 20 ms late.
"""

import numpy as np

import planarfriction as pf
from planarfriction.online import FrictionObserver, SlideBy
from planarfriction.plots.style import new_figure
from planarfriction_studies.rig import Gripper, Parts

GOAL, DT, STEPS = -0.02, 1e-3, 4000
mu_c = np.array([0.4, 0.6, 0.9])

finger = pf.ContactPatch.disc(0.02, pressure=pf.SoftFinger(c=6e-3, n=0.25, k=4.0))
known = pf.ReducedModel(finger, pf.LuGre(mu_c=0.6, mu_s=0.65, v_s=2e-3))
count = len(mu_c)
slide = SlideBy(FrictionObserver(known, batch=count), GOAL, duration=2.0)
parts = Parts(
    np.full(count, 0.2),
    np.full(count, 3e-4),
    np.tile((0.0, -0.01), (count, 1)),
    mu_c,
    delay=0.02,
)
gripper = Gripper(parts, 25.0)

sample, slid, grip = gripper.measurement, [], []
for _ in range(STEPS):
    sample = gripper.step(slide.update(sample))
    slid.append(gripper.slip[:, 1].copy())
    grip.append(gripper.normal_force.copy())

# %%
# Samples come late, so a part that breaks loose slides some millimetres before it is
# caught: it goes in hops. The smoother a part, the firmer the grip that it needs.
time = DT * np.arange(STEPS)
figure = new_figure(8.0, 5.0)
above, below = figure.subplots(2, 1, sharex=True)
above.plot(time, 1e3 * np.array(slid), label=[f"mu_c = {each}" for each in mu_c])
above.axhline(1e3 * GOAL, color="0.6", ls="--", label="goal")
above.set_ylabel("slid by [mm]")
above.legend()
below.plot(time, np.array(grip))
below.set(xlabel="time [s]", ylabel="grip force [N]", ylim=(0.0, 6.0))
print("slid by", np.round(1e3 * slid[-1], 1), "mm")
assert (np.abs(slid[-1] - GOAL) < 2e-3).all()
