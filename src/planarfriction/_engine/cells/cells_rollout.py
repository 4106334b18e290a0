"""Rollouts of cells, their discrete adjoint and their derivatives, in vector code (see `rollouts` for the inputs).

The cells of a contact lie in blocks (see `cell_blocks`). `shapes` are the weights of its M cells at each load `[L, M]`,
the blocks' filling included; `data` holds the numbers of the levers, block after block.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from planarfriction._engine.bristles.law import PARAMETERS, law_of
from planarfriction._engine.cells.cell_blocks import (
    BAR,
    BLOCK,
    BY_LOAD,
    HEAVIER,
    LANES,
    OUT,
    WEIGHT,
    BlockFunctions,
    Z,
    divided,
    totals,
)
from planarfriction._engine.cells.rollouts import Bars, Inputs, ShapesByLoad, row_of
from planarfriction._engine.codegen.definitions import bind
from planarfriction._engine.codegen.vectors import (
    Vector,
    add,
    clear,
    copy,
    plus,
    scatter,
    three,
    times,
)
from planarfriction._engine.compiler import compiled_math as xp
from planarfriction._engine.compiler import jit, kernel, wide_jit
from planarfriction._engine.compiler.calls import pointer
from planarfriction._engine.compiler.memory import Doubles, at
from planarfriction.formulas import LawNumbers

COLUMNS = tuple(LawNumbers._fields.index(name) for name in PARAMETERS)
"""Places of `PARAMETERS` in a row."""


def by_of(path: str, pad: bool = False) -> tuple[str, ...]:
    """Return the arguments by which steps of cells are differentiated, whose law stands at a path; last, their load."""
    return "z", "u", *(f"{path}.{name}" for name in PARAMETERS), *["pad.load"] * pad


# ---------------------------------------------------------------------- blocks


@kernel
def _lay(w: Doubles, blocks: int, levers: np.ndarray, numbers: int = BLOCK) -> None:
    """Write the numbers of the levers in the first row, states of zero and no cotangents."""
    for k in range(blocks):
        clear(at(w, k * numbers), numbers)
        _place(levers, 0, blocks, k, at(w, k * numbers))


@kernel
def _place(levers: np.ndarray, row: int, blocks: int, k: int, block: Doubles) -> None:
    per_block = levers.shape[1] // blocks
    copy(at(pointer(levers), row * levers.shape[1] + k * per_block), block, per_block)


@kernel
def _press(shape: ShapesByLoad, row: int, blocks: int, k: int, lanes: int, block: Doubles) -> None:  # fmt: skip
    """Write the weights of the cells of block k at a load, and their levers if these change."""
    for i in range(lanes):
        block[WEIGHT + i] = shape.weights[row, k * lanes + i]
    if shape.data.shape[0] > 1:
        _place(shape.data, row, blocks, k, block)


@kernel
def _keep(
    shape: ShapesByLoad, row: int, k: int, lanes: int, block: Doubles, field: int, size: int
) -> None:  # fmt: skip
    """Leave of a field of vectors of block k what stays of bristles as a step begins."""
    if shape.kept.shape[0] > 0:
        for m in range(size):
            for i in range(lanes):
                block[field + m * LANES + i] *= shape.kept[row, k * lanes + i]


@kernel
def _write(
    w: Doubles, field: int, values: np.ndarray, n: int, size: int, numbers: int = BLOCK
) -> None:
    """Write vectors [size n] to a field of all blocks, which have so many numbers."""
    blocks, lanes = divided(n)
    for k in range(blocks):
        block = at(w, k * numbers + field)
        first = k * lanes
        for i in range(xp.minimum(lanes, n - first)):
            for m in range(size):
                block[m * LANES + i] = values[m * n + first + i]


@kernel
def _read(
    w: Doubles, field: int, values: np.ndarray, n: int, size: int, numbers: int = BLOCK
) -> None:
    """Read vectors [size n] from a field of all blocks."""
    blocks, lanes = divided(n)
    for k in range(blocks):
        block = at(w, k * numbers + field)
        first = k * lanes
        for i in range(xp.minimum(lanes, n - first)):
            for m in range(size):
                values[m * n + first + i] = block[m * LANES + i]


@kernel
def _forget(w: Doubles, blocks: int, field: int, size: int) -> None:
    for k in range(blocks):
        clear(at(w, k * BLOCK + field), size * LANES)


@kernel
def _weigh(w: Doubles, blocks: int, lanes: int, shape: ShapesByLoad, row: int) -> None:
    for k in range(blocks):
        block = at(w, k * BLOCK)
        _press(shape, row, blocks, k, lanes, block)
        for i in range(lanes):
            block[BY_LOAD + i] = shape.by_load[row, k * lanes + i]


@kernel
def _stay(
    w: Doubles, blocks: int, lanes: int, shape: ShapesByLoad, row: int, field: int, size: int
) -> None:  # fmt: skip
    for k in range(blocks):
        _keep(shape, row, k, lanes, at(w, k * BLOCK), field, size)


class IntervalWithChanges(NamedTuple):
    """A step of bristles, and the changes of its inputs."""

    law: LawNumbers
    d_law: tuple
    """In the order of `PARAMETERS`."""
    twist: Vector
    d_twist: Vector
    load: float
    d_load: float
    dt: float


# ---------------------------------------------------------------------- rollouts


@kernel
def _roll(
    kind: BlockFunctions,
    law: LawNumbers,
    inputs: Inputs,
    b: int,
    n: int,
    w: Doubles,
    wrench: np.ndarray,
    states: np.ndarray,
) -> None:
    twists = inputs.twist[row_of(inputs.twist, b)]
    loads = inputs.load[row_of(inputs.load, b)]
    which = inputs.which[row_of(inputs.which, b)]
    last = -1
    (blocks, lanes) = divided(inputs.shape.weights.shape[1])
    kept = states.shape[0] > 0
    for t in range(inputs.dt.shape[0]):
        if which[t] != last:
            last = which[t]
            _weigh(w, blocks, lanes, inputs.shape, last)
        if kept:
            _read(w, Z, states[t], n, kind.size)
        _stay(w, blocks, lanes, inputs.shape, last, Z, kind.size)
        load = loads[t]
        twist = three(twists[t])
        dt = inputs.dt[t]
        if load == 0.0:
            _forget(w, blocks, Z, kind.size)
        else:
            total = (0.0, 0.0, 0.0)
            for k in range(blocks):
                total = plus(
                    total,
                    1.0,
                    kind.advance(law, twist, (dt, load), at(w, k * BLOCK), lanes),
                )
            add(wrench[t], times(load, total))


@kernel
def rollout(
    kind: BlockFunctions, inputs: Inputs, span: tuple[int, ...], z: np.ndarray, wrench: np.ndarray, states: np.ndarray,
    scratch: np.ndarray,
) -> None:  # fmt: skip
    """Step the contacts `span[0]` to `span[1]`: `z` [B, size n] in place, wrenches added to `wrench` [B, T, 3].

    The state before each step goes into `states` [B, T, size n], unless that is empty.
    """
    w = pointer(scratch)
    n = z.shape[1] // kind.size
    rows = inputs.rows
    blocks, _ = divided(inputs.shape.weights.shape[1])
    for b in range(span[0], span[1]):
        law = law_of(rows[row_of(rows, b)])
        _lay(w, blocks, inputs.shape.data)
        _write(w, Z, z[b], n, kind.size)
        _roll(kind, law, inputs, b, n, w, wrench[b], states[b])
        _read(w, Z, z[b], n, kind.size)


# ---------------------------------------------------------------------- the adjoint


@kernel
def _pull(
    kind: BlockFunctions,
    law: LawNumbers,
    inputs: Any,
    b: int,
    w: Doubles,
    states: np.ndarray,
    pulls: np.ndarray,
    bars: Any,
) -> Vector:
    """Carry the cotangents of the rollout of contact b back, and return the cotangent of the law."""
    n = bars.state.shape[1] // kind.size
    twist_bar = bars.twist[b]
    load_bar = bars.load[b]
    twists = inputs.twist[row_of(inputs.twist, b)]
    loads = inputs.load[row_of(inputs.load, b)]
    which = inputs.which[row_of(inputs.which, b)]
    last = -1
    (blocks, lanes) = divided(inputs.shape.weights.shape[1])
    by_law = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    for t in range(inputs.dt.shape[0] - 1, -1, -1):
        if which[t] != last:
            last = which[t]
            _weigh(w, blocks, lanes, inputs.shape, last)
        _write(w, Z, states[t], n, kind.size)
        _stay(w, blocks, lanes, inputs.shape, last, Z, kind.size)
        load = loads[t]
        twist = three(twists[t])
        shared = inputs.dt[t], load, 0.0 if load == 0.0 else 1.0, *three(pulls[t])
        for k in range(blocks):
            sums = kind.retreat(law, twist, shared, at(w, k * BLOCK), lanes)
            add(twist_bar[t], sums[:3])
            load_bar[t] += sums[3]
            by_law = plus(by_law, 1.0, sums[4:])
            if bars.cells.shape[1] > 0:
                block = at(w, k * BLOCK + OUT)
                for i in range(lanes):
                    block[i] += bars.own * block[LANES + i]
        if bars.cells.shape[1] > 0:
            _read(w, OUT, bars.cells[b, t], n, 1)
        _stay(w, blocks, lanes, inputs.shape, last, BAR, kind.size)
    return inputs.springs * by_law[0], *by_law[1:]


@kernel
def gradient(
    kind: BlockFunctions, inputs: Inputs, states: np.ndarray, wrench_bar: np.ndarray, span: tuple[int, ...], bars: Bars,
    scratch: np.ndarray,
) -> None:  # fmt: skip
    """Add the adjoint of `rollout` with its `states`, from cotangents of the wrenches [B or 1, T, 3], to `bars`."""
    w = pointer(scratch)
    n = bars.state.shape[1] // kind.size
    rows = inputs.rows
    blocks, _ = divided(inputs.shape.weights.shape[1])
    for b in range(span[0], span[1]):
        law = law_of(rows[row_of(rows, b)])
        before = states
        pulls = wrench_bar[row_of(wrench_bar, b)]
        before = before[row_of(before, b)]
        row_bar = bars.rows[b]
        _lay(w, blocks, inputs.shape.data)
        _write(w, BAR, bars.state[b], n, kind.size)
        by_law = _pull(kind, law, inputs, b, w, before, pulls, bars)
        _read(w, BAR, bars.state[b], n, kind.size)
        for m in range(len(by_law)):
            row_bar[COLUMNS[m]] += by_law[m]


# ---------------------------------------------------------------------- forwards


@kernel
def _push_one(
    kind: BlockFunctions, interval: IntervalWithChanges, block: Doubles, i: int
) -> None:
    """Step a cell and its change."""
    lever = kind.lever
    weight = block[WEIGHT + i]
    load = interval.load
    one = lever.read(block, i, LANES)
    z = kind.vector(block, Z + i, LANES)
    change = kind.vector(block, BAR + i, LANES)
    u = lever.seen(one, interval.twist)
    d_u = lever.seen(one, interval.d_twist)
    law = kind.law(interval.law, block, i, LANES, weight * load)
    heavier = (weight + load * block[BY_LOAD + i]) * interval.d_load + block[
        HEAVIER + i
    ]
    (new, traction), (d_new, d_traction) = kind.pushed(
        law, z, u, interval.dt, change, d_u, interval.d_law, heavier
    )
    scatter(block, Z + i, LANES, new)
    scatter(block, BAR + i, LANES, d_new)
    change = plus(times(load * weight, d_traction), heavier, traction)
    scatter(
        block,
        OUT + i,
        LANES,
        (times(weight, lever.wrench(one, traction)), lever.wrench(one, change)),
    )


@kernel
def _push(
    kind: BlockFunctions, interval: IntervalWithChanges, block: Doubles, lanes: int
) -> None:
    for i in range(lanes):
        _push_one(kind, interval, block, i)


@kernel
def tangent(
    kind: BlockFunctions, inputs: Inputs, span: tuple[int, ...], z: np.ndarray, changes: Bars, wrenches: np.ndarray,
    slopes: np.ndarray, scratch: np.ndarray,
) -> None:  # fmt: skip
    """Run rollouts with their change along changes of the inputs, added to `wrenches` and `slopes` [B, T, 3].

    `changes` of the inputs: as `Bars`, one row where all contacts share one; the change of the state is in place.
    """
    w = pointer(scratch)
    n = z.shape[1] // kind.size
    rows = inputs.rows
    blocks, lanes = divided(inputs.shape.weights.shape[1])
    for b in range(span[0], span[1]):
        twists = inputs.twist[row_of(inputs.twist, b)]
        loads = inputs.load[row_of(inputs.load, b)]
        turns = changes.twist[row_of(changes.twist, b)]
        pushes = changes.load[row_of(changes.load, b)]
        heavier = changes.cells[row_of(changes.cells, b)]
        law = law_of(rows[row_of(rows, b)])
        d_law = law_of(changes.rows[row_of(changes.rows, b)])
        which = inputs.which
        which = which[row_of(which, b)]
        last = -1
        _lay(w, blocks, inputs.shape.data)
        _write(w, Z, z[b], n, kind.size)
        _write(w, BAR, changes.state[b], n, kind.size)
        for t in range(inputs.dt.shape[0]):
            if which[t] != last:
                last = which[t]
                _weigh(w, blocks, lanes, inputs.shape, last)
            _stay(w, blocks, lanes, inputs.shape, last, Z, kind.size)
            _stay(w, blocks, lanes, inputs.shape, last, BAR, kind.size)
            if heavier.shape[0] > 0:
                _write(w, HEAVIER, heavier[t], n, 1)
            load = loads[t]
            stiffer = inputs.springs * d_law.sigma_0
            by_law = (stiffer, *d_law[1:7], d_law.breakaway_ratio)
            turn = three(turns[t])
            interval = IntervalWithChanges(
                law, by_law, three(twists[t]), turn, load, pushes[t], inputs.dt[t]
            )
            for k in range(blocks):
                _push(kind, interval, at(w, k * BLOCK), lanes)
            add(wrenches[b, t], times(load, totals(w, blocks, OUT, lanes)))
            add(slopes[b, t], totals(w, blocks, OUT + 3 * LANES, lanes))
            if load == 0.0:
                _forget(w, blocks, Z, kind.size)
                _forget(w, blocks, BAR, kind.size)
        _read(w, Z, z[b], n, kind.size)
        _read(w, BAR, changes.state[b], n, kind.size)


# ---------------------------------------------------------------------- bound to kinds of cells


def _entry(
    inputs: Inputs, *arguments: Any, loop: Any, kind: BlockFunctions, numbers: int
) -> None:
    """Run a loop in new scratch memory."""
    loop(
        kind,
        inputs,
        *arguments,
        np.empty(divided(inputs.shape.weights.shape[1])[0] * numbers),
    )


def entry_of(loop: Any, kind: BlockFunctions, name: str, numbers: int = BLOCK) -> Any:
    """Return the entry point of a loop for a kind of cells, whose blocks have so many numbers; it takes the inputs and
    the arguments between these and the scratch memory."""
    # The rollout divides and takes roots most of the time, which longer vectors do not hasten.
    decorator = jit if loop is rollout else wide_jit
    arguments = {"loop": loop, "kind": kind, "numbers": numbers}
    return bind(_entry, f"{name}_{loop.__name__}", decorator, **arguments)
