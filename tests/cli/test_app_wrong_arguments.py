"""Arguments as scripts and slips produce them: every command ends with exit code 2 and one line, never a traceback."""

import os
import subprocess
import sys
import warnings
from pathlib import Path

import pytest

import planarfriction as pf
from planarfriction.cli import main

pytestmark = pytest.mark.skipif(
    not hasattr(os, "mkfifo"), reason="pipes and devices of POSIX"
)

SCENE = """
t_end = 0.01
[body]
mass = 1.0
inertia = 1.0
[[contact]]
normal_force = 2.0
[contact.law]
[contact.patch]
shape = "disc"
radius = 0.01
cells = 5
"""
LONG = 300 * "x"
DIGITS = 5000 * "9"
LOG = "t,vx,vy,omega,fx,fy,tau,normal_force\n" + "".join(
    f"{0.01 * i},0.01,0,0,-1,0,0,2\n" for i in range(20)
)

FOLDERS = [
    (["run", "in-hand", "--t-end", "0.01"], "--out"),
    (["identify", "log.csv"], "--out"),
    (["reproduce", "--quick", "--only", "limit-surfaces"], "--out"),
]
FILES = [(["limit-surface"], "--out", ".png"), (["limit-surface"], "--csv", ".csv")]


@pytest.fixture(autouse=True)
def place(tmp_path, monkeypatch):
    """A folder with a scene, a log, a map, and things that are no files."""
    monkeypatch.chdir(tmp_path)
    for name, text in {
        "scene.toml": SCENE,
        "log.csv": LOG,
        "pad.csv": "1,1\n0,2\n",
        "plain": "kept",
    }.items():
        Path(name).write_text(text)
    for suffix in ("", ".toml", ".json", ".csv", ".png", ".npy"):
        os.mkfifo(f"pipe{suffix}")
        Path(f"folder{suffix}").mkdir()
        Path(f"noise{suffix}").write_bytes(bytes(range(128, 256)))
        Path(f"empty{suffix}").touch()
    return tmp_path


def fails(capsys, *arguments):
    """The line of a command that must fail and leave every file as it was."""
    before = {path.name: path.stat().st_mtime_ns for path in Path().iterdir()}
    assert main(arguments) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.startswith("error: ") and captured.err.count("\n") == 1, (
        captured.err
    )
    assert {path.name: path.stat().st_mtime_ns for path in Path().iterdir()} == before
    return captured.err


# ---------------------------------------------------------------------- values


@pytest.mark.parametrize(
    "value",
    ["", "  ", "0", "-1", "nan", "inf", "1e300", "1e400", "much", "1,5", "0x1", DIGITS],
)
@pytest.mark.parametrize(
    "command",
    [
        ["run", "in-hand", "--model", "reduced", "--t-end"],
        ["run", "scene.toml", "--t-end"],
        ["run", "in-hand", "--patch", "pad.csv", "--cell-size"],
        ["limit-surface", "--pressure", "pad.csv", "--cell-size"],
        ["identify", "log.csv", "--width"],
        ["identify", "plan", "--speed"],
    ],
    ids=lambda command: f"{command[0]} {command[-1]}",
)
def test_numbers(capsys, command, value):
    assert (
        len(fails(capsys, *command, value)) < 300 + len(value[:5000]) * value.isdigit()
    )


@pytest.mark.parametrize("name", ["make", "model", "options", "self"])
@pytest.mark.parametrize("command", ["run", "sweep"])
def test_names_of_no_value(capsys, command, name):
    told = fails(capsys, command, "in-hand", "--set", f"{name}=1")
    assert told.startswith(f"error: {name} must name a value of the scene")


@pytest.mark.parametrize(
    "value",
    ["", "  ", LONG, "nan", "é", "\udcff", "a\0b", "plain", "none.csv", "folder.csv"],
)
@pytest.mark.parametrize(
    "command",
    [
        ["run"],
        ["run", "in-hand", "--model"],
        ["run", "in-hand", "--patch"],
        ["run", "scene.toml", "--patch"],
        ["limit-surface", "--patch"],
        ["limit-surface", "--cell-size", "0.001", "--pressure"],
        ["limit-surface", "--surface"],
        ["export", "--out", "library"],
        ["export", "scene.toml", "--out", "library", "--contact"],
        ["identify"],
        ["identify", "log.csv", "--patch"],
        ["identify", "log.csv", "--parameters"],
        ["identify", "log.csv", "--start"],
        ["identify", "log.csv", "--noise"],
        ["identify", "plan"],
        ["identify", "plan", "--wanted"],
        ["bench", "--only"],
        ["reproduce", "--only"],
        ["warm"],
        [],
    ],
    ids=" ".join,
)
def test_names(capsys, command, value):
    fails(capsys, *command, value)


