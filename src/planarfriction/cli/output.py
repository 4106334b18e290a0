"""Files that the commands write: the paths are checked before the work, the files are written after it."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

import planarfriction as pf
from planarfriction._support.writing import check_writable, replacing, write_text
from planarfriction.errors import FileError

PICTURES = (".png", ".pdf", ".svg")
"""Kinds of pictures."""


def check_kind(
    path: Path, kinds: tuple[str, ...] = (".csv",), what: str = "a table"
) -> Path:
    """Return `path` if a file of one of the `kinds` can be written there, or raise FileError."""
    if path.suffix.lower() not in kinds:
        raise FileError(f"{path}: {what} ends in {' or '.join(kinds)}")
    return check_writable(path)


def write_csv(path: Path, columns: Mapping[str, np.ndarray]) -> None:
    """Write columns of numbers with their names in the first line, exact to the last bit."""
    lines = [",".join(columns)]
    rows = zip(*(np.asarray(each).tolist() for each in columns.values()), strict=True)
    lines += [",".join(map(repr, row)) for row in rows]
    write_text(path, "\n".join(lines) + "\n")


def write_picture(figure: Any, path: Path) -> Path:
    """Write a matplotlib figure to `path`, of the kind that its suffix says; returns the path."""
    with replacing(path) as file:
        figure.savefig(file, format=path.suffix[1:].lower())
    return path


def write_solution(solution: pf.Solution, folder: Path, label: str) -> list[Path]:
    """Write a solution as NetCDF, which `planarfriction.Solution.load` reads, and as CSV; return both paths."""
    stem = f"{slug(solution.scene.name)}-{slug(label)}"
    stored = folder / f"{stem}.nc"
    table = folder / f"{stem}.csv"
    solution.save(stored)
    write_csv(table, history_columns(solution))
    return [stored, table]


def history_columns(solution: pf.Solution) -> dict[str, np.ndarray]:
    """Return the histories as columns [SI]: time, the body, then each contact's columns (`name.vx`) of a log."""
    histories = solution.histories
    names = ("time", "x", "y", "theta", "vx", "vy", "omega")
    columns = {name: histories[name].values for name in names}
    for index, contact in enumerate(map(str, histories["contact"].values)):
        twist = solution.contact_twist(contact).T
        own: dict[str, np.ndarray] = dict(zip(names[4:], twist, strict=True))
        for name in ("fx", "fy", "tau", "normal_force"):
            own[name] = histories[name].values[:, index]
        columns |= {f"{slug(contact)}.{name}": each for name, each in own.items()}
    return columns


def slug(text: str) -> str:
    """Return `text` as part of a file name: letters, digits, dots and hyphens."""
    return re.sub(r"[^\w.]+", "-", text).strip("-.") or "unnamed"
