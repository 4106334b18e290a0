"""Quasi-static pushes: motion cones, the way a slider turns, symmetries, order, plans."""

import dataclasses

import numpy as np
import pytest

import planarfriction as pf
from planarfriction.planning import Pusher, Slider, motion_cone, plan_push, push
from planarfriction.planning.push_plans import PushReport
from planarfriction.planning.pushing import (
    CORNER,
    END,
    FACE,
    Scenery,
    Touch,
    TouchPoint,
    flush_after,
    motion_at,
    place_of,
    touch_after,
)
from tests.support.refusals import refused

HALF = 0.045
SQUARE = np.array([[-HALF, -HALF], [HALF, -HALF], [HALF, HALF], [-HALF, HALF]])
PATCH = pf.ContactPatch.rectangle(2 * HALF, cells=5)
SURFACES = {
    "ellipsoid": pf.LimitSurfaceEllipsoid(PATCH),
    "exact": pf.LimitSurfaceExact(PATCH),
    "table": pf.LimitSurfaceTable(PATCH),
    "feet": pf.LimitSurfaceExact(
        pf.ContactPatch.points(
            [[-0.03, -0.02], [0.04, -0.03], [0.0, 0.04]], [1.0, 1.0, 1.2]
        )
    ),
}
MU = 0.3


def straight(begin, end):
    return pf.Signal.sampled([0.0, 1.0], [begin, end], "linear")


def slider(kind="ellipsoid"):
    return Slider(SURFACES[kind], SQUARE)


# ---------------------------------------------------------------------- at an instant


def test_motion_cone_of_an_ellipsoid_is_the_closed_form():
    # V = (fx, fy, tau/r^2): the place r of force f moves along (1 + (y^2, -x y; -x y, x^2)/c^2) f
    surface = SURFACES["ellipsoid"]
    at = np.array([-HALF, 0.02])
    c = SURFACES["ellipsoid"].contact_radius
    x, y = at
    matrix = np.eye(2) + np.array([[y * y, -x * y], [-x * y, x * x]]) / c**2
    edges = np.array([[1.0, -MU], [1.0, MU]]) @ matrix
    expected = edges / np.hypot(*edges.T)[:, None]
    # Rounding.
    np.testing.assert_allclose(
        motion_cone(surface, at, (2.0, 0.0), MU), expected, atol=1e-12
    )


@pytest.mark.parametrize("kind", SURFACES)
def test_the_edges_of_a_motion_cone_are_in_order_and_wider_than_nothing(kind):
    for y in (-0.03, 0.0, 0.02):
        right, left = motion_cone(SURFACES[kind], (-HALF, y), (1.0, 0.0), MU)
        # A facet of feet has one velocity for many forces.
        assert right[0] * left[1] - right[1] * left[0] > -1e-9
        assert right[0] > 0.0 and left[0] > 0.0


@pytest.mark.parametrize("kind", ["ellipsoid", "exact", "table"])
@pytest.mark.parametrize("mu", [0.0, 0.3, 2.0])
def test_the_edges_of_the_friction_cone_vote_on_the_turn(kind, mu):
    # Mason 1986: both edges of the friction cone and the line of pushing vote, by the side of the centre that they pass
    for angle in (-0.6, 0.1, 0.5):
        for y in (-0.04, -0.01, 0.015, 0.04):
            way = np.array([np.cos(angle), np.sin(angle)])
            begin = np.array([-HALF, y])
            found = push(
                slider(kind), Pusher(mu), straight(begin, begin + 1e-3 * way), samples=3
            )
            votes = [
                -HALF * s - y * c
                for c, s in [way, *([1.0, sign * mu] for sign in (-1.0, 1.0))]
            ]
            assert np.sign(found.end[2]) == np.sign(sorted(votes)[1]), (angle, y)


@pytest.mark.parametrize("kind", ["ellipsoid", "exact"])
@pytest.mark.parametrize("mu", [0.0, MU])
def test_a_push_through_the_centre_does_not_turn(kind, mu):
    found = push(slider(kind), Pusher(mu), straight((-0.06, 0.0), (0.04, 0.0)))
    # 10 times rtol.
    np.testing.assert_allclose(found.end, [0.04 + HALF, 0.0, 0.0], rtol=0.0, atol=1e-6)


# ---------------------------------------------------------------------- along a path


