"""Interface of the machine form of a friction model."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from planarfriction.compiled.packed import PackedModel, PackedSteps
from planarfriction.equality import by_parts


@by_parts
class StepJacobians(NamedTuple):
    """Derivatives of the results of `step`: the new state, and the wrench at the end of the step.

    The shape of the patch is held fixed. Without load a step resets its bristles: all derivatives are zero except
    `wrench_load`, which is the wrench per unit load in the limit of a small load.
    """

    state_state: np.ndarray
    """d new state / d state: distributed `[..., 2, 2, N]` (cell by cell), reduced `[..., 3, 3]`, of P parts
    `[..., P, 3, 3]` (part by part)."""
    state_twist: np.ndarray
    """d new state / d twist: distributed `[..., 2, N, 3]`, reduced `[..., 3, 3]`, of P parts `[..., P, 3, 3]`."""
    wrench_state: np.ndarray
    """d wrench / d state: distributed `[..., 3, 2, N]`, reduced `[..., 3, 3]`, of P parts `[..., 3, P, 3]`."""
    wrench_twist: np.ndarray
    """d wrench / d twist, `[..., 3, 3]`; an implicit simulator adds this, times `dt`, to its mass matrix."""
    wrench_load: np.ndarray
    """d wrench / d normal_force, `[..., 3]`."""


class CompiledModel:
    """Machine form of a model: steps, rates, and what compiled loops of others need of it.

    `evaluate`, `step` and `step_jacobians` take inputs that `FrictionModel` has checked: contiguous arrays of doubles
    with the same batch axes. `step_one`, `step_batch` and `jacobians_one` take inputs as they come and return None for
    those that are not plain and in order; then the checks of the model decide.
    """

    step_function: Any
    """Compiled function of `kernels.step_slopes` for one part."""
    parts: int = 1
    """Number of parts of `packed_steps`, with as many states each."""

    def step_one(self, state: Any, twist: Any, normal_force: Any, dt: Any) -> tuple[np.ndarray, np.ndarray] | None:
        """Step one contact, or return None."""

    def step_batch(self, state: Any, twist: Any, normal_force: Any, dt: Any) -> tuple[np.ndarray, np.ndarray] | None:
        """Step contacts along one axis, or return None."""

    def jacobians_one(self, state: Any, twist: Any, normal_force: Any, dt: Any) -> StepJacobians | None:
        """Differentiate a step of one contact, or return None."""

    def evaluate(self, state: np.ndarray, twist: np.ndarray, load: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the rates of the states, and wrenches per unit load `[..., 3]`."""
        raise NotImplementedError

    def step(
        self, state: np.ndarray, twist: np.ndarray, load: np.ndarray, dt: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return new states and wrenches `[..., 3]`."""
        raise NotImplementedError

    def step_jacobians(self, state: np.ndarray, twist: np.ndarray, load: np.ndarray, dt: np.ndarray) -> StepJacobians:
        """Differentiate steps."""
        raise NotImplementedError

    def packed(self, loads: Sequence[float | None], between: tuple[float, float] | None = None) -> PackedModel:
        """Pack the model for the solver (see `FrictionModel.packed`)."""
        raise NotImplementedError

    def packed_steps(self, loads: Sequence[float | None]) -> PackedSteps:
        """Pack the model at `loads` > 0 [N], with all of its states, for `coupling`.

        `[None]` stands for any load if the patch ignores it.
        """
        raise NotImplementedError
