"""Grip plans reach what was asked for and hold, and the smallest grip is that of the limit surface."""

import dataclasses
import functools
import math

import numpy as np
import pytest

import planarfriction as pf
from planarfriction.errors import InvalidValueError
from planarfriction.planning import grip, holding_load, plan_grip
from planarfriction.planning.grip import (
    Aim,
    Grips,
    _bounds,
    grip_position,
    load_on,
    report_of,
    slide_of,
)
from tests.support.repository import script

LAW = pf.LuGre(mu_c=1.0, mu_s=1.2, elasto_plastic=0.9)
PATCH = pf.ContactPatch.disc(0.01, cells=11)
MODEL = pf.ReducedModel(PATCH, LAW)
SOFT = pf.ContactPatch.disc(
    0.02, cells=11, pressure=pf.SoftFinger(c=0.006, n=1 / 3, k=2.0)
)
HALF = math.radians(30.0)


def plate(offset=0.025, model=MODEL):
    return pf.scenes.in_hand(
        model, centre_of_mass=(offset, 0.0), normal_force=4.0, t_end=1.0
    )


@functools.cache
def turning():
    return plan_grip(plate(), {"angle": -HALF})


def at_the_end(solution):
    return {
        name: float(solution.data[name][-1])
        for name in ("x", "y", "theta", "vx", "vy", "omega")
    }


# ---------------------------------------------------------------------- plans


def test_a_plate_turns_by_thirty_degrees_slides_little_and_is_held():
    """Within 0.05 degrees and 1.45 mm of slide; and it stays for another second. The scene is simulated as it is."""
    plan = turning()
    longer = dataclasses.replace(plan.scene, t_end=2.0)
    data = pf.simulate(longer, save_every=0.5).data
    for at in (1.0, 2.0):
        assert math.degrees(float(data.theta.sel(time=at))) == pytest.approx(
            -30.0, abs=0.05
        )
    end = at_the_end(pf.simulate(plan.scene))
    assert (
        np.hypot(*slide_of(plan.scene, 0, np.array([end["x"], end["y"], end["theta"]])))
        < 1.45e-3
    )
    assert plan.report.angle == pytest.approx(end["theta"], abs=1e-9)
    assert plan.report.speed < 1e-9
    assert plan.scene.contacts[0].normal_force == plan.signal
    # It ends when nothing more is gained.
    assert plan.report.jacobians <= 6 and plan.report.simulations <= 100
    assert plan.signal.values[-1] >= 1.5 * plan.report.holding * (1 - 1e-9)
    assert (
        plan.signal.values[:3] < load_and_level(plan.scene)[1]
    ).all()  # it starts where something gives way


def load_and_level(scene):
    load = load_on(scene, 0, 0.0, np.zeros(2), 0.0)
    return load, holding_load(load, PATCH, LAW.mu_c)


@pytest.mark.parametrize("offset", [0.0, 0.002])
def test_a_plate_slides_by_ten_millimetres_without_turning(offset):
    """Within 0.05 mm and 0.3 degrees, with its centre of mass under the grip or 2 mm beside it."""
    plan = plan_grip(plate(offset), {"slide": (0.0, -0.01)})
    end = at_the_end(pf.simulate(plan.scene))
    slide = slide_of(plan.scene, 0, np.array([end["x"], end["y"], end["theta"]]))
    assert np.hypot(*(slide - [0.0, -0.01])) < 5e-5
    assert abs(math.degrees(end["theta"])) < 0.3
    assert abs(end["vy"]) < 1e-9


def held_at_first(grip):
    scene = pf.scenes.in_hand(
        MODEL, centre_of_mass=(0.025, 0.0), normal_force=grip, t_end=1.0
    )
    return dataclasses.replace(scene, start="equilibrium")


def test_a_plan_goes_on_from_the_grip_that_holds_the_plate():
    plan = plan_grip(held_at_first(5.0), {"angle": -HALF})
    assert plan.signal.values[0] == pytest.approx(5.0, rel=1e-5)
    data = pf.simulate(plan.scene).data
    assert math.degrees(float(data.theta[-1])) == pytest.approx(-30.0, abs=0.05)
    assert abs(float(data.omega[-1])) < 1e-9


