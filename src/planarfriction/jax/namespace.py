"""The array namespace of JAX."""

from __future__ import annotations

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer

from planarfriction import validation
from planarfriction.errors import InvalidValueError
from planarfriction.tensors.namespace import Namespace


class JaxNamespace(Namespace):
    """Operations on arrays of JAX; values are read on the processor, where JAX is not tracing."""

    def broadcast_arrays(self, *arrays: Any) -> Any:
        """Return the arrays with one common shape."""
        return jnp.broadcast_arrays(*arrays)

    def stop_gradient(self, x: jax.Array) -> jax.Array:
        """Return the value as a constant for differentiation."""
        return jax.lax.stop_gradient(x)

    def integers(self, x: jax.Array) -> jax.Array:
        """Return the numbers rounded towards zero."""
        return x.astype(jnp.int32)

    def real(self, name: str, value: Any, like: Any = None) -> jax.Array:
        """Return `value` as an array of real numbers; an array keeps its precision."""
        if not isinstance(value, jax.Array) and type(value) is not float:
            if isinstance(value, (list, tuple)) and any(isinstance(each, jax.Array) for each in value):
                value = jnp.stack([self.real(name, each) for each in value])
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

    def extremes(self, name: str, value: jax.Array) -> tuple[float, float] | None:
        """Return the smallest and the largest number, or None if there is none to read without waiting."""
        if isinstance(value, Tracer) or any(device.platform != "cpu" for device in value.devices()):
            return None
        numbers = np.asarray(value)
        if not numbers.size:
            return None
        low, high = float(numbers.min()), float(numbers.max())
        validation.within_range(name, low, high)
        return low, high

    def to_numpy(self, value: Any) -> Any:
        """Return an array of JAX as a NumPy array, anything else unchanged."""
        return np.asarray(value) if isinstance(value, jax.Array) else value

    def from_numpy(self, array: np.ndarray, like: jax.Array) -> jax.Array:
        """Return a copy of a NumPy array, with the number type of `like`."""
        return jnp.asarray(array, like.dtype)


xp = JaxNamespace(jnp)
