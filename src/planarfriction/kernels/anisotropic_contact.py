"""A contact of the distributed model with directions of its own as the solver calls it (see `kernels.anisotropic`)."""

from __future__ import annotations

from typing import NamedTuple

from planarfriction.formulas import LawNumbers
from planarfriction.kernels import anisotropic, entry
from planarfriction.kernels.anisotropic import CELL_NUMBERS, LINEAR_NUMBERS
from planarfriction.kernels.contacts import ModelFunctions
from planarfriction.kernels.pointers import doubles, matrix, vector
from planarfriction.kernels.records import reader


class AnisotropicContact(NamedTuple):
    """A contact of n cells."""

    law: LawNumbers
    count: int
    """n"""
    cells: int
    """Where the numbers of the cells are, [7, n]."""
    weights: int
    """Where their weights are."""


read = reader(AnisotropicContact)


@entry
def evaluate(contact, z, v, zdot, w):
    """See `ModelFunctions`."""
    own, v, w = read(contact), doubles(v), doubles(w)
    z, zdot, weights = vector(z, 2 * own.count), vector(zdot, 2 * own.count), vector(own.weights, own.count)
    w[0], w[1], w[2] = anisotropic.evaluate(
        own.law, z, v[0], v[1], v[2], matrix(own.cells, CELL_NUMBERS, own.count), weights, zdot
    )


@entry
def linearise(contact, z, v, lin):
    """See `ModelFunctions`."""
    own, v = read(contact), doubles(v)
    anisotropic.linearise(
        own.law,
        vector(z, 2 * own.count),
        v[0],
        v[1],
        v[2],
        matrix(own.cells, CELL_NUMBERS, own.count),
        matrix(lin, LINEAR_NUMBERS, own.count),
    )


@entry
def factor(contact, z, shift, lin, stiffness):
    """See `ModelFunctions`."""
    own, s = read(contact), matrix(stiffness, 3, 3)
    anisotropic.factor(
        own.law,
        shift,
        matrix(own.cells, CELL_NUMBERS, own.count),
        vector(own.weights, own.count),
        matrix(lin, LINEAR_NUMBERS, own.count),
        s,
    )


@entry
def eliminate(contact, z, shift, r, lin, w):
    """See `ModelFunctions`."""
    own, w = read(contact), doubles(w)
    r, weights = vector(r, 2 * own.count), vector(own.weights, own.count)
    w[0], w[1], w[2] = anisotropic.eliminate(
        own.law, shift, r, matrix(own.cells, CELL_NUMBERS, own.count), weights, matrix(lin, LINEAR_NUMBERS, own.count)
    )


@entry
def back_substitute(contact, z, r, dv, lin, out):
    """See `ModelFunctions`."""
    own, v = read(contact), doubles(dv)
    r, out = vector(r, 2 * own.count), vector(out, 2 * own.count)
    anisotropic.back_substitute(
        r, v[0], v[1], v[2], matrix(own.cells, CELL_NUMBERS, own.count), matrix(lin, LINEAR_NUMBERS, own.count), out
    )


@entry
def change(contact, z, zdot, lin, dz, dzdot, rows, friction, size):
    """Not derived: sensitivities refuse anisotropic patches before they come here."""


FUNCTIONS = ModelFunctions(evaluate, linearise, factor, eliminate, back_substitute, change)
