"""A contact of several parts, as the solver calls it (see `contacts.ModelFunctions`).

Parts see the same twist, share the load and know nothing of each other: the wrench is the sum of theirs, each times the
share of the part, and everything else is done part by part, by the functions of a contact of one part.
"""

from __future__ import annotations

from typing import NamedTuple

from planarfriction.compiler import entry, kernel
from planarfriction.kernels.contacts import (
    BACK_SUBSTITUTE,
    CHANGE,
    ELIMINATE,
    EVALUATE,
    FACTOR,
    LINEARISE,
    PULL_BACK,
    SOLVE_TRANSPOSED,
    ModelFunctions,
)
from planarfriction.kernels.pointers import at, call, doubles, integers
from planarfriction.kernels.records import reader


class PartsContact(NamedTuple):
    """A contact of `count` parts."""

    count: int
    states: int
    """States of a part."""
    workspace: int
    """Numbers that a linearisation of a part takes."""
    calls: int
    """Where the addresses of the functions of a part are, [8]."""
    records: int
    """Where the addresses of the records of the parts are, [count]."""
    shares: int
    """Where their shares of the load are, [count]."""


read = reader(PartsContact)


@kernel
def _part(own, k):
    """Record of part k, where its states and its linearisation begin, and its share."""
    return integers(own.records)[k], k * own.states, k * own.workspace, doubles(own.shares)[k]


@entry
def evaluate(contact, z, v, zdot, w):
    """See `ModelFunctions`."""
    own, one = read(contact), doubles(w)
    x, y, tau = 0.0, 0.0, 0.0
    for k in range(own.count):
        part, first, _, share = _part(own, k)
        call(integers(own.calls)[EVALUATE], (part, at(z, first), v, at(zdot, first), w))
        x, y, tau = x + share * one[0], y + share * one[1], tau + share * one[2]
    one[0], one[1], one[2] = x, y, tau


@entry
def linearise(contact, z, v, lin):
    """See `ModelFunctions`."""
    own = read(contact)
    for k in range(own.count):
        part, first, work, _ = _part(own, k)
        call(integers(own.calls)[LINEARISE], (part, at(z, first), v, at(lin, work)))


@entry
def factor(contact, z, shift, lin, stiffness):
    """See `ModelFunctions`."""
    own, one = read(contact), doubles(stiffness)
    a, b, c, d, e, f, g, h, i = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(own.count):
        part, first, work, share = _part(own, k)
        call(integers(own.calls)[FACTOR], (part, at(z, first), shift, at(lin, work), stiffness))
        a, b, c = a + share * one[0], b + share * one[1], c + share * one[2]
        d, e, f = d + share * one[3], e + share * one[4], f + share * one[5]
        g, h, i = g + share * one[6], h + share * one[7], i + share * one[8]
    one[0], one[1], one[2], one[3], one[4], one[5], one[6], one[7], one[8] = a, b, c, d, e, f, g, h, i


@entry
def eliminate(contact, z, shift, r, lin, w):
    """See `ModelFunctions`."""
    own, one = read(contact), doubles(w)
    x, y, tau = 0.0, 0.0, 0.0
    for k in range(own.count):
        part, first, work, share = _part(own, k)
        call(integers(own.calls)[ELIMINATE], (part, at(z, first), shift, at(r, first), at(lin, work), w))
        x, y, tau = x + share * one[0], y + share * one[1], tau + share * one[2]
    one[0], one[1], one[2] = x, y, tau


@entry
def back_substitute(contact, z, r, dv, lin, out):
    """See `ModelFunctions`."""
    own = read(contact)
    for k in range(own.count):
        part, first, work, _ = _part(own, k)
        call(
            integers(own.calls)[BACK_SUBSTITUTE], (part, at(z, first), at(r, first), dv, at(lin, work), at(out, first))
        )


@entry
def change(contact, z, zdot, lin, dz, dzdot, rows, friction, size):
    """See `ModelFunctions`; a part sees the wrench of all in the place of its own, as shares add up to one."""
    own, one = read(contact), doubles(at(rows, 9))
    x, y, tau = 0.0, 0.0, 0.0
    for k in range(own.count):
        part, first, work, share = _part(own, k)
        states = at(z, first), at(zdot, first), at(lin, work), at(dz, first), at(dzdot, first)
        call(integers(own.calls)[CHANGE], (part, *states, rows, friction, size))
        x, y, tau = x + share * one[0], y + share * one[1], tau + share * one[2]
    one[0], one[1], one[2] = x, y, tau


@entry
def solve_transposed(contact, z, r, lin, out):
    """See `ModelFunctions`."""
    own = read(contact)
    for k in range(own.count):
        part, first, work, _ = _part(own, k)
        call(integers(own.calls)[SOLVE_TRANSPOSED], (part, at(z, first), at(r, first), at(lin, work), at(out, first)))


@entry
def pull_back(contact, z, lin, dzdot, rows, out):
    """See `ModelFunctions`; a part takes its share of the wrench."""
    own, v, w = read(contact), doubles(at(rows, 6)), doubles(at(rows, 9))
    fx, fy, tau = w[0], w[1], w[2]
    x, y, s = 0.0, 0.0, 0.0
    for k in range(own.count):
        part, first, work, share = _part(own, k)
        w[0], w[1], w[2] = share * fx, share * fy, share * tau
        states = at(z, first), at(lin, work), at(dzdot, first), rows, at(out, first)
        call(integers(own.calls)[PULL_BACK], (part, *states))
        x, y, s = x + v[0], y + v[1], s + v[2]
    v[0], v[1], v[2] = x, y, s
    w[0], w[1], w[2] = fx, fy, tau


FUNCTIONS = ModelFunctions(evaluate, linearise, factor, eliminate, back_substitute, change, solve_transposed, pull_back)
