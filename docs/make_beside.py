"""Make README's picture of MuJoCo with and without patches: `python docs/make_beside.py [FOLDER]`, in `docs/images`.

It shows the case `in_hand` of the simulator benchmark at the settings of README's table: a plate slips and rotates
between two pads. Dashed: the exact motion. Errors at the end have to be those of docs/referee.json, which are the first
row of the table.
"""

from __future__ import annotations

import json
import math
import sys
from pathlib import Path

import numpy as np
from make_moving import check_size
from make_referee import IN_README, KEPT, rounded
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon, Wedge
from scipy.interpolate import CubicSpline

from planarfriction.plots import style
from planarfriction.plots.film_files import write_frames
from planarfriction_studies.referee.case import all_cases
from planarfriction_studies.referee.engines.mujoco import ENGINES
from planarfriction_studies.referee.run import trace
from planarfriction_studies.referee.truths import in_hand

NAME = "in_hand"
"""Case of the benchmark."""
HEADS = dict(
    zip(IN_README, ("default", "best settings", "planarfriction"), strict=True)
)
"""Engine -> heading of its panel."""

DASHES = style.LINES[style.REFERENCE]
"""Line style of the exact motion."""

WIDTH, HEIGHT = 840, 460
"""Size of the picture [px]; DPI is 100."""
FPS, SLOW, LAST = 15.0, 10.0, 30
"""Frames per second, how many times slower than the motion, and frames that show its end."""
KNOTS = 26
"""Times at which the exact motion is integrated; a spline joins them."""
LEAST = math.radians(0.5)
"""Rotation error below which no wedge is drawn [rad]."""


def exact(times: np.ndarray) -> np.ndarray:
    """Return x, y [m] and the angle [rad] of the exact motion `[T, 3]`, at times [s]."""
    given = dict(all_cases()[NAME].truths[0].given)
    del given["what"]
    knots = np.linspace(0.0, given.pop("time"), KNOTS)
    poses = [
        [in_hand(what, time=t, **given) for what in ("x", "y", "turn")]
        for t in knots[1:]
    ]
    return CubicSpline(knots, [[0.0] * 3, *poses])(times)


def in_mujoco(engine: str) -> tuple[np.ndarray, np.ndarray]:
    """Return times [s] and x, y [m] and the angle [rad] of the plate `[T, 3]` in an engine of the benchmark."""
    case = all_cases()[NAME]
    (dt,) = case.steps
    path, _, _ = trace(case, next(each for each in ENGINES if each.name == engine), dt)
    poses = np.column_stack([path.positions[:, 0, :2], path.turns[:, 0]])
    return path.times, poses - poses[0]


def placed(pose: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return points of the plate [mm] at a pose [m, m, rad]."""
    c = math.cos(pose[2])
    s = math.sin(pose[2])
    return 1e3 * pose[:2] + points @ np.array([[c, s], [-s, c]])


def draw(axes: Axes, pose: np.ndarray, true: np.ndarray, colour: str) -> None:
    """Draw the plate, the exact one as a dashed outline, the angle between them, and the pads."""
    case = all_cases()[NAME]
    half = 1e3 * case.moving[0].shapes[0].half[:2]
    corners = half * np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])
    pad = 1e3 * np.array(case.bodies[0].position[:2])
    axes.add_patch(Polygon(placed(pose, corners), fc=colour, alpha=0.3, ec="none"))
    axes.add_patch(Polygon(placed(pose, corners), fill=False, ec=colour, lw=2.6))
    axes.add_patch(
        Polygon(placed(true, corners), fill=False, ec="k", lw=1.8, ls=DASHES)
    )
    down = np.degrees([pose[2], true[2]]) - 90.0
    reach = half[1] + 6.0
    if abs(pose[2] - true[2]) > LEAST:
        axes.add_patch(
            Wedge(tuple(pad), reach, *sorted(down), fc=colour, alpha=0.85, ec="none")
        )
    for angle, look in zip(
        np.radians(down),
        ({"color": colour, "lw": 2.6}, {"color": "k", "lw": 1.8, "ls": DASHES}),
        strict=True,
    ):
        tip = pad + reach * np.array([math.cos(angle), math.sin(angle)])
        axes.plot(*np.array([pad, tip]).T, **look)
    axes.add_patch(
        Circle(
            tuple(pad),
            1e3 * case.bodies[0].shapes[0].half[0],
            fc="0.35",
            ec="w",
            lw=1.6,
            zorder=6,
        )
    )
    axes.set(xlim=(-92.0, 76.0), ylim=(-104.0, 66.0), aspect="equal")
    axes.axis("off")


def main(folder: Path) -> None:
    """Write the picture, and print the errors at the end and the size of the file."""
    runs = {name: in_mujoco(name) for name in HEADS}
    times = runs["MuJoCo"][0]
    true = exact(times)
    stored = {
        row["engine"]: row["error"]
        for row in json.loads(KEPT.read_text())["verdicts"]
        if row["case"] == NAME
    }
    for name, (_, path) in runs.items():
        error = math.degrees(abs(path[-1, 2] - true[-1, 2]))
        off = 1e3 * math.hypot(*(path - true)[-1, :2])
        print(f"{name}: {rounded(error)} degrees, {off:.1f} mm")
        if rounded(error) != (listed := rounded(math.degrees(stored[name]))):
            sys.exit(f"{name}: the table has {listed} degrees")
    moving = np.arange(0.0, times[-1] * SLOW * FPS + 1.0) / (SLOW * FPS)
    shown = np.concatenate([moving, np.full(LAST, times[-1])])

    def frame(number: int) -> np.ndarray:
        t = min(shown[number], times[-1])
        figure = Figure(figsize=(WIDTH / 100, HEIGHT / 100), dpi=100)
        canvas = FigureCanvasAgg(figure)
        now = [np.interp(t, times, column) for column in true.T]
        say = lambda x, y, words, **look: figure.text(
            x, y / HEIGHT, words, ha="center", va="center", **look
        )
        for k, (name, head) in enumerate(HEADS.items()):
            colour = style.REDUCED if k == 2 else style.BUILT_IN
            pose = np.array([np.interp(t, times, column) for column in runs[name][1].T])
            axes = figure.add_axes((k / 3, 100 / HEIGHT, 1 / 3, 270 / HEIGHT))
            draw(axes, pose, np.array(now), colour)
            middle = (k + 0.5) / 3
            say(middle, 392, head, fontsize=19, color=colour, weight="bold")
            say(
                middle,
                72,
                f"{rounded(math.degrees(abs(pose[2] - now[2])))}°",
                fontsize=32,
                color=colour,
                weight="bold",
            )
        say(
            1 / 3,
            434,
            "MuJoCo, built-in friction",
            fontsize=21,
            color=style.BUILT_IN,
            weight="bold",
        )
        say(5 / 6, 434, "MuJoCo with", fontsize=21, color=style.REDUCED, weight="bold")
        say(
            0.5,
            18,
            f"rotation error from the exact motion (dashed), {t:.2f} s",
            fontsize=16.5,
            color="0.2",
        )
        canvas.draw()
        return np.asarray(canvas.buffer_rgba())[..., :3].copy()

    folder.mkdir(parents=True, exist_ok=True)
    path = folder / "beside-mujoco.gif"
    with path.open("wb") as file:
        write_frames(path, file, frame, len(shown), FPS)
    check_size(path)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent / "images")
