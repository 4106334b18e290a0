"""`planarfriction bench`: present what `planarfriction_studies.bench` measures."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Sequence
from typing import Any

from planarfriction.cli.console import print_table, work_progress


def measure(names: Sequence[str] | None, *, full: bool) -> list[Any]:
    """Run the benchmarks called `names` (all if empty), with progress on stderr."""
    from planarfriction_studies import bench

    with work_progress("measuring") as progress:
        return bench.run(list(names) if names else None, full=full, progress=progress)


def show_json(lines: Sequence[Any]) -> None:
    """Print the measurements as a JSON list."""
    print(json.dumps([dataclasses.asdict(line) for line in lines], indent=2))


def show_table(lines: Sequence[Any]) -> None:
    """Print the measurements as a table."""
    rows = [
        [
            line.name,
            _number(line.value),
            line.unit,
            str(line.baseline or ""),
            _number(line.baseline_value),
            _number(line.ratio),
        ]
        for line in lines
    ]
    print_table("Benchmarks", ["name", "value", "unit", "baseline", "of the baseline", "ratio"], rows)


def _number(value: float | None) -> str:
    return "" if value is None else f"{value:.4g}"
