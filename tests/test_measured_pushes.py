"""The example on measured pushes, on pushes that the library itself made: the feet that went in explain them."""

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

without_quartic = importlib.util.find_spec("cvxpy") is None
needs_quartic = pytest.mark.skipif(without_quartic, reason="cvxpy is not installed: the convex quartic is an extra")

SCRIPT = Path(__file__).parents[1] / "examples" / "measured_pushes.py"
FEET = np.array([[-0.04, -0.04], [0.08, -0.04], [-0.04, 0.08]])
SHARES = np.array([0.5, 0.2, 0.3])
NOISE = 0.02  # of the unit twist, in each direction across it: 1.15 deg


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


def tables(stretch=None) -> dict[str, pd.DataFrame]:
    """Two layouts of 45 pushes with known friction, one on feet and one flat, in the columns of the measured files.

    `stretch` is L of the board's metric `L L`.
    """
    random, rows = np.random.default_rng(2), []
    flat = pf.LimitSurfaceCells(pf.ContactPatch.polygon(1.25 * FEET, cells=21))
    for config in ("feet", "flat"):
        for push in range(45):
            heading, turn = random.uniform(-3.0, 3.0), random.normal(0.0, 0.1)
            twist = random.normal(size=3) * [0.1, 0.1, 2.0]
            if config == "flat":
                wrench = -5.0 * flat.wrench(twist)
            else:
                wrench = pushed(twist, heading + 0.5 * turn, np.eye(2) if stretch is None else stretch)
            scaled = twist * [1.0, 1.0, 0.05] / np.linalg.norm(twist * [1.0, 1.0, 0.05])
            scaled = 0.01 * (scaled + NOISE * random.normal(size=3))
            row = {"config": config, "surface": "hardboard", "push": push, "world_theta0_rad": heading + 0.5 * turn}
            row |= dict(zip(("fx_N", "fy_N", "tau_Nm"), wrench, strict=True))
            row |= dict(zip(("dx_m", "dy_m", "dtheta_rad"), scaled / [1.0, 1.0, 0.05], strict=True))
            rows.append(row | {"world_theta0_rad": row["world_theta0_rad"] - 0.5 * row["dtheta_rad"]})
    kinds = {"feet": ("point", FEET, SHARES), "flat": ("uniform_triangle_vertex", 1.25 * FEET, [np.nan] * 3)}
    supports = [
        {"config": name, "kind": kind, "x_m": x, "y_m": y, "load_fraction": share, "muN_authors_N": 5.0}
        for name, (kind, places, shares) in kinds.items()
        for (x, y), share in zip(places, shares, strict=True)
    ]
    published = [
        {
            "config": "feet",
            "tested_on": "measured_holdout",
            "method": method,
            "n_train": 30,
            "mean_deg": mean,
            "sd_over_splits_deg": 1.0,
            "n_splits": 15,
        }
        for method, mean in (("poly4_convex", 7.75), ("gp", 8.25), ("quadratic_ellipsoid", 9.25))
    ]
    return {
        "pushes": pd.DataFrame(rows),
        "supports": pd.DataFrame(supports),
        "published_errors": pd.DataFrame(published),
    }


def pushed(twist, heading: float, stretch) -> np.ndarray:
    """Wrench of the pusher `[3]`, from the sum over the feet in board axes."""
    cos, sin = np.cos(heading), np.sin(heading)
    turn = np.array([[cos, -sin], [sin, cos]])
    metric = turn.T @ stretch @ turn
    velocity = (twist[:2] + twist[2] * FEET @ np.array([[0.0, 1.0], [-1.0, 0.0]])) @ metric
    traction = velocity / np.linalg.norm(velocity, axis=1)[:, None] @ metric * SHARES[:, None]
    torque = np.sum(FEET[:, 0] * traction[:, 1] - FEET[:, 1] * traction[:, 0])
    return 5.0 * np.array([*traction.sum(axis=0), torque])