@pytest.mark.parametrize("kind", SURFACES)
def test_a_push_is_the_same_seen_from_elsewhere_and_at_any_speed(kind):
    path = straight((-0.06, 0.01), (0.0, 0.03))
    plain = push(slider(kind), Pusher(MU), path, rtol=1e-9)
    turn = 0.7
    by = np.array([0.3, -0.2])
    moved = pf.Signal.sampled(
        [2.0, 9.0], by + pf.geometry.rotate(path.values, turn), "linear"
    )
    other = push(slider(kind), Pusher(MU), moved, start=(*by, turn), rtol=1e-9)
    expected = np.concatenate(
        [by + pf.geometry.rotate(plain.end[:2], turn), [plain.end[2] + turn]]
    )
    # the slope of a table jumps from cell to cell, which holds up the tolerance
    np.testing.assert_allclose(other.end, expected, rtol=0.0, atol=5e-6)
    assert (
        other.mode == plain.mode
    ).mean() > 0.95  # samples at a change of mode may differ


def test_a_mirrored_push_is_mirrored():
    found = [
        push(
            slider("exact"), Pusher(MU), straight((-0.06, s * 0.01), (0.0, s * 0.04))
        ).end
        for s in (1, -1)
    ]
    np.testing.assert_allclose(
        found[0], found[1] * [1.0, -1.0, -1.0], rtol=0.0, atol=1e-6
    )


def test_a_rough_pusher_sticks_and_a_smooth_one_slides():
    path = straight((-HALF, 0.01), (0.0, 0.04))
    stuck = push(slider(), Pusher(20.0), path)
    assert set(stuck.mode) <= {"stick", "free"} and (stuck.mode == "stick").sum() >= 100
    np.testing.assert_allclose(
        stuck.place[1:], np.tile([-HALF, 0.01], (100, 1)), rtol=0.0, atol=1e-7
    )
    smooth = push(slider(), Pusher(0.0), path)
    assert set(smooth.mode) <= {"slide left", "slide right", "free"}
    assert np.abs(smooth.place[-1, 1] - 0.01) > 2e-3
    # On the edge all the way.
    np.testing.assert_allclose(smooth.place[1:, 0], -HALF, rtol=0.0, atol=1e-7)


def test_a_stuck_pusher_turns_the_slider_as_the_ellipsoid_says():
    # with the arm along the push the angle b between them obeys b' = -sin(b) R/(c^2 + R^2) per length (Lynch 1996)
    surface = SURFACES["ellipsoid"]
    at = np.array([-HALF, 0.02])
    c = surface.contact_radius
    arm = np.hypot(*at)
    found = push(slider(), Pusher(20.0), straight(at, (at[0] + 0.05, at[1])))
    b = np.arctan2(-at[1], -at[0]) + np.array([0.0, found.end[2]])
    ways = np.linspace(0.0, 0.05, 20001)
    angle = b[0]
    for step in np.diff(ways):  # explicit midpoint, 1e-10
        rate = lambda a: arm * np.sin(a) / (c * c + arm * arm)
        angle += step * rate(angle + 0.5 * step * rate(angle))
    assert b[1] == pytest.approx(angle, abs=1e-6)


def test_order_of_convergence():
    path = straight((-HALF, 0.01), (0.03, 0.03))
    best = push(slider(), Pusher(MU), path, rtol=1e-11, samples=2).end
    errors = [
        np.abs(push(slider(), Pusher(MU), path, rtol=rtol, samples=2).end - best).max()
        for rtol in (1e-4, 1e-8)
    ]
    # Errors follow the tolerance, changes of mode included.
    assert errors[1] < 3e-7 and errors[0] < 3e-3


def test_contact_is_kept_and_never_entered():
    found = push(slider("exact"), Pusher(0.1), straight((-0.07, 0.0), (0.03, 0.035)))
    touched = found.mode != "free"
    assert 0 < touched.sum() < len(touched)
    gaps = [
        slider().gaps(pf.geometry.rotate(at[:2] - pose[:2], -pose[2])).max()
        for at, pose in zip(found.pusher_pose, found.pose, strict=True)
    ]
    assert np.min(gaps) > -1e-7  # rtol times the size
    assert np.abs(np.array(gaps)[touched]).max() < 1e-7


