"""Rules on what the data say of a parameter, on made-up evidence on either side of each limit."""

import dataclasses
import math

import numpy as np
import pytest

from planarfriction.identify.verdicts import Evidence, interval, judge_parameter

NAMES = ("mu_c", "mu_s", "v_s", "sigma_0", "sigma_1", "sigma_2", "contact_radius")
VALUES = np.array([0.5, 0.6, 2e-3, 2e4, 30.0, 0.7, 7e-3])
SPEEDS = np.geomspace(1e-4, 0.1, 500)


def evidence(correlation=(), seen=100.0, values=None, errors=None, bound=(), **changes):
    """Return evidence that determines each parameter to 1 %, with changes."""
    value = VALUES.copy()
    error = 0.01 * VALUES
    for array, given in ((value, values), (error, errors)):
        for name, number in (given or {}).items():
            array[NAMES.index(name)] = number
    correlations = np.eye(len(NAMES))
    for one, other, number in correlation:
        i = NAMES.index(one)
        j = NAMES.index(other)
        correlations[i, j] = correlations[j, i] = number
    at_bound = np.isin(NAMES, bound)
    base = Evidence(
        NAMES,
        value,
        error,
        correlations,
        at_bound,
        seen / value[None],
        SPEEDS,
        0.5 * SPEEDS,
        np.array([2.0, 3.0]),
        1.5,
    )
    return dataclasses.replace(base, **changes)


NO_TORQUE = {"measured": np.array([True, True, False])}
TOGETHER = {"correlation": [("sigma_0", "sigma_1", 0.99)]}
OTHERS = {"correlation": [("contact_radius", "sigma_0", 0.99)]}
CASES = [
    *((name, {}, None, "") for name in NAMES),
    (
        "v_s",
        {"without_slip": 11.9, "largest_coefficient": 0.3},
        False,
        "never slips, friction reaches 0.3 of the load",
    ),
    ("v_s", {"without_slip": 12.1}, None, ""),
    ("sigma_0", {"without_slip": 0.0}, None, ""),
    (
        "mu_s",
        {"errors": {"mu_c": 0.151}},
        False,
        "mu_c is unknown, as no sample is much faster",
    ),
    ("mu_s", {"errors": {"mu_c": 0.149}}, None, ""),
    ("mu_c", {"bound": ("mu_c",)}, False, "the fit ran into the bound 0.5"),
    (
        "mu_s",
        {"bound": ("mu_s",), "values": {"mu_s": 0.5004}},
        False,
        "no friction above mu_c was seen: equal to mu_c",
    ),
    (
        "mu_s",
        {"bound": ("mu_s",), "values": {"mu_s": 0.5006}},
        False,
        "the fit ran into the bound 0.501",
    ),
    ("v_s", {"errors": {"mu_s": 0.03, "mu_c": 0.04}}, None, ""),  # 1.96 x 0.05 < 0.1
    (
        "v_s",
        {"errors": {"mu_s": 0.032, "mu_c": 0.041}},
        False,
        "mu_s cannot be distinguished from mu_c",
    ),
    (
        "v_s",
        {"errors": {"mu_s": 0.1, "mu_c": 0.1}, "correlation": [("mu_s", "mu_c", 0.9)]},
        None,
        "",
    ),
    ("sigma_0", {"errors": {"sigma_0": 5.9e3}}, None, ""),
    (
        "sigma_0",
        {"errors": {"sigma_0": 6.2e3}},
        False,
        "standard error 31 % of the estimate",
    ),
    (
        "sigma_0",
        {"errors": {"sigma_0": 6.2e3}, "seen": 0.9},
        False,
        "changes no sample by more than 0.9 times the noise",
    ),
    (
        "sigma_0",
        {"errors": {"sigma_0": 6.2e3}, **TOGETHER},
        False,
        "separated from sigma_1 (correlation 0.99)",
    ),
    (
        "sigma_0",
        {"errors": {"sigma_0": 5e2}, **TOGETHER},
        True,
        "strongly correlated with sigma_1 (0.99)",
    ),
    ("sigma_0", TOGETHER, None, ""),  # 1 % is well known
    (
        "contact_radius",
        {"errors": {"contact_radius": 3e-3}, "spins": 0.0 * SPEEDS},
        False,
        "no spin",
    ),
    (
        "contact_radius",
        {"errors": {"contact_radius": 3e-3}, **NO_TORQUE},
        False,
        "only the torque depends on it",
    ),
    (
        "contact_radius",
        {**OTHERS, **NO_TORQUE},
        False,
        "(correlation 0.99) without the torque, and tau is 0 throughout",
    ),
    ("sigma_1", {"errors": {"sigma_1": 15.2}}, None, ""),
    (
        "sigma_1",
        {"errors": {"sigma_1": 15.4}},
        False,
        "cannot be distinguished from 0, so the corner frequency",
    ),
    (
        "sigma_2",
        {"errors": {"sigma_2": 0.36}},
        True,
        "cannot be distinguished from 0, at most 1.41 s/m",
    ),
    ("sigma_2", {"errors": {"sigma_2": 0.35}}, None, ""),
]


@pytest.mark.parametrize(("name", "changes", "identifiable", "words"), CASES)
def test_a_verdict_on_a_parameter(name, changes, identifiable, words):
    verdict = judge_parameter(evidence(**changes), NAMES.index(name))
    if identifiable is None:
        assert verdict is None
    else:
        assert (verdict.parameter, verdict.identifiable) == (
            name,
            identifiable,
        ) and words in verdict.reason


def test_intervals_are_factors_or_differences():
    assert interval("sigma_0", 2e4, 4e3) == pytest.approx(
        (2e4 / math.exp(0.392), 2e4 * math.exp(0.392))
    )
    assert interval("centre_x", 1e-3, 1e-3) == pytest.approx((-0.96e-3, 2.96e-3))
    assert interval("sigma_1", 10.0, 10.0) == pytest.approx((0.0, 29.6))
