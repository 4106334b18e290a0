"""Rates of cells whose stiffness does not grow with the load (docs/physics.md, "Stiffness and load").

A bristle moves as one of the published law at `l z` with `l = f_ref/f` (see `settle`), and besides returns to its limit
where a falling load has left it beyond. The factor l comes behind the twist.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from planarfriction.compiler import kernel
from planarfriction.compiler.memory import Doubles
from planarfriction.formulas import LawNumbers
from planarfriction.kernels import cells, disc_cells, discs, points
from planarfriction.kernels.cells import CellsContact
from planarfriction.kernels.contacts import functions_of
from planarfriction.kernels.general_cells import RATES, Bristle, bristle
from planarfriction.kernels.settle import recovery
from planarfriction.kernels.vectors import Vector, norm, plus, times


class Scaled(NamedTuple):
    """A law, and the factor l on its deflections."""

    law: LawNumbers
    factor: float


@kernel
def _law(contact: CellsContact, i: int, v: Doubles) -> Scaled:
    return Scaled(contact.law, v[3])


def _recovering(published: Any, size: int) -> Bristle:
    """Return the bristle that recovers from beyond its limit, from the rate and the traction of the published one."""

    @kernel
    def evaluate(scaled: Scaled, z: Vector, u: Vector) -> tuple[Vector, Vector]:
        law, bent = scaled.law, times(scaled.factor, z)
        rate, traction = published(law, bent, u)
        k = recovery(law, bent, norm(u))
        return plus(rate, -k, bent), plus(traction, law.sigma_1 * k, bent)

    return bristle(evaluate, None, size)


_POINT, _DISC = _recovering(points.evaluate, 2), _recovering(discs.evaluate, 3)
_KINDS = (
    ("points", cells.POSITIONS, _POINT),
    ("turned_points", cells.LEVERS, _POINT),
    ("discs", disc_cells.POSITIONS, _DISC),
    ("turned_discs", disc_cells.LEVERS, _DISC),
)
RATES_OF = {
    (each.size, "turned" in name): functions_of(
        f"fixed_{name}", RATES, lever=lever._replace(law=_law), bristle=each, read=cells.read
    )
    for name, lever, each in _KINDS
}
"""Functions of contacts by the components of a bristle and whether there is a metric."""
