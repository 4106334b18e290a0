"""The limit surface of evenly loaded cells, segments, polygons, discs and rings, integrated and not summed."""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np

from planarfriction.kernels import exact as kernels
from planarfriction.limit_surface.base import LimitSurface, SurfaceNumbers, _norm
from planarfriction.limit_surface.cells import LimitSurfaceCells
from planarfriction.patch import Pressure, SoftFinger, Uniform
from planarfriction.patch.outline import PolygonOutline, RoundOutline

EXACT_RULES = ((4.0, 8), (8.0, 6), (16.0, 5), (50.0, 4), (400.0, 3))
"""Distance of the centre of rotation from an element, in its radii, from which on how many Gauss points a side serve.

Measured against long double on squares, rectangles 4:1, triangles and segments that are the whole patch: the closed
form loses digits in proportion to the distance, 4e-15 of the wrench (1e-14 at 4:1) at the first switch; the rules err
by at most 1e-14 at their switches. Of the second derivatives: 1e-13 and 2e-12."""

STORED_RULES = ((3.0, 6), (6.0, 4), (12.0, 3), (100.0, 2))
"""The same for stored surfaces, whose nodes are many: 1e-7 of an element's wrench, 1e-8 of that of 441 cells."""

_CORNERS = (
    np.zeros((1, 2)),
    np.array([(-0.5, -0.5), (0.5, 0.5)]),
    np.array([(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)]),
)
"""Corners of a cell that extends in no direction (a point), in one (a segment), in two."""

_ENDS, _RADII = 3.3, 64
"""Double-exponential rule over radii: it ends where a share of 3e-19 of the way is left, and has so many points between
kinks. Error of the wrench at most 3e-13 and of its slope 3e-12 (pressures that end in a step, k > 8), else 1e-14."""


Rules = tuple[tuple[float, int], ...]


class _Parts(Protocol):
    """What a surface is integrated over: sums `[M, 9]` at unit twists `[M, 3]`, in the unit of length `unit` [m]."""

    def sums(self, twists: np.ndarray, unit: float, rules: Rules) -> np.ndarray: ...


class _Elements(NamedTuple):
    """Points, segments or quads about the centre of pressure, the load of each spread evenly."""

    corners: np.ndarray
    """Corners `[N, 1, 2, or 4, 2]` [m]; a triangle has two corners in one place."""
    weights: np.ndarray
    """Share of the load of each, `[N]` [-]; negative for the triangles that a polygon subtracts."""

    def sums(self, twists: np.ndarray, unit: float, rules: Rules) -> np.ndarray:
        corners = self.corners / unit
        shape = _shape(corners, self.weights)
        nodes, points, reach = _gauss_rules(corners.shape[1], rules)
        sums = np.empty((len(twists), 9))
        kernels.element_sums(corners, shape, nodes, points, reach, twists, sums)
        return sums


_TOGETHER = 4096
"""Directions that are integrated over rings at a time: some ten MB, where all of a large table took a gigabyte."""


class _Rings(NamedTuple):
    """A disc or ring about the centre of pressure under a pressure that depends on the radius alone."""

    inner: float
    outer: float
    pressure: Pressure
    normal_force: float | None

    def sums(self, twists: np.ndarray, unit: float, rules: Rules) -> np.ndarray:
        sums = np.empty((len(twists), 9))
        for first in range(0, len(twists), _TOGETHER):
            part = slice(first, first + _TOGETHER)
            sums[part] = self._sums(twists[part], unit)
        return sums

    def _sums(self, twists: np.ndarray, unit: float) -> np.ndarray:
        spin = np.abs(twists[:, 2])
        with np.errstate(divide="ignore", over="ignore"):
            kink = unit * np.hypot(twists[:, 0], twists[:, 1]) / spin  # where the rim runs as fast as the ring slides
        kink = np.clip(np.where(spin > 0.0, kink, np.inf), self.inner, self.outer)[:, None]
        share, weight = _double_exponential()
        radii = np.hstack([self.inner + (kink - self.inner) * share, kink + (self.outer - kink) * share])
        load = radii * np.hstack([(kink - self.inner) * weight, (self.outer - kink) * weight])
        places = np.stack([radii.ravel(), np.zeros(radii.size)], -1)
        force = None if self.normal_force is None else np.array(self.normal_force)
        load *= self.pressure.relative(places, force).reshape(radii.shape)
        sums = np.empty((len(twists), 9))
        kernels.ring_sums(radii / unit, load / load.sum(axis=1, keepdims=True), twists, sums)
        return sums


