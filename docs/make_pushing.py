"""Put the table and the picture of followed pushes into docs/pushing.md: `python docs/make_pushing.py`."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

import planarfriction as pf
from planarfriction.plots import style
from planarfriction.plots.planning import draw_push
from planarfriction_studies.measured import replayed_pushes
from planarfriction_studies.measured.scores import drawings, interval, mean

PAGE = Path(__file__).parent / "pushing.md"
MARK = re.compile(r"<!-- followed pushes -->\n\n(?:\|.*\n)+")
SURFACES = {"exact surface": pf.LimitSurfaceExact, "ellipsoid": pf.LimitSurfaceEllipsoid}
BOARDS = {"hardboard": "feet on hardboard", "plywood": "feet on plywood", "flat": "flat face", "in time": "in time"}


def cell(values: np.ndarray, unit: float) -> str:
    """Mean with its 95 % interval, and the median."""
    drawn = drawings([str(i) for i in range(len(values))], 0)
    low, high = interval(mean(unit * values, drawn))
    return f"{unit * values.mean():.2f} ({low:.2f} to {high:.2f}), {unit * np.median(values):.2f}"


def table(measured: list[replayed_pushes.ReplayedPush]) -> str:
    """Rows of the page: one for each surface and kind of push."""
    lines = ["| pushes | number | limit surface | position [mm] | angle [deg] |", "|---|---|---|---|---|"]
    for board, words in BOARDS.items():
        some = [each for each in measured if each.board == board]
        found = {name: replayed_pushes.errors(some, make) for name, make in SURFACES.items()}
        found["it does not move"] = np.array([each.error(each.start) for each in some])
        for name, values in found.items():
            cells = cell(values[:, 0], 1e3), cell(values[:, 1], np.degrees(1.0))
            lines.append(f"| {words} | {len(some)} | {name} | {cells[0]} | {cells[1]} |")
    return "\n".join(lines) + "\n"


def picture(measured: list[replayed_pushes.ReplayedPush]) -> None:
    """A planned push, and a measured one with where it ends."""
    square = np.array([[-0.045, -0.045], [0.045, -0.045], [0.045, 0.045], [-0.045, 0.045]])
    slider = pf.planning.Slider(pf.LimitSurfaceExact(pf.ContactPatch.rectangle(0.09)), square)
    plan = pf.planning.plan_push(slider, pf.planning.Pusher(0.4), (0.25, 0.08, 0.6), edges=[3])
    figure = style.new_figure(9.6, 4.2)
    left, right = figure.subplots(1, 2)
    draw_push(left, plan.push)
    left.set_title("A planned push of a square", fontsize="medium")
    one = next(each for each in measured if each.name.endswith("3out_2 108"))
    draw_push(right, one.by(pf.LimitSurfaceExact, samples=101))
    closed = np.concatenate([one.outline, one.outline[:1]])
    for pose, colour, words in (
        (one.end, style.PALETTE[1], "measured end"),
        (one.by(pf.LimitSurfaceEllipsoid).end, style.ELLIPSOID, "end by the ellipsoid"),
    ):
        corners = pose[:2] + pf.geometry.rotate(closed, pose[2])
        right.plot(*(1e3 * corners.T), "--", color=colour, linewidth=1.2, zorder=6, label=words)
    right.legend(fontsize="small")
    right.set_title("A measured push, followed from its start", fontsize="medium")
    figure.savefig(Path(__file__).parent / "images" / "pushing.png", dpi=110)


def main() -> None:
    """Rewrite the page and the picture."""
    measured = replayed_pushes.single_pushes() + replayed_pushes.pushes_in_time()
    picture(measured)
    text = PAGE.read_text(encoding="utf-8")
    PAGE.write_text(MARK.sub(lambda _: f"<!-- followed pushes -->\n\n{table(measured)}", text), encoding="utf-8")


if __name__ == "__main__":
    main()
