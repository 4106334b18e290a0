"""`planarfriction identify plan`: the motion to measure next, as a subcommand of `identify`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click
from click.shell_completion import CompletionItem

import planarfriction as pf
from planarfriction.cli import identify_joint
from planarfriction.cli.identify_joint import joint
from planarfriction.cli.options import FILE, map_options, patch_option

NAME = "plan"

SHORT_HELP = "Suggest which motion to measure next."

WORDS = {NAME: SHORT_HELP, identify_joint.NAME: identify_joint.SHORT_HELP}
"""Subcommands of `identify`, with their help."""


class FitOrPlan(click.Command):
    """`identify`: fits the logs that follow, unless the first word is that of a subcommand."""

    def make_context(
        self, info_name: str | None, args: list[str], parent: click.Context | None = None, **extra: Any
    ) -> click.Context:
        """Make the context of the fit, or of a subcommand."""
        if args and args[0] in WORDS:
            command = plan if args[0] == NAME else joint
            return command.make_context(f"{info_name} {args[0]}", args[1:], parent, **extra)
        return super().make_context(info_name, args, parent, **extra)

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the options, then the other commands."""
        super().format_options(ctx, formatter)
        with formatter.section("Commands"):
            formatter.write_dl([(name, f"{help} See identify {name} --help.") for name, help in WORDS.items()])


def complete_log(ctx: click.Context, parameter: object, incomplete: str) -> list[CompletionItem]:
    """Return completions of a log: files, and the names of subcommands where they may stand."""
    first = not ctx.params.get("logs")
    words = [CompletionItem(name, help=help) for name, help in WORDS.items() if first and name.startswith(incomplete)]
    return [*words, CompletionItem(incomplete, type="file")]


@click.command(name=NAME, short_help=SHORT_HELP)
@click.argument("logs", metavar="[LOG]...", type=FILE, nargs=-1)
@patch_option("Default: Circle.", "patch_name")
@map_options
@click.option("--parameters", metavar="NAMES", help="What to estimate, separated by commas. Default: law and radius.")
@click.option("--wanted", metavar="NAMES", help="Parameters whose information counts. Default: all.")
@click.option("--start", metavar="NAME=VALUE", multiple=True, help="Guess of a parameter, or fixed value.")
@click.option("--normal-force", type=float, multiple=True, help="Load in N; may be repeated. Default: the logs', or 1.")
@click.option("--speed", type=float, default=0.05, show_default=True, help="Largest speed in m/s.")
@click.option("--spin", type=float, help="Largest angular speed in rad/s. Default: the rim as fast as --speed.")
@click.option("--duration", type=float, default=2.0, show_default=True, help="Length of a motion in s.")
@click.option("--rate", type=float, default=1000.0, show_default=True, help="Samples per second.")
@click.option(
    "--noise", metavar="FX,FY,TAU", help="Noise of the measured wrench in N and N m. Default: the logs', else 1 %."
)
@click.option("--out", type=FILE, help="File for the best motion (.csv).")
def plan(
    logs: tuple[Path, ...],
    patch_name: str | None,
    size: dict[str, Any],
    parameters: str | None,
    wanted: str | None,
    start: tuple[str, ...],
    normal_force: tuple[float, ...],
    noise: str | None,
    out: Path | None,
    **motion: Any,
) -> int:
    """Rank motions by the information that each is expected to add to the logs so far.

    Each LOG is a file as for `planarfriction identify`; the logs are fitted first. Without a log, the law is guessed
    from --start. Prints the gains in bits, and the errors expected after the best motion; --out writes that motion.

    \b
    Examples:
      planarfriction identify plan --patch disc --start mu_c=0.5 --start sigma_0=2e4 --out next.csv
      planarfriction identify plan slow.csv --patch disc --speed 0.03 --spin 2
      planarfriction identify plan slow.csv --wanted sigma_1
    """
    from planarfriction.cli import identify, output
    from planarfriction.cli.console import note
    from planarfriction.cli.options import find_patch
    from planarfriction.identify import candidate_motions, design_experiment
    from planarfriction.identify.logs import columns_of

    patch = find_patch(patch_name, size)
    names, values, spread = identify.parse_names(parameters), identify.parse_start(start), identify.parse_noise(noise)
    if out is not None:
        output.check_kind(out)
    measured = [pf.Log.from_csv(path, normal_force=normal_force[0] if normal_force else None) for path in logs]
    patch, law = _known(measured, patch, names, values, spread)
    loads = list(normal_force) or sorted({float(f"{log.normal_force.mean():.3g}") for log in measured}) or [1.0]
    motions = candidate_motions(patch, law, normal_force=loads, **motion)
    chosen = None if wanted is None else [name.strip() for name in wanted.split(",")]
    options = {"parameters": names, "wanted": chosen, "noise": spread}
    found = design_experiment(patch, law, logs=measured, motions=motions, **options)
    print(found.table())
    if out is not None:
        output.write_csv(out, columns_of(found.best))
        note(f"wrote {out}, with the expected wrench")
    return 0


def _known(
    logs: list[pf.Log],
    patch: pf.ContactPatch,
    names: tuple[str, ...],
    start: dict[str, float],
    noise: list[float] | None,
) -> tuple[pf.ContactPatch, pf.LuGre]:
    """Find patch and law as the logs show them, or as guessed where there are none."""
    from planarfriction.cli.console import note, work_progress
    from planarfriction.identify import FitOptions, current_estimate, identify_lugre
    from planarfriction.identify.wrenches import guessed_law

    law = guessed_law(start)
    if not logs:
        return patch, law
    with work_progress("identifying") as progress:
        chosen = {"parameters": names, "start": start, "model": "reduced-published"}
        found = identify_lugre(logs, patch, **chosen, options=FitOptions(noise=noise), progress=progress)
    note(found.summary().replace("\n", " "))
    return current_estimate(found, patch, law)
