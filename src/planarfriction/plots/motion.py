"""Motion of the body in the plane: three outlines with the contact patches, and the path between them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.artist import Artist
from matplotlib.collections import LineCollection
from matplotlib.colors import Normalize
from matplotlib.lines import Line2D
from matplotlib.patches import PathPatch
from matplotlib.path import Path as Outline
from matplotlib.transforms import Affine2D

import planarfriction as pf
from planarfriction import geometry
from planarfriction._support import validation
from planarfriction._support.shown import unit_for
from planarfriction.plots import style, symbols
from planarfriction.plots.histories import draw_histories
from planarfriction.plots.patch import cell_boxes
from planarfriction.plots.track import body_poses
from planarfriction.scenes.contact import contact_poses

INSTANTS = 3
"""Number of outlines: at the start, half-way and at the end."""

ROOM = 0.3
"""Share of the side of the view for the words beside the outlines."""

APART = 0.07
"""Least distance of these words over each other, as a share of the side of the view."""

MASS = 0.018
"""Radius of the mark of the centre of mass, as a share of the side of the view."""

PIECES = 200
"""Most pieces of a path that is coloured by time."""

PAD_OPACITY = 0.35
"""Opacity of contact patches, so that those of a strobe show through each other."""

TINY = 25.0
"""Ratio of a side of the view to the body beyond which the body is drawn larger [-]."""

SEEN = 0.08
"""Share of the side of the view that such a body is drawn with [-]."""

UNSEEN = 0.01
"""Share of the size of the body by which it has to move for that to be seen [-]."""

ROUND = 0.02
"""Share by which the radii of a round outline differ at most [-]."""

CORNERS = 12
"""Corners that a round outline has at least."""


def plot_motion(
    solution: pf.Solution, *, size: Any = None, ax: Any = None
) -> style.PlotFigure:
    """Draw the body and its patches at the start, half-way and at the end, and the path of its centre of mass.

    World axes, equal scales. The path is coloured by time; the outlines, in the colours of their instants, are labelled
    with time and turn. Half-way is where half of the motion is done. Patches fixed to the world are drawn once; patches
    on the body, and pads that are driven, at each instant. A body without an outline is drawn as the rim of its
    patches, with a line from its centre of mass along its x axis. A body that is tiny beside its path is drawn larger,
    and the title says so, as it does where the body hardly moves. `size` is the width and the height of the figure
    [inch]; `ax` are axes to draw into instead of a new figure.

    Raises InvalidValueError for what is not a solution of a scene, and for a wrong size or axes.
    """
    strobe = _strobe(solution)
    width, height = np.diff(strobe.limits, axis=-1)[:, 0]
    tall = float(np.clip(1.0 + 4.6 * height / width, 2.6, 5.6))
    figure, axes = style.place(ax, 6.4, tall, size)
    _draw(axes, strobe)
    figure.draw_without_rendering()  # the aspect sets the ticks, which the layout has to know
    return figure


def plot_solution(solution: pf.Solution, *, size: Any = None) -> style.PlotFigure:
    """Draw the motion of the body (left) and the time histories of body and contacts (right).

    `size` is the width and the height of the figure [inch].

    Raises InvalidValueError for what is not a solution of a scene, and for a wrong size.
    """
    figure = style.new_figure(14.0, 6.8, size)
    parts: Any = figure.subfigures(1, 2, width_ratios=(1.0, 1.45))
    motion, histories = parts
    draw_motion(motion, solution)
    draw_histories(histories, solution)
    figure.suptitle(f"{solution.scene.name}", fontsize="large")
    return figure


def draw_motion(figure: Any, solution: pf.Solution) -> None:
    """Draw `plot_motion` into a figure or subfigure."""
    _draw(figure.subplots(), _strobe(solution))


class _Strobe(NamedTuple):
    solution: pf.Solution
    times: np.ndarray
    """Instants that are drawn [s]."""
    poses: np.ndarray
    """Poses of the body at them `[N, 3]` [m, m, rad]."""
    path: np.ndarray
    """Poses at all samples `[T, 3]` [m, m, rad]."""
    larger: float
    """Factor by which the body is drawn larger than it is [-]."""
    limits: np.ndarray
    """Limits of both axes `[2, 2]` [mm]."""


def _strobe(solution: pf.Solution) -> _Strobe:
    validation.instance("solution", solution, pf.Solution, "a Solution")
    time = solution.histories["time"].values
    poses = body_poses(solution)
    chosen = instants(poses, _reach(solution))
    limits = _limits(solution, time[chosen], poses[chosen], 1.0)
    side = 1e-3 * float(np.diff(limits, axis=-1).max())
    size = 2.0 * _reach(solution)
    larger = 1.0
    if TINY * size < side:
        larger = float(f"{SEEN * side / size:.1g}")
        limits = _limits(solution, time[chosen], poses[chosen], larger)
    return _Strobe(solution, time[chosen], poses[chosen], poses, larger, limits)


def instants(poses: np.ndarray, reach: float) -> np.ndarray:
    """Return the indices of the first pose, of that at which half of the motion is done, and of the last."""
    x, y, turn = np.diff(poses, axis=0).T
    done = np.cumsum(np.hypot(np.hypot(x, y), reach * turn))
    if not len(done) or done[-1] == 0.0:
        return style.evenly(len(poses), INSTANTS)
    half = 1 + int(np.searchsorted(done, 0.5 * done[-1]))
    return np.unique([0, half, len(poses) - 1])


def _draw(axes: Any, strobe: _Strobe) -> None:
    solution = strobe.solution
    times = strobe.times
    pads = [each for each in solution.scene.contacts if each.mounted_on == "world"]
    scale = Normalize(times[0], times[-1] if times[-1] > times[0] else times[0] + 1.0)
    for time, pose in zip(times, strobe.poses, strict=True):
        colour = style.TIME_COLOURS(scale(time))
        body = [
            _draw_shape(axes, _on_mount(each), colour)
            for each in solution.scene.contacts
            if each.mounted_on == "body"
        ]
        body += [
            axes.add_artist(Line2D(*(1e3 * line.T), color=colour, lw=1.3, zorder=3))
            for line in body_lines(solution)
        ]
        move(body, axes, pose, strobe.larger)
        for contact in (each for each in pads if each.support_velocity is not None):
            at = contact_poses(contact, np.array([time]), pose)[0]
            move([_draw_shape(axes, _pad_shape(contact), colour)], axes, at)
    for contact in (each for each in pads if each.support_velocity is None):
        _draw_shape(axes, _on_mount(contact), style.PAD)
    style.show_lengths(axes, 1e-3 * float(np.abs(strobe.limits).max()))
    axes.locator_params(nbins=style.ticks(axes, 7))
    room = ROOM * float(np.diff(strobe.limits, axis=-1).max())
    axes.update_datalim(strobe.limits.T + np.array([[0.0, 0.0], [room, 0.0]]))
    axes.margins(0.0)
    axes.set_aspect("equal", adjustable="datalim")  # narrow motions fill the panel too
    style.tidy(axes)
    draw_path(axes, strobe.solution.histories["time"].values, strobe.path, scale)
    side = float(np.diff(strobe.limits, axis=-1).max())
    for pose in strobe.poses:
        symbols.centre_of_mass(axes, 1e3 * pose[:2], MASS * side)
    lines = [strobe.larger * each for each in body_lines(solution)]
    body = np.concatenate(lines or [np.zeros((1, 2))])
    corners = [1e3 * placed(body, pose) for pose in strobe.poses]
    turns = strobe.poses[:, 2] - strobe.path[0, 2]
    label_poses(axes, times, turns, corners, side, scale)
    axes.set_title(_remark(strobe), fontsize="small", loc="left")


def draw_path(axes: Any, time: np.ndarray, poses: np.ndarray, scale: Any) -> None:
    """Draw the path of a body [mm], coloured by time on a `scale`."""
    some = style.evenly(len(time), PIECES)
    places = 1e3 * poses[some, :2]
    pieces = np.stack([places[:-1], places[1:]], axis=1)
    colours = style.TIME_COLOURS(scale(0.5 * (time[some][1:] + time[some][:-1])))
    look = {"linewidth": 2.2, "capstyle": "round", "zorder": 4}
    axes.add_collection(LineCollection(list(pieces), colors=colours, **look))


def label_poses(
    axes: Any,
    times: np.ndarray,
    turns: np.ndarray,
    corners: Sequence[np.ndarray],
    side: float,
    scale: Any,
) -> None:
    """Write time and turn of each instant to the right of the body's corners [mm], clear of each other.

    `side` is the larger side of the view [mm].
    """
    clock = unit_for("time", times)
    angle = unit_for("angle", turns)
    sign = "°" if angle.label == "deg" else f" {angle.label}"
    # The upper one of corners that are about as far to the right.
    ends = np.array([each[np.argmax(each @ [1.0, 0.1])] for each in corners])
    last = np.inf
    for k in np.argsort(-ends[:, 1], kind="stable"):
        last = min(ends[k, 1], last - APART * side)
        turn = f"{angle.factor * turns[k] + 0.0:.3g}{sign}"
        words = f"{clock.factor * times[k]:.3g} {clock.label}: {turn}"
        axes.text(
            ends[k, 0] + 0.02 * side,
            last,
            words.replace("-", "\N{MINUS SIGN}"),
            color=style.TIME_COLOURS(scale(times[k])),
            fontsize="small",
            fontweight="bold",
            va="center",
            zorder=10,
        ).set_path_effects(list(symbols.HALO))


def _remark(strobe: _Strobe) -> str:
    """Return a remark on what the drawing does not show: that the body is drawn larger, or how little it moves."""
    if strobe.larger > 1.0:
        return f"body drawn {strobe.larger:g} times as large"
    moved = strobe.path - strobe.path[0]
    length = float(np.hypot(moved[:, 0], moved[:, 1]).max())
    angle = float(np.abs(moved[:, 2]).max())
    if max(length, angle * _reach(strobe.solution)) > UNSEEN * _reach(strobe.solution):
        return ""
    if length == angle == 0.0:
        return "it does not move"
    far = unit_for("length", length)
    turn = unit_for("angle", angle)
    moves = f"moves by up to {far.factor * length:.2g} {far.label}"
    return f"{moves}, rotates by up to {turn.factor * angle:.2g} {turn.label}"


def _reach(solution: pf.Solution) -> float:
    """Return the largest distance of the body's lines from its centre of mass [m]."""
    return float(np.hypot(*np.concatenate(body_lines(solution)).T).max()) or 1e-3


