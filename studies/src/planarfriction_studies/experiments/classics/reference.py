"""One mass on one bristle, integrated by SciPy's explicit method of order 8: the paper's equations, written anew.

m x'' = force(t) + stiffness (pulled(t) - x) - F,   z' = v - sigma_0 |v| z/g(v),   F = sigma_0 z + sigma_1 z' +
sigma_2 v,   g(v) = F_C + (F_S - F_C) exp(-(v/v_s)^2)
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from planarfriction_studies.experiments.experiment import Arrays

SIGMA_0, SIGMA_1, SIGMA_2, COULOMB, STATIC, STRIBECK = (
    1e5,
    np.sqrt(1e5),
    0.4,
    1.0,
    1.5,
    1e-3,
)
"""Parameters of the paper: N/m, N s/m, N s/m, N, N, m/s."""

RTOL, ATOL = 1e-9, 1e-14
"""Tolerances, relative and of x [m], v [m/s] and z [m]."""

Course = Callable[[float], float]


def steady(v: Any) -> Any:
    """Return the steady friction g(v) [N]."""
    return COULOMB + (STATIC - COULOMB) * np.exp(-((v / STRIBECK) ** 2))


def friction(z: Any, v: Any) -> tuple[Any, Any]:
    """Return z' [m/s] and the friction against the motion [N]."""
    rate = v - SIGMA_0 * np.abs(v) / steady(v) * z
    return rate, SIGMA_0 * z + SIGMA_1 * rate + SIGMA_2 * v


def moved(
    knots: Sequence[float],
    force: Course = lambda t: 0.0,
    pulled: Course = lambda t: 0.0,
    *,
    k: float = 0.0,
    dt: float,
) -> Arrays:
    """Integrate a mass of 1 kg from rest under a force and the pull of a spring of stiffness `k` [N/m].

    Both are smooth between the `knots` [s]. Returns columns over `time`, every `dt` [s].
    """

    def rates(t: float, y: np.ndarray) -> list[float]:
        rate, against = friction(y[2], y[1])
        return [y[1], force(t) + k * (pulled(t) - y[0]) - against, rate]

    time, (x, v, z) = _integrated(rates, knots, np.zeros(3), dt)
    return {"time": time, "x": x, "vx": v, "friction": friction(z, v)[1]}


def hunting(gains: Sequence[float], goal: float, t_end: float, dt: float) -> Arrays:
    """Integrate a mass of 1 kg from rest under a PID controller of `gains` [N/m, N/(m s), N s/m] towards `goal` [m]."""
    stiffness, integral, damping = gains

    def rates(t: float, y: np.ndarray) -> list[float]:
        x, v, z, error = y
        rate, against = friction(z, v)
        return [
            v,
            stiffness * (goal - x) + integral * error - damping * v - against,
            rate,
            goal - x,
        ]

    time, (x, v, _, error) = _integrated(rates, (0.0, t_end), np.zeros(4), dt)
    return {
        "time": time,
        "x": x,
        "force": stiffness * (goal - x) + integral * error - damping * v,
    }


def driven(t_end: float, speed: Callable[[Any], Any], dt: float) -> Arrays:
    """Integrate a bristle from rest, driven at a `speed` [m/s] > 0; columns as in `moved`."""

    def rates(t: float, y: np.ndarray) -> np.ndarray:
        return friction(y, speed(t))[0]

    time, (z,) = _integrated(rates, (0.0, t_end), [0.0], dt)
    return {"time": time, "vx": speed(time), "friction": friction(z, speed(time))[1]}


def _integrated(
    rates: Any, knots: Sequence[float], y: Any, dt: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return times and states `[n, T]`, piece after piece."""
    from scipy.integrate import solve_ivp

    parts = []
    for begin, end in itertools.pairwise(knots):
        time = np.linspace(begin, end, round((end - begin) / dt) + 1)
        found = solve_ivp(rates, (begin, end), y, "DOP853", time, rtol=RTOL, atol=ATOL)
        y = found.y[:, -1]
        parts.append(np.vstack([found.t, found.y])[:, 1 if parts else 0 :])
    whole = np.concatenate(parts, axis=1)
    return whole[0], whole[1:]
