"""Carry out experiments one after the other and keep what they find in a folder, so that nothing is done twice.

DIR/report.html              everything, figures inside
DIR/numbers.json             every number
DIR/<experiment>/            its figures (PNG, SVG), its curves (NetCDF), and `result.json`
DIR/<experiment>/pieces/     what an interrupted experiment has finished; gone when it is done
"""

from __future__ import annotations

import dataclasses
import functools
import hashlib
import json
import os
import platform
import shutil
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path
from typing import Any

import planarfriction
from planarfriction import __version__
from planarfriction._support import validation
from planarfriction._support.writing import make_folder, replacing, write_text
from planarfriction.scenes.solution import write_dataset
from planarfriction_studies.experiments import EXPERIMENTS, Experiment
from planarfriction_studies.experiments.experiment import Result, Work

Record = dict[str, Any]
"""A result as it is stored: what `result.json` holds."""


@dataclass(frozen=True)
class Reproduction:
    """Folder of results and options of a reproduction."""

    folder: Path
    quick: bool = False
    full: bool = False

    @property
    def fingerprint(self) -> str:
        """Fingerprint of the code, the packages beneath it and the options: results with another one are not reused."""
        return hashlib.sha256(
            f"{_code()} {self.quick} {self.full}".encode()
        ).hexdigest()

    def kept(self, name: str) -> Record | None:
        """Return the result of an experiment that an earlier run with the same code and options has finished."""
        try:
            record = json.loads(
                (self.folder / name / "result.json").read_text(encoding="utf-8")
            )
        except (OSError, ValueError):
            return None
        return (
            record
            if isinstance(record, dict)
            and record.get("fingerprint") == self.fingerprint
            else None
        )

    def records(self) -> list[Record]:
        """Return all results kept in the folder, in the order of the experiments."""
        return [
            record for name in EXPERIMENTS if (record := self.kept(name)) is not None
        ]

    def run(
        self,
        names: Sequence[str] | None = None,
        *,
        again: bool = False,
        progress: Callable[[str], None] | None = None,
    ) -> Iterator[Record]:
        """Carry out the experiments `names` (all by default) and yield each result as it is stored.

        What is kept is not done again, unless `again` asks for it. `progress` is called with the piece in work. Ctrl-C
        passes through; what is finished by then, pieces included, stays.

        Raises `InvalidValueError` for an unknown name, `FileError` where nothing can be written.
        """
        wanted = EXPERIMENTS if names is None else names
        chosen = [
            EXPERIMENTS[validation.choice("experiment", name, EXPERIMENTS)]
            for name in wanted
        ]
        for each in chosen:
            record = None if again else self.kept(each.name)
            yield self._carry_out(each, again, progress) if record is None else record

    def _carry_out(
        self, each: Experiment, again: bool, progress: Callable[[str], None] | None
    ) -> Record:
        home = self.folder / each.name
        pieces = home / "pieces"
        if again:
            shutil.rmtree(pieces, ignore_errors=True)
        begin = time.perf_counter()
        work = Work(self.quick, self.full, pieces, self.fingerprint, progress)
        result = each.run(work)
        if progress is not None:
            progress("drawing and writing")
        record = _record(each, result) | {"fingerprint": self.fingerprint}
        make_folder(home)
        for picture in result.pictures:
            with replacing(home / f"{picture.name}.png") as file:
                picture.figure.savefig(file, format="png", dpi=160)
            picture.figure.set_layout_engine("none")  # laid out once is enough for both
            with replacing(home / f"{picture.name}.svg") as file:
                picture.figure.savefig(file, format="svg", metadata={"Date": None})
        for name, dataset in result.data.items():
            write_dataset(dataset, home / f"{name}.nc")
        record["seconds"] = round(time.perf_counter() - begin, 2)
        write_text(home / "result.json", json.dumps(record, indent=1, allow_nan=False))
        shutil.rmtree(pieces, ignore_errors=True)
        return record

    def write_numbers(self) -> Path:
        """Write `numbers.json` from all results kept in the folder; returns its path."""
        path = self.folder / "numbers.json"
        write_text(path, json.dumps(self.numbers(), indent=1, allow_nan=False))
        return path

    def numbers(self) -> Record:
        """Return every number of the kept results, with what they were measured on."""
        keys = ("title", "seconds", "numbers", "comparisons")
        every = {
            record["name"]: {key: record[key] for key in keys}
            for record in self.records()
        }
        options = {"quick": self.quick, "full": self.full}
        return {
            "version": __version__,
            "options": options,
            "machine": machine(),
            "experiments": every,
        }


def machine() -> dict[str, Any]:
    """Return the machine and the versions that the numbers were computed with."""
    packages = {
        name: metadata.version(name)
        for name in ("numpy", "scipy", "numba", "matplotlib")
    }
    return {
        "processors": os.cpu_count(),
        "platform": platform.platform(),
        "python": platform.python_version(),
        **packages,
    }


def _record(each: Experiment, result: Result) -> Record:
    return {
        "name": each.name,
        "title": each.title,
        **{name: getattr(result, name) for name in ("verdict", "asked", "left_out")},
        "findings": list(result.findings),
        "pictures": [
            {"name": picture.name, "caption": picture.caption}
            for picture in result.pictures
        ],
        "tables": [_plain(dataclasses.asdict(table)) for table in result.tables],
        "comparisons": [
            _plain(dataclasses.asdict(row)) | {"share": row.share, "holds": row.holds}
            for row in result.comparisons
        ],
        "numbers": _plain(result.numbers),
        "data": [f"{name}.nc" for name in result.data],
    }


def _plain(value: Any) -> Any:
    """Convert a value to mappings, lists and Python's own numbers, which JSON accepts."""
    if isinstance(value, dict):
        return {str(key): _plain(each) for key, each in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(each) for each in value]
    return _plain(value.tolist()) if hasattr(value, "tolist") else value


@functools.cache
def _code() -> str:
    homes = Path(planarfriction.__file__).parent, Path(__file__).parents[1]
    digest = hashlib.sha256(f"{sys.version} {machine()}".encode())
    for home in homes:
        for path in sorted(
            path
            for path in home.rglob("*")
            if path.suffix in (".py", ".j2", ".json", ".npz")
        ):
            digest.update(path.read_bytes())
    return digest.hexdigest()
