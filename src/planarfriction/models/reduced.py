"""The reduced model: the moments of the bristle field, three states."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from planarfriction import validation
from planarfriction.kernels import reduced_adjoint, reduced_contact
from planarfriction.kernels import reduced_step as kernels
from planarfriction.kernels.pointers import place_of
from planarfriction.kernels.records import rows_of
from planarfriction.kernels.reduced import LINEAR
from planarfriction.kernels.reduced_contact import ReducedContact, Shape
from planarfriction.laws.base import refuse_creep
from planarfriction.models.base import FrictionModel, ModelJacobians, PackedModel, StepJacobians
from planarfriction.models.load_family import LoadFamily
from planarfriction.models.reduced_map import ReducedShape, owner, reduced_shape

_REMEMBERED = 64
"""Loads whose shapes a model remembers that builds each."""


@dataclass(frozen=True, eq=False)
class ReducedModel(FrictionModel):
    """Reduced LuGre friction: the first moments of the bristle field of the patch, three states.

    With `V_G = F V`, `|V_G|` the root mean square of the cells' speeds, and the patch's own steady state `z_ss(V)`, the
    sum over its cells at their own speeds: `zdot = V_G - beta (lambda (z - s z_ss) + s V_G)`, `s = z.z_ss/|z_ss|^2`,
    `lambda = |V_G|^2/(V_G.z_ss)`, `W = -F' (sigma_0 z + sigma_1 zdot + sigma_2 V_G) f_N`; beta as for one bristle, from
    `|z|/|z_ss|` and the angle between z and z_ss. Exact: pre-sliding stiffness, viscous friction, steady sliding, and
    translation. State: `(z_x, z_y, z_theta)` [m]; the third is the moment over the radius of gyration of the pressure.

    `z_ss` comes from a stored map over direction and speed with continuous slopes. A patch that depends on the load has
    maps at a ladder of loads, blended in between; they are built where loads are asked for (see `LoadFamily`). The
    state is kept when the shape changes.

    Friction that depends on the direction: `|V_G|` is the root mean square of `|B_i V|` (see `ContactPatch.levers`),
    and `z_ss` sums `u/|u| + a`; an asymmetry takes maps of twice the size. It enters z_ss alone: bristles are measured
    from z = 0, and not from `a g/sigma_0` as those of the distributed model are.
    """

    segments: int = 24
    """Squares of the map along a quarter of a face of its cube; 24 leave errors of 1e-5 (median) of z_ss."""
    speeds: int = 14
    """Nodes of the map over the speed, for the Stribeck part."""
    load_error: float = 4e-3
    """Largest relative error of z_ss from blending maps over the load; 0 builds a map for each load, which is slow."""

    def __post_init__(self) -> None:
        super().__post_init__()
        refuse_creep(self.law, "ReducedModel")  # its stored steady state is that of bristles without creep
        object.__setattr__(self, "segments", validation.count("segments", self.segments, at_least=4))
        object.__setattr__(self, "speeds", validation.count("speeds", self.speeds, at_least=5))
        object.__setattr__(self, "load_error", validation.non_negative("load_error", self.load_error))
        if not self.patch.depends_on_load:
            _ = self._reference  # refuses a patch of one point now rather than later

    @property
    def state_shape(self) -> tuple[int, ...]:
        """`(3,)`"""
        return (3,)

    def shape_at(self, normal_force: float | None) -> ReducedShape:
        """Second moments of slip and stored steady state at a load [N]; recent loads are remembered."""
        return self.shapes_at([normal_force])[0]

    def shapes_at(self, loads) -> list[ReducedShape]:
        """`shape_at` of many loads [N], which costs less than one by one."""
        if not self.patch.depends_on_load:
            return [self._reference for _ in loads]
        if isinstance(loads, np.ndarray) and (loads > 0.0).all() and (loads < np.inf).all():
            loads = loads.tolist()  # one by one takes longer than all else
        else:
            loads = [validation.positive("normal_force", load) for load in loads]
        return self._family.shapes(loads) if self.load_error > 0.0 else [self._built_at(load) for load in loads]

    @property
    def load_rungs(self) -> list[float]:
        """Loads [N] at which maps have been built so far, of a patch that depends on the load."""
        return self._family.rungs

    def rate(self, state, twist, normal_force) -> np.ndarray:
        """Rates of the moments `zdot`, shape `[..., 3]` [m/s]."""
        return self._by_load(self._evaluate, (6,), *self._inputs(state, twist, normal_force))[..., :3]

    def wrench(self, state, twist, normal_force) -> np.ndarray:
        """Friction wrench on the moving body, shape `[..., 3]` [N, N, N m]."""
        return self._by_load(self._evaluate, (6,), *self._inputs(state, twist, normal_force))[..., 3:]

    def jacobians(self, state, twist, normal_force) -> ModelJacobians:
        """Analytic derivatives of `rate` and `wrench` (see `ModelJacobians`); at kinks a one-sided derivative."""
        packed = self._by_load(self._jacobians, (13, 3), *self._inputs(state, twist, normal_force))
        square = [packed[..., i : i + 3, :] for i in (0, 3, 6, 9)]
        zero = np.zeros_like(packed[..., 12, :])
        return ModelJacobians(square[0], square[1], zero, square[2], square[3], packed[..., 12, :])

    def step(self, state, twist, normal_force, dt) -> tuple[np.ndarray, np.ndarray]:
        """Advance by `dt` [s] at a held twist: the new state and the wrench at the end, stable at any `dt`.

        Plain LuGre is linear in z and its step exact. Elasto-plastic: the exponential step with the mean of beta at the
        start and at a predicted end, second order, kept within the largest deflection.
        """
        array = np.ndarray
        if (
            type(state) is array
            and state.shape == (3,)
            and type(normal_force) is not array
            and type(dt) is not array
            and (type(twist) is not array or twist.ndim == 1)
            and self._fixed is not None
        ):  # one contact: no batch to broadcast, and the compiled step checks the numbers
            numbers, data = self._fixed
            result = np.empty(6)
            try:
                vx, vy, omega = twist
                valid = kernels.step_one(
                    numbers, data, state, float(vx), float(vy), float(omega), float(normal_force), float(dt), result
                )
            except (TypeError, ValueError):  # not numbers, or a batch: the checks below decide
                valid = False
            if valid:
                return result[:3], result[3:]
        packed = self._by_load(self._step, (6,), *self._inputs(state, twist, normal_force, dt=dt))
        return packed[..., :3], packed[..., 3:]

    def step_jacobians(self, state, twist, normal_force, dt) -> StepJacobians:
        """Analytic derivatives of `step` (see `StepJacobians`); at kinks a one-sided derivative."""
        packed = self._by_load(self._step_jacobians, (13, 3), *self._inputs(state, twist, normal_force, dt=dt))
        square = [packed[..., i : i + 3, :] for i in (0, 3, 6, 9)]
        return StepJacobians(square[0], square[1], square[2], square[3], packed[..., 12, :])

    def packed(self, loads: Sequence[float | None]) -> PackedModel:
        """See `FrictionModel.packed`; a family's maps stay where they are, its shapes refer to them."""
        shapes = self.shapes_at(loads)
        maps = {id(data): data for shape in shapes for data in (shape.data, shape.other) if data is not None}
        at = {name: place_of(data) for name, data in maps.items()}
        data = np.array([at[id(shape.data)] for shape in shapes])
        other = np.array([at[id(shape.data if shape.other is None else shape.other)] for shape in shapes])
        factors = np.array([shape.factor for shape in shapes])[:, *np.triu_indices(3)]
        numbers = np.column_stack([factors, [shape.blend for shape in shapes]])
        record = ReducedContact(self.law.numbers, Shape(*numbers[0]), 0, 0)
        rows = rows_of(record, len(shapes), shape=numbers, data=data, other=(other - data) // 8)
        radius = max(shape.contact_radius for shape in shapes)
        natural = np.full(3, self.law.largest_deflection)
        kept = tuple(maps.values())
        return PackedModel(reduced_contact.FUNCTIONS, rows, 3, reduced_contact.LINEAR, natural, radius, kept)

    # ------------------------------------------------------------------ one shape

    @functools.cached_property
    def _reference(self) -> ReducedShape:
        return reduced_shape(self.patch, None, self.law.numbers.gamma, self.segments, self.speeds)

    @functools.cached_property
    def _family(self) -> LoadFamily:
        return LoadFamily(self.patch, self.law.numbers.gamma, self.segments, self.speeds, self.load_error)

    @functools.cached_property
    def _recent(self) -> dict[float, ReducedShape]:
        return {}

    def _built_at(self, load: float) -> ReducedShape:
        if load not in self._recent:
            while len(self._recent) >= _REMEMBERED:
                self._recent.pop(next(iter(self._recent)))
            self._recent[load] = reduced_shape(self.patch, load, self.law.numbers.gamma, self.segments, self.speeds)
        return self._recent[load]

    @functools.cached_property
    def _fixed(self) -> tuple[np.ndarray, np.ndarray] | None:
        """Numbers of law and shape for `step_one`, where the patch does not depend on the load."""
        if self.patch.depends_on_load:
            return None
        return np.array([*self.law.numbers, *self._reference.numbers]), self._reference.data

    def _by_load(self, function, inner: tuple[int, ...], state, twist, load, *more) -> np.ndarray:
        """Apply `function(shape, state, twist, load, ...)` to flat batches, one for each shape that the loads take."""
        result = np.zeros((*load.shape, *inner))
        flat = [np.ascontiguousarray(a.reshape(load.size, *a.shape[load.ndim :])) for a in (state, twist, load, *more)]
        out = result.reshape(load.size, *inner)
        if not self.patch.depends_on_load:
            out[:] = function(self._reference, *flat)
            return out.reshape(result.shape)
        values = np.unique(flat[2][flat[2] > 0.0])
        if self.load_error > 0.0:
            self.shapes_at(values)  # all at once
        for value in values:
            chosen = flat[2] == value
            out[chosen] = function(self.shape_at(value), *(a[chosen] for a in flat))
        return out.reshape(result.shape)

    def _evaluate(self, shape: ReducedShape, state, twist, load) -> np.ndarray:
        rate, wrench = np.empty_like(state), np.empty_like(state)
        kernels.evaluate_batch(np.array(self.law.numbers), shape.numbers, *_maps(shape), state, twist, rate, wrench)
        return np.concatenate([rate, load[:, None] * wrench], axis=1)

    def _jacobians(self, shape: ReducedShape, state, twist, load) -> np.ndarray:
        law, factor = self.law.numbers, shape.factor
        lin = np.empty((len(load), LINEAR))
        kernels.linearise_batch(np.array(law), shape.numbers, *_maps(shape), state, twist, lin)
        rate_state, rate_twist = lin[:, 1:10].reshape(-1, 3, 3), lin[:, 10:19].reshape(-1, 3, 3) @ factor
        weight = -load[:, None, None]
        pull = law.sigma_0 * np.eye(3) + law.sigma_1 * rate_state
        push = law.sigma_1 * rate_twist + law.sigma_2 * factor
        unit = self._evaluate(shape, state, twist, np.ones_like(load))[:, None, 3:]
        return np.concatenate(
            [rate_state, rate_twist, weight * (factor.T @ pull), weight * (factor.T @ push), unit], axis=1
        )

    def _step(self, shape: ReducedShape, state, twist, load, dt) -> np.ndarray:
        out, wrench = np.empty_like(state), np.empty_like(state)
        law = np.array(self.law.numbers)
        kernels.step_batch(law, shape.numbers, *_maps(shape), state, twist, load, dt, out, wrench)
        return np.concatenate([out, wrench], axis=1)

    def _step_jacobians(self, shape: ReducedShape, state, twist, load, dt) -> np.ndarray:
        slopes = np.empty((len(load), 6, 6))
        reduced_adjoint.jacobians(np.array(self.law.numbers), shape.numbers, *_maps(shape), state, twist, dt, slopes)
        factor, weight = shape.factor, load[:, None, None]
        loaded = np.where(weight > 0.0, 1.0, 0.0)
        new_state, new_twist = loaded * slopes[:, :3, :3], loaded * slopes[:, :3, 3:] @ factor
        pull, push = weight * (factor.T @ slopes[:, 3:, :3]), weight * (factor.T @ slopes[:, 3:, 3:] @ factor)
        unit = self._step(shape, state, twist, np.ones_like(load), dt)[:, None, 3:]
        return np.concatenate([new_state, new_twist, pull, push, unit], axis=1)


def _maps(shape: ReducedShape) -> tuple[np.ndarray, np.ndarray]:
    """Where the maps of a shape begin, and the numbers that hold them."""
    if shape.other is None:
        return np.array([0, 0, 0]), shape.data
    store, start = owner(shape.data)
    return np.array([start, owner(shape.other)[1], 0]), store
