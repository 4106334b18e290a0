"""Compiling ahead, and first runs in several processes and threads at once."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import planarfriction as pf

COUNTING = """
import numba.core.event as events
import planarfriction as pf

class Count(events.Listener):
    started = 0
    def on_start(self, event):
        Count.started += 1
    def on_end(self, event):
        pass

events.register("numba:compile", Count())
pf.warm_up()
print(Count.started)
"""

FIRST_RUN = """
import planarfriction as pf

patch = pf.ContactPatch.disc(radius=0.01, cells=5)
model = pf.ReducedModelPublished(patch, pf.LuGre(mu_s=1.2))
print(float(pf.simulate(pf.scenes.in_hand(model), t_end=0.1).data.x[-1]))
"""

THREADS = """
from concurrent.futures import ThreadPoolExecutor
import planarfriction as pf

patch, law = pf.ContactPatch.disc(radius=0.01, cells=5), pf.LuGre(mu_s=1.2)
kinds = [pf.DistributedModel, pf.ReducedModelPublished] * 2
run = lambda kind: float(pf.simulate(pf.scenes.in_hand(kind(patch, law)), t_end=0.1).data.x[-1])
with ThreadPoolExecutor(4) as pool:
    at_once = list(pool.map(run, kinds))
assert at_once == [run(kind) for kind in kinds], at_once
"""


def started(code: str, cache=None) -> subprocess.Popen:
    where = os.environ if cache is None else {**os.environ, "NUMBA_CACHE_DIR": str(cache)}
    command = [sys.executable, "-c", code]
    return subprocess.Popen(command, env=where, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def result(process: subprocess.Popen) -> str:
    out, error = process.communicate()
    assert process.returncode == 0, error
    return out.strip()


def test_what_was_compiled_ahead_is_not_compiled_again():
    told: list[str] = []
    times = pf.warm_up(progress=told.append)
    assert list(times) == told and len(told) > 5
    assert all(seconds > 0.0 for seconds in times.values())
    assert result(started(COUNTING)) == "0"


@pytest.mark.slow
def test_two_first_runs_at_once(tmp_path):
    pair = [started(FIRST_RUN, tmp_path) for _ in range(2)]
    first, second = (result(process) for process in pair)
    assert first == second == result(started(FIRST_RUN, tmp_path))  # compiled or read from the cache: to the last bit


@pytest.mark.slow
def test_first_runs_in_several_threads(tmp_path):
    result(started(THREADS, tmp_path))


@pytest.mark.slow
def test_a_read_only_installation_uses_the_cache_of_the_user(tmp_path):
    installed = tmp_path / "planarfriction"
    shutil.copytree(Path(pf.__file__).parent, installed, ignore=shutil.ignore_patterns("__pycache__"))
    (installed / "kernels" / "__pycache__").write_text("nothing can be written beside the sources")
    where = {**os.environ, "PYTHONPATH": str(tmp_path), "XDG_CACHE_HOME": str(tmp_path / "cache")}
    where.pop("NUMBA_CACHE_DIR", None)
    counting = COUNTING.replace("pf.warm_up()", FIRST_RUN.strip())
    counts = []
    for _ in range(2):
        run = subprocess.run([sys.executable, "-c", counting], env=where, capture_output=True, text=True, check=True)
        counts.append(int(run.stdout.split()[-1]))
    assert counts[0] > 0 and counts[1] == 0
    assert any((tmp_path / "cache").rglob("*.nbi"))
