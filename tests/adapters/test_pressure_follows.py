"""Patches of faces inside MuJoCo: their pressure follows the contact forces."""

import numpy as np
import pytest

import planarfriction as pf
from tests.support.plate import GRAVITY, Plate
from tests.support.refusals import refused

mujoco = pytest.importorskip("mujoco", reason="needs the extra [mujoco]")

from planarfriction.adapters.mujoco import Friction, PatchContact, prepare  # noqa: E402

pytestmark = pytest.mark.mujoco

DT, PLATE = 2e-3, Plate()
BOX = f"""<inertial pos="{PLATE.centre_of_mass} 0 {PLATE.height - 0.02}" mass="{PLATE.mass}"
    diaginertia="{" ".join(map(str, PLATE.inertia))}"/><geom name="box" type="box" size="0.05 0.03 0.02"/>"""
TABLE = '<geom name="table" type="plane" size="2 2 0.1"/>'


def made(body=BOX, table=TABLE, joint="<freejoint/>", model=None, **options):
    """Model, data after the box has come to rest, and friction."""
    spec = mujoco.MjSpec.from_string(f"""<mujoco><option timestep="{DT}" integrator="implicitfast"/><worldbody>
        {table}<body name="box" pos="0 0 0.02">{joint}{body}<site name="under" pos="0 0 -0.02"/></body>
        </worldbody></mujoco>""")
    model = model or PLATE.model()
    patches = [PatchContact(model, site="under", geoms=("table", "box"), **options)]
    prepare(spec, patches)
    m = spec.compile()
    d = mujoco.MjData(m)
    friction = Friction(m, patches)
    for _ in range(200):
        friction.step(d)
    return m, d, friction


def stopped(start, **options):
    """Return the pose where the box comes to rest, with the half step added that a velocity-stepping start loses."""
    _, d, friction = made(**options)
    start = np.array(start)
    away = PLATE.centre_of_mass
    d.qvel[:] = [start[0], start[1] - start[2] * away, 0.0, 0.0, 0.0, start[2]]
    begin = d.qpos[:2] + np.array([away, 0.0])
    path = []
    for _ in range(400):
        friction.step(d)
        path.append(2.0 * np.arctan2(d.qpos[6], d.qpos[3]))
    angle = np.unwrap(path)[-1]
    end = d.qpos[:2] + away * np.array([np.cos(angle), np.sin(angle)]) - begin
    return np.array([*end, angle]) + 0.5 * DT * start


@pytest.mark.parametrize(
    "start", [(0.0, 0.6, 0.0), (0.6, 0.0, 0.0), (0.0, 0.5, 8.0), (0.35, 0.35, -5.0)]
)
def test_a_box_slides_as_a_plate_with_linear_pressure(start):
    """Within 0.5 mm and 0.1 degrees; 20 degrees off for the first with a pressure that stays in the middle."""
    end = stopped(start)
    truth = PLATE.stops(*start)
    np.testing.assert_allclose(end[:2], truth[:2], atol=5e-4)
    assert end[2] == pytest.approx(truth[2], abs=np.radians(0.1))


@pytest.mark.parametrize("start", [(0.0, 0.6, 0.0), (0.6, 0.0, 0.0)])
def test_a_patch_at_the_centre_of_the_contact_forces_slides_straight(start):
    """Within 0.5 mm and 0.1 degrees; 20 degrees off for the first in the middle of the contact points."""
    end = stopped(start, centre="contact", pressure="fixed")
    truth = PLATE.stops(*start)
    np.testing.assert_allclose(end[:2], truth[:2], atol=5e-4)
    assert abs(end[2]) < np.radians(0.1)


def test_a_fixed_pressure_turns_the_box():
    assert stopped((0.0, 0.6, 0.0), pressure="fixed")[2] > np.radians(15.0)


@pytest.mark.parametrize("centre", ["site", "contact"])
def test_friction_is_continuous_while_points_drop_out(centre):
    """A box slides steadily and a torque moves its weight to a corner, until three of four points bear it."""
    slides = "".join(
        f'<joint type="slide" axis="{axis}"/>' for axis in ("1 0 0", "0 1 0", "0 0 1")
    )
    turns = '<joint axis="1 0 0"/><joint axis="0 1 0"/>'  # no yaw: it would turn
    body = '<geom name="box" type="box" size="0.05 0.03 0.02" mass="0.3"/>'
    _, d, friction = made(body=body, joint=slides + turns, centre=centre)
    weight = 0.3 * GRAVITY
    force = []
    bearing = []
    d.qvel[0] = 3.0
    for k in range(300):
        # Of the way to the corner; the diagonal is at 0.5.
        share = 0.6 * min(k / 280.0, 1.0)
        d.xfrc_applied[1, 3:] = share * weight * 0.03, -share * weight * 0.05, 0.0
        friction.step(d)
        wrench = friction.wrenches(d)[0].copy()
        (origin, axes) = friction.frame(d, 0)
        x, y = (origin - d.site_xpos[0]) @ axes[
            :2
        ].T  # torques about the site, wherever the origin is
        wrench[2] += x * wrench[1] - y * wrench[0]
        force.append(wrench / (PLATE.mu * weight))
        bearing.append(int((d.efc_force > 1e-6 * weight).sum()))
    assert bearing[20] == 4 and bearing[-1] == 3
    # Torques by the half width.
    steps = abs(np.diff(force[20:], axis=0)) / (
        1.0,
        1.0,
        0.03,
    )
    assert steps.max() < 0.01


