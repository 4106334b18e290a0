"""Roll-outs with a fixed step, and their derivatives backwards and forwards."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any, NamedTuple

import numpy as np

from planarfriction import validation
from planarfriction.autodiff.parameters import Packed, pack
from planarfriction.errors import InvalidValueError

_WORTH_A_THREAD = 20_000
"""Steps [-] below which starting a thread costs more than it saves."""


class Rollout(NamedTuple):
    """A model stepped through T twists and loads."""

    wrenches: np.ndarray
    """Wrench on the moving body at the end of each step, `[..., T, 3]` [N, N, N m]."""
    state: np.ndarray
    """State after the last step, `[..., 3]`."""


class RolloutStates(NamedTuple):
    """A roll-out with its states on the way."""

    wrenches: np.ndarray
    """As in `Rollout`."""
    state: np.ndarray
    """As in `Rollout`."""
    states: np.ndarray
    """State before each step, `[..., T, 3]`."""


class RolloutGradient(NamedTuple):
    """Gradient of a number with respect to the inputs of a roll-out, each of the shape of that input."""

    state: np.ndarray
    twists: np.ndarray
    loads: np.ndarray
    parameters: np.ndarray


class _Inputs(NamedTuple):
    """Checked inputs; B contacts in all, one row where all contacts share an input."""

    packed: Packed
    rows: np.ndarray
    """[B or 1, N]"""
    state: np.ndarray
    """[B, 3]"""
    twists: np.ndarray
    """[B or 1, T, 3]"""
    loads: np.ndarray
    """[B or 1, T]"""
    dt: np.ndarray
    """[T]"""
    batch: tuple[int, ...]


def rollout(model: Any, state: Any, twists: Any, loads: Any, dt: Any, parameters: Any = None) -> Rollout:
    """Step a reduced model through `twists` `[..., T, 3]` and `loads` `[..., T]`, each held for `dt` [s].

    The steps are those of `model.step`. `state` `[..., 3]`; `loads` may be one number; `dt` is one number or `[T]`;
    leading axes broadcast. `parameters` `[..., P]` (see `parameter_names`) take the place of the model's own; the limit
    surface, or the map of a `ReducedModel`, stays as it is, in scaled coordinates. Batches run on all processors.

    Raises `InvalidValueError` for wrong shapes, for numbers out of range, and for a model whose shape follows the load.
    """
    inputs = _checked(model, state, twists, loads, dt, parameters)
    wrenches, end, _ = _roll(inputs, 0)
    return Rollout(wrenches.reshape(*inputs.batch, *wrenches.shape[1:]), end.reshape(*inputs.batch, 3))


def rollout_states(model: Any, state: Any, twists: Any, loads: Any, dt: Any, parameters: Any = None) -> RolloutStates:
    """`rollout` that keeps the state before each step: given to `rollout_gradient`, it saves walking there again."""
    inputs = _checked(model, state, twists, loads, dt, parameters)
    wrenches, end, states = _roll(inputs, len(inputs.dt))
    batch = inputs.batch
    return RolloutStates(
        wrenches.reshape(*batch, *wrenches.shape[1:]), end.reshape(*batch, 3), states.reshape(*batch, *states.shape[1:])
    )


def rollout_gradient(
    model: Any,
    state: Any,
    twists: Any,
    loads: Any,
    dt: Any,
    wrenches_bar: Any,
    state_bar: Any = None,
    parameters: Any = None,
    *,
    states: Any = None,
) -> RolloutGradient:
    """Gradient of `sum(wrenches_bar wrenches) + sum(state_bar state)` of a `rollout` with respect to its inputs.

    The discrete adjoint: exact for the steps taken, at a few times the cost of the roll-out whatever the number of
    inputs. `wrenches_bar` `[..., T, 3]` and `state_bar` `[..., 3]` (None: zero) broadcast. An input that several
    contacts share gets the sum of theirs. `states`: those of `rollout_states`, if kept. At zero load the gradient with
    respect to that load is the one-sided one.
    """
    inputs = _checked(model, state, twists, loads, dt, parameters)
    count, steps = len(inputs.state), len(inputs.dt)
    cotangents = _rows("wrenches_bar", wrenches_bar, (steps, 3), inputs.batch)
    on_the_way = _roll(inputs, steps)[2] if states is None else _rows("states", states, (steps, 3), inputs.batch)
    z_bar = np.zeros((count, 3))
    if state_bar is not None:
        z_bar[:] = _rows("state_bar", state_bar, (3,), inputs.batch)
    twists_bar, loads_bar = np.empty((count, steps, 3)), np.empty((count, steps))
    rows_bar = np.zeros((count, inputs.packed.rows.shape[-1]))
    family = inputs.packed.family
    arguments = inputs.rows, inputs.packed.surface, inputs.packed.data, on_the_way, inputs.twists, inputs.loads
    results = z_bar, twists_bar, loads_bar, rows_bar
    _share(inputs, lambda first, last: family.gradient(*arguments, inputs.dt, cotangents, first, last, *results))
    given = parameters if parameters is not None else inputs.packed.rows[..., family.columns]
    return RolloutGradient(
        *(
            _sum_to(np.shape(value), gradient.reshape(*inputs.batch, *gradient.shape[1:]))
            for value, gradient in (
                (state, z_bar),
                (twists, twists_bar),
                (loads, loads_bar),
                (given, rows_bar[:, family.columns]),
            )
        )
    )


def rollout_sensitivities(
    model: Any,
    state: Any,
    twists: Any,
    loads: Any,
    dt: Any,
    names: Sequence[str] | None = None,
    parameters: Any = None,
) -> tuple[np.ndarray, np.ndarray]:
    """Wrenches `[..., T, 3]` of a `rollout` and their derivatives `[..., T, 3, P]` to the parameters `names`.

    Forward in time, for least squares, which wants each wrench's own derivatives; the initial state is held. `names`:
    of `parameter_names`, None for all.
    """
    inputs = _checked(model, state, twists, loads, dt, parameters)
    family = inputs.packed.family
    known = family.names
    chosen = [known.index(validation.choice("names", name, known)) for name in (known if names is None else names)]
    columns = family.columns[np.array(chosen, dtype=int)]
    wrenches = np.empty((len(inputs.state), len(inputs.dt), 3))
    slopes = np.empty((*wrenches.shape, len(columns)))
    end = inputs.state.copy()
    arguments = inputs.rows, inputs.packed.surface, inputs.packed.data, end, inputs.twists, inputs.loads, inputs.dt
    _share(inputs, lambda first, last: family.sensitivities(*arguments, columns, first, last, wrenches, slopes))
    return wrenches.reshape(*inputs.batch, *wrenches.shape[1:]), slopes.reshape(*inputs.batch, *slopes.shape[1:])


def _roll(inputs: _Inputs, kept: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Wrenches `[B, T, 3]`, states at the end `[B, 3]` and, with `kept = T` rather than 0, before each step."""
    count, end = len(inputs.state), inputs.state.copy()
    wrenches, states = np.empty((count, len(inputs.dt), 3)), np.empty((count, kept, 3))
    arguments = inputs.rows, inputs.packed.surface, inputs.packed.data, end, inputs.twists, inputs.loads, inputs.dt
    _share(inputs, lambda first, last: inputs.packed.family.rollout(*arguments, first, last, wrenches, states))
    return wrenches, end, states


