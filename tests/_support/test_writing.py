"""Files are written whole or not at all: by several processes at once, on a full disk, and under a kill."""

import contextlib
import os
import signal
import stat
import subprocess
import sys
import textwrap
import time
from pathlib import Path

import pytest

from planarfriction import FrictionError
from planarfriction._support.writing import (
    check_writable,
    make_folder,
    replacing,
    write_text,
)
from tests.support.refusals import refused

resource = pytest.importorskip("resource")  # not on Windows

OLD = b"what was there before"


def names(folder):
    return sorted(path.name for path in folder.iterdir())


@contextlib.contextmanager
def started(code, *arguments):
    """A Python process with `code`, which says "ready" as soon as everything is imported; killed at the end."""
    command = [sys.executable, "-c", textwrap.dedent(code), *map(str, arguments)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None and process.stdout.readline() == "ready\n"
            yield process
        finally:
            process.kill()


# ---------------------------------------------------------------------- what a reader finds


WRITER = """
    import sys
    from planarfriction._support.writing import replacing

    path, letter, rounds = sys.argv[1], sys.argv[2].encode(), int(sys.argv[3])
    print("ready", flush=True)
    for _ in range(rounds):
        with replacing(path) as file:
            file.write(1_000_000 * letter)
"""


def test_several_writers_always_leave_a_whole_file_of_one_of_them(tmp_path):
    target = tmp_path / "run.nc"
    own = tmp_path / "run.nc.part"
    own.write_bytes(OLD)
    target.write_bytes(1_000_000 * b"o")
    seen = set()
    reads = 0
    with contextlib.ExitStack() as stack:
        writers = [
            stack.enter_context(started(WRITER, target, letter, 80)) for letter in "abc"
        ]
        while any(writer.poll() is None for writer in writers):
            content = target.read_bytes()
            assert content == 1_000_000 * content[:1]
            seen.add(content[:1])
            reads += 1
        assert [writer.wait() for writer in writers] == [0, 0, 0]
    assert reads > 10 and seen <= {b"o", b"a", b"b", b"c"}
    assert own.read_bytes() == OLD
    assert names(tmp_path) == ["run.nc", "run.nc.part"]


def test_a_kill_leaves_the_old_file_or_the_new_one(tmp_path):
    target = tmp_path / "run.nc"
    for wait in (0.0, 0.001, 0.003, 0.01, 0.02, 0.03):
        target.write_bytes(1_000_000 * b"o")
        with started(WRITER, target, "a", 1_000_000) as writer:
            time.sleep(wait)
            writer.send_signal(signal.SIGKILL)
            assert writer.wait() == -signal.SIGKILL
        content = target.read_bytes()
        assert content == 1_000_000 * content[:1]
    left = [name for name in names(tmp_path) if name != "run.nc"]
    assert all(
        name.startswith(".planarfriction-") and name.endswith(".part") for name in left
    )


def test_a_kill_before_the_writing_itself_leaves_nothing(tmp_path):
    target = tmp_path / "run.nc"
    target.write_bytes(OLD)
    code = """
        import sys, time
        from planarfriction._support.writing import replacing

        with replacing(sys.argv[1]) as file:
            file.write(b"half of ")
            print("ready", flush=True)
            time.sleep(60)
    """
    with started(code, target) as writer:
        writer.kill()
    assert target.read_bytes() == OLD
    assert names(tmp_path) == ["run.nc"]


def test_an_error_on_the_way_leaves_the_old_file(tmp_path):
    (tmp_path / "table.csv").write_bytes(OLD)
    for error in (RuntimeError, KeyboardInterrupt):
        with pytest.raises(error), replacing(tmp_path / "table.csv") as file:
            file.write(b"half of ")
            raise error
    with (
        refused(r"table.csv: cannot be written: no ink", FrictionError),
        replacing(tmp_path / "table.csv"),
    ):
        raise OSError("no ink")
    assert (tmp_path / "table.csv").read_bytes() == OLD
    assert names(tmp_path) == ["table.csv"]


# ---------------------------------------------------------------------- disks


def test_a_full_disk_leaves_the_old_file(tmp_path):
    """A limit on the size of files stands for the disk: the system refuses the same call, in the middle of the file."""
    target = tmp_path / "run.nc"
    target.write_bytes(OLD)
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, limits[1]))
    try:
        with refused(r"run.nc: cannot be written: File too large", FrictionError):
            write_text(target, 200_000 * "a")
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert target.read_bytes() == OLD
    assert names(tmp_path) == ["run.nc"]


