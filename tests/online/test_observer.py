"""The observer: what it learns of a slip, what it does not of a part that sticks, and what bad samples do to it."""

import copy
import pickle

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from numba import njit

import planarfriction as pf
from planarfriction.online import FrictionObserver, Measurement
from planarfriction.online.loops import filter_state, square_root
from planarfriction.online.loops import friction_filter as kernels
from planarfriction_studies.rig import Gripper, Parts

LAW = pf.LuGre(mu_c=0.5, mu_s=0.55, v_s=2e-3, sigma_2=0.1)
PATCH = pf.ContactPatch.disc(6e-3, 21)
SURFACE = pf.LimitSurfaceTable(PATCH)
MODEL = pf.ReducedModel(PATCH, LAW)


def observer(**options):
    """Observer of a sensor whose bias is below its noise, unless the options say otherwise."""
    return FrictionObserver(
        MODEL, surface=SURFACE, **{"bias": (0.01, 0.01, 1e-4)} | options
    )


def sliding(mu=0.7, scale=1.1, load=4.0, count=1200, turning=True):
    """Samples of a slip without noise whose direction changes, of a patch `scale` times as large; begins at rest."""
    time = 1e-3 * np.arange(count)
    phase = 3.0 * time
    twist = np.stack(
        [
            0.03 * np.cos(phase),
            0.02 + 0 * time,
            (4.0 if turning else 0.0) * np.sin(phase),
        ],
        axis=-1,
    )
    wrench = mu * load * SURFACE.wrench(twist * (1.0, 1.0, scale)) * (1.0, 1.0, scale)
    for k in range(count):
        rests = k < 20
        velocity = (
            (0.0 if rests else 1.0) * twist[k - 4 if k > 4 else 0]
            if k % 8 == 0
            else None
        )
        fast = 1.0 + LAW.numbers.sigma_2 / mu * np.linalg.norm(
            twist[k] * (1.0, 1.0, scale * SURFACE.contact_radius)
        )
        yield Measurement(time[k], (0.5 if rests else fast) * wrench[k], load, velocity)


def taken(own, samples):
    for sample in samples:
        estimate = own.update(sample)
    return estimate


def test_a_slip_in_many_directions_determines_friction_and_radius():
    found = taken(observer(), sliding())
    assert found.mu_c == pytest.approx(0.7, rel=0.01)
    assert found.radius == pytest.approx(1.1 * SURFACE.contact_radius, rel=0.02)
    # Mu_s shows at the beginning of a slip alone.
    assert found.determined.tolist() == [
        True,
        False,
        True,
    ]
    assert found.slip > 0.95
    low, high = found.interval()[0]
    assert low < 0.7 < high < 0.75


def test_stiffness_that_does_not_grow_with_the_load_changes_nothing():
    # sliding friction does not depend on bristles
    fixed = FrictionObserver(
        pf.DistributedModel(PATCH, LAW, pad=pf.Pad.at_load(3.0)),
        surface=SURFACE,
    )
    ours = FrictionObserver(pf.DistributedModel(PATCH, LAW), surface=SURFACE)
    for sample in sliding(count=60):
        assert fixed.update(sample) == ours.update(sample)


def test_a_slide_without_a_turn_does_not_determine_the_radius():
    own = observer()
    found = taken(own, sliding(turning=False))
    assert found.determined.tolist() == [True, False, False]
    assert found.radius == pytest.approx(SURFACE.contact_radius, rel=0.02)  # as assumed
    information = np.diag(own.information())
    assert information[0] > 1e3 > 30.0 * information[2]


