"""The numbers of a friction law as compiled loops see them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planarfriction import formulas
from planarfriction.kernels import compiled_math as xp
from planarfriction.kernels import inlined, kernel


class LawNumbers(NamedTuple):
    """Parameters of `LuGre`, with `elasto_plastic` 1.0 or 0.0 (names and units as there)."""

    sigma_0: float
    sigma_1: float
    sigma_2: float
    mu_c: float
    mu_s: float
    v_s: float
    gamma: float
    elasto_plastic: float
    breakaway_ratio: float


def law_numbers(law) -> LawNumbers:
    """The numbers of a `LuGre` law."""
    elastic = law.elasto_plastic
    return LawNumbers(
        law.sigma_0,
        law.sigma_1,
        law.sigma_2,
        law.mu_c,
        law.mu_s,
        law.v_s,
        law.gamma,
        0.0 if elastic is None else 1.0,
        0.5 if elastic is None else elastic.breakaway_ratio,  # unused by plain LuGre, but the formulas divide by 1 - it
    )


def law_row(law) -> np.ndarray:
    """The numbers of a `LuGre` law as one row of a table of laws."""
    return np.array(law_numbers(law), dtype=float)


@kernel
def law_of(row):
    """Read a law from a row."""
    return LawNumbers(row[0], row[1], row[2], row[3], row[4], row[5], row[6], row[7], row[8])


@inlined
def grip(law, gamma, speed):
    """`sigma_0/g(v)` [1/m]: one over the steady deflection of a bristle."""
    return law.sigma_0 / formulas.stribeck(xp, speed, law.mu_c, law.mu_s, law.v_s, gamma)


@inlined
def grip_slope(law, gamma, speed, grip):
    """Derivative of `sigma_0/g(v)` with respect to the speed [s/m^2]."""
    slope = formulas.stribeck_slope(xp, speed, law.mu_c, law.mu_s, law.v_s, gamma)
    return -grip * grip * (1.0 / law.sigma_0) * slope