def test_auto_follows_on_faces_and_not_on_spheres():
    for body, follows in (
        (BOX, True),
        ('<geom name="box" type="sphere" size="0.02" mass="0.1"/>', False),
    ):
        friction = made(body=body)[2]
        assert [each.follows for each in friction.placed] == [follows]


def test_another_word_for_the_pressure_is_refused():
    with refused("pressure"):
        PatchContact(
            PLATE.model(), site="under", geoms=("table", "box"), pressure="linear"
        )


def test_a_box_tips_over_the_edge_of_a_table_as_with_mujocos_own_contacts():
    """It leaves at the speed of MuJoCo's own friction within 5 %, and turns as fast within 10 %."""
    edge = '<geom name="table" type="box" size="0.3 0.3 0.05" pos="0 0 -0.05" friction="0.4"/>'
    body = (
        '<geom name="box" type="box" size="0.05 0.03 0.02" mass="0.3" friction="0.4"/>'
    )
    ends = []
    for ours in (True, False):
        m, d, friction = made(body=body, table=edge)
        if not ours:
            m = mujoco.MjModel.from_xml_string(f"""<mujoco><option timestep="{DT}" integrator="implicitfast"
                cone="elliptic" impratio="10" noslip_iterations="10"/><worldbody>{edge}
                <body pos="0 0 0.02"><freejoint/>{body}</body></worldbody></mujoco>""")
            d = mujoco.MjData(m)
        d.qpos[0] = 0.2
        d.qvel[0] = 1.15
        for _ in range(200):
            friction.step(d) if ours else mujoco.mj_step(m, d)
        ends.append((d.qvel[0], d.qvel[4]))
    assert ends[0] == pytest.approx(ends[1], rel=0.1)
    assert ends[0][0] == pytest.approx(ends[1][0], rel=0.05)


EDGE = '<geom name="table" type="box" size="0.3 0.3 0.05" pos="0 0 -0.05"/>'
PLAIN = '<geom name="box" type="box" size="0.05 0.03 0.02" mass="0.3"/>'


@pytest.mark.parametrize("few", [False, True])
@pytest.mark.parametrize("beyond", [0.0, 0.023, 0.035])
def test_a_patch_over_the_edge_acts_with_the_part_that_is_borne(beyond, few):
    """Spun in place, the box is braked as by the cells on the table, pressed by a plane with their centre below it."""
    slides = "".join(
        f'<joint type="slide" axis="{axis}"/>' for axis in ("1 0 0", "0 1 0", "0 0 1")
    )
    turns = '<joint axis="1 0 0"/><joint axis="0 1 0"/><joint axis="0 0 1"/>'
    cells = PLATE.model()
    model = pf.ReducedModel(cells.patch, cells.law) if few else cells
    _, d, friction = made(PLAIN, EDGE, slides + turns, model)
    d.qpos[0] = 0.25 + beyond
    for _ in range(100):
        friction.step(d)
    d.qvel[5] = 5.0
    for _ in range(3):
        friction.step(d)
    n = 1000
    columns = (np.arange(n) + 0.5) * (0.1 - beyond) / n - 0.05
    rows = (np.arange(60) + 0.5) * 1e-3 - 0.03
    points = np.stack(np.meshgrid(columns, rows), -1).reshape(-1, 2)
    cells = pf.ContactPatch.points(points)
    pressed = 0.3 * GRAVITY * cells.weights(1.0, moments=(0.0, 0.0))
    torque = PLATE.mu * (pressed * np.hypot(*points.T)).sum()
    off = 0.02 if few else 0.01
    assert friction.wrenches(d)[0, 2] == pytest.approx(-torque, rel=off)


@pytest.mark.parametrize("share", [0.495, 0.505])
def test_a_box_tips_where_half_of_it_is_over_the_edge(share):
    _, d, friction = made(PLAIN, EDGE)
    d.qpos[0] = 0.25 + 0.1 * share
    for _ in range(200):
        friction.step(d)
    tilt = 2.0 * np.arcsin(d.qpos[5])
    assert tilt > 0.2 if share > 0.5 else abs(tilt) < 0.01
