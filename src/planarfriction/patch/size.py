"""Limits of the number of cells of a patch, and a warning for patches of unusual size."""

from __future__ import annotations

import warnings

import numpy as np

from planarfriction.errors import InvalidValueError

MOST_CELLS = 1_100_000
"""Cells of a patch, and boxes of its grid, that are taken: some 1050 x 1050, half a gigabyte while shapes are cut."""

LEAST_WIDTH, MOST_WIDTH = 1e-5, 1.0
"""Widths of a patch [m] outside of which its maker is asked whether they are in metres."""


def check_cells(count: int) -> None:
    """Raise, before memory is asked for, where a patch would have more than `MOST_CELLS`."""
    if count > MOST_CELLS:
        raise InvalidValueError("cells", f"be at most {MOST_CELLS} in all", count)


def warn_of_the_unit(name: str, positions: np.ndarray, cell_size: tuple[float, float] | None) -> None:
    """Warn where a patch is so large or so small that millimetres may have been given for metres."""
    width = max(float(np.ptp(x)) + side for x, side in zip(positions.T, cell_size or (0.0, 0.0), strict=True))
    if not LEAST_WIDTH <= width <= MOST_WIDTH and width > 0.0:  # 0: a point
        than = f"larger than {MOST_WIDTH:g}" if width > MOST_WIDTH else f"smaller than {LEAST_WIDTH:g}"
        warnings.warn(f"patch {name!r} is {width:.3g} m wide, {than} m: are its lengths in metres?", stacklevel=4)
