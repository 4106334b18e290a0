"""Sensitivities of a simulated scene: closed forms, similarity, and central differences of tight simulations."""

import dataclasses
import functools

import numpy as np
import pytest

import planarfriction as pf
from planarfriction.derivatives import (
    SCENE_PARAMETERS,
    path,
    scene_gradient,
    scene_sensitivities,
)
from planarfriction.errors import SolverError
from planarfriction.scenes import SolverOptions
from tests.support.differences import MOTION, WRENCH, assert_sensitivities
from tests.support.refusals import refused

LAW = pf.LuGre(
    mu_c=0.3,
    mu_s=0.4,
    v_s=5e-3,
    sigma_0=1e5,
    sigma_1=50.0,
    sigma_2=0.2,
    elasto_plastic=pf.ElastoPlastic(0.5),
)
NAMES = tuple(SCENE_PARAMETERS)
FACTORS = dict.fromkeys(NAMES, 1.0)
SURFACES = {"ellipsoid": pf.LimitSurfaceEllipsoid, "table": pf.LimitSurfaceTable}


def model_of(kind, mu=1.0, r=1.0, law=LAW):
    """A patch off its frame's origin, `r` times as large as it is."""
    law = dataclasses.replace(law, mu_c=mu * law.mu_c, mu_s=mu * law.mu_s)
    positions = np.array(
        [[0.01, 0.0], [-0.008, 0.009], [-0.006, -0.01], [0.002, 0.004]]
    )
    patch = pf.ContactPatch.points(r * positions, [1.0, 2.0, 1.5, 0.5])
    # Of a smooth limit surface: that of four points has facets.
    if kind == "table" or "reduced" in kind:
        patch = pf.ContactPatch.disc(r * 0.012, cells=9)
    if "reduced" in kind:
        pad = pf.Pad.at_load(2.0) if kind == "fixed reduced" else None
        return pf.ReducedModel(patch, law, cells=20, pad=pad)
    return (
        pf.DistributedModel(patch, law)
        if kind == "distributed"
        else pf.ReducedModelPublished(patch, law, surface=SURFACES[kind](patch))
    )


def slide(kind, force=True, **factors):
    """A plate that slides, stops and is pushed off again, on a pad of its own and on two of the table."""
    by = FACTORS | factors
    model = model_of(kind, by["mu"], by["r"])
    load = pf.Signal.sampled([0.0, 0.3, 0.36], by["load"] * np.array([3.0, 0.0, 2.5]))
    push = pf.Signal.sampled(
        [0.0, 0.1, 0.3], [[0.0, 0.0, 0.0], [0.2, 0.3, 2e-3], [1.5, 0.5, 1e-2]]
    )
    return pf.Scene(
        pf.Body(
            0.4 * by["mass"],
            6e-4 * by["inertia"],
            (2e-3, 1e-3),
            velocity=(0.08, 0.03, 1.5),
            gravity=(0.0, 0.0),
        ),
        [
            pf.Contact(
                model,
                load,
                position=(3e-3, 0.0),
                angle=0.3,
                mounted_on="body",
                name="own",
            ),
            pf.Contact(model, 1.0 * by["load"], count=2, name="fixed"),
        ],
        0.4,
        force=push if force else None,
        save_every=0.02,
    )


@functools.cache
def sensitivities(kind):
    return scene_sensitivities(slide(kind), NAMES)


# ---------------------------------------------------------------------- closed forms


@pytest.mark.parametrize("kind", ["distributed", "ellipsoid"])
def test_a_long_slide_slows_down_in_proportion_to_friction(kind):
    # v = v_0 - mu f_N t/m, but for the micrometres in which the bristles deflect.
    law = dataclasses.replace(LAW, mu_s=LAW.mu_c, sigma_2=0.0, sigma_1=1.0)
    body = pf.Body(0.5, 1e-3, velocity=(0.6, 0.0, 0.0), gravity=(0.0, 0.0))
    patch = pf.ContactPatch.disc(0.01, cells=5)
    surface = (
        {} if kind == "distributed" else {"surface": pf.LimitSurfaceEllipsoid(patch)}
    )
    model = (pf.ReducedModelPublished if surface else pf.DistributedModel)(
        patch, law, **surface
    )
    scene = pf.Scene(
        body, [pf.Contact(model, 5.0, mounted_on="body")], 0.1, save_every=0.05
    )
    found = scene_sensitivities(scene, ("mu", "mass", "load", "r"))
    lost = 0.3 * 5.0 / 0.5 * 0.1
    # 1e-5 of the velocity is lost while the bristles deflect
    assert found.d_motion[-1, 0] == pytest.approx([-lost, lost, -lost, 0.0], abs=3e-5)
    assert found.d_motion[-1, 3] == pytest.approx(
        0.05 * np.array([-lost, lost, -lost, 0.0]), abs=3e-6
    )
    assert found.d_wrenches[-1, 0, 0] == pytest.approx([-1.5, 0.0, -1.5, 0.0], abs=1e-6)


@pytest.mark.parametrize("kind", ["distributed", "ellipsoid"])
def test_wrenches_at_a_given_velocity_are_proportional_to_the_load(kind):
    scene = pf.scenes.driven(model_of(kind), t_end=0.5)
    found = scene_sensitivities(scene, ("load", "mass", "mu"))
    largest = np.abs(found.wrenches).max(axis=(0, 1))
    assert np.abs(found.d_wrenches[..., 0] - found.wrenches).max(
        axis=(0, 1)
    ) == pytest.approx(0.0 * largest, abs=1e-12)
    assert np.abs(found.d_motion).max() == np.abs(found.d_wrenches[..., 1]).max() == 0.0
    assert np.abs(found.d_wrenches[..., 2]).max() > 0.1 * largest.max()


