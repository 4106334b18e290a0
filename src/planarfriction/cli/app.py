"""The commands and their options; each loads what it needs when it runs."""

from __future__ import annotations

import gc
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from planarfriction import __version__

app = typer.Typer(
    name="planarfriction",
    add_completion=False,
    rich_markup_mode="rich",
    pretty_exceptions_enable=False,
    help="Friction of contact patches that slide and spin: simulate scenes, draw limit surfaces, measure speed.",
)


class ModelChoice(StrEnum):
    """Friction models of the command line."""

    distributed = "distributed"
    reduced = "reduced"
    both = "both"


class SurfaceChoice(StrEnum):
    """Limit surfaces of the command line."""

    cells = "cells"
    table = "table"
    table_published = "table-published"
    ellipsoid = "ellipsoid"


def _show_version(wanted: bool) -> None:
    if wanted:
        print(f"planarfriction {__version__}")
        raise typer.Exit()


@app.callback()
def _root(
    version: Annotated[
        bool, typer.Option("--version", callback=_show_version, is_eager=True, help="Show the version and exit.")
    ] = False,
) -> None:
    """Options before the command."""


PATCH_HELP = (
    "Square, Circle, Line, LineGrad, LineGradX, NonConvex1, NonConvex2, disc, rectangle, or a pressure map "
    "(.csv, .npy, grey image; row 0 is the top) with --cell-size."
)


@app.command(
    help="""Simulate a ready scene or a scene file, with one friction model or with several side by side.

    SCENE is in-hand, drift, free-slide, driven, or a file (.toml, .json).

    [bold]Examples[/bold]

    planarfriction run in-hand --model both --out out/ --plot

    planarfriction run drift --model reduced --patch Square --t-end 2

    planarfriction run in-hand --patch pad.csv --cell-size 0.001 --animate

    planarfriction run scene.toml --rtol 1e-7 --out results/
    """
)
def run(
    scene: Annotated[str, typer.Argument(metavar="SCENE", help="Ready scene or scene file.")],
    model: Annotated[
        list[ModelChoice] | None,
        typer.Option(
            help="Friction model, may be repeated. Default: both for in-hand, else distributed or the file's."
        ),
    ] = None,
    patch: Annotated[
        str | None, typer.Option(help=f"Contact patch: {PATCH_HELP} Default: Circle, or the file's.")
    ] = None,
    cell_size: Annotated[float | None, typer.Option(help="Side of a cell of a pressure map in m.")] = None,
    t_end: Annotated[float | None, typer.Option(help="Duration in s. Default: the scene's.")] = None,
    rtol: Annotated[float | None, typer.Option(help="Relative tolerance of the solver.")] = None,
    out: Annotated[Path | None, typer.Option(help="Folder for the data (NetCDF, CSV) and the pictures.")] = None,
    plot: Annotated[
        bool, typer.Option("--plot", help="Draw histories, motion and patch (PNG; to out/ by default).")
    ] = False,
    animate: Annotated[bool, typer.Option("--animate", help="Draw the motion as a GIF (to out/ by default).")] = False,
) -> None:
    """Simulate a scene (the help above is what users see)."""
    # Compiler, arrays and datasets load now, a million objects that all stay: not looking for garbage among them saves
    # 0.3 s of 3. `main` turns the collector on again.
    gc.disable()
    from planarfriction.cli import run as command

    choices = [] if model is None else [choice.value for choice in model]
    scenes = command.build_scenes(scene, choices, patch=patch, cell_size=cell_size, t_end=t_end)
    pictures = [name for name, wanted in (("plot", plot), ("animate", animate)) if wanted]
    folder = Path("out") if out is None and pictures else out
    raise typer.Exit(command.run(scenes, rtol=rtol, t_end=t_end, folder=folder, pictures=pictures))


@app.command(
    name="limit-surface",
    help="""Limit surface of a contact patch: numbers, a picture beside the ellipsoid, samples as CSV.

    The CSV has the columns vx vy omega fx fy tau: twists around the direction sphere and their friction wrenches for
    mu f_N = 1, about the origin of the contact frame, in m/s, rad/s, 1 and m.

    [bold]Examples[/bold]

    planarfriction limit-surface --patch NonConvex1 --out surface.png

    planarfriction limit-surface --pressure pad.png --cell-size 0.0005 --surface table --csv samples.csv
    """,
)
def limit_surface(
    patch: Annotated[str | None, typer.Option(help=f"Contact patch: {PATCH_HELP} Default: Circle.")] = None,
    pressure: Annotated[
        Path | None, typer.Option(help="Pressure map (.csv, .npy, grey image); row 0 is the top.")
    ] = None,
    cell_size: Annotated[float | None, typer.Option(help="Side of a cell of the pressure map in m.")] = None,
    surface: Annotated[SurfaceChoice, typer.Option(help="How the surface is represented.")] = SurfaceChoice.cells,
    out: Annotated[Path | None, typer.Option(help="Picture to write (.png, .pdf, .svg).")] = None,
    csv: Annotated[Path | None, typer.Option(help="Table of samples to write (.csv).")] = None,
) -> None:
    """Show a limit surface (the help above is what users see)."""
    from planarfriction.cli import limit_surface as command

    chosen = command.choose_patch(patch, pressure, cell_size)
    command.show(chosen, surface.value, picture=out, table=csv)


@app.command(
    help="""Measure the speed of this installation; every line stands beside its baseline from the same run.

    [bold]Examples[/bold]

    planarfriction bench

    planarfriction bench --only in_hand.reduced --json

    planarfriction bench --full
    """
)
def bench(
    only: Annotated[list[str] | None, typer.Option(metavar="NAME", help="Only this line; may be repeated.")] = None,
    full: Annotated[bool, typer.Option("--full", help="With the baselines that take minutes.")] = False,
    json: Annotated[bool, typer.Option("--json", help="Print a JSON list and nothing else on stdout.")] = False,
) -> None:
    """Measure (the help above is what users see)."""
    from planarfriction.cli import bench as command

    show = command.show_json if json else command.show_table
    show(command.measure(only, full=full))