def test_a_part_that_sticks_says_only_what_it_holds():
    own = observer()
    for k in range(500):
        found = own.update(
            Measurement(
                1e-3 * k,
                (0.0, 0.002 * k, 0.0),
                2.0,
                np.zeros(3) if k % 8 == 0 else None,
            )
        )
    assert found.slip < 0.05
    assert (found.mu_c, found.radius) == pytest.approx((0.5, SURFACE.contact_radius))
    assert found.gauge == pytest.approx(0.5, rel=0.02)  # |f|/f_N at the end: filtered
    assert not found.determined.any()
    assert np.abs(own.information()).max() < 1e-6
    stronger = taken(
        own,
        [
            Measurement(0.5 + 1e-3 * k, (0.0, 1.6, 0.0), 2.0, np.zeros(3))
            for k in range(50)
        ],
    )
    assert stronger.mu_s == pytest.approx(0.8, rel=0.02)  # more than was assumed
    assert stronger.slip < 0.2


def test_gauge_is_what_the_holding_load_says():
    for wrench in ((0.3, 0.4, 0.0), (0.0, 0.0, 2e-3), (0.2, 0.5, 1.5e-3)):
        found = taken(
            observer(), [Measurement(1e-3 * k, wrench, 5.0) for k in range(60)]
        )
        expected = pf.planning.holding_load(wrench, PATCH, mu=1.0) / 5.0
        # Planes around the surface.
        assert found.gauge == pytest.approx(expected, rel=3e-3)


def bad_samples():
    nan = np.nan
    return {
        "no wrench": (Measurement(0.1, (nan, 0.0, 0.0), 4.0), 1),
        "no load": (Measurement(0.1, (0.0, 1.0, 0.0), nan), 1),
        "infinite": (Measurement(0.1, (0.0, np.inf, 0.0), 4.0), 1),
        "time back": (Measurement(-5.0, (0.0, 1.0, 0.0), 4.0, (0.02, 0.0, 0.0)), 2),
        "no time": (Measurement(nan, (0.0, 1.0, 0.0), 4.0), 2),
        "saturated": (Measurement(0.1, (0.0, 60.0, 0.0), 4.0), 4),
    }


@pytest.mark.parametrize("what", bad_samples())
def test_bad_samples_are_said_and_lose_nothing(what):
    sample, flag = bad_samples()[what]
    samples = list(sliding(count=600))
    clean = taken(observer(saturation=50.0), samples)
    own = observer(saturation=50.0)
    for k, each in enumerate(samples):
        found = own.update(each)
        if k % 50 == 25:
            time = sample.time if flag == 2 else each.time + 5e-4
            odd = own.update(sample._replace(time=time))
            assert odd.flags & flag
            assert all(
                np.isfinite(own.state[name]).all() for name in ("x", "root", "slip")
            )
    assert found.flags == 0
    assert found.mu_c == pytest.approx(float(clean.mu_c), rel=1e-3)
    assert found.radius == pytest.approx(float(clean.radius), rel=1e-2)


def reached(change=lambda sample: sample, empty=True, **options):
    """Estimate at the end of a slip in the gripper whose samples are changed."""
    patch = pf.ContactPatch.disc(9e-3, 21, pressure=pf.SoftFinger(c=9e-3, k=4.0))
    gripper = Gripper(
        Parts(
            [0.2], [3e-4], [(0.002, 0.0)], [0.7], radius=9e-3, growth=0.0, delay=0.02
        ),
        5.0,
    )
    own = FrictionObserver(pf.ReducedModel(patch, LAW), batch=1, **options)
    samples = [gripper.step(max(5.0 - 8e-3 * k, 1.2)) for k in range(600)]
    return taken(own, [*(gripper.empty_hand() if empty else ()), *map(change, samples)])


def changes():
    return {
        "reaction on the finger": (lambda s: s._replace(wrench=-s.wrench), 16),
        "velocity of the finger": (
            lambda s: s._replace(slip_velocity=-s.slip_velocity),
            16,
        ),
        "load in kg": (lambda s: s._replace(normal_force=s.normal_force / 9.81), 32),
        "load in grams": (
            lambda s: s._replace(normal_force=s.normal_force * 1e3 / 9.81),
            32,
        ),
        "velocity in mm/s": (
            lambda s: s._replace(slip_velocity=s.slip_velocity * 1e3),
            32,
        ),
        "nothing": (lambda s: s, 0),
    }


