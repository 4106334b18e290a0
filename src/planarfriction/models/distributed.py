"""The distributed model: a bristle in every cell of the patch, of two components in points and three in discs."""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import Any

import numpy as np

from planarfriction._engine.records.distributed import CompiledDistributed
from planarfriction._engine.records.rate_cells import CompiledRateCells
from planarfriction.errors import InvalidValueError
from planarfriction.formulas import LIGHTEST
from planarfriction.laws.base import is_rate_law, refuse_creep, refuse_rate_law
from planarfriction.models.base import FrictionModel, ModelJacobians


@dataclass(frozen=True, eq=False)
class DistributedModel(FrictionModel):
    """Distributed LuGre friction, exact for the given patch.

    `zdot_i = v_i - beta sigma_0 |v_i| / g z_i`, `W = sum w_i f_N [t_i ; rho_i x t_i]`, `t_i = -(sigma_0 z_i + sigma_1
    zdot_i + sigma_2 v_i)`. State: bristle deflections `[2, N]` [m], x then y.

    A patch of discs (`ContactPatch.discs`) has a third bristle in every cell, that of its spin: cells see `u = (v_i,
    kappa a_i omega)`, and the state is `[3, N]` [m]. They slide as discs do (docs/physics.md, "Discs").

    With a friction metric, `u_i = L_i v_i` replaces `v_i`, and `L_i t_i` replaces `t_i`. With asymmetric friction the
    bristle decays towards `a_i g/sigma_0` instead of zero, `zdot_i = u_i - k_i (z_i - a_i g/sigma_0)`, `k_i = beta
    sigma_0 |u_i|/g`, where beta depends on the deflection measured from there.

    A law with a `reference_load` (`LuGre`, `Dahl`) has a stiffness that does not grow with the load; a bristle that a
    falling load has left beyond its limit slips back onto it (see docs/physics.md, "Stiffness and load").

    Raises InvalidValueError for what is not a patch or a law, for a law that creeps on a patch with an asymmetry, and
    for one with a `reference_load` on a patch whose shape depends on the load.

    Source: Waltersson and Karayiannidis 2024, section III.
    """

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.patch.has_discs:
            refuse_rate_law(
                self.law,
                "patches of discs (dataclasses.replace(patch, radii=None) has points)",
            )
        if self.patch.asymmetric:
            # At rest they would push.
            refuse_creep(self.law, "patches with an asymmetry")
            refuse_rate_law(self.law, "patches with an asymmetry")
        if self.law.reference_load is not None and self.patch.depends_on_load:
            rule = "have a shape that does not depend on the load, for a law with a reference_load"
            raise InvalidValueError("patch", rule, self.patch.name or "one that does")

    @property
    def state_shape(self) -> tuple[int, ...]:
        """`(2, N)` for the N cells that can carry load; `(3, N)` for discs."""
        return (self.patch.bristles, len(self.patch.positions))

    @functools.cached_property
    def compiled(self) -> CompiledDistributed:
        """Machine form of the model (see `FrictionModel.compiled`)."""
        return (CompiledRateCells if is_rate_law(self.law) else CompiledDistributed)(
            self.law, self.patch
        )

    def jacobians(self, state: Any, twist: Any, normal_force: Any) -> ModelJacobians:
        """Return the analytic derivatives of `rate` and `wrench` (see `ModelJacobians`); one-sided at kinks.

        Raises InvalidValueError as `step` does.
        """
        state, twist, load, _ = self._inputs(state, twist, normal_force)
        lever = self.compiled.lever
        share = (load[..., None] * self.patch.weights(load))[..., None, None, :]
        rate_state, rate_velocity, pull_state, pull_velocity = self.compiled.slopes(
            state, twist, load
        )
        wrench_state = np.einsum("dan,...abn->...dbn", lever, share * pull_state)
        rate_load = np.zeros_like(state)
        wrench_load = self.compiled.evaluate(state, twist, load)[1]
        # Rates and tractions are functions of `z f_ref/f`.
        if self.compiled.reference > 0.0:
            per = np.where(
                load > LIGHTEST * self.compiled.reference, -1.0, 0.0
            ) / np.where(load > 0.0, load, 1.0)
            rate_load = np.einsum("...,...abn,...bn->...an", per, rate_state, state)
            wrench_load = wrench_load + np.einsum(
                "...,...dbn,...bn->...d", per, wrench_state, state
            )
        return ModelJacobians(
            rate_state,
            np.einsum("...abn,dbn->...and", rate_velocity, lever),
            rate_load,
            wrench_state,
            np.einsum("dan,...abn,ebn->...de", lever, share * pull_velocity, lever),
            wrench_load,
        )

    def _state_of(self, deflections: np.ndarray, load: float) -> np.ndarray:
        return deflections
