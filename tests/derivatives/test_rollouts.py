"""Derivatives of steps and rollouts: closed forms, kinks, differences, and backwards against forwards."""

import functools
import pickle
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import planarfriction as pf
from planarfriction import derivatives
from planarfriction.derivatives import PARAMETERS
from tests.support.contacts import (
    ELASTIC,
    LAWS,
    SURFACES,
    friction_model,
    published_finger,
)
from tests.support.contacts import FOUR as PATCH
from tests.support.refusals import refused

LOAD, DT, T = 2.0, 1e-4, 12

every_surface = pytest.mark.parametrize("kind", SURFACES)
every_law = pytest.mark.parametrize("law", LAWS)


model_of = functools.cache(friction_model)


def radius(model):
    return model.shape_at(LOAD).contact_radius


def drive(model, seed=0, steps=T):
    """A random walk in the space of twists that starts, slides, spins, turns back; loads; a state."""
    random = np.random.default_rng(seed)
    scale = np.array([1.0, 1.0, 1.0 / radius(model)])
    twists = np.cumsum(random.normal(size=(steps, 3)), axis=0) * 3e-3 * scale
    loads = random.uniform(1.0, 3.0, steps)
    return random.normal(size=3) * 4e-7 / scale, twists, loads


# ---------------------------------------------------------------------- the rollout


@pytest.mark.parametrize("kind", ["distributed", "ellipsoid"])
def test_inputs_of_every_kind_give_the_same_rollout(kind):
    """One contact of plain arrays is stepped without the checks of all others."""
    model = pickle.loads(pickle.dumps(model_of(kind)))  # not packed yet
    state, twists, loads = drive(model_of("ellipsoid"))
    state = np.full(model.state_shape, 1e-7) if kind == "distributed" else state
    with ThreadPoolExecutor(4) as pool:
        found = list(
            pool.map(
                lambda given: derivatives.rollout(model, *given),
                [
                    (state, twists, loads, DT),
                    (state, twists, loads, np.full(T, DT)),
                    (state.tolist(), twists.tolist(), loads.tolist(), np.array(DT)),
                    (state, np.asfortranarray(twists), np.repeat(loads, 2)[::2], DT),
                ],
            )
        )
    assert all(each == found[0] for each in found)
    (many,) = derivatives.rollout(model, state, twists[None], loads, DT).wrenches
    np.testing.assert_array_equal(many, found[0].wrenches)
    assert found[0].wrenches.shape == (T, 3) and found[0].wrenches.all()


def test_parameters_take_the_place_of_the_models_own():
    model = model_of("ellipsoid")
    other = pf.LuGre(0.4, 0.9, 2e-3, 3e5, 50.0, 0.7, 1.3, pf.ElastoPlastic(0.5))
    changed = pf.ReducedModelPublished(
        PATCH, other, surface=pf.LimitSurfaceEllipsoid(PATCH)
    )
    state, twists, loads = drive(model)
    got = derivatives.rollout(
        model, state, twists, loads, DT, parameters=derivatives.parameters_of(changed)
    )
    assert np.array_equal(
        got.wrenches, derivatives.rollout(changed, state, twists, loads, DT).wrenches
    )


# ---------------------------------------------------------------------- closed forms


@pytest.mark.parametrize("law", ["plain", "elasto-plastic"])
def test_a_contact_at_rest_is_a_spring_and_two_dampers(law):
    """From rest at zero twist `W = -(sigma_0 u dt + sigma_1 u + sigma_2 U V) f_N` to first order."""
    model = model_of("ellipsoid", law)
    j = model.step_jacobians(model.rest(), np.zeros(3), LOAD, DT)
    numbers = model.law
    (x, y) = model.shape_at(LOAD).centre_of_pressure
    r = radius(model)
    to_centre = np.array([[1.0, 0.0, -y], [0.0, 1.0, x], [0.0, 0.0, 1.0]])
    bristle = (numbers.sigma_0 * DT + numbers.sigma_1) * np.diag([1.0, 1.0, r * r])
    viscous = numbers.sigma_2 * np.diag([1.0, 1.0, model.shape_at(LOAD).second_moment])
    # Rounding of ten operations.
    assert j.wrench_twist == pytest.approx(
        -LOAD * to_centre.T @ (bristle + viscous) @ to_centre, rel=1e-13, abs=1e-15
    )
    assert j.state_state == pytest.approx(np.eye(3), rel=1e-13)


