"""What is held keeps its place on whatever turns, in MuJoCo and MJX; what rolls goes on as it should.

Free bodies move along the tangent of a step, hinges along their arc. A held velocity alone lets a radius grow by
`exp(w^2 dt T/2)`; a held place leaves `w^4 dt^3 T/8` of the radius and `w^3 dt^2 T/6` of the angle, to second order.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

import planarfriction as pf

mujoco = pytest.importorskip("mujoco")

from planarfriction.adapters.mujoco import Friction, PatchContact, prepare  # noqa: E402
from planarfriction.formulas import turning_mean  # noqa: E402
from tests.support.turning import SPEEDS, STEPS, G, in_mjx, in_mujoco, rounding, turning  # noqa: E402

pytestmark = pytest.mark.mujoco

SUPPORTS = "surface", "table", "arm", "car"

LAW = pf.LuGre(mu_c=0.5, sigma_2=0.0, elasto_plastic=0.9)


def check(scene, times, qpos, share: float = 0.0, angle: float = 0.0) -> None:
    """Compare places with those after 1 s: within the bounds, bristles' deflections, and a share and an angle more."""
    places = scene.places(times, qpos)[times > 1.0 - 1e-9]
    law = scene.patches[0].model.law
    radius = places[0, 0]
    bristles = law.mu_c / law.sigma_0
    change = abs(places - places[0])
    most, turned = scene.bounds(times[-1] - 1.0)
    assert change[:, 0].max() <= (most + share) * radius + bristles
    assert change[:, 1:].max() <= turned + angle + bristles / radius


@pytest.mark.parametrize("support", SUPPORTS)
def test_a_held_box_keeps_its_place_on_what_turns(support):
    """At 10 rad/s and 4 ms a held velocity alone would have let the radius grow by half in 2 s."""
    scene = turning(support, 10.0, 4e-3)
    check(scene, *in_mujoco(scene, 3.0))


def test_the_place_on_a_surface_that_turns_is_exact():
    """Its chord is known: nothing is left but rounding and bristles; held velocities alone would give 0.2708 m."""
    scene = turning("surface", 2.0, 2e-3)
    times, qpos = in_mujoco(scene, 20.0)
    places = scene.places(times, qpos)
    assert places[-1, 0] == pytest.approx(0.25, abs=3e-5)  # bristles
    assert abs(places[-1] - places[499]).max() < 1e-6


@pytest.mark.parametrize(("share", "holds"), [(0.98, True), (1.02, False)])
def test_a_box_on_a_surface_that_turns_slips_beyond_the_friction(share, holds):
    """From the radius mu g/w^2 on."""
    scene = turning("surface", 2.0, 2e-3)
    radius = share * 0.3 * G / 2.0**2
    scene.qpos[0] = radius
    scene.qvel[1] = 2.0 * radius
    end = scene.places(*in_mujoco(scene, 3.0))[-1, 0]
    assert (abs(end - radius) < 1e-4) == holds


@pytest.mark.slow
@pytest.mark.parametrize("integrator", ["Euler", "implicitfast"])
@pytest.mark.parametrize("dt", STEPS)
@pytest.mark.parametrize("w", SPEEDS)
@pytest.mark.parametrize("support", SUPPORTS)
def test_held_boxes_keep_their_places_for_long(support, w, dt, integrator):
    scene = turning(support, w, dt, integrator)
    check(scene, *in_mujoco(scene, 20.0))


@pytest.mark.slow
@pytest.mark.mjx
@pytest.mark.parametrize("support", SUPPORTS)
def test_held_boxes_keep_their_places_for_long_in_single_precision(support):
    """MJX rounds poses: 1e-5 of a radius and 1e-4 rad in 10,000 steps; more the angle of a hinge that turned far."""
    pytest.importorskip("mujoco.mjx")
    speeds = SPEEDS[-1:] if support == "surface" else SPEEDS
    scenes = [turning(support, w, dt) for w in speeds for dt in STEPS]
    for scene, path in zip(scenes, in_mjx(scenes, 20.0), strict=True):
        hinged = support in ("table", "arm")
        check(
            scene,
            *path,
            share=1e-5,
            angle=1e-4 + hinged * rounding(scene.w, scene.m.opt.timestep, 20.0),
        )


WRIST = """<mujoco><option timestep="0.004" gravity="0 0 0"/><worldbody>
<body><joint axis="0 0 1" armature="1e4"/><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
<body name="hand"><joint axis="1 0 0" armature="1e4"/>
<geom name="fixed" type="box" size="0.02 0.005 0.02" pos="0 0.015 0" mass="0.1"/>
<body pos="0 -0.015 0"><joint name="press" type="slide" axis="0 1 0"/>
<geom name="pad" type="box" size="0.02 0.005 0.02" mass="0.1"/></body></body></body>
<body name="box"><freejoint/><geom name="box" type="box" size="0.02 0.01 0.02" mass="0.2"/>
<site name="fixed" pos="0 0.01 0" zaxis="0 -1 0"/><site name="pad" pos="0 -0.01 0" zaxis="0 1 0"/></body>
</worldbody><actuator><motor joint="press"/></actuator></mujoco>"""


