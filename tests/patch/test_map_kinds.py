"""Forms of files of pressure maps and logs: what each gives, or the line that refuses it with its remedy."""

from __future__ import annotations

import io
import warnings

import numpy as np
import pytest
from scipy.io import savemat

import planarfriction as pf
from planarfriction._support.reading import Table
from planarfriction.errors import FileError
from planarfriction.patch import map_kinds
from tests.support.refusals import refused

MAP = np.array([[0.0, 0.0, 0.0], [0.0, 5.0, 2.5], [0.0, 7.0, 0.0]])
ROWS = "0,0,0\n0,5,2.5\n0,7,0\n"
LOG = np.array([[0.0, 1.5], [0.1, 2.5]])

Y, X = np.mgrid[:6, :8]
PAD = np.clip(7.0 - (X - 3.5) ** 2 - (Y - 2.5) ** 2, 0.0, None)
"""A round pad on 6 x 8 taxels."""

TIME = 0.01 * np.arange(40)
LOAD = np.sin(0.5 + 3.0 * TIME)
NOISE = np.random.default_rng(0).normal(size=(40, 48))
FRAMES = np.clip(LOAD[:, None] * PAD.ravel() + 0.1 * NOISE, 0.0, None)
"""A grip in time: a row of 48 taxels for each sample."""

AWAY = [
    (X - 3.5 - 2.5 * np.cos(6.0 * t)) ** 2 + (Y - 2.5 - 1.5 * np.sin(4.0 * t)) ** 2
    for t in TIME
]
MOVING = np.clip(4.0 - np.reshape(AWAY, (40, 48)) + 0.1 * NOISE, 0.0, None)
"""A pad that rolls over the sensor."""

PLACES = np.column_stack([0.25 * X.ravel(), 0.3 * Y.ravel(), PAD.ravel()])
OFFSET = 100.0 + 20.0 * PAD + NOISE[:6, :8]
WAVES = np.sin(0.3 + 0.2 * np.arange(12))[:, None] * (np.arange(14) % 4 < 2)


def csv(values, head=""):
    """Return a table as NumPy writes it, below a header."""
    file = io.StringIO(head)
    file.seek(0, io.SEEK_END)
    np.savetxt(file, values, "%.9g", ",")
    return file.getvalue()


def numbered(name, count, first=""):
    """Return a header with numbered names."""
    return (
        ",".join([*([first] if first else []), *(f"{name}{i}" for i in range(count))])
        + "\n"
    )


def saved(kind, values):
    """Return the bytes of a file of an array."""
    file = io.BytesIO()
    {
        "npy": np.save,
        "npz": np.savez_compressed,
        "mat": lambda file, p: savemat(file, {"p": p}),
    }[kind](file, values)
    return file.getvalue()