@every_surface
@every_law
def test_a_long_step_ends_in_the_steady_state_of_its_parameters(kind, law):
    """`W = -(g(v) S h + sigma_2 U V) f_N`: neither stiffness nor damping nor the start matter."""
    model = model_of(kind, law)
    twist = np.array([2e-3, -1e-3, 0.3])
    _, wrenches, slopes = derivatives.rollout_jacobian(
        model, model.rest(), twist[None], LOAD, 1e6
    )
    by = dict(zip(PARAMETERS, slopes[0].T, strict=True))
    numbers = model.law
    shape = model.shape_at(LOAD)
    unit = LOAD * model.surface.wrench(twist)
    v = np.hypot(
        np.hypot(*(twist[:2] + twist[2] * shape.centre_of_pressure[::-1] * (-1, 1))),
        shape.contact_radius * 0.3,
    )
    share = np.exp(-((v / numbers.v_s) ** numbers.gamma))
    # What the bristle remembers: 1e-9 of the step. Rounding of g over h.
    assert by["mu_c"] == pytest.approx((1.0 - share) * unit, rel=1e-8)
    assert by["mu_s"] == pytest.approx(share * unit, rel=1e-8, abs=1e-12)
    for name in ("sigma_0", "sigma_1", "breakaway_ratio"):
        assert by[name] * max(getattr(numbers, name, 1.0), 1.0) == pytest.approx(
            np.zeros(3), abs=1e-8
        ), name
    assert by["sigma_2"][:2] == pytest.approx(
        (wrenches[0] - unit * _friction(numbers, v))[:2] / numbers.sigma_2, rel=1e-6
    )


def _friction(law, v):
    from planarfriction import formulas

    return formulas.stribeck(np, v, law)


# ---------------------------------------------------------------------- kinks


@every_surface
@every_law
def test_gradients_are_finite_at_every_kink(kind, law):
    model = model_of(kind, law)
    r = radius(model)
    z = np.array([4e-7, -3e-7, 2e-7 * r])
    rotation = 0.5
    (x, y) = model.shape_at(LOAD).centre_of_pressure
    # About the centre of pressure: the axis of the tables.
    spin = np.array([rotation * y, -rotation * x, rotation])
    twists = [
        np.zeros(3),
        spin,
        -spin,
        1e-300 * spin,
        1e-160 * spin,
        [1e-3, 0, 0],
        [0, 1e-3, 0],
        [1e-3, 1e-3, 0],
    ]
    # Takes the ellipsoid's bristle exactly to zero.
    back = -z / DT / np.array([1.0, 1.0, r * r])
    twists.append([back[0] + y * back[2], back[1] - x * back[2], back[2]])
    states = [np.zeros(3), z, 1e-300 * z, 1e-160 * z, -z, 1e4 * z]
    for state in states:
        for twist in twists:
            for load in (0.0, LOAD):
                for dt in (0.0, 1e-12, DT, 1e9):
                    gradient = derivatives.rollout_vjp(
                        model,
                        state,
                        np.tile(twist, (2, 1)),
                        load,
                        dt,
                        np.ones((2, 3)),
                        np.ones(3),
                    )
                    for name, value in gradient._asdict().items():
                        assert np.isfinite(value).all(), (name, state, twist, load, dt)


@every_surface
def test_without_load_nothing_passes_but_the_load(kind):
    model = model_of(kind)
    state, twists, loads = drive(model)
    loads[6] = 0.0
    bar = np.ones((T, 3))
    gradient = derivatives.rollout_vjp(
        model, state, twists, loads, DT, bar * (np.arange(T) >= 6)[:, None], np.ones(3)
    )
    _, wrenches = derivatives.rollout(model, state, twists, loads, DT)
    assert str(wrenches[6]) == "[0. 0. 0.]"  # not even a negative zero
    assert (
        not gradient.state.any()
        and not gradient.twist[:7].any()
        and not gradient.normal_force[:6].any()
    )
    assert gradient.twist[7:].all()
    # The slope to the load: the wrench per newton that a small load would have.
    before = derivatives.rollout_states(model, state, twists, loads, DT).states[6]
    assert gradient.normal_force[6] == pytest.approx(
        model.step(before, twists[6], 1e-3, DT)[1].sum() / 1e-3, rel=1e-10
    )


