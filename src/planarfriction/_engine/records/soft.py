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
        self._pieces = CompiledDistributed(law, patch, pad)

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
        state = self.left(state, centre)
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
        """See `CompiledModel`: those of the pieces at the twist of the face, which moves with all inputs."""
        batch = load.shape
        soft = self.compliance
        h = (dt + self.lag)[..., None, None]
        _, wrench = self.step(state, twist, load, dt, centre)
        face = state[..., -3:]
        at_face = twist + (face + wrench @ soft.T) / h[..., 0]
        bristles = state[..., :-3].reshape(*batch, *self._pieces.state_shape)
        pieces = self._pieces.step_jacobians(bristles, at_face, load, dt, centre)
        n = state.shape[-1] - 3
        by_face = pieces.wrench_twist
        alone = np.concatenate(
            [pieces.wrench_state.reshape(*batch, 3, n), by_face / h], axis=-1
        )
        answer = np.linalg.inv(np.eye(3) - by_face @ soft / h)
        wrench_state = answer @ alone
        wrench_twist = answer @ by_face
        wrench_load = (answer @ pieces.wrench_load[..., None])[..., 0]
        moved = np.zeros((*batch, 3, n + 3))
        moved[..., n:] = np.eye(3) / h
        face_state = moved + soft @ wrench_state / h
        face_twist = np.eye(3) + soft @ wrench_twist / h
        face_load = (soft @ wrench_load[..., None] / h)[..., 0]
        of_twist = pieces.state_twist.reshape(*batch, n, 3)
        new_state = of_twist @ face_state
        new_state[..., :n] += _spread(pieces.state_state)
        loaded = (load > 0.0)[..., None, None] * dt[..., None, None]
        back = np.zeros((*batch, 3, n + 3))
        back[..., n:] = (load > 0.0)[..., None, None] * np.eye(3)
        of_load = pieces.state_load.reshape(*batch, n)
        return StepJacobians(
            np.concatenate([new_state, back - loaded * face_state], axis=-2),
            np.concatenate(
                [of_twist @ face_twist, loaded * (np.eye(3) - face_twist)], axis=-2
            ),
            np.concatenate(
                [
                    of_load + (of_twist @ face_load[..., None])[..., 0],
                    -loaded[..., 0] * face_load,
                ],
                axis=-1,
            ),
            wrench_state,
            wrench_twist,
            wrench_load,
        )


def _spread(cells: np.ndarray) -> np.ndarray:
    """Return derivatives cell by cell `[..., d, d, N]` as matrices `[..., d N, d N]`."""
    d, n = cells.shape[-2:]
    spread = np.einsum("...abn,nm->...anbm", cells, np.eye(n))
    return spread.reshape(*cells.shape[:-3], d * n, d * n)
