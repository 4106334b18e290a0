"""A contact of several parts as the solver sees it (see `contacts.ModelFunctions`): a loop over their records.

Parts see the same twist, share the load and know nothing of each other: the wrench is the sum of theirs, each times the
share of the part, and everything else is done part by part, by the functions of a contact of one part.
"""

from __future__ import annotations

from typing import NamedTuple

from planarfriction.compiler import entry, kernel
from planarfriction.compiler.calls import call
from planarfriction.compiler.memory import Doubles, Integers, arrays_at, at, reader
from planarfriction.kernels.contacts import (
    BACK_SUBSTITUTE,
    CHANGE,
    ELIMINATE,
    EVALUATE,
    FACTOR,
    LINEARISE,
    PULL_BACK,
    ROWS,
    SOLVE_TRANSPOSED,
    ModelFunctions,
)
from planarfriction.kernels.small_matrices import nine
from planarfriction.kernels.vectors import plus, put, put_all, three, times


class PartsContact(NamedTuple):
    """A contact of `count` parts."""

    count: int
    states: int
    """Number of states of a part."""
    workspace: int
    """Number of words that a linearisation of a part takes."""
    calls: Integers
    """Addresses of the functions of a part, [8]."""
    records: Integers
    """Addresses of the records of the parts, [count]."""
    shares: Doubles
    """Shares of the parts in the load, [count]."""


read = reader(PartsContact)


@kernel
def _part(own, k, z, lin):
    """Return the record of part k, the pointers to its states and its linearisation, and its first state."""
    first = k * own.states
    return own.records[k], at(z, first), at(lin, k * own.workspace), first


@entry
def evaluate(contact, z, v, zdot, w):
    """Write the rates of all parts, and the sum of their wrenches."""
    own, total = read(contact), (0.0, 0.0, 0.0)
    for k in range(own.count):
        first = k * own.states
        call(own.calls[EVALUATE], (own.records[k], at(z, first), v, at(zdot, first), w))
        total = plus(total, own.shares[k], three(w))
    put(w, total)


@entry
def linearise(contact, z, v, lin):
    """Linearise all parts."""
    own = read(contact)
    for k in range(own.count):
        part, z_k, lin_k, _ = _part(own, k, z, lin)
        call(own.calls[LINEARISE], (part, z_k, v, lin_k))


@entry
def factor(contact, z, shift, lin, stiffness):
    """Prepare D of all parts, and write the sum of their stiffnesses."""
    own, total = read(contact), (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    for k in range(own.count):
        part, z_k, lin_k, _ = _part(own, k, z, lin)
        call(own.calls[FACTOR], (part, z_k, shift, lin_k, stiffness))
        total = plus(total, own.shares[k], nine(stiffness))
    put_all(stiffness, total)


@entry
def eliminate(contact, z, shift, r, lin, w):
    """Write the sum of the wrenches that the residuals of all parts cause."""
    own, total = read(contact), (0.0, 0.0, 0.0)
    for k in range(own.count):
        part, z_k, lin_k, first = _part(own, k, z, lin)
        call(own.calls[ELIMINATE], (part, z_k, shift, at(r, first), lin_k, w))
        total = plus(total, own.shares[k], three(w))
    put(w, total)


@entry
def back_substitute(contact, z, r, dv, lin, out):
    """Solve for the states of all parts."""
    own = read(contact)
    for k in range(own.count):
        part, z_k, lin_k, first = _part(own, k, z, lin)
        call(own.calls[BACK_SUBSTITUTE], (part, z_k, at(r, first), dv, lin_k, at(out, first)))


@entry
def change(contact, z, zdot, lin, dz, dzdot, rows, friction, size):
    """Write the changes of all parts; a part sees the wrench of all as its own, since shares add up to one."""
    own, total, changes = read(contact), (0.0, 0.0, 0.0), arrays_at(ROWS, rows)
    for k in range(own.count):
        part, z_k, lin_k, first = _part(own, k, z, lin)
        states = part, z_k, at(zdot, first), lin_k, at(dz, first), at(dzdot, first)
        call(own.calls[CHANGE], (*states, rows, friction, size))
        total = plus(total, own.shares[k], three(changes.d_wrench))
    put(changes.d_wrench, total)


@entry
def solve_transposed(contact, z, r, lin, out):
    """Solve the transposed equations of all parts."""
    own = read(contact)
    for k in range(own.count):
        part, z_k, lin_k, first = _part(own, k, z, lin)
        call(own.calls[SOLVE_TRANSPOSED], (part, z_k, at(r, first), lin_k, at(out, first)))


@entry
def pull_back(contact, z, lin, dzdot, rows, out):
    """Write the transpose of `change`; a part takes its share of the wrench."""
    own, total, changes = read(contact), (0.0, 0.0, 0.0), arrays_at(ROWS, rows)
    wrench = three(changes.d_wrench)
    for k in range(own.count):
        part, z_k, lin_k, first = _part(own, k, z, lin)
        put(changes.d_wrench, times(own.shares[k], wrench))
        call(own.calls[PULL_BACK], (part, z_k, lin_k, at(dzdot, first), rows, at(out, first)))
        total = plus(total, 1.0, three(changes.d_twist))
    put(changes.d_twist, total)
    put(changes.d_wrench, wrench)


FUNCTIONS = ModelFunctions(evaluate, linearise, factor, eliminate, back_substitute, change, solve_transposed, pull_back)