@pytest.mark.parametrize("value", ["-1", "1.5", "", DIGITS])
@pytest.mark.parametrize("option", ["--starts", "--seed"])
def test_counts(capsys, option, value):
    fails(capsys, "identify", "log.csv", option, value)


@pytest.mark.parametrize("kind", ["pipe", "folder", "noise", "empty", "/dev/zero"])
@pytest.mark.parametrize(
    ("command", "suffix"),
    [
        (["run"], ".toml"),
        (["run"], ".json"),
        (["export", "--out", "library"], ".toml"),
        (["run", "in-hand", "--cell-size", "0.001", "--patch"], ".csv"),
        (["run", "in-hand", "--cell-size", "0.001", "--patch"], ".npy"),
        (["limit-surface", "--cell-size", "0.001", "--pressure"], ".png"),
        (["identify"], ".csv"),
    ],
)
def test_files_that_are_none(capsys, command, suffix, kind):
    assert kind in fails(
        capsys, *command, kind if kind.startswith("/") else kind + suffix
    )


def test_what_is_not_said_is_not_guessed(capsys):
    """An empty patch was Circle, an empty folder the present one, and a cell size without a map was passed over."""
    assert "patch must be one of Square" in fails(
        capsys, "run", "in-hand", "--patch", ""
    )
    assert "--out" in fails(capsys, "run", "in-hand", "--out", "")
    assert "--cell-size must be given only" in fails(
        capsys, "run", "scene.toml", "--cell-size", "0.001"
    )


def test_warnings_are_one_line_too(capsys):
    with warnings.catch_warnings():
        warnings.simplefilter("default")
        assert main(["limit-surface", "--patch", "pad.csv", "--cell-size", "2"]) == 0
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("warning: patch 'pad' is 4 m wide")


# ---------------------------------------------------------------------- scene files


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        (
            "t_end = 0.01",
            f"t_end = {DIGITS}",
            "not valid TOML: Exceeds the limit (4300 digits)",
        ),
        ("t_end = 0.01", "t_end = 1e300", "t_end must be at most"),
        ("t_end = 0.01", "t_end = nan", "t_end must be finite"),
        ("t_end = 0.01", "t_end = 2026-01-01", "t_end must be a number"),
        ("t_end = 0.01", "t_end = 1\nname = 2026-01-01", "name must be a text"),
        ("t_end = 0.01", "t_end = 1\nname = nan", "name must be a text"),
        (
            "t_end = 0.01",
            "t_end = 1\nsave_every = 1e-12",
            "save_every must be at least",
        ),
        ("t_end = 0.01", "t_end = 1\nt_end = 2", "not valid TOML: Cannot overwrite"),
        ("t_end = 0.01", "", "missing key 't_end'"),
        ("mass = 1.0", f"mass = 1.0\n{LONG} = 1", "unknown key 'xxx"),
        ("mass = 1.0", "mass = 1.0\nsize = [1e200, 1e200]", "size must be at most"),
        ("cells = 5", "cells = 100_000", "cells (rows x columns) must be at most"),
        ("cells = 5", "cells = '5'", "cells must be a number"),
        (
            "normal_force = 2.0",
            f"normal_force = 2.0\ncount = 1{400 * '0'}",
            "count of contact 'contact' must be at mo",
        ),
        (
            "normal_force = 2.0",
            "normal_force = 2.0\nname = 2026-01-01",
            "name of a contact must be a text",
        ),
        (
            "normal_force = 2.0",
            "normal_force = { csv = 'pipe.csv' }",
            "is a device or a pipe",
        ),
        (
            "normal_force = 2.0",
            "normal_force = { csv = '/dev/zero' }",
            "is a device or a pipe",
        ),
        (
            "normal_force = 2.0",
            "normal_force = { csv = '' }",
            "must be the path of a file",
        ),
        ('shape = "disc"', "shape = ['disc']", "shape must be one of"),
    ],
)
def test_scene_files(capsys, old, new, words):
    Path("wrong.toml").write_text(SCENE.replace(old, new, 1))
    line = fails(capsys, "run", "wrong.toml")
    assert words in line and "wrong.toml" in line and len(line) < 300


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('{"t_end": 1, "t_end": 2}', "two keys 't_end'"),
        ('{"body": {"mass": 1, "mass": 2}}', "two keys 'mass'"),
        (f'{{"t_end": {DIGITS}}}', "not valid JSON: Exceeds the limit (4300 digits)"),
        (100_000 * "[", "not valid JSON"),
        ("null", "must be a table"),
    ],
)
def test_json_scene_files(capsys, text, words):
    Path("wrong.json").write_text(text)
    assert words in fails(capsys, "run", "wrong.json")


