"""Machine form of a pad whose pieces have a compliance in common: each step solves for the twist of its face."""

from __future__ import annotations

import functools
import math
from typing import Any

import numpy as np

from planarfriction._engine.compiler.memory import places_of
from planarfriction._engine.coupled.coupling import solve_batch
from planarfriction._engine.records.base import StepJacobians
from planarfriction._engine.records.distributed import CompiledDistributed
from planarfriction._engine.records.patches import PackedPatches, packed_patches
from planarfriction.errors import InvalidValueError, SolverError

MOST = 100
"""Iterations of the search for the twist of a face, at most."""


class CompiledSoft(CompiledDistributed):
    """Machine form of a `DistributedModel` on a pad with a common compliance; behind the bristles is the face."""

    def __init__(self, law: Any, patch: Any, pad: Any, lever: float) -> None:
        super().__init__(law, patch, pad)
        bristles = math.prod(self.state_shape)
        self._prepare((bristles + 3,), (bristles + 3, bristles + 3))
        self.compliance = pad.compliance(patch)
        self.lag = pad.lag
        self._lever_arm = lever

    @functools.cached_property
    def _patch(self) -> PackedPatches:
        return packed_patches([self], [self._lever_arm])

    def step_one(self, *inputs: Any) -> None:
        """Leave all steps to `step`."""
        return None

    step_batch = step_one
    jacobians_one = step_one

    def step(
        self,
        state: np.ndarray,
        twist: np.ndarray,
        load: np.ndarray,
        dt: np.ndarray,
        centre: np.ndarray | None = None,
    ) -> tuple[np.ndarray, np.ndarray]:
        """See `CompiledModel`: the host of a prescribed twist does not yield."""
        layout = self._patch.layout
        parts = layout.slices
        rows = np.zeros((load.size, layout.size))
        rows[:, parts["state"]] = state.reshape(load.size, -1)
        rows[:, parts["free_twist"]] = twist.reshape(-1, 3)
        rows[:, parts["free_load"]] = load.reshape(-1, 1)
        rows[:, parts["dt"]] = dt.reshape(-1, 1)
        rows[:, parts["most"]] = MOST
        rows[:, parts["again"]] = 1.0
        ((_, contact, _),) = self.pressed(load, centre)
        records = rows.view(np.int64)[:, parts["records"]]
        records[:, 0] = places_of(contact.records)
        solve_batch(self._patch.patches.words, rows, 0, len(rows))
        if not rows[:, parts["converged"]].all():
            raise SolverError("the twist of a pad's face was not found")
        new = rows[:, parts["new"]].reshape(state.shape)
        return new, rows[:, parts["wrench"]].reshape(twist.shape)

    def evaluate(
        self,
        state: np.ndarray,
        twist: np.ndarray,
        load: np.ndarray,
        centre: np.ndarray | None = None,
    ) -> tuple[np.ndarray, np.ndarray]:
        """See `CompiledModel`."""
        rule = "have no common compliance for rates, which depend on the time in which the face follows"
        raise InvalidValueError("pad", rule, type(self.pad).__name__)

    def step_jacobians(
        self,
        state: np.ndarray,
        twist: np.ndarray,
        load: np.ndarray,
        dt: np.ndarray,
        centre: np.ndarray | None = None,
    ) -> StepJacobians:
        """See `CompiledModel`."""
        raise InvalidValueError(
            "pad",
            "have no common compliance for derivatives of steps",
            type(self.pad).__name__,
        )
