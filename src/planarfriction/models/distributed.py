"""The distributed model: one two-dimensional bristle in every cell of the patch."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from planarfriction.kernels import anisotropic_contact, distributed_contact, step_slopes
from planarfriction.kernels import distributed_step as kernels
from planarfriction.kernels.anisotropic_contact import AnisotropicContact
from planarfriction.kernels.distributed_contact import DistributedContact
from planarfriction.kernels.pointers import place_of
from planarfriction.kernels.records import rows_of
from planarfriction.laws.base import refuse_creep
from planarfriction.models import anisotropic, base
from planarfriction.models.base import FrictionModel, ModelJacobians, PackedModel, PackedSteps, StepJacobians
from planarfriction.models.rates import linearised, rates


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

    def rate(self, state: Any, twist: Any, normal_force: Any) -> np.ndarray:
        """Bristle rates `zdot`, shape `[..., 2, N]` [m/s]. Raises InvalidValueError as `step` does."""
        state, twist, load = self._inputs(state, twist, normal_force)
        return self._rates(state, twist, load)[0]

    def wrench(self, state: Any, twist: Any, normal_force: Any) -> np.ndarray:
        """Friction wrench on the moving body, `[..., 3]` [N, N, N m]. Raises InvalidValueError as `step` does."""
        state, twist, load = self._inputs(state, twist, normal_force)
        return load[..., None] * self._rates(state, twist, load)[1]

    def step(self, state: Any, twist: Any, normal_force: Any, dt: Any) -> tuple[np.ndarray, np.ndarray]:
        """Advance by `dt` [s] at a constant twist; returns the new state and the wrench at the end. Stable at any `dt`.

        Plain LuGre is linear in z, and its step is exact. Elasto-plastic bristles use an exponential step with the
        average of the decay at the start and at the predicted end: second order, and limited to the largest deflection
        so that nothing overshoots.

        Raises InvalidValueError for shapes that do not fit, numbers that are not finite, and a load or time below zero.
        """
        state, twist, load, dt = self._inputs(state, twist, normal_force, dt=dt)
        if self.patch.anisotropic:
            return anisotropic.step(self, state, self._cell_velocity(twist), load, dt)
        batch = load.shape
        flat = np.ascontiguousarray(state.reshape(-1, 2 * state.shape[-1]))
        out, wrench = np.empty_like(flat), np.empty((len(flat), 3))
        kernels.step_batch(
            self.law.numbers,
            flat,
            np.ascontiguousarray(twist.reshape(-1, 3)),
            self._cells(load),
            np.ascontiguousarray(load.reshape(-1)),
            np.ascontiguousarray(dt.reshape(-1)),
            out,
            wrench,
        )
        return out.reshape(state.shape), wrench.reshape(*batch, 3)

    def jacobians(self, state: Any, twist: Any, normal_force: Any) -> ModelJacobians:
        """Analytic derivatives of `rate` and `wrench` (see `ModelJacobians`); one-sided at kinks.

        Raises InvalidValueError as `step` does.
        """
        state, twist, load = self._inputs(state, twist, normal_force)
        law, identity = self.law.numbers, np.eye(2)[:, :, None]
        lin = linearised(self._of_all_cells(load), state.reshape(load.size, 2 * state.shape[-1]), twist.reshape(-1, 3))
        lin = lin.reshape(*load.shape, lin.shape[-1] // state.shape[-1], state.shape[-1])
        if self.patch.anisotropic:
            rate_state = -lin[..., :4, :].reshape(*load.shape, 2, 2, state.shape[-1])
            rate_velocity = lin[..., 4:8, :].reshape(*load.shape, 2, 2, state.shape[-1])
        else:
            k, k_z, k_v = lin[..., :1, None, :], lin[..., None, 1:3, :], lin[..., None, 3:5, :]
            rate_state = -k * identity - state[..., :, None, :] * k_z
            rate_velocity = identity - state[..., :, None, :] * k_v
        rate_twist = np.einsum("...abn,dbn->...and", rate_velocity, self._lever)
        share = load[..., None] * self.patch.weights(load)
        force_state = -(law.sigma_0 * identity + law.sigma_1 * rate_state) * share[..., None, None, :]
        force_velocity = -(law.sigma_2 * identity + law.sigma_1 * rate_velocity) * share[..., None, None, :]
        return ModelJacobians(
            rate_state,
            rate_twist,
            np.zeros_like(state),
            np.einsum("dan,...abn->...dbn", self._lever, force_state),
            np.einsum("dan,...abn,ebn->...de", self._lever, force_velocity, self._lever),
            self._rates(state, twist, load)[1],
        )

    def step_jacobians(self, state: Any, twist: Any, normal_force: Any, dt: Any) -> StepJacobians:
        """Analytic derivatives of `step` (see `StepJacobians`); one-sided at kinks.

        Raises InvalidValueError as `step` does.
        """
        state, twist, load, dt = self._inputs(state, twist, normal_force, dt=dt)
        if self.patch.anisotropic:
            return anisotropic.step_jacobians(self, state, self._cell_velocity(twist), load, dt)
        batch, cells = load.shape, state.shape[-1]
        results = kernels.CellJacobians(
            *(np.zeros((load.size, *inner)) for inner in ((2, 2, cells), (2, cells, 3), (3, 2, cells), (3, 3), (3,)))
        )
        kernels.jacobians(
            self.law.numbers,
            np.ascontiguousarray(state.reshape(-1, 2, cells)),
            np.ascontiguousarray(twist.reshape(-1, 3)),
            self._cells(load),
            np.ascontiguousarray(load.reshape(-1)),
            np.ascontiguousarray(dt.reshape(-1)),
            results,
        )
        return StepJacobians(*(a.reshape(*batch, *a.shape[1:]) for a in results))

    def _state_of(self, deflections: np.ndarray, load: float) -> np.ndarray:
        return deflections

    def packed(self, loads: Sequence[float | None], between: tuple[float, float] | None = None) -> PackedModel:
        """See `FrictionModel.packed`; only cells that carry load at one of the loads have bristles."""
        if between is None:
            weights = np.atleast_2d([self.patch.weights(load) for load in loads])
            return self._packed(weights, weights.max(axis=0) > 0.0)
        chosen = self.patch.pressure.ever_loaded(self.patch.positions, between)
        most = max(int(base.MAX_PACK_BYTES / (8.0 * chosen.sum())), 1)
        return self._packed(np.array([self.patch.weights(load)[chosen] for load in loads[:most]]), chosen)

    @property
    def step_function(self) -> Any:
        """See `FrictionModel.step_function`."""
        return step_slopes.anisotropic if self.patch.anisotropic else step_slopes.distributed

    def packed_steps(self, loads: Sequence[float | None]) -> PackedSteps:
        """See `FrictionModel.packed_steps`."""
        weights = np.array([self.patch.weights(load) for load in loads])
        packed = self._packed(weights, np.ones(weights.shape[1], bool))
        return PackedSteps(packed.records[:, None], np.ones((len(loads), 1)), packed.keepalive)

    def _packed(self, weights: np.ndarray, chosen: np.ndarray) -> PackedModel:
        """The chosen cells as the solver sees them, with each row of weights `[R, n]` of theirs or `[R, N]` of all."""
        if weights.shape[1] > chosen.sum():
            weights = weights[:, chosen]
        weights, positions = np.ascontiguousarray(weights), self.patch.positions[chosen]
        count, law = len(positions), self.law.numbers
        at = place_of(weights) + weights.strides[0] * np.arange(len(weights))
        if self.patch.anisotropic:
            cells = anisotropic.cell_numbers(self.patch, chosen)
            record = AnisotropicContact(law, count, place_of(cells), 0)
            functions, numbers, kept = anisotropic_contact.FUNCTIONS, anisotropic_contact.LINEAR_NUMBERS, (cells,)
        else:
            x, y = np.ascontiguousarray(positions[:, 0]), np.ascontiguousarray(positions[:, 1])
            record = DistributedContact(law, count, place_of(x), place_of(y), 0)
            functions, numbers, kept = distributed_contact.FUNCTIONS, distributed_contact.LINEAR, (x, y)
        return PackedModel(
            functions,
            rows_of(record, len(weights), weights=at),
            2 * count,
            numbers * count,
            np.full(2 * count, self.law.largest_deflection),
            float(np.hypot(*(positions - positions.mean(axis=0)).T).mean()),
            (weights, *kept),
            chosen,
        )

    # ------------------------------------------------------------------ cells

    def _cells(self, load: np.ndarray) -> kernels.Cells:
        """The cells with one row of weights, or one for each load."""
        weights = self.patch.weights(load.reshape(-1)) if self.patch.depends_on_load else self.patch.weights()
        return kernels.Cells(*self._xy, np.ascontiguousarray(np.atleast_2d(weights)))

    @functools.cached_property
    def _xy(self) -> tuple[np.ndarray, np.ndarray]:
        return np.ascontiguousarray(self.patch.positions[:, 0]), np.ascontiguousarray(self.patch.positions[:, 1])

    @functools.cached_property
    def _lever(self) -> np.ndarray:
        """`P` `[3, 2, N]`: cell velocity (of `u_i`) is `P' V`, wrench of a cell force `P f`."""
        if self.patch.anisotropic:
            return np.ascontiguousarray(self.patch.levers().T)
        x, y = self._xy
        one, zero = np.ones_like(x), np.zeros_like(x)
        return np.array([[one, zero], [zero, one], [-y, x]])

    @functools.cached_property
    def _asymmetry(self) -> np.ndarray | None:
        """`a_i` `[2, N]`, or None."""
        return np.ascontiguousarray(self.patch.asymmetries().T) if self.patch.asymmetric else None

    def _cell_velocity(self, twist: np.ndarray) -> np.ndarray:
        return np.einsum("...d,dcn->...cn", twist, self._lever)

    def _rates(self, state: np.ndarray, twist: np.ndarray, load: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Bristle rates, and wrenches per unit load."""
        cells = self._of_all_cells(load)
        rate, wrench = rates(cells, state.reshape(load.size, *self.state_shape), twist.reshape(-1, 3))
        return rate.reshape(state.shape), wrench.reshape(twist.shape)

    def _of_all_cells(self, load: np.ndarray) -> PackedModel:
        return self._packed(self._cells(load).weights, np.ones(len(self.patch.positions), bool))
