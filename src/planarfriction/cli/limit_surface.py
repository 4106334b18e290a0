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
"""A picture to be turned with the mouse."""

FINER = 3
"""Refinement whose errors stand beside those of a patch."""

MOST_FINER = 12_000
"""Number of cells up to which the refinement takes a second."""

POLAR_SAMPLES = 37
"""Samples from pole to pole of the direction sphere in the CSV: every five degrees."""

AZIMUTH_SAMPLES = 72
"""Samples around the direction sphere in the CSV: every five degrees."""


def choose_patch(
    patch: str | None, pressure: Path | None, size: Mapping[str, Any]
) -> pf.ContactPatch:
    """Return the patch of `--patch` or of `--pressure`, of which at most one is given; Circle without either."""
    if patch is not None and pressure is not None:
        raise InvalidValueError(
            "--patch", "not be given together with --pressure", patch
        )
    if pressure is not None:
        return pressure_map(pressure, size)
    return find_patch(patch, size)


def show(
    patch: pf.ContactPatch,
    *,
    surface: str,
    out: Path | None,
    alone: bool,
    csv: Path | None,
) -> None:
    """Print the numbers of a limit surface; write its picture (alone or beside the ellipsoid) and its samples."""
    if out is not None:
        check_kind(out, (*PICTURES, HTML), "a picture")
    elif alone:
        raise InvalidValueError("--alone", "be given together with --out", alone)
    if csv is not None:
        check_kind(csv)
    shown = SURFACES[surface](patch)
    # No -0 and no rounding errors of symmetric patches.
    centre = np.round(1e3 * shown.centre_of_pressure, 9) + 0.0
    rows = [
        ["loaded cells", f"{patch.cells}"],
        ["centre of pressure [mm]", f"{centre[0]:.4g}, {centre[1]:.4g}"],
        ["contact radius r [mm]", f"{1e3 * shown.contact_radius:.4g}"],
        ["second moment <rho^2> [mm^2]", f"{1e6 * patch.second_moment():.4g}"],
        [
            "largest distance from the ellipsoid [-]",
            f"{_distance_from_ellipsoid(shown):.3g}",
        ],
    ]
    rows += _grid_errors(patch)
    print_table(
        f"Limit surface of {patch.name} ({surface})", ["mu f_N = 1", "value"], rows
    )
    if csv is not None:
        from planarfriction.plots.limit_surface import sample_limit_surface

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
            write_picture(plots.plot_limit_surface(shown, beside=beside), out)
        note(f"wrote {out}")


def _grid_errors(patch: pf.ContactPatch) -> list[list[str]]:
    """Return rows on what the cells cost against the continuous patch, and on what finer ones would; none of points."""
    if not patch.cell_extents().any():
        return []
    rows = [["errors of these cells", f"{patch.grid_error()}"]]
    if patch.cells * FINER**2 <= MOST_FINER:
        rows.append(
            [f"errors of refined({FINER})", f"{patch.grid_error(refined=FINER)}"]
        )
    return rows


def _directions() -> tuple[np.ndarray, np.ndarray]:
    """Return the polar angle and azimuth [rad] of the samples, `[M]`: every direction once."""
    polar, azimuth = np.meshgrid(
        np.linspace(0.0, np.pi, POLAR_SAMPLES)[1:-1],
        np.linspace(0.0, 2 * np.pi, AZIMUTH_SAMPLES, endpoint=False),
        indexing="ij",
    )
    polar = np.concatenate([[0.0], polar.ravel(), [np.pi]])
    return polar, np.pad(azimuth.ravel(), 1)


def _distance_from_ellipsoid(surface: Any) -> float:
    """Return the largest distance of (fx, fy, tau/r) from those of the ellipsoid at the same directions of sliding."""
    from planarfriction.plots.limit_surface import scaled_samples

    ellipsoid = pf.LimitSurfaceEllipsoid(
        surface.patch, normal_force=surface.normal_force
    )
    points, others = (
        scaled_samples(each, *_directions())[1] for each in (surface, ellipsoid)
    )
    return np.linalg.norm(points - others, axis=1).max()
