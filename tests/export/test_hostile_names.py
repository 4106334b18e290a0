"""Names that are text of a stranger: they become no code of theirs, whatever they are written into."""

from __future__ import annotations

import dataclasses
import re
from html.parser import HTMLParser
from xml.etree import ElementTree

import pytest

import planarfriction as pf
from planarfriction.export.pieces import pieces_of
from planarfriction_studies.referee.case import all_cases
from planarfriction_studies.referee.export import mjcf, sdf
from planarfriction_studies.referee.report import page

HOSTILE = """*/ int pad; /* "><script>alert('x')</script> {{ 1 }} \\" & %s"""
PATCH = dataclasses.replace(pf.ContactPatch.disc(0.01, cells=5), name=HOSTILE)
LAW = pf.LuGre(mu_s=1.2)


class Tags(HTMLParser):
    """Names of the tags and of the attributes of a page."""

    def __init__(self, text):
        super().__init__()
        self.names: set[str] = set()
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.names |= {tag, *(name for name, _ in attrs)}


def hostile_case():
    """Return a case of the package in which everything has a hostile name."""
    case = next(each for each in all_cases().values() if sdf(each, 1e-3))
    names = {
        name: f"{name}{HOSTILE}"
        for name in (*case.shapes, *(body.name for body in case.bodies))
    }
    bodies = tuple(
        dataclasses.replace(
            body,
            name=names[body.name],
            shapes=[
                dataclasses.replace(shape, name=names[shape.name])
                for shape in body.shapes
            ],
        )
        for body in case.bodies
    )
    contacts = [
        dataclasses.replace(each, pair=tuple(names[name] for name in each.pair))
        for each in case.contacts
    ]
    return dataclasses.replace(
        case, name=HOSTILE, title=HOSTILE, bodies=bodies, contacts=contacts
    )


def test_c(tmp_path):
    """Comments of C end where they should, in each file."""
    model = pf.ReducedModelPublished(
        PATCH, LAW, surface=pf.LimitSurfaceEllipsoid(PATCH)
    )
    for file in pf.export_c(model, tmp_path, casadi=True):
        code = re.sub(r"/\*.*?\*/|#[^\n]*", "", file.read_text(), flags=re.DOTALL)
        assert "pad" not in code and "alert" not in code and "*/" not in code


def test_warp():
    """No name stands in the source at all."""
    source = pytest.importorskip(
        "planarfriction.warp.source", reason="needs the extra [warp]"
    )
    pieces = pieces_of(pf.ReducedModel(PATCH, LAW), "float")
    texts = [
        source.source_of(pieces, "float"),
        source.coupled_source_of([pieces], [0], [True], [0.01], "float"),
    ]
    assert not any("alert" in each.text for each in texts)


@pytest.mark.parametrize("write", [mjcf, sdf])
def test_mjcf_and_sdf(write):
    case = hostile_case()
    root = ElementTree.fromstring(write(case, 1e-3))
    names = {value for element in root.iter() for value in element.attrib.values()}
    assert {case.name, *case.shapes, *(body.name for body in case.bodies)} <= names | {
        case.name
    }
    assert not {element.tag for element in root.iter()} & {"script"}


def test_pages():
    """Pages of patches, laws and models in notebooks, and that of the referee."""
    model = pf.ReducedModel(PATCH, LAW)
    texts = [
        each._repr_html_()
        for each in (PATCH, LAW, model, pf.LimitSurfaceEllipsoid(PATCH))
    ]
    case = hostile_case()
    run = {
        "date": HOSTILE,
        "machine": HOSTILE,
        "versions": {HOSTILE: HOSTILE},
        "settings": {HOSTILE: HOSTILE},
    }
    texts.append(page([], {HOSTILE: case}, run))
    assert any("alert" in each for each in texts)
    for text in texts:
        assert (
            not Tags(text).names & {"script", "onmouseover"} and "<script" not in text
        )
