"""Cases of public threads with closed forms: throws, rolling, pinches, spins, ladders, wedges, skid steering, belts.

Threads are named where they are known; where they give no numbers, the sizes here are chosen.
"""

import math

import numpy as np
import pytest

import planarfriction as pf

mujoco = pytest.importorskip("mujoco")

from planarfriction.adapters.mujoco import Friction, PatchContact, prepare  # noqa: E402

pytestmark = pytest.mark.mujoco

G, DT = 9.81, 1e-3


def law(mu):
    return pf.LuGre(mu_c=mu, sigma_0=1e5, sigma_2=0.0, elasto_plastic=0.9)


def point(mu):
    return pf.ReducedModel(pf.ContactPatch.disc(radius=1e-4, cells=5), law(mu))


def made(text, patches, actuators=""):
    xml = f'<mujoco><option timestep="{DT}"/><worldbody>{text}</worldbody><actuator>{actuators}</actuator></mujoco>'
    m = prepare(mujoco.MjSpec.from_string(xml), patches).compile()
    return m, mujoco.MjData(m), Friction(m, patches)


@pytest.mark.parametrize("share", [0.97, 1.03])
def test_a_pinched_capsule_holds_from_its_weight_on(share):
    """Two pads press with N: they hold 2 mu N, and what is heavier falls at the rest of g."""
    mass = 0.045
    mu = 0.8
    pads = "".join(
        f"""<body pos="{0.02 * sign} 0 1"><joint name="{side}" type="slide" axis="{-sign} 0 0" damping="1"/>
        <geom name="{side}" type="box" size="0.01 0.02 0.02" mass="0.1" contype="1" conaffinity="0"/></body>"""
        for side, sign in (("left", -1), ("right", 1))
    )
    text = f"""<body pos="0 0 1"><freejoint/><geom name="capsule" type="capsule" size="0.01 0.03" euler="90 0 0"
    mass="{mass}" contype="0" conaffinity="1"/><site name="left" zaxis="1 0 0"/><site name="right" zaxis="-1 0 0"/>
    </body>{pads}"""
    motors = '<motor joint="left"/><motor joint="right"/>'
    patches = [
        PatchContact(point(mu), side, (side, "capsule")) for side in ("left", "right")
    ]
    m, d, friction = made(text, patches, motors)
    m.opt.gravity[:] = 0.0
    d.ctrl[:] = share * mass * G / (2.0 * mu)
    for _ in range(500):
        friction.step(d)
    m.opt.gravity[2] = -G
    speeds = []
    for _ in range(200):
        friction.step(d)
        speeds.append(d.qvel[2])
    falls = (speeds[199] - speeds[99]) / (100 * DT)
    assert falls == pytest.approx(-max(1.0 - share, 0.0) * G, rel=0.02, abs=1e-4)


@pytest.mark.parametrize(("angle", "holds"), [(48.2, True), (47.2, False)])
def test_a_ladder_slips_below_its_angle(angle, holds):
    """tan(angle) = (1 - mu_floor mu_wall) / (2 mu_floor): 47.73 deg for 0.4 and 0.3."""
    assert math.degrees(math.atan((1.0 - 0.4 * 0.3) / 0.8)) == pytest.approx(
        47.73, abs=0.005
    )
    half = 1.0
    tip = 0.001
    x = half * math.cos(math.radians(angle))
    z = half * math.sin(math.radians(angle))
    text = f"""<geom name="floor" type="plane" size="5 5 1"/>
    <geom name="wall" type="plane" size="5 5 1" pos="0 0 0" zaxis="-1 0 0"/>
    <body pos="{-x - tip + 2e-6} 0 {z + tip - 2e-6}" euler="0 {-angle} 0"><freejoint/>
    <inertial pos="0 0 0" mass="5" diaginertia="0.1 1.7 1.7"/>
    <geom name="foot" size="{tip}" pos="{-half} 0 0"/><site name="foot" pos="{-half} 0 0" xyaxes="0 1 0 0 0 1"/>
    <geom name="head" size="{tip}" pos="{half} 0 0"/><site name="head" pos="{half} 0 0" xyaxes="0 1 0 0 0 1"/>
    </body>"""
    patches = [
        PatchContact(point(0.4), "foot", ("foot", "floor")),
        PatchContact(point(0.3), "head", ("head", "wall")),
    ]
    _, d, friction = made(text, patches)
    for _ in range(600):
        friction.step(d)
    assert (d.qpos[2] > z - 0.002) == holds


