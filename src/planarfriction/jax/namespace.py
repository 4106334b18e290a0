"""The `xp` of JAX: what the formulas need, with a finite derivative everywhere."""

from __future__ import annotations

import math

import jax
import jax.numpy as jnp

exp, sin, cos, stack, ones_like = jnp.exp, jnp.sin, jnp.cos, jnp.stack, jnp.ones_like
atan2, moveaxis, concatenate, broadcast_arrays = jnp.arctan2, jnp.moveaxis, jnp.concatenate, jnp.broadcast_arrays


def where(condition, a, b):
    """`a` where the condition holds, else `b`; a condition known beforehand picks its branch at once."""
    return (a if condition else b) if isinstance(condition, bool) else jnp.where(condition, a, b)


def minimum(a, b):
    """The smaller of two numbers; of two equal ones the first, and its derivative."""
    return jnp.where(a <= b, a, b)


def maximum(a, b):
    """The larger of two numbers; of two equal ones the first, and its derivative."""
    return jnp.where(a >= b, a, b)


def power(x, exponent):
    """`x^exponent` for x >= 0 and exponent > 0, derivatives 0 at x = 0; held where it would leave the range of x."""
    limit = math.log(jnp.finfo(x.dtype).max) - 1.0
    moving = x > 0.0
    within = moving & (exponent * jnp.log(jnp.where(moving, x, 1.0)) < limit)
    return jnp.where(within, jnp.power(jnp.where(within, x, 1.0), exponent), jnp.where(moving, math.exp(limit), 0.0))


def dot(a, b, axis: int):
    """`a . b` along an axis, which stays with length 1."""
    return jnp.sum(a * b, axis=axis, keepdims=True)


def norm(vector, axis: int):
    """`|vector|` along an axis, which stays with length 1; its derivative at 0 is 0."""
    return root(dot(vector, vector, axis))


def root(x):
    """Square root of `x >= 0`; its derivative at 0 is 0."""
    positive = x > 0.0
    return jnp.where(positive, jnp.sqrt(jnp.where(positive, x, 1.0)), 0.0)


def whole(x, most: int):
    """Integer part, from 0 to `most`."""
    return jnp.clip(jax.lax.stop_gradient(x).astype(jnp.int32), 0, most)


def held(x):
    """The value, without its derivative."""
    return jax.lax.stop_gradient(x)


def epsilon(x) -> float:
    """Rounding error of the numbers."""
    return float(jnp.finfo(x.dtype).eps)
