"""Machine form of `DistributedModel`: cells with two bristles each, and their share of the load."""

from __future__ import annotations

import functools
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from planarfriction.compiled import packed
from planarfriction.compiled.base import CompiledModel
from planarfriction.compiled.packed import PackedModel, PackedParts
from planarfriction.compiled.rates import linearised
from planarfriction.compiler.memory import places_of, rows_of
from planarfriction.kernels import cells as contacts
from planarfriction.kernels import distributed_step as steps


class CompiledDistributed(CompiledModel):
    """Machine form of a `DistributedModel` with a law on a patch."""

    def __init__(self, law: Any, patch: Any) -> None:
        self.law, self.patch = law, patch
        kinds = (contacts.ISOTROPIC, steps.ISOTROPIC), (contacts.TURNED, steps.TURNED)
        self._contact, functions = kinds[patch.anisotropic]
        if patch.asymmetric:
            self._contact, functions = contacts.ASYMMETRIC, steps.ASYMMETRIC
        cells = len(patch.positions)
        super().__init__(functions, (2, cells), (2, 2, cells))

    # ------------------------------------------------------------------ at given loads

    @functools.cached_property
    def fixed(self) -> PackedParts | None:
        """See `CompiledModel`."""
        return None if self.patch.depends_on_load else self.packed_parts([None])

    def at_each_load(self, load: np.ndarray) -> Iterator[tuple[Any, PackedParts]]:
        """See `CompiledModel`; all rows at once, each with its own weights."""
        weights = None if self.fixed else self.patch.weights(load.reshape(-1))
        yield slice(None), self.fixed or _alone(self._packed(weights))

    def linearisation(self, state: np.ndarray, twist: np.ndarray, load: np.ndarray) -> np.ndarray:
        """Return linearisations cell by cell `[..., L, N]` (see `kernels.cells.LinearCells`)."""
        ((_, contact),) = self.at_each_load(load)
        cells = state.shape[-1]
        lin = linearised(contact.joined, state.reshape(load.size, 2 * cells), twist.reshape(-1, 3))
        return lin.reshape(*load.shape, lin.shape[-1] // cells, cells)

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

    def packed_parts(self, loads: Sequence[float | None]) -> PackedParts:
        """See `CompiledModel`."""
        return _alone(self._packed(np.array([self.patch.weights(load) for load in loads])))

    def _packed(self, weights: np.ndarray, chosen: np.ndarray | None = None) -> PackedModel:
        """Pack the chosen cells, or all, with R rows of their weights `[R, n]`."""
        if chosen is None:
            chosen = np.ones(weights.shape[1], bool)
        weights, positions = np.ascontiguousarray(weights), self.patch.positions[chosen]
        count, law, numbers = len(positions), self.law.numbers, self._numbers(chosen)
        record = contacts.CellsContact(law, count, numbers, weights)
        return PackedModel(
            self._contact,
            rows_of(record, len(weights), weights=places_of(weights)),
            2 * count,
            (contacts.LEANING if self.patch.asymmetric else contacts.STRAIGHT) * count,
            np.full(2 * count, self.law.largest_deflection),
            float(np.hypot(*(positions - positions.mean(axis=0)).T).mean()),
            (weights, numbers),
            chosen,
        )

    def _numbers(self, chosen: np.ndarray) -> np.ndarray:
        """Return the numbers of the chosen cells as `kernels.cells` reads them, `[2, n]` or `[7, n]`."""
        if not self.patch.anisotropic:
            return np.ascontiguousarray(self.patch.positions[chosen].T)
        levers, asymmetry = self.patch.levers()[chosen], self.patch.asymmetries()[chosen]
        return np.array([*(levers[:, i, j] for i, j in ((0, 0), (0, 1), (1, 1), (0, 2), (1, 2))), *asymmetry.T])

    @functools.cached_property
    def lever(self) -> np.ndarray:
        """P `[3, 2, N]`: the velocity of a cell (`u_i`) is `P' V`, the wrench of a force on it `P f`."""
        return np.ascontiguousarray(self.patch.levers().T)


def _alone(part: PackedModel) -> PackedParts:
    return PackedParts([part], np.ones((len(part.records), 1)))
