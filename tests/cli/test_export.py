"""`planarfriction export`: files of models and of scenes as C source."""

import pytest

import planarfriction as pf
from planarfriction.cli import main

MODEL = """model = "reduced-published"
patch = {shape = "disc", radius = 0.01, cells = 5}
law = {mu_c = 0.7}
"""


@pytest.fixture(autouse=True)
def files(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "model.toml").write_text(MODEL)
    disc = pf.ContactPatch.disc(0.01, 5)
    one, other = (
        pf.ReducedModelPublished(disc, pf.LuGre(mu_c=mu)) for mu in (0.7, 0.5)
    )
    for name, second in (("same", one), ("scene", other)):
        contacts = [
            pf.Contact(one, 1.0, name="left"),
            pf.Contact(second, 1.0, name="right"),
        ]
        pf.Scene(pf.Body(1.0, 1.0), contacts, 1.0).to_file(f"{name}.toml")


FILES = "pad.h", "pad.c", "pad_test.c", "pad.cmake"


@pytest.mark.parametrize(
    ("arguments", "mu_c"),
    [
        (["model.toml"], 0.7),
        (["same.toml"], 0.7),
        (["scene.toml", "--contact", "right"], 0.5),
    ],
)
def test_files(capsys, tmp_path, arguments, mu_c):
    assert (
        main(
            [
                "export",
                *arguments,
                "--out",
                "made/here",
                "--name",
                "pad",
                "--precision",
                "float",
            ]
        )
        == 0
    )
    folder = tmp_path / "made" / "here"
    assert capsys.readouterr().out.split() == [f"made/here/{each}" for each in FILES]
    assert sorted(each.name for each in folder.iterdir()) == sorted(FILES)
    assert f" {mu_c}f, {mu_c}f," in (folder / "pad.c").read_text()
    assert "typedef float pad_real;" in (folder / "pad.h").read_text()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["scene.toml"], "--contact must be one of left, right"),
        (["scene.toml", "--contact", "middle"], "--contact must be one of left, right"),
        (
            ["model.toml", "--contact", "left"],
            "--contact must be given only for a scene",
        ),
        (
            ["model.toml", "--name", "a b"],
            "name must be a letter, then letters, digits and _, 40 in all",
        ),
        (
            ["model.toml", "--precision", "half"],
            "precision must be one of double, float",
        ),
        (["broken.toml"], "broken.toml: unknown key 'mass'"),
        (["cells.toml"], "surface must be an ellipsoid or a table"),
        (["none.toml"], "none.toml: no such file"),
    ],
)
def test_wrong_input_is_one_line(capsys, tmp_path, arguments, words):
    (tmp_path / "broken.toml").write_text(MODEL + "mass = 1.0\n")
    (tmp_path / "cells.toml").write_text(
        MODEL.replace('"reduced', '{kind = "reduced', 1).replace(
            'published"\n', 'published", surface = "cells"}\n', 1
        )
    )
    assert main(["export", *arguments, "--out", "library"]) == 2
    said = capsys.readouterr()
    assert words in said.err and said.err.count("\n") == 1 and said.out == ""
    assert not (tmp_path / "library").exists()


def test_a_folder_that_is_a_file_is_one_line(capsys):
    assert main(["export", "model.toml", "--out", "scene.toml"]) == 2
    assert "cannot write to folder scene.toml" in capsys.readouterr().err


def test_no_half_of_a_library_is_written(capsys, tmp_path):
    (tmp_path / "library" / "friction.c").mkdir(parents=True)
    assert main(["export", "model.toml", "--out", "library"]) == 2
    assert "friction.c: cannot be written: it is a folder" in capsys.readouterr().err
    assert [each.name for each in (tmp_path / "library").iterdir()] == ["friction.c"]
