"""`planarfriction limit-surface`: numbers, picture and samples of the limit surface of a patch."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

import planarfriction as pf
from planarfriction._support.writing import write_text
from planarfriction.cli.console import note, print_table
from planarfriction.cli.options import find_patch, pressure_map
from planarfriction.cli.output import PICTURES, check_kind, write_csv, write_picture
from planarfriction.errors import InvalidValueError
from planarfriction.families import SURFACES

HTML = ".html"
"""A picture to be rotated with the mouse."""

FINER = 3
"""Refinement whose errors stand beside those of a patch."""

MOST_FINER = 12_000
"""Number of cells up to which the refinement takes a second."""

POLAR_SAMPLES = 37
"""Samples from pole to pole of the direction sphere in the CSV: every five degrees."""

AZIMUTH_SAMPLES = 72
"""Samples around the direction sphere in the CSV: every five degrees."""


def show(
    *,
    patch: str | None,
    pressure: Path | None,
    size: Mapping[str, Any],
    surface: str,
    out: Path | None,
    alone: bool,
    csv: Path | None,
) -> None:
    """Print the numbers of a limit surface; write its picture (alone or beside the ellipsoid) and its samples.

    The patch is that of `--patch` or of `--pressure`, of which at most one is given; Circle without either.
    """
    from planarfriction.plots.limit_surface import sample_limit_surface, scaled_samples

    if patch is not None and pressure is not None:
        raise InvalidValueError(
            "--patch", "not be given together with --pressure", patch
        )
    if pressure is None:
        contact = find_patch(patch, size)
    else:
        contact = pressure_map(pressure, size)
    if out is not None:
        check_kind(out, (*PICTURES, HTML), "a picture")
    elif alone:
        raise InvalidValueError("--alone", "be given together with --out", alone)
    if csv is not None:
        check_kind(csv)
    shown = SURFACES[surface](contact)
    # No -0 and no rounding errors of symmetric patches.
    centre = np.round(1e3 * shown.centre_of_pressure, 9) + 0.0
    ellipsoid = pf.LimitSurfaceEllipsoid(contact, normal_force=shown.normal_force)
    points, others = (
        scaled_samples(each, *_directions())[1] for each in (shown, ellipsoid)
    )
    # of (fx, fy, tau/r) at the same directions of sliding
    distance = np.linalg.norm(points - others, axis=1).max()
    rows = [
        ["loaded cells", f"{contact.cells}"],
        ["centre of pressure [mm]", f"{centre[0]:.4g}, {centre[1]:.4g}"],
        ["contact radius r [mm]", f"{1e3 * shown.contact_radius:.4g}"],
        ["second moment <rho^2> [mm^2]", f"{1e6 * contact.second_moment():.4g}"],
        ["largest distance from the ellipsoid [-]", f"{distance:.3g}"],
    ]
    # what the cells cost against the continuous patch, and what finer ones would; points have no errors
    if contact.cell_extents().any():
        rows.append(["errors of these cells", f"{contact.grid_error()}"])
        if contact.cells * FINER**2 <= MOST_FINER:
            errors = contact.grid_error(refined=FINER)
            rows.append([f"errors of refined({FINER})", f"{errors}"])
    print_table(
        f"Limit surface of {contact.name} ({surface})", ["mu f_N = 1", "value"], rows
    )
    if csv is not None:
        columns = np.hstack(sample_limit_surface(shown, *_directions())).T
        names = ("vx", "vy", "omega", "fx", "fy", "tau")
        write_csv(csv, dict(zip(names, columns, strict=True)))
        note(f"wrote {csv}")
    if out is not None:
        from planarfriction import plots

        beside = None if alone else "ellipsoid"
        # With plotly's own code in it, so that it opens without a network.
        if out.suffix.lower() == HTML:
            figure = plots.interactive_limit_surface(shown, beside=beside)
            write_text(out, figure.to_html(include_plotlyjs=True))
        else:
            write_picture(plots.plot_sections(shown, beside=beside), out)
        note(f"wrote {out}")


def _directions() -> tuple[np.ndarray, np.ndarray]:
    """Return the polar angle and azimuth [rad] of the samples, `[M]`: every direction once."""
    polar, azimuth = np.meshgrid(
        np.linspace(0.0, np.pi, POLAR_SAMPLES)[1:-1],
        np.linspace(0.0, 2 * np.pi, AZIMUTH_SAMPLES, endpoint=False),
        indexing="ij",
    )
    polar = np.concatenate([[0.0], polar.ravel(), [np.pi]])
    return polar, np.pad(azimuth.ravel(), 1)
