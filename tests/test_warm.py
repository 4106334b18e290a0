"""Compiling ahead, and first runs in several processes and threads at once."""

import io
import os
import random
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import numba
import pytest

import planarfriction as pf
from planarfriction import warm
from planarfriction._engine.compiler import messages, threads
from planarfriction.families import MODELS

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


COMMAND_LINE = (
    "import sys; from planarfriction.cli import main; sys.exit(main(sys.argv[1:]))"
)

INTERRUPTED = {
    "simulate": [f"while True:\n    exec({FIRST_RUN!r})"],
    "warm_up": ["import planarfriction as pf; pf.warm_up()"],
    "run": [COMMAND_LINE, "run", "in-hand"],
    "warm": [COMMAND_LINE, "warm"],
    "reproduce": [COMMAND_LINE, "reproduce", "--only", "drift", "--quick"],
}
"""Runs that compile for some seconds at least."""


def started(code, cache=None, *arguments):
    where = (
        os.environ if cache is None else {**os.environ, "NUMBA_CACHE_DIR": str(cache)}
    )
    # what runs in the background of a plain shell ignores Ctrl-C, and hands that down
    heeds = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)\n"
    command = [sys.executable, "-c", heeds + code, *arguments]
    return subprocess.Popen(
        command, env=where, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )


def result(process):
    out, error = process.communicate()
    assert process.returncode == 0, error
    return out.strip()


def test_what_was_compiled_ahead_is_not_compiled_again():
    told = []
    times = pf.warm_up(progress=told.append)
    assert list(times) == told and "joints" in told  # by processes beside this one
    assert {f"{kind}, {model}" for kind in warm._WORK for model in MODELS} < set(told)
    assert all(seconds > 0.0 for seconds in times.values())
    assert result(started(COUNTING)) == "0"


class Terminal(io.StringIO):
    def isatty(self):
        return True


@pytest.mark.parametrize(
    ("stream", "module", "lines"),
    [
        (Terminal, "planarfriction._engine.coupled.steps", 1),
        (io.StringIO, "planarfriction._engine.coupled.steps", 0),
        (Terminal, "mine", 0),
        (Terminal, None, 0),
    ],
)
def test_the_first_function_that_is_compiled_says_so(
    monkeypatch, stream, module, lines
):
    """Once, to somebody who waits; functions of users say nothing."""
    monkeypatch.setattr(sys, "stderr", stream())
    monkeypatch.setattr(messages._Said, "done", False)
    for _ in range(2):
        function = lambda x: x + 1.0
        function.__module__ = module
        numba.njit(function)(1.0)
    said = sys.stderr.getvalue().splitlines()
    assert len(said) == lines and all(
        "compiles its loops, once after installation" in line for line in said
    )


@pytest.mark.parametrize("processors", [1, 3])
def test_warming_up_names_its_parts_to_somebody_who_waits(monkeypatch, processors):
    """Also where no other process can help: all end at once."""
    monkeypatch.setattr(threads, "processors", lambda: processors)
    monkeypatch.setattr(
        sys,
        "executable",
        shutil.which("false") or pytest.skip("there is no program `false`"),
    )
    monkeypatch.setattr(sys, "stderr", Terminal())
    monkeypatch.setattr(warm, "_parts", lambda: {"first": dict, "second": dict})
    assert list(pf.warm_up()) == ["first", "second"]
    shown = sys.stderr.getvalue()
    assert (
        "\rcompiling: first" in shown
        and "\rcompiling: second" in shown
        and "compiled 2 parts" in shown
    )


@pytest.mark.slow
def test_two_first_runs_at_once(tmp_path):
    pair = [started(FIRST_RUN, tmp_path) for _ in range(2)]
    first, second = (result(process) for process in pair)
    # Compiled or read from the cache: to the last bit.
    assert first == second == result(started(FIRST_RUN, tmp_path))


@pytest.mark.slow
def test_first_runs_in_several_threads(tmp_path):
    result(started(THREADS, tmp_path))


def read_only_installation(folder):
    """Install the package where nothing can be written beside it; returns the environment that has it."""
    installed = folder / "planarfriction"
    shutil.copytree(
        Path(pf.__file__).parent,
        installed,
        ignore=shutil.ignore_patterns("__pycache__"),
    )
    (installed / "__pycache__").write_text("nothing can be written beside the sources")
    where = {
        **os.environ,
        "PYTHONPATH": str(folder),
        "XDG_CACHE_HOME": str(folder / "cache"),
    }
    where.pop("NUMBA_CACHE_DIR", None)
    return where


@pytest.mark.slow
def test_a_read_only_installation_uses_the_cache_of_the_user(tmp_path):
    where = read_only_installation(tmp_path)
    counting = COUNTING.replace("pf.warm_up()", FIRST_RUN.strip())
    counts = []
    for _ in range(2):
        run = subprocess.run(
            [sys.executable, "-c", counting],
            env=where,
            capture_output=True,
            text=True,
            check=True,
        )
        counts.append(int(run.stdout.split()[-1]))
    assert counts[0] > 0 and counts[1] == 0
    assert any((tmp_path / "cache").rglob("*.machine"))


@pytest.mark.slow
def test_without_a_folder_for_machine_code_commands_run_and_say_so(tmp_path):
    where = read_only_installation(tmp_path)
    (tmp_path / "cache").write_text("there is no home either")
    command = [sys.executable, "-c", COMMAND_LINE, "run", "in-hand", "--t-end", "0.01"]
    run = subprocess.run(
        command, env=where, cwd=tmp_path, capture_output=True, text=True, check=True
    )
    (line,) = [line for line in run.stderr.splitlines() if "NUMBA_CACHE_DIR" in line]
    assert line.startswith("warning: compiled code is not kept")
    assert "Traceback" not in run.stderr and "~" not in os.listdir(tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize("what", INTERRUPTED)
def test_ctrl_c_while_compiling_ends_the_run(what, tmp_path):
    code, *arguments = INTERRUPTED[what]
    if what == "reproduce":
        arguments += ["--out", str(tmp_path / "out")]
    draw = random.Random(what)
    for _ in range(4):
        cache = tmp_path / f"{draw.random()}"
        process = started(code, cache, *arguments)
        patience = time.monotonic() + 120.0
        while not any(cache.rglob("*.machine")) and time.monotonic() < patience:
            time.sleep(0.01)
        time.sleep(draw.uniform(0.0, 3.0))
        process.send_signal(signal.SIGINT)
        # A second where the machine is idle; two of these never end alone.
        _, error = process.communicate(timeout=60)
        # -SIGINT: Python ends so, shells call it 130.
        assert process.returncode in (130, -signal.SIGINT), error
        assert "Exception ignored" not in error
    assert result(started(FIRST_RUN, cache)) == result(started(FIRST_RUN))
