"""The example on measured slides, on slides that the library itself made: the friction that went in comes out."""

from __future__ import annotations

import importlib.util
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import planarfriction as pf

SCRIPT = Path(__file__).parents[1] / "examples" / "measured_slides.py"
MU = 0.31
RATE = 148.0  # samples per second, as measured


@pytest.fixture(scope="module")
def example():
    """The script as a module."""
    sys.path.insert(0, str(SCRIPT.parent))  # where Python looks first when it runs the script
    spec = importlib.util.spec_from_file_location(SCRIPT.stem, SCRIPT)
    module = importlib.util.module_from_spec(spec)
    sys.modules[SCRIPT.stem] = module  # dataclasses look their module up
    spec.loader.exec_module(module)
    yield module
    sys.path.remove(str(SCRIPT.parent))
    del sys.modules[SCRIPT.stem]


def slides(count: int = 8) -> pd.DataFrame:
    """Slides of a uniform square with friction MU, in the columns of the measured file.

    The first ends before the cube stops; the last two are one slide and its copy, turned by 1 rad.
    """
    patch = pf.ContactPatch.rectangle(0.1048, cells=11)
    law = pf.LuGre(mu_c=MU, mu_s=MU, sigma_0=1e6, sigma_1=20.0, sigma_2=0.0, elasto_plastic=pf.ElastoPlastic(0.9))
    random = np.random.default_rng(3)
    tables = []
    for toss in range(count):
        heading = random.uniform(-np.pi, np.pi)
        speed, spin = random.uniform(0.3, 0.7), random.uniform(-3.6, 3.6)
        start = (speed * np.cos(heading), speed * np.sin(heading), spin)
        scene = pf.scenes.free_slide(pf.DistributedModel(patch, law), mass=0.37, inertia=8.10e-4, twist=start)
        data = pf.simulate(scene, save_every=1.0 / RATE / 4, rtol=1e-4, atol=0.1).data
        time = np.arange(round((0.08 if toss == 0 else 0.35) * RATE)) / RATE
        turn = random.uniform(-np.pi, np.pi)  # the whole slide, so that cubes start at any yaw
        at = {name: np.interp(time, data.time, data[name]) for name in ("x", "y", "theta", "vx", "vy", "omega")}
        (x, y), (vx, vy) = turned(at["x"], at["y"], turn), turned(at["vx"], at["vy"], turn)
        columns = {
            "x_m": x,
            "y_m": y,
            "yaw_rad": at["theta"] + turn,
            "vx_mps": vx,
            "vy_mps": vy,
            "wz_radps": at["omega"],
        }
        sliding = (np.hypot(at["vx"], at["vy"]) > 0.02).astype(int)
        table = pd.DataFrame({"toss": toss, "t_s": time, **columns, "sliding": sliding, "unique_id": 10 * toss})
        tables.append(table)
    last = tables[-1]
    (x, y), (vx, vy) = turned(last.x_m, last.y_m, 1.0), turned(last.vx_mps, last.vy_mps, 1.0)
    tables.append(last.assign(toss=count, x_m=x, y_m=y, vx_mps=vx, vy_mps=vy, yaw_rad=last.yaw_rad + 1.0))
    return pd.concat(tables)


def turned(x, y, angle):
    """Components of vectors turned counter-clockwise by `angle` [rad]."""
    return np.cos(angle) * x - np.sin(angle) * y, np.sin(angle) * x + np.cos(angle) * y


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    """A file of slides."""
    path = tmp_path_factory.mktemp("slides") / "slides.csv.gz"
    slides().to_csv(path, index=False)
    return path


