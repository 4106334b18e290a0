"""Random sequences of steps in contact space: finite, and no work on the host beyond what the bristles give.

The law is one that cannot give more: without damping, or with `sigma_2 >= sigma_1 (mu_s - mu_c)/mu_c`.
"""

from __future__ import annotations

import random

import nasty
import numpy as np
import some
from attack import attack
from hypothesis import strategies as st
from judge import Broken, finite, judge

import planarfriction as pf
from planarfriction.coupling import CoupledPatches, HostStep
from tests.support.coupling_problems import abrupt_run, random_bodies, random_run

ROUNDING = 1e-7
"""Excess of work, as a share of all that flows, that is not counted: the tolerance of the twists, mostly."""


def patches_of(draw: random.Random) -> CoupledPatches:
    """Up to four patches of the distributed model, whose bristles store energy that is known."""
    laws = []
    for _ in range(draw.randint(1, 4)):
        damping = draw.choice(
            [{"sigma_1": 0.0}, {"sigma_1": 800.0, "sigma_2": 160.0}, {"sigma_1": 1.0}]
        )
        laws.append(
            pf.LuGre(
                mu_s=1.2, sigma_0=some.spread(draw, 4, 9), elasto_plastic=0.9, **damping
            )
        )
    return CoupledPatches(
        [pf.DistributedModel(pf.ContactPatch.disc(0.01, 5), law) for law in laws]
    )


def stored(patches: CoupledPatches, state: np.ndarray, load: np.ndarray) -> np.ndarray:
    """Return the energy of the bristles under a load [J]."""
    total = np.zeros(len(load))
    for k, (model, each) in enumerate(
        zip(patches.models, patches.states(state), strict=True)
    ):
        total += (
            0.5
            * model.law.sigma_0
            * load[:, k]
            * (each**2 * model.patch.weights()).sum(axis=(1, 2))
        )
    return total


@attack("coupling", 10)
def test_coupling_sequences(draw: random.Random) -> None:
    generator = np.random.default_rng(draw.getrandbits(32))
    patches = patches_of(draw)
    count = 16
    k = len(patches.models)
    height = draw.choice([0.0, 0.05, 0.3])
    run = random_run(generator, patches, random_bodies(generator, count, k, height), 6)
    if draw.random() < 0.5:
        run = abrupt_run(generator, patches, count, height, 6)
    for state, host, dt, step in judge(
        "steps of sequences in contact space", lambda: list(run), compiles=True
    ):
        finite(tuple(step)[:6], "a step in contact space")
        flat = step.wrench.reshape(count, -1)
        caused = np.einsum(
            "eij,ej->ei", host.twist_response, flat - host.wrench.reshape(count, -1)
        )
        work = dt * ((host.twist.reshape(count, -1) + caused) * flat).sum(axis=1)
        before, after = (
            stored(patches, each, step.normal_force) for each in (state, step.state)
        )
        off = dt * 1e-6 * np.abs(step.wrench * [1.0, 1.0, 100.0]).sum(axis=(1, 2))
        if (
            excess := work
            - before
            + after
            - ROUNDING * (np.abs(work) + before + after)
            - off
        ).max() > 0.0:
            raise Broken(f"does {excess.max():.3g} J more work than it may")


@attack(
    "coupling", 60, st.sampled_from(["state", "dt", *HostStep._fields]), nasty.nasty()
)
def test_coupling_arguments(name, drawn) -> None:
    what, make = drawn
    patches = CoupledPatches(
        [pf.DistributedModel(pf.ContactPatch.disc(0.01, 5), pf.LuGre())] * 2
    )
    given = {
        "twist": np.full((2, 3), 0.1),
        "normal_force": np.ones(2),
        "wrench": np.zeros((2, 3)),
    }
    given |= {
        "twist_response": 1e-3 * np.eye(6),
        "load_response": np.zeros((2, 6)),
        "moments": np.zeros((2, 2)),
    }
    given |= {"state": patches.rest(), "dt": 1e-3} | {name: make()}
    state = given.pop("state")
    dt = given.pop("dt")
    try:
        step = judge(
            "arguments of steps in contact space",
            lambda: patches.step(state, HostStep(**given), dt),
            compiles=True,
        )
        if step is not None:
            finite(tuple(step)[:6], "a step in contact space")
    except Broken as broken:
        raise Broken(f"{name} = <{what}>: {broken}") from broken
