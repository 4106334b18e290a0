"""Roll-outs of cells, their discrete adjoint and their derivatives, in vector code (see `rollouts` for the inputs).

The cells of a contact lie in blocks (see `cell_blocks`). `shapes` are the weights of its cells at each load `[L, M]`, M
that of all their blocks; `data` holds the numbers of their levers, block after block.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from planarfriction.compiler import jit, kernel
from planarfriction.compiler.calls import pointer
from planarfriction.compiler.memory import at
from planarfriction.formulas import LawNumbers
from planarfriction.kernels import cells, distributed_step
from planarfriction.kernels.bind import bind
from planarfriction.kernels.cell_blocks import (
    BAR,
    BLOCK,
    BY_LOAD,
    LANES,
    OUT,
    WEIGHT,
    Z,
    divided,
    lever_at,
    pair,
    put_pair,
    totals,
)
from planarfriction.kernels.cell_passes import advance
from planarfriction.kernels.cell_slopes import retreat
from planarfriction.kernels.derive import derive
from planarfriction.kernels.forward import forward
from planarfriction.kernels.law import law_of
from planarfriction.kernels.rollouts import row_of
from planarfriction.kernels.vectors import add, plus, scatter, three, times

PARAMETERS = "sigma_0", "sigma_1", "sigma_2", "mu_c", "mu_s", "v_s", "gamma", "breakaway_ratio"
"""Numbers of the law that derivatives are taken by."""

COLUMNS = tuple(LawNumbers._fields.index(name) for name in PARAMETERS)
"""Their places in a row."""

_BY = ("z", "u", *(f"law.{name}" for name in PARAMETERS))
_WRITTEN = derive(distributed_step.cell, _BY, ("z", "u"))
_pushed = forward(distributed_step.cell, _BY, ("z", "u"))


# ---------------------------------------------------------------------- blocks


@kernel
def _lay(w, blocks, levers, size=BLOCK):
    """Write the numbers of the levers, states of zero and no cotangents."""
    per_block = levers.shape[0] // blocks
    for k in range(blocks):
        block = at(w, k * size)
        for i in range(size):
            block[i] = 0.0
        for i in range(per_block):
            block[i] = levers[k * per_block + i]


@kernel
def _write(w, field, values, n, size=BLOCK):
    """Write vectors [2 n] to a field of all blocks."""
    blocks, lanes = divided(n)
    for k in range(blocks):
        block, first = at(w, k * size + field), k * lanes
        for i in range(min(lanes, n - first)):
            block[i], block[LANES + i] = values[first + i], values[n + first + i]


@kernel
def _read(w, field, values, n, size=BLOCK):
    """Read vectors [2 n] from a field of all blocks."""
    blocks, lanes = divided(n)
    for k in range(blocks):
        block, first = at(w, k * size + field), k * lanes
        for i in range(min(lanes, n - first)):
            values[first + i], values[n + first + i] = block[i], block[LANES + i]


@kernel
def _forget(w, blocks, field):
    for k in range(blocks):
        block = at(w, k * BLOCK + field)
        for i in range(2 * LANES):
            block[i] = 0.0


@kernel
def _weigh(w, blocks, lanes, weights, by_load):
    for k in range(blocks):
        block, first = at(w, k * BLOCK), k * lanes
        for i in range(lanes):
            block[WEIGHT + i], block[BY_LOAD + i] = weights[first + i], by_load[first + i]


# ---------------------------------------------------------------------- roll-outs


@kernel
def _roll(lever, law, inputs, b, n, w, wrench, states):
    twists, loads = inputs.twist[row_of(inputs.twist, b)], inputs.load[row_of(inputs.load, b)]
    which, weights, last = inputs.which[row_of(inputs.which, b)], inputs.shapes, -1
    (blocks, lanes), kept = divided(weights.shape[1]), states.shape[0] > 0
    for t in range(inputs.dt.shape[0]):
        if which[t] != last:
            last = which[t]
            _weigh(w, blocks, lanes, weights[last], inputs.by_load[last])
        if kept:
            _read(w, Z, states[t], n)
        load, twist, dt = loads[t], three(twists[t]), inputs.dt[t]
        if load == 0.0:
            _forget(w, blocks, Z)
        else:
            add(wrench[t], times(load, advance(lever, law, w, blocks, lanes, twist, dt)))


@kernel
def _rollout(lever, inputs, span, z, wrench, states, scratch):
    w, n, rows = pointer(scratch), z.shape[1] // 2, inputs.rows
    blocks, _ = divided(inputs.shapes.shape[1])
    for b in range(span[0], span[1]):
        law = law_of(rows[row_of(rows, b)])
        _lay(w, blocks, inputs.data)
        _write(w, Z, z[b], n)
        _roll(lever, law, inputs, b, n, w, wrench[b], states[b])
        _read(w, Z, z[b], n)


def rollout(lever, inputs, span, z, wrench, states):
    """Step the contacts `span[0]` to `span[1]`: `z` [B, 2 n] in place, wrenches added to `wrench` [B, T, 3].

    The state before each step goes into `states` [B, T, 2 n], unless that is empty.
    """
    scratch = np.empty(divided(inputs.shapes.shape[1])[0] * BLOCK)
    _rollout(lever, inputs, span, z, wrench, states, scratch)


# ---------------------------------------------------------------------- the adjoint


@kernel
def _pull(lever, law, inputs, b, n, w, states, pulls, twist_bar, load_bar):
    """Carry the cotangents of a roll-out back, and return that of the law."""
    twists, loads = inputs.twist[row_of(inputs.twist, b)], inputs.load[row_of(inputs.load, b)]
    which, weights, last = inputs.which[row_of(inputs.which, b)], inputs.shapes, -1
    (blocks, lanes), by_law = divided(weights.shape[1]), (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    for t in range(inputs.dt.shape[0] - 1, -1, -1):
        if which[t] != last:
            last = which[t]
            _weigh(w, blocks, lanes, weights[last], inputs.by_load[last])
        _write(w, Z, states[t], n)
        load, pull, held = loads[t], three(pulls[t]), (three(twists[t]), inputs.dt[t])
        for k in range(blocks):
            bars = retreat(lever, law, at(w, k * BLOCK), lanes, held, pull, load)
            add(twist_bar[t], bars.twist)
            load_bar[t] += bars.load
            by_law = plus(by_law, 1.0, bars.law)
    return by_law


@kernel
def _gradient(lever, inputs, states, wrench_bar, span, bars, scratch):
    w, n, rows = pointer(scratch), bars.state.shape[1] // 2, inputs.rows
    blocks, _ = divided(inputs.shapes.shape[1])
    for b in range(span[0], span[1]):
        law, before, pulls = law_of(rows[row_of(rows, b)]), states, wrench_bar[row_of(wrench_bar, b)]
        before, row_bar = before[row_of(before, b)], bars.rows[b]
        _lay(w, blocks, inputs.data)
        _write(w, BAR, bars.state[b], n)
        by_law = _pull(lever, law, inputs, b, n, w, before, pulls, bars.twist[b], bars.load[b])
        _read(w, BAR, bars.state[b], n)
        for m in range(len(by_law)):
            row_bar[COLUMNS[m]] += by_law[m]


def gradient(lever, inputs, states, wrench_bar, span, bars):
    """Add the adjoint of `rollout` with its `states`, from cotangents of the wrenches [B or 1, T, 3], to `bars`."""
    scratch = np.empty(divided(inputs.shapes.shape[1])[0] * BLOCK)
    _gradient(lever, inputs, states, wrench_bar, span, bars, scratch)


# ---------------------------------------------------------------------- forwards


@kernel
def _push_one(lever, law, by, block, i, twist, turn, dt, load, push):
    """Step a cell and its change, for changes `by` of the law, `turn` of the twist and `push` of the load."""
    one, weight = lever_at(lever, block, i), block[WEIGHT + i]
    new, traction, d_new, d_traction = _pushed(
        law, pair(block, Z, i), lever.seen(one, twist), dt, pair(block, BAR, i), lever.seen(one, turn), *by
    )
    put_pair(block, Z, i, new)
    put_pair(block, BAR, i, d_new)
    heavier = (weight + load * block[BY_LOAD + i]) * push
    change = plus(times(load * weight, d_traction), heavier, traction)
    scatter(block, OUT + i, LANES, (times(weight, lever.wrench(one, traction)), lever.wrench(one, change)))


@kernel
def _push(lever, law, by, block, twist, turn, dt, load, push, lanes):
    for i in range(lanes):
        _push_one(lever, law, by, block, i, twist, turn, dt, load, push)


@kernel
def _tangent(lever, inputs, span, z, changes, wrenches, slopes, scratch):
    w, n, rows = pointer(scratch), z.shape[1] // 2, inputs.rows
    weights, all_by_load = inputs.shapes, inputs.by_load
    blocks, lanes = divided(weights.shape[1])
    for b in range(span[0], span[1]):
        twists, loads = inputs.twist[row_of(inputs.twist, b)], inputs.load[row_of(inputs.load, b)]
        turns, pushes = changes.twist[row_of(changes.twist, b)], changes.load[row_of(changes.load, b)]
        law, d_law, which = law_of(rows[row_of(rows, b)]), law_of(changes.rows[row_of(changes.rows, b)]), inputs.which
        which, last = which[row_of(which, b)], -1
        by = (*d_law[:7], d_law.breakaway_ratio)
        _lay(w, blocks, inputs.data)
        _write(w, Z, z[b], n)
        _write(w, BAR, changes.state[b], n)
        for t in range(inputs.dt.shape[0]):
            if which[t] != last:
                last = which[t]
                _weigh(w, blocks, lanes, weights[last], all_by_load[last])
            load, twist, turn, dt = loads[t], three(twists[t]), three(turns[t]), inputs.dt[t]
            for k in range(blocks):
                _push(lever, law, by, at(w, k * BLOCK), twist, turn, dt, load, pushes[t], lanes)
            add(wrenches[b, t], times(load, totals(w, blocks, OUT, lanes)))
            add(slopes[b, t], totals(w, blocks, OUT + 3 * LANES, lanes))
            if load == 0.0:
                _forget(w, blocks, Z)
                _forget(w, blocks, BAR)
        _read(w, Z, z[b], n)
        _read(w, BAR, changes.state[b], n)


def tangent(lever, inputs, span, z, changes, wrenches, slopes):
    """Run roll-outs with their change along given ones of the inputs, added to `wrenches` and `slopes` [B, T, 3].

    `changes` of the inputs: as `Bars`, one row where all contacts share one; that of the state in place.
    """
    scratch = np.empty(divided(inputs.shapes.shape[1])[0] * BLOCK)
    _tangent(lever, inputs, span, z, changes, wrenches, slopes, scratch)


# ---------------------------------------------------------------------- bound to the levers


class CellRollouts(NamedTuple):
    """Entry points of cells with one kind of lever."""

    rollout: Any
    gradient: Any
    tangent: Any


class _Model(NamedTuple):
    lever: Any


def _bound(lever: Any, name: str) -> CellRollouts:
    return CellRollouts(*(bind(each, _Model(lever), f"{name}_{each.__name__}", jit) for each in TEMPLATES))


TEMPLATES = rollout, gradient, tangent
ISOTROPIC, TURNED = _bound(cells.POSITIONS, "isotropic"), _bound(cells.LEVERS, "turned")
