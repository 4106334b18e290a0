"""Grids over shapes, and the one function that cuts a grid's boxes along an outline."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from planarfriction import validation
from planarfriction.patch.grid import MOST_CELLS, Grid

CIRCLE_SIDES = 4096
"""Sides of the polygon that stands for a circle: at equal area, its moments are those of the circle to 1e-12."""

SLIVER = 1e-12
"""Share of a box below which the part inside an outline is rounding noise of the clipping, and no cell."""


def columns_and_rows(cells: int | Sequence[int], width: float, height: float) -> tuple[int, int]:
    """Return the number of columns and rows on a box of `width` x `height` [m].

    A pair is taken as it is; one number counts the cells along the longer side, and the shorter side gets as many as
    keep the cells closest to square.
    """
    if not (isinstance(cells, (list, tuple)) or (isinstance(cells, np.ndarray) and cells.ndim)):
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
    return radius * math.sqrt(step / math.sin(step)) * np.stack([np.cos(angle), np.sin(angle)], -1)


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
