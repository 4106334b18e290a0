"""Files that come from the browser: a name and the content, which readers of the library want as a file."""

from __future__ import annotations

import contextlib
import tempfile
from collections.abc import Iterator
from pathlib import Path, PurePosixPath, PureWindowsPath

from planarfriction.errors import FileError


def plain_name(name: str) -> str:
    """Return the name of a file without the path that a browser may send with it."""
    return PurePosixPath(PureWindowsPath(name).name).name


@contextlib.contextmanager
def as_file(name: str, content: bytes) -> Iterator[Path]:
    """Yield a file of the same suffix with the content; errors raised meanwhile name the file as the user does.

    Raises `FileError` for what a reader does not take.
    """
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"file{Path(name).suffix}"
        try:
            path.write_bytes(content)
            yield path
        except (FileError, OSError, ValueError) as error:
            raise FileError(str(error).replace(str(path), name)) from None
