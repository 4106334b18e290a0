"""Rates of models and their linearisation by the functions that they give to the solver, for batches."""

from __future__ import annotations

import numpy as np

from planarfriction.compiled.packed import PackedModel
from planarfriction.compiler.calls import address_of
from planarfriction.kernels import batched_rates as kernels


def rates(packed: PackedModel, state: np.ndarray, twist: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return rates as `state` `[B, ...]` and wrenches per unit load `[B, 3]` at contiguous states and twists `[B, 3]`.

    `packed` has one record, or one for each contact.
    """
    rate, wrench = np.empty((len(twist), packed.states)), np.empty((len(twist), 3))
    function = address_of(packed.functions.evaluate)
    kernels.evaluate(function, packed.records, state.reshape(rate.shape), twist, rate, wrench)
    return rate.reshape(state.shape), wrench


def linearised(packed: PackedModel, state: np.ndarray, twist: np.ndarray) -> np.ndarray:
    """Return linearisations `[B, workspace]`; the kernels of each kind of model describe the numbers."""
    lin = np.empty((len(twist), packed.workspace))
    function = address_of(packed.functions.linearise)
    kernels.linearise(function, packed.records, state.reshape(len(twist), packed.states), twist, lin)
    return lin
