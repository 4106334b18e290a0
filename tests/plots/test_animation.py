"""Moving pictures: what their frames show is what the solution says, and what cannot be written says why."""

import dataclasses
import io
import re
import subprocess

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

import planarfriction as pf
from planarfriction import plots
from planarfriction.errors import FileError, InvalidValueError
from planarfriction.plots import animation, film_files
from planarfriction.plots.animation import Film, frame_times
from planarfriction.plots.limit_surface import scaled_samples
from planarfriction.plots.panels import CellPanel, SurfacePanel, level_of
from planarfriction.plots.track import track_of
from planarfriction.scenes.slip import bristles_of, slip_field
from tests.support import synthetic
from tests.support.pictures import faults
from tests.support.refusals import refused

LAW = pf.LuGre(
    mu_c=1.0, mu_s=1.0, sigma_0=1e4, sigma_1=0.0, sigma_2=0.0, elasto_plastic=0.9
)
"""Bristles that bend by 0.1 mm and stick up to 0.09 mm."""

SMALL = {"dpi": 25.0, "slow": 0.1}
"""Pictures of few and small frames."""


def film_of(run, frames=5, follow=True):
    times = np.asarray(run.histories["time"].values)
    track = track_of(run, np.linspace(times[0], times[-1], frames))
    return Film(run, track, follow=follow, pace="", dpi=50.0)


def panels(film, kind):
    return [each for each in film.panels if isinstance(each, kind)]


# ---------------------------------------------------------------------- how many frames


@settings(deadline=None, max_examples=60)
@given(span=st.floats(1e-6, 1e5), fps=st.floats(1.0, 50.0))
def test_a_picture_has_75_frames_or_more_unless_one_asks_for_fewer(span, fps):
    times, pace = frame_times(np.array([0.5, 0.5 + span]), None, fps)
    assert animation.LEAST_FRAMES <= len(times) <= animation.USUAL_FRAMES + 1
    assert (times[0], times[-1]) == (0.5, 0.5 + span)
    slow = (len(times) - 1) / (span * fps)
    # rounding to a whole frame of at least 75 changes the pace by less than 1 %
    shown = 1.0 if not pace else float(pace.split()[0][1:])
    assert (1.0 / slow if "faster" in pace else slow) == pytest.approx(shown, rel=0.01)


def test_the_pace_that_is_asked_for_is_kept():
    times, pace = frame_times(np.array([0.0, 0.2]), 10.0, 30.0)
    assert (len(times), pace) == (61, "   (10 x slower)")


def test_a_solution_of_one_instant_is_a_picture_too():
    assert frame_times(np.array([0.0]), None, 30.0) == (pytest.approx(np.zeros(75)), "")


# ---------------------------------------------------------------------- between the samples


def test_frames_pass_through_the_samples_without_overshoot():
    run = synthetic.solution(t_end=0.5)
    y = np.where(np.arange(51) < 25, 0.0, -0.01)  # a jump: a spline would ring
    run = synthetic.changed(run, y=y)
    times = np.linspace(0.0, 0.5, 401)
    track = track_of(run, times)
    assert track.poses[::8, 1] == pytest.approx(y, abs=1e-15)
    assert track.poses[:, 1].min() >= -0.01 and track.poses[:, 1].max() <= 0.0


@pytest.mark.parametrize(("kick", "shown"), [(-800.0, 0.2), (0.5, 0.5)])
def test_a_kick_at_the_start_does_not_shrink_the_arrow_of_friction(kick, shown):
    run = synthetic.solution()
    force = np.full((201, 1), 0.1)
    force[:2, 0] = kick, 0.2
    (contact,) = track_of(
        synthetic.changed(run, fx=force), np.array([0.0, 1.0])
    ).contacts
    assert contact.wrenches[:, 0] == pytest.approx([shown, 0.1])


