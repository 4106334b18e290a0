"""Checked inputs of rollouts, contact by contact, as compiled loops read them; and threads."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from planarfriction._engine.cells.rollouts import Inputs, ShapesByLoad
from planarfriction._engine.compiler import threads
from planarfriction._engine.coupled.steps import PLAIN, in_order, ready
from planarfriction._engine.records.pressing import Pressing
from planarfriction._support import validation
from planarfriction.derivatives.parameters import PackedRollout, pack
from planarfriction.errors import InvalidValueError
from planarfriction.formulas import LARGEST
from planarfriction.models.base import BESIDE, FrictionModel
from planarfriction.models.cell_loads import in_time, sequence_of

_WORTH_A_THREAD = 20_000
"""Steps [-] below which starting a thread costs more than it saves."""

_FLOAT = np.dtype(float)

_NONE = np.empty(0)
"""Rows that are not checked together with others."""

LIGHTEST = 1e-9
"""Load [N] whose shape stands for the shape of a load that fades in, for the slope at no load."""


class RolloutInputs(NamedTuple):
    """Checked inputs; B contacts in all, one row where all contacts share an input."""

    model: PackedRollout
    rows: np.ndarray
    """Numbers of law and shape, `[B or 1, N]`."""
    state: np.ndarray
    """States before the first step, flat, `[B, S]`."""
    twist: np.ndarray
    """Twists `[B or 1, T, 3]`."""
    normal_force: np.ndarray
    """Loads `[B or 1, T]`."""
    dt: np.ndarray
    """Steps `[T]` [s]."""
    batch: tuple[int, ...]

    def shaped(self, values: np.ndarray, *inner: int) -> np.ndarray:
        """Return flat states `[B, *inner, S]` as `[*batch, *inner, *state_shape]`."""
        return values.reshape(*self.batch, *inner, *self.model.inner)

    def of_all(self, values: np.ndarray) -> np.ndarray:
        """Return values of each contact `[B, ...]` as `[*batch, ...]`."""
        return (
            values.reshape(*self.batch, *values.shape[1:]) if self.batch else values[0]
        )

    def compiled(self, slopes: bool = False) -> Inputs:
        """Return the inputs as compiled loops take them, with the `slopes` of the weights of cells by the load."""
        shape = self.model.shapes
        which = np.zeros((1, len(self.dt)), dtype=int)
        if own := self.model.batch:
            each = np.arange(math.prod(own)).reshape(own)
            which = np.broadcast_to(each, (*self.batch, len(self.dt)))
            which = np.array(which.reshape(len(self.state), -1))
        if not isinstance(shape, ShapesByLoad):
            loads, which = np.unique(self.normal_force, return_inverse=True)
            which = which.reshape(self.normal_force.shape)
            if (
                loads[:1] == 0.0
            ).any():  # any shape does for a step without load, but for its slope
                loads[0] = loads[1] if len(loads) > 1 and not slopes else LIGHTEST
            shape = shape(loads if len(loads) else np.array([LIGHTEST]), slopes)
        return Inputs(
            self.rows,
            shape,
            self.twist,
            self.normal_force,
            self.dt,
            which,
            self.model.springs,
        )


def given_loads(
    model: Any, twist: Any, normal_force: Any, loads: Any, cover: Any
) -> Pressing | None:
    """Return the pressure in each step of a rollout by the loads of cells (see `rollouts.rollout`), or None."""
    if loads is None and cover is None:
        return None
    if normal_force is not None:
        raise InvalidValueError("normal_force", BESIDE, normal_force)
    if loads is None:
        raise InvalidValueError("loads", "be given with a cover", "None")
    validation.instance("model", model, FrictionModel, "a friction model")
    steps = np.shape(twist)[-2:-1]
    cells = model._bearing(in_time(loads)[1])
    sizes = *steps, cells.count
    pairs = [
        None if each is None else sequence_of(name, each, sizes)
        for name, each in (("loads", loads), ("cover", cover))
    ]
    return cells.under(*pairs)


def step_at(
    model: Any, state: Any, twist: Any, load: Any, dt: Any, given: Pressing | None, t: int
) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    """Take step t of a rollout at loads `[..., T]` or a given pressure."""
    if given is None:
        now = load[..., t]
        # Plain numbers take the fast door of a step.
        return model.step(state, twist, now if now.ndim else float(now), float(dt))
    return model.step(state, twist, None, dt, loads=given.at(t))


def sequences(
    twist: Any, normal_force: Any, dt: Any, given: Pressing | None = None
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return twists `[..., T, 3]`, loads `[..., T]` and steps `[T]`."""
    normal_force = normal_force if given is None else given.load
    twist, load, dt = (
        validation.numbers(n, v)
        for n, v in (("twist", twist), ("normal_force", normal_force), ("dt", dt))
    )
    if twist.ndim < 2 or twist.shape[-1] != 3:
        raise InvalidValueError(
            "twist", "have shape [..., T, 3]", f"shape {list(twist.shape)}"
        )
    steps = twist.shape[-2]
    if load.ndim and load.shape[-1] not in (1, steps):
        raise InvalidValueError(
            "normal_force",
            f"broadcast with [..., {steps}]",
            f"shape {list(load.shape)}",
        )
    if dt.ndim and dt.shape != (steps,):
        raise InvalidValueError(
            "dt", f"be one number or have shape [{steps}]", f"shape {list(dt.shape)}"
        )
    return (
        twist,
        np.broadcast_to(load, (*load.shape[:-1], steps)),
        np.broadcast_to(dt, steps),
    )


