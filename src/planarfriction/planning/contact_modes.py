"""Instantaneous motion of a pushed slider: it sticks to the pusher, or the pusher slides left or right along it.

A force `f` at a point of the slider has the wrench `F = (f, r x f)`. Friction balances it, so the twist is normal to
the limit surface at F. The velocity of that point turns monotonically with the force, since it is the normal to a
section of the convex surface: the forces of the pusher's friction cone correspond to the velocities of the **motion
cone**.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from planarfriction._support import validation
from planarfriction.limit_surface import LimitSurface

STICK = "stick"
"""Mode of a pusher that pushes without sliding."""

LEFT = "slide left"
"""Mode of a pusher that slides to the left, seen along its direction."""

RIGHT = "slide right"
"""Mode of a pusher that slides to the right, seen along its direction."""

_BEYOND = 0.1
"""Angle beyond the friction cone [rad] at which a sticking force is still sought: steps may pass the end of a mode."""

_EDGE = 1.0 - 1e-9
"""Share of its half width from which on a face is pressed at its end, as far as rounding can say."""


class TouchPoint(NamedTuple):
    """Point at which a slider is touched, in its own axes."""

    at: np.ndarray
    """`[2]` [m]"""
    normal: np.ndarray
    """Unit vector into the slider `[2]`."""
    half_width: float = 0.0
    """Width of a face that lies flush [m]; `at` is its middle."""


class SliderMotion(NamedTuple):
    """Motion of a slider."""

    twist: np.ndarray
    """Twist of the slider about its frame's origin, in its own axes `[3]`."""
    mode: str
    """`STICK`, `LEFT` or `RIGHT`."""
    slack: float
    """Distance of the mode from its end: an angle [rad], or a share of the face [-]."""
    leans: int = 0
    """A face that cannot stay flush: 1 where it turns about its left end, -1 about its right one."""


def motion_cone(
    surface: LimitSurface, at: ArrayLike, normal: ArrayLike, mu: float
) -> np.ndarray:
    """Return the edges of the motion cone `[2, 2]`: velocities of a point for both edges of the friction cone.

    If the velocity of the pusher is between the two, it sticks; otherwise it slides along the slider, which then moves
    as on the nearer edge. `at` `[2]` [m] is the point, `normal` `[2]` the direction into the slider, in the axes of the
    surface; the result are unit vectors.

    Raises `InvalidValueError` for arguments out of range.

    Source: Mason 1986; Lynch, Maekawa and Tanie 1992.
    """
    validation.instance("surface", surface, LimitSurface, "a limit surface")
    at = validation.vector("at", at, 2)
    normal = validation.vector("normal", normal, 2)
    length = validation.positive("length of normal", np.hypot(*normal))
    angle = math.atan(validation.non_negative("mu", mu))
    place = TouchPoint(at, normal / length)
    edges = np.array([pushed_by(surface, place, each)[1] for each in (-angle, angle)])
    return edges / np.hypot(*edges.T)[:, None]


def motion_at(
    surface: LimitSurface,
    place: TouchPoint,
    mu: float,
    velocity: np.ndarray,
    held: str = "",
) -> SliderMotion:
    """Compute the motion of a slider touched at a place by a pusher with a `velocity` `(vx, vy, omega)` there.

    All in the slider's axes; the pusher approaches, `velocity . normal > 0`. A mode that is `held` stays so beyond its
    end, where its slack is negative.
    """
    if place.half_width > 0.0:
        return _flush(surface, place, mu, velocity, held)
    angle = math.atan(mu)
    wanted = _angle(place, velocity)
    edges = [pushed_by(surface, place, each) for each in (-angle, angle)]
    right, left = (_angle(place, moved) for _, moved in edges)
    if angle == 0.0:  # left or right, the force is the same, and no mode has an end
        held = LEFT if wanted >= left else RIGHT
    mode = held or (LEFT if wanted >= left else RIGHT if wanted <= right else STICK)
    if mode == STICK:
        twist, moved = _stuck(surface, place, angle + _BEYOND, wanted)
        scale = math.hypot(*velocity[:2]) / math.hypot(*moved)
        return SliderMotion(scale * twist, mode, min(wanted - right, left - wanted))
    twist, moved = edges[mode == LEFT]
    scale = (velocity[:2] @ place.normal) / (moved @ place.normal)
    slack = wanted - left if mode == LEFT else right - wanted
    return SliderMotion(scale * twist, mode, math.inf if angle == 0.0 else slack)


