"""Command line: `planarfriction run`, `planarfriction limit-surface`, `planarfriction bench`."""

from __future__ import annotations

import gc
import sys
from collections.abc import Sequence

from planarfriction.errors import FrictionError

INTERRUPTED = 130
"""Exit code after Ctrl-C, as shells report it."""

BAD_INPUT = 2
"""Exit code where the input is wrong."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit code; what the user got wrong is one line on stderr, exit code 2."""
    from planarfriction.cli.app import app

    given = list(sys.argv[1:] if arguments is None else arguments)
    try:
        code = app(args=given or ["--help"], prog_name="planarfriction", standalone_mode=False)
    except FrictionError as error:
        return _fail(str(error))
    except KeyboardInterrupt:
        return INTERRUPTED
    except Exception as error:
        if not hasattr(error, "format_message"):  # what typer raises for wrong usage has it, whatever class it is
            raise
        return _fail(error.format_message())  # pyright: ignore[reportAttributeAccessIssue]
    finally:
        gc.enable()
    return code if isinstance(code, int) else 0


def _fail(message: str) -> int:
    print("error:", " ".join(message.split()), file=sys.stderr)
    return BAD_INPUT
