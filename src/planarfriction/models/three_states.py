"""What the reduced models share: three states, and a shape of the patch that may follow the load."""

from __future__ import annotations

import functools
import math
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from types import ModuleType
from typing import Any, ClassVar, Self

import numpy as np

from planarfriction.geometry import transformed
from planarfriction.kernels.pointers import place_of
from planarfriction.kernels.quick_steps import compile_quick_steps, step_many
from planarfriction.kernels.records import row_of
from planarfriction.kernels.rollouts import UNFIT, Place, compile_step_one, step_one
from planarfriction.laws import FrictionLaw
from planarfriction.models import base
from planarfriction.models.base import FrictionModel, ModelJacobians, PackedModel, PackedSteps, StepJacobians
from planarfriction.models.part_shapes import REMEMBERED, Part
from planarfriction.models.quick_steps import (
    Quick,
    jacobian_places,
    jacobians_of_many,
    jacobians_of_one,
    step_of_many,
)
from planarfriction.models.rates import linearised, rates
from planarfriction.models.remembered import Remembered
from planarfriction.models.shapes_by_load import ShapesByLoad

_ARRAY, _FLOAT, _EMPTY = np.ndarray, np.dtype(float), np.empty
_TRUTH = frozenset((bool, np.bool_))

_HERE_ALONE = ("_fixed", "_contacts", "_quick", "_fixed_records", "_recent")
"""What a copy makes again: addresses hold in this process, and memories are shared by threads, not by models."""


