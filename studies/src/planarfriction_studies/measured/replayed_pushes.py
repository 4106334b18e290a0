"""Measured pushes replayed from their start: the end of the object is predicted from the path of the pusher.

The pushes are those of the tasks `pushes` and `series`; nothing of a limit surface is fitted. What belongs to the
pusher comes from the measured places and forces: the friction between pusher and object is the median ratio of the two
components of the force while the pusher slides, and the pusher is put onto the edge that it pushes, from which the
measured places are 1 to 2 mm off.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from planarfriction.geometry import rotate
from planarfriction.limit_surface import LimitSurface, LimitSurfaceEllipsoid
from planarfriction.patch import ContactPatch
from planarfriction.planning import Push, Pusher, Slider, push
from planarfriction.scenes import Signal
from planarfriction_studies.measured import push_series, pushes
from planarfriction_studies.measured.tables import read_table

TRIANGLE = np.array([[-0.05, -0.05], [0.1, -0.05], [-0.05, 0.1]])
"""Outline of the object of the single pushes about its centre of mass [m]."""

WOODEN = np.array([[0.0, 0.0], [0.101, 0.0], [0.0, 0.099]]) - push_series.CENTRE
"""Outline of the object of the pushes in time [m]."""

EDGES = {0: 2, 1: 1}
"""Edges of the pushes in time, y leg and hypotenuse, as edges of the outline."""

MU_TRIANGLE, MU_WOODEN = 0.42, 0.22
"""Friction of the pushers: ratio of the force along the edge to that across it where they slide by 3 mm and more."""

SHORTEST = 30
"""Samples of a push in time while it slides, at 60 Hz, from which on it is followed; every sixth gives its path."""

RTOL = 1e-5


class ReplayedPush(NamedTuple):
    """A measured push."""

    board: str
    """"hardboard", "plywood", "flat", or "in time"."""
    name: str
    patch: ContactPatch
    outline: np.ndarray
    mu: float
    """Friction between pusher and object [-]."""
    path: Signal
    """Path of the pusher `[K, 2]` [m]."""
    start: np.ndarray
    """First pose `[3]` [m, m, rad]."""
    end: np.ndarray
    """Last measured pose `[3]` [m, m, rad]."""

    def by(
        self, make: Callable[[ContactPatch], LimitSurface], samples: int = 2
    ) -> Push:
        """Replay the push with a limit surface of the patch."""
        slider = Slider(make(self.patch), self.outline)
        return push(
            slider,
            Pusher(self.mu),
            self.path,
            start=self.start,
            samples=samples,
            rtol=RTOL,
        )

    def error(self, end: np.ndarray) -> np.ndarray:
        """Return the distance [m] and angle [rad] of a pose from the measured end `[2]`."""
        return np.array([np.hypot(*(end - self.end)[:2]), abs(end[2] - self.end[2])])


def single_pushes(folder: Path | None = None) -> list[ReplayedPush]:
    """Read the 250 single pushes with an odd number; the others give the offset of the places from the edges."""
    places = ["px0_m", "py0_m", "px1_m", "py1_m"]
    table = read_table(
        "pushes",
        ["push", "dx_m", "dy_m", "dtheta_rad", *places],
        ["config"],
        folder=folder,
    )
    cases = {
        case.question.layout: (case.question.patch, case.board)
        for case in pushes.read(folder)
    }
    first = table[places[:2]].to_numpy()
    last = table[places[2:]].to_numpy()
    edges = _slider(TRIANGLE)
    gaps = np.array([edges.gaps(place) for place in last])
    edge = np.abs(gaps).argmin(axis=1)
    at_edge = gaps[np.arange(len(edge)), edge]
    even = table["push"].to_numpy() % 2 == 0
    off = np.array([np.median(at_edge[even & (edge == k)]) for k in range(3)])
    found = []
    for i, row in enumerate(table.itertuples()):
        if even[i]:
            continue
        patch, board = cases[row.config]
        shift = off[edge[i]] * edges.inward[edge[i]]
        end = np.array([row.dx_m, row.dy_m, row.dtheta_rad])
        begin = first[i] + shift
        if (inside := edges.gaps(begin)).max() < 0.0:
            begin = begin + inside[edge[i]] * edges.inward[edge[i]]
        path = Signal.sampled(
            [0.0, 1.0], [begin, end[:2] + rotate(last[i] + shift, end[2])], "linear"
        )
        name = f"{row.config} {row.push:g}"
        found.append(
            ReplayedPush(
                board, name, patch, TRIANGLE, MU_TRIANGLE, path, np.zeros(3), end
            )
        )
    return found


def pushes_in_time(folder: Path | None = None) -> list[ReplayedPush]:
    """Read the pushes of the wooden triangle on three outer feet, from where it begins to slide to where it ends."""
    columns = [
        "push_id",
        "t_s",
        "x_m",
        "y_m",
        "yaw_rad",
        "px_m",
        "py_m",
        "sliding",
        "edge",
    ]
    table = read_table("series", columns, ["run"], folder=folder)
    patch = push_series.feet()
    edges = _slider(WOODEN)
    found = []
    for (run, number), rows in table[
        ~table["run"].isin(push_series.OTHER_FEET)
    ].groupby(["run", "push_id"], sort=False):
        slides = np.flatnonzero(rows["sliding"].to_numpy() > 0)
        if len(slides) < SHORTEST:
            continue
        first = slides[0]
        last = slides[-1]
        pose = rows[["x_m", "y_m", "yaw_rad"]].to_numpy()
        start = pose[max(first - 2, 0) : first + 1].mean(axis=0)
        kept = np.append(np.arange(first, last, 6), last)
        path = rows[["px_m", "py_m"]].to_numpy()[kept]
        edge = EDGES[int(rows["edge"].iloc[0])]
        gap = edges.gaps(rotate(path[0] - start[:2], -start[2]))[edge]
        path = path + rotate(gap * edges.inward[edge], start[2])
        signal = Signal.sampled(rows["t_s"].to_numpy()[kept], path, "linear")
        name = f"{run} {number:g}"
        found.append(
            ReplayedPush(
                "in time", name, patch, WOODEN, MU_WOODEN, signal, start, pose[last]
            )
        )
    return found


def errors(
    pushes_replayed: Sequence[ReplayedPush],
    make: Callable[[ContactPatch], LimitSurface],
) -> np.ndarray:
    """Return distances [m] and angles [rad] between the ends with a limit surface and the measured ones `[N, 2]`."""
    made: dict[int, LimitSurface] = {}
    for each in pushes_replayed:
        if id(each.patch) not in made:
            made[id(each.patch)] = make(each.patch)
    return np.array(
        [
            each.error(each.by(lambda patch: made[id(patch)]).end)
            for each in pushes_replayed
        ]
    )


def _slider(outline: np.ndarray) -> Slider:
    """Return an outline with its edges; its surface plays no part."""
    return Slider(LimitSurfaceEllipsoid(ContactPatch.points(outline)), outline)
