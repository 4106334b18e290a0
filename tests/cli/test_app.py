"""Command line: what it builds, writes, prints and says when the input is wrong."""

from __future__ import annotations

import contextlib
import csv
import dataclasses
import json
import re
import sys
import tomllib
from importlib.metadata import EntryPoint, PackageNotFoundError, entry_points
from pathlib import Path
from types import SimpleNamespace

import click
import numpy as np
import pytest
from PIL import Image

import planarfriction as pf
from planarfriction import __version__, scenes
from planarfriction._engine.body import rosenbrock
from planarfriction.cli import main, output
from planarfriction.cli.app import ELSEWHERE, GROUP, app
from planarfriction.cli.options import find_patch
from planarfriction.cli.run import build_scenes, largest_differences
from planarfriction.errors import SimulationInterrupted, SolverError
from planarfriction.families import SCENES
from planarfriction.patch import PUBLISHED_PATCHES
from planarfriction.plots import animation
from tests.support import synthetic

LIBRARY = [
    "doctor",
    "explore",
    "export",
    "hold",
    "identify",
    "limit-surface",
    "run",
    "sweep",
    "warm",
]
"""Commands of a library alone."""


def test_ctrl_c_before_the_first_sample_is_no_traceback(monkeypatch, capsys):
    def interrupted(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(rosenbrock, "advance", interrupted)
    assert main(["run", "in-hand", "--model", "reduced", "--t-end", "0.01"]) == 130
    assert "Traceback" not in capsys.readouterr().err


@pytest.fixture
def simulated(monkeypatch):
    """Replace `simulate` by a stand-in; returns what it was asked for."""
    calls = []

    def simulate(scene, *, progress=None, **options):
        calls.append((scene, options))
        progress(0.5 * scene.t_end)
        return synthetic.solution(
            scene,
            scale=1.0 + 0.1 * len(calls),
            t_end=min(2.0, options.get("t_end", 2.0)),
        )

    monkeypatch.setitem(vars(scenes), "simulate", simulate)
    return calls


def fails(capsys, *arguments):
    """Run a command that must fail with exit code 2, one line on stderr, nothing on stdout; returns the line."""
    assert main(arguments) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.startswith("error: ") and captured.err.count("\n") == 1
    return captured.err


def read_csv(path):
    with path.open(newline="") as file:
        head, *rows = csv.reader(file)
    return dict(zip(head, np.array(rows, dtype=float).T, strict=True))


# ---------------------------------------------------------------------- the command itself


def test_version(capsys):
    assert main(["--version"]) == 0
    assert capsys.readouterr().out == f"planarfriction {__version__}\n"


@pytest.mark.parametrize("command", [["run"], ["limit-surface"], ["bench"]])
def test_help_has_examples(capsys, command):
    assert main([*command, "--help"]) == 0
    assert (
        f"planarfriction {command[0]} " in capsys.readouterr().out.split("Examples")[1]
    )


def test_without_arguments_the_help_is_shown(capsys, monkeypatch):
    monkeypatch.setattr(sys, "argv", ["planarfriction"])
    assert main() == 0
    assert "limit-surface" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["run"], "SCENE"),
        (["run", "in-hnad"], "did you mean 'in-hand'?"),
        (["run", "missing.toml"], "missing.toml"),
        (["run", "in-hand", "--patch", "Circel"], "did you mean 'Circle'?"),
        (
            ["run", "in-hand", "--patch", "missing.csv", "--cell-size", "0.001"],
            "missing.csv: no such file",
        ),
        (["run", "in-hand", "--patch", "pad.csv"], "--cell-size must be given"),
        (
            ["run", "in-hand", "--patch", "Circle", "--cell-size", "0.001"],
            "--cell-size must be given only for a pressure",
        ),
        (["run", "in-hand", "--t-end", "nan"], "--t-end must be finite"),
        (["run", "in-hand", "--rtol", "fast"], "--rtol"),
        (["run", "in-hand", "--model", "simple"], "--model"),
        (
            ["limit-surface", "--out", "surface.bmp"],
            "surface.bmp: a picture ends in .png",
        ),
        (["limit-surface", "--out", "missing/surface.png"], "missing"),
        (["limit-surface", "--surface", "sphere"], "table-published"),
    ],
)
def test_wrong_input_is_one_line(capsys, monkeypatch, tmp_path, arguments, words):
    monkeypatch.chdir(tmp_path)
    assert words in fails(capsys, *arguments)


