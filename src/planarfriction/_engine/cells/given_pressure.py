"""Cells whose pressure a source gives anew wherever the solver evaluates them (see `edge_cells`, `following_cells`).

A source has inputs s: the place of a body over its edge, or a centre of pressure. It writes the weights of the cells at
s, and where they move their levers as well. The slopes by s of rates and wrench, `df/ds` and `dW/ds` at held bristles,
are differences; all else is left to the functions of the cells.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from planarfriction._engine.codegen.vectors import copy
from planarfriction._engine.compiler import kernel
from planarfriction._engine.compiler.calls import call
from planarfriction._engine.compiler.memory import (
    Doubles,
    Layout,
    Place,
    arrays_at,
    at,
)
from planarfriction._engine.protocol import Addresses

NUDGE = 1e-6
"""Change of an input for differences, as a share of its natural scale."""


class Pressed(NamedTuple):
    """Cells at a pressure."""

    record: Doubles
    """Words of their record, whose arrays follow."""
    weights: Doubles
    cells: Doubles


class GivenPressure(NamedTuple):
    """Cells whose pressure is given anew."""

    count: int
    """Number n of cells."""
    states: int
    """Number of states of the bristles."""
    calls: Addresses
    """Addresses of the functions of the cells."""
    x: Doubles
    y: Doubles
    whole: Doubles
    """Words of the record of the cells where the inputs change nothing."""
    weights: Doubles
    """Weights of these, [n]."""
    held: Pressed
    """Cells as they were linearised last."""
    trial: Pressed
    """Cells anywhere else."""
    rate: Doubles
    """Rates of the bristles where the contact was evaluated last, [states]."""
    wrench: Doubles
    """Wrench there, [3]."""
    by_input: Doubles
    """df/ds where the contact was linearised last, a row for each input, [inputs, states]."""


class GivenLinearisation(NamedTuple):
    """Numbers at the beginning of a linearisation, before the numbers of the cells."""

    acts: Doubles
    """1 if the inputs change anything, else 0, [1]."""
    slopes: Doubles
    """dW/ds at held bristles, a row for each input, [3, 3]."""
    inverse: Doubles
    """Inverse of the matrix [2, 2] of the states of a source that has some."""
    by_twist: Doubles
    """Changes of these states by the twist, [3, 2]."""
    residual: Doubles
    """Changes of these states that the residual causes, [2]."""


_LINEAR = Layout(
    GivenLinearisation, acts=1, slopes=9, inverse=4, by_twist=6, residual=2
)
PLACES = _LINEAR.offsets
OWN = _LINEAR.size


class Source(NamedTuple):
    """Functions of a source; `contact` is its record, which has `GivenPressure` as `given`."""

    count: int
    """Number of inputs."""
    levers: bool
    """True if levers move too, so that rates of the bristles see the inputs."""
    inputs: Any
    """`(contact, z, V)`: return the inputs, as a vector."""
    moved: Any
    """`(contact, s, i, share)`: return the inputs with the i-th changed by a share of its scale, and the change."""
    press: Any
    """`(contact, s, V, pressed)`: write weights and numbers of cells; return True if the inputs change anything."""
    rates: Any
    """`(contact, z, w, z')`: write the rates of states of the source."""


@kernel
def held(given: GivenPressure, m: GivenLinearisation) -> Doubles:
    """Return the record of the cells as they were linearised last."""
    return given.held.record if m.acts[0] > 0.0 else given.whole


def evaluate(
    contact: Place, z: Doubles, v: Doubles, zdot: Doubles, w: Doubles, *, source: Source, read: Any,
) -> None:  # fmt: skip
    """Write z' and the wrench."""
    record = read(contact)
    given = record.given
    acts = source.press(record, source.inputs(record, z, v), v, given.trial)
    call(
        given.calls.evaluate,
        (given.trial.record if acts else given.whole, z, v, zdot, w),
    )
    copy(zdot, given.rate, given.states if source.levers and acts else 0)
    copy(w, given.wrench, 3)
    source.rates(record, z, w, zdot)


def linearise(
    contact: Place, z: Doubles, v: Doubles, lin: Doubles, *, source: Source, read: Any
) -> None:
    """Hold the cells and linearise them where the contact was evaluated last, and write the slopes by the inputs."""
    record = read(contact)
    given = record.given
    m = arrays_at(PLACES, lin)
    s = source.inputs(record, z, v)
    acts = source.press(record, s, v, given.held)
    m.acts[0] = 1.0 if acts else 0.0
    call(given.calls.linearise, (held(given, m), z, v, at(lin, OWN)))
    for j in range(source.count if acts else 0):
        moved, by = source.moved(record, s, j, NUDGE)
        source.press(record, moved, v, given.trial)
        slope = at(m.slopes, 3 * j)
        by_input = at(given.by_input, j * given.states)
        call(given.calls.evaluate, (given.trial.record, z, v, by_input, slope))
        per = 1.0 / by
        for i in range(3):
            slope[i] = per * (slope[i] - given.wrench[i])
        for i in range(given.states if source.levers else 0):
            by_input[i] = per * (by_input[i] - given.rate[i])


TEMPLATES = evaluate, linearise
