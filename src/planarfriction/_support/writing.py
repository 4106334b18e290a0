"""Writing of files, whole or not at all: after a kill, a full disk or a second writer a file is the old or the new one.

Everything that the library writes is written here.
"""

from __future__ import annotations

import contextlib
import io
import os
import secrets
import shutil
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

from planarfriction._support import validation
from planarfriction.errors import FileError, FrictionError

_PATIENCE = (0.01, 0.03, 0.1, 0.3) if os.name == "nt" else ()
"""Pauses [s] between tries to replace a file: Windows refuses while another program has it open, if only to scan it."""


@contextlib.contextmanager
def replacing(path: str | Path) -> Iterator[io.BytesIO]:
    """Yield a buffer that becomes the file `path` when the block ends; an error in the block leaves `path` as it was.

    The bytes go to a file beside the target, whose name no other process has, then to the disk, then that file takes
    the place of the target, whose permissions it has. A symbolic link stays one; other hard links keep what they have.
    A process that is killed while it writes may leave such a file, `.planarfriction-*.part`.

    Raises FileError in one line where the file cannot be written: before the block where that can be known.
    """
    path = check_writable(path)
    buffer = io.BytesIO()
    with reporting(path):
        yield buffer
        _replace(Path(os.path.realpath(path)), buffer.getbuffer())


def write_text(path: str | Path, text: str) -> None:
    """Make `text` the file `path` (UTF-8), as `replacing` does."""
    with replacing(path) as file:
        file.write(text.encode())


def check_writable(path: str | Path) -> Path:
    """Return `path` if a file can be written there, or raise FileError: ask before a long run, not after it.

    A file is really made beside it, since permissions alone do not tell; what `path` holds stays as it is.
    """
    path = validation.path("path", path)
    with reporting(path):
        target = Path(os.path.realpath(path))
        if target.is_dir():
            raise FileError(
                f"{path}: cannot be written: it is a folder; give the name of a file in it"
            )
        if not target.parent.is_dir():
            raise FileError(
                f"{path}: cannot be written: there is no folder {target.parent}"
            )
        with contextlib.suppress(FileNotFoundError):
            target.stat()  # tells a name that is too long
            if not target.is_file():
                raise FileError(
                    f"{path}: cannot be written: it is a device, not a file"
                )
            target.open("ab").close()
        part = _part(target)
        part.open("xb").close()
        part.unlink()
    return path


def make_folder(path: str | Path) -> Path:
    """Make the folder `path`, and those above it, where it is missing, and try to write in it; returns its path.

    Raises FileError in one line where that is not possible.
    """
    path = validation.path("path", path)
    try:
        path.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=path):
            pass
    except (OSError, ValueError) as error:
        raise FileError(f"cannot write to folder {path}: {_reason(error)}") from None
    return path


def _replace(target: Path, content: memoryview) -> None:
    part = _part(target)
    try:
        with part.open("xb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        with contextlib.suppress(FileNotFoundError):
            shutil.copymode(target, part)
        _take_place(part, target)
    except BaseException:
        with contextlib.suppress(OSError):
            part.unlink()
        raise


def _take_place(part: Path, target: Path) -> None:
    """Let the file `part` take the place of `target`."""
    for pause in _PATIENCE:
        try:
            return os.replace(part, target)
        except PermissionError:
            time.sleep(pause)
    os.replace(part, target)


def _part(target: Path) -> Path:
    """Return a name beside `target` that no other process takes."""
    return target.with_name(f".planarfriction-{secrets.token_hex(8)}.part")


@contextlib.contextmanager
def reporting(path: str | Path) -> Iterator[None]:
    """Turn the system's error into a FileError of one line with the path."""
    try:
        yield
    except FrictionError:
        raise
    except (
        OSError,
        ValueError,
    ) as error:  # ValueError: a path with a zero byte, text that UTF-8 cannot hold
        raise FileError(f"{path}: cannot be written: {_reason(error)}") from None


def _reason(error: Exception) -> str:
    return getattr(error, "strerror", None) or " ".join(str(error).split())