def test_fit_recovers_the_friction_and_the_poses(example, path, tmp_path, capsys):
    assert example.main([str(path), "--seed", "1", "--out", str(tmp_path / "new" / "folder")]) == 0
    errors = pd.read_csv(tmp_path / "new" / "folder" / "measured_slides.csv")
    assert list(dict.fromkeys(errors.model)) == list(example.MODELS)
    square = errors[errors.model == "distributed square"]
    # The search stops within 5e-3 in 1/mu, 1.6e-3 of mu, which is 1.6e-3 of 0.11 m of sliding or less.
    assert square.mu.iloc[0] == pytest.approx(MU, rel=1.6e-3)
    assert square.final_mm.max() < 0.2
    assert square.final_deg.max() < 0.2
    # The reduced model with the table slides like its patch (bilinear table: 1 % of the wrench) ...
    table = errors[errors.model == "reduced, table"]
    assert table.mu.iloc[0] == pytest.approx(MU, rel=5e-3)
    assert table.final_deg.max() < 0.5
    # ... and without coupling the cube turns far too little.
    assert errors[errors.model == "uncoupled Coulomb"].final_deg.median() > 1.0
    assert (tmp_path / "new" / "folder" / "measured_slides.png").read_bytes().startswith(b"\x89PNG")
    printed = capsys.readouterr().out
    assert all(name in printed for name in example.MODELS)
    assert all(len(line) <= 120 for line in printed.splitlines()[:-1])  # the last names the files


def test_copies_stay_on_one_side_and_the_split_is_reproducible(example, path):
    tosses = example.read_tosses(path)
    assert [toss.stopped for toss in tosses] == [False] + 8 * [True]
    for seed in range(20):
        fit, test = example.split(tosses, seed)
        assert sorted(toss.number for toss in [*fit, *test]) == list(range(9))
        assert not {toss.unique_id for toss in fit} & {toss.unique_id for toss in test}
        again, _ = example.split(tosses, seed)
        assert [toss.number for toss in again] == [toss.number for toss in fit]
    fit, test = example.split(tosses, 0, 4)
    assert len({toss.unique_id for toss in [*fit, *test]}) == 4


def test_uncoupled_coulomb_in_closed_form(example):
    """v^2/(2 mu g) and omega^2 I/(2 mu m g r), each until its own stop; r of a uniform square is 0.3826 sides."""
    toss = example.Toss(0, 0, np.array([0.0, 10.0]), np.zeros((2, 3)), np.array([0.3, -0.4, -2.0]), True)
    way, turn = 0.5**2 / (2 * MU * 9.81), 2.0**2 * 8.10e-4 / (2 * MU * 0.37 * 9.81 * 0.3826 * 0.1048)
    # r comes from 11 x 11 cells at their centres: low by half of 1/11^2.
    expected = pytest.approx([0.6 * way, -0.8 * way, -turn], rel=4.2e-3)
    assert list(example.uncoupled(MU, toss)[-1]) == expected


def test_turned_slides_have_turned_ends(example):
    """Turned by 35 degrees, the end is turned and nothing else: wrong where the initial yaw, or its sign, is lost."""
    angle, time = np.radians(35.0), np.linspace(0.0, 0.4, 20)
    turn = np.array([[np.cos(angle), -np.sin(angle), 0.0], [np.sin(angle), np.cos(angle), 0.0], [0.0, 0.0, 1.0]])
    start, twist = np.array([0.1, 0.2, 0.3]), np.array([0.5, 0.1, 2.0])
    for name, predict in example.MODELS.items():
        still = example.Toss(0, 0, time, np.tile(start, (20, 1)), twist, True)
        turned = example.Toss(1, 1, time, np.tile(turn @ start + [0.0, 0.0, angle], (20, 1)), turn @ twist, True)
        end, turned_end = predict(MU, still)[-1], predict(MU, turned)[-1]
        # The solver keeps 1e-4 of the motion: 0.04 m and 0.5 rad.
        assert turned_end == pytest.approx(turn @ end + [0.0, 0.0, angle], abs=1e-4), name
        assert np.hypot(*(end - start)[:2]) > 0.03, name


