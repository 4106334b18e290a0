"""Laws beside LuGre: closed forms of one bristle, with a patch and without; what models take and what they refuse."""

import math

import numpy as np
import pytest

import planarfriction as pf
from planarfriction.derivatives import rollout, rollout_jacobian
from tests.support.contacts import lengths
from tests.support.differences import (
    assert_rate_jacobians,
    assert_step_jacobians,
    differences,
)
from tests.support.refusals import refused

POINT = pf.ContactPatch.points([(0.0, 0.0)])
DISC = pf.ContactPatch.disc(0.01, 7)
GROOVED = DISC.with_friction_metric([[1.2, 0.1], [0.1, 0.9]])
LOAD = 3.0
DAHL = pf.Dahl(mu_c=0.4, sigma_0=2e4)
CREEPING = pf.CoulombStribeck(
    mu_c=0.5,
    mu_s=0.7,
    v_s=2e-3,
    gamma=1.5,
    sigma_2=0.3,
    creep_speed=1e-4,
    relaxation_time=5e-3,
)
SIMPLE = pf.CoulombStribeck(mu_c=0.5, creep_speed=1e-4, relaxation_time=5e-3)
LAWS = {
    "LuGre": pf.LuGre(
        mu_c=0.6, mu_s=0.9, v_s=2e-3, sigma_0=1e5, sigma_1=300.0, sigma_2=0.4
    ),
    "elasto-plastic": pf.LuGre(
        mu_c=0.6, sigma_0=1e5, sigma_1=300.0, elasto_plastic=0.8
    ),
    "Dahl": DAHL,
    "CoulombStribeck": CREEPING,
}
every_law = pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)


def held(model, velocity, time, steps, state=None):
    """State and wrench after `time` [s] at a held velocity along x."""
    state = model.rest() if state is None else state
    for _ in range(steps):
        state, wrench = model.step(state, (velocity, 0.0, 0.0), LOAD, time / steps)
    return state, wrench


# ---------------------------------------------------------------------- defaults


def test_static_friction_is_that_of_sliding_unless_given():
    assert pf.LuGre(mu_c=0.3).mu_s == 0.3 and pf.LuGre().mu_s == 1.0
    assert pf.CoulombStribeck(mu_c=0.3).mu_s == 0.3
    assert pf.LuGre(mu_c=0.3) == pf.LuGre(mu_c=0.3, mu_s=0.3)


def test_a_number_is_a_breakaway_ratio():
    assert pf.LuGre(elasto_plastic=0.9) == pf.LuGre(
        elasto_plastic=pf.ElastoPlastic(0.9)
    )
    assert pf.LuGre(elasto_plastic=0).elasto_plastic == pf.ElastoPlastic(0.0)


# ---------------------------------------------------------------------- closed forms


@pytest.mark.parametrize("steps", [1, 7])
def test_dahl_from_rest_is_an_exponential_of_the_way(steps):
    """`f = mu (1 - exp(-sigma_0 x / mu))`, however fast."""
    for speed in (1e-6, 1.0):
        for way in (1e-6, 2e-5, 1e-3):
            _, wrench = held(
                pf.DistributedModel(POINT, DAHL), speed, way / speed, steps
            )
            expected = 0.4 * LOAD * -math.expm1(-2e4 * way / 0.4)
            assert -wrench[0] == pytest.approx(expected, rel=1e-13)  # rounding


def test_dahl_moved_to_and_fro_closes_its_loop():
    """After a way back of x from full deflection: `f = mu (2 exp(-sigma_0 x / mu) - 1)`."""
    model = pf.DistributedModel(POINT, DAHL)
    state, _ = held(model, 0.1, 1.0, 1)
    _, wrench = held(model, -0.1, 1e-4, 3, state)
    # Rounding.
    assert -wrench[0] == pytest.approx(
        0.4 * LOAD * (2.0 * math.exp(-2e4 * 1e-5 / 0.4) - 1.0), rel=1e-12
    )


