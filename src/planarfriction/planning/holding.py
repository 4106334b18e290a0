"""The smallest normal force with which a contact holds a load."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from planarfriction import validation
from planarfriction.errors import InvalidValueError
from planarfriction.limit_surface import LimitSurface, LimitSurfaceCells, LimitSurfaceExact
from planarfriction.patch import ContactPatch

_STEP, _STEPS = 1.25, 120
"""Factor between the loads that are tried on a patch that follows its load, and how many of them."""


def holding_load(wrench: ArrayLike, patch: ContactPatch, mu: float, margin: float = 0.0) -> float:
    """Return the smallest normal force [N] of a contact that holds a load `wrench` `(fx, fy, tau)` [N, N, N m].

    The load acts on the body, about the origin of the contact frame. Friction can be anything inside the limit surface:
    `f_N = max_V (wrench . V) / (mu Phi(V))`, which is attained by the twist V normal to the surface. For a patch that
    depends on the load, it is the smallest root of `f_N = f_N(shape at f_N)`. The result is increased by the share
    `margin`; it is 0 without a load.

    Use mu_s for a body that must just be held, and mu_c for one that must also be stopped. Raises `InvalidValueError`
    if the patch cannot hold the load however hard it is pressed (a torque on a single point).

    Source: Goyal, Ruina, Papadopoulos 1991.
    """
    load = validation.array("wrench", wrench, (3,))
    validation.instance("patch", patch, ContactPatch, "a ContactPatch")
    mu, margin = validation.positive("mu", mu), validation.non_negative("margin", margin)
    if not load.any():
        return 0.0
    if not patch.depends_on_load:
        return (1.0 + margin) * _needed(load, patch, mu, None)
    reach = float(np.hypot(*patch.positions.T).max())
    low = max(float(np.hypot(*load[:2])), abs(float(load[2])) / reach) / (mu * _strongest(patch))
    tried = low * (1.0 - 1e-9)
    for _ in range(_STEPS):
        if _needed(load, patch, mu, tried) <= tried:
            break
        tried, low = _STEP * tried, tried
    else:
        raise InvalidValueError("wrench", "be a load that this patch holds at some normal force", load.tolist())
    if tried <= low:
        return (1.0 + margin) * tried
    from scipy.optimize import brentq

    found = brentq(lambda each: each - _needed(load, patch, mu, each), low, tried, xtol=1e-12 * low)
    return (1.0 + margin) * float(found)  # pyright: ignore[reportArgumentType]


def _needed(load: np.ndarray, patch: ContactPatch, mu: float, normal_force: float | None) -> float:
    """Return the normal force that holds the load on the shape at `normal_force`."""
    kind: type[LimitSurface] = LimitSurfaceExact if patch.root is None or patch.root.ndim == 2 else LimitSurfaceCells
    surface = kind(patch, normal_force=normal_force)
    twist = surface.twist(-load)
    return float(load @ twist / (mu * surface.dissipation(twist)))


def _strongest(patch: ContactPatch) -> float:
    """Return an upper bound on friction over mu in any direction."""
    metric = 1.0 if patch.root is None else float(np.linalg.norm(patch.root, ord=2, axis=(-2, -1)).max())
    return metric * (1.0 + float(np.hypot(*patch.asymmetries().T).max()))
