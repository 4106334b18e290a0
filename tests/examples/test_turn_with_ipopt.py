"""The example of a plan by IPOPT ends where that of the library does."""

import shutil

import numpy as np
import pytest

import planarfriction as pf
from tests.support.repository import script

pytest.importorskip("casadi", reason="needs the extra [casadi]")
pytestmark = [
    pytest.mark.casadi,
    pytest.mark.skipif(shutil.which("gcc") is None, reason="needs gcc"),
]


def test_ipopt_and_the_library_turn_the_plate_alike():
    example = script("examples/turn_with_ipopt.py")
    plan, turned = example.main()
    ends = [pf.simulate(scene).data.isel(time=-1) for scene in (plan.scene, turned)]
    for end in ends:
        assert float(end.theta) == pytest.approx(example.GOAL, abs=np.radians(0.1))
    slides = [np.array([float(end.x), float(end.y)]) for end in ends]
    # 0.03 mm apart along the slide of 1.0 mm.
    assert np.abs(slides[0] - slides[1]).max() < 2e-4
