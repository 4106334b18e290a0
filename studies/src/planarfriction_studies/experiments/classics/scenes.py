"""The experiments of the LuGre paper as ready scenes: one mass, one line of motion.

Each takes a model; without one a single point with the law of the paper, `mu_c = 1`, `mu_s = 1.5` under 1 N. Hunting
under a PID controller is a loop around `pf.SlidingBody`: the integral is a state that no part of a scene has.

Source: Canudas de Wit, Olsson, Astrom, Lischinsky 1995, "A new model for control of systems with friction".
"""

from __future__ import annotations

from typing import Any

import numpy as np

from planarfriction._support import validation
from planarfriction.laws import LuGre
from planarfriction.models import DistributedModel
from planarfriction.patch import ContactPatch
from planarfriction.scenes import Body, Contact, Scene, Signal, Spring
from planarfriction.scenes.ready import FINE
from planarfriction.sliding_body import SlidingBody

BODY = Body(1.0, 1.0, gravity=(0.0, 0.0))
"""The mass of 1 kg of every experiment; it does not turn."""

PER_PERIOD = 2000
"""Samples of a sine in each of its periods: straight lines between them are within 1.2e-6 of the amplitude."""


def point() -> Any:
    """Make the model of the paper: a single point with `sigma_0 = 1e5`, `sigma_1 = sqrt(1e5)`, `sigma_2 = 0.4`."""
    law = LuGre(
        mu_c=1.0, mu_s=1.5, v_s=1e-3, sigma_0=1e5, sigma_1=np.sqrt(1e5), sigma_2=0.4
    )
    return DistributedModel(ContactPatch.points([[0.0, 0.0]]), law)


def _contact(model: Any, normal_force: Any) -> Contact:
    return Contact(
        point() if model is None else model,
        normal_force,
        mounted_on="body",
        name="table",
    )


def stick_slip(
    model: Any = None,
    *,
    stiffness: float = 2.0,
    speed: float = 0.1,
    normal_force: Any = 1.0,
    t_end: float = 30.0,
) -> Scene:
    """Make the scene of a mass pulled over a table by a spring of `stiffness` [N/m] whose end moves at `speed` [m/s].

    It sticks until the spring overcomes static friction, and slips on until friction catches it again.

    Raises InvalidValueError for a parameter that breaks its rule.
    """
    t_end, way = (
        validation.positive("t_end", t_end),
        validation.number("speed", speed) * t_end,
    )
    end = Signal([0.0, t_end], [[0.0, 0.0, 0.0], [way, 0.0, 0.0]], "linear")
    return Scene(
        BODY,
        _contact(model, normal_force),
        t_end,
        springs=Spring(stiffness, 0.0, end),
        name="stick-slip",
    )


def hunting(
    model: Any = None,
    *,
    gains: tuple[float, float, float] = (3.0, 4.0, 6.0),
    goal: float = 1.0,
    normal_force: float = 1.0,
    t_end: float = 100.0,
    dt: float = 1e-3,
) -> dict[str, np.ndarray]:
    """Simulate a mass under a PID controller of `gains` [N/m, N/(m s), N s/m] that is to bring it to `goal` [m].

    It overshoots, sticks until the integral has grown enough, and overshoots on the other side, for ever. The
    controller acts by its mean over each step, at a speed linear in time, so that its part at the new speed is added to
    the mass. Returns columns time, x and force. The error falls with `dt`.

    Raises InvalidValueError for a parameter that breaks its rule.
    """
    (stiffness, integral, damping) = gains
    half = 0.5 * dt
    model = point() if model is None else model
    body = SlidingBody(
        1.0 + half * (damping + half * (stiffness + half * integral)), 1.0, model
    )
    state = body.rest()
    twist = np.zeros(3)
    error = 0.0
    rows = np.zeros(
        (
            round(validation.positive("t_end", t_end) / validation.positive("dt", dt))
            + 1,
            3,
        )
    )
    for i in range(len(rows) - 1):
        x = rows[i, 1]
        v = twist[0]
        off = goal - x - half * v
        force = stiffness * off + integral * (error + half * off) - damping * v
        state, twist, _ = body.step(state, twist, normal_force, dt, (force, 0.0, 0.0))
        moved = half * (v + twist[0])
        error += dt * (goal - x - 0.5 * moved)
        x += moved
        rows[i + 1] = (
            (i + 1) * dt,
            x,
            stiffness * (goal - x) + integral * error - damping * twist[0],
        )
    return dict(zip(("time", "x", "force"), rows.T, strict=True))


def presliding(
    model: Any = None, *, force: float = 1.425, normal_force: Any = 1.0
) -> Scene:
    """Make the scene of a mass pushed to `force` [N] in 10 s, held for 5 s, to `-force` in 20 s, held for 5 s.

    Less than it takes to slide: the path of a few micrometres is a loop, and does not lead back.

    Raises InvalidValueError for a parameter that breaks its rule.
    """
    force = validation.number("force", force)
    signs = np.array([0.0, 1.0, 1.0, -1.0, -1.0])
    push = Signal(
        [0.0, 10.0, 15.0, 35.0, 40.0],
        force * signs[:, None] * [1.0, 0.0, 0.0],
        "linear",
    )
    return Scene(
        BODY, _contact(model, normal_force), 40.0, push, name="presliding", **FINE
    )


def break_away(
    model: Any = None, *, rate: float = 1.0, normal_force: float = 1.0
) -> Scene:
    """Make the scene of a mass pushed by a force that grows at `rate` [N/s], up to 1.2 times static friction.

    The largest friction on the way, the break-away force, is smaller the faster the force grows.

    Raises InvalidValueError for a parameter that breaks its rule.
    """
    contact = _contact(model, normal_force)
    rate = validation.positive("rate", rate)
    force = (
        1.2
        * contact.model.law.numbers.mu_s
        * validation.positive("normal_force", normal_force)
    )
    push = Signal([0.0, force / rate], [[0.0, 0.0, 0.0], [force, 0.0, 0.0]], "linear")
    options = FINE | {"save_every": 5e-4 * force / rate}
    return Scene(BODY, contact, force / rate, push, name="break-away", **options)


def friction_lag(
    model: Any = None,
    *,
    frequency: float = 1.0,
    speed: float = 1.5e-3,
    amplitude: float = 1e-3,
    normal_force: Any = 1.0,
    periods: int = 2,
) -> Scene:
    """Make the scene of a patch moved at `speed + amplitude sin(frequency t)` [m/s], `frequency` in rad/s.

    Friction lags behind the speed: it is larger while the speed grows than while it falls.

    Raises InvalidValueError for a parameter that breaks its rule.
    """
    speed = validation.number("speed", speed)
    amplitude = validation.number("amplitude", amplitude)
    step = 2.0 * np.pi / PER_PERIOD / validation.positive("frequency", frequency)
    phase = (
        2.0
        * np.pi
        * np.arange(PER_PERIOD * validation.count("periods", periods) + 1)
        / PER_PERIOD
    )
    velocity = (speed + amplitude * np.sin(phase))[:, None] * [1.0, 0.0, 0.0]
    moved = Signal(step * np.arange(len(phase)), velocity, "linear")
    contact = _contact(model, normal_force)
    t_end = float(moved.times[-1])
    return Scene(
        None,
        contact,
        t_end,
        velocity=moved,
        name="friction lag",
        save_every=step,
        **FINE,
    )