def written(folder: Path, **kind) -> Path:
    """A folder with the three files."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, rows in tables(**kind).items():
        rows.to_csv(folder / f"zhou_icra16_{name}.csv", index=False)
    return folder


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return written(tmp_path_factory.mktemp("pushes") / "data")


@needs_quartic
@pytest.mark.quartic
def test_the_patch_explains_its_pushes_to_the_noise(example, folder, tmp_path, capsys):
    assert example.main([str(folder), "--splits", "0", "--out", str(tmp_path / "new" / "folder")]) == 0
    errors = pd.read_csv(tmp_path / "new" / "folder" / "measured_pushes.csv").groupby("config").mean()
    # Noise of 0.02 in both directions across a unit vector: sqrt(pi/2) 0.02 = 1.44 deg in the mean, 0.11 of its error.
    assert errors.patch["feet"] == pytest.approx(1.44, abs=0.35)
    assert errors.patch["flat"] == pytest.approx(1.44, abs=0.45)  # and 31 cells across in the place of 21
    assert errors.ellipsoid["feet"] > 8.0
    assert errors.patch["feet"] < 0.5 * errors.quartic["feet"] < 0.5 * errors.ellipsoid["feet"]
    assert (tmp_path / "new" / "folder" / "measured_pushes.png").read_bytes().startswith(b"\x89PNG")
    printed = capsys.readouterr().out
    assert "7.8" in printed and "8.2" in printed and "9.2" in printed  # theirs
    assert all(len(line) <= 120 for line in printed.splitlines()[:-1])  # the last names the files


def test_the_measured_twist_keeps_its_sign(example, folder):
    """The object goes where it is pushed: a wrench of the other sign would be 180 degrees off."""
    layout = example.read_layouts(folder)[0]
    assert np.einsum("mi,mi->m", layout.wrenches / [1.0, 1.0, 0.05], layout.twists).min() > 0.0
    assert example.error(layout.twists, -layout.twists) == pytest.approx(np.full(45, 180.0))


def test_fits_recover_what_went_in(example, tmp_path):
    """Shares of the load and the board's metric, from 30 pushes with noise."""
    every = np.arange(30)
    layout = example.read_layouts(written(tmp_path / "plain"))[0]
    object.__setattr__(layout, "shares", np.full(3, 1 / 3))
    found = example.fit(*steps(example, "load fractions (2)", layout), layout, every)
    assert found == pytest.approx(SHARES[:2], abs=0.02)  # 1.4 deg of noise, 30 pushes

    grain = np.array([[1.2, 0.1], [0.1, 1.01 / 1.2]])  # determinant 1
    layout = example.read_layouts(written(tmp_path / "grain", stretch=grain))[0]
    a, b = example.fit(*steps(example, "grain (2)", layout), layout, every)
    size = np.hypot(a, b)
    board = np.cosh(size) * np.eye(2) + np.sinh(size) / size * np.array([[a, b], [b, -a]])
    assert board == pytest.approx(grain, abs=0.03)
    exact = example.with_grain(layout, every, np.array([a, b]))
    assert example.error(exact, layout.twists[every]).mean() < 1.9


def steps(example, name, layout):
    """Prediction, start and first steps of a fit."""
    predict, start, first = example.FITS[name]
    return predict, start(layout), first


def test_splits_hold_out_and_repeat(example):
    sets = example.splits(20, 50, 3)
    for chosen, test in sets:
        assert len(chosen) == 30 and len(test) == 10
        assert not set(chosen) & set(test)
    again = example.splits(20, 50, 3)
    assert all((a == c).all() and (b == d).all() for (a, b), (c, d) in zip(sets, again, strict=True))


@needs_quartic
@pytest.mark.quartic
def test_fits_are_shown(example, folder, capsys, monkeypatch):
    monkeypatch.setattr(example, "FITS", {"load fractions (2)": example.FITS["load fractions (2)"]})
    assert example.main([str(folder / "zhou_icra16_pushes.csv"), "--splits", "2"]) == 0  # a file stands for its folder
    printed = capsys.readouterr().out
    assert "load fractions (2)" in printed and "quartic (15)" in printed and "95 % interval" in printed