@pytest.mark.parametrize("moves", [None, (0.02, -0.03, 0.7)])
@pytest.mark.parametrize("mounted_on", ["world", "body"])
def test_the_way_of_a_contact_is_that_of_its_twist(mounted_on, moves):
    """The body turns about a fixed point; half-way rules err by (turn per step)^2 / 24 of the way.

    What it stands on, or the pad, may move as well.
    """
    scene = synthetic.scene(contacts=2, mounted_on=mounted_on)
    contacts = [
        dataclasses.replace(each, angle=0.4, support_velocity=moves)
        for each in scene.contacts
    ]
    scene = dataclasses.replace(scene, contacts=contacts)
    run = synthetic.solution(scene)
    time = np.linspace(0.0, 2.0, 201)
    turn = 1.5 * time
    arm = 0.05
    run = synthetic.changed(
        run,
        x=arm * np.cos(turn),
        y=arm * np.sin(turn),
        theta=turn,
        vx=-1.5 * arm * np.sin(turn),
        vy=1.5 * arm * np.cos(turn),
        omega=1.5 + 0.0 * time,
    )
    from planarfriction.plots.track import _displacements
    from planarfriction.scenes.contact import contact_poses

    poses = np.stack([np.asarray(run.data[name]) for name in ("x", "y", "theta")], -1)
    for contact in run.scene.contacts:
        displacements = _displacements(
            contact, time, poses, contact_poses(contact, time, poses)
        )
        twists = run.contact_twist(contact.name)
        assert displacements / 0.01 == pytest.approx(
            0.5 * (twists[1:] + twists[:-1]), abs=1e-4
        )


# ---------------------------------------------------------------------- which cells slip


def field(displacements, cells=21):
    model = bristles_of(pf.ReducedModel(pf.ContactPatch.disc(0.01, cells), LAW))
    times = 0.01 * np.arange(len(displacements) + 1)
    loads = np.full(len(displacements) + 1, 2.0)
    return model.patch, slip_field(
        model,
        model.rest(),
        times,
        np.asarray(displacements),
        loads,
        np.arange(len(times)),
        np.zeros(3),
    )


def test_a_patch_that_is_pushed_sticks_up_to_breakaway_and_slips_beyond():
    _, (bent, slips) = field([[1e-5, 0.0, 0.0]] * 30)
    way = 1e-5 * np.arange(31)
    # Elastic: the bristle takes up all of the way.
    assert bent[:9, 0] == pytest.approx(way[:9] / 1e-4, rel=1e-6)
    assert not slips[:9].any()
    assert slips[13:].all()  # 0.13 mm: past the 0.1 mm that the bristles can bend
    assert bent[-1] == pytest.approx(np.ones_like(bent[-1]), rel=1e-3)


def test_a_patch_that_turns_slips_outside_and_sticks_inside():
    patch, (_, slips) = field([[0.0, 0.0, 1e-3]] * 20)
    reach = np.hypot(*patch.positions.T) * 0.02
    # bristles take up all below 0.09 mm and, a few steps past the 0.1 mm that they can bend, next to nothing
    assert not slips[-1][reach < 0.9e-4].any()
    assert slips[-1][reach > 1.3e-4].all() and (reach > 1.3e-4).any()


@pytest.mark.parametrize("speed", [0.0, 1e-2])
def test_at_first_slips_what_moves(speed):
    model = bristles_of(pf.ReducedModel(pf.ContactPatch.disc(0.01, 5), LAW))
    displacements = np.full((2, 3), [1e-3, 0.0, 0.0])
    twist = np.array([speed, 0.0, 0.0])
    _, slips = slip_field(
        model,
        model.rest(),
        np.arange(3.0),
        displacements,
        np.full(3, 2.0),
        np.arange(3),
        twist,
    )
    assert slips[1:].all()
    assert slips[0].all() == (speed > 0.0)


def test_what_stops_does_not_slip():
    # Creeps by 1e-5 of a full deflection.
    _, (bent, slips) = field([[1e-5, 0.0, 0.0]] * 30 + [[1e-9, 0.0, 0.0]] * 3)
    assert slips[30].all() and not slips[31:].any()
    assert bent[-1] == pytest.approx(np.ones_like(bent[-1]), rel=1e-3)


