"""Machine form of a friction model: steps, rates, and records for the compiled loops of others.

The fast doors of a step pass plain numbers and arrays of numbers directly to compiled code, where every check in Python
would take longer than the step. The compiled function checks its arguments and refuses the rest.
"""

from __future__ import annotations

import functools
import itertools
import math
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from planarfriction._engine.cells.cell_steps import CellSteps
from planarfriction._engine.compiler.memory import StructBuffer
from planarfriction._engine.coupled.steps import (
    PLAIN,
    REFUSED,
    SCRATCH,
    UNFIT,
    Borne,
    jacobians,
    ready,
    step_borne,
    step_many,
    step_one,
)
from planarfriction._engine.protocol import StepFunctions
from planarfriction._engine.records.packed import PackedModel, driven, rates
from planarfriction._engine.records.pressing import Pressing
from planarfriction._support.equality import by_parts
from planarfriction.geometry import twist_at, wrench_at

_ARRAY = np.ndarray
_FLOAT = np.dtype(float)
_EMPTY = np.empty
_MAKE = np.array
_TRUTH = frozenset((bool, np.bool_))


@by_parts
class StepJacobians(NamedTuple):
    """Derivatives of the results of `step`: the new state, and the wrench at the end of the step.

    The shape of the patch is held fixed. Without load a step resets its bristles: all derivatives are zero except
    `wrench_load`, which is the wrench per unit load in the limit of a small load.
    """

    state_state: np.ndarray
    """d new state / d state: distributed `[..., 2, 2, N]` (cell by cell), of three states `[..., 3, 3]`."""
    state_twist: np.ndarray
    """d new state / d twist: distributed `[..., 2, N, 3]`, of three states `[..., 3, 3]`."""
    state_load: np.ndarray
    """d new state / d normal_force, `[..., *s]`: zero but for a fixed stiffness, as in `ModelJacobians`."""
    wrench_state: np.ndarray
    """d wrench / d state: distributed `[..., 3, 2, N]`, of three states `[..., 3, 3]`."""
    wrench_twist: np.ndarray
    """d wrench / d twist, `[..., 3, 3]`; an implicit simulator adds this, times `dt`, to its mass matrix."""
    wrench_load: np.ndarray
    """d wrench / d normal_force, `[..., 3]`."""


def _seen(twist: np.ndarray, offset: np.ndarray | None) -> np.ndarray:
    """Return the twists that patches see at an offset, in C order."""
    return twist if offset is None else np.ascontiguousarray(twist_at(twist, offset))


def _pull(wrench: np.ndarray, offset: np.ndarray | None) -> np.ndarray:
    """Return the wrenches of patches at an offset about the origin."""
    return wrench if offset is None else wrench_at(wrench, -offset)


