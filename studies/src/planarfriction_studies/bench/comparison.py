"""Two runs of `planarfriction bench`: how far the ratios to the baselines have moved, and by how much they scatter."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from planarfriction._support.reading import read_text
from planarfriction.cli.doctor import processor
from planarfriction.errors import FileError, InvalidValueError
from planarfriction.extend import processors
from planarfriction_studies.bench.measurement import Measurement

ROUNDS = 3
"""Rounds of a run that is compared, unless said otherwise."""

LEAST_SHARE = 0.9
"""Share of its processor below which a busy loop says that others use the machine: its own clock costs a percent."""

_LOOP = """
import time
begin, used = time.perf_counter(), time.process_time()
while time.perf_counter() - begin < 0.5:
    pass
print((time.process_time() - used) / (time.perf_counter() - begin))
"""


class Change(NamedTuple):
    """One benchmark in two runs."""

    now: Measurement
    then: Measurement
    change: float
    """Ratio to the baseline now over the ratio then: above 1 where the library has become faster."""
    low: float
    high: float
    """Lowest and highest change of any round now over any round then."""


def read_run(path: Path) -> dict[str, Measurement]:
    """Read what `planarfriction bench --json` printed; raise FileError in one line if the file is something else."""
    try:
        rows = [
            Measurement(**row)
            for row in json.loads(read_text(path, "a run of planarfriction bench"))
        ]
    except (ValueError, TypeError):
        raise FileError(
            f"{path}: is not what planarfriction bench --json prints"
        ) from None
    return {row.name: row for row in rows}


def changes(now: Sequence[Measurement], then: dict[str, Measurement]) -> list[Change]:
    """Compare the benchmarks that both runs have with a ratio."""
    found = []
    for each in now:
        before = then.get(each.name)
        if before is None or not each.ratio or not before.ratio:
            continue
        new = each.ratios or (each.ratio,)
        old = before.ratios or (before.ratio,)
        spread = min(new) / max(old), max(new) / min(old)
        found.append(Change(each, before, each.ratio / before.ratio, *spread))
    return found


def rows(compared: Sequence[Change]) -> list[list[str]]:
    """Return the rows of the table: a change counts where its whole spread lies on one side of 1."""
    table = []
    for each in compared:
        verdict = "faster" if each.low > 1.0 else "slower" if each.high < 1.0 else ""
        values = [f"{one.value:.4g} {one.unit}" for one in (each.then, each.now)]
        ratios = [f"{one.ratio:.4g}" for one in (each.then, each.now)]
        table.append(
            [
                each.now.name,
                *values,
                *ratios,
                f"{each.change:.3f}",
                f"{each.low:.3f} to {each.high:.3f}",
                verdict,
            ]
        )
    return table


def free_share() -> float:
    """Measure which share of a processor busy loops get, one on each processor at once: the smallest of them."""
    command = [sys.executable, "-c", _LOOP]
    loops = [
        subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        for _ in range(processors())
    ]
    return min(float(each.communicate()[0]) for each in loops)


def machine() -> str:
    """Return the instruction set that compiled loops use, and a warning if other programs use this machine."""
    words = f"compiled loops use {processor()[1][1]}"
    if (share := free_share()) < LEAST_SHARE:
        words += f"; other programs leave {share:.0%} of a processor: ratios of rows on threads are rough"
    return words


def check_idle() -> None:
    """Raise InvalidValueError if other programs use this machine."""
    if (share := free_share()) < LEAST_SHARE:
        raise InvalidValueError(
            "machine",
            "be idle for a comparison (or give --force)",
            f"{share:.0%} of a processor",
        )
