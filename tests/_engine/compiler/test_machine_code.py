"""Machine code on disk: current, whole, bounded, never in the way; and Ctrl-C is heard while it is made."""

from __future__ import annotations

import contextlib
import functools
import importlib.util
import os
import shutil
import signal
import subprocess
import sys
import threading
import warnings
from collections.abc import Iterator
from pathlib import Path

import numba
import pytest
from numba.core import config
from numba.core.registry import cpu_target

from planarfriction._engine import compiler
from planarfriction._engine.compiler import machine_code
from planarfriction._engine.compiler.interrupts import heard_between_passes

resource = pytest.importorskip("resource")  # not on Windows

FORMULA = """
def grow(x):
    return 2.0 * x
"""

LOOPS = """
from pathlib import Path

import own_formula
from numba import njit
from planarfriction._engine.compiler.machine_code import Sources, kept

inner = njit(own_formula.grow)
SOURCES = Sources(Path(__file__).parent, [Path(own_formula.__file__), Path(__file__)])

def outer(x):
    return inner(x) + 1.0

outer = kept(njit(outer), SOURCES)

def another(x):
    return inner(x) - 1.0

another = kept(njit(another), SOURCES)
"""


@pytest.fixture
def sources(tmp_path, monkeypatch) -> Path:
    """A small package of somebody: a formula in one file, compiled functions that call it in another."""
    folder = tmp_path / "sources"
    folder.mkdir()
    (folder / "own_formula.py").write_text(FORMULA)
    (folder / "own_loops.py").write_text(LOOPS)
    # Python's own cache goes by time and size.
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    monkeypatch.setattr(config, "CACHE_DIR", "")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "user"))
    monkeypatch.setattr(machine_code.MachineCode, "warned", False)
    for name in ("own_formula", "own_loops"):
        monkeypatch.setitem(sys.modules, name, None)
    return folder


def imported(sources: Path):
    """The functions as a new process has them."""
    for name in ("own_formula", "own_loops"):
        spec = importlib.util.spec_from_file_location(name, sources / f"{name}.py")
        assert spec is not None and spec.loader is not None
        sys.modules[name] = module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
    return sys.modules["own_loops"]


def was_read(function) -> bool:
    hits = sum(function.stats.cache_hits.values())
    misses = sum(function.stats.cache_misses.values())
    assert hits + misses == 1
    return hits == 1


def machine_files(place: Path) -> list[Path]:
    return sorted(place.rglob("*.machine"))


PLACES = {
    "named": "named by the user",
    "beside": "sources/__pycache__",
    "user": "user/planarfriction",
}


@pytest.fixture(params=PLACES)
def place(request, sources, tmp_path, monkeypatch) -> Path:
    """Machine code goes to the folder that the user names, beside the sources, or to the user's cache."""
    folder = tmp_path / PLACES[request.param]
    if request.param == "named":
        monkeypatch.setattr(config, "CACHE_DIR", str(folder))
    if request.param == "user":
        (sources / "__pycache__").write_text(
            "nothing can be written beside the sources"
        )
    return folder


def test_machine_code_is_that_of_the_sources_wherever_it_is_kept(sources, place):
    assert imported(sources).outer(3.0) == 7.0
    again = imported(sources)
    assert again.outer(3.0) == 7.0 and was_read(again.outer)
    formula = sources / "own_formula.py"
    before = formula.stat()
    # An upgrade that keeps sizes and times.
    formula.write_text(FORMULA.replace("2.0", "5.0"))
    os.utime(formula, ns=(before.st_atime_ns, before.st_mtime_ns))
    edited = imported(sources)
    assert edited.outer(3.0) == 16.0 and not was_read(edited.outer)
    formula.write_text(FORMULA)
    back = imported(sources)
    assert back.outer(3.0) == 7.0 and was_read(back.outer)
    assert len(machine_files(place)) == 2
    assert not list(place.rglob("*.part"))