def test_a_broken_scene_file_is_one_line(capsys, tmp_path):
    broken = tmp_path / "scene.toml"
    broken.write_text("t_end = [1,\n", encoding="utf-8")
    assert "scene.toml" in fails(capsys, "run", str(broken))


# ---------------------------------------------------------------------- scenes and patches


@pytest.mark.parametrize("name", ["in-hand", "drift", "free-slide", "driven", "pushed"])
def test_ready_scenes_by_name(name):
    built = build_scenes(name, ["both"], t_end=1.5)
    assert [type(scene.contacts[0].model).__name__ for scene in built.values()] == list(
        run_models()
    )
    assert list(built) == ["distributed", "reduced"]
    for scene in built.values():
        assert scene.t_end == 1.5
        assert scene.contacts[0].model.law == pf.LuGre(
            mu_s=1.2, elasto_plastic=pf.ElastoPlastic(0.9)
        )
        assert scene.contacts[0].model.patch.cells == 317


def run_models():
    return "DistributedModel", "ReducedModel"


def test_the_published_model_has_its_own_name():
    (scene,) = build_scenes("in-hand", ["reduced-published"]).values()
    assert type(scene.contacts[0].model) is pf.ReducedModelPublished


def test_default_models():
    assert list(build_scenes("in-hand", [])) == ["distributed", "reduced"]
    assert list(build_scenes("drift", [])) == ["distributed"]
    assert list(build_scenes("in-hand", ["reduced", "both"])) == [
        "reduced",
        "distributed",
    ]


def test_drift_has_the_published_width():
    patch = build_scenes("drift", [])["distributed"].contacts[0].model.patch
    assert np.ptp(patch.positions[:, 0]) == pytest.approx(0.05 * 20 / 21, rel=1e-12)


@pytest.mark.parametrize("name", PUBLISHED_PATCHES)
def test_published_patches_by_name(name):
    assert find_patch(name.lower(), {}).to_dict() == PUBLISHED_PATCHES[name]().to_dict()


def test_disc_rectangle_and_pressure_map(tmp_path):
    assert find_patch("disc", {}).area() == pytest.approx(np.pi * 1e-4, rel=1e-9)
    assert find_patch("rectangle", {}).area() == pytest.approx(4e-4, rel=1e-12)
    (tmp_path / "pad.csv").write_text("1,1\n0,2\n", encoding="utf-8")
    patch = find_patch(str(tmp_path / "pad.csv"), {"cell_size": 1e-3})
    assert patch.weights() == pytest.approx([0.25, 0.25, 0.5])
    assert patch.positions[0] == pytest.approx([-5e-4, 5e-4])  # row 0 is the top


@pytest.fixture
def scene_file(tmp_path):
    path = tmp_path / "plate.json"
    synthetic.scene(contacts=2, name="my plate").to_file(path)
    return path


def test_scene_files_keep_their_models_unless_told_otherwise(scene_file):
    built = build_scenes(str(scene_file), [])
    assert [type(contact.model) for contact in built["distributed"].contacts] == [
        pf.DistributedModel
    ] * 2
    built = build_scenes(str(scene_file), ["both"])
    assert [type(contact.model) for contact in built["reduced"].contacts] == [
        pf.ReducedModel
    ] * 2
    assert built["reduced"].contacts[1].position == (0.03, 0.0)
    assert built["reduced"].contacts[0].model.law == pf.LuGre(mu_s=1.2)
    built = build_scenes(str(scene_file), [], patch="Line")
    assert [contact.model.patch.name for contact in built["distributed"].contacts] == [
        "Line"
    ] * 2


# ---------------------------------------------------------------------- run


