"""The array namespace `xp`: operations under one name in PyTorch and JAX, with finite derivatives at every kink."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from typing import Any

_SAME = (
    *("exp", "sin", "cos", "sqrt", "log", "pow", "arctan2", "clip", "finfo", "ones_like", "full_like"),
    *("stack", "concatenate", "moveaxis", "broadcast_to", "broadcast_shapes"),
)
"""Functions that PyTorch and JAX have with the same name and the same leading arguments."""


class Namespace(ABC):
    """Operations on the arrays of one library, as formulas and checks of inputs need them."""

    def __init__(self, library: Any) -> None:
        self._where = library.where
        for name in _SAME:
            setattr(self, name, getattr(library, name))

    def __getattr__(self, name: str) -> Any:
        raise AttributeError(f"the array namespace has no {name}")

    # ------------------------------------------------------------------ operations

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

    @abstractmethod
    def broadcast_arrays(self, *arrays: Any) -> Any:
        """Return the arrays with one common shape."""

    @abstractmethod
    def stop_gradient(self, x: Any) -> Any:
        """Return the value as a constant for differentiation."""

    @abstractmethod
    def integers(self, x: Any) -> Any:
        """Return the numbers rounded towards zero, of an integer type that indexes arrays."""

    # ------------------------------------------------------------------ inputs and results

    @abstractmethod
    def real(self, name: str, value: Any, like: Any = None) -> Any:
        """Return `value` as an array of real numbers; an array keeps its precision and its device.

        Anything else takes both from `like`, if it is given. Raises InvalidValueError if `value` is not numeric.
        """

    @abstractmethod
    def extremes(self, name: str, value: Any) -> tuple[float, float] | None:
        """Return the smallest and the largest number, or None if there is none to read without waiting.

        Raises InvalidValueError for numbers outside the range of `validation.within_range`.
        """

    @abstractmethod
    def to_numpy(self, value: Any) -> Any:
        """Return an array of the library as a NumPy array, anything else unchanged."""

    @abstractmethod
    def from_numpy(self, array: Any, like: Any) -> Any:
        """Return a copy of a NumPy array, with the number type and the device of `like`."""

    def widened(self, x: Any) -> Any:
        """Return the numbers of a step in the precision in which the library computes it."""
        return x

    def narrowed(self, result: Any, *inputs: Any) -> Any:
        """Return the result of a step in the precision of its inputs."""
        return result