def test_regularised_coulomb_is_the_curve_over_speed():
    speed = np.array([1e-6, 1e-4, 1e-3, 1e-2, 1.0])
    g = 0.5 + 0.2 * np.exp(-((speed / 2e-3) ** 1.5))
    expected = g * speed / (speed + 1e-4) + 0.3 * speed
    assert CREEPING.steady_friction(speed) == pytest.approx(expected, rel=1e-15)
    for v, friction in zip(speed, expected, strict=True):
        # 200 relaxation times.
        _, wrench = held(pf.DistributedModel(POINT, CREEPING), v, 1.0, 1)
        assert -wrench[0] == pytest.approx(friction * LOAD, rel=1e-12)  # rounding


def test_regularised_coulomb_relaxes_at_rest_within_its_time():
    model = pf.DistributedModel(POINT, CREEPING)
    state, before = held(model, 0.1, 1.0, 1)
    _, after = held(model, 0.0, 5e-3, 4, state)
    viscous = 0.3 * 0.1 * LOAD
    # Rounding.
    assert after[0] / (before[0] + viscous) == pytest.approx(math.exp(-1.0), rel=1e-13)


def creeping_block(share):
    """A block on a disc, pushed with a share of what it can hold."""
    model = pf.DistributedModel(DISC, SIMPLE)
    force = pf.Signal.constant([share * 0.5 * LOAD, 0.0, 0.0])
    body = pf.Body(0.1, 1e-5, gravity=(0.0, 0.0))
    return pf.Scene(
        body, [pf.Contact(model, LOAD, mounted_on="body")], 0.2, force=force
    )


@pytest.mark.parametrize("share", [0.2, 0.6, 0.9])
def test_regularised_coulomb_creeps_under_a_held_force(share):
    """`v = v_c F/(mu f_N - F)`"""
    data = pf.simulate(creeping_block(share), rtol=1e-8).data
    # Of the solver.
    assert float(data.vx[-1]) == pytest.approx(1e-4 * share / (1.0 - share), rel=1e-4)


def test_the_creep_of_a_scene_has_the_slope_of_its_closed_form():
    """`dv/d(log mu) = -v_c F mu f_N/(mu f_N - F)^2`"""
    found = pf.derivatives.scene_sensitivities(creeping_block(0.6), ("mu", "load"))
    # Of the solver.
    assert found.d_motion[-1, 0] == pytest.approx(-1e-4 * 0.6 / 0.4**2, rel=1e-4)


# ---------------------------------------------------------------------- one bristle without a patch


@every_law
def test_a_single_bristle_is_a_patch_of_one_cell(law):
    model = pf.DistributedModel(POINT, law)
    rng = np.random.default_rng(0)
    z = law.largest_deflection * rng.normal(size=(20, 2))
    v = 1e-3 * rng.normal(size=(20, 2))
    twist = np.concatenate([v, np.zeros((20, 1))], axis=1)
    wide = z[..., None]
    # Rounding.
    assert law.rate(z, v, axis=-1) == pytest.approx(
        model.rate(wide, twist, LOAD)[..., 0], rel=1e-12
    )
    assert law.force(z, v, LOAD, axis=-1) == pytest.approx(
        model.wrench(wide, twist, LOAD)[:, :2], rel=1e-12
    )


@every_law
def test_a_bristle_on_a_line_is_one_in_the_plane_that_keeps_to_it(law):
    z = law.largest_deflection * np.array([-0.9, 0.0, 0.5, 0.95])
    v = np.array([1e-3, 1e-4, -2e-3, 5e-2])
    flat = np.zeros(4)
    plane = law.force(
        np.stack([z, flat]), np.stack([v, flat]), np.full(4, LOAD), axis=0
    )
    # Rounding.
    assert (
        law.force(z, v, LOAD) == pytest.approx(plane[0], rel=1e-13)
        and not plane[1].any()
    )
    assert law.rate(z, v) == pytest.approx(
        law.rate(np.stack([z, flat]), np.stack([v, flat]), axis=0)[0], rel=1e-13
    )


