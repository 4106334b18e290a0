"""
A pivot, a foot and a curling stone
===================================

Three contacts beyond a plate in a hand, each a ready-made scene: a part swings in a loosened grip, a robot turns on one
foot, and a curling stone spins to rest. All three also run from the command line, such as `planarfriction run pivot`.
"""

import numpy as np

import planarfriction as pf

law = pf.LuGre(mu_s=1.2, elasto_plastic=0.9)

# %%
# Pivot a part in a gripper
# -------------------------
#
# A part held by one end stays level as long as two soft fingers can hold its torque, `2 mu f_N r`. The contact of a
# soft finger grows with its load, so the torque falls faster than the grip force. A quarter of the force still
# carries the weight, but not the torque: 35 N mm here.
finger = pf.SoftFinger(c=0.006, n=1 / 3, k=2.0, radius_max=0.012)
pads = pf.DistributedModel(pf.ContactPatch.disc(0.012, pressure=finger), law)
for load in (1.0, 4.0):
    print(f"{load:.0f} N hold {2e3 * load * pads.patch.contact_radius(load):.1f} N mm")

# %%
# The longer the grip is loosened, the farther the part swings before the fingers catch it. Friction also carries its
# weight and the centrifugal force meanwhile, so the part slides a little. A pendulum on a pin with the friction of a
# pure spin has neither effect.
swings = {}
for length in (0.06, 0.09, 0.12, 0.15):
    grip = pf.Signal.sampled([0.0, 0.2, 0.2 + length], [4.0, 1.0, 6.0])
    swings[length] = pf.simulate(pf.scenes.pivot(pads, normal_force=grip))
    end = swings[length].data.isel(time=-1)
    slide = np.hypot(end.x - 0.06 * np.cos(end.theta), end.y - 0.06 * np.sin(end.theta))
    print(
        f"{1e3 * length:.0f} ms: {np.degrees(float(end.theta)):.1f} deg, slides {1e3 * float(slide):.1f} mm"
    )
swing = pf.plots.plot_motion(swings[0.09])

# %%
# Turn a foot on the ground
# -------------------------
#
# How much yaw torque can a sole resist without a side force? A sole slips about the point where turning costs the
# least power, which is not its centre of pressure. `LimitSurfaceExact` finds that point as the normal of the limit
# surface.
outline = 1e-3 * np.array(
    [
        (0, -25),
        (0, 25),
        (90, 33),
        (200, 48),
        (260, 20),
        (265, -10),
        (210, -47),
        (100, -32),
    ]
)


def standing(x, y):
    """Pressure under heel and ball of a standing shoe, at any scale."""
    heel = np.exp(-(((x - 0.035) / 0.03) ** 2) - (y / 0.025) ** 2)
    ball = np.exp(-(((x - 0.195) / 0.035) ** 2) - (y / 0.04) ** 2)
    return heel + 0.75 * ball + 0.03


sole = pf.ContactPatch.polygon(outline, cells=30, pressure=standing)
turn = pf.LimitSurfaceExact(sole).twist((0.0, 0.0, -1.0))
print(
    f"centre of pressure at {1e3 * sole.centre_of_pressure()[0]:.0f} mm, r = {1e3 * sole.contact_radius():.1f} mm"
)
print(
    f"turns about {-1e3 * turn[1] / turn[2]:.0f} mm, at {1e3 / turn[2]:.1f} mm times mu f_N"
)
shoe = sole.plot(normal_force=400.0)
assert 1.0 / turn[2] < sole.contact_radius()

# %%
# The scene `foot` makes use of this: a robot of 40 kg stands on its heel while it turns to the left, shifts its
# weight to the forefoot, and turns back. The foot has moved sideways without a step (Miura et al., "Quick slip-turn
# of HRP-4C on its toes"). The loads are given, because a planar scene has no equation for tipping.
step = pf.simulate(pf.scenes.foot(pf.ReducedModel(pf.ContactPatch.disc(0.03), law)))
end = step.data.isel(time=-1)
print(
    f"turned by {np.degrees(float(step.data.theta.max())):.1f} deg and back, {1e3 * float(end.y):.0f} mm aside"
)
walk = pf.plots.plot_motion(step)

# %%
# Slide a curling stone
# ---------------------
#
# A uniform disc on a table stops sliding and spinning at the same moment, and v/(omega R) tends to 0.653 however it
# is thrown (Farkas et al., Physical Review Letters 90, 2003).
coulomb = pf.LuGre(mu_c=0.2, sigma_0=1e5, sigma_1=10.0, sigma_2=0.0)
puck = pf.ReducedModel(pf.ContactPatch.disc(0.04), coulomb, cells=64)
for spin in (20.0, 30.0, 60.0):
    data = pf.simulate(
        pf.scenes.free_slide(puck, twist=(1.0, 0.0, spin), save_every=1e-3)
    ).data
    slow = data.sel(time=data.time[data.vx > 0.02]).isel(time=-1)
    ratios = [
        float(each.vx / (0.04 * each.omega)) for each in (data.isel(time=0), slow)
    ]
    print(f"v/(omega R) = {ratios[0]:.2f} at the start, {ratios[1]:.2f} at 2 cm/s")

# %%
# A curling stone touches the ice with a narrow ring, and its mass reaches farther out than that ring: it ends
# spinning on the spot. It does not curl, because friction that is the same in all directions on an evenly loaded
# ring opposes the velocity. Why real stones curl is a question about ice.
ice = pf.LuGre(mu_c=0.01, sigma_0=1e5, sigma_1=10.0, sigma_2=0.0)
stone = pf.simulate(
    pf.scenes.curling(pf.ReducedModel(pf.ContactPatch.ring(0.0585, 0.0645), ice))
)
end = stone.data.isel(time=-1)
print(
    f"{float(end.x):.2f} m in {float(end.time):.1f} s, {float(end.theta) / (2 * np.pi):.2f} turns"
)
histories = pf.plots.plot_histories(stone)
