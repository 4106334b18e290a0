"""Motion of the body in the plane: a strobe of its outline with the contact patches."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib import colormaps
from matplotlib.artist import Artist
from matplotlib.cm import ScalarMappable
from matplotlib.colors import ListedColormap, Normalize
from matplotlib.lines import Line2D
from matplotlib.patches import PathPatch
from matplotlib.path import Path as Outline
from matplotlib.transforms import Affine2D

from planarfriction import geometry, validation
from planarfriction.plots import style
from planarfriction.plots.patch import cell_boxes

if TYPE_CHECKING:
    from planarfriction.scenes import Contact, Solution

INSTANTS = 12
"""Number of outlines in a strobe."""

PAD_OPACITY = 0.35
"""Opacity of contact patches, so that those of a strobe show through each other."""

_TIME_COLOURS = ListedColormap(colormaps["viridis"](np.linspace(0.0, 0.92, 256)))  # the last yellow is lost on white


def plot_motion(solution: Solution) -> style.PlotFigure:
    """Draw the outline of the body at 12 instants, evenly spaced in time and coloured by time, with the contact
    patches.

    World axes in mm, equal scales. Patches fixed to the world are drawn once; patches on the body, and pads that are
    driven, at each instant. A body without an outline is drawn as a line from its centre of mass along its x axis. The
    thin line is the path of the centre of mass.
    """
    figure = style.new_figure(6.4, 5.2)
    draw_motion(figure, solution)
    return figure


def draw_motion(figure: Any, solution: Solution) -> None:
    """Draw `plot_motion` into a figure or subfigure."""
    from planarfriction.scenes import Solution

    validation.instance("solution", solution, Solution, "a Solution")
    axes = figure.subplots()
    time, poses = np.asarray(solution.data["time"], dtype=float), _poses(solution)
    chosen = np.unique(np.linspace(0, len(time) - 1, min(INSTANTS, len(time))).round().astype(int))
    scale = Normalize(time[0], time[-1] if time[-1] > time[0] else time[0] + 1.0)
    for index in chosen:
        _move(_draw_mount(axes, solution, "body", _TIME_COLOURS(scale(time[index]))), axes, poses[index])
        for contact in _driven(solution):
            pads = _draw_shape(axes, _pad_shape(contact), _TIME_COLOURS(scale(time[index])))
            _move(pads, axes, _carried(contact, float(time[index])))
    _draw_mount(axes, solution, "world", style.PAD_COLOUR)
    _finish(axes, _limits(solution, time[chosen], poses[chosen]))
    axes.plot(*(1e3 * poses[:, :2].T), color="0.3", linewidth=0.9, zorder=4)
    dots = {"s": 14, "edgecolor": "white", "linewidth": 0.5, "zorder": 5}
    axes.scatter(*(1e3 * poses[chosen, :2].T), color=_TIME_COLOURS(scale(time[chosen])), **dots)
    figure.colorbar(ScalarMappable(scale, _TIME_COLOURS), ax=axes, label="time [s]", aspect=30)


def _poses(solution: Solution) -> np.ndarray:
    """Pose (x, y, theta) of the body over time, `[T, 3]` [m, m, rad]."""
    return np.stack([np.asarray(solution.data[name], dtype=float) for name in ("x", "y", "theta")], -1)


def _placed(points: np.ndarray, pose: np.ndarray) -> np.ndarray:
    """Points `[..., 2]` [m] of a frame at `pose` (x, y, angle), seen from the frame that the pose is in."""
    return pose[:2] + geometry.rotate(points, pose[2])


def _draw_mount(axes: Any, solution: Solution, mounted_on: str, colour: Any) -> list[Artist]:
    """Draw what belongs to the body or stands in the world, its frame on that of the axes [mm]; returns the artists."""
    moving = _driven(solution)
    here = [each for each in solution.scene.contacts if each.mounted_on == mounted_on and each not in moving]
    artists = [artist for contact in here for artist in _draw_shape(axes, _on_mount(contact), colour)]
    if mounted_on == "body":
        lines = [Line2D(*(1e3 * line.T), color=colour, linewidth=1.3, zorder=3) for line in _body_lines(solution)]
        artists += [axes.add_artist(line) for line in lines]
    return artists


def _draw_shape(axes: Any, shape: np.ndarray, colour: Any) -> list[Artist]:
    """Draw boxes `[N, 4, 2]` or points `[N, 2]` [m] in the frame of the axes [mm]; returns the artists."""
    shape = 1e3 * shape
    if shape.ndim == 3:
        drawn: Artist = PathPatch(_one_path(shape), facecolor=colour, edgecolor="none", alpha=PAD_OPACITY, zorder=2)
    else:
        look = {"marker": "o", "markersize": 4.5, "markeredgewidth": 0.0, "linestyle": "none"}
        drawn = Line2D(*shape.T, **look, color=colour, alpha=0.8, zorder=2)
    return [axes.add_artist(drawn)]


def _driven(solution: Solution) -> list[Contact]:
    """Contacts whose frame is carried by something that moves as prescribed."""
    return [each for each in solution.scene.contacts if each.mounted_on == "world" and each.velocity is not None]


def _carried(contact: Contact, time: float) -> np.ndarray:
    """Pose (x, y, angle) of the frame of a driven contact [m, m, rad]."""
    from planarfriction.scenes.movers import displacement

    return np.array([*contact.position, contact.angle]) + displacement(contact.velocity, [time])[0]  # pyright: ignore


def _move(artists: list[Artist], axes: Any, pose: np.ndarray) -> None:
    """Put the frame of the artists at `pose` (x, y, angle) [m, m, rad] in the plane of the axes."""
    transform = Affine2D().rotate(pose[2]).translate(*(1e3 * pose[:2])) + axes.transData
    for artist in artists:
        artist.set_transform(transform)


def _body_lines(solution: Solution) -> list[np.ndarray]:
    """What stands for the body, as lines `[M, 2]` [m] in its frame: the closed outline, or its x axis."""
    outline = solution.scene.body.outline
    if outline is not None:
        outline = np.asarray(outline, dtype=float)
        return [np.concatenate([outline, outline[:1]])]
    arm = max(float(np.abs(_pad_shape(contact).reshape(-1, 2)).max()) for contact in solution.scene.contacts)
    return [np.array([(0.0, 0.0), (arm, 0.0)])]


def _pad_shape(contact: Contact) -> np.ndarray:
    """Cells of a contact's patch as polygons `[N, 4, 2]`, or its points `[N, 2]` [m], in its frame."""
    patch = contact.model.patch
    return patch.positions if patch.grid is None else cell_boxes(patch, patch.grid)


