"""The motion of a scene as one differentiable operation of PyTorch."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import torch
from torch import Tensor

from planarfriction.derivatives.scene_function import SceneFunction
from planarfriction.equality import by_parts
from planarfriction.errors import InvalidValueError
from planarfriction.scenes.scene import Scene
from planarfriction.torch import inputs
from planarfriction.torch.adjoint import First


@by_parts
class SceneMotion(NamedTuple):
    """Motion of a body, and the wrenches of its contacts, at M instants."""

    time: Tensor
    """Times `[M]` [s]."""
    motion: Tensor
    """vx, vy, omega, x, y, theta of the body `[..., M, 6]`."""
    wrenches: Tensor
    """Wrench of one of the identical contacts `[..., M, C, 3]` [N, N, N m]."""


def simulate_scene(
    scene: Scene,
    parameters: Mapping[str, Any] | None = None,
    *,
    signals: Mapping[str, tuple[Any, Any]] | None = None,
    initial: Mapping[str, Any] | None = None,
    t_end: float | None = None,
    rtol: float = 1e-9,
    atol: float | None = None,
    save_every: float | None = None,
) -> SceneMotion:
    """Simulate a scene as a differentiable function of tensors.

    `parameters` gives factors `[...]` (1 leaves the scene as it is) on mu, mass, inertia and load. `signals` gives
    knots [s] and values by the name of a signal as in `derivatives.scene_sensitivities`, `(times [K], values [...,
    K])`,
    for `force` and `velocity` `[..., K, 3]`. They replace the scene's own signal and are interpolated in the same way.
    `initial` gives components `[...]` of the initial state: vx, vy, omega, x, y, theta. Leading axes broadcast, and
    each set of numbers is a separate simulation on its own thread.

    Gradients with respect to all of the tensors are those of `derivatives.scene_gradient`; forward derivatives (`jvp`)
    are those of `scene_sensitivities`. First derivatives only; computed in double precision on the CPU.

    Raises `InvalidValueError` for names and numbers out of range, and `SolverError` if the solver fails.
    """
    parameters, signals, initial = parameters or {}, signals or {}, initial or {}
    for name, pair in signals.items():
        if not (isinstance(pair, Sequence) and len(pair) == 2):
            raise InvalidValueError(f"signals of {name}", "be a pair of times and values", pair)
    options = {"t_end": t_end, "rtol": rtol, "atol": atol, "save_every": save_every}
    knots = {name: _plain(times) for name, (times, _) in signals.items()}
    function = SceneFunction(scene, tuple(parameters), knots, tuple(initial), **options)
    like = torch.empty((), dtype=torch.float64)
    named = [
        (name, inputs.real(name, value, like)[..., None]) for name, value in (*parameters.items(), *initial.items())
    ]
    for name, (_, values) in signals.items():
        tensor, shape = inputs.real(name, values, like), function.shapes[name]
        if tuple(tensor.shape[max(tensor.ndim - len(shape), 0) :]) != shape:
            wanted = ", ".join(map(str, shape))
            raise InvalidValueError(f"values of {name}", f"have shape [..., {wanted}]", f"shape {list(tensor.shape)}")
        named.append((name, tensor.flatten(-2) if len(shape) == 2 else tensor))
    tensors = [inputs.finite(name, tensor) for name, tensor in named]
    try:
        batch = torch.broadcast_shapes(*(tensor.shape[:-1] for tensor in tensors))
    except RuntimeError:
        shapes = ", ".join(str(list(tensor.shape[:-1])) for tensor in tensors)
        raise InvalidValueError("the numbers of a scene", "have axes that broadcast", f"shapes {shapes}") from None
    numbers = torch.cat([tensor.expand(*batch, -1) for tensor in tensors], dim=-1) if tensors else like.new_empty(0)
    kept = {} if torch.is_grad_enabled() and numbers.requires_grad else None
    found: Any = _Simulate.apply(function, kept, numbers)
    return SceneMotion(torch.from_numpy(function.time.copy()).to(found[0].dtype), *found)


def _plain(times: Any) -> Any:
    return times.detach().cpu().numpy() if isinstance(times, Tensor) else times


def _rows(tensor: Tensor, inner: int) -> np.ndarray:
    """Numbers `[B, ...]` in double precision, the last `inner` axes as they are."""
    plain = tensor.detach().to("cpu", torch.float64).contiguous()
    return plain.reshape(-1, *plain.shape[plain.ndim - inner :]).numpy()


def _shaped(array: np.ndarray, batch: torch.Size, like: Tensor) -> Tensor:
    return torch.from_numpy(array).to(like).reshape(*batch, *array.shape[1:])


class _Simulate(torch.autograd.Function):
    """Motion and wrenches of numbers `[..., P]`; the ways that they took are `kept` for the way back."""

    @staticmethod
    def forward(function: SceneFunction, kept: dict | None, numbers: Tensor):
        found = function.run(_rows(numbers, 1), kept)
        return tuple(_shaped(array, numbers.shape[:-1], numbers) for array in found)

    @staticmethod
    def setup_context(ctx, inputs, output):
        ctx.function, ctx.kept, numbers = inputs
        ctx.save_for_backward(numbers)
        ctx.save_for_forward(numbers)

    @staticmethod
    def backward(ctx, *bars):
        return None, None, _Pull.apply(ctx.function, ctx.kept, ctx.saved_tensors[0], *bars)

    @staticmethod
    def jvp(ctx, _, __, change):
        return _Push.apply(ctx.function, ctx.saved_tensors[0], change)

    @staticmethod
    def vmap(info, in_dims, function, kept, numbers):
        return _Simulate.apply(function, kept, numbers.movedim(in_dims[2], 0)), (0, 0)


class _Pull(First):
    """Cotangents of the numbers from those of motion and wrenches."""

    @staticmethod
    def forward(function: SceneFunction, kept: dict | None, numbers: Tensor, *bars: Tensor):
        slopes = function.pull(_rows(numbers, 1), _rows(bars[0], 2), _rows(bars[1], 3), kept)
        return _shaped(slopes, numbers.shape[:-1], numbers)

    @staticmethod
    def vmap(info, in_dims, function, kept, *tensors):
        return _Pull.apply(function, kept, *_fronted(info.batch_size, in_dims[2:], tensors)), 0


class _Push(First):
    """Changes of motion and wrenches with those of the numbers."""

    @staticmethod
    def forward(function: SceneFunction, numbers: Tensor, change: Tensor):
        found = function.push(_rows(numbers, 1), _rows(change, 1))
        return tuple(_shaped(array, numbers.shape[:-1], numbers) for array in found)

    @staticmethod
    def vmap(info, in_dims, function, *tensors):
        return _Push.apply(function, *_fronted(info.batch_size, in_dims[1:], tensors)), (0, 0)


def _fronted(size: int, dims, tensors) -> list[Tensor]:
    """The mapped axis of each in front."""
    return [
        tensor.expand(size, *tensor.shape) if dim is None else tensor.movedim(dim, 0)
        for tensor, dim in zip(tensors, dims, strict=True)
    ]
