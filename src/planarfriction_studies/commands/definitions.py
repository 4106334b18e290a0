"""The commands `bench`, `measured`, `reproduce` and `simulators`; each loads what it needs when it runs."""

from __future__ import annotations

from pathlib import Path

import click

from planarfriction.cli.options import FILE


@click.command(
    short_help="Measure the speed of this installation.",
    help="""Measure the speed of this installation, each benchmark next to its baseline from the same run.

    \b
    Examples:
      planarfriction bench
      planarfriction bench --only in_hand.reduced --json
      planarfriction bench --full
    """,
)
@click.option("--only", metavar="NAME", multiple=True, help="Only this benchmark; may be repeated.")
@click.option("--full", is_flag=True, help="Include the baselines that take minutes.")
@click.option("--json", is_flag=True, help="Print a JSON list and nothing else on stdout.")
def bench(only: tuple[str, ...], full: bool, json: bool) -> None:
    """Measure (the help above is what users see)."""
    from planarfriction_studies.commands import bench as command

    show = command.show_json if json else command.show_table
    show(command.measure(only, full=full))


@click.command(
    short_help="Compare friction models on measured data.",
    help="""Compare friction models on published measurements, which come with the package: three tasks, fixed splits.

    slides: the path and final pose of a cube on a table, from its first 8 poses. pushes: the twist of an object that is
    pushed slowly, from the wrench. series: twists and wrenches during whole pushes. Each model is fitted to the
    training cases and scored on the others, with bootstrap intervals. --own adds your own function (docs/measured.md).

    \b
    Examples:
      planarfriction measured --out results/
      planarfriction measured --task slides --only "exact surface" --own my_model.py:predict
      planarfriction measured --list
    """,
)
@click.option("--task", "tasks", metavar="NAME", multiple=True, help="Only this task; may be repeated.")
@click.option("--only", metavar="NAME", multiple=True, help="Only this model of the library; may be repeated.")
@click.option("--own", metavar="FILE.py:NAME", multiple=True, help="A model of your own; may be repeated.")
@click.option("--list", "list_only", is_flag=True, help="List models and tasks.")
@click.option("--tables", type=FILE, help="Folder with the measured tables. Default: those of the package.")
@click.option("--out", type=FILE, help="Folder for JSON and pictures.")
@click.option("--seed", type=int, default=0, show_default=True, help="Random seed of the bootstrap.")
@click.option("--json", "as_json", is_flag=True, help="Print JSON and nothing else on stdout.")
def measured(
    tasks: tuple[str, ...],
    only: tuple[str, ...],
    own: tuple[str, ...],
    list_only: bool,
    tables: Path | None,
    out: Path | None,
    seed: int,
    as_json: bool,
) -> int:
    """Compare on measured data (the help above is what users see)."""
    from planarfriction_studies.commands import measured as command

    if list_only:
        command.show_list()
        return 0
    return command.measured(tasks, only, own, tables=tables, folder=out, seed=seed, as_json=as_json)


@click.command(
    short_help="Reproduce the published experiments in one report.",
    help="""Reproduce the experiments of the source paper in one HTML report that compares the results with the paper's.

    Writes report.html (with figures), numbers.json, and the figures (PNG, SVG) and curves (NetCDF) of each experiment
    to --out. If it is interrupted and started again, finished experiments are not repeated. The exit code is 1 if a
    number is out of its tolerance.

    \b
    Examples:
      planarfriction reproduce
      planarfriction reproduce --list
      planarfriction reproduce --only drift --only in-hand --out results/
      planarfriction reproduce --quick
    """,
)
@click.option("--only", metavar="NAME", multiple=True, help="Only this experiment; may be repeated.")
@click.option("--list", "list_only", is_flag=True, help="List the experiments.")
@click.option("--out", type=FILE, default=Path("reproduction"), show_default=True, help="Folder for the report.")
@click.option("--quick", is_flag=True, help="A small part of everything, in seconds.")
@click.option("--full", is_flag=True, help="Include what takes many minutes: published solvers, long baselines.")
@click.option("--again", is_flag=True, help="Repeat finished experiments.")
def reproduce(only: tuple[str, ...], list_only: bool, out: Path, quick: bool, full: bool, again: bool) -> int:
    """Reproduce the paper (the help above is what users see)."""
    from planarfriction_studies.commands import reproduce as command

    if list_only:
        command.show_list()
        return 0
    return command.reproduce(only, out, quick=quick, full=full, again=again)


@click.command(
    short_help="Compare with the friction of MuJoCo and Drake.",
    help="""Compare patch friction inside MuJoCo and Drake with the simulators' own friction at several settings.

    Cases: creep of a held object, slip of a shaken one, discs that slide and spin to rest, a plate turned in the hand,
    and the time of a step. Needs MuJoCo (pip install 'planarfriction[mujoco]'); Drake is used if it is installed.

    Prints the tables, and writes numbers.json and a figure to --out. If it is interrupted and started again, finished
    cases are not repeated. The exit code is 1 if a result of patch friction is out of its tolerance.

    \b
    Examples:
      planarfriction simulators
      planarfriction simulators --quick --out results/
    """,
)
@click.option("--out", type=FILE, default=Path("simulators"), show_default=True, help="Folder for numbers and figure.")
@click.option("--quick", is_flag=True, help="A small part of everything, in seconds.")
@click.option("--again", is_flag=True, help="Repeat finished experiments.")
def simulators(out: Path, quick: bool, again: bool) -> int:
    """Compare (the help above is what users see)."""
    from planarfriction_studies.commands import simulators as command

    return command.compare(out, quick=quick, again=again)
