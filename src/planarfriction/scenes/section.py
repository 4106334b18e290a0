"""Reading of tables from scene files: every mistake becomes one line with the file, the table and what to write."""

from __future__ import annotations

import contextlib
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

from planarfriction import validation
from planarfriction.errors import FileError, FrictionError, shown

_REQUIRED: Any = object()


class Section:
    """One table of a scene file, which knows its position so that errors can name it.

    `where` is the dotted name of the table ("contact.law", "" at the top), `source` names the file in messages, and
    relative paths start from `folder`.
    """

    def __init__(self, data: Any, where: str = "", source: str = "scene", folder: Path | None = None):
        self.where, self.source, self.folder = where, source, folder or Path()
        if not isinstance(data, dict):
            self.fail(f"must be a table of keys and values, got {_shown(data)}")
        self.data: dict[str, Any] = data

    def __contains__(self, key: str) -> bool:
        return key in self.data

    def error(self, message: str) -> FileError:
        """Return the error for this table: `file: [table]: message`."""
        table = f"[{self.where}]: " if self.where else ""
        return FileError(f"{self.source}: {table}{message}")

    def fail(self, message: str) -> None:
        """Raise the error for this table."""
        raise self.error(message)

    def only(self, keys: Iterable[str]) -> Section:
        """Return this table if it has no other keys than `keys`, or raise an error with the nearest valid name."""
        keys = list(keys)
        valid = f" (valid: {', '.join(keys)})"
        for key in self.data:
            if key not in keys:
                self.fail(f"unknown key {_shown(key)}{validation.hint(key, keys) or valid}")
        return self

    def get(self, key: str, default: Any = _REQUIRED) -> Any:
        """Return the value under `key`; without a default the key must be there."""
        if key not in self.data:
            if default is _REQUIRED:
                self.fail(f"missing key {key!r}")
            return default
        return self.data[key]

    def name_of(self, key: str) -> str:
        """Return the dotted name of the table `key` below this one."""
        return f"{self.where}.{key}" if self.where else key

    def section(self, key: str, value: Any = _REQUIRED) -> Section:
        """Return the table below this one; `value` stands in for a table that was written in a shorter form."""
        data = self.get(key) if value is _REQUIRED else value
        return Section(data, self.name_of(key), self.source, self.folder)

    def choice(self, key: str, valid: Iterable[str], default: Any = _REQUIRED) -> str:
        """Return the value under `key` if it is one of `valid`, or raise an error that names the nearest valid one."""
        with self.located():
            return validation.choice(key, self.get(key, default), valid)

    def path(self, key: str) -> Path:
        """Return the path under `key`, taken from the folder of the scene file."""
        return self._path(key, self.get(key))

    def paths(self, key: str) -> list[Path]:
        """Return the list of paths under `key`, taken from the folder of the scene file."""
        value = self.get(key)
        if not isinstance(value, list):
            self.fail(f"{key} must be a list of paths, got {_shown(value)}")
        return [self._path(key, each) for each in value]

    def _path(self, key: str, value: Any) -> Path:
        if not isinstance(value, str) or not value:
            self.fail(f"{key} must be the path of a file, got {_shown(value)}")
        return self.folder / value

    @contextlib.contextmanager
    def located(self) -> Iterator[None]:
        """Put file and table in front of the errors raised inside."""
        try:
            yield
        except FrictionError as error:
            message = str(error)
            raise (error if message.startswith(f"{self.source}: ") else self.error(message)) from None


def _shown(value: Any) -> str:
    return shown(validation.quoted(value))
