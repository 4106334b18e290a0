"""Compiled functions over arrays: the source of a straight-line kernel, run on tensors.

What is written once for one cell, of numbers, is also what a tensor library needs for all cells at once. Numbers become
arrays `[..., 1, N]`, with the cells along the last axis; a vector is a `Vector`, or a tuple where the source names its
components. Only functions that are not straight lines, or whose slopes at a kink have a rule of their own (see
`codegen.rules.primitive`), have forms for arrays here.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any

from planarfriction import formulas
from planarfriction._engine.bristles import bristle_step, elastic
from planarfriction._engine.codegen import ratios, vectors
from planarfriction._engine.codegen.rebinding import Rewriting
from planarfriction._engine.compiler import compiled_math
from planarfriction._engine.published import published_contact, surfaces

ROUNDING = 256.0
"""Excess of a deflection over its cap, in units of the rounding error, that counts as rounding: see `bristle_step`."""


class Vector:
    """A vector whose components lie along the last axis but one of an array `[..., d, N]`: sums take one operation."""

    def __init__(self, array: Any) -> None:
        self.array = array

    def __getitem__(self, i: int) -> Any:
        return self.array[..., i : i + 1, :]

    def __iter__(self) -> Iterator[Any]:
        return (self[i] for i in range(self.array.shape[-2]))


def split(array: Any) -> tuple[Any, ...]:
    """Return the components of an array `[..., d, N]`, each `[..., 1, N]`."""
    return tuple(Vector(array))


def joined(xp: Any, vector: Any) -> Any:
    """Return a vector as an array `[..., d, N]`."""
    return (
        vector.array
        if isinstance(vector, Vector)
        else xp.concatenate(xp.broadcast_arrays(*vector), -2)
    )


class Placed:
    """Size of a table, with places in it that are known: cells about which numbers were read count as the first."""

    def __init__(self, size: int, place: tuple[Any, ...]) -> None:
        self.size = size
        self.cell = place[:2]
        self.place = (0, 0, *place[2:])

    def __add__(self, other: Any) -> Any:
        return self.size + other

    def __rmul__(self, other: Any) -> Any:
        return other * self.size

    def __rtruediv__(self, other: Any) -> Any:
        return other / self.size


def _place(xp: Any, size: Any, x: Any, y: Any, s: Any) -> tuple[Any, ...]:
    """Return `surfaces.place`; on the spin axis the azimuth is 0."""
    if isinstance(size, Placed):
        return size.place
    across = xp.root(x * x + y * y)
    on_axis = across == 0.0
    polar = xp.arctan2(across, s)
    azimuth = xp.arctan2(xp.where(on_axis, 0.0, y), xp.where(on_axis, 1.0, x))
    azimuth = xp.where(azimuth < 0.0, azimuth + 2.0 * math.pi, azimuth)
    a, b = (size / (0.5 * math.pi) * each for each in (polar, azimuth))
    i = xp.whole(a, size - 1)
    j = xp.whole(b, 4 * size - 1)
    return i, j, a - i, b - j, polar, azimuth


@functools.cache
def over(xp: Any) -> Rewriting:
    """Return `of(function)`, which returns a function of numbers and tuples as one of arrays of `xp`."""
    return Rewriting(_twins(xp))


def _twins(xp: Any) -> list[tuple[Any, Any]]:
    """Return functions that arrays take in another form, and these forms."""

    def plus(a: Any, c: Any, b: Any) -> Any:
        if isinstance(a, Vector) and isinstance(b, Vector):
            return Vector(a.array + c * b.array)
        return tuple(x + c * y for x, y in zip(a, b, strict=True))

    def times(c: Any, a: Any) -> Any:
        return Vector(c * a.array) if isinstance(a, Vector) else tuple(c * x for x in a)

    def dot(a: Any, b: Any) -> Any:
        if isinstance(a, Vector) and isinstance(b, Vector):
            return xp.dot(a.array, b.array, -2)
        first, *others = (x * y for x, y in zip(a, b, strict=True))
        return sum(others, first)

    def per(x: Any) -> Any:
        some = x > 0.0
        return xp.where(some, 1.0 / xp.where(some, x, 1.0), 0.0)

    def ratio(x: Any, y: Any) -> Any:
        some = y > 0.0
        return xp.where(some, x / xp.where(some, y, 1.0), 0.0)

    def sloping(value: Any, deflection: Any, largest: Any) -> Any:
        """Return a value, without slopes where the deflection is not larger by more than rounding."""
        beyond = deflection > (1.0 + ROUNDING * xp.epsilon(deflection)) * largest
        return xp.where(beyond, value, xp.stop_gradient(value))

    def through(root: Any, x: Any, y: Any) -> tuple[Any, Any]:
        """Return `published_contact.through`, without a metric if there is none."""
        return (
            (x, y)
            if root is None
            else (root.xx * x + root.xy * y, root.xy * x + root.yy * y)
        )

    def disc_friction(_: Any, slide: Any, spin: Any) -> Any:
        """Return `formulas.disc_friction` in a unit of speed that keeps squares and their slopes in range."""
        rest = formulas.DISC_REST
        per = 1.0 / xp.stop_gradient(slide + spin + math.sqrt(rest))
        return formulas.disc_friction_above(per * slide, per * spin, rest * per * per)

    def traction(law: Any, y: Any, rate: Any, u: Any) -> Any:
        """Return `elastic.traction` in a unit of speed that keeps squares and their slopes in range."""
        speed = xp.stop_gradient(xp.root(dot(u, u)))
        moves = speed > 0.0
        unit = 1.0 / xp.where(moves, speed, 1.0)
        heading = times(unit, u)
        along = xp.where(moves, dot(times(unit, rate), heading), 1.0)
        along = along / xp.where(moves, dot(heading, heading), 1.0)
        damping = law.sigma_1 * xp.clip(along, 0.0, 1.0) + law.sigma_2
        return plus(times(-law.sigma_0, y), -damping, u)

    return [
        (compiled_math, xp),
        (
            math,
            SimpleNamespace(
                sqrt=xp.root, sin=xp.sin, cos=xp.cos, inf=math.inf, pi=math.pi
            ),
        ),
        (vectors.plus, plus),
        (vectors.times, times),
        (vectors.dot, dot),
        (vectors.square, lambda a: dot(a, a)),
        (formulas.disc_friction, disc_friction),
        (elastic.traction, traction),
        (surfaces.place, functools.partial(_place, xp)),
        (published_contact.through, through),
        (ratios.per, per),
        (ratios.ratio, ratio),
        (bristle_step.cap, lambda x, most: sloping(formulas.cap(xp, x, most), x, most)),
        (
            bristle_step.reachable,
            lambda x, law: formulas.reachable_deflection(xp, sloping(x, x, 1.0), law),
        ),
    ]
