"""Files that are read: CSV as others write it, and what is no file, too large or damaged gets one line at once."""

import os
import subprocess
import sys
import tracemalloc

import numpy as np
import pytest
from PIL import Image

import planarfriction as pf
from planarfriction import FrictionError, Scene, Signal
from planarfriction._support import reading
from planarfriction.errors import FileError
from planarfriction.identify import Log
from planarfriction.patch import map_files as patch_files
from planarfriction.patch import read_pressure_map
from tests.support.refusals import refusal as one_line
from tests.support.refusals import refused

NOISE = np.random.default_rng(0).bytes(300)

READERS = {
    "scene.toml": Scene.from_file,
    "scene.json": Scene.from_file,
    "load.csv": Signal.from_csv,
    "log.csv": Log.from_csv,
    "map.csv": read_pressure_map,
    "map.npy": read_pressure_map,
    "map.png": read_pressure_map,
    "run.nc": pf.Solution.load,
}
"""A file of each kind, and what reads it."""


# ---------------------------------------------------------------------- what is no file


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="pipes and devices of POSIX")
@pytest.mark.parametrize("name", READERS)
def test_what_is_no_file_is_said_at_once(tmp_path, name):
    path = tmp_path / name
    assert "no such file" in one_line(READERS[name], path)
    path.mkdir()
    assert "is a folder" in one_line(READERS[name], path)
    path.rmdir()
    os.mkfifo(path)  # opening it would wait for somebody who writes to it
    assert "is a device or a pipe" in one_line(READERS[name], path)
    path.unlink()
    path.symlink_to("/dev/zero")
    assert "is a device or a pipe" in one_line(READERS[name], path)
    path.unlink()
    path.symlink_to(path)
    assert "cannot be read" in one_line(READERS[name], path)
    assert "cannot be read" in one_line(READERS[name], tmp_path / f"a\0b{path.suffix}")


@pytest.mark.parametrize("name", READERS)
@pytest.mark.parametrize(
    "content", [b"", NOISE, b"\xff\xfe\x00", b"a,b\n1,c\n", b"[" * 20_000, b"\0" * 100]
)
def test_files_of_another_kind_get_one_line(tmp_path, name, content):
    (tmp_path / name).write_bytes(content)
    assert name in one_line(READERS[name], tmp_path / name)


