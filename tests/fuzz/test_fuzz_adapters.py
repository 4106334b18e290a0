"""Plants and models that change behind the adapter's back: said in one line, and nothing is said of others."""

from __future__ import annotations

import random
import warnings
from typing import Any

import numpy as np
import pytest
import some
from attack import attack
from judge import CASES, Broken

import planarfriction as pf
from tests.support.refusals import refused


@attack("adapters", 1)
def test_drake_contexts_with_other_parameters(draw: random.Random) -> None:
    pytest.importorskip("pydrake", reason="Drake is not installed")
    from tests.support.drake_scenes import sliding

    model = pf.DistributedModel(
        pf.ContactPatch.disc(0.1, 5),
        pf.LuGre(mu_c=0.3, sigma_0=1e5, elasto_plastic=0.9),
    )
    run = sliding("disc", draw.choice(["point", "hydroelastic"]), 2e-3, model)
    run.to(0.05)
    times = draw.choice([1.0, 1.0 + some.spread(draw, -1, 1)])
    run.plant.GetBodyByName("disc").SetMass(run.context, 0.2 * times)
    run.plant.SetVelocities(
        run.context,
        [0.0, 0.0, draw.uniform(-10.0, 10.0), draw.uniform(0.5, 1.0), 0.0, 0.0],
    )
    CASES["contexts of Drake with other parameters"] += 1
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        run.to(0.07)
    said = any("parameters in its context" in str(each.message) for each in caught)
    if said != (times != 1.0) or run.friction.GetReport(run.own).converged == said:
        raise Broken(
            f"mass times {times:g}: said is {said}, {run.friction.GetReport(run.own)}"
        )
    if not np.isfinite(run.plant.GetPositionsAndVelocities(run.context)).all():
        raise Broken("the state is not finite")


def change(m: Any, kind: str, draw: random.Random) -> bool:
    """Change the model at run time; return True if the new options fit."""
    if kind == "integrator":
        m.opt.integrator = draw.choice([0, 1, 2, 3])
        return m.opt.integrator != 1
    if kind == "noslip_iterations":
        m.opt.noslip_iterations = draw.randint(0, 3)
        return m.opt.noslip_iterations == 0
    if kind == "timestep":
        m.opt.timestep = draw.choice(
            [draw.uniform(1e-4, 0.01), draw.uniform(0.0101, 0.05)]
        )
        return m.opt.timestep < 0.0101
    m.pair_dim[draw.randrange(m.npair)] = dimensions = draw.choice([1, 3, 4, 6])
    return dimensions == 1


@attack("adapters", 2)
def test_models_of_mujoco_that_change(draw: random.Random) -> None:
    mujoco = pytest.importorskip("mujoco", reason="MuJoCo is not installed")
    from planarfriction_studies.bench import mujoco_scenes

    scene = mujoco_scenes.grip()
    law = pf.LuGre(mu_c=draw.uniform(0.2, 0.45), sigma_0=some.spread(draw, 4, 6))
    pad = pf.ReducedModel(pf.ContactPatch.disc(draw.uniform(0.005, 0.02), 9), law)
    (m, d, friction) = scene.ours()
    (another, there, own) = scene.ours(model=pad)
    d.ctrl[:] = there.ctrl[:] = scene.control(0.0)
    CASES["models of MuJoCo that change"] += 1
    with refused("data of the model of the patches"):
        friction.step(there)
    with friction.install():
        for _ in range(5):
            mujoco.mj_step(another, there)
    if own.wrenches(there).any():
        raise Broken("the friction of one model acts on another")
    for _ in range(5):
        friction.step(d)
    time = d.time
    fits = change(
        m,
        kind := draw.choice(["integrator", "noslip_iterations", "timestep", "condim"]),
        draw,
    )
    try:
        friction.step(d)
    except pf.errors.InvalidValueError as told:
        if (
            fits
            or d.time != time
            or friction.wrenches(d).any()
            or kind.replace("condim", "pair") not in str(told)
        ):
            raise Broken(
                f"{kind}: {told}, which fits: {fits}, at {d.time} s after {time} s"
            ) from told
    else:
        if not fits or d.time == time or not np.isfinite(friction.wrenches(d)).all():
            raise Broken(
                f"{kind}: a step with options that do not fit, or none with those that do, at {d.time} s"
            )
