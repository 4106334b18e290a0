"""Source of a pressure that follows the load of a body that moves in a plane (see `given_pressure`): its centre p.

The weights are those of `moment_pressure.tilt` at p.
"""

from __future__ import annotations

from typing import NamedTuple

from planarfriction._engine.cells.given_pressure import (
    FOLLOWING,
    GivenPressure,
    Pressed,
)
from planarfriction._engine.cells.moment_pressure import tilt
from planarfriction._engine.codegen.vectors import Vector
from planarfriction._engine.compiler import compiled_math as xp
from planarfriction._engine.compiler import kernel
from planarfriction._engine.compiler.memory import Doubles, reader
from planarfriction._engine.protocol import functions_of


class FollowingContact(NamedTuple):
    """A contact of n cells whose pressure follows the load."""

    given: GivenPressure
    middle: Doubles
    """Centre of pressure of the weights before it moves [m], [2]."""
    slopes: Doubles
    """Relative slopes of weights by the centre of pressure, while all cells press [1/m], [2, n]."""
    centre_x: float
    """Centre of mass c [m]."""
    centre_y: float


@kernel
def _place(record: FollowingContact, z: Doubles, v: Doubles) -> Vector:
    n = record.given.states
    return record.centre_x + z[n], record.centre_y + z[n + 1], 1.0, 0.0


@kernel
def _press(record: FollowingContact, p: Vector, v: Doubles, to: Pressed) -> bool:
    """Write the weights with their centre at p."""
    given = record.given
    n = given.count
    x, y, _, _ = p
    lowest = 1.0
    dx = x - record.middle[0]
    dy = y - record.middle[1]
    for i in range(n):
        share = 1.0 + record.slopes[i] * dx + record.slopes[n + i] * dy
        lowest = xp.minimum(lowest, share)
        to.weights[i] = given.weights[i] * share
    if lowest < 0.0:
        tilt(given.x, given.y, given.weights, n, x, y, to.weights)
    return True


FUNCTIONS = functions_of(
    "following",
    FOLLOWING,
    read=reader(FollowingContact),
    place=_place,
    press=_press,
    follows=True,
)
