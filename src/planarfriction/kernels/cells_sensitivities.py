"""Derivatives of rollouts of cells by all numbers of their law, forward in time, in one pass.

A step and what its derivatives share is computed once: for each number of the law a bristle carries its change. Those
of `sigma_1` and `sigma_2` move no bristle.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from planarfriction.compiler import jit, kernel
from planarfriction.compiler.calls import pointer
from planarfriction.compiler.memory import at
from planarfriction.kernels.bind import bind
from planarfriction.kernels.cell_blocks import BLOCK, LANES, WEIGHT, Kind, Z, divided, lever_at
from planarfriction.kernels.cells_rollout import _lay, _read, _write
from planarfriction.kernels.forward import forwards
from planarfriction.kernels.law import law_of
from planarfriction.kernels.rollouts import row_of
from planarfriction.kernels.settle import factor_at, stiffened, within
from planarfriction.kernels.vectors import add, plus, scatter, three

_MOVING = "sigma_0", "mu_c", "mu_s", "v_s", "gamma", "breakaway_ratio"
PARAMETERS = (*_MOVING, "sigma_1", "sigma_2")
"""Numbers of the law, those first that move bristles."""

_BY = tuple((f"law.{name}", "z")[: 1 + (name in _MOVING)] for name in PARAMETERS)

_pushed_within = forwards(
    within, tuple((f"law.{name}", "z")[name not in ("sigma_0", "mu_s") :] for name in _MOVING), ("z",)
).pushed

_CHANGE, _PULL = BLOCK, BLOCK + 3 * LANES * len(_MOVING)
"""Fields behind those of a block: changes of the state, and traction with its changes."""

_ALL = _PULL + 3 * LANES * (1 + len(PARAMETERS))
_SIZE = _ALL + LANES * (1 - _ALL // LANES % 2)
"""Numbers of a block, an odd number of fields (see `cell_blocks`)."""


@kernel
def _change(kind, block, n, i):
    return kind.vector(block, _CHANGE + kind.size * n * LANES + i, LANES)


@kernel
def _bring_back(kind, law, block, stiffer, lanes):
    """Bring bristles back onto their limits (see `settle`), with their changes."""
    for i in range(lanes):
        moved = _pushed_within(
            law, kind.vector(block, Z + i, LANES), stiffer, _change(kind, block, 0, i), _change(kind, block, 1, i), 1.0,
            _change(kind, block, 2, i), _change(kind, block, 3, i), _change(kind, block, 4, i),
            _change(kind, block, 5, i),
        )  # fmt: skip
        scatter(block, Z + i, LANES, moved[0])
        scatter(block, _CHANGE + i, LANES, moved[1:])


@kernel
def _push_one(kind, pushed, law, block, i, twist, dt, stiffer):
    z, u = kind.vector(block, Z + i, LANES), kind.lever.seen(lever_at(kind.lever, block, i), twist)
    found = pushed(
        law, z, u, dt, stiffer, _change(kind, block, 0, i), 1.0, _change(kind, block, 1, i), 1.0,
        _change(kind, block, 2, i), 1.0, _change(kind, block, 3, i), 1.0, _change(kind, block, 4, i), 1.0,
        _change(kind, block, 5, i), 1.0, 1.0
    )  # fmt: skip
    scatter(block, Z + i, LANES, found[0])
    scatter(block, _CHANGE + i, LANES, found[2:14:2])
    scatter(block, _PULL + i, LANES, found[1::2])


@kernel
def _push(kind, pushed, law, block, twist, dt, stiffer, lanes):
    for i in range(lanes):
        _push_one(kind, pushed, law, block, i, twist, dt, stiffer)


@kernel
def _total(kind, block, lanes, load, n):
    """Return the wrench of a block, n = 0, or its change with the number n - 1 of the law.

    The load is a factor inside the sum, so that what adds up blocks rounds alike in compiled code and outside.
    """
    total = (0.0, 0.0, 0.0)
    for i in range(lanes):
        pull = kind.vector(block, _PULL + kind.size * n * LANES + i, LANES)
        total = plus(total, load * block[WEIGHT + i], kind.lever.wrench(lever_at(kind.lever, block, i), pull))
    return total


@kernel
def _forget(block):
    for i in range(3 * LANES):
        block[Z + i] = 0.0
    for i in range(_CHANGE, _PULL):
        block[i] = 0.0


@kernel
def _follow(kind, pushed, law, block, inputs, b, k, lanes, wanted, wrench, slopes):
    """Step block k of contact b through all steps: one block fits into the cache."""
    twists, loads = inputs.twist[row_of(inputs.twist, b)], inputs.load[row_of(inputs.load, b)]
    which, last = inputs.which[row_of(inputs.which, b)], -1
    for t in range(inputs.dt.shape[0]):
        if which[t] != last:
            last = which[t]
            for i in range(lanes):
                block[WEIGHT + i] = inputs.shapes[last, k * lanes + i]
        load = loads[t]
        if load == 0.0:
            _forget(block)
            continue
        stiff, stiffer = stiffened(law, inputs.reference, load), factor_at(inputs.reference, load)
        if inputs.reference > 0.0:
            _bring_back(kind, stiff, block, stiffer, lanes)
        _push(kind, pushed, stiff, block, three(twists[t]), inputs.dt[t], stiffer, lanes)
        add(wrench[t], _total(kind, block, lanes, load, 0))
        for d in range(wanted.shape[0]):
            change = _total(kind, block, lanes, load, 1 + wanted[d])
            for m in range(3):
                slopes[t, m, d] += change[m]


@kernel
def _sensitivities(kind, pushed, inputs, span, z, wanted, wrenches, slopes, scratch):
    w, n, rows = pointer(scratch), z.shape[1] // kind.size, inputs.rows
    blocks, lanes = divided(inputs.shapes.shape[1])
    for b in range(span[0], span[1]):
        _lay(w, blocks, inputs.data, _SIZE)
        _write(w, Z, z[b], n, kind.size, _SIZE)
        law = law_of(rows[row_of(rows, b)])
        for k in range(blocks):
            _follow(kind, pushed, law, at(w, k * _SIZE), inputs, b, k, lanes, wanted, wrenches[b], slopes[b])
        _read(w, Z, z[b], n, kind.size, _SIZE)


def sensitivities(inputs, span, z, wanted, wrenches, slopes, *, kind, pushed):
    """Run rollouts with their derivatives by the numbers `wanted` of `PARAMETERS`.

    They are added to `wrenches` [B, T, 3] and `slopes` [B, T, 3, len(wanted)]; `z` [B, size n] in place.
    """
    scratch = np.empty(divided(inputs.shapes.shape[1])[0] * _SIZE)
    _sensitivities(kind, pushed, inputs, span, z, wanted, wrenches, slopes, scratch)


def bound(kind: Kind, step: Any, name: str) -> Any:
    """Return the entry point of a kind of cells, with the step of one and its changes by each number of the law."""
    pushed = forwards(step, _BY, ("z", "u")).pushed
    return bind(sensitivities, f"{name}_sensitivities", jit, kind=kind, pushed=pushed)
