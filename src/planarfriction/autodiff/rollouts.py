"""Roll-outs with a fixed step, and their derivatives backwards and forwards."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any, NamedTuple

import numpy as np

from planarfriction import validation
from planarfriction.autodiff.parameters import Packed, has_one_shape, pack
from planarfriction.equality import by_parts
from planarfriction.errors import InvalidValueError
from planarfriction.families import MODELS
from planarfriction.kernels.rollouts import Bars, Inputs
from planarfriction.models import FrictionModel

_WORTH_A_THREAD = 20_000
"""Steps [-] below which starting a thread costs more than it saves."""


@by_parts
class Rollout(NamedTuple):
    """A model stepped through T twists and loads."""

    state: np.ndarray
    """State after the last step, `[..., *state_shape]`."""
    wrenches: np.ndarray
    """Wrench on the moving body at the end of each step, `[..., T, 3]` [N, N, N m]."""


@by_parts
class RolloutStates(NamedTuple):
    """A roll-out with its states on the way."""

    state: np.ndarray
    """As in `Rollout`."""
    wrenches: np.ndarray
    """As in `Rollout`."""
    states: np.ndarray
    """State before each step, `[..., T, *state_shape]`."""


@by_parts
class RolloutSensitivities(NamedTuple):
    """A roll-out with the derivatives of its wrenches by P parameters."""

    state: np.ndarray
    """As in `Rollout`."""
    wrenches: np.ndarray
    """As in `Rollout`."""
    d_wrenches: np.ndarray
    """`[..., T, 3, P]`"""


@by_parts
class RolloutGradient(NamedTuple):
    """Gradient of a number with respect to the inputs of a roll-out, each of the shape of that input."""

    state: np.ndarray
    twist: np.ndarray
    normal_force: np.ndarray
    parameters: np.ndarray


class _Inputs(NamedTuple):
    """Checked inputs; B contacts in all, one row where all contacts share an input."""

    parts: tuple[Packed, ...]
    rows: list[np.ndarray]
    """[B or 1, N] of each part."""
    state: np.ndarray
    """[P, B, 3]"""
    twist: np.ndarray
    """[B or 1, T, 3]"""
    normal_force: np.ndarray
    """[B or 1, T]"""
    dt: np.ndarray
    """[T]"""
    batch: tuple[int, ...]

    def shaped(self, values: np.ndarray, *inner: int) -> np.ndarray:
        """Values of each part and contact `[P, B, *inner, 3]` as `[*batch, *inner, P, 3]`; of one part without."""
        each = values[0] if len(values) == 1 else np.moveaxis(values, 0, -2)
        return each.reshape(*self.batch, *inner, *self.inner)

    @property
    def inner(self) -> tuple[int, ...]:
        """Shape of the state of one contact."""
        return _inner(self.parts)


def rollout(model: Any, state: Any, twist: Any, normal_force: Any, dt: Any, *, parameters: Any = None) -> Rollout:
    """Step a model from `state` (None: at rest) through `twist` `[..., T, 3]`, each held for `dt` [s].

    The steps are those of `model.step`. `normal_force` broadcasts with `[..., T]`: one number, one for each step, or
    one for each contact `[..., 1]`; `dt` is one number or `[T]`; leading axes broadcast. `parameters` `[..., P]` of a
    reduced model (see `parameter_names`) take the place of its own; the limit surface, or the map of a `ReducedModel`,
    stays as it is, in scaled coordinates. Reduced models of a fixed shape run compiled, batches on all processors; any
    other model steps in Python.

    Raises `InvalidValueError` for wrong shapes, for numbers out of range, and for `parameters` of a model that cannot
    take them.
    """
    if not isinstance(model, FrictionModel | Packed | tuple):
        raise InvalidValueError("model", f"be a friction model ({MODELS.classes()})", type(model).__name__)
    if parameters is None and isinstance(model, FrictionModel) and not has_one_shape(model):
        return _stepped(model, state, twist, normal_force, dt)
    inputs = _checked(model, state, twist, normal_force, dt, parameters)
    end, wrenches, _ = _roll(inputs, 0)
    return Rollout(inputs.shaped(end), wrenches)


def rollout_states(
    model: Any, state: Any, twist: Any, normal_force: Any, dt: Any, *, parameters: Any = None
) -> RolloutStates:
    """`rollout` of a reduced model with the state before each step, which saves `rollout_gradient` half of its way."""
    inputs = _checked(model, state, twist, normal_force, dt, parameters)
    end, wrenches, states = _roll(inputs, len(inputs.dt))
    return RolloutStates(inputs.shaped(end), wrenches, inputs.shaped(states, len(inputs.dt)))


def rollout_gradient(
    model: Any,
    state: Any,
    twist: Any,
    normal_force: Any,
    dt: Any,
    wrenches_bar: Any,
    state_bar: Any = None,
    *,
    parameters: Any = None,
    states: Any = None,
) -> RolloutGradient:
    """Gradient of `sum(wrenches_bar wrenches) + sum(state_bar state)` of a `rollout` with respect to its inputs.

    The discrete adjoint: exact for the steps taken, at a few times the cost of the roll-out whatever the number of
    inputs. `wrenches_bar` `[..., T, 3]` and `state_bar` `[..., *state_shape]` (None: zero) broadcast. An input that
    several contacts share gets the sum of theirs. `states`: those of `rollout_states`, if kept. At zero load the
    gradient with respect to that load is the one-sided one.

    Raises `InvalidValueError` as `rollout` does, and for a model that is not a reduced one of fixed shape.
    """
    inputs = _checked(model, state, twist, normal_force, dt, parameters)
    count, steps, inner = inputs.state.shape[1], len(inputs.dt), inputs.inner
    cotangents = _rows("wrenches_bar", wrenches_bar, (steps, 3), inputs.batch)
    if states is None:
        on_the_way = _roll(inputs, steps)[2]
    else:
        on_the_way = _by_part(_rows("states", states, (steps, *inner), inputs.batch), len(inputs.parts))
    z_bar = np.zeros_like(inputs.state)
    if state_bar is not None:
        z_bar[:] = _by_part(_rows("state_bar", state_bar, inner, inputs.batch), len(inputs.parts))
    columns, shapes = (
        inputs.parts[0].family.columns,
        ((count, steps, 3), (count, steps), (count, inputs.rows[0].shape[-1])),
    )

    def run(k: int, part: Packed, packed: Inputs, *own: np.ndarray) -> None:
        pulls, bars = part.share * cotangents, Bars(z_bar[k], *own)
        _share(packed, count, lambda *span: part.family.gradient(packed, on_the_way[k], pulls, span, bars))

    twist_bar, load_bar, rows_bar = _summed(inputs, shapes, run)
    given = parameters if parameters is not None else inputs.parts[0].rows[..., columns]
    start = np.empty(inner) if state is None else state
    return RolloutGradient(
        _sum_to(np.shape(start), inputs.shaped(z_bar)),
        _sum_to(np.shape(twist), twist_bar),
        _sum_to(np.shape(normal_force), load_bar),
        _sum_to(np.shape(given), rows_bar[..., columns]),
    )


def rollout_sensitivities(
    model: Any,
    state: Any,
    twist: Any,
    normal_force: Any,
    dt: Any,
    names: Sequence[str] | None = None,
    *,
    parameters: Any = None,
) -> RolloutSensitivities:
    """A `rollout` of a reduced model with the derivatives of its wrenches by the parameters `names`.

    Forward in time, for least squares, which wants each wrench's own derivatives; the initial state is held. `names`:
    of `parameter_names`, None for all.
    """
    inputs = _checked(model, state, twist, normal_force, dt, parameters)
    family, count, steps = inputs.parts[0].family, inputs.state.shape[1], len(inputs.dt)
    known = family.names
    chosen = [known.index(name) for name in (known if names is None else validation.choices("names", names, known))]
    columns = family.columns[np.array(chosen, dtype=int)]
    end, shapes = inputs.state.copy(), ((count, steps, 3), (count, steps, 3, len(columns)))

    def run(k: int, part: Packed, packed: Inputs, wrenches: np.ndarray, slopes: np.ndarray) -> None:
        _share(packed, count, lambda *span: part.family.sensitivities(packed, span, end[k], columns, wrenches, slopes))
        wrenches *= part.share
        slopes *= part.share

    wrenches, slopes = _summed(inputs, shapes, run)
    return RolloutSensitivities(inputs.shaped(end), wrenches, slopes)


def _roll(inputs: _Inputs, kept: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """States at the end `[P, B, 3]`, wrenches `[..., T, 3]`, and with `kept = T` the states before each step.

    These are `[P, B, T, 3]`; `kept = 0` for none.
    """
    end, count = inputs.state.copy(), inputs.state.shape[1]
    states = np.empty((len(end), count, kept, 3))

    def run(k: int, part: Packed, packed: Inputs, wrenches: np.ndarray) -> None:
        _share(packed, count, lambda *span: part.family.rollout(packed, span, end[k], wrenches, states[k]))
        wrenches *= part.share

    (wrenches,) = _summed(inputs, ((count, len(inputs.dt), 3),), run)
    return end, wrenches, states


def _summed(inputs: _Inputs, shapes: Sequence[tuple[int, ...]], run: Callable[..., None]) -> list[np.ndarray]:
    """Sums over the parts, which know nothing of each other, of what `run` writes into zeros of `shapes` `[B, ...]`.

    It is given the number of the part, the part, the `Inputs` of its compiled loops, and the arrays.
    """
    total = [np.zeros(shape) for shape in shapes]
    for k, (part, rows) in enumerate(zip(inputs.parts, inputs.rows, strict=True)):
        own = [np.zeros(shape) for shape in shapes] if k > 0 else total
        run(k, part, Inputs(rows, part.surface, part.data, inputs.twist, inputs.normal_force, inputs.dt), *own)
        if k > 0:
            for sums, values in zip(total, own, strict=True):
                sums += values
    return [values.reshape(*inputs.batch, *values.shape[1:]) for values in total]


def _stepped(model: Any, state: Any, twist: Any, normal_force: Any, dt: Any) -> Rollout:
    """The steps of any model; it checks their numbers itself."""
    state = model.rest() if state is None else validation.numbers("state", state)
    twist, load, dt = _sequences(twist, normal_force, dt)
    inner = model.state_shape
    try:
        batch = np.broadcast_shapes(state.shape[: -len(inner)], twist.shape[:-2], load.shape[:-1])
        state = np.broadcast_to(state, (*batch, *inner))
    except ValueError:
        shapes = ", ".join(str(list(a.shape)) for a in (state, twist, load))
        raise InvalidValueError("state, twist and normal_force", "broadcast", f"shapes {shapes}") from None
    wrenches = np.empty((*batch, len(dt), 3))
    for t, held in enumerate(dt):
        state, wrenches[..., t, :] = model.step(state, twist[..., t, :], load[..., t], held)
    return Rollout(np.array(state), wrenches)


# ---------------------------------------------------------------------- shapes and threads


def _sequences(twist: Any, normal_force: Any, dt: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Twists `[..., T, 3]`, loads `[..., T]` and steps `[T]`."""
    twist, load, dt = (
        validation.numbers(n, v) for n, v in (("twist", twist), ("normal_force", normal_force), ("dt", dt))
    )
    if twist.ndim < 2 or twist.shape[-1] != 3:
        raise InvalidValueError("twist", "have shape [..., T, 3]", f"shape {list(twist.shape)}")
    steps = twist.shape[-2]
    if load.ndim and load.shape[-1] not in (1, steps):
        raise InvalidValueError("normal_force", f"broadcast with [..., {steps}]", f"shape {list(load.shape)}")
    if dt.ndim and dt.shape != (steps,):
        raise InvalidValueError("dt", f"be one number or have shape [{steps}]", f"shape {list(dt.shape)}")
    return twist, np.broadcast_to(load, (*load.shape[:-1], steps)), np.broadcast_to(dt, steps)