def test_the_report_says_what_friction_does():
    """Its frictions are those of scenes whose law is scaled, and one percent is the slope between them."""
    report = turning().report
    law = dataclasses.replace(LAW, mu_c=1.05, mu_s=1.2 * 1.05)
    contact = dataclasses.replace(
        turning().scene.contacts[0], model=pf.ReducedModel(PATCH, law)
    )
    changed = pf.simulate(dataclasses.replace(turning().scene, contacts=[contact]))
    assert report.frictions.tolist() == [0.95, 0.99, 1.0, 1.01, 1.05]
    assert report.angles[-1] == pytest.approx(float(changed.data.theta[-1]), abs=1e-9)
    assert (np.diff(report.angles) > 0.0).all()  # the more friction, the less it turns
    assert report.per_percent == pytest.approx(
        (report.angles[3] - report.angles[1]) / 2
    )
    assert report.spread == pytest.approx(np.abs(report.angles + HALF).max())
    shown = repr(turning())
    assert (
        "rotate by -30 degrees" in shown
        and "+5 %" in shown
        and "An error of one percent" in shown
    )


@pytest.mark.slow
def test_the_worst_friction_misses_by_less_where_that_is_the_aim():
    """A quick swing depends on friction five times less than a slow one, and slides more."""
    worst = plan_grip(plate(), {"angle": -HALF}, aim="worst").report
    assert worst.spread < 0.3 * turning().report.spread
    assert np.hypot(*worst.slide) < 4e-3


def test_slopes_of_ends_are_differences(monkeypatch):
    """Central differences over 1e-3 N, right to 1e-3 of the largest; speed, slide and angle of a plate that moves.

    At 1e-4, a third of the tolerance of searches.
    """
    monkeypatch.setattr(grip, "LOOSE", 1e-4)
    scene = dataclasses.replace(plate(), t_end=0.2)
    grips = Grips(scene, 0, [1.0])
    times = np.array([0.0, 0.08, 0.15])
    values = np.array([2.0, 2.8, 3.5])

    def vector(change):
        return grips.ends(
            pf.Signal(times, values + change, "linear"), [1.0], rtol=1e-9
        )[0]

    (slopes,) = grips.slopes(pf.Signal(times, values, "linear"), [1.0])
    step = 1e-3 * np.eye(3)
    differences = np.stack(
        [(vector(each) - vector(-each)) / 2e-3 for each in step], axis=1
    )
    assert (
        np.abs(slopes - differences) < 1e-3 * np.abs(differences).max(axis=1)[:, None]
    ).all()


@pytest.mark.parametrize("mounted_on", ["world", "body"])
def test_ends_and_loads_of_a_scene_that_is_seen_turned_are_turned(mounted_on):
    """A pad off the origin on a plate that is pulled, seen from axes turned by 0.5: rounding and 1e-5 of the solver."""
    turn = 0.5
    profile = pf.Signal.constant(0.5)
    patch = pf.ContactPatch.rectangle(0.02, 0.01, cells=6)
    pad = {"count": 2, "mounted_on": mounted_on, "position": (0.01, 0.02), "angle": 0.2}
    for_one = pf.Contact(pf.ReducedModel(patch, LAW), 3.0, **pad)
    body = pf.Body(0.2, 3e-4, position=(0.03, -0.01), angle=0.3, gravity=(0.0, -9.81))
    ends = []
    loads = []
    for by in (0.0, turn):
        seen = dataclasses.replace(
            body,
            position=tuple(pf.geometry.rotate(np.array(body.position), by)),
            angle=body.angle + by,
            gravity=tuple(pf.geometry.rotate(np.array(body.gravity), by)),
        )
        contact = for_one
        if mounted_on == "world":
            place = tuple(pf.geometry.rotate(np.array(for_one.position), by))
            contact = dataclasses.replace(
                for_one, position=place, angle=for_one.angle + by
            )
        scene = pf.Scene(seen, contact, 0.1)
        ends.append(Grips(scene, 0, [1.0]).ends(profile, [1.0])[0])
        loads.append(
            load_on(
                scene, 0, 0.2, pf.geometry.rotate(np.array([0.004, -0.002]), by), 0.0
            )
        )
    speed = pf.geometry.rotate(ends[0][:2], turn)
    slide = pf.geometry.rotate(ends[0][3:5], turn)
    assert ends[1] == pytest.approx([*speed, ends[0][2], *slide, ends[0][5]], abs=1e-5)
    assert abs(ends[0][5]) > 1e-3 and np.hypot(*ends[0][3:5]) > 1e-4
    assert loads[1] == pytest.approx(loads[0], abs=1e-9)
    away = np.array(body.position) - grip_position(pf.Scene(body, for_one, 0.1), 0)
    # The pad stays where it is.
    arm = pf.geometry.rotate(away, 0.2) + np.array([0.004, -0.002])
    if mounted_on == "world":  # half the weight, about the pad, in its axes
        force = pf.geometry.rotate(np.array([0.0, -0.981]), -for_one.angle)
        assert loads[0] == pytest.approx([*force, -0.981 * arm[0]], abs=1e-9)


