"""Numbers and texts of joints' fits.

The values at which they are taken are fixed, or a few steps of a search away.
"""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from planarfriction.joints import Drive, JointFit, JointFriction, JointLog, Plant
from planarfriction.joints.fit import attempt, improves, minimise, with_term
from planarfriction.joints.problem import Problem, moving
from planarfriction.joints.result import judge
from tests.joints.test_joint_fit import PENDULUM, SERVO, servo_logs, torque_log

TERMS = ("load", "stribeck", "bristles", "directional")
MORE = {"load": 0.1, "rise": 0.01, "v_s": 0.7, "sigma_0": 30.0, "sigma_1": 0.03, "load_external": 0.05}


def shortened(log: JointLog, every: int, rows: int) -> JointLog:
    """Return some samples of a log, with a reported speed and an external torque."""
    names = [each.name for each in dataclasses.fields(log) if isinstance(getattr(log, each.name), np.ndarray)]
    kept = {name: getattr(log, name)[: rows * every : every] for name in names}
    t = kept["time"]
    return dataclasses.replace(log, **kept, dq=np.gradient(kept["q"], t), external=0.02 * np.sin(2.0 * t))


def trial(problem: Problem, values: dict[str, float]) -> dict[str, Any]:
    """Compute what a problem says at values, and where its search begins."""
    log = problem.logs[0]
    told: dict[str, Any] = {
        "names": problem.names, "groups": problem.groups, "start": problem.start(), "moving": [moving(log)],
        "guesses": [problem.guesses(term, values) for term in TERMS], "slopes": list(problem.slopes(values, 0.2)),
        "errors": problem.errors(values), "short": problem.costs(values, 0.2), "costs": problem.costs(values),
        "plant": problem.plant_numbers(values, log), "settled": vars(problem.settled(values)),
        "friction": vars(problem.friction(values)),
    }  # fmt: skip
    return told


def result(fit: JointFit) -> dict[str, Any]:
    """Return all that a fit says."""
    fit = dataclasses.replace(fit, verdicts=judge(fit))
    return {"table": fit.table(), "data": fit.to_dict(), "spread": fit.spread, "torque_gain": fit.torque_gain}


def made(problem: Problem, values: dict[str, float], less: Problem) -> JointFit:
    """Return a fit whose folds are the values times fixed factors."""
    groups = len(problem.groups)
    folds = tuple(
        {n: v * (1.0 + 0.02 * np.sin(k + i)) for i, (n, v) in enumerate(values.items())} for k in range(groups)
    )
    errors = problem.costs(values)
    halves = errors[: groups // 2], errors[groups // 2 :] * 0.9
    again = {name: 1.01 * value for name, value in values.items()}
    first = {name: values[name] for name in less.names}
    worse = less.costs(first) * 1.3
    base = attempt_like(less, first, worse)
    kept = attempt_like(problem, values, errors)
    kept = dataclasses.replace(kept, folds=folds, again=again, halves=halves)
    return JointFit(**vars(kept), baseline=base, trials={"load": (kept, base), "stribeck": (base, kept)}, verdicts=())


def attempt_like(problem: Problem, values: dict[str, float], errors: np.ndarray) -> Any:
    """Return a trial of given errors whose other fits are its values."""
    from planarfriction.joints.result import Trial

    half = len(errors) // 2
    folds = (values,) * len(errors)
    return Trial(problem, values, folds, values, errors, 1.1 * errors, (errors[:half], errors[half:]))


def numbers_of_servo() -> dict[str, Any]:
    """Compute the problem of a servo's logs with all terms, and the result at fixed values."""
    logs = tuple(shortened(each, 1, 300) for each in servo_logs(SERVO | {"load": 0.1}))
    less = Problem(logs, PENDULUM, None, ("load",), 2)
    problem, values = less.with_terms(TERMS), SERVO | MORE
    stands = dataclasses.replace(logs[1], goal=np.full(300, 3.0), q=logs[1].q[0] + 1e-3 * np.sin(9.0 * logs[1].time))
    stands = dataclasses.replace(stands, drive=Drive(800.0, 7.3, 0.0029, 0.2), name="stands")
    standing = dataclasses.replace(problem, logs=(logs[0], stands), parts=1)
    told = {
        **trial(problem, values),
        **result(made(problem, values, less)),
        "volts": [log.volts for log in logs], "motion": logs[0].motion,
        "stands": result(made(standing, values, dataclasses.replace(less, logs=standing.logs, parts=1))),
        "known gain": result(made(*known_gain(logs, values))),
    }  # fmt: skip
    return told


def known_gain(logs: tuple[JointLog, ...], values: dict[str, float]) -> tuple[Any, ...]:
    """Return a problem whose torque gain is known and whose drive was never off, at values, and its first problem."""
    plant = Plant(mass=0.4, length=0.1, arm_mass=0.05, offset=0.02)
    on = tuple(dataclasses.replace(log, enabled=None, voltage=log.volts, dq=None) for log in logs)
    less = Problem(on, plant, 0.11, ("load",), 1)
    problem = less.with_terms(("load", "stribeck"))
    return problem, {name: values[name] for name in problem.names}, less


def numbers_of_torque() -> dict[str, Any]:
    """Compute the problem of a log with a torque, and the result at fixed values."""
    log = shortened(torque_log(), 4, 2500)
    less = Problem((log,), Plant(inertia=0.05), None, ("load",), 4)
    problem = less.with_terms(TERMS)
    values = {"mu_c": 0.8, "sigma_2": 2.0} | MORE | {"sigma_0": 400.0}
    return trial(problem, values) | result(made(problem, values, less)) | {"torque": problem.torque(values, log)}


def numbers_of_searches() -> dict[str, Any]:
    """Search with and without a term, whole and with groups left out."""
    logs = tuple(shortened(each, 2, 160) for each in servo_logs(SERVO | {"load": 0.2}, 4))
    told: list[str] = []
    base = Problem(logs, PENDULUM, None, (), 1)
    first = attempt(base, minimise(base, base.start(), (np.inf,)), told.append)
    problem, values = with_term(base, first.values, "load")
    more = attempt(problem, values, told.append)
    found = {name: [each.values, list(each.folds), each.again, each.errors, each.short, list(each.halves)]
             for name, each in {"first": first, "more": more}.items()}  # fmt: skip
    return found | {"told": told, "gains": more.gains(first), "improves": improves(more, first)}


def numbers_of_friction() -> dict[str, Any]:
    """Compute the laws of frictions with and without bristles."""
    soft, rigid = JointFriction(0.8, 0.3, 0.1, 0.2, 1.2, 0.05, 400.0, 2.0), JointFriction(0.5, 0.1)
    return {
        "numbers": [[each.numbers, each.rigid_numbers, each.load(1.0, -2.0), each.mu_s] for each in (soft, rigid)],
        "voltage": Drive(2.0, 8.0, 0.5, 1.0).voltage([-1.0, -0.3, 0.0, 0.7]),
        "duty": Drive(2.0, 8.0, 0.5, 1.0).duty([-3.0, -0.3, 0.0, 0.7]),
    }


SOURCES: dict[str, Any] = {
    "servo": numbers_of_servo, "torque": numbers_of_torque,
    "searches": numbers_of_searches, "friction": numbers_of_friction,
}  # fmt: skip
"""What is computed, by name."""
