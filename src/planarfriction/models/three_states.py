"""What the reduced models share: three states, and a shape of the patch that may follow the load."""

from __future__ import annotations

import functools
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from types import ModuleType
from typing import Any, ClassVar

import numpy as np

from planarfriction.formulas import LARGEST
from planarfriction.geometry import transformed
from planarfriction.kernels.pointers import place_of
from planarfriction.kernels.rollouts import UNFIT, compile_step_one, step_batch, step_one
from planarfriction.models import base
from planarfriction.models.base import FrictionModel, ModelJacobians, PackedModel, StepJacobians
from planarfriction.models.rates import linearised, rates
from planarfriction.models.remembered import Remembered

_REMEMBERED = 64
"""Loads whose shapes a model remembers that builds each."""

_ARRAY, _FLOAT, _EMPTY = np.ndarray, np.dtype(float), np.empty
_TRUTH = frozenset((bool, np.bool_))
_STATE, _WRENCH = slice(3), slice(3, 6)

_PLAIN = frozenset((float, int, np.float64))
"""What needs no conversion to a number."""

_HERE_ALONE = ("_fixed", "_fixed_record", "_recent", "_family")
"""What a copy makes anew: addresses hold in this process, and memories are shared by threads, not by models."""


@dataclass(frozen=True, eq=False)
class ThreeStateModel(FrictionModel):
    """A model of three states per contact whose equations are compiled loops.

    A member gives its compiled functions (`_kernels`) and its shapes: at one load (`shape_at`), the reference, and what
    compiled loops need of one (`_maps`, `_levers`, `_rate_slopes`).
    """

    _kernels: ClassVar[ModuleType]
    """Steps and their derivatives, as in `kernels.reduced_step`."""

    @property
    def state_shape(self) -> tuple[int, ...]:
        """`(3,)`"""
        return (3,)

    def rate(self, state, twist, normal_force) -> np.ndarray:
        """Rates of the state `zdot`, shape `[..., 3]`, in units of the state per second."""
        return self._by_load(self._evaluate, (6,), *self._inputs(state, twist, normal_force))[..., :3]

    def wrench(self, state, twist, normal_force) -> np.ndarray:
        """Friction wrench on the moving body, shape `[..., 3]` [N, N, N m]."""
        return self._out(self._by_load(self._evaluate, (6,), *self._inputs(state, twist, normal_force))[..., 3:])

    def jacobians(self, state, twist, normal_force) -> ModelJacobians:
        """Analytic derivatives of `rate` and `wrench` (see `ModelJacobians`); at kinks a one-sided derivative."""
        packed = self._by_load(self._jacobians, (13, 3), *self._inputs(state, twist, normal_force))
        square = [packed[..., i : i + 3, :] for i in (0, 3, 6, 9)]
        zero = np.zeros_like(packed[..., 12, :])
        slopes = ModelJacobians(square[0], square[1], zero, square[2], square[3], packed[..., 12, :])
        return self._turned(slopes, "rate_twist")

    def step(self, state, twist, normal_force, dt) -> tuple[np.ndarray, np.ndarray]:
        """Advance by `dt` [s] at a held twist: the new state and the wrench at the end, stable at any `dt`.

        Plain LuGre is linear in z and its step exact. Elasto-plastic: the exponential step with the mean decay of start
        and predicted end, second order, kept within the largest deflection so that nothing overshoots.
        """
        kind, held = type(twist), None
        if kind is tuple or kind is list:
            held = twist
        elif kind is _ARRAY and twist.ndim == 1 and twist.dtype is _FLOAT:
            held = twist.tolist()
        if held is not None and type(state) is _ARRAY and state.size == 3 and (fixed := self._fixed):
            # one contact: no batch to broadcast, and the compiled step checks what it is given, but takes True for 1.0
            result = _EMPTY(14)
            try:
                vx, vy, omega = held
                if not (
                    bool is type(vx)
                    or bool is type(vy)
                    or bool is type(omega)
                    or type(normal_force) in _TRUTH
                    or bool is type(dt)
                ) and step_one(fixed[0], state, vx, vy, omega, normal_force, dt, result):
                    return result[_STATE], result[_WRENCH]
            except UNFIT:  # not plain numbers, or a batch: the checks below decide
                pass
        packed = self._by_load(self._step, (6,), *self._inputs(state, twist, normal_force, dt=dt))
        return packed[..., :3], self._out(packed[..., 3:])

    def step_jacobians(self, state, twist, normal_force, dt) -> StepJacobians:
        """Analytic derivatives of `step` (see `StepJacobians`); at kinks a one-sided derivative."""
        packed = self._one_step_jacobians(state, twist, normal_force, dt)
        if packed is None:
            inputs = self._inputs(state, twist, normal_force, dt=dt)
            packed = self._by_load(self._step_jacobians, (6, 7), *inputs)
        new, wrench = packed[..., :3, :], packed[..., 3:, :]
        slopes = StepJacobians(new[..., :3], new[..., 3:6], wrench[..., :3], wrench[..., 3:6], wrench[..., 6])
        return self._turned(slopes, "state_twist")

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

    @property
    def _reference(self) -> Any:
        """The shape that does not follow the load."""
        raise NotImplementedError

    @property
    def _follows_load(self) -> bool:
        return self.patch.depends_on_load

    @functools.cached_property
    def _recent(self) -> Remembered[Any]:
        """Shapes at the latest loads."""
        return Remembered(_REMEMBERED)

    def packed(self, loads: Sequence[float | None], between: tuple[float, float] | None = None) -> PackedModel:
        """See `FrictionModel.packed`; the lever arm of a run is that at its highest load."""
        if not self._follows_load:
            return self._records([self._reference] * len(loads))
        radius = None if between is None else self.shape_at(between[1]).contact_radius
        return self._records(self._first_shapes(loads), radius)

    def _first_shapes(self, loads: Sequence[float | None]) -> list[Any]:
        """Shapes at the first of `loads`, as many as `ROOM` and `SPELL` allow."""
        shapes, counted, size, begin = [], set(), 0, time.perf_counter()
        for shape in self._shapes_at(loads):
            shapes.append(shape)
            new = {id(data): data.nbytes for data in self._arrays(shape) if id(data) not in counted}
            if new:  # no other array takes the place of one, as `shapes` holds it
                counted.update(new)
                size += sum(new.values())
                if size > base.ROOM and len(shapes) > 1:
                    return shapes[:-1]
                if time.perf_counter() - begin > base.SPELL:
                    break
        return shapes

    def _shapes_at(self, loads: Sequence[float | None]) -> Iterator[Any]:
        """Shapes at loads, one after another."""
        return (self.shape_at(load) for load in loads)  # pyright: ignore[reportArgumentType]

    def _arrays(self, shape: Any) -> tuple[np.ndarray, ...]:
        """The large arrays of a shape."""
        return (self._maps(shape)[1],)

    def _records(self, shapes: Sequence[Any], radius: float | None = None) -> PackedModel:
        """The shapes as the solver sees them; `radius` [m] is the lever arm, by default the largest of them."""
        raise NotImplementedError

    def _record(self, shape: Any) -> PackedModel:
        """One shape as the solver sees it; twists and wrenches as `_inputs` gives and `_out` takes them."""
        return self._records([shape]) if self._follows_load else self._fixed_record

    @functools.cached_property
    def _fixed_record(self) -> PackedModel:
        return self._records([self._reference])

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
    def _fixed(self) -> tuple[np.ndarray, np.ndarray, np.ndarray] | None:
        """`_contact`, where the shape is fixed."""
        if self.patch.depends_on_load or self._axes is not None:
            return None
        return self._contact(self._reference)

    def _contact(self, shape: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Addresses for `kernels.rollouts.step_one`, and what they point to, which has to be kept.

        That is the row of a contact, with the integers of its surface or maps at the end, and the numbers of these.
        """
        surface, data = self._maps(shape)
        row, data = np.array([*self._row(shape), *surface]), np.ascontiguousarray(data, dtype=float)
        compile_step_one()
        return np.array([self._kernels.step_address(), place_of(row), place_of(data)]), row, data

    def __getstate__(self) -> dict[str, Any]:
        """What a copy or another process gets."""
        return {name: value for name, value in super().__getstate__().items() if name not in _HERE_ALONE}

    def _by_load(self, function, inner: tuple[int, ...], state, twist, load, *more) -> np.ndarray:
        """Apply `function(shape, state, twist, load, ...)` to flat batches, one for each shape that the loads take."""
        result = np.zeros((*load.shape, *inner))
        flat = [np.ascontiguousarray(a.reshape(load.size, *a.shape[load.ndim :])) for a in (state, twist, load, *more)]
        out = result.reshape(load.size, *inner)
        if not self._follows_load:
            out[:] = function(self._reference, *flat)
            return out.reshape(result.shape)
        for value, shape in self._shapes_of(flat[2]):
            chosen = flat[2] == value
            out[chosen] = function(shape, *(a[chosen] for a in flat))
        return out.reshape(result.shape)

    def _shapes_of(self, loads: np.ndarray):
        """The different loads > 0 with their shapes, one after another."""
        return ((value, self.shape_at(value)) for value in np.unique(loads[loads > 0.0]))

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
        out = np.empty((len(load), 6))
        inputs = np.concatenate([state, twist, load[:, None], dt[:, None]], axis=1)
        contact = self._contact(shape)  # it and the shape, which holds the other map, are kept until the call is over
        step_batch(contact[0], inputs, out)
        return out

    def _one_step_jacobians(self, state, twist, normal_force, dt) -> np.ndarray | None:
        """`_step_jacobians` `[6, 7]` of one contact of fixed shape, checked quickly; None where that is not it."""
        if self._fixed is None:
            return None
        plain = []
        for vector in (state, twist):
            if type(vector) is _ARRAY and vector.ndim == 1 and vector.dtype is _FLOAT:
                vector = vector.tolist()
            if type(vector) not in (list, tuple) or len(vector) != 3:
                return None
            plain += vector
        plain += normal_force, dt
        if not _PLAIN.issuperset(map(type, plain)):  # the checks of `_inputs` say which
            return None
        try:
            given = np.array(plain, dtype=float)
        except OverflowError:  # an integer of hundreds of digits
            return None
        if not ((np.abs(given) <= LARGEST).all() and given[6] >= 0.0 and given[7] >= 0.0):
            return None
        return self._step_jacobians(self._reference, given[None, :3], given[None, 3:6], given[6:7], given[7:])[0]

    def _step_jacobians(self, shape: Any, state, twist, load, dt) -> np.ndarray:
        slopes = np.empty((len(load), 6, 7 + len(self._kernels.NAMES)))
        fixed = self._fixed
        if fixed is None:
            row, (surface, data) = self._row(shape), self._maps(shape)
        else:
            _, numbers, data = fixed
            row, surface = numbers[:-3], numbers[-3:].astype(int)
        self._kernels.jacobians(row, surface, data, (state, twist, load, dt), slopes)
        return slopes[:, :, :7]
