"""The distributed model: a bristle in every cell of the patch, of two components in points and three in discs."""

from __future__ import annotations

import functools
from dataclasses import KW_ONLY, dataclass
from typing import Any

import numpy as np

from planarfriction._engine.records.distributed import CompiledDistributed
from planarfriction._engine.records.rate_cells import CompiledRateCells
from planarfriction._engine.records.soft import CompiledSoft
from planarfriction._support import validation
from planarfriction._support.equality import checked
from planarfriction.laws.base import is_rate_law, refuse_creep, refuse_rate_law
from planarfriction.models.base import (
    FrictionModel,
    ModelJacobians,
    arm_of,
    hung,
    refuse_common,
)
from planarfriction.models.cell_loads import Cells
from planarfriction.pads import Pad


@dataclass(frozen=True, eq=False)
class DistributedModel(FrictionModel):
    """Distributed LuGre friction, exact for the given patch.

    `zdot_i = v_i - beta sigma_0 |v_i| / g z_i`, `W = sum w_i f_N [t_i ; rho_i x t_i]`, `t_i = -(sigma_0 z_i + sigma_1
    zdot_i + sigma_2 v_i)`. State: bristle deflections `[2, N]` [m], x then y.

    A patch of discs (`ContactPatch.discs`) has a third bristle in every cell, that of its spin: cells see `u = (v_i,
    kappa a_i omega)`, and the state is `[3, N]` [m]. They slide as discs do (docs/discs.md).

    With a friction metric, `u_i = L_i v_i` replaces `v_i`, and `L_i t_i` replaces `t_i`. With asymmetric friction the
    bristle decays towards `a_i g/sigma_0` instead of zero, `zdot_i = u_i - k_i (z_i - a_i g/sigma_0)`, `k_i = beta
    sigma_0 |u_i|/g`, where beta depends on the deflection measured from there.

    With a `pad` bristle i is a piece of it, whose stiffness K_i is its own and does not grow with its load N_i: it
    moves as above with `l_i z_i` in place of `z_i`, `l_i = K_i/(sigma_0 N_i)`, and damps along `u_i` alone
    (docs/pads.md). The state of a pad with a common compliance is flat, `[d N + 3]`; the displacement of the face is
    last.

    Raises InvalidValueError for what is not a patch or a law, for a law that creeps on a patch with an asymmetry, and
    for a pad that does not go with them.

    Source: Waltersson and Karayiannidis 2024, section III.
    """

    _: KW_ONLY
    pad: Pad | None = checked(  # pyright: ignore[reportIncompatibleVariableOverride]
        validation.instance, Pad, "a Pad or None", default=None
    )
    """Pad under the patch; None: bristles whose stiffness grows with the load, as published."""

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
        if self.pad is not None:
            refuse_rate_law(self.law, "a pad")
            self.pad.check(self.patch, self.law)

    @property
    def state_shape(self) -> tuple[int, ...]:
        """`(2, N)` for the N cells that can carry load; `(3, N)` for discs; flat with the face of a pad behind."""
        return self.compiled.state_shape

    @functools.cached_property
    def compiled(self) -> CompiledDistributed:
        """Machine form of the model (see `FrictionModel.compiled`)."""
        if is_rate_law(self.law):
            return CompiledRateCells(self.law, self.patch)
        if self._common:
            return CompiledSoft(self.law, self.patch, self.pad, arm_of(self.patch))
        return CompiledDistributed(self.law, self.patch, self.pad)

    @functools.cached_property
    def _common(self) -> bool:
        """True if the pieces of the pad have a compliance in common."""
        return self.pad is not None and self.pad.compliance(self.patch) is not None

    def _bearing(self, loads: Any) -> Cells:
        return self._cells

    @functools.cached_property
    def _cells(self) -> Cells:
        return Cells.alone(self.compiled.bristles)

    def jacobians(self, state: Any, twist: Any, normal_force: Any) -> ModelJacobians:
        """Return the analytic derivatives of `rate` and `wrench` (see `ModelJacobians`); one-sided at kinks.

        Raises InvalidValueError as `step` does.
        """
        refuse_common(self, "derivatives of rates")
        state, twist, load, _ = self._inputs(state, twist, normal_force)
        lever = self.compiled.lever
        share = (load[..., None] * self.patch.weights(load))[..., None, None, :]
        rate_state, rate_velocity, pull_state, pull_velocity = self.compiled.slopes(
            state, twist, load
        )
        wrench_state = np.einsum("dan,...abn->...dbn", lever, share * pull_state)
        rate_load = np.zeros_like(state)
        wrench_load = self.compiled.evaluate(state, twist, load)[1]
        # Rates and tractions of a pad are functions of `z/f`.
        if self.pad is not None:
            per = -1.0 / np.where(load > 0.0, load, np.inf)
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
        return hung(self, deflections)