def test_run_prints_the_comparison(capsys, simulated):
    assert main(["run", "in-hand", "--rtol", "1e-4"]) == 0
    rows = {row[0]: row[1:] for row in table_rows(capsys.readouterr().out)}
    assert rows["final y [mm]"] == ["-22", "-24"]
    assert rows["largest difference, position [mm]"] == ["2"]
    # scale 1.1 and 1.2, at t = 2 s: 0.1 * 0.3 * 4 rad
    assert float(rows["largest difference, angle [deg]"][0]) == pytest.approx(
        np.degrees(0.12), abs=5e-4
    )
    assert rows["steps"] == ["1234", "1234"]
    assert rows["rejected steps"] == ["56", "56"]
    assert rows["times faster than real time"] == ["8", "8"]
    assert [options for _, options in simulated] == [{"rtol": 1e-4}] * 2


def table_rows(text):
    """Cells of the rows of a printed table, empty ones left out."""
    rows = [
        [cell.strip() for cell in line.strip("│").split("│")]
        for line in text.splitlines()
        if line.startswith("│")
    ]
    return [[cell for cell in row if cell] for row in rows]


def test_run_writes_what_can_be_read_back(simulated, tmp_path):
    folder = tmp_path / "new" / "out"
    assert (
        main(
            [
                "run",
                "in-hand",
                "--model",
                "reduced",
                "--t-end",
                "1",
                "--out",
                str(folder),
            ]
        )
        == 0
    )
    assert sorted(path.name for path in folder.iterdir()) == [
        "in-hand-reduced.csv",
        "in-hand-reduced.nc",
    ]
    stored = pf.Solution.load(folder / "in-hand-reduced.nc")
    assert stored.scene.to_dict() == simulated[0][0].to_dict()
    columns = read_csv(folder / "in-hand-reduced.csv")
    expected = synthetic.solution(simulated[0][0], scale=1.1, t_end=1.0).data
    assert list(columns)[:7] == ["time", "x", "y", "theta", "vx", "vy", "omega"]
    of_contact = ["vx", "vy", "omega", "fx", "fy", "tau", "normal_force"]
    assert list(columns)[7:] == [f"fingers.{name}" for name in of_contact]
    check_columns(columns, expected)


def check_columns(columns, expected):
    """Columns of a file that `run` wrote against the data of a solution, to the last bit."""
    for name, values in columns.items():
        contact, _, last = name.rpartition(".")
        if not (contact and last in ("vx", "vy", "omega")):
            assert np.array_equal(values, np.asarray(expected[last]).ravel()), name


@pytest.mark.parametrize(
    ("text", "name"),
    [
        ("in-hand", "in-hand"),
        (" a/b: c. ", "a-b-c"),
        ("../é 2.5", "é-2.5"),
        ("-?-", "unnamed"),
    ],
)
def test_names_of_files_are_letters_digits_dots_and_hyphens(text, name):
    assert output.slug(text) == name


def test_columns_of_several_contacts_carry_their_names():
    run = synthetic.solution(synthetic.scene(contacts=2))
    columns = output.history_columns(run)
    assert [name for name in columns if name.endswith("fx")] == ["pad-1.fx", "pad-2.fx"]
    for name in ("fx", "fy", "tau", "normal_force"):
        assert columns[f"pad-2.{name}"] == pytest.approx(
            run.data[name].values[:, 1], rel=1e-15
        )
        assert columns[f"pad-2.{name}"] == pytest.approx(2.0 * columns[f"pad-1.{name}"])
    assert columns["pad-2.vy"][-1] == pytest.approx(run.contact_twist("pad 2")[-1, 1])


