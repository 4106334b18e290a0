"""Steps, rates and their derivatives of cells in blocks as vector loops, written from the functions of one cell.

An `Element` is the bristle of a kind of cells (see `points`, `discs`). See `loop_generation` for how loops come out of
a trace, `cell_steps` and `cells_rollout` for what runs them.
"""

from __future__ import annotations

import functools
from typing import Any, NamedTuple

import numpy as np

from planarfriction._engine.bristles import asymmetric_cells, discs, elastic, points
from planarfriction._engine.bristles.asymmetric_cells import Leaning
from planarfriction._engine.bristles.elastic import Elastic
from planarfriction._engine.cells import cells
from planarfriction._engine.cells.cell_blocks import BAR, BY_LOAD, LANES, OUT, WEIGHT
from planarfriction._engine.cells.cells import Lever
from planarfriction._engine.cells.cells_rollout import by_of
from planarfriction._engine.cells.loop_generation import Passes, passes
from planarfriction._engine.codegen.derivatives import derive
from planarfriction._engine.codegen.symbolic_functions import twin
from planarfriction._engine.codegen.trace import Number, Trace, traced
from planarfriction._engine.compiler import kernel
from planarfriction._engine.compiler.memory import Doubles
from planarfriction.formulas import LawNumbers


class Element(NamedTuple):
    """Bristle of a kind of cells."""

    name: str
    size: int
    """Components d."""
    evaluate: Any
    """`(law, z, u)`: return z' and the traction."""
    step: Any
    """`(law, z, u, dt)`: return the bristle after dt and its traction."""
    forward: tuple[int, int] = 8, 2
    """Division into passes that is fastest for a few dozen cells (see `loop_generation`)."""
    backward: tuple[int, int] = 6, 6
    rate: tuple[int, int] = 5, 0
    slopes: tuple[int, int] = 4, 2
    step_slopes: tuple[int, int] = 4, 8


_OF_DISCS: dict[str, Any] = {
    "forward": (17, 0),
    "backward": (1, 0),
    "step_slopes": (1, 0),
}
"""Divisions for discs: passes hide the divisions of a step, derivatives have enough sums and products between them."""

POINT = Element("points", 2, points.evaluate, points.step, slopes=(2, 0))
DISC = Element(
    "discs", 3, discs.evaluate, discs.step, rate=(8, 0), slopes=(1, 2), **_OF_DISCS
)
LEANING_POINT = Element(
    "leaning points",
    2,
    asymmetric_cells.evaluate,
    asymmetric_cells.step,
)
LEANING_DISC = Element(
    "leaning discs",
    3,
    asymmetric_cells.evaluate_disc,
    asymmetric_cells.step_disc,
    **_OF_DISCS,
)
"""Elements whose law is a `Leaning`; the asymmetry stands behind the numbers of the lever."""

PAD_POINT = Element("points of a pad", 2, elastic.evaluate, elastic.step)
PAD_DISC = Element(
    "discs of a pad", 3, elastic.evaluate_disc, elastic.step_disc, **_OF_DISCS
)
"""Elements whose law is an `Elastic`; `Elastic.stiff` stands behind the numbers of the lever."""


class CellKind(NamedTuple):
    """Element of a kind of cells and their lever, which has so many numbers."""

    name: str
    element: Element
    lever: Lever
    numbers: int
    leans: bool = False
    """True for elements whose law is a `Leaning`."""
    law: Any = LawNumbers
    """Record of the numbers of the law."""
    linear: bool = True
    """See `general_cells.Bristle`."""
    pad: bool = False
    """True for elements whose law is an `Elastic`, which see their load."""

    @property
    def rows(self) -> int:
        """Numbers of a cell: those of the lever, and what stands behind them."""
        return self.numbers + 2 * self.leans + self.pad

    @property
    def path(self) -> str:
        """Name of the law among the arguments of the element."""
        return "lean.law" if self.leans else "pad.law" if self.pad else "law"

    @property
    def lengths(self) -> dict[str, int]:
        """Lengths of the vectors among the arguments of the element, by name."""
        asymmetry = {"law.a": 2, "lean.a": 2} if self.leans else {}
        return {"z": self.element.size, "u": self.element.size, **asymmetry}


@kernel
def _plain(law: Any, cells: Doubles, i: int, n: int, load: float) -> Any:
    return law