@dataclass(frozen=True, eq=False)
class LimitSurfaceExact(LimitSurface):
    """Limit surface of the continuous patch: `W = -dPhi/dV`, `Phi = int p |v| dA`, in closed form.

    Integrated over the patch's outline where the pressure is uniform on it (polygons), or depends on the radius alone
    (discs and rings, `Uniform` or `SoftFinger`); else over its cells, each a rectangle (on lines a segment) of uniform
    pressure. Points stay points. The wrench is continuous in the twist, the Jacobian exact; on lines the Jacobian grows
    without bound (as a logarithm) where the centre of rotation meets the line, and is cut off at 1e-15 of a cell.

    Costs more than a sum over cells, and compiled loops do not know it: models store it as `LimitSurfaceTable` does.
    """

    anisotropy = "uniform"

    @functools.cached_property
    def numbers(self) -> SurfaceNumbers:
        """Those of `LimitSurfaceTable`, which knows the mixed derivatives at its nodes."""
        from planarfriction.limit_surface.table import LimitSurfaceTable

        return LimitSurfaceTable(self.patch, self.segments, normal_force=self.normal_force).numbers

    @functools.cached_property
    def centre_of_pressure(self) -> np.ndarray:
        """Centre of pressure `[2]` of what is integrated [m]."""
        if isinstance(self._outline, PolygonOutline):
            triangles = self._outline.triangles()
            areas = _area(triangles)
            # from the first vertex, so that a polygon far from the origin keeps its digits
            offset = np.einsum("n,nkx->x", areas / areas.sum(), triangles - triangles[0, 0]) / 3.0
            return triangles[0, 0] + offset
        if isinstance(self._outline, RoundOutline):
            return np.zeros(2)
        return super().centre_of_pressure

    @functools.cached_property
    def _outline(self) -> PolygonOutline | RoundOutline | None:
        """The patch's outline, if the pressure can be integrated over it."""
        outline, pressure = self.patch.outline, self.patch.pressure
        laws = (Uniform, SoftFinger) if isinstance(outline, RoundOutline) else (Uniform,)
        if isinstance(outline, RoundOutline) and self.patch.root is not None and (self.patch.root != np.eye(2)).any():
            return None  # a metric makes the rings ellipses
        return outline if isinstance(pressure, laws) else None

    @functools.cached_property
    def _parts(self) -> _Parts:
        """What is integrated over."""
        outline, pressure = self._outline, self.patch.pressure
        self.patch.weights(self.normal_force)  # refuses a missing normal force
        if isinstance(outline, RoundOutline):
            reach = float(pressure.radius(self.normal_force or 1.0)) if isinstance(pressure, SoftFinger) else np.inf
            return _Rings(outline.inner, min(outline.outer, reach), pressure, self.normal_force)
        if isinstance(outline, PolygonOutline):
            triangles = outline.triangles()
            areas = _area(triangles)
            corners = triangles[:, [0, 1, 2, 2]] - self.centre_of_pressure
            return _Elements(self._lever_corners(corners), areas / areas.sum())
        x, y, weights = self._loaded_cells()
        extents = self.patch.cell_extents()[self.patch.weights(self.normal_force) > 0.0]
        sides = int((extents > 0.0).any(axis=0).sum())
        corners = np.stack([x, y], -1)[:, None] + self._lever_corners(extents[:, None] * _CORNERS[sides])
        return _Elements(corners, weights)

    def _lever_corners(self, corners: np.ndarray) -> np.ndarray:
        """Corners `[..., 2]` in the lever coordinates of a friction metric, which maps quads to quads."""
        return np.stack(self.patch.lever_coordinates(corners[..., 0], corners[..., 1]), -1)

    def _radius(self) -> float:
        return float(self._parts.sums(np.array([[0.0, 0.0, 1.0]]), 1.0, EXACT_RULES)[0, 2])

    def sums(self, scaled: np.ndarray, rules: Rules = EXACT_RULES) -> tuple[np.ndarray, np.ndarray]:
        """Gradient `[M, 3]` and second derivatives `[M, 3, 3]` of the dissipation, for scaled twists `[M, 3]`."""
        speed = _norm(scaled)
        moving = speed > 0.0
        sums = np.zeros((len(scaled), 9))
        if moving.any():
            sums[moving] = self._parts.sums(scaled[moving] / speed[moving, None], self.contact_radius, rules)
        per_speed = np.where(moving, 1.0 / np.where(moving, speed, 1.0), 0.0)
        slopes = sums[:, [3, 4, 5, 4, 6, 7, 5, 7, 8]] * per_speed[:, None]
        return sums[:, :3], slopes.reshape(-1, 3, 3)

    def direction(self, units: np.ndarray) -> np.ndarray:
        """Integrated in closed form, as far as there is one."""
        return self.sums(units)[0]

    def direction_slope(self, units: np.ndarray) -> np.ndarray:
        """Integrated alike."""
        return self.sums(units)[1]

    def _scaled_twists_of(self, targets: np.ndarray) -> np.ndarray:
        if isinstance(self._parts, _Elements) and self._parts.corners.shape[1] == kernels.POINTS:
            return LimitSurfaceCells(self.patch, normal_force=self.normal_force)._scaled_twists_of(targets)
        return super()._scaled_twists_of(targets)