def placed(points: np.ndarray, pose: np.ndarray) -> np.ndarray:
    """Return the points `[..., 2]` [m] of a frame at `pose` (x, y, angle), seen from the frame that the pose is in."""
    return pose[..., :2] + geometry.rotate(points, pose[..., 2])


def _draw_shape(axes: Any, shape: np.ndarray, colour: Any) -> Artist:
    """Draw boxes `[N, 4, 2]` or points `[N, 2]` [m] in the frame of the axes [mm]; return the artist."""
    shape = 1e3 * shape
    # All boxes are one path, so that no seams show between neighbours.
    if shape.ndim == 3:
        drawn = PathPatch(
            outline_of(shape), fc=colour, ec="none", alpha=PAD_OPACITY, zorder=2
        )
    else:
        look = {"marker": "o", "ms": 4.5, "mew": 0.0, "ls": "none", "alpha": 0.8}
        drawn = Line2D(*shape.T, **look, color=colour, zorder=2)
    return axes.add_artist(drawn)


def outline_of(boxes: np.ndarray) -> Outline:
    """Return the path around polygons `[N, M, 2]`."""
    closed = np.concatenate([boxes, boxes[:, :1]], axis=1)
    lines = [Outline.LINETO] * (boxes.shape[1] - 1)
    codes = [Outline.MOVETO, *lines, Outline.CLOSEPOLY]
    return Outline(closed.reshape(-1, 2), np.tile(codes, len(boxes)))


