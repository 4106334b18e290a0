"""`planarfriction hold`: force, safety factor and picture; patches and lengths with units."""

import numpy as np
import pytest

from planarfriction.cli import main, options
from tests.support.refusals import refused

PART = [
    "hold",
    "--mass",
    "0.3",
    "--pad",
    "12x20mm",
    "--offset",
    "60mm",
    "--mu",
    "0.8",
    "--acceleration",
    "3",
]


def test_the_force_the_factor_of_a_grip_and_a_picture(tmp_path, capsys):
    picture = tmp_path / "hold.pdf"
    assert main([*PART, "--grip", "30", "--margin", "0.25", "--out", str(picture)]) == 0
    out = capsys.readouterr().out
    for words in ("17.8", "23.3", "29.1", "1.29: holds", "along +y, 5° towards"):
        assert words in out
    assert picture.read_bytes().startswith(b"%PDF")
    assert picture.stat().st_size < 100_000


@pytest.mark.parametrize(
    ("more", "words"),
    [
        (["--pad", "12x20in"], "patch must be a length such as 60mm, 6cm or 0.06"),
        (["--pad", "12mm"], "patch must have two sides such as 12x20mm"),
        (["--pad", "12y20"], "patch must have two sides such as 12x20mm"),
        (["--pad", "12.5y20mm"], "patch must have two sides such as 12x20mm"),
        (["--offset", "1mm,"], "--offset must be a length"),
        (["--width", "20mm"], "--width must be given only for a pressure map"),
        (["--out", "hold.txt"], "a picture ends in .png or .pdf or .svg"),
    ],
)
def test_a_mistake_is_one_line(more, words, capsys):
    assert main([*PART, *more]) == 2
    error = capsys.readouterr().err
    assert error.startswith("error: ") and words in error
    assert error.count("\n") == 1


@pytest.mark.parametrize(
    "text", ["12x20mm", "12mmx20mm", "0.012x0.02", "1.2cm x 20mm", "12X20MM".lower()]
)
def test_a_patch_of_two_sides(text):
    patch = options.find_patch(text, {})
    assert patch.name == text
    assert np.ptp(patch.positions, axis=0) == pytest.approx(
        [0.012 * 12 / 13, 0.02 * 20 / 21]
    )


def test_lengths_have_units():
    lengths = {"60mm": 0.06, "6 cm": 0.06, "0.02": 0.02, "-5mm": -0.005, "2e4um": 0.02}
    for text, metres in lengths.items():
        assert options.parse_length("--width", text) == pytest.approx(metres)
    with refused("--width must be a length"):
        options.parse_length("--width", "60 inch")
