"""The compiled roll-out and its discrete adjoint (`planarfriction.autodiff`) as a function that JAX differentiates."""

from __future__ import annotations

import functools
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax.custom_derivatives import SymbolicZero

from planarfriction import autodiff
from planarfriction.autodiff.parameters import Packed, pack_map, pack_surface
from planarfriction.errors import InvalidValueError
from planarfriction.formulas import LARGEST
from planarfriction.jax.published import ReducedModelPublished
from planarfriction.jax.reduced import ReducedModel


class _Kind(NamedTuple):
    """What is fixed when a function is compiled."""

    leaf: str
    """What of the model is held fixed."""
    sizes: tuple
    """Kind and size of a surface."""
    elasto_plastic: bool


def rollout(model, state, twist, normal_force, dt) -> tuple[jax.Array, jax.Array]:
    """Last state `[..., 3]` and wrenches `[..., T, 3]`; state, twist and normal_force have the same batch axes."""
    if isinstance(model, ReducedModelPublished):
        leaf, sizes, data = "surface", (model.surface.kind, model.surface.size), model.surface.data
    elif isinstance(model, ReducedModel):
        leaf, sizes = "shape", ()
        data = jnp.concatenate([model.shape.factor.reshape(-1), model.shape.map])
    else:
        raise InvalidValueError("method", f"be 'eager' for {type(model).__name__}", "'adjoint'")
    kind = _Kind(leaf, sizes, model.elasto_plastic)
    return _rollout(kind, data, jnp.asarray(dt), jnp.stack(model.parameters), state, twist, normal_force)


@functools.partial(jax.custom_vjp, nondiff_argnums=(0,))
def _rollout(kind: _Kind, data, dt, parameters, state, twist, load):
    shapes = jax.ShapeDtypeStruct(state.shape, twist.dtype), jax.ShapeDtypeStruct(twist.shape, twist.dtype)
    return jax.pure_callback(
        functools.partial(_forward, kind), shapes, data, dt, parameters, state, twist, load, vmap_method="expand_dims"
    )


def _rollout_fwd(kind: _Kind, data, dt, *inputs):
    for name, value in ((kind.leaf, data), ("dt", dt)):
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
    def run(data, dt, *inputs):
        good, dt, (parameters, state, twist, load) = _numbers(dt, *inputs)
        found = autodiff.rollout(_packed(kind, data), state, twist, load, dt, parameters=parameters)
        return _spoilt(good, *found)

    return _by_contact(run, arrays, arrays[4].dtype)


def _backward(kind: _Kind, *arrays):
    def run(data, dt, *inputs):
        good, dt, (parameters, state, twist, load, state_bar, wrenches_bar) = _numbers(dt, *inputs)
        found = autodiff.rollout_gradient(
            _packed(kind, data), state, twist, load, dt, wrenches_bar, state_bar, parameters=parameters
        )
        shared = tuple(i for i, length in enumerate(parameters.shape[:-1]) if length == 1)
        (slopes,) = _spoilt(good.all(axis=shared, keepdims=True), found.parameters)
        return slopes.reshape(inputs[0].shape), *_spoilt(good, found.state, found.twist, found.normal_force)

    return _by_contact(run, arrays, arrays[4].dtype)


def _numbers(dt, parameters, *inputs):
    """Which contacts are given numbers, bool `[...]`, and all inputs with harmless ones for the other contacts.

    Inputs are those of a roll-out and, if any, cotangents of its results. There is nobody to whom an error could be
    raised: NaN comes out where NaN went in, as from the operations of JAX.
    """
    wide = _beside(parameters, inputs[0])
    inner = 1, 2, 1, 1, 2
    fit = [
        (np.abs(value) <= LARGEST).all(axis=tuple(range(-axes, 0)))
        for value, axes in zip((wide, *inputs), (1, *inner), strict=False)
    ]
    good = functools.reduce(np.logical_and, fit) & (dt <= LARGEST)
    if good.all():
        return good, dt, (wide, *inputs)
    usable = [
        np.where(own.reshape(own.shape + (1,) * axes), value, harmless)
        for own, value, axes, harmless in zip(fit, (wide, *inputs), (1, *inner), (0.5, 0, 0, 0, 0, 0), strict=False)
    ]
    return good, dt if dt <= LARGEST else 0.0, usable


def _spoilt(good: np.ndarray, *results: np.ndarray) -> list[np.ndarray]:
    """Results, NaN for contacts that are not good."""
    return [np.where(good.reshape(good.shape + (1,) * (r.ndim - good.ndim)), r, np.nan) for r in results]


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
    """The model as compiled loops see it, with parameters that others take the place of."""
    if kind.leaf == "shape":
        return pack_map(kind.elasto_plastic, data[:9].reshape(3, 3), data[9:])
    surface, size = kind.sizes
    return pack_surface(kind.elasto_plastic, surface, size, np.ascontiguousarray(data))


def _beside(parameters: np.ndarray, state: np.ndarray) -> np.ndarray:
    """Parameters with axes of length 1 for the batch axes that only the contacts have."""
    own = state.ndim - parameters.ndim
    return parameters.reshape(*parameters.shape[:-1], *(1,) * own, parameters.shape[-1])