def move(
    artists: list[Artist], axes: Any, pose: np.ndarray, larger: float = 1.0
) -> None:
    """Put the frame of the artists at `pose` (x, y, angle) [m, m, rad] in the plane of the axes, `larger` times."""
    frame = Affine2D().scale(larger).rotate(pose[2]).translate(*(1e3 * pose[:2]))
    for artist in artists:
        artist.set_transform(frame + axes.transData)


def body_lines(solution: pf.Solution) -> list[np.ndarray]:
    """Return lines `[M, 2]` [m] that stand for the body, in its frame: the outline, or the rim of the patches on it.

    Where its turn would not show, on a round outline and without any, also a line along its x axis.
    """
    outline = solution.scene.body.outline
    contacts = solution.scene.contacts
    if outline is not None:
        radii = np.hypot(*outline.T)
        arm = radii.max()
        lines = [np.concatenate([outline, outline[:1]])]
        if len(outline) < CORNERS or np.ptp(radii) > ROUND * arm:
            return lines
    else:
        arm = max(float(np.abs(_pad_shape(each)).max()) for each in contacts)
        lines = _rim(
            [_on_mount(each) for each in contacts if each.mounted_on == "body"]
        )
    return [*lines, np.array([(0.0, 0.0), (arm, 0.0)])]


def _rim(shapes: list[np.ndarray]) -> list[np.ndarray]:
    """Return the closed line around all points of the shapes; none where they lie on one line."""
    from scipy.spatial import ConvexHull, QhullError

    try:
        points = np.concatenate([shape.reshape(-1, 2) for shape in shapes])
        corners = points[ConvexHull(points).vertices]
    except (ValueError, QhullError):
        return []
    return [np.concatenate([corners, corners[:1]])]


def _pad_shape(contact: pf.Contact) -> np.ndarray:
    """Return the cells of a contact's patch as polygons `[N, 4, 2]`, or its points `[N, 2]` [m], in its frame."""
    patch = contact.model.patch
    return patch.positions if patch.grid is None else cell_boxes(patch, patch.grid)


def _on_mount(contact: pf.Contact) -> np.ndarray:
    """Return the patch of a contact in the frame that it is mounted on (world or body) [m]."""
    return placed(_pad_shape(contact), np.array([*contact.position, contact.angle]))


def _limits(
    solution: pf.Solution, times: np.ndarray, poses: np.ndarray, larger: float
) -> np.ndarray:
    """Return the limits of both axes, `[2, 2]` [mm], that hold all drawn at `times` and `poses`, the body `larger`."""
    points = [
        placed(larger * line, pose) for pose in poses for line in body_lines(solution)
    ]
    for contact in solution.scene.contacts:
        shape = _pad_shape(contact)
        seen = contact_poses(contact, times, poses)
        if contact.mounted_on == "body":
            shape = larger * _on_mount(contact)
            seen = poses
        points += [placed(shape.reshape(-1, 2), pose) for pose in seen]
    everything = 1e3 * np.concatenate(points)
    low = everything.min(axis=0)
    high = everything.max(axis=0)
    margin = 0.04 * float((high - low).max())
    return np.stack([low - margin, high + margin], -1)