def rotation(angle: float) -> np.ndarray:
    """Return the matrix `[2, 2]` that rotates by an angle [rad], counter-clockwise."""
    c = math.cos(angle)
    s = math.sin(angle)
    return np.array([[c, -s], [s, c]])


def _angle(place: TouchPoint, vector: Any) -> float:
    """Return the angle of a vector to the left of the normal [rad]."""
    x, y = place.normal.tolist()
    a = vector[0]
    b = vector[1]
    return math.atan2(x * b - y * a, x * a + y * b)


def pushed_by(
    surface: LimitSurface, place: TouchPoint, angle: float
) -> tuple[np.ndarray, tuple[float, float]]:
    """Return the twist of unit power under a force at an angle to the normal, and the velocity of the place."""
    nx, ny = place.normal.tolist()
    x, y = place.at.tolist()
    c = math.cos(angle)
    s = math.sin(angle)
    fx = c * nx - s * ny
    fy = s * nx + c * ny
    twist = surface.twist((-fx, -fy, y * fx - x * fy))
    vx, vy, omega = twist.tolist()
    return twist, (vx - omega * y, vy + omega * x)


def _stuck(
    surface: LimitSurface, place: TouchPoint, angle: float, wanted: float
) -> tuple[np.ndarray, Any]:
    """Return the twist whose place has a velocity of the wanted angle, and that velocity."""
    from scipy.optimize import brentq

    off = lambda each: _angle(place, pushed_by(surface, place, each)[1]) - wanted
    try:
        found: float = brentq(off, -angle, angle, xtol=1e-13)  # pyright: ignore
    except ValueError:  # far beyond the end of the mode: a step that will be taken back
        found = math.copysign(angle, -off(angle))
    return pushed_by(surface, place, found)


# ---------------------------------------------------------------------- a face that lies flush


def _flush(
    surface: LimitSurface,
    place: TouchPoint,
    mu: float,
    velocity: np.ndarray,
    held: str,
) -> SliderMotion:
    """Compute the motion of a slider under a flush face with the `velocity` `(vx, vy, omega)` at its middle.

    The pressure of the face has a resultant that crosses it, at an angle within the friction cone.
    """
    from scipy.optimize import brentq

    x, y = place.at
    h = place.half_width
    angle = math.atan(mu)
    vx, vy, omega = velocity
    stuck = np.array([vx + omega * y, vy - omega * x, omega])
    speed = math.hypot(vx, vy) + abs(omega) * (h + math.hypot(x, y))
    # to the normal and to its left
    axes = np.stack([place.normal, rotation(0.5 * math.pi) @ place.normal])

    def of(slip: float) -> tuple[np.ndarray, float, float]:
        """Return twist, angle of the force, and its crossing of the face as a share of the half width."""
        twist = stuck - slip * np.append(axes[1], 0.0)
        fx, fy, tau = -surface.wrench(twist)
        pressed, along = axes @ [fx, fy]
        turn = tau - (x * fy - y * fx)  # about the middle, of the normal force alone
        share = math.copysign(math.inf, -turn)
        if pressed > 0.0:
            share = -turn / (pressed * h)
        return twist, math.atan2(along, pressed), share

    twist, lean, share = of(0.0)
    mode = STICK
    slack = angle - abs(lean)
    if angle == 0.0:
        held = LEFT if lean > 0.0 else RIGHT
    if held in (LEFT, RIGHT) or (not held and slack < 0.0):
        mode = held or (LEFT if lean > 0.0 else RIGHT)
        left = 1.0 if mode == LEFT else -1.0
        # the force turns from one side of the normal to the other between slips far to the right and far to the left
        slip_at = lambda u: speed * u / (1.0 - abs(u))
        off = lambda u: of(slip_at(u))[1] - left * angle
        slip = slip_at(brentq(off, -0.999999, 0.999999, xtol=1e-14))
        twist, _, share = of(slip)
        slack = math.inf if angle == 0.0 else left * slip / speed
    leans = int(math.copysign(1.0, share)) if abs(share) > _EDGE else 0
    return SliderMotion(twist, mode, min(slack, 1.0 - abs(share)), leans)
