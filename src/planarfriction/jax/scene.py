"""The motion of a scene as one differentiable operation of JAX."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax.interpreters import ad

from planarfriction.derivatives.scene_function import SceneFunction
from planarfriction.equality import by_parts
from planarfriction.errors import FrictionError, InvalidValueError
from planarfriction.jax import inputs
from planarfriction.jax.adjoint import primitive_of, transposed
from planarfriction.scenes.scene import Scene


@by_parts
class SceneMotion(NamedTuple):
    """Motion of a body, and the wrenches of its contacts, at M instants."""

    time: jax.Array
    """Times `[M]` [s]."""
    motion: jax.Array
    """vx, vy, omega, x, y, theta of the body `[..., M, 6]`."""
    wrenches: jax.Array
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
    """Simulate a scene as a differentiable function of arrays.

    `parameters` gives factors `[...]` (1 leaves the scene as it is) on mu, mass, inertia and load. `signals` gives
    knots [s], which must be concrete numbers, and values by the name of a signal as in
    `derivatives.scene_sensitivities`,
    `(times [K], values [..., K])`, for `force` and `velocity` `[..., K, 3]`. They replace the scene's own signal and
    are interpolated in the same way. `initial` gives components `[...]` of the initial state: vx, vy, omega, x, y,
    theta. Leading axes broadcast, and each set of numbers is a separate simulation on its own thread; `vmap` adds an
    axis in front.

    Reverse derivatives are those of `derivatives.scene_gradient`, which simulates once more; forward derivatives are
    those of `scene_sensitivities`. First derivatives only; computed in double precision on the CPU.

    Raises `InvalidValueError` for names and numbers out of range, and `SolverError` if the solver fails; inside `jit`
    these end in an error of JAX whose last line names them.
    """
    parameters, signals, initial = parameters or {}, signals or {}, initial or {}
    for name, pair in signals.items():
        if not (isinstance(pair, Sequence) and len(pair) == 2):
            raise InvalidValueError(f"signals of {name}", "be a pair of times and values", pair)
    options = {"t_end": t_end, "rtol": rtol, "atol": atol, "save_every": save_every}
    knots = {name: np.asarray(times) if isinstance(times, jax.Array) else times for name, (times, _) in signals.items()}
    function = SceneFunction(scene, tuple(parameters), knots, tuple(initial), **options)
    factors = [(name, inputs.non_negative(name, inputs.real(name, value))) for name, value in parameters.items()]
    start = [(name, inputs.real(name, value)) for name, value in initial.items()]
    named = [(name, value[..., None]) for name, value in (*factors, *start)]
    for name, (_, values) in signals.items():
        shape = function.shapes[name]
        array = inputs.shaped(f"values of {name}", inputs.real(name, values), shape)
        if len(shape) == 1:
            array = inputs.non_negative(f"values of {name}", array)
        named.append((name, array.reshape(*array.shape[: array.ndim - len(shape)], -1)))
    arrays = [inputs.finite(name, array) for name, array in named]
    try:
        batch = jnp.broadcast_shapes(*(array.shape[:-1] for array in arrays))
    except ValueError:
        shapes = ", ".join(str(list(array.shape[:-1])) for array in arrays)
        raise InvalidValueError("the numbers of a scene", "have axes that broadcast", f"shapes {shapes}") from None
    wide = [jnp.broadcast_to(array, (*batch, array.shape[-1])) for array in arrays]
    numbers = jnp.concatenate(wide, axis=-1) if wide else jnp.zeros(0)
    motion, wrenches = _simulate.bind(numbers, kind=function, outer=0, kept=False)
    return SceneMotion(jnp.asarray(function.time, numbers.dtype), motion, wrenches)


def _rows(inner: Sequence[int], arrays) -> tuple[tuple[int, ...], list[np.ndarray]]:
    """The axes in front of the last `inner` ones of each array, and the arrays with one axis in their place."""
    plain = [np.asarray(array, float) for array in arrays]
    batch = np.broadcast_shapes(*(array.shape[: array.ndim - axes] for array, axes in zip(plain, inner, strict=True)))
    shapes = [array.shape[array.ndim - axes :] for array, axes in zip(plain, inner, strict=True)]
    full = [np.broadcast_to(array, (*batch, *shape)) for array, shape in zip(plain, shapes, strict=True)]
    return batch, [np.ascontiguousarray(a).reshape(-1, *shape) for a, shape in zip(full, shapes, strict=True)]


def _called(call: str, inner: Sequence[int]):
    """A callback to a method of `SceneFunction`."""

    def callback(function: SceneFunction, kept: bool, dtypes, *arrays) -> tuple[np.ndarray, ...]:
        batch, rows = _rows(inner, arrays)
        found = getattr(function, call)(*rows)
        found = found if isinstance(found, tuple) else (found,)
        each = zip(found, dtypes, strict=True)
        return tuple(value.reshape(*batch, *value.shape[1:]).astype(dtype) for value, dtype in each)

    return callback


def _of_motion(operands, kept: bool, kind: SceneFunction):
    batch, dtype = operands[0].shape[:-1], operands[0].dtype
    return [((*batch, *shape), dtype) for shape in kind.results]


def _of_numbers(operands, kept: bool, kind: SceneFunction):
    return [(operands[0].shape, operands[0].dtype)]


_simulate = primitive_of("simulate_scene", _called("run", (1,)), _of_motion)
_push = primitive_of("push_scene", _called("push", (1, 1)), _of_motion)
_pull = primitive_of("pull_scene", _called("pull", (1, 2, 3)), _of_numbers)


def _jvp(primals, tangents, **options):
    (change,) = (ad.instantiate_zeros(tangent) for tangent in tangents)
    return _simulate.bind(*primals, **options), _push.bind(*primals, change, **options)


def _linear(primitive):
    """The derivative of what is linear in all but the numbers of the scene."""

    def jvp(primals, tangents, **options):
        if type(tangents[0]) is not ad.Zero:
            raise FrictionError("the motion of a scene has first derivatives only")
        dots = [ad.instantiate_zeros(tangent) for tangent in tangents[1:]]
        return primitive.bind(*primals, **options), primitive.bind(primals[0], *dots, **options)

    ad.primitive_jvps[primitive] = jvp


ad.primitive_jvps[_simulate] = _jvp
_linear(_push)
_linear(_pull)
transposed(_push, _pull, 1)
transposed(_pull, _push, 2)
