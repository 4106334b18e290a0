"""`planarfriction hold`: the grip force that holds a part while a gripper accelerates it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click
from click import command, option

from planarfriction.cli.options import (
    FILE,
    complete_patch,
    find_patch,
    map_options,
    parse_length,
)


def parse_offset(text: str) -> tuple[float, float]:
    """Return the position (x, y) [m] that `--offset` spells, `60mm` or `60mm,-5mm`."""
    x, comma, y = text.partition(",")
    return parse_length("--offset", x), parse_length("--offset", y if comma else "0")


@command(short_help="Compute the grip force that holds a part in motion.")
@option("--mass", type=float, required=True, help="Mass of the part in kg.")
@option(
    "--pad",
    metavar="PATCH",
    default="Circle",
    shell_complete=complete_patch,
    help="Contact patch of a finger: 12x20mm (along x and y), a name, or a pressure map with --cell-size or --width.",
)
@map_options
@option(
    "--offset",
    metavar="X[,Y]",
    default="0",
    help="Centre of mass from the centre of the pads: 60mm or 60mm,-5mm; x is horizontal, y is up.",
)
@option("--mu", type=float, required=True, help="Friction coefficient.")
@option(
    "--acceleration",
    type=float,
    default=0.0,
    help="Largest acceleration of the gripper in m/s^2, in any direction.",
)
@option("--grip", type=float, help="Normal force of each finger in N, to be checked.")
@option(
    "--margin",
    type=click.FloatRange(min=0.0),
    default=0.0,
    help="Share that is added to the force that is needed; 0.2 adds 20 %.",
)
@option("--fingers", default=2, help="Number of fingers that share the load.")
@option("--out", type=FILE, default="hold.png", help="Picture (.png, .pdf, .svg).")
def hold(
    mass: float,
    pad: str,
    size: dict[str, Any],
    offset: str,
    mu: float,
    out: Path,
    **motion: Any,
) -> None:
    """Compute the grip force that holds a part while a gripper accelerates it in any direction.

    Prints the force of each finger at rest and in the worst direction, and the safety factor of a given --grip. The
    picture shows the loads inside the limit surface. A part that rotates, and a moment that tilts it between the
    pads, are not included.

    \b
    Examples:
      planarfriction hold --mass 0.3 --pad 12x20mm --offset 60mm --mu 0.8 --acceleration 3
      planarfriction hold --mass 0.3 --pad 12x20mm --offset 60mm --mu 0.8 --acceleration 3 --grip 30
      planarfriction hold --mass 0.1 --pad pad.csv --cell-size 1mm --mu 0.6 --margin 0.25 --out hold.pdf
    """
    from planarfriction.cli.console import note, print_table
    from planarfriction.cli.output import PICTURES, check_kind, write_picture
    from planarfriction.planning import plan_hold

    check_kind(out, PICTURES, "a picture")
    patch = find_patch(pad, size)
    centre = parse_offset(offset)
    plan = plan_hold(patch, mu, mass=mass, centre_of_mass=centre, **motion)
    rows = [["grip needed at rest [N]", f"{plan.at_rest:.1f}"]]
    if plan.acceleration:
        rows += [
            [f"at {plan.acceleration:g} m/s^2 [N]", f"{plan.forces.max():.1f}"],
            ["worst direction (+y is up)", plan.worst_direction],
        ]
    if plan.margin:
        rows.append([f"with {100 * plan.margin:g} % margin [N]", f"{plan.needed:.1f}"])
    if plan.grip is not None and plan.safety_factor is not None:
        factor = plan.safety_factor
        verdict = "slips" if factor < 1.0 else "holds, below the margin"
        if plan.grip >= plan.needed:
            verdict = "holds"
        rows.append([f"safety factor of {plan.grip:g} N", f"{factor:.2f}: {verdict}"])
    print_table(f"Grip of {patch.name}, each finger", ["quantity", "value"], rows)
    note(f"wrote {write_picture(plan.plot(), out)}")
