"""Rates of cells whose stiffness does not grow with the load (docs/physics.md, "Stiffness and load").

A bristle moves as one of the published law at `l z` with `l = f_ref/f` (see `settle`), and besides returns to its limit
where a falling load has left it beyond. The factor l comes behind the twist.
"""

from __future__ import annotations

import functools

from planarfriction.compiler import kernel
from planarfriction.formulas import LawNumbers
from planarfriction.kernels import cells, leaning_cells
from planarfriction.kernels.cell_passes import KINDS, CellKind, Element
from planarfriction.kernels.cell_steps import rates_of
from planarfriction.kernels.contacts import ModelFunctions
from planarfriction.kernels.leaning_cells import Leaning
from planarfriction.kernels.settle import recovery
from planarfriction.kernels.vectors import Vector, norm, plus, times


@kernel
def _itself(law: LawNumbers) -> LawNumbers:
    return law


@kernel
def _law_of(lean: Leaning) -> LawNumbers:
    return lean.law


@kernel
def _bent(law: LawNumbers, z: Vector) -> Vector:
    return z


_PARTS = {
    (2, False): (_itself, _bent), (3, False): (_itself, _bent),
    (2, True): (_law_of, leaning_cells.out), (3, True): (_law_of, leaning_cells.out_of_disc),
}  # fmt: skip
"""Numbers of the law of a cell, and its bristle as seen from the middle of its limit."""


def _recovering(kind: CellKind) -> Element:
    """Return the bristle that recovers from beyond its limit, from the rate and the traction of the published one."""
    published, (numbers, out) = kind.element.evaluate, _PARTS[kind.element.size, kind.leans]

    @kernel
    def evaluate(law: LawNumbers | Leaning, z: Vector, u: Vector, factor: float) -> tuple[Vector, Vector]:
        bent = times(factor, z)
        rate, traction = published(law, bent, u)
        plain, beyond = numbers(law), out(law, bent)
        k = recovery(plain, beyond, norm(u))
        return plus(rate, -k, beyond), plus(traction, plain.sigma_1 * k, beyond)

    return Element(f"recovering {kind.element.name}", kind.element.size, evaluate, None)


@functools.cache
def fixed_rates_of(size: int, turned: bool, leans: bool) -> ModelFunctions:
    """Return the functions of contacts of a kind of cells (see `cell_passes.KINDS`)."""
    kind = KINDS[size, turned, leans]
    fixed = kind._replace(name=f"fixed_{kind.name}", element=_recovering(kind), linear=False, fixed=True)
    return rates_of(fixed, cells.read)