def test_a_fast_spin_has_a_torque_proportional_to_the_size():
    model = model_of("table", law=dataclasses.replace(LAW, sigma_2=0.0))
    scene = pf.scenes.driven(
        model, twist=pf.Signal.constant([0.0, 0.0, 50.0]), t_end=0.05
    )
    found = scene_sensitivities(scene, ("r", "mu"))
    assert found.d_wrenches[-1, 0, 2] == pytest.approx(
        found.wrenches[-1, 0, 2] * np.ones(2), rel=1e-6
    )


# ---------------------------------------------------------------------- similarity, agreement


@pytest.mark.parametrize("kind", ["distributed", "table"])
def test_only_the_ratio_of_load_and_mass_counts_without_other_forces(kind):
    found = scene_sensitivities(
        slide(kind, force=False),
        ("mass", "inertia", "load"),
        options=SolverOptions(t_end=0.2),
    )
    total = np.abs(found.d_motion.sum(axis=-1)).max(axis=0)
    assert (
        total < 1e-9 * np.abs(found.d_motion).max(axis=(0, 2))
    ).all()  # sums of three numbers, stiff ones among them


@pytest.mark.parametrize("kind", ["distributed", "table"])
def test_motion_and_wrenches_are_those_of_simulate(kind):
    found = sensitivities(kind)
    data = pf.simulate(slide(kind), rtol=1e-9, atol=1e-9).data
    assert found.time == pytest.approx(data.time.values, abs=1e-12)
    for i, name in enumerate(MOTION):
        assert found.motion[:, i] == pytest.approx(
            data[name].values, abs=1e-7 * np.abs(data[name].values).max()
        )
    for i, name in enumerate(WRENCH):
        assert found.wrenches[..., i] == pytest.approx(
            data[name].values, abs=1e-5 * np.abs(data[name].values).max()
        )


def test_a_part_of_the_motion_at_a_time_gives_the_same(monkeypatch):
    """Parts of sixteen nodes: steps of the derivatives end elsewhere, which moves them by less than their accuracy."""
    whole = sensitivities("ellipsoid")
    monkeypatch.setattr(path, "NUMBERS", 1.0)
    parts = scene_sensitivities(slide("ellipsoid"), NAMES)
    assert parts.motion == pytest.approx(whole.motion, abs=1e-9)
    largest = np.abs(whole.d_motion).max(axis=0)
    assert (np.abs(parts.d_motion - whole.d_motion).max(axis=0) <= 1e-5 * largest).all()


@pytest.mark.parametrize(
    ("kind", "h", "rtol"),
    [
        ("distributed", 1e-4, 1e-5),
        ("ellipsoid", 1e-4, 1e-5),
        ("table", 1e-5, 1e-4),
        ("reduced", 1e-4, 1e-5),
        ("fixed reduced", 2e-5, 1e-4),
    ],
)
def test_derivatives_are_central_differences(kind, h, rtol):
    """Through sliding, a stop, a contact that loses its load, and a new slip.

    The Jacobian of a table jumps from cell to cell, so that differences are off by a share of their step; the smaller
    step has more rounding. Bristles of a pad that a falling load brings back are stiffer, and its damping has kinks.
    """
    found = sensitivities(kind)
    for p, name in enumerate(NAMES):

        def changed(by, name=name):
            return slide(kind, **{name: by})

        # and 1e-13 m of rounding in each run
        assert_sensitivities(found, p, changed, 1.0, h, rtol, 1e-13 / h)


def test_derivatives_end_where_a_slide_stops():
    model = model_of(
        "ellipsoid", law=dataclasses.replace(LAW, mu_s=LAW.mu_c, sigma_2=0.0)
    )
    scene = pf.scenes.free_slide(model, mass=0.4, inertia=6e-4, twist=(0.2, 0.0, 1.0))
    found = scene_sensitivities(scene, ("mu",))
    data = pf.simulate(scene, rtol=1e-8, atol=1e-8).data
    assert found.time[-1] == pytest.approx(data.time.values[-1], rel=1e-3)
    distance = found.motion[-1, 3] - found.motion[0, 3]
    # v^2/(2 mu g), nearly: speed and spin fall together
    assert found.d_motion[-1, 3, 0] == pytest.approx(-distance, rel=0.02)


def test_derivatives_end_after_max_steps_and_before_memory_does(monkeypatch):
    scene = slide("ellipsoid")
    few = SolverOptions(max_steps=25)
    for derivatives_of in (lambda o: scene_sensitivities(scene, ("mu",), options=o),
                           lambda o: scene_gradient(scene, lambda _, motion: motion, ("mu",), options=o)):  # fmt: skip
        with refused(
            "max_steps steps were taken before the end: raise it", SolverError
        ):
            derivatives_of(few)
        derivatives_of(SolverOptions(max_steps=100_000))
    monkeypatch.setattr("planarfriction.derivatives.path.MOST_KEPT", 1000)
    with refused(r"the path has more than [0-9]+ steps", SolverError):
        scene_gradient(scene, lambda _, motion: motion, ("mu",))


def test_wrong_input_is_named():
    scene = slide("ellipsoid")
    with refused("parameters must be one of mu, r, mass, inertia, load"):
        scene_sensitivities(scene, ("my",))
    with refused(r"t_end must be at most the scene's 0\.4 s"):
        scene_sensitivities(scene, options=SolverOptions(t_end=1.0))
    with refused("rtol must be > 0"):
        scene_sensitivities(scene, options=SolverOptions(rtol=0.0))
    with refused("scene must be a Scene"):
        scene_sensitivities("in-hand")
