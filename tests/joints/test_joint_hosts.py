"""Friction of a joint in MuJoCo, and bristles of MuJoCo's own motor back from a log."""

import math

import numpy as np
import pytest

from planarfriction.joints import (
    JointFriction,
    JointLog,
    Plant,
    apply_to_spec,
    identify_joint,
    set_level,
    to_mjcf,
)
from tests.support.refusals import refused

mujoco = pytest.importorskip("mujoco", reason="needs the extra [mujoco]")
pytestmark = pytest.mark.mujoco

FRICTION = JointFriction(0.8, 0.3, 0.2, 0.1, 1.2, 0.05, 400.0, 2.0)
RIGID = JointFriction(0.5, 0.3, 0.2, 0.1)
MODEL = """<mujoco><option timestep="1e-4" gravity="0 0 0" integrator="implicitfast"/><worldbody><body>
<inertial pos="0 0 0" mass="1" diaginertia=".05 .05 .05"/>{joint}</body></worldbody><actuator>{motor}
<motor name="push" joint="j"/></actuator></mujoco>"""
JOINT = '<joint name="j" axis="0 0 1"/>'
PLAIN = MODEL.format(
    joint=JOINT, motor='<dcmotor joint="j" motorconst=".01" resistance=".01"/>'
)


def test_bristles_of_a_motor_come_back_from_its_torque():
    """Five numbers within 2 % and both terms, from 6 s of a slow wave with ripples, then fast."""
    motor = '<dcmotor joint="j" motorconst="1" resistance="1e9" lugre="400 2 0.8 1.2 0.05"/>'
    text = MODEL.format(joint=JOINT.replace("/>", ' damping=".3"/>'), motor=motor)
    model = mujoco.MjModel.from_xml_string(
        text.replace('timestep="1e-4"', 'timestep="2e-5"')
    )
    data = mujoco.MjData(model)
    rows = []
    for i in range(300_000):
        t = data.time
        goal = 0.08 * math.sin(1.57 * t) + 0.006 * math.sin(14.5 * t)
        goal += 0.4 * math.sin(3.14 * t) * min(max(t - 3.0, 0.0), 2.0)
        data.ctrl[1] = 400.0 * (goal - data.qpos[0]) - 5.0 * data.qvel[0]
        if i % 20 == 0:
            rows.append((t, data.qpos[0], data.ctrl[1]))
        mujoco.mj_step(model, data)
    time, q, torque = np.transpose(rows)
    log = JointLog(time, q, torque=torque)
    fit = identify_joint(log, Plant(inertia=0.05))
    assert fit.terms == ("stribeck", "bristles")
    wanted = {"sigma_0": 400.0, "mu_c": 0.8, "mu_s": 1.2, "v_s": 0.05, "sigma_2": 0.3}
    found = {
        name: getattr(fit.friction, name) / value - 1.0
        for name, value in wanted.items()
    }
    assert max(map(abs, found.values())) < 0.02, found


@pytest.mark.parametrize("friction", [FRICTION, RIGID])
def test_text_and_model_hold_the_same_numbers(friction):
    spec = mujoco.MjSpec.from_string(PLAIN)
    apply_to_spec(friction, spec, "j", armature=0.01)
    joint, *motor = to_mjcf(
        friction, "j", armature=0.01, torque_gain=0.1, back_emf=0.03
    ).splitlines()
    text = MODEL.format(
        joint=joint.replace("/>", ' axis="0 0 1"/>'), motor="".join(motor)
    )
    one = spec.compile()
    other = mujoco.MjModel.from_xml_string(text)
    for name in ("dof_damping", "dof_frictionloss", "dof_armature"):
        np.testing.assert_allclose(getattr(one, name), getattr(other, name))
    np.testing.assert_allclose(
        one.actuator_biasprm[0, 3:6], other.actuator_biasprm[0, 3:6]
    )
    np.testing.assert_allclose(
        one.actuator_dynprm[0, 5:7], other.actuator_dynprm[0, 5:7]
    )
    resistance, kt = other.actuator_gainprm[0, :2]
    assert kt / resistance == pytest.approx(
        0.1
    ) and kt**2 / resistance == pytest.approx(0.03)
    assert one.dof_damping[0] == 0.3 and one.na == (1 if friction.sigma_0 else 0)
    assert one.dof_frictionloss[0] == (0.0 if friction.sigma_0 else 0.5)


@pytest.mark.parametrize("friction, motor", [(FRICTION, 0), (RIGID, None)])
def test_levels_follow_the_load(friction, motor):
    """A steady speed takes the level of its torque: mu_c + b_m tau, with the torque of its motor, of either kind."""
    spec = mujoco.MjSpec.from_string(PLAIN)
    apply_to_spec(friction, spec, "j")
    model = spec.compile()
    data = mujoco.MjData(model)
    data.ctrl[1 if motor is None else 0] = 4.0
    for _ in range(20_000):
        set_level(friction, model, data, 0, motor)
        mujoco.mj_step(model, data)
    torque = 4.0 - 0.01 * data.qvel[0]  # with its back-EMF
    taken = torque - friction.sigma_2 * data.qvel[0]
    assert taken == pytest.approx(friction.mu_c + 0.2 * torque, rel=2e-3)


def test_gravity_counts_against_the_torque_of_the_motor():
    """1 kg at 0.1 m, held out: MuJoCo counts gravity as bias, with the other sign."""
    text = (
        MODEL.replace("0 0 0", "0 -9.81 0", 1)
        .replace('pos="0 0 0"', 'pos="0.1 0 0"')
        .format(joint=JOINT, motor="")
    )
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    data.ctrl[0] = 2.0
    mujoco.mj_forward(model, data)
    set_level(RIGID, model, data, 0)
    assert model.dof_frictionloss[0] == pytest.approx(
        0.5 + 0.2 * 2.0 + 0.1 * 9.81 * 0.1
    )


def test_bristles_beyond_a_level_that_fell_come_back():
    """As in the library's own step: after a load of 100 N m, MuJoCo's bristles hold no more than the static level."""
    spec = mujoco.MjSpec.from_string(PLAIN)
    apply_to_spec(FRICTION, spec, "j")
    model = spec.compile()
    data = mujoco.MjData(model)
    data.act[-1] = 20.0 / 400.0
    set_level(FRICTION, model, data, 0, 0)
    assert data.act[-1] == pytest.approx(1.2 / 400.0)


def test_friction_that_mujoco_cannot_hold_is_refused():
    falls = JointFriction(0.5, mu_s=0.8)
    with refused("mu_s must be mu_c for rigid friction"):
        to_mjcf(falls, "j")
    with refused("mu_s must be mu_c for rigid friction"):
        apply_to_spec(falls, mujoco.MjSpec.from_string(PLAIN), "j")
    with refused("asymmetry must be 0: friction in MuJoCo is the same"):
        to_mjcf(JointFriction(0.5, asymmetry=0.1), "j")


def test_what_a_model_lacks_is_named():
    spec = mujoco.MjSpec.from_string(MODEL.format(joint=JOINT, motor=""))
    with refused("joint must be the name of a joint"):
        apply_to_spec(RIGID, spec, "k")
    with refused("joint must be a text"):
        apply_to_spec(RIGID, spec, None)
    with refused("joint must have a dcmotor"):
        apply_to_spec(FRICTION, spec, "j")
