"""Machine form of `DistributedModel`: cells that are points or small discs, and their share of the load."""

from __future__ import annotations

import copy
import functools
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from planarfriction._engine.bristles.discs import KAPPA
from planarfriction._engine.cells.cell_loops import LEANS, PAD, PLAIN
from planarfriction._engine.cells.cell_steps import CellSteps, functions_of_cells
from planarfriction._engine.cells.cells import CellsContact
from planarfriction._engine.cells.general_cells import LINEAR, MATRICES, A, C, E, F
from planarfriction._engine.cells.moment_pressure import tilted
from planarfriction._engine.cells.rollouts import ShapesByLoad
from planarfriction._engine.compiler.memory import places_of, rows_of, size_of
from planarfriction._engine.protocol import ModelFunctions
from planarfriction._engine.records import packed
from planarfriction._engine.records.base import CompiledModel, StepJacobians
from planarfriction._engine.records.packed import (
    PackedModel,
    cells_by_load,
    driven,
    linearised,
)
from planarfriction._engine.records.pressing import Pressing
from planarfriction.formulas import LIGHTEST

SHORTEST = 1e-9
"""Least width of a cell over which an edge uncovers it [m]."""

LOAD_STEP = 1e-5
"""Step of the central differences of weights by the load, as a share of the load [-]; their relative error is 1e-10."""


