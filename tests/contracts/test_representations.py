"""Records at the prompt and in notebooks: one short line, or a picture with a few numbers."""

from __future__ import annotations

import base64
import dataclasses
import io
import re

import numpy as np
import pytest
from PIL import Image

import planarfriction as pf
from planarfriction._support.equality import ByValue, by_parts

DISC = pf.ContactPatch.disc(radius=0.01, cells=9)
LAW = pf.LuGre(mu_s=1.2)
SOFT = pf.ContactPatch.disc(0.01, 9, pressure=pf.SoftFinger(c=0.0085, n=1 / 3, k=2.0))


@pytest.fixture(scope="module")
def solution():
    return pf.simulate(
        pf.scenes.in_hand(pf.ReducedModelPublished(DISC, LAW)), t_end=0.02
    )


def test_records_are_one_short_and_telling_line(solution):
    model = pf.ReducedModel(DISC, LAW, cells=16)
    assert (
        repr(model)
        == "ReducedModel('disc' of 77 cells, LuGre(mu_c=1, mu_s=1.2, ...), cells=16)"
    )
    assert (
        repr(pf.LimitSurfaceExact(SOFT, normal_force=2.0))
        == "LimitSurfaceExact('disc' of 77 cells, normal_force=2.0)"
    )
    assert repr(pf.solvers.RODAS3) == "Method(RODAS3, order 3, 4 stages)"
    grip = pf.Signal.sampled([0.0, 1.0], [1.0, 2.5])
    contact = pf.Contact(
        pf.DistributedModel(DISC, pf.Dahl(0.5)), grip, count=2, name="pads"
    )
    line = "Contact('pads': 2 x DistributedModel('disc' of 77 cells, Dahl(mu_c=0.5, ...)) on the world, 1 to 2.5 N)"
    assert repr(contact) == line
    scene = pf.Scene(pf.Body(0.5, 2e-4), contact, 0.1, name="grip")
    assert repr(scene) == f"Scene('grip': 0.1 s, body of 0.5 kg, 0.0002 kg m^2; {line})"
    assert repr(solution).startswith(
        "Solution('in-hand', success: 3 samples to t=0.02 s, x="
    )
    assert re.search(r", \d+ steps in [\d.]+ ms\)$", repr(solution))
    for each in (
        model,
        contact,
        scene,
        solution,
        solution.statistics,
        SOFT,
        pf.solvers.RODAS4,
    ):
        assert len(repr(each)) < 250 and "\n" not in repr(each)


def test_large_parts_of_a_record_are_shown_by_their_size():
    @dataclasses.dataclass(frozen=True, eq=False)
    class Record(ByValue):
        short: np.ndarray
        long: np.ndarray
        hidden: int = dataclasses.field(default=0, repr=False)

    class Pair(pf.derivatives.Rollout):
        pass

    for long, shown in (
        (np.ones((40, 3)), "[40, 3]"),
        (np.ones((2, 2)), "[2, 2]"),
        (np.ones(20), "[20]"),
    ):
        assert repr(Record(np.ones(2), long)).endswith(
            f"Record(short=[1., 1.], long=array {shown})"
        )
    assert (
        repr(Pair(np.ones(3), np.ones((40, 3))))
        == "Pair(state=[1., 1., 1.], wrenches=array [40, 3])"
    )
    assert (
        repr(
            by_parts(
                type("One", (tuple,), {"_asdict": lambda self: {"a": list(range(12))}})
            )()
        )
        == "One(a=list of 12)"
    )


def pictures(page):
    found = re.findall(r"data:image/png;base64,([^\"]+)", page)
    return [Image.open(io.BytesIO(base64.b64decode(each))) for each in found]


def test_notebooks_show_a_patch_with_its_pressure():
    patch = pf.ContactPatch.from_pressure(
        np.array([[9.0, 0.0], [1.0, 1.0]]), 1e-3, name="<b>"
    )
    shown = patch._repr_html_()
    (picture,) = pictures(shown)
    assert "&lt;b&gt;" in shown and "<b><b>" not in shown
    assert "2 x 2 mm" in shown and "(-0.41, 0.32) mm" in shown
    pixels = np.asarray(picture.convert("RGB"), dtype=float)
    height, width, _ = pixels.shape
    corner = {
        (r, c): pixels[int(height * r), int(width * c)]
        for r in (0.3, 0.7)
        for c in (0.3, 0.7)
    }
    # Row 0 is the top, and the most loaded is darkest.
    assert corner[0.3, 0.3].sum() < corner[0.7, 0.7].sum() - 100
    assert np.abs(corner[0.7, 0.3] - corner[0.7, 0.7]).max() < 2.0
    assert corner[0.3, 0.7].min() > 250  # no load, no colour


def test_dir_lists_what_is_public_and_nothing_else():
    listed = dir(pf)
    assert set(listed) == {*pf.__all__, "__version__"} and len(listed) == len(
        set(listed)
    )
    assert all(hasattr(pf, name) for name in listed)
