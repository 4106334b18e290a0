"""The panels of a moving picture that show one contact: its cells, and its wrench in the limit surface."""

from __future__ import annotations

import math
import textwrap
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.cm import ScalarMappable
from matplotlib.collections import PolyCollection
from matplotlib.colors import LinearSegmentedColormap, ListedColormap, Normalize
from matplotlib.patches import Polygon

import planarfriction as pf
from planarfriction import geometry
from planarfriction.errors import FrictionError
from planarfriction.laws import FrictionLaw
from planarfriction.plots import style
from planarfriction.plots.limit_surface import even_mesh, scaled_samples
from planarfriction.plots.patch import cell_boxes
from planarfriction.plots.track import ContactTrack

STICK = style.STICKS
"""Colour of what sticks, which pales towards it as its bristles bend."""

SLIP = style.SLIPS
"""Colour of what slips."""

PLAIN = "#9AA5B1"
"""Colour of what is not known."""

LOAD_STEP = 1.15
"""A patch that follows the load has its limit surface drawn at loads that differ by this factor."""

FARTHEST = 1.6
"""Largest force of the limit surface's axes, of mu_c f_N [-]; what is beyond is drawn outside."""

TAIL = 25
"""Frames whose wrenches are drawn behind the wrench."""

LONGEST = 24
"""Letters of the name of a contact."""

STILL = 1e-3
"""Share of the largest speed below which a body stands and turns about no point [-]."""

ARM = 1e-2
"""Lever of the spin of a body in its speed [m]."""

_PALE = LinearSegmentedColormap.from_list("stick", ["#F4F8FB", STICK])(
    np.linspace(0.0, 1.0, 230)
)
CELLS = ListedColormap([*_PALE, *[SLIP] * 26])
"""Colours of cells: up to 0.9 those of bristles that stick, above it of those that slip."""


def cell_polygons(patch: Any) -> np.ndarray:
    """Return the cells of a patch `[N, M, 2]` [m] in its frame; points are drawn as little hexagons."""
    if patch.grid is not None:
        return cell_boxes(patch, patch.grid)
    extent = float(np.ptp(patch.positions, axis=0).max()) or 1e-2
    around = np.pi / 3.0 * np.arange(6)
    hexagon = (
        min(0.05, 0.5 / math.sqrt(len(patch.positions)))
        * extent
        * np.stack([np.cos(around), np.sin(around)], -1)
    )
    return patch.positions[:, None, :] + hexagon


def cells_of(track: ContactTrack, *, edge: str) -> PolyCollection:
    """Return the cells of a contact [mm], to be coloured frame by frame; `edge` is the colour of their edges."""
    boxes = list(1e3 * cell_polygons(track.contact.model.patch))
    # Seams would show.
    cells = PolyCollection(
        boxes, edgecolor=edge, linewidth=0.3, antialiased=edge != "face"
    )
    if track.slip is not None:
        cells.set(cmap=CELLS, clim=(0.0, 1.0))
    return cells


def colour_cells(cells: PolyCollection, track: ContactTrack, frame: int) -> None:
    """Colour the cells as they are at a frame; those without load disappear."""
    weights, _ = track.shape(frame)
    loaded = weights > 0.0
    if track.slip is None:
        cells.set_facecolor([PLAIN if each else "none" for each in loaded])
        return
    bent = track.slip.bent[frame]
    slips = track.slip.slips[frame]
    shade = np.where(slips, 1.0, 0.89 * np.minimum(bent, 1.0))
    cells.set_array(np.ma.masked_array(shade, ~loaded))