def test_a_reduced_model_shows_the_bristles_that_a_distributed_one_has():
    """Whatever the model: the picture of the distributed model's own run, from the bristles that it recorded.

    The path is known every 2 ms here. Held twists in between, and a speed for the Stribeck curve that is their mean,
    leave 5e-4 of the largest deflection in the mean; ten times that is still not to be seen.
    """
    model = pf.DistributedModel(
        pf.ContactPatch.disc(0.01, 9), pf.LuGre(mu_s=1.2, elasto_plastic=0.9)
    )
    run = pf.simulate(
        pf.scenes.in_hand(model), t_end=0.4, save_every=2e-3, bristles="all"
    )
    times = np.asarray(run.histories["time"].values)
    bent, slips = track_of(run, times).contacts[0].slip
    bristles = np.asarray(run.histories["bristles_fingers"].values)
    speed = np.linalg.norm(
        np.einsum("nci,ti->tcn", model.patch.levers(), run.contact_twist()), axis=1
    )
    true = (
        np.linalg.norm(bristles, axis=1)
        * 1e6
        / (1.0 + 0.2 * np.exp(-((speed / 1e-3) ** 2)))
    )
    assert np.abs(bent - true).mean() < 5e-3
    assert 0.1 < slips.mean() < 0.9  # the plate slips and is held


def test_a_law_without_bristles_leaves_the_cells_plain():
    assert bristles_of(Own()) is None


@pytest.mark.parametrize("start", ["equilibrium", "sliding"])
def test_bristles_start_as_those_of_the_scene(start):
    model = pf.ReducedModel(pf.ContactPatch.disc(0.01, 7), LAW)
    moving = (0.05, 0.0, 0.0)
    scene = synthetic.scene()
    body = dataclasses.replace(
        scene.body, velocity=moving if start == "sliding" else (0.0, 0.0, 0.0)
    )
    contacts = [dataclasses.replace(scene.contacts[0], model=model, normal_force=4.0)]
    run = synthetic.solution(
        dataclasses.replace(scene, body=body, contacts=contacts, start=start)
    )
    zero = np.zeros(201)
    run = synthetic.changed(
        run, x=zero, y=zero, theta=zero, normal_force=np.full((201, 1), 4.0)
    )
    bent = track_of(run, np.linspace(0.0, 2.0, 3)).contacts[0].slip.bent
    if start == "sliding":
        assert bent[1:] == pytest.approx(np.ones_like(bent[1:]), rel=1e-3)
    else:  # the weight of 0.2 kg on 4 N of mu = 1, up to the torque of the plate's small offset
        assert bent[1:].mean() == pytest.approx(0.2 * 9.81 / 4.0, rel=0.05)


# ---------------------------------------------------------------------- what a frame shows


def test_the_centre_of_rotation_is_where_the_body_stands_still():
    film = film_of(synthetic.solution())
    film.show(3)  # 1.5 s: falls at 0.015 m/s, turns at -0.9 rad/s
    x, y = film.centre.get_xydata()[0]
    assert (x, y) == pytest.approx((2.0 - 1e3 * 0.015 / 0.9, -5.0 * 1.5**2), abs=1e-9)


def test_a_body_that_stands_turns_about_no_point():
    film = film_of(synthetic.solution())
    film.show(0)
    assert len(film.centre.get_xydata()) == 0


@pytest.mark.parametrize(
    ("mounted_on", "turned"), [("world", 0.0), ("body", -0.3 * 1.5**2)]
)
def test_the_arrow_of_friction_is_in_world_axes_for_identical_contacts(
    mounted_on, turned
):
    scene = synthetic.scene(mounted_on=mounted_on)
    scene = dataclasses.replace(
        scene, contacts=[dataclasses.replace(scene.contacts[0], angle=0.5, count=2)]
    )
    run = synthetic.solution(scene)
    film = film_of(run)
    film.show(3)
    fx, fy = (2.0 * float(run.data[name][150, 0]) for name in ("fx", "fy"))
    angle = turned + 0.5
    force = pf.geometry.rotate(np.array([fx, fy]), angle)
    start, end = film.contacts[0][2]._posA_posB
    assert np.asarray(end) - np.asarray(start) == pytest.approx(
        film.millimetres_per_newton * force, abs=1e-9
    )


def test_the_outline_is_drawn_where_the_body_is():
    film = film_of(synthetic.solution())
    film.show(4)
    (line,) = film.body
    drawn = (line.get_transform() - film.axes.transData).transform(line.get_xydata())
    angle = -0.3 * 4.0
    turned = 1e3 * pf.geometry.rotate(synthetic.PLATE, angle)
    # 1e-6 mm: the way through pixels and back loses a few digits
    assert drawn[:4] == pytest.approx(turned + np.array([2.0, -20.0]), abs=1e-6)


