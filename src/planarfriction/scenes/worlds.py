"""Ready scenes beyond hand and table: a part that pivots in a gripper, a foot that turns, a curling stone."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal

import numpy as np

from planarfriction import validation
from planarfriction.errors import InvalidValueError
from planarfriction.scenes.body import Body
from planarfriction.scenes.contact import Contact
from planarfriction.scenes.files import rectangle_inertia, rectangle_outline
from planarfriction.scenes.ready import GRAVITY, SAMPLE_TIME, STOP_SPEED
from planarfriction.scenes.scene import Scene
from planarfriction.scenes.signal import Signal, as_signal

GRIP = ([0.0, 0.2, 0.24, 0.36, 0.4], [4.0, 4.0, 1.0, 1.0, 6.0])
"""Corners [s], [N] of the grip of one finger: holds, lets go, catches."""

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
    inertia, outline = rectangle_inertia(mass, size), rectangle_outline(size)
    body = Body(mass, inertia, (arm, 0.0), gravity=(0.0, -GRAVITY), outline=outline)
    load = Signal.sampled(*GRIP, hold="linear").held(SAMPLE_TIME) if normal_force is None else normal_force
    return Scene(body, [Contact(model, load, count=fingers, name="fingers")], t_end, start=start, name="pivot")


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
    ahead = Signal.sampled(*SWAY, hold="linear") if share is None else as_signal("share", share, None)
    if ahead.values.min() < 0.0 or ahead.values.max() > 1.0:
        raise InvalidValueError("share", "be in [0, 1]", f"{ahead.values.min():g} to {ahead.values.max():g}")
    turning = Signal.sampled(*TURNS) if torque is None else as_signal("torque", torque, None)
    wrench = Signal.sampled(turning.times, turning.values[:, None] * [0.0, 0.0, 1.0], turning.hold)
    body = Body(mass, inertia, gravity=(0.0, 0.0), outline=_around(half, 0.5 * SOLE_WIDTH))
    contacts = []
    for name, patch, part, x in (
        ("heel", model, 1.0 - ahead.values, -half),
        ("forefoot", model if forefoot is None else forefoot, ahead.values, half),
    ):
        load = Signal(ahead.times, GRAVITY * body.mass * part, ahead.hold)
        contacts.append(Contact(patch, load, mounted_on="body", position=(x, 0.0), name=name))
    return Scene(body, contacts, t_end, force=wrench, name="foot")


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
    body = Body(mass, inertia, velocity=velocity, gravity=(0.0, 0.0), outline=_around(0.0, STONE_RADIUS))
    weight: Any = GRAVITY * body.mass
    ice = Contact(model, weight, mounted_on="body", name="ice")
    return Scene(body, [ice], t_end, None, None, STOP_SPEED, save_every, start=start, name="curling")


def _around(half: float, radius: float) -> np.ndarray:
    """Return the outline `[M, 2]` [m] at the distance `radius` from the line between (-half, 0) and (half, 0)."""
    angle = 2.0 * np.pi * (np.arange(64) + 0.5) / 64
    x, y = radius * np.cos(angle), radius * np.sin(angle)
    return np.stack([x + np.copysign(half, x), y], axis=1)
