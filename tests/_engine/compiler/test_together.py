"""Processes that compile at once."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import time

import pytest

from planarfriction._engine.compiler import parallel
from planarfriction._engine.compiler.parallel import Crew

WRITES = "from pathlib import Path; from planarfriction._engine.compiler.parallel import serve; serve(lambda job: {})"
"""Code of a process whose jobs do something."""

FIRST_RUN = """
import os, sys
import numba.core.event as events
import planarfriction as pf
from planarfriction._engine.compiler import threads

class Count(events.Listener):
    names = []
    def on_start(self, event):
        self.names.append(event.data["dispatcher"].py_func.__name__)
    def on_end(self, event):
        pass

events.register("numba:compile", Count())
threads.processors = lambda: int(sys.argv[1])
patch = pf.ContactPatch.disc(radius=0.01, cells=5)
solution = pf.simulate(pf.scenes.in_hand(pf.DistributedModel(patch, pf.LuGre(mu_s=1.2))), t_end=0.01)
print(float(solution.data.x[-1]).hex(), *Count.names)
"""


def served(tmp_path, work: str) -> str:
    return WRITES.format(work.format(f"Path({str(tmp_path)!r}, str(job))"))


def test_another_process_takes_jobs_from_the_last_on(tmp_path):
    with Crew(served(tmp_path, "{}.touch()"), range(3), processes=1) as crew:
        patience = time.monotonic() + 60.0
        while len(crew.seconds) < 3 and time.monotonic() < patience:
            time.sleep(0.01)
        assert list(crew.seconds) == [2, 1, 0] and all(
            seconds > 0.0 for seconds in crew.seconds.values()
        )
        assert not any(crew.take(job) for job in range(3))
    assert sorted(os.listdir(tmp_path)) == ["0", "1", "2"]


def test_a_job_is_done_once(tmp_path):
    """Here or there: whoever comes first takes it, and the other waits for its end."""
    with Crew(
        served(tmp_path, "{}.touch(exist_ok=False)"), range(20), processes=2
    ) as crew:
        here = [job for job in range(20) if crew.take(job)]
        for job in here:
            (tmp_path / str(job)).touch(exist_ok=False)
    assert sorted([*here, *crew.seconds]) == list(range(20))
    assert len(os.listdir(tmp_path)) == 20


@pytest.mark.parametrize("work", ["1 / 0", "__import__('os')._exit(0)"])
def test_jobs_of_a_process_that_ends_come_back(tmp_path, work):
    with Crew(served(tmp_path, work), range(3), processes=1) as crew:
        assert [crew.take(job) for job in range(3)] == [True] * 3
    assert crew.seconds == {}


def test_a_process_at_work_is_ended_with_the_block(tmp_path):
    begin = time.monotonic()
    with Crew(
        served(tmp_path, "(({}).touch(), __import__('time').sleep(1000))"),
        [0],
        processes=1,
    ):
        while not (tmp_path / "0").exists() and time.monotonic() < begin + 60.0:
            time.sleep(0.01)
    assert time.monotonic() < begin + 90.0


@pytest.mark.parametrize(
    "executable", ["", "/opt/blender/blender", shutil.which("sh") or "sh"]
)
def test_nothing_is_shared_by_programs_that_are_not_python(monkeypatch, executable):
    assert parallel.possible()
    monkeypatch.setattr(sys, "executable", executable)
    assert not parallel.possible()


@pytest.mark.slow
def test_first_runs_that_compile_together_find_the_same(tmp_path):
    """To the last bit, and with less to compile in each process."""
    runs = []
    for processors in (1, 2):
        where = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / str(processors))}
        command = [sys.executable, "-c", FIRST_RUN, str(processors)]
        runs.append(
            subprocess.run(
                command, env=where, capture_output=True, text=True, check=True
            ).stdout.split()
        )
    alone, with_another = runs
    assert alone[0] == with_another[0]
    assert "advance" in alone and "advance" not in with_another
    assert len(with_another) < len(alone)
