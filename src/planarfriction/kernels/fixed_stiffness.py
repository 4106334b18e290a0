"""Rates of cells whose stiffness does not grow with the load (docs/physics.md, "Stiffness and load").

A bristle moves as one of the published law at `l z` with `l = f_ref/f` (see `settle`), and besides returns to its limit
where a falling load has left it beyond. The factor l comes behind the twist.
"""

from __future__ import annotations

import functools
from typing import Any, NamedTuple

from planarfriction.compiler import kernel
from planarfriction.compiler.memory import Doubles
from planarfriction.formulas import LawNumbers
from planarfriction.kernels import cells, leaning_cells
from planarfriction.kernels.cell_passes import KINDS
from planarfriction.kernels.cells import CellsContact
from planarfriction.kernels.contacts import ModelFunctions, functions_of
from planarfriction.kernels.general_cells import RATES, Bristle, bristle
from planarfriction.kernels.leaning_cells import Leaning
from planarfriction.kernels.settle import recovery
from planarfriction.kernels.vectors import Vector, norm, plus, times


class Scaled(NamedTuple):
    """The law of a cell, and the factor l on its deflections."""

    law: LawNumbers | Leaning
    factor: float


class _Parts(NamedTuple):
    """Functions of the law of a cell."""

    numbers: Any
    middle: Any
    """`(law)`: return the middle of the limit of the bristle."""


@kernel
def _itself(law: LawNumbers) -> LawNumbers:
    return law


@kernel
def _law_of(lean: Leaning) -> LawNumbers:
    return lean.law


@kernel
def _nowhere(law: LawNumbers) -> Vector:
    return 0.0, 0.0


@kernel
def _nowhere_of_disc(law: LawNumbers) -> Vector:
    return 0.0, 0.0, 0.0


_PARTS = {
    (2, False): _Parts(_itself, _nowhere), (3, False): _Parts(_itself, _nowhere_of_disc),
    (2, True): _Parts(_law_of, leaning_cells.middle), (3, True): _Parts(_law_of, leaning_cells.middle_of_disc),
}  # fmt: skip


def _recovering(published: Any, size: int, parts: _Parts) -> Bristle:
    """Return the bristle that recovers from beyond its limit, from the rate and the traction of the published one."""
    numbers, middle = parts

    @kernel
    def evaluate(scaled: Scaled, z: Vector, u: Vector) -> tuple[Vector, Vector]:
        bent = times(scaled.factor, z)
        rate, traction = published(scaled.law, bent, u)
        law, out = numbers(scaled.law), plus(bent, -1.0, middle(scaled.law))
        k = recovery(law, out, norm(u))
        return plus(rate, -k, out), plus(traction, law.sigma_1 * k, out)

    return bristle(evaluate, None, size)


@functools.cache
def rates_of(size: int, turned: bool, leans: bool) -> ModelFunctions:
    """Return the functions of contacts of a kind of cells (see `cell_passes.KINDS`)."""
    kind = KINDS[size, turned, leans]
    given = kind.lever.law

    @kernel
    def law(contact: CellsContact, i: int, v: Doubles) -> Scaled:
        return Scaled(given(contact, i, v), v[3])

    recovering = _recovering(kind.element.evaluate, size, _PARTS[size, leans])
    lever = kind.lever._replace(law=law)
    return functions_of(f"fixed_{kind.name}", RATES, lever=lever, bristle=recovering, read=cells.read)
