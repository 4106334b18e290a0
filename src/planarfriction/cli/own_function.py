"""Functions of the user, which an option of a command names by their file."""

from __future__ import annotations

import importlib.util
from collections.abc import Callable
from pathlib import Path
from typing import Any

from planarfriction.errors import FileError, InvalidValueError, one_line


def load_function(option: str, entry: str) -> tuple[str, Callable[[Any], Any]]:
    """Load the function, or object that can be called, and its name from the `FILE.py:NAME` that an option has.

    Raises FileError in one line where the file or what is in it cannot be had.
    """
    file, colon, name = entry.rpartition(":")
    if not colon or not file.endswith(".py") or not name.isidentifier():
        raise InvalidValueError(option, "be FILE.py:NAME", entry)
    path = Path(file)
    if not path.is_file():
        raise FileError(f"{path}: no such file")
    spec = importlib.util.spec_from_file_location(path.stem, path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    try:
        spec.loader.exec_module(module)
    except Exception as error:  # whatever a file of the user raises
        raise FileError(one_line(f"{path}: {type(error).__name__}: {' '.join(str(error).split())}")) from None
    if not callable(getattr(module, name, None)):
        raise FileError(f"{path}: has no function called {name}")
    return name, getattr(module, name)
