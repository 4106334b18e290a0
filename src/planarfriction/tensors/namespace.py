"""The array namespace `xp`: operations under one name in PyTorch and JAX, with finite derivatives at every kink.

Inputs are checked here too: shapes always, values where they can be read without waiting. Elsewhere (on a device,
inside `jit`, `vmap`, `grad` or `torch.compile`) a load or a time step below zero counts as zero, so that friction never
drives; NaN stays NaN.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from planarfriction._support import validation
from planarfriction.errors import InvalidValueError
from planarfriction.families import MODELS
from planarfriction.tensors.elements import over

_SAME = (
    *(
        "exp",
        "sin",
        "cos",
        "sqrt",
        "log",
        "pow",
        "arctan2",
        "clip",
        "finfo",
        "ones_like",
        "full_like",
    ),
    *("stack", "concatenate", "moveaxis", "broadcast_to", "broadcast_shapes"),
    "linalg",
)
"""Functions that PyTorch and JAX have with the same name and the same leading arguments."""


class Namespace:
    """Operations on the arrays of one library, as formulas and checks of inputs need them; some are the library's own:

    - `broadcast_arrays(*arrays)`; `stop_gradient(x)`, a constant for differentiation; `integers(x)`, towards zero
    - `real(name, value, like=None)`: an array of real numbers, which keeps its precision and its device. Anything else
      takes both from `like`, if given; InvalidValueError if it is not numeric.
    - `extremes(name, value)`: smallest and largest number, or None if there is none to read without waiting;
      InvalidValueError outside the range of `validation.within_range`.
    - `pressing(u, v, share, x, y, narrow)`: the cells at (u, v) with shares of a load that press where it is at (x, y),
      bool `[..., N]`, by the rule of `cells.moment_pressure` in its scaled coordinates; without derivatives
    - `until(body, start, most)`: the last state of `done, state = body(state)`, which runs until `done` or `most` times
    - `repeat(body, state, times)`: the last result of `state, result = body(state)`
    - `compiled(function, record)`: `function(xp, record)`, in JAX traced and compiled once for all records whose arrays
      are alike and whose other parts are equal: loops of operations one by one would be compiled in each call
    - `slopes(function, x, units)`: the derivatives of a function of vectors `[..., 3]`, each of a component of its
      value, `[3, ..., 3]`; `units` are unit vectors in the same order
    - `to_numpy(value)`, where anything but an array of the library stays; `from_numpy(array, like)`, a copy with the
      number type and the device of `like`
    - `in_double(function, *arrays)`, the result of a function of arrays computed in double precision, in their own
    - `widened(x)`, numbers of a step in the precision in which the library computes it; `narrowed(result, *inputs)`,
      its result in the precision of the inputs
    """

    def __init__(self, library: Any, **own: Any) -> None:
        self._where = library.where
        vars(self).update({name: getattr(library, name, None) for name in _SAME}, **own)

    def __getattr__(self, name: str) -> Any:
        raise AttributeError(f"the array namespace has no {name}")

    def over(self, function: Any) -> Any:
        """Return a function of numbers and tuples as one of arrays."""
        return over(self)(function)

    def where(self, condition: Any, a: Any, b: Any) -> Any:
        """Return `a` where the condition holds, else `b`; a plain bool selects one of them as it is."""
        return (
            (a if condition else b)
            if isinstance(condition, bool)
            else self._where(condition, a, b)
        )

    def minimum(self, a: Any, b: Any) -> Any:
        """Return the smaller of two numbers; at a tie the first one, with its derivative."""
        return self._where(a <= b, a, b)

    def maximum(self, a: Any, b: Any) -> Any:
        """Return the larger of two numbers; at a tie the first one, with its derivative."""
        return self._where(a >= b, a, b)

    def power(self, x: Any, exponent: Any) -> Any:
        """Return `x^exponent` for x >= 0 and exponent > 0, with derivative 0 at x = 0.

        The value is held constant where it would leave the range of the number type.
        """
        limit = math.log(self.finfo(x.dtype).max) - 1.0
        moving = x > 0.0
        within = moving & (exponent * self.log(self._where(moving, x, 1.0)) < limit)
        largest = self._where(moving, self.full_like(x, math.exp(limit)), 0.0)
        return self._where(
            within, self.pow(self._where(within, x, 1.0), exponent), largest
        )

    def dot(self, a: Any, b: Any, axis: int) -> Any:
        """Return `a . b` along an axis, which stays with length 1."""
        return (a * b).sum(axis, keepdims=True)

    def norm(self, vector: Any, axis: int) -> Any:
        """Return `|vector|` along an axis, which stays with length 1; its derivative at 0 is 0."""
        return self.root(self.dot(vector, vector, axis))

    def root(self, x: Any) -> Any:
        """Return the square root of `x >= 0`; its derivative at 0 is 0."""
        positive = x > 0.0
        return self._where(positive, self.sqrt(self._where(positive, x, 1.0)), 0.0)

    def whole(self, x: Any, most: int) -> Any:
        """Return the integer part, limited to the range from 0 to `most`."""
        return self.clip(self.integers(self.stop_gradient(x)), 0, most)

    def epsilon(self, x: Any) -> float:
        """Return the rounding error of the number type of `x`."""
        return float(self.finfo(x.dtype).eps)


METHODS = ("adjoint", "eager")
"""The compiled rollout with its discrete adjoint; each step as operations of the tensor library."""


def finite(xp: Any, name: str, value: Any) -> Any:
    """Return `value`; raise InvalidValueError if it can be read and is not finite."""
    xp.extremes(name, value)
    return value


def non_negative(xp: Any, name: str, value: Any) -> Any:
    """Return `value`; raise InvalidValueError if it can be read and is below zero, else replace what is by zero."""
    extremes = xp.extremes(name, value)
    if extremes is None:
        # Not a maximum, which of NaN and zero takes zero.
        return xp.where(value < 0.0, 0.0, value)
    if extremes[0] < 0.0:
        raise InvalidValueError(name, "be >= 0", extremes[0])
    return value


def positive(xp: Any, name: str, value: Any) -> Any:
    """Return `value`; raise InvalidValueError if it can be read and is not above zero."""
    extremes = xp.extremes(name, value)
    if extremes is not None and extremes[0] <= 0.0:
        raise InvalidValueError(name, "be > 0", extremes[0])
    return value


def shaped(name: str, value: Any, inner: tuple[int, ...]) -> Any:
    """Return `value` `[..., *inner]`; raise InvalidValueError if its last axes have other lengths."""
    if tuple(value.shape[max(value.ndim - len(inner), 0) :]) != tuple(inner):
        wanted = ", ".join(map(str, inner))
        raise InvalidValueError(
            name, f"have shape [..., {wanted}]", f"shape {list(value.shape)}"
        )
    return value


def broadcast(
    xp: Any, subject: str, rule: str, shapes: Mapping[str, Any]
) -> tuple[int, ...]:
    """Return the common shape of `shapes` by name; raise InvalidValueError, `subject must rule`, if there is none."""
    try:
        return xp.broadcast_shapes(*shapes.values())
    except (RuntimeError, ValueError):  # of PyTorch, of JAX
        named = ", ".join(f"{name} {list(shape)}" for name, shape in shapes.items())
        raise InvalidValueError(subject, rule, f"shapes {named}") from None


def rollout_inputs(
    model: Any,
    kind: type,
    front: str,
    state: Any,
    twist: Any,
    normal_force: Any,
    dt: Any,
    method: str | None,
) -> tuple[Any, Any, Any, Any]:
    """Return state (at rest if None), twist `[..., T, 3]`, load `[..., T]` and dt, whose batch axes broadcast.

    Raises InvalidValueError for a model that is not of the front end's `kind`, and for wrong input, by its name.
    """
    if not isinstance(model, kind):
        given = f"{type(model).__module__}.{type(model).__name__}"
        raise InvalidValueError(
            "model", f"be one of {front} ({MODELS.classes()})", given
        )
    if method is not None:
        validation.choice("method", method, METHODS)
    xp = model.xp
    twist = model._number("twist", twist)
    dt = model._number("dt", dt)
    load = model._number("normal_force", normal_force)
    if twist.ndim < 2 or twist.shape[-1] != 3:
        raise InvalidValueError(
            "twist", "have shape [..., T, 3]", f"shape {list(twist.shape)}"
        )
    inner = model.state_shape
    start = (
        model.rest()
        if state is None
        else shaped("state", model._number("state", state), inner)
    )
    start = finite(xp, "state", start)
    twist = finite(xp, "twist", twist)
    load = non_negative(xp, "normal_force", load)
    dt = non_negative(xp, "dt", dt)
    steps = twist.shape[-2:-1]
    shape = broadcast(
        xp,
        "normal_force",
        f"broadcast with [..., {steps[0]}]",
        {"load": load.shape, "twist": steps},
    )
    batch = start.shape[: start.ndim - len(inner)]
    shapes = {
        "state": (*batch, 1),
        "twist": twist.shape[:-1],
        "normal_force": load.shape,
    }
    broadcast(xp, "batch axes", "broadcast", shapes)
    return start, twist, xp.broadcast_to(load, shape), dt
