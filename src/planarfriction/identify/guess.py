"""Initial guesses: friction taken from the wrenches, and a coarse grid of Stribeck speeds and stiffnesses."""

from __future__ import annotations

from typing import Any

import numpy as np

from planarfriction.identify.parameters import ALL
from planarfriction.laws import LuGre

SPEEDS, STIFFNESSES = 6, 7
"""Size of the grid."""

SCATTER = 0.7
"""Spread of the logarithms of starts around a given one."""


def guess_starts(problem: Any, given: dict[str, float] | None, *, starts: int, seed: int, noise) -> list[np.ndarray]:
    """`starts` vectors of values `[F]`, the best first.

    A whole law as start (`given` is None) leads, scattered copies follow. Else the best points of the grid, with the
    values `given` by name.
    """
    random = np.random.default_rng(seed)
    if given is None:
        first = problem.start_values(problem.law)
        return [first, *(_scattered(first, problem.names, random) for _ in range(starts - 1))]
    ranked = sorted(_grid(problem, given), key=lambda values: misfit(problem, values, noise))
    return ranked[:starts] + [_scattered(ranked[0], problem.names, random) for _ in range(starts - len(ranked))]


def _grid(problem: Any, given: dict[str, float]) -> list[np.ndarray]:
    """Values at all points of the grid; of what is not estimated or is given there is one value only."""
    base = problem.start_values(problem.law)
    speeds = [each[0] for each in problem.sliding(base)]
    mu_c, mu_s = _friction(problem, speeds)
    wanted = [name for name in problem.names if name not in given]
    interval = min(log.interval for log in problem.logs)
    results = []
    for v_s in _speeds(np.concatenate(speeds)) if "v_s" in wanted else [problem.law.v_s]:
        for sigma_0 in _stiffnesses(problem, speeds, mu_c) if "sigma_0" in wanted else [problem.law.sigma_0]:
            guess = {"mu_c": mu_c, "mu_s": mu_s, "v_s": v_s, "gamma": 1.5, "sigma_0": sigma_0}
            guess |= {"sigma_1": 0.3 * sigma_0 * interval, "sigma_2": 0.02 * mu_c / max(np.max(speeds[0]), 1e-9)}
            values = [
                guess[name] if name in wanted and name in guess else base[i] for i, name in enumerate(problem.names)
            ]
            results.append(np.array(values))
    return results


def _friction(problem: Any, speeds: list[np.ndarray]) -> tuple[float, float]:
    """Friction coefficients of fast sliding and of the largest friction seen."""
    coefficients = []
    for log, shape in zip(problem.logs, problem.shapes, strict=True):
        radius = shape.vector(problem.start_values(problem.law))[8]
        force = np.linalg.norm(log.wrench / [1.0, 1.0, radius], axis=1)
        coefficients.append(force / np.where(log.normal_force > 0.0, log.normal_force, np.nan))
    coefficient, speed = np.concatenate(coefficients), np.concatenate(speeds)
    usable = np.isfinite(coefficient)
    coefficient, speed = coefficient[usable], speed[usable]
    fast = coefficient[speed >= np.quantile(speed, 0.7)]
    mu_c = float(np.clip(np.median(fast), 0.01, 10.0))
    return mu_c, float(np.clip(np.quantile(coefficient, 0.98), 1.1 * mu_c, 2.0 * mu_c))


def _speeds(speeds: np.ndarray) -> np.ndarray:
    """Stribeck speeds to try [m/s]: over the sliding speeds of the logs."""
    moving = speeds[speeds > 0.0]
    if not len(moving):
        return np.array([LuGre.v_s])
    low, high = np.quantile(moving, [0.05, 0.9])
    return np.geomspace(max(low, 1e-3 * high), high, SPEEDS)


def _stiffnesses(problem: Any, speeds: list[np.ndarray], mu_c: float) -> np.ndarray:
    """Stiffnesses to try [1/m]: full deflection between a tenth of a typical step and a tenth of the whole way."""
    steps = np.concatenate([s[1:] * np.diff(log.time) for s, log in zip(speeds, problem.logs, strict=True)])
    moving = steps[steps > 0.0]
    if not len(moving):
        return np.array([LuGre.sigma_0])
    short, long = 0.1 * np.median(moving), 0.1 * moving.sum()
    return np.geomspace(mu_c / short, mu_c / max(long, 10.0 * short), STIFFNESSES)


def misfit(problem: Any, values: np.ndarray, noise: np.ndarray) -> float:
    """Sum of the squares that values `[F]` or `[F + K]` leave, over the noise `[3]`."""
    return sum(
        float((((wrench - log.wrench) * (log.channels / noise))[used] ** 2).sum())
        for wrench, log, used in zip(problem.shown(values), problem.logs, problem.used, strict=True)
    )


def _scattered(values: np.ndarray, names, random: np.random.Generator) -> np.ndarray:
    factor = np.exp(SCATTER * random.standard_normal(len(values)))
    positive = np.array([ALL[name].logarithmic or name.startswith("sigma") for name in names])
    return np.where(positive, values * factor, values)