@pytest.mark.parametrize("name", changes())
def test_signs_and_units_that_are_wrong_are_said(name):
    change, flag = changes()[name]
    found = reached(change)
    assert found.flags == flag
    assert found.determined[0, 0] == (flag == 0)
    if flag == 16:  # nothing was learnt but the peak of mu_s, which has no sign
        assert found.mu_c == pytest.approx(0.7, rel=0.2)


@pytest.mark.parametrize(
    "bias, flag", [((0.03, 0.03, 3e-4), 8), ((0.01, 0.01, 1e-4), 0)]
)
def test_a_bias_that_no_empty_hand_showed_is_said(bias, flag):
    found = reached(empty=False, bias=bias)
    assert found.flags == flag
    assert found.determined[0, 0] == (flag == 0)


def test_a_wrench_beyond_all_friction_is_said_and_forgotten():
    own = observer()
    flags = []
    for k in range(200):
        load = 0.2 if 100 <= k < 150 else 4.0
        flags.append(
            int(
                own.update(
                    Measurement(1e-3 * k, (0.0, 1.0, 0.0), load, np.zeros(3))
                ).flags
            )
        )
    assert set(flags[:100]) == set(flags[170:]) == {0}
    assert set(flags[110:150]) == {32}  # |f|/f_N = 5


CLOCKS = {
    "missing": lambda now: np.nan,
    "zero": lambda now: 0.0,
    "stands": lambda now: 0.2,
    "backwards": lambda now: -now,
    "in ks": lambda now: 1e-3 * now,
    "in ms": lambda now: 1e3 * now,
    "set back": lambda now: now - 0.15,
}


@pytest.mark.parametrize("name", CLOCKS)
def test_a_clock_that_fails_leaves_the_period_of_the_samples(name):
    own = observer()
    steps = []
    for k in range(400):
        now = 2e-3 * k if k < 200 else CLOCKS[name](2e-3 * k)
        found = own._take(Measurement(now, (0.0, 1.0, 0.0), 4.0))
        steps.append(float(found["dt"]))
        assert (found["flags"] & 2 > 0) == (
            k >= 200 and (name != "set back" or k < 210)
        )
    # Ten samples are left out, until the fault is certain.
    assert sum(steps[200:]) == pytest.approx(0.4, abs=0.025)


def test_a_pause_is_not_a_clock_that_fails():
    own = observer()
    times = *(1e-3 * np.arange(150)), 0.4, 0.401
    steps = [
        float(own._take(Measurement(time, (0.0, 1.0, 0.0), 4.0))["dt"])
        for time in times
    ]
    assert steps[-2:] == pytest.approx([0.251, 1e-3])


def test_no_load_is_said_once_the_hand_has_gripped():
    own = observer()
    empty = Measurement(0.0, (0.0, 0.0, 0.0), 0.0)
    assert own.update(empty).flags == 0
    assert own.update(Measurement(1e-3, (0.0, 1.0, 0.0), 4.0)).flags == 0
    assert own.update(empty._replace(time=2e-3)).flags == 1


@pytest.mark.parametrize(
    "part, flag", [((1.0, 1.0, 1.0), 0), ((1.0, 1.0, 0.0), 64), ((0.3, 0.3, 1.0), 64)]
)
def test_a_wrench_that_contradicts_what_was_found_is_said(part, flag):
    own = observer()
    samples = list(sliding(count=900))
    found = taken(own, samples[:600])
    assert found.flags == 0
    flags = {
        int(own.update(s._replace(wrench=np.asarray(s.wrench) * part)).flags)
        for s in samples[600:]
    }
    assert flags <= {0, flag, 32} and (flag in flags)


NUMBERS = st.floats(allow_nan=True, allow_infinity=True) | st.floats(-10.0, 10.0)


NOTHING = [(0.0, (0.0, 0.0, 0.0), 0.0, None)] * 13
"""Samples after which the part has slid for long."""


