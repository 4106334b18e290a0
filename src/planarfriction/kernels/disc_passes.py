"""Steps, rates and their derivatives of discs in blocks as vector loops, written from the functions of one disc.

See `passes` for how loops come out of a trace, `disc_steps` and `disc_rollouts` for what runs them.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from planarfriction.formulas import LawNumbers
from planarfriction.kernels import discs
from planarfriction.kernels.cell_blocks import BAR, BY_LOAD, LANES, WEIGHT, Z
from planarfriction.kernels.cells import Lever
from planarfriction.kernels.cells_rollout import BY
from planarfriction.kernels.derive import derive
from planarfriction.kernels.passes import Passes, passes
from planarfriction.kernels.trace import Number, Trace, traced
from planarfriction.kernels.twins import twin

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
