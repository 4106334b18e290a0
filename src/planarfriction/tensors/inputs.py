"""Checks of arrays that front ends are given: shapes always, values where they can be read without waiting.

Elsewhere (on a device, inside `jit`, `vmap`, `grad` or `torch.compile`) a load or a time step below zero counts as
zero, so that friction never drives; NaN stays NaN.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from planarfriction.errors import InvalidValueError


def finite(xp: Any, name: str, value: Any) -> Any:
    """Return `value`; raise InvalidValueError if it can be read and is not finite."""
    xp.extremes(name, value)
    return value


def non_negative(xp: Any, name: str, value: Any) -> Any:
    """Return `value`; raise InvalidValueError if it can be read and is below zero, else replace what is by zero."""
    extremes = xp.extremes(name, value)
    if extremes is None:
        return xp.where(value < 0.0, 0.0, value)  # not a maximum, which of NaN and zero takes zero
    if extremes[0] < 0.0:
        raise InvalidValueError(name, "be >= 0", extremes[0])
    return value


def positive(xp: Any, name: str, value: Any) -> Any:
    """Return `value`; raise InvalidValueError if it can be read and is not above zero."""
    extremes = xp.extremes(name, value)
    if extremes is not None and extremes[0] <= 0.0:
        raise InvalidValueError(name, "be > 0", extremes[0])
    return value


def shaped(name: str, value: Any, inner: tuple[int, ...]) -> Any:
    """Return `value` `[..., *inner]`; raise InvalidValueError if its last axes have other lengths."""
    if tuple(value.shape[max(value.ndim - len(inner), 0) :]) != tuple(inner):
        wanted = ", ".join(map(str, inner))
        raise InvalidValueError(name, f"have shape [..., {wanted}]", f"shape {list(value.shape)}")
    return value


def broadcast(xp: Any, subject: str, rule: str, shapes: Mapping[str, Any]) -> tuple[int, ...]:
    """Return the common shape of `shapes` by name; raise InvalidValueError, `subject must rule`, if there is none."""
    try:
        return xp.broadcast_shapes(*shapes.values())
    except (RuntimeError, ValueError):  # of PyTorch, of JAX
        named = ", ".join(f"{name} {list(shape)}" for name, shape in shapes.items())
        raise InvalidValueError(subject, rule, f"shapes {named}") from None