def test_a_pusher_that_goes_away_leaves_the_slider():
    path = pf.Signal.sampled(
        [0.0, 1.0, 2.0, 3.0],
        [(-0.06, 0.0), (-0.03, 0.0), (-0.06, 0.0), (-0.02, 0.0)],
        "linear",
    )
    found = push(slider(), Pusher(MU), path, samples=301)
    assert (found.mode[101:200] == "free").all()
    assert np.ptp(found.pose[101:200], axis=0).max() == 0.0
    assert found.end[0] == pytest.approx(-0.02 + HALF, abs=1e-6)


# ---------------------------------------------------------------------- a flat face


def test_a_face_comes_flush_and_stays():
    found = push(
        slider("exact"), Pusher(MU, 0.06), straight((-0.07, 0.0, 0.2), (0.02, 0.0, 0.2))
    )
    assert found.end[2] == pytest.approx(0.2, abs=1e-5)
    gaps = slider().gaps(
        pf.geometry.rotate(
            found.pusher_pose[-1, :2] - found.pose[-1, :2], -found.pose[-1, 2]
        )
    )
    assert gaps.max() == pytest.approx(0.0, abs=1e-6)


def test_a_face_beside_the_centre_turns_about_its_end():
    found = push(
        slider("exact"),
        Pusher(1.0, 0.02),
        straight((-0.06, 0.034, 0.0), (0.0, 0.034, 0.0)),
    )
    # A narrow face at the corner cannot keep the slider straight.
    assert found.end[2] < -0.2
    wide = push(
        slider("exact"), Pusher(1.0, 0.09), straight((-0.06, 0.0, 0.0), (0.0, 0.0, 0.0))
    )
    np.testing.assert_allclose(wide.end, [HALF, 0.0, 0.0], rtol=0.0, atol=1e-8)


@pytest.mark.parametrize("mu, slack", [(1.0, 0.5), (0.1, np.arctan(0.1))])
def test_a_flush_face_stays_until_its_pressure_or_its_friction_ends(mu, slack):
    """A straight push by a face 10 mm beside the centre presses at half of its half width."""
    place = TouchPoint(np.array([-HALF, 0.01]), np.array([1.0, 0.0]), half_width=0.02)
    found = motion_at(SURFACES["ellipsoid"], place, mu, np.array([0.1, 0.0, 0.0]))
    assert found.mode == "stick" and found.slack == pytest.approx(slack, abs=1e-9)


# ---------------------------------------------------------------------- plans


@pytest.mark.parametrize("kind", ["ellipsoid", "exact"])
def test_a_plan_leads_to_its_pose(kind):
    goal = (0.2, 0.03, 0.3)
    plan = plan_push(slider(kind), Pusher(0.4), goal, edges=[3])
    np.testing.assert_allclose(plan.push.end, goal, rtol=0.0, atol=1e-4)
    again = push(slider(kind), Pusher(0.4), plan.path)
    np.testing.assert_allclose(again.end, plan.push.end, rtol=0.0, atol=1e-12)
    assert plan.report.sticks and plan.report.used <= 0.8 + 1e-9
    assert plan.report.reached and "Misses" not in str(plan)
    assert plan.report.length < 1.3 * np.hypot(*goal[:2])
    assert "reached" in str(plan.report)
    axes = plan.plot().axes[0]
    line = next(each for each in axes.lines if each.get_label() == "goal")
    corner = 1e3 * (goal[:2] + pf.geometry.rotate(SQUARE[0], goal[2]))
    np.testing.assert_allclose(line.get_xydata()[0], corner)
    assert f"{1e3 * plan.report.length:.3g} mm" in axes.get_title()
    # a pusher that is rougher than thought sticks too, and nothing changes
    rough = push(slider(kind), Pusher(0.5), plan.path)
    np.testing.assert_allclose(rough.end, plan.push.end, rtol=0.0, atol=1e-5)


def test_a_plan_that_misses_its_goal_says_by_how_much():
    # behind the only edge that may be pushed: two metres of an unstable push
    goal = np.array([-0.3, 0.1, -1.0])
    with pytest.warns(RuntimeWarning, match="misses its goal by [0-9.]+ mm and"):
        plan = plan_push(slider(), Pusher(0.4), goal, edges=[3])
    away = np.abs(plan.push.end - goal)
    np.testing.assert_allclose(plan.report.error, [np.hypot(*away[:2]), away[2]])
    assert not plan.report.reached
    assert f"Misses its goal by {1e3 * plan.report.error[0]:.3g} mm" in str(plan)


