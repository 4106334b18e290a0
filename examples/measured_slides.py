"""Compare friction models with published measurements of a sliding cube: from its first 8 poses to the end.

    python examples/measured_slides.py --out out/
    python examples/measured_slides.py FOLDER

The tables come with the package; FOLDER may contain others of the same format. The script does the same as
`planarfriction measured --task slides`; docs/measured.md explains how to test a model of your own.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence

from planarfriction.cli import main as planarfriction

TASKS = ("slides",)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the comparison; returns the exit code."""
    given = list(sys.argv[1:] if arguments is None else arguments)
    tables = (
        ["--tables", given.pop(0)] if given and not given[0].startswith("-") else []
    )
    return planarfriction(
        ["measured", *(f"--task={task}" for task in TASKS), *tables, *given]
    )


if __name__ == "__main__":
    sys.exit(main())
