"""What the options of several commands share."""

from __future__ import annotations

from pathlib import Path

import click

from planarfriction.families import PUBLISHED_PATCHES

PATCH_HELP = (
    f"{', '.join(PUBLISHED_PATCHES)}, another shape that its width describes (disc, rectangle), or a pressure map "
    "(.csv, .npy, grey image; row 0 is the top) with --cell-size."
)


class FilePath(click.Path):
    """A path that the commands check themselves, and that is one."""

    def convert(self, value: object, param: click.Parameter | None, ctx: click.Context | None) -> Path:
        """The path; an empty text, as of a variable that a script has not set, is none."""
        if not str(value) or "\0" in str(value):
            self.fail("the name of a file or a folder is needed, got an empty one", param, ctx)
        return Path(str(value))


FILE = FilePath()
