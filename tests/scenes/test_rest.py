"""When a body counts as at rest: slow, and held by friction for good."""

import numpy as np
import pytest

import planarfriction as pf
from tests.support.refusals import refused

PATCH = pf.ContactPatch.disc(0.01, cells=5)
MODELS = [pf.DistributedModel, pf.ReducedModel, pf.ReducedModelPublished]
G = 9.81
MU = 0.5


def law(sigma_1, elasto_plastic=None, mu_s=MU):
    return pf.LuGre(
        mu_c=MU,
        mu_s=mu_s,
        sigma_0=1e6,
        sigma_1=sigma_1,
        sigma_2=0.0,
        elasto_plastic=elasto_plastic,
    )


def name_of(model):
    return f"{type(model).__name__}-{model.law.sigma_1:g}-{model.law.elasto_plastic is not None}"


LAWS = [law(800.0), law(800.0, 0.9), law(100.0), law(0.0), law(0.0, 0.9)]


def run(model, body, load, t_end, **more):
    contact = pf.Contact(model, load, mounted_on="body")
    return pf.simulate(pf.Scene(body, [contact], t_end, stop_speed=1e-4, **more))


def level(speed=0.0):
    return pf.Body(1.0, 1e-4, velocity=(speed, 0.0, 0.0), gravity=(0.0, 0.0))


def on_a_slope(model, steepness, t_end, speed=0.0):
    """A body on an incline of `steepness`, in parts of the friction coefficient, thrown up it with `speed`."""
    angle = np.arctan(steepness * MU)
    body = pf.Body(
        1.0, 1e-4, velocity=(0.0, speed, 0.0), gravity=(0.0, -G * np.sin(angle))
    )
    return run(model, body, G * np.cos(angle), t_end)


@pytest.mark.parametrize(
    "model", [kind(PATCH, each) for kind in MODELS for each in LAWS[::2]], ids=name_of
)
def test_a_push_to_come_is_waited_for(model):
    push = pf.Signal.sampled([0.0, 0.5], [[0.0, 0.0, 0.0], [2.0 * MU * G, 0.0, 0.0]])
    solution = run(model, level(), G, 0.6, force=push)
    assert solution.status == "success"
    # once the bristles are full, in about a millisecond
    assert float(solution.data.vx[-1]) == pytest.approx(MU * G * 0.1, rel=2e-2)


def test_a_push_that_friction_holds_ends_at_rest():
    for each in (law(800.0), law(800.0, 0.9), law(0.0)):
        push = pf.Signal.sampled(
            [0.0, 0.1], [[0.0, 0.0, 0.0], [0.4 * MU * G, 0.0, 0.0]]
        )
        solution = run(pf.DistributedModel(PATCH, each), level(), G, 0.6, force=push)
        assert solution.status == "at rest"
        assert 0.1 < float(solution.data.time[-1]) < 0.12
        # 1e-4 m/s within sigma_1/sigma_0 are 0.125 N; bristles without damping swing on, with four times that speed
        left = 1e-4 / 8e-4 if each.sigma_1 else 4e-4 * np.sqrt(1e6 * G)
        assert float(solution.data.fx[-1, 0]) == pytest.approx(-0.4 * MU * G, abs=left)


@pytest.mark.parametrize("each", LAWS)
def test_a_body_in_free_fall_never_rests(each):
    solution = run(pf.DistributedModel(PATCH, each), pf.Body(1.0, 1e-4), 0.0, 0.1)
    assert solution.status == "success"
    assert float(solution.data.vy[-1]) == pytest.approx(-0.1 * G, rel=1e-9)


@pytest.mark.parametrize("each", LAWS)
def test_a_body_without_load_never_rests_however_slow(each):
    solution = run(pf.ReducedModel(PATCH, each), level(1e-5), 0.0, 0.1)
    assert solution.status == "success"
    assert float(solution.data.x[-1]) == pytest.approx(1e-6, rel=1e-9)


