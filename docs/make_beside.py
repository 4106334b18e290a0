"""Make the picture of MuJoCo with and without patches: `python docs/make_beside.py [FOLDER]`, in `docs/images`.

The published plate slips between two pads under both published loads: with MuJoCo's own friction, and with patches of
this library, at the same time step. The dashed outline is the solution with bristles on a fine grid.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Literal

import numpy as np
from make_moving import check_size
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.patches import Circle, Polygon

import planarfriction as pf
from planarfriction.plots import style
from planarfriction.plots.film_files import write_frames
from planarfriction.scenes import in_hand, in_hand_load
from planarfriction_studies.bench.mujoco_scenes import Native, plate

FPS, SLOW, DPI = 20.0, 2.0, 84.0
DT = 2e-3
WAYS = {"MuJoCo, noslip solver": Native(noslip=10), "MuJoCo with patches": None}
LOADS: tuple[Literal[1, 2], ...] = (1, 2)
CORNERS = 1e3 * np.array(
    [(-0.075, -0.04), (0.075, -0.04), (0.075, 0.04), (-0.075, 0.04)]
)
MOST = 3.0  # normal force at the end of the scale [N]


def truth(load: Literal[1, 2]) -> np.ndarray:
    """Return x, y [m] and the angle [rad] of the plate, by bristles on a fine grid."""
    law = pf.LuGre(mu_s=1.2, elasto_plastic=0.9)
    model = pf.DistributedModel(pf.ContactPatch.disc(0.01).refined(3), law)
    data = pf.simulate(
        in_hand(model, normal_force=in_hand_load(load)), save_every=DT
    ).data
    return np.stack([data[name] for name in ("x", "y", "theta")], axis=1)


def in_mujoco(load: Literal[1, 2], way: Native | None) -> np.ndarray:
    """Return x, y [m] and the angle [rad] in MuJoCo."""
    scene = plate(load)
    path = scene.run(*scene.begin(way, DT))[:, [0, 1, 3]]
    return path + np.array([2e-3, 0.0, 0.0])


def outline(pose: np.ndarray) -> np.ndarray:
    """Return the corners of the plate [mm]."""
    c = np.cos(pose[2])
    s = np.sin(pose[2])
    return 1e3 * pose[:2] + CORNERS @ [[c, s], [-s, c]]


def draw(
    axes: Axes, pose: np.ndarray, true: np.ndarray, force: float, colour: str
) -> None:
    """Draw the plate, the true one as a dashed outline, the pads, the grip and the error."""
    axes.add_patch(Polygon(outline(pose), fc=colour, ec=colour, alpha=0.45))
    axes.add_patch(Polygon(outline(true), fill=False, ec="k", ls="--", lw=1.2))
    axes.add_patch(Circle((0.0, 0.0), 10.0, fc=style.PAD_COLOUR, ec="k", alpha=0.8))
    axes.annotate(
        "", (88.0, 22.0), (88.0, 44.0), arrowprops={"arrowstyle": "-|>", "color": "0.4"}
    )
    axes.text(85.0, 33.0, "g", color="0.4", ha="right", va="center")
    axes.plot(
        [-90.0, -90.0 + 60.0], [-96.0, -96.0], color="0.85", lw=7, solid_capstyle="butt"
    )
    axes.plot(
        [-90.0, -90.0 + 60.0 * force / MOST],
        [-96.0, -96.0],
        color=style.PAD_COLOUR,
        lw=7,
        solid_capstyle="butt",
    )
    axes.text(-26.0, -96.0, f"grip {force:.1f} N", va="center", fontsize="small")
    error = 1e3 * float(np.hypot(*(pose - true)[:2]))
    axes.text(
        92.0, -96.0, f"off by {error:.1f} mm", ha="right", va="center", weight="bold"
    )
    axes.set(
        xlim=(-95.0, 95.0), ylim=(-106.0, 50.0), aspect="equal", xticks=[], yticks=[]
    )


def main(folder: Path) -> None:
    """Write the picture; say how far the plates are off in the end, and how large the file is."""
    true = {load: truth(load) for load in LOADS}
    runs = {
        (load, name): in_mujoco(load, way)
        for load in LOADS
        for name, way in WAYS.items()
    }
    rows = np.arange(0, len(true[1]), round(1.0 / (FPS * SLOW * DT)))
    colours = dict(zip(WAYS, (style.OTHER, style.FEW), strict=True))

    def frame(number: int) -> np.ndarray:
        row = rows[number]
        figure = style.new_figure(9.0, 7.2)
        for i, load in enumerate(LOADS):
            for j, name in enumerate(WAYS):
                axes = figure.add_subplot(2, 2, 2 * i + j + 1)
                force = float(in_hand_load(load)(row * DT))
                draw(axes, runs[load, name][row], true[load][row], force, colours[name])
                if i == 0:
                    axes.set_title(name, weight="bold")
                if j == 0:
                    axes.set_ylabel(("the grip swings", "the grip drops once")[i])
        canvas = FigureCanvasAgg(figure)
        figure.set_dpi(DPI)
        canvas.draw()
        return np.asarray(canvas.buffer_rgba())[..., :3]

    folder.mkdir(parents=True, exist_ok=True)
    path = folder / "beside-mujoco.gif"
    with path.open("wb") as file:
        write_frames(path, file, frame, len(rows), FPS)
    for (load, name), run in runs.items():
        off = (run - true[load])[-1]
        print(
            f"load {load}, {name}: {1e3 * np.hypot(*off[:2]):.1f} mm, {np.degrees(off[2]):.2f} degrees"
        )
    check_size(path)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent / "images")
