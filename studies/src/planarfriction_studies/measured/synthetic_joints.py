"""Synthetic joints, by which the rule that keeps a term of friction is judged: false claims, and what is missed.

Each moves along the goals of the eight recorded logs, with numbers drawn anew and each term present in every second
joint. A model with the right terms still errs, as with real logs: in each log, friction and voltage are a little
different, and a torque that no model has wanders about.
"""

from __future__ import annotations

import dataclasses
from typing import NamedTuple

import numpy as np

from planarfriction.joints import JointLog
from planarfriction.joints.loops.runs import run_plant
from planarfriction.joints.problem import TERMS, JointFitProblem, friction_of
from planarfriction_studies.measured.joints import PENDULUM, read_logs

STEP = 1e-4
"""Longest step of the simulated motion [s]."""

ENCODER = 2.0 * np.pi / 4096.0
"""Resolution of the position [rad]."""

SPREAD, SUPPLY, WANDERS = (0.03, 0.15), (0.005, 0.03), (0.05, 0.5)
"""Least and largest scatter of a joint between its logs, of friction and of voltage, and of the unknown torque over
friction."""

MEMORY = 0.1
"""Time in which the unknown torque forgets [s]."""


class SyntheticJoint(NamedTuple):
    """One joint with its logs."""

    terms: tuple[str, ...]
    """Terms that it has beside Coulomb and viscous friction."""
    values: dict[str, float]
    """Its true numbers by name."""
    logs: list[JointLog]


def synthetic_joint(
    seed: int, recorded: list[JointLog] | None = None
) -> SyntheticJoint:
    """Draw a joint and simulate its logs; every term is there with a chance of one half."""
    rng = np.random.default_rng(seed)
    recorded = recorded or read_logs()
    terms = [term for term in TERMS if rng.random() < 0.5]
    terms = tuple(each for each in terms if each != "directional" or "load" in terms)
    values = {
        "inertia": rng.uniform(5e-4, 3e-3), "offset": rng.normal(0.0, 0.02), "torque_gain": rng.uniform(0.08, 0.15),
        "back_emf": rng.uniform(0.02, 0.05), "mu_c": rng.uniform(0.01, 0.04), "sigma_2": rng.uniform(3e-3, 1e-2),
    }  # fmt: skip
    load = rng.uniform(0.1, 0.3)
    share = rng.uniform(0.0, 0.4)
    fall = rng.uniform(0.3, 1.0)
    bent = rng.uniform(-2.5, -1.5)
    more = {
        "load": {"load": load, "mu_c": 0.3 * values["mu_c"]},
        "stribeck": {
            "rise": fall * values["mu_c"],
            "v_s": 10.0 ** rng.uniform(-1.3, 0.0),
        },
        "bristles": {
            "sigma_0": values["mu_c"] / 10.0**bent,
            "sigma_1": 0.01 * values["mu_c"] / 10.0**bent,
        },
        "directional": {"load": 1.5 * load, "load_external": share * load},
    }
    for term in terms:
        values |= more[term]
    problem = JointFitProblem(tuple(recorded), PENDULUM, None, terms)
    scatter = np.array([rng.uniform(*each) for each in (SPREAD, SUPPLY, WANDERS)])
    return SyntheticJoint(
        terms, values, [_moved(problem, values, log, scatter, rng) for log in recorded]
    )


def _moved(
    problem: JointFitProblem,
    values: dict[str, float],
    log: JointLog,
    scatter: np.ndarray,
    rng: np.random.Generator,
) -> JointLog:
    """Simulate one log and read it with the encoder."""
    warm, supply = rng.normal(1.0, scatter[:2])
    here = values | {
        name: values[name] * warm
        for name in ("mu_c", "sigma_2", "rise")
        if name in values
    }
    here["torque_gain"] *= supply
    joint = friction_of(here).rigid_numbers
    plant = problem.plant_numbers(here, log)
    wander = np.zeros(len(log.time))
    steps = np.diff(log.time)
    kick = scatter[2] * (values["mu_c"] + 0.3 * plant.moment * values.get("load", 0.0))
    for i, step in enumerate(steps):
        keep = np.exp(-step / MEMORY)
        wander[i + 1] = keep * wander[i] + kick * np.sqrt(1.0 - keep**2) * rng.normal()
    motion = np.empty((len(log.time), 2))
    start = log.motion * [1.0, 0.0]
    run_plant(
        joint, plant, log.time, log.goal, log.on, wander, start, 10**9, STEP, motion
    )
    return dataclasses.replace(
        log, q=np.round(motion[:, 0] / ENCODER) * ENCODER, dq=None
    )
