"""The compiled roll-out and its discrete adjoint (`planarfriction.autodiff`) as a function that JAX differentiates."""

from __future__ import annotations

import functools
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax.custom_derivatives import SymbolicZero

from planarfriction import autodiff
from planarfriction.autodiff.parameters import Packed
from planarfriction.errors import InvalidValueError
from planarfriction.jax.published import ReducedModelPublished
from planarfriction.kernels.published_step import NAMES


class _Kind(NamedTuple):
    """What is fixed when a function is compiled."""

    surface: int
    size: int
    elasto_plastic: bool


def rollout(model, state, twist, normal_force, dt) -> tuple[jax.Array, jax.Array]:
    """Last state `[..., 3]` and wrenches `[..., T, 3]`; state, twist and normal_force have the same batch axes."""
    if not isinstance(model, ReducedModelPublished):
        raise InvalidValueError("method", f"be 'eager' for {type(model).__name__}", "'adjoint'")
    surface = model.surface
    kind = _Kind(surface.kind, surface.size, model.elasto_plastic)
    parameters = jnp.stack(model.parameters)
    return _rollout(kind, surface.data, jnp.asarray(dt), parameters, state, twist, normal_force)


@functools.partial(jax.custom_vjp, nondiff_argnums=(0,))
def _rollout(kind: _Kind, data, dt, parameters, state, twist, load):
    shapes = jax.ShapeDtypeStruct(state.shape, twist.dtype), jax.ShapeDtypeStruct(twist.shape, twist.dtype)
    return jax.pure_callback(
        functools.partial(_forward, kind), shapes, data, dt, parameters, state, twist, load, vmap_method="expand_dims"
    )


def _rollout_fwd(kind: _Kind, data, dt, *inputs):
    for name, value in (("surface", data), ("dt", dt)):
        if value.perturbed:
            raise InvalidValueError(
                name,
                "be held fixed with method='adjoint': differentiate with respect to the parameters, state, twist and "
                "normal_force, or take method='eager'",
                "a derivative of it",
            )
    values = (data.value, dt.value, *(entry.value for entry in inputs))
    return _rollout(kind, *values), values


def _rollout_bwd(kind: _Kind, values, cotangents):
    _, _, parameters, state, twist, load = values
    shapes = [jax.ShapeDtypeStruct(value.shape, value.dtype) for value in (parameters, state, twist, load)]
    results = (state, twist)
    bars = [jnp.zeros_like(r) if isinstance(c, SymbolicZero) else c for c, r in zip(cotangents, results, strict=True)]
    slopes = jax.pure_callback(functools.partial(_backward, kind), shapes, *values, *bars, vmap_method="expand_dims")
    return jnp.zeros_like(values[0]), jnp.zeros_like(values[1]), *slopes


_rollout.defvjp(_rollout_fwd, _rollout_bwd, symbolic_zeros=True)


# ---------------------------------------------------------------------- outside JAX, in NumPy


def _forward(kind: _Kind, *arrays):
    def run(data, dt, parameters, state, twist, load):
        wide = _beside(parameters, state)
        return autodiff.rollout(_packed(kind, data), state, twist, load, dt, parameters=wide)

    return _by_contact(run, arrays, arrays[4].dtype)


def _backward(kind: _Kind, *arrays):
    def run(data, dt, parameters, state, twist, load, state_bar, wrenches_bar):
        wide = _beside(parameters, state)
        found = autodiff.rollout_gradient(
            _packed(kind, data), state, twist, load, dt, wrenches_bar, state_bar, parameters=wide
        )
        return found.parameters.reshape(parameters.shape), found.state, found.twist, found.normal_force

    return _by_contact(run, arrays, arrays[4].dtype)


def _by_contact(run, arrays, dtype):
    """`run` on arrays whose leading axes `vmap` has put there, of length 1 where it did not map that array.

    One call for all contacts; only if the surface or dt, the first two arrays, differ between contacts, one for each.
    """
    axes = arrays[0].ndim - 1
    outer = np.broadcast_shapes(*(value.shape[:axes] for value in arrays))
    shared = all(value.shape[:axes] == (1,) * axes for value in arrays[:2])
    wide = [np.broadcast_to(np.asarray(value, float), (*outer, *value.shape[axes:])) for value in arrays]
    if shared:
        first = (0,) * axes
        results = run(wide[0][first], wide[1][first], *wide[2:])
    else:
        parts = [run(*(value[index] for value in wide)) for index in np.ndindex(outer)]
        results = [np.stack(part).reshape(*outer, *part[0].shape) for part in zip(*parts, strict=True)]
    return tuple(value.astype(dtype) for value in results)


def _packed(kind: _Kind, data: np.ndarray) -> Packed:
    row = np.zeros(len(NAMES))
    row[NAMES.index("elasto_plastic")] = float(kind.elasto_plastic)
    return Packed(row, np.array([kind.surface, 0, kind.size]), np.ascontiguousarray(data))


def _beside(parameters: np.ndarray, state: np.ndarray) -> np.ndarray:
    """Parameters with axes of length 1 for the batch axes that only the contacts have."""
    own = state.ndim - parameters.ndim
    return parameters.reshape(*parameters.shape[:-1], *(1,) * own, parameters.shape[-1])
