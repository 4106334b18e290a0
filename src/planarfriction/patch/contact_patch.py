"""The contact patch: the positions and areas of its cells, and how the normal load is distributed over them."""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, overload

import numpy as np
from numpy.typing import ArrayLike

from planarfriction._support import validation
from planarfriction._support.equality import ByValue, checked
from planarfriction._support.pictures import picture
from planarfriction.errors import InvalidValueError
from planarfriction.patch import outline as outlines
from planarfriction.patch import pressure as pressures
from planarfriction.patch.disc_friction import disc_friction
from planarfriction.patch.grid import (
    MOST_CELLS,
    Grid,
    cell_extents,
    check_cells,
    point_shares,
    warn_of_the_unit,
)
from planarfriction.patch.grid_error import GridError, finer, grid_error
from planarfriction.patch.metric import positive_definite, symmetric_root
from planarfriction.patch.moment_pressure import weights_under
from planarfriction.patch.pressure import Pressure, Uniform
from planarfriction.patch.pressure_maps import map_grid, read_maps

MOST_DEGREE = 40
"""Largest degree of polynomial moments: beyond it powers are rounding."""

_UNIT_BOX = np.array([(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)])


def _sizes(name: str, value: Any) -> tuple[float, ...]:
    """Return `value` as two finite numbers >= 0, or raise."""
    size = validation.vector(name, value, 2)
    if not (size >= 0.0).all():
        raise InvalidValueError(name, "be >= 0", float(size.min()))
    return tuple(size.tolist())