def test_interrupt_keeps_what_is_done(example, path, capsys, monkeypatch):
    def stop(mu, toss):
        raise KeyboardInterrupt

    monkeypatch.setitem(example.MODELS, "four corners", stop)
    monkeypatch.setitem(example.MODELS, "distributed square", example.uncoupled)
    assert example.main([str(path)]) == 130
    captured = capsys.readouterr()
    assert "2 of 5 models" in captured.err
    assert "distributed square" in captured.out
    assert "four corners" not in captured.out


def test_a_fit_at_the_edge_of_its_range_says_so(example, capsys):
    """A cube that does not slow down, as if the lengths were in another unit."""
    time = np.array([0.0, 0.3])
    toss = example.Toss(0, 0, time, np.array([[0.0, 0.0, 0.0], [1.5, 0.0, 0.3]]), np.array([5.0, 0.0, 1.0]), False)
    example.fit_mu(example.uncoupled, [toss], lambda tosses, what: tosses)
    assert "edge" in capsys.readouterr().err


def bad_files(folder: Path) -> dict[str, tuple[Path, str]]:
    """Files that cannot be used, and a word of what is said about each."""
    table = slides(2)
    variants = {
        "columns": (table.drop(columns=["yaw_rad", "sliding"]), "no column yaw_rad, sliding"),
        "text": (table.assign(x_m="left"), "column x_m, row 1"),
        "missing value": (table.assign(vx_mps=np.where(table.toss == 1, np.nan, table.vx_mps)), "column vx_mps"),
        "backwards": (table[::-1], "increasing"),
        "one toss": (table[table.toss == 0], "two tosses"),
        "no rows": (table[:0], "two tosses"),
    }
    files = {}
    for name, (rows, word) in variants.items():
        files[name] = (folder / f"{name}.csv", word)
        rows.to_csv(files[name][0], index=False)
    raw = {"empty": ("csv", b""), "binary": ("csv", bytes(range(256))), "not gzip": ("csv.gz", b"toss,t_s\n1,2\n")}
    for name, (kind, content) in raw.items():
        files[name] = (folder / f"{name}.{kind}", name)
        files[name][0].write_bytes(content)
    whole = folder / "whole.csv.gz"
    table.to_csv(whole, index=False)
    files["cut"] = (folder / "cut.csv.gz", "cut")
    files["cut"][0].write_bytes(whole.read_bytes()[:300])
    return files | {"missing": (folder / "none.csv.gz", "no such file"), "folder": (folder, "cannot be read")}


def test_bad_files_are_one_line_and_exit_code_2(example, tmp_path, capsys):
    for name, (file, word) in bad_files(tmp_path).items():
        with pytest.raises(SystemExit) as stop:
            example.main([str(file)])
        message = capsys.readouterr().err
        assert stop.value.code == 2, name
        assert message.startswith("error: ") and message.count("\n") == 1, message
        assert str(file) in message and word in message, message


@pytest.mark.parametrize(
    ("options", "word"),
    [
        ([], "path"),
        (["PATH", "--tosses", "1"], "--tosses must be an integer >= 2"),
        (["PATH", "--tosses", "few"], "--tosses"),
        (["PATH", "--seed", "-1"], "--seed must be an integer >= 0"),
        (["PATH", "--out", "FILE"], "cannot be made a folder"),
        (["PATH", "--fast"], "--fast"),
    ],
)
def test_bad_options_are_one_line_and_exit_code_2(example, path, tmp_path, capsys, options, word):
    file = tmp_path / "file"
    file.touch()
    replaced = {"PATH": str(path), "FILE": str(file)}
    with pytest.raises(SystemExit) as stop:
        example.main([replaced.get(option, option) for option in options])
    message = capsys.readouterr().err
    assert stop.value.code == 2
    assert message.startswith("error: ") and message.count("\n") == 1 and word in message, message


def test_runs_as_a_script(tmp_path):
    """From any folder, without a traceback."""
    environment = {**os.environ, "PYTHONPATH": str(Path(pf.__file__).parents[1])}
    command = [sys.executable, str(SCRIPT), "none.csv"]
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=120)
    assert done.returncode == 2
    assert done.stderr == "error: none.csv: no such file\n"