def test_without_cvxpy_all_but_the_quartic_runs_and_the_rest_is_named(example, folder, tmp_path, capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "cvxpy", None)  # an import of it raises
    monkeypatch.setattr(example, "FITS", {"load fractions (2)": example.FITS["load fractions (2)"]})
    assert example.main([str(folder), "--splits", "1", "--out", str(tmp_path)]) == 0
    printed = capsys.readouterr().out
    first, tables = printed.split("\n", 1)
    assert "quartic" in first and "pip install 'planarfriction[quartic]'" in first
    assert "quartic of it" not in tables and "quartic (15)" not in tables  # that of the authors stays
    assert "ellipsoid of it" in tables and "load fractions (2)" in tables
    assert list(pd.read_csv(tmp_path / "measured_pushes.csv")) == ["config", "push", "patch", "ellipsoid"]
    assert (tmp_path / "measured_pushes.png").exists()


def test_interrupt_keeps_what_is_done(example, folder, capsys, monkeypatch):
    def stop(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(example, "fit", stop)
    assert example.main([str(folder), "--splits", "1"]) == 130
    captured = capsys.readouterr()
    assert "0 of 2 layouts" in captured.err and "nothing fitted" in captured.out


@pytest.mark.parametrize(
    ("name", "change", "word"),
    [
        ("pushes", lambda t: t.drop(columns=["fy_N", "dx_m"]), "no column fy_N, dx_m"),
        ("pushes", lambda t: t.assign(fx_N="left"), "column fx_N, row 1"),
        ("pushes", lambda t: t[:20], "40 pushes or more"),
        ("pushes", lambda t: t.assign(dx_m=0.0, dy_m=0.0, dtheta_rad=0.0), "none without force or motion"),
        ("pushes", lambda t: t[:0], "holds no pushes"),
        ("supports", lambda t: t[1:], "needs three rows for feet"),
        ("supports", lambda t: t.assign(load_fraction=np.nan), "column load_fraction"),
        ("published_errors", lambda t: t.drop(columns=["method"]), "no column method"),
    ],
)
def test_bad_files_are_one_line_and_exit_code_2(example, tmp_path, capsys, name, change, word):
    for each, rows in tables().items():
        rows = change(rows) if each == name else rows
        rows.to_csv(tmp_path / f"zhou_icra16_{each}.csv", index=False)
    message = refused(example, [str(tmp_path)], capsys)
    assert f"zhou_icra16_{name}.csv" in message and word in message, message


@pytest.mark.parametrize(
    ("options", "word"),
    [
        ([], "path"),
        (["none"], "no such file"),
        (["DATA", "--splits", "-1"], "--splits must be an integer >= 0"),
        (["DATA", "--seed", "-1"], "--seed must be an integer >= 0"),
        (["DATA", "--out", "FILE"], "cannot be made a folder"),
        (["DATA", "--fast"], "--fast"),
    ],
)
def test_bad_options_are_one_line_and_exit_code_2(example, folder, tmp_path, capsys, options, word):
    file = tmp_path / "file"
    file.touch()
    replaced = {"DATA": str(folder), "FILE": str(file)}
    assert word in refused(example, [replaced.get(option, option) for option in options], capsys)


def refused(example, options, capsys) -> str:
    with pytest.raises(SystemExit) as stop:
        example.main(options)
    message = capsys.readouterr().err
    assert stop.value.code == 2
    assert message.startswith("error: ") and message.count("\n") == 1, message
    return message


def test_runs_as_a_script(tmp_path):
    """From any folder, without a traceback."""
    environment = {**os.environ, "PYTHONPATH": str(Path(pf.__file__).parents[1])}
    command = [sys.executable, str(SCRIPT), "none"]
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=120)
    assert done.returncode == 2
    assert done.stderr.startswith("error: none") and done.stderr.endswith("no such file\n")
