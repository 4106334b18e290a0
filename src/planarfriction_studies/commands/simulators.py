"""`planarfriction simulators`: compare patch friction inside simulators with their own friction."""

from __future__ import annotations

import json
from pathlib import Path

from planarfriction.cli.console import note, print_table
from planarfriction.writing import make_folder, write_text
from planarfriction_studies.commands.reproduce import carry_out


def compare(folder: Path, *, quick: bool, again: bool) -> int:
    """Carry out the comparison, write its numbers and its figure, print its tables; returns the exit code."""
    from planarfriction_studies.experiments import COMPARISONS
    from planarfriction_studies.experiments.reproduction import Reproduction

    reproduction = Reproduction(make_folder(folder), quick, experiments=COMPARISONS)
    code = carry_out(reproduction, list(COMPARISONS), again=again)
    for record in reproduction.records():
        for table in record["tables"]:
            print_table(table["title"], table["headings"], table["rows"])
        for finding in record["findings"]:
            print(finding)
        home = reproduction.folder / record["name"]
        for picture in record["pictures"]:
            note(f"wrote {home / picture['name']}.png")
        write_text(reproduction.folder / "numbers.json", json.dumps(reproduction.numbers(), indent=1, allow_nan=False))
        note(f"wrote {reproduction.folder / 'numbers.json'}")
    return code
