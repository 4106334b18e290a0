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
    """State before each step, `[..., T, 3]`."""


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

    packed: Packed
    rows: np.ndarray
    """[B or 1, N]"""
    state: np.ndarray
    """[B, 3]"""
    twist: np.ndarray
    """[B or 1, T, 3]"""
    normal_force: np.ndarray
    """[B or 1, T]"""
    dt: np.ndarray
    """[T]"""
    batch: tuple[int, ...]


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
    if not isinstance(model, FrictionModel | Packed):
        raise InvalidValueError("model", f"be a friction model ({MODELS.classes()})", type(model).__name__)
    if parameters is None and isinstance(model, FrictionModel) and not has_one_shape(model):
        return _stepped(model, state, twist, normal_force, dt)
    inputs = _checked(model, state, twist, normal_force, dt, parameters)
    end, wrenches, _ = _roll(inputs, 0)
    return Rollout(end.reshape(*inputs.batch, 3), wrenches.reshape(*inputs.batch, *wrenches.shape[1:]))


def rollout_states(
    model: Any, state: Any, twist: Any, normal_force: Any, dt: Any, *, parameters: Any = None
) -> RolloutStates:
    """`rollout` of a reduced model with the state before each step, which saves `rollout_gradient` half of its way."""
    inputs = _checked(model, state, twist, normal_force, dt, parameters)
    end, wrenches, states = _roll(inputs, len(inputs.dt))
    batch = inputs.batch
    return RolloutStates(
        end.reshape(*batch, 3), wrenches.reshape(*batch, *wrenches.shape[1:]), states.reshape(*batch, *states.shape[1:])
    )


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
    inputs. `wrenches_bar` `[..., T, 3]` and `state_bar` `[..., 3]` (None: zero) broadcast. An input that several
    contacts share gets the sum of theirs. `states`: those of `rollout_states`, if kept. At zero load the gradient with
    respect to that load is the one-sided one.

    Raises `InvalidValueError` as `rollout` does, and for a model that is not a reduced one of fixed shape.
    """
    inputs = _checked(model, state, twist, normal_force, dt, parameters)
    count, steps = len(inputs.state), len(inputs.dt)
    cotangents = _rows("wrenches_bar", wrenches_bar, (steps, 3), inputs.batch)
    on_the_way = _roll(inputs, steps)[2] if states is None else _rows("states", states, (steps, 3), inputs.batch)
    z_bar = np.zeros((count, 3))
    if state_bar is not None:
        z_bar[:] = _rows("state_bar", state_bar, (3,), inputs.batch)
    twist_bar, load_bar = np.empty((count, steps, 3)), np.empty((count, steps))
    rows_bar = np.zeros((count, inputs.packed.rows.shape[-1]))
    family = inputs.packed.family
    bars = Bars(z_bar, twist_bar, load_bar, rows_bar)
    packed = _kernel_inputs(inputs)
    _share(inputs, lambda first, last: family.gradient(packed, on_the_way, cotangents, (first, last), bars))
    given = parameters if parameters is not None else inputs.packed.rows[..., family.columns]
    return RolloutGradient(
        *(
            _sum_to(np.shape(value), gradient.reshape(*inputs.batch, *gradient.shape[1:]))
            for value, gradient in (
                (np.empty(3) if state is None else state, z_bar),
                (twist, twist_bar),
                (normal_force, load_bar),
                (given, rows_bar[:, family.columns]),
            )
        )
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
    family = inputs.packed.family
    known = family.names
    chosen = [known.index(name) for name in (known if names is None else validation.choices("names", names, known))]
    columns = family.columns[np.array(chosen, dtype=int)]
    wrenches = np.empty((len(inputs.state), len(inputs.dt), 3))
    slopes = np.empty((*wrenches.shape, len(columns)))
    end = inputs.state.copy()
    packed = _kernel_inputs(inputs)
    _share(inputs, lambda first, last: family.sensitivities(packed, (first, last), end, columns, wrenches, slopes))
    shaped = (array.reshape(*inputs.batch, *array.shape[1:]) for array in (end, wrenches, slopes))
    return RolloutSensitivities(*shaped)


def _roll(inputs: _Inputs, kept: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """States at the end `[B, 3]`, wrenches `[B, T, 3]` and, with `kept = T` rather than 0, states before each step."""
    count, end = len(inputs.state), inputs.state.copy()
    wrenches, states = np.empty((count, len(inputs.dt), 3)), np.empty((count, kept, 3))
    packed, family = _kernel_inputs(inputs), inputs.packed.family
    _share(inputs, lambda first, last: family.rollout(packed, (first, last), end, wrenches, states))
    return end, wrenches, states


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


def _kernel_inputs(inputs: _Inputs) -> Inputs:
    """The inputs as compiled loops take them."""
    packed = inputs.packed
    return Inputs(inputs.rows, packed.surface, packed.data, inputs.twist, inputs.normal_force, inputs.dt)


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
    packed = pack(model, parameters)
    state = np.zeros(3) if state is None else validation.numbers("state", state)
    if state.shape[-1:] != (3,):
        raise InvalidValueError("state", "have shape [..., 3]", f"shape {list(state.shape)}")
    twist, load, dt = _sequences(twist, normal_force, dt)
    steps = len(dt)
    for name, value in {"state": state, "twist": twist, "normal_force": load, "dt": dt}.items():
        validation.within_range(name, value.min(initial=0.0), value.max(initial=0.0))
    for name, value in {"normal_force": load, "dt": dt}.items():
        if value.min(initial=0.0) < 0.0:
            raise InvalidValueError(name, "be >= 0", float(value.min()))
    axes = state.shape[:-1], twist.shape[:-2], load.shape[:-1], packed.rows.shape[:-1]
    try:
        batch = np.broadcast_shapes(*axes)
    except ValueError:
        raise InvalidValueError("batch axes", "broadcast", f"shapes {', '.join(str(list(a)) for a in axes)}") from None
    count = int(np.prod(batch))
    return _Inputs(
        packed,
        _rows("parameters", packed.rows, packed.rows.shape[-1:], batch),
        np.broadcast_to(state, (*batch, 3)).reshape(count, 3),
        _rows("twist", twist, (steps, 3), batch),
        _rows("normal_force", load, (steps,), batch),
        np.require(dt, float, ["C", "W", "A"]),
        batch,
    )


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


def _share(inputs: _Inputs, work: Callable[[int, int], None]) -> None:
    """Run `work(first, last)` over all contacts, on several threads where that pays."""
    count = len(inputs.state)
    available = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    threads = max(1, min(available, count, count * len(inputs.dt) // _WORTH_A_THREAD))
    if threads == 1:
        work(0, count)
        return
    bounds = [count * i // threads for i in range(threads + 1)]
    with ThreadPoolExecutor(threads) as pool:
        list(pool.map(work, bounds[:-1], bounds[1:]))
