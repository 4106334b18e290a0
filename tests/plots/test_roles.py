"""Roles in pictures: those of the pages have the colours of what they show, and PDFs are small."""

import io
from pathlib import Path

import numpy as np
import pytest
from matplotlib.colors import to_rgb
from PIL import Image

import planarfriction as pf
from planarfriction import plots
from planarfriction.plots import limit_surface, style
from tests.support import synthetic
from tests.support.repository import script

IMAGES = Path(__file__).parents[2] / "docs" / "images"

SHOWN = {
    "beside-mujoco.gif": (style.REDUCED, style.BUILT_IN),
    "breakaway.png": (*style.SHADES, style.DISTRIBUTED, style.PUBLISHED),
    "concept-bristle.png": (style.REDUCED,),
    "concept-motions.png": (style.REDUCED, style.REFERENCE, style.BODY),
    "correspondence.png": (style.REFERENCE, style.ELLIPSOID),
    "discs.png": (style.REDUCED, style.BODY),
    "driven-errors.png": (style.PUBLISHED, style.ELLIPSOID, style.MEASURED),
    "grip-plan.png": (style.REDUCED, *style.SHADES[1::2]),
    "in-hand-histories.png": (style.REDUCED, style.DISTRIBUTED),
    "joint.png": (style.MEASURED, style.BUILT_IN, style.REDUCED),
    "joint-holds.png": (style.BUILT_IN, style.REDUCED),
    "joint-torque.png": (style.MEASURED, style.BUILT_IN, style.REDUCED),
    "ladder.png": (style.REDUCED, style.DISTRIBUTED, style.PUBLISHED),
    "limit-surface.png": (style.REFERENCE, style.ELLIPSOID, style.PUBLISHED),
    "measured-slides.png": (style.REDUCED, style.DISTRIBUTED, style.ELLIPSOID),
    "measured-slides-paths.png": (style.MEASURED, style.ELLIPSOID, style.REDUCED),
    "measured-pushes.png": (style.MEASURED, style.ELLIPSOID, style.DISTRIBUTED),
    "pre-sliding-cycles.png": (style.REDUCED, style.PUBLISHED),
    "pushing.png": (style.MEASURED, style.ELLIPSOID, style.SLIPS),
    "slip.png": (style.STICKS, style.SLIPS, style.REDUCED),
    "slip.gif": (style.SLIPS, style.REDUCED),
    "timing-work-precision.png": (style.REDUCED,),
}
"""Picture of the pages -> roles that its figure shows."""

NEAR = 12
"""Largest difference of each of red, green and blue that a palette of 128 colours may make."""

LEAST = 12
"""Pixels of a role: fewer than a small marker has."""

LARGEST = 100_000
"""Largest PDF [bytes]: a page of a paper holds several."""


def pixels(picture, colour):
    """Return the number of pixels of a picture that have a colour."""
    wanted = np.round(255.0 * np.array(to_rgb(colour)))
    off = np.abs(np.asarray(picture.convert("RGB"), dtype=int) - wanted)
    return int((off.max(axis=-1) <= NEAR).sum())


@pytest.mark.parametrize("name", SHOWN)
def test_pictures_of_the_pages_have_the_colours_of_their_roles(name):
    if not IMAGES.is_dir():
        pytest.skip("no docs beside these tests")
    with Image.open(IMAGES / name) as picture:
        found = {colour: pixels(picture, colour) for colour in SHOWN[name]}
    assert min(found.values()) >= LEAST, found


def test_few_colours_keep_small_marks():
    """A marker of 25 pixels of the published model beside shades of all others: the median cut repaints it."""
    if not IMAGES.is_dir():
        pytest.skip("no docs beside these tests")
    share = np.linspace(0.0, 1.0, 256)[:, None]
    others = (style.REDUCED, style.SLIPS, style.ELLIPSOID, style.BUILT_IN, "black")
    rows = [share * to_rgb(each) + 1.0 - share for each in others]
    shade = np.repeat(rows, 40, axis=0)
    shade[100:105, 100:105] = to_rgb(style.PUBLISHED)
    picture = Image.fromarray(np.round(255.0 * shade).astype(np.uint8))
    few = script("docs/make_tables.py").few_colours(picture)
    assert pixels(few, style.PUBLISHED) == 25


FIGURES = {
    "patch": lambda: plots.plot_patch(pf.ContactPatch.rectangle(0.02, cells=40)),
    "limit surface": lambda: plots.plot_limit_surface(
        pf.LimitSurfaceEllipsoid(pf.ContactPatch.disc(0.01, 5))
    ),
    "sections": lambda: plots.plot_sections(
        pf.LimitSurfaceEllipsoid(pf.ContactPatch.disc(0.01, 15)), beside=None
    ),
    "solution": lambda: plots.plot_solution(synthetic.solution()),
}


@pytest.mark.parametrize("name", FIGURES)
def test_pdfs_are_small(name, monkeypatch):
    # The mesh is drawn as an image, whose size hardly depends on it.
    monkeypatch.setattr(limit_surface, "POLAR_SEGMENTS", 24)
    monkeypatch.setattr(limit_surface, "AZIMUTH_SEGMENTS", 48)
    buffer = io.BytesIO()
    FIGURES[name]().savefig(buffer, format="pdf")
    assert len(buffer.getvalue()) <= LARGEST