def test_misses_count_what_was_wanted():
    aim = Aim(None, np.array([3e-3, 4e-3]), 0.005)
    (end,) = Grips(plate(), 0, [1.0]).ends(pf.Signal.constant(50.0), [1.0])
    assert aim.progress(end) == pytest.approx(0.0, abs=1e-3)
    assert aim.misses(end)[3:5] == pytest.approx([-600.0, -800.0], abs=1.0)


def test_a_plan_draws_itself():
    figure = turning().plot()
    assert [axes.get_ylabel() for axes in figure.axes] == [
        "grip [N]",
        "rotation [°]",
        "slide [mm]",
    ]
    assert len(figure.axes[1].lines) == 4  # three frictions and the goal
    report = turning().report
    (grip, turn, slide) = figure.axes
    assert turn.lines[3].get_ydata()[0] == pytest.approx(-30.0)
    for number, factor in enumerate((1.0, 0.95, 1.05)):
        k = report.frictions.tolist().index(factor)
        assert turn.lines[number].get_ydata()[-1] == pytest.approx(
            math.degrees(report.angles[k]), abs=1e-3
        )
        assert slide.lines[number].get_ydata()[-1] == pytest.approx(
            1e3 * np.hypot(*report.slides[k]), abs=1e-3
        )
    assert grip.lines[0].get_ydata()[-1] == pytest.approx(report.grip)
    assert grip.lines[1].get_ydata()[0] == pytest.approx(report.holding)
    assert [each.get_text() for each in turn.get_legend().get_texts()][1:] == [
        "friction \N{MINUS SIGN}5 %",
        "friction +5 %",
    ]


def test_grips_are_between_a_fiftieth_and_four_times_the_holding_load():
    assert _bounds(None, 10.0) == pytest.approx((0.2, 40.0))
    assert _bounds((1.0, 2.0), 10.0) == (1.0, 2.0)


def test_a_report_is_in_degrees_and_millimetres():
    frictions = [0.99, 1.0, 1.01]
    ends = np.zeros((3, 6))
    ends[:, 3:] = [[4e-3, 3e-3, 0.30], [2e-3, 1e-3, 0.20], [1e-3, 0.0, 0.14]]
    ends[1, :3] = 3e-3, 0.0, 0.4
    turned = report_of(
        Aim(0.2, np.zeros(2), 0.01), frictions, ends, 6.0, 4.0, (1, 2, 3.0)
    )
    assert turned.per_percent == pytest.approx(0.08)  # (0.30 - 0.14)/2
    assert turned.speed == pytest.approx(5e-3)  # 3 mm/s, and 0.4 rad/s at 10 mm
    assert turned.spread == pytest.approx(0.1)
    said = " ".join(str(turned).split())
    assert (
        "rotate by 11.46 degrees" in said
        and "-1 % 17.189 4.000 3.000 nominal 11.459 2.000 1.000 +1 % 8.021" in said
    )
    assert (
        "changes the result by 4.6 degrees" in said
        and "6 N, 1.50 times the holding force" in said
    )
    slid = report_of(
        Aim(None, np.array([0.0, 1e-3]), 0.01), frictions, ends, 6.0, 4.0, (1, 2, 3.0)
    )
    assert slid.per_percent == pytest.approx(1.5e-3) and slid.spread == pytest.approx(
        np.sqrt(20.0) * 1e-3
    )
    assert "slide by (0, 1) mm" in str(slid) and "changes the result by 1.5 mm" in str(
        slid
    )