@settings(max_examples=60, deadline=None)
@example(
    [
        *NOTHING,
        (2.0, (0.0, 0.0, 351.0), 1.0, (0.0, 0.0, 1.0)),
        (3.0, (0.0, 0.0, 0.0), 0.0, (0.0, 0.0, 1.0)),
    ]
)
@example(
    [
        *NOTHING,
        (1.0, (0.0, 0.0, 2.0), 13.0, (0.0, 0.0, 3.0)),
        (2.0, (0.0, 0.0, 0.0), 1.0, (0.0, 0.0, 1.0)),
    ]
)
@example(
    [
        *NOTHING,
        (1.0, (0.0, 0.0, 2.0), 10.0, (0.0, 0.0, 4.0)),
        (2.0, (0.0, 1.0, 0.0), 0.0, (0.0, 0.0, 1.0)),
    ]
)
@given(
    st.lists(
        st.tuples(
            NUMBERS,
            st.tuples(NUMBERS, NUMBERS, NUMBERS),
            NUMBERS,
            st.none() | st.tuples(NUMBERS, NUMBERS, NUMBERS),
        ),
        max_size=20,
    )
)
def test_whatever_comes_the_estimate_stays_finite(samples):
    own = observer()
    for k, sample in enumerate(samples):
        found = own.update(Measurement(*sample))
        found = own.update(
            Measurement(1e-3 * k, (0.0, 1.0, 0.0), 4.0, (0.0, 0.03, 0.0))
        )
        assert all(np.isfinite(value).all() for value in found)
        assert (found.interval() > 0.0).all()


def test_a_copy_of_the_state_is_a_checkpoint():
    samples = list(sliding(count=400))
    own = observer()
    taken(own, samples[:200])
    kept = own.state.copy()
    other = copy.deepcopy(own)
    pickled = pickle.loads(pickle.dumps(own))
    end = taken(own, samples[200:])
    assert taken(other, samples[200:]) == end
    assert taken(pickled, samples[200:]) == end
    own.state[...] = kept
    assert taken(own, samples[200:]) == end


def test_a_batch_is_many_observers():
    several = [list(sliding(mu=mu, count=300)) for mu in (0.4, 0.6, 0.8)]
    own = observer(batch=3)
    for samples in zip(*several, strict=True):
        velocity = (
            None
            if samples[0].slip_velocity is None
            else np.array([s.slip_velocity for s in samples])
        )
        together = own.update(
            Measurement(
                samples[0].time, np.array([s.wrench for s in samples]), 4.0, velocity
            )
        )
    alone = [taken(observer(), samples) for samples in several]
    assert together.mu_c == pytest.approx(
        [float(each.mu_c) for each in alone], rel=1e-12
    )
    assert together.slip.shape == (3,)


@njit
def updated(state, h, column):
    square_root.measure(state, h, 0.7, 0.04, column)
    square_root.spread(state, 3, 0.25, column)
    square_root.reset(state, 1, 5.0, 0.5, column)


def test_measurements_and_spreads_are_those_of_a_kalman_filter():
    rng = np.random.default_rng(0)
    n = kernels.N
    state = np.zeros(1, filter_state.STATE)[0]
    column = np.zeros(n)
    state["root"] = root = np.tril(rng.normal(size=(n, n)))
    state["x"] = mean = rng.normal(size=n)
    covariance = root @ root.T
    h = rng.normal(size=n)
    updated(state, h, column)
    gain = covariance @ h / (h @ covariance @ h + 0.04)
    covariance = covariance - np.outer(gain, h @ covariance)
    covariance[3, 3] += 0.25
    covariance[1] = 0.0
    covariance[:, 1] = 0.0
    covariance[1, 1] = 0.25
    found = state["root"]
    assert found @ found.T == pytest.approx(covariance, abs=1e-12)
    assert state["x"] == pytest.approx(
        np.where(np.arange(n) == 1, 5.0, mean + 0.7 * gain)
    )


