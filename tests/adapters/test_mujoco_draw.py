"""Patches drawn into a MuJoCo scene, and the example that shows them."""

import numpy as np
import pytest

import planarfriction as pf
from planarfriction.patch import PUBLISHED_PATCHES
from tests.support.refusals import refused
from tests.support.repository import script

mujoco = pytest.importorskip(
    "mujoco", reason="needs MuJoCo: pip install 'planarfriction[mujoco]'"
)

from planarfriction.adapters.mujoco.draw import (  # noqa: E402
    CENTRE,
    FRICTION,
    OUTLINE,
    draw_patch,
    outlines,
)

FRAME = (
    np.array([1.0, 2.0, 3.0]),
    np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]]),
)
"""Along the world's y, z, x."""

pytestmark = pytest.mark.mujoco


def _drawn(patch, wrench, twist, newton=0.1, scale=1.0):
    """Positions of what is drawn, by colour; of the arrow, its tip (from its tail on) last."""
    scene = mujoco.MjvScene(mujoco.MjModel.from_xml_string("<mujoco/>"), maxgeom=200)
    draw_patch(scene, patch, FRAME, np.array(wrench), np.array(twist), newton, scale)
    found = {OUTLINE: [], FRICTION: [], CENTRE: []}
    for geom in scene.geoms[: scene.ngeom]:
        found[
            next(colour for colour in found if np.allclose(geom.rgba, colour))
        ].append(geom.pos.copy())
        if geom.type == mujoco.mjtGeom.mjGEOM_ARROW:
            found[FRICTION].append(geom.size[2] * geom.mat[:, 2])
    return [np.array(found[colour]) for colour in (OUTLINE, FRICTION, CENTRE)]


def test_outline_arrow_and_centre_of_rotation_are_where_they_belong():
    rim, arrow, centre = _drawn(
        pf.ContactPatch.disc(radius=0.02), (0.0, -2.0, 0.0), (0.0, 0.01, 2.0)
    )
    away = rim - FRAME[0]
    assert away[:, 0] == pytest.approx(0.0, abs=1e-12)  # in the plane
    # The polygon of a circle.
    assert np.linalg.norm(away, axis=1) == pytest.approx(0.02, rel=0.02)
    assert arrow[0] == pytest.approx(FRAME[0])
    # -2 N along the frame's y, the world's z.
    assert arrow[1] == pytest.approx([0.0, 0.0, -0.2], abs=1e-6)
    # (-vy, vx)/omega = (-5 mm, 0) along the world's y
    assert centre[0][1:] == pytest.approx([2.0 - 0.005, 3.0], abs=1e-12)


def test_a_patch_is_drawn_larger_but_not_its_arrow_and_centre():
    rim, arrow, centre = _drawn(
        pf.ContactPatch.disc(radius=0.02),
        (3.0, 0.0, 0.0),
        (0.01, 0.0, 2.0),
        0.1,
        scale=2.5,
    )
    assert np.linalg.norm(rim - FRAME[0], axis=1) == pytest.approx(0.05, rel=0.02)
    assert arrow[1] == pytest.approx([0.0, 0.3, 0.0], abs=1e-6)
    # Vx/omega = 5 mm along the frame's y.
    assert centre[0][1:] == pytest.approx([2.0, 3.005], abs=1e-12)


@pytest.mark.parametrize("twist", [(0.0, 0.0, 0.0), (1e-9, 0.0, 1e-7), (0.1, 0.0, 0.1)])
def test_what_sticks_or_slides_straight_turns_about_nothing(twist):
    _, arrow, centre = _drawn(
        pf.ContactPatch.disc(radius=0.02), (0.0, 0.0, 1e-3), twist
    )
    assert not len(centre) and not len(arrow)


@pytest.mark.parametrize("name", PUBLISHED_PATCHES)
def test_outlines_hold_the_area_of_the_patch(name):
    patch = PUBLISHED_PATCHES[name]()
    x, y = np.concatenate(
        [np.append(rim, rim[:1] * np.nan, axis=0) for rim in outlines(patch)]
    ).T
    area = 0.5 * abs(np.nansum(x[:-1] * y[1:] - x[1:] * y[:-1]))
    # cells cut by the rim are drawn as squares: a hundredth of a disc of 21 cells across, and an outline is simplified
    assert area == pytest.approx(patch.areas.sum(), rel=0.05)


def test_an_outline_is_off_by_less_than_a_hundredth_of_the_patch():
    """The chords of a disc lie furthest from its rim in their middle."""
    (rim,) = outlines(pf.ContactPatch.disc(radius=0.02))
    middles = 0.5 * (rim[1:] + rim[:-1])
    assert np.linalg.norm(rim, axis=1) == pytest.approx(0.02, rel=1e-6)
    assert np.linalg.norm(middles, axis=1).min() > 0.99 * 0.02


def test_a_full_scene_is_refused():
    scene = mujoco.MjvScene(mujoco.MjModel.from_xml_string("<mujoco/>"), maxgeom=5)
    with refused("scene must have room for more geoms"):
        draw_patch(
            scene,
            pf.ContactPatch.disc(radius=0.02),
            FRAME,
            np.ones(3),
            np.zeros(3),
            0.1,
        )


def test_the_gripper_of_the_example_lets_the_plate_hang_where_theory_says():
    example = script("examples/mujoco_gripper.py")
    rows, pictures = example.run(draw=False)
    time, angle, beside, _ = rows.T
    assert not pictures
    # the plate swings a little too far, for it moves: by 3 % here
    assert beside[np.searchsorted(time, example.GRIPS[3][0]) - 1] == pytest.approx(
        example.reach(), rel=0.05
    )
    held = time > example.END - 0.2
    assert np.ptp(angle[held]) < 1e-6 and np.ptp(beside[held]) < 1e-9


def test_the_gripper_holds_still_with_any_pads():
    """Hold a plate still that such pads rock, at 0.4 rad/s in yaw, if MuJoCo finds one point between faces."""
    example = script("examples/mujoco_gripper.py")
    rng = np.random.default_rng(1)
    places = rng.uniform(-0.01, 0.01, (7, 2))
    weights = rng.uniform(0.2, 1.0, 7)
    law = pf.LuGre(mu_c=1.0, mu_s=1.0, sigma_0=1e5, sigma_1=300.0, elasto_plastic=0.9)
    pad = pf.DistributedModel(pf.ContactPatch.points(places, weights), law)
    _, d, friction = example.hand(pad)
    d.ctrl[:2] = example.FIRM
    for _ in range(500):
        friction.step(d)
    np.testing.assert_allclose(friction.loads(d), example.FIRM, rtol=1e-6)
    assert abs(d.qvel).max() < 1e-6
