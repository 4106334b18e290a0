"""The disc with dry friction and uniform pressure that slides and spins to rest, from its limit surface in closed form.

Both motions stop at the same instant, so that time is scaled by the speed that is left. The wrench is that of
Farkas, Bartels, Unger and Wolf 2003, equations 4 to 7, in complete elliptic integrals.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from planarfriction.scenes.ready import GRAVITY

_STOPPED = 1e-5
"""Speed at the rim [m/s] below which the rest of the way does not count: `v^2 / (2 mu g)` is below 1e-10 m."""


class Stop(NamedTuple):
    """Place of rest of a disc."""

    time: float
    """[s]"""
    distance: float
    """[m]"""
    angle: float
    """[rad]"""


def wrench(ratio: float) -> tuple[float, float]:
    """Return force over `mu N` and torque over `mu N R` against the motion of a disc; `ratio`: speed over rim speed."""
    from scipy.special import ellipe, ellipkm1

    if ratio < 1e-9:
        return ratio, 2.0 / 3.0
    if abs(ratio - 1.0) < 1e-10:
        ratio = 1.0 + 1e-10
    square = ratio * ratio
    if ratio < 1.0:
        k = ellipkm1(1.0 - square)
        e = ellipe(square)
        force = (
            4.0 / (3.0 * math.pi) * ((square + 1.0) * e + (square - 1.0) * k) / ratio
        )
        return force, 4.0 / (9.0 * math.pi) * (
            (4.0 - 2.0 * square) * e + (square - 1.0) * k
        )
    if ratio > 1e3:
        return 1.0 - 1.0 / (8.0 * square), 0.25 / ratio
    k = ellipkm1(1.0 - 1.0 / square)
    e = ellipe(1.0 / square)
    force = 4.0 / (3.0 * math.pi) * ((square + 1.0) * e - (square - 1.0) * k)
    torque = (4.0 - 2.0 * square) * e + (2.0 * square - 5.0 + 3.0 / square) * k
    return force, 4.0 / (9.0 * math.pi) * ratio * torque


def stop(speed: float, spin: float, *, radius: float = 0.1, mu: float = 0.3) -> Stop:
    """Compute the place of rest of a disc of homogeneous mass that starts with `speed` [m/s] and `spin` [rad/s]."""
    from scipy.integrate import solve_ivp

    def rates(_, y):
        v = max(y[0], 0.0)
        w = max(y[1], 0.0)
        scale = math.hypot(v, radius * w)
        force, torque = wrench(v / (radius * w) if w > 0.0 else math.inf)
        slowing = scale * mu * GRAVITY
        return [
            -slowing * force,
            -2.0 * slowing / radius * torque,
            scale * v,
            scale * w,
            scale,
        ]

    def stopped(_, y):
        return math.hypot(y[0], radius * y[1]) - _STOPPED

    stopped.terminal = True  # pyright: ignore[reportFunctionMemberAccess]
    end = solve_ivp(
        rates,
        [0.0, 200.0],
        [speed, spin, 0.0, 0.0, 0.0],
        rtol=1e-10,
        atol=1e-13,
        events=stopped,
    ).y[:, -1]
    return Stop(float(end[4]), float(end[2]), float(end[3]))
