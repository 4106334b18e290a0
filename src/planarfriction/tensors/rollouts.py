"""Inputs of rollouts over `xp`, checked for both front ends."""

from __future__ import annotations

from typing import Any, NamedTuple

from planarfriction import validation
from planarfriction.equality import by_parts
from planarfriction.errors import InvalidValueError
from planarfriction.families import MODELS
from planarfriction.tensors.inputs import broadcast, finite, non_negative, shaped
from planarfriction.tensors.steps import TensorModel

METHODS = ("adjoint", "eager")
"""The compiled rollout with its discrete adjoint; each step as operations of the tensor library."""


@by_parts
class Rollout(NamedTuple):
    """Result of stepping a model through T twists and loads."""

    state: Any
    """State after the last step, `[..., *state_shape]`."""
    wrenches: Any
    """Wrench on the moving body at the end of each step, `[..., T, 3]` [N, N, N m]."""


class RolloutInputs(NamedTuple):
    """Checked inputs of a rollout, as arrays whose batch axes broadcast."""

    state: Any
    """State before the first step, `[..., *state_shape]`."""
    twist: Any
    """`[..., T, 3]`"""
    normal_force: Any
    """`[..., T]`"""
    dt: Any


def checked(
    model: TensorModel, kind: type, front: str, state: Any, twist: Any, normal_force: Any, dt: Any, method: str | None
) -> RolloutInputs:
    """Return the inputs of a rollout of a model, which must be of the front end's `kind`, from `state` (None: at rest).

    Raises InvalidValueError, naming the input.
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
    return RolloutInputs(start, twist, xp.broadcast_to(load, shape), dt)
