"""Files of pressure maps: tables, arrays, Tekscan exports and grey images, where row 0 of every map is its top."""

from __future__ import annotations

import io
import itertools
import math
import warnings
import zipfile
from array import array
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from planarfriction._support import validation
from planarfriction._support.equality import Checked, checked
from planarfriction._support.reading import (
    number,
    read_bytes,
    read_rows,
    read_text,
    width,
)
from planarfriction.errors import FileError, FrictionError, InvalidValueError, shown
from planarfriction.patch.grid import MOST_CELLS
from planarfriction.patch.map_kinds import (
    refuse_named,
    refuse_other_tables,
    remark_offset,
    rim_of,
)

IMAGE_SUFFIXES = (".png", ".tif", ".tiff", ".bmp", ".pgm", ".jpg", ".jpeg")
"""Suffixes of the files that are read as grey images."""

MOST_BYTES = 256_000_000
"""Largest file of a map that is read [bytes]."""

MOST_VALUES = 32_000_000
"""Largest number of pressures in all frames of a map."""

GREY_MODES = ("1", "L", "I", "F", "I;16", "I;16B", "I;16L", "I;16N")
"""Pillow's names for images with one channel of numbers."""

RINGING = 0.1
"""Share of the peak below which cells of a JPEG count as empty: its compression leaves up to 12 % beside an edge at the
usual quality of 75 (1308 cells above it where 1288 were drawn, 1684 above 0)."""

BRIGHT = 0.75
"""Brightness over the largest from which a pixel may be paper."""

PAPER = 0.9
"""Share of such pixels along the rim of an image from which it may be a print."""

INK = 0.5
"""Brightness below which a pixel inside is ink."""

ARRAYS = (".npy", ".npz", ".mat")
"""Suffixes of the files of arrays."""

FEWEST_LABELS = 3
"""Number of consecutive integers from which a row or column may be labels in place of pressures."""