def law_of(kind: CellKind) -> Any:
    """Return a function `(law, cells, i, n, load)` of rows of n numbers: the law of cell i under its load."""
    first = kind.numbers

    @kernel
    def leaning(law: Any, cells: Doubles, i: int, n: int, load: float) -> Leaning:
        return Leaning(law, (cells[first * n + i], cells[(first + 1) * n + i]))

    @kernel
    def elastic(law: Any, cells: Doubles, i: int, n: int, load: float) -> Elastic:
        return Elastic(law, cells[first * n + i], load)

    return leaning if kind.leans else elastic if kind.pad else _plain


PLAIN = "plain"
LEANS = "leans"
PAD = "pad"
"""Sorts of bristles: of the law alone, with an asymmetry, of a pad."""

_OF_PAD = {"linear": False, "pad": True}

KINDS = {
    (2, False, PLAIN): CellKind("isotropic", POINT, cells.POSITIONS, 2),
    (2, True, PLAIN): CellKind("turned", POINT, cells.LEVERS, 5),
    (3, False, PLAIN): CellKind("discs", DISC, cells.DISC_POSITIONS, 3),
    (3, True, PLAIN): CellKind("turned_discs", DISC, cells.DISC_LEVERS, 6),
    (2, True, LEANS): CellKind("leaning", LEANING_POINT, cells.LEVERS, 5, leans=True),
    (3, True, LEANS): CellKind(
        "leaning_discs", LEANING_DISC, cells.DISC_LEVERS, 6, leans=True
    ),
    (2, False, PAD): CellKind("pad", PAD_POINT, cells.POSITIONS, 2, **_OF_PAD),
    (2, True, PAD): CellKind("turned_pad", PAD_POINT, cells.LEVERS, 5, **_OF_PAD),
    (3, False, PAD): CellKind(
        "pad_discs", PAD_DISC, cells.DISC_POSITIONS, 3, **_OF_PAD
    ),
    (3, True, PAD): CellKind(
        "turned_pad_discs", PAD_DISC, cells.DISC_LEVERS, 6, **_OF_PAD
    ),
}
"""Kinds of cells by the components of a bristle, whether there is a metric, and the sort of bristles."""


class CellRows(NamedTuple):
    """Cells of a contact from one on, row by row of n numbers; of a block, `LANES` numbers."""

    cells: Doubles
    z: Doubles
    weights: Doubles
    out: Doubles
    """Rates, new bristles or cotangents [d, n], or a block of derivatives by state and velocity [2, d, d, LANES]."""
    n: int


class StepRows(NamedTuple):
    """Cells of a contact, row by row, and the derivatives of a step."""

    cells: Doubles
    z: Doubles
    weights: Doubles
    out: Doubles
    """New bristles [d, n]."""
    n: int
    slopes: Doubles
    """d new/dV [d, n, 3], dW/dz [3, d, n], d new/dz [d, d, n] and, of a pad, d new/dN [d, n]."""


class _Symbols:
    """Arguments of the functions of a cell in a trace."""

    def __init__(self, trace: Trace, kind: CellKind) -> None:
        self.trace = trace
        numbers = self.several("c", kind.rows)
        law = kind.law(
            *(Number(trace, f"{kind.law.__name__}.{name}") for name in kind.law._fields)
        )
        self.cell = numbers[: kind.numbers]
        self.z = self.several("z", kind.element.size)
        self.v = self.several("v", 3)
        self.dt = Number(trace, "dt")
        self.load = Number(trace, "load")
        self.weight = Number(trace, "weight")
        self.u = twin(kind.lever.seen)(self.cell, self.v)
        self.law = twin(law_of(kind))(law, numbers, 0, 1, self.weight * self.load)

    def several(self, letter: str, count: int) -> tuple:
        """Return a vector of symbols."""
        return tuple(Number(self.trace, f"{letter}{m}") for m in range(count))


def _rows(letter: str, field: str, count: int) -> dict[str, str]:
    """Return the sources of a vector of symbols that lies in `CellRows`."""
    return {f"{letter}{m}": f"block.{field}[{m} * block.n + i]" for m in range(count)}


