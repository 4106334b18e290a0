"""A contact of three states as the solver sees it (see `contacts.ModelFunctions`): one linear algebra for all models.

In scaled coordinates the state z, conjugate to the scaled twist `u = G V`, obeys `z' = f(z, u)` with the Jacobians
`f_z` and `f_u` [3, 3], and the wrench is `W = G' t` with the traction `t = -(sigma_0 z + sigma_1 z' + sigma_2 u)`. With
`D = shift I - f_z` a step needs `D^-1`, in closed form.

The raw state of a model may have other units, and grow with the size of the patch: a patch `l` times as large sees
`l omega` and gives `l tau`.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from planarfriction.compiler.memory import Doubles, Layout, arrays_at
from planarfriction.kernels.contacts import ROWS, traction
from planarfriction.kernels.small_matrices import applied, inverse
from planarfriction.kernels.vectors import applied_back, plus, put, put_all, three, times


class ThreeStates(NamedTuple):
    """Functions of a model; `own` is the contact's record, which has its law."""

    read: Any
    """`(contact)`: read the record."""
    seen: Any
    """`(own, V)`: return `G V`."""
    wrench: Any
    """`(own, t)`: return `G' t`."""
    viscous: Any
    """`(own, V)`: return the scaled twist that viscous friction goes by."""
    scaled: Any
    """`(own, z)`: return a raw state in scaled coordinates."""
    raw: Any
    """`(own, z)`: return a scaled state in raw coordinates."""
    grows: float
    """1 if the third raw state grows with the size of the patch, else 0."""
    rate: Any
    """`(own, z, u)`: return `f(z, u)`."""
    slopes: Any
    """`(own, z, u, lin)`: write `f_z` and `f_u` into a `LinearMoments`."""


class LinearMoments(NamedTuple):
    """Workspace of a linearisation, each [3, 3] row by row."""

    by_z: Doubles
    """f_z"""
    by_u: Doubles
    """f_u"""
    inverse: Doubles
    """D^-1"""
    scratch: Doubles
    """Numbers that `ThreeStates.slopes` may use, [9]."""


LINEAR = Layout(LinearMoments, by_z=9, by_u=9, inverse=9, scratch=9)
_LINEAR = LINEAR.offsets


def slopes_in(lin: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return `f_z` and `f_u` [B, 3, 3] of linearisations [B, words]."""
    by_z, by_u = (lin[:, LINEAR.slices[name]].reshape(-1, 3, 3) for name in ("by_z", "by_u"))
    return by_z, by_u


def evaluate(model, contact, z, v, zdot, w):
    """Write `z'` and the wrench."""
    own, v = model.read(contact), three(v)
    z = model.scaled(own, three(z))
    rate = model.rate(own, z, model.seen(own, v))
    put(zdot, model.raw(own, rate))
    put(w, model.wrench(own, traction(own.law, z, rate, model.viscous(own, v))))


def linearise(model, contact, z, v, lin):
    """Write `f_z` and `f_u`."""
    own = model.read(contact)
    model.slopes(own, model.scaled(own, three(z)), model.seen(own, three(v)), arrays_at(_LINEAR, lin))


def factor(model, contact, z, shift, lin, stiffness):
    """Prepare `D^-1`, write `-G' ((sigma_0 + sigma_1 shift) D^-1 f_u G + sigma_2 G)`."""
    own, m = model.read(contact), arrays_at(_LINEAR, lin)
    put_all(m.inverse, inverse(shift, m.by_z))
    pull = own.law.sigma_0 + own.law.sigma_1 * shift
    for k in range(3):
        unit = (1.0 if k == 0 else 0.0), (1.0 if k == 1 else 0.0), (1.0 if k == 2 else 0.0)
        z = applied(m.inverse, applied(m.by_u, model.seen(own, unit)))
        t = plus(times(-pull, z), -own.law.sigma_2, model.viscous(own, unit))
        stiffness[k], stiffness[3 + k], stiffness[6 + k] = model.wrench(own, t)


def eliminate(model, contact, z, shift, r, lin, w):
    """Write `G' (sigma_1 - (sigma_0 + sigma_1 shift) D^-1) r`."""
    own, m = model.read(contact), arrays_at(_LINEAR, lin)
    r, pull = model.scaled(own, three(r)), own.law.sigma_0 + own.law.sigma_1 * shift
    put(w, model.wrench(own, plus(times(own.law.sigma_1, r), -pull, applied(m.inverse, r))))


def back_substitute(model, contact, z, r, dv, lin, out):
    """Solve `D out = r + f_u G dV`."""
    own, m = model.read(contact), arrays_at(_LINEAR, lin)
    driven = applied(m.by_u, model.seen(own, three(dv)))
    put(out, model.raw(own, applied(m.inverse, plus(model.scaled(own, three(r)), 1.0, driven))))


def change(model, contact, z, zdot, lin, dz, dzdot, rows, friction, size):
    """Write the changes of `z'` and of the wrench."""
    own, m, rows = model.read(contact), arrays_at(_LINEAR, lin), arrays_at(ROWS, rows)
    turns, grows = (0.0, 0.0, 1.0), model.grows * size
    v, z = plus(three(rows.d_twist), size * rows.twist[2], turns), model.scaled(own, three(z))
    dz = plus(model.scaled(own, three(dz)), -grows * z[2], turns)
    rate = plus(applied(m.by_z, plus(dz, -friction, z)), 1.0, applied(m.by_u, model.seen(own, v)))
    put(dzdot, plus(model.raw(own, rate), grows * zdot[2], turns))
    w = model.wrench(own, traction(own.law, dz, rate, model.viscous(own, v)))
    put(rows.d_wrench, plus(w, size * rows.wrench[2], turns))


def solve_transposed(model, contact, z, r, lin, out):
    """Solve `D' out = r`; a cotangent is scaled as a state is made raw."""
    own, m = model.read(contact), arrays_at(_LINEAR, lin)
    put(out, model.scaled(own, applied_back(m.inverse, model.raw(own, three(r)))))


def pull_back(model, contact, z, lin, dzdot, rows, out):
    """Write the transpose of `change`; that of `G' t` is G."""
    own, m, rows = model.read(contact), arrays_at(_LINEAR, lin), arrays_at(ROWS, rows)
    law, wrench = own.law, three(rows.d_wrench)
    t = model.seen(own, wrench)
    rate = plus(model.raw(own, three(dzdot)), -law.sigma_1, t)
    put(out, model.scaled(own, plus(applied_back(m.by_z, rate), -law.sigma_0, t)))
    u = plus(applied_back(m.by_u, rate), -law.sigma_2, model.viscous(own, wrench))
    put(rows.d_twist, model.wrench(own, u))


TEMPLATES = evaluate, linearise, factor, eliminate, back_substitute, change, solve_transposed, pull_back
