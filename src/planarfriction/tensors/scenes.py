"""The motion of a scene as a function of arrays over `xp`: its arguments, checked for both front ends."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from planarfriction.derivatives.scene_function import SceneFunction
from planarfriction.equality import by_parts
from planarfriction.errors import InvalidValueError
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
