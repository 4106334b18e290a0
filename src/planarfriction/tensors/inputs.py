"""Checks of arrays that front ends are given: shapes always, values where they can be read without waiting.

Elsewhere (on a device, inside `jit`, `vmap`, `grad` or `torch.compile`) a load or a time step below zero counts as
zero, so that friction never drives; NaN stays NaN.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from planarfriction import validation
from planarfriction.errors import InvalidValueError
from planarfriction.families import MODELS

METHODS = ("adjoint", "eager")
"""The compiled rollout with its discrete adjoint; each step as operations of the tensor library."""


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


def rollout_inputs(
    model: Any, kind: type, front: str, state: Any, twist: Any, normal_force: Any, dt: Any, method: str | None
) -> tuple[Any, Any, Any, Any]:
    """Return state (at rest if None), twist `[..., T, 3]`, load `[..., T]` and dt, whose batch axes broadcast.

    Raises InvalidValueError for a model that is not of the front end's `kind`, and for wrong input, by its name.
    """
    if not isinstance(model, kind):
        given = f"{type(model).__module__}.{type(model).__name__}"
        raise InvalidValueError("model", f"be one of {front} ({MODELS.classes()})", given)
    if method is not None:
        validation.choice("method", method, METHODS)
    xp = model.xp
    twist, dt = model._number("twist", twist), model._number("dt", dt)
    load = model._number("normal_force", normal_force)
    if twist.ndim < 2 or twist.shape[-1] != 3:
        raise InvalidValueError("twist", "have shape [..., T, 3]", f"shape {list(twist.shape)}")
    inner = model.state_shape
    start = model.rest() if state is None else shaped("state", model._number("state", state), inner)
    start, twist = finite(xp, "state", start), finite(xp, "twist", twist)
    load, dt = non_negative(xp, "normal_force", load), non_negative(xp, "dt", dt)
    steps = twist.shape[-2:-1]
    shape = broadcast(xp, "normal_force", f"broadcast with [..., {steps[0]}]", {"load": load.shape, "twist": steps})
    batch = start.shape[: start.ndim - len(inner)]
    shapes = {"state": (*batch, 1), "twist": twist.shape[:-1], "normal_force": load.shape}
    broadcast(xp, "batch axes", "broadcast", shapes)
    return start, twist, xp.broadcast_to(load, shape), dt