@dataclass(frozen=True, eq=False, repr=False)
class ContactPatch(ByValue):
    """A flat contact: N cells at `rho_i` with areas `a_i`, and a pressure that determines their weights.

    `w_i = p_i a_i q_i / sum(p a q)`, so that `sum(w) = 1` and cell i carries the normal force `w_i f_N`; see
    `point_shares` for the factors `q`.

    Frame: the contact frame, x to the right, y up; **row 0 of a grid or map is its top** (largest y). Grids and maps
    are centred on the origin (a polygon stays where its vertices are) and list their cells row by row from the top
    left; points keep the order given. Cells that carry no pressure at any load are dropped. A patch has at most
    1,100,000 cells; one wider than 1 m or smaller than 10 um is made with a warning, as its lengths may be millimetres.

    Make patches with the class methods (`disc`, `rectangle`, `ring`, `line`, `polygon`, `points`, `from_pressure`).
    Their `pressure` is a law (`Uniform`, `LinearGradient`, `SoftFinger`), a function `p(x, y)` of two floats [m], one
    number per cell, or None for uniform; it is evaluated at the positions of the cells, and constant in each. The
    centre of a continuous pressure `1 + g x` is `g h^2/12` farther in x than that of its cells, of side h.

    `normal_force` [N] may be left out where the shape does not depend on it. Its shape `[...]` leads that of the
    result. A patch whose shape depends on the load has weights 0, and moments 0, at zero load.

    Source: Waltersson and Karayiannidis 2024, section III.

    Raises InvalidValueError for no cells, wrong shapes, numbers that are not finite, negative pressure, zero total
    pressure, and a normal force that is negative or missing where it is needed.
    """

    positions: np.ndarray = checked(validation.array, (None, 2))
    """Positions of the cells (centroids of their parts inside the patch), shape `[N, 2]` [m]."""
    areas: np.ndarray  # pyright: ignore[reportGeneralTypeIssues]
    """Areas of the cells inside the patch, shape `[N]` [m^2]."""
    pressure: Any = field(default_factory=Uniform)
    """Pressure law."""
    grid: Grid | None = checked(
        validation.instance, Grid, "a Grid or None", default=None
    )
    """Regular grid from which the cells were cut, or None."""
    name: str = checked(validation.text, default="patch")
    """Name for plots and tables."""
    cell_size: tuple[float, float] | None = checked(_sizes, default=None)
    """Width and height of a whole cell [m], with its load spread evenly over it; None for points (lines: one is 0)."""
    point_shares: Any = None
    """Factors `q` on the areas `[N]` [-] that give evenly pressed shapes by name or outline the second moments of their
    areas, although each cell is a point; None: ones (other pressures, the published masks)."""
    radii: Any = field(default=None, kw_only=True)
    """Radii `a` of cells that are small discs, shape `[N]` [m], 0 for points; None: points (see `discs`)."""
    metric: Any = field(default=None, kw_only=True)
    """Metric of the friction, `[2, 2]` or one per cell `[N, 2, 2]` [-]; None: the same in all directions."""
    asymmetry: Any = field(default=None, kw_only=True)
    """Asymmetry `a`, `[2]` or one per cell `[N, 2]` [-], `|a| < 1`; None: the same forwards and backwards."""
    outline: outlines.Outline | None = field(init=False, default=None)
    """Outline from which the class methods cut the cells; None for other cells."""
    _fixed_weights: np.ndarray | None = field(init=False, default=None, compare=False)

    def __post_init__(self) -> None:
        super().__post_init__()
        positions = self.positions
        shape = positions.shape[:1]
        if len(positions) == 0:
            raise InvalidValueError("patch", "have at least one cell", "none")
        if self.cell_size is None and self.grid is not None:
            self._set(cell_size=(self.grid.cell_width, self.grid.cell_height))
        check_cells(len(positions))
        areas = validation.positive_array("areas", self.areas, shape)
        radii = np.zeros(shape) if self.radii is None else self.radii
        radii = validation.non_negative_array("radii", radii, shape)
        law = pressures.as_law(self.pressure, positions)
        if not law.depends_on_load:
            pressures.check_pressure(law.relative(positions), positions)
        kept = law.ever_loaded(positions)
        if not kept.any():
            rule = "be > 0 on at least one cell"
            raise InvalidValueError("pressure", rule, "0 on all of them")
        self._check_anisotropy(kept)
        self._set(positions=positions[kept], areas=areas[kept], radii=radii[kept])
        self._set(pressure=law.only(kept))
        if type(law) is not Uniform:  # other pressures keep their ratios
            self._set(point_shares=None)
        elif self.point_shares is not None:
            shares = self.point_shares
            shares = validation.positive_array("point_shares", shares, shape)
            shares.setflags(write=False)
            self._set(point_shares=shares)
        for numbers in (self.positions, self.areas, np.asarray(self.radii)):
            numbers.setflags(write=False)
        if not law.depends_on_load:
            fixed = self._shares(self.pressure.relative(self.positions))
            fixed.setflags(write=False)
            self._set(_fixed_weights=fixed)
        warn_of_the_unit(self.name, self.positions, self.cell_size)

    @classmethod
    def disc(
        cls, radius: float, cells: int = 21, *, pressure: Any = None, name: str = "disc"
    ) -> ContactPatch:
        """Return a disc of `radius` [m] about the origin on a grid of `cells` x `cells`; cells at the rim are cut.

        A cut cell has the area of its part inside the disc, and its position is the centroid of that part. Raises
        InvalidValueError for a parameter that breaks its rule.
        """
        radius = validation.length("radius", radius)
        grid = Grid.square(2 * radius, cells)
        outline = outlines.RoundOutline(0.0, radius)
        return outlines.clipped(cls, outline, grid, pressure, name)

    @classmethod
    def disc_published(
        cls,
        radius: float = 0.01,
        cells: int = 21,
        *,
        pressure: Any = None,
        name: str = "disc_published",
    ) -> ContactPatch:
        """Return the published mask: cells of a grid `2 radius` [m] wide, within `cells // 2` cells of its centre.

        Distances are between cell centres and `cells` is odd, so the size of the mask depends on it: 317 of 21 x 21
        cells have the area of a disc with a radius of 10.05 cells, not 10.5. Use it for reproduction; `disc` is the
        true disc. Raises InvalidValueError for an even number of cells.
        """
        grid = Grid.square(2 * validation.length("radius", radius), cells)
        if grid.columns % 2 == 0:
            raise InvalidValueError(
                "cells", "be odd (the published mask is centred on a cell)", cells
            )
        reach = grid.columns // 2
        squares = (np.arange(grid.columns) - reach) ** 2
        inside = np.add.outer(squares, squares) <= reach**2
        positions = grid.centres()[inside.ravel()]
        areas = np.full(len(positions), grid.cell_area)
        return cls(positions, areas, pressure, grid, name)

    @classmethod
    def rectangle(
        cls,
        width: float,
        height: float | None = None,
        cells: int | Sequence[int] = 21,
        *,
        pressure: Any = None,
        name: str = "rectangle",
    ) -> ContactPatch:
        """Return a rectangle of `width` x `height` [m] about the origin; without `height` a square.

        `cells` counts along the longer side (cells as square as possible), or is `(columns, rows)`. One row of cells is
        a line, whose cells are discs (see `line`). Raises InvalidValueError for a parameter that breaks its rule.
        """
        width = validation.length("width", width)
        height = width if height is None else validation.length("height", height)
        grid = Grid.around_origin(
            width, height, *outlines.columns_and_rows(cells, width, height)
        )
        positions = grid.centres()
        corners = _UNIT_BOX * (width, height)
        areas = np.full(len(positions), grid.cell_area)
        shares = point_shares(positions, areas, (grid.cell_width, grid.cell_height))
        patch = cls(positions, areas, pressure, grid, name, point_shares=shares)
        patch = outlines.with_outline(patch, outlines.polygon_outline(corners))
        line = 1 in (grid.columns, grid.rows) and len(areas) > 1
        return patch.discs() if line else patch

    @classmethod
    def ring(
        cls,
        inner_radius: float,
        outer_radius: float,
        cells: int = 21,
        *,
        pressure: Any = None,
        name: str = "ring",
    ) -> ContactPatch:
        """Return a ring between two radii [m] about the origin on a grid of `cells` x `cells`, cut at both rims.

        Raises InvalidValueError unless 0 < inner_radius < outer_radius.
        """
        inner = validation.length("inner_radius", inner_radius)
        outer = validation.length("outer_radius", outer_radius)
        if inner >= outer:
            raise InvalidValueError(
                "inner_radius", "be < outer_radius", f"{inner} and {outer}"
            )
        grid = Grid.square(2 * outer, cells)
        outline = outlines.RoundOutline(inner, outer)
        return outlines.clipped(cls, outline, grid, pressure, name)

    @classmethod
    def line(
        cls,
        length: float,
        cells: int = 21,
        *,
        direction: str = "y",
        profile: Any = None,
        name: str = "line",
    ) -> ContactPatch:
        """Return a line of `length` [m] along `direction` ("y" or "x") through the origin, one cell wide, of discs.

        Points in a row have the largest error if the line rotates about one of its cells: as discs, 21 cells have two
        thirds of the largest error of force in motion (one third if they are squares).
        `dataclasses.replace(line, radii=None)` has points.

        `profile` holds the relative pressures `[cells]` from the top down (y) or from the left to the right (x), or is
        a function of the coordinate along the line [m]; None is uniform. The grid is square with the line in its middle
        column or row (across the line it has one cell more than along it where `cells` is even). Raises
        InvalidValueError for a parameter that breaks its rule.
        """
        length = validation.length("length", length)
        cells = validation.count("cells", cells, at_most=MOST_CELLS)
        along = ["x", "y"].index(validation.choice("direction", direction, ("x", "y")))
        side = length / cells
        across = cells + 1 - cells % 2
        columns, rows = (cells, across) if along == 0 else (across, cells)
        grid = Grid.around_origin(columns * side, rows * side, columns, rows)
        positions = np.zeros((cells, 2))
        positions[:, along] = (np.arange(cells) - (cells - 1) / 2) * (
            side if along == 0 else -side
        )
        if callable(profile):
            places = positions[:, along, None].tolist()
            profile = pressures.evaluated("profile", profile, places)
        elif profile is not None:
            profile = pressures.non_negative_array("profile", profile, (cells,))
        size = (side, 0.0) if along == 0 else (0.0, side)
        areas = np.full(cells, grid.cell_area)
        patch = cls(positions, areas, profile, grid, name, size)
        return patch.discs() if cells > 1 else patch

    @classmethod
    def polygon(
        cls,
        vertices: Any,
        cells: int | Sequence[int] = 21,
        *,
        pressure: Any = None,
        name: str = "polygon",
    ) -> ContactPatch:
        """Return a polygon with `vertices` `[M, 2]` [m], convex or not, on a grid over its box, cut along its sides.

        `cells` counts along the longer side of the bounding box, or is `(columns, rows)`. Raises InvalidValueError for
        vertices that outline no simple polygon.
        """
        outline = outlines.polygon_outline(vertices)
        vertices = outline.vertices
        low = vertices.min(axis=0)
        width, height = vertices.max(axis=0) - low
        if not (width > 0.0 and height > 0.0):
            raise InvalidValueError(
                "vertices", "enclose an area", f"a box of {width} x {height} m"
            )
        columns, rows = outlines.columns_and_rows(cells, width, height)
        grid = Grid(low[0], low[1], width / columns, height / rows, columns, rows)
        return outlines.clipped(cls, outline, grid, pressure, name)

    @classmethod
    def points(
        cls,
        positions: Any,
        weights: Any = None,
        *,
        area: float = 1e-6,
        name: str = "points",
    ) -> ContactPatch:
        """Return a patch of contact points `[N, 2]` [m] with relative `weights` `[N]` (equal if None), such as feet.

        `area` [m^2] is what each point stands for; only `areas`, `area`, `pressure_values` and `Pad.layer` look at it.
        Raises InvalidValueError for weights below zero.
        """
        positions = validation.array("positions", positions, (None, 2))
        shape = positions.shape[:1]
        if weights is not None:
            weights = pressures.non_negative_array("weights", weights, shape)
        areas = np.full(shape, validation.positive("area", area))
        return cls(positions, areas, weights, None, name)

    @classmethod
    def from_pressure(
        cls, pressure: Any, cell_size: Any = None, *, width: Any = None, loads: Any = None, name: str | None = None,
        **reading: Any,
    ) -> ContactPatch:  # fmt: skip
        """Return a patch from a pressure map: an array `[rows, columns]`, or the path of a file (`read_pressure_map`).

        **Row 0 is the top** (largest y), column 0 the left; the middle of the map is the origin. `cell_size` [m] is the
        side of a cell or `(width, height)`, or `width` [m] that of the whole map, of square cells. Only ratios of the
        pressures matter. Cells without pressure are dropped. `reading` are the options of `MapReading`: header, index,
        frame_shape, frame, threshold, invert.

        For maps measured at several loads, give a mapping `{load [N]: map}`, or a list of maps (a stack `[L, rows,
        columns]`) with their `loads` `[L]`; see `PressureMaps`. Raises FileError or InvalidValueError otherwise.
        """
        law, shape, file = read_maps(pressure, loads, **reading)
        grid = map_grid(*shape, cell_size, width)
        name = (file or "pressure map") if name is None else name
        areas = np.full(grid.rows * grid.columns, grid.cell_area)
        return cls(grid.centres(), areas, law, grid, name)

    def refined(self, parts: int) -> ContactPatch:
        """Return the same patch with every cell divided into `parts` x `parts` (a cell of a line into `parts`).

        Pressure laws are evaluated at the new cells; numbers per cell are repeated. Cells cut by a rim are replaced by
        cells of the same area and centroid. Points remain points. Raises InvalidValueError for too many cells.
        """
        return finer(self, parts)

    def discs(self, n: int | None = None) -> ContactPatch:
        """Return the patch as `n` small discs that stand for its cells; None: each cell is one disc.

        The disc of a cell has its second moment, `a^2/2 = (s_x^2 + s_y^2)/12` (length only on lines; points stay
        points), and so has the disc of many cells: load, centre of pressure and second moment of the patch are kept.
        Symmetric patches have symmetric discs, n or a few less; cells of different friction never share a disc. A patch
        whose shape depends on the load has up to `2 n`, with the moments of its cells at each load. Raises
        InvalidValueError for n below 1.
        """
        from planarfriction.patch.discs import discs

        return discs(self, n)

    def grid_error(
        self, normal_force: float | None = None, *, refined: int = 1
    ) -> GridError:
        """Return the errors of `refined(refined)` against the continuous patch: of force, torque and breakaway.

        Steady sliding is compared with `LimitSurfaceExact` (of the outline, or of cells three times as fine where a law
        gives the pressure) while the patch rotates about points off the centres of inner cells, where a sum
        over cells is worst, and breakaway in 200 directions of the load. If cells are points, `as_discs` has the errors
        of `discs()`. Points without size stand for themselves: 0. Raises InvalidValueError without a load that is
        needed, and for a friction metric per cell.
        """
        return grid_error(self, normal_force, refined)

    def cell_extents(self) -> np.ndarray:
        """Return the width and height over which the load of each cell is spread `[N, 2]` [m], less for cut cells."""
        return cell_extents(self.areas, self.cell_size)

    @property
    def cells(self) -> int:
        """Number N of cells that can carry load."""
        return len(self.areas)

    @property
    def depends_on_load(self) -> bool:
        """True if the weights change with the normal force."""
        return self.pressure.depends_on_load

    def weights(
        self, normal_force: ArrayLike | None = None, moments: ArrayLike | None = None
    ) -> np.ndarray:
        """Return the fraction of the normal force on each cell, `w_i = p_i a_i q_i / sum(p a q)`, shape `[..., N]` [-].

        With `moments` `[..., 2]` [N m] of the normal forces `N_i` on the moving body about the origin, `(m_x, m_y) =
        (sum(y N), -sum(x N))`, the pressure follows them: `w_i max(0, c + a x_i + b y_i)`, whose centre is `(-m_y, m_x)
        / f_N`. A centre beyond all cells comes to the nearest point of their convex hull, so that an edge carries all.

        Raises InvalidValueError without a load that is needed.
        """
        if moments is not None:
            return weights_under(self, normal_force, moments)
        if normal_force is None:
            if self._fixed_weights is None:
                rule = "be given: the shape of this patch depends on it"
                raise InvalidValueError("normal_force", rule, "None")
            return self._fixed_weights
        load = validation.non_negative_numbers("normal_force", normal_force)
        if load.size * self.cells > validation.MOST_NUMBERS:
            rule = f"be at most {validation.MOST_NUMBERS // self.cells} loads for {self.cells} cells"
            raise InvalidValueError("normal_force", rule, load.size)
        if self._fixed_weights is not None:
            return np.broadcast_to(self._fixed_weights, (*load.shape, self.cells))
        loaded = load > 0.0
        held = np.where(loaded, load, 1.0)
        weights = self._shares(self.pressure.relative(self.positions, held))
        return np.where(loaded[..., None], weights, 0.0)

    def tile_weights(self, normal_force: ArrayLike | None = None) -> np.ndarray:
        """Return the fraction of the normal force on the area of each cell, `p_i a_i / sum(p a)`, shape `[..., N]` [-].

        For sums that spread the load of a cell over its `cell_extents`. Raises InvalidValueError as `weights` does.
        """
        weights = self.weights(normal_force)
        if self.point_shares is None or self.has_discs:
            return weights
        tiles = weights / self.point_shares
        return tiles / tiles.sum(-1, keepdims=True)

    def pressure_values(self, normal_force: ArrayLike) -> np.ndarray:
        """Return the pressure on each cell, `p_i f_N / sum(p a)`, shape `[..., N]` [Pa].

        Raises InvalidValueError for a load below zero.
        """
        load = validation.non_negative_numbers("normal_force", normal_force)
        return self.tile_weights(load) * load[..., None] / self.areas

    def centre_of_pressure(self, normal_force: ArrayLike | None = None) -> np.ndarray:
        """Return the centre of pressure `sum(w rho)`, shape `[..., 2]` [m].

        Raises InvalidValueError without a load that is needed, as all sums here.
        """
        weights = self.weights(normal_force)
        return np.stack([(weights * x).sum(-1) for x in self.positions.T], -1)

    @overload
    def contact_radius(self, normal_force: float | None = None) -> float: ...
    @overload
    def contact_radius(
        self, normal_force: np.ndarray | Sequence[Any]
    ) -> np.ndarray: ...
    def contact_radius(self, normal_force: Any = None) -> Any:
        """Return the contact radius `r = sum(w |rho - CoP|)` [m]: a spin about the CoP has the torque `mu f_N r`.

        With a friction metric `sum(w |L J (rho - CoP)|)`, J a quarter turn; the second moment likewise. A disc counts
        with the mean distance of its points.

        Raises InvalidValueError as `weights` does.
        """
        weights, *offset = self._about_centre_of_pressure(normal_force)
        x, y = self.lever_coordinates(*offset)
        if not self.has_discs:
            return (weights * np.hypot(x, y)).sum(-1)
        return (weights * disc_friction(x**2 + y**2, self.lever_radii**2)[2]).sum(-1)

    @overload
    def second_moment(self, normal_force: float | None = None) -> float: ...
    @overload
    def second_moment(self, normal_force: np.ndarray | Sequence[Any]) -> np.ndarray: ...
    def second_moment(self, normal_force: Any = None) -> Any:
        """Return the second moment `<rho^2> = sum(w (|rho - CoP|^2 + a^2/2))` of cells with radii a [m^2].

        Raises InvalidValueError as `weights` does.
        """
        weights, *offset = self._about_centre_of_pressure(normal_force)
        dx, dy = self.lever_coordinates(*offset)
        return (weights * (dx**2 + dy**2 + 0.5 * self.lever_radii**2)).sum(-1)

    @overload
    def area(self, normal_force: float | None = None) -> float: ...
    @overload
    def area(self, normal_force: np.ndarray | Sequence[Any]) -> np.ndarray: ...
    def area(self, normal_force: Any = None) -> Any:
        """Return the area of the cells under load [m^2]. Raises InvalidValueError as `weights` does."""
        return np.where(self.weights(normal_force) > 0.0, self.areas, 0.0).sum(-1)

    def moments(
        self, degree: int, normal_force: ArrayLike | None = None, *, about: Any = None
    ) -> np.ndarray:
        """Return the moments of the pressure `M[i, j] = sum(w (x - x0)^i (y - y0)^j)` for `i + j <= degree`.

        Shape `[..., degree + 1, degree + 1]` [m^(i + j)], zero where `i + j > degree`. `about` is the point (x0, y0)
        [m]: None for the centre of pressure (central moments), `(0, 0)` for the raw ones. Raises InvalidValueError for
        a parameter that breaks its rule.
        """
        degree = validation.count("degree", degree, at_least=0, at_most=MOST_DEGREE)
        weights, dx, dy = self._about_centre_of_pressure(normal_force)
        if about is not None:
            dx, dy = (self.positions - validation.vector("about", about, 2)).T
        result = np.zeros((*weights.shape[:-1], degree + 1, degree + 1))
        for i in range(degree + 1):
            for j in range(degree + 1 - i):
                result[..., i, j] = (weights * dx**i * dy**j).sum(-1)
        return result

    def _about_centre_of_pressure(
        self, normal_force: Any
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the weights and both coordinates of the cells relative to the CoP, each of shape `[..., N]`."""
        weights = self.weights(normal_force)
        dx, dy = ((x - (weights * x).sum(-1, keepdims=True)) for x in self.positions.T)
        return weights, dx, dy

    def with_friction_metric(self, metric: Any, asymmetry: Any = None) -> ContactPatch:
        """Return the same patch with friction that depends on the direction; None and None for friction that does not.

        `metric` `M`: sliding along a unit vector e meets the coefficient `mu sqrt(e' M e)`; see `friction_metric`.
        `asymmetry`
        `a`: sliding along e, a principal axis of M, meets `1 + a . e` times that, so that it is easiest against a. Both
        are in the axes of the contact frame and turn with it: the grooves belong to the patch.

        Raises `InvalidValueError` unless every metric is symmetric and positive definite and every `|a| < 1`.
        """
        patch = dataclasses.replace(self, metric=metric, asymmetry=asymmetry)
        return outlines.with_outline(patch, self.outline)

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
        levers = np.zeros((self.cells, self.bristles, 3))
        levers[:, :2, :2] = np.eye(2)
        levers[:, 0, 2] = -self.positions[:, 1]
        levers[:, 1, 2] = self.positions[:, 0]
        if self.root is not None:
            levers[:, :2] = self.root @ levers[:, :2]
        if self.has_discs:
            levers[:, 2, 2] = math.sqrt(0.5) * self.lever_radii
        return levers

    @functools.cached_property
    def has_discs(self) -> bool:
        """True if any cell is a disc and not a point."""
        return bool(self.radii.any())

    @property
    def bristles(self) -> int:
        """Number of components of the bristle of a cell: two of a point; three of all cells if any is a disc."""
        return 3 if self.has_discs else 2

    @functools.cached_property
    def lever_radii(self) -> np.ndarray:
        """Radii `[N]` [m] of the cells in the space of the metric M, `a sqrt(tr M/2)`; those of points are 0."""
        if self.root is None:
            return self.radii
        return self.radii * np.sqrt(0.5 * (self.root**2).sum((-2, -1)))

    def asymmetries(self) -> np.ndarray:
        """Return the asymmetry `a_i` of each cell, shape `[N, 2]`; zeros where there is none."""
        asymmetry = 0.0 if self.asymmetry is None else self.asymmetry
        return np.broadcast_to(asymmetry, self.positions.shape).copy()

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

    def plot(self, *, normal_force: float | None = None) -> Any:
        """Draw the pressure map with its centre of pressure; returns a matplotlib Figure."""
        return picture("patch", self, normal_force=normal_force)

    def __repr__(self) -> str:
        grid = self.grid
        of_grid = "" if grid is None else f" of {grid.columns} x {grid.rows}"
        law = type(self.pressure).__name__
        count = f"{self.cells} {'discs' if self.has_discs else 'cells'}"
        return f"ContactPatch({self.name!r}, {count}{of_grid}, {law} pressure)"

    def _repr_html_(self) -> str:
        return picture("patch in a notebook", self)

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
                value = positive_definite(value)
            elif not ((size := np.hypot(value[..., 0], value[..., 1])) < 1.0).all():
                rule = "be shorter than 1 (friction must oppose sliding)"
                raise InvalidValueError("asymmetry", rule, float(size.max()))
            value = value[kept] if per_cell else value
            value.setflags(write=False)
            self._set(**{name: value})

    def _shares(self, relative: np.ndarray) -> np.ndarray:
        """Return weights `[..., N]` from relative pressures of that shape, scaled first so that no sum can overflow."""
        peak = relative.max(-1, keepdims=True)
        if not (peak > 0.0).all():
            rule = "be > 0 on at least one cell at every load"
            raise InvalidValueError("pressure", rule, f"a peak of {peak.min()}")
        shares = 1.0 if self.point_shares is None else self.point_shares
        load = relative / peak * (self.areas * shares)
        return load / load.sum(-1, keepdims=True)

    def to_dict(self) -> dict[str, Any]:
        """Return the patch as numbers, strings and lists, ready for JSON; `from_dict` restores it to the last bit."""
        parts = {
            "shape": "cells", "name": self.name, "positions": self.positions, "areas": self.areas,
            "pressure": self.pressure.to_dict(), "metric": self.metric, "asymmetry": self.asymmetry,
            "outline": self.outline and self.outline.to_dict(), "cell_size": self.cell_size and list(self.cell_size),
            "grid": self.grid and dataclasses.asdict(self.grid), "point_shares": self.point_shares,
            "radii": self.radii if self.has_discs else None,
        }  # fmt: skip
        plain = {
            name: part.tolist() if isinstance(part, np.ndarray) else part
            for name, part in parts.items()
        }
        return {name: part for name, part in plain.items() if part is not None}

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> ContactPatch:
        """Restore the patch that `to_dict` described; unknown and missing keys raise an error that names them.

        Raises InvalidValueError for those, and for values that break a rule of the patch.
        """
        options = ("cell_size", "metric", "asymmetry", "point_shares", "radii")
        optional = ("shape", "name", "pressure", "grid", "outline", *options)
        validation.keys(
            "patch", data, required=("positions", "areas"), optional=optional
        )
        validation.choice("patch shape", data.get("shape", "cells"), ("cells",))
        pressure = data.get("pressure")
        grid = data.get("grid")
        if isinstance(pressure, Mapping):
            if "patch" in pressure:
                pressure = {**pressure, "patch": cls.from_dict(pressure["patch"])}
            pressure = Pressure.from_dict(pressure)
        if grid is not None:
            validation.keys("grid", grid, required=Grid.__dataclass_fields__)
            grid = Grid(**grid)
        given = {key: data.get(key) for key in ("positions", "areas", *options)}
        name = data.get("name", "patch")
        patch = cls(**given, pressure=pressure, grid=grid, name=name)  # pyright: ignore[reportArgumentType]
        outline = outlines.outline_from_dict(data.get("outline"))
        return outlines.with_outline(patch, outline)