@dataclass(frozen=True, eq=False)
class ThreeStateModel(FrictionModel):
    """A model of three states for each part of a contact, whose equations are compiled loops.

    A member gives its compiled functions (`_kernels`) and its shapes: at one load (`shape_at`), and what compiled loops
    need of one (`_maps`, `_levers`, `_rate_slopes`); one with several parts their shapes and shares (`parts_at`). Parts
    see the same twist and know nothing of each other; the wrench is the sum of theirs, each times its share.
    """

    _kernels: ClassVar[ModuleType]
    """Steps and their derivatives, as in `kernels.reduced_step`."""
    _shared: ClassVar[tuple[str, ...]] = ("_recent",)
    """Memories of shapes."""
    jacobian_function: ClassVar[Any]
    """Its function `..._jacobian` of `kernels.step_slopes`."""

    @property
    def state_shape(self) -> tuple[int, ...]:
        """`(3,)`"""
        return (3,)

    def rate(self, state: Any, twist: Any, normal_force: Any) -> np.ndarray:
        """Rates of the state `zdot`, shape `[..., *s]`, in units of the state per second."""
        return _each(self._by_load(self._evaluate, (6,), *self._inputs(state, twist, normal_force))[..., :3])

    def wrench(self, state: Any, twist: Any, normal_force: Any) -> np.ndarray:
        """Friction wrench on the moving body, shape `[..., 3]` [N, N, N m]."""
        return self._out(_sum(self._by_load(self._evaluate, (6,), *self._inputs(state, twist, normal_force))[..., 3:]))

    def jacobians(self, state: Any, twist: Any, normal_force: Any) -> ModelJacobians:
        """Analytic derivatives of `rate` and `wrench` (see `ModelJacobians`); at kinks a one-sided derivative."""
        packed = self._by_load(self._jacobians, (13, 3), *self._inputs(state, twist, normal_force))
        square = [packed[..., i : i + 3, :] for i in (0, 3, 6, 9)]
        load, zero = packed[..., 12, :], np.zeros_like(packed[..., 12, :])
        slopes = ModelJacobians(
            _each(square[0], 2), _each(square[1], 2), _each(zero), _each(square[2]), _sum(square[3]), _sum(load)
        )
        return self._turned(slopes, "rate_twist")

    def step(self, state: Any, twist: Any, normal_force: Any, dt: Any) -> tuple[np.ndarray, np.ndarray]:
        """Advance by `dt` [s] at a held twist: the new state and the wrench at the end, stable at any `dt`.

        Plain LuGre is linear in z and its step exact. Elasto-plastic: the exponential step with the mean decay of start
        and predicted end, second order, kept within the largest deflection so that nothing overshoots.
        """
        kind, held = type(twist), None
        if kind is tuple or kind is list:
            held = twist
        elif kind is _ARRAY and twist.ndim == 1 and twist.dtype is _FLOAT:
            held = twist.tolist()
        if held is not None and type(state) is _ARRAY and (fixed := self._fixed):
            # one contact: no batch to broadcast, and the compiled step checks what it is given, but takes True for 1.0
            places, several, room, new, pull = fixed
            result = _EMPTY(room)
            try:
                vx, vy, omega = held
                if (
                    (state.size == 3 if several is None else state.shape == several)
                    and not (
                        bool is type(vx)
                        or bool is type(vy)
                        or bool is type(omega)
                        or type(normal_force) in _TRUTH
                        or bool is type(dt)
                    )
                    and step_one(
                        places, state if several is None else state.ravel(), vx, vy, omega, normal_force, dt, result
                    )
                ):
                    return result[new] if several is None else result[new].reshape(several), result[pull]
            except UNFIT:  # not plain numbers, or a batch: the checks below decide
                pass
        if (quick := self._quick) and (done := step_of_many(quick, state, twist, normal_force, dt)):
            return done
        packed = self._by_load(self._step, (6,), *self._inputs(state, twist, normal_force, dt=dt))
        return _each(packed[..., :3]), self._out(_sum(packed[..., 3:]))

    def step_jacobians(self, state: Any, twist: Any, normal_force: Any, dt: Any) -> StepJacobians:
        """Analytic derivatives of `step` (see `StepJacobians`); at kinks a one-sided derivative."""
        quick = self._quick
        if quick is not None:
            done = jacobians_of_one(quick, state, twist, normal_force, dt)
            if done is None:
                inputs = self._inputs(state, twist, normal_force, dt=dt)
                done = jacobians_of_many(quick.jacobian_places, quick.shape, *inputs)
            return done
        packed = self._by_load(self._step_jacobians, (6, 7), *self._inputs(state, twist, normal_force, dt=dt))
        new, wrench = packed[..., :3, :], packed[..., 3:, :]
        slopes = StepJacobians(
            _each(new[..., :3], 2),
            _each(new[..., 3:6], 2),
            _each(wrench[..., :3]),
            _sum(wrench[..., 3:6]),
            _sum(wrench[..., 6]),
        )
        return self._turned(slopes, "state_twist")

    def with_law(self, law: FrictionLaw) -> Self:
        """See `FrictionModel.with_law`."""
        changed = super().with_law(law)
        if changed.law.numbers.gamma == self.law.numbers.gamma:  # all that a shape takes from the law
            changed.__dict__.update({name: getattr(self, name) for name in self._shared})
        return changed

    def _state_of(self, deflections: np.ndarray, load: float) -> np.ndarray:
        pulls = -self.law.numbers.sigma_0 * load * self.patch.weights(load) * deflections
        wrenches = np.einsum("nij,in->nj", self.patch.levers(), pulls)
        per_state = self.jacobians(self.rest(), np.zeros(3), load).wrench_state.reshape(3, -1, 3)
        parts = range(per_state.shape[1])
        sums = [wrenches[self._labels == k].sum(axis=0) for k in parts]
        states = [np.linalg.lstsq(per_state[:, k], sums[k], rcond=1e-12)[0] for k in parts]
        return np.array(states).reshape(self.state_shape)

    @property
    def _labels(self) -> np.ndarray:
        """Which part each cell belongs to, `[N]`."""
        return np.zeros(self.patch.cells, int)

    # ------------------------------------------------------------------ axes of the twist

    @property
    def _axes(self) -> np.ndarray | None:
        """Symmetric `[3, 3]`, or None: twists go in through it, wrenches come out."""
        return None

    def _out(self, wrench: np.ndarray) -> np.ndarray:
        return wrench if self._axes is None else transformed(self._axes, wrench)

    def _turned(self, slopes: Any, by_twist: str) -> Any:
        """Derivatives by the twist and of the wrench through the axes."""
        axes = self._axes
        if axes is None:
            return slopes
        return slopes._replace(
            **{by_twist: getattr(slopes, by_twist) @ axes},
            wrench_state=axes @ slopes.wrench_state,
            wrench_twist=axes @ slopes.wrench_twist @ axes,
            wrench_load=transformed(axes, slopes.wrench_load),
        )

    # ------------------------------------------------------------------ shapes

    def shape_at(self, normal_force: float) -> Any:
        """What the model knows of its patch at a load [N]."""
        raise NotImplementedError

    def parts_at(self, normal_force: float | None) -> tuple[Part, ...]:
        """Share of the load and shape of each part at a load [N], which may be None where it makes no difference."""
        return (Part(1.0, self.shape_at(normal_force)),)  # pyright: ignore[reportArgumentType]

    def _at_loads(self, loads: np.ndarray, slopes: bool) -> ShapesByLoad:
        """The parts at different loads > 0 `[L]` [N], with their `slopes` by the load or zeros.

        For compiled roll-outs, of a model whose shape follows the load.
        """
        raise NotImplementedError

    @functools.cached_property
    def _recent(self) -> Remembered[Any]:
        """Shapes at the latest loads."""
        return Remembered(REMEMBERED)

    def packed(self, loads: Sequence[float | None], between: tuple[float, float] | None = None) -> PackedModel:
        """See `FrictionModel.packed`; the lever arm of a run is that at its highest load."""
        if not self.depends_on_load:
            return self._packed([self.parts_at(None)] * len(loads), loads)
        if between is None:
            return self._packed(list(self._parts_at(loads)), loads)
        return self._packed(self._first_parts(loads), between[1:])

    def packed_steps(self, loads: Sequence[float | None]) -> PackedSteps:
        """See `FrictionModel.packed_steps`."""
        parts = list(self._parts_at(loads)) if self.depends_on_load else [self.parts_at(None)] * len(loads)
        each = [self._records([part.shape for part in same], 0.0) for same in zip(*parts, strict=True)]
        shares = np.array([[part.share for part in loaded] for loaded in parts])
        records = np.stack([part.records for part in each], 1)
        return PackedSteps(records, shares, tuple(data for part in each for data in part.keepalive))

    @property
    def _pieces(self) -> int:
        return math.prod(self.state_shape) // 3

    def _packed(self, parts: Sequence[tuple[Part, ...]], widest: Sequence[float | None]) -> PackedModel:
        """The parts at some loads as the solver sees them; its lever arm is the largest at the loads `widest`."""
        return self._records([each[0].shape for each in parts], max(map(self._radius, widest)))

    def _radius(self, load: float | None) -> float:
        """Lever arm [m] that turns spins into speeds at a load."""
        return self.shape_at(load).contact_radius  # pyright: ignore[reportArgumentType]

    def _first_parts(self, loads: Sequence[float | None]) -> list[tuple[Part, ...]]:
        """Parts at the first of `loads`, as many as `MAX_PACK_BYTES` and `MAX_PACK_SECONDS` allow."""
        parts, counted, size, begin = [], set(), 0, time.perf_counter()
        for each in self._parts_at(loads):
            parts.append(each)
            arrays = [array for part in each for array in self._arrays(part.shape)]
            new = {id(data): data.nbytes for data in arrays if id(data) not in counted}
            if new:  # no other array takes the place of one, as `parts` holds it
                counted.update(new)
                size += sum(new.values())
                if size > base.MAX_PACK_BYTES and len(parts) > 1:
                    return parts[:-1]
                if time.perf_counter() - begin > base.MAX_PACK_SECONDS:
                    break
        return parts

    def _parts_at(self, loads: Sequence[float | None]) -> Iterator[tuple[Part, ...]]:
        """`parts_at` of loads, one after another."""
        return (self.parts_at(load) for load in loads)

    def _arrays(self, shape: Any) -> tuple[np.ndarray, ...]:
        """The large arrays of a shape."""
        return (self._maps(shape)[1],)

    def _records(self, shapes: Sequence[Any], radius: float) -> PackedModel:
        """Shapes of one part as the solver sees them; `radius` [m] is the lever arm."""
        raise NotImplementedError

    def _record(self, shape: Any) -> PackedModel:
        """One shape as the solver sees it; twists and wrenches as `_inputs` gives and `_out` takes them."""
        known = None if self.depends_on_load else self._fixed_records.get(id(shape))
        return self._records([shape], shape.contact_radius) if known is None else known

    @functools.cached_property
    def _fixed_records(self) -> dict[int, PackedModel]:
        """What is known of fixed shapes, which the model holds."""
        shapes = [part.shape for part in self.parts_at(None)]
        return {id(shape): self._records([shape], shape.contact_radius) for shape in shapes}

    def _maps(self, shape: Any) -> tuple[np.ndarray, np.ndarray]:
        """Of the limit surface or maps: three integers, and the numbers that hold them."""
        raise NotImplementedError

    def _levers(self, shape: Any) -> tuple[np.ndarray, np.ndarray]:
        """G and H [3, 3] of `wrench = -G' (sigma_0 z + sigma_1 zdot + sigma_2 H V)`."""
        raise NotImplementedError

    def _rate_slopes(self, shape: Any, lin: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """d rate / d state and d rate / d twist from the compiled linearisation [B, L]."""
        raise NotImplementedError

    # ------------------------------------------------------------------ compiled loops

    def _row(self, shape: Any) -> np.ndarray:
        return np.array([*self.law.numbers, *shape.numbers])

    @functools.cached_property
    def _fixed(self) -> tuple[np.ndarray, tuple[int, ...] | None, int, slice, slice] | None:
        """What a step of one contact needs (see `kernels.rollouts.step_one`), where the shape is fixed.

        That are the places of its parts, the shape of a state of several, how many numbers the compiled step writes,
        and where among them it leaves the new state and the wrench. A plain tuple is taken apart the fastest.
        """
        contacts = self._contacts
        if contacts is None:
            return None
        compile_step_one()
        n, places = 3 * len(contacts), np.concatenate([place for place, _, _ in contacts])
        return places, None if n == 3 else self.state_shape, n + 11, slice(n), slice(n, n + 3)

    @functools.cached_property
    def _contacts(self) -> list[tuple[np.ndarray, np.ndarray, np.ndarray]] | None:
        """`_contact` of each part, where the shape is fixed."""
        if self.patch.depends_on_load or self._axes is not None:
            return None
        return [self._contact(part) for part in self.parts_at(None)]

    @functools.cached_property
    def _quick(self) -> Quick | None:
        """What small batches and derivatives need, where the shape is fixed."""
        contacts, shape = self._contacts, self.state_shape
        if contacts is None:
            return None
        compile_quick_steps()
        steps = self.packed_steps([None])
        places = jacobian_places(self.jacobian_function, steps.records[0], steps.shares[0])
        return Quick(np.concatenate([place for place, _, _ in contacts]), places, math.prod(shape), shape, steps)

    def _contact(self, part: Part) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """A `kernels.rollouts.Place` as a row of words, and what it points to, which has to be kept.

        That is the row of a contact, with the integers of its surface or maps at the end, and the numbers of these.
        """
        surface, data = self._maps(part.shape)
        row, data = np.array([*self._row(part.shape), *surface]), np.ascontiguousarray(data)
        place = Place(self._kernels.step_address(), place_of(row), place_of(data), part.share)
        return row_of(place), row, data

    def __getstate__(self) -> dict[str, Any]:
        """What a copy or another process gets."""
        return {name: value for name, value in super().__getstate__().items() if name not in _HERE_ALONE}

    def _by_load(self, function, inner: tuple[int, ...], state, twist, load, *more) -> np.ndarray:
        """Apply `function(shape, state, twist, load, ...)` to flat batches, one for each part and each of its shapes.

        Returns `[P, ..., *inner]`. Rows of the wrench, those behind the first half, are times the share of the part.
        """
        parts = int(np.prod(self.state_shape)) // 3
        result = np.zeros((parts, *load.shape, *inner))
        out, wrench_rows = result.reshape(parts, load.size, *inner), slice(inner[0] // 6 * 3, None)
        flat = [np.ascontiguousarray(a.reshape(load.size, *a.shape[load.ndim :])) for a in (state, twist, load, *more)]
        each_state = flat[0].reshape(load.size, parts, 3)
        for value, found in self._loads_of(flat[2]):
            chosen = slice(None) if value is None else flat[2] == value
            others = [a[chosen] for a in flat[1:]]
            for k, (share, shape) in enumerate(found):
                rows = function(shape, np.ascontiguousarray(each_state[chosen, k]), *others)
                if parts > 1:
                    rows[:, wrench_rows] *= share
                out[k, chosen] = rows
        return result

    def _loads_of(self, loads: np.ndarray) -> Iterator[tuple[float | None, tuple[Part, ...]]]:
        """The different loads > 0 with the parts there, one after another; None for all where they are the same."""
        if not self.depends_on_load:
            return iter([(None, self.parts_at(None))])
        different = np.unique(loads[loads > 0.0])
        return zip(different, self._parts_at(different), strict=True)  # pyright: ignore[reportArgumentType]

    def _evaluate(self, shape: Any, state, twist, load) -> np.ndarray:
        rate, unit = rates(self._record(shape), state, twist)
        return np.concatenate([rate, load[:, None] * unit], axis=1)

    def _jacobians(self, shape: Any, state, twist, load) -> np.ndarray:
        law, (lever, viscous) = self.law.numbers, self._levers(shape)
        record = self._record(shape)
        rate_state, rate_twist = self._rate_slopes(shape, linearised(record, state, twist))
        weight = -load[:, None, None]
        pull = law.sigma_0 * np.eye(3) + law.sigma_1 * rate_state
        push = law.sigma_1 * rate_twist + law.sigma_2 * viscous
        unit = rates(record, state, twist)[1][:, None, :]
        return np.concatenate(
            [rate_state, rate_twist, weight * (lever.T @ pull), weight * (lever.T @ push), unit], axis=1
        )

    def _step(self, shape: Any, state, twist, load, dt) -> np.ndarray:
        compile_quick_steps()
        new, wrench = _EMPTY((len(load), 3)), _EMPTY((len(load), 3))
        contact = self._contact(Part(1.0, shape))  # kept, as the shape is, which holds the other map, until it is over
        step_many(contact[0], state, twist, load, dt, new, wrench, _EMPTY(14))
        return np.concatenate([new, wrench], axis=1)

    def _step_jacobians(self, shape: Any, state, twist, load, dt) -> np.ndarray:
        record, out = self._record(shape), np.empty((len(load), 6, 7))
        places = jacobian_places(self.jacobian_function, record.records, np.ones(1))
        slopes = jacobians_of_many(places, (3,), state, twist, load, dt)
        out[:, :3, :3], out[:, :3, 3:6], out[:, :3, 6] = slopes.state_state, slopes.state_twist, 0.0
        out[:, 3:, :3], out[:, 3:, 3:6], out[:, 3:, 6] = slopes.wrench_state, slopes.wrench_twist, slopes.wrench_load
        return out


def _each(values: np.ndarray, inner: int = 1) -> np.ndarray:
    """Values of each part `[P, ..., *inner]` with their parts in front of the inner axes; of one part without."""
    return values[0] if len(values) == 1 else np.ascontiguousarray(np.moveaxis(values, 0, -1 - inner))


def _sum(values: np.ndarray) -> np.ndarray:
    """Sum over the parts `[P, ...]`."""
    return values[0] if len(values) == 1 else values.sum(0)
