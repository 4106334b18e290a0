"""The `xp` of tensors: what the formulas need, with derivatives that stay finite at every kink.

At a tie `minimum` and `maximum` pass the derivative of their first argument. `power` has the derivative 0 at 0.
"""

from __future__ import annotations

import math

import torch
from torch import Tensor

exp, sin, cos, stack, ones_like = torch.exp, torch.sin, torch.cos, torch.stack, torch.ones_like
atan2, moveaxis, concatenate, broadcast_arrays = torch.atan2, torch.movedim, torch.concatenate, torch.broadcast_tensors


def where(condition, a, b):
    """`a` where the condition holds, else `b`."""
    if isinstance(condition, bool):
        return a if condition else b
    return torch.where(condition, a, b)


def minimum(a, b):
    """The smaller of two numbers, `a` at a tie."""
    return torch.where(a <= b, a, b)


def maximum(a, b):
    """The larger of two numbers, `a` at a tie."""
    return torch.where(a >= b, a, b)


def power(x: Tensor, exponent: Tensor) -> Tensor:
    """`x^exponent` for x >= 0 and exponent > 0; held constant where it would leave the range of the number type."""
    limit = math.log(torch.finfo(x.dtype).max) - 1.0
    moving = x > 0.0
    usual = moving & (exponent * torch.log(torch.where(moving, x, 1.0)) < limit)
    largest = torch.where(moving, torch.full_like(x, math.exp(limit)), 0.0)
    return torch.where(usual, torch.pow(torch.where(usual, x, 1.0), exponent), largest)


def dot(a: Tensor, b: Tensor, axis: int) -> Tensor:
    """`a . b` along an axis, which stays with length 1."""
    return (a * b).sum(axis, keepdim=True)


def norm(vector: Tensor, axis: int) -> Tensor:
    """`|vector|` along an axis, which stays with length 1; its derivative at 0 is 0."""
    return root(dot(vector, vector, axis))


def root(x: Tensor) -> Tensor:
    """Square root of `x >= 0`; its derivative at 0 is 0."""
    positive = x > 0.0
    return torch.where(positive, torch.sqrt(torch.where(positive, x, 1.0)), 0.0)


def whole(x: Tensor, most: int) -> Tensor:
    """Integer part, from 0 to `most`."""
    return x.detach().long().clamp(0, most)


def held(x: Tensor) -> Tensor:
    """The value, without its derivative."""
    return x.detach()


def epsilon(x: Tensor) -> float:
    """Rounding error of the numbers."""
    return torch.finfo(x.dtype).eps
