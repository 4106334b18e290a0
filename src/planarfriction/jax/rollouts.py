"""Pure functions of a model: rate, wrench, step, and roll-outs of many steps."""

from __future__ import annotations

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp

from planarfriction import validation
from planarfriction.equality import by_parts
from planarfriction.errors import InvalidValueError
from planarfriction.families import MODELS
from planarfriction.jax import adjoint, inputs
from planarfriction.jax.base import FrictionModel

METHODS = ("adjoint", "eager")
"""Compiled roll-out with its discrete adjoint; every step an operation of JAX, in `lax.scan`."""


@by_parts
class Rollout(NamedTuple):
    """Result of stepping a model through T twists and loads."""

    state: jax.Array
    """State after the last step, `[..., *state_shape]`."""
    wrenches: jax.Array
    """Wrench on the moving body at the end of each step, `[..., T, 3]` [N, N, N m]."""


def rest(model: FrictionModel) -> jax.Array:
    """State of a contact at rest, with relaxed bristles."""
    return model.rest()


def rate(model: FrictionModel, state, twist, normal_force) -> jax.Array:
    """Rate of the state, of the same shape."""
    return model.rate(state, twist, normal_force)


def wrench(model: FrictionModel, state, twist, normal_force) -> jax.Array:
    """Friction wrench on the moving body, `[..., 3]` [N, N, N m]."""
    return model.wrench(state, twist, normal_force)


def step(model: FrictionModel, state, twist, normal_force, dt) -> tuple[jax.Array, jax.Array]:
    """Advance by `dt` [s] at a constant twist; returns the new state and the wrench at the end. Stable at any `dt`."""
    return model.step(state, twist, normal_force, dt)


def rollout(
    model: FrictionModel,
    state: Any,
    twist: Any,
    normal_force: Any,
    dt: Any,
    *,
    parameters: Any = None,
    method: str | None = None,
) -> Rollout:
    """Step a model from `state` (None: at rest) through `twist` `[..., T, 3]`, each held for `dt` [s].

    `normal_force` broadcasts with `[..., T]`: one number, one for each step `[T]`, or one for each contact `[..., 1]`.
    `parameters`, a record like `model.parameters` or an array `[P]` in the same order, replaces the model's own.

    `method` is `"eager"`, JAX operations step by step (any model and device, all kinds and orders of derivatives), or
    `"adjoint"`, the much faster compiled roll-out with forward and reverse derivatives (reduced models on the CPU,
    float64 inside, first derivatives with respect to the parameters, `state`, `twist` and `normal_force`). None uses
    the adjoint for a reduced model if JAX's default device is the CPU, and JAX operations for whatever the adjoint
    cannot do: higher derivatives, and those with respect to `dt` and the numbers of the patch.

    Inside `jit`, a contact whose input is NaN or exceeds 1e50 gets NaN in its wrenches, its state and its gradients.

    Raises `InvalidValueError` as a step does (see `FrictionModel`), and for a method that is not possible. Inside
    `jit`, parameters outside their range make the adjoint end in an error of JAX whose last line names them.
    """
    if not isinstance(model, FrictionModel):
        kind = type(model)
        rule = f"be one of planarfriction.jax ({MODELS.classes()})"
        raise InvalidValueError("model", rule, f"{kind.__module__}.{kind.__name__}")
    if method is not None:
        validation.choice("method", method, METHODS)
    if parameters is not None:
        model = model.replace(parameters=type(model.parameters)(*parameters))
    twist, dt = inputs.real("twist", twist), inputs.real("dt", dt)
    if twist.ndim < 2 or twist.shape[-1] != 3:
        raise InvalidValueError("twist", "have shape [..., T, 3]", f"shape {list(twist.shape)}")
    inner = model.rest().shape
    load = inputs.non_negative("normal_force", inputs.real("normal_force", normal_force)).astype(twist.dtype)
    start = model.rest() if state is None else inputs.shaped("state", inputs.real("state", state), inner)
    start, twist, dt = inputs.finite("state", start), inputs.finite("twist", twist), inputs.non_negative("dt", dt)
    try:
        shape = jnp.broadcast_shapes(twist.shape[:-1], load.shape, (*start.shape[: -len(inner)], 1))
        start = jnp.broadcast_to(start, (*shape[:-1], *inner))
    except ValueError:
        shapes = ", ".join(str(list(a.shape)) for a in (start, twist, load))
        rule = "broadcast to [..., T]"
        raise InvalidValueError("state, twist and normal_force", rule, f"shapes {shapes}") from None
    twist, load = jnp.broadcast_to(twist, (*shape, 3)), jnp.broadcast_to(load, shape)
    known = type(model).compiled is not FrictionModel.compiled
    if method == "adjoint" and not known:
        raise InvalidValueError("method", f"be 'eager' for {type(model).__name__}", repr(method))
    if method == "adjoint" or (method is None and known and jax.default_backend() == "cpu"):
        return Rollout(*adjoint.rollout(model, start, twist, load, dt, strict=method == "adjoint"))
    return Rollout(*model.roll(start, twist, load, dt))
