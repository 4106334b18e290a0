"""The grip that holds while it falls: brackets of simulations, its order in the time of the fall, refusals."""

import dataclasses

import numpy as np
import pytest

import planarfriction as pf
from planarfriction.patch import PUBLISHED_PATCHES
from planarfriction.planning import (
    dynamic_holding_load,
    holding,
    holding_load,
    plan_grip,
    plan_hold,
)
from tests.support.refusals import refused

LAW = pf.LuGre(
    mu_c=1.0,
    mu_s=1.2,
    v_s=1e-3,
    sigma_0=1e6,
    sigma_1=8e2,
    sigma_2=0.2,
    elasto_plastic=0.9,
)
PADS = PUBLISHED_PATCHES["NonConvex1"]()
DISC = pf.ContactPatch.disc(0.01, cells=11)
LEVER, WEIGHT = 0.025, 0.5 * 0.2 * 9.81
LOAD = np.array([0.0, -WEIGHT, -LEVER * WEIGHT])
PLATE = {"mass": 0.1, "inertia": 0.1 * ((0.15**2 + 0.08**2) / 12 + LEVER**2)}


def moved(model, grip):
    """Distance [m] that the plate of the published runs moves as its grip changes."""
    scene = pf.scenes.in_hand(
        model, centre_of_mass=(LEVER, 0.0), normal_force=grip, t_end=0.6
    )
    data = pf.simulate(dataclasses.replace(scene, start="equilibrium")).data
    return float(np.hypot(data.x[-1] - data.x[0], data.y[-1] - data.y[0]))


@pytest.mark.parametrize("patch", [PADS, DISC], ids=["pads", "disc"])
def test_a_grip_that_drops_to_it_holds_the_plate_and_one_below_drops_it(patch):
    """In a scene of its own: 1 % above, partial slip of micrometres at 25 mm from the pads; 2 % below, millimetres."""
    model = pf.DistributedModel(patch, LAW)
    least = dynamic_holding_load(LOAD, model, **PLATE)
    high = 1.5 * holding_load(LOAD, patch, LAW.mu_s)
    assert moved(model, pf.Signal.sampled([0.0, 0.02], [high, 1.01 * least])) < 1e-4
    assert moved(model, pf.Signal.sampled([0.0, 0.02], [high, 0.98 * least])) > 1e-3


def test_cells_that_break_first_weaken_so_that_a_quick_fall_needs_more():
    """Two narrow pads: +5.4 %, +4.5 %, +3.3 % of a fall in one step, in 10 ms, in 1 s (0.1 % of search, 0.5 % room)."""
    model = pf.DistributedModel(PADS, LAW)
    slow = holding_load(LOAD, PADS, LAW.mu_s)
    shares = [
        dynamic_holding_load(LOAD, model, ramp=ramp, **PLATE) / slow
        for ramp in (0.0, 0.01, 1.0)
    ]
    assert shares == pytest.approx([1.054, 1.045, 1.033], abs=5e-3)
    assert shares[0] > shares[1] > shares[2] > 1.0
    assert shares[0] < LAW.mu_s / LAW.mu_c  # what slides is held by mu_c


def test_a_central_force_without_stribeck_needs_what_statics_says():
    """All cells break together; the search and the approach to the limit within 10 um take less than 1 %."""
    model = pf.DistributedModel(DISC, dataclasses.replace(LAW, mu_s=1.0))
    force = (0.0, -WEIGHT, 0.0)
    least = dynamic_holding_load(force, model, ramp=0.01, fall=2.0)
    assert least == pytest.approx(WEIGHT, rel=1e-2)
    assert dynamic_holding_load(
        force, model, ramp=0.01, fall=2.0, margin=0.5
    ) == pytest.approx(1.5 * least, rel=1e-12)
    assert dynamic_holding_load(np.zeros(3), model) == 0.0


def test_a_torque_alone_slips_by_its_turn():
    """The middle of the disc stays where it is: the angle alone shows the slip."""
    model = pf.DistributedModel(DISC, dataclasses.replace(LAW, mu_s=1.0))
    torque = (0.0, 0.0, 0.01)
    least = dynamic_holding_load(torque, model, ramp=0.01, fall=2.0)
    assert least == pytest.approx(holding_load(torque, DISC, 1.0), rel=3e-2)


