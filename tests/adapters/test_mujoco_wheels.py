"""Wheels, rollers, casters and boxes in MuJoCo move as in closed form, wherever their sites lie."""

from __future__ import annotations

import math

import numpy as np
import pytest

import planarfriction as pf
from tests.support.refusals import refused

mujoco = pytest.importorskip("mujoco", reason="needs the extra [mujoco]")

from planarfriction.adapters.mujoco import Friction, PatchContact, prepare  # noqa: E402
from tests.support.wheels import (  # noqa: E402
    CAR,
    DT,
    HALF,
    LAW,
    MOTORS,
    POINT,
    RADIUS,
    SHAPES,
    SITES,
    STRIP,
    TRAIL,
    TREAD,
    box,
    car,
    caster,
    drawn,
    face,
    on_the_floor,
    roller,
    wheel,
)

pytestmark = pytest.mark.mujoco


def made(text: str, *patches: PatchContact):
    """Return data of a model and the friction of its patches."""
    m = prepare(mujoco.MjSpec.from_string(text), patches).compile()
    return mujoco.MjData(m), Friction(m, patches)


def thrown(
    shape: str, site: str, speed: float = 1.0, spin: float = 0.0, centre: str = "auto"
):
    """Return data and friction of a wheel that was thrown along x or set spinning a while ago."""
    patch = PatchContact(
        SHAPES[shape][1], site="wheel", geoms=("floor", "wheel"), centre=centre
    )
    d, friction = made(on_the_floor(wheel(shape, site)), patch)
    for _ in range(50):
        friction.step(d)
    d.qvel[:] = speed, 0.0, 0.0, 0.0, 0.0, -spin  # its z axis is -y of the world
    for _ in range(100 if shape == "mesh" else 300):
        friction.step(d)
    return d, friction


@pytest.mark.parametrize("site", SITES)
@pytest.mark.parametrize("shape", SHAPES)
def test_a_wheel_thrown_without_spin_rolls_on(shape, site):
    """v = v0/(1 + I/(m r^2)): 5/7 for a sphere, 2/3 for a solid cylinder, as friction turns on the contact.

    A mesh may have any shape: one with its site on the tread is told that this leaves the contact, and what to do.
    """
    share = SHAPES[shape][2]
    told = shape == "mesh" and site in ("tread", "contact")
    if told:
        with pytest.warns(
            UserWarning,
            match='site wheel of the contact .* beyond the patch: .*centre="contact"',
        ):
            thrown(shape, site)
    d, friction = thrown(shape, site, centre="contact" if told else "auto")
    # MuJoCo's contact points lie between the surfaces, which overlap.
    arm = 0.5 * (RADIUS + d.qpos[2])
    near = 2e-2 if shape == "mesh" else 5e-4
    assert d.qvel[0] == pytest.approx(
        1.0 / (1.0 + share * (RADIUS / arm) ** 2), rel=near
    )
    assert -d.qvel[5] * arm == pytest.approx(
        d.qvel[0], rel=3e-3 if shape == "mesh" else 1e-4
    )
    assert friction.misplaced(d) is None


@pytest.mark.parametrize("centre", ["auto", "site", "contact"])
@pytest.mark.parametrize("shape", ["sphere", "cylinder", "mesh"])
def test_a_spinning_wheel_drives_off(shape, centre):
    """v = w0 r/(1 + m r^2/I)."""
    spin = 20.0
    share = SHAPES[shape][2]
    d, friction = thrown(shape, "centre", 0.0, spin, centre)
    assert d.qvel[0] == pytest.approx(spin * RADIUS / (1.0 + 1.0 / share), rel=2e-2)
    assert friction.misplaced(d) is None


@pytest.mark.filterwarnings(
    "ignore:site box of the contact:UserWarning"
)  # where the box has fallen
@pytest.mark.parametrize("site", [-0.1, 0.0, 0.1])
def test_a_box_topples_where_friction_is_beyond_its_half_width_over_its_height(site):
    """b/h = 0.2 of its half width and the height of its middle: it falls at mu = 0.6, and slides on at 0.15.

    Then it slides v0^2/(2 mu g), less the stepper's own v0 dt/2.
    """
    for mu in (0.15, 0.6):
        text = on_the_floor(box(f'pos="0 0 {site}"'))
        d, friction = made(
            text, PatchContact(face(mu), site="box", geoms=("floor", "box"))
        )
        for _ in range(50):
            friction.step(d)
        start = d.qpos[0]
        d.qvel[:] = 1.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for _ in range(400):
            friction.step(d)
            upright = 1.0 - 2.0 * (d.qpos[4] ** 2 + d.qpos[5] ** 2)
            if upright < 0.5:
                break
        assert (upright < 0.5) == (mu > 0.2)
        if mu < 0.2:
            assert d.qpos[0] - start == pytest.approx(
                0.5 / (mu * 9.81) - 0.5 * DT, rel=2e-3
            )
            assert friction.misplaced(d) is None


