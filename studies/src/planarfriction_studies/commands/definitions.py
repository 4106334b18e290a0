"""The commands `bench`, `measured` and `reproduce`; each loads what it needs when it runs."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from planarfriction.cli.options import FILE

if TYPE_CHECKING:
    from planarfriction_studies.experiments.reproduction import Reproduction


# ---------------------------------------------------------------------- bench

THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
"""Variables by which libraries of linear algebra, and PyTorch, learn how many threads to use."""


WIDEST = 100
"""Letters of a line of the table of benchmarks where it is not printed on a terminal."""


def use_one_thread() -> None:
    """Give libraries of linear algebra that are loaded after this one thread, unless OMP_NUM_THREADS says otherwise."""
    for name in THREADS:
        os.environ.setdefault(name, os.environ.get("OMP_NUM_THREADS", "1"))


@click.command(short_help="Measure the speed of this installation.")
@click.option(
    "--only",
    metavar="NAME",
    multiple=True,
    help="Only this benchmark; may be repeated.",
)
@click.option("--full", is_flag=True, help="Include the baselines that take minutes.")
@click.option(
    "--rounds", type=int, help="Rounds of each benchmark. Default: 1, with --compare 3."
)
@click.option(
    "--compare",
    "old",
    type=FILE,
    help="Earlier run to compare with, as --json prints it.",
)
@click.option(
    "--force", is_flag=True, help="Compare although other programs use the machine."
)
@click.option(
    "--json",
    "as_json",
    is_flag=True,
    help="Print a JSON list and nothing else on stdout.",
)
def bench(
    only: tuple[str, ...],
    full: bool,
    rounds: int | None,
    old: Path | None,
    force: bool,
    as_json: bool,
) -> None:
    """Measure the speed of this installation, each benchmark next to its baseline from the same run.

    \b
    Examples:
      planarfriction bench
      planarfriction bench --only in_hand.reduced --json
      planarfriction bench --full
      planarfriction bench --json > old.json
      planarfriction bench --compare old.json --only sweep

    --compare measures again and prints how far the ratios to the baselines have moved since, which depends less on the
    machine than the times do. What runs on one thread is measured by its least processor time, all else by medians.
    NumPy, SciPy and PyTorch get one thread unless OMP_NUM_THREADS says otherwise.
    """
    import dataclasses
    import json

    from planarfriction.cli.console import print_table, work_progress

    use_one_thread()
    from planarfriction_studies import bench as benchmarks
    from planarfriction_studies.bench import comparison

    then = None if old is None else comparison.read_run(old)
    if then is not None and not force:
        comparison.check_idle()
    with work_progress("measuring") as progress:
        rounds = (
            rounds if rounds is not None else 1 if then is None else comparison.ROUNDS
        )
        names = list(only) or (
            None
            if then is None
            else [name for name in benchmarks.BENCHMARKS if name in then]
        )
        lines = benchmarks.run(names, full=full, rounds=rounds, progress=progress)
    click.echo(comparison.machine(), err=True)
    if as_json:
        print(json.dumps([dataclasses.asdict(line) for line in lines], indent=2))
    elif then is not None:
        headings = [
            "name",
            "then",
            "now",
            "ratio then",
            "ratio now",
            "change",
            "spread",
            "",
        ]
        print_table(
            "Ratios to the baselines",
            headings,
            comparison.rows(comparison.changes(lines, then)),
            width=WIDEST,
        )
    else:
        shown = lambda value, unit="": (
            "" if value is None else f"{value:.4g} {unit}".strip()
        )
        rows = [
            [each.name, *(shown(value, each.unit) for value in (each.value, each.baseline_value)), shown(each.ratio),
             each.baseline or ""]
            for each in lines
        ]  # fmt: skip
        print_table(
            "Benchmarks",
            ["name", "cost", "of the baseline", "ratio", "baseline"],
            rows,
            width=WIDEST,
        )


# ---------------------------------------------------------------------- measured


@click.command(short_help="Compare friction models on measured data.")
@click.option(
    "--task",
    "tasks",
    metavar="NAME",
    multiple=True,
    help="Only this task; may be repeated.",
)
@click.option(
    "--only",
    metavar="NAME",
    multiple=True,
    help="Only this model of the library; may be repeated.",
)
@click.option(
    "--own",
    metavar="FILE.py:NAME",
    multiple=True,
    help="A model of your own; may be repeated.",
)
@click.option("--list", "list_only", is_flag=True, help="List models and tasks.")
@click.option(
    "--tables",
    type=FILE,
    help="Folder with the measured tables. Default: those of the package.",
)
@click.option("--out", "folder", type=FILE, help="Folder for JSON and pictures.")
@click.option(
    "--seed",
    type=int,
    default=0,
    show_default=True,
    help="Random seed of the bootstrap.",
)
@click.option(
    "--json", "as_json", is_flag=True, help="Print JSON and nothing else on stdout."
)
def measured(
    tasks: tuple[str, ...],
    only: tuple[str, ...],
    own: tuple[str, ...],
    list_only: bool,
    tables: Path | None,
    folder: Path | None,
    seed: int,
    as_json: bool,
) -> int:
    """Compare friction models on published measurements, which come with the package: four tasks, fixed splits.

    slides: the path and final pose of a cube on a table, from its first 8 poses. pushes: the twist of an object that is
    pushed slowly, from the wrench. series: twists and wrenches during whole pushes. onsets: the final pose of a push
    from its touch, and the peak of the force at breakaway. Each model is fitted to the training cases and scored on
    the others, with bootstrap intervals. --own adds your own function (docs/measured.md). The task joints, which runs
    only by its name, fits the friction of a servo from eight logs (docs/joints.md).

    \b
    Examples:
      planarfriction measured --out results/
      planarfriction measured --task slides --only "exact surface" --own my_model.py:predict
      planarfriction measured --task joints
      planarfriction measured --list
    """
    from planarfriction._support import validation
    from planarfriction._support.writing import make_folder
    from planarfriction.cli import INTERRUPTED
    from planarfriction.cli.console import note, print_table, work_progress
    from planarfriction.errors import FrictionError, InvalidValueError
    from planarfriction_studies.measured import TASKS, Benchmark
    from planarfriction_studies.measured.library import LIBRARY

    if list_only:
        rows = [
            [name, each.words, "" if each.installed else f"[{each.extra}]"]
            for name, each in LIBRARY.items()
        ]
        print_table("Models", ["name", "description", "needs"], rows)
        rows = [[task.name, task.title] for task in TASKS.values()]
        print_table(
            "Tasks",
            ["name", "description"],
            [*rows, ["joints", "Friction of a servo from its goal and position"]],
        )
        return 0
    for task in tasks:
        validation.choice("--task", task, (*TASKS, "joints"))
    if tasks == ("joints",):
        return _joints(tables, folder, as_json)
    if "joints" in tasks:
        raise InvalidValueError(
            "--task", "be joints alone, or other tasks", ", ".join(tasks)
        )
    validation.count("--seed", seed, 0)
    models, left_out = _models(only, own)
    if folder is not None:
        make_folder(folder)
    benchmark = Benchmark(models, tasks or tuple(TASKS), tables, seed)
    benchmark.left_out += left_out
    code = 0
    wrong = None
    try:
        with work_progress("measured") as progress:
            benchmark.run(progress)
    except KeyboardInterrupt:
        done = sum(map(len, benchmark.results.values()))
        note(
            f"interrupted: {done} of {len(models) * len(benchmark.tasks)} results are finished"
        )
        code = INTERRUPTED
    except FrictionError as error:  # of a model: the others are done
        wrong = error
    _show(benchmark, as_json, folder if benchmark.results else None)
    if wrong is not None:
        raise wrong
    return code


def _joints(tables: Path | None, folder: Path | None, as_json: bool) -> int:
    """Fit the joint, print what was found, and draw it."""
    import json

    from planarfriction._support.writing import make_folder
    from planarfriction.cli.console import note, work_progress
    from planarfriction.cli.output import write_picture
    from planarfriction_studies.measured.joints import fit_joints

    if folder is not None:
        make_folder(folder)
    with work_progress("measured") as progress:
        fit = fit_joints(tables, progress=progress)
    print(json.dumps(fit.to_dict(), indent=2) if as_json else fit.table())
    if folder is not None:
        note(f"wrote {write_picture(fit.plot(), folder / 'joints.png')}")
    return 0


def _models(
    only: Sequence[str], own: Sequence[str]
) -> tuple[dict[str, Any], list[str]]:
    """Return the models that are asked for, and what is left out."""
    from planarfriction._support import validation
    from planarfriction.cli.options import load_function
    from planarfriction.errors import InvalidValueError
    from planarfriction_studies.measured.library import LIBRARY, library

    left_out: list[str] = []
    models = {}
    if only or not own:
        chosen = [validation.choice("--only", name, LIBRARY) for name in only] or list(
            LIBRARY
        )
        there = library(left_out)
        models = {name: there[name] for name in chosen if name in there}
    for entry in own:
        name, model = load_function("--own", entry)
        if name in models or name in LIBRARY:
            raise InvalidValueError(
                "--own",
                "have a name that differs from those of the library's models",
                name,
            )
        models[name] = model
    return models, left_out


def _show(benchmark: Any, as_json: bool, folder: Path | None) -> None:
    """Print the tables, or JSON; write JSON and pictures to a folder."""
    import json

    import numpy as np

    from planarfriction._support.writing import write_text
    from planarfriction.cli import output
    from planarfriction.cli.console import note, print_table
    from planarfriction_studies.measured.benchmark import table, to_dict
    from planarfriction_studies.measured.figures import draw
    from planarfriction_studies.measured.tasks import TASKS

    if as_json:
        print(json.dumps(to_dict(benchmark), indent=1))
    for name, results in {} if as_json else benchmark.results.items():
        counts = [each.cases for each in next(iter(results.values())).scores.values()]
        tests = f"{counts[0]} tosses" if name == "slides" else f"{sum(counts)} tests"
        print_table(f"{TASKS[name].title} ({tests})", *table(benchmark, name))
        for model, result in results.items():
            if result.fitted:
                for key, value in result.checked.items():
                    note(
                        f"{model}: {key} {' '.join(f'{each:.3g}' for each in np.atleast_1d(value))}"
                    )
                note(
                    f"{model}, fitted: {', '.join(f'{key} {value:.4g}' for key, value in result.fitted.items())}"
                )
    for text in () if as_json else benchmark.left_out:
        note(f"left out: {text}")
    if folder is not None:
        path = folder / "measured.json"
        write_text(path, json.dumps(to_dict(benchmark), indent=1) + "\n")
        note(f"wrote {path}")
        for name in benchmark.results:
            for picture, figure in draw(benchmark, name).items():
                path = folder / f"measured-{picture}.png"
                note(f"wrote {output.write_picture(figure, path)}")


# ---------------------------------------------------------------------- reproduce


@click.command(short_help="Reproduce the published experiments in one report.")
@click.option(
    "--only",
    metavar="NAME",
    multiple=True,
    help="Only this experiment; may be repeated.",
)
@click.option("--list", "list_only", is_flag=True, help="List the experiments.")
@click.option(
    "--out",
    type=FILE,
    default=Path("reproduction"),
    show_default=True,
    help="Folder for the report.",
)
@click.option("--quick", is_flag=True, help="A small part of everything, in seconds.")
@click.option(
    "--full",
    is_flag=True,
    help="Include what takes many minutes: published solvers, long baselines.",
)
@click.option("--again", is_flag=True, help="Repeat finished experiments.")
def reproduce(
    only: tuple[str, ...],
    list_only: bool,
    out: Path,
    quick: bool,
    full: bool,
    again: bool,
) -> int:
    """Reproduce the experiments of the source paper in one HTML report that compares the results with the paper's.

    Writes report.html (with figures), numbers.json, and the figures (PNG, SVG) and curves (NetCDF) of each experiment
    to --out. If it is interrupted and started again, finished experiments are not repeated. The exit code is 1 if a
    number is out of its tolerance.

    \b
    Examples:
      planarfriction reproduce
      planarfriction reproduce --list
      planarfriction reproduce --only drift --only in-hand --out results/
      planarfriction reproduce --quick
    """
    use_one_thread()
    from planarfriction._support.writing import make_folder
    from planarfriction.cli.console import note, print_table
    from planarfriction.errors import InvalidValueError
    from planarfriction_studies.experiments import EXPERIMENTS, find_experiment

    if list_only:
        width = max(map(len, EXPERIMENTS))
        for each in EXPERIMENTS.values():
            print(f"{each.name:{width}}  {each.title}")
        return 0
    if quick and full:
        raise InvalidValueError("--quick", "not be given together with --full", "both")
    chosen = [find_experiment(name).name for name in only] or list(EXPERIMENTS)
    from planarfriction_studies.experiments.report import write_report
    from planarfriction_studies.experiments.reproduction import Reproduction
    from planarfriction_studies.experiments.wording import number

    reproduction = Reproduction(make_folder(out), quick, full)
    code = _carry_out(reproduction, chosen, again=again)
    if records := reproduction.records():
        rows = []
        for record in records:
            missed = sum(not row["holds"] for row in record["comparisons"])
            rows.append(
                [
                    record["name"],
                    f"{len(record['comparisons'])}",
                    f"{missed}",
                    number(record["seconds"]),
                ]
            )
        print_table(
            "Reproduced",
            ["experiment", "compared", "out of tolerance", "time [s]"],
            rows,
        )
        note(f"wrote {write_report(reproduction)}")
        note(f"wrote {reproduction.write_numbers()}")
    return code


def _carry_out(
    reproduction: Reproduction, chosen: Sequence[str], *, again: bool
) -> int:
    """Carry out the experiments `chosen`, with progress and a line for each; returns the exit code."""
    from planarfriction.cli import INTERRUPTED, OUT_OF_TOLERANCE
    from planarfriction.cli.console import note, work_progress

    code = 0
    try:
        for index, name in enumerate(chosen, 1):
            earlier = reproduction.kept(name) is not None and not again
            with work_progress(f"{index} of {len(chosen)}, {name}") as progress:
                (record,) = reproduction.run([name], again=again, progress=progress)
            missed = [
                row["quantity"] for row in record["comparisons"] if not row["holds"]
            ]
            code = OUT_OF_TOLERANCE if missed else code
            when = (
                "kept from an earlier run" if earlier else f"{record['seconds']:.1f} s"
            )
            note(
                f"{name}: {len(record['comparisons'])} compared, {len(missed)} out of tolerance ({when})"
            )
            for quantity in missed:
                note(f"  out of tolerance: {quantity}")
    except KeyboardInterrupt:
        note(f"stopped in {name}: the same command continues from there")
        code = INTERRUPTED
    return code
