"""Patch friction inside MuJoCo: grips that hold, discs that stop where they should, data that can be restored."""

from __future__ import annotations

import copy

import numpy as np
import pytest

import planarfriction as pf

mujoco = pytest.importorskip("mujoco")

from planarfriction.adapters.mujoco import Friction, Patch, prepare  # noqa: E402
from planarfriction.adapters.mujoco.responses import responses  # noqa: E402

pytestmark = pytest.mark.mujoco

LAW = pf.LuGre(mu_s=1.0, sigma_2=0.0, elasto_plastic=0.9)
PAD = pf.ReducedModel(pf.ContactPatch.disc(radius=0.01, cells=9), LAW)
PADS = {"sphere": 'type="sphere" size="0.01"', "box": 'type="box" size="0.01 0.00886 0.00886"'}


def _grip(pad: str, dt: float, options: str = "") -> str:
    """A block of 0.2 kg between two pads on slides, held 4 mm beside its centre of mass."""
    pads = "".join(
        f"""<body name="pad{side}" pos="{sign * 0.02} 0.004 0.5">
        <joint name="j{side}" type="slide" axis="{-sign} 0 0" damping="3"/>
        <geom name="pad{side}" {PADS[pad]} mass="0.05" contype="1" conaffinity="0"/></body>"""
        for side, sign in (("L", -1), ("R", 1))
    )
    return f"""<mujoco><option timestep="{dt}" {options}/><worldbody><body name="block" pos="0 0 0.5"><freejoint/>
    <geom name="block" type="box" size="0.01 0.04 0.06" mass="0.2" contype="0" conaffinity="1"/>
    <site name="L" pos="-0.01 0.004 0" zaxis="1 0 0"/><site name="R" pos="0.01 0.004 0" zaxis="-1 0 0"/></body>
    {pads}</worldbody><actuator><motor joint="jL"/><motor joint="jR"/></actuator></mujoco>"""


def _gripper(pad: str = "box", dt: float = 2e-3, options: str = ""):
    patches = [Patch(PAD, site=side, geoms=(f"pad{side}", "block"), centre="contact") for side in "LR"]
    spec = mujoco.MjSpec.from_string(_grip(pad, dt, options))
    prepare(spec, patches)
    m = spec.compile()
    d = mujoco.MjData(m)
    d.ctrl[:] = 3.0
    return m, d, patches


@pytest.mark.parametrize("pad", PADS)
@pytest.mark.parametrize("dt", [2e-3, 1e-2])
@pytest.mark.parametrize("integrator", ["Euler", "implicitfast"])
def test_a_grip_beside_the_centre_of_mass_holds(pad, dt, integrator):
    m, d, patches = _gripper(pad, dt, f'integrator="{integrator}"')
    friction, poses = Friction(m, patches), []
    for steps in (round(0.6 / dt), round(0.4 / dt)):
        for _ in range(steps):
            friction.step(d)
            assert friction.report.converged and friction.report.misfit < 1e-7
        poses.append(d.qpos[:7].copy())
    drift = abs(poses[1] - poses[0])
    # 1e-3 um/s, and 1e-6 degrees a second
    assert drift[:3].max() < 0.4 * 1e-9 and 2.0 * np.degrees(drift[4:].max()) < 0.4e-6
    weight = (friction.wrenches(d) * friction.last.normal_force[:, None]).sum()
    assert weight != 0.0 and np.hypot(*friction.wrenches(d)[:, :2].sum(axis=0)) <= 0.2 * 9.81 + 1e-6


@pytest.mark.parametrize("kind", [pf.ReducedModel, pf.DistributedModel])
def test_a_disc_slides_and_spins_to_rest_where_theory_says(kind):
    """From 1 m/s and 10 rad/s, R = 0.1 m, mu 0.3; less the stepper's own `v dt/2`."""
    dt, law = 2e-3, pf.LuGre(mu_c=0.3, sigma_0=1e5, sigma_1=0.0, sigma_2=0.0, elasto_plastic=0.9)
    patch = Patch(kind(pf.ContactPatch.disc(radius=0.1, cells=31), law), site="disc", geoms=("floor", "disc"))
    spec = mujoco.MjSpec.from_string(f"""<mujoco><option timestep="{dt}"/><worldbody>
    <geom name="floor" type="plane" size="9 9 .1"/><body name="disc" pos="0 0 0.002">
    <joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 1 0"/><joint type="slide" axis="0 0 1"/>
    <joint type="hinge" axis="0 0 1"/><inertial pos="0 0 0" mass="0.2" diaginertia="5e-4 5e-4 1e-3"/>
    <geom name="disc" type="cylinder" size="0.1 0.002" mass="0"/><site name="disc" pos="0 0 -0.002"/>
    </body></worldbody></mujoco>""")
    prepare(spec, [patch])
    m = spec.compile()
    d, friction = mujoco.MjData(m), Friction(m, [patch])
    for _ in range(300):
        mujoco.mj_step(m, d)
    d.qvel[:] = 1.0, 0.0, 0.0, 10.0
    for _ in range(300):
        friction.step(d)
    assert abs(d.qvel).max() < 1e-4
    # the Coulomb disc with uniform pressure, from its limit surface in scaled time
    distance, angle = 0.216581, 2.460359
    assert d.qpos[0] + 0.5 * dt == pytest.approx(distance, rel=1e-3)
    assert d.qpos[3] + 5.0 * dt == pytest.approx(angle, rel=2e-3)