def _one_path(boxes: np.ndarray) -> Outline:
    """All boxes `[N, 4, 2]` as one path, so that no seams show between neighbours."""
    closed = np.concatenate([boxes, boxes[:, :1]], axis=1)
    codes = [Outline.MOVETO, Outline.LINETO, Outline.LINETO, Outline.LINETO, Outline.CLOSEPOLY]
    return Outline(closed.reshape(-1, 2), np.tile(codes, len(boxes)))


def _on_mount(contact: Contact) -> np.ndarray:
    """The patch of a contact in the frame that it is mounted on (world or body) [m]."""
    return _placed(_pad_shape(contact), np.array([*contact.position, contact.angle], dtype=float))


def _limits(solution: Solution, times: np.ndarray, poses: np.ndarray) -> np.ndarray:
    """Limits of both axes, `[2, 2]` [mm], that hold everything drawn at `times` and `poses` `[T, 3]`."""
    points = [_placed(line, pose) for pose in poses for line in _body_lines(solution)]
    moving = _driven(solution)
    for contact in moving:
        shape = _pad_shape(contact).reshape(-1, 2)
        points += [_placed(shape, _carried(contact, time)) for time in times]
    for contact in solution.scene.contacts:
        if contact in moving:
            continue
        shape = _on_mount(contact).reshape(-1, 2)
        points += [shape] if contact.mounted_on == "world" else [_placed(shape, pose) for pose in poses]
    everything = 1e3 * np.concatenate(points)
    low, high = everything.min(axis=0), everything.max(axis=0)
    margin = 0.04 * float((high - low).max())
    return np.stack([low - margin, high + margin], -1)


def _finish(axes: Any, limits: np.ndarray) -> None:
    axes.set(xlabel="x [mm]", ylabel="y [mm]")
    axes.update_datalim(limits.T)
    axes.margins(0.0)
    axes.set_aspect("equal", adjustable="datalim")  # narrow motions fill the panel too
    style.tidy(axes)
