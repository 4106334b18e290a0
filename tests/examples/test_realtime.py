"""examples/realtime: built from an exported model, and run beside the same loops in Python."""

import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

import planarfriction as pf
from planarfriction.cli import main
from planarfriction.cli.export import read_model

FOLDER = Path(__file__).parents[2] / "examples" / "realtime"


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """Build the example with a model's library; return the folder of its programs, and the model."""
    missing = [each for each in ("cmake", "gcc", "g++") if shutil.which(each) is None]
    if missing:
        pytest.skip(f"needs {' and '.join(missing)}")
    folder = tmp_path_factory.mktemp("realtime") / "source"
    shutil.copytree(FOLDER, folder)
    assert (
        main(["export", str(folder / "model.toml"), "--out", str(folder / "friction")])
        == 0
    )
    for command in (["cmake", "-S", ".", "-B", "build"], ["cmake", "--build", "build"]):
        subprocess.run(command, cwd=folder, check=True, capture_output=True)
    return folder / "build", read_model(folder / "model.toml", None)


def output(built, name):
    """Return the lines that a program prints."""
    return subprocess.run(
        [built[0] / name], check=True, capture_output=True, text=True
    ).stdout.splitlines()


def test_loop(built):
    """Speeds and forces are those of the same implicit steps in Python, sticking, sliding and at rest again."""
    body = pf.SlidingBody(0.2, 1e-4, built[1])
    dt = 1e-3
    state = body.rest()
    twist = np.zeros(3)
    rows = []
    for i in range(1000):
        state, twist, wrench = body.step(
            state, twist, 2.0, dt, (4e-3 * i if i < 700 else 0.0, 0.0, 0.0)
        )
        if i % 100 == 99:
            rows.append([(i + 1) * dt, twist[0], wrench[0]])
    found = np.array([line.split() for line in output(built, "loop")], float)
    np.testing.assert_allclose(found, rows, atol=2e-9)  # as many digits are printed
    assert found[2, 1] < 1e-4 < found[6, 1] and abs(found[-1, 1]) < 1e-6


def test_contact(built):
    model = built[1]
    state = built[1].rest()
    for _ in range(99):  # one of a hundred was broken
        state, wrench = model.step(state, (0.01, 0.0, 1.0), 2.0, 1e-3)
    said, numbers = output(built, "contact")
    assert said == "step 50: kept the last wrench"
    np.testing.assert_allclose(np.array(numbers.split(), float), wrench, atol=2e-9)
