"""`planarfriction sweep`: simulate a scene for every combination of some of its values."""

from __future__ import annotations

import itertools
from pathlib import Path
from typing import TYPE_CHECKING, Any

from click import argument, command, option

from planarfriction.cli.options import (
    FILE,
    cells_option,
    complete_scene,
    load_function,
    map_options,
    patch_option,
)
from planarfriction.families import SCENES

if TYPE_CHECKING:
    import numpy as np
    import xarray as xr

MOST_ROWS = 40
"""Number of runs up to which each has a row of its own on the screen."""

KINDS = {"m": "length", "m/s": "speed", "rad": "angle", "N": "force", "N m": "torque"}
"""Kinds of quantities, by their SI units."""


@command(short_help="Simulate a scene for every combination of values.")
@argument("scene", shell_complete=complete_scene)
@option(
    "--set",
    "settings",
    metavar="PATH=VALUES",
    multiple=True,
    required=True,
    help="START:STOP:COUNT, both ends included, or VALUE,VALUE,...; may be repeated.",
)
@option(
    "--model", metavar="NAME", help="Friction model. Default: the file's, or reduced."
)
@cells_option
@patch_option("Default: Circle, or the file's.")
@map_options
@option("--t-end", type=float, help="Duration of a ready scene in s.")
@option(
    "--measure",
    metavar="FILE.py:NAME",
    help="Function of a solution that returns the values to keep. Default: all.",
)
@option(
    "--out",
    type=FILE,
    default=Path("sweep"),
    help="Folder for the runs.",
)
def sweep(
    scene: str,
    settings: tuple[str, ...],
    model: str | None,
    measure: str | None,
    out: Path,
    **options: Any,
) -> int:
    """Simulate a scene for every combination of some of its values; an interrupted sweep can be continued.

    SCENE is in-hand, drift, free-slide, driven, pushed, pivot, foot or curling, or a file (.toml, .json). PATH is the
    name of a value in it, such as body.mass, t_end, or fingers.law.mu_c for a contact called fingers; for a ready scene
    also an argument of its function, such as mass.

    The runs are kept in --out; the same command simulates only the missing ones. The dataset of all runs is written to
    sweep.nc in --out.

    \b
    Examples:
      planarfriction sweep scene.toml --set body.mass=0.1:0.3:20 --set fingers.law.mu_c=0.5,0.8
      planarfriction sweep in-hand --set mass=0.1:0.3:5 --set fingers.model=reduced,distributed --out runs/
      planarfriction sweep scene.toml --set body.position.0=0:0.02:50 --measure mine.py:slip
    """
    from planarfriction import sweeps
    from planarfriction._support import validation
    from planarfriction.cli import INTERRUPTED
    from planarfriction.cli.console import note, work_progress
    from planarfriction.cli.run import scene_makers
    from planarfriction.errors import SweepInterrupted
    from planarfriction.families import MODELS
    from planarfriction.sweeps.settings import parse_all, try_ends

    values = parse_all(settings)
    if model is not None:
        validation.choice("--model", model, MODELS)
    models = [model] if model is not None else ["reduced"] if scene in SCENES else []
    make = next(iter(scene_makers(scene, models, **options).values()))
    # A path that leads nowhere is wrong in all runs.
    try_ends(make, {path: list(each.values()) for path, each in values.items()})
    function = None if measure is None else load_function("--measure", measure)[1]
    last: list[sweeps.Progress] = []
    try:
        with work_progress("sweep") as report:

            def tell(progress: sweeps.Progress) -> None:
                last[:] = [progress]
                report(str(progress), progress.done, progress.runs)

            data = sweeps.sweep(make, values, out=out, measure=function, progress=tell)
    except SweepInterrupted:
        note(
            f"interrupted: {last[0]}; the same command continues"
            if last
            else "interrupted"
        )
        return INTERRUPTED
    note(str(last[0]))
    _show(data, out)
    return 0


def _show(data: xr.Dataset, out: Path) -> None:
    """Write the dataset and print a row for each run, or the ranges of many runs."""
    from planarfriction.cli.console import note, print_table
    from planarfriction.scenes.solution import write_dataset

    failed = [str(each) for each in data.failure.values.ravel().tolist() if each]
    if failed:
        note(
            f"{len(failed)} failed; the first: {failed[0]} (for all reasons see the variable failure)"
        )
    swept = data.status.dims
    note(f"wrote {write_dataset(data, out / 'sweep.nc')}")
    ends = data.isel(time=-1) if "time" in data.dims else data
    columns = dict(
        _in_units(each)
        for each in ends.data_vars.values()
        if each.dims == swept and each.dtype.kind in "fiu"
    )
    title = f"{data.status.size} runs over {', '.join(map(str, swept))}"
    if "time" in data.dims:
        title += f", at {float(data.time[-1]):g} s"
    if data.status.size > MOST_ROWS:
        import numpy as np

        rows = []
        for name, each in columns.items():
            known = each[np.isfinite(each)]
            if known.size:
                ranges = np.quantile(known, [0.0, 0.5, 1.0])
                rows.append([name, *(f"{value:.3g}" for value in ranges)])
        print_table(title, ["", "smallest", "median", "largest"], rows)
        return
    labels = itertools.product(*(data[name].values.tolist() for name in swept))
    rows = [
        [
            *(
                f"{each:.4g}" if isinstance(each, float) else str(each)
                for each in label
            ),
            *(f"{each[i]:.3g}" for each in columns.values()),
        ]
        for i, label in enumerate(labels)
    ]
    print_table(title, [*map(str, swept), *columns], rows)


def _in_units(each: xr.DataArray) -> tuple[str, np.ndarray]:
    """Return the name of a variable with a unit in which its values read well, and all values in that unit."""
    import numpy as np

    from planarfriction._support.shown import unit_for

    values = each.values.ravel()
    unit = each.attrs.get("units")
    if unit in KINDS:
        suited = unit_for(KINDS[unit], values[np.isfinite(values)])
        values = suited.factor * values
        unit = suited.label
    return (f"{each.name} [{unit}]" if unit else str(each.name)), values
