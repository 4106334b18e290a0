"""Pressure maps from files: CSV, NPY, grey images. Row 0 of every map is its top (largest y)."""

from __future__ import annotations

import io
import math
import warnings
from array import array
from pathlib import Path

import numpy as np

from planarfriction import validation
from planarfriction.errors import FileError, FrictionError, shown
from planarfriction.patch.grid import MOST_CELLS
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
