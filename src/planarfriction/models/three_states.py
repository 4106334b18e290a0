"""Models of three states for each part of a contact, with a shape of the patch that may depend on the load."""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import Any, ClassVar, Self

import numpy as np

from planarfriction.compiled.shapes_by_load import Part
from planarfriction.compiled.three_states import CompiledThreeStates, Kind, Shapes
from planarfriction.laws import FrictionLaw
from planarfriction.models.base import FrictionModel, ModelJacobians


@dataclass(frozen=True, eq=False)
class ThreeStateModel(FrictionModel):
    """A model of three states for each part of a contact.

    A member gives its `_kind` of compiled functions and its `shapes` at any load. A shape knows its levers G and H
    (`lever`, `viscous_lever`) of `W = -G' (sigma_0 z + sigma_1 zdot + sigma_2 H V)` and the slopes of its rate
    (`rate_slopes`). Parts see the same twist and know nothing of each other; the wrench is the sum of theirs, each
    times its share.
    """

    _kind: ClassVar[Kind]

    @functools.cached_property
    def shapes(self) -> Shapes:
        """Shapes of the parts at any load."""
        raise NotImplementedError

    @functools.cached_property
    def compiled(self) -> CompiledThreeStates:
        """Machine form of the model (see `FrictionModel.compiled`)."""
        return CompiledThreeStates(self._kind, self.law, self.shapes)

    @property
    def state_shape(self) -> tuple[int, ...]:
        """`(3,)`"""
        return (3,)

    def parts_at(self, normal_force: float | None) -> tuple[Part, ...]:
        """Return the share of the load and the shape of each part at a load [N].

        None stands for any load if the shapes do not depend on it. Raises InvalidValueError for a load that is not > 0.
        """
        return next(iter(self.shapes.at([normal_force])))

    def jacobians(self, state: Any, twist: Any, normal_force: Any) -> ModelJacobians:
        """Return the analytic derivatives of `rate` and `wrench` (see `ModelJacobians`); one-sided at kinks.

        With a part's rate f and `W = -G' (sigma_0 z + sigma_1 f + sigma_2 H V)`: `dW/dz = -G' (sigma_0 + sigma_1
        df/dz)`, `dW/dV = -G' (sigma_1 df/dV + sigma_2 H)`.
        """
        state, twist, load, _ = self._inputs(state, twist, normal_force)
        law, inner, count, parts = self.law.numbers, self.state_shape, load.size, self.compiled.parts
        z, v, f = state.reshape(count, 3 * parts), twist.reshape(count, 3), load.reshape(count)
        rate_state, rate_twist = np.zeros((count, parts, 3, 3)), np.zeros((count, parts, 3, 3))
        wrench_state, wrench_twist = np.zeros((count, 3, parts, 3)), np.zeros((count, 3, 3))
        for rows, loaded in self.compiled.parts_at_each_load(load):
            lin, weight = self.compiled.linearisation(loaded, z[rows], v[rows]), -f[rows][:, None, None]
            for k, (share, shape) in enumerate(loaded):
                lever, (by_z, by_v) = shape.lever, shape.rate_slopes(lin[:, k])
                rate_state[rows, k], rate_twist[rows, k] = by_z, by_v
                pull = law.sigma_0 * np.eye(3) + law.sigma_1 * by_z
                push = law.sigma_1 * by_v + law.sigma_2 * shape.viscous_lever
                wrench_state[rows, :, k] = share * weight * (lever.T @ pull)
                wrench_twist[rows] += share * weight * (lever.T @ push)
        return ModelJacobians(
            rate_state.reshape(*load.shape, *inner, 3),
            rate_twist.reshape(*load.shape, *inner, 3),
            np.zeros_like(state),
            wrench_state.reshape(*load.shape, 3, *inner),
            wrench_twist.reshape(*load.shape, 3, 3),
            self.compiled.evaluate(state, twist, load)[1],
        )

    def with_law(self, law: FrictionLaw) -> Self:
        """Return the model with another law; see `FrictionModel.with_law`."""
        changed = super().with_law(law)
        if changed.law.numbers.gamma == self.law.numbers.gamma:  # all that a shape takes from the law
            changed.__dict__["shapes"] = self.shapes
        return changed

    def _state_of(self, deflections: np.ndarray, load: float) -> np.ndarray:
        pulls = -self.law.numbers.sigma_0 * load * self.patch.weights(load) * deflections
        wrenches = np.einsum("nij,in->nj", self.patch.levers(), pulls)
        per_state = self.jacobians(self.rest(), np.zeros(3), load).wrench_state.reshape(3, -1, 3)
        sums = [wrenches[self._labels == k].sum(axis=0) for k in range(per_state.shape[1])]
        states = [np.linalg.lstsq(per_state[:, k], each, rcond=1e-12)[0] for k, each in enumerate(sums)]
        return np.array(states).reshape(self.state_shape)

    @property
    def _labels(self) -> np.ndarray:
        """Part to which each cell belongs, `[N]`."""
        return np.zeros(self.patch.cells, int)
