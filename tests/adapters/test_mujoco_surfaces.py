"""Surfaces that move, stick or roll inside MuJoCo, and models that are prepared without changing their contacts."""

import dataclasses
import gc
import math

import numpy as np
import pytest

import planarfriction as pf
from tests.support.refusals import refused

mujoco = pytest.importorskip("mujoco")

from planarfriction.adapters.mujoco import Friction, PatchContact, prepare  # noqa: E402

pytestmark = pytest.mark.mujoco

G = 9.81
LAW = pf.LuGre(mu_c=0.4, sigma_2=0.0, elasto_plastic=0.9)
SOLE = pf.ReducedModel(pf.ContactPatch.rectangle(0.04), LAW)
SMALL = pf.ContactPatch.disc(0.003, cells=5)
BOX = [PatchContact(SOLE, "sole", ("box", "floor"))]


def made(text, patches, dt=1e-3):
    spec = mujoco.MjSpec.from_string(f"<mujoco><worldbody>{text}</worldbody></mujoco>")
    spec.option.timestep = dt
    m = prepare(spec, patches).compile()
    return m, mujoco.MjData(m), Friction(m, patches)


def box(floor="", own="", pos="0 0 0.02", site=""):
    return f"""<geom name="floor" type="plane" size="5 5 1" {floor}/><body name="box" pos="{pos}"><freejoint/>
    <geom name="box" type="box" size="0.02 0.02 0.02" mass="0.2" {own}/>
    <site name="sole" pos="0 0 -0.02" {site}/></body>"""


# ---------------------------------------------------------------------- moving surfaces


@pytest.mark.parametrize("turned", [0, 40])
def test_a_belt_takes_a_box_along(turned):
    """It speeds up with mu g until it has the speed of the belt; explicit steps of positions add v dt / 2."""
    _, d, friction = made(
        box('surfacevel="0.5 0 0 0 0 0"', site=f'euler="0 0 {turned}"'), BOX
    )
    for _ in range(1000):
        friction.step(d)
    expected = 0.5 - 0.5**2 / (2.0 * 0.4 * G) + 0.5 * 1e-3 / 2.0
    assert d.qpos[0] == pytest.approx(expected, abs=2e-5)
    assert abs(friction.twists(d)).max() < 1e-6


def test_tracks_drive_a_box_and_a_turntable_turns_it():
    _, d, friction = made(box(own='surfacevel="-0.3 0 0 0 0 0"'), BOX)
    for _ in range(500):
        friction.step(d)
    assert d.qvel[0] == pytest.approx(0.3, abs=1e-6)
    _, d, friction = made(box('surfacevel="0 0 0 0 0 2"', pos="0.1 0 0.02"), BOX)
    for _ in range(1500):
        friction.step(d)
    assert d.qvel[5] == pytest.approx(2.0, abs=1e-3)
    assert np.hypot(*d.qvel[:2]) == pytest.approx(2.0 * np.hypot(*d.qpos[:2]), rel=2e-3)
    assert abs(friction.twists(d)).max() < 1e-4


# ---------------------------------------------------------------------- what rolls


def _on_a_common_part(patch, law):
    """Model whose face bends as well, as much as the bristles of the law under 1 N do."""
    law = dataclasses.replace(law, sigma_1=0.0)
    return pf.DistributedModel(patch, law, pad=pf.Pad.measured(1e3, 0.5))


@pytest.mark.parametrize(
    "model",
    [
        pf.ReducedModel,
        pf.DistributedModel,
        pf.ReducedModelPublished,
        _on_a_common_part,
    ],
)
def test_a_ball_rolls_down_at_a_constant_acceleration(model):
    """5/7 g sin(angle), less what the depth of the contact takes; the site's x axis, beside the plane of the motion,
    swings to the other side every half turn."""
    law = pf.LuGre(mu_c=0.5, sigma_0=1e3, sigma_1=60.0, sigma_2=0.0, elasto_plastic=0.9)
    angle = math.radians(10.0)
    speeds = []
    text = """<geom name="floor" type="plane" size="50 5 1"/><body pos="0 0 0.05"><freejoint/>
    <geom name="ball" type="sphere" size="0.05" mass="0.1"/><site name="ball" euler="0 0 8"/></body>"""
    m, d, friction = made(
        text, [PatchContact(model(SMALL, law), "ball", ("ball", "floor"))], 2e-3
    )
    m.opt.gravity[:] = G * math.sin(angle), 0.0, -G * math.cos(angle)
    for _ in range(750):
        friction.step(d)
        speeds.append(d.qvel[0])
    acceleration = np.diff(speeds[200:]) / 2e-3
    assert acceleration.mean() == pytest.approx(
        5.0 / 7.0 * G * math.sin(angle), rel=3e-3
    )
    assert np.ptp(acceleration) < 1e-3


@pytest.mark.parametrize("site", ["", 'euler="90 0 0"', 'euler="0 0 90"'])
def test_a_wheel_keeps_its_easy_direction(site):
    """A wheel that spins in place for three turns, with friction of one sign along it only."""
    easy = (0.0, -0.3) if "0 0 90" in site else (0.3, 0.0)
    patch = SMALL.with_friction_metric(np.eye(2), asymmetry=np.array(easy))
    text = f"""<geom name="floor" type="plane" size="5 5 1"/><body pos="0 0 0.0499"><joint type="slide" axis="0 0 1"/>
    <joint name="axle" axis="0 1 0"/><geom name="wheel" type="cylinder" size="0.05 0.01" euler="90 0 0" mass="0.5"/>
    <site name="wheel" pos="0 0 -0.05" {site}/></body>"""
    m, d, friction = made(
        text, [PatchContact(pf.ReducedModel(patch, LAW), "wheel", ("wheel", "floor"))]
    )
    forces = []
    for _ in range(1900):
        d.qvel[1] = 10.0
        friction.step(d)
        _, axes = friction.frame(d, 0)
        forces.append(friction.wrenches(d)[0, :2] @ axes[:2, 0] / friction.loads(d)[0])
    assert m.nv == 2
    assert np.ptp(forces[300:]) < 1e-3
    assert min(abs(abs(forces[-1]) - 0.4 * factor) for factor in (0.7, 1.3)) < 1e-3


