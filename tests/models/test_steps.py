"""The step for hosts with a fixed time step: exact, second order, stable; batches; loads that change the shape."""

import functools
import pickle

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import integrate

import planarfriction as pf
from tests.support.contacts import (
    ELASTIC,
    LAWS,
    PLAIN,
    SURFACES,
    friction_model,
    lengths,
    published_finger,
)
from tests.support.refusals import refused

LOAD = 2.0
TWIST = np.array([2e-3, -1e-3, 0.3])

every_model = pytest.mark.parametrize("kind", ["distributed", *SURFACES])
every_law = pytest.mark.parametrize("law", LAWS)


model_of = functools.cache(friction_model)


def scaled(model, state):
    """Return deflections [m]."""
    return state / lengths(model)


def norms(model, state):
    """Deflection |z| of each bristle [m]."""
    return np.linalg.norm(
        scaled(model, state), axis=-1 if model.state_shape == (3,) else -2
    )


def some_state(model, seed, size):
    """A random state of that deflection."""
    random = np.random.default_rng(seed)
    return random.normal(size=model.state_shape) * size * lengths(model)


def reference(model, state, twist, time):
    """The state after `time` at a held twist, from `rate` by a Runge-Kutta method of order 8."""
    units = 1e-6 * lengths(model)

    def slope(_, z):
        return (
            model.rate(z.reshape(model.state_shape) * units, twist, LOAD) / units
        ).ravel()

    found = integrate.solve_ivp(
        slope,
        (0.0, time),
        (state / units).ravel(),
        method="DOP853",
        rtol=3e-14,
        atol=1e-14,
    )
    assert found.success
    return found.y[:, -1].reshape(model.state_shape) * units


# ---------------------------------------------------------------------- accuracy


@every_model
@pytest.mark.parametrize("time", [1e-5, 3e-4, 2e-3])
def test_plain_steps_are_exact(kind, time):
    model = model_of(kind, "plain")
    start = some_state(model, 1, 5e-7)
    end, wrench = model.step(start, TWIST, LOAD, time)
    expected = reference(model, start, TWIST, time)
    # Deflections of 1e-6 m; the reference's own error, 3e-14 in each of some hundred steps.
    assert scaled(model, end) == pytest.approx(
        scaled(model, expected), abs=1e-6 * 1e-11
    )
    # The wrench is that of the end of the step: sigma_0 times the above, and rounding.
    assert wrench == pytest.approx(model.wrench(end, TWIST, LOAD), abs=1e-10)


@every_model
@pytest.mark.parametrize("law", ["elasto-plastic", "wide"])
def test_wrench_of_a_step_is_that_of_its_end(kind, law):
    model = model_of(kind, law)
    for seed in range(5):
        end, wrench = model.step(some_state(model, seed, 7e-7), TWIST, LOAD, 1e-4)
        # Rounding.
        assert wrench == pytest.approx(model.wrench(end, TWIST, LOAD), abs=1e-10)


@every_model
@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_elasto_plastic_steps_are_of_second_order(kind, direction):
    model = model_of(kind, "wide")
    time = 3e-4
    # Deflected into the elasto-plastic range (0.3 to 1 micrometre), and from there onwards or back.
    start, _ = model.step(model.rest(), TWIST, LOAD, 2.5e-4)
    twist = direction * TWIST + (5e-4, 4e-4, 0.1)
    expected = reference(model, start, twist, time)
    errors = []
    for steps in (20, 40, 80, 160):
        state = start
        for _ in range(steps):
            state, _ = model.step(state, twist, LOAD, time / steps)
        errors.append(np.abs(scaled(model, state - expected)).max())
    orders = -np.diff(np.log2(errors))
    # Second order, where no bristle crosses an end of its range within the last halvings.
    assert orders[-1] == pytest.approx(2.0, abs=0.25), errors
    assert errors[-1] < 1e-10  # of 1e-6 m


