"""The true outline that a patch's cells were cut from: what an exact limit surface integrates over."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from planarfriction import validation
from planarfriction.equality import ByValue
from planarfriction.errors import InvalidValueError
from planarfriction.patch import shapes
from planarfriction.patch.point_shares import point_shares

if TYPE_CHECKING:
    from planarfriction.patch.contact_patch import ContactPatch
    from planarfriction.patch.grid import Grid


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
        return np.stack([np.broadcast_to(self.vertices[0], others[1:].shape), others[:-1], others[1:]], 1)

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
        return shapes.circle(self.outer), [shapes.circle(self.inner)] if self.inner > 0.0 else []

    def to_dict(self) -> dict[str, Any]:
        """Return the outline as plain data, which `outline_from_dict` reads."""
        return {"radii": [self.inner, self.outer]}


Outline = PolygonOutline | RoundOutline


def outline_from_dict(data: Any) -> Outline | None:
    """Return the outline of `{"vertices": [[x, y], ...]}` or `{"radii": [inner, outer]}`; None of None."""
    if data is None:
        return None
    if not isinstance(data, Mapping) or list(data) not in (["vertices"], ["radii"]):
        raise InvalidValueError("outline", "be a table with either vertices or radii", data)
    if "vertices" in data:
        return polygon_outline(data["vertices"])
    inner, outer = validation.vector("radii", data["radii"], 2).tolist()
    if not 0.0 <= inner < outer:
        raise InvalidValueError("radii", "be (inner, outer) with 0 <= inner < outer", f"{inner} and {outer}")
    return RoundOutline(inner, outer)


def polygon_outline(vertices: Any) -> PolygonOutline:
    """Return the outline with those `vertices` `[M, 2]` [m]."""
    vertices = validation.array("vertices", vertices, (None, 2), largest=validation.LONGEST)
    if len(vertices) < 3:
        raise InvalidValueError("vertices", "hold at least 3 points", f"{len(vertices)}")
    vertices.setflags(write=False)
    return PolygonOutline(vertices)


def with_outline(patch: ContactPatch, outline: Outline | None) -> ContactPatch:
    """Record in the new `patch` the outline from which its cells were cut, and return it."""
    patch._set(outline=outline)
    return patch


def clipped(kind: type[ContactPatch], outline: Outline, grid: Grid, pressure: Any, name: str) -> ContactPatch:
    """Return a patch of the parts of the grid's boxes inside an outline."""
    import shapely

    polygon = shapely.Polygon(*outline.rims())
    if not polygon.is_valid:
        raise InvalidValueError("vertices", "form a simple polygon", shapely.is_valid_reason(polygon))
    try:
        positions, areas = shapes.clip(polygon, grid)
    except shapely.errors.GEOSException as error:  # rounding of coordinates far apart in size
        raise InvalidValueError("vertices", "form a polygon that can be cut into cells", str(error)) from None
    shares = point_shares(positions, areas, (grid.cell_width, grid.cell_height))
    return with_outline(kind(positions, areas, pressure, grid, name, point_shares=shares), outline)
