"""The example that identifies slides, on slides that the library itself made."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path

import numpy as np
import pytest

import planarfriction as pf
from planarfriction.errors import InvalidValueError
from planarfriction.identify import Slide, SlidingBody, fit_start
from test_measured_slides import MU, slides

SCRIPT = Path(__file__).parents[1] / "examples" / "identify_slides.py"


@pytest.fixture(scope="module")
def example():
    """The script as a module."""
    sys.path.insert(0, str(SCRIPT.parent))
    spec = importlib.util.spec_from_file_location(SCRIPT.stem, SCRIPT)
    module = importlib.util.module_from_spec(spec)
    sys.modules[SCRIPT.stem] = module
    spec.loader.exec_module(module)
    yield module
    sys.path.remove(str(SCRIPT.parent))
    del sys.modules[SCRIPT.stem]


def test_friction_radius_and_ends_come_out(example, tmp_path, monkeypatch, capsys):
    """Slides of a uniform square: its friction and radius, ends within 1 mm, and a picture."""
    path = tmp_path / "slides.csv"
    slides(6).to_csv(path, index=False)
    case = example.Case("square", example.SQUARE, pf.DistributedModel, ("mu_c", "contact_radius"))
    tosses = [example.as_slide(toss) for toss in example.read_tosses(path)][1:]  # the first does not stop
    rows = example.run(tosses[:4], tosses[4:], [case], 0)
    told = dict(part.split(" ± ")[0].split(" ") for part in rows[0][3].split(", "))
    assert float(told["mu_c"]) == pytest.approx(MU, rel=5e-3)  # bristles start relaxed: 1e-3 of the way
    assert float(told["contact_radius"]) == pytest.approx(example.SQUARE.contact_radius(), rel=2e-2)
    assert all(float(row[4]) < 1.0 for row in rows)
    monkeypatch.setattr(example, "CASES", (example.CASES[0],))
    assert example.main([str(path), "--tosses", "4", "--out", str(tmp_path / "out")]) == 0
    assert "square, mu alone" in capsys.readouterr().out
    assert (tmp_path / "out" / "identify_slides.png").read_bytes().startswith(b"\x89PNG")


def test_a_missing_file_is_one_line(example, capsys):
    assert example.main(["none.csv"]) == 2
    assert capsys.readouterr().err == "error: none.csv: no such file\n"


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"body": 0.2}, "body must be a SlidingBody, got 0.2"),
        ({"slide": [1.0]}, "slide must be a Slide"),
        ({"noise": 0.1}, r"noise must have shape \[3\]"),
        ({"noise": (1e-3, 1e-3, 0.0)}, "noise must be > 0"),
        ({"samples": 5.5}, "samples must be an integer >= 5"),
    ],
)
def test_what_cannot_be_fitted_is_named_in_one_line(changes, message):
    time = np.linspace(0.0, 0.1, 11)
    legal = {"body": SlidingBody(0.2, 1e-4), "slide": Slide(time, np.outer(0.1 * time, [1.0, 0.0, 0.0]))}
    with pytest.raises(InvalidValueError, match=message):
        fit_start(None, **{**legal, **changes})