LABELS, LIST, SHAPE = (
    "labels (index = true)",
    "make it a table with a row for each y",
    "frame_shape",
)
MANY, DIGITS, CELLS = (
    "write thousands without",
    "write the digits 0 to 9",
    "part cells by commas",
)
FORMS = {  # what the file is: its kind, its content, options, and what it gives
    "commas": ("csv", ROWS, {}, MAP),
    "semicolons": ("csv", ROWS.replace(",", ";"), {}, MAP),
    "decimal commas": ("csv", "0;0;0\n0;5;2,5\n0;7;0\n", {}, MAP),
    "tabs": ("csv", ROWS.replace(",", "\t"), {}, MAP),
    "spaces around": ("csv", ROWS.replace(",", " , "), {}, MAP),
    "quotes": ("csv", '"0","0","0"\n"0","5","2.5"\n"0","7","0"\n', {}, MAP),
    "exponents": ("csv", "0e0,0,-0\n0,.5e1,25E-1\n0,+7.,0\n", {}, MAP),
    "lines of Windows": ("csv", ROWS.replace("\n", "\r\n"), {}, MAP),
    "lines of old Macs": ("csv", ROWS.replace("\n", "\r"), {}, MAP),
    "no last line end": ("csv", ROWS.rstrip(), {}, MAP),
    "remarks": ("csv", f"# kPa\n{ROWS}# end\n", {}, MAP),
    "UTF-8 with its mark": ("csv", ROWS.encode("utf-8-sig"), {}, MAP),
    "UTF-16": ("csv", ROWS.encode("utf-16"), {}, MAP),
    "UTF-16, other order": ("csv", b"\xfe\xff" + ROWS.encode("utf-16-be"), {}, MAP),
    "UTF-16 without its mark": (
        "csv",
        ROWS.encode("utf-16-le"),
        {},
        "save it as UTF-8",
    ),
    "letters of Latin-1": (
        "csv",
        "# \xb5bar\n".encode("latin-1") + ROWS.encode(),
        {},
        "save it as UTF-8",
    ),
    "commas at line ends": ("csv", ROWS.replace("\n", ",\n"), {}, MAP),
    "semicolons at line ends": (
        "csv",
        ROWS.replace(",", ";").replace("\n", ";\n"),
        {},
        MAP,
    ),
    "commas at some line ends": ("csv", ROWS.replace("5\n", "5,\n"), {}, MAP),
    "sep= of Excel": ("csv", "sep=;\n" + ROWS.replace(",", ";"), {}, MAP),
    "spaces between": ("csv", ROWS.replace(",", " "), {}, CELLS),
    "bars between": ("csv", ROWS.replace(",", "|"), {}, "is not a number"),
    "underscores": ("csv", "1_000,2\n3,4\n", {}, MANY),
    "thousands": ("csv", '"1,000",2\n3,4\n', {}, MANY),
    "thousands and points": ("csv", "1,000.5;2\n3;4\n", {}, MANY),
    "other digits": ("csv", "\u0661,2\n3,4\n", {}, DIGITS),
    "hexadecimal": ("csv", "0x10,2\n3,4\n", {}, "'0x10' is not a number"),
    "beyond all pressures": ("csv", "1e308,2\n3,4\n", {}, "beyond 1e+50"),
    "no number": ("csv", "nan,2\n3,4\n", {}, "is not finite"),
    "an empty cell": ("csv", "1,2\n,4\n", {}, "line 2, value 1: '' is not a number"),
    "a short row": ("csv", "1,2\n3\n", {}, "line 2 has 1 values, the first row has 2"),
    "letters above": ("csv", "a,b,c\n" + ROWS, {}, MAP),
    "labels of pandas": ("csv", ",0,1,2\n0,0,0,0\n1,0,5,2.5\n2,0,7,0\n", {}, MAP),
    "letters beside": ("csv", "a,0,0,0\nb,0,5,2.5\nc,0,7,0\n", {}, MAP),
    "numbers beside": ("csv", "0,5\n1,6\n2,7\n", {}, LABELS),
    "numbers above": ("csv", "0,1,2\n5,6,7\n", {}, "labels (header = true)"),
    "a column of time": ("csv", csv(np.column_stack([TIME, FRAMES])), {}, LABELS),
    "a column of time, a ramp": (
        "csv",
        csv(np.outer(TIME, [1.0, *PAD.ravel()])),
        {},
        LABELS,
    ),
    "time that does not begin at 0": (
        "csv",
        csv(np.column_stack([17.3 + TIME, FRAMES])),
        {},
        LABELS,
    ),
    "time of an uneven clock": (
        "csv",
        csv(np.column_stack([TIME + 3e-4 * NOISE[:, 0], FRAMES])),
        {},
        LABELS,
    ),
    "time with its name": (
        "csv",
        csv(np.c_[TIME, FRAMES], numbered("p", 48, "Time [s]")),
        {},
        SHAPE,
    ),
    "time and the shape": (
        "csv",
        csv(np.c_[TIME, FRAMES]),
        {"frame_shape": (6, 8), "frame": 7},
        FRAMES[7],
    ),
    "time that is no pressure": (
        "csv",
        csv(np.c_[TIME[:9], PAD.ravel()[:9]]),
        {"index": True},
        PAD.ravel()[:9],
    ),
    "heights beside": (
        "csv",
        csv(np.column_stack([2.5 - 0.5 * np.arange(6), PAD])),
        {},
        LABELS,
    ),
    "heights beside, told": (
        "csv",
        csv(np.column_stack([2.5 - 0.5 * np.arange(6), PAD])),
        {"index": True},
        PAD,
    ),
    "frames in rows": ("csv", csv(FRAMES), {}, SHAPE),
    "frames in rows, named": ("csv", csv(FRAMES, numbered("taxel", 48)), {}, SHAPE),
    "frames in rows and the shape": (
        "csv",
        csv(FRAMES),
        {"frame_shape": (6, 8), "frame": 7},
        FRAMES[7],
    ),
    "frames whose pattern moves": ("csv", csv(MOVING), {}, SHAPE),
    "frames whose pattern moves above an offset": (
        "npy",
        saved("npy", 100.0 + MOVING),
        {},
        SHAPE,
    ),
    "frames whose pattern moves, with time": (
        "csv",
        csv(np.column_stack([TIME, MOVING])),
        {},
        LABELS,
    ),
    "frames whose pattern moves and the shape": (
        "csv",
        csv(MOVING),
        {"frame_shape": (6, 8), "frame": 7},
        MOVING[7],
    ),
    "frames in an array": ("npy", saved("npy", FRAMES), {}, SHAPE),
    "time in an array": ("npz", saved("npz", np.c_[TIME, FRAMES]), {}, LABELS),
    "time in an array, told": (
        "mat",
        saved("mat", np.c_[TIME[:6], PAD]),
        {"index": True},
        PAD,
    ),
    "a list": ("csv", csv(PLACES), {}, LIST),
    "a list with names": ("csv", csv(PLACES[:5], "x [mm],y [mm],kPa\n"), {}, LIST),
    "a list with numbers": (
        "csv",
        csv(np.c_[np.arange(48), PLACES], ",X,Y,p\n"),
        {},
        LIST,
    ),
    "a list of what is loaded": ("csv", csv(PLACES[PLACES[:, 2] > 0.0]), {}, LIST),
    "a list by columns": (
        "csv",
        csv(PLACES.reshape(6, 8, 3).swapaxes(0, 1).reshape(48, 3)),
        {},
        LIST,
    ),
    "a list, pressures first": ("csv", csv(PLACES[:, [2, 0, 1]]), {}, LIST),
    "a list in an array": ("npy", saved("npy", PLACES), {}, LIST),
    "an offset": ("csv", csv(OFFSET), {}, "its rim is flat at 100"),
    "an offset in an array": (
        "npy",
        saved("npy", OFFSET),
        {},
        "leave out such cells by threshold",
    ),
    "an offset, told": (
        "csv",
        csv(np.round(OFFSET)),
        {"threshold": 0.5},
        np.where(PAD > 1.5, np.round(OFFSET), 0.0),
    ),
    "a log": ("log", csv(LOG, "time,fx\n"), {}, LOG),
    "a log with units below": (
        "log",
        csv(LOG, "time,fx\ns,N\n"),
        {"names": ("time [s]", "fx [N]")},
        LOG,
    ),
    "a log in UTF-16": ("log", csv(LOG, "time,fx\n").encode("utf-16"), {}, LOG),
    "a log, commas at its line ends": (
        "log",
        csv(LOG, "time,fx\n").replace("\n", ",\n"),
        {},
        LOG,
    ),
    "a log, commas below its header": ("log", "time,fx\n0,1.5,\n.1,2.5,\n", {}, LOG),
    "a log, a comma in its header": ("log", "time,fx,\n0,1.5\n.1,2.5\n", {}, LOG),
    "a log, sep=": ("log", "sep=;\ntime;fx\n0;1,5\n,1;2,5\n", {}, LOG),
    "a log, underscores": ("log", "time,fx\n0,1_000\n", {}, MANY),
    "a log, numbers beyond all": ("log", "time,fx\n0,1e308\n", {}, "beyond 1e+50"),
    "a log, spaces between": (
        "log",
        "time,fx\n0 1\n",
        {},
        "line 2 has 1 columns, the header has 2",
    ),
}
"""What the file is: its kind, content and options, and the values that it gives or words of what it is told."""


