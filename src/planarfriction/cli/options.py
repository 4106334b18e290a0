"""Options that several commands share."""

from __future__ import annotations

import importlib.util
from collections.abc import Callable
from pathlib import Path
from typing import Any

import click
from click.shell_completion import CompletionItem

from planarfriction.cli.patches import WIDTH, patch_names
from planarfriction.errors import FileError, InvalidValueError, one_line
from planarfriction.families import PUBLISHED_PATCHES, SCENES

PATCH_HELP = (
    f"{', '.join(PUBLISHED_PATCHES)}, disc, rectangle, or a pressure map (.csv, .npy, grey image; row 0 is the top) "
    "with --cell-size."
)


class FilePath(click.Path):
    """A path that the commands check themselves, and that is one."""

    def convert(self, value: object, param: click.Parameter | None, ctx: click.Context | None) -> Path:
        """Return the path; refuse an empty text, as of a variable that a script has not set."""
        if not str(value) or "\0" in str(value):
            self.fail("the name of a file or a folder is needed, got an empty one", param, ctx)
        return Path(str(value))


FILE = FilePath()


def complete_scene(context: object, parameter: object, incomplete: str) -> list[CompletionItem]:
    """Return completions of a scene: ready scenes that begin with the typed text, and files."""
    names = [CompletionItem(name, help=SCENES.words(name)) for name in SCENES if name.startswith(incomplete)]
    return [*names, CompletionItem(incomplete, type="file")]


def complete_patch(context: object, parameter: object, incomplete: str) -> list[CompletionItem]:
    """Return completions of a patch: names that begin with the typed text in any case, and files."""
    names = [CompletionItem(name) for name in patch_names() if name.lower().startswith(incomplete.lower())]
    return [*names, CompletionItem(incomplete, type="file")]


def patch_option(default: str, name: str = "patch") -> Callable[[Any], Any]:
    """Make the option `--patch`, given to a command as `name`; `default` says what is taken without it."""
    words = f"Contact patch: {PATCH_HELP} {default}"
    return click.option("--patch", name, metavar="PATCH", shell_complete=complete_patch, help=words)


width_option = click.option(
    "--width", type=float, default=WIDTH, help=f"Width in m of a patch given by name. Default: {WIDTH}."
)


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