@pytest.mark.parametrize("call", ["fsync", "replace"])
def test_a_disk_that_fails_late_leaves_the_old_file(tmp_path, monkeypatch, call):
    def full(*arguments):
        raise OSError(28, "No space left on device")

    target = tmp_path / "run.nc"
    target.write_bytes(OLD)
    monkeypatch.setattr(os, "fsync", full) if call == "fsync" else monkeypatch.setattr(
        os, "replace", full
    )
    with refused(r"run.nc: cannot be written: No space left on device", FrictionError):
        write_text(target, "new")
    assert target.read_bytes() == OLD
    assert names(tmp_path) == ["run.nc"]


def test_the_bytes_are_on_the_disk_before_they_take_the_place(tmp_path, monkeypatch):
    calls = []
    fsync = os.fsync
    replace = os.replace
    monkeypatch.setattr(
        os, "fsync", lambda number: calls.append("fsync") or fsync(number)
    )
    monkeypatch.setattr(
        os, "replace", lambda part, to: calls.append("replace") or replace(part, to)
    )
    write_text(tmp_path / "a.txt", "µ")
    assert calls == ["fsync", "replace"]
    assert (tmp_path / "a.txt").read_bytes() == "µ".encode()


# ---------------------------------------------------------------------- what stays


def test_permissions_stay_and_new_files_have_those_of_any_new_file(tmp_path):
    def mode(name):
        return stat.S_IMODE((tmp_path / name).stat().st_mode)

    (tmp_path / "plain").write_bytes(b"")
    write_text(tmp_path / "new", "")
    assert mode("new") == mode("plain")
    (tmp_path / "plain").chmod(0o640)
    write_text(tmp_path / "plain", "")
    assert mode("plain") == 0o640


def test_links_stay_links(tmp_path):
    (tmp_path / "data").mkdir()
    (tmp_path / "link").symlink_to(Path("data") / "run.nc")
    # The first one makes the file that the link points to.
    for text in (
        "first",
        "second",
    ):
        write_text(tmp_path / "link", text)
        assert (tmp_path / "link").is_symlink()
        assert (tmp_path / "data" / "run.nc").read_text() == text
    assert names(tmp_path / "data") == ["run.nc"]


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("", "it is a folder"),
        ("folder", "it is a folder"),
        ("none/run.nc", "there is no folder"),
        ("plain/run.nc", "there is no folder"),
        ("a\0b", "null"),
        (300 * "n", "name too long"),
        ("loop", "symbolic links"),
        ("/dev/null", "it is a device"),
        ("/dev/full", "it is a device"),
        ("/proc/run.nc", "cannot be written"),
        ("pipe", "it is a device"),
    ],
)
def test_places_where_no_file_can_be(tmp_path, monkeypatch, name, reason):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "folder").mkdir()
    (tmp_path / "plain").write_bytes(OLD)
    (tmp_path / "loop").symlink_to("loop")
    os.mkfifo(tmp_path / "pipe")
    before = names(tmp_path)
    for act in (check_writable, lambda path: write_text(path, "new")):
        with pytest.raises(FrictionError) as caught:
            act(name)
        assert (
            "cannot be written" in str(caught.value)
            and reason in str(caught.value).lower()
        )
        assert "\n" not in str(caught.value)
    assert names(tmp_path) == before and (tmp_path / "plain").read_bytes() == OLD


def test_text_that_utf_8_cannot_hold_gets_one_line(tmp_path):
    with refused(r"a.txt: cannot be written: .*surrogates not allowed", FrictionError):
        write_text(tmp_path / "a.txt", "\udc80")
    assert names(tmp_path) == []


def test_folders_are_made_or_refused_in_one_line(tmp_path):
    assert make_folder(tmp_path / "new" / "out").is_dir()
    (tmp_path / "plain").write_bytes(OLD)
    for path in (tmp_path / "plain", tmp_path / "plain" / "out", "/proc/out", "a\0b"):
        with refused("cannot write to folder", FrictionError):
            make_folder(path)


def test_a_limit_on_the_size_of_files_leaves_the_old_one(tmp_path):
    """The system takes the first bytes and says nothing; the next write fails."""
    path = tmp_path / "run.npz"
    path.write_bytes(OLD)
    code = """
    import resource, signal, sys
    from planarfriction._support.writing import write_text
    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (3000, 3000))
    print("ready", flush=True)
    try:
        write_text(sys.argv[1], 10_000 * "x")
    except Exception as error:
        print(error)
    """
    with started(code, path) as process:
        assert (
            process.stdout is not None
            and "cannot be written: File too large" in process.stdout.read()
        )
    assert path.read_bytes() == OLD and names(tmp_path) == ["run.npz"]
