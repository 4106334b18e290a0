"""Machine form of models of three states for each part of a contact, and the fast doors of their steps.

A fast door passes plain numbers and arrays of them directly to compiled code, where every check in Python would take
longer than the step. The compiled function checks what it is given and says no to the rest.
"""

from __future__ import annotations

import functools
import math
import time
from collections.abc import Iterator, Sequence
from typing import Any, Protocol

import numpy as np

from planarfriction.compiled import packed
from planarfriction.compiled.base import CompiledModel, StepJacobians
from planarfriction.compiled.packed import PackedModel, PackedSteps
from planarfriction.compiled.parts import ContactAtLoad, Kind, Part, packed_parts
from planarfriction.compiled.rates import linearised, rates
from planarfriction.compiled.shapes_by_load import ShapesByLoad, shapes_by_load
from planarfriction.geometry import transformed
from planarfriction.kernels.quick_steps import (
    NUMBERS,
    compile_quick_steps,
    jacobians_many,
    jacobians_one,
    step_many,
)
from planarfriction.kernels.rollouts import UNFIT, compile_step_one, step_one

_ARRAY, _FLOAT, _EMPTY, _MAKE = np.ndarray, np.dtype(float), np.empty, np.array
_TRUTH = frozenset((bool, np.bool_))
_PLAIN = frozenset((float, int, np.float64))
_REFUSED = (*UNFIT, OverflowError)
_NEW, _WRENCH = slice(3), slice(3, 6)


class Shapes(Protocol):
    """Shapes of the parts of a patch at any load; any number of threads may ask."""

    count: int
    """Number of parts."""
    depends_on_load: bool
    """True if the shapes change with the load."""

    def at(self, loads: Sequence[float | None]) -> Iterator[tuple[Part, ...]]:
        """Yield the parts at each load > 0 [N]; None stands for any load if the shapes do not depend on it."""
        ...

    def lever_arm(self, load: float | None) -> float:
        """Return the length [m] that turns spins into speeds at a load."""
        ...

    def arrays(self, shape: Any) -> tuple[np.ndarray, ...]:
        """Return the large arrays of a shape."""
        ...


