"""Scenes: what makes one, what does not, and the ready scenes against the description of the experiments."""

import dataclasses
import re
from types import SimpleNamespace

import numpy as np
import pytest

import planarfriction as pf
from planarfriction import (
    Body,
    Contact,
    ContactPatch,
    FrictionError,
    LuGre,
    Scene,
    Signal,
)
from planarfriction.patch import PUBLISHED_PATCHES
from planarfriction.scenes import (
    drift,
    driven,
    free_slide,
    in_hand,
    in_hand_load,
    published_velocity,
)
from tests.support.refusals import refused

ROUNDING = 1e-14  # a few roundings of numbers of order one


def stand_in(patch=None):
    """Return a stand-in for a model with its parts alone, all that a scene needs."""
    return SimpleNamespace(
        patch=patch or ContactPatch.points([[0.0, 0.0], [1.0, 0.0]]),
        law=LuGre(mu_s=1.2),
        surface=None,
    )


def a_scene(**changes):
    parts = {
        "body": Body(1.0, 1.0),
        "contacts": [Contact(stand_in(), 1.0)],
        "t_end": 1.0,
    }
    return Scene(**{**parts, **changes})


# ---------------------------------------------------------------------- what makes a scene


def test_a_scene_keeps_its_parts_and_makes_signals_of_numbers():
    model = stand_in()
    contact = Contact(
        model, 3, mounted_on="body", position=[0.1, 0.2], angle=1, count=2, name="pad"
    )
    assert contact.model is model
    assert contact.normal_force == Signal.constant(3.0)
    assert (contact.position, contact.angle, contact.count) == ((0.1, 0.2), 1.0, 2)
    scene = a_scene(contacts=[contact], force=[1.0, 2.0, 3.0])
    assert scene.contacts == (contact,)
    assert scene.force == Signal.constant([1.0, 2.0, 3.0])
    assert dataclasses.replace(scene, t_end=2).t_end == 2.0


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: a_scene(t_end=0), "t_end must be > 0, got 0.0"),
        (lambda: a_scene(save_every=-1), "save_every must be > 0, got -1.0"),
        (
            lambda: a_scene(contacts=[]),
            "contacts must hold at least one contact, got none",
        ),
        (
            lambda: a_scene(contacts=[Contact(stand_in(), 1.0)] * 2),
            "contacts must have different names, got 'contact'",
        ),
        (lambda: a_scene(contacts=[stand_in()]), "contacts must be a list of Contact"),
        (lambda: a_scene(body=1.0), "body must be a Body, got 1.0"),
        (
            lambda: a_scene(velocity=Signal.constant([1.0, 2.0])),
            "velocity must have 3 columns",
        ),
        (lambda: a_scene(velocity=1.0), "velocity must have 3 columns"),
        (lambda: a_scene(force=[1.0, 2.0]), "force must have 3 columns"),
        (
            lambda: a_scene(velocity=[0, 0, 1], force=[0, 0, 1]),
            "force must be None if the velocity is prescribed",
        ),
        (
            lambda: a_scene(velocity=[0, 0, 1], stop_speed=1),
            "stop_speed must be None if the velocity is prescribed",
        ),
        (lambda: a_scene(stop_speed=0), "stop_speed must be > 0"),
        (lambda: Body(0, 1), "mass must be > 0, got 0.0"),
        (lambda: Body(1, float("nan")), "inertia must be finite, got nan"),
        (
            lambda: Body(1, 1, position=(1, 2, 3)),
            "position must have shape [2], got shape [3]",
        ),
        (
            lambda: Body(1, 1, outline=[[0, 0], [1, 1]]),
            "outline must have at least 3 points, got 2",
        ),
        (
            lambda: Contact(3, 1.0),
            "model of contact 'contact' must be a friction model",
        ),
        (
            lambda: Contact(stand_in(), -2.0),
            "normal_force of contact 'contact' must be >= 0, got -2.0 at t = 0 s",
        ),
        (
            lambda: Contact(
                stand_in(), Signal.sampled([0, 0.5], [1.0, -0.1]), name="toe"
            ),
            "normal_force of contact 'toe' must be >= 0, got -0.1 at t = 0.5 s",
        ),
        (
            lambda: Contact(stand_in(), [1.0, 2.0]),
            "normal_force of contact 'contact' must be a number, or a Signal of numbers",
        ),
        (
            lambda: Contact(stand_in(), "heavy"),
            "normal_force of contact 'contact' must be a number, or a Signal of numbers",
        ),
        (
            lambda: Contact(stand_in(), 1.0, mounted_on="wrld"),
            "(did you mean 'world'?)",
        ),
        (
            lambda: Contact(stand_in(), 1.0, count=0),
            "count of contact 'contact' must be an integer >= 1, got 0",
        ),
        (
            lambda: Contact(stand_in(), 1.0, name=""),
            "name of a contact must be a text that is not empty",
        ),
    ],
)
def test_what_is_no_scene_gets_one_line(make, message):
    with refused(re.escape(message), FrictionError):
        make()


