"""Rollouts with a fixed step, and their reverse and forward derivatives."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Generic, NamedTuple, TypeVar

import numpy as np

from planarfriction._engine.cells.cell_blocks import divided
from planarfriction._engine.cells.rollouts import (
    Bars,
    Derivatives,
    Inputs,
    ShapesByLoad,
)
from planarfriction._engine.compiler import threads
from planarfriction._engine.records.pressing import Pressing
from planarfriction._support import validation
from planarfriction._support.equality import by_parts
from planarfriction.derivatives import faces
from planarfriction.derivatives.inputs import (
    RolloutInputs,
    checked,
    given_loads,
    rows_of,
    sequences,
    share,
    step_at,
    sum_to,
)
from planarfriction.derivatives.parameters import (
    PackedRollout,
    is_compiled,
    made_before,
    pack,
    parameter_names,
)
from planarfriction.errors import InvalidValueError
from planarfriction.families import MODELS
from planarfriction.models import FrictionModel
from planarfriction.models.cell_loads import in_time

ArrayT = TypeVar("ArrayT")


@by_parts
class Rollout(NamedTuple, Generic[ArrayT]):
    """Result of stepping a model through T twists and loads, as arrays of NumPy, PyTorch or JAX."""

    state: ArrayT
    """State after the last step, `[..., *state_shape]`."""
    wrenches: ArrayT
    """Wrench on the moving body at the end of each step, `[..., T, 3]` [N, N, N m]."""


@by_parts
class RolloutStates(NamedTuple):
    """A rollout together with its intermediate states."""

    state: np.ndarray
    """State after the last step, as in `Rollout`."""
    wrenches: np.ndarray
    """Wrenches, as in `Rollout`."""
    states: np.ndarray
    """State before each step, `[..., T, *state_shape]`."""


@by_parts
class RolloutJacobian(NamedTuple):
    """A rollout with the derivatives of its wrenches with respect to P parameters."""

    state: np.ndarray
    """State after the last step, as in `Rollout`."""
    wrenches: np.ndarray
    """Wrenches, as in `Rollout`."""
    d_wrenches: np.ndarray
    """Derivatives of the wrenches by the parameters `[..., T, 3, P]`."""


@by_parts
class RolloutTangent(NamedTuple):
    """Changes of the inputs of a rollout, each of the shape of its input; leading axes broadcast."""

    state: Any = 0.0
    """Change of the state before the first step."""
    twist: Any = 0.0
    """Changes of the twists `[..., T, 3]`."""
    normal_force: Any = 0.0
    """Changes of the loads `[..., T]` [N], or of those of cells `[..., T, N]` where `loads` are given."""
    parameters: Any = 0.0
    """Changes of the parameters `[..., P]`."""


@by_parts
class RolloutJVP(NamedTuple):
    """A rollout and its change for given changes of the inputs."""

    state: np.ndarray
    """State after the last step, as in `Rollout`."""
    wrenches: np.ndarray
    """Wrenches, as in `Rollout`."""
    state_dot: np.ndarray
    """Change of the state `[..., *state_shape]`."""
    wrenches_dot: np.ndarray
    """Changes of the wrenches `[..., T, 3]`."""


@by_parts
class RolloutVJP(NamedTuple):
    """Gradient of a scalar with respect to the inputs of a rollout, each of the shape of its input."""

    state: np.ndarray
    """Gradient with respect to the state before the first step, of its shape [1/unit of the state]."""
    twist: np.ndarray
    """Gradient with respect to the twists, `[..., T, 3]` [s/m, s/m, s/rad]."""
    normal_force: np.ndarray
    """Gradient with respect to the loads, of their shape [1/N]: of `loads` that are given, that of those of steps."""
    parameters: np.ndarray
    """Gradient with respect to the parameters, `[..., P]` [1/unit of each]."""


def rollout(
    model: Any,
    state: Any,
    twist: Any,
    normal_force: Any,
    dt: Any,
    *,
    parameters: Any = None,
    loads: Any = None,
    cover: Any = None,
) -> Rollout[np.ndarray]:
    """Step a model from `state` (None: at rest) through `twist` `[..., T, 3]`, each constant for `dt` [s].

    Each step is a `model.step`. `normal_force` broadcasts with `[..., T]`: one number, one for each step, or
    one for each contact `[..., 1]`; `dt` is one number or `[T]`; leading axes broadcast. `parameters` `[..., P]` (see
    `parameter_names`) replace the model's own; the limit surface stays as it is, in scaled coordinates.
    Models run in compiled code, batches on all processors; cells with a `RateLaw` step in Python, as do pads with a
    common compliance, with their derivatives, and `ReducedModelPublished` where its shape follows the load. Pads with a
    common compliance take no `parameters`.

    `loads` `[..., T, N]` [N] of the cells, as in `FrictionModel.step`, take the place of `normal_force`: each step sees
    which cells were pressed in the one before. The first sees no change unless `loads` is a tuple of the loads before
    it, `[..., N]`, and those of the steps; and so for `cover`.

    Raises `InvalidValueError` for wrong shapes, for numbers out of range, and for `parameters` if the model cannot take
    them.
    """
    if not isinstance(model, FrictionModel | PackedRollout):
        raise InvalidValueError(
            "model", f"be a friction model ({MODELS.classes()})", type(model).__name__
        )
    given = given_loads(model, twist, normal_force, loads, cover)
    if given is None:
        model = made_before(model)
    if faces.hangs(model, parameters) or (
        parameters is None
        and isinstance(model, FrictionModel)
        and not is_compiled(model)
    ):
        return _stepped(model, state, twist, normal_force, dt, given)
    inputs = checked(model, state, twist, normal_force, dt, parameters, given=given)
    end, wrenches, _ = _roll(inputs, 0)
    return Rollout(inputs.shaped(end), wrenches)


def rollout_states(
    model: Any,
    state: Any,
    twist: Any,
    normal_force: Any,
    dt: Any,
    *,
    parameters: Any = None,
    loads: Any = None,
    cover: Any = None,
) -> RolloutStates:
    """Step a model as `rollout` does and keep the state before each step, which saves `rollout_vjp` half of its work.

    Raises InvalidValueError as `rollout` does.
    """
    given = given_loads(model, twist, normal_force, loads, cover)
    if given is None:
        model = made_before(model)
    if faces.hangs(model, parameters):
        path = faces.path_of(model, state, twist, normal_force, dt, given)
        return RolloutStates(path.state, path.wrenches, path.states)
    inputs = checked(model, state, twist, normal_force, dt, parameters, given=given)
    end, wrenches, states = _roll(inputs, len(inputs.dt))
    return RolloutStates(
        inputs.shaped(end), wrenches, inputs.shaped(states, len(inputs.dt))
    )


def rollout_vjp(
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
    loads: Any = None,
    cover: Any = None,
) -> RolloutVJP:
    """Compute the gradient of `sum(wrenches_bar wrenches) + sum(state_bar state)` of a `rollout` by its inputs.

    This is the discrete adjoint: exact for the steps taken, and a few times as expensive as the rollout whatever the
    number of inputs. `wrenches_bar` `[..., T, 3]` and `state_bar` `[..., *state_shape]` (None: zero) broadcast. The
    gradient of an input that several contacts share is the sum over these contacts. `states` come from
    `rollout_states`, if available. At zero load the gradient with respect to that load is one-sided.

    If the weights of cells depend on the load, they are differentiated too, by central differences with a step of 1e-5
    of the load (relative error 1e-10).

    Raises `InvalidValueError` as `rollout` does, and for a model that has no compiled rollout.
    """
    given = given_loads(model, twist, normal_force, loads, cover)
    if given is None:
        model = made_before(model)
    if faces.hangs(model, parameters):
        path = faces.path_of(model, state, twist, normal_force, dt, given)
        *found, by_disc = faces.vjp(path, wrenches_bar, state_bar, gradient)
        start = model.rest() if state is None else state
        shapes = *map(np.shape, (start, twist, normal_force)), found[-1].shape[-1:]
        found = RolloutVJP(*map(sum_to, shapes, found))
        return found if given is None else _by_cell(found, model, loads, by_disc)
    found, by_disc = gradient(
        model, state, twist, normal_force, dt, wrenches_bar, state_bar,
        parameters=parameters, states=states, given=given, cells=given is not None,
    )  # fmt: skip
    return found if given is None else _by_cell(found, model, loads, by_disc)


def _by_cell(found: RolloutVJP, model: Any, loads: Any, by_disc: Any) -> RolloutVJP:
    """Return gradients with those of loads of cells, from those of discs `[..., T, n]`."""
    loads = in_time(loads)[1]
    by_loads = model._bearing(loads).spread(by_disc)
    return found._replace(normal_force=sum_to(np.shape(loads), by_loads))


def gradient(
    model: Any, state: Any, twist: Any, normal_force: Any, dt: Any, wrenches_bar: Any, state_bar: Any = None, *,
    parameters: Any = None, states: Any = None, given: Pressing | None = None, own: float = 1.0, cells: bool = True,
) -> tuple[RolloutVJP, np.ndarray]:  # fmt: skip
    """Return what `rollout_vjp` does at a `given` pressure, and the gradient by the loads of the model's `cells`.

    That is `[..., T, n]`, with a share of `own` of what a pad sees of them (see `Bars`).
    """
    inputs = checked(model, state, twist, normal_force, dt, parameters, given=given)
    (count, size) = inputs.state.shape
    steps = len(inputs.dt)
    packed = inputs.model
    inner = packed.inner
    family = packed.family
    turned = packed.turned
    cotangents = turned(rows_of("wrenches_bar", wrenches_bar, (steps, 3), inputs.batch))
    on_the_way = _on_the_way(inputs, states)
    z_bar = np.zeros((count, size))
    if state_bar is not None:
        z_bar[:] = rows_of("state_bar", state_bar, inner, inputs.batch).reshape(
            -1, size
        )
    rows_bar = np.zeros((count, inputs.rows.shape[-1]))
    along = np.zeros((count, steps, 3)), np.zeros((count, steps))
    by_disc = np.zeros((count, steps if cells else 0, inner[-1]))
    bars = Bars(z_bar, *along, rows_bar, by_disc, own)
    compiled = inputs.compiled(True)
    share(
        compiled,
        count,
        lambda *span: family.gradient(compiled, on_the_way, cotangents, span, bars),
    )
    own_vector = *packed.rows.shape[:-1], len(family.columns)
    vector = own_vector if parameters is None else np.shape(parameters)
    start = inner if state is None else np.shape(state)
    found = RolloutVJP(
        sum_to(start, inputs.shaped(z_bar)),
        sum_to(np.shape(twist), inputs.of_all(turned(bars.twist))),
        sum_to(np.shape(normal_force), inputs.of_all(bars.load)),
        sum_to(vector, inputs.of_all(rows_bar[:, family.columns])),
    )
    return found, inputs.of_all(by_disc)


def rollout_jacobian(
    model: Any,
    state: Any,
    twist: Any,
    normal_force: Any,
    dt: Any,
    names: Sequence[str] | None = None,
    *,
    parameters: Any = None,
    loads: Any = None,
    cover: Any = None,
) -> RolloutJacobian:
    """Step a model as `rollout` does, with derivatives of the wrenches by the parameters `names`.

    Computed forward in time, for least squares, which needs the derivatives of each wrench; the initial state is held
    fixed. `names` are some of `parameter_names`, or None for all.

    Raises InvalidValueError for inputs of wrong shapes, for negative values where they are not possible, and for names
    that are not parameters of the law.
    """
    given = given_loads(model, twist, normal_force, loads, cover)
    if faces.hangs(model, parameters):
        known = parameter_names(model)
        some = known if names is None else validation.choices("names", names, known)
        units = np.eye(len(known))[[known.index(name) for name in some]]
        path = faces.path_of(model, state, twist, normal_force, dt, given)
        shape = len(units), *[1] * (path.load.ndim - 1), len(known)
        tangent = RolloutTangent(parameters=units.reshape(shape))
        more = {"loads": loads, "cover": cover}
        found = rollout_jvp(model, state, twist, normal_force, dt, tangent, **more)
        slopes = np.moveaxis(found.wrenches_dot, 0, -1)
        return RolloutJacobian(path.state, path.wrenches, slopes)
    inputs = checked(model, state, twist, normal_force, dt, parameters, given=given)
    family = inputs.model.family
    turned = inputs.model.turned
    count = len(inputs.state)
    steps = len(inputs.dt)
    known = family.names
    chosen = [
        known.index(name)
        for name in (
            known if names is None else validation.choices("names", names, known)
        )
    ]
    columns = family.columns[np.array(chosen, dtype=int)]
    end = inputs.state.copy()
    compiled = inputs.compiled()
    wrenches = np.zeros((count, steps, 3))
    slopes = np.zeros((count, steps, 3, len(columns)))
    _differentiate(inputs.model, compiled, end, Derivatives(columns, wrenches, slopes))
    slopes = np.swapaxes(turned(np.swapaxes(inputs.of_all(slopes), -1, -2)), -1, -2)
    return RolloutJacobian(inputs.shaped(end), turned(inputs.of_all(wrenches)), slopes)


def rollout_jvp(
    model: Any,
    state: Any,
    twist: Any,
    normal_force: Any,
    dt: Any,
    tangent: RolloutTangent | None = None,
    *,
    parameters: Any = None,
    loads: Any = None,
    cover: Any = None,
) -> RolloutJVP:
    """Step a model as `rollout` does, with the change of the result for changes of the inputs (`tangent`).

    Computed forward in time, at several times the cost of `rollout_vjp`: it gives `J x` where that gives `J' x`.

    Raises `InvalidValueError` as `rollout_vjp` does.
    """
    tangent = RolloutTangent() if tangent is None else tangent
    validation.instance("tangent", tangent, RolloutTangent, "a RolloutTangent")
    given = given_loads(model, twist, normal_force, loads, cover)
    heavier = None
    if given is not None:
        name = "tangent.normal_force"
        changes = validation.finite_numbers(name, tangent.normal_force)
        shape = *changes.shape[:-2], *np.shape(in_time(loads)[1])[-2:]
        changes = validation.filled(name, changes, shape)
        heavier = model._bearing(changes).members.sums(changes)
        tangent = tangent._replace(normal_force=0.0)
    if faces.hangs(model, parameters):
        more = [
            np.shape(each)[: max(np.ndim(each) - count, 0)]  # pyright: ignore
            for each, count in zip((*tangent, heavier), (1, 2, 1, 1, 2), strict=True)
        ]
        path = faces.path_of(model, state, twist, normal_force, dt, given, more)
        changes = faces.jvp(path, tangent, heavier, push)
        return RolloutJVP(path.state, path.wrenches, *changes)
    inputs = model, state, twist, normal_force, dt
    return push(*inputs, tangent, heavier, parameters=parameters, given=given)


def push(
    model: Any, state: Any, twist: Any, normal_force: Any, dt: Any, tangent: RolloutTangent, heavier: Any, *,
    parameters: Any = None, given: Pressing | None = None,
) -> RolloutJVP:  # fmt: skip
    """Return what `rollout_jvp` does at a `given` pressure, for changes of the loads of the model's cells, or None."""
    packed = pack(model, parameters)
    family = packed.family
    turned = packed.turned
    steps = validation.numbers("twist", twist).shape[-2:-1]
    heavier = np.zeros((0, packed.inner[-1])) if heavier is None else heavier
    names = [f"tangent.{name}" for name in tangent._fields] + ["loads"]
    inner = packed.inner, (*steps, 3), steps, (len(family.names),), heavier.shape[-2:]
    changes = [
        validation.finite_numbers(name, value)
        for name, value in zip(names, (*tangent, heavier), strict=True)
    ]
    more = [
        value.shape[: max(value.ndim - len(shape), 0)]
        for value, shape in zip(changes, inner, strict=True)
    ]
    inputs = checked(packed, state, twist, normal_force, dt, None, more, given)
    rows = zip(names, changes, inner, strict=True)
    z, twists, loads, values, heavier = (rows_of(*each, inputs.batch) for each in rows)
    numbers = np.zeros((len(values), inputs.rows.shape[-1]))
    numbers[:, family.columns] = values
    end = inputs.state.copy()
    count = len(inputs.state)
    d_state = np.zeros_like(end)
    d_state[:] = z.reshape(len(z), -1)
    changed = Bars(d_state, turned(twists), loads, numbers, heavier)
    compiled = inputs.compiled(slopes=bool(loads.any()))
    both = [np.zeros((count, *steps, 3)) for _ in range(2)]
    share(
        compiled,
        count,
        lambda *span: family.tangent(compiled, span, end, changed, *both),
    )
    wrenches, slopes = (turned(inputs.of_all(values)) for values in both)
    return RolloutJVP(inputs.shaped(end), wrenches, inputs.shaped(d_state), slopes)