def test_a_box_that_slides_diagonally_keeps_its_direction():
    """-39.806 deg from (1.2, -1) m/s to the end (RandyGaul/qu3e #35), which is v^2 / (2 mu g) away."""
    text = """<geom name="table" type="plane" size="5 5 1"/><body pos="0 0 0.00999"><freejoint/>
    <geom name="box" type="box" size="0.05 0.05 0.01" mass="0.5"/><site name="box" pos="0 0 -0.01"/></body>"""
    sole = pf.ReducedModel(pf.ContactPatch.rectangle(0.1), law(0.5))
    _, d, friction = made(text, [PatchContact(sole, "box", ("box", "table"))])
    d.qvel[:2] = 1.2, -1.0
    while np.hypot(*d.qvel[:2]) > 1e-4:
        friction.step(d)
        assert math.degrees(math.atan2(d.qpos[1], d.qpos[0])) == pytest.approx(
            -39.806, abs=1e-3
        )
    assert np.hypot(*d.qpos[:2]) == pytest.approx(
        (1.2**2 + 1.0) / (2.0 * 0.5 * G), rel=5e-3
    )
    assert abs(d.qpos[6]) < 1e-6


def test_a_box_slides_down_a_wedge_that_gives_way():
    """With N = m (g cos - A sin) the wedge backs off, M A = N (sin - mu cos); the box slides down it with the rest."""
    mass = 1.0
    wedge = 2.0
    mu = 0.2
    s = 0.5
    c = math.sqrt(0.75)
    backs_off = mass * G * c * (s - mu * c) / (wedge + mass * s * (s - mu * c))
    slides = G * s + backs_off * c - mu * (G * c - backs_off * s)
    text = f"""<body pos="0 0 1"><joint name="wedge" type="slide" axis="1 0 0"/>
    <geom name="wedge" type="box" size="0.6 0.2 0.01" euler="0 30 0" mass="{wedge}"/></body>
    <body name="box" pos="{0.03999 * s - 0.4 * c} 0 {1.0 + 0.03999 * c + 0.4 * s}" euler="0 30 0"><freejoint/>
    <geom name="box" type="box" size="0.03 0.03 0.03" mass="{mass}"/><site name="sole" pos="0 0 -0.03"/></body>"""
    sole = pf.ReducedModel(pf.ContactPatch.rectangle(0.06), law(mu))
    _, d, friction = made(text, [PatchContact(sole, "sole", ("box", "wedge"))])
    speeds = []
    for _ in range(300):
        friction.step(d)
        speeds.append((-d.qvel[0], (d.qvel[1] - d.qvel[0]) * c - d.qvel[3] * s))
    found = (np.array(speeds[299]) - speeds[99]) / (200 * DT)
    assert found == pytest.approx((backs_off, slides), rel=5e-3)


@pytest.mark.parametrize(("grip", "turns"), [(1.0, 2.3077), (2.0, 1.2), (4.0, 0.4110)])
def test_skid_steering_turns_by_its_closed_form(grip, turns):
    """Wheels run at -v and v, with `grip` times the friction along their axles: b v / (b^2 + grip^2 a^2).

    They are at (+-a, +-b) = (+-0.2, +-0.3) m and turn without being slowed, at v = 1 m/s.
    """
    assert turns == pytest.approx(0.3 / (0.3**2 + (grip * 0.2) ** 2), abs=5e-5)
    wheels = ""
    names = []
    for x, y in ((0.2, 0.3), (0.2, -0.3), (-0.2, 0.3), (-0.2, -0.3)):
        names.append(f"wheel {x} {y}")
        wheels += f"""<body pos="{x} {y} 0"><joint axis="0 1 0" armature="1e4"/><geom name="{names[-1]}" size="0.1"
        mass="0.1" contype="0" conaffinity="1"/><site name="{names[-1]}" xyaxes="0 1 0 -1 0 0"/></body>"""
    text = f"""<geom name="ground" type="plane" size="5 5 1"/><body pos="0 0 0.0999"><freejoint/>
    <inertial pos="0 0 0" mass="10" diaginertia="0.3 0.3 0.3"/>{wheels}</body>"""
    tread = pf.ContactPatch.disc(radius=1e-4, cells=5).with_friction_metric(
        pf.friction_metric(0.0, grip, 1.0)
    )
    model = pf.ReducedModel(tread, law(0.4))
    _, d, friction = made(
        text, [PatchContact(model, name, (name, "ground")) for name in names]
    )
    d.qvel[6:] = -10.0, 10.0, -10.0, 10.0
    for _ in range(600):
        friction.step(d)
    assert d.qvel[5] == pytest.approx(turns, rel=3e-3)
    assert np.abs(d.qpos[:2]).max() < 1e-3
