"""Ready scenes, made from a friction model and a few numbers: the published experiments, and everyday ones."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any, Literal

import numpy as np

from planarfriction._support import validation
from planarfriction.errors import InvalidValueError, shown
from planarfriction.scenes.body import Body
from planarfriction.scenes.contact import Contact, checked_model
from planarfriction.scenes.files import rectangle_inertia, rectangle_outline
from planarfriction.scenes.scene import Scene
from planarfriction.scenes.signal import Signal, as_signal, sample_times

GRAVITY = 9.81
"""Acceleration of gravity [m/s^2]."""

SAMPLE_TIME = 0.01
"""Time over which the published experiments hold their inputs [s]."""

STOP_SPEED = 1e-4
"""Speed at which a free slide counts as stopped [m/s]: what is left, v^2/(2 mu g), is below 1e-8 m for mu > 0.1."""

IN_HAND_LOADS = {(1, 1): (1.73, 0.91), (1, 2): (3.6, 0.9)}
"""(load, placement) -> offset and amplitude [N] of the sine at 2 Hz."""

IN_HAND_DROPS = {(2, 1): (2.0, 0.84, 33, 50), (2, 2): (4.0, 2.9, 31, 50)}
"""(load, placement) -> force, force while dropped [N], first dropped sample, first sample after."""


FINE: dict[str, Any] = {"rtol": 1e-6, "atol": 3e-6}
"""Tolerances of scenes that look at small things: wrenches to 1e-5 of the load, motions of nanometres."""


def in_hand_load(
    load: Literal[1, 2], *, placement: Literal[1, 2] = 1, t_end: float = 2.0
) -> Signal:
    """Return the normal force of one finger in the published in-hand runs [N], held over every 0.01 s.

    Load 1 is a sine at 2 Hz, load 2 is constant with one drop. `placement` 1 is the centre of mass at (0.002, 0) m, 2
    at (0.025, 0) m.

    Raises InvalidValueError for any other load or placement.

    Source: Waltersson and Karayiannidis 2024, section VI.
    """
    if not all(type(each) is int and each in (1, 2) for each in (load, placement)):
        given = f"load={shown(load)}, placement={shown(placement)}"
        raise InvalidValueError("load and placement", "each be 1 or 2", given)
    if load == 1:
        offset, amplitude = IN_HAND_LOADS[load, placement]
        return Signal.sine(offset, amplitude, 2.0, t_end=t_end, dt=SAMPLE_TIME)
    force, dropped, first, after = IN_HAND_DROPS[load, placement]
    return Signal.sampled(
        [0.0, first * SAMPLE_TIME, after * SAMPLE_TIME], [force, dropped, force]
    )


def _plate(mass: float, size: Sequence[float], **options: Any) -> Body:
    """Make the body of a uniform rectangular plate of `size` (width, height) [m] and `mass` [kg]."""
    inertia = rectangle_inertia(mass, size)
    return Body(mass, inertia, outline=rectangle_outline(size), **options)


def in_hand(
    model: Any,
    *,
    centre_of_mass: Sequence[float] = (0.002, 0.0),
    normal_force: Any = None,
    fingers: int = 2,
    mass: float = 0.2,
    size: Sequence[float] = (0.15, 0.08),
    t_end: float = 2.0,
    edge: bool = False,
) -> Scene:
    """Make the scene of a plate held upright between finger pads that slips and turns under gravity as the grip varies.

    The pads are fixed at the origin of the world and do not turn; the `fingers` share one state, each pressing with the
    full `normal_force` [N] (a signal or a number; default: `in_hand_load(1)`). `centre_of_mass` [m] is where the
    centre of the plate of `size` (width, height) [m] and `mass` [kg] starts, at rest. With `edge`, only the part of the
    pads that is on the plate carries load; as published, the plate has no edge.

    Raises InvalidValueError for a parameter that breaks its rule.

    Source: Waltersson and Karayiannidis 2024, section VI.
    """
    centre = validation.vector("centre_of_mass", centre_of_mass, 2)
    body = _plate(mass, size, position=centre)
    load = in_hand_load(1, t_end=t_end) if normal_force is None else normal_force
    pads = Contact(model, load, count=fingers, name="fingers", edge=edge)
    return Scene(body, pads, t_end, name="in-hand")


def drift_force(load: Literal["tangential", "normal"], *, t_end: float = 5.0) -> Signal:
    """Return the applied wrench `(fx, fy, tau)` of the published drift runs [N, N, N m], held over every 0.01 s."""
    t = sample_times(t_end, SAMPLE_TIME)
    wave = np.sin(6.0 * np.pi * t)
    force = np.minimum(t / 0.2, 1.0)
    torque = 0.03 * force
    if load == "tangential":
        force = np.where(t > 1.0, 1.0 + 0.4 * wave, force)
        ramp = 0.03 * np.clip((t - 2.8) / 0.2, 0.0, 1.0)
        torque = np.where(t > 3.0, 0.03 + 0.01 * wave, ramp)
    return Signal.sampled(t, np.stack([force, np.zeros_like(t), torque], axis=1))


def drift(
    model: Any,
    *,
    load: Literal["tangential", "normal"] = "tangential",
    t_end: float = 5.0,
) -> Scene:
    """Make the scene of a disc on a table, 1 kg, radius 0.05 m, pushed with less than friction can hold: does it creep?

    `load="tangential"`: the force oscillates, and from 2.8 s a torque does too; `load="normal"`: force and torque are
    constant and the normal force oscillates after 1 s. The contact is fixed to the world.

    Raises InvalidValueError for a parameter that breaks its rule.

    Source: Waltersson and Karayiannidis 2024, section VI.
    """
    validation.choice("load", load, ("tangential", "normal"))
    normal_force: Any = GRAVITY
    if load == "normal":
        t = sample_times(t_end, SAMPLE_TIME)
        wave = np.where(t > 1.0, np.sin(6.0 * np.pi * t), 0.0)
        normal_force = Signal.sampled(t, GRAVITY + wave)
    around = 2.0 * np.pi * np.arange(64) / 64
    outline = 0.05 * np.stack([np.cos(around), np.sin(around)], axis=1)
    # Inertia of a disc, m R^2 / 2.
    body = Body(1.0, 1.25e-3, gravity=(0.0, 0.0), outline=outline)
    table = Contact(model, normal_force, name="table")
    force = drift_force(load, t_end=t_end)
    return Scene(body, table, t_end, force, **FINE, name=f"drift, {load}")


def free_slide(
    model: Any,
    *,
    mass: float = 0.2,
    inertia: float | None = None,
    twist: Sequence[float] = (1.0, 0.0, 100.0),
    position: Sequence[float] = (0.0, 0.0),
    angle: float = 0.0,
    normal_force: Any = None,
    outline: np.ndarray | None = None,
    t_end: float = 5.0,
    save_every: float = 0.01,
) -> Scene:
    """Make the scene of a body thrown onto a level table with a `twist` `(vx, vy, omega)`; it ends when that stops.

    The patch is fixed to the body, its frame's origin at the centre of mass. `mass` [kg], `inertia` about the centre of
    mass [kg m^2] (default: that of a puck whose mass is spread like its contact pressure), initial `position` [m] and
    `angle` [rad], `normal_force` [N] a signal or a number (default: the weight `9.81 mass`), `outline` `[M, 2]` [m] for
    drawing, `save_every` [s] the time between samples.

    Raises InvalidValueError for a parameter that breaks its rule.
    """
    if inertia is None:
        mass = validation.positive("mass", mass)
        patch = checked_model("model", model).patch
        inertia = mass * float(patch.second_moment(GRAVITY * mass))
    velocity = validation.vector("twist", twist, 3)
    body = Body(
        mass, inertia, position, angle, velocity, gravity=(0.0, 0.0), outline=outline
    )
    load: Any = GRAVITY * body.mass if normal_force is None else normal_force
    table = Contact(model, load, mounted_on="body", name="table")
    stop = None, None, STOP_SPEED, save_every
    return Scene(body, table, t_end, *stop, name="free slide")


def published_velocity(*, speed: float = 0.015, spin: float = 1.0) -> Signal:
    """Return the twist `(vx, vy, omega)` [m/s, m/s, rad/s] of the published driven runs, held over every 0.01 s.

    `speed` [m/s] is the peak of vx (vy peaks at 0.4 of it), `spin` [rad/s] that of omega: spin up, slide along x while
    spinning, slide along y, spin down, stop.

    Raises InvalidValueError for a parameter that breaks its rule.

    Source: Waltersson and Karayiannidis 2024, section VI.
    """
    speed = validation.number("speed", speed)
    spin = validation.number("spin", spin)
    t = sample_times(5.0, SAMPLE_TIME)
    vx = speed * np.interp(t, [0.8, 1.4, 1.6, 2.2], [0.0, 1.0, 1.0, 0.0])
    vy = 0.4 * speed * np.interp(t, [2.4, 2.7, 4.3, 4.6], [0.0, 1.0, 1.0, 0.0])
    omega = spin * np.interp(t, [0.0, 0.6, 3.4, 4.0], [0.0, 1.0, 1.0, 0.0])
    return Signal.sampled(t, np.stack([vx, vy, omega], axis=1))


def driven(
    model: Any,
    *,
    twist: Any = None,
    normal_force: Any = 1.0,
    at: Literal["origin", "centre_of_pressure"] = "centre_of_pressure",
    t_end: float = 5.0,
) -> Scene:
    """Make the scene of a patch moved with a `twist` `(vx, vy, omega)` in its own axes, to record its wrench.

    `twist` is a signal `[T, 3]` or a constant (default: `published_velocity()`), `normal_force` [N] a signal or a
    number. `at` is the point of the patch that has the velocity: the origin of the contact frame, or the centre of
    pressure (if the patch changes with the load: the one at t = 0). Wrenches are about the contact frame's origin.

    Raises InvalidValueError for a parameter that breaks its rule.
    """
    validation.choice("at", at, ("origin", "centre_of_pressure"))
    contact = Contact(model, normal_force, mounted_on="body", name="patch")
    if at == "centre_of_pressure":
        load = float(contact.normal_force(0.0))
        centre = np.asarray(model.patch.centre_of_pressure(load))
        contact = dataclasses.replace(contact, position=-centre)
    # Moved as prescribed: mass and inertia play no part.
    body = Body(1.0, 1.0, gravity=(0.0, 0.0))
    velocity = published_velocity() if twist is None else as_signal("twist", twist, 3)
    return Scene(body, contact, t_end, None, velocity, **FINE, name="driven")


def pushed(
    model: Any,
    *,
    pad: Any = None,
    velocity: Any = None,
    normal_force: Any = 1.0,
    fingers: int = 2,
    position: Sequence[float] = (-0.06, 0.01),
    mass: float = 0.2,
    size: Sequence[float] = (0.15, 0.08),
    t_end: float = 2.0,
) -> Scene:
    """Make the scene of a plate on a table, pushed by two finger pads that pinch it and move as prescribed.

    `model` is the friction of the patch on which the plate of `size` (width, height) [m] and `mass` [kg] stands, under
    its weight, with its frame at the centre of mass. The pads, with the model `pad` (default: the same), begin at
    `position` [m] from there and press with `normal_force` [N] each, a signal or a number. `velocity` is their twist
    `(vx, vy, omega)`, world axes, `[T, 3]`: a signal or a constant (default: up to 0.05 m/s along x and back to rest,
    each in a tenth of the time). The pads may slip and turn on the plate; pushed from behind, it swings round.

    A pusher that touches a point of the plate's outline is not a patch: see `planning.push`.

    Raises InvalidValueError for a parameter that breaks its rule.
    """
    t_end = validation.positive("t_end", t_end)
    if velocity is None:
        times = t_end * np.array([0.0, 0.1, 0.9, 1.0])
        values = np.outer([0.0, 1.0, 1.0, 0.0], [0.05, 0.0, 0.0])
        velocity = Signal.sampled(times, values, "linear")
    body = _plate(mass, size, gravity=(0.0, 0.0))
    weight: Any = GRAVITY * body.mass
    table = Contact(model, weight, mounted_on="body", name="table")
    pads = Contact(
        model if pad is None else pad,
        normal_force,
        position=position,
        count=fingers,
        name="fingers",
        support_velocity=velocity,
    )
    return Scene(body, [table, pads], t_end, name="pushed")


GRIP = ([0.0, 0.2, 0.24, 0.36, 0.4], [4.0, 4.0, 1.0, 1.0, 6.0])
"""Corners [s], [N] of the grip of one finger: holds, loosens, catches."""

SWAY = ([0.7, 1.0], [0.1, 0.9])
"""Corners [s], [-] of the share of the weight on the forefoot."""

TURNS = ([0.0, 0.1, 0.4, 1.1, 1.4], [0.0, 20.0, 0.0, -20.0, 0.0])
"""Times [s] and yaw torques [N m] from then on that turn the foot, and turn it back."""

SOLE_WIDTH = 0.09
"""Width of the outline around both patches of a foot [m], for drawings."""

STONE_RADIUS = 0.14
"""Radius of a curling stone [m]: 0.88 m around, of 0.91 m (36 inches) that the rules allow."""


def pivot(
    model: Any,
    *,
    mass: float = 0.06,
    size: Sequence[float] = (0.16, 0.03),
    arm: float = 0.06,
    normal_force: Any = None,
    fingers: int = 2,
    start: Literal["rest", "equilibrium"] = "equilibrium",
    t_end: float = 1.0,
) -> Scene:
    """Make the scene of a part held level by one end between finger pads, which loosen, let it swing, and catch it.

    The pads are at the origin of the world; the centre of mass of the plate of `size` (width, height) [m] and `mass`
    [kg] starts `arm` [m] beside them. Each of the `fingers` presses with the full `normal_force` [N], a signal or a
    number (default: 4 N; from 0.24 s 1 N, from 0.4 s 6 N). The part turns while `fingers mu f_N r < mass g arm`, and
    the contact radius r of a soft finger grows with its load. By default the bristles carry the weight at the `start`;
    if the grip cannot hold the part, use "rest".

    Raises InvalidValueError for a parameter that breaks its rule.
    """
    arm = validation.positive("arm", arm)
    body = _plate(mass, size, position=(arm, 0.0))
    if normal_force is None:
        normal_force = Signal.sampled(*GRIP, hold="linear").held(SAMPLE_TIME)
    pads = Contact(model, normal_force, count=fingers, name="fingers")
    return Scene(body, pads, t_end, start=start, name="pivot")


def foot(
    model: Any,
    *,
    forefoot: Any = None,
    mass: float = 40.0,
    inertia: float = 1.0,
    length: float = 0.16,
    share: Any = None,
    torque: Any = None,
    t_end: float = 2.0,
) -> Scene:
    """Make the scene of a robot on one foot that turns about its heel and back about its forefoot: a sideways move.

    Heel (`model`) and `forefoot` (a model; the heel's by default) are fixed to the body, `length` [m] apart along x,
    with the centre of mass of `mass` [kg] and `inertia` about the vertical [kg m^2] midway. `share` of the weight is on
    the forefoot [-] (default: 0.1, from 1 s on 0.9), and the yaw `torque` [N m] turns the body (default: 20 N m for 0.3
    s from 0.1 s on, -20 N m from 1.1 s on); each a signal or a number.

    Raises InvalidValueError for a parameter that breaks its rule.
    """
    half = 0.5 * validation.positive("length", length)
    share = Signal.sampled(*SWAY, hold="linear") if share is None else share
    ahead = as_signal("share", share, None)
    least = ahead.values.min()
    most = ahead.values.max()
    if least < 0.0 or most > 1.0:
        raise InvalidValueError("share", "be in [0, 1]", f"{least:g} to {most:g}")
    torque = Signal.sampled(*TURNS) if torque is None else torque
    turning = as_signal("torque", torque, None)
    turns = turning.values[:, None] * [0.0, 0.0, 1.0]
    wrench = Signal.sampled(turning.times, turns, turning.hold)
    outline = _around(half, 0.5 * SOLE_WIDTH)
    body = Body(mass, inertia, gravity=(0.0, 0.0), outline=outline)
    contacts = []
    for name, patch, part, x in (
        ("heel", model, 1.0 - ahead.values, -half),
        ("forefoot", model if forefoot is None else forefoot, ahead.values, half),
    ):
        load = Signal(ahead.times, GRAVITY * body.mass * part, ahead.hold)
        contacts.append(
            Contact(patch, load, mounted_on="body", position=(x, 0.0), name=name)
        )
    return Scene(body, contacts, t_end, wrench, name="foot")


def curling(
    model: Any,
    *,
    mass: float = 19.0,
    inertia: float | None = None,
    twist: Sequence[float] = (2.2, 0.0, 1.5),
    start: Literal["rest", "sliding"] = "sliding",
    t_end: float = 60.0,
    save_every: float = 0.05,
) -> Scene:
    """Make the scene of a curling stone released with the `twist` `(vx, vy, omega)`; it ends when it has stopped.

    The patch is fixed to the stone, with the origin of its frame at the centre of mass; on real stones it is a narrow
    ring. `mass` [kg], `inertia` about the vertical [kg m^2] (default: that of a cylinder of radius 0.14 m), `start` the
    initial state of the bristles, `save_every` [s] the time between samples. Friction that is the same in all
    directions, under an even pressure, slows the stone and its spin but does not make it curl.

    Raises InvalidValueError for a parameter that breaks its rule.
    """
    if inertia is None:
        inertia = 0.5 * validation.positive("mass", mass) * STONE_RADIUS**2
    velocity = validation.vector("twist", twist, 3)
    outline = _around(0.0, STONE_RADIUS)
    body = Body(mass, inertia, velocity=velocity, gravity=(0.0, 0.0), outline=outline)
    weight: Any = GRAVITY * body.mass
    ice = Contact(model, weight, mounted_on="body", name="ice")
    stop = None, None, STOP_SPEED, save_every
    return Scene(body, ice, t_end, *stop, start=start, name="curling")


def _around(half: float, radius: float) -> np.ndarray:
    """Return the outline `[M, 2]` [m] at the distance `radius` from the line between (-half, 0) and (half, 0)."""
    angle = 2.0 * np.pi * (np.arange(64) + 0.5) / 64
    x = radius * np.cos(angle)
    y = radius * np.sin(angle)
    return np.stack([x + np.copysign(half, x), y], axis=1)
