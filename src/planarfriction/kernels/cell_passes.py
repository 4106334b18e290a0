"""Steps, rates and their derivatives of cells in blocks as vector loops, written from the functions of one cell.

An `Element` is the bristle of a kind of cells (see `points`, `discs`). See `passes` for how loops come out of a trace,
`cell_steps` and `cell_rollouts` for what runs them.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from planarfriction.compiler.memory import Doubles
from planarfriction.formulas import LawNumbers
from planarfriction.kernels import discs, points
from planarfriction.kernels.cell_blocks import BAR, BY_LOAD, LANES, WEIGHT, Z
from planarfriction.kernels.cells import Lever
from planarfriction.kernels.cells_rollout import BY
from planarfriction.kernels.derive import derive
from planarfriction.kernels.passes import Passes, passes
from planarfriction.kernels.trace import Number, Trace, traced
from planarfriction.kernels.twins import twin


class Division(NamedTuple):
    """Division of a function into passes that is fastest for a few dozen cells (see `passes`)."""

    count: int
    short: int


class Element(NamedTuple):
    """Bristle of a kind of cells."""

    name: str
    size: int
    """Components d."""
    evaluate: Any
    """`(law, z, u)`: return z' and the traction."""
    step: Any
    """`(law, z, u, dt)`: return the bristle after dt and its traction."""
    forward: Division
    backward: Division
    rate: Division
    slopes: Division


POINT = Element(
    "points", 2, points.evaluate, points.step, Division(8, 2), Division(6, 6), Division(5, 0), Division(2, 0)
)
DISC = Element("discs", 3, discs.evaluate, discs.step, Division(8, 2), Division(6, 6), Division(5, 0), Division(4, 2))


class Rows(NamedTuple):
    """Cells of the solver from one on, where they lie: row by row of n numbers."""

    cells: Doubles
    z: Doubles
    weights: Doubles
    out: Doubles
    """Rates [d, n], or a block of derivatives by state and velocity [2, d, d, LANES]."""
    n: int


_LAW = {f"law.{name}": f"law.{name}" for name in LawNumbers._fields}


class _Symbols:
    """Arguments of the functions of a cell in a trace, whose levers have so many numbers."""

    def __init__(self, trace: Trace, element: Element, numbers: int) -> None:
        self.trace = trace
        self.law = LawNumbers(*(Number(trace, name) for name in _LAW))
        self.cell, self.z, self.v = self.several("c", numbers), self.several("z", element.size), self.several("v", 3)
        self.dt, self.weight = Number(trace, "dt"), Number(trace, "weight")

    def several(self, letter: str, count: int) -> tuple:
        """Return a vector of symbols."""
        return tuple(Number(self.trace, f"{letter}{m}") for m in range(count))


def _fields(letter: str, first: int, count: int) -> dict[str, str]:
    """Return the sources of a vector of symbols that lies in fields of a block."""
    return {f"{letter}{m}": f"block[{first + m * LANES} + i]" for m in range(count)}


def _sources(element: Element, numbers: int) -> dict[str, str]:
    """Return the sources of the symbols: numbers of a cell lie in its block."""
    twist = {f"v{m}": f"v[{m}]" for m in range(3)}
    cell = _fields("c", 0, numbers) | _fields("z", Z, element.size)
    return {**_LAW, **cell, **twist, "dt": "given[0]", "weight": f"block[{WEIGHT} + i]"}


def _rows(letter: str, field: str, count: int) -> dict[str, str]:
    """Return the sources of a vector of symbols that lies in rows of the solver."""
    return {f"{letter}{m}": f"block.{field}[{m} * block.n + i]" for m in range(count)}


def _solver_sources(element: Element, numbers: int) -> dict[str, str]:
    """Return the sources of the symbols in `Rows`."""
    rows = _rows("c", "cells", numbers) | _rows("z", "z", element.size)
    return {**_sources(element, numbers), **rows, "weight": "block.weights[0 + i]"}


