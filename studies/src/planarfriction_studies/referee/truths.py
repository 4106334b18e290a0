"""Truths: closed forms, exact motions of rigid bodies with dry friction, and measured ones, by the names in `source`.

Each returns a number; `value` looks one up. Patches are rectangles, discs or an L of two rectangles, whose pressure is
uniform or linear; their wrench is that of the exact limit surface, so that the error is that of the integration.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from planarfriction.limit_surface import LimitSurfaceCells, LimitSurfaceExact
from planarfriction.patch import ContactPatch, LinearGradient, friction_metric
from planarfriction.scenes.ready import GRAVITY
from planarfriction_studies.bench import coulomb_disc

RTOL = 1e-10


def held() -> float:
    """Return 0: friction can bear the load, and what is held does not move."""
    return 0.0


def slope(mu: float, tilt: float, time: float) -> float:
    """Return the displacement of a box down an incline from rest [m]: 0 up to `tan(tilt) = mu`."""
    return 0.5 * time**2 * GRAVITY * max(math.sin(tilt) - mu * math.cos(tilt), 0.0)


def stop(mu: float, speed: float, cosine: float = 1.0) -> float:
    """Return the stopping distance `v^2/(2 mu g)` [m], or its component along a direction with this cosine."""
    return cosine * speed**2 / (2.0 * mu * GRAVITY)


def disc(speed: float, spin: float, radius: float, mu: float, what: str) -> float:
    """Return the distance [m] or the angle [rad] of a disc that slides and spins to rest."""
    return getattr(coulomb_disc.stop(speed, spin, radius=radius, mu=mu), what)


def stribeck_stop(mu_c: float, mu_s: float, v_s: float, speed: float) -> float:
    """Return the stopping distance [m] of `integral v dv/(g mu(v))` with the Stribeck curve `mu(v)`."""
    from scipy.integrate import quad

    return (
        quad(
            lambda v: v / (mu_c + (mu_s - mu_c) * math.exp(-((v / v_s) ** 2))),
            0.0,
            speed,
            epsrel=1e-12,
        )[0]
        / GRAVITY
    )


def grip_slips(
    mu: float, mass: float, load: float, rate: float, threshold: float
) -> float:
    """Return the time [s] at which an object, held by two pads whose load falls at `rate`, has sunk by `threshold`.

    It lets go at `2 mu N = m g` and sinks by `g rate t^3/(6 N)` in the time t after that.
    """
    critical = mass * GRAVITY / (2.0 * mu)
    return (load - critical) / rate + (
        6.0 * critical * threshold / (GRAVITY * rate)
    ) ** (1.0 / 3.0)


def pad_turns(
    mu: float, load: float, side: float, rate: float, inertia: float, threshold: float
) -> float:
    """Return the time [s] at which two square pads under a growing torque have let an object turn by `threshold`.

    Torsion lets go at `2 mu N r`, `r = side (sqrt(2) + asinh(1))/6`; then the angle is `rate t^3/(6 I)`.
    """
    radius = side * (math.sqrt(2.0) + math.asinh(1.0)) / 6.0
    return 2.0 * mu * load * radius / rate + (6.0 * inertia * threshold / rate) ** (
        1.0 / 3.0
    )


def tower(
    force: float, below: int, above: int, mass: float, mu: float, time: float
) -> float:
    """Return the displacement [m] of boxes of a tower that one is pushed with: those above go with it.

    `(F - n mu m g)/(n m)` is their acceleration, n boxes from the pushed one up; it is below `mu g`, and the boxes
    below, which are `below` many, are held by the floor, which bears more boxes.
    """
    moving = above + 1
    acceleration = force / (moving * mass) - mu * GRAVITY
    if not (0.0 < acceleration < mu * GRAVITY and below > 0):
        raise ValueError("the boxes above do not go with the pushed one")
    return 0.5 * acceleration * time**2


def shaken(mu: float, amplitude: float, frequency: float, time: float) -> float:
    """Return the displacement [m] of a box under a force `amplitude m sin(2 pi f t)`, phase by phase in closed form."""
    omega = 2.0 * math.pi * frequency
    slowing = mu * GRAVITY
    t = 0.0
    x = 0.0
    v = 0.0
    while t < time:
        pull = amplitude * math.sin(omega * t)
        if v == 0.0 and abs(pull) < slowing * (1.0 - 1e-12):
            t = _next(lambda s: abs(amplitude * math.sin(omega * s)) - slowing, t, time)
            continue
        side = math.copysign(1.0, v if v != 0.0 else pull)

        def braked(s: float, t: float = t, v: float = v, side: float = side) -> float:
            speed = (
                v
                + amplitude / omega * (math.cos(omega * t) - math.cos(omega * s))
                - side * slowing * (s - t)
            )
            return -side * speed

        end = _next(braked, t + 1e-6, time)  # pyright: ignore[reportGeneralTypeIssues]
        lasts = end - t
        x += (
            v * lasts
            + amplitude / omega * (math.cos(omega * t) * lasts)
            - 0.5 * side * slowing * lasts**2
        )
        x -= amplitude / omega**2 * (math.sin(omega * end) - math.sin(omega * t))
        t = end
        v = 0.0
    return x


def _next(function: Callable[[float], float], start: float, end: float) -> float:
    """Return the first time at which a function that is below zero passes it, or the end."""
    from scipy.optimize import brentq

    times = np.linspace(start, end, 4001)
    above = next(
        (
            i
            for i, t in enumerate(times)
            if i and function(t) >= 0.0 > function(times[i - 1])
        ),
        None,
    )
    return (
        end
        if above is None
        else float(
            np.asarray(brentq(function, times[above - 1], times[above], xtol=1e-14))
        )
    )


# ---------------------------------------------------------------------- exact motion of a patch


def patch_of(
    rectangles: Sequence[Sequence[float]] = (),
    disc: float | None = None,
    gradient: Sequence[float] = (0.0, 0.0),
) -> ContactPatch:
    """Return a patch: one rectangle [x, y, width, height], with a linear pressure, an L of two of them, or a disc."""
    if disc is not None:
        return ContactPatch.disc(disc, cells=21)
    if len(rectangles) == 1:
        _, _, width, height = rectangles[0]
        return ContactPatch.rectangle(
            width,
            height,
            pressure=LinearGradient((gradient[0], gradient[1]))
            if any(gradient)
            else None,
        )
    (x0, y0, x1, y1), (x2, _, x3, y3) = [
        (x - w / 2, y - h / 2, x + w / 2, y + h / 2) for x, y, w, h in rectangles
    ]
    return ContactPatch.polygon(
        [(x0, y0), (x1, y0), (x1, y1), (x3, y1), (x3, y3), (x2, y3)]
    )


_PLACES = "x", "y", "turn"


def slide(what: str, **motion: Any) -> float:
    """Return x, y [m] or the turn [rad] of `end`, whose arguments the others are."""
    frozen = {key: _frozen(value) for key, value in motion.items()}
    return end(**frozen)[_PLACES.index(what)]


def _frozen(value: Any) -> Any:
    return tuple(map(_frozen, value)) if isinstance(value, list) else value


@functools.cache
def end(
    mu: Any, mass: float, inertia: float, time: float, twist: tuple[float, ...] = (0.0, 0.0, 0.0),
    push: tuple[float, ...] = (0.0, 0.0), at: tuple[float, ...] = (0.0, 0.0),
    rectangles: tuple[Any, ...] = (), disc: float | None = None, gradient: tuple[float, ...] = (0.0, 0.0),
) -> tuple[float, float, float]:  # fmt: skip
    """Integrate a rigid body on its patch, whose middle is the origin of its axes; return where that middle ends.

    `M V' = W(V) + push`: mu N times the exact wrench of the limit surface, and a constant force `push` in the axes of
    the world at the point `at` of the body. The centre of mass is above the centre of pressure, in the plane of the
    contact. From rest, the motion begins along the acceleration that is its own direction.
    """
    from scipy.optimize import fsolve

    patch = patch_of(rectangles, disc, gradient)
    along, across = mu if isinstance(mu, tuple) else (mu, mu)
    if along != across:
        patch = patch.with_friction_metric(friction_metric(0.0, 1.0, across / along))
    surface = LimitSurfaceCells(patch) if along != across else LimitSurfaceExact(patch)
    centre = patch.centre_of_pressure()
    masses = np.array([mass, mass, inertia])

    def acceleration(pose, velocity):
        c = math.cos(pose[2])
        s = math.sin(pose[2])
        turned = np.array([[c, -s], [s, c]])
        lever = np.array(at) - centre
        own = np.array([*(turned.T @ velocity[:2]), velocity[2]])
        origin = own[:2] + own[2] * np.array([centre[1], -centre[0]])
        fx, fy, torque = (
            along * mass * GRAVITY * np.asarray(surface.wrench((*origin, own[2])))
        )
        torque -= centre[0] * fy - centre[1] * fx
        force = turned @ (fx, fy) + push
        arm = turned @ lever
        return np.array([*force, torque + arm[0] * push[1] - arm[1] * push[0]]) / masses

    pose = np.zeros(3)
    velocity = np.array(twist, dtype=float)
    scale = math.sqrt(inertia / mass)
    if not velocity.any():
        first = (
            np.array(
                [*push, (at[0] - centre[0]) * push[1] - (at[1] - centre[1]) * push[0]]
            )
            / masses
        )
        velocity = 1e-9 * np.asarray(
            fsolve(lambda a: a - acceleration(pose, a), first, xtol=1e-13)
        )
    y = _moved(
        lambda _, *motion: acceleration(*motion),
        velocity,
        scale,
        time,
        rests=not any(push),
    )
    c = math.cos(y[2]) - 1.0
    s = math.sin(y[2])
    shift = np.array([c * centre[0] - s * centre[1], s * centre[0] + c * centre[1]])
    return float(y[0] - shift[0]), float(y[1] - shift[1]), float(y[2])


def _moved(
    acceleration: Callable[..., np.ndarray],
    velocity: np.ndarray,
    scale: float,
    time: float,
    *,
    rests: bool,
) -> np.ndarray:
    """Integrate an acceleration by time, pose and velocity from pose 0, for a time or to rest; return the pose."""
    from scipy.integrate import solve_ivp

    size = lambda v: math.hypot(v[0], v[1], scale * v[2])

    def rates(_, y):
        # Slower clock where the body comes to rest.
        factor = min(size(y[3:6]) / 0.1, 1.0) if rests else 1.0
        return np.concatenate(
            [factor * y[3:6], factor * acceleration(y[6], y[:3], y[3:6]), [factor]]
        )

    stops = [lambda _, y: y[6] - time, lambda _, y: size(y[3:6]) - 1e-11][
        : 2 if rests else 1
    ]
    for event in stops:
        event.terminal = True  # pyright: ignore[reportFunctionMemberAccess]
    start = np.concatenate([np.zeros(3), velocity, [0.0]])
    return solve_ivp(
        rates, [0.0, 1e4], start, method="DOP853", rtol=RTOL, atol=1e-13, events=stops
    ).y[:3, -1]


def in_hand(what: str, **motion: Any) -> float:
    """Return x, y [m] or the turn [rad] of `held_plate`, whose arguments the others are."""
    frozen = {key: _frozen(value) for key, value in motion.items()}
    return held_plate(**frozen)[_PLACES.index(what)]


@functools.cache
def held_plate(
    mu: float,
    mass: float,
    inertia: float,
    load: float,
    rate: float,
    at: tuple[float, float],
    disc: float,
    time: float,
) -> tuple[float, float, float]:
    """Integrate a plate between two discs that press with `load + rate t`; return where its centre of mass ends.

    The discs stay where they are, at first at the point `at` from the centre of mass, and weight is along -y:
    `M V' = 2 W(V) + (0, -m g, 0)`, mu N times the exact wrench of the limit surface, moved to the centre of mass.
    """
    from scipy.optimize import fsolve

    surface = LimitSurfaceExact(patch_of(disc=disc))
    masses = np.array([mass, mass, inertia])

    def acceleration(t, pose, velocity):
        x, y = np.array(at) - pose[:2]
        (vx, vy, omega) = velocity
        bears = 2.0 * mu * (load + rate * t)
        fx, fy, torque = bears * np.asarray(
            surface.wrench((vx - omega * y, vy + omega * x, omega))
        )
        return np.array([fx, fy - mass * GRAVITY, torque + x * fy - y * fx]) / masses

    weight = np.array([0.0, -GRAVITY, 0.0])
    velocity = 1e-9 * np.asarray(
        fsolve(
            lambda a: a - acceleration(0.0, np.zeros(3), a), 0.5 * weight, xtol=1e-13
        )
    )
    return tuple(
        map(
            float,
            _moved(acceleration, velocity, math.sqrt(inertia / mass), time, rests=True),
        )
    )  # pyright: ignore[reportReturnType]


# ---------------------------------------------------------------------- measured slides

TOSSES = Path(__file__).parents[1] / "measured" / "data" / "contactnets_slides.csv.gz"
"""Slides of a cube (see the NOTICE beside it)."""

FIRST = 8
"""Sample at which a slide begins here: the cube has landed."""


@functools.cache
def tosses() -> np.ndarray:
    """Return the rows of all slides, with the columns of `TOSSES` by name."""
    return np.genfromtxt(TOSSES, delimiter=",", names=True)


def sliding(toss: int) -> tuple[np.ndarray, np.ndarray]:
    """Return twist and displacement to rest [m, m, rad] of a slide in the cube's first axes."""
    rows = tosses()[tosses()["toss"] == toss]
    first = rows[FIRST]
    last = rows[-1]
    yaw = np.unwrap(rows["yaw_rad"])
    c = math.cos(first["yaw_rad"])
    s = math.sin(first["yaw_rad"])
    axes = np.array([[c, s], [-s, c]])
    velocity = axes @ [first["vx_mps"], first["vy_mps"]]
    moved = axes @ [last["x_m"] - first["x_m"], last["y_m"] - first["y_m"]]
    return np.array([*velocity, first["wz_radps"]]), np.array(
        [*moved, yaw[-1] - yaw[FIRST]]
    )


def measured(toss: int, what: str) -> float:
    """Return x, y [m] or the turn [rad] of a measured slide."""
    return float(sliding(toss)[1][_PLACES.index(what)])


SOURCES: dict[str, Callable[..., float]] = {
    each.__name__: each
    for each in (
        held,
        slope,
        stop,
        disc,
        stribeck_stop,
        grip_slips,
        pad_turns,
        tower,
        shaken,
        slide,
        in_hand,
        measured,
    )
}


def value(source: str, given: Mapping[str, Any]) -> float:
    """Compute the value of a truth."""
    return SOURCES[source](**given)