def test_a_push_is_drawn():
    found = push(slider(), Pusher(MU), straight((-0.06, 0.01), (0.0, 0.03)))
    axes = found.plot().axes[0]
    assert len(axes.lines) == 3
    (x, y, turn) = found.end
    (c, s) = (np.cos(found.end[2]), np.sin(found.end[2]))
    closed = [*SQUARE, SQUARE[0]] @ np.array([[c, s], [-s, c]]) + [x, y]
    np.testing.assert_allclose(axes.lines[2].get_xydata(), 1e3 * closed, atol=1e-9)
    path, *marks = axes.collections
    ends = np.array(path.get_segments())[[0, -1], [0, 1]]
    np.testing.assert_allclose(ends, 1e3 * found.pose[[0, -1], :2], atol=1e-9)
    dots = {each.get_label(): each.get_offsets() for each in marks}
    some = np.linspace(0, len(found.time) - 1, 40).round().astype(int)
    sticks = some[found.mode[some] == "stick"]
    np.testing.assert_allclose(
        dots["pusher: stick"],
        1e3 * found.pusher_pose[sticks, :2],
        atol=1e-9,
    )
    start = (
        f"Push to ({1e3 * x:.4g} mm, {1e3 * y:.4g} mm, {np.degrees(turn):.4g} deg): "
    )
    assert repr(found).startswith(
        start
    ) and f"stick {100 * np.mean(found.mode == 'stick'):.0f}%" in repr(found)


def test_a_report_of_a_push_is_in_millimetres_and_degrees():
    pose = (0.1, -0.02, 0.5)
    said = " ".join(
        str(
            PushReport(
                pose,
                pose,
                (0.0, 0.0),
                True,
                (0.0, 0.003, -0.1),
                2,
                (0.0, 0.0),
                0.1234,
                0.75,
                True,
                1.0,
            )
        ).split()
    )
    assert (
        "goal 100.00 -20.00 28.65 reached 100.00 -20.00 28.65 with an ellipsoid 0.00 3.00 -5.73"
        in said
    )
    assert said.endswith("123.4 mm long, on edge 2, using 75% of the friction cone.")


@pytest.mark.parametrize(
    ("width", "left", "right"),
    [
        (0.04, Touch(END, 3, 1), Touch(END, 3, 0)),
        (0.2, Touch(CORNER, 3), Touch(CORNER, 0)),
    ],
)
def test_a_face_turns_about_its_end_or_about_the_corner_within(width, left, right):
    # Flush with edge 3, which leads from corner 3 down to 0.
    path = np.array([[-HALF, 0.0, 0.0], [0.0, 0.0, 0.0]])
    scenery = Scenery(slider(), Pusher(MU, width=width), np.array([0.0, 1.0]), path)
    assert flush_after(scenery, Touch(FACE, 3), 0.0, np.zeros(3), 1) == left
    assert flush_after(scenery, Touch(FACE, 3), 0.0, np.zeros(3), -1) == right
    low, high = scenery.overlap(3, 0.0, np.zeros(3))
    assert (low, high) == pytest.approx(
        (max(HALF - 0.5 * width, 0.0), min(HALF + 0.5 * width, 2.0 * HALF))
    )


UNEVEN = np.array([[-0.05, -0.03], [0.02, -0.04], [0.06, 0.01], [-0.02, 0.05]])


