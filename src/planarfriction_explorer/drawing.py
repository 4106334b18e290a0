"""Pressure map of the explorer: relative pressures that are chosen, read from a file, or painted."""

from __future__ import annotations

import contextlib
import dataclasses
import functools
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path, PurePosixPath, PureWindowsPath
from typing import Literal

import numpy as np

from planarfriction import geometry
from planarfriction._support import validation
from planarfriction._support.equality import Checked, checked
from planarfriction.cli.options import parse_sides
from planarfriction.errors import FileError, InvalidValueError
from planarfriction.limit_surface import (
    LimitSurfaceEllipsoid,
    LimitSurfaceExact,
    LimitSurfaceTable,
)
from planarfriction.limit_surface.comparison import directions
from planarfriction.patch import (
    PUBLISHED_PATCHES,
    ContactPatch,
    Grid,
    GridError,
    read_pressure_map,
)


def plain_name(name: str) -> str:
    """Return the name of a file without the path that a browser may send with it."""
    return PurePosixPath(PureWindowsPath(name).name).name


@contextlib.contextmanager
def as_file(name: str, content: bytes) -> Iterator[Path]:
    """Yield a file of the same suffix with the content; errors raised meanwhile name the file as the user does.

    Raises `FileError` for what a reader does not take.
    """
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"file{Path(name).suffix}"
        try:
            path.write_bytes(content)
            yield path
        except (FileError, OSError, ValueError) as error:
            raise FileError(str(error).replace(str(path), name)) from None


MOST_SIDE = 64
"""Most rows and columns of a map: with more, a stroke of the brush would no longer follow the hand."""

MOST_QUICK = 700
"""Most cells of a map whose grid error is found in less than a second."""

SAMPLES = 100
"""Directions in which ellipsoid and surface are compared."""

DRAWN = "drawn"
"""Name of a map that was painted."""


