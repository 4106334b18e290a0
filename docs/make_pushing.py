"""Put the table of pushes that are followed into docs/measured.md, and draw one: `python docs/make_pushing.py`."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

import planarfriction as pf
from planarfriction.plots import style
from planarfriction.plots.planning import draw_push
from planarfriction_studies.measured import replayed_pushes
from planarfriction_studies.measured.scores import drawings, interval, mean

PAGE = Path(__file__).parent / "measured.md"
MARK = re.compile(r"<!-- followed pushes -->\n\n(?:\|.*\n)+")
SURFACES = {
    "exact surface": pf.LimitSurfaceExact,
    "ellipsoid": pf.LimitSurfaceEllipsoid,
}
BOARDS = {
    "hardboard": "feet on hardboard",
    "plywood": "feet on plywood",
    "flat": "flat face",
    "in time": "push trajectories",
}


def cell(values: np.ndarray) -> str:
    """Mean with its 95 % interval."""
    low, high = interval(
        mean(values, drawings([str(i) for i in range(len(values))], 0))
    )
    return f"{values.mean():.2f} [{low:.2f}, {high:.2f}]"


def table(measured: list[replayed_pushes.ReplayedPush]) -> str:
    """Rows of the page: one for each kind of push."""
    units = "[mm]", "[deg]"
    headings = [
        "pushes",
        "number",
        *(f"{name} {unit}" for unit in units for name in (*SURFACES, "no motion")),
    ]
    lines = [f"| {' | '.join(headings)} |", "|---" * len(headings) + "|"]
    for board, words in BOARDS.items():
        some = [each for each in measured if each.board == board]
        found = [replayed_pushes.errors(some, make) for make in SURFACES.values()]
        still = np.array([each.error(each.start) for each in some]).mean(axis=0)
        cells = []
        for column, factor in enumerate((1e3, np.degrees(1.0))):
            cells += [cell(factor * values[:, column]) for values in found]
            cells.append(f"{factor * still[column]:.2f}")
        lines.append(f"| {words} | {len(some)} | {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def picture(measured: list[replayed_pushes.ReplayedPush]) -> None:
    """A planned push, and a measured one with where it ends."""
    square = np.array(
        [[-0.045, -0.045], [0.045, -0.045], [0.045, 0.045], [-0.045, 0.045]]
    )
    slider = pf.planning.Slider(
        pf.LimitSurfaceExact(pf.ContactPatch.rectangle(0.09)), square
    )
    plan = pf.planning.plan_push(
        slider, pf.planning.Pusher(0.4), (0.25, 0.08, 0.6), edges=[3]
    )
    one = next(each for each in measured if each.name.endswith("3out_2 108"))
    with style.paper():
        figure = style.new_figure(style.PAGE, 3.6)
        left, right = figure.subplots(1, 2)
        draw_push(left, plan.push)
        draw_push(right, one.by(pf.LimitSurfaceExact, samples=101))
        closed = np.concatenate([one.outline, one.outline[:1]])
        for pose, colour, words, look in (
            (one.end, style.MEASURED, "measured end", {"lw": 4.0, "zorder": 2}),
            (
                one.by(pf.LimitSurfaceEllipsoid).end,
                style.ELLIPSOID,
                "end by the ellipsoid",
                {"lw": 1.3, "zorder": 6, "ls": style.LINES[style.ELLIPSOID]},
            ),
        ):
            corners = 1e3 * (pose[:2] + pf.geometry.rotate(closed, pose[2]))
            right.plot(*corners.T, color=colour, label=words, **look)
        for axes, title in (
            (left, "planned push of a square"),
            (right, "measured push, predicted from its start"),
        ):
            place = {"loc": "upper center", "bbox_to_anchor": (0.5, -0.2), "ncols": 2}
            axes.legend(**place, frameon=False)
            axes.set_title(title, loc="left")
        figure.savefig(Path(__file__).parent / "images" / "pushing.png", dpi=160)


def main() -> None:
    """Rewrite the page and the picture."""
    measured = replayed_pushes.single_pushes() + replayed_pushes.pushes_in_time()
    picture(measured)
    text = PAGE.read_text(encoding="utf-8")
    PAGE.write_text(
        MARK.sub(lambda _: f"<!-- followed pushes -->\n\n{table(measured)}", text),
        encoding="utf-8",
    )


if __name__ == "__main__":
    main()
