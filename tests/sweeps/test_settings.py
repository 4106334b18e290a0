"""Values of scenes by dotted path, as `--set` spells them, and the command `sweep`."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import planarfriction as pf
from planarfriction.cli import INTERRUPTED, main
from planarfriction.cli.run import build_scenes, one_each
from planarfriction.errors import SweepInterrupted
from planarfriction.sweeps import running
from planarfriction.sweeps.settings import Settable, parse
from tests.sweeps.test_running import kept

SCENE = """
t_end = 0.03
[body]
mass = 0.2
size = [0.15, 0.08]
position = [0.002, 0.0]
[[contact]]
name = "fingers"
count = 2
normal_force = 2.0
model = {model}
[contact.patch]
shape = "disc"
radius = 0.01
cells = 7
[contact.law]
mu_c = 1.0
mu_s = 1.2
elasto_plastic = 0.9
"""
SMALL = '{ kind = "reduced", cells = 8 }'


@pytest.fixture
def file(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("scene.toml").write_text(SCENE.format(model=SMALL))
    return "scene.toml"


# ---------------------------------------------------------------------- paths


def test_values_of_a_file_are_changed_before_it_is_read(file):
    make = Settable(file)
    plain = make()
    heavy = make(**{"body.mass": 0.4})
    # By its size.
    assert heavy.body.mass == 0.4 and heavy.body.inertia == 2.0 * plain.body.inertia
    changed = make(
        **{
            "fingers.law.mu_c": 0.5,
            "body.position.1": 0.01,
            "t_end": 0.02,
            "fingers.patch.radius": 0.02,
            "fingers.model": "distributed",
            "fingers.normal_force": 3,
            "body.angle": 0.1,  # which the file does not have
        }
    )
    (contact,) = changed.contacts
    assert contact.model.law == dataclasses.replace(
        plain.contacts[0].model.law, mu_c=0.5
    )
    assert (
        changed.body.position == (0.002, 0.01)
        and changed.t_end == 0.02
        and changed.body.angle == 0.1
    )
    assert contact.model == pf.DistributedModel(
        pf.ContactPatch.disc(0.02, 7), contact.model.law
    )
    assert contact.normal_force(0.0) == 3.0
    assert make() == plain  # nothing of it stays


def test_values_of_a_scene_are_changed_too(file):
    scene = pf.Scene.from_file(file)
    make = Settable(scene)
    assert make() == scene
    changed = make(
        **{"fingers.law.mu_c": 0.5, "body.mass": 0.4, "fingers.model.cells": 6}
    )
    assert (
        changed.body.inertia == scene.body.inertia
        and changed.contacts[0].model.cells == 6
    )
    assert changed.contacts[0].model.patch == scene.contacts[0].model.patch


def test_a_model_that_is_only_named_gets_keys(file):
    Path(file).write_text(SCENE.format(model='"reduced"'))
    assert Settable(file)(**{"fingers.model.cells": 2}).contacts[0].model.cells == 2


def test_contacts_are_called_what_they_are_called_in_results():
    model = pf.DistributedModel(pf.ContactPatch.disc(0.01, 5), pf.LuGre())
    contacts = [
        pf.Contact(model, 1.0, name="left"),
        pf.Contact(model, 1.0, name="v1.5"),
    ]
    make = Settable(pf.Scene(pf.Body(1.0, 1.0), contacts, 0.1))
    assert make(**{"v1.5.law.mu_c": 0.5}).contacts[1].model.law.mu_c == 0.5
    assert make(**{"left.count": 3}).contacts[0].count == 3
    table = make(**{"left.count": 3}).to_dict()
    for each in table["contact"]:
        del each["name"]
    assert Settable(table)(**{"contact 2.count": 4}).contacts[1].count == 4


# ---------------------------------------------------------------------- texts


@pytest.mark.parametrize(
    ("text", "path", "values"),
    [
        ("body.mass=0.1:0.3:3", "body.mass", np.linspace(0.1, 0.3, 3).tolist()),
        ("a = 0.5, 0.8", "a", [0.5, 0.8]),
        ("count=1,2", "count", [1, 2]),
        ("model=reduced,distributed", "model", ["reduced", "distributed"]),
        ("on=true,false", "on", [True, False]),
        ("g=[0, -9.81],[0.0,0.0]", "g", [[0, -9.81], [0.0, 0.0]]),
        ('n="a,b"', "n", ["a,b"]),
        ("n=1:2", "n", ["1:2"]),
        ("m={ kind = 'reduced', cells = 2 }", "m", [{"kind": "reduced", "cells": 2}]),
    ],
)
def test_texts_are_values(text, path, values):
    found, labels = parse(text)
    assert found == path and list(labels.values()) == values
    assert [type(each) for each in labels.values()] == [type(each) for each in values]


# ---------------------------------------------------------------------- commands


def test_run_takes_values_of_files_and_of_ready_scenes(file):
    (scene,) = build_scenes(
        file, [], settings=one_each(["body.mass=0.3", "fingers.law.mu_c=0.5"])
    ).values()
    assert scene.body.mass == 0.3 and scene.contacts[0].model.law.mu_c == 0.5
    settings = one_each(["mass=0.4", "fingers.law.mu_c=0.5", "fingers.count=1"])
    scenes = build_scenes("in-hand", ["both"], patch="Line", settings=settings)
    assert list(scenes) == ["distributed", "reduced"]
    for scene in scenes.values():
        plain = pf.scenes.in_hand(scene.contacts[0].model, mass=0.4)
        # Inertia too, which `body.mass` alone would leave.
        assert scene.body == plain.body
        assert scene.contacts[0].count == 1 and scene.contacts[0].model.law.mu_c == 0.5
    by_label = build_scenes(file, [], settings=one_each(["fingers.model=distributed"]))
    assert list(by_label) == ["distributed"]


def fails(capsys, *arguments):
    assert main(arguments) == 2
    captured = capsys.readouterr()
    assert (
        captured.out == ""
        and captured.err.startswith("error: ")
        and captured.err.count("\n") == 1
    )
    return captured.err


def test_mistakes_of_the_commands_are_one_line(file, capsys):
    assert "must be one value (planarfriction sweep takes several)" in fails(
        capsys, "run", file, "--set", "t_end=1,2"
    )
    assert "did you mean 'mass'?" in fails(
        capsys, "run", "in-hand", "--set", "mas=1", "--t-end", "0.01"
    )
    assert "did you mean 'mu_c'?" in fails(
        capsys, "sweep", file, "--set", "fingers.law.muc=1:2:3"
    )
    assert "be given once" in fails(
        capsys, "sweep", file, "--set", "t_end=1", "--set", "t_end=2"
    )
    assert "Missing option '--set'" in fails(capsys, "sweep", file)
    assert "no such file" in fails(capsys, "sweep", "nothing.toml", "--set", "t_end=1")
    assert "--measure must be FILE.py:NAME" in fails(
        capsys, "sweep", file, "--set", "t_end=0.01", "--measure", "x"
    )
    assert not Path("sweep").exists()


def test_the_command_sweeps_and_goes_on(file, capsys, monkeypatch):
    arguments = [
        "sweep",
        file,
        "--set",
        "body.mass=0.1:0.3:3",
        "--set",
        "fingers.law.mu_c=0.5,0.8",
        "--out",
        "runs",
    ]
    assert main(arguments) == 0
    first = capsys.readouterr()
    assert (
        "6 runs over body.mass, fingers.law.mu_c, at 0.03 s" in first.out
        and "6 of 6 runs\n" in first.err
    )
    with xr.open_dataset("runs/sweep.nc", engine="scipy") as data:
        assert data.y.dims == ("body.mass", "fingers.law.mu_c", "time")
        there = data.sel({"body.mass": 0.2, "fingers.law.mu_c": 0.8})
        values = {"body.mass": 0.2, "fingers.law.mu_c": 0.8}
        np.testing.assert_array_equal(
            there.y, pf.simulate(Settable(file)(**values)).data.y
        )
    assert main(arguments) == 0
    again = capsys.readouterr()
    assert again.out == first.out and "6 of 6 runs (6 found)" in again.err
    rows = [
        [cell.strip() for cell in line.split("│")[1:-1]]
        for line in first.out.splitlines()
        if "│" in line
    ]
    values = [[mass, mu] for mass in ("0.1", "0.2", "0.3") for mu in ("0.5", "0.8")]
    assert [row[:2] for row in rows] == values  # a row for each run
    drop = 1e6 * data.y.isel(time=-1).values.ravel()
    assert "y [µm]" in first.out
    # Three digits.
    np.testing.assert_allclose([float(row[6]) for row in rows], drop, rtol=0.006)
    monkeypatch.setattr("planarfriction.cli.sweep.MOST_ROWS", 5)
    assert main(arguments) == 0
    ranges = capsys.readouterr().out
    assert "smallest" in ranges and f"{np.median(drop):.3g}" in ranges


def test_the_command_measures_with_a_function_of_a_file(file, capsys):
    Path("mine.py").write_text(
        "def down(solution):\n    return -1e3 * solution.histories['y'].values[-1]\n"
    )
    assert (
        main(
            [
                "sweep",
                file,
                "--set",
                "fingers.normal_force=-1,1,2",
                "--measure",
                "mine.py:down",
            ]
        )
        == 0
    )
    captured = capsys.readouterr()
    assert (
        "1 failed; the first: make_scene: scene.toml: [contact]: normal_force"
        in captured.err
    )
    assert "down" in captured.out
    assert len(kept(Path("sweep"))) == 2


def test_ctrl_c_says_how_to_go_on(file, capsys, monkeypatch):
    def stopped(*arguments, progress, **options):
        progress(running.Progress(10, 4, 1, 0, 0, 3.0))
        raise SweepInterrupted("4 of 10", None)

    monkeypatch.setattr("planarfriction.sweeps.sweep", stopped)
    assert main(["sweep", file, "--set", "t_end=0.01,0.02"]) == INTERRUPTED
    assert (
        "interrupted: 4 of 10 runs (1 found), 3 s left; the same command continues"
        in capsys.readouterr().err
    )


@pytest.mark.parametrize("command", ["", "run", "sweep", "bench", "identify", "warm"])
def test_every_command_has_short_help(command, capsys):
    assert main([*command.split(), "-h"]) == 0
    assert "Usage: planarfriction" in capsys.readouterr().out
