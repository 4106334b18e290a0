"""Published rules for slip-aware grippers, to compare with: regression, grip forces from an ellipsoid, a disc observer.

Written from the equations of Waltersson and Karayiannidis (perception and control of in-hand motions with parallel
grippers, 2024) and of Costanzo, De Maria and Natale (slipping control with tactile sensors). Arrays broadcast.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

SLIDING_SPEED, SLIDING_SPIN = 2e-3, 0.1
"""Speed from which on a sample counts as sliding [m/s], and spin up to which it does, or from which it turns
[rad/s]."""

TURNING_SPEED = 5e-3
"""Speed up to which a sample counts as turning [m/s]."""

LEAST_HOLD, LEAST_HINGE = 2.0, 0.6
"""Least normal force of the rule that holds, before its factor, and of the rule of the hinge [N]."""


class Regression(NamedTuple):
    """Friction by the published regressions; NaN for a number whose window holds no sample."""

    mu_c: float
    """Coulomb coefficient [-]."""
    mu_v: float
    """Growth of friction with speed [s/m]."""
    mu_s: float
    """Static coefficient [-]."""
    radius: float
    """Contact radius `b/mu_c` [m] of the torque at no spin."""


def regression(
    force: ArrayLike,
    torque: ArrayLike,
    normal_force: ArrayLike,
    speed: ArrayLike,
    spin: ArrayLike,
) -> Regression:
    """Fit friction to samples `[T]` of a slip by the published rule.

    `|f|/f_N = mu_c + mu_v v` where v >= 2 mm/s and |omega| <= 0.1 rad/s, `mu_s` the maximum at lower speeds, and
    `|tau|/f_N = b + a |omega|` where |omega| >= 0.1 rad/s and v <= 5 mm/s, `r = b/mu_c`.
    """
    f, tau, load, v, omega = (
        np.abs(np.asarray(each, float))
        for each in (force, torque, normal_force, speed, spin)
    )
    slides = (v >= SLIDING_SPEED) & (omega <= SLIDING_SPIN)
    turns = (omega >= SLIDING_SPIN) & (v <= TURNING_SPEED)
    mu_c, mu_v = _line(v[slides], (f / load)[slides])
    below = (f / load)[v < SLIDING_SPEED]
    b, _ = _line(omega[turns], (tau / load)[turns])
    return Regression(
        mu_c, mu_v, float(below.max()) if len(below) else np.nan, b / mu_c
    )


def _line(x: np.ndarray, y: np.ndarray) -> tuple[float, float]:
    """Return intercept and slope of a least-squares line; NaN without samples."""
    if not len(x):
        return np.nan, np.nan
    if np.ptp(x) == 0.0:
        return float(y.mean()), 0.0
    slope, intercept = np.polyfit(x, y, 1)
    return float(intercept), float(slope)


def ellipsoid_load(wrench: ArrayLike, radius: ArrayLike, mu: ArrayLike) -> np.ndarray:
    """Return the normal force `sqrt(|f|^2 + (tau/r)^2)/mu` [N] by which an ellipsoid holds wrenches `[..., 3]`."""
    fx, fy, tau = np.moveaxis(np.asarray(wrench, float), -1, 0)
    return np.sqrt(fx * fx + fy * fy + (tau / np.asarray(radius)) ** 2) / mu


def hold_rule(
    wrench: ArrayLike,
    speed: ArrayLike,
    radius: ArrayLike,
    mu: ArrayLike,
    before: ArrayLike = 0.0,
) -> np.ndarray:
    """Return the target `2 max(f_ellipsoid, 2 N) + 100 |v|` [N]; from `before` it rises at once, and decays by 0.95."""
    target = 2.0 * np.maximum(
        ellipsoid_load(wrench, radius, mu), LEAST_HOLD
    ) + 100.0 * np.abs(speed)
    return np.maximum(target, 0.95 * np.asarray(before))


def hinge_rule(force: ArrayLike, speed: ArrayLike, mu: ArrayLike) -> np.ndarray:
    """Return the normal force `max(0.6, 1.4 |f|/mu + 100 v)` [N] under which a part pivots without sliding."""
    return np.maximum(
        LEAST_HINGE, 1.4 * np.asarray(force) / np.asarray(mu) + 100.0 * np.abs(speed)
    )


@dataclass(frozen=True)
class SlipRule:
    """Published control of a slip along a trapezoid: `v_c = v_d + 2 (x_d - x)`, `f = f_s (1 + k_a a + k_v (v - v_c)) -
    k_i int(v_c - v)`, with the low-passed normal force `f_s` that holds the part.
    """

    integral: float
    """Gain `k_i` of the integral [N/m] or [N/rad]."""
    acceleration: float
    """Gain `k_a` of the wanted acceleration [s^2/m] or [s^2]."""
    speed: float
    """Gain `k_v` of the error of the speed [s/m] or [s]."""

    def commanded(self, place: Any, wanted: Any, wanted_speed: Any) -> Any:
        """Return the commanded speed `v_c`."""
        return wanted_speed + 2.0 * (wanted - place)

    def grip(
        self, holding: Any, speed: Any, commanded: Any, acceleration: Any, total: Any
    ) -> Any:
        """Return the normal force [N] for the `total` of `int(v_c - v)` so far."""
        pushed = (
            1.0 + self.acceleration * acceleration + self.speed * (speed - commanded)
        )
        return np.maximum(holding * pushed - self.integral * total, 0.0)


LINEAR_RULE = SlipRule(integral=1000.0, acceleration=0.1, speed=50.0)
"""Gains for a linear slip."""

ROTATION_RULE = SlipRule(integral=40.0, acceleration=0.05, speed=2.0)
"""Gains for a turn."""


@dataclass(frozen=True)
class DiscObserver:
    """Observer of the slip speed of a turning disc from its torque, with a bristle and a Luenberger gain.

    `omega' = (u - beta omega - sigma_0 z)/(I + M c^2) + l (y - sigma_0 z)`, `z' = omega - sigma_0/f_max |omega| z`, and
    the measured `y = tau - c f_t` is the torque of the bristle. State: `(omega, z)`.
    """

    inertia: float = 7.4e-4
    """Inertia about the centre of mass [kg m^2]."""
    mass: float = 0.35
    """Mass [kg]."""
    damping: float = 0.02
    """Viscous torque per spin `beta` [N m s]."""
    sigma_0: float = 50.0
    """Stiffness of the bristle [N m/rad]."""
    gain: float = 1000.0
    """Luenberger gain `l` [rad/s^2/(N m)]."""

    def step(
        self,
        state: ArrayLike,
        applied: float,
        measured: float,
        largest: float,
        lever: float,
        dt: float,
    ) -> np.ndarray:
        """Advance `(omega, z)` by `dt` [s] under a torque `applied`, with the `measured` one and the `largest` [N m].

        Linearly implicit, since the bristle is stiff.
        """
        omega, z = np.asarray(state, float)
        inertia = self.inertia + self.mass * lever**2
        decay = self.sigma_0 / largest * abs(omega)
        by_z = -self.sigma_0 * (1.0 / inertia + self.gain)
        slopes = np.array([[-self.damping / inertia, by_z], [1.0, -decay]])
        drive = np.array([applied / inertia + self.gain * measured, 0.0])
        rate = slopes @ (omega, z) + drive
        return np.array([omega, z]) + np.linalg.solve(
            np.eye(2) - dt * slopes, dt * rate
        )
