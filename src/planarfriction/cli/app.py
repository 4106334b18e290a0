"""The commands and their options; each loads what it needs when it runs."""

from __future__ import annotations

import gc
from pathlib import Path
from typing import Any

import click
from click.shell_completion import CompletionItem

from planarfriction import __version__
from planarfriction.cli.commands import Commands
from planarfriction.cli.doctor import doctor
from planarfriction.cli.identify_plan import FitOrPlan, complete_log
from planarfriction.cli.options import FILE, cells_option, complete_scene, map_options, patch_option
from planarfriction.cli.sweep import sweep
from planarfriction.families import MODELS, SURFACES, Family


class MemberOf(click.Choice):
    """A choice among the members of a family, those that are registered later too, and a few words more."""

    def __init__(self, family: Family, *more: str):
        self.family, self.more = family, more
        super().__init__([*family, *more])

    @property
    def choices(self) -> tuple[str, ...]:
        """The names, as they are now."""
        return (*self.family, *self.more)

    @choices.setter
    def choices(self, value: object) -> None:
        """Ignore the names that click sets: the family has them."""

    def shell_complete(self, ctx: click.Context, param: click.Parameter, incomplete: str) -> list[CompletionItem]:
        """Return the members that begin with the typed text, with their descriptions."""
        words = {name: self.family.words(name) for name in self.family} | dict.fromkeys(self.more)
        return [CompletionItem(name, help=help) for name, help in words.items() if name.startswith(incomplete)]


@click.group(
    cls=Commands,
    name="planarfriction",
    context_settings={"max_content_width": 100, "help_option_names": ["-h", "--help"]},
)
@click.version_option(__version__, message="%(prog)s %(version)s")
def app() -> None:
    """Friction of contact patches that slide and spin at the same time: simulate, fit to measurements, compare."""


@app.command(short_help="Simulate a ready scene or a scene file.")
@click.argument("scene", shell_complete=complete_scene)
@click.option(
    "--model",
    type=MemberOf(MODELS, "both"),
    multiple=True,
    help="Friction model; may be repeated; both: distributed and reduced. Default: both for in-hand, else distributed"
    " or the file's.",
)
@cells_option
@patch_option("Default: the scene's (mostly Circle), or the file's.")
@map_options
@click.option("--t-end", type=float, help="Duration in s. Default: the scene's.")
@click.option("--rtol", type=float, help="Relative tolerance of the solver. Default: the scene's.")
@click.option("--max-steps", type=int, help="Largest number of steps of the solver. Default: 50 million.")
@click.option(
    "--set", "settings", metavar="PATH=VALUE", multiple=True, help="Change a value of the scene; may be repeated."
)
@click.option("--out", type=FILE, help="Folder for the data (NetCDF, CSV) and the pictures.")
@click.option("--plot", is_flag=True, help="Draw histories, motion and patch as PNG (in out/ by default).")
@click.option("--animate", is_flag=True, help="Draw motion and slip as an animated GIF (in out/ by default).")
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

    pictures = [name for name, wanted in (("plot", plot), ("animate", animate)) if wanted]
    folder = Path("out") if out is None and pictures else out
    with compiled_together():  # the models take a second to load
        return command.run(scene, folder=folder, pictures=pictures, **options)


@app.command(name="limit-surface", short_help="Print, draw or tabulate a limit surface.")
@patch_option("Default: Circle.")
@click.option("--pressure", type=FILE, help="Pressure map, as with --patch.")
@map_options
@click.option("--surface", type=MemberOf(SURFACES), default="exact", show_default=True, help="Kind of limit surface.")
@click.option("--out", type=FILE, help="Picture to write (.png, .pdf, .svg, or .html to rotate it with the mouse).")
@click.option("--alone", is_flag=True, help="Draw the surface without the ellipsoid.")
@click.option("--csv", type=FILE, help="Table of samples to write (.csv).")
def limit_surface(patch: str | None, pressure: Path | None, size: dict[str, Any], **options: Any) -> None:
    """Show the limit surface of a contact patch: numbers, a picture (next to its ellipsoid), a table as CSV.

    The CSV has the columns vx vy omega fx fy tau: twists in all directions and their friction wrenches for mu f_N = 1,
    about the origin of the contact frame, in m/s, rad/s, 1 and m.

    \b
    Examples:
      planarfriction limit-surface --patch NonConvex1 --out surface.png
      planarfriction limit-surface --patch NonConvex1 --out surface.html --alone
      planarfriction limit-surface --pressure pad.png --cell-size 0.0005 --surface table --csv samples.csv
    """
    from planarfriction.cli import limit_surface as command

    command.show(command.choose_patch(patch, pressure, size), **options)


