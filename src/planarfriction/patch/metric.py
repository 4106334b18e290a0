"""Friction that depends on the direction: a metric for each cell (grooves) and an asymmetry (a brushed surface).

A cell with the metric `M`, whose symmetric root is `L`, sees `u = L v` and pulls with `L` times the traction that a
cell without a metric would have: in steady sliding `-g L (u/|u| + a)`. It then dissipates the power `g (|u| + a . u)`.
"""

from __future__ import annotations

import dataclasses
import functools
import math
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np

from planarfriction._support import validation
from planarfriction._support.equality import ByValue
from planarfriction.errors import InvalidValueError
from planarfriction.patch.outline import with_outline

_SAME = 1e-12
"""Relative difference of the two entries off the diagonal that still counts as symmetric."""

_PatchT = TypeVar("_PatchT", bound="Anisotropy")


def friction_metric(angle: float, along: float, across: float) -> np.ndarray:
    """Return the metric `[2, 2]` of grooves: `R diag(along^2, across^2) R'` with R the rotation by `angle` [rad].

    `along` and `across` are the friction coefficients along and across the grooves, relative to those of the law, > 0;
    `angle` is measured to the grooves from the contact frame's x axis. Sliding along `e` dissipates `sqrt(e' M e)`.

    Raises InvalidValueError for an angle that is not finite, and for frictions that are not > 0.
    """
    angle = validation.number("angle", angle)
    squares = [
        validation.positive("along", along) ** 2,
        validation.positive("across", across) ** 2,
    ]
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    return _symmetric((turn * squares) @ turn.T)


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class Anisotropy(ByValue):
    """Friction of a patch that depends on the direction; see `with_friction_metric`."""

    metric: Any = None
    """Metric of the friction, `[2, 2]` or one per cell `[N, 2, 2]` [-]; None: the same in all directions."""
    asymmetry: Any = None
    """Asymmetry `a`, `[2]` or one per cell `[N, 2]` [-], `|a| < 1`; None: the same forwards and backwards."""

    def with_friction_metric(
        self: _PatchT, metric: Any, asymmetry: Any = None
    ) -> _PatchT:
        """Return the same patch with friction that depends on the direction; None and None for friction that does not.

        `metric` `M`: sliding along a unit vector e meets the coefficient `mu sqrt(e' M e)`; see `friction_metric`.
        `asymmetry`
        `a`: sliding along e, a principal axis of M, meets `1 + a . e` times that, so that it is easiest against a. Both
        are in the axes of the contact frame and turn with it: the grooves belong to the patch.

        Raises `InvalidValueError` unless every metric is symmetric and positive definite and every `|a| < 1`.
        """
        patch = dataclasses.replace(self, metric=metric, asymmetry=asymmetry)  # pyright: ignore
        return with_outline(patch, self.outline)  # pyright: ignore

    @functools.cached_property
    def anisotropic(self) -> bool:
        """True if friction depends on the direction; metrics of ones and asymmetries of zero do not make it so."""
        same = self.metric is None or (self.metric == np.eye(2)).all()
        return not same or self.asymmetric

    @functools.cached_property
    def asymmetric(self) -> bool:
        """True if friction differs forwards and backwards."""
        return self.asymmetry is not None and bool(self.asymmetry.any())

    def levers(self) -> np.ndarray:
        """Return `B` with `u_i = B_i V` for the twist V about the contact frame's origin, shape `[N, 2, 3]`.

        `B_i = L_i [[1, 0, -y_i], [0, 1, x_i]]`; the wrench of a traction `t` of cell i is `B_i' t`. If any cell is a
        disc, all have a third row `(0, 0, kappa a_i)` with the `lever_radii` a and `kappa^2 = 1/2`: `[N, 3, 3]`.
        """
        x, y = self.positions.T  # pyright: ignore[reportAttributeAccessIssue]
        one = np.ones_like(x)
        zero = np.zeros_like(x)
        plain = np.moveaxis(np.array([[one, zero, -y], [zero, one, x]]), -1, 0)
        levers = plain if self.root is None else self.root @ plain
        if not self.has_discs:
            return levers
        spin = np.zeros((len(x), 1, 3))
        spin[:, 0, 2] = math.sqrt(0.5) * self.lever_radii
        return np.concatenate([levers, spin], axis=1)

    @functools.cached_property
    def has_discs(self) -> bool:
        """True if any cell is a disc and not a point."""
        return bool(self.radii.any())  # pyright: ignore[reportAttributeAccessIssue]

    @property
    def bristles(self) -> int:
        """Number of components of the bristle of a cell: two of a point; three of all cells if any is a disc."""
        return 3 if self.has_discs else 2

    @functools.cached_property
    def lever_radii(self) -> np.ndarray:
        """Radii `[N]` [m] of the cells in the space of the metric M, `a sqrt(tr M/2)`; those of points are 0."""
        radii = self.radii  # pyright: ignore[reportAttributeAccessIssue]
        return (
            radii
            if self.root is None
            else radii * np.sqrt(0.5 * (self.root**2).sum((-2, -1)))
        )

    def asymmetries(self) -> np.ndarray:
        """Return the asymmetry `a_i` of each cell, shape `[N, 2]`; zeros where there is none."""
        shape = self.positions.shape  # pyright: ignore[reportAttributeAccessIssue]
        return (
            np.zeros(shape)
            if self.asymmetry is None
            else np.broadcast_to(self.asymmetry, shape).copy()
        )

    @functools.cached_property
    def root(self) -> np.ndarray | None:
        """Symmetric root `L` of the metric: `[2, 2]` where it is one for all cells, `[N, 2, 2]`, or None."""
        if self.metric is None or (self.metric == np.eye(2)).all():
            return None
        root = symmetric_root(self.metric)
        return root[0] if root.ndim == 3 and (root == root[0]).all() else root

    def lever_coordinates(
        self, x: np.ndarray, y: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return `(x', y')` `[..., N]` with `L (-y, x) = (-y', x')`: a cell sees a spin as if it stood there.

        For a metric per cell the last axis of `x` and `y` runs over all cells of the patch.
        """
        if self.root is None:
            return x, y
        xx = self.root[..., 0, 0]
        xy = self.root[..., 0, 1]
        yy = self.root[..., 1, 1]
        return yy * x - xy * y, xx * y - xy * x

    def _check_anisotropy(self, kept: np.ndarray) -> None:
        """Check both fields against the cells given, and drop those of cells that are not `kept` `[n]`."""
        for name, axes in (("metric", 2), ("asymmetry", 1)):
            value = getattr(self, name)
            if value is None:
                continue
            value = validation.numbers(name, value)
            per_cell = value.ndim == axes + 1
            value = validation.array(name, value, (len(kept),) * per_cell + (2,) * axes)
            if name == "metric":
                value = _positive_definite(value)
            elif not ((size := np.hypot(value[..., 0], value[..., 1])) < 1.0).all():
                rule = "be shorter than 1 (friction must oppose sliding)"
                raise InvalidValueError("asymmetry", rule, float(size.max()))
            value = value[kept] if per_cell else value
            value.setflags(write=False)
            self._set(**{name: value})


def symmetric_root(metric: np.ndarray) -> np.ndarray:
    """Return `L` with `L L = M`, symmetric and positive definite, for metrics `[..., 2, 2]`."""
    values, axes = np.linalg.eigh(metric)
    return _symmetric(
        (axes * np.sqrt(values)[..., None, :]) @ np.swapaxes(axes, -1, -2)
    )


def refuse_anisotropy(patch: Anisotropy, by: str) -> None:
    """Raise where `by`, which knows only friction that is the same in all directions, is given other friction."""
    if (
        isinstance(patch, Anisotropy) and patch.anisotropic
    ):  # what is no patch at all has its own error
        raise InvalidValueError(
            "patch",
            f"have the same friction in all directions for {by}",
            "a friction metric",
        )


def refuse_cell_metrics(patch: Anisotropy, by: str) -> None:
    """Raise where `by`, which knows one metric and one asymmetry for all cells, is given one for each cell."""
    different = (
        patch.asymmetry is not None
        and (patch.asymmetries() != patch.asymmetries()[0]).any()
    )
    if different or (patch.root is not None and patch.root.ndim == 3):
        raise InvalidValueError(
            "patch",
            f"have one friction metric and asymmetry for all cells for {by}",
            "one a cell",
        )


def same_metric(one: Anisotropy, other: Anisotropy) -> bool:
    """Return True if two patches have the same metric for all cells."""
    if one.root is None or other.root is None:
        return one.root is other.root
    return bool(np.array_equal(one.root, other.root))


def _symmetric(matrix: np.ndarray) -> np.ndarray:
    return 0.5 * (matrix + np.swapaxes(matrix, -1, -2))


def _positive_definite(metric: np.ndarray) -> np.ndarray:
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