def test_an_x_axis_along_the_normal_gives_way_to_the_y_axis():
    _, d, friction = made(box(site='xyaxes="0 0 1 0.6 0.8 0"'), BOX)
    with pytest.warns(
        UserWarning,
        match="its x axis lies along the normal of the contact, where its y axis takes",
    ):
        for _ in range(20):
            friction.step(d)
    _, axes = friction.frame(d, 0)
    np.testing.assert_allclose(axes[0], d.site_xmat[0].reshape(3, 3)[:, 1], atol=1e-6)


# ---------------------------------------------------------------------- prepare


NEAR = """<geom name="floor" type="plane" size="5 5 1" condim="1" margin="0.005" gap="0.001" solref="0.01 0.8"
 solmix="2" {floor}/><body pos="0 0 {height}"><freejoint/><geom name="box" type="box" size="0.02 0.02 0.02" mass="0.2"
 condim="1" margin="0.002" gap="0.002" solimp="0.8 0.9 0.002 0.4 3" {own}/><site name="sole" pos="0 0 -0.02"/></body>"""


@pytest.mark.parametrize("priority", [0, 1])
@pytest.mark.parametrize("height", [0.0269, 0.0295, 0.0301])
def test_prepare_leaves_every_field_of_a_contact_as_it_was(height, priority):
    """Within the margins, in the gap, beyond it; with all that the installed version has."""
    sticky = "adhesion" in dir(mujoco.MjsGeom)
    floor, own = ('adhesion="0.3"', 'adhesion="0.5"') if sticky else ("", "")
    text = NEAR.format(height=height, floor=floor, own=f'{own} priority="{priority}"')
    contacts = []
    for prepared in (False, True):
        spec = mujoco.MjSpec.from_string(
            f"<mujoco><worldbody>{text}</worldbody></mujoco>"
        )
        m = (prepare(spec, BOX) if prepared else spec).compile()
        d = mujoco.MjData(m)
        mujoco.mj_forward(m, d)
        fields = [name for name in dir(d.contact) if name[0] != "_"]
        contacts.append({name: np.array(getattr(d.contact, name)) for name in fields})
    before, after = contacts
    assert len(before["dist"]) == (0 if height == 0.0301 else 4)
    for name, value in before.items():
        np.testing.assert_allclose(after[name], value, rtol=1e-14, err_msg=name)


@pytest.mark.skipif(
    "adhesion" not in dir(mujoco.MjsGeom), reason="geoms do not stick in this version"
)
def test_a_sticky_box_on_a_wall_holds_what_its_adhesion_allows():
    """Four contacts of adhesion A press with 4 A: the wall holds mu 4 A, and beyond the box slides down."""
    for adhesion, held in ((1.5, True), (0.9, False)):
        text = box(f'adhesion="{adhesion}" gap="0.001"', pos="0 0 0.01999")
        m, d, friction = made(text, BOX)
        m.opt.gravity[:] = -G, 0.0, 0.0
        for _ in range(500):
            friction.step(d)
        slope = max(0.2 * G - 0.4 * 4.0 * adhesion, 0.0) / 0.2
        assert friction.loads(d)[0] == pytest.approx(4.0 * adhesion, rel=1e-3)
        assert abs(d.qvel[0] + slope * 0.5) < (1e-6 if held else 2e-3)


def test_prepare_takes_a_path_and_says_what_else_it_takes(tmp_path):
    text = f"<mujoco><worldbody>{box()}</worldbody></mujoco>"
    (tmp_path / "box.xml").write_text(text)
    assert prepare(tmp_path / "box.xml", BOX).compile().npair == 1
    for wrong, got in (
        (mujoco.MjModel.from_xml_string(text), "MjModel"),
        ("grip.xml", "grip.xml"),
        (None, "NoneType"),
    ):
        with refused(f"spec must be an MjSpec or the path .*, got {got}"):
            prepare(wrong, BOX)
    spec = mujoco.MjSpec.from_string(text)
    for patch, message in (
        (
            PatchContact(SOLE, "ssole", ("box", "floor")),
            r"site must be in the model, got ssole \(did you mean sole",
        ),
        (
            PatchContact(SOLE, "sole", ("box", "door")),
            r"geoms must be in the model, got door \(did you mean floor",
        ),
    ):
        with refused(message):
            prepare(spec, [patch])


# ---------------------------------------------------------------------- steps without friction are told


def test_steps_of_mujoco_alone_are_told_once():
    m, d, friction = made(box(), BOX)
    friction.step(d)
    mujoco.mj_step(m, d)
    mujoco.mj_step(m, d)
    with pytest.warns(
        UserWarning,
        match="went on by 2 steps without patch friction: mj_step has none by",
    ):
        friction.loads(d)
    mujoco.mj_step(m, d)
    friction.step(d)
    assert friction.loads(d)[0] > 0.0


def test_friction_that_no_step_had_is_told():
    m, d, friction = made(box(), BOX)
    mujoco.mj_step(m, d)
    with pytest.warns(UserWarning, match="Friction was made and not used"):
        del friction
        gc.collect()
