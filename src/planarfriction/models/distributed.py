"""The distributed model: one two-dimensional bristle in every cell of the patch."""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import Any

import numpy as np

from planarfriction.compiled.distributed import CompiledDistributed
from planarfriction.laws.base import refuse_creep
from planarfriction.models.base import FrictionModel, ModelJacobians


@dataclass(frozen=True, eq=False)
class DistributedModel(FrictionModel):
    """Distributed LuGre friction, exact for the given patch.

    `zdot_i = v_i - beta sigma_0 |v_i| / g z_i`, `W = sum w_i f_N [t_i ; rho_i x t_i]`, `t_i = -(sigma_0 z_i + sigma_1
    zdot_i + sigma_2 v_i)`. State: bristle deflections `[2, N]` [m], x then y.

    With a friction metric, `u_i = L_i v_i` replaces `v_i`, and `L_i t_i` replaces `t_i`. With asymmetric friction the
    bristle decays towards `a_i g/sigma_0` instead of zero, `zdot_i = u_i - k_i (z_i - a_i g/sigma_0)`, `k_i = beta
    sigma_0 |u_i|/g`, where beta depends on the deflection measured from there.

    Raises InvalidValueError for what is not a patch or a law, and for a law that creeps on a patch with an asymmetry.

    Source: Waltersson and Karayiannidis 2024, section III.
    """

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.patch.asymmetric:
            refuse_creep(self.law, "patches with an asymmetry")  # at rest they would push

    @property
    def state_shape(self) -> tuple[int, ...]:
        """`(2, N)` for the N cells that can carry load."""
        return (2, len(self.patch.positions))

    @functools.cached_property
    def compiled(self) -> CompiledDistributed:
        """Machine form of the model (see `FrictionModel.compiled`)."""
        return CompiledDistributed(self.law, self.patch)

    def jacobians(self, state: Any, twist: Any, normal_force: Any) -> ModelJacobians:
        """Return the analytic derivatives of `rate` and `wrench` (see `ModelJacobians`); one-sided at kinks.

        Raises InvalidValueError as `step` does.
        """
        state, twist, load = self._inputs(state, twist, normal_force)
        law, identity = self.law.numbers, np.eye(2)[:, :, None]
        lin, lever = self.compiled.linearisation(state, twist, load), self.compiled.lever
        bristle = lin[..., 7:9, :] if self.patch.asymmetric else state
        k, k_z, k_v = lin[..., :1, None, :], lin[..., None, 1:3, :], lin[..., None, 3:5, :]
        rate_state = -k * identity - bristle[..., :, None, :] * k_z
        rate_velocity = identity - bristle[..., :, None, :] * k_v
        if self.patch.asymmetric:
            rate_velocity = lin[..., 9:13, :].reshape(rate_state.shape)
        rate_twist = np.einsum("...abn,dbn->...and", rate_velocity, lever)
        share = load[..., None] * self.patch.weights(load)
        force_state = -(law.sigma_0 * identity + law.sigma_1 * rate_state) * share[..., None, None, :]
        force_velocity = -(law.sigma_2 * identity + law.sigma_1 * rate_velocity) * share[..., None, None, :]
        return ModelJacobians(
            rate_state,
            rate_twist,
            np.zeros_like(state),
            np.einsum("dan,...abn->...dbn", lever, force_state),
            np.einsum("dan,...abn,ebn->...de", lever, force_velocity, lever),
            self.compiled.evaluate(state, twist, load)[1],
        )

    def _state_of(self, deflections: np.ndarray, load: float) -> np.ndarray:
        return deflections
