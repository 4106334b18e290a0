"""Fits of the discs of pads are kept on disk, told to who watches, and end at Ctrl-C."""

import numpy as np
import pytest
import scipy.optimize

from planarfriction._engine.compiler.sources import Sources
from planarfriction.laws import LuGre
from planarfriction.models import ReducedModel, pad_discs
from planarfriction.pads import Pad
from planarfriction.patch import ContactPatch

LAW = LuGre(sigma_1=0.0, elasto_plastic=0.9)
PATCH = ContactPatch.rectangle(0.02, cells=6)
PAD = Pad.measured(4e3, 0.4)


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A folder that nothing is kept in yet."""
    monkeypatch.setattr("numba.core.config.CACHE_DIR", "")
    source = tmp_path / "source.py"
    source.touch()
    monkeypatch.setattr(pad_discs, "SOURCES", Sources(tmp_path, [source]))
    forget()
    yield tmp_path
    forget()


def forget():
    pad_discs._fitted.cache_clear()


@pytest.fixture
def fits(monkeypatch):
    """Fits that were made."""
    made = []
    fit = scipy.optimize.least_squares

    def counted(*arguments, **options):
        made.append(None)
        return fit(*arguments, **options)

    monkeypatch.setattr(scipy.optimize, "least_squares", counted)
    return made


def stiffness(pad=PAD, patch=PATCH):
    model = ReducedModel(patch, LAW, cells=4, pad=pad).reduction
    return model.pad.pieces(model.patch, LAW), model.pad.compliance(model.patch)


def test_equal_inputs_are_fitted_once(folder, fits):
    first = stiffness()
    assert len(fits) == 1
    forget()
    again = stiffness(Pad.measured(4e3, 0.4), ContactPatch.rectangle(0.02, cells=6))
    assert len(fits) == 1
    np.testing.assert_array_equal(first[0], again[0])
    np.testing.assert_array_equal(first[1], again[1])
    stiffness(Pad.measured(4e3, 0.5))
    stiffness(patch=ContactPatch.rectangle(0.02, 0.021, cells=6))
    assert len(fits) == 3


@pytest.mark.parametrize(
    "damage", [bytes.upper, lambda content: content[:-8], lambda _: b""]
)
def test_a_damaged_file_is_made_anew(folder, fits, damage):
    first = stiffness()
    (file,) = folder.rglob("*.numbers") or [None]
    whole = file.read_bytes()
    file.write_bytes(damage(whole[:-8] + b"abcdefgh"))
    forget()
    np.testing.assert_array_equal(first[0], stiffness()[0])
    assert len(fits) == 2
    assert file.read_bytes() == whole


def test_a_folder_that_cannot_be_written_is_no_obstacle(folder, fits, monkeypatch):
    def full(path):
        raise OSError("no space left on device")

    monkeypatch.setattr("planarfriction._engine.compiler.machine_code.replacing", full)
    first = stiffness()
    forget()
    np.testing.assert_array_equal(first[0], stiffness()[0])
    assert len(fits) == 2


def test_who_watches_sees_how_far_it_is(folder, monkeypatch, capsys):
    monkeypatch.setattr(pad_discs, "watched", lambda: True)
    stiffness()
    lines = capsys.readouterr().err.split("\r")
    assert lines[-1].isspace() and len(lines) > 5
    shares = [int(line.split(":")[1].split()[0]) for line in lines[1:-1]]
    assert shares == sorted(shares) and shares[0] >= 0 and shares[-1] <= 100
    forget()
    stiffness()
    assert not capsys.readouterr().err


def test_ctrl_c_ends_a_fit_and_leaves_nothing(folder, fits, monkeypatch):
    ends = pad_discs._ends

    def pressed(*arguments):
        raise KeyboardInterrupt

    monkeypatch.setattr(pad_discs, "_ends", pressed)
    with pytest.raises(KeyboardInterrupt):
        stiffness()
    assert not list(folder.rglob("*.numbers"))
    monkeypatch.setattr(pad_discs, "_ends", ends)
    stiffness()
    assert len(fits) == 1 and list(folder.rglob("*.numbers"))
