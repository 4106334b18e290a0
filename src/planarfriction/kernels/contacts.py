"""Contacts of a planar body, as compiled loops see them: mounts, models, loads and shapes.

The twist of contact c is `V = A(pose) u` for the body's velocity `u = (vx, vy, omega)`, and its wrench `W` acts on the
body as `A' W`, since power is the same at both ends. With `G = d(A u)/d pose` and `H = d(A' W)/d pose` that is all the
body needs to know of a contact; its model is called by address (see `ModelFunctions`).
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from planarfriction.compiler import entry, kernel
from planarfriction.compiler.calls import address_of
from planarfriction.compiler.memory import Doubles, Integers, Layout, offsets_of, reader, row_of
from planarfriction.kernels.definitions import bind
from planarfriction.kernels.vectors import Vector, clear, plus, times

WORLD, BODY, BODY_AXES = 0, 1, 2
"""Fixed to the world; fixed to the body; fixed to a body whose prescribed velocity is given in its own axes."""


class Rows(NamedTuple):
    """Twist and wrench of a contact and their changes, [3] each."""

    twist: Doubles
    wrench: Doubles
    d_twist: Doubles
    d_wrench: Doubles


ROWS = Layout(Rows, twist=3, wrench=3, d_twist=3, d_wrench=3).offsets
"""Rows [4, 3] as `ModelFunctions` take them (see `memory.arrays_at`)."""


class Seen(NamedTuple):
    """Twist of a contact, and what else its rates and a contact with an edge (see `kernels.edge_cells`) see."""

    twist: Doubles
    """[3]"""
    factor: Doubles
    """Factor on the stiffness, [1]."""
    place: Doubles
    """Place of the body in the contact frame [m], and its angle in the world, [3]."""
    axes: Doubles
    """Cosine and sine of the angle of the contact frame in the world, [2]."""
    covered: Doubles
    """Share of the load of whole cells that lies on the body, to be written where there is an edge; else 1, [1]."""


_SEEN = Layout(Seen, twist=3, factor=1, place=3, axes=2, covered=1)
SEEN, SEEN_SIZE = _SEEN.offsets, _SEEN.size
"""Places of `Seen` (see `memory.arrays_at`), and its size in words."""


class ModelFunctions(NamedTuple):
    """Compiled functions of a kind of model, for the bristles z of one contact, per unit normal load.

    Their first argument is the address of the contact's record, the others are pointers to doubles but for `shift`
    and the two changes. With `z' = f(z, V)`, `D = shift I - df/dz` and the wrench `W(z, V)`:
    """

    evaluate: Any
    """`(contact, z, V, z', W)`: write z' and W; behind V is what `Seen` holds."""
    linearise: Any
    """`(contact, z, V, lin)`: write the derivatives of f into the workspace `lin` of the contact; V as above."""
    factor: Any
    """`(contact, z, shift, lin, S)`: prepare D in `lin`, write S [3, 3] = dW/dV with z eliminated.

    With an edge, dW/dq by the place q of `Seen` is behind it, [3, 3]; there are zeros else."""
    eliminate: Any
    """`(contact, z, shift, r, lin, W)`: write the wrench that the residual r of z' causes."""
    back_substitute: Any
    """`(contact, z, r, dV, lin, out)`: solve `D out = r + df/dV dV`; behind dV is the change of the place, [3]."""
    change: Any = None
    """`(contact, z, z', lin, dz, dz', rows, friction, size)`: write the changes of z' and of the wrench.

    `rows` are `Rows` that hold V, W, dV and take dW. The changes come from `dz`, `dV` and from relative changes of all
    coefficients of friction and of the size of the patch. None: the model takes no part in derivatives of scenes."""
    solve_transposed: Any = None
    """`(contact, z, r, lin, out)`: solve `D' out = r` with the D that `factor` prepared."""
    pull_back: Any = None
    """`(contact, z, lin, l, rows, out)`: the transpose of `change`, at held coefficients.

    From `l` of z' and the wrench's `rows.d_wrench` write `(df/dz)' l + (dW/dz)' d_wrench` to `out` and the same by V to
    `rows.d_twist`."""


Addresses = offsets_of(ModelFunctions)
"""Record of the addresses of `ModelFunctions`; 0 of those that are not wanted."""

addresses_at = reader(Addresses)
CALLS = len(Addresses._fields)


def functions_of(name: str, templates: tuple, **model: Any) -> ModelFunctions:
    """Return the functions of a model, entry points `<name>_<template>`: templates that are bound to its argument."""
    return ModelFunctions(*(bind(each, f"{name}_{each.__name__}", entry, **model) for each in templates))


def calls_of(functions: ModelFunctions, *, change: bool = False) -> np.ndarray:
    """Return the words of `Addresses` of compiled functions of a model, those from `change` on if asked for."""
    wanted = functions[: None if change else ModelFunctions._fields.index("change")]
    return row_of(Addresses(*(address_of(each) if each else 0 for each in wanted), *[0] * (CALLS - len(wanted))))


@kernel
def traction(law: Any, z: Vector, rate: Vector, u: Vector) -> Vector:
    """Return `-(sigma_0 z + sigma_1 z' + sigma_2 u)` of a bristle of any dimension."""
    return plus(plus(times(-law.sigma_0, z), -law.sigma_1, rate), -law.sigma_2, u)


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
    reference: Doubles
    """Reference load [N] of laws whose stiffness does not grow with the load; 0 of others, [C]."""
    bristle: Integers
    """Components of a bristle of each contact with such a law, [C]."""


@kernel
def contact_map(mount: int, place: Doubles, pose: Doubles, a: Doubles) -> None:
    """Write `A`, with `V = A u`, into `a` [3, 3]."""
    dx, dy, c, s = place[0], place[1], place[2], place[3]
    if mount == WORLD:
        dx, dy = dx - pose[0], dy - pose[1]
    elif mount == BODY:
        ct, st = math.cos(pose[2]), math.sin(pose[2])
        dx, dy = ct * dx - st * dy, st * dx + ct * dy
        c, s = c * ct - s * st, s * ct + c * st
    a[0], a[1], a[2] = c, s, s * dx - c * dy
    a[3], a[4], a[5] = -s, c, s * dy + c * dx
    a[6], a[7], a[8] = 0.0, 0.0, 1.0


@kernel
def contact_map_slopes(mount: int, a: Doubles, u: Doubles, w: Doubles, g: Doubles, h: Doubles) -> None:
    """Write `G = d(A u)/d pose` and `H = d(A' W)/d pose` into `g` and `h` [3, 3]."""
    clear(g, 9)
    clear(h, 9)
    if mount == WORLD:
        # the lever arm shortens as the body moves; world axes of the force
        fx, fy = a[0] * w[0] + a[3] * w[1], a[1] * w[0] + a[4] * w[1]
        g[0], g[1] = -u[2] * a[1], u[2] * a[0]
        g[3], g[4] = -u[2] * a[4], u[2] * a[3]
        h[6], h[7] = -fy, fx
    elif mount == BODY:
        # the contact's axes turn with the body
        g[2] = a[3] * u[0] + a[4] * u[1]
        g[5] = -(a[0] * u[0] + a[1] * u[1])
        h[2] = a[3] * w[0] - a[0] * w[1]
        h[5] = a[4] * w[0] - a[1] * w[1]