# ---------------------------------------------------------------------- places


@pytest.mark.parametrize(
    "folder", ["", "plain", "plain/out", "/proc/out", LONG, "a\0b", "/dev/null"]
)
@pytest.mark.parametrize(
    ("command", "option"),
    FOLDERS,
    ids=lambda value: value[0] if isinstance(value, list) else "",
)
def test_folders_that_cannot_be_written(capsys, command, option, folder):
    fails(capsys, *command, option, folder)


@pytest.mark.parametrize(
    "name",
    [
        "",
        "folder",
        "pipe",
        "none/surface",
        "plain/surface",
        "/proc/surface",
        LONG,
        "a\0b",
    ],
)
@pytest.mark.parametrize(
    ("command", "option", "suffix"),
    FILES,
    ids=lambda value: value if value == "--csv" else "",
)
def test_files_that_cannot_be_written(capsys, command, option, suffix, name):
    fails(capsys, *command, option, name and name + suffix)


MAIN = "import sys; from planarfriction.cli import main; sys.exit(main())"

FULL = """
import resource, sys, warnings
from planarfriction.cli import main
import planarfriction.plots  # fonts are looked for, and remembered, before the disk is full
from planarfriction.plots import animation, limit_surface
animation.LEAST_FRAMES, limit_surface.POLAR_SEGMENTS, limit_surface.AZIMUTH_SEGMENTS = 5, 12, 12  # drawn in no time
resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[1]), resource.RLIM_INFINITY))
sys.exit(main(sys.argv[2:]))
"""


@pytest.mark.parametrize(
    ("most", "command", "kept"),
    [
        (
            1000,
            ["limit-surface", "--surface", "ellipsoid", "--out", "kept.png"],
            ["kept.png"],
        ),
        (
            1000,
            ["limit-surface", "--surface", "ellipsoid", "--csv", "kept.csv"],
            ["kept.csv"],
        ),
        (1000, ["run", "scene.toml", "--out", "."], ["scene-distributed.nc"]),
        pytest.param(
            5000,
            ["run", "scene.toml", "--out", ".", "--animate"],
            ["scene-motion-distributed.gif"],
            marks=pytest.mark.slow,
        ),
    ],
)
def test_a_full_disk_leaves_what_was_there(place, most, command, kept):
    for name in kept:
        Path(name).write_text("kept")
    done = subprocess.run(
        [sys.executable, "-c", FULL, str(most), *command],
        capture_output=True,
        text=True,
    )
    assert done.returncode == 2
    assert done.stderr.splitlines()[-1].endswith("cannot be written: File too large"), (
        done.stderr
    )
    assert "Traceback" not in done.stderr
    for name in kept:
        assert Path(name).read_text() == "kept"
    assert not list(Path().glob(".planarfriction-*"))


def test_file_names_that_are_no_utf_8(capsys):
    name = os.fsdecode(b"pl\xe4ttchen.toml")
    Path(name).write_text(SCENE)
    out = os.fsdecode(b"s\xf6lution")
    assert main(["run", name, "--out", out]) == 0
    assert pf.Solution.load(Path(out) / "scene-distributed.nc").status == "success"
    Path(name).rename(pad := os.fsdecode(b"p\xe4d.csv"))
    Path(pad).write_text("1,1\n")
    done = subprocess.run(
        [
            sys.executable,
            "-c",
            MAIN,
            "limit-surface",
            "--patch",
            os.fsencode(pad),
            "--cell-size",
            "0.1",
        ],
        capture_output=True,
    )
    assert (done.returncode, done.stderr) == (0, b"")
    assert b"Limit surface of p?d" in done.stdout