def test_the_geometry_of_a_push_is_that_of_complex_numbers():
    """A quadrilateral without symmetry, turned, and a face that turns along a path of two pieces."""
    times = np.array([1.0, 2.0, 4.0])
    poses = np.array([[-0.12, 0.03, 0.1], [-0.08, 0.02, 0.3], [-0.02, 0.06, 0.2]])
    thing = Slider(pf.LimitSurfaceEllipsoid(PATCH), UNEVEN)
    scenery = Scenery(thing, Pusher(MU, 0.03), times, poses)
    q = np.array([0.01, -0.02, 0.4])
    t = 2.5
    width = 0.03
    x, y, angle = pose = poses[1] + 0.25 * (poses[2] - poses[1])
    rate = 0.5 * (poses[2] - poses[1])
    assert scenery.pose(t) == pytest.approx(pose) and scenery.pose(
        1.5
    ) == pytest.approx(0.5 * (poses[0] + poses[1]))
    assert scenery.rate(t) == pytest.approx(rate) and scenery.rate(
        2.0
    ) == pytest.approx(poses[1] - poses[0])
    assert scenery.rate(2.0, forward=True) == pytest.approx(rate)
    assert (scenery.piece_end(1.0), scenery.piece_end(2.0), scenery.times[-1]) == (
        2.0,
        4.0,
        4.0,
    )
    pusher = complex(x, y)
    body = complex(q[0], q[1])
    ends = (
        pusher + np.exp(1j * angle) * 0.5j * width * np.array([-1.0, 1.0]) - body
    ) * np.exp(-1j * q[2])
    for i, end in enumerate(ends):
        assert scenery.end(i, t, q) == pytest.approx((end.real, end.imag))
    corners = (body + np.exp(1j * q[2]) * (UNEVEN @ [1.0, 1j]) - pusher) * np.exp(
        -1j * angle
    )
    assert scenery.corners(t, q) == pytest.approx(
        np.stack([corners.real, corners.imag], -1)
    )
    corner = UNEVEN[3]
    edge = UNEVEN[0] - UNEVEN[3]  # the edge on the left leads from corner 3 down to 0
    length = np.hypot(*edge)
    along = np.array(
        [(np.array([end.real, end.imag]) - corner) @ edge / length for end in ends]
    )
    assert scenery.overlap(3, t, q) == pytest.approx(
        (max(along[1], 0.0), min(along[0], length))
    )
    assert scenery.within(Touch(FACE, 3), t, q) == pytest.approx(
        min(along[0], length) - max(along[1], 0.0)
    )
    assert scenery.within(Touch(END, 3, 0), t, q) == pytest.approx(
        min(along[0], length - along[0])
    )
    assert scenery.within(Touch(CORNER, 3), t, q) == pytest.approx(
        0.5 * width - abs(corners[3].imag)
    )
    normal = np.array([-edge[1], edge[0]]) / length
    middle = corner + 0.5 * (max(along[1], 0.0) + min(along[0], length)) * edge / length
    faces = np.exp(1j * (angle - q[2]))
    half = 0.5 * (min(along[0], length) - max(along[1], 0.0))
    for touch, at, inwards, wide in (
        (Touch(END, 3, 1), np.array([ends[1].real, ends[1].imag]), normal, 0.0),
        (Touch(CORNER, 2), UNEVEN[2], np.array([faces.real, faces.imag]), 0.0),
        (Touch(FACE, 3), middle, normal, half),
    ):
        place, velocity = place_of(scenery, touch, t, q)
        assert place.at == pytest.approx(at) and place.normal == pytest.approx(inwards)
        assert place.half_width == pytest.approx(wide)
        arm = body + np.exp(1j * q[2]) * complex(*at) - pusher
        moves = (complex(rate[0], rate[1]) + 1j * rate[2] * arm) * np.exp(-1j * q[2])
        assert velocity == pytest.approx((moves.real, moves.imag, rate[2]))


def test_a_face_is_flush_with_the_edge_that_it_looks_at():
    thing = Slider(pf.LimitSurfaceEllipsoid(PATCH), UNEVEN)
    q = np.array([0.01, -0.02, 0.4])
    for edge, (x, y) in enumerate(thing.inward):
        for off in (5e-5, -5e-5, 2e-4):
            path = np.array([[-0.1, 0.0, np.arctan2(y, x) + 0.4 + off]] * 2)
            scenery = Scenery(thing, Pusher(MU, 0.03), np.array([0.0, 1.0]), path)
            if abs(off) < 1e-4:
                assert scenery.flush(0.5, q) == Touch(FACE, edge)
            else:
                with refused("not wedge the slider", pf.FrictionError):
                    scenery.flush(0.5, q)