def test_a_frame_draws_and_says_where_body_and_contacts_are():
    """A pad off the centre of mass on a turned contact, with its centre of pressure beside the origin of its frame."""
    patch = pf.patch.PUBLISHED_PATCHES["LineGrad"]()
    scene = synthetic.scene(contacts=2, mounted_on="body", patch=patch)
    contacts = [
        dataclasses.replace(each, angle=0.5, position=(0.03, 0.01 * i))
        for i, each in enumerate(scene.contacts)
    ]
    run = synthetic.solution(dataclasses.replace(scene, contacts=contacts))
    run = synthetic.changed(run, x=0.002 + 0.003 * np.asarray(run.data["time"]))
    film = film_of(run)
    film.show(3)  # 1.5 s
    x = 0.002 + 0.0045
    y = -0.005 * 1.5**2
    theta = -0.3 * 1.5**2
    times = np.linspace(0.0, 1.5, 4)
    path = 1e3 * np.stack([0.002 + 0.003 * times, -0.005 * times**2], -1)
    assert film.path.get_xydata() == pytest.approx(path, abs=1e-9)

    turned = pf.geometry.rotate
    for contact, (_, cells, arrow) in zip(contacts, film.contacts, strict=True):
        origin = np.array([x, y]) + turned(np.array(contact.position), theta)
        drawn = np.array(
            [polygon.vertices[:4].mean(axis=0) for polygon in cells.get_paths()]
        )
        drawn = (cells.get_transform() - film.axes.transData).transform(drawn)
        assert drawn == pytest.approx(
            1e3 * (origin + turned(patch.positions, theta + 0.5)), abs=1e-6
        )
        start = 1e3 * (origin + turned(patch.centre_of_pressure(), theta + 0.5))
        assert arrow._posA_posB[0] == pytest.approx(start, abs=1e-9)
    assert (
        film.words.get_text()
        == "moved by x 4.50 mm, y -11.25 mm, rotated by -38.67 deg"
    )
    assert film.clock.get_text() == "t = 1.50 s"
    longest = max(np.hypot(*each.forces.T).max() for each in film.track.contacts)
    side = np.diff(film.views[0], axis=-1).min()
    assert film.millimetres_per_newton * longest == pytest.approx(0.3 * side)
    assert (
        f"(longest {longest:.3g} N)" in film.figure.legends[0].get_texts()[0].get_text()
    )


def test_the_wrench_is_drawn_from_the_side_with_its_tail():
    run = synthetic.solution()
    film = film_of(run, frames=41)
    (panel,) = panels(film, SurfacePanel)
    panel.show(30)
    head = panel.points[30]
    fx, fy, tau = (run.data[name].values[:, 0] for name in ("fx", "fy", "tau"))
    most = np.hypot(fx, fy)[::5].argmax() * 5
    along = np.array([fx[most], fy[most]]) / np.hypot(fx[most], fy[most])
    radius = run.scene.contacts[0].model.patch.contact_radius()
    seen = np.array([along @ [fx[150], fy[150]], tau[150] / radius])
    # Exact radius, of cells here.
    assert head == pytest.approx(seen / 2.0, rel=2e-3)
    assert np.ravel(panel.head.get_data()) == pytest.approx(head)
    assert pytest.approx(panel.points[5:31]) == np.asarray(panel.tail.get_data()).T
    arm = np.asarray(panel.arm.get_data()).T
    assert pytest.approx(np.array([[0.0, 0.0], head])) == arm


def test_cells_are_pale_unbent_blue_bent_and_orange_where_they_slip():
    film = film_of(synthetic.run(patch=pf.ContactPatch.rectangle(0.04, 0.01, 8)))
    (panel,) = panels(film, CellPanel)
    bent, slips = panel.track.slip
    bent[2], slips[2] = (
        np.linspace(0.0, 1.2, bent.shape[1]),
        np.arange(bent.shape[1]) % 3 == 0,
    )
    panel.show(2)
    expected = np.where(slips[2], 1.0, 0.89 * np.minimum(bent[2], 1.0))
    assert np.asarray(panel.cells.get_array()) == pytest.approx(expected)
    assert (*panel.axes.get_xlim(), *panel.axes.get_ylim()) == pytest.approx(
        (-22.4, 22.4) * 2
    )
    twist = panel.track.twists[2]
    centre = (-1e3 * twist[1] / twist[2], 1e3 * twist[0] / twist[2])
    assert panel.centre.get_xydata()[0] == pytest.approx(centre, abs=1e-9)