@njit
def moved(own, state, column):
    kernels._move(own, state, column)


def test_errors_of_the_count_do_not_add_up():
    # x = (remainder e, twist, ...); a window of v counts: twist = v + (e - e')/span, e' again and kept
    rng = np.random.default_rng(1)
    n = kernels.N
    span = 1.0 / 120.0
    own = observer()._filter
    column = np.zeros(n)
    state = np.zeros(1, filter_state.STATE)[0]
    state["root"] = root = np.tril(rng.normal(size=(n, n)))
    state["x"][:3] = (1e-6, 2e-6, -1e-6)
    state["chain"] = 3.0
    state["span"] = span
    state["velocity"] = 0.01, 0.02, 0.03
    before = state["x"][:3].copy()
    moved(own, state, column)
    map_ = np.eye(n)
    map_[:6, :6] = 0.0
    map_[3:6, :3] = np.eye(3) / span
    new = np.zeros((n, 3))
    new[:3], new[3:6] = np.diag(own.remainder), -np.diag(own.remainder) / span
    found = state["root"]
    assert found @ found.T == pytest.approx(
        map_ @ root @ root.T @ map_.T + new @ new.T, rel=1e-9, abs=1e-15
    )
    assert state["x"][3:6] == pytest.approx((0.01, 0.02, 0.03) + before / span)
    assert not state["x"][:3].any()


def test_an_empty_hand_gives_the_bias():
    own = observer(bias=(0.05, 0.05, 5e-4))
    plain = observer(bias=(0.05, 0.05, 5e-4))
    bias = np.array([0.06, -0.04, 4e-4])
    load = np.array([0.0, 1.0, 0.0])
    for k in range(100):
        own.update(Measurement(1e-3 * k, bias, 0.0))
        # Holds something: it cannot be empty.
        own.update(Measurement(1e-3 * k + 5e-4, bias + 1.5 * load, 0.0))
    for k in range(100, 200):
        found, other = (
            each.update(Measurement(1e-3 * k, bias + load, 4.0))
            for each in (own, plain)
        )
    assert own.bias == pytest.approx(bias, rel=1e-2)
    # As controllers see it.
    freed = own._take(Measurement(1.0, bias + load, 4.0))["wrench"]
    assert freed == pytest.approx(load, abs=1e-2 * np.abs(bias).max())
    assert found.gauge == pytest.approx(0.25, rel=5e-3)
    # Without an empty hand the bias is load.
    assert abs(other.gauge / 0.25 - 1.0) > 0.02


def test_a_slip_in_the_gripper_is_seen_and_its_friction_found():
    count = 40
    mu = np.linspace(0.35, 0.8, count)
    parts = Parts(
        [0.2] * count,
        [3e-4] * count,
        [(0.004, 0.0)] * count,
        mu,
        radius=9e-3,
        growth=0.0,
        delay=0.01,
    )
    patch = pf.ContactPatch.disc(9e-3, 21, pressure=pf.SoftFinger(c=9e-3, k=4.0))
    own = FrictionObserver(pf.ReducedModel(patch, LAW), batch=count)
    gripper = Gripper(parts, 5.0, seed=1)
    seen = np.full(count, np.nan)
    began = np.full(count, np.nan)
    for k in range(700):
        found = own.update(gripper.step(5.0 - 6e-3 * k))
        moved = (
            np.hypot(*gripper.slip[:, :2].T) + 4e-3 * np.abs(gripper.slip[:, 2]) > 1e-4
        )
        began = np.where(np.isnan(began) & moved, gripper.time, began)
        seen = np.where(np.isnan(seen) & (found.slip > 0.5), gripper.time, seen)
    late = seen - began - 0.01
    assert np.nanmax(late) < 0.02
    assert np.nanmin(late) > -0.05  # no alarm long before
    assert np.isfinite(late).all()
    assert np.median(np.abs(found.mu_c / mu - 1.0)) < 0.02
