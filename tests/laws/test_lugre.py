"""Friction laws: one-cell patches are the classical one-dimensional models; wrong parameters get one line."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import planarfriction as pf
from planarfriction.errors import FrictionError, InvalidValueError

POINT = pf.ContactPatch.points([(0.0, 0.0)])
LOAD = 3.0
PARAMETERS = {
    "mu_c": 0.6,
    "mu_s": 0.9,
    "v_s": 2e-3,
    "sigma_0": 1e5,
    "sigma_1": 300.0,
    "sigma_2": 0.4,
}


def one_cell(**changes):
    """The classical model: one bristle that carries the whole load."""
    return pf.DistributedModel(POINT, pf.LuGre(**{**PARAMETERS, **changes}))


def pulled(model, velocities, dt, state=None):
    """Forces [N] along x after each of the `velocities` [m/s] was held for `dt` [s], and the last state."""
    state = model.rest() if state is None else state
    forces = []
    for velocity in velocities:
        state, wrench = model.step(state, (velocity, 0.0, 0.0), LOAD, dt)
        forces.append(wrench[0])
    return np.array(forces), state


# ---------------------------------------------------------------------- Stribeck curve


@pytest.mark.parametrize("gamma", [0.7, 1.0, 2.0])
@pytest.mark.parametrize(
    "elasto_plastic", [None, pf.ElastoPlastic(0.8)], ids=["plain", "elasto-plastic"]
)
def test_steady_force_is_the_stribeck_curve_with_its_viscous_term(
    gamma, elasto_plastic
):
    model = one_cell(gamma=gamma, elasto_plastic=elasto_plastic)
    speed = 2e-3 * np.array([0.01, 0.3, 1.0, 2.0, 10.0, 1000.0])
    twist = np.stack([speed, 0 * speed, 0 * speed], -1)
    # A step long enough for the slowest, g/(sigma_0 v) = 0.5 s.
    _, wrench = model.step(model.rest(), twist, LOAD, 1e3)
    g = 0.6 + 0.3 * np.exp(-((speed / 2e-3) ** gamma))
    # Nothing is left of the start (exp(-2000)); the rounding of zdot, 1e-16 of v = 2 m/s, meets sigma_1 = 300.
    assert -wrench[:, 0] == pytest.approx((g + 0.4 * speed) * LOAD, rel=1e-12)
    assert not wrench[:, 1:].any()


@given(st.floats(-math.pi, math.pi), st.floats(1e-5, 1.0))
@settings(deadline=None, max_examples=25)
def test_friction_opposes_the_velocity_in_every_direction(angle, speed):
    model = one_cell(sigma_2=0.0)
    _, wrench = model.step(
        model.rest(), (speed * math.cos(angle), speed * math.sin(angle), 0.0), LOAD, 1e6
    )
    g = 0.6 + 0.3 * math.exp(-((speed / 2e-3) ** 2))
    assert wrench == pytest.approx(
        -g * LOAD * np.array([math.cos(angle), math.sin(angle), 0.0]),
        rel=1e-12,
        abs=1e-13,
    )


def test_a_point_resists_no_spin():
    model = one_cell()
    state, wrench = model.step(model.rest(), (0.0, 0.0, 100.0), LOAD, 1.0)
    assert not state.any() and not wrench.any()


# ---------------------------------------------------------------------- pre-sliding


def test_bristle_is_a_spring_and_a_damper_at_first():
    model = one_cell(elasto_plastic=pf.ElastoPlastic(0.9))
    # A third of the steady deflection: purely elastic.
    state = np.array([[2e-6], [0.0]])
    wrench = model.wrench(state, (1e-4, 0.0, 0.0), LOAD)
    # Rounding.
    assert -wrench[0] == pytest.approx(
        (1e5 * 2e-6 + 300.0 * 1e-4 + 0.4 * 1e-4) * LOAD, rel=1e-14
    )


def test_breakaway_force():
    """Pulled slowly, a bristle holds up to mu_s f_N and no more."""
    law = {"sigma_1": 0.0, "sigma_2": 0.0, "elasto_plastic": pf.ElastoPlastic(0.9)}
    forces, _ = pulled(one_cell(**law), np.full(3000, 1e-6), 5e-2)
    # g(1e-6 m/s) misses mu_s by (v/v_s)^2 = 2.5e-7 of it; after 17 times z_max, exp(-17 + 2) = 3e-7 are missing.
    assert -forces.min() == pytest.approx(0.9 * LOAD, rel=1e-6)
    # Up to the share s_ba of that the force is exactly the spring's.
    held = -forces < 0.9 * 0.9 * 0.9 * LOAD
    displacement = 5e-8 * np.arange(1, 3001)
    # 0.81 z_max, in whole steps.
    assert held.sum() == pytest.approx(0.9 * 0.9 * 9e-6 / 5e-8, abs=1)
    # 800 additions.
    assert -forces[held] == pytest.approx(1e5 * displacement[held] * LOAD, rel=1e-12)


def test_hysteresis_loop_in_pre_sliding():
    """Small oscillations dissipate: the force drawn over the displacement encloses an area, run through clockwise."""
    model = one_cell(sigma_1=0.0, sigma_2=0.0, mu_s=0.6)
    amplitude = 4e-6
    n = 1000
    cycles = 5  # two thirds of the full deflection mu_c/sigma_0
    x = amplitude * np.sin(2 * np.pi * np.arange(cycles * n + 1) / n)
    forces, _ = pulled(model, np.diff(x) / 1e-3, 1e-3)
    work = -0.5 * (forces[1:] + forces[:-1]) * np.diff(x)[1:]
    loops = [work[k * n : (k + 1) * n].sum() for k in (2, 3)]
    # The Dahl loop between +-A in closed form, from `F = F_c (1 - c exp(-(x + A)/z))` with equal forces at both tips.
    z = 6e-6
    limit = 0.6 * LOAD
    closed = 4 * limit * (amplitude - z * math.tanh(amplitude / z))
    # Settles by exp(-4 A/z) = 0.07 a cycle: 3e-4 after three; the trapezoidal rule adds 1e-5.
    assert loops == pytest.approx([closed, closed], rel=1e-3)


def test_dahl_limit():
    """mu_s = mu_c, no damping, no viscous term: `F = F_c (1 - exp(-x/z))`, whatever the speed, `z = mu_c/sigma_0`."""
    model = one_cell(mu_s=0.6, sigma_1=0.0, sigma_2=0.0)
    for speeds in (np.full(200, 1e-4), np.full(200, 3.0), np.geomspace(1e-5, 1.0, 200)):
        dt = 1e-7 / speeds  # 0.1 micrometres each
        state = model.rest()
        forces = []
        for v, step in zip(speeds, dt, strict=True):
            state, wrench = model.step(state, (v, 0.0, 0.0), LOAD, step)
            forces.append(wrench[0])
        x = 1e-7 * np.arange(1, 201)
        # Plain LuGre steps are exact: 200 roundings.
        assert -np.array(forces) == pytest.approx(
            0.6 * LOAD * (1.0 - np.exp(-x / 6e-6)), rel=2e-13
        )


def test_dahl_unloading_from_full_friction():
    model = one_cell(mu_s=0.6, sigma_1=0.0, sigma_2=0.0)
    full = np.array([[6e-6], [0.0]])
    forces, _ = pulled(model, np.full(300, -1e-4), 1e-3, full)
    x = 1e-7 * np.arange(1, 301)
    # 300 roundings.
    assert -forces == pytest.approx(
        0.6 * LOAD * (2.0 * np.exp(-x / 6e-6) - 1.0), abs=1e-12
    )


# ---------------------------------------------------------------------- drift


def positions(model, cycles):
    """Position [m] of a light mass in stick after each cycle of 0.1 s of a force of 0.4 + 0.3 sin of Coulomb's.

    The mass is so light that the balance of forces decides its velocity: f(z, v) = -F(t), by Newton's method.
    """
    law = model.law
    n = 80
    state = model.rest()
    x = 0.0
    v = 0.0
    after = []
    for i in range(cycles * n):
        wanted = (
            law.mu_c * (0.4 + 0.3 * math.sin(2 * math.pi * i / n)) * min(1.0, i / n)
        )
        for _ in range(8):
            rate = model.rate(state, (v, 0.0, 0.0), 1.0)
            slope = model.jacobians(state, (v, 0.0, 0.0), 1.0).rate_twist[0, 0, 0]
            miss = (
                law.sigma_0 * state[0, 0]
                + law.sigma_1 * rate[0, 0]
                + law.sigma_2 * v
                - wanted
            )
            v -= miss / (law.sigma_1 * slope + law.sigma_2)
            if abs(miss) < 1e-14:
                break
        state, _ = model.step(state, (v, 0.0, 0.0), 1.0, 0.1 / n)
        x += v * 0.1 / n
        if i % n == n - 1:
            after.append(x)
    return after


def test_only_plain_lugre_drifts_below_breakaway():
    # Below z_ba (0.8 of the Coulomb force and more; the force reaches 0.7 of it) nothing slips: x is z, exactly as long
    # as the force repeats. Rounding of 80 steps a cycle, and what the damper sigma_1/sigma_0 = 3 ms of the ramp leaves.
    elastic = positions(one_cell(elasto_plastic=pf.ElastoPlastic(0.8)), 5)
    assert elastic[4] == pytest.approx(elastic[2], abs=1e-18)
    plain = positions(one_cell(), 5)
    creep = np.diff(plain)[1:]
    assert (
        creep > 1e-7
    ).all()  # every cycle a few percent of the full deflection, 6e-6 m


# ---------------------------------------------------------------------- Coulomb


def test_coulomb_wrench_is_the_surface_scaled():
    patch = pf.ContactPatch.rectangle(0.02, cells=5)
    surface = pf.LimitSurfaceCells(patch)
    twist = np.array([[0.1, 0.2, 3.0], [0.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
    load = np.array([2.0, 3.0, 0.0])
    wrench = pf.Coulomb(0.3).wrench(surface, twist, load)
    # Rounding.
    assert wrench[0] == pytest.approx(0.6 * surface.wrench(twist[0]), rel=1e-15)
    assert not wrench[1].any()  # at rest
    assert not wrench[2].any()  # without load
    # Batch axes broadcast.
    assert pf.Coulomb(0.3).wrench(surface, twist[0], load).shape == (
        3,
        3,
    )
    assert pf.Coulomb(0.3).wrench(surface, (0.1, 0.0, 0.0), 1.0) == pytest.approx(
        [-0.3, 0.0, 0.0], rel=1e-15, abs=1e-16
    )


# ---------------------------------------------------------------------- wrong input

SURFACE = pf.LimitSurfaceCells(pf.ContactPatch.rectangle(0.02, cells=3))


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (
            lambda: pf.LuGre(mu_s=0.3, mu_c=0.5),
            "mu_s must be >= mu_c, got mu_s=0.3, mu_c=0.5",
        ),
        (lambda: pf.LuGre(mu_c=-0.5), "mu_c must be > 0, got -0.5"),
        (lambda: pf.LuGre(mu_c=0.0), "mu_c must be > 0, got 0.0"),
        (lambda: pf.LuGre(mu_s=math.nan), "mu_s must be finite, got nan"),
        (lambda: pf.LuGre(v_s=0.0), "v_s must be > 0, got 0.0"),
        (lambda: pf.LuGre(v_s=math.inf), "v_s must be finite, got inf"),
        (lambda: pf.LuGre(sigma_0=-1e6), "sigma_0 must be > 0, got -1000000.0"),
        (lambda: pf.LuGre(sigma_1=-1.0), "sigma_1 must be >= 0, got -1.0"),
        (lambda: pf.LuGre(sigma_2=math.nan), "sigma_2 must be finite, got nan"),
        (lambda: pf.LuGre(gamma=0.0), "gamma must be > 0, got 0.0"),
        (lambda: pf.LuGre(mu_c="slippery"), "mu_c must be a number, got 'slippery'"),
        (lambda: pf.LuGre(mu_c=None), "mu_c must be a number, got None"),
        (
            lambda: pf.LuGre(elasto_plastic="early"),
            "elasto_plastic must be a breakaway ratio, an ElastoPlastic, or None, got early",
        ),
        (
            lambda: pf.LuGre(elasto_plastic=1.0),
            "elasto_plastic must be in [0, 1), got 1.0",
        ),
        (lambda: pf.Dahl(mu_c=0.0), "mu_c must be > 0, got 0.0"),
        (
            lambda: pf.CoulombStribeck(creep_speed=0.0),
            "creep_speed must be > 0, got 0.0",
        ),
        (
            lambda: pf.CoulombStribeck(mu_s=0.5),
            "mu_s must be >= mu_c, got mu_s=0.5, mu_c=1.0",
        ),
        (
            lambda: pf.Dahl().force(0.0, 0.0, -1.0),
            "normal_force must be finite and >= 0, got -1.0",
        ),
        (lambda: pf.ElastoPlastic(1.0), "breakaway_ratio must be in [0, 1), got 1.0"),
        (lambda: pf.ElastoPlastic(-0.1), "breakaway_ratio must be in [0, 1), got -0.1"),
        (lambda: pf.ElastoPlastic(math.nan), "breakaway_ratio must be finite, got nan"),
        (lambda: pf.Coulomb(0.0), "mu must be > 0, got 0.0"),
        (lambda: pf.Coulomb(math.nan), "mu must be finite, got nan"),
        (
            lambda: pf.Coulomb(0.3).wrench(SURFACE, (1, 0, 0), -2.0),
            "normal_force must be finite and >= 0, got -2.0",
        ),
        (
            lambda: pf.Coulomb(0.3).wrench(SURFACE, (1, 0, 0), "x"),
            "normal_force must be an array of numbers, got 'x'",
        ),
        (
            lambda: pf.Coulomb(0.3).wrench(SURFACE, np.ones((2, 3)), np.ones(3)),
            "normal_force must broadcast with the twist, got shapes [3] and [2]",
        ),
        (
            lambda: pf.DistributedModel("disc", pf.LuGre()),
            "patch must be a ContactPatch, got 'disc'",
        ),
        (
            lambda: pf.DistributedModel(POINT, pf.Coulomb(0.3)),
            "law must be a friction law of bristles, such as LuGre, got Coulomb(mu=0.3)",
        ),
    ],
)
def test_wrong_input_gets_one_line_with_name_rule_and_value(call, message):
    with pytest.raises(InvalidValueError) as caught:
        call()
    assert str(caught.value) == message
    assert isinstance(caught.value, FrictionError) and isinstance(
        caught.value, ValueError
    )
    name = caught.value.name
    rule = caught.value.rule
    assert message.startswith(f"{name} must {rule}, got ")


def test_laws_are_values():
    law = pf.LuGre(mu_c=1, mu_s=2)
    assert law == pf.LuGre(mu_c=1.0, mu_s=2.0) and hash(law) == hash(
        pf.LuGre(mu_c=1.0, mu_s=2.0)
    )
    assert isinstance(law.mu_c, float)
    assert law.largest_deflection == 1.0 / 1e6
    with pytest.raises(AttributeError):
        law.mu_c = 0.5