def test_a_frame_without_load_has_the_surface_of_the_last_load_before():
    run = soft_finger()
    run = synthetic.changed(
        run, normal_force=np.repeat([0.0, 1.0, 0.0, 3.0, 0.0], 41)[:201, None]
    )
    (panel,) = panels(film_of(run), SurfacePanel)
    low, high = (round(np.log(load) / np.log(1.15)) for load in (1.0, 3.0))
    assert [level_of(panel.track, frame) for frame in range(5)] == [
        low,
        low,
        low,
        high,
        high,
    ]
    assert {
        level: float(load) for level, load in panel.levels.items()
    } == pytest.approx({low: 1.15**low, high: 1.15**high})


def test_a_patch_in_steady_sliding_has_its_wrench_on_the_limit_surface():
    patch = pf.patch.PUBLISHED_PATCHES["NonConvex2"]()
    run = synthetic.run(patch=patch)
    surface = pf.LimitSurfaceExact(patch)
    polar = np.full(201, 1.1)
    azimuth = np.linspace(0.0, 6.0, 201)
    twists, points = (each for each in scaled_samples(surface, polar, azimuth))
    del twists
    from planarfriction.plots.limit_surface import sample_limit_surface

    _, wrenches = sample_limit_surface(surface, polar, azimuth)
    fx, fy, tau = 2.0 * wrenches.T[:, :, None]  # mu_c = 1 and 2 N
    film = film_of(synthetic.changed(run, fx=fx, fy=fy, tau=tau))
    (panel,) = panels(film, SurfacePanel)
    seen = np.stack([points[:, :2] @ panel.along, points[:, 2]], -1)
    assert panel.points == pytest.approx(seen[::50], abs=1e-9)
    panel.show(2)
    assert np.ravel(panel.head.get_data()) == pytest.approx(seen[100], abs=1e-9)
    # What is seen of the surface holds all its wrenches, and is no larger than they are.
    (side,) = (shapely.Polygon(each.get_xy()) for each in panel.drawn.values())
    assert shapely.distance(side, shapely.points(seen)).max() < 2e-3
    ahead = surface.wrench((*panel.along, 0.0))[:2] @ panel.along
    assert abs(side.bounds[2]) == pytest.approx(abs(ahead), rel=2e-3)


def soft_finger():
    soft = pf.ContactPatch.rectangle(
        0.02, cells=9, pressure=pf.SoftFinger(c=0.006, n=1 / 3, k=2.0, radius_max=0.01)
    )
    run = synthetic.run(patch=soft)
    return synthetic.changed(run, normal_force=np.linspace(0.0, 4.0, 201)[:, None])


def test_the_patch_and_its_limit_surface_follow_the_load():
    film = film_of(soft_finger())
    (cells,) = panels(film, CellPanel)
    (surface,) = panels(film, SurfacePanel)
    shown = []
    for frame in range(5):
        film.picture(frame)
        shown.append(int((~np.ma.getmaskarray(cells.cells.get_array())).sum()))
        assert [
            level for level, each in surface.drawn.items() if each.get_visible()
        ] == [level_of(surface.track, frame)]
    assert shown[0] == 0 and shown[1] > 0
    assert shown == sorted(shown) and shown[4] > shown[1]
    assert len(surface.levels) == 4  # a first frame without load has that of the next


def test_every_contact_has_its_panels_and_the_rest_is_drawn_in_the_world():
    assert len(film_of(synthetic.run(contacts=2)).panels) == 4
    film = film_of(synthetic.run(contacts=5))
    assert [each.track.contact.name for each in panels(film, CellPanel)] == [
        "pad 3",
        "pad 4",
        "pad 5",
    ]
    assert len(film.contacts) == 5