def test_what_a_shell_pipes_is_read(tmp_path):
    rows = "".join(f"{0.01 * i},0,0,0,0,0,0,1\n" for i in range(20))
    text = f"t,vx,vy,omega,fx,fy,tau,normal_force\n{rows}"
    code = "import sys; from planarfriction.identify import Log; print(len(Log.from_csv('/dev/stdin').time))"
    done = subprocess.run(
        [sys.executable, "-c", code],
        input=text,
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout == "20\n"


# ---------------------------------------------------------------------- what is too large


def test_text_files_have_a_largest_size(tmp_path):
    for name, most in (
        ("scene.toml", 256),
        ("load.csv", 4000),
        ("log.csv", 4000),
        ("map.csv", 256),
    ):
        with (tmp_path / name).open("wb") as file:
            file.truncate(1 << 40)  # sparse: takes no place, and no memory holds it
        assert f"is larger than {most} MB, the most that is read" in one_line(
            READERS[name], tmp_path / name
        )


def test_a_line_without_end_is_not_read_to_its_end(tmp_path, monkeypatch):
    monkeypatch.setattr(reading, "MOST_TEXT", 1000)
    (tmp_path / "log.csv").write_text(2000 * "t")
    assert "is larger than 4000 MB" in one_line(
        READERS["log.csv"], tmp_path / "log.csv"
    )


@pytest.mark.parametrize("at_once", [1, 2, 3, 1000])
@pytest.mark.parametrize(
    "text",
    [
        "# a;remark\na,b,c\n1,2,3\n4,5,6\n7,8,9\n",
        "a,b,c\r\n1,2,3\r\n\r\n# remark, \r\n4,5,6\r\n7,8,9\r\n",
        'a,b,c\n1,2,3\n4,"5\n\n",6\n"7",8,9',
        "a;b;c\n1;2,0;3\n4;5;6\n7;8;9\n",
        "a\tb\tc\n1\t 2\t3\n4\t5\t6\n7\t8\t9e0\n",
    ],
)
def test_tables_are_read_the_same_in_blocks_of_any_size(
    tmp_path, monkeypatch, text, at_once
):
    monkeypatch.setattr(reading, "AT_ONCE", at_once)
    (tmp_path / "t.csv").write_bytes(text.encode())
    found = reading.Table(tmp_path / "t.csv").numbers(["c", "b"])
    assert found.tolist() == [[3.0, 2.0], [6.0, 5.0], [9.0, 8.0]]


@pytest.mark.parametrize("at_once", [2, 1000])
@pytest.mark.parametrize(
    ("row", "words"),
    [
        ("x,2", "line 4, column 'a': 'x' is not a number"),
        ("1,2,3", "line 4 has 3 columns"),
        ("inf,2", "is not finite"),
    ],
)
def test_what_is_wrong_in_a_block_is_named(tmp_path, monkeypatch, row, words, at_once):
    monkeypatch.setattr(reading, "AT_ONCE", at_once)
    (tmp_path / "t.csv").write_text(f"a,b\n1,2\n3,4\n{row}\n")
    assert words in one_line(
        lambda path: reading.Table(path).numbers(["a", "b"]), tmp_path / "t.csv"
    )


def test_a_table_is_read_in_little_more_memory_than_its_numbers(tmp_path):
    """Its numbers, the block that is parsed, and what a growing array has in reserve: less than the text."""
    (tmp_path / "t.csv").write_text(
        "a,b\n" + 300_000 * "1.000000001,2.000000000000001\n"
    )
    tracemalloc.start()
    found = reading.Table(tmp_path / "t.csv").numbers(["a", "b"])
    most = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert most < 1.3 * found.nbytes + reading.AT_ONCE * 400


def test_pipes_have_a_largest_size():
    code = (
        "from planarfriction._support import reading\n"
        "reading.MOST_TEXT = 100_000\n"
        "reading.read_text('/dev/stdin', 'a text')"
    )
    done = subprocess.run(
        [sys.executable, "-c", code],
        input=100_001 * "a",
        capture_output=True,
        text=True,
    )
    assert (
        "FileError: /dev/stdin: is larger than 0.1 MB, the most that is read as a text"
        in done.stderr
    )


def test_maps_have_a_largest_size(tmp_path, monkeypatch):
    monkeypatch.setattr(patch_files, "MOST_CELLS", 99)
    np.save(tmp_path / "map.npy", np.ones((10, 10), dtype=np.int8))
    Image.new("L", (10, 10), 1).save(tmp_path / "map.png")
    (tmp_path / "map.csv").write_text(10 * (",".join(10 * "1") + "\n"))
    for name in ("map.npy", "map.png", "map.csv"):
        assert f"{name}: has more than 99 cells" in one_line(
            read_pressure_map, tmp_path / name
        )


def test_huge_pictures_are_refused_before_memory_is_asked_for(tmp_path):
    """A few kilobytes that say 20,000 x 20,000 points: Pillow would raise an error of its own, or take 3 GB."""
    for side in (3_000, 10_000, 20_000):
        Image.new("1", (side, side)).save(tmp_path / "map.png")
        assert "map.png: " in one_line(read_pressure_map, tmp_path / "map.png")


def test_arrays_that_claim_more_than_they_hold(tmp_path):
    np.save(tmp_path / "map.npy", np.ones((2, 2)))
    content = (tmp_path / "map.npy").read_bytes()
    for shape in (b"(999999, 999999)", b"(9999999999999, 9999999999999)"):
        changed = content.replace(b"(2, 2)", shape, 1).replace(
            b" " * (len(shape) - 6), b"", 1
        )
        (tmp_path / "map.npy").write_bytes(changed)
        assert "not a readable .npy file" in one_line(
            read_pressure_map, tmp_path / "map.npy"
        )


# ---------------------------------------------------------------------- CSV as others write it


def table(tmp_path, text):
    (tmp_path / "table.csv").write_bytes(text.encode())
    return reading.Table(tmp_path / "table.csv")


def test_quotes_comments_empty_lines_and_line_ends(tmp_path):
    text = (
        '\ufeff# made by a logger, "unit\r\n\r\n'
        '"t","two\nlines",note\r\n'
        '0,"1",plain\r\n'
        "  # half-way\r\n"
        '1,2,"a ""quoted"" note\r\n# over three lines\r\n, with a comma"\r\n'
        "2,3,\n"
    )
    read = table(tmp_path, text)
    assert read.names == ["t", "two\nlines", "note"]
    assert read.numbers(["two\nlines", "t"]).tolist() == [
        [1.0, 0.0],
        [2.0, 1.0],
        [3.0, 2.0],
    ]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("a,a\n1,2\n", "line 1 has two columns 'a'"),
        ("# x\n\n a , a\n1,2\n", "line 3 has two columns 'a'"),
        ('a,b\n1,"2\n', "line 2 is not CSV: unexpected end of data"),
        ('a,b\n1,"2"3\n', "line 2 is not CSV"),
        (
            f"a,b\n1,{200_000 * '7'}\n",
            "line 2 is not CSV: field larger than field limit",
        ),
        (f"a,b\n1,{1000 * 'x'}\n", "xxx... is not a number"),
        ('a,b\n1,"2\n2"\n', r"line 2, column 'b': '2\n2' is not a number"),
        ("a,b\n1,2\n\n1,inf\n", "line 4, column 'b': 'inf' is not finite"),
        (f"a,b\n1,{5000 * '9'}\n", "is not finite"),
        ("a,b\n1,2,3\n", "line 2 has 3 columns, the header has 2"),
        ("a,c\n1,2\n", "no column 'b' (valid: a, c)"),
        ("a,b\n", "no rows"),
        ("# nothing\n", "is empty"),
        ("a,b\n1,\0\n", "not a text file"),
    ],
)
def test_bad_tables_get_one_line(tmp_path, text, words):
    message = one_line(lambda: table(tmp_path, text).numbers(["a", "b"]))
    assert words in message and str(tmp_path) in message
    assert len(message) < len(str(tmp_path)) + 200