def test_a_grip_that_turns_about_two_axes_keeps_its_angle():
    """The hand's spin turns with its first axis: a held spin alone would turn the box by dt/2 w^2 = 8 mrad/s."""
    spec = mujoco.MjSpec.from_string(WRIST)
    pad = pf.ReducedModel(
        pf.ContactPatch.rectangle(0.04), pf.LuGre(mu_c=1.0, elasto_plastic=0.9)
    )
    patches = [PatchContact(pad, name, (name, "box")) for name in ("fixed", "pad")]
    m = prepare(spec, patches).compile()
    d = mujoco.MjData(m)
    friction = Friction(m, patches)
    turns = []
    d.qvel[:2] = 2.0
    d.qvel[-3:] = (2.0, 0.0, 2.0)
    d.ctrl[:] = 30.0
    for _ in range(750):
        friction.step(d)
        hand, box = (d.body(name).xmat.reshape(3, 3) for name in ("hand", "box"))
        turns.append(0.5 * (hand.T @ box - box.T @ hand)[[2, 0, 1], [1, 2, 0]])
    assert abs(turns[-1] - turns[249]).max() < 2e-4  # of 16 mrad


def test_pads_that_close_while_they_turn_do_not_turn_what_they_hold():
    """Along the normal, which turns with them: along one that stands still, 2 mm would turn the box by 1.3 mrad."""
    scene = turning("arm", 3.0, 4e-3)
    assert np.ptp(scene.places(*in_mujoco(scene, 0.4))[:, 2]) < 1e-4


def test_what_soft_pads_hold_creeps_by_what_the_second_order_leaves():
    """By `(1/8 - y/(6 a x)) a^4 x` in each step, with `a = w dt`, where pads give by y.

    A place (x, y) that turns by a moves by `y a + x a^2/2` towards the axis, which leaves out `y a^3/6`, and by
    `x a - y a^2/2` along the normal, which takes `x a^3/6` too much for pads that close.
    """
    scene = turning("arm", 10.0, 2e-3)._replace(ctrl=120.0)
    times, qpos = in_mujoco(scene, 3.0)
    radius, angle, _ = scene.places(times, qpos)[times > 1.5].T
    place = radius * np.exp(1j * angle)
    creep = np.diff(place.real[[0, -1]])[0] / (len(place) - 1) / (0.02**4 * 0.5)
    assert creep == pytest.approx(
        1.0 / 8.0 - place[0].imag / (6.0 * 0.02 * 0.5), abs=2e-3
    )


@pytest.mark.slow
@pytest.mark.mjx
def test_pads_that_close_while_they_turn_do_not_turn_what_they_hold_in_mjx():
    pytest.importorskip("mujoco.mjx")
    scene = turning("arm", 3.0, 4e-3)
    assert np.ptp(scene.places(*in_mjx([scene], 0.4, every=5)[0])[:, 2]) < 1e-4


BALL = """<mujoco><option timestep="0.004"/><worldbody><geom name="floor" type="plane" size="5 5 1" {floor}/>
<body pos="{x} 0 0.04999"><freejoint/><geom name="ball" type="sphere" size="0.05" mass="0.2"/><site name="ball"/></body>
</worldbody></mujoco>"""


def rolled(x: float, qvel, floor: str, time: float) -> np.ndarray:
    """Return the path [n, 2] of a ball."""
    spec = mujoco.MjSpec.from_string(BALL.format(x=x, floor=floor))
    model = pf.ReducedModel(pf.ContactPatch.disc(0.0005, cells=5), LAW)
    patches = [PatchContact(model, "ball", ("ball", "floor"))]
    m = prepare(spec, patches).compile()
    d = mujoco.MjData(m)
    friction = Friction(m, patches)
    path = []
    d.qvel[:] = qvel
    for _ in range(round(time / m.opt.timestep)):
        friction.step(d)
        path.append(d.qpos[:2].copy())
    return np.array(path)


def test_a_ball_that_spins_rolls_straight():
    """Its contact moves along with it: the material below turns aside, by half of 10 rad/s in 4 ms."""
    x, y = rolled(0.0, (1.0, 0.0, 0.0, 0.0, 20.0, 10.0), "", 1.0)[-1]
    assert x == pytest.approx(1.0, abs=3e-3)
    assert abs(y / x) < 1e-6  # of 2e-2


def test_a_ball_rolls_round_on_a_surface_that_turns():
    """A circle at 2/7 of the spin of the surface, about a point of its own, which held velocities widen by 2 %."""
    w = 3.0
    x = 0.2
    speed = 0.3
    around = 2.0 / 7.0 * w
    qvel = 0.0, speed, 0.0, (w * x - speed) / 0.05, 0.0, 0.0
    path = rolled(x, qvel, f'surfacevel="0 0 0 0 0 {w}"', 4.0 * math.pi / around)
    radii = np.hypot(*(path - [x - speed / around, 0.0]).T)
    assert radii[-1] == pytest.approx(radii[0], rel=2e-4)


@pytest.mark.parametrize("angle", [0.0, 1e-3, 0.09, 0.11, 2.0])
def test_the_mean_of_a_velocity_that_turns(angle):
    """Against the sum over a thousand parts of the turn, of second order."""
    shares = (np.arange(1000) + 0.5) * 1e-3 * angle
    first, second = turning_mean(np, angle)
    # of a unit vector across the axis: along itself, and across both
    assert 1.0 - second * angle**2 == pytest.approx(np.cos(shares).mean(), abs=1e-6)
    assert first * angle == pytest.approx(np.sin(shares).mean(), abs=1e-6)
    if angle > 0.0:
        assert second == pytest.approx((angle - math.sin(angle)) / angle**3, rel=1e-6)
