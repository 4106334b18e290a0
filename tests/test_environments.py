"""Draws of parameters for environments of their own."""

import numpy as np
import pytest
from scipy import stats

import planarfriction as pf
from tests.support.refusals import refused

LAW = pf.LuGre(mu_c=0.4, mu_s=0.5)


def test_draws_fill_their_ranges_and_repeat():
    ranges = {
        "mu_c": (0.2, 0.8),
        "v_s": stats.loguniform(1e-4, 1e-2),
        "scale": (0.9, 1.1),
        "centre_x": (-1e-3, 1e-3),
    }
    drawn = pf.randomise(LAW, ranges, 2000, seed=3)
    for name, low, high in [
        ("mu_c", 0.2, 0.8),
        ("v_s", 1e-4, 1e-2),
        ("scale", 0.9, 1.1),
        ("centre_x", -1e-3, 1e-3),
    ]:
        values = drawn[name]
        assert values.shape == (2000,) and low <= values.min() < values.max() <= high
        assert values.min() < low + 0.01 * (
            high - low
        ) and values.max() > high - 0.01 * (high - low)
    # 50 % more than three standard errors.
    assert np.median(drawn["v_s"]) == pytest.approx(1e-3, rel=0.15)
    np.testing.assert_allclose(drawn["mu_s"], 1.25 * drawn["mu_c"], rtol=1e-14)
    again, other = (pf.randomise(LAW, ranges, 2000, seed=seed) for seed in (3, 4))
    assert all(np.array_equal(drawn[name], again[name]) for name in drawn)
    assert not np.array_equal(drawn["mu_c"], other["mu_c"])


def test_static_friction_is_never_below_sliding_friction():
    both = pf.randomise(LAW, {"mu_c": (0.2, 0.8), "mu_s": (0.2, 0.8)}, 500)
    assert (both["mu_s"] >= both["mu_c"]).all() and (both["mu_s"] > both["mu_c"]).any()
    assert (pf.randomise(LAW, {"mu_s": (0.1, 0.8)}, 500)["mu_s"] >= 0.4).all()


@pytest.mark.parametrize(
    ("ranges", "message"),
    [
        ({"mu": (0.1, 0.2)}, "ranges key must be one of"),
        (
            {"mu_c": (0.3, 0.2)},
            "mu_c must have the lower end of its range first, got 0.3, 0.2",
        ),
        ({"scale": (-0.2, -0.1)}, "scale must be > 0"),
        (
            {"breakaway_ratio": (1.0, 1.0)},
            "breakaway_ratio must be >= 0 and < 1, got 1.0",
        ),
        ({"v_s": 0.1}, "v_s must have shape"),
    ],
)
def test_ranges_that_break_rules_are_refused(ranges, message):
    with refused(message):
        pf.randomise(LAW, ranges, 5)


def test_counts_beyond_memory_are_refused():
    with refused("count must be at most"):
        pf.randomise(LAW, {"mu_c": (0.1, 0.2)}, 10**9)
