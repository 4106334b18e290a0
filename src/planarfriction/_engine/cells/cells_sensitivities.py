"""Derivatives of rollouts of cells by all numbers of their law, forward in time, in one pass.

A step is computed once with all its derivatives: for each number of the law a bristle carries its change, but
`sigma_1` and `sigma_2` move no bristle.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from planarfriction._engine.bristles.law import law_of
from planarfriction._engine.cells.cell_blocks import (
    BLOCK,
    LANES,
    WEIGHT,
    BlockFunctions,
    Z,
    divided,
)
from planarfriction._engine.cells.cell_loops import CellKind
from planarfriction._engine.cells.cells_rollout import (
    _keep,
    _lay,
    _press,
    _read,
    _write,
    entry_of,
)
from planarfriction._engine.cells.rollouts import Derivatives, row_of
from planarfriction._engine.codegen.derivatives import forwards
from planarfriction._engine.codegen.vectors import (
    Vector,
    add,
    clear,
    plus,
    scatter,
    three,
)
from planarfriction._engine.compiler import kernel
from planarfriction._engine.compiler.calls import pointer
from planarfriction._engine.compiler.memory import Doubles, at
from planarfriction.formulas import LawNumbers

_MOVING = "sigma_0", "mu_c", "mu_s", "v_s", "gamma", "breakaway_ratio"
PARAMETERS = (*_MOVING, "sigma_1", "sigma_2")
"""Numbers of the law; the numbers that move bristles come first."""

_PLACES = tuple(
    PARAMETERS.index(name) if name in PARAMETERS else -1 for name in LawNumbers._fields
)
"""Place in `PARAMETERS` of each column of a row."""

_CHANGE = BLOCK
"""Field behind a block: changes of the bristles."""

_PULL = BLOCK + 3 * LANES * len(_MOVING)
"""Field behind a block: traction with its changes."""

_ALL = _PULL + 3 * LANES * (1 + len(PARAMETERS))
_SIZE = _ALL + LANES * (1 - _ALL // LANES % 2)
"""Numbers of a block, an odd number of fields (see `cell_blocks`)."""


class Interval(NamedTuple):
    """A step of bristles."""

    law: LawNumbers
    twist: Vector
    dt: float
    load: float
    springs: float
    """See `rollouts.Inputs`."""


@kernel
def _change(kind: BlockFunctions, block: Doubles, n: int, i: int) -> Vector:
    return kind.vector(block, _CHANGE + kind.size * n * LANES + i, LANES)


@kernel
def _changes(kind: BlockFunctions, block: Doubles, i: int) -> tuple[Vector, ...]:
    """Return the changes of bristle i, in the order of `_MOVING`."""
    first = (
        _change(kind, block, 0, i),
        _change(kind, block, 1, i),
        _change(kind, block, 2, i),
    )
    return (
        *first,
        _change(kind, block, 3, i),
        _change(kind, block, 4, i),
        _change(kind, block, 5, i),
    )


@kernel
def _push_one(kind: BlockFunctions, interval: Interval, block: Doubles, i: int) -> None:
    z = kind.vector(block, Z + i, LANES)
    u = kind.lever.seen(kind.lever.read(block, i, LANES), interval.twist)
    a, b, c, d, e, f = _changes(kind, block, i)
    changes = interval.springs, a, 1.0, b, 1.0, c, 1.0, d, 1.0, e, 1.0, f, 1.0, 1.0
    borne = block[WEIGHT + i] * interval.load
    law = kind.law(interval.law, block, i, LANES, borne)
    results = kind.pushed(law, z, u, interval.dt, *changes)
    (new, traction) = results[0]
    d = results[1:]
    scatter(block, Z + i, LANES, new)
    scatter(
        block,
        _CHANGE + i,
        LANES,
        (d[0][0], d[1][0], d[2][0], d[3][0], d[4][0], d[5][0]),
    )
    pulls = (
        traction,
        d[0][1],
        d[1][1],
        d[2][1],
        d[3][1],
        d[4][1],
        d[5][1],
        d[6][1],
        d[7][1],
    )
    scatter(block, _PULL + i, LANES, pulls)


@kernel
def _push(kind: BlockFunctions, interval: Interval, block: Doubles, lanes: int) -> None:
    for i in range(lanes):
        _push_one(kind, interval, block, i)


@kernel
def _total(
    kind: BlockFunctions, block: Doubles, lanes: int, load: float, n: int
) -> Vector:
    """Return the wrench of a block, n = 0, or its change with the number n - 1 of the law.

    The load is a factor inside the sum, so that sums over blocks round alike in compiled code and outside.
    """
    total = (0.0, 0.0, 0.0)
    for i in range(lanes):
        pull = kind.vector(block, _PULL + kind.size * n * LANES + i, LANES)
        total = plus(
            total,
            load * block[WEIGHT + i],
            kind.lever.wrench(kind.lever.read(block, i, LANES), pull),
        )
    return total


@kernel
def _forget(block: Doubles) -> None:
    clear(at(block, Z), 3 * LANES)
    clear(at(block, _CHANGE), _PULL - _CHANGE)


@kernel
def _follow(
    kind: BlockFunctions,
    inputs: Any,
    b: int,
    law: LawNumbers,
    k: int,
    lanes: int,
    block: Doubles,
    out: Derivatives,
) -> None:
    """Step block k of contact b through all steps: one block fits into the cache."""
    twists = inputs.twist[row_of(inputs.twist, b)]
    loads = inputs.load[row_of(inputs.load, b)]
    which = inputs.which[row_of(inputs.which, b)]
    shape = inputs.shape
    blocks, _ = divided(shape.weights.shape[1])
    last = -1
    wrench = out.wrenches[b]
    slopes = out.slopes[b]
    for t in range(inputs.dt.shape[0]):
        if which[t] != last:
            last = which[t]
            _press(shape, last, blocks, k, lanes, block)
        _keep(shape, last, k, lanes, block, Z, kind.size)
        _keep(shape, last, k, lanes, block, _CHANGE, kind.size * len(_MOVING))
        load = loads[t]
        if load == 0.0:
            _forget(block)
            continue
        interval = Interval(law, three(twists[t]), inputs.dt[t], load, inputs.springs)
        _push(kind, interval, block, lanes)
        add(wrench[t], _total(kind, block, lanes, load, 0))
        for d in range(out.columns.shape[0]):
            change = _total(kind, block, lanes, load, 1 + _PLACES[out.columns[d]])
            for m in range(3):
                slopes[t, m, d] += change[m]


@kernel
def sensitivities(
    kind: BlockFunctions,
    inputs: Any,
    span: tuple,
    z: np.ndarray,
    out: Derivatives,
    scratch: np.ndarray,
) -> None:
    """Run rollouts with their derivatives by numbers of the law; `z` [B, size n] in place."""
    w = pointer(scratch)
    n = z.shape[1] // kind.size
    rows = inputs.rows
    blocks, lanes = divided(inputs.shape.weights.shape[1])
    for b in range(span[0], span[1]):
        _lay(w, blocks, inputs.shape.data, _SIZE)
        _write(w, Z, z[b], n, kind.size, _SIZE)
        law = law_of(rows[row_of(rows, b)])
        for k in range(blocks):
            _follow(kind, inputs, b, law, k, lanes, at(w, k * _SIZE), out)
        _read(w, Z, z[b], n, kind.size, _SIZE)


def bound(functions: BlockFunctions, kind: CellKind) -> Any:
    """Return the entry point of a kind of cells."""
    by = [(f"{kind.path}.{each}", "z")[: 1 + (each in _MOVING)] for each in PARAMETERS]
    functions = functions._replace(pushed=forwards(kind.element.step, by, kind.lengths))
    return entry_of(sensitivities, functions, kind.name, _SIZE)
