"""The commands `simulator-benchmark` (alias `referee`) and `simulators`, a view of it; each loads its parts late."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from planarfriction.cli.options import FILE

ENGINE = click.option(
    "--engine",
    "engines",
    metavar="NAME",
    multiple=True,
    help="Only this engine, or all with this prefix; may be repeated.",
)
CASE = click.option(
    "--case",
    "cases",
    metavar="NAME",
    multiple=True,
    help="Only this case, or a TOML file; may be repeated.",
)
JSON = click.option(
    "--json",
    "file",
    type=FILE,
    help="File for a JSON list of results; a later run continues from it.",
)


@click.group(
    name="simulator-benchmark",
    invoke_without_command=True,
    short_help="Benchmark the friction of simulators against exact solutions.",
)
@ENGINE
@CASE
@click.option("--step", type=float, help="Time step in s. Default: those of each case.")
@click.option("--quick", is_flag=True, help="The first two engines.")
@click.option("--list", "list_only", is_flag=True, help="List cases and engines.")
@JSON
@click.option(
    "--out",
    "folder",
    type=FILE,
    help="Folder for referee.json and referee.html, with a picture per case.",
)
@click.pass_context
def referee(
    context: click.Context,
    engines: tuple[str, ...],
    cases: tuple[str, ...],
    step: float | None,
    quick: bool,
    list_only: bool,
    file: Path | None,
    folder: Path | None,
) -> int:
    """Benchmark the contact friction of simulators on cases with exact solutions: closed forms, or exact motions.

    Every engine that is installed runs every case with default and with tuned settings, this library's adapters among
    them. Marks: ok within the allowed error, off up to ten times that, fails beyond it; - if an engine cannot
    describe the case. With --json, results are written as they come, and the same command continues from the file.

    \b
    Examples:
      planarfriction simulator-benchmark
      planarfriction simulator-benchmark --quick
      planarfriction simulator-benchmark --engine MuJoCo --case stop --step 0.005
      planarfriction simulator-benchmark --json results.json --out report/
      planarfriction simulator-benchmark export cases/
    """
    if context.invoked_subcommand is not None:
        return 0
    from planarfriction._support import validation
    from planarfriction._support.writing import make_folder
    from planarfriction.cli.console import note, print_table
    from planarfriction_studies.referee import report

    chosen = _cases(cases)
    left_out: list[str] = []
    found = _engines(engines, left_out)[: 2 if quick else None]
    if list_only:
        print_table(
            "Cases",
            ["name", "description"],
            [[each.name, each.title] for each in chosen.values()],
        )
        print_table(
            "Engines",
            ["name", "settings"],
            [
                [each.name, each.settings.replace("as it comes", "default")]
                for each in found
            ],
        )
        return 0
    steps = None if step is None else (validation.positive("--step", step),)
    if folder is not None:
        make_folder(folder)
    verdicts, code = _judged(chosen, found, file, steps)
    print_table(
        "Error over allowed error",
        *report.table(verdicts),
    )
    for text in left_out:
        note(f"left out: {text}")
    for path in report.write(verdicts, chosen, found, folder):
        note(f"wrote {path}")
    return code


def _judged(
    cases: dict[str, Any],
    engines: list[Any],
    file: Path | None,
    steps: tuple[float, ...] | None = None,
) -> tuple[list[Any], int]:
    """Judge with progress; return verdicts, those of the file among them, and the exit code."""
    from planarfriction._support.writing import check_writable
    from planarfriction.cli import INTERRUPTED
    from planarfriction.cli.console import note, work_progress
    from planarfriction.errors import FrictionError
    from planarfriction_studies.referee.run import Apart, Kept, run

    if not engines:
        raise FrictionError(
            "no simulator is installed: run pip install 'planarfriction[mujoco]' or [drake], [mjx]"
        )
    if file is not None:
        check_writable(file)
    kept = Kept(file)
    code = 0
    try:
        with Apart() as apart, work_progress("benchmark") as report:
            progress = lambda done, of, words: report(words, done, of)
            run(
                cases, engines, kept, steps=steps, judged=apart.judge, progress=progress
            )
    except KeyboardInterrupt:
        code = INTERRUPTED
    verdicts = kept.of(cases, engines)
    if code:
        goes_on = "" if file is None else ": the same command continues from there"
        note(
            f"interrupted: {len(verdicts)} of {len(cases) * len(engines)} results are finished{goes_on}"
        )
    return verdicts, code


@click.command(short_help="Compare patches with simulators' own friction.")
@ENGINE
@CASE
@JSON
def simulators(
    engines: tuple[str, ...], cases: tuple[str, ...], file: Path | None
) -> int:
    """Compare patch friction in simulators with their own friction, with default and with the best settings.

    This is a view of `planarfriction simulator-benchmark`, in units instead of marks. Results in the --json
    file are not computed again.

    \b
    Examples:
      planarfriction simulators
      planarfriction simulators --engine MuJoCo --json results.json
    """
    from planarfriction.cli.console import note, print_table
    from planarfriction_studies.referee import report

    left_out: list[str] = []
    verdicts, code = _judged(_cases(cases), _engines(engines, left_out), file)
    for name, table in report.simulators(verdicts).items():
        print_table(f"{name}: largest errors", *table)
    for text in left_out:
        note(f"left out: {text}")
    return code


@referee.command(short_help="Write all cases for other engines.")
@click.argument("folder", type=FILE)
def export(folder: Path) -> int:
    """Write all cases to FOLDER, to be run without this library: for each its TOML, MJCF and SDF of its bodies and
    friction, the forces on its bodies over time, and the truths with their errors, as CSV.

    \b
    Examples:
      planarfriction simulator-benchmark export cases/
    """
    from planarfriction._support.writing import make_folder
    from planarfriction.cli.console import note
    from planarfriction_studies.referee.case import all_cases
    from planarfriction_studies.referee.export import export_case

    make_folder(folder)
    for case in all_cases().values():
        export_case(case, folder)
    note(f"wrote {folder}")
    return 0


def _cases(names: tuple[str, ...]) -> dict[str, Any]:
    """Return the cases that are asked for: by name, or from a file."""
    from planarfriction._support import validation
    from planarfriction_studies.referee.case import all_cases, read_case

    own = all_cases()
    if not names:
        return own
    found = [
        read_case(Path(name))
        if name.endswith(".toml")
        else own[validation.choice("--case", name, own)]
        for name in names
    ]
    return {case.name: case for case in found}


def _engines(names: tuple[str, ...], left_out: list[str]) -> list[Any]:
    """Return the engines that are asked for."""
    from planarfriction.errors import InvalidValueError
    from planarfriction_studies.referee.engines import installed

    found = list(installed(left_out))
    for name in names:
        if not any(engine.name.lower().startswith(name.lower()) for engine in found):
            installed = "; ".join(engine.name for engine in found) or "none"
            rule = f"begin the name of an engine that is installed: {installed}"
            raise InvalidValueError("--engine", rule, name)
    exact = {name.lower() for name in names} & {each.name.lower() for each in found}

    def asked(engine: Any) -> bool:
        name = engine.name.lower()
        return name in exact or any(
            name.startswith(each.lower()) for each in names if each.lower() not in exact
        )

    return [each for each in found if not names or asked(each)]
