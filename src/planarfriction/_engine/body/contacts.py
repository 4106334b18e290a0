"""Contacts of a planar body, as compiled loops see them: mounts, models, loads and shapes.

The twist of contact c is `V = A(pose) u` for the body's velocity `u = (vx, vy, omega)`, and its wrench `W` acts on the
body as `A' W`, since power is the same at both ends. With `G = d(A u)/d pose` and `H = d(A' W)/d pose` that is all the
body needs to know of a contact; its model is called by address (see `ModelFunctions`).
"""

from __future__ import annotations

import math
from typing import NamedTuple

from planarfriction._engine.codegen.vectors import clear
from planarfriction._engine.compiler import kernel
from planarfriction._engine.compiler.memory import Doubles, Integers

WORLD = 0
"""Axes of a contact that is fixed to the world."""

BODY = 1
"""Axes of a contact that is fixed to the body."""

BODY_AXES = 2
"""Axes of a contact on the body whose prescribed velocity is given in the body's
axes."""


class Contacts(NamedTuple):
    """C contacts and the R shapes they take."""

    calls: Doubles
    """Words of the `Addresses` of the functions of each contact, [C, 8]."""
    record: Integers
    """Addresses of the records of contacts, one for each shape, [R]."""
    mount: Integers
    """`WORLD`, `BODY` or `BODY_AXES`, [C]."""
    place: Doubles
    """Position of the contact frame on its mount, cosine and sine of its angle, [C, 4]."""
    count: Doubles
    """Number of identical contacts that share the state, [C]."""
    state: Integers
    """Number of the state at which the bristles of each contact begin, [C + 1]."""
    linear: Integers
    """Number of the workspace at which the linearisation of each contact begins, [C + 1]."""
    stiff: Doubles
    """Loads [N] at which laws alone would be as stiff as their pads; 0 without one, [C]."""
    bristle: Integers
    """Components of a bristle of each contact, [C]."""


@kernel
def contact_map(mount: int, place: Doubles, pose: Doubles, a: Doubles) -> None:
    """Write `A`, with `V = A u`, into `a` [3, 3]."""
    dx = place[0]
    dy = place[1]
    c = place[2]
    s = place[3]
    if mount == WORLD:
        dx = dx - pose[0]
        dy = dy - pose[1]
    elif mount == BODY:
        ct = math.cos(pose[2])
        st = math.sin(pose[2])
        dx, dy = ct * dx - st * dy, st * dx + ct * dy
        c, s = c * ct - s * st, s * ct + c * st
    a[0] = c
    a[1] = s
    a[2] = s * dx - c * dy
    a[3] = -s
    a[4] = c
    a[5] = s * dy + c * dx
    a[6] = 0.0
    a[7] = 0.0
    a[8] = 1.0


@kernel
def contact_map_slopes(
    mount: int, a: Doubles, u: Doubles, w: Doubles, g: Doubles, h: Doubles
) -> None:
    """Write `G = d(A u)/d pose` and `H = d(A' W)/d pose` into `g` and `h` [3, 3]."""
    clear(g, 9)
    clear(h, 9)
    if mount == WORLD:
        # the lever arm shortens as the body moves; world axes of the force
        fx = a[0] * w[0] + a[3] * w[1]
        fy = a[1] * w[0] + a[4] * w[1]
        g[0] = -u[2] * a[1]
        g[1] = u[2] * a[0]
        g[3] = -u[2] * a[4]
        g[4] = u[2] * a[3]
        h[6] = -fy
        h[7] = fx
    elif mount == BODY:
        # the contact's axes turn with the body
        g[2] = a[3] * u[0] + a[4] * u[1]
        g[5] = -(a[0] * u[0] + a[1] * u[1])
        h[2] = a[3] * w[0] - a[0] * w[1]
        h[5] = a[4] * w[0] - a[1] * w[1]
