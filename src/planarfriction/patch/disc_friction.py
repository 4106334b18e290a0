"""Sliding friction of small discs, whatever their size and speed."""

from __future__ import annotations

from typing import Any

import numpy as np

from planarfriction import formulas
from planarfriction.formulas import DISC_A, DISC_B, DISC_C


def disc_friction(slide: Any, spin: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return `c_t`, `c_s` [-] and the mean speed S of discs from `|u|^2` and `(a omega)^2`.

    Friction is `W/S`, `W = (c_t u, c_s kappa a omega)` (see `formulas.disc_friction`).
    """
    slide_share, spin_share, _ = _shares(slide, spin)
    c_t, c_s, m = formulas.disc_friction(np, slide_share, spin_share)
    return c_t, c_s, np.sqrt(slide + m * spin)


def disc_curvature(u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return g `[...]` and q `[..., 3]` of `dW/du = diag(c_t, c_t, c_s) + g q q'`, for velocities u `[..., 3]`.

    `S^2(p, o)` is homogeneous of degree 1 in `p = |u|^2` and `o = (a omega)^2`, so that its second derivatives are
    those by p times 1, `-p/o` and `(p/o)^2`; with `x = p/(p + o)` and `y = 1 - x` they are `(y^2, -x y, x^2)` times
    `7/36 (-2 C n - 2 d (A e - n d)/e)/(e^2 (p + o))`, `n = y + A x`, `d = B y + 2 C x`, `e = y^2 + B x y + C x^2`.
    """
    x, y, per = _shares(u[..., 0] ** 2 + u[..., 1] ** 2, 2.0 * u[..., 2] ** 2)
    y = np.where(per > 0.0, y, 1.0)
    n, d, e = y + DISC_A * x, DISC_B * y + 2.0 * DISC_C * x, y * y + DISC_B * x * y + DISC_C * x * x
    bent = (7.0 / 36.0) * (-2.0 * DISC_C * n - 2.0 * d * (DISC_A * e - n * d) / e) / (e * e)
    return 2.0 * bent * per, np.stack([y * u[..., 0], y * u[..., 1], -2.0 * x * u[..., 2]], -1)


def _shares(slide: Any, spin: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the shares of slide and spin in their sum, and one over the sum, 0 at rest."""
    total = np.asarray(slide + spin)
    per = np.divide(1.0, total, out=np.zeros_like(total), where=total > 0.0)
    return slide * per, spin * per, per