class CompiledThreeStates(CompiledModel):
    """Machine form of a model of three states for each part of a contact.

    Parts see the same twist and know nothing of each other; the wrench is the sum of theirs, each times its share.
    """

    def __init__(self, kind: Kind, law: Any, shapes: Shapes) -> None:
        self._kind, self._law, self.shapes = kind, law, shapes
        self.step_function, self.parts = kind.step_function, shapes.count
        self.state_shape = (3,) if self.parts == 1 else (self.parts, 3)
        self._size, self._places = 3 * self.parts, None
        self._room, self._new, self._wrench = self._size + 11, slice(self._size), slice(self._size, self._size + 3)

    # ------------------------------------------------------------------ fast doors

    @functools.cached_property
    def fixed(self) -> ContactAtLoad:
        """The contact of a patch whose shape does not depend on the load."""
        return ContactAtLoad(self._kind, self._law, next(iter(self.shapes.at([None]))))

    @property
    def _direct(self) -> ContactAtLoad | None:
        """The contact, if it steps in its own frame at any load."""
        return None if self.shapes.depends_on_load or self.fixed.frame is not None else self.fixed

    def _opened(self) -> np.ndarray | None:
        """Return the places of the parts for `step_one`, and keep them; None if there is no such door."""
        if (contact := self._direct) is not None:
            compile_step_one()
            self._places = contact.places
        return self._places

    @functools.cached_property
    def _quick(self) -> ContactAtLoad | None:
        if (contact := self._direct) is not None:
            compile_quick_steps()
        return contact

    def step_one(self, state: Any, twist: Any, normal_force: Any, dt: Any) -> tuple[np.ndarray, np.ndarray] | None:
        """See `CompiledModel`; the compiled step checks its numbers, but takes True for 1.0."""
        kind, places = type(twist), self._places
        if kind is tuple or kind is list:
            held = twist
        elif kind is _ARRAY and twist.ndim == 1 and twist.dtype is _FLOAT:
            held = twist.tolist()
        else:
            return None
        if type(state) is not _ARRAY or (places is None and (places := self._opened()) is None):
            return None
        try:
            vx, vy, omega = held
            if (
                bool is type(vx)
                or bool is type(vy)
                or bool is type(omega)
                or type(normal_force) in _TRUTH
                or bool is type(dt)
            ):
                return None
            if self.parts == 1:
                result = _EMPTY(14)
                if state.size == 3 and step_one(places, state, vx, vy, omega, normal_force, dt, result):
                    return result[_NEW], result[_WRENCH]
            elif state.shape == (inner := self.state_shape):
                result = _EMPTY(self._room)
                if step_one(places, state.ravel(), vx, vy, omega, normal_force, dt, result):
                    return result[self._new].reshape(inner), result[self._wrench]
        except UNFIT:  # not plain numbers, or a batch
            pass
        return None

    def step_batch(self, state: Any, twist: Any, normal_force: Any, dt: Any) -> tuple[np.ndarray, np.ndarray] | None:
        """See `CompiledModel`; loads and steps are one number, or one for each contact."""
        if type(state) is not _ARRAY or type(twist) is not _ARRAY or (contact := self._quick) is None:
            return None
        if twist.ndim != 2 or state.shape != (count := len(twist), *self.state_shape):
            return None
        try:
            if type(normal_force) is not _ARRAY:
                if type(normal_force) not in _PLAIN:
                    return None
                normal_force = _MAKE((normal_force,), float)
            if type(dt) is not _ARRAY:
                if type(dt) not in _PLAIN:
                    return None
                dt = _MAKE((dt,), float)
            rows = state.reshape(count, self._size) if self.parts > 1 else state
            new, wrench = _EMPTY((count, self._size)), _EMPTY((count, 3))
            if not step_many(contact.places, rows, twist, normal_force, dt, new, wrench, _EMPTY(14)):
                return None
        except _REFUSED:
            return None
        return new.reshape(state.shape) if self.parts > 1 else new, wrench

    def jacobians_one(self, state: Any, twist: Any, normal_force: Any, dt: Any) -> StepJacobians | None:
        """See `CompiledModel`."""
        if type(twist) is _ARRAY and twist.ndim == 1:
            twist = twist.tolist()
        if type(state) is not _ARRAY or state.shape != self.state_shape:
            return None
        if type(twist) not in (tuple, list) or len(twist) != 3 or (contact := self._quick) is None:
            return None
        vx, vy, omega = twist
        if not _PLAIN.issuperset((type(vx), type(vy), type(omega), type(normal_force), type(dt))):
            return None
        n = self._size
        result = _EMPTY(9 * n + NUMBERS + 5)
        try:
            flat = state.ravel() if n > 3 else state
            if not jacobians_one(contact.jacobian_places, flat, vx, vy, omega, normal_force, dt, result):
                return None
        except _REFUSED:
            return None
        return _apart(result, (), self.state_shape)

    # ------------------------------------------------------------------ batches, load by load

    def at_each_load(self, load: np.ndarray) -> Iterator[tuple[Any, ContactAtLoad]]:
        """Yield the contact at each of the different loads > 0 of a batch, and the rows of the flat batch that have it.

        A contact whose shape does not depend on the load has all rows.
        """
        if not self.shapes.depends_on_load:
            yield slice(None), self.fixed
            return
        flat = load.reshape(-1)
        different = np.unique(flat[flat > 0.0])
        for value, parts in zip(different, self.shapes.at(different), strict=True):  # pyright: ignore
            yield flat == value, ContactAtLoad(self._kind, self._law, parts)

    def evaluate(self, state: np.ndarray, twist: np.ndarray, load: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """See `CompiledModel`; a contact whose shape depends on the load has zeros without load."""
        z, v = self._rows(state), twist.reshape(-1, 3)
        rate, unit = np.zeros(z.shape), np.zeros(v.shape)
        for rows, contact in self.at_each_load(load):
            rate[rows], unit[rows] = rates(contact.packed, z[rows], v[rows])
        return rate.reshape(state.shape), unit.reshape(twist.shape)

    def linearisation(self, contact: ContactAtLoad, state: np.ndarray, twist: np.ndarray) -> np.ndarray:
        """Return linearisations of the parts `[B, P, L]` at flat states and twists (see the kernels of the model)."""
        lin = linearised(contact.packed, state, twist)
        return lin.reshape(len(lin), self.parts, lin.shape[1] // self.parts)

    def step(
        self, state: np.ndarray, twist: np.ndarray, load: np.ndarray, dt: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """See `CompiledModel`."""
        compile_quick_steps()
        z, v, f, h = self._rows(state), twist.reshape(-1, 3), load.reshape(-1), dt.reshape(-1)
        new, wrench = np.zeros(z.shape), np.zeros(v.shape)
        for rows, contact in self.at_each_load(load):
            begin, moved = z[rows], v[rows]
            end, pull = np.empty_like(begin), np.empty_like(moved)
            if (frame := contact.frame) is not None:
                given, begin, moved = begin, _entering(frame, begin), transformed(frame.lever, moved)
            step_many(contact.places, begin, moved, f[rows], h[rows], end, pull, np.empty(14))
            if frame is not None:
                pull = transformed(frame.lever.T, pull)
                if not frame.spins:
                    end[:, 2] = given[:, 2]
            new[rows], wrench[rows] = end, pull
        return new.reshape(state.shape), wrench.reshape(twist.shape)

    def step_jacobians(self, state: np.ndarray, twist: np.ndarray, load: np.ndarray, dt: np.ndarray) -> StepJacobians:
        """See `CompiledModel`."""
        compile_quick_steps()
        z, count, inner = self._rows(state), load.size, self.state_shape
        given = np.concatenate([twist, load[..., None], dt[..., None]], axis=-1).reshape(count, 5)
        shapes = (*inner, 3), (*inner, 3), (3, *inner), (3, 3), (3,)
        found = StepJacobians(*(np.zeros((count, *shape)) for shape in shapes))
        for rows, contact in self.at_each_load(load):
            begin, held, frame = z[rows], given[rows], contact.frame
            if frame is not None:
                begin, held = _entering(frame, begin), held.copy()
                held[:, :3] = transformed(frame.lever, held[:, :3])
            result = np.empty((len(held), 9 * self._size + NUMBERS))
            jacobians_many(contact.jacobian_places, begin, held, result)
            slopes = _apart(result, (len(held),), inner)
            for whole, part in zip(found, slopes if frame is None else _leaving(frame, slopes), strict=True):
                whole[rows] = part
        return StepJacobians(*(part.reshape(*load.shape, *part.shape[1:]) for part in found))

    def _rows(self, state: np.ndarray) -> np.ndarray:
        """Return states as rows `[B, 3 P]`."""
        return state.reshape(state.size // self._size, self._size)

    # ------------------------------------------------------------------ for the loops of others

    def packed(self, loads: Sequence[float | None], between: tuple[float, float] | None = None) -> PackedModel:
        """See `CompiledModel`; the lever arm of a run is that at its highest load."""
        loaded = list(self.shapes.at(loads)) if between is None else self._first(loads)
        radius = max(map(self.shapes.lever_arm, loads if between is None else between[1:]))
        return packed_parts(self._kind, self._law, loaded, radius)

    def packed_steps(self, loads: Sequence[float | None]) -> PackedSteps:
        """See `CompiledModel`."""
        loaded = list(self.shapes.at(loads))
        each = [self._kind.records(self._law, [part.shape for part in same], 0.0) for same in zip(*loaded, strict=True)]
        shares = np.array([[part.share for part in parts] for parts in loaded])
        records = np.stack([part.records for part in each], 1)
        return PackedSteps(records, shares, tuple(data for part in each for data in part.keepalive))

    def at_loads(self, loads: np.ndarray, slopes: bool) -> ShapesByLoad:
        """Pack a contact of `ReducedModel` at different loads > 0 `[L]` [N], with its `slopes` by the load or zeros."""
        loaded, by_load = list(self.shapes.at(loads)), None  # pyright: ignore[reportArgumentType]
        if slopes:
            loaded, by_load = self.shapes.by_load(loads, loaded)  # pyright: ignore[reportAttributeAccessIssue]
        return shapes_by_load(loaded, by_load)

    def _first(self, loads: Sequence[float | None]) -> list[tuple[Part, ...]]:
        """Return parts at the first of `loads`, as many as `MAX_PACK_BYTES` and `MAX_PACK_SECONDS` allow."""
        found, counted, size, begin = [], set(), 0, time.perf_counter()
        for parts in self.shapes.at(loads):
            found.append(parts)
            arrays = [array for part in parts for array in self.shapes.arrays(part.shape)]
            new = {id(data): data.nbytes for data in arrays if id(data) not in counted}
            if new:  # no other array takes the place of one, as `found` holds it
                counted.update(new)
                size += sum(new.values())
                if size > packed.MAX_PACK_BYTES and len(found) > 1:
                    return found[:-1]
                if time.perf_counter() - begin > packed.MAX_PACK_SECONDS:
                    break
        return found


def _entering(frame: Any, state: np.ndarray) -> np.ndarray:
    """Return states `[B, 3]` as the step in a frame takes them."""
    return state if frame.spins else state * np.array([1.0, 1.0, 0.0])


def _leaving(frame: Any, slopes: StepJacobians) -> StepJacobians:
    """Return derivatives of steps in a frame as those of the contact's own states, twists and wrenches."""
    lever, of_state, by_state = frame.lever, slopes.state_state, slopes.wrench_state
    by_twist = slopes.state_twist
    if not frame.spins:
        keep = np.array([1.0, 1.0, 0.0])
        of_state, by_state, by_twist = of_state * np.outer(keep, keep), by_state * keep, by_twist * keep[:, None]
        of_state[:, 2, 2] = 1.0
    return StepJacobians(
        of_state,
        by_twist @ lever,
        lever.T @ by_state,
        lever.T @ slopes.wrench_twist @ lever,
        transformed(lever.T, slopes.wrench_load),
    )


def _apart(result: np.ndarray, batch: tuple[int, ...], inner: tuple[int, ...]) -> StepJacobians:
    """Return the derivatives that `kernels.quick_steps.jacobians` has written one behind the other."""
    n = math.prod(inner)
    last, square = 9 * n, (*batch, *inner, 3)
    return StepJacobians(
        result[..., : 3 * n].reshape(square),
        result[..., 3 * n : 6 * n].reshape(square),
        result[..., 6 * n : last].reshape(*batch, 3, *inner),
        result[..., last : last + 9].reshape(*batch, 3, 3),
        result[..., last + 9 : last + 12].reshape(*batch, 3),
    )
