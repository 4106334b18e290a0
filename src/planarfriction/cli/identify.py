"""`planarfriction identify`: parameters of a contact from logs, the motion to measure next, and friction of a joint."""

from __future__ import annotations

import itertools
import json
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import click
from click import argument, command, option
from click.shell_completion import CompletionItem

import planarfriction as pf
from planarfriction.cli import INTERRUPTED
from planarfriction.cli.options import (
    FILE,
    find_patch,
    map_options,
    or_file,
    patch_option,
)
from planarfriction.errors import IdentificationInterrupted, InvalidValueError


class FitOrPlan(click.Command):
    """`identify`: fits the logs that follow, unless the first word is that of a subcommand."""

    def make_context(
        self,
        info_name: str | None,
        args: list[str],
        parent: click.Context | None = None,
        **extra: Any,
    ) -> click.Context:
        """Make the context of the fit, or of a subcommand."""
        if args and args[0] in OTHERS:
            return OTHERS[args[0]].make_context(
                f"{info_name} {args[0]}", args[1:], parent, **extra
            )
        return super().make_context(info_name, args, parent, **extra)

    def format_options(
        self, ctx: click.Context, formatter: click.HelpFormatter
    ) -> None:
        """Write the options, then the other commands."""
        super().format_options(ctx, formatter)
        rows = [
            (name, f"{each.short_help} See identify {name} --help.")
            for name, each in OTHERS.items()
        ]
        with formatter.section("Commands"):
            formatter.write_dl(rows)


def complete_log(
    ctx: click.Context, parameter: object, incomplete: str
) -> list[CompletionItem]:
    """Return completions of a log: files, and the names of subcommands where they may stand."""
    others = {} if ctx.params.get("logs") else OTHERS
    words = {name: each.short_help for name, each in others.items()}
    return or_file(words, incomplete)


@command(
    cls=FitOrPlan,
    short_help="Estimate friction parameters from logs; plan the next measurement.",
)
@argument(
    "logs",
    metavar="LOG...",
    type=FILE,
    nargs=-1,
    required=True,
    shell_complete=complete_log,
)
@patch_option("Default: Circle.")
@map_options
@option(
    "--parameters",
    metavar="NAMES",
    help="Parameters to estimate, separated by commas. Default: law and radius.",
)
@option(
    "--start",
    metavar="NAME=VALUE",
    multiple=True,
    help="Initial guess, or fixed value if not estimated.",
)
@option(
    "--normal-force",
    type=float,
    help="Normal force in N, if the logs have no such column.",
)
@option(
    "--contact",
    metavar="NAME",
    help="Contact whose columns (NAME.vx) are read, if there are several.",
)
@option(
    "--noise",
    metavar="FX,FY,TAU",
    help="Noise of the measured wrench in N and N m. Default: estimated.",
)
@option(
    "--plain",
    is_flag=True,
    help="Use plain LuGre bristles. Default: the one that fits better.",
)
@option("--steady", is_flag=True, help="The logs begin in steady sliding, not at rest.")
@option(
    "--model",
    default="auto",
    help="reduced-published, reduced, distributed, or auto.",
)
@option(
    "--nuisance",
    metavar="NAMES",
    help="Sensor errors: delay,bias,load,twist or none. Default: all.",
)
@option(
    "--starts",
    default=4,
    help="Number of starting points of the search.",
)
@option(
    "--seed",
    default=0,
    help="Random seed of the starting points.",
)
@option(
    "--out",
    type=FILE,
    help="Folder for the estimates (JSON) and the residual plot (PNG).",
)
def identify(
    logs: tuple[Path, ...],
    patch: str | None,
    size: dict[str, Any],
    parameters: str | None,
    start: tuple[str, ...],
    normal_force: float | None,
    contact: str | None,
    noise: str | None,
    plain: bool,
    steady: bool,
    model: str,
    nuisance: str | None,
    out: Path | None,
    **search: Any,
) -> int:
    """Estimate friction parameters of a contact from logs of its motion and its friction wrench.

    Each LOG is a CSV file with a heading and the columns t, vx, vy, omega (or x, y, theta), fx, fy, tau, normal_force
    in s, m/s, rad/s, N and N m, or with units in the heading: Time (ms), vx [mm/s], tau [N mm]. Twist and wrench are
    about the origin of the contact frame, in its axes; the wrench acts on the moving body. The files that
    `planarfriction run` writes are such logs. Prints the estimates, their errors, and what the data do not determine.
    The command `identify plan` suggests which motion to measure next (for a log called plan, write ./plan).

    \b
    Examples:
      planarfriction identify log.csv --patch disc --out out/
      planarfriction identify slow.csv fast.csv --patch pad.csv --cell-size 0.001
      planarfriction identify log.csv --parameters mu_c,mu_s,v_s --start sigma_0=1e5 --start sigma_1=100
      planarfriction identify plan slow.csv --patch disc
      planarfriction identify joint arm.csv --inertia 0.05
    """
    from planarfriction._support.writing import make_folder, write_text
    from planarfriction.cli.console import note, work_progress
    from planarfriction.cli.output import slug, write_picture
    from planarfriction.identify import FitOptions, identify_lugre
    from planarfriction.identify.checks import check_logs

    given = find_patch(patch, size)
    names = parse_names(parameters)
    guess = parse_start(start)
    if nuisance is not None:
        groups = [name.strip() for name in nuisance.split(",")]
        search["nuisance"] = () if groups == ["none"] else groups
    options = FitOptions(
        noise=parse_noise(noise),
        elasto_plastic=None if plain else "auto",
        begins="steady" if steady else "rest",
        **search,
    )
    if out is not None:
        make_folder(out)
    read = []
    with work_progress("identifying") as shown:
        progress = Stages(shown)
        for path in logs:
            progress(f"reading {path.name}")
            log = pf.Log.from_csv(path, normal_force=normal_force, contact=contact)
            read.append(log)
        for doubt in check_logs(read, given):  # a fit of wrong units takes minutes
            note(f"warning: {doubt}")
        try:
            found = identify_lugre(
                read,
                given,
                parameters=names,
                start=guess,
                model=model,
                options=options,
                progress=progress,
            )
        except IdentificationInterrupted as stop:
            print(stop)
            return INTERRUPTED
    samples = sum(len(log.time) for log in read)
    print(
        f"{', '.join(log.name for log in read)}: {samples} samples, {given.name}",
        "",
        found.table(),
        sep="\n",
    )
    note(f"{found.starts[0]} of {found.starts[1]} starting points led to this minimum")
    note(progress.times())
    if out is not None:
        stem = slug(read[0].name)
        table = out / f"{stem}-identification.json"
        picture = out / f"{stem}-residuals.png"
        write_text(table, json.dumps(found.to_dict(), indent=2) + "\n")
        note(f"wrote {table}")
        note(f"wrote {write_picture(found.plot(), picture)}")
    return 0


