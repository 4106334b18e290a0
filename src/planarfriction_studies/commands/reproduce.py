"""`planarfriction reproduce`: the experiments of the paper, one report."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from planarfriction.cli import INTERRUPTED, OUT_OF_TOLERANCE
from planarfriction.cli.console import note, print_table, work_progress
from planarfriction.errors import InvalidValueError
from planarfriction.writing import make_folder

if TYPE_CHECKING:
    from planarfriction_studies.experiments.reproduction import Reproduction


def show_list() -> None:
    """Print the experiments."""
    from planarfriction_studies.experiments import EXPERIMENTS

    width = max(map(len, EXPERIMENTS))
    for each in EXPERIMENTS.values():
        print(f"{each.name:{width}}  {each.title}")


def reproduce(names: Sequence[str], folder: Path, *, quick: bool, full: bool, again: bool) -> int:
    """Carry out the experiments `names` (all if empty), write the report; returns the exit code."""
    from planarfriction_studies.experiments import EXPERIMENTS, find_experiment

    if quick and full:
        raise InvalidValueError("--quick", "not be given together with --full", "both")
    chosen = [find_experiment(name).name for name in names] or list(EXPERIMENTS)
    from planarfriction_studies.experiments.reproduction import Reproduction

    reproduction = Reproduction(make_folder(folder), quick, full)
    code = carry_out(reproduction, chosen, again=again)
    _write(reproduction)
    return code


def carry_out(reproduction: Reproduction, chosen: Sequence[str], *, again: bool) -> int:
    """Carry out the experiments `chosen`, with progress and a line for each; returns the exit code."""
    code = 0
    try:
        for index, name in enumerate(chosen, 1):
            earlier = reproduction.kept(name) is not None and not again
            with work_progress(f"{index} of {len(chosen)}, {name}") as progress:
                (record,) = reproduction.run([name], again=again, progress=progress)
            missed = [row["quantity"] for row in record["comparisons"] if not row["holds"]]
            code = OUT_OF_TOLERANCE if missed else code
            when = "kept from an earlier run" if earlier else f"{record['seconds']:.1f} s"
            note(f"{name}: {len(record['comparisons'])} compared, {len(missed)} out of tolerance ({when})")
            for quantity in missed:
                note(f"  out of tolerance: {quantity}")
    except KeyboardInterrupt:
        note(f"stopped in {name}: the same command continues from there")
        code = INTERRUPTED
    return code


def _write(reproduction) -> None:
    """Write the report and the numbers of everything finished so far; print the summary."""
    import json

    from planarfriction.writing import write_text
    from planarfriction_studies.experiments.report import write_report
    from planarfriction_studies.experiments.wording import number

    records = reproduction.records()
    if not records:
        return
    numbers = reproduction.folder / "numbers.json"
    write_text(numbers, json.dumps(reproduction.numbers(), indent=1, allow_nan=False))
    rows = []
    for record in records:
        missed = sum(not row["holds"] for row in record["comparisons"])
        rows.append([record["name"], f"{len(record['comparisons'])}", f"{missed}", number(record["seconds"])])
    print_table("Reproduced", ["experiment", "compared", "out of tolerance", "time [s]"], rows)
    note(f"wrote {write_report(reproduction)}")
    note(f"wrote {numbers}")
