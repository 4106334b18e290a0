"""Command line: `planarfriction run`, `sweep`, `limit-surface`, `reproduce`, `identify`, `bench` and others."""

from __future__ import annotations

import gc
import io
import sys
import warnings
from collections.abc import Sequence
from typing import Any

from planarfriction.errors import FrictionError, one_line

INTERRUPTED = 130
"""Exit code after Ctrl-C, as shells report it."""

BAD_INPUT = 2
"""Exit code where the input is wrong."""

OUT_OF_TOLERANCE = 1
"""Exit code where a reproduced number misses its reference."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit code; what the user got wrong is one line on stderr, exit code 2."""
    try:
        return _run(list(sys.argv[1:] if arguments is None else arguments))
    except KeyboardInterrupt:  # also while modules load
        return INTERRUPTED


def _run(arguments: list[str]) -> int:
    import click

    from planarfriction.cli.app import app

    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            # Names of files need not be text that a terminal can show.
            stream.reconfigure(errors="backslashreplace")
    try:
        with warnings.catch_warnings():
            warnings.showwarning = _warn
            code = app.main(
                arguments or ["--help"],
                prog_name="planarfriction",
                standalone_mode=False,
            )
    except FrictionError as error:
        return _fail(str(error))
    except click.ClickException as error:
        return _fail(error.format_message())
    except click.Abort:  # how click calls Ctrl-C where its own code runs
        return INTERRUPTED
    finally:
        gc.enable()
    return code if isinstance(code, int) else 0


def _warn(message: Warning | str, *where: Any) -> None:
    """Print a warning in one line, without the place in the code that it comes from."""
    print("warning:", " ".join(str(message).split()), file=sys.stderr)


def _fail(message: str) -> int:
    print("error:", one_line(" ".join(message.split())), file=sys.stderr)
    return BAD_INPUT
