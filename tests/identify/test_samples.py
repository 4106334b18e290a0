"""Draws from an identification: its errors, correlations and bounds, as parameters of environments."""

import numpy as np
import pytest

import planarfriction as pf
from planarfriction.environments import check
from planarfriction.identify.result import Identification

LAW = pf.LuGre(mu_c=0.5, mu_s=0.55, elasto_plastic=0.9)
PATCH = pf.ContactPatch.disc(radius=0.01, cells=7)
COUNT = 20_000


def made(parameters, correlations=None, patch=PATCH):
    """An identification with `{name: (estimate, standard error)}`."""
    values, errors = np.array(list(parameters.values())).T
    known = np.eye(len(values)) if correlations is None else np.array(correlations)
    model = pf.DistributedModel(patch, LAW)
    noise = np.ones(1)
    none = ()
    return Identification(
        tuple(parameters),
        values,
        errors,
        known,
        none,
        noise,
        (("x", "m"),),
        none,
        LAW,
        model,
        (1, 1),
    )


def test_draws_have_the_errors_and_correlations_of_the_estimates():
    found = made(
        {"mu_c": (0.5, 0.02), "sigma_1": (100.0, 5.0), "v_s": (1e-3, 2e-4)},
        [[1.0, 0.6, 0.0], [0.6, 1.0, -0.5], [0.0, -0.5, 1.0]],
    )
    drawn = found.sample(COUNT, seed=1)
    logs = np.array([np.log(drawn["mu_c"]), drawn["sigma_1"], np.log(drawn["v_s"])])
    # five standard errors of 20 000 draws
    np.testing.assert_allclose(logs.std(axis=1), [0.04, 5.0, 0.2], rtol=0.025)
    np.testing.assert_allclose(np.corrcoef(logs), found.correlations, atol=0.035)
    assert np.median(drawn["mu_c"]) == pytest.approx(0.5, rel=2e-3)
    low, high = found.intervals()["v_s"]
    assert ((drawn["v_s"] > low) & (drawn["v_s"] < high)).mean() == pytest.approx(
        0.95, abs=0.01
    )
    assert all(
        np.array_equal(drawn[name], found.sample(COUNT, seed=1)[name]) for name in drawn
    )
    assert not np.array_equal(drawn["mu_c"], found.sample(COUNT, seed=2)["mu_c"])


def test_draws_stay_in_bounds_and_fit_each_other():
    found = made(
        {
            "mu_c": (0.5, 0.1),
            "breakaway_ratio": (0.95, 0.3),
            "sigma_2": (0.01, 0.1),
            "gamma": (2.0, 0.1),
        }
    )
    drawn = check(found.sample(2000))
    assert set(drawn) == {"mu_c", "mu_s", "breakaway_ratio", "sigma_2"}
    assert drawn["breakaway_ratio"].max() <= 0.99 and drawn["sigma_2"].min() == 0.0
    # a static coefficient that was held grows with a sliding one that passes it
    np.testing.assert_array_equal(drawn["mu_s"], np.maximum(drawn["mu_c"], 0.55))


def test_what_the_data_leave_open_varies_by_the_prior():
    drawn = made({"v_s": (1e-3, np.inf), "sigma_1": (100.0, np.inf)}).sample(COUNT)
    assert np.log(drawn["v_s"]).std() == pytest.approx(3.0, rel=0.03)  # log 20
    assert (drawn["sigma_1"] == 100.0).all()


def test_size_and_place_are_those_of_the_fitted_patch():
    """Draws of radius and centre of pressure are those of the patch `centre + scale * rho` that they describe."""
    centre = np.array([0.003, -0.001])
    patch = pf.ContactPatch(PATCH.positions + centre, PATCH.areas)
    radius = patch.contact_radius()
    found = made(
        {
            "contact_radius": (radius, 1e-3),
            "centre_x": (0.003, 1e-4),
            "mu_c": (0.5, 0.01),
        },
        patch=patch,
    )
    drawn = found.sample(COUNT)
    assert (drawn["scale"] * radius).std() == pytest.approx(1e-3, rel=0.03)
    middle = drawn["scale"] * centre[0] + drawn["centre_x"]
    assert middle.mean() == pytest.approx(
        0.003, abs=5e-6
    ) and middle.std() == pytest.approx(1e-4, rel=0.03)
    np.testing.assert_allclose(
        drawn["scale"] * centre[1] + drawn["centre_y"], centre[1], atol=1e-12
    )
