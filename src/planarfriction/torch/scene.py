"""The motion of a scene as one differentiable operation of PyTorch."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from planarfriction.scenes.scene import Scene
from planarfriction.tensors.operations import SceneOperation
from planarfriction.tensors.scenes import SceneMotion, scene_function
from planarfriction.torch.adjoint import call
from planarfriction.torch.namespace import xp


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
    knots [s] and values by the name of a signal, `(times [K], values [..., K])`, for `force` and `velocity`
    `[..., K, 3]`, as in `derivatives.scene_sensitivities`. They replace the scene's own signal and are interpolated in
    the same way. `initial` gives components `[...]` of the initial state: vx, vy, omega, x, y, theta. Leading axes
    broadcast, and each set of numbers is a separate simulation on its own thread.

    Gradients are those of `derivatives.scene_gradient`, forward derivatives (`jvp`) those of `scene_sensitivities`.
    First derivatives only; computed in double precision on the CPU.

    Raises `InvalidValueError` for names and numbers out of range, and `SolverError` if the solver fails.
    """
    options = {"t_end": t_end, "rtol": rtol, "atol": atol, "save_every": save_every}
    function, numbers = scene_function(xp, scene, parameters, signals, initial, **options)
    motion, wrenches = call(SceneOperation(function, {}), (), numbers)
    return SceneMotion(xp.from_numpy(function.time, motion), motion, wrenches)