def test_run_draws(simulated, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(animation, "LEAST_FRAMES", 3)
    assert main(["run", "drift", "--t-end", "0.1", "--plot", "--animate"]) == 0
    drawn = sorted(
        path.name
        for path in (tmp_path / "out").iterdir()
        if path.suffix in (".png", ".gif")
    )
    stem = "drift-tangential"
    assert drawn == [
        f"{stem}-histories.png",
        f"{stem}-motion-distributed.gif",
        f"{stem}-motion-distributed.png",
        f"{stem}-patch.png",
    ]
    assert all((tmp_path / "out" / name).stat().st_size > 5000 for name in drawn)


def test_a_folder_that_cannot_be_written_is_found_before_the_simulation(
    capsys, simulated, tmp_path
):
    blocked = tmp_path / "file"
    blocked.write_text("", encoding="utf-8")
    for folder in (blocked, blocked / "out"):
        assert "cannot write to folder" in fails(
            capsys, "run", "in-hand", "--out", str(folder)
        )
    assert simulated == []


def interrupted(after, error):
    """A stand-in for `simulate` that ends in an error with a part of the solution after some complete runs."""
    done = []

    def simulate(scene, *, progress=None, **options):
        done.append(scene)
        if len(done) > after:
            raise error(synthetic.solution(scene, t_end=0.5))
        return synthetic.solution(scene)

    return simulate


def test_ctrl_c_keeps_what_is_done(capsys, tmp_path, monkeypatch):
    monkeypatch.setitem(vars(scenes), "simulate", interrupted(1, SimulationInterrupted))
    assert main(["run", "in-hand", "--out", str(tmp_path), "--plot"]) == 130
    captured = capsys.readouterr()
    assert "stopped at t = 0.5 s of the reduced run" in captured.err
    assert "simulated time [s]" in captured.out
    assert pf.Solution.load(tmp_path / "in-hand-distributed.nc").data["time"][-1] == 2.0
    assert pf.Solution.load(tmp_path / "in-hand-reduced.nc").data["time"][-1] == 0.5


def test_ctrl_c_elsewhere_is_no_traceback(capsys, monkeypatch):
    def simulate(scene, **options):
        raise KeyboardInterrupt

    monkeypatch.setitem(vars(scenes), "simulate", simulate)
    assert main(["run", "in-hand"]) == 130
    assert "Traceback" not in capsys.readouterr().err


def test_a_solver_that_gives_up_keeps_what_is_done(capsys, tmp_path, monkeypatch):
    stand_in = interrupted(
        0, lambda part: SolverError("step size fell below the least: raise rtol", part)
    )
    monkeypatch.setitem(vars(scenes), "simulate", stand_in)
    assert main(["run", "drift", "--out", str(tmp_path)]) == 2
    assert (
        capsys.readouterr().err.splitlines()[-1]
        == "error: step size fell below the least: raise rtol"
    )
    assert (
        pf.Solution.load(tmp_path / "drift-tangential-distributed.nc").data["time"][-1]
        == 0.5
    )


def test_differences_cover_the_time_that_both_runs_have():
    full = synthetic.solution()
    short = synthetic.solution(scale=2.0, t_end=1.0)
    for pair in ((full, short), (short, full)):
        assert largest_differences(*pair) == pytest.approx((5e-3, 0.3), rel=1e-12)


# ---------------------------------------------------------------------- run, with the real solver


def test_a_body_that_is_held_moves_by_less_than_a_micrometre(capsys):
    assert main(["run", "drift"]) == 0
    rows = {row[0]: row[1] for row in table_rows(capsys.readouterr().out)}
    assert 0.05 < float(rows["final x [µm]"]) < 0.2


def test_a_slide_ends_when_the_puck_has_stopped(capsys):
    assert main(["run", "free-slide", "--model", "both"]) == 0
    rows = {row[0]: row[1:] for row in table_rows(capsys.readouterr().out)}
    assert rows["ended"] == ["at rest"] * 2
    # Coulomb friction without spin would stop it after v^2/(2 mu g) = 51 mm; spin lets it go further, Stribeck and
    # viscous friction hold it back a little
    assert 48.0 < float(rows["final x [mm]"][0]) < 65.0


@pytest.mark.parametrize(
    "path",
    sorted((Path(__file__).parents[2] / "examples").glob("*.toml")),
    ids=lambda path: path.stem,
)
def test_example_scene_files_run(path, tmp_path):
    assert main(["run", str(path), "--t-end", "0.02", "--out", str(tmp_path)]) == 0
    (stored,) = tmp_path.glob("*.nc")
    assert pf.Solution.load(stored).data["time"][-1] == 0.02


def test_ctrl_c_in_the_solver_keeps_what_is_done(capsys, tmp_path, monkeypatch):
    from planarfriction.cli import run as command

    @contextlib.contextmanager
    def impatient(label, t_end):
        def report(time):
            raise KeyboardInterrupt

        yield report

    monkeypatch.setattr(command, "simulation_progress", impatient)
    assert main(["run", "in-hand", "--out", str(tmp_path)]) == 130
    assert "stopped at t = " in capsys.readouterr().err
    part = pf.Solution.load(tmp_path / "in-hand-distributed.nc")
    assert part.status == "interrupted"
    assert 0.0 < part.data["time"][-1] < 2.0


# ---------------------------------------------------------------------- limit-surface


@pytest.fixture
def coarse(monkeypatch):
    """Draw limit surfaces with few facets: nothing here depends on their number."""
    for name in ("POLAR_SEGMENTS", "AZIMUTH_SEGMENTS"):
        monkeypatch.setattr(f"planarfriction.plots.limit_surface.{name}", 12)


def test_limit_surface_of_a_map_is_the_exact_one_alone_or_to_be_rotated(
    coarse, capsys, tmp_path
):
    pytest.importorskip("plotly")
    (tmp_path / "pad.csv").write_text("1,1,1\n0,2,0\n", encoding="utf-8")
    command = [
        "limit-surface",
        "--pressure",
        str(tmp_path / "pad.csv"),
        "--cell-size",
        "0.001",
    ]
    alone, both, page = (
        tmp_path / name for name in ("alone.png", "both.png", "both.html")
    )
    assert main([*command, "--out", str(alone), "--alone"]) == 0
    assert "(exact)" in capsys.readouterr().out
    for path in (both, page):
        assert main([*command, "--surface", "ellipsoid", "--out", str(path)]) == 0
    # three sections, and the ellipsoid in green over them
    green = np.array([0, 158, 115])
    for path, expected in ((alone, False), (both, True)):
        with Image.open(path) as picture:
            pixels = np.asarray(picture.convert("RGB")).astype(int)
        assert (np.abs(pixels - green).max(axis=-1) < 20).any() == expected
    assert page.read_text(encoding="utf-8").count('"type":"surface"') >= 2


# ---------------------------------------------------------------------- bench


@dataclasses.dataclass
class Line:
    name: str
    value: float
    unit: str
    baseline: str | None
    baseline_value: float | None
    ratio: float | None


LINES = [
    Line("import", 0.1, "s", None, None, None),
    Line("table.build", 0.004, "s", "published", 0.4, 0.01),
]


@pytest.fixture
def measured(monkeypatch):
    calls = []

    def run(names, *, full, rounds, progress):
        calls.append((names, full))
        progress("import")
        return LINES

    monkeypatch.setattr("planarfriction_studies.bench.run", run)
    return calls


def test_bench_prints_json_and_nothing_else(capsys, measured):
    assert (
        main(["bench", "--json", "--full", "--only", "import", "--only", "table.build"])
        == 0
    )
    assert json.loads(capsys.readouterr().out) == [
        dataclasses.asdict(line) for line in LINES
    ]
    assert measured == [(["import", "table.build"], True)]


def test_bench_prints_a_table(capsys, measured):
    assert main(["bench"]) == 0
    rows = table_rows(capsys.readouterr().out)
    assert rows == [
        ["import", "0.1 s"],
        ["table.build", "0.004 s", "0.4 s", "0.01", "published"],
    ]
    assert measured == [(None, False)]


def test_an_own_shape_without_parameters_keeps_the_names_of_patches(monkeypatch):
    from planarfriction.families import SHAPES

    SHAPES.register("thumb", lambda: pf.ContactPatch.disc(0.01))
    assert find_patch("disc", {}).name == "disc"


@pytest.mark.parametrize("command", ["run", "sweep"])
def test_the_help_names_every_ready_scene(command):
    assert all(name in str(app.commands[command].help) for name in SCENES)


# ---------------------------------------------------------------------- commands of other packages


@pytest.fixture
def only_the_library(monkeypatch):
    """Take the commands of other packages away, as in an installation of the library alone."""
    entries = [each for each in entry_points(group=GROUP) if each.name == "explore"]
    monkeypatch.setattr("planarfriction.cli.app.entry_points", lambda *, group: entries)
    monkeypatch.setattr(
        app,
        "commands",
        {name: app.commands[name] for name in LIBRARY if name in app.commands},
    )


def test_a_bare_library_says_what_it_has_and_where_the_rest_is(
    only_the_library, monkeypatch, capsys
):
    def missing(name):
        raise PackageNotFoundError(name)

    monkeypatch.setattr("planarfriction.cli.app.distribution", missing)
    assert app.list_commands(click.Context(app)) == LIBRARY
    assert main(["--help"]) == 0
    out = capsys.readouterr().out
    assert " ".join(out.split()).endswith(ELSEWHERE) and "bench" not in re.findall(
        r"^  (\S+)", out, re.MULTILINE
    )
    assert main(["bench"]) == 2
    assert "No such command 'bench'" in capsys.readouterr().err


@pytest.mark.parametrize("folder", [".", "studies"])
def test_entry_points_of_each_distribution_are_its_commands(folder):
    project = Path(__file__).parents[2] / folder / "pyproject.toml"
    if not project.exists():
        pytest.skip("no project beside these tests")
    entries = tomllib.loads(project.read_text(encoding="utf-8"))["project"][
        "entry-points"
    ][GROUP]
    for name, value in entries.items():
        command = EntryPoint(name, value, GROUP).load()
        assert (
            isinstance(command, click.Command)
            and command.name == {"referee": "simulator-benchmark"}.get(name, name)
            and command.get_short_help_str()
        )
    listed = app.list_commands(click.Context(app))
    assert set(entries) - {"referee"} < set(listed) and ELSEWHERE not in app.get_help(
        click.Context(app)
    )


def test_the_simulator_benchmark_has_an_alias_that_help_does_not_list():
    context = click.Context(app)
    benchmark = app.get_command(context, "simulator-benchmark")
    assert benchmark is app.get_command(context, "referee")
    listed = app.list_commands(context)
    assert "simulator-benchmark" in listed and "referee" not in listed


def test_commands_of_ones_own_package_are_added_but_replace_none(monkeypatch, capsys):
    @click.command()
    def hello():
        print("hello")

    entries = [
        SimpleNamespace(name=name, load=lambda: hello) for name in ("hello", "run")
    ]
    monkeypatch.setattr(app, "commands", dict(app.commands))
    monkeypatch.setattr("planarfriction.cli.app.entry_points", lambda *, group: entries)
    assert main(["hello"]) == 0
    assert capsys.readouterr().out == "hello\n"
    assert app.commands["run"] is not hello


def test_options_of_maps_on_the_command_line(capsys, tmp_path):
    (tmp_path / "pad.csv").write_text("0,1,2\n5,6,1\n\n7,8,9\n5,0,5\n")
    command = [
        "limit-surface",
        "--patch",
        str(tmp_path / "pad.csv"),
        "--width",
        "0.003",
    ]
    assert "first row is 0, 1, 2: labels" in fails(capsys, *command)
    assert "frame must be one of the 2 frames" in fails(capsys, *command, "--no-header")
    assert main([*command, "--no-header", "--frame", "1", "--threshold", "0.6"]) == 0
    assert re.search(r"loaded cells\W+3\b", capsys.readouterr().out)
    assert "--frame must be given only for a pressure map" in fails(
        capsys, "limit-surface", "--frame", "1"
    )
    assert main(["limit-surface", "--patch", "disc", "--width", "0.002"]) == 0
    assert re.search(r"contact radius r \[mm\]\W+0.66", capsys.readouterr().out)
