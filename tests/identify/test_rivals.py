"""Models that compete with the best one: they count where they fit as well over its noise."""

from types import SimpleNamespace

import pytest

import planarfriction as pf
from planarfriction.identify import Log, identify_lugre
from planarfriction.identify.verdicts import SLIPPED, rivals
from planarfriction.patch import PUBLISHED_PATCHES
from planarfriction.scenes import driven


def test_rivals_fit_as_well_over_the_noise_of_the_best():
    def candidate(model, cost, rejected=False):
        return SimpleNamespace(
            score=SimpleNamespace(model=model),
            uncertainty=SimpleNamespace(rejected=rejected),
            fit=SimpleNamespace(sigma=model),
            cost=lambda sigma: cost if sigma == "best" else 0.0,
        )

    best = candidate("best", 100.0)
    near = candidate("other", 99.0 + SLIPPED)
    same = candidate("best", 99.0 + SLIPPED)
    far = (
        candidate("other", 101.0 + SLIPPED),
        candidate("best", 101.0 + SLIPPED),
        candidate("third", 100.0, True),
    )
    assert rivals(best, [near, best, *far, same]) == [near.score, same.score]


def test_a_run_without_noise_shows_all_but_the_damping_of_bristles():
    """Other models leave less than sensors' noise, but far more than the right one.

    The reduced model as published, with the bristles that made this log, ends far from it: it is tried nevertheless.
    """
    patch = PUBLISHED_PATCHES["Circle"]()
    law = pf.LuGre(mu_s=1.2, elasto_plastic=0.9)
    log = Log.from_solution(pf.simulate(driven(pf.DistributedModel(patch, law))))
    found = identify_lugre(log, patch)
    assert (found.chosen, found.law.elasto_plastic) == (
        "distributed",
        pf.ElastoPlastic(0.9),
    )
    assert found.estimates["sigma_0"] == pytest.approx(law.sigma_0, rel=0.05)
    assert found.estimates["mu_s"] == pytest.approx(law.mu_s, rel=1e-3)
    names = ("mu_c", "mu_s", "v_s", "gamma", "sigma_0", "sigma_2", "contact_radius")
    assert tuple(name for name in found.names if found.identifiable(name)) == names
    for name in names:
        low, high = found.intervals()[name]
        assert (
            low
            < (
                patch.contact_radius()
                if name == "contact_radius"
                else getattr(law, name)
            )
            < high
        )
