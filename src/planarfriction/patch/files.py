"""Pressure maps from files: CSV, NPY, grey images. Row 0 of every map is its top (largest y)."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from planarfriction.errors import FileError
from planarfriction.reading import number, read_rows

IMAGE_SUFFIXES = (".png", ".tif", ".tiff", ".bmp", ".pgm", ".jpg", ".jpeg")
"""Suffixes of the files that are read as grey images."""

GREY_MODES = ("1", "L", "I", "F", "I;16", "I;16B", "I;16L", "I;16N")
"""Pillow's names for images with one channel of numbers."""


def read_pressure_map(path: str | Path) -> np.ndarray:
    """Read a map of relative pressures, shape `[rows, columns]`, row 0 at the top.

    The suffix tells the kind: `.csv` (numbers separated by commas, no header, lines that begin with # are skipped),
    `.npy` (a two-dimensional array), or a grey image (brightness is pressure, black is none).

    Raises
    ------
    FileError
        The file is missing, of an unknown kind, or does not hold what its suffix says.
    """
    path = Path(path)
    readers = {".csv": _read_csv, ".npy": _read_npy, **dict.fromkeys(IMAGE_SUFFIXES, _read_image)}
    reader = readers.get(path.suffix.lower())
    if reader is None:
        kinds = ", ".join(IMAGE_SUFFIXES)
        raise FileError(f"pressure map {path}: unknown kind {path.suffix!r}, use .csv, .npy or a grey image ({kinds})")
    if not path.is_file():
        raise FileError(f"pressure map {path}: no such file")
    try:
        return reader(path)
    except FileError:
        raise
    # Pillow reports a broken PNG as SyntaxError; an oversized header of an NPY file ends in a MemoryError.
    except (OSError, ValueError, SyntaxError, EOFError, MemoryError) as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        raise FileError(f"pressure map {path}: not a readable {path.suffix.lower()} file ({reason})") from error


def _read_csv(path: Path) -> np.ndarray:
    rows: list[list[float]] = []
    for line, cells in read_rows(path, "a pressure map"):
        if rows and len(cells) != len(rows[0]):
            rule = f"has {len(cells)} values, the first row has {len(rows[0])}"
            raise FileError(f"pressure map {path}: line {line} {rule}")
        rows.append([number(f"pressure map {path}", line, f"value {i}", cell) for i, cell in enumerate(cells, 1)])
    if not rows:
        raise FileError(f"pressure map {path}: the file holds no numbers")
    return np.array(rows)


def _read_npy(path: Path) -> np.ndarray:
    values = np.load(path, allow_pickle=False)
    if not isinstance(values, np.ndarray) or values.dtype.kind not in "biuf":
        raise FileError(f"pressure map {path}: the file must hold one array of real numbers")
    return values.astype(float)


def _read_image(path: Path) -> np.ndarray:
    from PIL import Image

    with Image.open(path) as image:
        if image.mode in GREY_MODES:
            return np.asarray(image, dtype=float)
        red, green, blue, alpha = np.moveaxis(np.asarray(image.convert("RGBA"), dtype=float), -1, 0)
    if not ((red == green).all() and (red == blue).all()):
        raise FileError(f"pressure map {path}: this is a colour image, brightness means pressure in a grey one only")
    if not (alpha == 255).all():
        raise FileError(f"pressure map {path}: the image is partly transparent, save it without transparency")
    return red