class Stages:
    """Receiver of the progress of a fit that measures the time of its stages."""

    def __init__(self, shown: Callable[..., None]):
        self._shown = shown
        self._seconds: dict[str, float] = {}
        self._stage = "reading"
        self._since = time.perf_counter()

    def __call__(self, text: str) -> None:
        """Show the progress; its text says to which stage it belongs."""
        self._end()
        model, colon, work = text.partition(": ")
        if colon:
            self._stage = "intervals" if work.startswith("interval") else model
        self._shown(text)

    def _end(self) -> None:
        """Add the time since the last call to the stage that it began or went on with."""
        now = time.perf_counter()
        self._seconds[self._stage] = self._seconds.get(self._stage, 0.0) + (
            now - self._since
        )
        self._since = now

    def times(self) -> str:
        """Return the time of each stage until now in one line."""
        self._end()
        parts = [f"{name} {each:.1f} s" for name, each in self._seconds.items()]
        return f"time: {', '.join(parts)}"


def parse_start(entries: Sequence[str]) -> dict[str, float]:
    """Parse the values of `--start NAME=VALUE`, by name."""
    from planarfriction._support import validation

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

    if text is None:
        return USUAL
    return check_names([name.strip() for name in text.split(",") if name.strip()])


def parse_noise(text: str | None) -> list[float] | None:
    """Parse the three numbers of `--noise`."""
    from planarfriction._support import validation

    if text is None:
        return None
    return [validation.number_in("--noise", part) for part in text.split(",")]


@command(short_help="Suggest which motion to measure next.")
@argument("logs", metavar="[LOG]...", type=FILE, nargs=-1)
@patch_option("Default: Circle.", "patch_name")
@map_options
@option(
    "--parameters",
    metavar="NAMES",
    help="Parameters to estimate, separated by commas. Default: law and radius.",
)
@option(
    "--wanted",
    metavar="NAMES",
    help="Parameters whose information counts. Default: all.",
)
@option(
    "--start",
    metavar="NAME=VALUE",
    multiple=True,
    help="Initial guess of a parameter, or fixed value.",
)
@option(
    "--normal-force",
    type=float,
    multiple=True,
    help="Load in N; may be repeated. Default: the logs', or 1.",
)
@option("--speed", default=0.05, help="Largest speed in m/s.")
@option(
    "--spin",
    type=float,
    help="Largest angular speed in rad/s. Default: the rim as fast as --speed.",
)
@option(
    "--duration",
    default=2.0,
    help="Length of a motion in s.",
)
@option("--rate", default=1000.0, help="Samples per second.")
@option(
    "--noise",
    metavar="FX,FY,TAU",
    help="Noise of the measured wrench in N and N m. Default: the logs', else 1 %.",
)
@option("--out", type=FILE, help="File for the best motion (.csv).")
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
    from planarfriction.cli import output
    from planarfriction.cli.console import note, work_progress
    from planarfriction.identify import (
        FitOptions,
        candidate_motions,
        current_estimate,
        design_experiment,
        identify_lugre,
    )
    from planarfriction.identify.logs import columns_of
    from planarfriction.identify.wrenches import guessed_law

    patch = find_patch(patch_name, size)
    names = parse_names(parameters)
    values = parse_start(start)
    spread = parse_noise(noise)
    if out is not None:
        output.check_kind(out)
    load = normal_force[0] if normal_force else None
    measured = [pf.Log.from_csv(path, normal_force=load) for path in logs]
    law = guessed_law(values)
    if measured:
        with work_progress("identifying") as progress:
            fit = identify_lugre(
                measured,
                patch,
                parameters=names,
                start=values,
                model="reduced-published",
                options=FitOptions(noise=spread),
                progress=progress,
            )
        note(fit.summary().replace("\n", " "))
        patch, law = current_estimate(fit, patch, law)
    usual = sorted({float(f"{log.normal_force.mean():.3g}") for log in measured})
    loads = normal_force or usual or [1.0]
    motions = candidate_motions(patch, law, normal_force=loads, **motion)
    chosen = None if wanted is None else [name.strip() for name in wanted.split(",")]
    found = design_experiment(
        patch,
        law,
        logs=measured,
        motions=motions,
        parameters=names,
        wanted=chosen,
        noise=spread,
    )
    print(found.table())
    if out is not None:
        output.write_csv(out, columns_of(found.best))
        note(f"wrote {out}, with the expected wrench")
    return 0