def test_machine_code_of_old_sources_does_not_pile_up(sources, tmp_path):
    place = sources / "__pycache__"
    for i in range(20):
        old = place / f"planarfriction-{i:016x}"
        old.mkdir(parents=True)
        (old / "some.machine").write_text("old")
        os.utime(old, (i, i))
    (place / "planarfriction-of-the-user").mkdir()
    assert imported(sources).outer(3.0) == 7.0
    kept = {path.name for path in place.glob("planarfriction-*")}
    assert len(kept) == machine_code._VERSIONS_KEPT + 1
    assert (
        f"planarfriction-{19:016x}" in kept and f"planarfriction-{0:016x}" not in kept
    )
    assert "planarfriction-of-the-user" in kept
    assert was_read_again(sources)


def was_read_again(sources: Path) -> bool:
    again = imported(sources)
    assert again.outer(3.0) == 7.0
    return was_read(again.outer)


def flip(path: Path) -> None:
    content = bytearray(path.read_bytes())
    content[content.index(b".text") + 1] ^= 1  # in the machine code itself
    path.write_bytes(content)


def as_folder(path: Path, other: Path) -> None:
    path.unlink()
    path.mkdir()


DAMAGES = {
    "empty": lambda path, other: path.write_bytes(b""),
    "cut": lambda path, other: path.write_bytes(path.read_bytes()[:-100]),
    "one bit": lambda path, other: flip(path),
    "garbage": lambda path, other: path.write_bytes(bytes(range(256)) * 40),
    "of another function": lambda path, other: path.write_bytes(other.read_bytes()),
    "a folder": as_folder,
}


@pytest.mark.parametrize("damage", DAMAGES)
def test_damaged_machine_code_is_made_anew(sources, damage):
    first = imported(sources)
    assert (first.outer(3.0), first.another(3.0)) == (7.0, 5.0)
    another, outer = machine_files(sources)
    DAMAGES[damage](outer, another)
    mended = imported(sources)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore" if damage == "a folder" else "error")
        assert mended.outer(3.0) == 7.0 and not was_read(mended.outer)
    assert was_read_again(sources)


def test_without_a_place_it_runs_and_says_so_once(sources, tmp_path):
    (sources / "__pycache__").write_text("no folder")
    (tmp_path / "user").write_text("no folder")
    functions = imported(sources)
    with pytest.warns(RuntimeWarning, match="compiled code is not kept") as told:
        assert (functions.outer(3.0), functions.another(3.0)) == (7.0, 5.0)
    assert len(told) == 1
    (text,) = [str(each.message) for each in told]
    assert "\n" not in text and "NUMBA_CACHE_DIR" in text


