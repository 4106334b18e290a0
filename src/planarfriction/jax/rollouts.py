"""Pure functions of a model: rate, wrench, step, and roll-outs of many steps."""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp

from planarfriction import validation
from planarfriction.errors import InvalidValueError
from planarfriction.jax.base import FrictionModel


class Rollout(NamedTuple):
    """What a roll-out of T steps returns."""

    wrenches: jax.Array
    """Wrench at the end of each step `[..., T, 3]` [N, N, N m]."""
    state: jax.Array
    """State after the last step."""


def rest(model: FrictionModel) -> jax.Array:
    """State of a contact at rest: no bristle is deflected."""
    return model.rest()


def rate(model: FrictionModel, z, twist, load) -> jax.Array:
    """Bristle rates `zdot`, of the shape of the state [m/s; m^2/s for the third bristle of the reduced model]."""
    return model.rate(jnp.asarray(z), jnp.asarray(twist), load)


def wrench(model: FrictionModel, z, twist, load) -> jax.Array:
    """Friction wrench on the moving body, `[..., 3]` [N, N, N m]."""
    return model.wrench(jnp.asarray(z), jnp.asarray(twist), load)


def step(model: FrictionModel, z, twist, load, dt) -> tuple[jax.Array, jax.Array]:
    """Advance by `dt` [s] at a held twist: the new state and the wrench at the end, stable at any `dt`."""
    return model.step(jnp.asarray(z), jnp.asarray(twist), load, dt)


def simulate(model: FrictionModel, twists, loads, dt, z0=None, *, method: str = "scan") -> Rollout:
    """Steps of `dt` [s] through twists `[..., T, 3]` and loads (`[..., T]` or a number), from `z0` or from rest.

    Method "scan" differentiates through `lax.scan`, on any device and with respect to everything; "adjoint"
    (`ReducedModelPublished`, CPU) runs the compiled roll-out and its discrete adjoint, much faster, in float64 inside.
    """
    validation.choice("method", method, ("scan", "adjoint"))
    twists = jnp.asarray(twists)
    if twists.ndim < 2 or twists.shape[-1] != 3:
        raise InvalidValueError("twists", "have shape [..., T, 3]", f"shape {list(twists.shape)}")
    loads = jnp.asarray(loads, twists.dtype)
    z0 = model.rest() if z0 is None else jnp.asarray(z0)
    inner = model.rest().ndim
    try:
        shape = jnp.broadcast_shapes(twists.shape[:-1], loads.shape, (*z0.shape[:-inner], 1))
        z0 = jnp.broadcast_to(z0, (*shape[:-1], *model.rest().shape))
    except ValueError:
        shapes = ", ".join(str(list(a.shape)) for a in (twists, loads, z0))
        raise InvalidValueError("twists, loads and z0", "broadcast to [..., T]", f"shapes {shapes}") from None
    twists, loads = jnp.broadcast_to(twists, (*shape, 3)), jnp.broadcast_to(loads, shape)
    if method == "adjoint":
        from planarfriction.jax.adjoint import rollout

        return Rollout(*rollout(model, z0, twists, loads, dt))

    def one(z, inputs):
        twist, load = inputs
        return model.step(z, twist, load, dt)

    # Only the states are kept for the way back; to step again costs less than to store all that a step computes.
    one = jax.checkpoint(one, prevent_cse=False)  # pyright: ignore[reportPrivateImportUsage]
    z, wrenches = jax.lax.scan(one, z0, (jnp.moveaxis(twists, -2, 0), jnp.moveaxis(loads, -1, 0)))
    return Rollout(jnp.moveaxis(wrenches, 0, -2), z)
