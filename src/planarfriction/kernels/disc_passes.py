"""Steps of discs in blocks, their adjoint and their derivatives: vector loops written from the step of one disc.

See `passes` for how loops come out of a trace, `cells_rollout` for what runs them.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from planarfriction.compiler import kernel
from planarfriction.compiler.memory import at
from planarfriction.formulas import LawNumbers
from planarfriction.kernels import cells, cells_rollout, cells_sensitivities, disc_cells, discs, distributed_step
from planarfriction.kernels.cell_blocks import BAR, BLOCK, BY_LOAD, LANES, WEIGHT, Kind, Z, divided, room
from planarfriction.kernels.cell_slopes import StepBars
from planarfriction.kernels.cells import Lever
from planarfriction.kernels.cells_rollout import BY, bound
from planarfriction.kernels.contacts import ModelFunctions, functions_of
from planarfriction.kernels.derive import derive
from planarfriction.kernels.general_cells import RATES
from planarfriction.kernels.passes import Passes, passes
from planarfriction.kernels.steps import StepFunctions, step_functions
from planarfriction.kernels.trace import Number, Trace, traced
from planarfriction.kernels.twins import twin
from planarfriction.kernels.vectors import plus, put, reader_of, three

FORWARD, BACKWARD = {"count": 8, "short": 2}, {"count": 6, "short": 6}
RATE, SLOPES = {"count": 5, "short": 0}, {"count": 4, "short": 2}
"""Division into passes that is fastest for a few dozen discs (see `passes`): of a step, its adjoint, a rate, its
derivatives."""

RATES_AT, SLOPES_AT = LANES * 11, LANES * 14
"""Fields of a block of the solver behind its weights: rates [3], and derivatives by state and velocity [2, 3, 3]."""


class _Symbols(NamedTuple):
    """Arguments of the step of a disc, in a trace."""

    law: LawNumbers
    cell: tuple
    z: tuple
    v: tuple
    dt: Number
    weight: Number


_LAW = {f"law.{name}": f"law.{name}" for name in LawNumbers._fields}


def _sources(numbers: int) -> dict[str, str]:
    """Return the sources of the symbols: numbers of a cell lie in its block."""
    cell = {f"c{m}": f"block[{m * LANES} + i]" for m in range(numbers)}
    state = {f"z{m}": f"block[{Z + m * LANES} + i]" for m in range(3)}
    twist = {f"v{m}": f"v[{m}]" for m in range(3)}
    return {**_LAW, **cell, **state, **twist, "dt": "given[0]", "weight": f"block[{WEIGHT} + i]"}


def _symbols(trace: Trace, numbers: int) -> _Symbols:
    def several(letter: str, count: int) -> tuple:
        return tuple(Number(trace, f"{letter}{m}") for m in range(count))

    law = LawNumbers(*(Number(trace, name) for name in _LAW))
    vectors = several("c", numbers), several("z", 3), several("v", 3)
    return _Symbols(law, *vectors, Number(trace, "dt"), Number(trace, "weight"))


def forward_passes(lever: Lever, numbers: int) -> Passes:
    """Write the step of discs, whose levers have so many numbers."""

    def step(trace: Trace) -> Any:
        s = _symbols(trace, numbers)
        new, traction = twin(discs.step)(s.law, s.z, twin(lever.seen)(s.cell, s.v), s.dt)
        return new, twin(lever.wrench)(s.cell, tuple(s.weight * each for each in traction))

    stores = [f"block[{Z + m * LANES} + i]" for m in range(3)]
    return passes("discs", traced(step), _sources(numbers), stores, **FORWARD)


def backward_passes(lever: Lever, numbers: int) -> Passes:
    """Write the adjoint of a step of discs, as `cell_slopes.retreat` has it for points."""
    written = derive(discs.step, BY, ("z", "u"))

    def adjoint(trace: Trace) -> Any:
        s = _symbols(trace, numbers)
        load, keeps, by_load = (Number(trace, name) for name in ("load", "keeps", "by_load"))
        pull, bar = (tuple(Number(trace, f"{letter}{m}") for m in range(3)) for letter in ("p", "b"))
        pulled = twin(lever.seen)(s.cell, pull)
        (_, traction), tape = twin(written.forth)(s.law, s.z, twin(lever.seen)(s.cell, s.v), s.dt)
        bars = tuple(keeps * each for each in bar), tuple(load * s.weight * each for each in pulled)
        z_bar, u_bar, *law_bar = twin(written.back)(tape, bars)
        along = sum(a * b for a, b in zip(pulled, traction, strict=True))
        return z_bar, twin(lever.wrench)(s.cell, u_bar), (s.weight + load * by_load) * along, tuple(law_bar)

    given = {f"p{m}": f"given[{m + 3}]" for m in range(3)} | {"load": "given[1]", "keeps": "given[2]"}
    bar = {f"b{m}": f"block[{BAR + m * LANES} + i]" for m in range(3)}
    sources = _sources(numbers) | given | bar | {"by_load": f"block[{BY_LOAD} + i]"}
    return passes("discs_back", traced(adjoint), sources, list(bar.values()), **BACKWARD)


def rate_passes(lever: Lever, numbers: int) -> Passes:
    """Write the rates of discs, and their wrench."""

    def rate(trace: Trace) -> Any:
        s = _symbols(trace, numbers)
        zdot, traction = twin(discs.evaluate)(s.law, s.z, twin(lever.seen)(s.cell, s.v))
        return zdot, twin(lever.wrench)(s.cell, tuple(s.weight * each for each in traction))

    stores = [f"block[{RATES_AT + m * LANES} + i]" for m in range(3)]
    return passes("rates of discs", traced(rate), _sources(numbers), stores, **RATE)


def slope_passes(lever: Lever, numbers: int) -> Passes:
    """Write the derivatives of the rates of discs, by state and velocity."""
    written = derive(discs.evaluate, ("z", "u"), ("z", "u"))

    def slopes(trace: Trace) -> Any:
        s = _symbols(trace, numbers)
        _, tape = twin(written.forth)(s.law, s.z, twin(lever.seen)(s.cell, s.v))
        units, none = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)), (0.0, 0.0, 0.0)
        rows = [twin(written.back)(tape, (unit, none)) for unit in units]
        return tuple(by_z for by_z, _ in rows), tuple(by_u for _, by_u in rows)

    stores = [f"block[{SLOPES_AT + m * LANES} + i]" for m in range(18)]
    return passes("slopes of discs", traced(slopes), _sources(numbers), stores, **SLOPES)


def kind_of(lever: Lever, numbers: int) -> Kind:
    """Return the functions of discs with a lever of so many numbers."""
    forth, back = forward_passes(lever, numbers), backward_passes(lever, numbers)
    step, adjoint, forth_numbers, back_numbers = forth.run, back.run, LANES * forth.rows, LANES * back.rows

    @kernel
    def advance(lever, law, w, blocks, lanes, twist, dt):
        work, total = room(forth_numbers), (0.0, 0.0, 0.0)
        for k in range(blocks):
            total = plus(total, 1.0, step(law, twist, (dt,), at(w, k * BLOCK), work, lanes))
        return total

    @kernel
    def retreat(lever, law, block, lanes, held, pull, load):
        given = held[1], load, 0.0 if load == 0.0 else 1.0, pull[0], pull[1], pull[2]
        s = adjoint(law, held[0], given, block, room(back_numbers), lanes)
        return StepBars((s[0], s[1], s[2]), s[3], (s[4], s[5], s[6], s[7], s[8], s[9], s[10], s[11]))

    return Kind(lever, 3, advance, retreat, cells_rollout.pushed_of(discs.step), reader_of(3))


DISCS, TURNED_DISCS = kind_of(disc_cells.POSITIONS, 3), kind_of(disc_cells.LEVERS, 6)


def _run(written: Passes) -> Any:
    """Return `(law, v, block, lanes)`, which runs passes in memory of their own."""
    run, numbers = written.run, LANES * written.rows

    @kernel
    def passed(law, v, block, lanes):
        return run(law, v, (0.0,), block, room(numbers), lanes)

    return passed


def evaluate(lever, rate, contact, z, v, zdot, w):
    """Write `z'`, and `W`."""
    own, twist, total, block = cells.read(contact), three(v), (0.0, 0.0, 0.0), room(SOLVER_BLOCK)
    n, (_, lanes) = own.count, divided(own.count)
    for first in range(0, n, lanes):
        count = min(lanes, n - first)
        distributed_step.fill(lever, 3, own, z, first, count, lanes, block)
        total = plus(total, 1.0, rate(own.law, twist, block, lanes))
        for m in range(3):
            distributed_step.copy(count, at(block, RATES_AT + m * LANES), at(zdot, m * n + first))
    put(w, total)


def linearise(lever, slope, contact, z, v, lin):
    """Write A and F of each cell (see `general_cells`)."""
    own, twist, block = cells.read(contact), three(v), room(SOLVER_BLOCK)
    n, (_, lanes) = own.count, divided(own.count)
    for first in range(0, n, lanes):
        count = min(lanes, n - first)
        distributed_step.fill(lever, 3, own, z, first, count, lanes, block)
        slope(own.law, twist, block, lanes)
        for m in range(18):
            distributed_step.copy(count, at(block, SLOPES_AT + m * LANES), at(lin, m * n + first))


SOLVER_BLOCK = SLOPES_AT + LANES * 18
"""Numbers of a block of the solver."""


def _rates(lever: Lever, numbers: int, name: str) -> ModelFunctions:
    """Return the functions of discs for the solver: rates and slopes in passes, the rest disc by disc."""
    model = {"lever": lever, "bristle": disc_cells.BRISTLE, "read": cells.read}
    vector = {"rate": _run(rate_passes(lever, numbers)), "slope": _run(slope_passes(lever, numbers))}
    return functions_of(name, (evaluate, linearise, *RATES[2:]), **model, **vector)


SOLVED, TURNED_SOLVED = _rates(disc_cells.POSITIONS, 3, "discs"), _rates(disc_cells.LEVERS, 6, "turned_discs")


def _steps(kind: Kind, name: str) -> StepFunctions:
    model = {"lever": kind.lever, "advance": kind.advance, "size": 3, "bristle": disc_cells.BRISTLE, "read": cells.read}
    return step_functions(name, distributed_step.TEMPLATES, **model)


STEPS, TURNED_STEPS = _steps(DISCS, "discs"), _steps(TURNED_DISCS, "turned_discs")
ROLLOUTS, TURNED_ROLLOUTS = bound(DISCS, "discs"), bound(TURNED_DISCS, "turned_discs")
SENSITIVITIES = cells_sensitivities.bound(DISCS, discs.step, "discs")
TURNED_SENSITIVITIES = cells_sensitivities.bound(TURNED_DISCS, discs.step, "turned_discs")
