"""Machine form of `DistributedModel`: cells with two bristles each, and their share of the load."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from typing import Any

import numpy as np

from planarfriction.compiled import anisotropic_steps, packed
from planarfriction.compiled.base import CompiledModel, StepJacobians
from planarfriction.compiled.packed import PackedModel, PackedSteps
from planarfriction.compiled.rates import linearised, rates
from planarfriction.compiler.memory import places_of, rows_of
from planarfriction.kernels import cells as contacts
from planarfriction.kernels import distributed_step as kernels
from planarfriction.kernels import step_slopes


class CompiledDistributed(CompiledModel):
    """Machine form of a `DistributedModel` with a law on a patch."""

    def __init__(self, law: Any, patch: Any) -> None:
        self.law, self.patch = law, patch
        self.step_function = step_slopes.anisotropic if patch.anisotropic else step_slopes.distributed

    def evaluate(self, state: np.ndarray, twist: np.ndarray, load: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """See `CompiledModel`."""
        rate, wrench = rates(self._all_cells(load), state.reshape(load.size, *state.shape[-2:]), twist.reshape(-1, 3))
        return rate.reshape(state.shape), wrench.reshape(twist.shape)

    def linearisation(self, state: np.ndarray, twist: np.ndarray, load: np.ndarray) -> np.ndarray:
        """Return linearisations cell by cell `[..., L, N]` (see `kernels.cells.LinearCells`)."""
        cells = state.shape[-1]
        lin = linearised(self._all_cells(load), state.reshape(load.size, 2 * cells), twist.reshape(-1, 3))
        return lin.reshape(*load.shape, lin.shape[-1] // cells, cells)

    def step(
        self, state: np.ndarray, twist: np.ndarray, load: np.ndarray, dt: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """See `CompiledModel`."""
        if self.patch.anisotropic:
            return anisotropic_steps.step(self, state, twist, load, dt)
        flat, moved = state.reshape(load.size, 2 * state.shape[-1]), twist.reshape(-1, 3)
        new, wrench = np.empty_like(flat), np.empty(moved.shape)
        cells = self._cells(load)
        kernels.step_batch(self.law.numbers, flat, moved, cells, load.reshape(-1), dt.reshape(-1), new, wrench)
        return new.reshape(state.shape), wrench.reshape(twist.shape)

    def step_jacobians(self, state: np.ndarray, twist: np.ndarray, load: np.ndarray, dt: np.ndarray) -> StepJacobians:
        """See `CompiledModel`."""
        if self.patch.anisotropic:
            return anisotropic_steps.step_jacobians(self, state, twist, load, dt)
        cells = state.shape[-1]
        shapes = (2, 2, cells), (2, cells, 3), (3, 2, cells), (3, 3), (3,)
        results = kernels.CellJacobians(*(np.zeros((load.size, *shape)) for shape in shapes))
        flat, moved = state.reshape(load.size, 2, cells), twist.reshape(-1, 3)
        kernels.jacobians(self.law.numbers, flat, moved, self._cells(load), load.reshape(-1), dt.reshape(-1), results)
        return StepJacobians(*(part.reshape(*load.shape, *part.shape[1:]) for part in results))

    # ------------------------------------------------------------------ for the loops of others

    def packed(self, loads: Sequence[float | None], between: tuple[float, float] | None = None) -> PackedModel:
        """See `CompiledModel`; only cells that carry load at one of the loads have bristles."""
        if between is None:
            weights = np.atleast_2d([self.patch.weights(load) for load in loads])
            chosen = weights.max(axis=0) > 0.0
            return self._packed(weights[:, chosen], chosen)
        chosen = self.patch.pressure.ever_loaded(self.patch.positions, between)
        most = max(int(packed.MAX_PACK_BYTES / (8.0 * chosen.sum())), 1)
        return self._packed(np.array([self.patch.weights(load)[chosen] for load in loads[:most]]), chosen)

    def packed_steps(self, loads: Sequence[float | None]) -> PackedSteps:
        """See `CompiledModel`."""
        found = self._packed(np.array([self.patch.weights(load) for load in loads]))
        return PackedSteps(found.records[:, None], np.ones((len(loads), 1)), found.keepalive)

    def _packed(self, weights: np.ndarray, chosen: np.ndarray | None = None) -> PackedModel:
        """Pack the chosen cells, or all, with R rows of their weights `[R, n]`."""
        if chosen is None:
            chosen = np.ones(weights.shape[1], bool)
        weights, positions = np.ascontiguousarray(weights), self.patch.positions[chosen]
        count, law = len(positions), self.law.numbers
        if self.patch.anisotropic:
            numbers = anisotropic_steps.cell_numbers(self.patch, chosen)
            functions = contacts.ASYMMETRIC if self.patch.asymmetric else contacts.TURNED
        else:
            numbers, functions = np.ascontiguousarray(positions.T), contacts.ISOTROPIC
        record = contacts.CellsContact(law, count, numbers, weights)
        return PackedModel(
            functions,
            rows_of(record, len(weights), weights=places_of(weights)),
            2 * count,
            (contacts.LEANING if self.patch.asymmetric else contacts.STRAIGHT) * count,
            np.full(2 * count, self.law.largest_deflection),
            float(np.hypot(*(positions - positions.mean(axis=0)).T).mean()),
            (weights, numbers),
            chosen,
        )

    # ------------------------------------------------------------------ cells

    def _all_cells(self, load: np.ndarray) -> PackedModel:
        return self._packed(self._cells(load).weights)

    def _cells(self, load: np.ndarray) -> kernels.Cells:
        """Return the cells with one row of weights, or one for each load."""
        weights = self.patch.weights(load.reshape(-1)) if self.patch.depends_on_load else self.patch.weights()
        return kernels.Cells(*self._xy, np.ascontiguousarray(np.atleast_2d(weights)))

    @functools.cached_property
    def _xy(self) -> tuple[np.ndarray, np.ndarray]:
        return np.ascontiguousarray(self.patch.positions[:, 0]), np.ascontiguousarray(self.patch.positions[:, 1])

    @functools.cached_property
    def lever(self) -> np.ndarray:
        """P `[3, 2, N]`: the velocity of a cell (`u_i`) is `P' V`, the wrench of a force on it `P f`."""
        if self.patch.anisotropic:
            return np.ascontiguousarray(self.patch.levers().T)
        x, y = self._xy
        one, zero = np.ones_like(x), np.zeros_like(x)
        return np.array([[one, zero], [zero, one], [-y, x]])

    @functools.cached_property
    def asymmetry(self) -> np.ndarray | None:
        """Asymmetries `a_i` `[2, N]`, or None."""
        return np.ascontiguousarray(self.patch.asymmetries().T) if self.patch.asymmetric else None
