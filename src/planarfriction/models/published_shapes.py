"""Shapes of the reduced model as published: centre of pressure, radius and limit surface at any load."""

from __future__ import annotations

import functools
import itertools
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from planarfriction.compiled.remembered import Remembered
from planarfriction.compiled.shapes_by_load import Part
from planarfriction.equality import by_parts
from planarfriction.kernels.moments import slopes_in
from planarfriction.kernels.surfaces import ELLIPSOID
from planarfriction.limit_surface import LimitSurface
from planarfriction.limit_surface.base import SurfaceNumbers
from planarfriction.models.part_shapes import REMEMBERED
from planarfriction.models.reduced_map import is_point
from planarfriction.patch import ContactPatch


class _OfPoint(NamedTuple):
    """Stand-in for the limit surface of a point: `u = V_S`, and V_S has no third component."""

    numbers: SurfaceNumbers = SurfaceNumbers(ELLIPSOID, 0, np.zeros(0))


@by_parts
class PublishedShape(NamedTuple):
    """A patch at one load, as `ReducedModelPublished` knows it."""

    centre_of_pressure: np.ndarray
    """Centre of pressure `[2]` [m]; of a patch with a friction metric its `lever_coordinates`."""
    contact_radius: float
    """Contact radius r [m]; of the published table as published; 0 of a point."""
    second_moment: float
    """Second moment <rho^2> [m^2]."""
    surface: LimitSurface
    """Limit surface; at a point, a stand-in."""
    root: np.ndarray = np.eye(2)
    """Symmetric root of the friction metric, [2, 2] [-]."""

    @property
    def numbers(self) -> np.ndarray:
        """Numbers of the shape in the order of compiled loops."""
        return np.array([*self.centre_of_pressure, self.contact_radius, self.second_moment])

    @property
    def axes(self) -> np.ndarray:
        """`axes_of` the friction metric."""
        return axes_of(self.root)

    @property
    def lever(self) -> np.ndarray:
        """Map `[3, 3]` of twists about the origin to those at the centre of pressure, in the axes of the metric."""
        x, y = self.centre_of_pressure
        return np.array([[1.0, 0.0, -y], [0.0, 1.0, x], [0.0, 0.0, 1.0]]) @ self.axes

    @property
    def viscous_lever(self) -> np.ndarray:
        """Map `[3, 3]` of twists to the speeds of viscous friction, `U V` at the centre of pressure."""
        return np.diag([1.0, 1.0, self.second_moment]) @ self.lever

    def rate_slopes(self, lin: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return d rate / d state and d rate / d twist `[B, 3, 3]` from linearisations `[B, L]`."""
        scale = np.array([1.0, 1.0, self.contact_radius])
        rate_state, scaled = slopes_in(lin)
        per_scale = np.where(scale > 0.0, 1.0 / np.where(scale > 0.0, scale, 1.0), 0.0)
        return scale[:, None] * rate_state * per_scale, scale[:, None] * scaled * scale @ self.lever


def axes_of(root: np.ndarray) -> np.ndarray:
    """Return `diag(L, 1)` `[3, 3]` of the root L of a friction metric: twists go in through it, wrenches come out."""
    axes = np.eye(3)
    axes[:2, :2] = root
    return axes


class PublishedShapes:
    """Shapes of a patch at any load, updated as `on_load_change` says (see `ReducedModelPublished`)."""

    count = 1

    def __init__(self, surface: LimitSurface, patch: ContactPatch, on_load_change: str) -> None:
        self._surface, self._patch = surface, patch
        self.depends_on_load = patch.depends_on_load and on_load_change != "keep"
        self._rescales = on_load_change == "rescale"
        self._recent: Remembered[PublishedShape] = Remembered(REMEMBERED)

    def at(self, loads: Sequence[float | None]) -> Iterator[tuple[Part, ...]]:
        """See `compiled.three_states.Shapes`."""
        if not self.depends_on_load:
            return itertools.repeat((Part(1.0, self.reference),), len(loads))
        return ((Part(1.0, self.shape_at(load)),) for load in loads)  # pyright: ignore[reportArgumentType]

    def shape_at(self, load: float) -> PublishedShape:
        """Return the shape at a load > 0 [N]; recent loads are cached."""
        return self._recent.get(load, lambda: self._built(load)) if self.depends_on_load else self.reference

    def lever_arm(self, load: float | None) -> float:
        """See `compiled.three_states.Shapes`."""
        return self.shape_at(load).contact_radius  # pyright: ignore[reportArgumentType]

    def arrays(self, shape: PublishedShape) -> tuple[np.ndarray, ...]:
        """See `compiled.three_states.Shapes`."""
        return (shape.surface.numbers.data,)

    @functools.cached_property
    def reference(self) -> PublishedShape:
        """Shape at the load of the limit surface."""
        surface = self._surface
        second_moment = float(self._patch.second_moment(surface.normal_force))
        return PublishedShape(self._centre(surface), surface.contact_radius, second_moment, surface, self._root)

    def _built(self, load: float) -> PublishedShape:
        if is_point(self._patch, load):
            centre = self._patch.lever_coordinates(*self._patch.centre_of_pressure(load))
            return PublishedShape(np.array(centre), 0.0, 0.0, _OfPoint(), self._root)  # pyright: ignore
        surface = self._surface.at(load)
        same = self.reference if self._rescales else None
        return PublishedShape(
            self._centre(surface),
            surface.contact_radius,
            float(self._patch.second_moment(load)) if same is None else same.second_moment,
            surface if same is None else same.surface,
            self._root,
        )

    def _centre(self, surface: LimitSurface) -> np.ndarray:
        return np.array(self._patch.lever_coordinates(*surface.centre_of_pressure))

    @property
    def _root(self) -> np.ndarray:
        return np.eye(2) if self._patch.root is None else self._patch.root

    def __getstate__(self) -> dict[str, Any]:
        """Return what a copy gets: memories are shared by threads, not by models."""
        return {name: value for name, value in self.__dict__.items() if name != "_recent"}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state, _recent=Remembered(REMEMBERED))
