"""Roll-outs of many steps: every step recorded by autograd, or the compiled discrete adjoint."""

from __future__ import annotations

from typing import NamedTuple

import torch
from torch import Tensor

from planarfriction import validation
from planarfriction.equality import by_parts
from planarfriction.errors import InvalidValueError
from planarfriction.families import MODELS
from planarfriction.torch import adjoint, inputs
from planarfriction.torch.base import Compiled, FrictionModel

METHODS = ("adjoint", "eager")
"""Compiled roll-out with its discrete adjoint; every step an operation of PyTorch, recorded by autograd."""


@by_parts
class Rollout(NamedTuple):
    """Result of stepping a model through T twists and loads."""

    state: Tensor
    """State after the last step, `[..., *components]`."""
    wrenches: Tensor
    """Wrench on the moving body at the end of each step, `[..., T, 3]` [N, N, N m]."""


def rollout(
    model: FrictionModel,
    state: Tensor | None,
    twist: Tensor,
    normal_force: Tensor | float,
    dt: Tensor | float,
    *,
    parameters: Tensor | None = None,
    method: str | None = None,
) -> Rollout:
    """Step a model from `state` (None: at rest) through `twist` `[..., T, 3]`, each held for `dt` [s].

    `normal_force` broadcasts with `[..., T]`: one number, one for each step `[T]`, or one for each contact `[..., 1]`.
    Gradients reach the parameters of the model, `state`, `twist`, `normal_force` and `parameters`.

    `method` is `"adjoint"`, the compiled roll-out with its discrete adjoint (reduced models on the CPU, first
    derivatives), or `"eager"`, PyTorch operations step by step (any model and device, derivatives of any order, also
    with respect to `dt`); None uses the adjoint if possible.

    Raises `InvalidValueError` as a step does (see `FrictionModel`), and for a method that is not possible.
    """
    if not isinstance(model, FrictionModel):
        kind = type(model)
        rule = f"be one of planarfriction.torch ({MODELS.classes()})"
        raise InvalidValueError("model", rule, f"{kind.__module__}.{kind.__name__}")
    if method is not None:
        validation.choice("method", method, METHODS)
    twist, step = model._number("twist", twist), model._number("dt", dt)
    load = model._number("normal_force", normal_force)
    if twist.ndim < 2 or twist.shape[-1] != 3 or twist.shape[-2] == 0:
        raise InvalidValueError("twist", "have shape [..., T, 3] with T > 0", f"shape {list(twist.shape)}")
    if step.ndim:
        raise InvalidValueError("dt", "be one number", f"shape {list(step.shape)}")
    start = model.rest() if state is None else model._number("state", state)
    if start.shape[max(start.ndim - len(model.components), 0) :] != model.components:
        wanted = ", ".join(map(str, model.components))
        raise InvalidValueError("state", f"have shape [..., {wanted}]", f"shape {list(start.shape)}")
    start, twist = inputs.finite("state", start), inputs.finite("twist", twist)
    load, step = inputs.non_negative("normal_force", load), inputs.non_negative("dt", step)
    try:
        load = load.expand(torch.broadcast_shapes(load.shape, twist.shape[-2:-1]))
    except RuntimeError:
        rule = f"broadcast with [..., {twist.shape[-2]}]"
        raise InvalidValueError("normal_force", rule, f"shape {list(load.shape)}") from None
    compiled = model.compiled()
    obstacle = _obstacle(model, compiled, start, twist, load, step)
    if method == "adjoint" and obstacle:
        raise InvalidValueError("method", f"be 'eager' {obstacle}", repr(method))
    if method == "eager" or obstacle or compiled is None:
        return Rollout(*model.roll_out(parameters, start, twist, load, step))
    return Rollout(*adjoint.roll_out(compiled, float(step), start, twist, load, model._vector(parameters)))


def _obstacle(model: FrictionModel, compiled: Compiled | None, *tensors: Tensor) -> str:
    """Why the adjoint cannot be used, or nothing."""
    if compiled is None:
        return f"for {type(model).__name__}"
    if any(tensor.device.type != "cpu" for tensor in (*tensors, model.physical.values)):
        return "for tensors that are not on the processor"
    if tensors[-1].requires_grad:
        return "for a gradient to dt"
    if any(buffer.requires_grad for buffer in compiled.buffers):
        return "for a gradient to the numbers of the patch"
    return "inside torch.compile" if torch.compiler.is_compiling() else ""


def tracking_loss(
    model: FrictionModel,
    state: Tensor | None,
    twist: Tensor,
    normal_force: Tensor | float,
    dt: Tensor | float,
    wrenches: Tensor,
    *,
    parameters: Tensor | None = None,
    method: str | None = None,
) -> Tensor:
    """Mean squared error of a `rollout` compared with measured `wrenches` `[..., T, 3]`, relative to the load.

    `mean(((fx - fx*)/f_N)^2 + ((fy - fy*)/f_N)^2 + ((tau - tau*)/(f_N r))^2)` over the samples with load. The scales
    are constants; r is that of the patch. The other arguments are those of `rollout`.

    Raises InvalidValueError as `rollout` does.
    """
    run = rollout(model, state, twist, normal_force, dt, parameters=parameters, method=method)
    measured, load = (
        model._number("wrenches", wrenches),
        model._number("normal_force", normal_force).detach()[..., None],
    )
    loaded = load > 0.0
    one = torch.ones_like(model.lever)
    lever = torch.stack([one, one, model.lever]).to(load)
    error = torch.where(loaded, (run.wrenches - measured) / (torch.where(loaded, load, 1.0) * lever), 0.0)
    count = loaded.expand(torch.broadcast_shapes(loaded.shape, (*error.shape[:-1], 1))).sum()
    return (error * error).sum() / count.clamp(min=1)
