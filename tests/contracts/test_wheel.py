"""The wheel, installed into an empty environment, does what the checkout does: nothing is missing from it."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys

import pytest

from planarfriction.cli.app import ELSEWHERE
from tests.support.repository import ROOT, script

DISTRIBUTIONS = script(".ci/check_dist.py").DISTRIBUTIONS

LOG = """
import numpy as np
import planarfriction as pf

law = pf.LuGre(mu_c=0.5, mu_s=0.65, v_s=2e-3, sigma_0=2e4, sigma_1=30.0, elasto_plastic=pf.ElastoPlastic(0.9))
model, dt = pf.ReducedModelPublished(pf.ContactPatch.disc(0.01, 11), law), 1e-3
t = dt * np.arange(400)
twists = np.sin(np.array([[14.0], [11.0], [20.0]]) * t) * np.array([[0.03], [0.02], [2.0]])
state, rows = model.rest(), []
for time, twist in zip(t, twists.T):
    state, wrench = model.step(state, twist, 2.0, dt)
    rows.append([time, *twist, *wrench, 2.0])
np.savetxt("log.csv", rows, delimiter=",", header="t,vx,vy,omega,fx,fy,tau,normal_force", comments="")
"""


@pytest.mark.slow
def test_wheel_in_an_empty_environment(tmp_path):
    source = tmp_path / "source"
    elsewhere = tmp_path / "elsewhere"
    for folder in (".", "studies"):
        ignored = shutil.ignore_patterns("__pycache__", "*.egg-info")
        shutil.copytree(ROOT / folder / "src", source / folder / "src", ignore=ignored)
        for name in ("pyproject.toml", "README.md", "LICENSE"):
            shutil.copy(ROOT / folder / name, source / folder)
    shutil.copy(ROOT / "build_backend.py", source)
    elsewhere.mkdir()
    environment = {
        name: value
        for name, value in os.environ.items()
        if not name.startswith(("PYTHON", "NUMBA"))
    }

    def run(*command) -> str:
        done = subprocess.run(
            [str(word) for word in command],
            cwd=elsewhere,
            env=environment,
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout + done.stderr

    run(
        sys.executable,
        "-m",
        "pip",
        "wheel",
        "--no-deps",
        "--wheel-dir",
        tmp_path,
        source,
        source / "studies",
    )
    run(sys.executable, "-m", "venv", tmp_path / "empty")
    python = tmp_path / "empty" / "bin" / "python"
    wheels = {name: next(tmp_path.glob(f"{name}-*.whl")) for name in DISTRIBUTIONS}
    for name, kind in DISTRIBUTIONS.items():
        assert wheels[name].stat().st_size < kind.most
    run(python, "-m", "pip", "install", wheels["planarfriction"])
    command = python.with_name("planarfriction")
    listed = run(command, "--help")
    assert " ".join(listed.split()).endswith(ELSEWHERE)
    assert run(python, "-m", "planarfriction", "--help") == listed
    for name in re.findall(
        r"^  (\w[\w-]*)", listed.partition("Commands:")[2], re.MULTILINE
    ):
        run(command, name, "--help")
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    (code,) = re.findall(r"^```python\n(.*?)^```$", readme, re.MULTILINE | re.DOTALL)
    assert "success" in run(python, "-c", code)
    run(python, "-c", LOG)
    assert "times faster than real time" in run(command, "run", "in-hand")
    run(python, "-m", "pip", "install", "--no-deps", wheels["planarfriction_studies"])
    assert "0 out of tolerance" in run(
        command, "reproduce", "--only", "drift", "--quick"
    )
    assert "exact surface" in run(command, "measured", "--list") and "in_hand" in run(
        command, "bench", "--help"
    )
    asked = subprocess.run(
        [command, "explore"],
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert (
        asked.returncode == 2
        and "run pip install 'planarfriction[explore]'" in asked.stderr
    )
    start = [
        "--start=mu_s=0.65",
        "--start=v_s=2e-3",
        "--start=sigma_0=2e4",
        "--start=sigma_1=30",
    ]
    found = run(
        command,
        "identify",
        "log.csv",
        "--patch",
        "disc",
        "--parameters",
        "mu_c,contact_radius",
        "--starts",
        "1",
        *start,
    )
    assert "mu_c" in found