def forward_passes(element: Element, lever: Lever, numbers: int) -> Passes:
    """Write the step of cells, whose levers have so many numbers."""

    def step(trace: Trace) -> Any:
        s = _Symbols(trace, element, numbers)
        new, traction = twin(element.step)(s.law, s.z, twin(lever.seen)(s.cell, s.v), s.dt)
        return new, twin(lever.wrench)(s.cell, tuple(s.weight * each for each in traction))

    stores = list(_fields("z", Z, element.size).values())
    return passes(element.name, traced(step), _sources(element, numbers), stores, **element.forward._asdict())


def backward_passes(element: Element, lever: Lever, numbers: int) -> Passes:
    """Write the adjoint of a step of cells: the cotangent of the state in place, and sums over the cells.

    These are the cotangents of the twist [3], of the load, and of the law in the order of `cells_rollout.PARAMETERS`.
    """
    written = derive(element.step, BY, ("z", "u"))

    def adjoint(trace: Trace) -> Any:
        s = _Symbols(trace, element, numbers)
        load, keeps, by_load = (Number(trace, name) for name in ("load", "keeps", "by_load"))
        pulled = twin(lever.seen)(s.cell, s.several("p", 3))
        (_, traction), tape = twin(written.forth)(s.law, s.z, twin(lever.seen)(s.cell, s.v), s.dt)
        state_bar = tuple(keeps * each for each in s.several("b", element.size))
        z_bar, u_bar, *law_bar = twin(written.back)(tape, (state_bar, tuple(load * s.weight * each for each in pulled)))
        along = sum(a * b for a, b in zip(pulled, traction, strict=True))
        return z_bar, twin(lever.wrench)(s.cell, u_bar), (s.weight + load * by_load) * along, tuple(law_bar)

    pull = {f"p{m}": f"given[{m + 3}]" for m in range(3)} | {"load": "given[1]", "keeps": "given[2]"}
    bar = _fields("b", BAR, element.size)
    sources = _sources(element, numbers) | pull | bar | {"by_load": f"block[{BY_LOAD} + i]"}
    name, division = f"{element.name}_back", element.backward._asdict()
    return passes(name, traced(adjoint), sources, list(bar.values()), **division)


def rate_passes(element: Element, lever: Lever, numbers: int) -> Passes:
    """Write the rates of cells, and their wrench."""

    def rate(trace: Trace) -> Any:
        s = _Symbols(trace, element, numbers)
        zdot, traction = twin(element.evaluate)(s.law, s.z, twin(lever.seen)(s.cell, s.v))
        return zdot, twin(lever.wrench)(s.cell, tuple(s.weight * each for each in traction))

    stores = list(_rows("r", "out", element.size).values())
    name, division = f"rates of {element.name}", element.rate._asdict()
    return passes(name, traced(rate), _solver_sources(element, numbers), stores, **division)


def slope_passes(element: Element, lever: Lever, numbers: int) -> Passes:
    """Write the derivatives of the rates of cells, by state and velocity."""
    written = derive(element.evaluate, ("z", "u"), ("z", "u"))
    units = [tuple(float(m == j) for m in range(element.size)) for j in range(element.size)]

    def slopes(trace: Trace) -> Any:
        s = _Symbols(trace, element, numbers)
        _, tape = twin(written.forth)(s.law, s.z, twin(lever.seen)(s.cell, s.v))
        rows = [twin(written.back)(tape, (unit, (0.0,) * element.size)) for unit in units]
        return tuple(by_z for by_z, _ in rows), tuple(by_u for _, by_u in rows)

    stores = [f"block.out[{m * LANES} + i]" for m in range(2 * element.size**2)]  # of a block: that lies apart
    name, division = f"slopes of {element.name}", element.slopes._asdict()
    return passes(name, traced(slopes), _solver_sources(element, numbers), stores, **division)