@dataclass(frozen=True)
class MapReading(Checked):
    """Options with which a pressure map is read, from a file or, where they apply, from an array.

    Raises InvalidValueError for a value that breaks its rule.
    """

    header: bool | None = checked(
        validation.instance, bool, "True or False", default=None
    )
    """True: the first row of a CSV file has names, False: pressures; None: names if none of them is a number, or if
    they are 0, 1, 2 ... behind an empty cell."""
    index: bool | None = checked(
        validation.instance, bool, "True or False", default=None
    )
    """True: the first column of a table has labels or times, False: pressures; None: labels if the header is empty
    there, if none of them is a number, or if they ascend and frames of `frame_shape` fill the rows only without them.
    """
    frame_shape: Any = None
    """Rows and columns of a frame, where a file has one frame per row, or frames one below another."""
    frame: int | None = checked(validation.count, 0, default=None)
    """Frame of a file with several, or page of an image, counted from 0; None: the only one."""
    threshold: float | None = checked(validation.non_negative, default=None)
    """Share of the peak up to which cells count as empty [-], < 1; None: 0, and 0.1 for a JPEG."""
    invert: bool | None = checked(
        validation.instance, bool, "True or False", default=None
    )
    """True: dark means pressure, as on a print; False: bright does; None: bright does, and images that look like prints
    are refused."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.frame_shape is not None:
            sides = self.frame_shape
            if not isinstance(sides, Sequence) or len(sides) != 2:
                raise InvalidValueError("frame_shape", "be (rows, columns)", sides)
            sides = tuple(validation.count("frame_shape", side) for side in sides)
            self._set(frame_shape=sides)
        if self.threshold is not None and self.threshold >= 1.0:
            rule = "be < 1, a fraction of the peak"
            raise InvalidValueError("threshold", rule, self.threshold)

    def frame_of(self, what: str, values: np.ndarray | list[np.ndarray]) -> np.ndarray:
        """Return the frame `[rows, columns]` of values `[frames, rows, columns]`, or of any that `frame_shape` divides.

        Raises InvalidValueError for a frame that does not exist or has to be chosen.
        """
        if self.frame_shape is not None and isinstance(values, np.ndarray):
            if values.size == 0 or values.size % math.prod(self.frame_shape):
                rule = f"divide the {values.size} values of {what}"
                raise InvalidValueError("frame_shape", rule, self.frame_shape)
            values = values.reshape(-1, *self.frame_shape)
        several = isinstance(values, list) or values.ndim == 3
        place = self.place(what, len(values) if several else 1)
        return values[place] if several else values  # pyright: ignore[reportReturnType]

    def labelled(self, columns: int, first: Any) -> bool:
        """Return True if the `first` of some columns holds no pressures.

        `index` says so, or else it ascends, or has names, and frames of `frame_shape` fill the rows only without it.
        """
        if self.index is not None or self.frame_shape is None:
            return bool(self.index)
        cells = math.prod(self.frame_shape)
        fits = [
            count > 0 and (count % cells == 0 or count == self.frame_shape[1])
            for count in (columns, columns - 1)
        ]
        return fits == [False, True] and _ascends(first)

    def place(self, what: str, count: int) -> int:
        """Return the index of the frame among `count`. Raises InvalidValueError if there is none, or several."""
        if self.frame is None and count == 1:
            return 0
        if self.frame is None or self.frame >= count:
            rule = f"be one of the {count} frames of {what}, 0 to {count - 1}"
            raise InvalidValueError("frame", rule, self.frame)
        return self.frame

    def pressures(self, what: str, values: np.ndarray, kind: str = "") -> np.ndarray:
        """Return pressures `[rows, columns]` >= 0 of read values, inverted and with empty cells as asked for.

        Raises FileError for an image (by its suffix, `kind`) that may be a print, unless `invert` is given.
        """
        if not (values.size and np.isfinite(values).all()):
            return values
        if self.invert is None and kind in IMAGE_SUFFIXES and _is_print(values):
            text = "its rim is bright, its inside dark: ink on paper (invert = true) or pressure (invert = false)?"
            raise FileError(f"{what}: {text}")
        if self.invert:
            paper = np.median(rim_of(values)) if _is_print(values) else values.max()
            values = np.maximum(paper - values, 0.0)
        share = self.threshold
        if share is None:
            share = RINGING if kind in (".jpg", ".jpeg") else 0.0
        empty = (values > 0.0) & (values <= share * values.max())
        if self.threshold is None and empty.any():
            text = f"{empty.sum()} of {(values > 0.0).sum()} cells, up to {share:g} of the peak, count as empty"
            text += ", as JPEG leaves traces there; threshold sets the share"
            warnings.warn(f"{what}: {text}", stacklevel=5)
        return np.where(empty, 0.0, values)


def map_reading(options: Mapping[str, Any]) -> MapReading:
    """Return the options of a map by their names. Raises InvalidValueError for other names and wrong values."""
    validation.keys(
        "pressure map", options, required=(), optional=MapReading.__dataclass_fields__
    )
    return MapReading(**options)


def read_pressure_map(path: str | Path, **options: Any) -> np.ndarray:
    """Read a map of relative pressures, shape `[rows, columns]`, row 0 at the top; `options` are those of `MapReading`.

    The suffix determines the format: `.csv` (numbers separated by commas, lines that begin with # are skipped; blank
    lines or repeated headers part frames), `.npy`, `.npz` and `.mat` (an array, or `[frames, rows, columns]`, in `.mat`
    `[rows, columns, frames]`), `.asf` (Tekscan ASCII, also as `.csv`; B is empty), or a grey image (brightness is
    pressure, black is none).

    Raises FileError for a missing file, an unknown format, and content that is not what the suffix says;
    InvalidValueError for an option that breaks its rule, or has to be given.
    """
    path = validation.path("path", path)
    reading = map_reading(options)
    readers: dict[str, Any] = {
        ".csv": _read_csv, ".npy": _read_npy, ".npz": _read_npz, ".mat": _read_mat, ".asf": _read_tekscan,
        **dict.fromkeys(IMAGE_SUFFIXES, _read_image),
    }  # fmt: skip
    kind = path.suffix.lower()
    if kind not in readers:
        tables = ".csv, .npy, .npz, .mat, .asf"
        images = ", ".join(IMAGE_SUFFIXES)
        raise FileError(
            f"pressure map {path}: unknown kind {path.suffix!r}, use {tables} or a grey image ({images})"
        )
    what = f"pressure map {path}"
    try:
        # What is no number, or too large for a float, no patch takes.
        with np.errstate(all="ignore"):
            values = readers[kind](path, reading)
            if kind not in IMAGE_SUFFIXES:
                if getattr(values, "ndim", 0) == 2:
                    if kind in ARRAYS and reading.labelled(
                        values.shape[1], values[:, 0]
                    ):
                        values = values[:, 1:]
                    if reading.frame_shape is None:
                        refuse_other_tables(what, values, reading.index)
                values = reading.frame_of(what, values)
            _check_size(path, values.size)
            values = reading.pressures(what, values, kind)
            if reading.threshold is None and not reading.invert:
                remark_offset(what, values)
            return values
    except (FrictionError, UserWarning):
        raise
    # Pillow reports a broken PNG as SyntaxError, and other things as what they are in its own code.
    except Exception as error:
        reason = shown(" ".join(str(error).split())) or type(error).__name__
        raise FileError(f"{what}: not a readable {kind} file ({reason})") from None


# ---------------------------------------------------------------------- tables


def _read_csv(path: Path, reading: MapReading) -> np.ndarray | list[np.ndarray]:
    """Read a table, or as many frames as blank lines or repeated headers part."""
    what = f"pressure map {path}"
    rows = read_rows(path, "a pressure map")
    line, names = next(rows, (0, []))
    names = names[: width(names)]
    if names and names[0].startswith("DATA_TYPE"):
        return _read_tekscan(path, reading)
    corner = bool(names) and _is_name(names[0]) and _are_labels(names[1:])
    header = reading.header
    if header is None:
        header = corner or (all(map(_is_name, names)) and any(names))
        if not header and _are_labels(names, FEWEST_LABELS):
            raise FileError(_ambiguous(what, "row", names, "header"))
    rows = rows if header or not names else itertools.chain([(line, names)], rows)
    first = []
    values = array("d")
    blocks = [0]
    last = None
    for line, row in rows:
        cells = row if len(row) == len(names) else row[: width(row)]
        if (header and cells == names) or (last is not None and line != last + 1):
            blocks.append(0)
        last = line
        if header and cells == names:
            continue
        if len(cells) != len(names):
            raise FileError(
                f"{what}: line {line} has {len(cells)} values, the first row has {len(names)}"
            )
        blocks[-1] += 1
        first.append((line, cells[0]))
        values.extend(
            number(what, line, f"value {i}", cell)
            for i, cell in enumerate(cells[1:], 2)
        )
        if len(values) + len(first) > MOST_VALUES:
            raise FileError(f"{what}: has more than {MOST_VALUES} values")
    if not first:
        raise FileError(f"{what}: the file holds no numbers")
    table = np.array(values).reshape(len(first), -1)
    labels = [cell for _, cell in first]
    index = reading.labelled(len(names), labels)
    if reading.index is None:
        if reading.frame_shape is None and header:
            refuse_named(what, names)
        named = header and names[0] in ("", "index", "Unnamed: 0")
        index = index or corner or named or all(map(_is_name, labels))
        if not index and len(names) > 1 and _are_labels(labels, FEWEST_LABELS):
            raise FileError(_ambiguous(what, "column", labels, "index"))
    if not index:
        column = [number(what, line, "value 1", cell) for line, cell in first]
        table = np.column_stack([column, table])
    if reading.frame_shape is not None:
        return table
    return _frames(what, table, [count for count in blocks if count], reading.frame)


def _frames(
    what: str, table: np.ndarray, blocks: Sequence[int], frame: int | None
) -> np.ndarray | list[np.ndarray]:
    """Return the frames of a table whose blocks of rows are parted by blank lines, or a single one as it is."""
    # A blank line behind every row, as Windows writes it, parts nothing.
    if max(blocks) == 1 or len(blocks) == 1:
        return table
    if len(set(blocks)) > 1 and frame is None:
        sizes = ", ".join(map(str, blocks[:5]))
        raise FileError(
            f"{what}: blank lines part it into blocks of {sizes} rows: choose one by frame, or join them"
        )
    return np.split(table, np.cumsum(blocks)[:-1])


def _ambiguous(what: str, place: str, cells: Sequence[str], option: str) -> str:
    labels = f"{', '.join(cells[:3])}{', ...' if len(cells) > 3 else ''}"
    return f"{what}: the first {place} is {labels}: labels ({option} = true) or pressures ({option} = false)?"


def _is_name(cell: str) -> bool:
    """Return True if a cell is empty or begins with a letter and is no number such as nan."""
    try:
        float(cell)
    except ValueError:
        return not cell or cell[0].isalpha()
    return False


def _are_labels(cells: Sequence[str], fewest: int = 1) -> bool:
    """Return True if cells, at least so many, are consecutive integers from 0 or 1."""
    first = 0 if "0" in cells[:1] else 1
    labels = [str(first + i) for i in range(len(cells))]
    return len(cells) >= fewest and list(cells) == labels


def _ascends(cells: Any) -> bool:
    """Return True if cells are numbers that ascend, as times do, or are no numbers."""
    try:
        return bool((np.diff(np.array(cells, float)) > 0.0).all())
    except ValueError:
        return True


def _read_tekscan(path: Path, _: MapReading) -> np.ndarray:
    """Read the frames of a Tekscan ASCII export, in which B stands for places without a sensor."""
    mark, body = read_text(path, "a pressure map").partition("ASCII_DATA")[1:]
    if not mark:
        raise FileError(
            f"pressure map {path}: has no ASCII_DATA, as Tekscan exports have"
        )
    frames: list[list[list[float]]] = []
    for line in map(str.strip, body.splitlines()[1:]):
        if line.lower().startswith("frame") or (line and not frames and line != "@@"):
            frames.append([])
        if line and line != "@@" and not line.lower().startswith("frame"):
            cells = map(str.strip, line.split(","))
            frames[-1].append([0.0 if cell == "B" else float(cell) for cell in cells])
    if not any(frames):
        raise FileError(f"pressure map {path}: the file holds no numbers")
    return np.array(frames)


# ---------------------------------------------------------------------- arrays


def _read_npy(path: Path, _: MapReading) -> np.ndarray:
    return _array(path, read_bytes(path, "a pressure map", MOST_BYTES))


def _array(path: Path, content: bytes) -> np.ndarray:
    with warnings.catch_warnings():
        # Of a damaged header, which NumPy reads as source code.
        warnings.simplefilter("error")
        try:
            values = np.load(io.BytesIO(content), allow_pickle=False)
        except Warning as warning:
            raise FileError(
                f"pressure map {path}: not a readable {path.suffix} file ({warning})"
            ) from None
    return _real(path, values)


def _read_npz(path: Path, _: MapReading) -> np.ndarray:
    content = io.BytesIO(read_bytes(path, "a pressure map", MOST_BYTES))
    with zipfile.ZipFile(content) as archive:
        name = _only(path, archive.namelist())
        if archive.getinfo(name).file_size > MOST_BYTES:
            raise FileError(
                f"pressure map {path}: its array is larger than {MOST_BYTES / 1e6:g} MB"
            )
        return _array(path, archive.read(name))


def _read_mat(path: Path, _: MapReading) -> np.ndarray:
    from scipy.io import loadmat, whosmat

    content = io.BytesIO(read_bytes(path, "a pressure map", MOST_BYTES))
    sizes = {
        name: size
        for name, shape, _ in whosmat(content)
        if (size := math.prod(shape)) > 1
    }
    name = _only(path, list(sizes))
    if sizes[name] > MOST_VALUES:
        raise FileError(f"pressure map {path}: has more than {MOST_VALUES} values")
    values = _real(path, loadmat(content, variable_names=[name])[name])
    return np.moveaxis(values, -1, 0) if values.ndim == 3 else values


def _only(path: Path, names: Sequence[str]) -> str:
    if len(names) != 1:
        found = shown(", ".join(names)) or "none"
        text = (
            f"the file must hold one array, it has {found}: read it, and pass the array"
        )
        raise FileError(f"pressure map {path}: {text}")
    return names[0]


def _real(path: Path, values: Any) -> np.ndarray:
    if not isinstance(values, np.ndarray) or values.dtype.kind not in "biuf":
        raise FileError(
            f"pressure map {path}: the file must hold one array of real numbers"
        )
    return values.astype(float)


# ---------------------------------------------------------------------- images


def _read_image(path: Path, reading: MapReading) -> np.ndarray:
    from PIL import Image

    what = f"pressure map {path}"
    with (
        warnings.catch_warnings(),
        Image.open(io.BytesIO(read_bytes(path, "a pressure map", MOST_BYTES))) as image,
    ):
        warnings.simplefilter("error", Image.DecompressionBombWarning)
        pages = getattr(image, "n_frames", 1)
        page = reading.place(what, pages)
        if pages > 1:
            image.seek(page)
        _check_size(path, math.prod(image.size))
        if image.mode in GREY_MODES:
            return np.asarray(image, dtype=float)
        colours = np.asarray(image.convert("RGBA"), dtype=float)
    red, green, blue, alpha = np.moveaxis(colours, -1, 0)
    if not ((red == green).all() and (red == blue).all()):
        text = "this is a colour image; if its brightness means pressure, save it in grey (in Pillow: convert('L'))"
        raise FileError(f"{what}: {text}")
    if not (alpha == 255).all():
        raise FileError(
            f"{what}: the image is partly transparent; save it without transparency"
        )
    return red


def _is_print(values: np.ndarray) -> bool:
    """Return True if the rim of an image is bright and some of its inside dark, as of dark on paper."""
    peak = values.max()
    return bool(
        np.mean(rim_of(values) >= BRIGHT * peak) >= PAPER
        and (values < INK * peak).any()
    )


def _check_size(path: Path, cells: int) -> None:
    """Raise, before memory is asked for, where a map has more cells than a patch may have."""
    if cells > MOST_CELLS:
        raise FileError(
            f"pressure map {path}: has more than {MOST_CELLS} cells, the maximum for a patch"
        )
