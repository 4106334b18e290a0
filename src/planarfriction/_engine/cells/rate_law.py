"""A bristle of a law that is a function of its own, `z' = rate(xp, law, z, u)`, with derivatives written from it.

The step is linearly implicit, of two stages (Rosenbrock; Verwer, Spee, Blom, Hundsdorfer 1999): with `A = dz'/dz` at
the start and `g = 1 - 1/sqrt(2)`,

    (I - g dt A) k = z'(z),   (I - g dt A) l = z'(p) - 2 k,   p = z + dt k,   new = z + dt (3 k + l)/2.

It is of order 2 and L-stable: stiff bristles are damped to 0.5 % in a step where nothing holds them back. A bristle
that is within its largest deflection never leaves it, so `p` and `new` are brought back there, and bristles stay in
bounds for any dt; where that holds back p, a stiff bristle keeps up to two thirds of its deflection with the opposite
sign.
"""

from __future__ import annotations

import functools
import hashlib
import inspect
import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

from planarfriction._engine.bristles.law import traction as traction_of
from planarfriction._engine.cells.cell_loops import CellKind, Element
from planarfriction._engine.cells.cell_steps import CellSteps, rates_of
from planarfriction._engine.cells.cells import LEVERS, Lever
from planarfriction._engine.codegen.derivatives import forward
from planarfriction._engine.codegen.vectors import Vector, norm, plus, times
from planarfriction._engine.compiler import compiled_math as xp
from planarfriction._engine.compiler import kernel
from planarfriction._engine.compiler.memory import Doubles, reader
from planarfriction._engine.protocol import ModelFunctions

_SHARE = 1.0 - math.sqrt(0.5)
"""g [-]"""

_KNOWN = frozenset(("planarfriction", "math", "numpy", "numba", "builtins"))
"""Packages whose versions and sources machine code is kept under anyway."""

_LEAST = 0.1
"""Least determinant of `I - g dt A`: it could vanish for a law whose bristles grow by themselves."""


@kernel
def traction(xp: Any, law: Any, z: Vector, zdot: Vector, u: Vector) -> Vector:
    """Compute `-(sigma_0 z + sigma_1 z' + sigma_2 u)`, the traction per unit load of a law without one."""
    return traction_of(law, z, zdot, u)


@kernel
def _within(z: Vector, largest: float) -> Vector:
    """Bring a bristle back to its largest deflection."""
    size = norm(z)
    return times(
        xp.where(size > largest, largest, 1.0) / xp.where(size > largest, size, 1.0), z
    )


@kernel
def _solved(
    a: float, b: float, c: float, d: float, per_determinant: float, r: Vector
) -> Vector:
    """Solve a system [2, 2] with the rows (a, b) and (c, d)."""
    return per_determinant * (d * r[0] - b * r[1]), per_determinant * (
        a * r[1] - c * r[0]
    )


@functools.cache
def element_of(name: str, rate: Callable, pull: Callable = traction) -> Element:
    """Return the element of a bristle from `rate(xp, law, z, u)` and its traction `pull(xp, law, z, z', u)`."""
    rate_of, pull = (
        each if hasattr(each, "py_func") else kernel(each) for each in (rate, pull)
    )

    @kernel
    def rate(xp: Any, law: Any, z: Vector, u: Vector) -> Vector:
        x, y = rate_of(xp, law, z, u)
        return x, y

    pushed = forward(rate, ("z",), {"z": 2, "u": 2})

    @kernel
    def evaluate(law: Any, z: Vector, u: Vector) -> tuple[Vector, Vector]:
        zdot = rate(xp, law, z, u)
        return zdot, pull(xp, law, z, zdot, u)

    @kernel
    def step(law: Any, z: Vector, u: Vector, dt: float) -> tuple[Vector, Vector]:
        start, x = pushed(xp, law, z, u, (1.0, 0.0))
        start, y = pushed(xp, law, z, u, (0.0, 1.0))
        g = _SHARE * dt
        a = 1.0 - g * x[0]
        b = -g * y[0]
        c = -g * x[1]
        d = 1.0 - g * y[1]
        # without subtracting large numbers: the bristles of a law that dissipates have no negative determinant
        apart = xp.maximum(g * x[0] * (g * y[1]) - g * x[1] * (g * y[0]), 0.0)
        per = 1.0 / xp.maximum(1.0 - g * (x[0] + y[1]) + apart, _LEAST)
        largest = xp.maximum(law.largest_deflection, norm(z))
        first = _solved(a, b, c, d, per, start)
        end = rate(xp, law, _within(plus(z, dt, first), largest), u)
        second = _solved(a, b, c, d, per, plus(end, -2.0, first))
        new = _within(plus(plus(z, 1.5 * dt, first), 0.5 * dt, second), largest)
        return new, pull(xp, law, new, rate(xp, law, new, u), u)

    return Element(name, 2, evaluate, step)


class CellFunctions(NamedTuple):
    """Compiled functions of contacts with a law and a kind of cells."""

    record: Any
    """Record of a contact: `law`, `count`, `cells`, `weights` as in `cells.CellsContact`."""
    rates: ModelFunctions
    steps: CellSteps


def cell_functions(element: Element, law: Any, lever: Lever) -> CellFunctions:
    """Bind the functions of contacts to an element, the record of its law's numbers and a lever; compile none yet."""
    fields = [("law", law), ("count", int), ("cells", Doubles), ("weights", Doubles)]
    record = NamedTuple(f"{law.__name__}Cells", fields)
    kind = CellKind(
        element.name, element, lever, 5 if lever is LEVERS else 2, law=law, linear=False
    )
    read = reader(record)
    return CellFunctions(record, rates_of(kind, read), CellSteps(kind, read))


def fingerprint(names: Sequence[str], *functions: Callable) -> str:
    """Return a short text that changes with the names of a law's numbers, with functions, and with all that these use.

    Functions use other functions, modules and numbers.
    """
    sources: dict[Any, str] = {None: " ".join(names)}
    for function in functions:
        _note(function, sources)
    return hashlib.sha256(repr(sorted(sources.values())).encode()).hexdigest()[:12]


def _note(value: Any, sources: dict[Any, str]) -> None:
    value = getattr(value, "py_func", value)
    home = (
        value.__name__
        if inspect.ismodule(value)
        else getattr(value, "__module__", None)
    )
    if value in sources or (home or "").split(".")[0] in _KNOWN:
        return
    if inspect.ismodule(value):
        sources[value] = inspect.getsource(value)
    elif inspect.isfunction(value):
        sources[value] = inspect.getsource(value)
        used = inspect.getclosurevars(value)
        for name, each in {**used.globals, **used.nonlocals}.items():
            if callable(each) or inspect.ismodule(each):
                _note(each, sources)
            else:
                sources[value, name] = f"{value.__qualname__} {name} {each!r}"
