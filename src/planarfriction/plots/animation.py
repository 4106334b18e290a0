"""Animations of solutions: the body in the world, and beside it the cells and the wrench of each contact."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.lines import Line2D
from matplotlib.patches import FancyArrowPatch, Patch
from matplotlib.patheffects import withStroke

import planarfriction as pf
from planarfriction._support import validation
from planarfriction._support.shown import unit_for
from planarfriction._support.writing import replacing
from planarfriction.errors import InvalidValueError
from planarfriction.plots import panels, style
from planarfriction.plots.film_files import check_kind, write_frames
from planarfriction.plots.motion import body_lines, move, placed
from planarfriction.plots.panels import CellPanel, SurfacePanel
from planarfriction.plots.track import Track, track_of

LEAST_FRAMES = 75
"""Frames that a picture has at least where nothing is asked for."""

USUAL_FRAMES = 300
"""Frames that a picture has at most where nothing is asked for."""

MOST_FRAMES = 3000
"""Frames that a picture can have at most."""

FASTEST = 50.0
"""Most frames a second: browsers show faster GIFs ten times too slow."""

SLOWEST = 0.01
"""Fewest frames a second: a GIF shows no frame for more than 655 s."""


def animate_solution(
    solution: pf.Solution,
    path: str | Path,
    *,
    slow: float | None = None,
    fps: float = 30.0,
    follow: bool = True,
    dpi: float = 100.0,
    progress: Callable[[float], None] | None = None,
) -> Path:
    """Write an animation of a solution to `path`, a `.gif`, `.mp4` or `.html` file; returns the path.

    On the left, the body in the world: outline, contact patches, the path of its centre, the friction force on it at
    each contact (world axes, all identical contacts) and its centre of rotation. On the right, for each contact (the
    three of the largest normal force): its cells, from pale to blue as their bristles bend and orange where they
    slip, and its wrench inside its limit surface, for mu_c f_N = 1. Which cells slip is computed by a distributed
    model with the contact's law on the recorded path, whatever the model of the contact, less accurately from
    samples far apart.

    `.mp4` needs ffmpeg or the extra `[ffmpeg]`. `slow` is how many times slower than real time it runs [-], below 1
    faster; None takes real time if that makes 75 to 300 frames, else the next of 1, 2, 5, 10, ... that does. `fps` are
    the frames per second, from 0.01 to 50. With `follow` the view follows a body that moves much farther than its size,
    instead of showing the whole path. `dpi` is the resolution of pictures of 9.6 x 5.4 inches; `progress` is called
    with the time of each frame [s].

    Raises FileError for a file of another kind, one that cannot be written, a missing ffmpeg, and a solution without
    its scene; InvalidValueError for a parameter that breaks its rule.
    """
    from planarfriction.scenes.solution import scene_of

    scene_of(
        validation.instance("solution", solution, pf.Solution, "a Solution"),
        "the animation",
    )
    path = validation.path("path", path)
    check_kind(path)
    times, pace = frame_times(solution.histories["time"].values, slow, fps)
    validation.instance("follow", follow, bool, "True or False")
    dpi = validation.positive("dpi", dpi)
    if not 20.0 <= dpi <= 400.0:
        raise InvalidValueError("dpi", "be from 20 to 400", dpi)
    if not (progress is None or callable(progress)):
        raise InvalidValueError(
            "progress", "be a function of the time of a frame, or None", progress
        )
    with replacing(path) as file:
        film = Film(
            solution, track_of(solution, times), follow=follow, pace=pace, dpi=dpi
        )

        def frame(number: int) -> np.ndarray:
            if progress is not None:
                progress(float(times[number]))
            return film.picture(number)

        write_frames(path, file, frame, len(times), fps)
    return path


def frame_times(
    sampled: np.ndarray, slow: float | None, fps: float
) -> tuple[np.ndarray, str]:
    """Return the times of the frames [s] of a solution with samples at `sampled` [s], and their pace in words."""
    fps = validation.positive("fps", fps)
    if not SLOWEST <= fps <= FASTEST:
        limit = f"most {FASTEST:g}" if fps > FASTEST else f"least {SLOWEST:g}"
        raise InvalidValueError("fps", f"be at {limit}", fps)
    span = float(sampled[-1] - sampled[0])
    frames = span * fps
    if slow is not None:
        slow = validation.positive("slow", slow)
    elif frames > USUAL_FRAMES:
        slow = 1.0 / _round_up(frames / USUAL_FRAMES)
    else:
        slow = _round_up(LEAST_FRAMES / frames) if 0.0 < frames < LEAST_FRAMES else 1.0
    wanted = slow * span * fps
    if wanted > MOST_FRAMES:
        rule = f"be at most {MOST_FRAMES / frames:.3g} here, for at most {MOST_FRAMES} frames"
        raise InvalidValueError("slow", rule, slow)
    count = max(round(wanted) + 1, 2) if span > 0.0 else LEAST_FRAMES
    words = f"   ({slow:g} x slower)" if slow > 1.0 else f"   ({1.0 / slow:g} x faster)"
    words = "" if slow == 1.0 or span == 0.0 else words
    return np.linspace(sampled[0], sampled[-1], count), words


def _round_up(value: float) -> float:
    """Return the next of 1, 2, 5, 10, 20, ..."""
    power = 10.0 ** math.floor(math.log10(value))
    return next(
        each * power
        for each in (1.0, 2.0, 5.0, 10.0)
        if each * power >= value * (1.0 - 1e-12)
    )


WIDTH = 9.6
"""Width of a frame [inch]."""

HEIGHT = 5.4
"""Height of a frame [inch]."""

MOST_PANELS = 3
"""Contacts that have panels of their own beside the motion: those of the largest normal force."""

VIEW = 2.3
"""Side of a view that follows the body, in its largest radius [-]."""

ROAM = 1.5
"""Number of such views that a motion fills before there is one [-]."""

ARROW = 0.3
"""Length of the longest of a force, as a share of the view [-]."""


class Film:
    """The frames of a track."""

    def __init__(
        self,
        solution: pf.Solution,
        track: Track,
        *,
        follow: bool,
        pace: str,
        dpi: float,
    ):
        self.track = track
        self.pace = pace
        self.figure = style.PlotFigure(
            figsize=(WIDTH, HEIGHT), dpi=dpi, facecolor="white"
        )
        self.canvas = FigureCanvasAgg(self.figure)
        pressed = lambda each: -each.contact.count * float(each.loads.max())
        hardest = sorted(track.contacts, key=pressed)
        chosen = sorted(hardest[:MOST_PANELS], key=lambda each: each.index)
        world, places = _places(len(chosen))
        self.axes = self.figure.add_axes(world)
        self.panels: list[CellPanel | SurfacePanel] = []
        for each, (cells, bar, surface) in zip(chosen, places, strict=True):
            shown = self.figure.add_axes(bar) if bar and each.slip is not None else None
            self.panels.append(CellPanel(self.figure.add_axes(cells), each, bar=shown))
            if panels.has_surface(each):
                axes = self.figure.add_axes(surface)
                self.panels.append(SurfacePanel(axes, each, beside=len(chosen) - 1))
        self._draw_body(solution)
        box = self.axes.bbox
        views = _views(solution, track, follow)
        self.views = _filling(views, box.width / box.height)
        far = float(np.abs(self.views).max())
        side = float(np.diff(self.views[0], axis=-1).max())
        style.show_lengths(self.axes, 1e-3 * max(0.1 * far, side))
        # Clear of any tick label.
        self.axes.yaxis.set_label_coords(0.022, 0.5, transform=self.figure.transFigure)
        self.axes.locator_params(nbins=7)
        style.tidy(self.axes)
        self._legend()
        self.axes.set_animated(True)
        self.backgrounds: dict[tuple, Any] = {}

    def picture(self, frame: int) -> np.ndarray:
        """Return a frame as red, green and blue `[height, width, 3]`, each a byte."""
        self.show(frame)
        surfaces = [each for each in self.panels if isinstance(each, SurfacePanel)]
        levels = tuple(panels.level_of(each.track, frame) for each in surfaces)
        if levels not in self.backgrounds:
            for panel, level in zip(surfaces, levels, strict=True):
                panel.choose(level)
            self.canvas.draw()
            self.backgrounds[levels] = self.canvas.copy_from_bbox(self.figure.bbox)
        self.canvas.restore_region(self.backgrounds[levels])
        self.figure.draw_artist(self.axes)
        for panel in self.panels:
            for artist in panel.artists():
                panel.axes.draw_artist(artist)
        return np.asarray(self.canvas.buffer_rgba())[..., :3].copy()

    def show(self, frame: int) -> None:
        """Show a frame."""
        track = self.track
        pose = track.poses[frame]
        (x, y) = self.views[frame]
        self.axes.set(xlim=x, ylim=y)
        move(self.body, self.axes, pose)
        self.path.set_data(*(1e3 * track.poses[: frame + 1, :2].T))
        for each, cells, arrow in self.contacts:
            panels.colour_cells(cells, each, frame)
            move([cells], self.axes, each.poses[frame])
            _, centre = each.shape(frame)
            start = 1e3 * placed(centre, each.poses[frame])
            arrow.set_positions(
                start, start + self.millimetres_per_newton * each.forces[frame]
            )
        panels.put_centre(self.centre, track.twists[frame], pose[:2], still=self.still)
        self.clock.set_text(f"t = {track.times[frame]:.{self.digits}f} s{self.pace}")
        self.words.set_text(self._moved(frame))
        for panel in self.panels:
            panel.show(frame)

    def _draw_body(self, solution: pf.Solution) -> None:
        axes = self.axes
        track = self.track
        self.body = [
            axes.add_artist(Line2D(*(1e3 * each.T), color="0.25", lw=1.5, zorder=5))
            for each in body_lines(solution)
        ]
        (self.path,) = axes.plot([], [], color="0.45", linewidth=0.9, zorder=5)
        self.contacts = []
        for each in track.contacts:
            cells = panels.cells_of(each, edge="face")
            cells.set_zorder(4)
            axes.add_collection(cells, autolim=False)
            arrow = FancyArrowPatch(
                (0, 0),
                (1, 1),
                arrowstyle="-|>,head_length=5,head_width=2.5",
                color=style.REDUCED,
                linewidth=2.2,
                shrinkA=0,
                shrinkB=0,
                zorder=7,
            )
            arrow.set_path_effects([withStroke(linewidth=4.2, foreground="white")])
            self.contacts.append((each, cells, axes.add_patch(arrow)))
        self.centre = panels.centre_mark(axes)
        self.still = panels.still_speed(track.twists)
        span = float(track.times[-1] - track.times[0])
        self.digits = (
            int(np.clip(2 - math.floor(math.log10(span)), 2, 9)) if span > 0.0 else 3
        )
        above = {"transform": axes.transAxes, "va": "bottom"}
        self.clock = axes.text(0.0, 1.06, "", **above, fontsize="medium")
        self.words = axes.text(0.0, 1.01, "", **above, fontsize="small", color="0.3")

    def _legend(self) -> None:
        contacts = self.track.contacts
        largest = max(float(np.hypot(*each.forces.T).max()) for each in contacts)
        side = float(np.diff(self.views[0], axis=-1).min())
        self.millimetres_per_newton = ARROW * side / largest if largest > 0.0 else 0.0
        unit = unit_for("force", largest)
        words = (
            f"friction on the body (longest {unit.factor * largest:.3g} {unit.label})"
        )
        handles: list[Any] = [
            Line2D([], [], color=style.REDUCED, linewidth=2.2, label=words),
            self.centre,
        ]
        if len(contacts) > 1:  # one has its colours beside its cells
            handles += [
                Patch(color=panels.STICK, label="sticks"),
                Patch(color=panels.SLIP, label="slips"),
            ]
        self.figure.legend(
            handles=handles,
            loc="lower left",
            bbox_to_anchor=(0.03, 0.0),
            ncols=len(handles),
            frameon=False,
            fontsize="small",
            columnspacing=1.2,
            handlelength=1.4,
        )

    def _moved(self, frame: int) -> str:
        """Return the distance that the body has moved, in units that fit the whole motion."""
        moved = self.track.poses - self.track.poses[0]
        parts = []
        for words, kind, column in (
            ("moved by x", "length", 0),
            ("y", "length", 1),
            ("rotated by", "angle", 2),
        ):
            unit = unit_for(kind, moved[:, column])
            # No -0.00.
            way = round(unit.factor * moved[frame, column], 2) + 0.0
            parts.append(f"{words} {way:.2f} {unit.label}")
        return ", ".join(parts)


def _places(contacts: int) -> tuple[tuple, list[tuple]]:
    """Return the places of the world and, for each contact, of its cells, their colours (or None) and its surface."""
    if contacts == 1:
        cells = (0.665, 0.6, 0.2, 0.355)
        bar = (0.88, 0.6, 0.014, 0.355)
        return (0.072, 0.145, 0.5, 0.745), [(cells, bar, (0.665, 0.1, 0.2, 0.355))]
    height = 1.0 / contacts
    places: list[tuple] = []
    for number in range(contacts):
        low = 1.0 - (number + 1) * height
        side = height - 0.17
        cells = (0.57, low + 0.105, side * HEIGHT / WIDTH, side)
        places.append((cells, None, (0.81, low + 0.105, *cells[2:])))
    return (0.072, 0.145, 0.43, 0.745), places


def _views(solution: pf.Solution, track: Track, follow: bool) -> np.ndarray:
    """Return the limits of both axes `[F, 2, 2]` [mm]: of all that is drawn, or of a window that follows the body.

    A window follows where the motion is much longer than the body; it stays within the limits of the whole.
    """
    of_body = body_lines(solution)
    of_world = []
    for each in track.contacts:
        contact = each.contact
        points = _rim(panels.cell_polygons(contact.model.patch).reshape(-1, 2))
        if contact.mounted_on == "body":
            frame = np.array([*contact.position, contact.angle])
            of_body.append(placed(points, frame))
        else:
            of_world += [placed(points, pose) for pose in np.unique(each.poses, axis=0)]
    carried = np.concatenate(of_body)
    radius = float(np.hypot(*carried.T).max()) or 1e-3
    turned = placed(carried, track.poses[:, None])
    everything = np.concatenate([turned.reshape(-1, 2), *of_world])
    low = everything.min(axis=0)
    high = everything.max(axis=0)
    whole = 0.5 * (low + high)
    reach = 0.5 * (high - low) + 0.05 * max(float((high - low).max()), radius)
    side = VIEW * radius
    half = reach
    middle = np.broadcast_to(whole, (len(track.times), 2))
    if follow and 2.0 * reach.max() > ROAM * side:
        half = min(0.5 * side, reach.max())
        # How far the middle may go from that of the whole.
        room = np.maximum(reach - half, 0.0)
        middle = np.clip(track.poses[:, :2], whole - room, whole + room)
    return 1e3 * np.stack([middle - half, middle + half], -1)


def _rim(points: np.ndarray) -> np.ndarray:
    """Return the points that reach farthest in each of 16 directions: enough of them to see the limits of a drawing."""
    angles = 2.0 * np.pi * np.arange(16) / 16
    along = points @ np.stack([np.cos(angles), np.sin(angles)])
    return points[np.unique(along.argmax(axis=0))]


def _filling(views: np.ndarray, ratio: float) -> np.ndarray:
    """Return the views widened to axes of such a width over height, so that both axes have one scale."""
    middle = views.mean(axis=-1)
    (width, height) = np.diff(views[0], axis=-1)[:, 0]
    sides = np.array([max(width, height * ratio), max(height, width / ratio)])
    return np.stack([middle - 0.5 * sides, middle + 0.5 * sides], -1)
