"""Compiled computations on NumPy arrays with their derivatives, of which front ends make differentiable operations.

An operation has the numbers of inner axes of its inputs, `inner`, and of its results, `outer`, behind batch axes that
broadcast. `run(held, inputs, keep)` returns the results, and with `keep` also arrays that shorten `pull`; `held` are
arrays without derivative. `push(held, inputs, changes)` returns the changes of the results, `pull(held, inputs, bars,
kept)` the cotangents of the inputs for those of the results.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from planarfriction import derivatives
from planarfriction._support.equality import by_parts
from planarfriction.derivatives.inputs import sum_to
from planarfriction.derivatives.parameters import PackedRollout
from planarfriction.derivatives.rollouts import gradient
from planarfriction.derivatives.scene_function import SceneFunction
from planarfriction.errors import InvalidValueError
from planarfriction.scenes.scene import MAX_STEPS, Scene
from planarfriction.tensors.namespace import (
    broadcast,
    finite,
    non_negative,
    positive,
    shaped,
)

Arrays = Sequence[Any]


class RolloutOperation(NamedTuple):
    """Last state and wrenches of a rollout, of state, twist, load, parameters and any weights; `held` is `dt` and the
    buffers."""

    pack: Callable[..., PackedRollout]
    """Function that makes the parts of the model from weights of cells, if there are any, and the buffers."""
    axes: int
    """Axes of the state of a contact."""
    cells: bool = False
    """True if the weights of cells are the last input."""
    weighs: bool = False
    """True if their cotangent is wanted; it is 0 otherwise."""

    @property
    def inner(self) -> tuple[int, ...]:
        """Number of inner axes of state, twist, load, parameters and any weights."""
        return self.axes, 2, 1, *(1,) * (1 + self.cells)

    @property
    def outer(self) -> tuple[int, ...]:
        """Number of inner axes of the last state and of the wrenches."""
        return self.axes, 2

    def run(self, held: Arrays, inputs: Arrays, keep: bool) -> tuple[Arrays, Arrays]:
        """Return the last state and the wrenches, and with `keep` the states before each step."""
        state, twist, load, parameters, *weights = inputs
        roll = derivatives.rollout_states if keep else derivatives.rollout
        found = roll(
            self.pack(*weights, *held[1:]),
            state,
            twist,
            load,
            float(held[0]),
            parameters=parameters,
        )
        return found[:2], found[2:]

    def push(self, held: Arrays, inputs: Arrays, changes: Arrays) -> Arrays:
        """Return the changes of the last state and of the wrenches, which are linear in the weights."""
        (state, twist, load, parameters, *weights) = inputs
        tangent = derivatives.RolloutTangent(*changes[:4])
        given = (state, twist, load, float(held[0]))
        more = {"parameters": parameters}
        *_, end, wrenches = derivatives.rollout_jvp(
            self.pack(*weights, *held[1:]), *given, tangent, **more
        )
        if self.cells:
            for sign in (1.0, -1.0):  # weights are not negative
                share = np.maximum(sign * changes[4], 0.0)
                if share.any():
                    model = self.pack(share, *held[1:])
                    roll = derivatives.rollout(model, *given, **more)
                    wrenches = wrenches + sign * roll.wrenches
        return end, wrenches

    def pull(self, held: Arrays, inputs: Arrays, bars: Arrays, kept: Arrays) -> Arrays:
        """Return the cotangents of state, twist, load, parameters and any weights."""
        (state, twist, load, parameters, *weights) = inputs
        step = float(held[0])
        more = {"parameters": parameters, "states": kept[0] if kept else None}
        model = self.pack(*weights, *held[1:])
        # Bristles do not see the weights, or their stiffness on a pad follows these.
        found, by_cell = gradient(
            model, state, twist, load, step, bars[1], bars[0], **more, own=0.0, cells=self.weighs
        )  # fmt: skip
        found = found[:4]
        if not self.cells:
            return found
        if not self.weighs:
            return *found, np.zeros(weights[0].shape)
        by_weight = (np.asarray(load)[..., None] * by_cell).sum(axis=-2)
        return *found, sum_to(weights[0].shape, by_weight)


class SceneOperation(NamedTuple):
    """Motion `[..., M, 6]` and wrenches `[..., M, C, 3]` of a scene, of its numbers `[..., P]`."""

    function: SceneFunction
    memory: dict | None = None
    """Simulations that have been run, for `pull`; None to simulate once more."""
    inner = (1,)
    outer = (2, 3)
    like = 0
    keeps = False
    """Index of the input whose number type results have; True if `run` keeps arrays for `pull`."""

    def shapes(self, numbers: Any) -> list[tuple[int, ...]]:
        """Return the shapes of motion and wrenches."""
        return [(*numbers.shape[:-1], *shape) for shape in self.function.results]

    def run(self, held: Arrays, inputs: Arrays, keep: bool) -> tuple[Arrays, Arrays]:
        """Return motion and wrenches."""
        batch, rows = _rows(inputs, self.inner)
        return _shaped(
            batch, self.function.run(rows[0], self.memory if keep else None)
        ), ()

    def push(self, held: Arrays, inputs: Arrays, changes: Arrays) -> Arrays:
        """Return the changes of motion and wrenches."""
        batch, rows = _rows((*inputs, *changes), self.inner * 2)
        return _shaped(batch, self.function.push(rows[0], rows[1]))

    def pull(self, held: Arrays, inputs: Arrays, bars: Arrays, kept: Arrays) -> Arrays:
        """Return the cotangent of the numbers."""
        batch, rows = _rows((*inputs, *bars), (*self.inner, *self.outer))
        return _shaped(
            batch, (self.function.pull(rows[0], rows[1], rows[2], self.memory),)
        )


def _rows(
    arrays: Arrays, inner: Sequence[int]
) -> tuple[tuple[int, ...], list[np.ndarray]]:
    """Return the common batch axes of arrays, and the arrays with one axis instead of these."""
    each = [
        (array, array.ndim - axes) for array, axes in zip(arrays, inner, strict=True)
    ]
    batch = np.broadcast_shapes(*(array.shape[:own] for array, own in each))
    full = [
        (np.broadcast_to(array, (*batch, *array.shape[own:])), array.shape[own:])
        for array, own in each
    ]
    return batch, [
        np.ascontiguousarray(array).reshape(-1, *shape) for array, shape in full
    ]


def _shaped(batch: tuple[int, ...], arrays: Arrays) -> Arrays:
    return [array.reshape(*batch, *array.shape[1:]) for array in arrays]


@by_parts
class SceneMotion(NamedTuple):
    """Motion of a body, and the wrenches of its contacts, at M instants."""

    time: Any
    """Times `[M]` [s]."""
    motion: Any
    """vx, vy, omega, x, y, theta of the body `[..., M, 6]`."""
    wrenches: Any
    """Wrench of one of the identical contacts `[..., M, C, 3]` [N, N, N m]."""


def simulator(
    xp: Any, call: Callable[..., Sequence[Any]]
) -> Callable[..., SceneMotion]:
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
        options = {
            "t_end": t_end,
            "rtol": rtol,
            "atol": atol,
            "save_every": save_every,
            "max_steps": max_steps,
        }
        function, numbers = scene_function(
            xp, scene, parameters, signals, initial, **options
        )
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
    parameters = parameters or {}
    signals = signals or {}
    initial = initial or {}
    for name, pair in signals.items():
        if not (isinstance(pair, Sequence) and len(pair) == 2):
            raise InvalidValueError(
                f"signals of {name}", "be a pair of times and values", pair
            )
    knots = {name: xp.to_numpy(times) for name, (times, _) in signals.items()}
    function = SceneFunction(scene, tuple(parameters), knots, tuple(initial), **options)
    factors = [
        positive(xp, name, xp.real(name, value))[..., None]
        for name, value in parameters.items()
    ]
    start = [
        finite(xp, name, xp.real(name, value))[..., None]
        for name, value in initial.items()
    ]
    arrays = dict(zip((*parameters, *initial), (*factors, *start), strict=True))
    for name, (_, values) in signals.items():
        of_name = f"values of {name}"
        shape = function.shapes[name]
        array = shaped(of_name, xp.real(of_name, values), shape)
        # A load; a force or a velocity.
        check = non_negative if len(shape) == 1 else finite
        arrays[name] = check(xp, of_name, array).reshape(
            *array.shape[: array.ndim - len(shape)], -1
        )
    if not arrays:
        return function, xp.real("numbers", [])
    shapes = {name: array.shape[:-1] for name, array in arrays.items()}
    batch = broadcast(xp, "the numbers of a scene", "have axes that broadcast", shapes)
    wide = [
        xp.broadcast_to(array, (*batch, array.shape[-1])) for array in arrays.values()
    ]
    return function, xp.concatenate(wide, -1)