@every_law
def test_steady_friction_is_where_the_bristle_stays(law):
    speed = np.array([1e-5, 1e-3, 0.1])
    deflection = (
        law.steady_friction(speed) - law.numbers.sigma_2 * speed
    ) / law.numbers.sigma_0
    # Rounding of speeds up to 0.1 m/s.
    assert np.abs(law.rate(deflection, speed)).max() < 1e-13
    assert law.force(deflection, speed, LOAD) == pytest.approx(
        -LOAD * law.steady_friction(speed), rel=1e-9
    )


# ---------------------------------------------------------------------- models


def model_of(kind, law):
    if kind == "reduced-published":
        return pf.ReducedModelPublished(
            DISC, law, surface=pf.LimitSurfaceEllipsoid(DISC)
        )
    return pf.DistributedModel(GROOVED if kind == "grooved" else DISC, law)


@pytest.mark.parametrize("law", [DAHL, CREEPING], ids=["Dahl", "CoulombStribeck"])
@pytest.mark.parametrize("kind", ["distributed", "grooved", "reduced-published"])
def test_models_of_other_laws_have_the_slopes_of_their_differences(kind, law):
    model = model_of(kind, law)
    rng = np.random.default_rng(1)
    # the third state of the published model is a moment
    scale = law.largest_deflection * lengths(model)
    state = 0.5 * scale * rng.normal(size=model.state_shape)
    twist = np.array([1e-3, -5e-4, 0.2])
    by_twist = np.array([1e-8, 1e-8, 1e-6])
    assert_rate_jacobians(model, state, twist, LOAD, 1e-5 * scale, by_twist)
    assert_step_jacobians(model, state, twist, LOAD, 2e-3, 1e-5 * scale, by_twist)


@pytest.mark.parametrize("law", [DAHL, CREEPING], ids=["Dahl", "CoulombStribeck"])
def test_a_disc_that_slides_straight_has_the_friction_of_its_law(law):
    for kind in ("distributed", "reduced-published"):
        model = model_of(kind, law)
        scene = pf.scenes.driven(
            model, twist=(3e-3, 4e-3, 0.0), normal_force=LOAD, t_end=0.2
        )
        data = pf.simulate(scene, rtol=1e-8).data
        friction = LOAD * float(law.steady_friction(5e-3))
        end = [float(data[name][-1, 0]) for name in ("fx", "fy")]
        # Of the solver.
        assert end == pytest.approx([-0.6 * friction, -0.8 * friction], rel=1e-6)


@pytest.mark.parametrize("law", [DAHL, CREEPING], ids=["Dahl", "CoulombStribeck"])
def test_grooves_turn_and_scale_the_friction_of_a_law(law):
    """In steady sliding with v, `f = -L (u/|u|) mu(|u|)` with `u = L v` and `L` the root of the metric."""
    v = np.array([3e-3, 4e-3])
    root = GROOVED.root
    u = root @ v
    expected = (
        -LOAD * root @ u / np.linalg.norm(u) * law.steady_friction(np.linalg.norm(u))
    )
    scene = pf.scenes.driven(
        model_of("grooved", law), twist=(*v, 0.0), normal_force=LOAD, t_end=0.2
    )
    data = pf.simulate(scene, rtol=1e-8).data
    end = [float(data[name][-1, 0]) for name in ("fx", "fy")]
    assert end == pytest.approx(expected, rel=1e-6)  # of the solver
    _, wrench = held(model_of("grooved", law), 5e-3, 1.0, 2)
    along = root @ [5e-3, 0.0]
    size = np.linalg.norm(along)
    assert wrench[:2] == pytest.approx(
        -LOAD * root @ along / size * law.steady_friction(size), rel=1e-9
    )