@contextlib.contextmanager
def full_disk(size: int) -> Iterator[None]:
    """No file may grow beyond `size` bytes: the system refuses to write more, as it does where the disk is full."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


def test_on_a_full_disk_it_runs_and_leaves_nothing(sources, tmp_path):
    functions = imported(sources)
    with (
        pytest.warns(RuntimeWarning, match="compiled code is not kept"),
        full_disk(4096),
    ):
        assert functions.outer(3.0) == 7.0
    assert not [
        path for path in tmp_path.rglob("*") if path.suffix in (".machine", ".part")
    ]
    assert not was_read_again(sources)
    assert was_read_again(sources)


def test_what_was_compiled_before_is_read_where_nothing_can_be_written(
    sources, monkeypatch
):
    imported(sources).outer(3.0)

    def refuse(path):
        raise PermissionError(13, "Read-only file system", str(path))

    monkeypatch.setattr(machine_code, "replacing", refuse)
    monkeypatch.setattr(machine_code, "_make", refuse)
    assert was_read_again(sources)


def test_a_process_that_compiles_nothing_does_not_load_what_compiles(sources):
    code = "import own_loops, sys; print(own_loops.outer(3.0), 'numba.np.linalg' in sys.modules)"
    run = functools.partial(
        subprocess.run,
        [sys.executable, "-c", code],
        cwd=sources,
        check=True,
        capture_output=True,
        text=True,
    )
    assert [run().stdout.split() for _ in range(2)] == [
        ["7.0", "True"],
        ["7.0", "False"],
    ]


def test_sources_that_change_under_a_running_process_leave_nothing_stale(sources):
    running = imported(sources)
    (sources / "own_formula.py").write_text(FORMULA.replace("2.0", "5.0"))
    assert running.outer(3.0) == 7.0  # what it imported
    assert not machine_files(sources)
    assert imported(sources).outer(3.0) == 16.0


@pytest.mark.parametrize(
    ("module", "name", "other"),
    [(config, "BOUNDSCHECK", 1), (numba, "__version__", "0.0")],
)
def test_settings_and_versions_of_the_compiler_are_told_apart(
    sources, monkeypatch, module, name, other
):
    imported(sources).outer(3.0)
    with monkeypatch.context() as elsewhere:
        elsewhere.setattr(module, name, other)
        assert not was_read_again(sources)
    assert was_read_again(sources)


def test_functions_made_by_functions_are_not_kept(sources):
    code = (sources / "own_loops.py").read_text()
    code += "\ndef make(k):\n    def inside(x):\n        return k * x\n    return kept(njit(inside), SOURCES)\n"
    (sources / "own_loops.py").write_text(code)
    functions = imported(sources)
    assert [functions.make(k)(2.0) for k in (1.0, 3.0)] == [2.0, 6.0]
    assert not machine_files(sources)


@pytest.fixture
def pressed_in_llvm(monkeypatch) -> list[int]:
    """Ctrl-C while LLVM hands the object code over, where an exception is printed and forgotten."""
    engine = cpu_target.target_context.codegen()._engine._ee
    notify = engine._object_cache_notify
    presses = []

    def press(module, buffer):
        if not presses:
            presses.append(1)
            os.kill(os.getpid(), signal.SIGINT)
        notify(module, buffer)

    monkeypatch.setattr(engine, "_object_cache_notify", press)
    return presses


def test_ctrl_c_inside_the_compiler_is_heard(sources, pressed_in_llvm):
    functions = imported(sources)
    handler = signal.getsignal(signal.SIGINT)
    with pytest.raises(KeyboardInterrupt):
        functions.outer(3.0)
    assert pressed_in_llvm and signal.getsignal(signal.SIGINT) is handler
    assert functions.outer(3.0) == 7.0
    again = imported(sources)
    assert again.outer(3.0) == 7.0


def test_ctrl_c_goes_to_whoever_handles_it(sources, pressed_in_llvm):
    heard = []
    earlier = signal.signal(signal.SIGINT, lambda number, frame: heard.append(number))
    try:
        assert imported(sources).outer(3.0) == 7.0
    finally:
        signal.signal(signal.SIGINT, earlier)
    assert heard == [signal.SIGINT]


def test_ctrl_c_is_left_alone_in_other_threads():
    handlers = []

    def look():
        with heard_between_passes():
            handlers.append(signal.getsignal(signal.SIGINT))

    thread = threading.Thread(target=look)
    thread.start()
    thread.join()
    assert handlers == [signal.getsignal(signal.SIGINT)]


def test_ctrl_c_is_heard_when_the_block_fails_too():
    with (
        pytest.raises(KeyboardInterrupt),
        heard_between_passes(),
        heard_between_passes(),
    ):
        os.kill(os.getpid(), signal.SIGINT)
        raise ValueError


PACKAGE = Path(compiler.__file__).parents[2]
FILES = [
    next(
        each
        for each in (f"{name}.py", f"{name}/__init__.py")
        if (PACKAGE / each).exists()
    )
    for name in compiler.FOLDERS
]


@pytest.mark.parametrize("file", ["formulas.py", *FILES])
def test_a_change_in_any_folder_with_compiled_code_is_another_origin(tmp_path, file):
    package = tmp_path / "planarfriction"
    shutil.copytree(PACKAGE, package, ignore=shutil.ignore_patterns("__pycache__"))
    sources = compiler.sources_of(package)
    assert sources.digest == compiler.SOURCES.digest  # the same files, elsewhere
    (package / file).write_text((package / file).read_text() + "\nCHANGED = 1\n")
    assert (
        not sources.unchanged()
        and compiler.sources_of(package).digest != sources.digest
    )
