"""Rollouts of pads with a common compliance (see `_engine.coupled.face`), step by step, and their derivatives.

At the twist of its face, `V_f = V + (b + C W)/h` with `h = dt + T`, a step is one of the bristles alone. Derivatives of
that step in four directions, of the inputs at a held face and of the three components of its twist or of the wrench,
give those of the face by three equations.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from planarfriction._engine.records.pressing import Pressing
from planarfriction._support import validation
from planarfriction.derivatives.inputs import sequences, step_at
from planarfriction.derivatives.parameters import PackedRollout, bristles_of
from planarfriction.errors import InvalidValueError

DIRECTIONS = np.eye(4)[:, 1:]
"""A held face, and its three components `[4, 3]`."""


def hangs(model: Any, parameters: Any) -> bool:
    """Return True for a model on a pad with a common compliance, which cannot take other `parameters`."""
    pad = getattr(getattr(model, "reduction", None), "pad", None)
    if pad is None or model.compiled.compliance is None:
        return False
    if parameters is not None:
        rule = "be None for a pad with a common compliance (take model.with_law)"
        raise InvalidValueError("parameters", rule, type(parameters).__name__)
    return True


class Path(NamedTuple):
    """A rollout with its inputs, of the same batch axes."""

    bristles: PackedRollout
    state: np.ndarray
    """State after the last step `[..., S]`."""
    wrenches: np.ndarray
    """`[..., T, 3]`"""
    states: np.ndarray
    """States before the steps `[..., T, S]`."""
    twist: np.ndarray
    load: np.ndarray
    dt: np.ndarray
    soft: np.ndarray
    """Common compliance `[3, 3]`."""
    lag: float
    given: Pressing | None
    """Pressure of the steps, if it is given."""

    def at(self, t: int) -> tuple[Any, Any, Any]:
        """Return the inputs of the bristles' step t, four times, the time h, and 1 or 0 by the load."""
        b = self.states[..., t, -3:]
        h = self.dt[t] + self.lag
        face = self.twist[..., t, :] + (b + self.wrenches[..., t, :] @ self.soft) / h
        batch = 4, *face.shape[:-1]
        state = self.states[..., t, :-3].reshape(*batch[1:], *self.bristles.inner)
        inputs = (
            np.broadcast_to(state, (4, *state.shape)),
            np.broadcast_to(face[..., None, :], (*batch, 1, 3)),
            None
            if self.given
            else np.broadcast_to(self.load[..., t : t + 1], (*batch, 1)),
            self.dt[t],
        )
        return inputs, h, (self.load[..., t] > 0.0)[..., None] * 1.0

    def pressed(self, t: int) -> Pressing | None:
        """Return the pressure of step t, if it is given."""
        return None if self.given is None else self.given.at([t])


def path_of(
    model: Any, state: Any, twist: Any, normal_force: Any, dt: Any, given: Pressing | None, more: Any = (),
) -> Path:  # fmt: skip
    """Step a model, which checks the numbers; `more` are batch axes of other arrays that belong to it."""
    model = model.reduction
    state = model.rest() if state is None else validation.numbers("state", state)
    twist, load, dt = sequences(twist, normal_force, dt, given)
    axes = state.shape[:-1], twist.shape[:-2], load.shape[:-1], *more
    batch = validation.common_shape("state, twist and normal_force", axes)
    steps = len(dt)
    state = np.broadcast_to(state, (*batch, state.shape[-1]))
    twist = np.broadcast_to(twist, (*batch, steps, 3))
    load = np.broadcast_to(load, (*batch, steps))
    states = np.empty((*batch, steps, state.shape[-1]))
    wrenches = np.empty((*batch, steps, 3))
    for t in range(steps):
        states[..., t, :] = state
        state, wrenches[..., t, :] = step_at(
            model, state, twist[..., t, :], load, dt[t], given, t
        )
    own = bristles_of(model), np.array(state), wrenches, states
    soft = model.compiled
    return Path(*own, twist, load, dt, soft.compliance, soft.lag, given)


def _sum(found: np.ndarray, shares: np.ndarray, inner: int) -> np.ndarray:
    """Return the first of four results `[4, ...]` of `inner` axes and the `shares` `[..., 3]` of the others."""
    shares = np.moveaxis(shares, -1, 0)
    shares = shares.reshape(*shares.shape, *[1] * inner)
    return found[0] + (shares * found[1:]).sum(axis=0)


