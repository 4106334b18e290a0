"""Outlines of shapes, grids over them, and the one function that cuts a grid's boxes along an outline."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from planarfriction._support import validation
from planarfriction._support.equality import ByValue
from planarfriction.errors import InvalidValueError
from planarfriction.patch.grid import MOST_CELLS, Grid, point_shares

if TYPE_CHECKING:
    from planarfriction.patch.contact_patch import ContactPatch

CIRCLE_SIDES = 4096
"""Sides of the polygon that stands for a circle: at equal area, its moments are those of the circle to 1e-12."""

SLIVER = 1e-12
"""Share of a box below which the part inside an outline is rounding noise of the clipping, and no cell."""


def columns_and_rows(
    cells: int | Sequence[int], width: float, height: float
) -> tuple[int, int]:
    """Return the number of columns and rows on a box of `width` x `height` [m].

    A pair is taken as it is; one number counts the cells along the longer side, and the shorter side gets as many as
    keep the cells closest to square.
    """
    if not (
        isinstance(cells, (list, tuple))
        or (isinstance(cells, np.ndarray) and cells.ndim)
    ):
        along = validation.count("cells", cells, at_most=MOST_CELLS)
        side = max(width, height) / along
        return max(1, round(width / side)), max(1, round(height / side))
    columns, rows = validation.vector("cells", cells, 2).tolist()
    return validation.count("cells[0]", columns), validation.count("cells[1]", rows)


def circle(radius: float) -> np.ndarray:
    """Return the vertices `[CIRCLE_SIDES, 2]` of the regular polygon with the area of the disc of `radius` [m].

    Circumradius `R sqrt(a / sin a)`, `a = 2 pi / sides`. Sides, not corners, face the axes: the polygon then lies
    inside the square around the disc.
    """
    step = 2 * math.pi / CIRCLE_SIDES
    angle = (np.arange(CIRCLE_SIDES) + 0.5) * step
    size = radius * math.sqrt(step / math.sin(step))
    return size * np.stack([np.cos(angle), np.sin(angle)], -1)


def clip(outline: Any, grid: Grid) -> tuple[np.ndarray, np.ndarray]:
    """Cut the boxes of `grid` along `outline`, a shapely polygon in the contact frame [m].

    Returns the centroids `[N, 2]` [m] and areas `[N]` [m^2] of the parts inside, row by row from the top left; boxes
    without a part inside are left out. A whole box keeps its exact centre and area.
    """
    import shapely

    positions = grid.centres()
    areas = np.full(len(positions), grid.cell_area)
    half = np.array([grid.cell_width, grid.cell_height]) / 2
    boxes = shapely.box(*(positions - half).T, *(positions + half).T)
    shapely.prepare(outline)
    cut = ~shapely.covers(outline, boxes)
    # First into rows, then the rows into cells: each cell then meets few of the outline's many sides.
    strips = shapely.intersection(outline, _rows(grid))
    parts = shapely.intersection(np.repeat(strips, grid.columns)[cut], boxes[cut])
    areas[cut] = shapely.area(parts)
    present = areas > SLIVER * grid.cell_area
    of_cut = present[cut]
    positions[cut & present] = shapely.get_coordinates(shapely.centroid(parts[of_cut]))
    return positions[present], areas[present]


def _rows(grid: Grid) -> np.ndarray:
    """Return a box for each row of `grid`, from the top, a cell wider on both sides, `[rows]` of shapely."""
    import shapely

    y = grid.centres()[:: grid.columns, 1]
    left = grid.x_min - grid.cell_width
    right = grid.x_min + (grid.columns + 1) * grid.cell_width
    return shapely.box(left, y - grid.cell_height / 2, right, y + grid.cell_height / 2)  # pyright: ignore


@dataclass(frozen=True, eq=False)
class PolygonOutline(ByValue):
    """A simple polygon, convex or not."""

    vertices: np.ndarray
    """Vertices in either sense, shape `[M, 2]` [m]."""

    def rims(self) -> tuple[np.ndarray, list[np.ndarray]]:
        """Return the polygon that bounds it, and its holes (none), `[M, 2]` [m] each."""
        return self.vertices, []

    def triangles(self) -> np.ndarray:
        """Return triangles `[M - 2, 3, 2]` [m] from the first vertex; their signed sum is the polygon."""
        others = self.vertices[1:]
        first = np.broadcast_to(self.vertices[0], others[1:].shape)
        return np.stack([first, others[:-1], others[1:]], 1)

    def to_dict(self) -> dict[str, Any]:
        """Return the outline as plain data, which `outline_from_dict` reads."""
        return {"vertices": self.vertices.tolist()}


@dataclass(frozen=True)
class RoundOutline:
    """A disc (inner radius 0) or a ring about the origin."""

    inner: float
    """Inner radius [m]."""
    outer: float
    """Outer radius [m]."""

    def rims(self) -> tuple[np.ndarray, list[np.ndarray]]:
        """Return polygons with the areas of its outer circle and its hole, if any, `[CIRCLE_SIDES, 2]` [m] each."""
        return circle(self.outer), [circle(self.inner)] if self.inner > 0.0 else []

    def to_dict(self) -> dict[str, Any]:
        """Return the outline as plain data, which `outline_from_dict` reads."""
        return {"radii": [self.inner, self.outer]}


Outline = PolygonOutline | RoundOutline


def outline_from_dict(data: Any) -> Outline | None:
    """Return the outline of `{"vertices": [[x, y], ...]}` or `{"radii": [inner, outer]}`; None of None."""
    if data is None:
        return None
    if not isinstance(data, Mapping) or list(data) not in (["vertices"], ["radii"]):
        raise InvalidValueError(
            "outline", "be a table with either vertices or radii", data
        )
    if "vertices" in data:
        return polygon_outline(data["vertices"])
    inner, outer = validation.vector("radii", data["radii"], 2).tolist()
    if not 0.0 <= inner < outer:
        raise InvalidValueError(
            "radii", "be (inner, outer) with 0 <= inner < outer", f"{inner} and {outer}"
        )
    return RoundOutline(inner, outer)


def polygon_outline(vertices: Any) -> PolygonOutline:
    """Return the outline with those `vertices` `[M, 2]` [m]."""
    vertices = validation.array(
        "vertices", vertices, (None, 2), largest=validation.LONGEST
    )
    if len(vertices) < 3:
        raise InvalidValueError(
            "vertices", "hold at least 3 points", f"{len(vertices)}"
        )
    vertices.setflags(write=False)
    return PolygonOutline(vertices)


def with_outline(patch: ContactPatch, outline: Outline | None) -> ContactPatch:
    """Record in the new `patch` the outline from which its cells were cut, and return it."""
    patch._set(outline=outline)
    return patch


def clipped(
    kind: type[ContactPatch], outline: Outline, grid: Grid, pressure: Any, name: str
) -> ContactPatch:
    """Return a patch of the parts of the grid's boxes inside an outline."""
    import shapely

    polygon = shapely.Polygon(*outline.rims())
    if not polygon.is_valid:
        raise InvalidValueError(
            "vertices", "form a simple polygon", shapely.is_valid_reason(polygon)
        )
    try:
        positions, areas = clip(polygon, grid)
    # Of coordinates far apart in size.
    except shapely.errors.GEOSException as error:
        rule = "form a polygon that can be cut into cells"
        raise InvalidValueError("vertices", rule, str(error)) from None
    shares = point_shares(positions, areas, (grid.cell_width, grid.cell_height))
    patch = kind(positions, areas, pressure, grid, name, point_shares=shares)
    return with_outline(patch, outline)
