"""The table of a made-up fit: digits, intervals, the strongest pairs, verdicts and what a rig adds."""

import numpy as np
import pytest

import planarfriction as pf
from planarfriction.identify import Identification
from planarfriction.identify.result import _digits
from planarfriction.identify.verdicts import ModelScore, Verdict


def made():
    """A fit of four parameters, of which sigma_1 is unknown and mu_c and mu_s go together."""
    names = ("mu_c", "mu_s", "sigma_0", "sigma_1")
    correlations = np.eye(4)
    for i, j, number in ((0, 1, -0.9), (1, 2, 0.5), (0, 2, 0.49), (2, 3, 0.7)):
        correlations[i, j] = correlations[j, i] = number
    law = pf.LuGre(mu_c=0.5)
    values = np.array([0.5, 0.61234567, 2e4, 30.0])
    errors = np.array([0.01, 0.0204, 400.0, np.inf])
    verdicts = (
        Verdict("fit", True, "it explains the data"),
        Verdict("sigma_1", False, "no sample shows it"),
    )
    wave = np.array([0.0, 1.0, -1.0, 1.0, -1.0, 1.0])[:, None]
    history = {
        "name": "log",
        "time": np.arange(6.0),
        "measured": 2.0 + 0.1 * wave,
        "predicted": np.full((6, 1), 2.0),
    }
    model = pf.ReducedModel(pf.ContactPatch.disc(0.01, 5), law)
    score = ModelScore("reduced", "plain bristles", 1.0, 1.23456, False, {})
    return Identification(
        names, values, errors, correlations, verdicts, np.array([0.1]), (("fx", "N"),), (history,), law, model, (1, 2),
        scores=(score,), chosen="reduced", samples=(1500, 3000),
    )  # fmt: skip


TABLE = """\
parameter             value  std. error  95 % interval            unit
mu_c                    0.5        0.01  0.4808 to 0.52           -
mu_s                0.61235        0.02  0.5736 to 0.6537         -
sigma_0               20000         400  19230 to 20800           1/m
sigma_1                  30     unknown  not identifiable         s/m
reduced chi-square 1.235 (1,500 samples, 4 parameters)

correlations of 0.5 and more
mu_c, mu_s                 -0.900
sigma_0, sigma_1           +0.700
mu_s, sigma_0              +0.500

Identified: mu_c, mu_s, sigma_0. Not identifiable: sigma_1.
It explains the data.

sigma_1: no sample shows it"""


def test_a_table_has_what_a_fit_says():
    assert made().table() == TABLE


def test_plain_data_have_none_for_what_is_infinite():
    data = made().to_dict()
    assert (
        data["parameters"]["sigma_1"]["standard_error"] is None
        and not data["parameters"]["sigma_1"]["identifiable"]
    )
    assert data["parameters"]["mu_c"]["interval_95"] == pytest.approx(
        0.5 * np.exp([-0.0392, 0.0392])
    )
    # of +-1 in turn: 5 of the sum at once, -4 after one sample, 3 after two
    assert data["residual_correlations"]["fx"][:3] == pytest.approx([1.0, -0.8, 0.6])
    assert data["starts"] == {"agreeing": 1, "total": 2} and data["samples"] == {
        "used": 1500,
        "total": 3000,
    }


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (1e-3, "0.001"),
        (9.9e-4, "0.00099"),
        (123456.7, "123500"),
        (1.5e6, "1.5e+06"),
        (-2.0, "-2"),
    ],
)
def test_numbers_have_an_exponent_where_they_have_many_zeros(value, text):
    assert _digits(value, 4) == text