@pytest.mark.parametrize("integrator", ["Euler", "implicit", "implicitfast"])
@pytest.mark.parametrize("jacobian", ["dense", "sparse"])
def test_responses_are_differences_of_steps(integrator, jacobian):
    m, d, patches = _gripper(options=f'integrator="{integrator}" jacobian="{jacobian}" tolerance="1e-14"')
    m.dof_damping[:6] = 2.0, 2.0, 2.0, 1e-3, 1e-3, 1e-3
    friction = Friction(m, patches)
    for _ in range(100):
        friction.step(d)
    mujoco.mj_step1(m, d)
    rows, contacts = friction._geometry(d)

    def ends(wrench):
        other = copy.copy(d)
        friction._apply(other, wrench @ rows)
        found, loads = responses(m, other, rows, contacts), [other.efc_force[own].sum() for own in contacts]
        mujoco.mj_step2(m, other)
        return rows @ other.qvel, np.array(loads), found

    guess = friction.wrenches(d).ravel()
    twist, loads, found = ends(guess)
    np.testing.assert_allclose(rows @ found.velocity, twist, atol=1e-12)
    assert abs(found.load_response).max() > 1e-3 and loads.min() > 0.1
    for i, small in enumerate(np.tile([1e-4, 1e-4, 1e-6], 2)):
        (more, more_load, _), (less, less_load, _) = (ends(guess + sign * small * np.eye(6)[i]) for sign in (1.0, -1.0))
        # constraints are quadratic as long as they hold: rounding, and the tolerance of MuJoCo's solver
        scale = abs(found.twist_response[:, i]).max()
        np.testing.assert_allclose((more - less) / (2.0 * small), found.twist_response[:, i], atol=1e-5 * scale)
        scale = abs(found.load_response[:, i]).max()
        np.testing.assert_allclose(
            (more_load - less_load) / (2.0 * small), found.load_response[:, i], atol=1e-4 * scale + 1e-6
        )


def test_twists_are_in_the_axes_of_the_site():
    """Whatever tangents MuJoCo gives the contact: the block moves along the x axis of its site, which lies aslant."""
    m, d, patches = _gripper()
    friction = Friction(m, patches)
    for _ in range(100):
        friction.step(d)
    m.site_quat[0] = [np.cos(0.2), np.sin(0.2), 0.0, 0.0]
    m.site_quat[0] = _times(m.site_quat[0], [np.sqrt(0.5), 0.0, np.sqrt(0.5), 0.0])
    mujoco.mj_step1(m, d)
    rows, _ = friction._geometry(d)
    x = d.site_xmat[0].reshape(3, 3)[:, 0]
    velocity = np.zeros(m.nv)
    velocity[:3] = [0.0, x[1], x[2]]
    along = rows[:3] @ velocity
    np.testing.assert_allclose(along / np.hypot(x[1], x[2]), [1.0, 0.0, 0.0], atol=1e-6)


def _times(a, b) -> np.ndarray:
    out = np.zeros(4)
    mujoco.mju_mulQuat(out, np.array(a, float), np.array(b, float))
    return out


def test_data_restore_bit_for_bit_and_forces_of_the_user_stay():
    m, d, patches = _gripper()
    friction = Friction(m, patches)
    d.qfrc_applied[2] = 0.1
    for _ in range(100):
        friction.step(d)
    assert d.qfrc_applied[2] == 0.1 and (np.delete(d.qfrc_applied, 2) == 0.0).all()
    other = copy.copy(d)
    for each in (d, other):
        for _ in range(30):
            friction.step(each)
    assert np.array_equal(d.qpos, other.qpos) and np.array_equal(d.userdata, other.userdata)
    friction.reset(d)
    assert (friction.state(d) == 0.0).all()


BAD = {
    "RK4": ('integrator="RK4"', "integrator must be Euler, implicit, implicitfast, got RK4"),
    "noslip": ('noslip_iterations="3"', "noslip_iterations must be 0: they change what has been solved, got 3"),
}


@pytest.mark.parametrize("name", BAD)
def test_options_that_do_not_fit_are_refused(name):
    options, message = BAD[name]
    m, _, patches = _gripper(options=options)
    with pytest.raises(pf.errors.InvalidValueError, match=message):
        Friction(m, patches)


def test_models_that_are_not_prepared_and_names_that_are_not_there_are_refused():
    m, _, patches = _gripper(dt=0.02)
    with pytest.raises(pf.errors.InvalidValueError, match=r"timestep must be at most half of solref\[0\] = 0.02 s"):
        Friction(m, patches)
    bare = mujoco.MjModel.from_xml_string(_grip("box", 2e-3))
    with pytest.raises(pf.errors.InvalidValueError, match=r"pair must be in the model \(prepare adds it\)"):
        Friction(bare, patches)
    m, _, patches = _gripper()
    for wrong, message in (
        ([patches[0], patches[0]], "patches must have each pair of geoms once, got block, padL"),
        ([Patch(PAD, site="nowhere", geoms=("padL", "block"))], "site must be in the model, got nowhere"),
        ([Patch(PAD, site="L", geoms=("padL", "padR"))], "site must be on the body of one of the geoms"),
    ):
        with pytest.raises(pf.errors.InvalidValueError, match=message):
            Friction(m, wrong)
    with pytest.raises(pf.errors.InvalidValueError, match="centre must be one of site, contact"):
        Patch(PAD, site="L", geoms=("padL", "block"), centre="middle")