@pytest.mark.parametrize("form", FORMS)
def test_forms_of_files(tmp_path, form):
    kind, content, options, given = FORMS[form]
    path = tmp_path / f"file.{'csv' if kind == 'log' else kind}"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    if isinstance(given, str):
        with pytest.raises((FileError, UserWarning)) as caught:  # warnings are errors
            read(kind, path, **options)
        assert (
            given in str(caught.value)
            and "\n" not in str(caught.value)
            and "file." in str(caught.value)
        )
    else:
        found = read(kind, path, **options)
        # Nine digits are written.
        np.testing.assert_allclose(found, given.reshape(found.shape), rtol=1e-8)


def read(kind, path, names=("time", "fx"), **options):
    return (
        Table(path).numbers(names)
        if kind == "log"
        else pf.patch.read_pressure_map(path, **options)
    )


# ---------------------------------------------------------------------- maps that are none of these

ROUND = [np.hypot(X - 3.5, Y - 2.5) < radius for radius in (1.2, 2.2, 3.0)]
FINGERS = sum(np.clip(1.0 - (np.mgrid[:20, :60][1] - c) ** 2 / 25 - (np.mgrid[:20, :60][0] - 10) ** 2 / 64, 0, None)
              for c in (8, 22, 37, 51))  # fmt: skip
