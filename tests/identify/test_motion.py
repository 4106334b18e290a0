"""Identification from slides that stop: friction and contact radius come out of motion alone."""

from types import SimpleNamespace

import numpy as np
import pytest

import planarfriction as pf
from planarfriction.identify import (
    MassProperties,
    Slide,
    fit_start,
    identify_motion,
    predict_slide,
)
from planarfriction.identify.checks import check_slides
from planarfriction.identify.motion import SlideProblem
from planarfriction.identify.slides import slide_poses
from tests.support.refusals import refused

BODY = MassProperties(0.37, 8.1e-4)
PATCH = pf.ContactPatch.disc(0.05, cells=9)
MU = 0.3
LAW = pf.LuGre(
    mu_c=MU,
    mu_s=MU,
    v_s=1e-3,
    sigma_0=1e6,
    sigma_1=20.0,
    sigma_2=0.0,
    elasto_plastic=pf.ElastoPlastic(0.9),
)


def ellipsoid(patch, law):
    return pf.ReducedModelPublished(patch, law, surface=pf.LimitSurfaceEllipsoid(patch))


def slides(count, noise=1e-4, spin=3.0, seed=0):
    """Slides at 150 samples a second, places off by `noise` [m], angles by `noise` over 3 cm, first twists by a lot."""
    random = np.random.default_rng(seed)
    model = ellipsoid(PATCH, LAW)
    result = []
    for number in range(count):
        heading = random.uniform(-np.pi, np.pi)
        speed = random.uniform(0.3, 0.7)
        twist = np.array(
            [
                speed * np.cos(heading),
                speed * np.sin(heading),
                random.uniform(-spin, spin),
            ]
        )
        time = np.arange(45) / 150.0
        pose = slide_poses(model, BODY, time, np.array([0.1, 0.2, heading, *twist]))
        off = noise * random.standard_normal(pose.shape) / [1.0, 1.0, 0.03]
        rough = twist + [0.03, -0.03, 0.3] * random.standard_normal(3)
        result.append(Slide(time, pose + off, rough, f"slide {number}"))
    return result


def test_simulated_slide_in_closed_form():
    """v t - mu g t^2/2 until v/(mu g); the spin alone stops after omega I/(mu m g r)."""
    time = np.linspace(0.0, 0.3, 31)
    poses = slide_poses(
        ellipsoid(PATCH, LAW), BODY, time, np.array([0.0, 0.0, 0.0, 0.5, 0.0, 0.0])
    )
    moving = np.minimum(time, 0.5 / (MU * 9.81))
    # Relaxed bristles let the first 2 mm/s ... of mu g sigma_1/sigma_0 go: 0.1 mm over the way.
    assert poses[:, 0] == pytest.approx(
        0.5 * moving - 0.5 * MU * 9.81 * moving**2, abs=1e-4
    )
    spun = slide_poses(
        ellipsoid(PATCH, LAW), BODY, time, np.array([0.0, 0.0, 0.0, 0.0, 0.0, 4.0])
    )
    braking = MU * BODY.mass * 9.81 * PATCH.contact_radius() / BODY.inertia
    assert spun[-1, 2] == pytest.approx(4.0**2 / (2.0 * braking), rel=5e-3)


def test_friction_and_radius_come_out():
    """Twelve noisy slides, started 25 % too high and 25 % too small: both within three standard errors."""
    guess = pf.ContactPatch.disc(0.0375, cells=9)
    start = pf.LuGre(
        mu_c=0.36, mu_s=0.36, v_s=1e-3, sigma_0=1e6, sigma_1=20.0, sigma_2=0.0
    )
    found = identify_motion(slides(12), guess, BODY, start=start, model=ellipsoid)
    assert abs(found.estimates["mu_c"] - MU) < 3.0 * found.errors["mu_c"] < 0.01 * MU
    radius = PATCH.contact_radius()
    assert (
        abs(found.estimates["contact_radius"] - radius)
        < 3.0 * found.errors["contact_radius"]
        < 0.1 * radius
    )
    assert found.law.mu_s == found.law.mu_c
    assert found.model.surface.contact_radius == pytest.approx(
        found.estimates["contact_radius"], rel=1e-9
    )
    assert found.noise[:2] == pytest.approx(1e-4, rel=0.15)
    assert len(found.plot().axes) == 6


