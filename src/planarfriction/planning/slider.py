"""The slider and the pusher: a convex outline with its limit surface, and a point or a flat face."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from planarfriction import validation
from planarfriction.equality import ByValue, Checked, Kept, checked
from planarfriction.errors import InvalidValueError
from planarfriction.limit_surface import LimitSurface


@dataclass(frozen=True, eq=False)
class Slider(ByValue):
    """An object that slides slowly on its support patch and is pushed at its outline.

    Raises `InvalidValueError` if the outline is not convex or the surface none.
    """

    surface: LimitSurface
    """Limit surface of the patch on which it stands; its frame is the slider's."""
    outline: Kept[ArrayLike, np.ndarray]
    """Corners of the convex outline `[M, 2]` in that frame [m], in either sense of rotation."""

    def __post_init__(self) -> None:
        validation.instance("surface", self.surface, LimitSurface, "a limit surface")
        corners = validation.array("outline", self.outline, (None, 2))
        if len(corners) < 3:
            raise InvalidValueError("outline", "have at least 3 points", f"{len(corners)}")
        edges = np.roll(corners, -1, axis=0) - corners
        turns = edges[:, 0] * np.roll(edges[:, 1], -1) - edges[:, 1] * np.roll(edges[:, 0], -1)
        winding = np.angle(np.roll(edges, -1, axis=0) @ [1, 1j] / np.where(edges.any(1), edges @ [1, 1j], 1)).sum()
        if not ((turns > 0.0).all() or (turns < 0.0).all()) or abs(winding) > 7.0:
            raise InvalidValueError("outline", "be convex, without three corners on a line", "another polygon")
        if turns[0] < 0.0:
            corners = corners[::-1].copy()
        corners.setflags(write=False)
        self._set(outline=corners)

    @cached_property
    def along(self) -> np.ndarray:
        """Unit vectors along the edges, counter-clockwise `[M, 2]`; edge j begins at corner j."""
        edges = np.roll(self.outline, -1, axis=0) - self.outline
        return edges / np.hypot(*edges.T)[:, None]

    @cached_property
    def inward(self) -> np.ndarray:
        """Unit normals of the edges, into the slider `[M, 2]`."""
        return np.stack([-self.along[:, 1], self.along[:, 0]], axis=1)

    @cached_property
    def size(self) -> float:
        """Largest distance of a corner from the frame's origin [m]."""
        return float(np.hypot(*self.outline.T).max())

    def gaps(self, point: np.ndarray) -> np.ndarray:
        """Return the distances of a point `[2]` from the lines of all edges `[M]` [m]; one that is outside has any > 0.

        Raises `InvalidValueError` unless it is a point.
        """
        return np.einsum("mi,mi->m", self.outline - validation.vector("point", point, 2), self.inward)


@dataclass(frozen=True)
class Pusher(Checked):
    """The pusher: a point, or a flat face that faces along its own x axis.

    Raises `InvalidValueError` for numbers out of range.
    """

    mu: float = checked(validation.non_negative, default=0.0)
    """Coefficient of friction between pusher and slider [-]."""
    width: float = checked(validation.non_negative, default=0.0)
    """Width of the face along the pusher's y axis [m]; 0 is a point."""

    @property
    def ends(self) -> np.ndarray:
        """Right and left end of the face, in the pusher's axes `[2, 2]` [m]; for a point that point `[1, 2]`."""
        half = 0.5 * self.width
        return np.array([[0.0, -half], [0.0, half]]) if half > 0.0 else np.zeros((1, 2))