# ---------------------------------------------------------------------- against differences


sliding_or_stuck = {
    "log_dt": st.floats(-9.0, 3.0),
    "seed": st.integers(0, 1000),
    "log_size": st.floats(-9.0, -5.0),
    "log_speed": st.floats(-7.0, 0.0),
    "turn": st.sampled_from([-1.0, 0.0, 1.0]),
}


@every_surface
@every_law
def test_slopes_of_a_step_lie_between_those_of_its_sides(kind, law):
    """In stick, slip and reversal, for short and long steps; across a kink, anything between the two sides."""
    model = model_of(kind, law)
    scale = np.array([1.0, 1.0, radius(model)])

    @given(**sliding_or_stuck)
    @settings(deadline=None, max_examples=30)
    def check(log_dt, seed, log_size, log_speed, turn):
        random = np.random.default_rng(seed)
        dt = 10.0**log_dt
        direction = random.normal(size=3)
        state = direction * 10.0**log_size * scale
        twist = (
            (turn * direction + 0.3 * random.normal(size=3)) * 10.0**log_speed / scale
        )
        move = random.normal(size=3)
        turned = random.normal(size=3)
        moves = move * 10.0**log_size * scale, turned * 10.0**log_speed / scale, 1.0
        j = model.step_jacobians(state, twist, LOAD, dt)
        got = (
            j.wrench_state @ moves[0]
            + j.wrench_twist @ moves[1]
            + j.wrench_load * moves[2]
        )
        got_state = j.state_state @ moves[0] + j.state_twist @ moves[1]

        def at(length):
            return model.step(
                state + length * moves[0],
                twist + length * moves[1],
                LOAD + length * moves[2],
                dt,
            )

        h = 1e-6
        (here_state, here) = at(0.0)
        (high_state, high) = at(h)
        (low_state, low) = at(-h)
        for slope, right, left, value in (
            (
                got / scale,
                (high - here) / h / scale,
                (here - low) / h / scale,
                here / scale,
            ),
            (
                got_state / scale,
                (high_state - here_state) / h / scale,
                (here_state - low_state) / h / scale,
                state / scale,
            ),
        ):
            # Rounding of the values over the step, and half the difference of the sides (curvature, or a kink).
            size = np.abs(value).max() + np.abs(here_state / scale).max() * (
                1.0 if value is not here else 0.0
            )
            allowed = (
                2e-9 * size + 1e-5 * np.abs(slope).max() + 0.51 * np.abs(right - left)
            )
            assert (np.abs(slope - 0.5 * (right + left)) <= allowed).all()

    check()


def test_a_bristle_brought_back_to_full_deflection_slides_along_the_cap():
    model = model_of("ellipsoid")
    scale = np.array([1.0, 1.0, radius(model)])
    state = np.array([-2.52e-8, -4.02e-7, 8.58e-7]) * scale
    dt = 5.53e-7
    twist = np.array([-4.2e-2, -3.4e-2, 202.0])
    end, _ = model.step(state, twist, LOAD, dt)
    v = np.linalg.norm(model.surface._frame() @ twist)
    assert np.linalg.norm(end / scale) == pytest.approx(
        _friction(model.law, v) / model.law.sigma_0, rel=1e-14
    )
    j = model.step_jacobians(state, twist, LOAD, dt)
    # Along the cap only: the length of the new bristle is full deflection whatever the old one was.
    assert (end / scale) @ (j.state_state / scale[:, None] * scale) == pytest.approx(
        np.zeros(3), abs=1e-6 * 1e-12
    )
    for move in np.eye(3):
        change = 1e-5 * move * scale * 1e-6
        difference = (
            model.step(state + change, twist, LOAD, dt)[0]
            - model.step(state - change, twist, LOAD, dt)[0]
        )
        assert 2.0 * j.state_state @ change / scale == pytest.approx(
            difference / scale, rel=1e-5, abs=1e-19
        )


# ---------------------------------------------------------------------- batches


