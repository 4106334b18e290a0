"""Machine form of a pad whose pieces have a compliance in common: each step solves for the twist of its face."""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from planarfriction._engine.cells import hung_cells
from planarfriction._engine.cells.hung_cells import HungContact
from planarfriction._engine.compiler.memory import places_of, rows_of
from planarfriction._engine.coupled.face_steps import Hanging, step
from planarfriction._engine.protocol import SEEN_SIZE, StepFunctions, calls_of
from planarfriction._engine.records.base import StepJacobians
from planarfriction._engine.records.distributed import CompiledDistributed
from planarfriction._engine.records.packed import PackedModel, rates
from planarfriction._engine.records.patches import PackedPatches, packed_patches
from planarfriction._engine.records.pressing import Pressing
from planarfriction.errors import InvalidValueError, SolverError


class CompiledSoft(CompiledDistributed):
    """Machine form of a `DistributedModel` on a pad with a common compliance; behind the bristles is the face."""

    def __init__(self, law: Any, patch: Any, pad: Any, lever: float) -> None:
        super().__init__(law, patch, pad)
        bristles = math.prod(self.state_shape)
        self._prepare((bristles + 3,), (bristles + 3, bristles + 3))
        self.compliance = pad.compliance(patch)
        self.lag = pad.lag
        self._pieces = CompiledDistributed(law, patch, pad)
        self._lever_arm = lever
        self.functions = StepFunctions(step, None, None)

    @functools.cached_property
    def _alone(self) -> PackedPatches:
        return packed_patches([self], [self._lever_arm])

    @functools.cached_property
    def behind(self) -> int:
        """See `CompiledModel`: room for the row of a problem in contact space."""
        return self._alone.layout.size

    @property
    def bristles(self) -> CompiledDistributed:
        """See `CompiledModel`."""
        return self._pieces

    def _packed(
        self, weights: np.ndarray, chosen: np.ndarray | None = None
    ) -> PackedModel:
        """Pack the pieces, and the face that they hang on."""
        return self._hung(self._pieces._packed(weights, chosen))

    def under(self, given: Pressing) -> PackedModel:
        """See `CompiledDistributed`."""
        return self._hung(self._pieces.under(given))

    def _hung(self, pieces: PackedModel) -> PackedModel:
        stuck, viscous = self.held
        alone = self._alone.patches
        limit = self.law.numbers.mu_s
        face = Hanging(0, alone.address, self.behind, limit, stuck, viscous)
        records = rows_of(face, len(pieces.records), pieces=places_of(pieces.records))
        kept = (*pieces.keepalive, pieces.records, stuck, viscous, alone.words)
        return pieces._replace(
            records=records, states=pieces.states + 3, keepalive=kept
        )

    def packed(
        self, loads: Sequence[float | None], between: tuple[float, float] | None = None
    ) -> PackedModel:
        """See `CompiledModel`: the pieces on their face, whose displacement follows with the time."""
        return self._faced(self._pieces.packed(loads, between))

    def _faced(self, pieces: PackedModel) -> PackedModel:
        """Return pieces, and the face that they hang on, as the solver reads them."""
        (weights, _) = pieces.keepalive
        levers = self.patch.levers()[pieces.cells]
        law = self.law.numbers
        by = "rn,nda,ndb->rab"
        viscous = law.sigma_2 * np.einsum(by, weights, levers, levers)
        stiff = law.sigma_0 * self.stiff[pieces.cells]  # pyright: ignore
        springs = -(stiff[:, None, None] * levers).swapaxes(0, 1).reshape(-1, 3)
        face = HungContact(
            pieces.records[0], calls_of(pieces.functions), pieces.states, self.compliance,
            viscous[0], np.ascontiguousarray(springs), self.lag, np.zeros(SEEN_SIZE),
        )  # fmt: skip
        columns = {"cells": pieces.records, "viscous": places_of(viscous)}
        arms = np.array([1.0, 1.0, 1.0 / (pieces.radius or 1.0)])
        longest = float(pieces.state_scale.max())
        return pieces._replace(
            functions=hung_cells.FUNCTIONS,
            records=rows_of(face, len(pieces.records), **columns),
            states=pieces.states + 3,
            workspace=pieces.workspace + hung_cells.OWN,
            state_scale=np.append(pieces.state_scale, longest * arms),
            keepalive=(*pieces.keepalive, pieces.records, face, viscous),
        )

    def step(self, *inputs: Any) -> tuple[np.ndarray, np.ndarray]:
        """See `CompiledModel`. Raises SolverError if the twist of a face was not found."""
        new, wrench = super().step(*inputs)
        if not np.isfinite(wrench).all():
            raise SolverError("the twist of a pad's face was not found")
        return new, wrench

    def jacobians_one(self, *inputs: Any) -> None:
        """Leave all derivatives to `step_jacobians`."""
        return None

    def evaluate(
        self,
        state: np.ndarray,
        twist: np.ndarray,
        load: np.ndarray,
        pressure: Any = None,
    ) -> tuple[np.ndarray, np.ndarray]:
        """See `CompiledModel`."""
        if pressure is not None:
            rule = "be None for rates on a pad with a common compliance"
            raise InvalidValueError("moments", rule, "some")
        z = state.reshape(-1, self._size)
        loads = load.reshape(-1)
        weights = self.patch.weights(loads if self.depends_on_load else None)
        pieces = self._pieces._packed(np.atleast_2d(weights))
        v = np.column_stack([twist.reshape(-1, 3), loads])
        rate, pull = rates(self._faced(pieces), z, v)
        return rate.reshape(state.shape), pull.reshape(twist.shape)

    def step_jacobians(
        self,
        state: np.ndarray,
        twist: np.ndarray,
        load: np.ndarray,
        dt: np.ndarray,
        pressure: Any = None,
    ) -> StepJacobians:
        """See `CompiledModel`: those of the pieces at the twist of the face, which moves with all inputs."""
        batch = load.shape
        soft = self.compliance
        h = (dt + self.lag)[..., None, None]
        _, wrench = self.step(state, twist, load, dt, pressure)
        face = state[..., -3:]
        at_face = twist + (face + wrench @ soft.T) / h[..., 0]
        bristles = state[..., :-3].reshape(*batch, *self._pieces.state_shape)
        pieces = self._pieces.step_jacobians(bristles, at_face, load, dt, pressure)
        n = state.shape[-1] - 3
        by_face = pieces.wrench_twist
        alone = np.concatenate(
            [pieces.wrench_state.reshape(*batch, 3, n), by_face / h], axis=-1
        )
        answer = np.linalg.inv(np.eye(3) - by_face @ soft / h)
        wrench_state = answer @ alone
        wrench_twist = answer @ by_face
        by_load = pieces.wrench_load
        of_load = pieces.state_load
        if isinstance(pressure, Pressing):
            alone = np.eye(of_load.shape[-1])
            of_load = np.einsum("...an,nm->...anm", of_load, alone)
        else:
            by_load = by_load[..., None]
        wrench_load = answer @ by_load
        moved = np.zeros((*batch, 3, n + 3))
        moved[..., n:] = np.eye(3) / h
        face_state = moved + soft @ wrench_state / h
        face_twist = np.eye(3) + soft @ wrench_twist / h
        face_load = soft @ wrench_load / h
        of_twist = pieces.state_twist.reshape(*batch, n, 3)
        new_state = of_twist @ face_state
        new_state[..., :n] += _spread(pieces.state_state)
        loaded = (load > 0.0)[..., None, None] * dt[..., None, None]
        back = np.zeros((*batch, 3, n + 3))
        back[..., n:] = (load > 0.0)[..., None, None] * np.eye(3)
        of_load = of_load.reshape(*batch, n, -1) + of_twist @ face_load
        new_load = np.concatenate([of_load, -loaded * face_load], axis=-2)
        if not isinstance(pressure, Pressing):
            new_load = new_load[..., 0]
            wrench_load = wrench_load[..., 0]
        return StepJacobians(
            np.concatenate([new_state, back - loaded * face_state], axis=-2),
            np.concatenate(
                [of_twist @ face_twist, loaded * (np.eye(3) - face_twist)], axis=-2
            ),
            new_load,
            wrench_state,
            wrench_twist,
            wrench_load,
        )


def _spread(cells: np.ndarray) -> np.ndarray:
    """Return derivatives cell by cell `[..., d, d, N]` as matrices `[..., d N, d N]`."""
    d, n = cells.shape[-2:]
    spread = np.einsum("...abn,nm->...anbm", cells, np.eye(n))
    return spread.reshape(*cells.shape[:-3], d * n, d * n)
