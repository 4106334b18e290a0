"""Tables that are no pressure map although they read as one: lists of places, columns of time, frames in rows."""

from __future__ import annotations

import re
import warnings
from collections.abc import Sequence

import numpy as np

from planarfriction.errors import FileError

TIMES = ("time", "t", "timestamp", "frame", "sample")
"""Names of a first column that makes each row a frame."""

FEWEST_STEPS = 5
"""Number of values from which equal steps are no chance."""

JITTER = 0.1
"""Share of their mean by which the steps of a clock may differ."""

FEWEST_PLACES = 6
"""Number of rows from which places that never repeat, on a lattice, are no chance."""

LOADED = 0.3
"""Share of the largest sum of a row from which the row is compared with the others: noise changes smaller ones."""

FEWEST_FRAMES = 8
"""Number of loaded rows from which they may be frames."""

MOST_FRAMES = 64
"""Number of rows that are compared."""

ALIKE = 0.03
"""Second singular value of rows over their first up to which they are one pattern: frames of one pad with a noise of
3 % of its peak have 0.02, rows through four round fingers beside each other 0.07 to 0.27."""

HUMPS = 3
"""Number of peaks along a row, each next to values below half of the largest, from which it may be several rows."""

REPEATS = 0.8
"""Difference of a row from itself a row of the sensor further on, over the largest at shorter shifts, up to which the
row repeats itself."""

MOVES = 0.55
"""Standard deviation of the centre of a pattern over its radius of gyration from which the pattern moves: rows through
ribs of a slanted tyre and through fingers have up to 0.52."""

PARTED = 0.5
"""Load that neighbours share across the ends of a sensor's rows, over the mean along a row, up to which the ends part
the pattern: oblique grooves are alike everywhere."""

FLAT = 0.1
"""Share of the pressure above the rim within which a rim is flat."""

RIM = 0.9
"""Share of the cells of a rim that must be flat."""

FEWEST_RIM = 5
"""Rows and columns from which a map has an inside and a rim."""


def refuse_named(what: str, names: Sequence[str]) -> None:
    """Raise FileError if the names of columns say that the rows are places, or frames."""
    known = [re.split(r"[\s\[(_]", name.strip().lower())[0] for name in names]
    if {"x", "y"} <= set(known):
        raise FileError(_list_of_places(what))
    if known and known[0] in TIMES:
        text = "give frame_shape = [rows, columns] of the frames in its rows, or index = false if it holds pressures"
        raise FileError(f"{what}: its first column is called {names[0]}: {text}")


def refuse_other_tables(what: str, table: np.ndarray, index: bool | None) -> None:
    """Raise FileError with the remedy for a table `[rows, columns]` whose numbers show that it is no map.

    - A list of places: three columns, of which two next to each other have few values in equal steps and no pair twice,
      in the order of one of them.
    - A column of time (unless `index` is False): the first one goes in equal steps, and others do not.
    - Frames in rows: all rows with a load are one pattern of at least three humps, as rows of a sensor in a row are, or
      they repeat themselves with a period, and fold to patterns of which the centre moves.
    """
    with np.errstate(all="ignore"):
        if not (table.size and np.isfinite(table).all()):
            return
        if table.shape[1] == 3 and (
            _are_places(table[:, :2]) or _are_places(table[:, 1:])
        ):
            raise FileError(
                f"{_list_of_places(what)} (frame_shape = {list(table.shape)}: it is a map)"
            )
        steady = np.array([_is_steady(column) for column in table.T])
        others = steady[1:] | (np.ptp(table[:, 1:], axis=0) == 0.0)
        if (
            index is None
            and steady[0]
            and (not others.all() or _are_frames(table[:, 1:]) or _move(table[:, 1:]))
        ):
            shown = ", ".join(f"{value:g}" for value in table[:3, 0])
            text = "labels (index = true), times (frame_shape = [rows, columns]) or pressures (index = false)?"
            raise FileError(f"{what}: the first column is {shown}, ...: {text}")
        if _are_frames(table) or _move(table):
            text = "its rows repeat one pattern: frames (frame_shape = [rows, columns], frame) or one map"
            raise FileError(f"{what}: {text} (frame_shape = {list(table.shape)})?")