def test_breaks_are_those_of_all_signals_and_rounding_makes_no_new_ones():
    steps = np.arange(1, 10)
    load = Signal.sampled(steps * 0.1, 1.0 + steps)
    force = Signal.sampled(np.cumsum(np.full(9, 0.1)), np.outer(steps, [1.0, 0.0, 0.0]))
    assert (load.times != force.times).any()
    scene = a_scene(contacts=[Contact(stand_in(), load)], force=force)
    # SAME_TIME.
    assert scene.breaks() == pytest.approx([0.0, *(steps[1:] * 0.1), 1.0], abs=1e-12)
    assert scene.breaks(0.45) == pytest.approx([0.0, 0.2, 0.3, 0.4, 0.45], abs=1e-12)
    assert a_scene().breaks().tolist() == [0.0, 1.0]
    for signal in (load, force):
        signal.pieces(scene.breaks())


# ---------------------------------------------------------------------- in-hand


def test_in_hand_is_the_published_experiment():
    model = stand_in()
    scene = in_hand(model)
    body = scene.body
    (fingers,) = scene.contacts
    assert body.mass == 0.2
    # Printed with seven digits.
    assert body.inertia == pytest.approx(4.816667e-4, rel=1e-6)
    assert (body.position, body.velocity, body.gravity) == (
        (0.002, 0.0),
        (0.0, 0.0, 0.0),
        (0.0, -9.81),
    )
    assert body.outline.min(axis=0).tolist() == [-0.075, -0.04]
    assert body.outline.max(axis=0).tolist() == [0.075, 0.04]
    assert fingers.model is model
    assert (fingers.mounted_on, fingers.position, fingers.count) == (
        "world",
        (0.0, 0.0),
        2,
    )
    assert (scene.t_end, scene.force, scene.velocity, scene.stop_speed) == (
        2.0,
        None,
        None,
        None,
    )
    t = np.arange(200) * 0.01
    expected = 1.73 + 0.91 * np.sin(4 * np.pi * t)
    assert np.abs(fingers.normal_force(t) - expected).max() < ROUNDING
    # Held to the end of each sample.
    assert np.abs(fingers.normal_force(t + 0.0099) - expected).max() < ROUNDING


def test_in_hand_takes_its_options():
    load = in_hand_load(2)
    scene = in_hand(
        stand_in(),
        centre_of_mass=(0.025, 0),
        normal_force=load,
        fingers=3,
        mass=0.6,
        size=(0.3, 0.1),
        t_end=1,
    )
    assert scene.contacts[0].normal_force == load
    assert scene.contacts[0].count == 3
    assert scene.body.inertia == pytest.approx(0.6 / 12 * (0.09 + 0.01), rel=1e-15)
    assert scene.body.position == (0.025, 0.0)
    assert scene.t_end == 1.0
    assert in_hand(stand_in(), normal_force=2.5).contacts[
        0
    ].normal_force == Signal.constant(2.5)


@pytest.mark.parametrize(
    ("placement", "high", "low", "first"), [(1, 2.0, 0.84, 33), (2, 4.0, 2.9, 31)]
)
def test_in_hand_load_2_drops_for_the_published_samples(placement, high, low, first):
    samples = np.arange(201)
    expected = np.where((samples >= first) & (samples <= 49), low, high)
    assert (
        in_hand_load(2, placement=placement)(samples * 0.01).tolist()
        == expected.tolist()
    )
    assert in_hand_load(2, placement=placement).breaks.tolist() == [first * 0.01, 0.5]