def test_a_pusher_that_is_away_reaches_the_slider_no_sooner_than_it_can():
    path = np.array([[-0.2, 0.0, 0.0], [-0.1, 0.0, 1.0]])
    scenery = Scenery(slider(), Pusher(MU, 0.02), np.array([0.0, 2.0]), path)
    # a gap of 155 mm; ends move at 50 mm/s and at 0.5 rad/s with 10 mm
    assert scenery.not_before(0.0, np.zeros(3)) == 2.0
    near = Scenery(
        slider(),
        Pusher(MU, 0.02),
        np.array([0.0, 2.0]),
        path + np.array([0.1, 0.0, 0.0]),
    )
    assert near.not_before(0.0, np.zeros(3)) == pytest.approx(0.055 / (0.05 + 0.005))
    at, touch = touch_after(near, 0.0, np.zeros(3))
    # the right end leads: -0.1 + 0.05 t + 0.01 sin(0.5 t) = -0.045
    assert -0.1 + 0.05 * at + 0.01 * np.sin(0.5 * at) == pytest.approx(-HALF, abs=1e-9)
    assert touch == Touch(END, 3, 0)


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("turn", [0.0, 0.7])
def test_a_flush_face_that_slides_pushes_along_the_edge_of_its_friction_cone(
    side, turn
):
    """Without a turn an ellipsoid moves along the force, which passes through its centre, at the normal velocity."""
    cos = np.cos(turn)
    sin = np.sin(turn)
    world = np.array([[cos, -sin], [sin, cos]])
    place = TouchPoint(
        world @ [-HALF, 0.01 * side], world @ [1.0, 0.0], half_width=0.04
    )
    velocity = np.array([*(world @ [0.1, 0.08 * side]), 0.0])
    found = motion_at(SURFACES["ellipsoid"], place, MU, velocity)
    assert found.mode == ("slide left" if side > 0.0 else "slide right")
    assert found.twist == pytest.approx(
        [*(world @ [0.1, 0.1 * MU * side]), 0.0], abs=1e-9
    )
    force = -world.T @ SURFACES["ellipsoid"].wrench(found.twist)[:2]
    assert force / force[0] == pytest.approx([1.0, MU * side])
    # it crosses the face 0.3 x 45 mm beside the centre, on the other side; and slides at 50 of 128 mm/s
    assert found.slack == pytest.approx(
        min(0.05 / np.hypot(0.1, 0.08), 1.0 - (0.01 + MU * HALF) / 0.04), abs=1e-9
    )
    assert found.leans == 0
    narrow = motion_at(
        SURFACES["ellipsoid"], place._replace(half_width=0.02), MU, velocity
    )
    assert narrow.leans == -side  # about its right end, where it slides to the left


# ---------------------------------------------------------------------- what is refused


def test_polygons_with_an_edge_along_an_axis_are_sliders_and_stars_are_not():
    # One edge stands upright on the right.
    corners = 0.05 * np.exp(2j * np.pi * (np.arange(5) - 0.5) / 5)
    corners = np.stack([corners.real, corners.imag], -1)
    assert Slider(SURFACES["exact"], corners).inward[0] == pytest.approx(
        [-1.0, 0.0], abs=1e-12
    )
    with refused("outline must be convex", pf.FrictionError):
        Slider(SURFACES["exact"], corners[[0, 2, 4, 1, 3]])


def test_sliders_take_outlines_of_either_sense():
    turned = dataclasses.replace(slider(), outline=SQUARE[::-1])
    assert turned.gaps(np.zeros(2)).max() == pytest.approx(-HALF)


@pytest.mark.parametrize(
    ("width", "length"), [(0.003, 0.25), (0.003, 10.0), (0.1, 10.0)]
)
def test_long_paths_meet_thin_sliders(width, length):
    """A point moves through a ruler far from its middle: it does not stay where it lies."""
    half = 0.5 * np.array([0.15, width])
    ruler = Slider(
        pf.LimitSurfaceEllipsoid(pf.ContactPatch.rectangle(*(2 * half), cells=5)),
        half * [[-1, -1], [1, -1], [1, 1], [-1, 1]],
    )
    found = push(
        ruler,
        Pusher(0.3),
        straight((0.03, -0.4 * length, np.pi / 2), (0.03, 0.6 * length, np.pi / 2)),
    )
    assert (found.mode != "free").any()
    assert np.hypot(*found.end[:2]) > 0.02


def test_a_path_beside_a_slider_is_free():
    away = straight((-1.0, HALF + 1e-4, 0.0), (1.0, HALF + 1e-4, 0.0))
    found = push(slider(), Pusher(0.3), away)
    assert (found.mode == "free").all() and not found.pose.any()
