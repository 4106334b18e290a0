"""Pressure maps: of one contact measured at several loads, and from files, where row 0 of every map is its top."""

from __future__ import annotations

import functools
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from planarfriction._support import validation
from planarfriction._support.equality import ByValue
from planarfriction.errors import InvalidValueError
from planarfriction.patch.grid import Grid
from planarfriction.patch.map_files import MapReading, map_reading, read_pressure_map
from planarfriction.patch.pressure import Pressure, non_negative_array


def title(path: str | Path) -> str:
    """Return the name of the patch of a map: that of its file, with ? for what cannot be printed."""
    return (
        "".join(each if each.isprintable() else "?" for each in Path(path).stem).strip()
        or "map"
    )


@dataclass(frozen=True, eq=False)
class PressureMaps(ByValue, Pressure):
    """Relative pressures of the cells measured at several loads; only ratios within a map matter.

    Between two measured loads the share of each cell in the total of its map is linear in the load; below the first and
    above the last the map stays as it is. Raises `InvalidValueError` unless the loads ascend and are > 0 and each map
    has one pressure >= 0 for each cell and a total > 0.
    """

    law = "pressure_maps"
    loads: Any
    """Normal forces of the measurements, ascending, shape `[L]` [N]."""
    values: Any
    """Pressures as given, each map at its own scale, shape `[L, N]`; not rescaled, so that files restore them."""

    def __post_init__(self) -> None:
        loads = validation.array("loads", self.loads, (None,))
        if len(loads) == 0 or not (loads[0] > 0.0 and (np.diff(loads) > 0.0).all()):
            raise InvalidValueError("loads", "be increasing and > 0", loads.tolist())
        values = non_negative_array("pressure values", self.values, (len(loads), None))
        peak = values.max(axis=1, initial=0.0)
        if not (peak > 0.0).all():
            given = f"0 at {loads[peak.argmin()]:g} N"
            raise InvalidValueError(
                "pressure values", "have a total > 0 at every load", given
            )
        for each in (loads, values):
            each.setflags(write=False)
        self._set(loads=loads, values=values)
        _ = self._shares  # now, and not while another thread copies what there is

    @functools.cached_property
    def _shares(self) -> np.ndarray:
        """Share of each cell in the total of its map, `[L, N]`."""
        # First, so that no sum can overflow.
        shares = self.values / self.values.max(axis=1, keepdims=True)
        return shares / shares.sum(axis=1, keepdims=True)

    @property
    def depends_on_load(self) -> bool:
        return len(self.loads) > 1

    def relative(
        self, positions: np.ndarray, normal_force: np.ndarray | None = None
    ) -> np.ndarray:
        """Return the relative pressures of the cells at the loads, `[..., N]`. Raises InvalidValueError for another
        number of positions, and for a load below zero."""
        if self.values.shape[1] != len(positions):
            rule = f"have shape [L, {len(positions)}]"
            given = f"shape {list(self.values.shape)}"
            raise InvalidValueError("pressure", rule, given)
        if not self.depends_on_load:
            return self._shares[0]
        load = self.loads[0] if normal_force is None else normal_force
        place = np.interp(load, self.loads, np.arange(len(self.loads)))
        below = np.minimum(place.astype(int), len(self.loads) - 2)
        share = (place - below)[..., None]
        return (1.0 - share) * self._shares[below] + share * self._shares[below + 1]

    def ever_loaded(
        self, positions: np.ndarray, between: tuple[float, float] | None = None
    ) -> np.ndarray:
        self.relative(positions)
        first = 0
        last = len(self.loads) - 1
        if between is not None:
            first = max(int(np.searchsorted(self.loads, between[0], "right")) - 1, 0)
            last = min(int(np.searchsorted(self.loads, between[1])), last)
        return (self.values[first : last + 1] > 0.0).any(axis=0)

    def only(self, kept: np.ndarray) -> PressureMaps:
        return PressureMaps(self.loads, self.values[:, kept])

    def repeated(self, times: int) -> PressureMaps:
        return PressureMaps(self.loads, np.repeat(self.values, times, axis=1))


def read_maps(
    pressure: Any, loads: Any = None, **options: Any
) -> tuple[Any, tuple[int, int], str | None]:
    """Return the pressure law or numbers, `(rows, columns)` and the name of one map, or of several with `loads` [N].

    A map is an array `[rows, columns]` or the path of a file; several are a stack, a list, or a mapping by load.
    `options` are those of `MapReading`.
    """
    reading = map_reading(options)
    if isinstance(pressure, Mapping):
        if loads is not None:
            rule = "be left out, because the mapping has them"
            raise InvalidValueError("loads", rule, loads)
        loads = sorted(
            pressure,
            key=functools.partial(validation.positive, "load of a pressure map"),
        )
        pressure = [pressure[load] for load in loads]
    if loads is None:
        values, name = _one_map(pressure, reading)
        if not values.any():
            raise InvalidValueError(_what(pressure), "have a total > 0", "0")
        return values.ravel(), values.shape, name
    loads = validation.array("loads", loads, (None,))
    several = hasattr(pressure, "__len__") and not isinstance(pressure, (str, Path))
    given: Any = pressure if several else [pressure]
    count = len(given)
    if not several or count != len(loads):
        rule = f"have one map for each of {len(loads)} loads"
        raise InvalidValueError("pressure", rule, count)
    maps = [_one_map(each, reading) for each in given]
    shape = maps[0][0].shape if maps else (0, 0)
    for each, (values, _) in zip(given, maps, strict=True):
        if values.shape != shape:
            rule = f"have the shape of the first, {list(shape)}"
            raise InvalidValueError(_what(each), rule, list(values.shape))
    stack = [values.ravel() for values, _ in maps]
    return PressureMaps(loads, stack if stack else np.empty((0, 0))), shape, maps[0][1]


def map_grid(rows: int, columns: int, cell_size: Any, width: Any) -> Grid:
    """Return the grid of a map: `cell_size` [m] is the side of a cell or `(width, height)`, or `width` that of the map.

    Raises InvalidValueError unless one of both is given, and > 0.
    """
    if (cell_size is None) == (width is None):
        raise InvalidValueError(
            "cell_size", "be given, or else the width of the whole map", cell_size
        )
    if cell_size is None:
        cell_size = validation.length("width", width) / columns
    size = validation.numbers("cell_size", cell_size)
    size = validation.array("cell_size", size, (2,) if size.ndim else ())
    width, height = np.broadcast_to(
        [validation.length("cell_size", side) for side in size.flat], 2
    )
    return Grid.around_origin(columns * width, rows * height, columns, rows)


def _what(pressure: Any) -> str:
    return (
        f"pressure map {pressure}" if isinstance(pressure, (str, Path)) else "pressure"
    )


def _one_map(pressure: Any, reading: MapReading) -> tuple[np.ndarray, str | None]:
    """Return the values `[rows, columns]` of an array or a file, and the name of the file."""
    if isinstance(pressure, (str, Path)):
        values = read_pressure_map(pressure, **vars(reading))
        name = title(pressure)
    else:
        values = pressure
        if isinstance(pressure, np.ndarray):
            values = reading.frame_of("pressure", pressure)
        name = None
    values = non_negative_array(_what(pressure), values, (None, None))
    return values if name else reading.pressures("pressure", values), name