def test_start_comes_out_of_the_first_poses():
    """Rough first twists, 3 cm/s off; ten poses of 10 um noise give the speed to 1 mm/s."""
    model = ellipsoid(PATCH, LAW)
    for slide in slides(3, noise=1e-5):
        start = fit_start(model, BODY, slide, samples=10)
        best = fit_start(model, BODY, slide)
        assert start[3:5] == pytest.approx(best[3:5], abs=1e-3)
        off = predict_slide(model, BODY, slide, samples=10) - slide.pose
        assert np.hypot(*off[-1, :2]) < 1e-3
        assert (
            np.hypot(*(predict_slide(model, BODY, slide) - slide.pose)[-1, :2]) > 1e-3
        )


def test_prediction_from_first_poses():
    found = identify_motion(
        slides(6, noise=2e-5), PATCH, BODY, start=LAW, model=ellipsoid, samples=10
    )
    assert found.estimates["mu_c"] == pytest.approx(MU, rel=0.02)


def test_what_slides_cannot_tell():
    found = identify_motion(
        slides(3, spin=0.0), PATCH, BODY, start=LAW, model=ellipsoid
    )
    assert not found.identifiable("contact_radius")
    assert "no spin" in found.table()
    assert "only 3 slides" in found.table()


def pushed(strength, begin, end, noise=1e-4):
    """A straight slide at 0.6 m/s that friction MU brakes until it stops, with a push [m/s^2] for a while."""
    fine = np.arange(0.0, 0.45, 1e-4)
    speed = 0.6
    way = np.zeros(len(fine))
    for k in range(1, len(fine)):
        way[k] = way[k - 1] + 1e-4 * speed
        speed = max(
            speed - 1e-4 * (MU * 9.81 - strength * (begin < fine[k] < end)), 0.0
        )
    time = np.arange(60) / 150.0
    pose = np.column_stack([np.interp(time, fine, way), np.zeros(60), np.zeros(60)])
    pose += (
        noise * np.random.default_rng(7).standard_normal(pose.shape) / [1.0, 1.0, 0.03]
    )
    return Slide(time, pose, name="the pushed one")


@pytest.fixture(scope="module")
def without():
    """The fit to seven of eight slides, without the fourth."""
    good = slides(8)
    return identify_motion(
        [*good[:3], *good[4:]],
        PATCH,
        BODY,
        parameters=("mu_c",),
        start=LAW,
        model=ellipsoid,
    )


@pytest.mark.parametrize(
    ("push", "reason"),
    [
        ((9.0, 0.05, 0.12), "speed grows"),
        ((2.94, 0.05, 0.25), "hardly falls"),
        ((1.5, 0.1, 0.2), "residuals are"),
    ],
)
def test_a_pushed_slide_is_named_and_changes_nothing(without, push, reason):
    """One among 8: friction as without it, to 1 % (the aim is 3 % among 30), and its reason is told."""
    good = slides(8)
    strange = [*good[:3], pushed(*push), *good[4:]]
    found = identify_motion(
        strange, PATCH, BODY, parameters=("mu_c",), start=LAW, model=ellipsoid
    )
    assert found.estimates["mu_c"] == pytest.approx(without.estimates["mu_c"], rel=0.01)
    told = [str(each) for each in found.verdicts if "the pushed one" in str(each)]
    assert any("left out" in each and reason in each for each in told), found.verdicts
    assert not any("left out" in str(each) for each in without.verdicts)
    if push[0] == 9.0:
        blind = identify_motion(
            strange,
            PATCH,
            BODY,
            parameters=("mu_c",),
            start=LAW,
            model=ellipsoid,
            loss="squares",
        )
        assert abs(blind.estimates["mu_c"] / without.estimates["mu_c"] - 1.0) > 0.03
        assert any("without the pushed one" in str(each) for each in blind.verdicts)


# ---------------------------------------------------------------------- slides that are misread


