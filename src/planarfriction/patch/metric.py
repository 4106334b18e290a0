"""Friction that depends on the direction: a metric for each cell (grooves) and an asymmetry (a brushed surface).

A cell with the metric `M`, whose symmetric root is `L`, sees `u = L v` and has `L` times the traction that a
cell without a metric would have: in steady sliding `-g L (u/|u| + a)`. It then dissipates the power `g (|u| + a . u)`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planarfriction._support import validation
from planarfriction.errors import InvalidValueError
from planarfriction.geometry import rotate

if TYPE_CHECKING:
    from planarfriction.patch.contact_patch import ContactPatch

_SAME = 1e-12
"""Relative difference of the two entries off the diagonal that still counts as symmetric."""


def friction_metric(angle: float, along: float, across: float) -> np.ndarray:
    """Return the metric `[2, 2]` of grooves: `R diag(along^2, across^2) R'` with R the rotation by `angle` [rad].

    `along` and `across` are the friction coefficients along and across the grooves, relative to those of the law, > 0;
    `angle` is measured to the grooves from the contact frame's x axis. Sliding along `e` dissipates `sqrt(e' M e)`.

    Raises InvalidValueError for an angle that is not finite, and for frictions that are not > 0.
    """
    angle = validation.number("angle", angle)
    along = validation.positive("along", along)
    across = validation.positive("across", across)
    axes = rotate(np.eye(2), angle)
    return _symmetric(axes.T @ np.diag([along**2, across**2]) @ axes)


def symmetric_root(metric: np.ndarray) -> np.ndarray:
    """Return `L` with `L L = M`, symmetric and positive definite, for metrics `[..., 2, 2]`."""
    values, axes = np.linalg.eigh(metric)
    return _symmetric(
        (axes * np.sqrt(values)[..., None, :]) @ np.swapaxes(axes, -1, -2)
    )


def refuse_anisotropy(patch: ContactPatch, by: str) -> None:
    """Raise where `by`, which knows only friction that is the same in all directions, is given other friction."""
    # What is no patch at all has its own error.
    if getattr(patch, "anisotropic", False):
        rule = f"have the same friction in all directions for {by}"
        raise InvalidValueError("patch", rule, "a friction metric")


def refuse_cell_metrics(patch: ContactPatch, by: str) -> None:
    """Raise where `by`, which knows one metric and one asymmetry for all cells, is given one for each cell."""
    different = (
        patch.asymmetry is not None
        and (patch.asymmetries() != patch.asymmetries()[0]).any()
    )
    if different or (patch.root is not None and patch.root.ndim == 3):
        rule = f"have one friction metric and asymmetry for all cells for {by}"
        raise InvalidValueError("patch", rule, "one a cell")


def same_metric(one: ContactPatch, other: ContactPatch) -> bool:
    """Return True if two patches have the same metric for all cells."""
    if one.root is None or other.root is None:
        return one.root is other.root
    return bool(np.array_equal(one.root, other.root))


def _symmetric(matrix: np.ndarray) -> np.ndarray:
    return 0.5 * (matrix + np.swapaxes(matrix, -1, -2))


def positive_definite(metric: np.ndarray) -> np.ndarray:
    """Return the metrics `[..., 2, 2]`, exactly symmetric, or raise an error that shows the first bad one."""
    skew = np.abs(metric[..., 0, 1] - metric[..., 1, 0]) > _SAME * np.abs(metric).max(
        axis=(-1, -2)
    )
    lowest = np.linalg.eigvalsh(_symmetric(metric))[..., 0]
    bad = skew | ~(lowest > 0.0)
    if bad.any():
        raise InvalidValueError(
            "metric", "be symmetric and positive definite", metric[bad][0].tolist()
        )
    return _symmetric(metric)
