"""The array namespace `xp`: operations under one name in PyTorch and JAX, with finite derivatives at every kink."""

from __future__ import annotations

import math
from typing import Any

_SAME = (
    *("exp", "sin", "cos", "sqrt", "log", "pow", "arctan2", "clip", "finfo", "ones_like", "full_like"),
    *("stack", "concatenate", "moveaxis", "broadcast_to", "broadcast_shapes"),
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
      bool `[..., N]`, by the rule of `kernels.tilt` in its scaled coordinates; without derivatives
    - `to_numpy(value)`, where anything but an array of the library stays; `from_numpy(array, like)`, a copy with the
      number type and the device of `like`
    - `widened(x)`, numbers of a step in the precision in which the library computes it; `narrowed(result, *inputs)`,
      its result in the precision of the inputs
    """

    def __init__(self, library: Any, **own: Any) -> None:
        self._where = library.where
        vars(self).update({name: getattr(library, name) for name in _SAME}, **own)

    def __getattr__(self, name: str) -> Any:
        raise AttributeError(f"the array namespace has no {name}")

    def where(self, condition: Any, a: Any, b: Any) -> Any:
        """Return `a` where the condition holds, else `b`; a plain bool selects one of them as it is."""
        return (a if condition else b) if isinstance(condition, bool) else self._where(condition, a, b)

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
        return self._where(within, self.pow(self._where(within, x, 1.0), exponent), largest)

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
