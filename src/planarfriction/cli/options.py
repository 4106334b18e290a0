"""Options that several commands share, and contact patches by name or from a pressure map."""

from __future__ import annotations

import functools
import importlib.util
import inspect
import os
import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import click
from click import option
from click.shell_completion import CompletionItem

import planarfriction as pf
from planarfriction.errors import FileError, InvalidValueError, one_line
from planarfriction.families import PUBLISHED_PATCHES, SCENES, SHAPES

WIDTH = 0.02
"""Width of named patches [m], that of the published experiments."""

USUAL = "Circle"
"""Patch where none is asked for."""

_PER_WIDTH = {"width": 1.0, "length": 1.0, "radius": 0.5}
"""First parameters of shapes that a width decides, and how large they are for a width of 1."""


_METRES = {"": 1.0, "m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "µm": 1e-6}
"""Units of lengths on the command line, and how many metres they are."""

_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?"

_LENGTH = re.compile(rf"({_NUMBER})\s*([a-zµ]*)", re.IGNORECASE)

_SIDES = re.compile(
    rf"({_NUMBER})\s*([a-zµ]*?)\s*[x×]\s*({_NUMBER})\s*([a-zµ]*)", re.IGNORECASE
)


def parse_length(name: str, text: str) -> float:
    """Return the length [m] that a text spells: `60mm`, `6 cm`, or a number in metres.

    Raises InvalidValueError for a text that is no length.
    """
    match = _LENGTH.fullmatch(text.strip())
    if match is None or match[2] not in _METRES:
        raise InvalidValueError(
            name, "be a length such as 60mm, 6cm or 0.06 (metres)", repr(text)
        )
    return float(match[1]) * _METRES[match[2]]


class Length(click.ParamType):
    """A length, with a unit or in metres."""

    name = "length"

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> float:
        """Return the length [m]."""
        if isinstance(value, float):
            return value
        return parse_length(
            "--" + str(param and param.name).replace("_", "-"), str(value)
        )


LENGTH = Length()
"""Type of options that are a length."""


def parse_sides(text: str) -> tuple[float, float] | None:
    """Return width and height [m] of a rectangle such as 12x20mm; None for another text."""
    match = _SIDES.fullmatch(text.strip())
    if match is None:
        return None
    width, height = match[1] + (match[2] or match[4]), match[3] + match[4]
    return parse_length("patch", width), parse_length("patch", height)


def find_patch(
    text: str | None, size: Mapping[str, Any], width: float = WIDTH
) -> pf.ContactPatch:
    """Return the patch called `text` (case does not matter), `width` [m] wide, or the pressure map in the file `text`.

    A text such as `12x20mm` is a rectangle, 12 mm along x and 20 mm along y.

    Circle for None, not for an empty text. `size` holds the options of `map_options` that were given.

    Raises InvalidValueError for an unknown name, and for options of a map that are missing for one or given for a name;
    FileError for a pressure map that cannot be read.
    """
    text = USUAL if text is None else text
    width = size.get("width", width)
    makers = _shapes(width)
    makers |= {
        name.lower(): functools.partial(make, width=width)
        for name, make in PUBLISHED_PATCHES.items()
    }
    sides = parse_sides(text)
    if sides is not None:
        makers[text.lower()] = functools.partial(
            pf.ContactPatch.rectangle, *sides, name=text.strip()
        )
    if make := makers.get(text.lower()):
        for name in size:
            if name != "width" or sides is not None:
                raise InvalidValueError(
                    f"--{name.replace('_', '-')}",
                    "be given only for a pressure map",
                    f"{size[name]} for the patch {text}",
                )
        return make()
    of_file = Path(text).suffix[1:].isalpha() or os.path.exists(text)
    if text[:1].isdigit() and not of_file:
        raise InvalidValueError(
            "patch", "have two sides such as 12x20mm, or be a name with --width", text
        )
    if not (Path(text).suffix or (text and os.path.exists(text))):
        from planarfriction._support import validation  # loads NumPy

        validation.choice("patch", text, [*patch_names(), "a pressure map file"])
    return pressure_map(text, size)


def patch_names() -> list[str]:
    """Return names that `find_patch` knows."""
    return [
        *PUBLISHED_PATCHES,
        *(name for name in _shapes(WIDTH) if name.title() not in PUBLISHED_PATCHES),
    ]


def _shapes(width: float) -> dict[str, Callable[[], pf.ContactPatch]]:
    """Return the shapes that their width alone describes, by name."""
    makers = {}
    for name, make in SHAPES.items():
        # A shape of one's own may have no parameters.
        parameters = list(inspect.signature(make).parameters.values())
        needed = any(each.default is each.empty for each in parameters[1:])
        first = parameters[0] if parameters else None
        if not needed and first and first.name in _PER_WIDTH:
            makers[name] = functools.partial(make, _PER_WIDTH[first.name] * width)
    return makers


def pressure_map(path: str | Path, size: Mapping[str, Any]) -> pf.ContactPatch:
    """Return the patch of a pressure map file, with the options of `map_options` that were given."""
    if not {"cell_size", "width"} & set(size):
        raise InvalidValueError(
            "--cell-size", f"be given (or --width) for the pressure map {path}", "none"
        )
    return pf.ContactPatch.from_pressure(path, **size)


PATCH_HELP = (
    f"{', '.join(PUBLISHED_PATCHES)}, disc, rectangle, two sides (12x20mm), or "
    "a pressure map (.csv, .npy, .npz, .mat, .asf, grey image; "
    "row 0 is the top) with --cell-size or --width."
)
"""Text on the values that the option `--patch` takes."""


class FilePath(click.Path):
    """A path that the commands check themselves, and that is one."""

    def convert(
        self, value: object, param: click.Parameter | None, ctx: click.Context | None
    ) -> Path:
        """Return the path; refuse an empty text, as of a variable that a script has not set."""
        if not str(value) or "\0" in str(value):
            self.fail(
                "the name of a file or a folder is needed, got an empty one", param, ctx
            )
        return Path(str(value))


FILE = FilePath()
"""Type of options that name files or folders."""


def or_file(words: Mapping[str, Any], incomplete: str) -> list[CompletionItem]:
    """Return completions by names that begin with the typed text in any case, with their descriptions, and by files."""
    typed = incomplete.lower()
    names = [name for name in words if name.lower().startswith(typed)]
    items = [CompletionItem(name, help=words[name]) for name in names]
    return [*items, CompletionItem(incomplete, type="file")]


def complete_scene(
    context: object, parameter: object, incomplete: str
) -> list[CompletionItem]:
    """Return completions of a scene: ready scenes that begin with the typed text, and files."""
    return or_file({name: SCENES.words(name) for name in SCENES}, incomplete)


def complete_patch(
    context: object, parameter: object, incomplete: str
) -> list[CompletionItem]:
    """Return completions of a patch: names that begin with the typed text in any case, and files."""
    return or_file(dict.fromkeys(patch_names()), incomplete)


cells_option = option(
    "--cells",
    type=int,
    help="Number of discs of the reduced model. Default: 24, or the file's.",
)
"""Option of commands that make models."""


def patch_option(default: str, name: str = "patch") -> Callable[[Any], Any]:
    """Make the option `--patch`, given to a command as `name`; `default` says what is taken without it."""
    return option(
        "--patch",
        name,
        metavar="PATCH",
        shell_complete=complete_patch,
        help=f"Contact patch: {PATCH_HELP} {default}",
    )


def _into_size(ctx: click.Context, param: click.Parameter, value: Any) -> None:
    """Put the value of an option into the argument `size` of its command, if it is given."""
    size = ctx.params.setdefault("size", {})
    if value is not None:
        size[param.name] = value


_map_option = functools.partial(option, expose_value=False, callback=_into_size)
"""Maker of options that a command gets as parts of its argument `size`."""

_MAP_OPTIONS = (
    _map_option(
        "--cell-size",
        type=LENGTH,
        help="Side of a cell of a pressure map (1mm, or in m).",
    ),
    _map_option(
        "--width",
        type=LENGTH,
        help=f"Width of a patch (20mm, or in m). Default: {WIDTH}, or the scene's or map's.",
    ),
    _map_option(
        "--header/--no-header",
        default=None,
        help="First row of a CSV map: names, or pressures.",
    ),
    _map_option(
        "--index/--no-index",
        default=None,
        help="First column of a CSV map: labels, or pressures.",
    ),
    _map_option(
        "--frame", type=int, help="Frame or page of a map that has several, from 0."
    ),
    _map_option(
        "--frame-shape",
        type=(int, int),
        metavar="ROWS COLUMNS",
        help="Shape of frames that are rows.",
    ),
    _map_option(
        "--threshold",
        type=float,
        help="Fraction of the peak up to which cells of a map count as empty.",
    ),
    _map_option(
        "--invert/--no-invert",
        default=None,
        help="In an image, dark means pressure, or bright does.",
    ),
)
"""Options that say how large a patch is and how a pressure map is read."""


def map_options(function: Any) -> Any:
    """Add the options of pressure maps; the command gets those that were given, by name, as `size`."""
    for add in reversed(_MAP_OPTIONS):
        function = add(function)
    return function


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
        raise FileError(
            one_line(f"{path}: {type(error).__name__}: {' '.join(str(error).split())}")
        ) from None
    if not callable(getattr(module, name, None)):
        raise FileError(f"{path}: has no function called {name}")
    return name, getattr(module, name)