def _shared(kind: CellKind) -> dict[str, str]:
    """Return the sources of the symbols that all cells share."""
    law = {f"{kind.law.__name__}.{name}": f"law.{name}" for name in kind.law._fields}
    twist = {f"v{m}": f"v[{m}]" for m in range(3)}
    return {**law, **twist, "dt": "shared[0]", "load": "shared[1]"}


_PULL = {f"p{m}": f"shared[{m + 3}]" for m in range(3)} | {"keeps": "shared[2]"}
"""Sources of the cotangent of a wrench, and of 1, or 0 without load."""


def _in_rows(kind: CellKind) -> dict[str, str]:
    """Return the sources of the symbols of cells in `CellRows`."""
    vectors = _rows("c", "cells", kind.rows) | _rows("z", "z", kind.element.size)
    return {**_shared(kind), **vectors, "weight": "block.weights[0 + i]"}


def step_passes(kind: CellKind) -> Passes:
    """Write the step of cells in `CellRows`.

    The new bristles may go where the old ones are, so they are written last.
    """
    element = kind.element

    def step(trace: Trace) -> Any:
        s = _Symbols(trace, kind)
        new, traction = twin(element.step)(s.law, s.z, s.u, s.dt)
        borne = tuple(s.weight * each for each in traction)
        return new, twin(kind.lever.wrench)(s.cell, borne)

    stores = _rows("new", "out", element.size)
    return passes(
        f"steps of {element.name}",
        traced(step),
        _in_rows(kind) | stores,
        list(stores.values()),
        element.forward,
    )


def step_slope_passes(kind: CellKind) -> Passes:
    """Write the step of cells in `CellRows`, their wrench, and its slopes by the twist, nine numbers."""
    element = kind.element
    lever = kind.lever
    written = derive(element.step, ("z", "u"), kind.lengths)
    none = (0.0,) * element.size
    units = np.eye(element.size).tolist()

    def slopes(trace: Trace) -> Any:
        s = _Symbols(trace, kind)
        (new, traction), tape = twin(written.forth)(s.law, s.z, s.u, s.dt)
        rows = [twin(written.back)(tape, (none, tuple(unit)))[1] for unit in units]
        by_velocity = tuple(each for row in rows for each in row)
        pull = twin(lever.wrench)(s.cell, traction)
        by_twist = twin(lever.around)(s.cell, by_velocity)
        return new, tuple(s.weight * each for each in (*pull, *by_twist))

    stores = _rows("new", "out", element.size)
    sources = _in_rows(kind) | stores
    return passes(
        f"slopes of steps of {element.name}",
        traced(slopes),
        sources,
        list(stores.values()),
        element.step_slopes,
    )


def jacobian_passes(kind: CellKind) -> Passes:
    """Write the step of cells in `StepRows` with its derivatives; sum up their wrench and its slopes by the twist.

    Those by the load, of a pad, come behind. One pass, for any number of cells.
    """
    size = kind.element.size
    by = "z", "u", *["pad.load"] * kind.pad
    written = derive(kind.element.step, by, kind.lengths)
    units = np.eye(2 * size).tolist()

    def slopes(trace: Trace) -> Any:
        s = _Symbols(trace, kind)
        (new, traction), tape = twin(written.forth)(s.law, s.z, s.u, s.dt)
        rows = [twin(written.back)(tape, (each[:size], each[size:])) for each in units]
        wrench = functools.partial(twin(kind.lever.wrench), s.cell)
        by_z, by_u, *by_load = zip(*rows, strict=True)
        borne = tuple(s.weight * each for each in traction)
        by_twist = tuple(s.weight * each for row in by_u[size:] for each in row)
        pulls = zip(*by_z[size:], strict=True)
        of_pull = [wrench(tuple(s.weight * each for each in pull)) for pull in pulls]
        heavier = [tuple(s.weight * each for each in row) for row in by_load]
        return (
            new,
            tuple(map(wrench, by_u[:size])),
            tuple(zip(*of_pull, strict=True)),
            by_z[:size],
            tuple(row[:size] for row in heavier),
            wrench(borne),
            twin(kind.lever.around)(s.cell, by_twist),
            tuple(wrench(tuple(s.weight * x for x in row[size:])) for row in heavier),
        )

    stores = [*_rows("new", "out", size).values()]
    stores += [
        f"block.slopes[3 * ({m} * block.n + i) + {j}]"
        for m in range(size)
        for j in range(3)
    ]
    behind = range(3 * size, (6 + size + kind.pad) * size)
    stores += [f"block.slopes[{m} * block.n + i]" for m in behind]
    name = f"derivatives of steps of {kind.element.name}"
    return passes(name, traced(slopes), _in_rows(kind), stores, (1, 0))


