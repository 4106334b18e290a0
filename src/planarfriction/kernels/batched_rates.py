"""Rates of many contacts and their linearisation, by the functions that the solver calls (see `kernels.contacts`)."""

from __future__ import annotations

import numpy as np

from planarfriction.compiler import jit
from planarfriction.compiler.calls import call, pointer
from planarfriction.compiler.memory import Place, at


@jit
def evaluate(
    function: Place, records: np.ndarray, state: np.ndarray, twist: np.ndarray, rate: np.ndarray, wrench: np.ndarray
) -> None:
    """Call `ModelFunctions.evaluate` of B contacts: `state`, `rate` [B, S], `twist`, `wrench` [B, 3] (per unit load).

    `function` is its address; `records` [B or 1, words] has a row for each contact, or one for all.
    """
    for b in range(state.shape[0]):
        record = at(pointer(records), b * records.shape[1] if records.shape[0] > 1 else 0)
        call(function, (record, state[b], twist[b], rate[b], wrench[b]))


@jit
def linearise(function: Place, records: np.ndarray, state: np.ndarray, twist: np.ndarray, lin: np.ndarray) -> None:
    """Call `ModelFunctions.linearise` of B contacts into `lin` [B, workspace]; the rest as in `evaluate`."""
    for b in range(state.shape[0]):
        record = at(pointer(records), b * records.shape[1] if records.shape[0] > 1 else 0)
        call(function, (record, state[b], twist[b], lin[b]))
