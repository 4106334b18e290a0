"""Films of cases: the worst body of every engine beside the others, as one animated SVG without scripts."""

from __future__ import annotations

import html
import math
from collections.abc import Sequence

import numpy as np

from planarfriction_studies.referee.case import Body, Case
from planarfriction_studies.referee.pictures import end, outline, side
from planarfriction_studies.referee.run import Verdict

COLUMNS, WIDTH, HEIGHT, TITLE = 4, 240.0, 150.0, 18.0
"""Panels of a row, and the sizes of a panel and its title [px]."""

SECONDS = 4.0
"""Duration of a film, of which the last quarter shows where bodies end."""


def film(case: Case, verdicts: Sequence[Verdict]) -> str:
    """Return an SVG in which each engine moves the body that it moves worst; dashed: where the truth says it ends."""
    shown = [each for each in verdicts if each.case == case.name and each.path]
    rows = math.ceil(len(shown) / COLUMNS)
    panels = "".join(
        _panel(case, each, WIDTH * (i % COLUMNS), (HEIGHT + TITLE) * (i // COLUMNS)) for i, each in enumerate(shown)
    )
    size = f'width="{COLUMNS * WIDTH:g}" height="{rows * (HEIGHT + TITLE):g}"'
    return f'<svg xmlns="http://www.w3.org/2000/svg" {size} font-family="sans-serif">{panels}</svg>\n'


def _panel(case: Case, verdict: Verdict, left: float, top: float) -> str:
    """Return the film of one engine, seen as the picture of the case."""
    body = next(each for each in case.moving if each.name == verdict.quantity.partition(" of ")[2])
    up, path, place = side(case), np.array(verdict.path), np.array(body.position)
    place = place[[0, up]]
    true = [outline(body, shape, up, *end(case, body)) for shape in body.shapes]
    own = [outline(body, shape, up) - place for shape in body.shapes]
    corners = np.concatenate([*true, *(each + place for each in own)])
    low, high = corners.min(0), corners.max(0)
    middle, span = 0.5 * (low + high), 1.6 * float(((high - low) / (WIDTH, HEIGHT)).max()) * np.array([WIDTH, HEIGHT])
    grey = "".join(_polygon(each, 'fill="#ddd" stroke="#999"') for each in _others(case, body, up))
    dashed = "".join(_polygon(each, 'fill="none" stroke="#c33" stroke-dasharray="4 3"') for each in true)
    moving = "".join(_polygon(each, 'fill="#48a" fill-opacity="0.6" stroke="#124"') for each in own)
    moving += _polygon(np.array([own[0].mean(0), own[0][0]]), 'stroke="#124"')  # a spoke, that shows how it turns
    name = f"{html.escape(verdict.engine)}: {verdict.mark}"
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
    place = np.array(body.position)[[0, up]] + path[:, :2] * (1.0, 1.0 if up == 1 else 0.0)
    turns = np.degrees(path[:, 2]) * (up == 1)
    times = ";".join(f"{0.75 * i / (len(path) - 1):.4g}" for i in range(len(path))) + ";1"
    goes, spins = (";".join([*values, values[-1]]) for values in (list(map(_pair, place)), [f"{t:.5g}" for t in turns]))
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
