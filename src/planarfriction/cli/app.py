"""The commands and their options, each of which loads what it needs when it runs; other packages add more."""

from __future__ import annotations

import gc
from importlib.metadata import PackageNotFoundError, distribution, entry_points
from pathlib import Path
from typing import Any

import click
from click import argument, option
from click.shell_completion import CompletionItem

from planarfriction import __version__
from planarfriction.cli.doctor import doctor
from planarfriction.cli.export import export
from planarfriction.cli.hold import hold
from planarfriction.cli.identify import identify
from planarfriction.cli.options import (
    FILE,
    cells_option,
    complete_scene,
    map_options,
    patch_option,
)
from planarfriction.cli.sweep import sweep
from planarfriction.families import MODELS, SURFACES, Family

GROUP = "planarfriction.commands"
"""Group of the entry points: name of the command = module:command of click."""

STUDIES = "planarfriction-studies"
"""Distribution of experiments, measured data, the referee of simulators, benchmarks, and the rig of grippers."""

ELSEWHERE = f"Experiments, measured data and benchmarks are in {STUDIES} (pip install ./studies)."
"""Line below the commands where that distribution is missing."""


class Commands(click.Group):
    """Group that looks for commands of other packages only where its own do not suffice: a search takes 10 ms."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the names of the commands, without aliases."""
        self.add_installed()
        names = super().list_commands(ctx)
        return [name for name in names if self.commands[name].name == name]

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name not in self.commands:
            self.add_installed()
        return super().get_command(ctx, cmd_name)

    def format_epilog(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write where more commands come from, if they are not installed."""
        try:
            distribution(STUDIES)
        except PackageNotFoundError:
            formatter.write_paragraph()
            formatter.write_text(ELSEWHERE)

    def add_installed(self) -> None:
        """Add the commands of other packages, without those whose package cannot be imported.

        A command has its own name, and that of its entry point as an alias.
        """
        for entry in entry_points(group=GROUP):
            if entry.name not in self.commands:
                try:
                    found = entry.load()
                except ImportError:
                    continue
                self.add_command(found, entry.name)
                self.commands.setdefault(found.name or entry.name, found)


class MemberOf(click.Choice):
    """A choice among the members of a family, those that are registered later too, and a few words more."""

    def __init__(self, family: Family, *more: str):
        self.family = family
        self.more = more
        super().__init__([*family, *more])

    @property
    def choices(self) -> tuple[str, ...]:
        """The names, as they are now."""
        return (*self.family, *self.more)

    @choices.setter
    def choices(self, value: object) -> None:
        """Ignore the names that click sets: the family has them."""

    def shell_complete(
        self, ctx: click.Context, param: click.Parameter, incomplete: str
    ) -> list[CompletionItem]:
        """Return the members that begin with the typed text, with their descriptions."""
        words = {name: self.family.words(name) for name in self.family} | dict.fromkeys(
            self.more
        )
        return [
            CompletionItem(name, help=help)
            for name, help in words.items()
            if name.startswith(incomplete)
        ]


@click.group(
    cls=Commands,
    name="planarfriction",
    context_settings={
        "max_content_width": 100,
        "help_option_names": ["-h", "--help"],
        "show_default": True,
    },
)
@click.version_option(__version__, message="%(prog)s %(version)s")
def app() -> None:
    """Friction of contact patches that slide and spin at the same time: simulate, fit to measurements, compare."""


@app.command(short_help="Simulate a ready scene or a scene file.")
@argument("scene", shell_complete=complete_scene)
@option(
    "--model",
    type=MemberOf(MODELS, "both"),
    multiple=True,
    help="Friction model; may be repeated; both: distributed and reduced. Default: both for in-hand, else distributed"
    " or the file's.",
)
@cells_option
@patch_option("Default: the scene's (mostly Circle), or the file's.")
@map_options
@option("--t-end", type=float, help="Duration in s. Default: the scene's.")
@option(
    "--rtol", type=float, help="Relative tolerance of the solver. Default: the scene's."
)
@option(
    "--max-steps",
    type=int,
    help="Largest number of steps of the solver. Default: 50 million.",
)
@option(
    "--set",
    "settings",
    metavar="PATH=VALUE",
    multiple=True,
    help="Change a value of the scene; may be repeated.",
)
@option("--out", type=FILE, help="Folder for the data (NetCDF, CSV) and the pictures.")
@option(
    "--plot",
    is_flag=True,
    help="Draw histories, motion and patch as PNG (in out/ by default).",
)
@option(
    "--animate",
    is_flag=True,
    help="Draw motion and slip as an animated GIF (in out/ by default).",
)
def run(scene: str, out: Path | None, plot: bool, animate: bool, **options: Any) -> int:
    """Simulate a ready scene or a scene file with one friction model, or with several to compare them.

    SCENE is in-hand, drift, free-slide, driven, pushed, pivot, foot or curling, or a file (.toml, .json).

    \b
    Examples:
      planarfriction run in-hand --model both --out out/ --plot
      planarfriction run drift --model reduced --patch Square --t-end 2
      planarfriction run in-hand --model both --cells 64
      planarfriction run in-hand --patch pad.csv --cell-size 0.001 --animate
      planarfriction run scene.toml --rtol 1e-7 --out results/
      planarfriction run scene.toml --set body.mass=0.3 --set fingers.law.mu_c=0.5
    """
    # Compiler, arrays and, where asked for, datasets and pictures load now, a million objects that all stay: not
    # looking for garbage among them saves up to a tenth of the run. `main` turns the collector on again.
    gc.disable()
    from planarfriction.cli import run as command
    from planarfriction.solvers.structured import compiled_together

    pictures = [
        name for name, wanted in (("plot", plot), ("animate", animate)) if wanted
    ]
    folder = Path("out") if out is None and pictures else out
    with compiled_together():  # the models take a second to load
        return command.run(scene, folder=folder, pictures=pictures, **options)


@app.command(
    name="limit-surface", short_help="Print, draw or tabulate a limit surface."
)
@patch_option("Default: Circle.")
@option("--pressure", type=FILE, help="Pressure map, as with --patch.")
@map_options
@option(
    "--surface",
    type=MemberOf(SURFACES),
    default="exact",
    help="Kind of limit surface.",
)
@option(
    "--out",
    type=FILE,
    help="Picture to write: three sections (.png, .pdf, .svg), or .html to rotate it with the mouse.",
)
@option("--alone", is_flag=True, help="Draw the surface without the ellipsoid.")
@option("--csv", type=FILE, help="Table of samples to write (.csv).")
def limit_surface(**options: Any) -> None:
    """Show the limit surface of a contact patch: numbers, a picture (with its ellipsoid), a table as CSV.

    The CSV has the columns vx vy omega fx fy tau: twists in all directions and their friction wrenches for mu f_N = 1,
    about the origin of the contact frame, in m/s, rad/s, 1 and m.

    \b
    Examples:
      planarfriction limit-surface --patch NonConvex1 --out surface.png
      planarfriction limit-surface --patch NonConvex1 --out surface.html --alone
      planarfriction limit-surface --pressure pad.png --cell-size 0.0005 --surface table --csv samples.csv
    """
    from planarfriction.cli import limit_surface as command

    command.show(**options)


@app.command(short_help="Compile everything in advance.")
def warm() -> None:
    """Compile everything in advance, so that later runs need not wait. Code in the cache is not recompiled.

    Ctrl-C stops it; finished parts are kept.
    """
    from planarfriction.cli.console import print_table, work_progress
    from planarfriction.warm import warm_up

    with work_progress("compiling") as progress:
        times = warm_up(progress=progress)
    times["all"] = sum(times.values())
    rows = [[words, f"{seconds:.2f}"] for words, seconds in times.items()]
    print_table("Compiled or read from the cache", ["part", "time [s]"], rows)


app.add_command(doctor)
app.add_command(export)
app.add_command(hold)
app.add_command(identify)
app.add_command(sweep)