@pytest.mark.parametrize(
    "model", [kind(PATCH, each) for kind in MODELS for each in LAWS], ids=name_of
)
def test_a_slope_decides_by_its_friction(model):
    """Two per cent steeper than friction or less steep than it: the one slides away, the other stays."""
    steep = on_a_slope(model, 1.02, 0.3)
    assert steep.status == "success"
    angle = np.arctan(1.02 * MU)
    way = 0.5 * G * (np.sin(angle) - MU * np.cos(angle)) * 0.3**2
    # friction differs while bristles fill, by a speed of at most sqrt(2 mu g z) with z = mu/sigma_0
    assert -float(steep.data.y[-1]) == pytest.approx(
        way, abs=0.3 * np.sqrt(2.0 * MU * G * MU / 1e6)
    )
    shallow = on_a_slope(model, 0.95, 0.3)
    assert shallow.status == "at rest"
    assert abs(float(shallow.data.y[-1])) < 2e-5


@pytest.mark.parametrize(
    "model", [kind(PATCH, each) for kind in MODELS for each in LAWS], ids=name_of
)
def test_a_body_thrown_up_a_slope_turns_and_slides_back(model):
    solution = on_a_slope(model, 1.3, 0.2, speed=0.3)
    assert solution.status == "success"
    up = on_a_slope(model, 1.3, 0.2, speed=0.3).data.y.max()
    assert float(up) > 3e-3
    assert float(solution.data.vy[-1]) < -0.1


@pytest.mark.parametrize("each", [law(800.0), law(800.0, 0.9), law(100.0), law(0.0)])
def test_a_body_thrown_up_a_shallow_slope_stops_there(each):
    solution = on_a_slope(pf.DistributedModel(PATCH, each), 0.6, 0.2, speed=0.3)
    angle = np.arctan(0.6 * MU)
    brake = G * (np.sin(angle) + MU * np.cos(angle))
    assert solution.status == "at rest"
    # it loses sigma_1/sigma_0 mu g of its speed at once, and without damping rings until the solver's own has its way
    left = 0.3 - each.sigma_1 / each.sigma_0 * MU * G
    assert float(solution.data.y[-1]) == pytest.approx(
        left**2 / (2.0 * brake), rel=5e-3, abs=5e-6
    )
    assert float(solution.data.time[-1]) == pytest.approx(
        left / brake, abs=6e-3 if each.sigma_1 > 0.0 else 1e-2
    )


def test_a_load_that_vanishes_later_is_waited_for():
    for each in LAWS:
        load = pf.Signal.sampled([0.0, 0.1], [G, 0.0])
        solution = run(
            pf.DistributedModel(PATCH, each),
            pf.Body(1.0, 1e-4, gravity=(0.0, -1.0)),
            load,
            0.2,
        )
        assert solution.status == "success"
        assert float(solution.data.vy[-1]) == pytest.approx(-0.1, rel=1e-2)
        # Still falling at the end.
        ramp = pf.Signal.sampled([0.0, 10.0], [G, 0.0], hold="linear")
        assert (
            run(pf.DistributedModel(PATCH, each), level(), ramp, 0.2).status
            == "success"
        )


def test_a_swing_past_static_friction_is_no_rest():
    """At the turning point friction could hold the body, but it swings back past the lower friction of sliding."""
    sticky = law(0.0, mu_s=0.6)
    solution = on_a_slope(pf.DistributedModel(PATCH, sticky), 1.15, 0.3, speed=0.3)
    assert solution.status == "success"
    assert float(solution.data.vy[-1]) < -0.05


def test_bristles_without_any_damping_swing_for_ever():
    solution = run(pf.DistributedModel(PATCH, law(0.0, 0.9)), level(0.1), G, 0.3)
    assert solution.status == "success"
    assert 1e-4 < float(np.abs(solution.data.vx[-10:]).max()) < 2e-3


def test_an_input_that_changes_nothing_is_none():
    load = pf.Signal.sampled([0.0, 0.1, 0.2], [G, G, G])
    solution = run(pf.DistributedModel(PATCH, law(800.0)), level(0.1), load, 0.5)
    assert solution.status == "at rest"
    assert float(solution.data.time[-1]) < 0.05


def test_a_prescribed_velocity_knows_no_rest():
    with refused(
        "stop_speed must be None if the velocity is prescribed", pf.FrictionError
    ):
        run(
            pf.DistributedModel(PATCH, LAWS[0]),
            level(),
            G,
            0.1,
            velocity=[0.0, 0.0, 0.0],
        )