def test_the_reduced_model_takes_dahl_and_refuses_creep():
    reduced, same = (
        pf.ReducedModel(DISC, law)
        for law in (DAHL, pf.LuGre(mu_c=0.4, sigma_0=2e4, sigma_1=0.0, sigma_2=0.0))
    )
    twist = (1e-3, 2e-3, 0.3)
    assert reduced.step(reduced.rest(), twist, LOAD, 1e-2)[1] == pytest.approx(
        same.step(same.rest(), twist, LOAD, 1e-2)[1], rel=1e-12
    )
    leaning = DISC.with_friction_metric(None, (0.1, 0.0))
    with refused("no creep_speed for patches with an asymmetry: take LuGre or Dahl"):
        pf.DistributedModel(leaning, CREEPING)


@pytest.mark.parametrize("law", [DAHL, CREEPING], ids=["Dahl", "CoulombStribeck"])
def test_sensitivities_of_other_laws_are_those_of_differences(law):
    model = pf.ReducedModelPublished(DISC, law, surface=pf.LimitSurfaceEllipsoid(DISC))
    given = (
        model.rest(),
        np.array([[1e-3, 2e-4, 0.1]] * 12),
        np.full(12, LOAD),
        np.full(12, 1e-3),
    )
    names = pf.derivatives.parameter_names(model)
    base = pf.derivatives.parameters_of(model)
    slopes = rollout_jacobian(model, *given).d_wrenches
    chosen = [names.index("sigma_0"), names.index("mu_c")]

    def wrenches(numbers):
        parameters = base.copy()
        parameters[chosen] = numbers
        return rollout(model, *given, parameters=parameters).wrenches

    wanted = differences(wrenches, base[chosen], 1e-6 * base[chosen])
    largest = np.abs(wanted).max((0, 1))
    assert (np.abs(slopes[..., chosen] - wanted) < 1e-6 * largest).all()


class Halved(pf.LuGre):
    """LuGre with half of its friction: what a user may derive."""

    @property
    def numbers(self):
        full = super().numbers
        return full._replace(mu_c=0.5 * full.mu_c, mu_s=0.5 * full.mu_s)


def test_a_subclass_is_what_its_numbers_say():
    halved = Halved(mu_c=0.8, mu_s=1.0)
    plain = pf.LuGre(mu_c=0.4, mu_s=0.5)
    twist = 1e-2, 2e-3, 0.3
    for make in (
        lambda law: pf.DistributedModel(DISC, law),
        lambda law: pf.ReducedModel(DISC, law),
        lambda law: pf.ReducedModelPublished(DISC, law),
    ):
        of_halved = make(halved)
        of_plain = make(plain)
        state, wrench = of_plain.step(of_plain.rest(), twist, LOAD, 1e-2)
        assert of_halved.step(of_halved.rest(), twist, LOAD, 1e-2)[1] == pytest.approx(
            wrench, rel=1e-14
        )
        assert of_halved.wrench(state, twist, LOAD) == pytest.approx(
            of_plain.wrench(state, twist, LOAD), rel=1e-12
        )
    assert halved.force(1e-6, 1e-3, LOAD) == pytest.approx(
        plain.force(1e-6, 1e-3, LOAD), rel=1e-14
    )
    with refused("start must be a LuGre law"):
        pf.identify.identify_lugre(
            pf.identify.Log(np.arange(20.0), np.ones((20, 3)), np.ones((20, 3)), 1.0),
            DISC,
            start=halved,
        )


def test_tensors_take_a_law_by_its_numbers_and_refuse_creep(front):
    twist = (1e-2, 2e-3, 0.3)
    for law in (Halved(mu_c=0.8, mu_s=1.0), DAHL):
        model = front.model(DISC, law)
        reference = pf.DistributedModel(DISC, law)
        _, wrench = model.step(model.rest(), front.array(twist), LOAD, 1e-2)
        expected = reference.step(reference.rest(), twist, LOAD, 1e-2)[1]
        assert front.plain(wrench) == pytest.approx(expected, rel=1e-9)
    with refused("law must have no creep_speed"):
        front.model(DISC, CREEPING)
