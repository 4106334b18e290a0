"""Roll-outs of many steps: every step recorded by autograd, or the compiled discrete adjoint."""

from __future__ import annotations

from typing import NamedTuple

import torch
from torch import Tensor

from planarfriction import validation
from planarfriction.errors import InvalidValueError
from planarfriction.torch import adjoint
from planarfriction.torch.base import FrictionModel
from planarfriction.torch.published import ReducedModelPublished

METHODS = ("adjoint", "eager")
"""Compiled roll-out with its discrete adjoint; every step an operation of PyTorch, recorded by autograd."""


class Rollout(NamedTuple):
    """A roll-out of T steps."""

    wrenches: Tensor
    """Wrenches at the end of each step, `[..., T, 3]` [N, N, N m]."""
    state: Tensor
    """State after the last step, `[..., *components]`."""


def simulate(
    model: FrictionModel,
    v_profile: Tensor,
    f_n: Tensor | float,
    dt: Tensor | float,
    *,
    z: Tensor | None = None,
    parameters: Tensor | None = None,
    method: str | None = None,
) -> Tensor:
    """Wrenches `[..., T, 3]` of the twists `v_profile` `[..., T, 3]`, each held for `dt` [s]; see `rollout`."""
    return rollout(model, v_profile, f_n, dt, z=z, parameters=parameters, method=method).wrenches


def rollout(
    model: FrictionModel,
    v_profile: Tensor,
    f_n: Tensor | float,
    dt: Tensor | float,
    *,
    z: Tensor | None = None,
    parameters: Tensor | None = None,
    method: str | None = None,
) -> Rollout:
    """Wrenches and the last state of `model.step` through the twists `v_profile` `[..., T, 3]`.

    The loads `f_n` broadcast with `[..., T]`: one number, one for each step `[T]`, or one for each contact `[..., 1]`.
    `z` is the state at the start (None: at rest). Gradients reach the parameters of the model, `v_profile`, `f_n`,
    `z` and `parameters`.

    `method` is `"adjoint"`, the compiled roll-out with its discrete adjoint (reduced model on the processor, first
    derivatives), or `"eager"`, PyTorch operations step by step (any model and device, derivatives of any order, also
    to `dt`); None takes the adjoint where it can.

    Raises `InvalidValueError` for wrong shapes and for a method that is not possible; the adjoint also for numbers that
    are not finite and for loads below zero.
    """
    if method is not None:
        validation.choice("method", method, METHODS)
    v_profile, loads, step = model._number(v_profile), model._number(f_n), model._number(dt)
    if v_profile.ndim < 2 or v_profile.shape[-1] != 3 or v_profile.shape[-2] == 0:
        raise InvalidValueError("v_profile", "have shape [..., T, 3] with T > 0", f"shape {list(v_profile.shape)}")
    if step.ndim:
        raise InvalidValueError("dt", "be one number", f"shape {list(step.shape)}")
    start = model.rest() if z is None else model._number(z)
    try:
        loads = loads.expand(torch.broadcast_shapes(loads.shape, v_profile.shape[-2:-1]))
    except RuntimeError:
        rule = f"broadcast with [..., {v_profile.shape[-2]}]"
        raise InvalidValueError("f_n", rule, f"shape {list(loads.shape)}") from None
    obstacle = _obstacle(model, start, v_profile, loads, step)
    if method == "adjoint" and obstacle:
        raise InvalidValueError("method", f"be 'eager' {obstacle}", repr(method))
    if method == "eager" or obstacle:
        return Rollout(*model.roll_out(parameters, start, v_profile, loads, step))
    return Rollout(*adjoint.roll_out(model.reference, float(step), start, v_profile, loads, model._vector(parameters)))


def _obstacle(model: FrictionModel, *tensors: Tensor) -> str:
    """Why the adjoint cannot be used, or nothing."""
    if not isinstance(model, ReducedModelPublished):
        return f"for {type(model).__name__}"
    if any(tensor.device.type != "cpu" for tensor in (*tensors, model.physical.values)):
        return "for tensors that are not on the processor"
    if tensors[-1].requires_grad:
        return "for a gradient to dt"
    return "inside torch.compile" if torch.compiler.is_compiling() else ""


def tracking_loss(
    model: FrictionModel, v_profile: Tensor, reference: Tensor, f_n: Tensor | float, dt: float, **options
) -> Tensor:
    """Mean squared error of the wrench against `reference` `[..., T, 3]`: forces by the load, torque by load times r.

    `mean(((fx - fx*)/f_N)^2 + ((fy - fy*)/f_N)^2 + ((tau - tau*)/(f_N r))^2)` over the samples with load. The scales
    are constants, r that of the patch. `options` are those of `simulate`.
    """
    wrenches = simulate(model, v_profile, f_n, dt, **options)
    reference, load = model._number(reference), model._number(f_n).detach()[..., None]
    loaded = load > 0.0
    lever = load.new_tensor([1.0, 1.0, model.lever])
    error = torch.where(loaded, (wrenches - reference) / (torch.where(loaded, load, 1.0) * lever), 0.0)
    count = loaded.expand(torch.broadcast_shapes(loaded.shape, (*error.shape[:-1], 1))).sum()
    return (error * error).sum() / count.clamp(min=1)
