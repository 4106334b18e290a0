"""Pressure maps: of one contact measured at several loads, and from files, where row 0 of every map is its top."""

from __future__ import annotations

import functools
import io
import math
import warnings
from array import array
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from planarfriction import validation
from planarfriction.equality import ByValue
from planarfriction.errors import FileError, FrictionError, InvalidValueError, shown
from planarfriction.patch.grid import MOST_CELLS
from planarfriction.patch.pressure import Pressure, check_not_negative, pressure_array
from planarfriction.reading import number, read_bytes, read_rows

IMAGE_SUFFIXES = (".png", ".tif", ".tiff", ".bmp", ".pgm", ".jpg", ".jpeg")
"""Suffixes of the files that are read as grey images."""

MOST_BYTES = 256_000_000
"""Largest file of a map that is read."""

GREY_MODES = ("1", "L", "I", "F", "I;16", "I;16B", "I;16L", "I;16N")
"""Pillow's names for images with one channel of numbers."""


def read_pressure_map(path: str | Path) -> np.ndarray:
    """Read a map of relative pressures, shape `[rows, columns]`, row 0 at the top.

    The suffix determines the format: `.csv` (numbers separated by commas, no header, lines that begin with # are
    skipped), `.npy` (a two-dimensional array), or a grey image (brightness is pressure, black is none).

    Raises
    ------
    FileError
        The file is missing, of an unknown format, or does not contain what its suffix says.
    """
    path = validation.path("path", path)
    readers = {".csv": _read_csv, ".npy": _read_npy, **dict.fromkeys(IMAGE_SUFFIXES, _read_image)}
    reader = readers.get(path.suffix.lower())
    if reader is None:
        kinds = ", ".join(IMAGE_SUFFIXES)
        raise FileError(f"pressure map {path}: unknown kind {path.suffix!r}, use .csv, .npy or a grey image ({kinds})")
    try:
        with np.errstate(all="ignore"):  # what is no number, or too large for a float, no patch takes
            return reader(path)
    except FrictionError:
        raise
    # Pillow reports a broken PNG as SyntaxError, and other things as what they are in its own code.
    except Exception as error:
        reason = shown(" ".join(str(error).split())) or type(error).__name__
        raise FileError(f"pressure map {path}: not a readable {path.suffix.lower()} file ({reason})") from None


def title(path: str | Path) -> str:
    """Return the name of the patch of a map: that of its file, with ? for what cannot be printed."""
    return "".join(each if each.isprintable() else "?" for each in Path(path).stem).strip() or "map"


def _read_csv(path: Path) -> np.ndarray:
    values, width = array("d"), 0
    for line, cells in read_rows(path, "a pressure map"):
        width = width or len(cells)
        if len(cells) != width:
            raise FileError(f"pressure map {path}: line {line} has {len(cells)} values, the first row has {width}")
        values.extend(number(f"pressure map {path}", line, f"value {i}", cell) for i, cell in enumerate(cells, 1))
        _check_size(path, len(values))
    if not values:
        raise FileError(f"pressure map {path}: the file holds no numbers")
    return np.array(values).reshape(-1, width)


def _read_npy(path: Path) -> np.ndarray:
    content = io.BytesIO(read_bytes(path, "a pressure map", MOST_BYTES))
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # of a damaged header, which NumPy reads as source code
        values = np.load(content, allow_pickle=False)
    if not isinstance(values, np.ndarray) or values.dtype.kind not in "biuf":
        raise FileError(f"pressure map {path}: the file must hold one array of real numbers")
    _check_size(path, values.size)
    return values.astype(float)


def _read_image(path: Path) -> np.ndarray:
    from PIL import Image

    with warnings.catch_warnings(), Image.open(io.BytesIO(read_bytes(path, "a pressure map", MOST_BYTES))) as image:
        warnings.simplefilter("error", Image.DecompressionBombWarning)
        _check_size(path, math.prod(image.size))
        if image.mode in GREY_MODES:
            return np.asarray(image, dtype=float)
        red, green, blue, alpha = np.moveaxis(np.asarray(image.convert("RGBA"), dtype=float), -1, 0)
    if not ((red == green).all() and (red == blue).all()):
        raise FileError(f"pressure map {path}: this is a colour image; brightness means pressure only in a grey image")
    if not (alpha == 255).all():
        raise FileError(f"pressure map {path}: the image is partly transparent; save it without transparency")
    return red


