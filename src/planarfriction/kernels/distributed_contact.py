"""A contact of the distributed model as the solver calls it (see `contacts.ModelFunctions`)."""

from __future__ import annotations

from typing import NamedTuple

from planarfriction import formulas
from planarfriction.formulas import LawNumbers
from planarfriction.kernels import distributed, entry, inlined
from planarfriction.kernels.contacts import ModelFunctions
from planarfriction.kernels.pointers import doubles, matrix, vector
from planarfriction.kernels.records import reader

LINEAR = 7
"""Numbers of a cell's linearisation."""


class DistributedContact(NamedTuple):
    """A contact of n cells."""

    law: LawNumbers
    count: int
    """n"""
    x: int
    """Where the positions of the cells are [m], and their weights."""
    y: int
    weights: int


read = reader(DistributedContact)


@inlined
def _cells(own):
    return vector(own.x, own.count), vector(own.y, own.count), vector(own.weights, own.count)


@entry
def evaluate(contact, z, v, zdot, w):
    """See `ModelFunctions`."""
    own, v, w = read(contact), doubles(v), doubles(w)
    x, y, weights = _cells(own)
    z, zdot = vector(z, 2 * own.count), vector(zdot, 2 * own.count)
    w[0], w[1], w[2] = distributed.evaluate(own.law, z, v[0], v[1], v[2], x, y, weights, zdot)


@entry
def linearise(contact, z, v, lin):
    """See `ModelFunctions`."""
    own, v = read(contact), doubles(v)
    x, y, _ = _cells(own)
    distributed.linearise(own.law, vector(z, 2 * own.count), v[0], v[1], v[2], x, y, matrix(lin, LINEAR, own.count))


@entry
def factor(contact, z, shift, lin, stiffness):
    """See `ModelFunctions`."""
    own, s = read(contact), matrix(stiffness, 3, 3)
    x, y, weights = _cells(own)
    distributed.factor(own.law, vector(z, 2 * own.count), shift, x, y, weights, matrix(lin, LINEAR, own.count), s)


@entry
def eliminate(contact, z, shift, r, lin, w):
    """See `ModelFunctions`."""
    own, w = read(contact), doubles(w)
    x, y, weights = _cells(own)
    z, r = vector(z, 2 * own.count), vector(r, 2 * own.count)
    w[0], w[1], w[2] = distributed.eliminate(own.law, z, shift, r, x, y, weights, matrix(lin, LINEAR, own.count))


@entry
def back_substitute(contact, z, r, dv, lin, out):
    """See `ModelFunctions`."""
    own, v = read(contact), doubles(dv)
    x, y, _ = _cells(own)
    z, r, out = vector(z, 2 * own.count), vector(r, 2 * own.count), vector(out, 2 * own.count)
    distributed.back_substitute(z, r, v[0], v[1], v[2], x, y, matrix(lin, LINEAR, own.count), out)


@entry
def change(contact, z, zdot, lin, dz, dzdot, rows, friction, size):
    """See `ModelFunctions`."""
    own, rows = read(contact), matrix(rows, 4, 3)
    law, n, lin = own.law, own.count, matrix(lin, LINEAR, own.count)
    v, w, dv = rows[0], rows[1], rows[2]
    z, dz, dzdot = vector(z, 2 * n), vector(dz, 2 * n), vector(dzdot, 2 * n)
    x, y, weights = _cells(own)
    fx, fy, tau = 0.0, 0.0, size * w[2]
    spin = dv[2] + size * v[2]
    for i in range(n):
        zx, zy = z[i], z[n + i]
        ux, uy = dv[0] - spin * y[i], dv[1] + spin * x[i]
        ax, ay = dz[i] - friction * zx, dz[n + i] - friction * zy
        k = lin[1, i] * ax + lin[2, i] * ay + lin[3, i] * ux + lin[4, i] * uy
        dzdot[i] = ux - lin[0, i] * ax - zx * k
        dzdot[n + i] = uy - lin[0, i] * ay - zy * k
        tx = weights[i] * formulas.traction(dz[i], dzdot[i], ux, law)
        ty = weights[i] * formulas.traction(dz[n + i], dzdot[n + i], uy, law)
        fx += tx
        fy += ty
        tau += x[i] * ty - y[i] * tx
    rows[3, 0], rows[3, 1], rows[3, 2] = fx, fy, tau


FUNCTIONS = ModelFunctions(evaluate, linearise, factor, eliminate, back_substitute, change)