def test_the_share_that_slips_is_that_of_the_load():
    film = film_of(synthetic.solution())
    (panel,) = panels(film, CellPanel)
    slips = panel.track.slip.slips
    slips[2] = panel.track.contact.model.patch.positions[:, 0] > 0.0
    panel.show(2)
    share = 100.0 * slips[2].sum() / slips.shape[1]
    assert panel.words.get_text() == f"pad: {share:.0f} % of the load slips"
    panel = panels(film_of(synthetic.run(contacts=2)), CellPanel)[1]
    panel.track = dataclasses.replace(
        panel.track,
        contact=dataclasses.replace(panel.track.contact, name="long" + 8 * " long"),
    )
    panel.show(0)
    assert panel.words.get_text().startswith("long long long long...: ")


# ---------------------------------------------------------------------- the view


def far(way=1.0):
    run = synthetic.run(mounted_on="body")
    return synthetic.changed(run, x=way * np.linspace(0.0, 1.0, 201))


def sides(film):
    return np.diff(film.views, axis=-1)[..., 0]


def test_the_view_follows_a_body_that_goes_far():
    film = film_of(far())
    assert np.ptp(sides(film), axis=0) == pytest.approx(np.zeros(2), abs=1e-9)
    reach = np.hypot(75.0, 40.0)
    assert sides(film)[0].min() == pytest.approx(2.3 * reach)  # mm; the way is a metre
    middle = film.views.mean(axis=-1)
    assert middle[1:4, 0] == pytest.approx(1e3 * film.track.poses[1:4, 0])
    for frame, pose in enumerate(film.track.poses):
        low, high = film.views[frame].T
        reach = 1e3 * np.hypot(0.075, 0.04)
        assert (low < 1e3 * pose[:2] - reach + 25.0).all() and (
            1e3 * pose[:2] + reach - 25.0 < high
        ).all()


@pytest.mark.parametrize(
    ("run", "follow"), [(lambda: far(), False), (lambda: far(0.05), True)]
)
def test_the_view_holds_the_whole_motion_where_it_need_not_follow(run, follow):
    film = film_of(run(), follow=follow)
    assert np.ptp(film.views, axis=0) == pytest.approx(np.zeros((2, 2)), abs=1e-9)
    low, high = film.views[0].T
    for pose in film.track.poses[:, :2]:
        assert (low < 1e3 * pose - 40.0).all() and (1e3 * pose + 40.0 < high).all()


def test_both_axes_have_one_scale():
    film = film_of(synthetic.solution())
    width, height = sides(film)[0]
    assert width / height == pytest.approx(
        film.axes.bbox.width / film.axes.bbox.height, rel=1e-9
    )


# ---------------------------------------------------------------------- what can be drawn


class Own:
    """A model of one's own, without a law of bristles."""

    patch = pf.ContactPatch.disc(0.01, 5)
    law = "tape"


def with_model(model):
    scene = synthetic.scene()
    return synthetic.solution(
        dataclasses.replace(scene, contacts=[pf.Contact(model, 2.0, name="pad")])
    )


def one_sample():
    run = synthetic.solution()
    return dataclasses.replace(run, histories=run.data.isel(time=slice(1)))


GROOVED = pf.ContactPatch.disc(0.01, 7).with_friction_metric(np.diag([1.0, 0.25]))
EACH = GROOVED.with_friction_metric(
    np.linspace(1.0, 2.0, len(GROOVED.positions))[:, None, None] * np.eye(2)
)
DRAWN = {
    "legs": lambda: synthetic.run(
        patch=pf.ContactPatch.points([(0.0, 0.1), (-0.1, -0.05)])
    ),
    "one point": lambda: with_model(
        pf.DistributedModel(pf.ContactPatch.points([(0.0, 0.0)]), LAW)
    ),
    "own model": lambda: with_model(Own()),
    "no outline": lambda: synthetic.run(mounted_on="body", outline=None),
    "one sample": one_sample,
    "cells differ": lambda: synthetic.run(patch=EACH),
    "grooved": lambda: synthetic.run(patch=GROOVED),
    "published": lambda: with_model(
        pf.ReducedModelPublished(pf.ContactPatch.disc(0.01, 7), LAW)
    ),
    "three contacts": lambda: synthetic.run(contacts=3),
    "no load": lambda: synthetic.changed(
        synthetic.solution(), normal_force=np.zeros((201, 1)), fy=np.zeros((201, 1))
    ),
}


