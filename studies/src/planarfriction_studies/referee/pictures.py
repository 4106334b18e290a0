"""Pictures of cases: what bodies do, and the worst body of every engine beside the others, as one animated SVG."""

from __future__ import annotations

import html
import math
from collections.abc import Sequence

import numpy as np

from planarfriction.plots.style import (
    BODY,
    HOLDS,
    PAD,
    REFERENCE,
    PlotFigure,
    new_figure,
    tidy,
)
from planarfriction_studies.referee.case import Body, Case, Shape
from planarfriction_studies.referee.run import Verdict

INCHES = 6.0
"""Width of a picture [in]."""

ARROW = 0.18
"""Length of the longest arrow over the size of what is drawn."""


def scene(case: Case) -> PlotFigure:
    """Draw a case from above, or from the side where bodies lie on each other; dashed: where bodies end."""
    from matplotlib.patches import Polygon

    up = side(case)
    drawn = [
        (outline(body, shape, up), body)
        for body in case.bodies
        for shape in body.shapes
        if shape.kind != "plane"
    ]
    ends = [
        (outline(body, shape, up, *end(case, body)), body)
        for body in case.moving
        for shape in body.shapes
    ]
    corners = np.concatenate([corners for corners, _ in (*drawn, *ends)])
    low = corners.min(0)
    high = corners.max(0)
    size = float((high - low).max())
    margin = np.full(2, 0.22 * size)
    width, height = high - low + 2.0 * margin
    figure = new_figure(INCHES, min(max(INCHES * height / width, 1.6), 7.0) + 0.5)
    axes = figure.subplots()
    for corners, body in sorted(drawn, key=lambda each: _height(each[1], up)):
        fixed = body.joint == "fixed"
        fill = PAD if fixed else BODY if body.joint == "free" else HOLDS
        axes.add_patch(
            Polygon(1e3 * corners, facecolor=fill, edgecolor="0.2", alpha=0.6)
        )
    for corners, body in ends:
        if any(end(case, body)):
            axes.add_patch(
                Polygon(1e3 * corners, fill=False, edgecolor=REFERENCE, linestyle="--")
            )
    _arrows(axes, case, up, size)
    names = "x", "z" if up == 2 else "y"
    axes.set(xlabel=f"{names[0]} [mm]", ylabel=f"{names[1]} [mm]", aspect="equal")
    axes.set_xlim(*(1e3 * np.array([low[0] - margin[0], high[0] + margin[0]])))
    axes.set_ylim(*(1e3 * np.array([low[1] - margin[1], high[1] + margin[1]])))
    tidy(axes)
    return figure


def side(case: Case) -> int:
    """Return the axis that points up in pictures: y from above, z (2) where bodies lie on each other."""
    places = [tuple(body.position[:2]) for body in case.moving if body.joint == "free"]
    return 2 if len(set(places)) < len(places) else 1


def _height(body: Body, up: int) -> float:
    return body.position[2] if up == 1 else 0.0


def end(case: Case, body: Body) -> tuple[float, float, float]:
    """Return the true displacement and turn of a body; 0 where nothing is known."""
    known = {
        truth.quantity: truth.value for truth in case.truths if truth.body == body.name
    }
    return known.get("x", 0.0), known.get("y", 0.0), known.get("turn", 0.0)


def outline(
    body: Body, shape: Shape, up: int, x: float = 0.0, y: float = 0.0, turn: float = 0.0
) -> np.ndarray:
    """Return the corners `[n, 2]` of a shape from above (up 1) or from the side (up 2) [m]."""
    half = shape.half[[0, up]]
    if (
        shape.kind == "box"
        or (up == 2 and shape.kind == "cylinder")
        or shape.kind == "capsule"
    ):
        around = half * [(-1, -1), (1, -1), (1, 1), (-1, 1)]
    else:
        angles = np.linspace(0.0, 2.0 * math.pi, 40)
        around = half * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    c = math.cos(turn)
    s = math.sin(turn)
    turned = (around + np.array(shape.position)[[0, up]]) @ np.array([[c, s], [-s, c]])
    return turned + np.array(body.position)[[0, up]] + [x, y if up == 1 else 0.0]


def _arrows(axes, case: Case, up: int, size: float) -> None:
    """Draw velocities, and the largest force of each row of forces; and gravity where it lies in the picture."""
    throws = [
        (np.array(body.position), np.array(body.velocity[:3]), "0.25")
        for body in case.moving
    ]
    of = {body.name: body for body in case.moving}
    pushes = []
    for force in case.forces:
        body = of[force.body]
        rows = np.array([*force.values, force.amplitude])[:, :3]
        at = body.centre_of_mass if force.at is None else force.at
        largest = rows[np.argmax(np.linalg.norm(rows[:, [0, up]], axis=1))]
        pushes.append((np.array(body.position) + at, largest, "0.55"))
    for arrows in (throws, pushes):
        lengths = [float(np.hypot(*vector[[0, up]])) for _, vector, _ in arrows]
        for (place, vector, colour), length in zip(arrows, lengths, strict=True):
            if length > 0.0:
                start = 1e3 * place[[0, up]]
                end = start + 1e3 * ARROW * size * vector[[0, up]] / max(lengths)
                axes.annotate(
                    "",
                    end,
                    start,
                    arrowprops={"arrowstyle": "->", "color": colour, "linewidth": 2.0},
                )
    if up == 1 and case.gravity[1]:
        axes.annotate(
            "g", (0.97, 0.04), (0.97, 0.22), xycoords="axes fraction", ha="center",
            arrowprops={"arrowstyle": "->", "color": "0.4"}, color="0.4",
        )  # fmt: skip


