"""Contacts of a planar body, as compiled loops see them: where each sits, which model it has, what load and shape.

The twist of contact c is `V = A(pose) u` for the body's velocity `u = (vx, vy, omega)`, and its wrench `W` acts on the
body as `A' W`, since power is the same at both ends. With `G = d(A u)/d pose` and `H = d(A' W)/d pose` that is all the
body needs to know of a contact.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from planarfriction.kernels import anisotropic, distributed, inlined, published, reduced
from planarfriction.kernels.law import law_of

DISTRIBUTED, PUBLISHED, ANISOTROPIC, REDUCED = 0, 1, 2, 3
WORLD, BODY, BODY_AXES = 0, 1, 2
"""Fixed to the world; fixed to the body; fixed to a body whose prescribed velocity is given in its own axes."""


class Contacts(NamedTuple):
    """C contacts and the R shapes they take, in flat arrays."""

    kind: np.ndarray
    """`DISTRIBUTED`, `PUBLISHED`, `ANISOTROPIC` (distributed) or `REDUCED`, int [C]."""
    law: np.ndarray
    """Numbers of the law, a row each."""
    mount: np.ndarray
    """`WORLD`, `BODY` or `BODY_AXES`, int [C]."""
    place: np.ndarray
    """Position of the contact frame on its mount, cosine and sine of its angle, [C, 4]."""
    count: np.ndarray
    """How many identical contacts share the state, [C]."""
    state: np.ndarray
    """Where the bristles of each contact begin in the state vector, int [C + 1]."""
    linear: np.ndarray
    """Where the linearisation of each contact begins in its workspace, int [C + 1]."""
    cell: np.ndarray
    """Where the cells of each contact begin in `x` and `y`, int [C + 1]."""
    x: np.ndarray
    y: np.ndarray
    weights: np.ndarray
    """Weights of the distributed and anisotropic contacts, one run of cells a shape, flat."""
    weight_start: np.ndarray
    """Where the weights of each shape begin, int [R]."""
    shape: np.ndarray
    """Numbers of each shape, [R, 7]: as `kernels.reduced` reads them, or as `kernels.published` (4) with the root of
    the metric (xx, xy, yy)."""
    surface: np.ndarray
    """Of each shape, int [R, 3]: limit surface (kind, start, size), maps of `kernels.reduced` (start, other), or the
    anisotropic cells (0, start, n)."""
    data: np.ndarray
    """Numbers of the limit surfaces and maps, and of the anisotropic cells (see `kernels.anisotropic`), flat."""


@inlined
def contact_map(mount, place, pose, a):
    """Write `A`, with `V = A u`, into `a` [3, 3]."""
    dx, dy, c, s = place[0], place[1], place[2], place[3]
    if mount == WORLD:
        dx, dy = dx - pose[0], dy - pose[1]
    elif mount == BODY:
        ct, st = math.cos(pose[2]), math.sin(pose[2])
        dx, dy = ct * dx - st * dy, st * dx + ct * dy
        c, s = c * ct - s * st, s * ct + c * st
    a[0, 0], a[0, 1], a[0, 2] = c, s, s * dx - c * dy
    a[1, 0], a[1, 1], a[1, 2] = -s, c, s * dy + c * dx
    a[2, 0], a[2, 1], a[2, 2] = 0.0, 0.0, 1.0


@inlined
def contact_map_slopes(mount, a, u, w, g, h):
    """Write `G = d(A u)/d pose` and `H = d(A' W)/d pose` into `g` and `h` [3, 3]."""
    for i in range(3):
        for j in range(3):
            g[i, j] = 0.0
            h[i, j] = 0.0
    if mount == WORLD:
        # the lever arm shortens as the body moves; world axes of the force
        fx, fy = a[0, 0] * w[0] + a[1, 0] * w[1], a[0, 1] * w[0] + a[1, 1] * w[1]
        g[0, 0], g[0, 1] = -u[2] * a[0, 1], u[2] * a[0, 0]
        g[1, 0], g[1, 1] = -u[2] * a[1, 1], u[2] * a[1, 0]
        h[2, 0], h[2, 1] = -fy, fx
    elif mount == BODY:
        # the contact's axes turn with the body
        g[0, 2] = a[1, 0] * u[0] + a[1, 1] * u[1]
        g[1, 2] = -(a[0, 0] * u[0] + a[0, 1] * u[1])
        h[0, 2] = a[1, 0] * w[0] - a[0, 0] * w[1]
        h[1, 2] = a[1, 1] * w[0] - a[0, 1] * w[1]


@inlined
def evaluate(contacts, c, row, z, v, zdot, w):
    """Bristle rates and wrench per unit load of contact c in shape `row` at the twist `v`."""
    law = law_of(contacts.law[c])
    if contacts.kind[c] == DISTRIBUTED:
        x, y, weights = _cells(contacts, c, row)
        w[0], w[1], w[2] = distributed.evaluate(law, z, v[0], v[1], v[2], x, y, weights, zdot)
    elif contacts.kind[c] == ANISOTROPIC:
        cells, weights = _anisotropic_cells(contacts, c, row)
        w[0], w[1], w[2] = anisotropic.evaluate(law, z, v[0], v[1], v[2], cells, weights, zdot)
    elif contacts.kind[c] == REDUCED:
        w[0], w[1], w[2] = reduced.evaluate(
            law, z, v[0], v[1], v[2], contacts.shape[row], contacts.surface[row], contacts.data, zdot
        )
    else:
        shape = contacts.shape[row]
        vx, vy = _through_root(shape, v[0], v[1])
        fx, fy, w[2] = published.evaluate(law, z, vx, vy, v[2], shape, contacts.surface[row], contacts.data, zdot)
        w[0], w[1] = _through_root(shape, fx, fy)


@inlined
def linearise(contacts, c, row, z, v, lin):
    """Linearise contact c in shape `row` at the twist `v` into its workspace `lin`."""
    law = law_of(contacts.law[c])
    if contacts.kind[c] == DISTRIBUTED:
        x, y, _ = _cells(contacts, c, row)
        distributed.linearise(law, z, v[0], v[1], v[2], x, y, lin.reshape(7, x.shape[0]))
    elif contacts.kind[c] == ANISOTROPIC:
        cells, weights = _anisotropic_cells(contacts, c, row)
        rows = lin.reshape(anisotropic.LINEAR_NUMBERS, weights.shape[0])
        anisotropic.linearise(law, z, v[0], v[1], v[2], cells, rows)
    elif contacts.kind[c] == REDUCED:
        reduced.linearise(law, z, v[0], v[1], v[2], contacts.shape[row], contacts.surface[row], contacts.data, lin)
    else:
        shape = contacts.shape[row]
        vx, vy = _through_root(shape, v[0], v[1])
        published.linearise(law, z, vx, vy, v[2], shape, contacts.surface[row], contacts.data, lin)


@inlined
def factor(contacts, c, row, z, shift, lin, stiffness):
    """Prepare the elimination of the bristles of contact c and write its `d wrench / d twist` per unit load."""
    law = law_of(contacts.law[c])
    if contacts.kind[c] == DISTRIBUTED:
        x, y, weights = _cells(contacts, c, row)
        distributed.factor(law, z, shift, x, y, weights, lin.reshape(7, x.shape[0]), stiffness)
    elif contacts.kind[c] == ANISOTROPIC:
        cells, weights = _anisotropic_cells(contacts, c, row)
        rows = lin.reshape(anisotropic.LINEAR_NUMBERS, weights.shape[0])
        anisotropic.factor(law, shift, cells, weights, rows, stiffness)
    elif contacts.kind[c] == REDUCED:
        reduced.factor(law, shift, contacts.shape[row], lin, stiffness)
    else:
        shape = contacts.shape[row]
        published.factor(law, shift, shape, lin, stiffness)
        for i in range(3):
            stiffness[i, 0], stiffness[i, 1] = _through_root(shape, stiffness[i, 0], stiffness[i, 1])
        for i in range(3):
            stiffness[0, i], stiffness[1, i] = _through_root(shape, stiffness[0, i], stiffness[1, i])


@inlined
def eliminate(contacts, c, row, z, shift, r, lin, w):
    """Wrench per unit load of contact c caused by its bristle residual `r`."""
    law = law_of(contacts.law[c])
    if contacts.kind[c] == DISTRIBUTED:
        x, y, weights = _cells(contacts, c, row)
        w[0], w[1], w[2] = distributed.eliminate(law, z, shift, r, x, y, weights, lin.reshape(7, x.shape[0]))
    elif contacts.kind[c] == ANISOTROPIC:
        cells, weights = _anisotropic_cells(contacts, c, row)
        rows = lin.reshape(anisotropic.LINEAR_NUMBERS, weights.shape[0])
        w[0], w[1], w[2] = anisotropic.eliminate(law, shift, r, cells, weights, rows)
    elif contacts.kind[c] == REDUCED:
        w[0], w[1], w[2] = reduced.eliminate(law, shift, r, contacts.shape[row], lin)
    else:
        shape = contacts.shape[row]
        fx, fy, w[2] = published.eliminate(law, shift, r, shape, lin)
        w[0], w[1] = _through_root(shape, fx, fy)


@inlined
def back_substitute(contacts, c, row, z, r, v, lin, out):
    """Bristle solution of contact c for the residual `r` and the twist change `v`."""
    if contacts.kind[c] == DISTRIBUTED:
        x, y, _ = _cells(contacts, c, row)
        distributed.back_substitute(z, r, v[0], v[1], v[2], x, y, lin.reshape(7, x.shape[0]), out)
    elif contacts.kind[c] == ANISOTROPIC:
        cells, weights = _anisotropic_cells(contacts, c, row)
        rows = lin.reshape(anisotropic.LINEAR_NUMBERS, weights.shape[0])
        anisotropic.back_substitute(r, v[0], v[1], v[2], cells, rows, out)
    elif contacts.kind[c] == REDUCED:
        reduced.back_substitute(r, v[0], v[1], v[2], contacts.shape[row], lin, out)
    else:
        shape = contacts.shape[row]
        vx, vy = _through_root(shape, v[0], v[1])
        published.back_substitute(r, vx, vy, v[2], shape, lin, out)


@inlined
def _cells(contacts, c, row):
    first, last = contacts.cell[c], contacts.cell[c + 1]
    start = contacts.weight_start[row]
    return contacts.x[first:last], contacts.y[first:last], contacts.weights[start : start + last - first]


@inlined
def _anisotropic_cells(contacts, c, row):
    n, start, first = contacts.surface[row, 2], contacts.weight_start[row], contacts.surface[row, 1]
    cells = contacts.data[first : first + anisotropic.CELL_NUMBERS * n].reshape(anisotropic.CELL_NUMBERS, n)
    return cells, contacts.weights[start : start + n]


@inlined
def _through_root(shape, x, y):
    """A velocity in the axes of a reduced contact's metric, or a force out of them: times the symmetric root."""
    return shape[4] * x + shape[5] * y, shape[5] * x + shape[6] * y