def remark_offset(what: str, values: np.ndarray) -> None:
    """Warn if the rim of a map is flat, but not at zero: cells that touch nothing would count as contact."""
    if min(values.shape) < FEWEST_RIM or not np.isfinite(values).all():
        return
    rim = rim_of(values)
    level = float(np.median(rim))
    above = float(values.max()) - level
    if (
        above > 0.0
        and np.mean(rim > 0.0) >= RIM
        and np.mean(np.abs(rim - level) <= FLAT * above) >= RIM
    ):
        share = np.ceil(100.0 * (level + FLAT * above) / values.max()) / 100.0
        text = (
            f"its rim is flat at {level:g} of {values.max():g}, and counts as contact"
        )
        remedy = f"subtract an offset of the sensor, or leave out such cells by threshold = {share:g}"
        warnings.warn(f"{what}: {text}; {remedy}", stacklevel=5)


def rim_of(values: np.ndarray) -> np.ndarray:
    """Return the values along the four sides of a map."""
    return np.concatenate([values[0], values[-1], values[:, 0], values[:, -1]])


def _list_of_places(what: str) -> str:
    text = "this is a list of places x, y and pressures, not a map: make it a table with a row for each y, top first"
    return f"{what}: {text}, or pass places and pressures to ContactPatch.points"


def _are_places(pairs: np.ndarray) -> bool:
    """Return True if pairs are places on a lattice, each once, row by row or column by column."""
    if len(pairs) < FEWEST_PLACES or len(np.unique(pairs, axis=0)) < len(pairs):
        return False
    steps = np.diff(pairs, axis=0)
    if not ((steps >= 0.0).all(axis=0) | (steps <= 0.0).all(axis=0)).any():
        return False
    for column in pairs.T:
        values = np.unique(column)
        if (
            len(values) < 2
            or 2 * len(values) > len(pairs)
            or not _are_equal(np.diff(values))
        ):
            return False
    return True


def _is_steady(values: np.ndarray) -> bool:
    """Return True if values rise or fall in equal steps."""
    return len(values) >= FEWEST_STEPS and _are_equal(np.diff(values))


def _are_equal(steps: np.ndarray) -> bool:
    mean = steps.mean()
    return bool(mean != 0.0 and (np.abs(steps - mean) <= JITTER * np.abs(mean)).all())


def _are_frames(table: np.ndarray) -> bool:
    """Return True if all rows with a load are one pattern, at different loads, with several humps."""
    sums = table.sum(axis=1)
    rows = table[sums > LOADED * sums.max()]
    if (
        len(rows) < FEWEST_FRAMES
        or np.ptp(rows.sum(axis=1)) == 0.0
        or _humps(rows.mean(axis=0)) < HUMPS
    ):
        return False
    some = rows[np.linspace(0, len(rows) - 1, min(len(rows), MOST_FRAMES)).astype(int)]
    first, second = np.linalg.svd(some / some.max(), compute_uv=False)[:2]
    return bool(second <= ALIKE * first)


def _move(table: np.ndarray) -> bool:
    """Return True if the rows with a load fold to frames of some width whose pattern moves."""
    above = np.clip(table - np.quantile(table, 0.25), 0.0, None)
    sums = above.sum(axis=1, keepdims=True)
    rows = above / sums
    rows = rows[sums[:, 0] > LOADED * sums.max()]
    size = rows.shape[1]
    if len(rows) < FEWEST_FRAMES or size < HUMPS * HUMPS:
        return False
    shifts = range(1, size // HUMPS + 1)
    unlike = [
        np.abs(rows[:, s:] - rows[:, :-s]).sum() / (rows[:, s:] + rows[:, :-s]).sum()
        for s in shifts
    ]
    common = np.minimum(rows[:, 1:], rows[:, :-1]).sum(axis=0)
    for width in shifts[HUMPS - 1 :]:
        frames = (
            rows.reshape(len(rows), -1, width)
            if size % width == 0
            else rows[:, :0, None]
        )
        repeats = unlike[width - 1] <= REPEATS * max(unlike[: width - 1])
        parted = common[width - 1 :: width].mean() <= PARTED * common.mean()
        if (
            frames.size
            and repeats
            and parted
            and max(_motion(frames.sum(axis)) for axis in (1, 2)) >= MOVES
        ):
            return True
    return False


def _motion(loads: np.ndarray) -> float:
    """Return the standard deviation of the centre of loads `[frames, places]` over their radius of gyration."""
    places = np.arange(loads.shape[1])
    centre = loads @ places
    spread = loads @ places**2 - centre**2
    return float(centre.std() / np.sqrt(max(spread.mean(), 1e-300)))


def _humps(pattern: np.ndarray) -> int:
    """Return the number of runs of values above half of the largest."""
    high = np.concatenate([[False], pattern > 0.5 * pattern.max()])
    return int((high[1:] & ~high[:-1]).sum())