def test_a_plan_ends_above_what_holds_the_cells_of_the_model():
    """The radius of areas of 5 x 5 cells is 2.7 % short, which shows if mu_s = mu_c; bounds that no plan meets are
    refused."""
    law = pf.LuGre(mu_c=1.0, elasto_plastic=0.9)
    by_area = pf.ContactPatch.disc(0.01, cells=5, pressure=lambda x, y: 1.0)
    coarse = pf.DistributedModel(by_area, law)
    scene = pf.scenes.in_hand(
        coarse, centre_of_mass=(LEVER, 0.0), normal_force=4.0, t_end=1.0
    )
    with refused(r"bounds must reach the 3\.9"):
        plan_grip(
            scene,
            {"angle": np.radians(-10.0)},
            knots=8,
            margin=0.0,
            bounds=(0.06, 3.885),
        )


def test_a_ramp_shorter_than_times_tell_apart_is_a_step():
    model = pf.ReducedModel(pf.ContactPatch.disc(0.01, 9), pf.LuGre(mu_s=1.2))
    step, ramp = (
        dynamic_holding_load((1.0, 0.0, 0.001), model, ramp=ramp)
        for ramp in (0.0, 5e-324)
    )
    assert ramp == step


def test_a_load_alone_weighs_what_it_pulls_at_its_contact_radius(monkeypatch):
    made = []
    monkeypatch.setattr(
        holding, "Body", lambda mass, inertia, **_: made.append((mass, inertia))
    )
    monkeypatch.setattr(holding, "_least_share", lambda slips: 1.0)
    radius = DISC.contact_radius()
    mass = np.linalg.norm([LOAD[0], LOAD[1], LOAD[2] / radius]) / 9.81
    dynamic_holding_load(LOAD, pf.DistributedModel(DISC, LAW))
    dynamic_holding_load(LOAD, pf.DistributedModel(DISC, LAW), mass=3.0)
    assert made == [
        pytest.approx((mass, mass * radius**2), rel=1e-12),
        pytest.approx((3.0, 3.0 * radius**2), rel=1e-12),
    ]


def test_the_force_in_motion_is_that_of_gravity_and_acceleration_in_the_worst_direction():
    """Without an offset the closed form is m g/2 mu + m a/2 sqrt(1 + 1/mu^2), with a pull out of the pads' plane."""
    mass, mu, most = 0.3, 0.8, 3.0
    plan = plan_hold(DISC, mu, mass=mass, acceleration=most)
    along = 0.5 * mass * most * np.hypot(1.0, 1.0 / mu)
    assert plan.needed == pytest.approx(0.5 * mass * 9.81 / mu + along, rel=1e-3)
    assert plan.at_rest == pytest.approx(0.5 * mass * 9.81 / mu, rel=1e-9)
    assert plan.worst_direction == "along +y, 40° towards a finger"  # atan(mu) is 38.7


def test_the_force_in_motion_with_an_offset_is_the_holding_load_upwards():
    """No direction needs less than `holding_load` of the same wrench, and the one upwards needs just that."""
    pad = pf.ContactPatch.rectangle(0.012, 0.02)
    plan = plan_hold(
        pad, 0.8, mass=0.3, centre_of_mass=(0.06, 0.0), acceleration=3.0, grip=30.0
    )
    up = 0.15 * 12.81 * np.array([0.0, -1.0, -0.06])
    k = np.flatnonzero((plan.angles == np.pi / 2) & (plan.elevations == 0.0))[0]
    assert plan.forces[k] == pytest.approx(holding_load(up, pad, 0.8), rel=1e-9)
    assert plan.forces[k] <= plan.needed < 1.002 * plan.forces[k]
    assert plan.safety_factor == pytest.approx(30.0 / plan.needed)
    assert plan.worst_direction == "along +y, 5° towards a finger"


def test_the_force_in_motion_of_a_soft_finger_holds_every_load_on_its_shape():
    soft = pf.ContactPatch.disc(0.01, 5, pressure=pf.SoftFinger(c=6e-3, n=0.3, k=2.0))
    plan = plan_hold(soft, 0.8, mass=0.1, centre_of_mass=(0.02, 0.01), acceleration=0.0)
    load = 0.05 * 9.81 * np.array([0.0, -1.0, -0.02])
    assert plan.needed == pytest.approx(holding_load(load, soft, 0.8), rel=1e-9)
    assert plan.worst_direction == "at rest"


def test_a_part_without_a_load_needs_no_force_and_is_drawn():
    soft = pf.ContactPatch.disc(0.01, 5, pressure=pf.SoftFinger(c=6e-3, n=0.3, k=2.0))
    assert holding_load(np.zeros(3), soft, 0.8) == 0.0
    plan = plan_hold(DISC, 0.8, mass=0.1, gravity=(0.0, 0.0), grip=1.0)
    assert plan.needed == 0.0 and plan.safety_factor == np.inf
    assert len(plan.plot().axes) == 2
    with refused("grip must be > 0, got 0"):
        plan_hold(DISC, 0.8, mass=0.1, grip=0)
