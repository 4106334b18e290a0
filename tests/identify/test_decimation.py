"""Decimation of long logs: nothing that happens is lost, wrenches are those of the whole log, memory is bounded."""

import tracemalloc

import numpy as np
import pytest

from planarfriction.derivatives import PARAMETERS, parameters_of
from planarfriction.identify import Log
from planarfriction.identify.decimation import WINDOW, decimated, farthest, samples_of
from planarfriction.identify.simulators import SIMULATORS, Prediction
from planarfriction.models import ReducedModelPublished
from tests.support.identification_logs import (
    LAW,
    LOAD,
    PATCH,
    clean_log,
    excitation,
    fitted,
    noisy,
    truth,
)

SIZE = 0.0066
"""Contact radius of the patch [m]."""


def long_motion(rows):
    """Times and twists at 1 kHz: bursts of the usual excitation, with holds in between."""
    time, twist = excitation(duration=2.0)
    pulse = (
        np.clip(0.5 + 8.0 * (0.3 - np.cos(2 * np.pi * time / time[-1])), 0.0, 1.0)[
            :, None
        ]
        ** 2
    )
    size = np.exp(np.random.default_rng(0).uniform(-3.0, 0.0, -(-rows // len(time))))
    whole = np.concatenate([each * pulse * twist for each in size])[:rows]
    return np.arange(rows) / 1000.0, whole


@pytest.fixture(scope="module")
def log():
    return clean_log(*long_motion(24_000))


# ---------------------------------------------------------------------- what is chosen


def test_a_point_far_from_all_others_is_chosen():
    points = np.random.default_rng(0).normal(size=(1000, 3))
    points[617] = 9.0
    assert 617 in farthest(points, 2)


def test_no_point_is_farther_than_chosen_ones_are_from_each_other():
    points = np.random.default_rng(0).normal(size=(500, 2))
    apart = np.linalg.norm(
        points[:, None] - points[(chosen := farthest(points, 30))], axis=2
    )
    between = apart[chosen] + np.where(np.eye(len(chosen)) > 0.0, np.inf, 0.0)
    assert apart.min(axis=1).max() <= between.min()


@pytest.mark.parametrize("at", [1, WINDOW, 31_415, 40_000, 99_998])
def test_a_slip_of_one_sample_in_a_long_hold_is_never_lost(at):
    """Wherever it is: the twist of that sample is the only one above the noise."""
    random = np.random.default_rng(at)
    twist = 1e-6 * random.standard_normal((100_000, 3))
    twist[at, 0] = 1e-3
    (cut,) = decimated(
        [Log(np.arange(100_000) / 1000.0, twist, np.ones((100_000, 3)), LOAD)],
        SIZE,
        2000,
    )
    assert at / 1000.0 in cut.time[cut.inner]


@pytest.mark.parametrize("at", [20_100, 70_007])
def test_a_short_change_of_the_load_is_never_lost(at):
    load = np.full(100_000, LOAD)
    load[at : at + 3] = 0.9 * LOAD
    (cut,) = decimated(
        [
            Log(
                np.arange(100_000) / 1000.0,
                np.zeros((100_000, 3)),
                np.ones((100_000, 3)),
                load,
            )
        ],
        SIZE,
        2000,
    )
    assert at / 1000.0 in cut.time[cut.inner]


def test_short_logs_stay_whole(log):
    assert decimated([log, log], SIZE, 48_000) == (log, log)
    assert samples_of([log]) == (24_000, 24_000)


def test_each_of_many_logs_keeps_its_share(log):
    short = Log(log.time[:100], log.twist[:100], log.wrench[:100], LOAD)
    cut = decimated([log, log, short], SIZE, 10_000)
    assert samples_of(cut)[1] == 48_100
    assert 9_000 < samples_of(cut)[0] <= 10_000 + WINDOW
    assert cut[2] == short


# ---------------------------------------------------------------------- the motion in between


def test_the_whole_motion_is_stepped_through(log):
    """Displacements and durations of windows and gaps add up to those of the log, to rounding."""
    (cut,) = decimated([log], SIZE, 6000)
    steps = Prediction(SIMULATORS["reduced-published"](PATCH, LAW), cut, cut.twist)
    twists, _, dt = steps._inputs
    assert len(cut.gaps) > 5
    assert dt[1:].sum() == pytest.approx(cut.time[-1] - log.time[0], rel=1e-12)
    rows = np.searchsorted(log.time, cut.time[-1]) + 1
    mean = 0.5 * (log.twist[1:rows] + log.twist[: rows - 1])
    each = np.diff(log.time[:rows])
    assert twists[1:].T @ dt[1:] == pytest.approx(mean.T @ each, abs=1e-12)


@pytest.mark.parametrize("name", list(SIMULATORS))
def test_wrenches_are_those_of_the_whole_log(log, name):
    """To 0.2 % of the largest wrench, a fifth of a usual noise, also right after holds."""
    vector = parameters_of(ReducedModelPublished(PATCH, LAW))
    vector[PARAMETERS.index("contact_radius")] = PATCH.contact_radius()
    simulator = SIMULATORS[name](PATCH, LAW)
    (cut,) = decimated([log], SIZE, 6000)
    whole = Prediction(simulator, log, log.twist).wrenches(vector)
    found = Prediction(simulator, cut, cut.twist).wrenches(vector)
    off = found[cut.inner] - whole[np.searchsorted(log.time, cut.time[cut.inner])]
    assert (np.abs(off).max(axis=0) < 2e-3 * np.abs(whole).max(axis=0)).all()


# ---------------------------------------------------------------------- the fit


def test_estimates_of_a_long_log_are_those_of_the_whole(log):
    """Within three standard errors of the truth and of the whole; errors grow as the root of fewer samples says."""
    seen = noisy(log, 0)
    options = {"model": "reduced-published", "start": LAW, "starts": 1}
    whole = fitted(seen, samples=24_000, **options)
    cut = fitted(seen, samples=8_000, **options)
    assert (whole.samples, cut.samples) == ((24_000, 24_000), (8_000, 24_000))
    assert "8,000 were used" in cut.table() and "were used" not in whole.table()
    assert cut.to_dict()["samples"] == {"used": 8_000, "total": 24_000}
    for name, value in truth().items():
        assert cut.identifiable(name)
        assert abs(cut.estimates[name] - value) < 3.0 * cut.errors[name], name
        assert (
            abs(cut.estimates[name] - whole.estimates[name]) < 3.0 * cut.errors[name]
        ), name
        assert 0.9 * whole.errors[name] < cut.errors[name] < 3.0 * whole.errors[name], (
            name
        )


@pytest.mark.slow
def test_errors_of_long_logs_are_honest(log):
    """Ten seeds: 80 z-scores have a spread below 1.25, as errors have an allowance, and none is beyond 4."""
    z = []
    for seed in range(10):
        found = fitted(
            noisy(log, seed),
            model="reduced-published",
            start=LAW,
            starts=1,
            samples=6_000,
        )
        z += [
            (found.estimates[name] - value) / found.errors[name]
            for name, value in truth().items()
        ]
    assert np.sqrt(np.mean(np.square(z))) < 1.25
    assert np.abs(z).max() < 4.0


def test_memory_is_bounded():
    """A few arrays as long as the log, for all rows are looked at; its windows take the same for any length."""
    time, twist = long_motion(400_000)
    whole = Log(time, twist, np.sin(twist), LOAD)
    tracemalloc.start()
    (cut,) = decimated([whole], SIZE, 20_000)
    kept, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert most < 20 * time.nbytes
    assert kept < 20_000 * 8 * 50
    assert sum(len(gap.dt) for gap in cut.gaps) < 2 * 20_000
