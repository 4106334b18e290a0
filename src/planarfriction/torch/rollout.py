"""Rollouts of many steps: every step recorded by autograd, or the compiled discrete adjoint."""

from __future__ import annotations

from collections.abc import Sequence

import torch
from torch import Tensor

from planarfriction.derivatives import Rollout
from planarfriction.errors import InvalidValueError
from planarfriction.tensors.namespace import rollout_inputs
from planarfriction.tensors.operations import (
    RolloutOperation,
    SceneOperation,
    simulator,
)
from planarfriction.torch import adjoint
from planarfriction.torch.base import FrictionModule
from planarfriction.torch.namespace import xp


def rollout(
    model: FrictionModule,
    state: Tensor | None,
    twist: Tensor,
    normal_force: Tensor | float,
    dt: Tensor | float,
    *,
    parameters: Tensor | None = None,
    method: str | None = None,
) -> Rollout[Tensor]:
    """Step a model from `state` (None: at rest) through `twist` `[..., T, 3]`, each constant for `dt` [s].

    `normal_force` broadcasts with `[..., T]`: one number, one for each step `[T]`, or one for each contact `[..., 1]`.
    Gradients reach the parameters of the model, `state`, `twist`, `normal_force` and `parameters`.

    `method` is `"adjoint"`, the compiled rollout with its discrete adjoint (on the CPU, first derivatives), or
    `"eager"`, PyTorch operations step by step (any model and device, derivatives of any order, also with respect to
    `dt`; on a pad with a common compliance, which is always eager, up to the second); None uses the adjoint if it can.

    Raises `InvalidValueError` as a step does (see `TensorModel`), and for a method that is not possible.
    """
    front = "planarfriction.torch"
    inputs = rollout_inputs(
        model, FrictionModule, front, state, twist, normal_force, dt, method
    )
    start, twist, load, step = inputs
    if step.ndim:
        raise InvalidValueError("dt", "be one number", f"shape {list(step.shape)}")
    if twist.shape[-2] == 0:
        raise InvalidValueError(
            "twist", "have T > 0 steps", f"shape {list(twist.shape)}"
        )
    pack, buffers, weights = model.compiled()
    obstacle = _obstacle(model, buffers, *inputs)
    if method == "adjoint" and obstacle:
        raise InvalidValueError("method", f"be 'eager' {obstacle}", repr(method))
    if method == "eager" or obstacle:
        return Rollout(*model.rollout(*inputs, parameters=parameters))
    cells = len(weights) > 0
    weighs = any(each.requires_grad for each in weights)
    operation = RolloutOperation(pack, len(model.state_shape), cells, weighs)
    inputs = (start, twist, load)
    return Rollout(
        *adjoint.call(
            operation, (step, *buffers), *inputs, model._vector(parameters), *weights
        )
    )


def _obstacle(
    model: FrictionModule, buffers: Sequence[Tensor], *tensors: Tensor
) -> str:
    """Return the reason why the adjoint cannot be used, or an empty text."""
    if any(tensor.device.type != "cpu" for tensor in (*tensors, model.physical.values)):
        return "for tensors that are not on the processor"
    if tensors[-1].requires_grad:
        return "for a gradient to dt"
    if model.compliance is not None:
        return "for a pad with a common compliance"
    if any(buffer.requires_grad for buffer in buffers):
        return "for a gradient to the numbers of the patch"
    return "inside torch.compile" if torch.compiler.is_compiling() else ""


def tracking_loss(
    model: FrictionModule,
    state: Tensor | None,
    twist: Tensor,
    normal_force: Tensor | float,
    dt: Tensor | float,
    wrenches: Tensor,
    *,
    parameters: Tensor | None = None,
    method: str | None = None,
) -> Tensor:
    """Return the mean squared error of a `rollout` against measured `wrenches` `[..., T, 3]`, relative to the load.

    `mean(((fx - fx*)/f_N)^2 + ((fy - fy*)/f_N)^2 + ((tau - tau*)/(f_N r))^2)` over the samples with load. The scales
    are constants; r is that of the patch. The other arguments are those of `rollout`.

    Raises InvalidValueError as `rollout` does.
    """
    run = rollout(
        model, state, twist, normal_force, dt, parameters=parameters, method=method
    )
    measured = model._number("wrenches", wrenches)
    load = model._number("normal_force", normal_force).detach()[..., None]
    loaded = load > 0.0
    one = torch.ones_like(model.lever)
    lever = torch.stack([one, one, model.lever]).to(load)
    error = torch.where(
        loaded,
        (run.wrenches - measured) / (torch.where(loaded, load, 1.0) * lever),
        0.0,
    )
    count = loaded.expand(
        torch.broadcast_shapes(loaded.shape, (*error.shape[:-1], 1))
    ).sum()
    return (error * error).sum() / count.clamp(min=1)


simulate_scene = simulator(
    xp,
    lambda function, numbers: adjoint.call(SceneOperation(function, {}), (), numbers),
)
