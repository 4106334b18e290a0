"""Models at some loads, as the solver, steps and `coupling` read them, and their rates for batches."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from planarfriction._engine.cells.cell_blocks import LANES, divided
from planarfriction._engine.cells.rollouts import ShapesByLoad
from planarfriction._engine.compiler.calls import address_of
from planarfriction._engine.compiler.memory import place_of, row_of
from planarfriction._engine.coupled.steps import Stepped, linearise_many, rates_many
from planarfriction._support.equality import by_parts

MAX_PACK_BYTES = 64e6
"""Bytes of shapes that a model packs at a time, if that is more than one shape."""

MAX_PACK_SECONDS = 0.25
"""Time [s] for which a model builds the shapes that it packs at a time, if that is more than one shape."""

VELOCITY_SCALE = 0.1
"""Natural scale of the velocity of a body on a patch, as a share of v_s [-] (see `PackedModel`)."""


@by_parts
class PackedModel(NamedTuple):
    """A model at R loads, in the form that the compiled solver reads."""

    functions: Any
    """Compiled `protocol.ModelFunctions` of the model."""
    records: np.ndarray
    """Data of the contact for these functions, a row of words for each load, `[R, words]` (`compiler.memory`)."""
    states: int
    """Number of bristle states of a contact."""
    workspace: int
    """Number of values that a linearisation needs."""
    state_scale: np.ndarray
    """Natural scale of each state, `[states]`: its value at full deflection."""
    radius: float
    """Lever arm [m] that turns the spin of the patch into a speed."""
    keepalive: tuple[np.ndarray, ...]
    """Arrays whose addresses are in the records; the caller of the functions must keep them alive."""
    cells: np.ndarray | None = None
    """Mask of the cells of the model that have bristles here, bool `[N]`, where states belong to cells."""
    velocity_scale: float = VELOCITY_SCALE
    """Natural scale of the body's velocity, as a share of v_s [-].

    A body that is about to slip, or has just stopped, creeps at 1e-4 to 1e-2 of v_s, and friction depends on the
    direction of its twist however slow it is. If errors were measured against v_s itself, that direction would be
    noise, and a patch that just holds could give way, or the other way round.
    """

    stiff: float = 0.0
    """Load [N] at which the law alone would be as stiff as the pad; 0 without one."""

    def table(self, function: Any, square: int) -> np.ndarray:
        """Return the words of `coupled.steps.Stepped`, which hold as long as the records; `square` as there."""
        loads, words = self.records.shape
        address = address_of(function)
        fields = address, self.states, square, loads, place_of(self.records), words
        return row_of(Stepped(*fields, int(self.stiff > 0.0)))


def driven(contact: PackedModel, twist: np.ndarray, load: np.ndarray) -> np.ndarray:
    """Return twists as rates read them: of a pad with the load behind, `[B, 4]`."""
    return np.column_stack([twist, load]) if contact.stiff > 0.0 else twist


def rates(
    packed: PackedModel, state: np.ndarray, twist: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return rates as `state` `[B, ...]` and wrenches per unit load `[B, 3]` at contiguous states and twists `[B, 3]`.

    `packed` has one record, or one for each contact.
    """
    rate = np.empty((len(twist), packed.states))
    wrench = np.empty((len(twist), 3))
    function = address_of(packed.functions.evaluate)
    rates_many(function, packed.records, state.reshape(rate.shape), twist, rate, wrench)
    return rate.reshape(state.shape), wrench


def linearised(packed: PackedModel, state: np.ndarray, twist: np.ndarray) -> np.ndarray:
    """Return linearisations `[B, workspace]`; the kernels of each kind of model describe the numbers."""
    lin = np.empty((len(twist), packed.workspace))
    rate = np.empty((len(twist), packed.states))
    wrench = np.empty((len(twist), 3))
    function = address_of(packed.functions.linearise)
    rows = state.reshape(rate.shape), twist, rate, wrench, lin
    linearise_many(function, packed.records, *rows)
    return lin


def cells_by_load(
    levers: np.ndarray,
    weights: np.ndarray,
    by_load: np.ndarray | None = None,
    kept: np.ndarray | None = None,
) -> ShapesByLoad:
    """Pack cells by the numbers of their levers `[1 or L, K, N]` and weights `[L, N]` at L loads.

    Slopes of the weights are zeros unless given; without `kept` bristles stay as they are.
    """
    rows, numbers, cells = levers.shape
    blocks, lanes = divided.py_func(cells)
    padded = np.zeros((rows, numbers, blocks * lanes))
    padded[..., :cells] = levers
    data = np.zeros((rows, blocks, numbers, LANES))
    data[..., :lanes] = padded.reshape(rows, numbers, blocks, lanes).swapaxes(1, 2)
    shapes, slopes = np.zeros((2, len(weights), blocks * lanes))
    shapes[:, :cells] = weights
    if by_load is not None:
        slopes[:, :cells] = by_load
    stays = np.zeros((0 if kept is None else len(kept), blocks * lanes))
    if kept is not None:
        stays[:, :cells] = kept
    data = data.reshape(rows, -1)
    return ShapesByLoad(np.zeros(3, dtype=int), shapes, slopes, data, stays)
