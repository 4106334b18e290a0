"""A name is a text by which results can be reached: checked where it is given."""

import datetime
import math
import warnings

import numpy as np
import pytest

import planarfriction as pf
from planarfriction.cli import main
from planarfriction.errors import FrictionError, InvalidValueError
from tests.support.refusals import refused

SQUARE = pf.ContactPatch.rectangle(0.02, cells=3)
LAW = pf.LuGre()
NAMED = {
    "name of a contact": lambda name: pf.Contact(
        pf.DistributedModel(SQUARE, LAW), 1.0, name=name
    ),
    "name": lambda name: pf.Scene(
        pf.Body(1, 1), pf.Contact(pf.DistributedModel(SQUARE, LAW), 1.0), 1.0, name=name
    ),
    "name of a disc": lambda name: pf.ContactPatch.disc(0.01, 3, name=name),
    "name of a map": lambda name: pf.ContactPatch.from_pressure(
        np.ones((2, 2)), 0.01, name=name
    ),
}


@pytest.mark.parametrize("what", NAMED)
def test_what_is_no_name_is_refused(what):
    for name in (
        datetime.date(2024, 1, 1),
        math.nan,
        1,
        True,
        b"toe",
        ["toe"],
        np.array(["a", "b"]),
        "",
        " toe",
        "toe ",
    ):
        with refused(r"name.* must be a text that is not empty, is printable, and"):
            NAMED[what](name)
    for name in ("a\nb", "a\0", "\ud800", "\x1b[31m"):
        with pytest.raises(InvalidValueError, match="printable") as caught:
            NAMED[what](name)
        assert str(caught.value).isprintable()
    with refused("have at most 100 characters, got 101"):
        NAMED[what]("x" * 101)


def test_dates_in_scene_files_are_no_names(tmp_path):
    scene = pf.scenes.in_hand(pf.DistributedModel(SQUARE, LAW))
    scene.to_file(tmp_path / "scene.toml")
    text = (tmp_path / "scene.toml").read_text()
    for old in ('name = "fingers"', 'name = "in-hand"', 'name = "rectangle"'):
        (tmp_path / "other.toml").write_text(text.replace(old, "name = 2024-01-01"))
        with refused(
            r"other\.toml: .*name.* must be a text .* got datetime.date\(2024, 1, 1\)",
            FrictionError,
        ):
            pf.Scene.from_file(tmp_path / "other.toml")


def test_names_are_different():
    toe = pf.Contact(pf.DistributedModel(SQUARE, LAW), 1.0, name="toe")
    with refused("contacts must have different names, got 'toe' 2 times"):
        pf.Scene(pf.Body(1, 1), [toe, toe], 1.0)


ODD_NAMES = [
    "φ",
    "é",
    "日本",
    "a/b",
    "a b",
    "1",
    "x",
    "time",
    "contact",
    "cell_x",
    "%CF%86",
    'Finger "ü"',
    "a\\b",
    "a[0]",
]


def test_results_are_reached_by_any_name(tmp_path):
    reduced = pf.ReducedModel(SQUARE, LAW)
    distributed = pf.DistributedModel(SQUARE, LAW)
    models = [reduced if i % 2 else distributed for i in range(len(ODD_NAMES))]
    contacts = [
        pf.Contact(model, 1.0, name=name)
        for model, name in zip(models, ODD_NAMES, strict=True)
    ]
    scene = pf.Scene(pf.Body(1, 1), contacts, 0.02, name="φ")
    solution = pf.simulate(scene, bristles="all")
    again = pf.Solution.load(solution.save(tmp_path / "x.nc"))
    assert again == solution
    for name, model in zip(ODD_NAMES, models, strict=True):
        for data in (solution.data, again.data):
            assert data[f"bristles_{name}"].shape == (3, *model.state_shape)
            assert data.fx.sel(contact=name).shape == (3,)
    for suffix in (".toml", ".json"):
        scene.to_file(tmp_path / f"x{suffix}")
        assert pf.Scene.from_file(tmp_path / f"x{suffix}") == scene


def test_millimetres_at_the_command_line_are_one_line(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "pad.csv").write_text("1,2\n3,4\n")
    with warnings.catch_warnings():
        warnings.simplefilter("always")
        before = warnings.showwarning
        assert (
            main(
                [
                    "limit-surface",
                    "--patch",
                    "pad.csv",
                    "--cell-size",
                    "2",
                    "--csv",
                    "surface.csv",
                ]
            )
            == 0
        )
        assert warnings.showwarning is before
    said = [line for line in capsys.readouterr().err.splitlines() if "m wide" in line]
    assert said == [
        "warning: patch 'pad' is 4 m wide, larger than 1 m: are its lengths in metres?"
    ]
