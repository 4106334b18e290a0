"""The regular grid from which cells are cut, limits of their number and size, and what points in their places lack."""

from __future__ import annotations

import warnings
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from planarfriction._support import validation
from planarfriction._support.equality import Checked, checked
from planarfriction.errors import InvalidValueError

MOST_CELLS = 1_100_000
"""Cells of a patch, and boxes of its grid, that are taken: some 1050 x 1050, half a gigabyte while shapes are cut."""

LEAST_WIDTH = 1e-5
"""Width of a patch [m] below which its maker is asked if it is in metres."""

MOST_WIDTH = 1.0
"""Width of a patch [m] above which its maker is asked if it is in metres."""


def check_cells(count: int, name: str = "cells") -> None:
    """Raise, before memory is asked for, where a patch would have more than `MOST_CELLS`."""
    if count > MOST_CELLS:
        raise InvalidValueError(name, f"be at most {MOST_CELLS} in all", count)


def warn_of_the_unit(
    name: str, positions: np.ndarray, cell_size: tuple[float, float] | None
) -> None:
    """Warn where a patch is so large or so small that millimetres may have been given for metres."""
    width = max(
        float(np.ptp(x)) + side
        for x, side in zip(positions.T, cell_size or (0.0, 0.0), strict=True)
    )
    if not LEAST_WIDTH <= width <= MOST_WIDTH and width > 0.0:  # 0: a point
        than = f"smaller than {LEAST_WIDTH:g}"
        than = f"larger than {MOST_WIDTH:g}" if width > MOST_WIDTH else than
        warnings.warn(
            f"patch {name!r} is {width:.3g} m wide, {than} m: are its lengths in metres?",
            stacklevel=4,
        )


FARTHEST = 2.0**62
"""Largest row or column in size: an integer of NumPy still."""


