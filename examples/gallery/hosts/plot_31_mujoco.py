"""
A gripper in MuJoCo that does not creep
=======================================

A block hangs between two pads, held off its centre of mass. With MuJoCo's own friction
it sinks; with the friction of patches it is held. Same model, same time step.
"""

import matplotlib.pyplot as plt
import mujoco
import numpy as np

import planarfriction as pf
from planarfriction.adapters.mujoco import Friction, PatchContact, prepare
from planarfriction.plots import style

plt.style.use("planarfriction.plots.print")

PADS = "".join(
    f"""<body name="{side}" pos="{sign * 0.015} 0.012 0.5">
    <joint type="slide" axis="{-sign} 0 0" name="{side}"/>
    <geom name="pad {side}" type="box" size="0.005 0.009 0.009" mass="0.05"
     contype="1" conaffinity="0" friction="1 0.005 0.0001" condim="4"/></body>"""
    for side, sign in (("left", -1), ("right", 1))
)
MODEL = f"""<mujoco><option timestep="0.005" cone="elliptic" impratio="10"/><worldbody>
  <body name="block" pos="0 0 0.5"><freejoint/>
    <geom name="block" type="box" size="0.01 0.04 0.06" mass="0.2"
     contype="0" conaffinity="1"/>
    <site name="left" pos="-0.01 0.012 0" zaxis="1 0 0"/>
    <site name="right" pos="0.01 0.012 0" zaxis="-1 0 0"/>
  </body>{PADS}</worldbody>
  <actuator><motor joint="left"/><motor joint="right"/></actuator></mujoco>"""
PAD = pf.ReducedModel(
    pf.ContactPatch.rectangle(0.018), pf.LuGre(mu_c=1.0, elasto_plastic=0.9)
)


# %%
# With patches, `prepare` takes MuJoCo's own friction out of the pairs, and
# `Friction.step` takes the place of `mj_step`.
def heights(patches):
    """Height of the block above its start [T]; without patches, MuJoCo's friction."""
    spec = mujoco.MjSpec.from_string(MODEL)
    if patches:
        prepare(spec, patches)
    m = spec.compile()
    d = mujoco.MjData(m)
    step = Friction(m, patches).step if patches else lambda d: mujoco.mj_step(m, d)
    d.ctrl[:] = 3.0
    found = []
    for _ in range(400):
        step(d)
        found.append(d.qpos[2] - 0.5)
    return np.array(found)


# %%
# The block over two seconds, both ways:
own = heights([])
sides = {"left": ("pad left", "block"), "right": ("pad right", "block")}
ours = heights([PatchContact(PAD, site=side, geoms=sides[side]) for side in sides])
figure, ax = plt.subplots(figsize=(6.4, 3.6), layout="constrained")
time = 0.005 * np.arange(1, 401)
ax.plot(time, 1e3 * own, color=style.BUILT_IN, label="MuJoCo's friction, condim 4")
ax.plot(time, 1e3 * ours, label="patches")
ax.set(xlabel="time [s]", ylabel="height of the block [mm]")
ax.legend()

# %%
# At the end:
print(f"sunk by {-1e3 * own[-1]:.3f} mm and {-1e3 * ours[-1]:.3f} mm")
assert abs(ours[-1] - ours[200]) < 1e-8
