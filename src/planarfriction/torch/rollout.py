"""Roll-outs of many steps: every step recorded by autograd, or the compiled discrete adjoint."""

from __future__ import annotations

from typing import NamedTuple

import torch
from torch import Tensor

from planarfriction import validation
from planarfriction.errors import InvalidValueError
from planarfriction.torch.base import PlanarLuGre

METHODS = ("adjoint", "eager")


class Rollout(NamedTuple):
    """A roll-out of T steps."""

    wrenches: Tensor
    """Wrenches at the end of each step, `[..., T, 3]` [N, N, N m]."""
    state: Tensor
    """State after the last step, `[..., *components]`."""


def simulate(
    model: PlanarLuGre,
    v_profile: Tensor,
    f_n: Tensor | float,
    dt: float,
    *,
    z: Tensor | None = None,
    parameters: Tensor | None = None,
    method: str | None = None,
) -> Tensor:
    """Wrenches `[..., T, 3]` of the twists `v_profile` `[..., T, 3]`, each held for `dt` [s]; see `rollout`."""
    return rollout(model, v_profile, f_n, dt, z=z, parameters=parameters, method=method).wrenches


def rollout(
    model: PlanarLuGre,
    v_profile: Tensor,
    f_n: Tensor | float,
    dt: float,
    *,
    z: Tensor | None = None,
    parameters: Tensor | None = None,
    method: str | None = None,
) -> Rollout:
    """Wrenches and the last state of `model.step` through the twists `v_profile` `[..., T, 3]`.

    The loads `f_n` broadcast with `[..., T]`: one number, one for each step `[T]`, or one for each contact `[..., 1]`.
    `z` is the state at the start (None: at rest). Gradients reach the parameters of the model, `v_profile`, `f_n`,
    `z` and `parameters`.
    """
    validation.choice("method", method or "eager", METHODS)
    v_profile = model._number(v_profile)
    if v_profile.ndim < 2 or v_profile.shape[-1] != 3 or v_profile.shape[-2] == 0:
        raise InvalidValueError("v_profile", "have shape [..., T, 3] with T > 0", f"shape {list(v_profile.shape)}")
    loads = model._number(f_n)
    start = model.rest() if z is None else z
    return Rollout(*model.roll_out(parameters, start, v_profile, loads, model._number(dt)))


def tracking_loss(
    model: PlanarLuGre, v_profile: Tensor, reference: Tensor, f_n: Tensor | float, dt: float, **options
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