@every_model
@every_law
def test_short_steps_follow_the_rate(kind, law):
    """Compiled steps against the rate in NumPy: `(step(dt) - z)/dt -> rate`."""
    model = model_of(kind, law)
    for seed, size in enumerate((1e-7, 6e-7, 1e-6)):
        state = some_state(model, seed, size)
        for twist in (TWIST, -TWIST, (0.0, 0.0, 1.0), (1e-5, 0.0, 0.0)):
            rate = scaled(model, model.rate(state, twist, LOAD))
            dt = 1e-6 * 1e-6 / np.abs(rate).max()  # a millionth of full deflection
            end, _ = model.step(state, twist, LOAD, dt)
            # Truncation: dt k/2 = 1e-6; rounding of z: 1e-16 of 1e-6 over 1e-12.
            assert scaled(model, end - state) / dt == pytest.approx(
                rate, abs=1e-5 * np.abs(rate).max()
            )


# ---------------------------------------------------------------------- stability


@every_model
@every_law
def test_any_step_is_stable_and_does_not_overshoot(kind, law):
    model = model_of(kind, law)

    @given(
        st.floats(-9.0, 3.0),
        st.integers(0, 1000),
        st.floats(-8.0, -4.0),
        st.tuples(*3 * [st.floats(-1.0, 1.0)]),
        st.floats(-6.0, 1.0),
    )
    @settings(deadline=None, max_examples=50)
    def check(log_dt, seed, log_size, direction, log_speed):
        start = some_state(model, seed, 10.0**log_size)
        twist = np.array(direction) * 10.0**log_speed * (1.0, 1.0, 200.0)
        end, wrench = model.step(start, twist, LOAD, 10.0**log_dt)
        assert np.isfinite(end).all() and np.isfinite(wrench).all()
        # Never past the larger of where it was and the steady deflection |h| g/sigma_0 of each bristle; rounding.
        steady, _ = model.step(model.rest(), twist, LOAD, 1e40)
        reach = np.maximum(norms(model, start), norms(model, steady))
        assert (norms(model, end) <= reach * (1 + 1e-12)).all()

    check()


@every_model
@every_law
@pytest.mark.parametrize("start", ["rest", "opposite", "far"])
def test_long_steps_end_in_the_steady_state(kind, law, start):
    model = model_of(kind, law)
    begin = {
        "rest": model.rest(),
        "opposite": some_state(model, 2, 5e-7),
        "far": some_state(model, 3, 1e-4),
    }[start]
    for twist in (TWIST, 50.0 * TWIST, 1e-3 * TWIST):
        # What is left of the start is its share of the way, squared: (1e-4 m/2e-6 m/s/1e8 s)^2 and less.
        end, wrench = model.step(begin, twist, LOAD, 1e8)
        at_end = model.rate(end, twist, LOAD)
        assert at_end == pytest.approx(
            np.zeros(model.state_shape), abs=1e-11 * np.abs(twist).max()
        )
        again, wrench_again = model.step(end, twist, LOAD, 1e8)
        assert scaled(model, again) == pytest.approx(
            scaled(model, end), abs=1e-6 * 1e-11
        )
        assert wrench == pytest.approx(wrench_again, rel=1e-9)


@every_model
@every_law
def test_nothing_moves_without_time_or_without_velocity(kind, law):
    model = model_of(kind, law)
    state = some_state(model, 4, 4e-7)
    # Rounding of exp(0) and of the scaling by r.
    assert model.step(state, TWIST, LOAD, 0.0)[0] == pytest.approx(state, rel=1e-15)
    assert model.step(state, (0, 0, 0), LOAD, 1e3)[0] == pytest.approx(state, rel=1e-15)


@every_model
def test_no_creep_below_breakaway(kind):
    """Elasto-plastic bristles are springs below breakaway: they come back exactly; plain ones creep."""
    for law, allowed in (("elasto-plastic", 1e-19), ("plain", None)):
        model = model_of(kind, law)
        state = None
        state = model.rest()
        # 50 cycles of pushing there and back, up to a fifth of full deflection.
        for _ in range(50):
            for sign in (1.0, -1.0):
                state, _ = model.step(state, sign * TWIST, LOAD, 5e-5)
        rest = np.abs(scaled(model, state)).max()
        assert rest < allowed if allowed else rest > 1e-9


# ---------------------------------------------------------------------- batches


