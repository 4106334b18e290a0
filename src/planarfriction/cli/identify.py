"""`planarfriction identify`: parameters of a contact from logs of its motion and its wrench."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import planarfriction as pf
from planarfriction import validation
from planarfriction.cli import INTERRUPTED, output
from planarfriction.cli.console import note, work_progress
from planarfriction.errors import IdentificationInterrupted, InvalidValueError
from planarfriction.writing import make_folder, write_text


def identify(
    paths: Sequence[Path],
    patch: pf.ContactPatch,
    *,
    out: Path | None,
    normal_force: float | None,
    contact: str | None,
    parameters: str | None,
    start: Sequence[str],
    noise: str | None,
    plain: bool,
    steady: bool,
    model: str,
    nuisance: str | None,
    **search: Any,
) -> int:
    """Estimate the parameters from the logs, print them, and write JSON and picture into `out`; options as typed."""
    from planarfriction.identify import FitOptions, Log, identify_lugre

    chosen: dict[str, Any] = {"parameters": parse_names(parameters), "start": parse_start(start), "model": model}
    options = FitOptions(
        noise=parse_noise(noise),
        elasto_plastic=None if plain else "auto",
        begins="steady" if steady else "rest",
        nuisance=parse_nuisance(nuisance),
        **search,
    )
    if out is not None:
        make_folder(out)
    logs = []
    with work_progress("identifying") as progress:
        for path in paths:
            progress(f"reading {path.name}")
            logs.append(Log.from_csv(path, normal_force=normal_force, contact=contact))
        try:
            found = identify_lugre(logs, patch, **chosen, options=options, progress=progress)
        except IdentificationInterrupted as stop:
            print(stop)
            return INTERRUPTED
    samples = sum(len(log.time) for log in logs)
    title = f"{', '.join(log.name for log in logs)}: {samples} samples, {patch.name}"
    print(title, "", found.table(), sep="\n")
    note(f"{found.starts[0]} of {found.starts[1]} starting points led to this minimum")
    if out is not None:
        stem = output.slug(logs[0].name)
        table, picture = out / f"{stem}-identification.json", out / f"{stem}-residuals.png"
        write_text(table, json.dumps(found.to_dict(), indent=2) + "\n")
        note(f"wrote {table}")
        note(f"wrote {output.write_picture(found.plot(), picture)}")
    return 0


def parse_start(entries: Sequence[str]) -> dict[str, float]:
    """Parse the values of `--start NAME=VALUE`, by name."""
    start = {}
    for entry in entries:
        name, equals, value = entry.partition("=")
        if not equals:
            raise InvalidValueError("--start", "be NAME=VALUE, such as mu_c=0.4", entry)
        start[name.strip()] = validation.number_in(f"--start {name.strip()}", value)
    return start


def parse_names(text: str | None) -> tuple[str, ...]:
    """Parse the names of `--parameters`, separated by commas; the usual ones without it."""
    from planarfriction.identify.parameters import USUAL, check_names

    return USUAL if text is None else check_names([name.strip() for name in text.split(",") if name.strip()])


def parse_nuisance(text: str | None) -> tuple[str, ...]:
    """Parse the names of `--nuisance`, separated by commas; all without it."""
    from planarfriction.identify.rig import GROUPS

    if text is None:
        return GROUPS
    return () if text.strip() == "none" else tuple(name.strip() for name in text.split(","))


def parse_noise(text: str | None) -> list[float] | None:
    """Parse the three numbers of `--noise`."""
    return None if text is None else [validation.number_in("--noise", part) for part in text.split(",")]