def face_model():
    """Return a model on a pad with a common compliance, whose face has a state and a rollout of its own."""
    law = pf.LuGre(mu_c=0.8, mu_s=1.0, sigma_1=0.0, v_s=2e-2, elasto_plastic=0.9)
    return pf.ReducedModel(PATCH, law, pad=pf.Pad.measured(4e3, 0.4))


@pytest.mark.parametrize(
    "make", [lambda: model_of("ellipsoid"), face_model], ids=["ellipsoid", "face"]
)
def test_one_load_for_each_contact_and_rest(make):
    model = make()
    _, twists, _ = drive(model_of("ellipsoid"))
    each = derivatives.rollout(model, None, twists, [[1.0], [2.0]], DT)
    assert each.wrenches.shape == (2, T, 3)
    # Contacts abreast go through vector code, which rounds differently.
    assert each.wrenches[1] == pytest.approx(
        derivatives.rollout(model, model.rest(), twists, 2.0, DT).wrenches, rel=1e-12
    )
    gradient = derivatives.rollout_vjp(
        model, None, twists, [[1.0], [2.0]], DT, np.ones((T, 3))
    )
    assert gradient.state.shape == model.state_shape
    assert gradient.normal_force.shape == (2, 1)
    alone = derivatives.rollout_vjp(model, None, twists, 2.0, DT, np.ones((T, 3)))
    assert gradient.normal_force[1] == pytest.approx(alone.normal_force, rel=1e-10)


def test_changes_broadcast_with_contacts():
    model = model_of("table", "wide")
    state, twists, loads = drive(model)
    changed_state, _, _ = drive(model, 1)
    scales = np.array([0.5, 1.0, 2.0])[:, None, None]
    tangent = derivatives.RolloutTangent(changed_state, 0.0, 1.0)
    found = derivatives.rollout_jvp(model, state, scales * twists, 2.0, DT, tangent)
    assert found.wrenches_dot.shape == (3, T, 3)
    for each, scale in zip(found.wrenches_dot, scales, strict=True):
        tangent = derivatives.RolloutTangent(changed_state, normal_force=np.ones(T))
        alone = derivatives.rollout_jvp(model, state, scale * twists, 2.0, DT, tangent)
        assert np.array_equal(each, alone.wrenches_dot)
    held = derivatives.rollout_jvp(model, state, twists, loads, DT)
    assert not held.wrenches_dot.any() and not held.state_dot.any()


# ---------------------------------------------------------------------- ends of the range


@pytest.mark.parametrize(
    "surface",
    [pf.LimitSurfaceCells, pf.LimitSurfaceTable, pf.LimitSurfaceTablePublished],
)
def test_twists_whose_squares_leave_the_range_of_numbers_are_rest(surface):
    generator = np.random.default_rng(0)
    model = pf.ReducedModelPublished(PATCH, ELASTIC, surface=surface(PATCH))
    twist = (
        10.0 ** generator.uniform(-163.0, -160.0, (1000, 1, 1))
        * generator.normal(size=(1000, 1, 3))
        * [1, 1, 150]
    )
    start = generator.normal(size=(1000, 3)) * [1e-7, 1e-7, 1e-9]
    ours, still = (
        derivatives.rollout(model, start, each, 1.0, 1e-3)
        for each in (twist, 0.0 * twist)
    )
    np.testing.assert_array_equal(ours.wrenches, still.wrenches)
    for each in derivatives.rollout_vjp(
        model, start, twist, 1.0, 1e-3, np.ones((1, 3))
    ):
        assert np.isfinite(each).all()


# ---------------------------------------------------------------------- errors

FINGER = pf.ContactPatch.rectangle(0.02, cells=21, pressure=published_finger())