class CellPanel:
    """The cells of a contact in its own frame, and the point about which the body turns on it."""

    def __init__(self, axes: Any, track: ContactTrack, *, bar: Any):
        self.axes = axes
        self.track = track
        points = 1e3 * cell_polygons(track.contact.model.patch).reshape(-1, 2)
        low = points.min(axis=0)
        high = points.max(axis=0)
        half = 0.56 * float((high - low).max())
        middle = 0.5 * (low + high)
        limits = np.stack([middle - half, middle + half], -1)
        axes.set(xlim=limits[0], ylim=limits[1])
        axes.set_xlabel("", fontsize="small", labelpad=1)
        axes.set_ylabel("", fontsize="small", labelpad=1)
        style.show_lengths(axes, 1e-3 * float(np.abs(limits).max()))
        axes.set_aspect("equal")
        axes.tick_params(labelsize="small")
        axes.locator_params(nbins=4)
        style.tidy(axes)
        self.cells = axes.add_collection(cells_of(track, edge="white"))
        self.centre = centre_mark(axes)
        above = {"transform": axes.transAxes, "ha": "center", "va": "bottom"}
        self.words = axes.text(0.5, 1.02, "", **above, fontsize="small")
        if bar is not None:
            colours = ScalarMappable(Normalize(0.0, 1.0), CELLS)
            shown = axes.figure.colorbar(colours, cax=bar)
            labels = ["unbent", "sticks", "slips"]
            shown.set_ticks([0.0, 0.45, 0.95], labels=labels, fontsize="small")
            shown.ax.tick_params(length=0)
        for artist in self.artists():
            artist.set_animated(True)

    def artists(self) -> list[Artist]:
        """Return the artists that change from frame to frame."""
        return [self.cells, self.centre, self.words]

    def show(self, frame: int) -> None:
        """Show a frame."""
        track = self.track
        colour_cells(self.cells, track, frame)
        still = still_speed(track.twists)
        put_centre(self.centre, track.twists[frame], np.zeros(2), still=still)
        name = textwrap.shorten(str(track.contact.name), LONGEST, placeholder="...")
        if track.slip is not None:
            weights, _ = track.shape(frame)
            name += f": {100.0 * float(weights[track.slip.slips[frame]].sum()):.0f} % of the load slips"
        self.words.set_text(name)


class SurfacePanel:
    """The limit surface of a contact at its load, and the friction wrench in it, both for mu_c f_N = 1.

    Both are seen from the side: force along the largest friction of the motion, and torque over the contact radius.
    """

    def __init__(self, axes: Any, track: ContactTrack, *, beside: int = 0):
        self.axes = axes
        self.track = track  # `beside` is the number of other contacts that are shown
        self.levels = _levels(track)
        self.surfaces = {
            level: surface_at(track.contact.model.patch, load)
            for level, load in self.levels.items()
        }
        points = self._points()
        force = points[np.hypot(*points[:, :2].T).argmax(), :2]
        length = math.hypot(*force)
        self.along = force / length if length > 0.0 else np.array([1.0, 0.0])
        self.points = self._seen(points)
        sides = {level: self._side(each) for level, each in self.surfaces.items()}
        reach = max(float(np.abs(side).max()) for side in sides.values())
        limit = 1.1 * max(reach, min(FARTHEST, float(np.abs(self.points).max())))
        look = {"fc": style.HOLDS, "ec": style.REFERENCE, "lw": 1.2, "zorder": 1}
        self.drawn = {
            level: axes.add_patch(Polygon(side, **look))
            for level, side in sides.items()
        }
        axes.set(xlim=(-limit, limit), ylim=(-limit, limit), aspect="equal")
        axes.set(xticks=[-1, 0, 1], yticks=[-1, 0, 1])
        axes.tick_params(labelsize="small")
        axes.set_xlabel(r"force $/\,\mu_c f_N$", fontsize="small", labelpad=1)
        axes.set_ylabel(r"torque $/\,\mu_c f_N r$", fontsize="small", labelpad=1)
        if not beside:
            axes.set_title("inside the limit surface", fontsize="small")
        style.tidy(axes)
        colour = style.REDUCED
        self.tail, self.arm, self.head = (
            axes.plot([], [], **look)[0]
            for look in (
                {"color": colour, "lw": 1.0, "alpha": 0.6},
                {"color": colour, "lw": 1.6},
                {"color": colour, "marker": "o", "ms": 6, "mec": "white"},
            )
        )
        for artist in self.artists():
            artist.set_animated(True)
            # Viscous friction may be many times mu_c f_N.
            artist.set_clip_box(axes.bbox)
            artist.set_clip_on(True)

    def artists(self) -> list[Artist]:
        """Return the artists that change from frame to frame, on top of the surface."""
        return [self.tail, self.arm, self.head]

    def choose(self, level: Any) -> None:
        """Show the surface at a level alone."""
        for each, surface in self.drawn.items():
            surface.set_visible(each == level)

    def show(self, frame: int) -> None:
        """Show a frame."""
        at = self.points[frame]
        self.tail.set_data(*self.points[max(0, frame - TAIL) : frame + 1].T)
        self.arm.set_data(*np.stack([np.zeros(2), at], -1))
        self.head.set_data(*at[:, None])

    def _seen(self, points: np.ndarray) -> np.ndarray:
        """Return points `[..., 3]` of the wrench as they are seen from the side `[..., 2]`."""
        return np.stack([points[..., :2] @ self.along, points[..., 2]], -1)

    def _side(self, surface: Any) -> np.ndarray:
        """Return the outline of a surface as it is seen from the side `[P, 2]`, convex as the surface is."""
        from scipy.spatial import ConvexHull

        points = self._seen(scaled_samples(surface, *even_mesh(surface))[1])
        points = points.reshape(-1, 2)
        return points[ConvexHull(points).vertices]

    def _points(self) -> np.ndarray:
        """Return the wrenches `(fx, fy, tau/r)` about the centre of pressure over `mu_c f_N` `[F, 3]` [-], or zeros."""
        track = self.track
        mu = float(self.track.contact.model.law.numbers.mu_c)
        points = np.zeros((len(track.loads), 3))
        for frame, load in enumerate(track.loads):
            if load > 0.0:
                radius = self.surfaces[level_of(track, frame)].contact_radius
                _, centre = track.shape(frame)
                wrench = geometry.wrench_at(track.wrenches[frame], centre)
                points[frame] = wrench / np.array([1.0, 1.0, radius]) / (mu * load)
        return points


