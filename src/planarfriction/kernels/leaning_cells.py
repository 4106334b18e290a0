"""Cells whose friction forwards and backwards is not the same: bristles that decay towards `c = a g(|u|)/sigma_0`.

A twist that is held holds c, so `z - c` steps as the bristle of a cell without c does, and the traction is that of one
less `sigma_0 c` (docs/anisotropy.md, "Asymmetric friction").
"""

from __future__ import annotations

from typing import Any, NamedTuple

from planarfriction import formulas
from planarfriction.compiler import compiled_math as xp
from planarfriction.compiler import kernel
from planarfriction.kernels import cells, points
from planarfriction.kernels.contacts import functions_of, traction
from planarfriction.kernels.general_cells import RATES, STEPS, bristle
from planarfriction.kernels.rules import ratio
from planarfriction.kernels.steps import step_functions
from planarfriction.kernels.vectors import dot, norm, plus, times


class Leaning(NamedTuple):
    """A law, and the asymmetry a of a cell."""

    law: Any
    a: tuple


@kernel
def _law(own, i):
    return Leaning(own.law, (own.cells[5 * own.count + i], own.cells[6 * own.count + i]))


@kernel
def evaluate(lean, z, u):
    """Return z' and the traction of a cell that moves at u."""
    speed = norm(u)
    q = lean.law.sigma_0 / formulas.stribeck(xp, speed, lean.law)
    h = plus(z, -1.0 / q, lean.a)
    size = norm(h)
    along = ratio(dot(h, u), size)
    rate = plus(u, -formulas.bristle_decay(xp, size * q, along, speed, q, lean.law), h)
    return rate, traction(lean.law, z, rate, u)


@kernel
def step(lean, z, u, dt):
    """Return the new bristle and the traction of a cell that moves at u."""
    c = times(formulas.stribeck(xp, norm(u), lean.law) / lean.law.sigma_0, lean.a)
    new, pull = points.step(lean.law, plus(z, -1.0, c), u, dt)
    return plus(new, 1.0, c), plus(pull, -lean.law.sigma_0, c)


_MODEL = {"lever": cells.LEVERS._replace(law=_law), "bristle": bristle(evaluate, step, linear=True), "read": cells.read}
RATES_OF_LEANING = functions_of("leaning", RATES, **_MODEL)
STEPS_OF_LEANING = step_functions("leaning", STEPS, **_MODEL)