def remade(slide, time=1.0, pose=(1.0, 1.0, 1.0)):
    return Slide(time * slide.time, slide.pose * pose, name=slide.name)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (
            {"pose": (1.0, 1.0, 180.0 / np.pi)},
            r"theta of the slides must be in rad, .* % if it is in deg",
        ),
        ({"time": 1e3}, r"time of the slides must be in s, .*: is it in ms\?"),
        (
            {"pose": (1e3, 1e3, 1.0)},
            r"x and y of the slides must be in m, .*: are they in mm\?",
        ),
    ],
)
def test_units_of_slides_are_seen_before_they_are_fitted(change, words):
    """Degrees made mu 3.26 for 0.3, and milliseconds a simulation of five minutes."""
    with refused(words):
        identify_motion(
            [remade(each, **change) for each in slides(6)],
            PATCH,
            BODY,
            start=LAW,
            model=ellipsoid,
        )


def test_one_slide_in_degrees_is_doubted():
    """Few windows of one slide refuse nothing, but nothing is called identified either; in rad nothing is said."""
    turning = slides(2)[1]
    straight = slides(2)[0]
    misread = remade(turning, pose=(1.0, 1.0, 180.0 / np.pi)).first(24)
    findings = check_slides([misread], PATCH, BODY)
    assert (
        "theta of the slides should be in rad" in str(findings[0])
        and not findings[0].refuses
    )
    assert (
        check_slides([turning.first(24)], PATCH, BODY)
        == check_slides([straight.first(24)], PATCH, BODY)
        == ()
    )
    found = identify_motion(
        misread, PATCH, BODY, parameters=("mu_c",), start=LAW, model=ellipsoid
    )
    assert (
        not found.identifiable("mu_c")
        and "Theta of the slides should be in rad" in found.summary()
    )


@pytest.mark.parametrize("frozen", [(10, 17), (20, 24), (0, 7)])
def test_a_tracker_that_froze_is_named(frozen):
    bad = slides(2)
    pose = bad[1].pose.copy()
    pose[frozen[0] : frozen[1] + 1] = pose[frozen[0]]
    bad[1] = Slide(bad[1].time, pose, name="slide 1")
    words = rf"pose of slide 1 must follow the body .*no motion for {1e3 * (frozen[1] - frozen[0]) / 150:.3g} ms"
    with refused(words):
        identify_motion(bad, PATCH, BODY, start=LAW, model=ellipsoid)
    kept = np.r_[: frozen[0] + 1, frozen[1] + 1 : len(pose)]
    check_slides([Slide(bad[1].time[kept], pose[kept])], PATCH, BODY)


def test_nothing_is_found_in_slides_as_they_should_be():
    for spin, noise in ((0.0, 1e-4), (3.0, 1e-4), (10.0, 1e-3)):
        check_slides(slides(8, spin=spin, noise=noise), PATCH, BODY)
    still = slides(1)[0]
    check_slides([Slide(still.time, np.zeros_like(still.pose))], PATCH, BODY)
    coarse = [Slide(each.time, np.round(each.pose, 3)) for each in slides(8)]
    held = [Slide(each.time, each.pose[np.arange(45) // 3 * 3]) for each in slides(4)]
    check_slides([*coarse, *held], PATCH, BODY)


def test_times_that_stand_still_are_shown_with_all_digits():
    time = 1.7e9 + np.arange(45) / 150.0
    time[7] = time[6]
    with refused(r"time of slide must increase, got 1700000000\.04 after .* sample 8"):
        Slide(time, slides(1)[0].pose)


def test_noise_of_slides_counts_what_is_fitted():
    """Two slides of 10 samples, one parameter and a start of six numbers for each: 13 of 60 numbers are fitted."""
    off = [np.tile([3e-3, 1e-3, 2e-2], (10, 1)), np.tile([-1e-3, 1e-3, 4e-2], (10, 1))]
    slides = [SimpleNamespace(pose=each, time=range(10)) for each in off]
    problem = SimpleNamespace(
        slides=slides, robust=False, names=("mu_c",), poses=lambda values: [0.0, 0.0]
    )
    problem.even_sigma = lambda noise: noise
    noise, _ = SlideProblem.estimate_noise(problem, np.ones(1), np.ones((2, 3)))
    across = np.sqrt(3e-6 * 60 / 47)
    turn = np.sqrt(1e-3 * 60 / 47)  # of x and y (5e-6 + 1e-6)/2
    np.testing.assert_allclose(noise, [[across, across, turn]] * 2, rtol=1e-12)