@dataclass(frozen=True)
class Grid(Checked):
    """A regular grid of boxes in the contact frame: x to the right, y up, **row 0 is the top row** (largest y).

    Raises InvalidValueError for sizes that are not > 0 and for counts below one.
    """

    x_min: float = checked(validation.number)
    """Left edge [m]."""
    y_min: float = checked(validation.number)
    """Bottom edge [m]."""
    cell_width: float = checked(validation.positive)
    """Width of a cell, along x [m]."""
    cell_height: float = checked(validation.positive)
    """Height of a cell, along y [m]."""
    columns: int = checked(validation.count)
    """Number of cells along x."""
    rows: int = checked(validation.count)
    """Number of cells along y."""

    def __post_init__(self) -> None:
        super().__post_init__()
        check_cells(self.rows * self.columns, "cells (rows x columns)")

    @classmethod
    def around_origin(
        cls, width: float, height: float, columns: int, rows: int
    ) -> Grid:
        """Return a grid of `columns` x `rows` cells on the box of `width` x `height` [m] whose middle is the origin.

        Raises InvalidValueError for sides that are not > 0, and for too many cells.
        """
        width = validation.positive("width", width)
        height = validation.positive("height", height)
        columns = validation.count("columns", columns, at_most=MOST_CELLS)
        rows = validation.count("rows", rows, at_most=MOST_CELLS)
        # Before the cells are too small to be any.
        check_cells(columns * rows, "cells (rows x columns)")
        return cls(
            -width / 2, -height / 2, width / columns, height / rows, columns, rows
        )

    @classmethod
    def square(cls, width: float, cells: int) -> Grid:
        """Return a grid of `cells` x `cells` on the square `width` [m] wide about the origin.

        Raises InvalidValueError for a width that is not > 0, and for too many cells.
        """
        cells = validation.count("cells", cells, at_most=MOST_CELLS)
        return cls.around_origin(width, width, cells, cells)

    @property
    def cell_area(self) -> float:
        """Area of one cell [m^2]."""
        return self.cell_width * self.cell_height

    def centres(self) -> np.ndarray:
        """Return the centres of all cells, row by row from the top left, shape `[rows * columns, 2]` [m]."""
        # Counted from the middle, so that a grid around the origin is symmetric to the last digit.
        width, height = grid_sides(self)
        column = np.arange(self.columns) - (self.columns - 1) / 2
        row = np.arange(self.rows) - (self.rows - 1) / 2
        x = self.x_min + width / 2 + column * self.cell_width
        y = self.y_min + height / 2 - row * self.cell_height
        return np.stack([np.tile(x, self.rows), np.repeat(y, self.columns)], -1)

    def locate(self, positions: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
        """Return the row and column of the cell that holds each of `positions` `[..., 2]` [m]; row 0 is the top.

        Positions outside the grid get rows or columns outside `0 .. rows - 1` and `0 .. columns - 1`.

        Raises InvalidValueError for positions of another shape.
        """
        positions = validation.vectors(
            "positions", validation.finite_numbers("positions", positions), 2
        )
        from_top = self.rows - (positions[..., 1] - self.y_min) / self.cell_height
        from_left = (positions[..., 0] - self.x_min) / self.cell_width
        places = np.clip([from_top, from_left], -FARTHEST, FARTHEST)
        row, column = np.floor(places).astype(int)
        return row, column


def grid_sides(grid: Grid) -> np.ndarray:
    """Return the width and the height of a whole grid `[2]` [m]."""
    return np.array([grid.columns * grid.cell_width, grid.rows * grid.cell_height])


LEAST_SPREAD = 1e-6
"""Variance of a quadratic over its mean square below which it is linear on the cells (one or two rows) [-]."""

LARGEST_CHANGE = 0.8
"""Largest relative change of a weight, which stays positive; few cells across a thin shape would need larger ones."""


def cell_extents(
    areas: np.ndarray, cell_size: tuple[float, float] | None
) -> np.ndarray:
    """Return the width and height `[N, 2]` [m] of cells; a cut one has the proportions of a whole one."""
    if cell_size is None:
        return np.zeros((len(areas), 2))
    width, height = cell_size
    if width == 0.0 or height == 0.0:
        return np.tile([width, height], (len(areas), 1))
    return np.sqrt(areas / (width * height))[:, None] * np.array([width, height])


def point_shares(
    positions: np.ndarray, areas: np.ndarray, cell_size: tuple[float, float] | None
) -> np.ndarray | None:
    """Return factors `q` `[N]` on the areas with which points at the cells have the second moments of the areas.

    `sum(a q p) = sum(a p)` for all polynomials of degree 1, and `sum(a q rho rho') = sum(a (rho rho' + e e'/12))` with
    the width and height `e` of the cells (`cell_extents`) as a diagonal. Of all such factors these have the least
    `sum(a (q - 1)^2)`: `q - 1` is a quadratic polynomial, of the order of the squared cell size over that of the patch.
    Second moments that no factors change (across one or two rows of cells) are left out, and a change beyond
    `LARGEST_CHANGE` is shortened to it. None: there is nothing to correct.
    """
    w = areas / areas.sum()
    rho = positions - w @ positions
    size = np.sqrt(w @ (rho**2).sum(1))
    if not size > 0.0:
        return None
    rho = rho / size
    own = cell_extents(areas, cell_size) ** 2 / (12.0 * size**2)
    linear = np.column_stack([np.ones(len(w)), rho])
    square = np.column_stack([rho[:, 0] ** 2, rho[:, 0] * rho[:, 1], rho[:, 1] ** 2])
    scale = np.sqrt(w @ square**2)
    safe = np.where(scale > 0.0, scale, 1.0)
    square = square / safe
    root = np.sqrt(w)[:, None]
    free = (
        square - linear @ np.linalg.lstsq(root * linear, root * square, rcond=None)[0]
    )
    variances, axes = np.linalg.eigh((w[:, None] * free).T @ free)
    determined = variances > LEAST_SPREAD
    axes = axes[:, determined]
    missing = np.array([w @ own[:, 0], 0.0, w @ own[:, 1]]) / safe
    found = axes @ (axes.T @ missing / variances[determined])
    change = free @ found
    largest = np.abs(change).max()
    return 1.0 + change * min(1.0, LARGEST_CHANGE / largest) if largest > 0.0 else None
