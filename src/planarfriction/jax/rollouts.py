"""Pure functions of a model: rate, wrench, step, and rollouts of many steps."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import jax
import jax.numpy as jnp

from planarfriction.derivatives import Rollout
from planarfriction.errors import InvalidValueError
from planarfriction.jax import adjoint
from planarfriction.jax.base import FrictionPytree
from planarfriction.jax.namespace import xp
from planarfriction.tensors.namespace import rollout_inputs
from planarfriction.tensors.operations import SceneOperation, simulator


def rest(model: FrictionPytree, batch: int | Sequence[int] = ()) -> jax.Array:
    """Return the state of a contact at rest, with relaxed bristles, or of a `batch`: `[*batch, *state_shape]`."""
    return model.rest(batch)


def rate(model: FrictionPytree, state, twist, normal_force) -> jax.Array:
    """Return the rate of the state, of the same shape."""
    return model.rate(state, twist, normal_force)


def wrench(model: FrictionPytree, state, twist, normal_force) -> jax.Array:
    """Return the friction wrench on the moving body, `[..., 3]` [N, N, N m]."""
    return model.wrench(state, twist, normal_force)


def step(
    model: FrictionPytree, state, twist, normal_force, dt
) -> tuple[jax.Array, jax.Array]:
    """Return the state after `dt` [s] of a constant twist, and the wrench at the end. Stable at any `dt`."""
    return model.step(state, twist, normal_force, dt)


def rollout(
    model: FrictionPytree,
    state: Any,
    twist: Any,
    normal_force: Any,
    dt: Any,
    *,
    parameters: Any = None,
    method: str | None = None,
) -> Rollout[jax.Array]:
    """Step a model from `state` (None: at rest) through `twist` `[..., T, 3]`, each constant for `dt` [s].

    `normal_force` broadcasts with `[..., T]`: one number, one for each step `[T]`, or one for each contact `[..., 1]`.
    `parameters`, a record like `model.parameters` or an array `[P]` in the same order, replaces the model's own.

    `method` is `"eager"`, JAX operations step by step (any model and device, all kinds and orders of derivatives), or
    `"adjoint"`, the much faster compiled rollout with forward and reverse derivatives (on the CPU, float64 inside,
    first derivatives with respect to the parameters, weights of cells, `state`, `twist` and `normal_force`). None uses
    the adjoint if JAX's default device is the CPU, and JAX operations for whatever the adjoint cannot do: higher
    derivatives, and those with respect to `dt` and other numbers of the patch. Pads with a common compliance are always
    eager, with derivatives up to the second.

    Inside `jit`, a contact whose input is NaN or exceeds 1e50 gets NaN in its wrenches, its state and its gradients.

    Raises `InvalidValueError` as a step does (see `TensorModel`), and for a method that is not possible. Inside
    `jit`, parameters outside their range make the adjoint end in an error of JAX whose last line names them.
    """
    front = "planarfriction.jax"
    state, twist, load, dt = rollout_inputs(
        model, FrictionPytree, front, state, twist, normal_force, dt, method
    )
    if parameters is not None:
        model = model.replace(parameters=model._record(parameters))
    inner = model.state_shape
    shape = jnp.broadcast_shapes(
        twist.shape[:-1], load.shape, (*state.shape[: state.ndim - len(inner)], 1)
    )
    state = jnp.broadcast_to(state, (*shape[:-1], *inner))
    twist, load = (
        jnp.broadcast_to(twist, (*shape, 3)),
        jnp.broadcast_to(load.astype(twist.dtype), shape),
    )
    hangs = model.compliance is not None
    if method == "adjoint" and hangs:
        rule = "be 'eager' for a pad with a common compliance"
        raise InvalidValueError("method", rule, repr(method))
    compiled = method is None and not hangs and jax.default_backend() == "cpu"
    if method == "adjoint" or compiled:
        return Rollout(
            *adjoint.rollout(model, state, twist, load, dt, strict=method == "adjoint")
        )
    return Rollout(*model.rollout(state, twist, load, dt))


simulate_scene = simulator(
    xp, lambda function, numbers: adjoint.call(SceneOperation(function), (), numbers)
)