def vjp(path: Path, bars: Any, state_bar: Any, differentiate: Any) -> tuple[Any, ...]:
    """Return gradients by state, twists, loads, parameters and loads of the cells of the model `[..., T, n]`.

    `differentiate` is `rollouts.gradient`.
    """
    batch = path.load.shape[:-1]
    none = 0.0 if state_bar is None else state_bar
    z_bar = validation.filled("state_bar", none, path.state.shape)
    bars = validation.filled("wrenches_bar", bars, path.wrenches.shape)
    twist_bar = np.zeros(path.twist.shape)
    load_bar = np.zeros(path.load.shape)
    rows = path.bristles.rows[path.bristles.family.columns]
    rows_bar = np.zeros((*batch, len(rows)))
    values = np.broadcast_to(rows, (4, *rows_bar.shape))
    inner = path.bristles.inner
    cells_bar = np.zeros((*path.load.shape, inner[-1]))
    for t in reversed(range(len(path.dt))):
        inputs, h, loaded = path.at(t)
        b_bar = loaded * z_bar[..., -3:]
        new_bar = np.zeros((4, *batch, *inner))
        new_bar[0] = z_bar[..., :-3].reshape(*batch, *inner)
        each = DIRECTIONS.reshape(4, *[1] * len(batch), 1, 3)
        found, by_cell = differentiate(
            path.bristles, *inputs, np.broadcast_to(each, (4, *batch, 1, 3)), new_bar,
            parameters=values, given=path.pressed(t),
        )  # fmt: skip
        by_face = found.twist[..., 0, :]
        soft = path.soft / h
        pull = bars[..., t, :] - path.dt[t] * b_bar @ soft + by_face[0] @ soft
        slopes = np.moveaxis(by_face[1:], 0, -1)
        pull = np.linalg.solve(np.eye(3) - soft @ slopes, pull[..., None])[..., 0]
        twist_bar[..., t, :] = _sum(by_face, pull, 1)
        cells_bar[..., t, :] = _sum(by_cell[..., 0, :], pull, 1)
        if path.given is None:
            load_bar[..., t] = _sum(found.normal_force[..., 0], pull, 0)
        rows_bar += _sum(found.parameters, pull, 1)
        z_bar = np.concatenate(
            [
                _sum(found.state, pull, len(inner)).reshape(*batch, -1),
                twist_bar[..., t, :] / h + (1.0 - path.dt[t] / h) * b_bar,
            ],
            axis=-1,
        )
    return z_bar, twist_bar, load_bar, rows_bar, cells_bar


def jvp(
    path: Path, tangent: Any, heavier: Any, differentiate: Any
) -> tuple[np.ndarray, np.ndarray]:
    """Return the changes of the state and of the wrenches; `differentiate` is `rollouts.push`."""
    batch = path.load.shape[:-1]
    inner = path.bristles.inner
    rows = *batch, len(path.bristles.family.names)
    sizes = path.state.shape, path.twist.shape, path.load.shape, rows
    names = [f"tangent.{name}" for name in tangent._fields]
    z_dot, twist_dot, load_dot, rows_dot = map(validation.filled, names, tangent, sizes)
    wrenches_dot = np.zeros(path.wrenches.shape)
    shapes = (*batch, *inner), (*batch, 1, 3), (*batch, 1), rows
    cells_dot = None
    for t in range(len(path.dt)):
        inputs, h, loaded = path.at(t)
        changes = [np.zeros((4, *shape)) for shape in shapes]
        changes[0][0] = z_dot[..., :-3].reshape(shapes[0])
        changes[1][:] = DIRECTIONS.reshape(4, *[1] * len(batch), 1, 3)
        changes[2][0] = load_dot[..., t : t + 1]
        changes[3][0] = rows_dot
        if heavier is not None:
            cells_dot = np.zeros((4, *batch, 1, inner[-1]))
            cells_dot[0] = heavier[..., t : t + 1, :]
        found = differentiate(
            path.bristles, *inputs, type(tangent)(*changes), cells_dot, given=path.pressed(t)
        )  # fmt: skip
        pulls = found.wrenches_dot[..., 0, :]
        slopes = np.moveaxis(pulls[1:], 0, -1)
        b_dot = z_dot[..., -3:]
        soft = path.soft / h
        free = twist_dot[..., t, :] + b_dot / h
        pull = pulls[0] + (slopes @ free[..., None])[..., 0]
        pull = np.linalg.solve(np.eye(3) - slopes @ soft, pull[..., None])[..., 0]
        wrenches_dot[..., t, :] = pull
        new = _sum(found.state_dot, free + pull @ soft, len(inner))
        bent = loaded * (b_dot - path.dt[t] * (b_dot / h + pull @ soft))
        z_dot = np.concatenate([new.reshape(*batch, -1), bent], axis=-1)
    return z_dot, wrenches_dot