def surface_at(patch: Any, load: float | None) -> Any:
    """Return the exact limit surface of a patch at a load; a table of it where the cells differ in their friction."""
    each_its_own = patch.root is not None and patch.root.ndim == 3
    make = pf.LimitSurfaceTable if each_its_own else pf.LimitSurfaceExact
    return make(patch, normal_force=load)


def has_surface(track: ContactTrack) -> bool:
    """Return True if a limit surface can be drawn: not for one point, nor for a user's model with other friction."""
    if not isinstance(track.contact.model.law, FrictionLaw):
        return False
    try:
        loads = _levels(track)
        for load in list(loads.values())[:1]:
            surface_at(track.contact.model.patch, load)
    except FrictionError:
        return False
    return bool(loads)


def _levels(track: ContactTrack) -> dict[Any, float | None]:
    """Return the load [N] of each level at which its surface is drawn; None if the shape does not depend on it."""
    if not track.contact.model.patch.depends_on_load:
        return {None: None}
    found = sorted(
        {level_of(track, frame) for frame, load in enumerate(track.loads) if load > 0.0}
    )
    return {level: LOAD_STEP**level for level in found}


def level_of(track: ContactTrack, frame: int) -> Any:
    """Return the level of the load of a frame; without load, that of the last one before with load, or of the first."""
    if not track.contact.model.patch.depends_on_load:
        return None
    loaded = np.flatnonzero(track.loads > 0.0)
    before = loaded[loaded <= frame]
    load = track.loads[before[-1] if len(before) else loaded[0]]
    return round(math.log(load) / math.log(LOAD_STEP))


def centre_mark(axes: Any) -> Any:
    """Return the mark of a centre of rotation, a ring with a dot."""
    look = {"ls": "none", "marker": r"$\odot$", "ms": 11, "color": "black", "zorder": 8}
    return axes.plot([], [], label="centre of rotation", **look)[0]


def put_centre(mark: Any, twist: np.ndarray, at: np.ndarray, *, still: float) -> None:
    """Put the mark [mm] where a body with `twist` at `at` [m] turns; nowhere where it is slower than `still` [m/s]."""
    vx, vy, omega = twist
    if omega == 0.0 or math.hypot(vx, vy) + ARM * abs(omega) < still:
        mark.set_data([], [])
    else:
        mark.set_data([1e3 * (at[0] - vy / omega)], [1e3 * (at[1] + vx / omega)])


def still_speed(twists: np.ndarray) -> float:
    """Return the speed [m/s] below which a body that has the twists `[F, 3]` stands."""
    return STILL * float(
        (np.hypot(*twists[:, :2].T) + ARM * np.abs(twists[:, 2])).max()
    )