def test_in_hand_load_1_of_the_second_placement():
    t = np.arange(201) * 0.01
    expected = 3.6 + 0.9 * np.sin(4 * np.pi * t)
    assert np.abs(in_hand_load(1, placement=2)(t) - expected).max() < ROUNDING


def test_in_hand_load_refuses_others():
    with refused("each be 1 or 2, got load=3, placement=1", FrictionError):
        in_hand_load(3)


# ---------------------------------------------------------------------- drift


def test_drift_is_a_disc_on_a_level_table():
    scene = drift(stand_in())
    assert (scene.body.mass, scene.body.inertia, scene.body.gravity) == (
        1.0,
        pytest.approx(1.25e-3),
        (0.0, 0.0),
    )
    assert scene.contacts[0].mounted_on == "world"
    assert scene.contacts[0].normal_force == Signal.constant(9.81)
    assert scene.t_end == 5.0


def test_tangential_drift_forces():
    force = drift(stand_in()).force
    fx, fy, tau = force(
        np.array([0, 10, 20, 50, 100, 108, 280, 290, 300, 308]) * 0.01
    ).T
    late = [np.sin(6 * np.pi * t) for t in (1.08, 2.8, 2.9, 3.0, 3.08)]
    assert fx == pytest.approx(
        [0.0, 0.5, 1.0, 1.0, 1.0, *(1 + 0.4 * w for w in late)], abs=ROUNDING
    )
    assert not fy.any()
    assert tau == pytest.approx(
        [0, 0, 0, 0, 0, 0, 0, 0.015, 0.03, 0.03 + 0.01 * late[-1]], abs=ROUNDING
    )
    assert force(0.0199).tolist() == force(0.01).tolist()


def test_normal_drift_forces():
    scene = drift(stand_in(), load="normal", t_end=3.0)
    assert scene.force([0.1, 0.2, 2.0]) == pytest.approx(
        np.outer([0.5, 1.0, 1.0], [1.0, 0.0, 0.03]), abs=ROUNDING
    )
    load = scene.contacts[0].normal_force
    assert load([0.5, 1.0, 1.08]) == pytest.approx(
        [9.81, 9.81, 9.81 + np.sin(6 * np.pi * 1.08)], abs=ROUNDING
    )
    with refused("did you mean 'normal'", FrictionError):
        drift(stand_in(), load="nomral")


# ---------------------------------------------------------------------- free slide, driven


def test_free_slide_carries_its_patch_and_stops():
    scene = free_slide(stand_in(), mass=0.37, inertia=8.1e-4, twist=(0.5, 0.1, 3.0))
    assert scene.body.velocity == (0.5, 0.1, 3.0)
    assert scene.body.gravity == (0.0, 0.0)
    assert scene.contacts[0].mounted_on == "body"
    assert float(scene.contacts[0].normal_force(0.0)) == pytest.approx(
        0.37 * 9.81, rel=1e-15
    )
    assert scene.stop_speed > 0.0
    assert free_slide(
        stand_in(), mass=1, inertia=1, twist=(1, 0, 0), normal_force=2
    ).contacts[0].normal_force == Signal.constant(2.0)


def test_published_velocity_at_its_corners():
    c = 0.015
    t = (
        np.array([0, 30, 60, 80, 110, 140, 160, 220, 240, 270, 370, 430, 460, 480])
        * 0.01
    )
    vx, vy, omega = published_velocity()(t).T
    assert vx == pytest.approx(
        [0, 0, 0, 0, c / 2, c, c, 0, 0, 0, 0, 0, 0, 0], abs=ROUNDING
    )
    assert vy == pytest.approx([0] * 9 + [0.4 * c] * 3 + [0, 0], abs=ROUNDING)
    assert omega == pytest.approx(
        [0, 0.5, 1, 1, 1, 1, 1, 1, 1, 1, 0.5, 0, 0, 0], abs=ROUNDING
    )
    assert published_velocity()(0.019).tolist() == published_velocity()(0.01).tolist()
    assert published_velocity(speed=0.03, spin=2.0)(1.5).tolist() == [0.03, 0.0, 2.0]


