"""Origins of patches in MuJoCo: contacts that roll, faces whose points jump about, sites beside the contact."""

import numpy as np
import pytest

import planarfriction as pf

mujoco = pytest.importorskip("mujoco", reason="needs the extra [mujoco]")

from planarfriction.adapters.mujoco import Friction, PatchContact, prepare  # noqa: E402
from planarfriction_studies.bench import mujoco_scenes  # noqa: E402
from tests.support.mujoco_misfit import step_checked  # noqa: E402

pytestmark = pytest.mark.mujoco

LAW = pf.LuGre(
    mu_c=0.3, mu_s=0.3, sigma_0=1e5, sigma_1=0.0, sigma_2=0.0, elasto_plastic=0.9
)
DT, RADIUS, MASS = 2e-3, 0.05, 0.5
SMALL = pf.ReducedModel(pf.ContactPatch.disc(radius=0.004, cells=9), LAW)
LINE = pf.ReducedModel(pf.ContactPatch.rectangle(0.0005, 0.08, cells=9), LAW)
FACE = pf.ReducedModel(pf.ContactPatch.rectangle(0.08, cells=9), LAW)
BOX = 'type="box" size="0.04 0.04 0.04"'


def on_the_floor(
    geom, site, model=SMALL, height=RADIUS, turned="", inertia=0.4, **options
):
    """Return data after a body on a plane has come to rest, and friction."""
    i = inertia * MASS * RADIUS**2
    spec = mujoco.MjSpec.from_string(f"""<mujoco><option timestep="{DT}" integrator="implicitfast"/><worldbody>
        <geom name="floor" type="plane" size="9 9 .1"/><body pos="0 0 {height}" {turned}><freejoint/>
        <inertial pos="0 0 0" mass="{MASS}" diaginertia="{i} {i} {i}"/><geom name="body" {geom}/>
        <site name="site" {site}/></body></worldbody></mujoco>""")
    patches = [PatchContact(model, site="site", geoms=("floor", "body"), **options)]
    prepare(spec, patches)
    m = spec.compile()
    d = mujoco.MjData(m)
    friction = Friction(m, patches)
    for _ in range(300):
        friction.step(d)
    return d, friction


ROUND = {
    "sphere": ('type="sphere" size="0.05"', 'pos="0 0 -0.05"', SMALL, "", 0.4),
    "cylinder": (
        'type="cylinder" size="0.05 0.04"',
        'pos="0 -0.05 0"',
        LINE,
        'euler="90 0 0"',
        0.5,
    ),
}


@pytest.mark.parametrize("name", ROUND)
def test_round_bodies_slide_until_they_roll(name):
    """They end at `v/(1 + I/(m r^2))`, 5/7 of the initial speed for a sphere, and keep it."""
    geom, site, model, turned, inertia = ROUND[name]
    d, friction = on_the_floor(geom, site, model, turned=turned, inertia=inertia)
    radius = float(d.qpos[2])  # it sinks into the floor a little
    d.qvel[:] = 1.0, 0.0, 0.0, 0.0, 0.0, 0.0
    speeds = []
    for _ in range(500):
        step_checked(friction, d, 1e-8)
        speeds.append(d.qvel[0])
    # MuJoCo's contact points lie between the surfaces: by half of what the body sinks in
    assert speeds[-1] == pytest.approx(
        1.0 / (1.0 + inertia * (RADIUS / radius) ** 2), rel=3e-3
    )
    assert np.ptp(speeds[250:]) < 1e-5
    assert friction.misplaced(d) is None


@pytest.mark.parametrize("centre", ["auto", "contact"])
def test_pads_with_jumping_points_do_not_creep(centre):
    """MuJoCo finds four other points of a cylinder's rim from step to step: their centre jumps by 1 mm."""
    scene = mujoco_scenes.grip("cylinder")
    text = scene.text(
        mujoco_scenes.Native(condim=1, impratio=1.0), DT, "Euler"
    ).replace('multiccd="disable"', "")
    spec = mujoco.MjSpec.from_string(text)
    patches = [
        PatchContact(scene.model, site=s, geoms=g, centre=centre)
        for s, g in scene.patches
    ]
    prepare(spec, patches)
    m = spec.compile()
    d = mujoco.MjData(m)
    friction = Friction(m, patches)
    points = []

    def step():
        friction.step(d)
        points.append(d.contact.pos[:4].sum(axis=0) / 4.0)

    path = scene.run(m, d, step)
    assert np.ptp(points[-500:], axis=0)[1:].max() > 5e-4
    moved = abs(path[-1] - path[len(path) // 2]) / (0.5 * scene.time)
    # 0.001 um/s and 2e-5 degrees a second in the plane of the pads; along their normal MuJoCo rocks the block
    assert moved[1:3].max() < 1e-9
    assert 2.0 * np.degrees(moved[4]) < 2e-5


FAULTS = {
    "off": (
        {"geom": BOX, "site": 'pos="0.5 0 -0.04"'},
        "contact forces act beyond the patch",
    ),
    "upright": (
        {"geom": BOX, "site": 'pos="0 0 -0.04" euler="0 90 0"'},
        "its x axis lies along the normal",
    ),
}


@pytest.mark.parametrize("name", FAULTS)
def test_a_site_that_is_not_in_the_contact_is_told_once(name):
    given, message = FAULTS[name]
    with pytest.warns(
        UserWarning, match=f"site site of the contact between floor and body: {message}"
    ) as told:
        d, friction = on_the_floor(model=FACE, height=0.04, centre="site", **given)
    assert len(told) == 1
    assert message in friction.misplaced(d)
    if name == "upright":
        assert np.isfinite(friction.wrenches(d)).all()


def test_a_box_that_falls_from_its_edge_onto_a_face():
    """A narrow patch at the edge is told when the box lies on its face; one that follows the contact lies there."""
    tilted = {"geom": BOX, "height": 0.0567, "turned": 'euler="0 43 0"', "model": LINE}
    with pytest.warns(UserWarning, match="contact forces act beyond the patch"):
        on_the_floor(site='pos="0.04 0 -0.04"', centre="site", **tilted)
    d, friction = on_the_floor(site='pos="0.04 0 -0.04"', centre="contact", **tilted)
    assert friction.misplaced(d) is None
    origin, axes = friction.frame(d, 0)
    # the box has fallen, and its origin lies in the middle of one of its faces
    assert abs(d.qpos[2] - 0.04) < 1e-3
    np.testing.assert_allclose(origin[:2], d.qpos[:2], atol=2e-3)
    assert axes[2] == pytest.approx([0.0, 0.0, 1.0])
