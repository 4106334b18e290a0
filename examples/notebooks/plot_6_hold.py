"""
Grip control with unknown friction
==================================

A gripper picks parts whose friction, mass and centre of mass it does not know. This walk lets it find the friction
while it holds, compares its grip with a rule that was told the friction, and then turns a part on purpose.
"""

import numpy as np

import planarfriction as pf
from planarfriction.online import FrictionObserver, Hold, TurnBy
from planarfriction.plots.style import new_figure
from planarfriction_studies.rig import Gripper, Parts
from planarfriction_studies.rig.baselines import ellipsoid_load

# %%
# Parts and what is known of them
# -------------------------------
#
# Three parts of 0.2 kg hang 3 mm beside the grip. After 2 s each is tapped, and after 3 s the hand tilts by 20 degrees.
# The observer knows the fingertips, and that friction is about 0.6: within a factor of three.
mu_c = np.array([0.4, 0.7, 1.0])
parts = Parts(
    mass=np.full(3, 0.2),
    inertia=np.full(3, 3e-4),
    centre=np.tile((0.003, -0.005), (3, 1)),
    mu_c=mu_c,
    delay=0.02,
    tap=np.tile((0.0, -0.8, 0.0), (3, 1)),
    tap_time=2.0,
    tilt=np.full(3, np.radians(20.0)),
    tilt_time=3.0,
)
finger = pf.ContactPatch.disc(0.02, pressure=pf.SoftFinger(c=6e-3, n=0.25, k=4.0))
known = pf.ReducedModel(finger, pf.LuGre(mu_c=0.6, mu_s=0.65, v_s=2e-3))

# %%
# Hold
# ----
#
# `Hold` lowers the grip until the part slips by some tenths of a millimetre. The friction of this slip, and its error,
# give the least grip that holds with a probability of slip of one in a thousand.
gripper = Gripper(parts, 20.0)
hold = Hold(FrictionObserver(known, batch=3))
for sample in gripper.empty_hand():  # noise and bias of the sensors
    hold.update(sample)
sample, time, found, bounds, grip = gripper.measurement, [], [], [], []
for _ in range(4000):
    sample = gripper.step(hold.update(sample))
    time.append(gripper.time)
    found.append(hold.estimate.mu_c)
    bounds.append(hold.estimate.interval()[:, 0])
    grip.append(gripper.normal_force.copy())
found, bounds, grip = np.array(found), np.array(bounds), np.array(grip)

figure = new_figure(8.0, 5.5)
above, below = figure.subplots(2, 1, sharex=True)
for i, mu in enumerate(mu_c):
    (line,) = above.plot(time, found[:, i], label=f"a part of {mu}")
    above.fill_between(time, *bounds[:, i].T, color=line.get_color(), alpha=0.2)
    above.axhline(mu, color=line.get_color(), ls="--", lw=1.0)
    below.plot(time, grip[:, i], color=line.get_color())
above.set(ylabel="mu_c with its 95 % interval", ylim=(0.0, 1.6))
above.legend()
below.set(xlabel="time [s]", ylabel="grip force [N]", ylim=(0.0, 10.0))

for i, mu in enumerate(mu_c):
    low, high = bounds[-1, i]
    slip = 1e3 * np.hypot(*gripper.slip[i, :2])
    print(
        f"mu_c {mu}: found {low:.2f} to {high:.2f}, slipped by {slip:.2f} mm, grip {grip[-1, i]:.1f} N"
    )
assert ((bounds[-1, :, 0] < mu_c) & (mu_c < bounds[-1, :, 1])).all()

# %%
# Beside a rule
# -------------
#
# A common rule grips twice as firmly as an ellipsoid of the true friction needs. `Hold` finds that friction itself.
radius = gripper.radius * gripper.model.patch.contact_radius() / 0.01
rule = 2.0 * np.maximum(ellipsoid_load(gripper.load(), radius, mu_c), 2.0)
print("grip of the rule", np.round(rule, 1), "N")

# %%
# Turn it on purpose
# ------------------
#
# A part that hangs 30 mm beside the grip turns by its own weight when the grip loosens. `TurnBy` lets it turn by 45
# degrees in 2 s and catches it there.
one = Parts([0.2], [3e-4], [(0.03, 0.0)], [0.7], delay=0.01)
gripper, turn = (
    Gripper(one, 40.0),
    TurnBy(FrictionObserver(known, batch=1), np.radians(-45.0), duration=2.0),
)
sample = gripper.measurement
for _ in range(4000):
    sample = gripper.step(turn.update(sample))
print(f"turned by {np.degrees(gripper.slip[0, 2]):.1f} degrees")
