"""The motion of a scene as one differentiable operation of JAX."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from planarfriction.jax.adjoint import call
from planarfriction.jax.callbacks import HostScene
from planarfriction.jax.namespace import xp
from planarfriction.scenes.scene import Scene
from planarfriction.tensors.scenes import SceneMotion, scene_function


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
    """Simulate a scene as a differentiable function of arrays.

    `parameters` gives factors `[...]` (1 leaves the scene as it is) on mu, mass, inertia and load. `signals` gives
    knots [s], which must be concrete numbers, and values by the name of a signal, `(times [K], values [..., K])`, for
    `force` and `velocity` `[..., K, 3]`, as in `derivatives.scene_sensitivities`. They replace the scene's own signal
    and are interpolated in the same way. `initial` gives components `[...]` of the initial state: vx, vy, omega, x, y,
    theta. Leading axes broadcast, and each set of numbers is a separate simulation on its own thread; `vmap` adds an
    axis in front.

    Gradients are those of `derivatives.scene_gradient`, which simulates once more; forward derivatives are those of
    `scene_sensitivities`. First derivatives only; computed in double precision on the CPU.

    Raises `InvalidValueError` for names and numbers out of range, and `SolverError` if the solver fails; inside `jit`
    these end in an error of JAX whose last line names them.
    """
    options = {"t_end": t_end, "rtol": rtol, "atol": atol, "save_every": save_every}
    function, numbers = scene_function(xp, scene, parameters, signals, initial, **options)
    motion, wrenches = call(HostScene(function), (), numbers)
    return SceneMotion(xp.from_numpy(function.time, numbers), motion, wrenches)
