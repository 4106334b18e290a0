"""Sections of limit surfaces: closed forms, gaps, what is drawn and what is refused."""

import numpy as np
import pytest

import planarfriction as pf
from planarfriction import plots
from planarfriction.plots import style
from planarfriction.plots.sections import farthest, sections
from tests.support.refusals import refused

TWO = pf.ContactPatch.points([(-0.01, 0.0), (0.01, 0.0)], name="two points")
CHORD = 1e-3
"""Largest distance of a chord of 3 degrees from the unit circle, 1 - cos(1.5 degrees), with a margin."""


def test_sections_have_their_closed_forms_all_around():
    """An ellipsoid is a unit sphere; two points hold |fy| + |tau| / r = 1, as each holds half of the load."""
    for cut in sections(pf.LimitSurfaceEllipsoid(TWO)):
        assert np.hypot(*cut.T) == pytest.approx(np.ones(len(cut)), abs=CHORD)
        angles = np.unwrap(np.arctan2(cut[:, 1], cut[:, 0]))
        assert np.diff(angles).max() < np.radians(4.0)
        assert np.ptp(angles) == pytest.approx(2.0 * np.pi, abs=1e-9)
    *_, diamond = sections(pf.LimitSurfaceExact(TWO))
    assert np.abs(diamond).sum(1) == pytest.approx(np.ones(len(diamond)), abs=CHORD)
    circle = sections(pf.LimitSurfaceEllipsoid(TWO))[2]
    # The diamond is 1 / sqrt(2) wide on its diagonal.
    assert farthest(circle, diamond) == pytest.approx(np.sqrt(2.0) - 1.0, abs=CHORD)


def test_sections_are_drawn_in_the_colours_of_their_surfaces():
    exact = pf.LimitSurfaceExact(TWO)
    cells = pf.LimitSurfaceCells(TWO)
    figure = plots.plot_sections(exact, beside=["ellipsoid", cells], size=(3.5, 1.55))
    for axes in figure.axes:
        colours = [line.get_color() for line in axes.get_lines()[:3]]
        assert colours == [style.REFERENCE, style.ELLIPSOID, style.DISTRIBUTED]
    said = [axes.get_title() for axes in figure.axes]
    assert said == ["the same", "the same", "up to 41 % off"]
    (legend,) = figure.legends
    words = [each.get_text() for each in legend.get_texts()]
    assert words == ["two points, exact", "ellipsoid", "sum over the cells"]
    assert min(each.get_size() for each in legend.get_texts()) >= 7.0


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda it: plots.plot_sections(5), "surface must be a limit surface, got 5"),
        (
            lambda it: plots.plot_sections(it, beside="table"),
            'beside must be a limit surface, "ellipsoid", a list of these, or None',
        ),
        (
            lambda it: plots.plot_sections(it, beside=[it, 3]),
            'beside must be a limit surface, "ellipsoid", a list of these, or None',
        ),
        (lambda it: plots.plot_sections(it, size=2.0), "size must have shape"),
    ],
)
def test_what_has_no_sections_is_named_in_one_line(call, message):
    with refused(message):
        call(pf.LimitSurfaceEllipsoid(TWO))