@app.command(short_help="Write the friction model of a file as C source.")
@click.argument("file", type=FILE, shell_complete=complete_scene)
@click.option("--out", type=FILE, required=True, help="Folder for the files.")
@click.option(
    "--name", default="friction", show_default=True, help="Name of the files, and prefix of the names in them."
)
@click.option("--precision", default="double", show_default=True, help="double or float.")
@click.option("--patches", default=1, show_default=True, help="Patches of this model below a body.")
@click.option("--contact", metavar="NAME", help="Contact whose model is exported, if a scene has different ones.")
def export(file: Path, **options: Any) -> None:
    """Write the friction model of a file as C source for a controller: NAME.h and NAME.c, C99 and C++17.

    NAME_test.c compares the library with numbers of the model; NAME.cmake has targets for both.

    FILE (.toml, .json) is a scene, or a model alone: patch, law and model, written as for a contact of a scene.

    \b
    Examples:
      planarfriction export model.toml --out friction/
      planarfriction export scene.toml --contact fingers --out src/ --name finger --precision float
    """
    from planarfriction.cli import export as command

    command.export(file, **options)


@app.command(cls=FitOrPlan, short_help="Estimate friction parameters from logs; plan the next measurement.")
@click.argument("logs", metavar="LOG...", type=FILE, nargs=-1, required=True, shell_complete=complete_log)
@patch_option("Default: Circle.")
@map_options
@click.option("--parameters", metavar="NAMES", help="What to estimate, separated by commas. Default: law and radius.")
@click.option("--start", metavar="NAME=VALUE", multiple=True, help="Initial guess, or fixed value if not estimated.")
@click.option("--normal-force", type=float, help="Normal force in N, if the logs have no such column.")
@click.option("--contact", metavar="NAME", help="Contact whose columns (NAME.vx) are read, if there are several.")
@click.option("--noise", metavar="FX,FY,TAU", help="Noise of the measured wrench in N and N m. Default: estimated.")
@click.option("--plain", is_flag=True, help="Use plain LuGre bristles. Default: what fits better.")
@click.option("--steady", is_flag=True, help="The logs begin in steady sliding, not at rest.")
@click.option("--model", default="auto", show_default=True, help="reduced-published, reduced, distributed, or auto.")
@click.option("--nuisance", metavar="NAMES", help="Rig disturbances: delay,bias,load,twist or none. Default: all.")
@click.option("--starts", type=int, default=4, show_default=True, help="Number of starting points of the search.")
@click.option("--seed", type=int, default=0, show_default=True, help="Random seed of the starting points.")
@click.option("--out", type=FILE, help="Folder for the estimates (JSON) and the residual plot (PNG).")
def identify(logs: tuple[Path, ...], patch: str | None, size: dict[str, Any], **options: Any) -> int:
    """Estimate friction parameters of a contact from logs of its motion and its friction wrench.

    Each LOG is a CSV file with a heading and the columns t, vx, vy, omega (or x, y, theta), fx, fy, tau, normal_force
    in s, m/s, rad/s, N and N m. Twist and wrench are about the origin of the contact frame, in its axes; the wrench
    acts on the moving body. The files that `planarfriction run` writes are such logs. Prints the estimates, their
    errors, and what the data do not determine. The command `identify plan` suggests which motion to measure next (for a
    log called plan, write ./plan).

    \b
    Examples:
      planarfriction identify log.csv --patch disc --out out/
      planarfriction identify slow.csv fast.csv --patch pad.csv --cell-size 0.001
      planarfriction identify log.csv --parameters mu_c,mu_s,v_s --start sigma_0=1e5 --start sigma_1=100
      planarfriction identify plan slow.csv --patch disc
      planarfriction identify joint arm.csv --inertia 0.05
    """
    from planarfriction.cli import identify as command
    from planarfriction.cli.options import find_patch

    return command.identify(logs, find_patch(patch, size), **options)


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
app.add_command(sweep)