def test_driven_puts_the_named_point_where_the_velocity_is():
    patch = PUBLISHED_PATCHES["LineGrad"]()
    scene = driven(stand_in(patch))
    assert scene.velocity == published_velocity()
    assert scene.contacts[0].mounted_on == "body"
    # Printed with seven digits.
    assert scene.contacts[0].position == pytest.approx((0.0, -3.174603e-3), abs=5e-10)
    assert driven(stand_in(patch), at="origin").contacts[0].position == (0.0, 0.0)
    assert driven(stand_in(patch), twist=(0, 0, 1)).velocity == Signal.constant(
        [0.0, 0.0, 1.0]
    )
    with refused("did you mean 'origin'", FrictionError):
        driven(stand_in(patch), at="orgin")


# ---------------------------------------------------------------------- plain data, digests


def every_model():
    patch = ContactPatch.disc(0.01, 7)
    law = LuGre(mu_s=1.2, elasto_plastic=pf.ElastoPlastic(0.9))
    soft = ContactPatch.disc(
        0.01, 7, pressure=pf.SoftFinger(c=0.005, n=1 / 3, k=2.0, radius_max=0.01)
    )
    fixed = ContactPatch.disc(0.01, 7, pressure=pf.SoftFinger(c=0.01, k=2.0))
    return {
        "distributed": pf.DistributedModel(patch, law),
        "plain": pf.DistributedModel(
            ContactPatch.from_pressure([[1.0, 2.0], [0.1, 0.0]], 1 / 3), LuGre(mu_s=1.2)
        ),
        "published": pf.ReducedModelPublished(patch, law),
        "table": pf.ReducedModelPublished(
            patch, law, surface=pf.LimitSurfaceTable(patch, segments=8)
        ),
        "ellipsoid": pf.ReducedModelPublished(
            patch, law, surface=pf.LimitSurfaceEllipsoid(patch)
        ),
        "soft": pf.ReducedModelPublished(soft, law),
        "rescaled": pf.ReducedModelPublished(
            soft,
            law,
            surface=pf.LimitSurfaceTablePublished(soft, 6, normal_force=100.0),
            on_load_change="rescale",
        ),
        "other patch": pf.ReducedModelPublished(
            patch, law, surface=pf.LimitSurfaceCells(fixed)
        ),
    }


@pytest.mark.parametrize("name", every_model())
def test_scenes_round_trip_through_plain_data(name):
    model = every_model()[name]
    for scene in (
        in_hand(model),
        drift(model, load="normal"),
        driven(model, twist=(1 / 3, 0, 1)),
    ):
        again = Scene.from_dict(scene.to_dict())
        assert again.to_dict() == scene.to_dict()
        assert again.digest() == scene.digest()
        assert type(again.contacts[0].model) is type(model)
    if hasattr(model, "surface"):
        twist = (0.01, 0.02, 3.0)
        surface = again.contacts[0].model.surface
        assert type(surface) is type(model.surface)
        if surface.normal_force is not None or not surface.patch.depends_on_load:
            assert (
                surface.wrench(twist).tolist() == model.surface.wrench(twist).tolist()
            )


def test_digests_tell_scenes_apart():
    model = every_model()["distributed"]
    scenes = [
        in_hand(model),
        in_hand(model, normal_force=2.0),
        in_hand(model, centre_of_mass=(0.002, 1e-17)),
        in_hand(dataclasses.replace(model, law=LuGre(mu_s=1.2))),
        drift(model),
    ]
    assert len({scene.digest() for scene in scenes}) == len(scenes)
    assert in_hand(model).digest() == scenes[0].digest()


def test_only_models_of_the_library_have_a_written_form():
    with refused("to be written to a file, got SimpleNamespace", FrictionError):
        in_hand(stand_in()).to_dict()


def test_a_prescribed_velocity_needs_no_body():
    contact = Contact(
        pf.DistributedModel(ContactPatch.disc(0.01, cells=3), LuGre()), 1.0
    )
    table = a_scene(contacts=contact, velocity=[0.1, 0.0, 0.0]).to_dict()
    del table["body"]
    scene = pf.Scene.from_dict(table)
    assert (
        pf.Scene(None, scene.contacts, scene.t_end, velocity=[0.1, 0.0, 0.0]).body
        == scene.body
    )
    with refused("body must be a Body, got None", FrictionError):
        a_scene(body=None)
