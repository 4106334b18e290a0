"""A contact of the reduced model as the solver calls it (see `contacts.ModelFunctions`)."""

from __future__ import annotations

from typing import NamedTuple

from numba import types

from planarfriction import formulas
from planarfriction.formulas import LawNumbers
from planarfriction.kernels import entry, inlined, reduced
from planarfriction.kernels.contacts import ModelFunctions
from planarfriction.kernels.pointers import doubles, matrix, vector
from planarfriction.kernels.records import reader
from planarfriction.kernels.reduced import LINEAR
from planarfriction.kernels.steady import scaled_twist


class Shape(NamedTuple):
    """A patch: F, upper triangular, and the share of the other map in its steady sliding."""

    f_00: float
    f_01: float
    f_02: float
    f_11: float
    f_12: float
    f_22: float
    blend: float


class ReducedContact(NamedTuple):
    """A contact of the reduced model."""

    law: LawNumbers
    shape: Shape
    data: int
    """Where the map of steady sliding is (see `kernels.steady`)."""
    other: int
    """How many doubles further on the other map is."""


read = reader(ReducedContact)


@inlined
def _maps(own):
    return types.int64(0), own.other


@entry
def evaluate(contact, z, v, zdot, w):
    """See `ModelFunctions`."""
    own, v, w = read(contact), doubles(v), doubles(w)
    w[0], w[1], w[2] = reduced.evaluate(
        own.law, doubles(z), v[0], v[1], v[2], own.shape, _maps(own), doubles(own.data), doubles(zdot)
    )


@entry
def linearise(contact, z, v, lin):
    """See `ModelFunctions`."""
    own, v, lin = read(contact), doubles(v), vector(lin, LINEAR)
    reduced.linearise(own.law, doubles(z), v[0], v[1], v[2], own.shape, _maps(own), doubles(own.data), lin)


@entry
def factor(contact, z, shift, lin, stiffness):
    """See `ModelFunctions`."""
    own = read(contact)
    reduced.factor(own.law, shift, own.shape, doubles(lin), matrix(stiffness, 3, 3))


@entry
def eliminate(contact, z, shift, r, lin, w):
    """See `ModelFunctions`."""
    own, w = read(contact), doubles(w)
    w[0], w[1], w[2] = reduced.eliminate(own.law, shift, doubles(r), own.shape, doubles(lin))


@entry
def back_substitute(contact, z, r, dv, lin, out):
    """See `ModelFunctions`."""
    own, v = read(contact), doubles(dv)
    reduced.back_substitute(doubles(r), v[0], v[1], v[2], own.shape, doubles(lin), doubles(out))


@entry
def change(contact, z, zdot, lin, dz, dzdot, rows, friction, size):
    """See `ModelFunctions`."""
    own, rows = read(contact), matrix(rows, 4, 3)
    law, z, lin, dz, out = own.law, doubles(z), doubles(lin), doubles(dz), doubles(dzdot)
    v, w, dv, dw = rows[0], rows[1], rows[2], rows[3]
    x, y, s = scaled_twist(own.shape, dv[0], dv[1], dv[2] + size * v[2])
    ax, ay, a_s = dz[0] - friction * z[0], dz[1] - friction * z[1], dz[2] - friction * z[2]
    for i in range(3):
        a, b = 1 + 3 * i, 10 + 3 * i
        out[i] = lin[a] * ax + lin[a + 1] * ay + lin[a + 2] * a_s + lin[b] * x + lin[b + 1] * y + lin[b + 2] * s
    gx = formulas.traction(dz[0], out[0], x, law)
    gy = formulas.traction(dz[1], out[1], y, law)
    gs = formulas.traction(dz[2], out[2], s, law)
    dw[0], dw[1], tau = reduced.to_origin(own.shape, gx, gy, gs)
    dw[2] = tau + size * w[2]


FUNCTIONS = ModelFunctions(evaluate, linearise, factor, eliminate, back_substitute, change)