def checked(
    model: Any,
    state: Any,
    twist: Any,
    normal_force: Any,
    dt: Any,
    parameters: Any,
    more: Sequence[tuple] = (),
    given: Pressing | None = None,
) -> RolloutInputs:
    """Check the inputs of a rollout; `more` are batch axes of other arrays that belong to it."""
    packed = pack(model, parameters)
    if given is not None:
        packed = packed.under(given)
        normal_force = given.load
    if packed.rows.ndim == 1 and not (packed.batch or more):
        quick = _of_one(packed, state, twist, normal_force, dt)
        if quick is not None:
            return quick
    inner = packed.inner
    state = np.zeros(inner) if state is None else validation.numbers("state", state)
    if state.shape[-len(inner) :] != inner:
        wanted = ", ".join(map(str, inner))
        raise InvalidValueError(
            "state", f"have shape [..., {wanted}]", f"shape {list(state.shape)}"
        )
    twist, load, dt = sequences(twist, normal_force, dt)
    steps = len(dt)
    for name, value in {
        "state": state,
        "twist": twist,
        "normal_force": load,
        "dt": dt,
    }.items():
        validation.within_range(name, value.min(initial=0.0), value.max(initial=0.0))
    for name, value in {"normal_force": load, "dt": dt}.items():
        if value.min(initial=0.0) < 0.0:
            raise InvalidValueError(name, "be >= 0", float(value.min()))
    axes = (
        state.shape[: -len(inner)],
        twist.shape[:-2],
        load.shape[:-1],
        packed.rows.shape[:-1],
        packed.batch[:-1],
        *more,
    )
    try:
        batch = np.broadcast_shapes(*axes)
    except ValueError:
        raise InvalidValueError(
            "batch axes", "broadcast", f"shapes {', '.join(str(list(a)) for a in axes)}"
        ) from None
    count = int(np.prod(batch))
    return RolloutInputs(
        packed,
        rows_of("parameters", packed.rows, packed.rows.shape[-1:], batch),
        np.ascontiguousarray(
            np.broadcast_to(state, (*batch, *inner)).reshape(count, math.prod(inner))
        ),
        packed.turned(rows_of("twist", twist, (steps, 3), batch)),
        rows_of("normal_force", load, (steps,), batch),
        np.require(dt, float, ["C", "W", "A"]),
        batch,
    )


def _of_one(
    packed: PackedRollout, state: Any, twist: Any, normal_force: Any, dt: Any
) -> RolloutInputs | None:
    """Return the inputs of one contact, which compiled code checks, or None for inputs not plain or not in order."""
    if type(twist) is not np.ndarray:
        return None
    steps = len(twist)
    state = np.zeros(packed.inner) if state is None else state
    load = _each(normal_force, steps)
    dt = _each(dt, steps)
    if not (
        _is_plain(twist, (steps, 3))
        and _is_plain(state, packed.inner)
        and _is_plain(load, (steps,))
        and _is_plain(dt, (steps,))
        and ready(in_order)(state.ravel(), twist.ravel(), load, dt)
    ):
        return None
    rows = packed.rows[None]
    state = state.reshape(1, -1)
    turned = packed.turned(twist[None])
    return RolloutInputs(packed, rows, state, turned, load[None], dt, ())


def _each(value: Any, steps: int) -> Any:
    """Return a plain number as one for each step, anything else as it is."""
    if type(value) not in PLAIN or (type(value) is int and abs(value) > LARGEST):
        return value
    filled = np.empty(steps)
    filled.fill(value)
    return filled


def _is_plain(value: Any, shape: tuple[int, ...]) -> bool:
    """Return True for an array of doubles that compiled loops take as it is."""
    return (
        type(value) is np.ndarray
        and value.shape == shape
        and value.dtype == _FLOAT
        and value.flags.carray
    )


def rows_of(
    name: str, value: Any, inner: tuple[int, ...], batch: tuple[int, ...]
) -> np.ndarray:
    """Return `value` `[..., *inner]` as `[B, *inner]`, or as one row where the contacts share it."""
    if _is_plain(value, inner) and ready(in_order)(value.ravel(), _NONE, _NONE, _NONE):
        return value[None]
    value = validation.finite_numbers(name, value)
    if value.size != np.prod(inner) or value.shape[value.ndim - len(inner) :] != inner:
        try:
            value = np.broadcast_to(value, (*batch, *inner))
        except ValueError:
            wanted = ", ".join(str(n) for n in inner)
            raise InvalidValueError(
                name, f"have shape [..., {wanted}]", f"shape {list(value.shape)}"
            ) from None
    outer = value.shape[: value.ndim - len(inner)]
    return np.require(value.reshape(math.prod(outer), *inner), float, ["C", "W", "A"])


def sum_to(shape: tuple[int, ...], gradient: np.ndarray) -> np.ndarray:
    """Sum a gradient over the axes along which its input was broadcast."""
    if gradient.shape == shape:
        return gradient
    extra = tuple(range(gradient.ndim - len(shape)))
    gradient = gradient.sum(axis=extra) if extra else gradient
    kept = tuple(i for i, n in enumerate(shape) if n == 1 and gradient.shape[i] != 1)
    return gradient.sum(axis=kept, keepdims=True) if kept else gradient


def share(inputs: Inputs, count: int, work: Callable[[int, int], None]) -> None:
    """Run `work(first, last)` over all contacts, on several threads where that pays."""
    threads.share(count, count * len(inputs.dt) // _WORTH_A_THREAD, work)