def _checked(model: Any, state: Any, twist: Any, normal_force: Any, dt: Any, parameters: Any) -> _Inputs:
    parts = pack(model, parameters)
    inner = _inner(parts)
    state = np.zeros(inner) if state is None else validation.numbers("state", state)
    if state.shape[-len(inner) :] != inner:
        wanted = ", ".join(map(str, inner))
        raise InvalidValueError("state", f"have shape [..., {wanted}]", f"shape {list(state.shape)}")
    twist, load, dt = _sequences(twist, normal_force, dt)
    steps = len(dt)
    for name, value in {"state": state, "twist": twist, "normal_force": load, "dt": dt}.items():
        validation.within_range(name, value.min(initial=0.0), value.max(initial=0.0))
    for name, value in {"normal_force": load, "dt": dt}.items():
        if value.min(initial=0.0) < 0.0:
            raise InvalidValueError(name, "be >= 0", float(value.min()))
    axes = state.shape[: -len(inner)], twist.shape[:-2], load.shape[:-1], parts[0].rows.shape[:-1]
    try:
        batch = np.broadcast_shapes(*axes)
    except ValueError:
        raise InvalidValueError("batch axes", "broadcast", f"shapes {', '.join(str(list(a)) for a in axes)}") from None
    count = int(np.prod(batch))
    return _Inputs(
        parts,
        [_rows("parameters", part.rows, part.rows.shape[-1:], batch) for part in parts],
        _by_part(np.broadcast_to(state, (*batch, *inner)).reshape(count, *inner), len(parts)),
        _rows("twist", twist, (steps, 3), batch),
        _rows("normal_force", load, (steps,), batch),
        np.require(dt, float, ["C", "W", "A"]),
        batch,
    )


