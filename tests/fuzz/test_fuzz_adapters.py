"""Plants that change behind the adapter's back: said in one line, and nothing is said of others."""

from __future__ import annotations

import random
import warnings

import numpy as np
import pytest
import some
from attack import attack
from judge import CASES, Broken

import planarfriction as pf


@attack("adapters", 1)
def test_drake_contexts_with_other_parameters(draw: random.Random) -> None:
    pytest.importorskip("pydrake", reason="Drake is not installed")
    from tests.support.drake_scenes import sliding

    model = pf.DistributedModel(pf.ContactPatch.disc(0.1, 5), pf.LuGre(mu_c=0.3, sigma_0=1e5, elasto_plastic=0.9))
    run = sliding("disc", draw.choice(["point", "hydroelastic"]), 2e-3, model)
    run.to(0.05)
    times = draw.choice([1.0, 1.0 + some.spread(draw, -1, 1)])
    run.plant.GetBodyByName("disc").SetMass(run.context, 0.2 * times)
    run.plant.SetVelocities(run.context, [0.0, 0.0, draw.uniform(-10.0, 10.0), draw.uniform(0.5, 1.0), 0.0, 0.0])
    CASES["contexts of Drake with other parameters"] += 1
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        run.to(0.07)
    said = any("parameters in its context" in str(each.message) for each in caught)
    if said != (times != 1.0) or run.friction.GetReport(run.own).converged == said:
        raise Broken(f"mass times {times:g}: said is {said}, {run.friction.GetReport(run.own)}")
    if not np.isfinite(run.plant.GetPositionsAndVelocities(run.context)).all():
        raise Broken("the state is not finite")
