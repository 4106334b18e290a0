"""The `xp` of JAX: what the formulas need, with a finite derivative everywhere."""

from __future__ import annotations

import math

import jax
import jax.numpy as jnp

exp, sin, cos, stack = jnp.exp, jnp.sin, jnp.cos, jnp.stack


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


def norm(x, axis: int):
    """Length along an axis; at the zero vector its derivative is 0."""
    return root(jnp.sum(x * x, axis=axis))


def unit(x, length, axis: int):
    """`x/length` along an axis; zero, with derivative 0, where the length is."""
    length = jnp.expand_dims(length, axis)
    nonzero = length > 0.0
    return jnp.where(nonzero, x / jnp.where(nonzero, length, 1.0), 0.0)


def root(x):
    """Square root of `x >= 0`; its derivative at 0 is 0."""
    positive = x > 0.0
    return jnp.where(positive, jnp.sqrt(jnp.where(positive, x, 1.0)), 0.0)


def whole(x, most: int):
    """Integer part, from 0 to `most`."""
    return jnp.clip(jax.lax.stop_gradient(x).astype(jnp.int32), 0, most)
