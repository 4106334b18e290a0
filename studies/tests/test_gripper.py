"""The rig: what it holds, how it slips, and what its sensors say."""

import numpy as np
import pytest

import planarfriction as pf
from planarfriction.online import Sensors
from planarfriction.planning import holding_load
from planarfriction_studies.rig import Gripper, Parts
from tests.support.refusals import refused

QUIET = Sensors(force_noise=0.0, torque_noise=0.0)


def parts(count=1, **changes):
    lever = changes.pop("lever", 0.02)
    given = {"mass": 0.2, "inertia": 3e-4, "mu_c": 0.5} | changes
    full = {
        name: np.broadcast_to(given.pop(name), (count,))
        for name in ("mass", "inertia", "mu_c")
    }
    return Parts(
        full["mass"],
        full["inertia"],
        np.tile([lever, 0.0], (count, 1)),
        full["mu_c"],
        **given,
    )


def run(gripper, command, seconds):
    """Run with a constant command; the samples as arrays of columns."""
    samples = [gripper.step(command) for _ in range(round(1e3 * seconds))]
    return [
        np.array([getattr(s, name) for s in samples])
        for name in ("time", "wrench", "normal_force", "slip_velocity")
    ]


def test_a_strong_grip_carries_the_load_and_does_not_move():
    gripper = Gripper(parts(), 20.0, sensors=QUIET)
    _, wrench, force, slip = run(gripper, 20.0, 0.2)
    weight = 0.5 * 0.2 * 9.81
    assert wrench[-1, 0] == pytest.approx(
        [0.0, weight, 0.02 * weight], abs=1e-5 * weight
    )
    assert force[-1] == pytest.approx(20.0)
    assert not np.nan_to_num(slip).any()
    assert abs(gripper.slip).max() < 1e-7


def test_the_slip_begins_at_the_holding_load():
    # cells are coarse, and a fall in half a second needs a little more (docs/grip-planning.md): 3 %
    gripper = Gripper(
        parts(radius=6e-3, growth=0.0, mu_ratio=1.0), 12.0, sensors=QUIET, cells=11
    )
    finger = pf.ContactPatch.disc(6e-3, 21, pressure=pf.SoftFinger(c=6e-3, k=4.0))
    expected = holding_load(gripper.load()[0], finger, mu=0.5)
    for k in range(900):
        gripper.step(12.0 - 0.01 * k)
        if abs(gripper.slip[0, 2]) > 2e-3:
            break
    assert gripper.normal_force[0] == pytest.approx(expected, rel=0.03)


def test_the_scaled_patch_is_the_distributed_model_of_the_finger():
    # mu and radius are symmetries: the same motion as a model with its own patch and law, solved accurately
    held = parts(radius=6e-3, growth=0.0, mu_ratio=1.0, lever=0.01)
    gripper = Gripper(held, 3.0, sensors=QUIET, cells=7)
    gripper._bristles[:] = 0.0
    gripper._scaled_wrench[:] = 0.0  # relaxed, as the scene starts
    for _ in range(80):
        gripper.step(3.0)
    law = pf.LuGre(
        mu_c=0.5,
        mu_s=0.5,
        v_s=2e-3,
        sigma_0=1e5,
        sigma_1=50.0,
        sigma_2=0.1,
        elasto_plastic=0.9,
    )
    finger = pf.DistributedModel(
        pf.ContactPatch.disc(6e-3, 7, pressure=pf.SoftFinger(c=6e-3, k=4.0)), law
    )
    body = pf.Body(0.2, 3e-4, position=(0.01, 0.0))
    scene = pf.Scene(body, pf.Contact(finger, 3.0, count=2), 0.08)
    end = pf.simulate(scene).data.isel(time=-1)
    # Steps of 1 ms are 1.2 % of 80 ms twice integrated.
    assert gripper.angle[0] == pytest.approx(float(end.theta), rel=0.02)
    assert gripper.centre[0] == pytest.approx([float(end.x), float(end.y)], rel=0.02)
    assert abs(gripper.angle[0]) > 0.05


