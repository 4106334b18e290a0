"""Inputs of rollouts over `xp`, checked for both front ends."""

from __future__ import annotations

from typing import Any

from planarfriction import validation
from planarfriction.errors import InvalidValueError
from planarfriction.families import MODELS
from planarfriction.tensors.inputs import broadcast, finite, non_negative, shaped
from planarfriction.tensors.steps import TensorModel

METHODS = ("adjoint", "eager")
"""The compiled rollout with its discrete adjoint; each step as operations of the tensor library."""


def checked(
    model: TensorModel, kind: type, front: str, state: Any, twist: Any, normal_force: Any, dt: Any, method: str | None
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