def _inner(parts: tuple[Packed, ...]) -> tuple[int, ...]:
    """Shape of the state of one contact."""
    return (3,) if len(parts) == 1 else (len(parts), 3)


def _by_part(values: np.ndarray, parts: int) -> np.ndarray:
    """States of contacts `[B, ..., P, 3]`, of one part `[B, ..., 3]`, as those of each part `[P, B, ..., 3]`."""
    return values[None] if parts == 1 else np.ascontiguousarray(np.moveaxis(values, -2, 0))


def _rows(name: str, value: Any, inner: tuple[int, ...], batch: tuple[int, ...]) -> np.ndarray:
    """`value` `[..., *inner]` as `[B, *inner]`, or as one row where the contacts share it."""
    value = validation.finite_numbers(name, value)
    if value.size != np.prod(inner) or value.shape[value.ndim - len(inner) :] != inner:
        try:
            value = np.broadcast_to(value, (*batch, *inner))
        except ValueError:
            wanted = ", ".join(str(n) for n in inner)
            raise InvalidValueError(name, f"have shape [..., {wanted}]", f"shape {list(value.shape)}") from None
    outer = value.shape[: value.ndim - len(inner)]
    return np.require(value.reshape(math.prod(outer), *inner), float, ["C", "W", "A"])


def _sum_to(shape: tuple[int, ...], gradient: np.ndarray) -> np.ndarray:
    """Sum a gradient over the axes along which its input was broadcast."""
    extra = tuple(range(gradient.ndim - len(shape)))
    gradient = gradient.sum(axis=extra) if extra else gradient
    kept = tuple(i for i, n in enumerate(shape) if n == 1 and gradient.shape[i] != 1)
    return gradient.sum(axis=kept, keepdims=True) if kept else gradient


def _share(inputs: Inputs, count: int, work: Callable[[int, int], None]) -> None:
    """Run `work(first, last)` over all contacts, on several threads where that pays."""
    available = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    threads = max(1, min(available, count, count * len(inputs.dt) // _WORTH_A_THREAD))
    if threads == 1:
        work(0, count)
        return
    bounds = [count * i // threads for i in range(threads + 1)]
    with ThreadPoolExecutor(threads) as pool:
        list(pool.map(work, bounds[:-1], bounds[1:]))
