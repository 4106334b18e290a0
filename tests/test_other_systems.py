"""Other systems, by taking away what they lack: replacing of open files, locks, affinity, modules of POSIX."""

from __future__ import annotations

import math
import os
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

from planarfriction import writing
from planarfriction.compiler.threads import processors
from planarfriction.errors import FileError
from planarfriction.sweeps import zarr_store
from planarfriction_studies.bench import workflows

POSIX = ("fcntl", "grp", "pty", "pwd", "resource", "termios")


def refusing(monkeypatch, times: int) -> None:
    """Refuse to replace a file a number of times, as Windows does while another program has it open."""
    replace, left = os.replace, iter(range(times))

    def refused(part, target):
        if next(left, None) is not None:
            raise PermissionError(13, "Access is denied")
        replace(part, target)

    monkeypatch.setattr(os, "replace", refused)
    monkeypatch.setattr(writing, "_PATIENCE", (0.0, 0.0))


@pytest.mark.parametrize("write", [writing.write_text, lambda path, text: writing.put(str(path), text.encode())])
def test_a_file_that_is_open_elsewhere_is_tried_again(write, tmp_path, monkeypatch):
    path = tmp_path / "run.json"
    path.write_text("old")
    refusing(monkeypatch, 2)
    write(path, "new")
    assert path.read_text() == "new"
    refusing(monkeypatch, 3)
    with pytest.raises(FileError, match=r"run\.json: cannot be written: Access is denied"):
        write(path, "newer")
    assert path.read_text() == "new" and os.listdir(tmp_path) == ["run.json"]


def test_an_empty_folder_is_replaced_where_renaming_does_not(tmp_path, monkeypatch):
    rename = Path.rename

    def refused(part, target):
        if target.exists():
            raise FileExistsError(17, "Cannot create a file when that file already exists")
        return rename(part, target)

    monkeypatch.setattr(Path, "rename", refused)
    (tmp_path / "store").mkdir()
    for name in ("first", "second"):
        with writing.making_folder(tmp_path / "store") as part:
            (part / name).touch()
    assert [each.name for each in tmp_path.rglob("*")] == ["store", "first"]


@pytest.fixture
def windows_locks(monkeypatch) -> list[tuple[str, int]]:
    """Locks of Windows instead of those of POSIX; returns the bytes that are locked."""
    locked: list[tuple[str, int]] = []

    def locking(file, mode, count):
        byte = os.readlink(f"/proc/self/fd/{file}"), os.lseek(file, 0, os.SEEK_CUR)
        if byte in locked:
            raise PermissionError(13, "Permission denied")
        locked.append(byte)

    monkeypatch.setitem(sys.modules, "fcntl", None)
    monkeypatch.setitem(sys.modules, "msvcrt", SimpleNamespace(locking=locking, LK_NBLCK=2))
    return locked


@pytest.mark.skipif(sys.platform != "linux", reason="asks Linux for the name of an open file")
def test_a_store_is_locked_with_the_locks_of_windows(windows_locks, tmp_path):
    journals = [(tmp_path / "journal").open("a+b", buffering=0) for _ in range(2)]
    journals[0].write(b"a line\n")
    zarr_store._lock(journals[0], tmp_path)
    assert journals[0].tell() == 7 and windows_locks[0][1] > 7  # what is written stays readable, and goes on there
    with pytest.raises(FileError, match="another sweep is writing to it"):
        zarr_store._lock(journals[1], tmp_path)
    for journal in journals:
        journal.close()


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
for name in ("cli", "compiler", "scenes", "solvers", "sweeps", "export", "online", "planning", "identify"):
    package = importlib.import_module("planarfriction." + name)
    for module in pkgutil.iter_modules(package.__path__, package.__name__ + "."):
        importlib.import_module(module.name)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
