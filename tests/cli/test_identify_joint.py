"""`planarfriction identify joint`: friction of a joint from files."""

import json

import numpy as np
import pytest

from planarfriction.cli import main


@pytest.fixture
def files(tmp_path):
    """Write two logs of a motor that turns an inertia of 0.01 against 0.05 N m and 0.02 N m s/rad."""
    t = 2e-3 * np.arange(1000)
    names = []
    for i, speed in enumerate((3.0, 5.0)):
        q = np.sin(speed * t)
        v = speed * np.cos(speed * t)
        a = -(speed**2) * np.sin(speed * t)
        rows = np.column_stack(
            [t, q, 0.01 * a + 0.05 * np.tanh(v / 1e-3) + 0.02 * v, v]
        )
        names.append(str(tmp_path / f"turn {i}.csv"))
        np.savetxt(names[-1], rows, delimiter=",", header="t,q,torque,dq", comments="")
    return names


def test_estimates_are_printed_and_written(files, tmp_path, capsys):
    out = tmp_path / "out"
    assert (
        main(
            [
                "identify",
                "joint",
                *files,
                "--inertia",
                "0.01",
                "--terms",
                "none",
                "--out",
                str(out),
            ]
        )
        == 0
    )
    text = capsys.readouterr().out
    assert "mu_c" in text and "N m s/rad" in text and "turn 0" in text
    stored = json.loads(next(out.glob("*.json")).read_text())
    assert stored["parameters"]["mu_c"]["value"] == pytest.approx(0.05, rel=0.02)
    assert stored["parameters"]["sigma_2"]["value"] == pytest.approx(0.02, rel=0.02)
    assert {each.suffix for each in out.iterdir()} == {".json", ".png", ".h", ".c"}


def test_options_of_a_servo_are_checked(files, capsys):
    assert main(["identify", "joint", *files, "--kp", "1"]) != 0
    assert "--supply must be given with --kp" in capsys.readouterr().err
    assert (
        main(
            [
                "identify",
                "joint",
                *files,
                "--kp",
                "1",
                "--kp",
                "2",
                "--kp",
                "3",
                "--supply",
                "7",
            ]
        )
        != 0
    )
    assert (
        "--kp must be given once, or once for each log, got 3 times"
        in capsys.readouterr().err
    )


def test_help_names_the_subcommand(capsys):
    assert main(["identify", "--help"]) == 0
    assert "identify joint --help" in " ".join(capsys.readouterr().out.split())
