"""The array namespace of JAX."""

from __future__ import annotations

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer

from planarfriction import validation
from planarfriction.errors import InvalidValueError
from planarfriction.jax.pressure import pressing
from planarfriction.tensors.namespace import Namespace


def _real(name: str, value: Any, like: Any = None) -> jax.Array:
    if not isinstance(value, jax.Array) and type(value) is not float:
        if isinstance(value, (list, tuple)) and any(isinstance(each, jax.Array) for each in value):
            value = jnp.stack([_real(name, each) for each in value])
        else:
            checked = validation.numbers(name, value)
            if isinstance(value, (int, float)) and not isinstance(value, np.generic):
                value = float(checked)  # a plain number takes the precision of what it meets
            elif isinstance(value, (np.ndarray, np.generic)) and value.dtype.char in "efd" and value.dtype.isnative:
                value = np.asarray(value)  # plain, which a masked array is not even if it masks nothing
            else:
                value = jnp.asarray(checked, float)
    array = jnp.asarray(value)
    if jnp.issubdtype(array.dtype, jnp.floating):
        return array
    if array.dtype == bool or jnp.issubdtype(array.dtype, jnp.complexfloating):
        raise InvalidValueError(name, "be an array of real numbers", f"one of {array.dtype}")
    return array.astype(float)


def _extremes(name: str, value: jax.Array) -> tuple[float, float] | None:
    if isinstance(value, Tracer) or not value.size or any(device.platform != "cpu" for device in value.devices()):
        return None
    numbers = np.asarray(value)
    low, high = float(numbers.min()), float(numbers.max())
    validation.within_range(name, low, high)
    return low, high


xp = Namespace(
    jnp,
    broadcast_arrays=jnp.broadcast_arrays,
    stop_gradient=jax.lax.stop_gradient,
    integers=lambda x: x.astype(jnp.int32),
    real=_real,
    extremes=_extremes,
    pressing=pressing,
    to_numpy=lambda value: np.asarray(value) if isinstance(value, jax.Array) else value,
    from_numpy=lambda array, like: jnp.asarray(array, like.dtype),
    widened=lambda x: x,
    narrowed=lambda result, *inputs: result,
)