@pytest.mark.parametrize("name", DRAWN)
def test_a_frame_of_it_is_drawn(name):
    film = film_of(DRAWN[name](), frames=2)
    first = film.picture(0)
    last = film.picture(1)
    assert first.shape == last.shape == (270, 480, 3)
    assert (first < 100).any()
    assert len(panels(film, SurfacePanel)) == {
        "one point": 0,
        "own model": 0,
        "three contacts": 3,
    }.get(name, 1)


@pytest.mark.parametrize("contacts", [1, 2, 3])
def test_no_word_of_a_frame_is_cut_or_covered(contacts):
    film = Film(
        run := synthetic.run(contacts=contacts),
        track_of(run, np.linspace(0.0, 2.0, 3)),
        follow=True,
        pace="   (2 x slower)",
        dpi=100.0,
    )
    film.picture(1)
    for artist in film.figure.findobj(lambda each: each.get_animated()):
        artist.set_animated(False)
    assert faults(film.figure) == []


# ---------------------------------------------------------------------- files


def test_a_gif_has_its_frames_at_their_pace(tmp_path):
    seen = []
    path = synthetic.solution(t_end=0.3).animate(
        tmp_path / "motion.gif", slow=1.0, dpi=30.0, progress=seen.append
    )
    with Image.open(path) as image:
        durations = []
        for frame in range(image.n_frames):
            image.seek(frame)
            durations.append(image.info["duration"])
        image.seek(0)
        assert np.asarray(image.convert("RGB"))[0, 0].tolist() == [255, 255, 255]
    # frames that are alike may be one: their times add up, to the hundredth of a second that GIF counts
    assert sum(durations) == pytest.approx(1e3 * (10 / 30.0 + film_files.LAST), abs=10)
    assert max(seen) == pytest.approx(0.3)


