"""The traced search for the twist of a wrench, and numbers with which the test of an exported library compares."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from planarfriction._engine.codegen.symbolic_functions import twin
from planarfriction._engine.codegen.trace import (
    Mathematics,
    Number,
    Table,
    Trace,
    traced,
)
from planarfriction.export.c_source import Writer
from planarfriction.limit_surface import LimitSurfaceTable
from planarfriction.limit_surface.base import CERTIFIED
from planarfriction.limit_surface.loops import twists
from planarfriction.limit_surface.loops.twists import Limits, Search, StoredPotential
from planarfriction.patch import ContactPatch

LIMITS = {"": twists.FINE, "f": Limits(1e-6, 1e-4, 1e-5, 1e-6)}
"""Limits of searches by suffixes of precisions: in single precision dissipation is rounded to 1e-7."""

LARGEST_ANGLE = {"": CERTIFIED, "f": 1e-3}
"""Largest angle [rad] by which the wrench of a twist may miss the given one."""


class Slip(NamedTuple):
    """The search for a twist in functions of its axes `c` [9] and of a `Search` `s` [14]."""

    surface: LimitSurfaceTable
    tables: dict[str, np.ndarray]
    """Numbers of the surface, and directions over their dissipation [M, 3] to start from."""
    words: dict[str, Any]
    """Lines of the functions by name, and the numbers that end a search."""


def slip_of(patch: ContactPatch, writer: Writer) -> Slip | None:
    """Trace the search in the `LimitSurfaceTable` of a patch; None for patches of one point or of many shapes."""
    if patch.depends_on_load or not patch.contact_radius() > 0.0:
        return None
    surface = LimitSurfaceTable(patch)
    _, size, data = surface.numbers
    frame = surface._scaling.tolist()

    axes = [f"c[{i}]" for i in range(9)]
    search = [f"s[{i}]" for i in range(len(Search._fields))]

    def place(trace: Trace) -> tuple[Any, Search]:
        c, s = ([Number(trace, each) for each in names] for names in (axes, search))
        return (tuple(c[:3]), tuple(c[3:6]), tuple(c[6:])), Search(*s)  # pyright: ignore[reportArgumentType]

    def three(trace: Trace, name: str) -> tuple[Number, ...]:
        return tuple(Number(trace, f"{name}[{i}]") for i in range(3))

    # the unit vector that the search is for, from a wrench `w`; axes and search from that, `t`, and a first guess `g`
    def target(trace: Trace) -> Any:
        return twin(twists.target_of)(frame, three(trace, "w"))

    def begin(trace: Trace) -> Any:
        return twin(twists.begin_search)(three(trace, "t"), three(trace, "g"))

    def attempt(trace: Trace) -> Any:
        numbers: Any = Table(trace, "normals", data)
        table = StoredPotential(numbers, size, data, 0.0)
        lean = twin(twists.lean_of)(frame)
        (axes, s) = place(trace)
        evaluate = twin(twists.table_at)
        found = twin(twists.try_place)(
            evaluate, table, lean, axes, LIMITS[writer.suffix], s, [0.0] * 9
        )
        return found._replace(going=Mathematics.where(found.going, 1.0, 0.0))

    # the twist of unit dissipation, and the angle [rad] by which its wrench misses the given one
    def end(trace: Trace) -> Any:
        (axes, s) = place(trace)
        twist = [0.0] * 3
        twin(twists.put_twist)(
            frame, twin(twists.place_of)(axes, s.a, s.b), s.power, twist
        )
        return (*twist, s.angle)

    # Rough: Newton's method goes on from there.
    duals = surface._table.duals.reshape(3, -1).T.astype(np.float32)
    tables = {"normals": data, "duals": np.unique(duals, axis=0)}
    twist = ["twist[0]", "twist[1]", "twist[2]", "*angle"]
    outputs = {
        target: ["t[0]", "t[1]", "t[2]"],
        begin: [*axes, *search],
        attempt: search,
        end: twist,
    }
    words = {
        each.__name__: "\n".join(writer.lines(traced(each), names))
        for each, names in outputs.items()
    }
    angle = writer.constant(LARGEST_ANGLE[writer.suffix])
    return Slip(
        surface,
        tables,
        words
        | {"trials": twists.MOST_TRIALS, "duals": len(tables["duals"]), "angle": angle},
    )


KINDS = {"": np.float64, "f": np.float32}

TOLERANCES = {"": 1e-9, "f": 1e-3}
"""Differences that pass, of the largest wrench per load: of rounding that slip multiplies."""

MU = 0.5


def samples_of(
    model: Any, slip: Slip | None, writer: Writer, rungs: Any, count: int = 32
) -> dict[str, Any]:
    """Step a model from rest through random twists, normal forces and periods, from sticking to sliding; return source.

    `loads` are followed by the least normal forces that hold them. Normal forces are the `rungs` between which shapes
    are interpolated, if there are any.
    """
    rng = np.random.default_rng(0)
    kind = KINDS[writer.suffix]
    lever = 1.0 if slip is None else slip.surface.contact_radius
    speeds = model.law.numbers.v_s * 10.0 ** rng.uniform(-3.0, 2.0, (count, 1))
    rows = np.hstack([
        rng.normal(size=(count, 3)) * speeds / [1.0, 1.0, lever],
        10.0 ** rng.uniform([-1.0, -5.0], [1.0, -2.0], (count, 2)),
    ]).astype(kind).astype(float)  # fmt: skip
    if rungs is not None:
        rows[:, 3] = rng.choice(
            rungs[np.clip(np.searchsorted(rungs, [0.1, 10.0]), 0, len(rungs) - 1)],
            count,
        )
    state = model.rest()
    wrenches = []
    for row in rows:
        state, wrench = model.step(state, row[:3], row[3], row[4])
        wrenches.append(wrench)
    loads = (rng.normal(size=(count, 3)) * [1.0, 1.0, lever]).astype(kind).astype(float)
    if slip is not None:
        needed = np.einsum("ni,ni->n", slip.surface.twist(-loads), loads) / MU
        loads = np.column_stack([loads, needed])
    tables = {"steps": rows, "wrenches": wrenches, "loads": loads}
    found = {
        name: [[writer.constant(float(x)) for x in row] for row in table]
        for name, table in tables.items()
    }
    numbers = {"mu": MU, "lever": float(lever), "tolerance": TOLERANCES[writer.suffix]}
    return found | {name: writer.constant(each) for name, each in numbers.items()}