# ---------------------------------------------------------------------- shapes and threads


def _checked(model: Any, state: Any, twists: Any, loads: Any, dt: Any, parameters: Any) -> _Inputs:
    packed = pack(model, parameters)
    state, twists = validation.numbers("state", state), validation.numbers("twists", twists)
    loads, dt = validation.numbers("loads", loads), validation.numbers("dt", dt)
    if state.shape[-1:] != (3,):
        raise InvalidValueError("state", "have shape [..., 3]", f"shape {list(state.shape)}")
    if twists.ndim < 2 or twists.shape[-1] != 3:
        raise InvalidValueError("twists", "have shape [..., T, 3]", f"shape {list(twists.shape)}")
    steps = twists.shape[-2]
    if loads.ndim and loads.shape[-1] != steps:
        raise InvalidValueError("loads", f"be one number or have shape [..., {steps}]", f"shape {list(loads.shape)}")
    if dt.ndim and dt.shape != (steps,):
        raise InvalidValueError("dt", f"be one number or have shape [{steps}]", f"shape {list(dt.shape)}")
    for name, value in {"state": state, "twists": twists, "loads": loads, "dt": dt}.items():
        if not (np.isfinite(value.sum()) or np.isfinite(value).all()):  # a sum is quicker, but may overflow
            raise InvalidValueError(name, "be finite", "NaN or infinity")
    for name, value in {"loads": loads, "dt": dt}.items():
        if value.min(initial=0.0) < 0.0:
            raise InvalidValueError(name, "be >= 0", float(value.min()))
    if not loads.ndim:
        loads = np.full(steps, loads)
    axes = state.shape[:-1], twists.shape[:-2], loads.shape[:-1], packed.rows.shape[:-1]
    try:
        batch = np.broadcast_shapes(*axes)
    except ValueError:
        raise InvalidValueError("batch axes", "broadcast", f"shapes {', '.join(str(list(a)) for a in axes)}") from None
    count = int(np.prod(batch))
    return _Inputs(
        packed,
        _rows("parameters", packed.rows, packed.rows.shape[-1:], batch),
        np.broadcast_to(state, (*batch, 3)).reshape(count, 3),
        _rows("twists", twists, (steps, 3), batch),
        _rows("loads", loads, (steps,), batch),
        np.full(steps, dt) if dt.ndim == 0 else np.require(dt, float, ["C", "W"]),
        batch,
    )


def _rows(name: str, value: Any, inner: tuple[int, ...], batch: tuple[int, ...]) -> np.ndarray:
    """`value` `[..., *inner]` as `[B, *inner]`, or as one row where the contacts share it."""
    value = validation.numbers(name, value)
    if value.size != np.prod(inner) or value.shape[value.ndim - len(inner) :] != inner:
        try:
            value = np.broadcast_to(value, (*batch, *inner))
        except ValueError:
            wanted = ", ".join(str(n) for n in inner)
            raise InvalidValueError(name, f"have shape [..., {wanted}]", f"shape {list(value.shape)}") from None
    outer = value.shape[: value.ndim - len(inner)]
    return np.require(value.reshape(math.prod(outer), *inner), float, ["C", "W"])


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