def test_a_puck_with_its_site_in_the_middle_slides_and_a_coin_on_its_rim_rolls():
    """The origin follows the contact of the curved side alone, whatever side the site is on."""
    puck = (
        wheel("cylinder", "centre")
        .replace('euler="90 0 0"', "")
        .replace('xyaxes="0 0 1 1 0 0"', "")
    )
    puck = puck.replace(f"{RADIUS - 1e-5}", f"{HALF - 1e-5}")
    end = pf.ReducedModel(pf.ContactPatch.disc(radius=RADIUS, cells=21), LAW)
    d, friction = made(
        on_the_floor(puck), PatchContact(end, site="wheel", geoms=("floor", "wheel"))
    )
    for _ in range(50):
        friction.step(d)
    start = d.qpos[0]
    d.qvel[0] = 1.0
    for _ in range(300):
        friction.step(d)
    assert d.qpos[0] - start == pytest.approx(0.5 / (0.4 * 9.81) - 0.5 * DT, rel=2e-3)
    origin, _ = friction.frame(d, 0)
    np.testing.assert_allclose(origin, [*d.qpos[:2], 0.0], atol=1e-4)
    assert friction.misplaced(d) is None
    on_its_end = wheel("cylinder", "centre").replace(
        'name="wheel" pos="0.0 0.0 0"', f'name="wheel" pos="0 0 {HALF}"'
    )
    d, friction = made(
        on_the_floor(on_its_end),
        PatchContact(TREAD, site="wheel", geoms=("floor", "wheel")),
    )
    d.qvel[0] = 1.0
    for _ in range(400):
        friction.step(d)
    assert d.qvel[0] == pytest.approx(2.0 / 3.0, rel=3e-3)
    assert friction.misplaced(d) is None


@pytest.mark.parametrize("angle", [45.0, -30.0])
def test_a_mecanum_roller_rolls_across_its_axis_and_holds_along_it(angle):
    """On a carrier of its own mass, thrown at an angle: v/(1 + I/(m r^2)) is left across it, and nothing along it."""
    text = on_the_floor(roller(angle))
    d, friction = made(
        text, PatchContact(TREAD, site="roller", geoms=("floor", "roller"))
    )
    turn = math.radians(angle)
    d.qvel[:2] = (
        math.cos(turn),
        -math.sin(turn),
    )  # along x of the world, in the axes of the carrier
    for _ in range(400):
        friction.step(d)
    assert d.qvel[0] == pytest.approx(0.8 * math.cos(turn), rel=3e-3)
    assert abs(d.qvel[1]) < 1e-6


def test_a_car_goes_as_its_wheels_turn():
    """Two driven wheels and a sphere in a socket behind: v = w r ahead, and (w_2 - w_1) r/b about the middle of b."""
    text = on_the_floor(car(), options='integrator="implicitfast"', more=MOTORS)
    patches = [
        PatchContact(model, site=name, geoms=("floor", name))
        for name, model in CAR.items()
    ]
    d, friction = made(text, *patches)
    for right, left in ((6.0, 6.0), (6.0, 4.0)):
        d.ctrl[:] = right, left
        for _ in range(500):
            friction.step(d)
        ahead = d.xmat[1].reshape(3, 3)[:, 0] @ d.qvel[:3]
        turned = d.qvel[6:8]  # of the right and the left wheel
        np.testing.assert_allclose(turned, [right, left], rtol=5e-3)
        assert ahead == pytest.approx(0.5 * turned.sum() * RADIUS, rel=3e-3)
        # the strips under the wheels are 4 mm wide, and turn
        assert d.qvel[5] == pytest.approx(
            (turned[0] - turned[1]) * RADIUS / 0.2, abs=5e-3
        )
    assert friction.misplaced(d) is None


def test_a_caster_swings_behind_its_pivot():
    """Drawn at a constant speed it follows a tractrix: tan(phi/2) falls as exp(-v t/a) behind the pivot."""
    speed = 0.2
    start = 120.0
    text = on_the_floor(caster(start), options='integrator="implicitfast"')
    d, friction = made(
        text, PatchContact(STRIP, site="caster", geoms=("floor", "caster"))
    )
    for _ in range(50):
        friction.step(d)
    begin = math.radians(start) + d.qpos[2]
    d.qvel[:] = drawn(math.degrees(begin), speed)
    for i in range(1, 301):
        friction.step(d)
        wanted = math.tan(0.5 * begin) * math.exp(-speed * i * DT / TRAIL)
        assert math.tan(0.5 * (math.radians(start) + d.qpos[2])) == pytest.approx(
            wanted, rel=0.02, abs=2e-3
        )
    assert friction.misplaced(d) is None


def test_a_flex_has_no_patches():
    flex = """<mujoco><worldbody><geom name="floor" type="plane" size="1 1 .1"/><site name="floor"/>
    <flexcomp name="cloth" type="grid" count="3 3 1" spacing="0.1 0.1 0.1" pos="0 0 0.1" dim="2" mass="1">
    <edge equality="true"/></flexcomp>
    </worldbody></mujoco>"""
    patches = [PatchContact(POINT, site="floor", geoms=("floor", "cloth"))]
    with refused("geoms must be rigid: flexes cannot have patches, got cloth"):
        prepare(mujoco.MjSpec.from_string(flex), patches)
    m = mujoco.MjModel.from_xml_string(flex)
    with refused("geoms must"):
        Friction(m, patches)