@pytest.mark.parametrize("kind", ["distributed", "published"])
def test_one_state_with_many_twists_loads_or_times(kind):
    """A batch of three, which must not be taken for the three components of one twist."""
    model = model_of(kind)
    rest = model.rest()
    twists = np.stack([TWIST, 2 * TWIST, 3 * TWIST])
    ends, wrenches = model.step(rest, twists, LOAD, 1e-4)
    assert ends.shape == (3, *model.state_shape) and wrenches.shape == (3, 3)
    assert ends[1] == pytest.approx(
        model.step(rest, twists[1], LOAD, 1e-4)[0], rel=1e-12
    )
    assert model.step(rest, TWIST, [1.0, 2.0], 1e-4)[1].shape == (2, 3)
    assert model.step(rest, TWIST, np.array([1.0]), 1e-4)[1].shape == (1, 3)
    assert model.step(rest, TWIST, LOAD, np.array([1e-4]))[1].shape == (1, 3)
    assert model.step(rest, TWIST[None], LOAD, 1e-4)[1].shape == (1, 3)


# ---------------------------------------------------------------------- loads


@every_model
def test_a_fixed_shape_is_proportional_to_the_load(kind):
    model = model_of(kind)
    state = some_state(model, 6, 6e-7)
    assert model.wrench(state, TWIST, 6.0) == pytest.approx(
        3.0 * model.wrench(state, TWIST, 2.0), rel=1e-12
    )
    assert model.rate(state, TWIST, 6.0) == pytest.approx(
        model.rate(state, TWIST, 2.0), rel=1e-15
    )


@every_model
def test_a_contact_without_load_forgets(kind):
    model = model_of(kind)
    state = some_state(model, 7, 6e-7)
    end, wrench = model.step(state, TWIST, 0.0, 1e-4)
    assert not end.any() and not wrench.any()
    assert not model.wrench(state, TWIST, 0.0).any()


FINGER = pf.ContactPatch.rectangle(0.02, cells=21, pressure=published_finger())


def soft(
    on_load_change="rebuild", kind=pf.LimitSurfaceTablePublished, normal_force=None
):
    """Reduced model of the soft finger."""
    surface = kind(FINGER, normal_force=normal_force)
    return pf.ReducedModelPublished(
        FINGER, PLAIN, surface=surface, on_load_change=on_load_change
    )


def fixed_at(load):
    """The soft finger's shape at a load, as a patch that keeps it."""
    positions = FINGER.positions
    weights = FINGER.weights(load)
    return pf.ContactPatch(
        positions[weights > 0.0],
        FINGER.areas[weights > 0.0],
        weights[weights > 0],
        FINGER.grid,
    )


@pytest.mark.parametrize("kind", SURFACES.values())
def test_rebuild_follows_the_load_with_everything(kind):
    model = soft(kind=kind)
    state = np.array([3e-7, -2e-7, 1e-9])
    loads = np.array([0.5, 1.0, 3.0])
    ends, wrenches = model.step(state, TWIST, loads, 1e-4)
    for load, end, wrench in zip(loads, ends, wrenches, strict=True):
        patch = fixed_at(load)
        other = pf.ReducedModelPublished(patch, PLAIN, surface=kind(patch))
        expected_end, expected_wrench = other.step(state, TWIST, load, 1e-4)
        # The same numbers by another way: rounding.
        assert end == pytest.approx(expected_end, rel=1e-9)
        assert wrench == pytest.approx(expected_wrench, rel=1e-9)
        assert model.rate(state, TWIST, load) == pytest.approx(
            other.rate(state, TWIST, load), rel=1e-9
        )
        for got, wanted in zip(
            model.jacobians(state, TWIST, load),
            other.jacobians(state, TWIST, load),
            strict=True,
        ):
            assert got == pytest.approx(
                wanted, rel=1e-9, abs=1e-9 * np.abs(wanted).max()
            )
        assert model.shape_at(load).contact_radius == pytest.approx(
            other.surface.contact_radius, rel=1e-12
        )
        assert model.shape_at(load).second_moment == pytest.approx(
            patch.second_moment(), rel=1e-12
        )


