"""Quotients that are 0 where nothing is there to divide by."""

from __future__ import annotations

import math

from planarfriction._engine.compiler import compiled_math as xp
from planarfriction._engine.compiler import kernel


@kernel
def per(x: float) -> float:
    """Return `1/x` for x > 0; 0 at 0, and so is its slope."""
    return 1.0 / xp.where(x > 0.0, x, math.inf)


@kernel
def ratio(x: float, y: float) -> float:
    """Return `x/y` for y > 0; 0 at 0, and so are its slopes."""
    return x * per(y)