def _area(triangles: np.ndarray) -> np.ndarray:
    """Signed areas `[N]` [m^2] of triangles `[N, 3, 2]` [m]."""
    first, second = triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    return 0.5 * _cross(first, second)


def _cross(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    return first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]


def _shape(corners: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """The coefficients `[N, 13]` that `kernels.exact` wants of elements and their weights."""
    count = corners.shape[1]
    signs = {
        kernels.POINTS: [[1.0], [0.0], [0.0], [0.0]],
        kernels.SEGMENTS: [[0.5, 0.5], [-0.5, 0.5], [0.0, 0.0], [0.0, 0.0]],
        kernels.QUADS: [
            [0.25, 0.25, 0.25, 0.25],
            [-0.25, 0.25, 0.25, -0.25],
            [-0.25, -0.25, 0.25, 0.25],
            [0.25, -0.25, 0.25, -0.25],
        ],
    }
    centre, a, b, c = np.einsum("fk,nkx->fnx", np.array(signs[count]), corners)
    shape = np.zeros((len(corners), 13))
    shape[:, :8] = np.hstack([centre, a, b, c])
    if count == kernels.QUADS:
        shape[:, 8:11] = np.stack([_cross(a, b), _cross(a, c), _cross(c, b)], -1)
    else:
        shape[:, 8] = np.hypot(*a.T) if count == kernels.SEGMENTS else 1.0
    shape[:, 11] = np.linalg.norm(corners - centre[:, None], axis=2).max(axis=1)
    shape[:, 12] = weights / (shape[:, 8] * count)
    shape[:, 8:11] *= shape[:, 12:]
    return shape


@functools.cache
def _gauss_rules(count: int, rules: Rules) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The rules for elements of so many corners: nodes `[J, 3, K]` (xi, eta, weight), numbers and distances `[J]`."""
    if count == kernels.POINTS:
        return np.array([[[0.0], [0.0], [1.0]]]), np.array([1]), np.zeros(1)
    nodes = np.zeros((len(rules), 3, max(side for _, side in rules) ** 2))
    points = np.array([side if count == kernels.SEGMENTS else side**2 for _, side in rules])
    for rule, (_, side) in zip(nodes, rules, strict=True):
        x, w = np.polynomial.legendre.leggauss(side)
        if count == kernels.SEGMENTS:
            rule[[0, 2], :side] = x, w
        else:
            rule[:, : side**2] = np.repeat(x, side), np.tile(x, side), np.outer(w, w).ravel()
    return nodes, points, np.array([reach for reach, _ in rules])


@functools.cache
def _double_exponential() -> tuple[np.ndarray, np.ndarray]:
    """Nodes in (0, 1) and weights of the double-exponential rule: any singularity at the ends may be integrated."""
    t = np.linspace(-_ENDS, _ENDS, _RADII)
    step = np.exp(-np.pi * np.abs(np.sinh(t)))
    share = np.where(t < 0.0, step, 1.0) / (1.0 + step)
    weight = step / (1.0 + step) ** 2 * np.pi * np.cosh(t) * (t[1] - t[0])
    return share, weight
