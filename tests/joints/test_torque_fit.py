"""Fits of joints to torques: numbers and terms that another simulation made, and the sets of terms that are kept."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest

from planarfriction.errors import InvalidValueError
from planarfriction.joints import JointFriction, JointLog, Plant, identify_joint
from planarfriction.joints.balance import TERMS, refine
from planarfriction.joints.torque_fit import doubt, prepare
from tests.support.refusals import refused
from tests.support.torque_joints import Numbers, Sensors, draw, recorded

LUGRE = JointFriction(0.8, 0.3, 0.0, 0.0, 1.2, 0.05, 400.0, 2.0)


def torque_log(noise=0.01, seed=0):
    """Return a log of a slow wave with ripples, then fast, with noise on its torque."""
    t = 1e-3 * np.arange(12_000)
    q = (
        0.08 * np.sin(1.57 * t)
        + 0.006 * np.sin(14.5 * t)
        + 0.8 * np.sin(3.14 * t) * np.clip((t - 8.0) / 2.0, 0.0, 1.0)
    )
    log = JointLog(t, q, torque=np.sin(t))
    torque = 0.05 * log.acceleration + LUGRE.along(t, log.speed)
    torque += (
        noise
        * np.sqrt(np.mean(torque**2))
        * np.random.default_rng(seed).normal(size=len(t))
    )
    return JointLog(t, q, torque=torque)


def logs_of(numbers, sensors=Sensors(), kinds=("sines", "levels", "sines")):  # noqa: B008
    rng = np.random.default_rng(7)
    made = [recorded(numbers, kind, sensors, rng) for kind in kinds]
    return [
        JointLog(t, q, torque=torque, name=f"log {i}")
        for i, (t, q, torque) in enumerate(made)
    ]


def holds(fit, name, truth):
    low, high = fit.intervals[name]
    return low <= truth <= high


def test_terms_that_matter_only_together_are_found():
    """Six numbers of LuGre come back from one noisy log without being told the terms."""
    log = torque_log()
    fit = identify_joint(log, Plant(inertia=0.05))
    assert fit.terms == ("stribeck", "bristles")
    truth = {
        "mu_c": 0.8,
        "sigma_2": 0.3,
        "rise": 0.4,
        "v_s": 0.05,
        "sigma_0": 400.0,
        "sigma_1": 2.0,
        "inertia": 0.05,
    }
    assert {
        name: fit.values[name] for name in truth if name != "sigma_1"
    } == pytest.approx(
        {name: value for name, value in truth.items() if name != "sigma_1"}, rel=0.03
    )
    assert all(holds(fit, name, value) for name, value in truth.items())
    assert fit.unit == "N m" and fit.error < 0.003  # 1 % of noise, smoothed
    upper, lower, side = (axes.get_lines() for axes in fit.plot().axes)
    (series,) = fit.series
    np.testing.assert_allclose(upper[0].get_ydata(), series.measured)
    np.testing.assert_allclose(upper[2].get_ydata(), series.fitted)
    np.testing.assert_allclose(lower[1].get_ydata(), series.fitted - series.measured)
    speed, level = side[0].get_xydata().T
    friction = fit.friction
    fall = (friction.mu_s - friction.mu_c) * np.exp(-((speed / friction.v_s) ** 2))
    np.testing.assert_allclose(level, friction.mu_c + fall + friction.sigma_2 * speed)
    assert speed[-1] == pytest.approx(np.abs(log.speed).max())


def test_a_rotor_without_gears_has_no_load():
    """Where the motor accelerates, a level that grows with the torque would explain its own target."""
    fit = identify_joint(logs_of(Numbers(mu_c=0.3, sigma_2=0.1)), Plant())
    assert set(fit.terms) <= {"bristles"}  # the simulation has them: 3e-5 rad
    assert (
        holds(fit, "mu_c", 0.3)
        and holds(fit, "inertia", 0.05)
        and holds(fit, "sigma_2", 0.1)
    )


def test_ideal_coulomb_friction_behind_a_coarse_encoder_has_no_load_and_no_fall():
    t = 2e-3 * np.arange(8000)
    q = 0.5 * np.sin(2.0 * t) + 0.15 * np.sin(5.3 * t)
    v = np.cos(2.0 * t) + 0.795 * np.cos(5.3 * t)
    a = -2.0 * np.sin(2.0 * t) - 4.2135 * np.sin(5.3 * t)
    torque = (
        0.05 * a
        + 0.8 * np.sign(v)
        + 0.3 * v
        + np.random.default_rng(0).normal(0.0, 0.01, len(t))
    )
    step = 2.0 * np.pi / 4096
    fit = identify_joint(JointLog(t, np.round(q / step) * step, torque=torque), Plant())
    assert fit.terms == ()
    for name, truth in {"mu_c": 0.8, "sigma_2": 0.3, "inertia": 0.05}.items():
        assert holds(fit, name, truth) and fit.values[name] == pytest.approx(
            truth, rel=0.05
        )
    assert fit.friction.mu_s == fit.friction.mu_c


def test_a_load_is_found_beside_gravity():
    hanging = Numbers(inertia=0.13, gravity=1.962, load=0.2, mu_c=0.3, sigma_2=0.1)
    fit = identify_joint(logs_of(hanging), Plant())
    assert {"gravity", "load"} <= set(fit.terms) <= {"gravity", "load", "bristles"}
    assert (
        fit.values["load"] == pytest.approx(0.2, rel=0.01)
        and holds(fit, "gravity", 1.962)
        and holds(fit, "mu_c", 0.3)
    )


def test_an_external_torque_belongs_to_the_load_and_not_to_friction():
    """A spring of 3 N m/rad on the joint whose torque is measured: without it, friction would be wrong."""
    t = 2e-3 * np.arange(6000)
    q = 0.5 * np.sin(2.0 * t) + 0.1 * np.sin(7.0 * t)
    v = np.cos(2.0 * t) + 0.7 * np.cos(7.0 * t)
    a = -2.0 * np.sin(2.0 * t) - 4.9 * np.sin(7.0 * t)
    torque = (
        0.05 * a
        + 0.4 * np.sign(v)
        + 0.2 * v
        + 3.0 * q
        + np.random.default_rng(0).normal(0.0, 0.01, len(t))
    )
    fit = identify_joint(JointLog(t, q, torque=torque, external=-3.0 * q), Plant())
    assert fit.terms == () and holds(fit, "mu_c", 0.4) and holds(fit, "sigma_2", 0.2)


def test_a_term_that_was_asked_for_and_does_not_show_reaches_no_law(tmp_path):
    logs = logs_of(Numbers(), kinds=("sines",))
    fit = identify_joint(logs, Plant(), terms=("stribeck",))
    assert fit.terms == ("stribeck",) and "stribeck" in fit.unclear
    with refused("terms of the fit must be without stribeck"):
        _ = fit.friction
    assert "not shown by these logs" in str(fit.verdicts[-1])


def test_terms_of_goals_are_refused_for_torques():
    with refused(
        r"terms must be some of gravity, .* for logs of a torque, got directional"
    ):
        identify_joint(torque_log(), Plant(), terms=("load", "directional"))


def test_a_log_of_standing_beside_others_is_left_out_and_named():
    moving = logs_of(Numbers(), kinds=("sines",))
    t = moving[0].time
    still = JointLog(t, 0.0 * t, torque=0.1 * np.sin(t), name="still")
    fit = identify_joint([*moving, still], Plant())
    assert any("still: hardly moves, left out" in str(each) for each in fit.verdicts)
    assert [each.name for each in fit.series] == ["log 0"]


def test_steps_are_told_and_may_end_a_fit():
    told = []

    def progress(words):
        told.append(words)
        if len(told) == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        identify_joint(torque_log(), Plant(), progress=progress)
    assert told[-1].startswith("first estimate, ") and "mu_c = 0." in told[-1]


def test_a_late_start_of_time_changes_nothing():
    logs = logs_of(Numbers(), kinds=("levels",))
    later = [dataclasses.replace(log, time=log.time + 1000.0) for log in logs]
    one, other = (
        identify_joint(each, Plant(), terms=()).values for each in (logs, later)
    )
    assert one == pytest.approx(other, rel=1e-5, abs=1e-6)


def test_a_slow_fall_of_friction_is_seen_behind_a_coarse_encoder():
    """Stribeck speed 0.04 rad/s; 11 bits at 1 kHz leave noise of 0.02 rad/s on the speed."""
    falls = Numbers(
        inertia=0.038, mu_c=0.74, sigma_2=0.095, rise=0.24, v_s=0.04, sigma_0=2.5e4
    )
    fit = identify_joint(logs_of(falls, Sensors(rate=1000, bits=11)), Plant())
    assert "stribeck" in fit.terms
    assert (
        holds(fit, "rise", 0.24)
        and holds(fit, "v_s", 0.04)
        and holds(fit, "mu_c", 0.74)
    )


def test_a_fall_of_friction_is_seen_behind_bristles_that_bend_far():
    """Bristles of 17 mrad blur the fall: the search over bends, a factor of 3 apart, takes it for another bend."""
    bent = Numbers(
        inertia=0.038,
        mu_c=0.25,
        sigma_2=0.088,
        rise=0.19,
        v_s=0.058,
        sigma_0=15.0,
        sigma_1=0.075,
    )
    fit = identify_joint(
        logs_of(
            bent, Sensors(rate=1000, bits=20), ("sines", "levels", "sines", "ripples")
        ),
        Plant(),
    )
    assert fit.terms == ("stribeck", "bristles")
    assert [fit.values[name] for name in ("rise", "v_s", "sigma_0")] == pytest.approx(
        [0.19, 0.058, 15.0], rel=0.03
    )


@pytest.mark.parametrize(
    ("middle", "shown"), [((0.3, 0.5), True), ((0.02, 0.02), False)]
)
def test_a_level_at_rest_of_many_times_the_coulomb_level_needs_speeds_between(
    middle, shown
):
    """Speeds of 0.02 and 1 rad/s alone do not show how friction falls between them."""
    t = 1e-3 * np.arange(16_000)
    side = np.sign(np.sin(np.pi * t))
    speed = side * np.select([t < 4.0, t < 8.0, t < 12.0], [0.02, *middle], 1.0)
    q = np.cumsum(np.convolve(speed, np.ones(5) / 5.0, mode="same")) * 1e-3
    data = prepare([JointLog(t, q, torque=np.sin(t))])
    fit = SimpleNamespace(
        values={"mu_c": 0.1, "rise": 0.5, "v_s": 0.6}, spread={"rise": 0.01, "v_s": 0.1}
    )
    assert doubt(data, fit, "stribeck").startswith("mu_s would be 6 mu_c") != shown
    fit.values["rise"] = 0.15
    assert not doubt(data, fit, "stribeck")


@pytest.mark.parametrize("gap", [0.0, 0.004])
def test_backlash_is_said(gap):
    """Motor and link of 0.02 and 0.04 kg m^2 with a gap of 4 mrad either way are no joint of one inertia."""
    rng = np.random.default_rng(3)
    made = [
        recorded(Numbers(inertia=0.06), kind, Sensors(), rng, gap)
        for kind in ("sines", "levels", "sines")
    ]
    fit = identify_joint(
        [JointLog(t, q, torque=torque) for t, q, torque in made], Plant()
    )
    assert any("backlash" in str(each) for each in fit.verdicts) == (gap > 0.0)


INDEPENDENT = 2.0 * np.sqrt(np.pi)
"""Widths of a Gaussian kernel after which white noise counts anew: rows lie one width apart."""


def likelihood_ratio(logs, joint, term):
    """Return twice the logarithm of the likelihood with a term over that without it, from the true numbers."""
    rows = prepare(logs).rows
    start = (
        dict.fromkeys(["torque_offset", "delay", "asymmetry", "sigma_1"], 0.0)
        | joint.truth
    )
    start |= {
        "delay": joint.about["late"] + joint.about["filtered"],
        "gravity_sin": joint.truth.get("gravity", 0.0),
    }
    start |= {
        "gravity_cos": -start["gravity_sin"] * np.sin(joint.truth.get("offset", 0.0))
    }
    rest = joint.terms - {term}
    whole, less = (
        refine(rows, start, [each for each in TERMS if each in terms])
        for terms in (joint.terms, rest)
    )
    gain = np.log(np.square(less.error).sum() / np.square(whole.error).sum())
    return len(whole.error) / INDEPENDENT * gain


@pytest.mark.slow
def test_joints_of_another_simulation():
    """A hundred drawn joints: few false terms, few that show are lost, intervals hold the truth.

    Bristles of "rigid" joints bend by 3e-5 rad in the simulation: found, they are no false term. Backlash is no term of
    the model: where it moves a number out of its interval, the fit is refused or says that it does not explain the
    friction. The rules were set with joints 0 to 99 in view, and these are the next hundred.
    """
    false = []
    lost = []
    silent = []
    held = []
    for seed in range(100, 200):
        joint = draw(seed)
        logs = [
            JointLog(t, q, torque=torque, name=f"log {i}")
            for i, (t, q, torque) in enumerate(joint.logs)
        ]
        try:
            fit = identify_joint(logs, Plant())
        except InvalidValueError:
            assert joint.about["gap"], seed
            continue
        bends = (
            fit.values["mu_c"] / fit.values["sigma_0"]
            if "bristles" in fit.terms
            else np.inf
        )
        false += [
            (seed, each)
            for each in set(fit.terms)
            - joint.terms
            - ({"bristles"} if bends < 3e-4 else set())
        ]
        lost += [
            (seed, each)
            for each in joint.terms - set(fit.terms)
            if likelihood_ratio(logs, joint, each) >= 18.0
        ]
        outside = [
            name
            for name in joint.truth
            if fit.intervals.get(name) and not holds(fit, name, joint.truth[name])
        ]
        if joint.about["gap"]:
            silent += (
                [seed]
                if outside and not any("backlash" in str(each) for each in fit.verdicts)
                else []
            )
        else:
            held += [
                name not in outside for name in joint.truth if fit.intervals.get(name)
            ]
    print(
        f"false {false}, lost {lost}, silent {silent}, {np.mean(held):.3f} of {len(held)} intervals hold"
    )
    assert len(false) <= 3 and len(lost) <= 5 and not silent
    assert 0.93 <= np.mean(held) <= 0.99
