"""Limit surface of the continuous patch (evenly loaded cells, segments, polygons, discs and rings), by integration."""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from planarfriction._engine.published import surfaces
from planarfriction.limit_surface.base import LimitSurface, SurfaceNumbers
from planarfriction.limit_surface.cells import LimitSurfaceCells
from planarfriction.limit_surface.loops import closed_forms as kernels
from planarfriction.limit_surface.loops.twists import exact_twists
from planarfriction.limit_surface.stored import stored_potential
from planarfriction.patch import SoftFinger, Uniform
from planarfriction.patch.outline import PolygonOutline, RoundOutline

EXACT_RULES = ((4.0, 8), (8.0, 6), (16.0, 5), (50.0, 4), (400.0, 3))
"""Distance of the centre of rotation from an element, in its radii, from which on how many Gauss points a side serve.

Measured against long double on squares, rectangles 4:1, triangles and segments that are the whole patch: the closed
form loses digits in proportion to the distance, 4e-15 of the wrench (1e-14 at 4:1) at the first switch; the rules err
by at most 1e-14 at their switches. Of the second derivatives: 1e-13 and 2e-12."""

STORED_RULES = ((3.0, 6), (6.0, 4), (12.0, 3), (100.0, 2))
"""Rules of stored surfaces, whose nodes are many: 1e-7 of an element's wrench, 1e-8 of that of 441 cells."""

_CORNERS = (
    np.zeros((1, 2)),
    np.array([(-0.5, -0.5), (0.5, 0.5)]),
    np.array([(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)]),
)
"""Corners of a cell that extends in no direction (a point), in one (a segment), in two."""

_ENDS = 3.3
"""End of the double-exponential rule over radii: a share of 3e-19 of the way is left.
The error of the wrench is at most 3e-13 and that of its slope 3e-12 for pressures that
end in a step with k > 8, else 1e-14."""

_RADII = 64
"""Number of points of that rule between kinks."""

_EVEN = 1e300
"""Exponent of the profile of an even pressure: that of a soft fingertip tends to it."""

_THICK = 0.9
"""Inner over outer radius up to which a ring is the difference of two discs: they lose a digit there."""


Rules = tuple[tuple[float, int], ...]


class _Elements(NamedTuple):
    """Points, segments or quads about the centre of pressure, the load of each spread evenly."""

    corners: np.ndarray
    """Corners `[N, 1, 2, or 4, 2]` [m]; a triangle has two corners in one place."""
    weights: np.ndarray
    """Share of the load of each, `[N]` [-]; negative for the triangles that a polygon subtracts."""


def _rows(domain: Any, unit: float, rules: Rules = EXACT_RULES) -> Any:
    """Return the record of a domain that a surface is integrated over, for compiled loops, lengths in `unit` [m]."""
    if isinstance(domain, kernels.Discs):
        return kernels.Discs(domain.radii / unit, domain.places / unit, domain.loads)
    if isinstance(domain, kernels.Rings):
        return domain._replace(
            inner=domain.inner / unit,
            outer=domain.outer / unit,
            radius=domain.radius / unit,
        )
    corners = domain.corners / unit
    return kernels.Elements(
        corners, _shape(corners, domain.weights), *_gauss_rules(corners.shape[1], rules)
    )


def _sums(domain: Any, twists: np.ndarray, unit: float, rules: Rules) -> np.ndarray:
    """Return the sums `[M, 9]` over a domain at unit twists `[M, 3]`, lengths in `unit` [m]."""
    rows = _rows(domain, unit, rules)
    sums = np.empty((len(twists), 9))
    loops = {
        kernels.Discs: kernels.disc_sums,
        kernels.Rings: kernels.ring_sums,
        kernels.Elements: kernels.element_sums,
    }
    loops[type(rows)](rows, twists, sums)
    return sums