def coloured(number):
    """A frame of 60 x 40 pixels: white, two frequent colours, and 30 rare ones that change from frame to frame."""
    pixels = np.full((60, 40, 3), 255, dtype=np.uint8)
    pixels[:20] = (0, 114, 178)
    pixels[20:30] = (230, 97, 0)
    rare = 7 * np.arange(30) + 211 * number
    pixels[50:].reshape(-1, 3)[:30] = np.stack(
        [rare % 256, rare // 7 % 256, rare // 3 % 256], -1
    )
    return pixels


def test_frequent_colours_are_kept_and_rare_ones_are_near(tmp_path):
    path = tmp_path / "colours.gif"
    file = io.BytesIO()
    film_files.write_frames(path, file, coloured, 8, 10.0)
    with Image.open(file) as image:
        assert image.n_frames == 8 and image.info["loop"] == 0
        for number in range(8):
            image.seek(number)
            assert image.info["duration"] == (100 if number < 7 else 1100)
            off = np.abs(
                np.asarray(image.convert("RGB"), dtype=int)
                - coloured(number).astype(int)
            )
            assert off[:50].max() == 0
            # 22: medians of 256 boxes.
            assert off.reshape(-1, 3)[2000:2030].mean() < 30.0


def test_an_html_file_plays_by_itself(tmp_path):
    text = (
        synthetic.solution()
        .animate(tmp_path / "motion.html", **SMALL)
        .read_text(encoding="utf-8")
    )
    assert text.count("data:image/png;base64") == 7
    assert re.search(r"(anim\w+) = new Animation\([^;]*; \1\.play_animation\(\);", text)
    assert "http" not in text.replace("http://www.w3.org", "")  # nothing is fetched
    assert all(
        each in text for each in ("&minus;</button>", " &gt;</button>", "+</button>")
    )


def test_an_mp4_file_is_a_film(tmp_path):
    pytest.importorskip("imageio_ffmpeg")
    path = synthetic.solution().animate(tmp_path / "motion.MP4", **SMALL)
    assert path.read_bytes()[4:8] == b"ftyp"


def test_without_ffmpeg_the_extra_is_named(tmp_path, monkeypatch):
    monkeypatch.setattr(film_files.shutil, "which", lambda name: None)
    monkeypatch.setitem(__import__("sys").modules, "imageio_ffmpeg", None)
    with refused(
        r"ffmpeg is not installed: run pip install 'planarfriction\[ffmpeg\]'",
        FileError,
    ):
        synthetic.solution().animate(tmp_path / "motion.mp4")


def test_an_ffmpeg_that_is_not_where_it_is_named_is_said_to_be_missing(
    tmp_path, monkeypatch
):
    pytest.importorskip("imageio_ffmpeg")
    monkeypatch.setattr(film_files.shutil, "which", lambda name: None)
    monkeypatch.setenv("IMAGEIO_FFMPEG_EXE", str(tmp_path / "gone"))
    with refused(
        r"there is no ffmpeg at .*gone, which imageio-ffmpeg names", FileError
    ):
        synthetic.solution().animate(tmp_path / "motion.mp4")


def test_the_slowest_gif_is_written(tmp_path):
    path = synthetic.solution().animate(
        tmp_path / "motion.gif", fps=animation.SLOWEST, slow=1e3, dpi=20.0
    )
    assert path.stat().st_size > 0


@pytest.mark.parametrize("kind", ["gif", "html", "mp4"])
def test_ctrl_c_leaves_what_was_there(tmp_path, kind):
    if kind == "mp4":
        pytest.importorskip("imageio_ffmpeg")
    path = tmp_path / f"motion.{kind}"
    path.write_text("kept")
    calls = []

    def stop(time):
        calls.append(time)
        # The colours are chosen from 6 frames before the first is written.
        if len(calls) == 9:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        synthetic.solution().animate(path, dpi=25.0, slow=0.2, progress=stop)
    assert path.read_text() == "kept"
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("stopped", [True, False])
def test_an_ffmpeg_that_fails_is_named_and_one_that_is_stopped_is_not(
    tmp_path, monkeypatch, stopped
):
    pytest.importorskip("imageio_ffmpeg")
    from matplotlib.animation import FFMpegWriter

    whole = FFMpegWriter.finish

    def fails(self):
        whole(self)
        raise subprocess.CalledProcessError(255, "ffmpeg")

    def stop(time):
        if stopped:
            raise KeyboardInterrupt

    monkeypatch.setattr(FFMpegWriter, "finish", fails)
    wanted = (
        None
        if stopped
        else "cannot write .*: ffmpeg failed; write a .gif or .html file instead"
    )
    count = iter(range(99))
    with pytest.raises(KeyboardInterrupt if stopped else FileError, match=wanted):
        path = tmp_path / "motion.mp4"
        synthetic.solution().animate(
            path, **SMALL, progress=lambda time: stop(time) if next(count) > 2 else None
        )


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            {"path": "motion.avi"},
            r"cannot write motion.avi: animations are .gif, .mp4 or .html files",
        ),
        ({"path": "missing/motion.gif"}, "there is no folder"),
        ({"path": 5}, "path must"),
        ({"slow": 0.0}, "slow must be > 0, got 0.0"),
        ({"slow": "fast"}, "slow must"),
        (
            {"slow": 1e4},
            "slow must be at most 50 here, for at most 3000 frames, got 10000.0",
        ),
        ({"fps": 60}, "fps must be at most 50, got 60.0"),
        ({"fps": -1}, "fps must be > 0"),
        ({"fps": 1e-3}, "fps must be at least 0.01, got 0.001"),
        ({"follow": "body"}, "follow must be True or False, got 'body'"),
        ({"dpi": 5}, "dpi must be from 20 to 400, got 5.0"),
        (
            {"progress": 5},
            "progress must be a function of the time of a frame, or None, got 5",
        ),
    ],
)
def test_what_cannot_be_animated_is_named_in_one_line(
    arguments, message, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    with refused(message, (FileError, InvalidValueError)):
        synthetic.solution().animate(**{"path": "motion.gif", **arguments})
    assert list(tmp_path.iterdir()) == []


def test_a_solution_without_its_scene_is_not_animated(tmp_path):
    run = dataclasses.replace(synthetic.solution(), scene=None)
    run.data.attrs["scene_left_out"] = "it was so"
    with refused(
        "the file has no scene, which the animation needs: it was so", FileError
    ):
        run.animate(tmp_path / "motion.gif")
    with refused("solution must be a Solution, got 5"):
        plots.animate_solution(5, tmp_path / "motion.gif")
