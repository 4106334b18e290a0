"""Other systems, by taking away what they lack: replacing of open files, locks, affinity, modules of POSIX."""

import math
import os
import subprocess
import sys

from planarfriction._engine.compiler.threads import processors
from planarfriction._support import writing
from planarfriction.errors import FileError
from planarfriction_studies.bench import workflows
from tests.support.refusals import refused

POSIX = ("fcntl", "grp", "pty", "pwd", "resource", "termios")


def refusing(monkeypatch, times):
    """Refuse to replace a file a number of times, as Windows does while another program has it open."""
    replace = os.replace
    left = iter(range(times))

    def refused(part, target):
        if next(left, None) is not None:
            raise PermissionError(13, "Access is denied")
        replace(part, target)

    monkeypatch.setattr(os, "replace", refused)
    monkeypatch.setattr(writing, "_PATIENCE", (0.0, 0.0))


def test_a_file_that_is_open_elsewhere_is_tried_again(tmp_path, monkeypatch):
    path = tmp_path / "run.json"
    path.write_text("old")
    refusing(monkeypatch, 2)
    writing.write_text(path, "new")
    assert path.read_text() == "new"
    refusing(monkeypatch, 3)
    with refused(r"run\.json: cannot be written: Access is denied", FileError):
        writing.write_text(path, "newer")
    assert path.read_text() == "new" and os.listdir(tmp_path) == ["run.json"]


def test_processors_without_affinity(monkeypatch):
    monkeypatch.delattr(os, "sched_getaffinity", raising=False)
    monkeypatch.setattr(os, "cpu_count", lambda: 3)
    assert processors() == 3
    monkeypatch.setattr(os, "cpu_count", lambda: None)
    assert processors() == 1


def test_memory_that_cannot_be_measured_is_no_number(monkeypatch):
    monkeypatch.setitem(sys.modules, "resource", None)
    assert math.isnan(workflows._memory())


def test_modules_load_without_those_of_posix():
    code = f"""
import importlib, pkgutil, sys
sys.modules.update(dict.fromkeys({POSIX}))
import planarfriction
for name in ("cli", "_engine.compiler", "scenes", "solvers", "sweeps", "export", "online", "planning", "identify"):
    package = importlib.import_module("planarfriction." + name)
    for module in pkgutil.iter_modules(package.__path__, package.__name__ + "."):
        importlib.import_module(module.name)
"""
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
