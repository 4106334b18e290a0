"""Plain data keep every bit: files, digests and caches rely on it."""

import dataclasses
import json

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

import planarfriction as pf
from tests.support.files import again

checked = settings(deadline=None, max_examples=20)
seeds = st.integers(0, 2**32 - 1)


def maps(random, count):
    """Maps of one size with empty cells, each at its own scale."""
    empty = random.random((4, 7)) < random.random()
    empty[2, 3] = False
    scales = 10.0 ** random.uniform(-300.0, 300.0, count)
    return [
        scale
        * np.where(empty & (random.random((4, 7)) < 0.9), 0.0, random.random((4, 7)))
        for scale in scales
    ]


def patches(seed):
    """One patch of each kind, all their numbers random."""
    random = np.random.default_rng(seed)
    sizes = random.uniform(1e-3, 0.1, 2)
    loads = np.cumsum(random.uniform(0.1, 2.0, 3))
    star = random.uniform(0.005, 0.02, 7)[:, None] * [
        (np.cos(a), np.sin(a)) for a in np.arange(7.0) * 0.9
    ]
    lean = random.uniform(-0.5, 0.5, 2)
    grains = np.array(
        [pf.friction_metric(*numbers) for numbers in random.uniform(0.5, 1.5, (12, 3))]
    )
    over_load = pf.ContactPatch.from_pressure(
        maps(random, 3), tuple(sizes), loads=loads
    )
    grid = pf.ContactPatch.rectangle(*sizes, (4, 3), pressure=random.random(12) + 0.1)
    soft = pf.SoftFinger(
        c=sizes[0], n=random.uniform(0.1, 0.5), k_per_newton=random.uniform(0.5, 3.0)
    )
    return [
        over_load,
        over_load.refined(2),
        over_load.with_friction_metric(
            pf.friction_metric(*random.uniform(0.5, 1.5, 3)), lean
        ),
        pf.ContactPatch.from_pressure(maps(random, 1)[0], sizes[0]),
        pf.ContactPatch.from_pressure(maps(random, 1), sizes[0], loads=[1.0]),
        pf.ContactPatch.disc(sizes[0], 9, pressure=soft),
        pf.ContactPatch.disc(
            sizes[0],
            21,
            pressure=pf.LinearGradient(random.uniform(-0.6, 0.6, 2) / sizes[0]),
        ),
        pf.ContactPatch.ring(*np.sort(sizes), 11),
        pf.ContactPatch.polygon(star, 9),
        pf.ContactPatch.line(sizes[0], 8, profile=lambda y: 1.0 + abs(y)),
        pf.ContactPatch.points(
            random.normal(0.0, 0.05, (5, 2)), random.random(5) + 0.01
        ),
        grid.with_friction_metric(grains, random.uniform(-0.5, 0.5, (12, 2))),
        grid.with_friction_metric(None, lean),
        dataclasses.replace(grid, radii=random.choice([0.0, 0.3, 1.0], 12) * sizes[0]),
    ]


def numbers(patch):
    """All that models and surfaces take from a patch."""
    load = 1.05 if patch.depends_on_load else None
    return [
        *(
            patch.weights(load),
            patch.positions,
            patch.areas,
            patch.cell_extents(),
            patch.levers(),
            patch.asymmetries(),
        ),
        *(
            patch.centre_of_pressure(load),
            np.array([patch.contact_radius(load), patch.second_moment(load)]),
        ),
    ]


@given(seeds)
@checked
def test_patches(seed):
    for patch in patches(seed):
        data = patch.to_dict()
        read = pf.ContactPatch.from_dict(json.loads(json.dumps(data)))
        assert read.to_dict() == data, patch
        for first, second in zip(numbers(patch), numbers(read), strict=True):
            np.testing.assert_array_equal(first, second, err_msg=repr(patch))


@given(seeds)
@checked
def test_scenes_and_their_digests(seed):
    random = np.random.default_rng(seed)
    patch = patches(seed)[seed % 14]
    law = pf.LuGre(
        *(random.uniform(0.5, 1.0) * np.array([1.0, 1.3, 1e-3, 2.0, 1e6, 8e2, 0.2]))
    )
    force = pf.Signal(
        np.cumsum(random.random(6)),
        random.normal(size=(6, 3)),
        random.choice(["previous", "linear"]),
    )
    body = pf.Body(
        random.random() + 0.1,
        random.random() + 0.1,
        random.normal(size=2),
        random.normal(),
    )
    contact = pf.Contact(
        pf.DistributedModel(patch, law),
        pf.Signal.sine(2.0, random.random(), 3.0, t_end=0.3),
    )
    scene = pf.Scene(body, [contact], t_end=random.random() + 0.1, force=force)
    read = pf.Scene.from_dict(json.loads(scene.to_json()))
    assert read.to_json() == scene.to_json() and read.digest() == scene.digest()


@given(seed=seeds)
@settings(deadline=None, max_examples=5)
def test_files(tmp_path_factory, seed):
    folder = tmp_path_factory.mktemp("scene")
    for patch in patches(seed):
        again(pf.scenes.in_hand(pf.DistributedModel(patch, pf.LuGre())), folder)