@dataclass(frozen=True, eq=False)
class Drawing(Checked):
    """Relative pressures on square cells about the origin, row 0 at the top, and where they come from."""

    pressures: np.ndarray
    """Relative pressures, shape `[rows, columns]` [-]; only their ratios matter."""
    cell_size: float = checked(validation.positive)
    """Side of a cell [m]."""
    name: str = DRAWN
    """Name of the published patch, of the file, or `DRAWN`."""
    origin: Literal["published", "file", "drawn"] = "drawn"
    """Origin of the pressures."""

    def __post_init__(self) -> None:
        super().__post_init__()
        self.pressures.setflags(write=False)

    @classmethod
    def published(cls, name: str) -> Drawing:
        """Return the published patch `name`."""
        patch = PUBLISHED_PATCHES.choose(name)()
        pressures = np.zeros((patch.grid.rows, patch.grid.columns))
        pressures[_places(patch.grid, patch.positions)] = (
            patch.weights() / patch.weights().max()
        )
        return cls(pressures, patch.grid.cell_width, name, "published")

    @classmethod
    def rectangle(cls, text: str) -> Drawing:
        """Return an evenly pressed rectangle such as `12x20mm`, whose sides are met within 1 % by square cells.

        Raises `InvalidValueError` for a text that has no two sides, and for a rectangle that is too narrow.
        """
        sides = parse_sides(text)
        if sides is None:
            raise InvalidValueError("the rectangle", "be such as 12x20mm", repr(text))
        width, height = (validation.length("the rectangle", each) for each in sides)
        longer = max(width, height)
        # The fewest cells along the longer side of which nearly a whole number fits into the shorter one.
        for cells in range(16, MOST_SIDE + 1):
            size = longer / cells
            columns, rows = (max(1, round(each / size)) for each in (width, height))
            if np.allclose([columns * size, rows * size], [width, height], rtol=0.01):
                return cls(np.ones((rows, columns)), size, text.strip())
        raise InvalidValueError(
            "the rectangle", f"have sides of a ratio up to {MOST_SIDE}", text
        )

    @classmethod
    def read(cls, name: str, content: bytes, cell_size: float) -> Drawing:
        """Return the pressure map in a file called `name`, of which the `content` is at hand.

        Raises `FileError` for what is no map, and `InvalidValueError` for one of more than `MOST_SIDE` rows or columns.
        """
        name = plain_name(name)
        with as_file(name, content) as path:
            pressures = read_pressure_map(path)
        if max(pressures.shape) > MOST_SIDE:
            rule = f"have at most {MOST_SIDE} rows and columns here"
            raise InvalidValueError(
                f"the map in {name}", rule, "{} x {}".format(*pressures.shape)
            )
        drawing = cls(pressures, cell_size, name, "file")
        _ = drawing.patch  # refuses what is negative or empty now
        return drawing

    def painted(self, x: float, y: float, *, radius: float, pressure: float) -> Drawing:
        """Return the map with a `pressure` on all cells whose middle is within `radius` [m] of the point (x, y) [m]."""
        centres = self.grid.centres().reshape(*self.pressures.shape, 2)
        under = np.hypot(centres[..., 0] - x, centres[..., 1] - y) <= radius
        under[_places(self.grid, np.array([[x, y]]))] |= (
            abs(x) < self.width / 2 and abs(y) < self.height / 2
        )
        return Drawing(np.where(under, pressure, self.pressures), self.cell_size)

    def cleared(self) -> Drawing:
        """Return the map without any pressure, ready to be painted."""
        return Drawing(np.zeros_like(self.pressures), self.cell_size)

    def scaled(self, cell_size: float) -> Drawing:
        """Return the map with cells of another size [m]; a published patch has its own and becomes a painted map."""
        if self.origin == "published":
            return Drawing(self.pressures, cell_size)
        return dataclasses.replace(self, cell_size=cell_size)

    @property
    def width(self) -> float:
        """Width of the map [m]."""
        return self.pressures.shape[1] * self.cell_size

    @property
    def height(self) -> float:
        """Height of the map [m]."""
        return self.pressures.shape[0] * self.cell_size

    @property
    def grid(self) -> Grid:
        """The grid of the map."""
        rows, columns = self.pressures.shape
        return Grid.around_origin(self.width, self.height, columns, rows)

    @functools.cached_property
    def patch(self) -> ContactPatch:
        """The contact patch. Raises `InvalidValueError` where nothing presses."""
        if self.origin == "published":
            return PUBLISHED_PATCHES[self.name]()
        return ContactPatch.from_pressure(
            self.pressures, self.cell_size, name=self.name
        )

    @functools.cached_property
    def surface(self) -> LimitSurfaceExact:
        """Exact limit surface of the map."""
        return LimitSurfaceExact(self.patch)

    @functools.cached_property
    def table(self) -> LimitSurfaceTable:
        """Limit surface of the map as a smooth table, quick to evaluate."""
        return LimitSurfaceTable(self.patch)

    @functools.cached_property
    def ellipsoid(self) -> LimitSurfaceEllipsoid:
        """The ellipsoid that is often put in its place."""
        return LimitSurfaceEllipsoid(self.patch)

    @functools.cached_property
    def grid_errors(self) -> tuple[GridError, GridError] | None:
        """Errors of the cells, and of 3 x 3 in each, against the continuous patch; None with too many cells."""
        if self.patch.cells > MOST_QUICK:
            return None
        return self.patch.grid_error(), self.patch.grid_error(refined=3)

    @functools.cached_property
    def largest_errors(self) -> tuple[float, float]:
        """Return the largest errors of the ellipsoid over all directions: distance of (fx, fy, tau/r) for the same
        twist [-], and angle between the twists (vx, vy, r omega) of the same wrench [deg]."""
        units = directions(SAMPLES)
        scale = np.array([1.0, 1.0, self.surface.contact_radius])
        twists = geometry.twist_at(units / scale, -self.surface.centre_of_pressure)
        apart = self.ellipsoid.wrench(twists) - self.surface.wrench(twists)
        apart = geometry.wrench_at(apart, self.surface.centre_of_pressure) / scale
        angle = self.ellipsoid.compare(self.surface, samples=SAMPLES).angle.largest
        return float(np.linalg.norm(apart, axis=1).max()), angle


def _places(grid: Grid, positions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return rows and columns of the cells that hold `positions` `[N, 2]` [m], or that lie nearest."""
    columns = np.floor((positions[:, 0] - grid.x_min) / grid.cell_width).astype(int)
    from_below = np.floor((positions[:, 1] - grid.y_min) / grid.cell_height).astype(int)
    return np.clip(grid.rows - 1 - from_below, 0, grid.rows - 1), np.clip(
        columns, 0, grid.columns - 1
    )