RIBS = np.mgrid[:30, :60][1] % 10 < 6
MAPS = {
    "a uniform pad": np.ones((6, 8)),
    "a noisy uniform pad": 1.0 + 0.05 * NOISE[:6, :8],
    "a gradient along x and y": 10.0 + X + 2.0 * Y,
    "a column that rises": np.array(
        [[1, 5, 5], [2, 4, 6], [4, 4, 5], [9, 6, 6], [9.5, 5, 4]]
    ),
    "discs": ROUND[1],
    "a smooth pad": PAD,
    "a pad that ends outside": PAD + 0.2 * X,
    "studs": (X % 3 < 1) * (Y % 3 < 1),
    "ribs": np.tile(np.arange(14) % 4 < 2, (9, 1)),
    "four fingers": FINGERS,
    "four fingers of one pressure": FINGERS > 0.0,
    "three columns of counts": np.random.default_rng(1).integers(0, 6, (20, 3)),
    "fingers of a hand": FINGERS[:, :56]
    * (np.abs(np.mgrid[:20, :56][0] - 11) < 6 + 2 * (np.mgrid[:20, :56][1] // 28)),
    "oblique grooves": (np.mgrid[:20, :48][0] + np.mgrid[:20, :48][1]) % 8 < 4,
    "ribs of a tyre": RIBS
    * (np.abs(np.mgrid[:30, :60][0] - 15) < 12 - np.mgrid[:30, :60][1] / 10),
    "a strip": np.array([[3.0, 5.0, 4.0, 4.0, 9.0, 1.0, 0.0, 2.0]]),
}
"""Maps as sensors and formulas give them."""


@pytest.mark.parametrize("name", MAPS)
def test_maps_are_taken_without_a_question(tmp_path, name):
    given = np.asarray(MAPS[name], float)
    for kind, content in {
        "csv": csv(given).encode(),
        "npy": saved("npy", given),
    }.items():
        (tmp_path / f"map.{kind}").write_bytes(content)
        found = pf.patch.read_pressure_map(tmp_path / f"map.{kind}")
        np.testing.assert_allclose(found, given, rtol=1e-8)


def test_random_maps_are_no_other_tables():
    """Counts, bytes, levels and masks of any shape: chance makes none of 2000 a list, a clock or frames."""
    rng = np.random.default_rng(0)
    for i in range(2000):
        rows, columns = rng.integers(1, 20, 2)
        table = rng.integers(0, (1000, 256, 4, 2)[i % 4], (rows, columns)).astype(float)
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            map_kinds.refuse_other_tables("map", table, None)


def test_one_frame_of_its_own_shape_is_a_map(tmp_path):
    """Ribs that bear more in the middle of their length read like frames; the shape settles it."""
    (tmp_path / "ribs.csv").write_text(csv(WAVES))
    with refused(r"one map \(frame_shape = \[12, 14\]\)", FileError):
        pf.patch.read_pressure_map(tmp_path / "ribs.csv")
    found = pf.patch.read_pressure_map(tmp_path / "ribs.csv", frame_shape=(12, 14))
    np.testing.assert_allclose(found, WAVES, rtol=1e-8)