def test_columns_that_nobody_asks_for_may_hold_anything(tmp_path):
    text = "a,,,note\n" + "".join(f"{i},,,{100_000 * 'x'}\n" for i in range(3))
    assert table(tmp_path, text).numbers(["a"]).tolist() == [[0.0], [1.0], [2.0]]


def test_long_tables_come_out_to_the_bit(tmp_path):
    text = "a,b\n" + "".join(f"{i},{i / 3}\n" for i in range(100_000))
    values = table(tmp_path, text).numbers(["b", "a"])
    assert np.array_equal(values[:, 1], np.arange(100_000)) and np.array_equal(
        values[:, 0], np.arange(100_000) / 3
    )


def test_duplicate_names_in_signals_and_logs_are_refused(tmp_path):
    (tmp_path / "load.csv").write_text("time,value,value\n0,1,2\n")
    with refused(r"two columns 'value'", FileError):
        Signal.from_csv(tmp_path / "load.csv")


# ---------------------------------------------------------------------- names


@pytest.mark.parametrize("name", READERS)
def test_what_is_no_path_is_refused(name):
    for path in (5, None, b"scene.toml", ["scene.toml"], np.zeros(2)):
        assert "path must be a path" in one_line(READERS[name], path)


@pytest.mark.parametrize("name", READERS)
def test_names_that_cannot_be_printed_are_escaped_and_long_ones_cut(tmp_path, name):
    kind = name[name.index(".") :]
    for odd, shown in (
        ("a\nb", r"a\nb"),
        ("\udcff", r"\udcff"),
        ("\x1b[31m", r"\x1b[31m"),
    ):
        assert shown in one_line(READERS[name], tmp_path / f"{odd}{kind}")
    assert len(one_line(READERS[name], tmp_path / (5000 * "x") / name)) == 300


def test_damaged_arrays_get_one_line(tmp_path):
    """NumPy reads the header of an array as source code, and says so in warnings and errors of the parser."""
    np.save(tmp_path / "map.npy", np.ones((3, 3)))
    good = (tmp_path / "map.npy").read_bytes()
    random = np.random.default_rng(5)
    for _ in range(300):
        place = int(random.integers(128))
        (tmp_path / "map.npy").write_bytes(
            good[:place] + random.bytes(2) + good[place + 2 :]
        )
        try:
            assert read_pressure_map(tmp_path / "map.npy").shape
        except FrictionError as error:
            assert str(error).isprintable() and len(str(error)) <= 300


@pytest.mark.parametrize(
    ("cell", "number"),
    [
        ("2,5", 2.5),
        ("-0,25", -0.25),
        ("+,5", 0.5),
        ("1,5e-3", 1.5e-3),
        ("12,5E+2", 1250.0),
    ],
)
def test_numbers_with_a_comma_are_read_as_spreadsheets_write_them(
    tmp_path, cell, number
):
    (tmp_path / "load.csv").write_text(f"time;value\n0,0;{cell}\n1,0;{cell}\n")
    assert Signal.from_csv(tmp_path / "load.csv").values.tolist() == [number, number]


@pytest.mark.parametrize("cell", ["1,000,000", "1,", "1,5e", "1.000,5"])
def test_other_commas_are_not_taken_for_points(tmp_path, cell):
    (tmp_path / "load.csv").write_text(f"time;value\n0,0;{cell}\n1,0;{cell}\n")
    assert cell in one_line(Signal.from_csv, tmp_path / "load.csv")
