"""Rates of models and their linearisation by the functions that they give to the solver, for batches."""

from __future__ import annotations

import numpy as np

from planarfriction.kernels import rates as kernels
from planarfriction.kernels.contacts import WORDS
from planarfriction.kernels.pointers import address_of
from planarfriction.models.base import PackedModel


def rates(packed: PackedModel, state: np.ndarray, twist: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rates as `state` `[B, ...]` and wrenches per unit load `[B, 3]` of contiguous states and twists `[B, 3]`."""
    rate, wrench = np.empty((len(twist), packed.states)), np.empty((len(twist), 3))
    function = address_of(packed.functions.evaluate, WORDS[0])
    kernels.evaluate(function, packed.records, state.reshape(rate.shape), twist, rate, wrench)
    return rate.reshape(state.shape), wrench


def linearised(packed: PackedModel, state: np.ndarray, twist: np.ndarray) -> np.ndarray:
    """The workspace of a linearisation `[B, workspace]`; what it holds, each model's kernels say."""
    lin = np.empty((len(twist), packed.workspace))
    function = address_of(packed.functions.linearise, WORDS[1])
    kernels.linearise(function, packed.records, state.reshape(len(twist), packed.states), twist, lin)
    return lin