COLUMNS, WIDTH, HEIGHT, TITLE = 4, 240.0, 150.0, 18.0
"""Panels of a row, and the sizes of a panel and its title [px]."""

SECONDS = 4.0
"""Duration of a film, of which the last quarter shows where bodies end."""


def film(case: Case, verdicts: Sequence[Verdict]) -> str:
    """Return an SVG in which each engine moves the body that it moves worst; dashed: where the truth says it ends."""
    shown = [each for each in verdicts if each.case == case.name and each.path]
    rows = math.ceil(len(shown) / COLUMNS)
    panels = "".join(
        _panel(case, each, WIDTH * (i % COLUMNS), (HEIGHT + TITLE) * (i // COLUMNS))
        for i, each in enumerate(shown)
    )
    size = f'width="{COLUMNS * WIDTH:g}" height="{rows * (HEIGHT + TITLE):g}"'
    return f'<svg xmlns="http://www.w3.org/2000/svg" {size} font-family="sans-serif">{panels}</svg>\n'


def _panel(case: Case, verdict: Verdict, left: float, top: float) -> str:
    """Return the film of one engine, seen as the picture of the case."""
    body = next(
        each
        for each in case.moving
        if each.name == verdict.quantity.partition(" of ")[2]
    )
    up = side(case)
    path = np.array(verdict.path)
    place = np.array(body.position)
    place = place[[0, up]]
    true = [outline(body, shape, up, *end(case, body)) for shape in body.shapes]
    own = [outline(body, shape, up) - place for shape in body.shapes]
    corners = np.concatenate([*true, *(each + place for each in own)])
    low = corners.min(0)
    high = corners.max(0)
    middle = 0.5 * (low + high)
    span = (
        1.6 * float(((high - low) / (WIDTH, HEIGHT)).max()) * np.array([WIDTH, HEIGHT])
    )
    grey = "".join(
        _polygon(each, 'fill="#ddd" stroke="#999"') for each in _others(case, body, up)
    )
    dashed = "".join(
        _polygon(each, 'fill="none" stroke="#c33" stroke-dasharray="4 3"')
        for each in true
    )
    moving = "".join(
        _polygon(each, 'fill="#48a" fill-opacity="0.6" stroke="#124"') for each in own
    )
    # A spoke, that shows how it turns.
    moving += _polygon(np.array([own[0].mean(0), own[0][0]]), 'stroke="#124"')
    name = html.escape(f"{verdict.engine}: {verdict.mark}")
    return f"""<text x="{left + 4:g}" y="{top + 13:g}" font-size="12">{name}</text>
<svg x="{left:g}" y="{top + TITLE:g}" width="{WIDTH - 6:g}" height="{HEIGHT - 4:g}" viewBox="{_view(span)}">
<rect x="{-span[0]:g}" y="{-span[1]:g}" width="200%" height="200%" fill="#f6f6f6"/><g transform="scale(1 -1)">
<g transform="translate({_pair(-middle)})">{grey}{dashed}{_moved(body, path, up, moving)}</g></g></svg>
"""


def _others(case: Case, body: Body, up: int) -> list[np.ndarray]:
    return [
        outline(other, shape, up)
        for other in case.bodies
        for shape in other.shapes
        if other is not body and shape.kind != "plane"
    ]


def _moved(body: Body, path: np.ndarray, up: int, inner: str) -> str:
    """Return a group that goes along displacements and turns `[frames, 3]` [m, m, rad]."""
    place = np.array(body.position)[[0, up]] + path[:, :2] * (
        1.0,
        1.0 if up == 1 else 0.0,
    )
    turns = np.degrees(path[:, 2]) * (up == 1)
    times = (
        ";".join(f"{0.75 * i / (len(path) - 1):.4g}" for i in range(len(path))) + ";1"
    )
    goes, spins = (
        ";".join([*values, values[-1]])
        for values in (list(map(_pair, place)), [f"{t:.5g}" for t in turns])
    )
    much = f'dur="{SECONDS:g}s" repeatCount="indefinite" keyTimes="{times}"'
    go = f'<animateTransform attributeName="transform" type="translate" values="{goes}" {much}/>'
    spin = f'<animateTransform attributeName="transform" type="rotate" values="{spins}" {much}/>'
    return f'<g transform="translate({_pair(place[0])})">{go}<g>{spin}{inner}</g></g>'


def _polygon(corners: np.ndarray, style: str) -> str:
    points = " ".join(map(_pair, corners))
    return f'<polygon points="{points}" vector-effect="non-scaling-stroke" {style}/>'


def _pair(values: np.ndarray) -> str:
    return f"{values[0]:.5g},{values[1]:.5g}"


def _view(span: np.ndarray) -> str:
    return f"{-0.5 * span[0]:.5g} {-0.5 * span[1]:.5g} {span[0]:.5g} {span[1]:.5g}"
