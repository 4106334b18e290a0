"""Mean speed and friction of small discs that slide and spin."""

from __future__ import annotations

from typing import Any

import numpy as np

from planarfriction import formulas


def disc_friction(slide: Any, spin: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return `c_t`, `c_s` [-] and the mean speed S of small discs from `|u|^2` and `(a omega)^2`, of any size.

    Friction is `W/S`, `W = (c_t u, c_s kappa a omega)` (see `formulas.disc_friction`).
    """
    total = np.asarray(slide + spin)
    # Shares of the sum keep in range.
    per = np.divide(1.0, total, out=np.zeros_like(total), where=total > 0.0)
    c_t, c_s, m, _ = formulas.disc_friction(np, slide * per, spin * per)
    return c_t, c_s, np.sqrt(slide + m * spin)