def test_the_grip_is_limited_in_its_rate_and_follows_its_command():
    gripper = Gripper(parts(), 10.0, sensors=QUIET, rate_limit=50.0)
    _, _, force, _ = run(gripper, 20.0, 0.5)
    assert np.diff(force[:, 0]).max() == pytest.approx(0.05)
    assert force[-1, 0] == pytest.approx(20.0, rel=0.01)


def test_sensors_are_late_biased_and_noisy():
    gripper = Gripper(parts(200, delay=0.02, bias=(0.05, 0.0, 1e-3)), 20.0, seed=3)
    time, wrench, force, _ = run(gripper, 20.0, 0.05)
    assert time[-1] == pytest.approx(0.03)
    assert wrench[..., 0].mean() == pytest.approx(0.05, abs=1e-3)
    assert wrench[..., 0].std() == pytest.approx(0.02, rel=0.05)
    assert wrench[..., 2].std() == pytest.approx(2e-4, rel=0.05)
    assert force.std() == pytest.approx(0.02, rel=0.05)


def test_an_empty_hand_shows_the_bias():
    gripper = Gripper(
        parts(2, delay=0.02, bias=((0.05, 0.0, 1e-3), (0.0, -0.02, 0.0))), 20.0, seed=3
    )
    samples = list(gripper.empty_hand(400))
    assert np.mean([each.wrench for each in samples], axis=0) == pytest.approx(
        gripper.parts.bias, abs=4e-3
    )
    assert abs(np.mean([each.normal_force for each in samples])) < 4e-3
    assert samples[-1].time.max() < gripper.measurement.time.min()


@pytest.mark.parametrize("samples", ["100", 0, 1.5])
def test_an_empty_hand_refuses_at_once(samples):
    """When it is called, and not when the first sample is asked for."""
    with refused("samples must"):
        Gripper(parts(), 20.0).empty_hand(samples)


def test_an_empty_hand_counts_with_any_whole_number():
    assert len(list(Gripper(parts(), 20.0).empty_hand(3.0))) == 3


def test_the_slip_sensor_counts_and_loses_nothing():
    gripper = Gripper(parts(), 1.5, sensors=QUIET)
    time, _, _, slip = run(gripper, 1.5, 0.1)
    seen = ~np.isnan(slip[:, 0, 0])
    assert seen.sum() == 12
    places = (slip[seen] * np.diff(time[seen, 0], prepend=0.0)[:, None, None]).sum(
        axis=0
    )
    unit = 0.95e-3 / 120.0
    last = round(1e3 * time[seen, 0][-1])
    assert last >= 99
    assert abs(places[0, 1] - gripper.slip[0, 1]) < unit + 1e-3 * abs(
        gripper.twist[0, 1]
    )


def test_a_part_that_is_let_go_falls():
    gripper = Gripper(parts(), 0.05, sensors=QUIET)
    run(gripper, 0.0, 0.2)
    assert gripper.normal_force[0] < 1e-3
    assert gripper.centre[0, 1] == pytest.approx(-0.5 * 9.81 * 0.2**2, rel=0.1)


def test_taps_and_tilts_load_the_part():
    gripper = Gripper(
        parts(
            tap=(1.0, 0.0, 0.0),
            tap_time=0.01,
            tilt=0.5,
            tilt_time=0.05,
            tilt_duration=0.01,
        ),
        40.0,
    )
    loads = []
    for _ in range(80):
        gripper.step(40.0)
        loads.append(gripper.load()[0])
    weight = 0.5 * 0.2 * 9.81
    assert max(load[0] for load in loads) == pytest.approx(0.5, rel=1e-2)
    assert loads[-1][:2] == pytest.approx(
        [-weight * np.sin(0.5), -weight * np.cos(0.5)]
    )


def test_bad_parts_and_commands_are_refused():
    with refused(r"centre must have shape \[1, 2\]"):
        Parts([0.1], [1e-4], (0.0, 0.0, 0.0), [0.5])
    with refused("mu_ratio must be >= 1"):
        parts(mu_ratio=0.9)
    gripper = Gripper(parts(), 5.0)
    with refused("command must be finite and >= 0"):
        gripper.step(-1.0)
