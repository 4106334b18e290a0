"""The `xp` of JAX: what the formulas need, with a finite derivative everywhere."""

from __future__ import annotations

import math

import jax.numpy as jnp

exp, sin, cos = jnp.exp, jnp.sin, jnp.cos


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
    square = jnp.sum(x * x, axis=axis)
    nonzero = square > 0.0
    return jnp.where(nonzero, jnp.sqrt(jnp.where(nonzero, square, 1.0)), 0.0)


def unit(x, length, axis: int):
    """`x/length` along an axis; zero, with derivative 0, where the length is."""
    length = jnp.expand_dims(length, axis)
    nonzero = length > 0.0
    return jnp.where(nonzero, x / jnp.where(nonzero, length, 1.0), 0.0)
