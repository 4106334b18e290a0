"""The motion of a scene as one differentiable operation over `xp`."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

from planarfriction.derivatives.scene_function import SceneFunction
from planarfriction.equality import by_parts
from planarfriction.errors import InvalidValueError
from planarfriction.scenes.options import MAX_STEPS
from planarfriction.scenes.scene import Scene
from planarfriction.tensors.inputs import broadcast, finite, non_negative, positive, shaped


@by_parts
class SceneMotion(NamedTuple):
    """Motion of a body, and the wrenches of its contacts, at M instants."""

    time: Any
    """Times `[M]` [s]."""
    motion: Any
    """vx, vy, omega, x, y, theta of the body `[..., M, 6]`."""
    wrenches: Any
    """Wrench of one of the identical contacts `[..., M, C, 3]` [N, N, N m]."""


def simulator(xp: Any, call: Callable[..., Sequence[Any]]) -> Callable[..., SceneMotion]:
    """Return `simulate_scene` of a front end, whose `call(function, numbers)` returns motion and wrenches."""

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
        max_steps: int = MAX_STEPS,
    ) -> SceneMotion:
        """Simulate a scene as a differentiable function of tensors of PyTorch or arrays of JAX.

        `parameters` gives factors `[...]` (1 leaves the scene as it is) on mu, mass, inertia and load. `signals` gives
        knots [s], concrete numbers, and values by the name of a signal, `(times [K], values [..., K])`, for `force` and
        `velocity` `[..., K, 3]`, as in `derivatives.scene_sensitivities`. They replace the scene's own signal and are
        interpolated in the same way. `initial` gives components `[...]` of the initial state: vx, vy, omega, x, y,
        theta. Leading axes broadcast, `vmap` adds one in front, and each set of numbers is simulated on its own thread.

        Gradients are those of `derivatives.scene_gradient` (in JAX they simulate once more), forward derivatives those
        of `scene_sensitivities`. First derivatives only; computed in double precision on the CPU.

        Raises `InvalidValueError` for names and numbers out of range, and `SolverError` if the solver fails; inside
        `jax.jit` these end in an error of JAX whose last line names them.
        """
        options = {"t_end": t_end, "rtol": rtol, "atol": atol, "save_every": save_every, "max_steps": max_steps}
        function, numbers = scene_function(xp, scene, parameters, signals, initial, **options)
        motion, wrenches = call(function, numbers)
        return SceneMotion(xp.from_numpy(function.time, numbers), motion, wrenches)

    return simulate_scene


def scene_function(
    xp: Any,
    scene: Scene,
    parameters: Mapping[str, Any] | None,
    signals: Mapping[str, tuple[Any, Any]] | None,
    initial: Mapping[str, Any] | None,
    **options: Any,
) -> tuple[SceneFunction, Any]:
    """Return a scene as a function of numbers, and these numbers `[..., P]`; arguments as in `simulate_scene`.

    Raises InvalidValueError for names and numbers out of range.
    """
    parameters, signals, initial = parameters or {}, signals or {}, initial or {}
    for name, pair in signals.items():
        if not (isinstance(pair, Sequence) and len(pair) == 2):
            raise InvalidValueError(f"signals of {name}", "be a pair of times and values", pair)
    knots = {name: xp.to_numpy(times) for name, (times, _) in signals.items()}
    function = SceneFunction(scene, tuple(parameters), knots, tuple(initial), **options)
    factors = [positive(xp, name, xp.real(name, value))[..., None] for name, value in parameters.items()]
    start = [finite(xp, name, xp.real(name, value))[..., None] for name, value in initial.items()]
    arrays = dict(zip((*parameters, *initial), (*factors, *start), strict=True))
    for name, (_, values) in signals.items():
        of_name, shape = f"values of {name}", function.shapes[name]
        array = shaped(of_name, xp.real(of_name, values), shape)
        check = non_negative if len(shape) == 1 else finite  # a load; a force or a velocity
        arrays[name] = check(xp, of_name, array).reshape(*array.shape[: array.ndim - len(shape)], -1)
    if not arrays:
        return function, xp.real("numbers", [])
    shapes = {name: array.shape[:-1] for name, array in arrays.items()}
    batch = broadcast(xp, "the numbers of a scene", "have axes that broadcast", shapes)
    wide = [xp.broadcast_to(array, (*batch, array.shape[-1])) for array in arrays.values()]
    return function, xp.concatenate(wide, -1)