class CompiledModel:
    """Machine form of a model: steps, rates, and records for the compiled loops of others.

    `evaluate`, `step` and `step_jacobians` take inputs that `FrictionModel` has checked: contiguous arrays of doubles
    with the same batch axes. `step_one`, `step_batch` and `jacobians_one` take inputs as they come and return None for
    inputs that are not plain and in order; then the checks of the model decide.
    """

    depends_on_load: bool
    """True if the load changes the shape of the patch."""
    components = 3
    """Components of a bristle."""
    of_pad = False
    """True if the bristles are pieces of a pad, which see the load."""
    compliance: np.ndarray | None = None
    """Common compliance of a pad about the origin `[3, 3]` (see `coupled.face`)."""
    lag = 0.0
    """Lag of a pad with a common compliance [s]."""

    @property
    def held(self) -> tuple[np.ndarray, np.ndarray]:
        """Stiffness of bristles that all stick, of a pad, or per unit load, and damping per unit load, `[3, 3]` each.

        Zeros if they are not known.
        """
        return np.zeros((3, 3)), np.zeros((3, 3))

    rollouts: Any = None
    """The model as the loops of rollouts see it, once `derivatives` has packed it."""
    moves = 0
    """Numbers of each disc, the first of which are its place and kappa times its radius; 0 of what cannot move."""
    behind = 0
    """Numbers behind a wrench that steps need as scratch."""

    def __init__(
        self,
        functions: StepFunctions | CellSteps,
        state_shape: tuple[int, ...],
        square_shape: tuple[int, ...],
    ) -> None:
        self.functions = functions
        self._prepare(state_shape, square_shape)

    def _prepare(
        self, state_shape: tuple[int, ...], square_shape: tuple[int, ...]
    ) -> None:
        """Set the places of the numbers of a step's results."""
        self.state_shape = state_shape
        self._size = math.prod(state_shape)
        self._square = math.prod(square_shape)
        self._flat = len(state_shape) == 1
        """Number of states, and numbers of d new state / d state, whose shape is `square_shape`."""
        n = self._size
        self._new = slice(n)
        self._wrench = slice(n, n + 3)
        self._result = n + 10
        self._table = None
        shapes = (
            square_shape,
            (*state_shape, 3),
            state_shape,
            (3, *state_shape),
            (3, 3),
            (3,),
        )
        ends = [0, *itertools.accumulate(map(math.prod, shapes))]
        self._derivatives = [
            (slice(*span), shape)
            for span, shape in zip(itertools.pairwise(ends), shapes, strict=True)
        ]
        """Places and shapes of `StepJacobians` in the numbers that `coupled.steps.jacobians` writes for a contact."""
        self._per_contact = ends[-1]
        self._scratch = 8 * n + self._square + 15

    @property
    def bristles(self) -> CompiledModel:
        """Machine form of the bristles alone, at the twist of the face of a pad."""
        return self

    # ------------------------------------------------------------------ at given loads

    @functools.cached_property
    def fixed(self) -> PackedModel | None:
        """The model at any load; None if that changes its shape."""
        return None if self.depends_on_load else self.with_all_states([None])

    def pressed(
        self, load: np.ndarray, pressure: Any = None
    ) -> Iterator[tuple[Any, PackedModel, np.ndarray | None]]:
        """Yield rows of the flat batch, the model at the load of each row or at the one load of all, and offsets.

        A pressure is a `Pressing` of cells, cells that are packed, or its centres `[..., 2]` [m]: patches whose
        pressure keeps its shape move by offsets `[rows, 2]` [m], None else. Rows without load may be left out; their
        results are zero.
        """
        raise NotImplementedError

    def points(self) -> tuple[np.ndarray, int]:
        """Return the cells that share the load, and the words of their record, or one point that has all.

        Cells `[n, 3]` have places x and y and a width [m].

        The last word is the address of the weights of cells; a point, which has none, moves as a whole. There is no
        point where it would change with the load: such a patch cannot follow moments in `coupling`.
        """
        raise NotImplementedError

    def step_table(self, contact: PackedModel) -> np.ndarray:
        """Return the words of `coupled.steps.Stepped` for steps; they hold as long as `contact` lives."""
        return contact.table(self.functions.step, self._square)

    def _jacobian_table(self, contact: PackedModel) -> np.ndarray:
        return contact.table(self.functions.jacobian, self._square)

    def _opened(self) -> np.ndarray | None:
        """Return the table of `step_one`, and keep it; None if there is no such door."""
        ready(step_one)
        self._table = None if self.fixed is None else self.step_table(self.fixed)
        return self._table

    @functools.cached_property
    def _many(self) -> np.ndarray | None:
        ready(step_many)
        return None if self.fixed is None else self.step_table(self.fixed)

    @functools.cached_property
    def _slopes(self) -> np.ndarray | None:
        ready(jacobians)
        return None if self.fixed is None else self._jacobian_table(self.fixed)

    # ------------------------------------------------------------------ fast doors

    def step_one(
        self, state: Any, twist: Any, normal_force: Any, dt: Any
    ) -> tuple[np.ndarray, np.ndarray] | None:
        """Step one contact, or return None; the compiled step checks its numbers, but takes True for 1.0."""
        kind = type(twist)
        if kind is tuple or kind is list:
            numbers = twist
        elif kind is _ARRAY and twist.ndim == 1 and twist.dtype is _FLOAT:
            numbers = twist.tolist()
        else:
            return None
        if type(state) is not _ARRAY or (
            (table := self._table) is None and (table := self._opened()) is None
        ):
            return None
        try:
            vx, vy, omega = numbers
            if (
                bool is type(vx)
                or bool is type(vy)
                or bool is type(omega)
                or type(normal_force) in _TRUTH
                or bool is type(dt)
            ):
                return None
            result = _EMPTY(self._result + self.behind)
            if self._flat:
                if step_one(table, state, vx, vy, omega, normal_force, dt, result):
                    return result[self._new], result[self._wrench]
            elif state.shape == self.state_shape and step_one(
                table, state.ravel(), vx, vy, omega, normal_force, dt, result
            ):
                return result[self._new].reshape(state.shape), result[self._wrench]
        except UNFIT:  # not plain numbers, or a batch
            pass
        return None

    def step_batch(
        self, state: Any, twist: Any, normal_force: Any, dt: Any
    ) -> tuple[np.ndarray, np.ndarray] | None:
        """Step contacts along one axis, or return None; loads and steps are one number, or one for each contact."""
        if (
            type(state) is not _ARRAY
            or type(twist) is not _ARRAY
            or (table := self._many) is None
        ):
            return None
        if twist.ndim != 2 or state.shape != (count := len(twist), *self.state_shape):
            return None
        try:
            if type(normal_force) is not _ARRAY:
                if type(normal_force) not in PLAIN:
                    return None
                normal_force = _MAKE((normal_force,), float)
            if type(dt) is not _ARRAY:
                if type(dt) not in PLAIN:
                    return None
                dt = _MAKE((dt,), float)
            rows = state if state.ndim == 2 else state.reshape(count, self._size)
            new = _EMPTY((count, self._size))
            wrench = _EMPTY((count, 3))
            scratch = _EMPTY(SCRATCH + self.behind)
            if not step_many(
                table, rows, twist, normal_force, dt, new, wrench, scratch
            ):
                return None
        except REFUSED:
            return None
        return new if state.ndim == 2 else new.reshape(state.shape), wrench

    def step_borne(
        self, cells: Any, state: Any, twist: Any, dt: Any, given: tuple[Any, ...]
    ) -> tuple[np.ndarray, np.ndarray] | None:
        """Step one contact or a batch whose `cells` bear `given` loads (see `cell_loads.seen`), or return None."""
        try:
            if type(twist) is not _ARRAY and PLAIN.issuperset(map(type, twist)):
                twist = _MAKE(twist, float)
            batch = twist.shape[:-1]
            alike = (cells.count,), (*batch, cells.count)
            if (
                type(dt) not in PLAIN
                or twist.shape[-1:] != (3,)
                or state.shape != (*batch, *self.state_shape)
            ):
                return None
            inputs = state.reshape(-1), twist.reshape(-1), float(dt)
            rows = []
            for row in given[:-1]:
                if row.shape not in alike:
                    return None
                rows.append(row.reshape(-1))
        except (*REFUSED, AttributeError):
            return None
        behind = state.size
        result = _EMPTY(behind + twist.size + SCRATCH + self.behind)
        room = cells.rooms.pop() if cells.rooms else self._room(cells)
        try:
            done = step_borne(room[0].words, *inputs, tuple(rows), given[-1], result)
        except REFUSED:
            return None
        finally:
            cells.rooms.append(room)
        if not done:
            return None
        wrench = result[behind : behind + twist.size]
        return result[:behind].reshape(state.shape), wrench.reshape(twist.shape)

    def _room(self, cells: Any) -> tuple[StructBuffer, PackedModel]:
        """Return memory for a step under given loads, and the contact that lies in it."""
        ready(step_borne)
        own = cells.bearing.record
        weights = np.full((1, own.bristles), 1.0 / own.bristles)
        given = Pressing(np.ones(1), weights, own.whole[None].copy())
        ((_, contact, _),) = self.pressed(given.load, given)
        (weights, numbers) = contact.keepalive[:2]
        kept = np.empty(own.bristles if own.stiffness.size else 0)
        words = self.step_table(contact)
        borne = Borne(words, own, weights, numbers, kept, np.empty(self._size))  # pyright: ignore[reportArgumentType]
        return StructBuffer(borne), contact

    def jacobians_one(
        self, state: Any, twist: Any, normal_force: Any, dt: Any
    ) -> StepJacobians | None:
        """Differentiate a step of one contact, or return None."""
        if type(twist) is _ARRAY and twist.ndim == 1:
            twist = twist.tolist()
        if type(state) is not _ARRAY or state.shape != self.state_shape:
            return None
        if (
            type(twist) not in (tuple, list)
            or len(twist) != 3
            or (table := self._slopes) is None
        ):
            return None
        inputs = *twist, normal_force, dt
        if not PLAIN.issuperset(map(type, inputs)):
            return None
        result = _EMPTY(self._per_contact + self._scratch)
        try:
            if not jacobians(
                table,
                state if state.ndim == 1 else state.ravel(),
                _MAKE(inputs, float),
                result,
            ):
                return None
        except REFUSED:
            return None
        return StepJacobians(
            *[result[place].reshape(shape) for place, shape in self._derivatives]
        )

    # ------------------------------------------------------------------ batches, load by load

    def evaluate(
        self,
        state: np.ndarray,
        twist: np.ndarray,
        load: np.ndarray,
        pressure: Any = None,
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the rates of the states, and wrenches per unit load `[..., 3]`; `pressure` as in `pressed`."""
        z = state.reshape(-1, self._size)
        v = twist.reshape(-1, 3)
        rate = np.zeros(z.shape)
        unit = np.zeros(v.shape)
        for rows, contact, offset in self.pressed(load, pressure):
            rate[rows], pull = rates(
                contact,
                z[rows],
                driven(contact, _seen(v[rows], offset), load.reshape(-1)[rows]),
            )
            unit[rows] = _pull(pull, offset)
        return rate.reshape(state.shape), unit.reshape(twist.shape)

    def step(
        self,
        state: np.ndarray,
        twist: np.ndarray,
        load: np.ndarray,
        dt: np.ndarray,
        pressure: Any = None,
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return new states and wrenches `[..., 3]`; `pressure` as in `pressed`."""
        if isinstance(pressure, Pressing):
            state = pressure.left(state, self.components)
        z = state.reshape(-1, self._size)
        v = twist.reshape(-1, 3)
        f = load.reshape(-1)
        h = dt.reshape(-1)
        new = np.zeros(z.shape)
        wrench = np.zeros(v.shape)
        for rows, contact, offset in self.pressed(load, pressure):
            end = np.empty_like(z[rows])
            pull = np.empty_like(v[rows])
            table = self.step_table(contact)
            seen = _seen(v[rows], offset)
            scratch = np.empty(SCRATCH + self.behind)
            ready(step_many)(table, z[rows], seen, f[rows], h[rows], end, pull, scratch)
            new[rows], wrench[rows] = end, _pull(pull, offset)
        return new.reshape(state.shape), wrench.reshape(twist.shape)

    def step_jacobians(
        self,
        state: np.ndarray,
        twist: np.ndarray,
        load: np.ndarray,
        dt: np.ndarray,
        pressure: Any = None,
    ) -> StepJacobians:
        """Differentiate steps, with the pressure held; `pressure` as in `pressed`."""
        inputs = np.concatenate(
            [twist, load[..., None], dt[..., None]], axis=-1
        ).reshape(load.size, 5)
        z = state.reshape(-1, self._size)
        results = np.zeros((load.size, self._per_contact))
        at = np.tile(np.eye(3), (load.size, 1, 1))
        for rows, contact, offset in self.pressed(load, pressure):
            numbers = inputs[rows]
            numbers[:, :3] = _seen(numbers[:, :3], offset)
            result = np.empty(len(numbers) * self._per_contact + self._scratch)
            ready(jacobians)(
                self._jacobian_table(contact), z[rows].ravel(), numbers.ravel(), result
            )
            results[rows] = result[: -self._scratch].reshape(
                len(numbers), self._per_contact
            )
            if offset is not None:
                at[rows, 0, 2] = -offset[:, 1]
                at[rows, 1, 2] = offset[:, 0]
        done = StepJacobians(
            *(
                results[:, place].reshape(*load.shape, *shape)
                for place, shape in self._derivatives
            )
        )
        if (at == np.eye(3)).all():
            return done
        # Of patches at an offset, by the twist and of the wrench about the origin.
        at = at.reshape(*load.shape, 3, 3)
        back = at.mT
        return done._replace(
            state_twist=done.state_twist @ at,
            wrench_state=back @ done.wrench_state,
            wrench_twist=back @ done.wrench_twist @ at,
            wrench_load=(back @ done.wrench_load[..., None])[..., 0],
        )

    # ------------------------------------------------------------------ for the loops of others

    def packed(
        self, loads: Sequence[float | None], between: tuple[float, float] | None = None
    ) -> PackedModel:
        """Pack the model for the solver (see `FrictionModel.packed`)."""
        raise NotImplementedError

    def with_all_states(self, loads: Sequence[float | None]) -> PackedModel:
        """Pack the model at `loads` > 0 [N], with all of its states; `[None]` stands for any load if it ignores it."""
        raise NotImplementedError