class CompiledDistributed(CompiledModel):
    """Machine form of a `DistributedModel` with a law on a patch, whose pieces may be those of a pad."""

    def __init__(self, law: Any, patch: Any, pad: Any = None) -> None:
        self.law = law
        self.pad = pad
        self.patch = patch
        self.depends_on_load = patch.depends_on_load
        self.size = patch.bristles
        """Number of bristles of a cell: two of a point, three of a disc."""
        self.components = self.size
        self.springs = 1.0 if pad is None or pad.springs_of_law else 0.0
        """See `cells.rollouts.Inputs`."""
        self.stiff = None
        """`elastic.Elastic.stiff` [N] of the pieces of the pad `[N]`; None without one."""
        if pad is not None:
            self.stiff = pad.pieces(patch, law) / law.numbers.sigma_0
            self.of_pad = True
        if self.size == 3 and not patch.anisotropic:
            self.moves = 3 + (pad is not None)
        self._contact, functions = self._functions()
        cells = len(patch.positions)
        super().__init__(functions, (self.size, cells), (self.size, self.size, cells))

    def _functions(self) -> tuple[ModelFunctions, CellSteps]:
        return functions_of_cells(self.size, self.patch.anisotropic, self.sort)

    @property
    def held(self) -> tuple[np.ndarray, np.ndarray]:
        """See `CompiledModel`."""
        if self.stiff is None and self.depends_on_load:
            return super().held
        law = self.law.numbers
        levers = self.patch.levers()
        shares = self.patch.areas / self.patch.areas.sum()
        if not self.depends_on_load:
            shares = self.patch.weights()
        by = "n,nda,ndb->ab"
        stiff = shares if self.stiff is None else self.stiff
        stuck = np.einsum(by, law.sigma_0 * stiff, levers, levers)
        damps = law.sigma_1 + law.sigma_2
        return stuck, damps * np.einsum(by, shares, levers, levers)

    @property
    def sort(self) -> str:
        """Sort of bristles (see `cells.cell_loops.KINDS`)."""
        if self.stiff is not None:
            return PAD
        return LEANS if self.patch.asymmetric else PLAIN

    def record(self, numbers: np.ndarray, weights: np.ndarray) -> tuple[Any, int]:
        """Return the record of a contact, and how many numbers of a linearisation each cell has."""
        matrices = MATRICES if self.sort == PAD else LINEAR
        rows, count = numbers.shape
        contact = CellsContact(self.law.numbers, count, rows, numbers, weights)
        return contact, matrices * self.size**2

    # ------------------------------------------------------------------ at given loads

    def pressed(
        self, load: np.ndarray, pressure: Any = None
    ) -> Iterator[tuple[Any, PackedModel, np.ndarray | None]]:
        """See `CompiledModel`; all rows at once, each with its own weights."""
        if pressure is None and self.fixed is not None:
            yield slice(None), self.fixed, None
            return
        if isinstance(pressure, PackedModel):
            yield slice(None), pressure, None
            return
        if not isinstance(pressure, Pressing):
            weights = self.patch.weights(load.reshape(-1))
            if pressure is not None:
                centres = pressure.reshape(-1, 2)
                weights = tilted(self.patch.positions, weights, centres)
            pressure = Pressing(load, weights)
        yield slice(None), self.under(pressure), None

    def under(self, given: Pressing) -> PackedModel:
        """Pack the cells under given loads."""
        return self._anew(self.numbers_under(given), given.weights)

    def numbers_under(self, given: Pressing) -> np.ndarray:
        """Return the `numbers` of the cells under given loads `[R, rows, n]`, or one row if they stay."""
        return (
            self._whole.keepalive[1][None] if given.numbers is None else given.numbers
        )

    @functools.cached_property
    def _whole(self) -> PackedModel:
        """The cells at equal weights."""
        n = len(self.patch.positions)
        return self._packed(np.full((1, n), 1.0 / n))

    def _anew(self, numbers: np.ndarray, weights: np.ndarray) -> PackedModel:
        """Return cells with `numbers` `[1 or R, numbers, n]` and `weights` `[R, n]` in each row."""
        weights = np.ascontiguousarray(weights)
        numbers = np.ascontiguousarray(numbers)
        (record, _) = self.record(numbers[0], weights)
        rows = len(weights)
        cells = np.broadcast_to(places_of(numbers), rows)
        packed = rows_of(record, rows, weights=places_of(weights), cells=cells)
        return self._whole._replace(records=packed, keepalive=(weights, numbers))

    def step_jacobians(
        self,
        state: np.ndarray,
        twist: np.ndarray,
        load: np.ndarray,
        dt: np.ndarray,
        pressure: Any = None,
    ) -> StepJacobians:
        """See `CompiledModel`; of given loads by the state before it was left, and by the load of each cell."""
        if not isinstance(pressure, Pressing):
            return super().step_jacobians(state, twist, load, dt, pressure)
        rows, n = pressure.weights.shape
        numbers = self.numbers_under(pressure).swapaxes(1, 2)
        numbers = np.broadcast_to(numbers, (rows, *numbers.shape[1:]))
        numbers = np.ascontiguousarray(numbers).reshape(rows * n, -1, 1)
        weights = np.ones((rows * n, 1))
        contact = self._anew(numbers, weights)
        contact = contact._replace(states=self.size)
        shares = np.maximum(pressure.weights, LIGHTEST)
        left = pressure.left(state, self.size).reshape(rows, self.size, n)
        slopes = self._one.step_jacobians(
            np.ascontiguousarray(left.swapaxes(1, 2)).reshape(-1, self.size, 1),
            np.repeat(twist.reshape(rows, 3), n, axis=0),
            (load.reshape(rows, 1) * shares).ravel(),
            np.repeat(dt.ravel(), n),
            contact,
        )
        kept = 1.0 if pressure.kept is None else pressure.kept[:, None, None]
        by_state, by_twist, by_load, pull_state, pull_twist, pull_load = (
            np.moveaxis(each.reshape(rows, n, *each.shape[1:]), 1, -1)
            for each in slopes
        )
        found = (
            by_state[:, :, :, 0] * kept,
            by_twist[:, :, 0].swapaxes(-1, -2),
            by_load[:, :, 0],
            pull_state[:, :, :, 0] * kept,
            pull_twist.sum(axis=-1),
            pull_load,
        )
        return StepJacobians(
            *(each.reshape(*load.shape, *each.shape[1:]) for each in found)
        )

    @functools.cached_property
    def _one(self) -> CompiledDistributed:
        """Machine form of one cell, whose numbers are given with it."""
        one = copy.copy(self)
        one._prepare((self.size, 1), (self.size, self.size, 1))
        return one

    def points(self) -> tuple[np.ndarray, int]:
        """See `CompiledModel`."""
        size = size_of(type(self.record(np.zeros((2, 1)), np.zeros(1))[0]))
        widths = np.maximum(np.sqrt(self.patch.areas), SHORTEST)
        return np.column_stack([self.patch.positions, widths]), size

    def linearisation(
        self, state: np.ndarray, twist: np.ndarray, load: np.ndarray
    ) -> np.ndarray:
        """Return linearisations `[..., L, N]` of `cells.general_cells`."""
        ((_, contact, _),) = self.pressed(load)
        cells = state.shape[-1]
        seen = driven(contact, twist.reshape(-1, 3), load.reshape(-1))
        lin = linearised(contact, state.reshape(load.size, self.size * cells), seen)
        return lin.reshape(*load.shape, lin.shape[-1] // cells, cells)

    def slopes(self, state: np.ndarray, twist: np.ndarray, load: np.ndarray) -> Any:
        """Return the derivatives of the rates of cells, and of their tractions per unit load, by state and velocity.

        Four arrays `[..., d, d, N]` of d bristles a cell; the velocity is that which a cell sees.
        """
        law = self.law.numbers
        d = self.size
        lin = self.linearisation(state, twist, load)
        matrices = np.moveaxis(
            lin.reshape(*load.shape, lin.shape[-2] // d**2, d, d, lin.shape[-1]), -4, 0
        )
        by_state = matrices[A]
        by_velocity = matrices[F]
        identity = np.eye(d)[:, :, None]
        if len(matrices) == MATRICES:
            return by_state, by_velocity, matrices[C], matrices[E]
        pull_state = law.sigma_0 * identity + law.sigma_1 * by_state
        pull_velocity = law.sigma_2 * identity
        return (
            by_state,
            by_velocity,
            -pull_state,
            -(pull_velocity + law.sigma_1 * by_velocity),
        )

    # ------------------------------------------------------------------ for the loops of others

    def packed(
        self, loads: Sequence[float | None], between: tuple[float, float] | None = None
    ) -> PackedModel:
        """See `CompiledModel`; only cells that carry load at one of the loads have bristles."""
        if len(loads) == 1 and loads[0] is None:
            return self._at_any_load
        if between is None:
            weights = np.atleast_2d([self.patch.weights(load) for load in loads])
            chosen = weights.max(axis=0) > 0.0
            return self._packed(weights[:, chosen], chosen)
        chosen = self.patch.pressure.ever_loaded(self.patch.positions, between)
        most = max(int(packed.MAX_PACK_BYTES / (8.0 * chosen.sum())), 1)
        return self._packed(
            np.array([self.patch.weights(load)[chosen] for load in loads[:most]]),
            chosen,
        )

    @functools.cached_property
    def _at_any_load(self) -> PackedModel:
        """The cells that carry load, on a patch that ignores how much."""
        weights = self.patch.weights()
        return self._packed(weights[None, weights > 0.0], weights > 0.0)

    def with_all_states(self, loads: Sequence[float | None]) -> PackedModel:
        """See `CompiledModel`."""
        return self._packed(np.array([self.patch.weights(load) for load in loads]))

    def at_loads(self, loads: np.ndarray, slopes: bool) -> ShapesByLoad:
        """Pack the cells at different loads > 0 `[L]` [N], with the `slopes` of their weights by the load or zeros.

        Slopes are central differences.
        """
        by_load = None
        step = LOAD_STEP * loads
        if slopes:
            above, below = (
                self.patch.weights(loads + change) for change in (step, -step)
            )
            by_load = (above - below) / (2.0 * step)[:, None]
        return cells_by_load(self.numbers()[None], self.patch.weights(loads), by_load)

    def _packed(
        self, weights: np.ndarray, chosen: np.ndarray | None = None
    ) -> PackedModel:
        """Pack the chosen cells, or all, with R rows of their weights `[R, n]`."""
        chosen = np.ones(weights.shape[1], bool) if chosen is None else chosen
        weights = np.ascontiguousarray(weights)
        positions = self.patch.positions[chosen]
        count = len(positions)
        numbers = self.numbers(chosen)
        (record, per_cell) = self.record(numbers, weights)
        states = self.size * count
        distances = np.hypot(*(positions - positions.mean(axis=0)).T)
        radius = float(
            np.hypot(distances, KAPPA * self.patch.lever_radii[chosen]).mean()
        )
        rows = rows_of(record, len(weights), weights=places_of(weights))
        scale = np.full(count, self.law.largest_deflection)
        stiff = 0.0
        if self.stiff is not None:  # at the load `stiff`
            stiff = float(self.stiff.sum())
            scale = scale * weights.max(axis=0) * stiff / self.stiff[chosen]
        return PackedModel(
            self._contact, rows, states, per_cell * count, np.tile(scale, self.size), radius, (weights, numbers),
            chosen, stiff=stiff,
        )  # fmt: skip

    def numbers(self, chosen: Any = slice(None)) -> np.ndarray:
        """Return the numbers `[numbers, n]` of cells, chosen or all, as levers (see `cells.cells`) read them."""
        levers = self.patch.levers()[chosen]
        spin = levers[:, 2:, 2].T
        lever = self.patch.positions[chosen].T
        behind: Any = []
        if self.patch.anisotropic:
            places = (0, 0), (0, 1), (1, 1), (0, 2), (1, 2)
            lever = np.array([levers[:, i, j] for i, j in places])
            behind = self.patch.asymmetries()[chosen].T
        if self.stiff is not None:
            behind = [self.stiff[chosen]]
        return np.array([*lever, *spin, *behind])

    @functools.cached_property
    def lever(self) -> np.ndarray:
        """P `[3, d, N]`: the velocity of a cell (`u_i`) is `P' V`, the wrench of a force on it `P f`."""
        return np.ascontiguousarray(self.patch.levers().T)
