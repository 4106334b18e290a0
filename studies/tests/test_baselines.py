"""Published rules against the numbers that their equations give, and against exact limit surfaces."""

import numpy as np
import pytest

import planarfriction as pf
from planarfriction.planning import holding_load
from planarfriction_studies.rig import baselines

GRAVITY = 9.81
MU, RADIUS = 0.4931, 5.568e-3
WEIGHT = 0.5 * 0.2 * GRAVITY
"""Friction, contact radius [m] and weight on each of two fingers [N] of the published example."""


def disc(k):
    return pf.ContactPatch.disc(0.1, 5, pressure=pf.SoftFinger(c=0.1, k=k))


@pytest.mark.parametrize(
    ("k", "torque"), [(2.0, 0.589049), (4.0, 0.635410), (1e6, 0.666667)]
)
def test_largest_torque_of_a_fingertip(k, torque):
    # published to six digits
    assert pf.LimitSurfaceExact(disc(k)).wrench((0.0, 0.0, 1.0))[
        2
    ] / 0.1 == pytest.approx(-torque, abs=1e-6)


def test_force_and_torque_about_half_the_radius():
    fx, fy, tau = pf.LimitSurfaceExact(disc(4.0)).wrench((0.0, -0.05, 1.0)) / (
        1.0,
        1.0,
        0.1,
    )
    assert np.hypot(fx, fy) == pytest.approx(0.50943, abs=1e-5)
    assert abs(tau) == pytest.approx(0.51071, abs=1e-5)


def test_least_grip_of_two_fingers_against_the_ellipsoid():
    finger = pf.ContactPatch.disc(
        0.02, 5, pressure=pf.SoftFinger(c=4.353e-3, n=0.2569, k=4.0)
    )
    weight = 0.5 * 0.35 * GRAVITY
    load = np.array([0.0, -weight, -0.03 * weight])
    exact = holding_load(load, finger, mu=0.8)
    assert exact == pytest.approx(12.452, abs=2e-3)
    ellipsoid = exact
    # The radius follows the load: the smallest root by substitution.
    for _ in range(60):
        radius = 0.635410 * 4.353e-3 * ellipsoid**0.2569
        ellipsoid = float(baselines.ellipsoid_load(load, radius, 0.8))
    assert ellipsoid == pytest.approx(12.382, abs=2e-3)
    assert ellipsoid < exact


@pytest.mark.parametrize(("lever", "grip"), [(0.0, 4.0), (0.03, 21.80)])
def test_hold_rule_of_the_published_example(lever, grip):
    load = (0.0, -WEIGHT, -lever * WEIGHT)
    assert baselines.hold_rule(load, 0.0, RADIUS, MU) == pytest.approx(grip, abs=5e-3)


def test_hold_rule_rises_at_once_and_decays():
    load = (0.0, -WEIGHT, 0.0)
    assert baselines.hold_rule(load, 0.01, RADIUS, MU, before=3.0) == pytest.approx(5.0)
    assert baselines.hold_rule(load, 0.0, RADIUS, MU, before=20.0) == pytest.approx(
        19.0
    )


def test_hinge_rule_of_the_published_example():
    assert baselines.hinge_rule(WEIGHT, 0.0, MU) == pytest.approx(2.785, abs=1e-3)
    assert baselines.hinge_rule(0.01, 0.0, MU) == 0.6


def test_torque_of_a_slip_biases_the_regression_of_the_radius():
    surface = pf.LimitSurfaceExact(
        pf.ContactPatch.disc(
            RADIUS / 0.635410, 5, pressure=pf.SoftFinger(c=RADIUS / 0.635410, k=4.0)
        )
    )
    turning = [-surface.wrench((speed, 0.0, 0.5))[2] / RADIUS for speed in (2e-3, 5e-3)]
    assert turning == pytest.approx([0.835, 0.340], abs=1e-3)
    speed = np.full(50, 5e-3)
    wrench = (
        -0.5
        * 3.0
        * surface.wrench(np.stack([speed, 0 * speed, 0 * speed + 0.5], axis=-1))
    )
    sliding = -0.5 * 3.0 * surface.wrench((0.01, 0.0, 0.0))
    found = baselines.regression(
        np.append(np.hypot(*wrench[:, :2].T), sliding[0]),
        np.append(wrench[:, 2], 0.0),
        3.0,
        np.append(speed, 0.01),
        np.append(0.5 + 0 * speed, 0.0),
    )
    assert found.mu_c == pytest.approx(0.5)
    # Published: up to -66 %.
    assert found.radius / RADIUS - 1.0 == pytest.approx(-0.66, abs=0.01)


def test_regression_finds_friction_that_grows_with_speed():
    speed = np.linspace(1e-3, 0.05, 80)
    found = baselines.regression(
        2.0 * (0.4 + 1.5 * speed), 0.0 * speed, 2.0, speed, 0.0 * speed
    )
    assert (found.mu_c, found.mu_v) == pytest.approx((0.4, 1.5))
    assert found.mu_s == pytest.approx(0.4 + 1.5 * speed[speed < 2e-3].max())
    assert np.isnan(found.radius)


def test_slip_rules_follow_their_equations():
    linear = baselines.LINEAR_RULE
    assert linear.commanded(0.01, 0.02, 0.005) == pytest.approx(0.025)
    assert linear.grip(4.0, 0.01, 0.025, 0.1, 1e-3) == pytest.approx(
        4.0 - 1.0 + 0.04 - 3.0
    )
    assert baselines.ROTATION_RULE.grip(4.0, 0.5, 0.3, 1.0, 0.0) == pytest.approx(
        4.0 + 0.2 + 1.6
    )


def test_disc_observer_finds_the_speed_of_a_slip():
    observer = baselines.DiscObserver()
    lever = 0.02
    largest = 0.02
    spin = 1.5
    state = np.zeros(2)
    applied = observer.damping * spin + largest  # a turn at a constant speed
    for _ in range(4000):
        state = observer.step(state, applied, largest, largest, lever, 1e-3)
    assert state[1] * observer.sigma_0 == pytest.approx(largest, rel=1e-6)
    assert state[0] == pytest.approx(spin, rel=1e-3)