@dataclass(frozen=True, eq=False)
class LimitSurfaceExact(LimitSurface):
    """Limit surface of the continuous patch: `W = -dPhi/dV`, `Phi = int p |v| dA`, in closed form.

    Integrated over the patch's outline if the pressure on it is uniform (polygons) or depends on the radius alone
    (discs and rings, `Uniform` or `SoftFinger`), otherwise over its cells, each a rectangle (on lines a segment) of
    uniform pressure. Points remain points, and discs that stand for several cells remain discs. The wrench is
    continuous in the twist, and the Jacobian is exact; on lines it has a logarithmic singularity where the centre of
    rotation meets the line, cut off at 1e-15 of a cell.

    It costs more than a sum over cells; models, whose compiled code cannot evaluate it, store it as a table.
    """

    anisotropy = "uniform"

    @functools.cached_property
    def numbers(self) -> SurfaceNumbers:
        """Numbers at the nodes: the potential and its derivatives along both angles and mixed; the force of a spin."""
        data = stored_potential(
            lambda units: self.sums(units, STORED_RULES), self.segments
        )
        return SurfaceNumbers(surfaces.POTENTIAL, self.segments, data)

    @functools.cached_property
    def centre_of_pressure(self) -> np.ndarray:
        """Centre of pressure `[2]` [m] of the pressure that is integrated."""
        if isinstance(self._outline, PolygonOutline):
            triangles = self._outline.triangles()
            areas = _area(triangles)
            # from the first vertex, so that a polygon far from the origin keeps its digits
            offset = (
                np.einsum("n,nkx->x", areas / areas.sum(), triangles - triangles[0, 0])
                / 3.0
            )
            return triangles[0, 0] + offset
        if isinstance(self._outline, RoundOutline):
            return np.zeros(2)
        return np.array(
            [
                (self._weights() * coordinate).sum()
                for coordinate in self.patch.positions.T
            ]
        )

    def _weights(self) -> np.ndarray:
        return self.patch.tile_weights(self.normal_force)

    @property
    def integrates_outline(self) -> bool:
        """True if the integral is over the outline of the patch, False if it is over its cells."""
        return self._outline is not None

    @functools.cached_property
    def _outline(self) -> PolygonOutline | RoundOutline | None:
        """The patch's outline, if the pressure can be integrated over it."""
        outline = self.patch.outline
        pressure = self.patch.pressure
        laws = (
            (Uniform, SoftFinger) if isinstance(outline, RoundOutline) else (Uniform,)
        )
        if (
            isinstance(outline, RoundOutline)
            and self.patch.root is not None
            and (self.patch.root != np.eye(2)).any()
        ):
            return None  # a metric makes the rings ellipses
        if isinstance(outline, RoundOutline) and self._soft[0] <= outline.inner:
            return None  # the cells nearest to the hole share the load
        return outline if isinstance(pressure, laws) else None

    @property
    def _soft(self) -> tuple[float, float]:
        """Radius at which the pressure on a disc or ring ends [m], and the exponent of its profile."""
        pressure = self.patch.pressure
        load = self.normal_force or 1.0
        if isinstance(pressure, SoftFinger):
            return float(pressure.radius(load)), float(pressure.exponent(load))
        return self.patch.outline.outer, _EVEN  # pyright: ignore[reportOptionalMemberAccess, reportAttributeAccessIssue]

    @functools.cached_property
    def _parts(self) -> _Elements | kernels.Discs | kernels.Rings:
        """Domain that the surface is integrated over, lengths in m."""
        outline = self._outline
        pressure = self.patch.pressure
        self.patch.weights(self.normal_force)  # refuses a missing normal force
        if isinstance(outline, RoundOutline):
            if (
                isinstance(pressure, Uniform)
                and outline.inner <= _THICK * outline.outer
            ):
                radii = np.array(
                    [outline.outer, outline.inner]
                    if outline.inner > 0.0
                    else [outline.outer]
                )
                squares = radii**2 * [1.0, -1.0][: len(radii)]
                return kernels.Discs(
                    radii, np.zeros((2, len(radii))), squares / squares.sum()
                )
            reach, exponent = self._soft
            return kernels.Rings(
                *_double_exponential(),
                outline.inner,
                min(outline.outer, reach),
                reach,
                exponent,
            )
        if isinstance(outline, PolygonOutline):
            triangles = outline.triangles()
            areas = _area(triangles)
            corners = triangles[:, [0, 1, 2, 2]] - self.centre_of_pressure
            return _Elements(self._lever_corners(corners), areas / areas.sum())
        x, y, weights = self._loaded_cells()
        if self.patch.has_discs and not self.patch.cell_extents().any():
            return kernels.Discs(
                self.patch.lever_radii[self._weights() > 0.0], np.array([x, y]), weights
            )
        extents = self.patch.cell_extents()[self.patch.weights(self.normal_force) > 0.0]
        sides = int((extents > 0.0).any(axis=0).sum())
        corners = np.stack([x, y], -1)[:, None] + self._lever_corners(
            extents[:, None] * _CORNERS[sides]
        )
        return _Elements(corners, weights)

    def _lever_corners(self, corners: np.ndarray) -> np.ndarray:
        """Return the corners `[..., 2]` in the lever coordinates of a friction metric, which maps quads to quads."""
        return np.stack(
            self.patch.lever_coordinates(corners[..., 0], corners[..., 1]), -1
        )

    def _radius(self) -> float:
        return float(
            _sums(self._parts, np.array([[0.0, 0.0, 1.0]]), 1.0, EXACT_RULES)[0, 2]
        )

    def sums(
        self, units: np.ndarray, rules: Rules = EXACT_RULES
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return gradient `[M, 3]` and Hessian `[M, 3, 3]` of the dissipation at unit scaled twists `[M, 3]`."""
        sums = _sums(self._parts, units, self.contact_radius, rules)
        return sums[:, :3], sums[:, [3, 4, 5, 4, 6, 7, 5, 7, 8]].reshape(-1, 3, 3)

    def direction(self, units: np.ndarray) -> np.ndarray:
        return self.sums(units)[0]

    def direction_slope(self, units: np.ndarray) -> np.ndarray:
        return self.sums(units)[1]

    @functools.cached_property
    def _points(self) -> LimitSurfaceCells | None:
        """The sum over the cells, if they are points."""
        points = (
            isinstance(self._parts, _Elements)
            and self._parts.corners.shape[1] == kernels.POINTS
        )
        return (
            LimitSurfaceCells(self.patch, normal_force=self.normal_force)
            if points
            else None
        )

    @functools.cached_property
    def _loops(self) -> tuple[kernels.Elements, kernels.Discs, kernels.Rings]:
        """Domains for compiled loops: elements, discs and rings, of which only one is not empty."""
        none = np.zeros(0)
        empty = (
            _rows(_Elements(np.zeros((0, 2, 2)), none), 1.0),
            kernels.Discs(none, np.zeros((2, 0)), none),
        )
        rows = _rows(self._parts, self.contact_radius)
        loops = (*empty, kernels.Rings(none, none, 0.0, 1.0, 1.0, 1.0))
        return tuple(rows if type(each) is type(rows) else each for each in loops)  # pyright: ignore[reportReturnType]

    def _find_twists(self, wrenches: np.ndarray, found: np.ndarray) -> float:
        if self._points is not None:
            return self._points._find_twists(wrenches, found)
        return exact_twists(*self._loops, self._table, self._scaling, wrenches, found)


def _area(triangles: np.ndarray) -> np.ndarray:
    """Return the signed areas `[N]` [m^2] of triangles `[N, 3, 2]` [m]."""
    first = triangles[:, 1] - triangles[:, 0]
    second = triangles[:, 2] - triangles[:, 0]
    return 0.5 * _cross(first, second)


def _cross(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    return first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]


def _shape(corners: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Return the coefficients `[N, 13]` that `limit_surface.loops.closed_forms` wants of elements and their weights."""
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
    """Return rules for elements of `count` corners: nodes `[J, 3, K]` (xi, eta, weight), numbers, distances `[J]`."""
    if count == kernels.POINTS:
        return np.array([[[0.0], [0.0], [1.0]]]), np.array([1]), np.zeros(1)
    nodes = np.zeros((len(rules), 3, max(side for _, side in rules) ** 2))
    points = np.array(
        [side if count == kernels.SEGMENTS else side**2 for _, side in rules]
    )
    for rule, (_, side) in zip(nodes, rules, strict=True):
        x, w = np.polynomial.legendre.leggauss(side)
        if count == kernels.SEGMENTS:
            rule[[0, 2], :side] = x, w
        else:
            rule[:, : side**2] = (
                np.repeat(x, side),
                np.tile(x, side),
                np.outer(w, w).ravel(),
            )
    return nodes, points, np.array([reach for reach, _ in rules])


@functools.cache
def _double_exponential() -> tuple[np.ndarray, np.ndarray]:
    """Return nodes in (0, 1) and weights of the double-exponential rule, for any singularity at the ends."""
    t = np.linspace(-_ENDS, _ENDS, _RADII)
    step = np.exp(-np.pi * np.abs(np.sinh(t)))
    share = np.where(t < 0.0, step, 1.0) / (1.0 + step)
    weight = step / (1.0 + step) ** 2 * np.pi * np.cosh(t) * (t[1] - t[0])
    return share, weight