def test_a_shape_that_follows_the_load_is_refused_and_a_kept_one_is_not():
    surface = pf.LimitSurfaceEllipsoid(FINGER, normal_force=1.0)
    kept = pf.ReducedModelPublished(
        FINGER, ELASTIC, surface=surface, on_load_change="keep"
    )
    _, twists, loads = drive(kept)
    _, wrenches = derivatives.rollout(kept, kept.rest(), twists, loads, DT)
    assert wrenches[0] == pytest.approx(
        kept.step(kept.rest(), twists[0], loads[0], DT)[1], rel=1e-12
    )
    for how in ("rebuild", "rescale"):
        model = pf.ReducedModelPublished(
            FINGER, ELASTIC, surface=surface, on_load_change=how
        )
        with refused(f"shape that does not follow the load.*on_load_change='{how}'"):
            derivatives.rollout_states(model, model.rest(), twists, loads, DT)


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"state": np.zeros(2)}, r"state must have shape \[..., 3\]"),
        ({"twist": np.zeros(3)}, r"twist must have shape \[..., T, 3\]"),
        ({"twist": np.full((T, 3), np.nan)}, "twist must be finite"),
        (
            {"normal_force": np.ones(T - 1)},
            rf"normal_force must broadcast with \[..., {T}\]",
        ),
        ({"normal_force": -1.0}, "normal_force must be >= 0, got -1.0"),
        ({"dt": np.ones((T, 1))}, rf"dt must be one number or have shape \[{T}\]"),
        ({"parameters": np.ones(11)}, r"parameters must have shape \[..., 12\]"),
        ({"parameters": np.zeros(12)}, "sigma_0 must be > 0, got 0.0"),
        ({"parameters": np.ones(12)}, r"breakaway_ratio must be in \[0, 1\), got 1.0"),
        (
            {"state": np.zeros((2, 3)), "twist": np.zeros((3, T, 3))},
            "batch axes must broadcast",
        ),
        (
            {"wrenches_bar": np.ones((T + 1, 3))},
            rf"wrenches_bar must have shape \[..., {T}, 3\]",
        ),
        ({"model": "a"}, "model must be one that has compiled rollouts, got str"),
    ],
)
def test_wrong_input_is_one_clear_line(changed, message):
    model = model_of("ellipsoid")
    state, twists, loads = drive(model)
    inputs = {
        "model": model,
        "state": state,
        "twist": twists,
        "normal_force": loads,
        "dt": DT,
        "wrenches_bar": np.ones((T, 3)),
    }
    with refused(message):
        derivatives.rollout_vjp(**{**inputs, **changed})


def test_a_roll_out_of_no_model_names_all_models():
    message = r"model must be a friction model \(DistributedModel, ReducedModel, ReducedModelPublished\), got str"
    with refused(message):
        pf.rollout("reduced", None, np.zeros((3, 3)), 1.0, DT)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (
            {"twist": np.zeros((T, 2))},
            rf"tangent.twist must have shape \[..., {T}, 3\], got shape \[{T}, 2\]",
        ),
        (
            {"parameters": np.zeros(7)},
            r"tangent.parameters must have shape \[..., 12\]",
        ),
        ({"state": [np.nan, 0.0, 0.0]}, "tangent.state must be finite"),
        (
            {"normal_force": np.zeros((4, T)), "state": np.zeros((5, 3))},
            "batch axes must broadcast",
        ),
    ],
)
def test_wrong_changes_are_one_clear_line(changes, message):
    model = model_of("table")
    tangent = derivatives.RolloutTangent(**changes)
    with refused(message):
        derivatives.rollout_jvp(model, *drive(model), DT, tangent)


def test_what_else_is_refused():
    model = model_of("ellipsoid")
    with refused("did you mean 'mu_s'"):
        derivatives.rollout_jacobian(model, *drive(model), DT, names=["mu_k"])
    with refused(r"^twist must"):
        derivatives.rollout_jvp(model, None, [[], [1.0, None], []], 1.0, DT)


# ---------------------------------------------------------------------- pads with a common compliance


def test_a_face_without_load_forgets_and_takes_no_numbers():
    model = face_model()
    _, twists, loads = drive(model_of("ellipsoid"))
    state, _ = model.step(model.rest(), 0.01 * twists[0], 3.0, DT)
    loads[2] = 0.0
    bars = np.ones((T, 3))
    found, before = (
        derivatives.rollout_vjp(model, state, twists[:t], loads[:t], DT, bars[:t])
        for t in (T, 2)
    )
    np.testing.assert_allclose(found.state, before.state, rtol=1e-12)
    assert np.isfinite(found.normal_force).all() and not found.twist[2].any()
    with refused("parameters must be None for a pad with a common compliance"):
        derivatives.rollout(model, state, twists, loads, DT, parameters=np.ones(8))
