"""Inputs of the JAX models: what is no number is refused, and a load or a step below zero never drives.

Shapes are always checked. Values are looked at where they are there: arrays on the processor that JAX is not tracing.
Inside `jit`, `vmap` or `grad`, and on a device, a load below zero counts as none, and a step below zero as none; NaN
stays NaN.
"""

from __future__ import annotations

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer

from planarfriction import validation
from planarfriction.errors import InvalidValueError


def real(name: str, value: Any) -> jax.Array:
    """`value` as an array of real numbers; an array keeps its precision."""
    if not isinstance(value, jax.Array) and type(value) is not float:
        if isinstance(value, (list, tuple)) and any(isinstance(each, jax.Array) for each in value):
            value = jnp.stack([real(name, each) for each in value])
        else:
            checked = validation.numbers(name, value)
            if isinstance(value, (int, float)) and not isinstance(value, np.generic):
                value = float(checked)  # a plain number takes the precision of what it meets
            elif not (
                isinstance(value, (np.ndarray, np.generic)) and value.dtype.char in "efd" and value.dtype.isnative
            ):
                value = jnp.asarray(checked, float)
    array = jnp.asarray(value)
    if jnp.issubdtype(array.dtype, jnp.floating):
        return array
    if array.dtype == bool or jnp.issubdtype(array.dtype, jnp.complexfloating):
        raise InvalidValueError(name, "be an array of real numbers", f"one of {array.dtype}")
    return array.astype(float)


def finite(name: str, value: jax.Array) -> jax.Array:
    """`value`, refused where it is looked at and not finite."""
    _extremes(name, value)
    return value


def non_negative(name: str, value: jax.Array) -> jax.Array:
    """`value`, refused where it is looked at and below zero; elsewhere what is below zero counts as zero."""
    extremes = _extremes(name, value)
    if extremes is None:
        return jnp.where(value < 0.0, 0.0, value)  # not a maximum, which of NaN and zero takes zero
    if extremes[0] < 0.0:
        raise InvalidValueError(name, "be >= 0", extremes[0])
    return value


def shaped(name: str, value: jax.Array, inner: tuple[int, ...]) -> jax.Array:
    """`value` `[..., *inner]`."""
    if value.shape[max(value.ndim - len(inner), 0) :] != inner:
        wanted = ", ".join(map(str, inner))
        raise InvalidValueError(name, f"have shape [..., {wanted}]", f"shape {list(value.shape)}")
    return value


def broadcasting(shapes: dict[str, tuple[int, ...]]) -> None:
    """Raise unless the batch axes broadcast."""
    try:
        jnp.broadcast_shapes(*shapes.values())
    except ValueError:
        named = ", ".join(f"{name} {list(shape)}" for name, shape in shapes.items())
        raise InvalidValueError("batch axes", "broadcast", named) from None


def _extremes(name: str, value: jax.Array) -> tuple[float, float] | None:
    """Smallest and largest number, which are within the range of numbers; None where they are not looked at."""
    if isinstance(value, Tracer) or any(device.platform != "cpu" for device in value.devices()):
        return None
    numbers = np.asarray(value)
    low, high = float(numbers.min(initial=0.0)), float(numbers.max(initial=0.0))
    validation.within_range(name, low, high)
    return low, high
