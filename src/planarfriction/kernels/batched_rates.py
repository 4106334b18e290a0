"""Rates of many contacts and their linearisation, by the functions that the solver calls (see `kernels.contacts`)."""

from __future__ import annotations

from planarfriction.compiler import jit
from planarfriction.compiler.calls import call, pointer
from planarfriction.compiler.memory import at


@jit
def evaluate(function, records, state, twist, rate, wrench):
    """Call `ModelFunctions.evaluate` of B contacts: `state`, `rate` [B, S], `twist`, `wrench` [B, 3] (per unit load).

    `function` is its address; `records` [B or 1, words] has a row for each contact, or the one that all share.
    """
    for b in range(state.shape[0]):
        own = at(pointer(records), b * records.shape[1] if records.shape[0] > 1 else 0)
        call(function, (own, state[b], twist[b], rate[b], wrench[b]))


@jit
def linearise(function, records, state, twist, lin):
    """Call `ModelFunctions.linearise` of B contacts into `lin` [B, workspace]; the rest as in `evaluate`."""
    for b in range(state.shape[0]):
        own = at(pointer(records), b * records.shape[1] if records.shape[0] > 1 else 0)
        call(function, (own, state[b], twist[b], lin[b]))
