"""The measured tables: those that come with the package, or those of a folder, as checked columns."""

from __future__ import annotations

import importlib.resources
import zlib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from planarfriction.errors import FileError

TABLES = {
    "slides": "contactnets_slides.csv.gz",
    "pushes": "zhou_icra16_pushes.csv",
    "supports": "zhou_icra16_supports.csv",
    "published": "zhou_icra16_published_errors.csv",
    "series": "mlab_pushes.csv.gz",
    "onsets": "mlab_onsets_pushes.csv",
    "forces": "mlab_onsets.csv.gz",
    "joints": "xl330_joints.csv.gz",
    "joint logs": "xl330_joints_logs.csv",
}
"""Files of the tables by name."""


def shipped() -> Any:
    """Return the folder of the tables inside the package, with their NOTICE."""
    return importlib.resources.files("planarfriction_studies.measured") / "data"


def read_table(
    name: str,
    numbers: Sequence[str],
    words: Sequence[str] = (),
    *,
    folder: Path | None = None,
    optional=(),
) -> Any:  # a pandas.DataFrame, whose type no checker follows
    """Read columns of the table `name`: `numbers` as finite numbers (but for those of `optional`), `words` as they are.

    Raises FileError in one line that names the file, and the column and row that are wrong.
    """
    import pandas as pd

    file = (shipped() if folder is None else Path(folder)) / TABLES[name]
    try:
        with file.open("rb") as opened:
            found: Any = pd.read_csv(
                opened, compression="gzip" if TABLES[name].endswith(".gz") else None
            )
    except FileNotFoundError:
        raise FileError(f"{file}: no such file") from None
    except (
        OSError,
        EOFError,
        ValueError,
        zlib.error,
    ) as error:  # a folder, a broken archive, no text, no table
        raise FileError(
            f"{file}: cannot be read as a table: {' '.join(str(error).split())}"
        ) from None
    needed = [*words, *numbers]
    if missing := [column for column in needed if column not in found]:
        raise FileError(
            f"{file}: has no column {', '.join(missing)}; needed are {', '.join(needed)}"
        )
    found = found[needed].copy()
    found[list(numbers)] = found[list(numbers)].apply(pd.to_numeric, errors="coerce")
    checked = [column for column in numbers if column not in optional]
    bad = np.argwhere(~np.isfinite(found[checked].to_numpy(dtype=float)))
    if len(bad):
        raise FileError(
            f"{file}: column {checked[bad[0, 1]]}, row {bad[0, 0] + 1} below the heading: not a number"
        )
    if not len(found):
        raise FileError(f"{file}: has no rows")
    return found


def refuse(name: str, folder: Path | None, what: str) -> FileError:
    """Return an error about the table `name`."""
    return FileError(
        f"{(shipped() if folder is None else Path(folder)) / TABLES[name]}: {what}"
    )
