"""Inputs of the tensor models: what is no number is refused, and a load or a step below zero never drives.

Values are looked at where that waits for nothing: tensors on the processor, outside of `torch.compile` and `vmap`.
Elsewhere a load below zero counts as none, and a step below zero as none; NaN stays NaN.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import torch
from torch import Tensor

from planarfriction import validation
from planarfriction.errors import InvalidValueError


def real(name: str, value: Any, like: Tensor) -> Tensor:
    """`value` as a tensor of real numbers; a tensor keeps its precision and its device."""
    if isinstance(value, Tensor):
        if value.is_floating_point():
            return value
        if value.is_complex() or value.dtype == torch.bool:
            raise InvalidValueError(name, "be a tensor of real numbers", f"one of {value.dtype}")
        return value.to(like.dtype)
    plain = value if type(value) is float else validation.numbers(name, value)
    if isinstance(plain, np.ndarray) and min(plain.strides, default=0) < 0:  # tensors know no way backwards
        plain = plain.copy()
    return torch.as_tensor(plain, dtype=like.dtype, device=like.device)


def finite(name: str, value: Tensor) -> Tensor:
    """`value`, refused where it is looked at and not finite."""
    extremes(name, value)
    return value


def non_negative(name: str, value: Tensor) -> Tensor:
    """`value`, refused where it is looked at and below zero; elsewhere what is below zero counts as zero."""
    ends = extremes(name, value)
    if ends is None:
        return value.clamp(min=0.0)
    if ends[0] < 0.0:
        raise InvalidValueError(name, "be >= 0", ends[0])
    return value


def extremes(name: str, value: Tensor) -> tuple[float, float] | None:
    """Smallest and largest number, which are within the range of numbers; None where they are not looked at."""
    if torch.compiler.is_compiling() or value.device.type != "cpu":
        return None
    if not value.numel():
        return 0.0, 0.0
    try:
        low, high = (each.item() for each in torch.aminmax(value.detach()))
    except RuntimeError:  # inside vmap, or of no values at all
        return None
    validation.within_range(name, low, high)
    return low, high