def _check_size(path: Path, cells: int) -> None:
    """Raise, before memory is asked for, where a map has more cells than a patch may have."""
    if cells > MOST_CELLS:
        raise FileError(f"pressure map {path}: has more than {MOST_CELLS} cells, the maximum for a patch")


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
        values = pressure_array("pressure values", self.values, (len(loads), None))
        values = check_not_negative("pressure values", values)
        peak = values.max(axis=1, initial=0.0)
        if not (peak > 0.0).all():
            raise InvalidValueError(
                "pressure values", "have a total > 0 at every load", f"0 at {loads[peak.argmin()]:g} N"
            )
        for each in (loads, values):
            each.setflags(write=False)
        self._set(loads=loads, values=values)
        _ = self._shares  # now, and not while another thread copies what there is

    @functools.cached_property
    def _shares(self) -> np.ndarray:
        """Share of each cell in the total of its map, `[L, N]`."""
        shares = self.values / self.values.max(axis=1, keepdims=True)  # first, so that no sum can overflow
        return shares / shares.sum(axis=1, keepdims=True)

    @property
    def depends_on_load(self) -> bool:
        return len(self.loads) > 1

    def relative(self, positions: np.ndarray, normal_force: np.ndarray | None = None) -> np.ndarray:
        """Return the relative pressures of the cells at the loads, `[..., N]`. Raises InvalidValueError for another
        number of positions, and for a load below zero."""
        if self.values.shape[1] != len(positions):
            raise InvalidValueError("pressure", f"have shape [L, {len(positions)}]", f"shape {list(self.values.shape)}")
        if not self.depends_on_load:
            return self._shares[0]
        load = np.asarray(self.loads[0] if normal_force is None else normal_force, dtype=float)
        place = np.interp(load, self.loads, np.arange(len(self.loads)))
        below = np.minimum(place.astype(int), len(self.loads) - 2)
        share = (place - below)[..., None]
        return (1.0 - share) * self._shares[below] + share * self._shares[below + 1]

    def ever_loaded(self, positions: np.ndarray, between: tuple[float, float] | None = None) -> np.ndarray:
        self.relative(positions)
        first, last = 0, len(self.loads) - 1
        if between is not None:
            first = max(int(np.searchsorted(self.loads, between[0], "right")) - 1, 0)
            last = min(int(np.searchsorted(self.loads, between[1])), last)
        return (self.values[first : last + 1] > 0.0).any(axis=0)

    def only(self, kept: np.ndarray) -> PressureMaps:
        return PressureMaps(self.loads, self.values[:, kept])

    def repeated(self, times: int) -> PressureMaps:
        return PressureMaps(self.loads, np.repeat(self.values, times, axis=1))

    def to_dict(self) -> dict[str, Any]:
        return {"law": self.law, "loads": self.loads.tolist(), "values": self.values.tolist()}


def read_maps(pressure: Any, loads: Any = None) -> tuple[Any, tuple[int, int], str | None]:
    """Return the pressure law or numbers, `(rows, columns)` and the name of one map, or of several with `loads` [N].

    A map is an array `[rows, columns]` or the path of a file; several are a stack, a list, or a mapping by load.
    """
    if isinstance(pressure, Mapping):
        if loads is not None:
            raise InvalidValueError("loads", "be left out, because the mapping has them", loads)
        loads = sorted(pressure, key=lambda load: validation.positive("load of a pressure map", load))
        pressure = [pressure[load] for load in loads]
    if loads is None:
        values, name = _one_map(pressure)
        if not values.any():
            raise InvalidValueError(_what(pressure), "have a total > 0", "0")
        return values.ravel(), values.shape, name
    loads = validation.array("loads", loads, (None,))
    count = 1 if isinstance(pressure, (str, Path)) or not hasattr(pressure, "__len__") else len(pressure)
    if count != len(loads) or isinstance(pressure, (str, Path)):
        raise InvalidValueError("pressure", f"have one map for each of {len(loads)} loads", count)
    maps = [_one_map(each) for each in pressure]
    shape = maps[0][0].shape if maps else (0, 0)
    for each, (values, _) in zip(pressure, maps, strict=True):
        if values.shape != shape:
            raise InvalidValueError(_what(each), f"have the shape of the first, {list(shape)}", list(values.shape))
    stack = [values.ravel() for values, _ in maps]
    return PressureMaps(loads, stack if stack else np.empty((0, 0))), shape, maps[0][1]


def _what(pressure: Any) -> str:
    return f"pressure map {pressure}" if isinstance(pressure, (str, Path)) else "pressure"


def _one_map(pressure: Any) -> tuple[np.ndarray, str | None]:
    """Return the values `[rows, columns]` of an array or a file, and the name of the file."""
    named = isinstance(pressure, (str, Path))
    values = read_pressure_map(pressure) if named else pressure
    values = check_not_negative(_what(pressure), pressure_array(_what(pressure), values, (None, None)))
    return values, title(pressure) if named else None