@pytest.mark.parametrize("patch", [PATCH, SOFT])
@pytest.mark.parametrize(
    "kind", [pf.DistributedModel, pf.ReducedModel, pf.ReducedModelPublished]
)
def test_a_model_with_another_law_is_that_model_to_the_bit(kind, patch):
    """Data taken over from the first model are those that the second builds; another exponent needs another map."""
    first = kind(patch, LAW)
    twist = (0.003, 0.001, 0.4)
    load = 2.3
    dt = 1e-3
    first.step(first.rest(), twist, load, dt)
    for law in (
        dataclasses.replace(LAW, mu_c=0.7),
        dataclasses.replace(LAW, gamma=1.5),
    ):
        shared = first.with_law(law)
        alone = kind(patch, law)
        assert shared == alone
        for mine, its in zip(
            shared.step(shared.rest(), twist, load, dt),
            alone.step(alone.rest(), twist, load, dt),
            strict=True,
        ):
            assert (mine == its).all()


# ---------------------------------------------------------------------- the smallest grip


def test_the_smallest_grip_of_a_force_of_a_torque_and_of_both():
    """Closed forms of a disc: `F/mu`, `3 tau/(2 mu R)`; both together take more than either."""
    force = (0.0, -3.0, 0.0)
    torque = (0.0, 0.0, 0.02)
    assert holding_load(force, PATCH, 0.6) == pytest.approx(3.0 / 0.6, rel=1e-9)
    assert holding_load(torque, PATCH, 0.6) == pytest.approx(
        1.5 * 0.02 / (0.6 * 0.01), rel=1e-9
    )
    both = holding_load((0.0, -3.0, 0.02), PATCH, 0.6)
    assert 5.0 < both < 10.0
    assert holding_load((0.0, -3.0, 0.02), PATCH, 0.6, margin=0.25) == pytest.approx(
        1.25 * both
    )
    assert holding_load(np.zeros(3), PATCH, 0.6) == 0.0


@pytest.mark.parametrize(
    "patch",
    [
        PATCH,
        SOFT,
        PATCH.with_friction_metric(pf.friction_metric(0.3, 0.5, 1.0), (0.2, 0.1)),
    ],
)
def test_the_smallest_grip_puts_the_load_on_the_limit_surface(patch):
    """At that grip the wrench of its twist is the load, to 1e-6; a brushed patch holds less one way than the other."""
    load = np.array([0.5, -2.0, 0.01])
    grip = holding_load(load, patch, 0.8)
    surface = pf.LimitSurfaceExact(patch, normal_force=grip)
    friction = 0.8 * grip * surface.wrench(surface.twist(-load))
    assert friction == pytest.approx(-load, rel=1e-5, abs=1e-7)
    back = holding_load(-load, patch, 0.8)
    assert (back == pytest.approx(grip, rel=1e-6)) == (not patch.asymmetric)


def test_a_plate_holds_just_above_the_smallest_grip_and_slips_just_below():
    """That of mu_s and the cells of the model; an exact disc differs from one of 11 x 11 cells by up to 2 %."""
    load, _ = load_and_level(plate())
    least = holding_load(load, PATCH, LAW.mu_s)
    moved = {}
    for share in (0.96, 1.04):
        scene = pf.scenes.in_hand(
            MODEL, centre_of_mass=(0.025, 0.0), normal_force=share * least, t_end=0.2
        )
        try:
            data = pf.simulate(dataclasses.replace(scene, start="equilibrium")).data
            moved[share] = abs(float(data.theta[-1]))
        except InvalidValueError:
            moved[share] = math.inf
    assert moved[1.04] < 1e-12 and moved[0.96] > 0.1


def test_the_smallest_grip_of_two_points_with_a_force_through_their_middle():
    points = pf.ContactPatch.points([(0.0, 0.0), (0.01, 0.0)], [1.0, 1.0])
    assert holding_load((0.0, 1.0, 0.005), points, 1.0) == pytest.approx(1.0, rel=1e-6)


def test_the_example_turns_the_plate():
    plan = script("examples/turn_in_hand.py").plan(degrees=-20.0, aim="nominal")
    assert math.degrees(plan.report.angle) == pytest.approx(-20.0, abs=0.05)