def backward_passes(kind: CellKind) -> Passes:
    """Write the adjoint of a step of the cells of a block: the cotangent of the state in place, and sums over cells.

    These are the cotangents of the twist [3], of the load, and of the law in the order of `cells_rollout.PARAMETERS`.
    The slope of the weight by the load lies behind the weight. The cotangent of the load of each cell goes behind that
    of the state, to `OUT`, and its part by the law of a pad behind it.
    """
    element = kind.element
    lever = kind.lever
    written = derive(element.step, by_of(kind.path, kind.pad), kind.lengths)

    def adjoint(trace: Trace) -> Any:
        s = _Symbols(trace, kind)
        keeps = Number(trace, "keeps")
        by_load = Number(trace, "by_load")
        load = s.load
        pulled = twin(lever.seen)(s.cell, s.several("p", 3))
        (_, traction), tape = twin(written.forth)(s.law, s.z, s.u, s.dt)
        state_bar = tuple(keeps * each for each in s.several("b", element.size))
        z_bar, u_bar, *law_bar = twin(written.back)(
            tape, (state_bar, tuple(load * s.weight * each for each in pulled))
        )
        along = sum(a * b for a, b in zip(pulled, traction, strict=True))
        stored = [along]
        if kind.pad:
            stored.append(law_bar.pop())
            along = along + stored[1]
        return (
            z_bar,
            tuple(stored),
            twin(lever.wrench)(s.cell, u_bar),
            (s.weight + load * by_load) * along,
            tuple(law_bar),
        )

    bar = _rows("b", "out", element.size)
    by_load = {"by_load": f"block.weights[{BY_LOAD - WEIGHT} + i]"}
    behind = [OUT - BAR + m * LANES for m in range(1 + kind.pad)]
    return passes(
        f"{element.name}_back",
        traced(adjoint),
        _in_rows(kind) | _PULL | bar | by_load,
        [*bar.values(), *(f"block.out[{place} + i]" for place in behind)],
        element.backward,
    )


def rate_passes(kind: CellKind) -> Passes:
    """Write the rates of cells in `CellRows`, and their wrench."""
    element = kind.element

    def rate(trace: Trace) -> Any:
        s = _Symbols(trace, kind)
        zdot, traction = twin(element.evaluate)(s.law, s.z, s.u)
        return zdot, twin(kind.lever.wrench)(
            s.cell, tuple(s.weight * each for each in traction)
        )

    stores = list(_rows("rate", "out", element.size).values())
    return passes(
        f"rates of {element.name}", traced(rate), _in_rows(kind), stores, element.rate
    )


def slope_passes(kind: CellKind) -> Passes:
    """Write the derivatives of the rates of cells in `CellRows` by state and velocity, their rates, and their wrench.

    The derivatives of tractions too, unless the bristle is linear.
    """
    element = kind.element
    written = derive(element.evaluate, ("z", "u"), kind.lengths)
    count = element.size if kind.linear else 2 * element.size
    units = [
        tuple(float(m == j) for m in range(2 * element.size)) for j in range(count)
    ]

    def slopes(trace: Trace) -> Any:
        s = _Symbols(trace, kind)
        (zdot, traction), tape = twin(written.forth)(s.law, s.z, s.u)
        rows = [
            twin(written.back)(tape, (unit[: element.size], unit[element.size :]))
            for unit in units
        ]
        halves = [
            rows[first : first + element.size]
            for first in range(0, count, element.size)
        ]
        matrices = tuple(
            tuple(row[which] for row in half) for half in halves for which in range(2)
        )
        borne = tuple(s.weight * each for each in traction)
        return matrices, zdot, twin(kind.lever.wrench)(s.cell, borne)

    # Of a block: that lies apart.
    rows = (2 * count + 1) * element.size
    stores = [f"block.out[{m * LANES} + i]" for m in range(rows)]
    return passes(
        f"slopes of {element.name}",
        traced(slopes),
        _in_rows(kind),
        stores,
        element.slopes,
    )