def _roll(
    inputs: RolloutInputs, kept: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return states at the end `[B, S]`, wrenches `[..., T, 3]`, and with `kept = T` the states before each step.

    These are `[B, T, S]`; `kept = 0` for none.
    """
    end = inputs.state.copy()
    count = len(inputs.state)
    states = np.empty((count, kept, end.shape[-1]))
    wrenches = np.zeros((count, len(inputs.dt), 3))
    compiled = inputs.compiled()
    family = inputs.model.family
    share(
        compiled,
        count,
        lambda *span: family.rollout(compiled, span, end, wrenches, states),
    )
    return end, inputs.of_all(inputs.model.turned(wrenches)), states


def _on_the_way(inputs: RolloutInputs, states: Any) -> np.ndarray:
    """Return the states before each step `[B or 1, T, S]`, given ones or those of a rollout."""
    steps = len(inputs.dt)
    if states is None:
        return _roll(inputs, steps)[2]
    rows = rows_of("states", states, (steps, *inputs.model.inner), inputs.batch)
    return rows.reshape(-1, steps, inputs.state.shape[1])


def _differentiate(
    model: PackedRollout, inputs: Inputs, z: np.ndarray, out: Derivatives
) -> None:
    """Run rollouts with their derivatives by numbers of the model: contacts, or the blocks of one, on threads."""
    run = model.family.sensitivities
    whole = inputs.shape
    blocks, lanes = divided.py_func(max(whole.weights.shape[1], 1))
    if blocks == 1 or len(z) > 1:
        share(inputs, len(z), lambda *span: run(inputs, span, z, out))
        return
    state = z.reshape(1, model.inner[0], -1)
    data = whole.data.reshape(len(whole.data), blocks, -1)

    def one(k: int) -> Derivatives:
        cells = slice(k * lanes, (k + 1) * lanes)
        part = state[..., cells].reshape(1, -1)
        sums = Derivatives(out.columns, *map(np.zeros_like, out[1:]))
        weights, by_load, kept = (
            np.ascontiguousarray(each[..., cells])
            for each in (whole.weights, whole.by_load, whole.kept)
        )
        levers = np.ascontiguousarray(data[:, k])
        shape = ShapesByLoad(whole.surface, weights, by_load, levers, kept)
        run(inputs._replace(shape=shape), (0, 1), part, sums)
        state[..., cells] = part.reshape(1, model.inner[0], -1)
        return sums

    for sums in threads.each(one, range(blocks)):
        out.wrenches[:] += sums.wrenches
        out.slopes[:] += sums.slopes


def _stepped(
    model: Any,
    state: Any,
    twist: Any,
    normal_force: Any,
    dt: Any,
    given: Pressing | None,
) -> Rollout[np.ndarray]:
    """Step any model, which checks the numbers itself."""
    state = model.rest() if state is None else validation.numbers("state", state)
    twist, load, dt = sequences(twist, normal_force, dt, given)
    inner = model.state_shape
    axes = state.shape, (*twist.shape[:-2], *inner), (*load.shape[:-1], *inner)
    state = np.broadcast_to(
        state, validation.common_shape("state, twist and normal_force", axes)
    )
    wrenches = np.empty((*state.shape[: -len(inner)], len(dt), 3))
    for t, step in enumerate(dt):
        state, wrenches[..., t, :] = step_at(
            model, state, twist[..., t, :], load, step, given, t
        )
    return Rollout(np.array(state), wrenches)
