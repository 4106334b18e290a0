"""The seven patches of the published experiments: 21 x 21 cells on a square 0.02 m wide; shapes of scene files.

Source: Waltersson and Karayiannidis 2024. Another number of cells gives the same shape on another grid (the disc mask
and the lines follow their own rules, which depend on the number of cells).
"""

from __future__ import annotations

import dataclasses
import warnings
from typing import Any

import numpy as np

from planarfriction._support import validation
from planarfriction.errors import InvalidValueError
from planarfriction.families import PUBLISHED_PATCHES
from planarfriction.patch.contact_patch import ContactPatch
from planarfriction.patch.grid import MOST_CELLS, check_cells
from planarfriction.patch.outline import with_outline

PUBLISHED_CELLS = 21
"""Rows and columns of the grid that the published masks are written on."""


def square(cells: int = PUBLISHED_CELLS, width: float = 0.02) -> ContactPatch:
    """Return a uniform square, `width` [m] wide."""
    return _even(ContactPatch.rectangle(width, cells=cells, name="Square"))


def circle(cells: int = PUBLISHED_CELLS, width: float = 0.02) -> ContactPatch:
    """Return a uniform disc, as the published mask on a grid `width` [m] wide."""
    return ContactPatch.disc_published(
        validation.positive("width", width) / 2, cells, name="Circle"
    )


def line(cells: int = PUBLISHED_CELLS, width: float = 0.02) -> ContactPatch:
    """Return a uniform line along y, `width` [m] long."""
    return _even(ContactPatch.line(width, cells, name="Line"))


def line_grad(cells: int = PUBLISHED_CELLS, width: float = 0.02) -> ContactPatch:
    """Return a line along y, `width` [m] long, with weights cells, ..., 2, 1 from the top."""
    return _even(
        ContactPatch.line(width, cells, profile=_steps(cells), name="LineGrad")
    )


def line_grad_x(cells: int = PUBLISHED_CELLS, width: float = 0.02) -> ContactPatch:
    """Return a line along x, `width` [m] long, with weights cells, ..., 2, 1 from the left."""
    return _even(
        ContactPatch.line(
            width, cells, direction="x", profile=_steps(cells), name="LineGradX"
        )
    )


def non_convex_1(cells: int = PUBLISHED_CELLS, width: float = 0.02) -> ContactPatch:
    """Return two square pads (3 x 3 of 21 x 21 cells) at the left and right ends of the middle rows."""
    pads = [(slice(9, 12), slice(0, 3)), (slice(9, 12), slice(18, 21))]
    return _masked(pads, cells, width, "NonConvex1")


def non_convex_2(cells: int = PUBLISHED_CELLS, width: float = 0.02) -> ContactPatch:
    """Return a lying T of two bars: rows 9..11 x columns 0..13, and rows 4..17 x columns 18..20 (of 21 x 21 cells)."""
    bars = [(slice(9, 12), slice(0, 14)), (slice(4, 18), slice(18, 21))]
    return _masked(bars, cells, width, "NonConvex2")


def _even(patch: ContactPatch) -> ContactPatch:
    """Return the patch of points with weights in proportion to pressure and area alone, as published."""
    # The shape itself has given them.
    with warnings.catch_warnings(action="ignore"):
        points = dataclasses.replace(patch, point_shares=None, radii=None)
    return with_outline(points, patch.outline)


def _steps(cells: int) -> np.ndarray:
    """Return the weights cells, ..., 2, 1."""
    return np.arange(validation.count("cells", cells, at_most=MOST_CELLS), 0, -1)


def _masked(
    blocks: list[tuple[slice, slice]], cells: int, width: float, name: str
) -> ContactPatch:
    """Return a patch of even pressure on blocks of the published grid, of all cells whose centre is in a block."""
    cells = validation.count("cells", cells, at_most=MOST_CELLS)
    width = validation.positive("width", width)
    check_cells(cells**2)
    mask = np.zeros((PUBLISHED_CELLS, PUBLISHED_CELLS))
    for block in blocks:
        mask[block] = 1.0
    nearest = ((2 * np.arange(cells) + 1) * PUBLISHED_CELLS) // (2 * cells)
    return ContactPatch.from_pressure(
        mask[np.ix_(nearest, nearest)], width / cells, name=name
    )


def pressure_map(
    cell_size: Any = None, width: Any = None, file: Any = None, files: Any = None, values: Any = None,
    loads: Any = None, name: str | None = None, *, header: Any = None, index: Any = None, frame_shape: Any = None,
    frame: Any = None, threshold: Any = None, invert: Any = None,
) -> ContactPatch:  # fmt: skip
    """Return the patch of one map (a file or its values, rows from the top), or of several with their loads [N].

    The other options are those of `ContactPatch.from_pressure`.

    Raises `InvalidValueError` unless exactly one of `file`, `files` and `values` is given.
    """
    options = {key: value for key, value in locals().items() if value is not None}
    maps = {
        key: options.pop(key) for key in ("file", "files", "values") if key in options
    }
    if len(maps) != 1:
        rule = "have either file or values (or files, one for each load)"
        given = " and ".join(maps) or "none of them"
        raise InvalidValueError("pressure map", rule, given)
    if files is not None and loads is None:
        raise InvalidValueError(
            "loads", "be given: the normal force of each of the files", "none"
        )
    return ContactPatch.from_pressure(*maps.values(), **options)


def published(name: str, cells: Any = None, width: Any = None) -> ContactPatch:
    """Return the published patch `name` of so many `cells` along a side, `width` [m] wide."""
    size = {key: value for key, value in locals().items() if value is not None}
    return PUBLISHED_PATCHES.choose(size.pop("name"))(**size)


def cells(
    positions: Any, areas: Any, pressure: Any = None, grid: Any = None, cell_size: Any = None, outline: Any = None,
    name: Any = None, point_shares: Any = None, radii: Any = None,
) -> ContactPatch:  # fmt: skip
    """Return the patch that `ContactPatch.to_dict` described."""
    return ContactPatch.from_dict(
        {key: value for key, value in locals().items() if value is not None}
    )
