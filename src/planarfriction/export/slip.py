"""Twists of wrenches for source code: the traced search for the normal of a patch's limit surface."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from planarfriction.export.trace import Block, Number, Table, Trace, traced
from planarfriction.export.twins import twin
from planarfriction.limit_surface import LimitSurfaceTable
from planarfriction.limit_surface.base import CERTIFIED
from planarfriction.limit_surface.loops import twists
from planarfriction.limit_surface.loops.twists import Limits, Search, StoredPotential
from planarfriction.patch import ContactPatch

LIMITS = {"double": twists.FINE, "float": Limits(1e-6, 1e-4, 1e-5, 1e-6)}
"""Limits of searches by precision: in single precision dissipation is rounded to 1e-7."""

LARGEST_ANGLE = {"double": CERTIFIED, "float": 1e-3}
"""Largest angle [rad] by which the wrench of a twist may miss the given one."""


class Slip(NamedTuple):
    """The search for a twist in functions of its axes `c` [9] and of a `Search` `s` [14]."""

    surface: LimitSurfaceTable
    tables: dict[str, np.ndarray]
    """Numbers of the surface, and directions over their dissipation [M, 3] to start from."""
    target: Block
    """Unit vector [3] that the search is for, from a wrench `w` [3]."""
    begin: Block
    """Axes and search from the unit vector `t` and a first guess `g` [3]."""
    attempt: Block
    """Search after another attempt."""
    end: Block
    """Twist [3] of unit dissipation, and the angle [rad] by which its wrench misses the given one."""
    angle: float
    """Largest angle that is taken."""


def slip_of(patch: ContactPatch, precision: str) -> Slip | None:
    """Trace the search in the `LimitSurfaceTable` of a patch; None for patches of one point or of many shapes."""
    if patch.depends_on_load or not patch.contact_radius() > 0.0:
        return None
    surface = LimitSurfaceTable(patch)
    _, size, data = surface.numbers
    frame = surface._scaling.tolist()

    def place(trace: Trace) -> tuple[Any, Search]:
        c: list[Any] = [Number(trace, f"c[{i}]") for i in range(9)]
        s: list[Any] = [Number(trace, f"s[{i}]") for i in range(len(Search._fields))]
        return (tuple(c[:3]), tuple(c[3:6]), tuple(c[6:])), Search(*s)

    def three(trace: Trace, name: str) -> tuple[Number, ...]:
        return tuple(Number(trace, f"{name}[{i}]") for i in range(3))

    def target(trace: Trace) -> Any:
        return twin(twists.target_of)(frame, three(trace, "w"))

    def begin(trace: Trace) -> Any:
        return twin(twists.begin_search)(three(trace, "t"), three(trace, "g"))

    def attempt(trace: Trace) -> Any:
        numbers: Any = Table(trace, "normals", data)
        table = StoredPotential(numbers, size, data, 0.0)
        lean, (axes, s) = twin(twists.lean_of)(frame), place(trace)
        evaluate = twin(twists.table_at)
        return twin(twists.try_place)(evaluate, table, lean, axes, LIMITS[precision], s, [0.0] * 9)

    def end(trace: Trace) -> Any:
        (axes, s), twist = place(trace), [0.0] * 3
        twin(twists.put_twist)(frame, twin(twists.place_of)(axes, s.a, s.b), s.power, twist)
        return (*twist, s.angle)

    duals = surface._table.duals.reshape(3, -1).T.astype(np.float32)  # rough: Newton's method goes on from there
    tables = {"normals": data, "duals": np.unique(duals, axis=0)}
    return Slip(surface, tables, traced(target), traced(begin), traced(attempt), traced(end), LARGEST_ANGLE[precision])