@command(
    short_help="Estimate the friction of a joint from a torque, a voltage or the goal of a servo."
)
@argument("logs", metavar="LOG...", type=FILE, nargs=-1, required=True)
@option("--mass", default=0.0, help="Mass at the end of a pendulum in kg.")
@option("--length", default=0.0, help="Length of the pendulum in m.")
@option("--arm-mass", type=float, help="Mass of its arm in kg.")
@option(
    "--offset",
    type=float,
    help="Angle in rad at which the pendulum hangs. Default: estimated.",
)
@option(
    "--inertia",
    type=float,
    help="Moment of inertia, without the pendulum, in kg m^2. Default: estimated.",
)
@option("--torque-gain", type=float, help="kt/R in N m/V. Default: estimated.")
@option(
    "--kp",
    type=float,
    multiple=True,
    help="Gain of the servo; once for each log, or once for all.",
)
@option(
    "--gain",
    default=1.0,
    help="Duty per rad at a gain of 1.",
)
@option("--supply", type=float, help="Voltage of the servo in V.")
@option(
    "--sag",
    default=0.0,
    help="Voltage lost at full duty in V.",
)
@option(
    "--terms",
    default="auto",
    help="gravity,stribeck,load,bristles,asymmetry for torques, load,stribeck,bristles,directional for goals; or auto.",
)
@option(
    "--out",
    type=FILE,
    help="Folder for the estimates (JSON), the picture (PNG) and C source.",
)
def joint(
    logs: tuple[Path, ...],
    torque_gain: float | None,
    kp: tuple[float, ...],
    gain: float,
    supply: float | None,
    sag: float,
    terms: str,
    out: Path | None,
    **plant: Any,
) -> int:
    """Estimate the friction of a joint from logs of its motion; say what the logs leave open.

    Each LOG is a CSV file with a heading and the columns t, q and one of torque, voltage (or duty and supply) and goal
    in s, rad, N m and V; enabled, dq and external are read too. A goal needs --kp and --supply. Terms of the friction
    are kept only if they predict what was left out better.

    \b
    Examples:
      planarfriction identify joint arm.csv --inertia 0.05
      planarfriction identify joint a.csv b.csv c.csv d.csv --mass 0.5 --length 0.1 --kp 200 --supply 7.4 --gain 0.003
    """
    from planarfriction._support.writing import make_folder, write_text
    from planarfriction.cli.console import note, work_progress
    from planarfriction.cli.output import slug, write_picture
    from planarfriction.export.joint import export_joint_c
    from planarfriction.joints import Drive, JointLog, Plant, identify_joint

    if len(kp) not in (0, 1, len(logs)):
        raise InvalidValueError(
            "--kp", "be given once, or once for each log", f"{len(kp)} times"
        )
    if kp and supply is None:
        raise InvalidValueError("--supply", "be given with --kp", "none")
    drives = [Drive(each, supply or 0.0, gain, sag) for each in kp] or [None]
    read = [
        JointLog.from_csv(path, drive=drive)
        for path, drive in zip(logs, itertools.cycle(drives), strict=False)
    ]
    words: Any = {"auto": "auto", "none": ()}.get(terms, terms.split(","))
    if out is not None:
        make_folder(out)
    with work_progress("identifying") as progress:
        fit = identify_joint(
            read,
            Plant(**plant),
            torque_gain=torque_gain,
            terms=words,
            progress=progress,
        )
    print(fit.table())
    if out is not None:
        stem = f"{slug(read[0].name)}-joint"
        table = out / f"{stem}.json"
        write_text(table, json.dumps(fit.to_dict(), indent=2) + "\n")
        files = [table, write_picture(fit.plot(), out / f"{stem}.png")]
        if not fit.unclear:
            files += export_joint_c(fit.friction, out, name="friction")
        for file in files:
            note(f"wrote {file}")
        if unclear := ", ".join(fit.unclear):
            note(
                f"no C source: leave out the terms that these logs do not show ({unclear})"
            )
    return 0


OTHERS = {"plan": plan, "joint": joint}
"""Subcommands of `identify`."""