def test_rescale_lets_only_the_radius_follow():
    model = soft("rescale", normal_force=2.0)
    reference_load = 2.0
    built = model.shape_at(reference_load)
    small = model.shape_at(0.5)
    assert small.contact_radius < 0.7 * built.contact_radius  # R ~ f_N^(1/3): 0.63
    assert small.contact_radius == pytest.approx(
        soft().shape_at(0.5).contact_radius, rel=1e-12
    )
    assert (
        small.second_moment
        == built.second_moment
        == FINGER.second_moment(reference_load)
    )
    assert small.surface is model.surface
    # A spin, elastic: torque sigma_0 r^2 theta of the radius that follows.
    state, _ = model.step(model.rest(), (0, 0, 1.0), 0.5, 1e-9)
    torque = model.wrench(state, (0, 0, 0), 0.5)[2]
    # Decay over 1e-9 s: 1e6 r dt.
    assert torque == pytest.approx(
        -0.5 * 1e6 * small.contact_radius**2 * 1e-9, rel=1e-4
    )


def test_keep_keeps_all():
    model = soft("keep", normal_force=2.0)
    assert model.shape_at(0.5) is model.shape_at(2.0)
    patch = fixed_at(2.0)
    other = pf.ReducedModelPublished(patch, PLAIN)
    state = np.array([3e-7, -2e-7, 1e-9])
    for load in (0.5, 2.0, 7.0):
        assert model.step(state, TWIST, load, 1e-4)[1] == pytest.approx(
            other.step(state, TWIST, load, 1e-4)[1], rel=1e-9
        )


@pytest.mark.parametrize("on_load_change", ["rescale", "keep"])
def test_a_reference_load_is_needed_to_keep_something(on_load_change):
    with refused(
        f"surface must have a normal_force when on_load_change='{on_load_change}'"
    ):
        soft(on_load_change)


def test_distributed_weights_follow_the_load():
    model = pf.DistributedModel(FINGER, ELASTIC)
    state = np.random.default_rng(3).normal(size=model.state_shape) * 3e-7
    loads = np.array([0.0, 0.5, 3.0])
    ends, wrenches = model.step(state, TWIST, loads, 1e-4)
    for load, end, wrench in zip(loads, ends, wrenches, strict=True):
        single_end, single_wrench = model.step(state, TWIST, load, 1e-4)
        assert end == pytest.approx(single_end, rel=1e-12) and wrench == pytest.approx(
            single_wrench, rel=1e-12
        )
        assert wrench == pytest.approx(model.wrench(end, TWIST, load), abs=1e-10)
    loaded = FINGER.weights(0.5) > 0.0
    other = pf.DistributedModel(fixed_at(0.5), ELASTIC)
    assert wrenches[1] == pytest.approx(
        other.step(state[:, loaded], TWIST, 0.5, 1e-4)[1], rel=1e-9
    )
    # Bristles of cells without load go on moving, as published: the rate does not look at the load.
    assert np.array_equal(model.rate(state, TWIST, 0.5), model.rate(state, TWIST, 3.0))
    got = model.jacobians(state, TWIST, loads)
    assert not got.wrench_load[0].any() and np.isfinite(got.wrench_load).all()
    assert got.wrench_load[1] * 0.5 == pytest.approx(
        model.wrench(state, TWIST, 0.5), rel=1e-12
    )


def test_zero_load_of_a_soft_finger():
    for model in (
        pf.DistributedModel(FINGER, ELASTIC),
        soft(),
        soft("keep", normal_force=2.0),
        soft("rescale", normal_force=2.0),
    ):
        state = np.full(model.state_shape, 1e-7)
        end, wrench = model.step(state, TWIST, 0.0, 1e-3)
        assert not end.any() and not wrench.any()
        assert not model.wrench(state, TWIST, 0.0).any()
        assert np.isfinite(model.rate(state, TWIST, 0.0)).all()
        assert all(
            np.isfinite(block).all() for block in model.jacobians(state, TWIST, 0.0)
        )


@pytest.mark.parametrize("model_type", [pf.ReducedModel, pf.ReducedModelPublished])
def test_a_model_takes_no_addresses_to_another_process(model_type):
    model = model_type(pf.ContactPatch.disc(0.01, cells=9), pf.LuGre())
    state = model.rest()
    twist = (0.01, 0.0, 1.0)
    expected = model.step(state, twist, 2.0, 1e-3)
    model.rate(state, twist, 2.0)
    copy = pickle.loads(pickle.dumps(model))
    assert not {"_fixed", "_fixed_record"} & set(vars(copy))
    for found, wanted in zip(copy.step(state, twist, 2.0, 1e-3), expected, strict=True):
        np.testing.assert_array_equal(found, wanted)
