"""Pressure maps from arrays and files: orientation, kinds of files, and what is said about broken ones."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from PIL import Image

import planarfriction as pf
from planarfriction.errors import FileError, FrictionError, InvalidValueError
from tests.support.refusals import refusal, refused

ROUNDING = 1e-15
"""Relative: a handful of operations, each rounded at 1e-16."""

MAP = np.array([[0, 0, 0, 9], [0, 0, 0, 0], [1, 0, 0, 0]])
"""Heavy at the top right, light at the bottom left, nothing else."""


def test_row_0_is_the_top_and_column_0_the_left():
    patch = pf.ContactPatch.from_pressure(MAP, 0.001)
    assert patch.positions == pytest.approx(
        np.array([[0.0015, 0.001], [-0.0015, -0.001]])
    )
    assert patch.weights() == pytest.approx([0.9, 0.1], rel=ROUNDING)
    assert patch.centre_of_pressure() == pytest.approx((0.0012, 0.0008))
    assert (patch.grid.columns, patch.grid.rows) == (4, 3)
    assert (patch.grid.x_min, patch.grid.y_min) == pytest.approx((-0.002, -0.0015))


def test_cells_may_be_oblong():
    patch = pf.ContactPatch.from_pressure(MAP, (0.002, 0.001))
    assert patch.positions[0] == pytest.approx((0.003, 0.001))
    assert patch.areas == pytest.approx([2e-6, 2e-6])


@settings(deadline=None, max_examples=25)
@given(
    hnp.arrays(
        float,
        hnp.array_shapes(min_dims=2, max_dims=2, max_side=8),
        elements=st.floats(0, 100, width=32),
    ).filter(np.any)
)
def test_any_map_comes_back(values):
    patch = pf.ContactPatch.from_pressure(values, 0.001)
    again = np.zeros_like(values)
    again[patch.grid.locate(patch.positions)] = patch.pressure_values(
        values.sum() * 1e-6
    )
    # A map in pascals and its own total load: the same pascals (weights below 1e-300 of the peak may be lost).
    assert again == pytest.approx(values, rel=1e-12, abs=1e-290)


@settings(deadline=None, max_examples=25)
@given(hnp.arrays(float, (4, 5), elements=st.floats(0.01, 100)))
def test_flipping_a_map_mirrors_the_centre(values):
    x, y = pf.ContactPatch.from_pressure(values, 0.001).centre_of_pressure()
    # Coordinates of a few millimetres, rounded.
    assert pf.ContactPatch.from_pressure(
        values[::-1], 0.001
    ).centre_of_pressure() == pytest.approx((x, -y), abs=1e-17)
    assert pf.ContactPatch.from_pressure(
        values[:, ::-1], 0.001
    ).centre_of_pressure() == pytest.approx((-x, y), abs=1e-17)


def write_csv(path, values):
    path.write_text(
        "# kPa\n"
        + "\n".join(",".join(str(value) for value in row) for row in values)
        + "\n\n"
    )


def write_image(path, values, mode="L"):
    Image.fromarray(
        np.asarray(
            values, dtype={"L": np.uint8, "I;16": np.uint16, "F": np.float32}[mode]
        )
    ).save(path)


@pytest.mark.parametrize(
    ("file", "write"),
    [
        ("pad.csv", write_csv),
        ("pad.npy", np.save),
        ("pad.png", write_image),
        ("PAD.PNG", write_image),
        ("pad.bmp", write_image),
        ("pad.pgm", write_image),
        (
            "sixteen bits.png",
            lambda path, values: write_image(path, 7000 * values, "I;16"),
        ),
        ("floats.tiff", lambda path, values: write_image(path, values / 64, "F")),
        (
            "palette.png",
            lambda path, values: (
                Image.fromarray(values.astype(np.uint8)).convert("P").save(path)
            ),
        ),
        (
            "grey in colours.png",
            lambda path, values: (
                Image.fromarray(values.astype(np.uint8)).convert("RGB").save(path)
            ),
        ),
        (
            "opaque.png",
            lambda path, values: (
                Image.fromarray(values.astype(np.uint8)).convert("LA").save(path)
            ),
        ),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_every_kind_of_file_gives_the_same_patch(tmp_path, file, write):
    path = tmp_path / file
    write(path, MAP)
    for given_path in (path, str(path)):
        patch = pf.ContactPatch.from_pressure(given_path, 0.001)
        assert patch.name == path.stem
        assert patch.weights() == pytest.approx([0.9, 0.1], rel=ROUNDING)
        assert patch.centre_of_pressure() == pytest.approx((0.0012, 0.0008))


def test_black_and_white_image_is_a_mask(tmp_path):
    Image.fromarray((MAP > 0).astype(np.uint8) * 255).convert("1").save(
        tmp_path / "mask.png"
    )
    assert pf.ContactPatch.from_pressure(
        tmp_path / "mask.png", 0.001
    ).weights().tolist() == [0.5, 0.5]


@pytest.mark.parametrize(
    ("values", "cell_size", "message"),
    [
        (
            [[1, 2], [3, -4]],
            0.001,
            r"pressure must be >= 0, got -4.0 at index \(1, 1\)",
        ),
        ([[1, np.nan]], 0.001, r"pressure must be finite, got nan at index \(0, 1\)"),
        ([[0, 0]], 0.001, "pressure must have a total > 0"),
        ([1, 2], 0.001, r"pressure must have shape \[any, any\], got shape \[2\]"),
        ([[1, 2], [3]], 0.001, "pressure must be an array of numbers"),
        (np.empty((0, 3)), 0.001, "pressure must have a total > 0"),
        ([[1, 2]], 0.0, "cell_size must be > 0, got 0.0"),
        ([[1, 2]], (1, 2, 3), r"cell_size must have shape \[2\]"),
        ([[1, 2]], "1 mm", "cell_size must be an array of numbers"),
    ],
)
def test_broken_arrays(values, cell_size, message):
    with refused(message):
        pf.ContactPatch.from_pressure(values, cell_size)


@pytest.mark.parametrize(
    ("file", "content", "message"),
    [
        ("pad.csv", "# kPa\n1,2\n3,x\n", "line 3, value 2: 'x' is not a number"),
        ("pad.csv", "", "the file holds no numbers"),
        ("pad.csv", b"\x89PNG\r\n\x1a\n", "not a text file (expected a pressure map)"),
        ("pad.npy", "1,2\n3,4\n", "not a readable .npy file"),
        ("pad.npy", "", "not a readable .npy file"),
        ("pad.png", "1,2\n3,4\n", "not a readable .png file"),
        ("pad.png", b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR", "not a readable .png file"),
        (
            "pad.txt",
            "1,2\n3,4\n",
            "unknown kind '.txt', use .csv, .npy, .npz, .mat, .asf or a grey image",
        ),
        ("pad", "1,2\n3,4\n", "unknown kind ''"),
    ],
)
def test_broken_files(tmp_path, file, content, message):
    path = tmp_path / file
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    line = refusal(pf.ContactPatch.from_pressure, path, 0.001, kind=FileError)
    assert message in line and str(path) in line


def test_missing_file_and_folder(tmp_path):
    (tmp_path / "folder.csv").mkdir()
    for name, reason in (
        ("missing.csv", "no such file"),
        ("folder.csv", "is a folder"),
    ):
        with refused(reason, FileError):
            pf.ContactPatch.from_pressure(tmp_path / name, 0.001)


def test_negative_pressures_in_a_file_name_the_file(tmp_path):
    (tmp_path / "pad.csv").write_text("1,-2\n")
    with refused(r"pressure map .*pad.csv must be >= 0, got -2.0 at index \(0, 1\)"):
        pf.ContactPatch.from_pressure(tmp_path / "pad.csv", 0.001)


def test_npy_files_that_hold_something_else(tmp_path):
    np.save(tmp_path / "objects.npy", np.array([None, {}], dtype=object))
    np.save(tmp_path / "complex.npy", np.array([[1j]]))
    np.save(tmp_path / "row.npy", np.array([1.0, 2.0]))
    np.savez(tmp_path / "several.npz", a=MAP)
    (tmp_path / "several.npz").rename(tmp_path / "several.npy")
    for name, error in (
        ("objects.npy", FileError),
        ("complex.npy", FileError),
        ("several.npy", FileError),
        ("row.npy", InvalidValueError),
    ):
        with pytest.raises(error, match=name):
            pf.ContactPatch.from_pressure(tmp_path / name, 0.001)


def test_colours_and_transparency_are_refused(tmp_path):
    Image.new("RGB", (2, 2), (255, 0, 0)).save(tmp_path / "colour.png")
    Image.new("LA", (2, 2), (255, 100)).save(tmp_path / "clear.png")
    with refused("colour image", FileError):
        pf.ContactPatch.from_pressure(tmp_path / "colour.png", 0.001)
    with refused("partly transparent", FileError):
        pf.ContactPatch.from_pressure(tmp_path / "clear.png", 0.001)


def test_numbers_beyond_floats_in_a_file_are_refused_without_a_warning(tmp_path):
    np.save(
        tmp_path / "map.npy", np.array([[1.0, 1.0], [1.0, np.longdouble("1e4000")]])
    )
    with pytest.raises((FileError, InvalidValueError), match="inf"):
        pf.ContactPatch.from_pressure(tmp_path / "map.npy", 0.001)


def test_pixels_that_are_no_numbers_are_refused_without_a_warning(tmp_path):
    """Signalling NaNs, of which floating-point units warn when they become numbers of another size."""
    Image.fromarray(np.ones((4, 4), np.float32)).save(tmp_path / "map.tif")
    ones = np.ones(4, "<f4").tobytes()
    signalling = np.array([0x7FA00000], "<u4").tobytes()
    content = (tmp_path / "map.tif").read_bytes()
    (tmp_path / "map.tif").write_bytes(content.replace(ones, signalling + ones[4:], 1))
    with refused(r"must be finite, got nan at index \(0, 0\)"):
        pf.ContactPatch.from_pressure(tmp_path / "map.tif", 0.001)


# ---------------------------------------------------------------------- files as others write them

PRESSURES = np.array(
    [[0.5, 1.25, 2.5], [3.5, 4.0, 5.25], [6.5, 0.75, 8.0], [9.0, 1.5, 2.0]]
)


def read(path, **options):
    return pf.patch.read_pressure_map(path, **options)


@pytest.mark.parametrize(
    ("writing", "options"),
    [
        ({}, {}),
        ({"index_label": "row"}, {}),
        ({"index": False}, {"header": True}),
        ({"header": False}, {"index": True}),
        ({"header": list("abc")}, {}),
        ({"header": list("abc"), "index": False}, {}),
        ({"header": False, "index": False}, {}),
        ({"sep": ";", "decimal": ","}, {}),
    ],
)
def test_labels_of_pandas_are_no_pressures(tmp_path, writing, options):
    import pandas

    path = tmp_path / "pad.csv"
    pandas.DataFrame(PRESSURES).to_csv(path, **writing)
    np.testing.assert_array_equal(read(path, **options), PRESSURES)
    patch = pf.ContactPatch.from_pressure(path, 1e-3, **options)
    assert (
        patch.contact_radius()
        == pf.ContactPatch.from_pressure(PRESSURES, 1e-3).contact_radius()
    )


def test_labels_that_may_be_pressures_are_asked_about(tmp_path):
    path = tmp_path / "pad.csv"
    path.write_text("0,1,2\n5,6,7\n")
    with refused(
        r"first row is 0, 1, 2: labels \(header = true\) or pressures \(header = fal",
        FileError,
    ):
        read(path)
    assert read(path, header=True).tolist() == [[5, 6, 7]]
    assert read(path, header=False).tolist() == [[0, 1, 2], [5, 6, 7]]
    path.write_text("0,5\n1,6\n2,7\n3,8\n")
    with refused(
        r"first column is 0, 1, 2, \.\.\.: labels \(index = true\)", FileError
    ):
        read(path)
    assert read(path, index=False).shape == (4, 2)


def test_frames_are_chosen_and_never_stacked(tmp_path):
    import pandas

    frames = [PRESSURES, 2.0 * PRESSURES, 3.0 * PRESSURES[:, ::-1]]
    names = []
    tables = [pandas.DataFrame(each).to_csv() for each in frames]
    for name, text in {
        "blank.csv": "\n".join(
            "".join(",".join(map(str, row)) + "\n" for row in each) for each in frames
        ),
        "remark.csv": "".join(
            f"# frame {i}\n{pandas.DataFrame(f).to_csv()}" for i, f in enumerate(frames)
        ),
        "appended.csv": "".join(tables),
    }.items():
        (tmp_path / name).write_text(text)
        names.append(name)
    np.save(tmp_path / "pad.npy", np.array(frames))
    np.savez_compressed(tmp_path / "pad.npz", np.array(frames))
    from scipy.io import savemat

    savemat(tmp_path / "pad.mat", {"p": np.moveaxis(frames, 0, -1), "rate": 100.0})
    images = [Image.fromarray((4 * each).astype(np.uint8)) for each in frames]
    images[0].save(tmp_path / "pad.tif", save_all=True, append_images=images[1:])
    for name in (*names, "pad.npy", "pad.npz", "pad.mat", "pad.tif"):
        scale = 4.0 if name == "pad.tif" else 1.0
        with refused(
            rf"frame must be one of the 3 frames of .*{name}, 0 to 2, got None",
            FrictionError,
        ):
            read(tmp_path / name)
        with refused("got 3", FrictionError):
            read(tmp_path / name, frame=3)
        for i, each in enumerate(frames):
            np.testing.assert_array_equal(
                read(tmp_path / name, frame=i), scale * each, err_msg=name
            )
    np.testing.assert_array_equal(
        pf.ContactPatch.from_pressure(np.array(frames), 1e-3, frame=1).cells, 12
    )


def test_blank_lines_behind_every_row_part_nothing(tmp_path):
    (tmp_path / "pad.csv").write_bytes(b"5,6\r\r\n7,8\r\r\n")
    assert read(tmp_path / "pad.csv").tolist() == [[5, 6], [7, 8]]
    (tmp_path / "pad.csv").write_text("5,6\n7,8\n\n1,2\n")
    with refused("blocks of 2, 1 rows", FileError):
        read(tmp_path / "pad.csv")
    assert read(tmp_path / "pad.csv", frame=1).tolist() == [[1, 2]]


def test_frames_in_rows_and_one_below_another_have_a_shape(tmp_path):
    frames = np.stack([PRESSURES, 2.0 * PRESSURES])
    np.savetxt(
        tmp_path / "rows.csv",
        np.column_stack([[0.0, 0.1], frames.reshape(2, -1)]),
        delimiter=",",
    )
    np.savetxt(tmp_path / "stacked.csv", frames.reshape(-1, 3), delimiter=",")
    for name, index in (("rows.csv", True), ("stacked.csv", None)):
        found = read(tmp_path / name, index=index, frame_shape=(4, 3), frame=1)
        np.testing.assert_array_equal(found, frames[1])
    with refused("frame_shape must divide the 24 values"):
        read(tmp_path / "stacked.csv", frame_shape=(5, 3))


@pytest.mark.parametrize("name", ["pad.asf", "pad.csv"])
def test_exports_of_tekscan(tmp_path, name):
    head = "DATA_TYPE MOVIE\nVERSION Fast Export\nROWS 2\nCOLS 3\nUNITS kPa\nASCII_DATA @@\n"
    (tmp_path / name).write_text(
        head + "Frame 1\nB,1,2\nB,B,3\n\nFrame 2\nB,4,5\nB,B,6\n@@\n"
    )
    assert read(tmp_path / name, frame=1).tolist() == [[0, 4, 5], [0, 0, 6]]
    with refused("one of the 2 frames", FrictionError):
        read(tmp_path / name)


def disc_image(radius=20.3, pixels=64):
    y, x = np.mgrid[:pixels, :pixels] - 0.5 * (pixels - 1)
    return np.where(np.hypot(x, y) < radius, 255, 0).astype(np.uint8)


def test_ringing_of_jpeg_is_no_pressure_and_is_told(tmp_path):
    Image.fromarray(disc_image()).save(tmp_path / "pad.jpg", quality=75)
    with pytest.warns(
        UserWarning,
        match=r"pad.jpg: .* of 1\d\d\d cells, up to 0.1 of the peak, count as empty",
    ):
        patch = pf.ContactPatch.from_pressure(tmp_path / "pad.jpg", 1e-3)
    drawn = pf.ContactPatch.from_pressure(disc_image(), 1e-3)
    assert abs(patch.cells - drawn.cells) < 0.02 * drawn.cells
    raw = pf.ContactPatch.from_pressure(tmp_path / "pad.jpg", 1e-3, threshold=0.0)
    assert raw.cells > 1.2 * drawn.cells
    assert (
        pf.ContactPatch.from_pressure(tmp_path / "pad.jpg", 1e-3, threshold=0.2).cells
        == drawn.cells
    )
    assert (
        pf.ContactPatch.from_pressure([[1.0, 9.0, 10.0]], 1e-3, threshold=0.2).cells
        == 2
    )


def test_prints_are_asked_about_and_inverted(tmp_path):
    rng = np.random.default_rng(1)
    paper = 250.0 - 0.8 * disc_image() + rng.integers(-3, 4, (64, 64))
    Image.fromarray(paper.astype(np.uint8)).save(tmp_path / "print.png")
    with refused(
        r"ink on paper \(invert = true\) or pressure \(invert = false\)", FileError
    ):
        read(tmp_path / "print.png")
    patch = pf.ContactPatch.from_pressure(
        tmp_path / "print.png", width=0.064, invert=True, threshold=0.1
    )
    np.testing.assert_array_equal(
        patch.positions, pf.ContactPatch.from_pressure(disc_image(), 1e-3).positions
    )
    assert read(tmp_path / "print.png", invert=False).min() > 0.0
    Image.fromarray(disc_image()).save(tmp_path / "mask.png")
    assert read(tmp_path / "mask.png").sum() == disc_image().sum(dtype=float)
    Image.new("L", (4, 4), 255).save(tmp_path / "full.png")
    assert read(tmp_path / "full.png").all()


def test_width_stands_in_for_the_cell_size():
    wide = pf.ContactPatch.from_pressure(PRESSURES, width=0.006)
    assert (wide.grid.cell_width, wide.grid.cell_height) == pytest.approx(
        (0.002, 0.002), rel=1e-15
    )
    for sizes in ({}, {"cell_size": 1e-3, "width": 1e-3}):
        with refused("cell_size must be given, or else the width"):
            pf.ContactPatch.from_pressure(PRESSURES, **sizes)
    with refused("width must be > 0"):
        pf.ContactPatch.from_pressure(PRESSURES, width=0.0)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"header": 1}, "header must be True or False"),
        ({"threshold": 1.0}, "threshold must be < 1"),
        ({"frame": -1}, "frame must be"),
        ({"frame_shape": 4}, r"frame_shape must be \(rows, columns\)"),
        ({"inverted": True}, "inverted"),
    ],
)
def test_options_that_break_their_rule(options, message):
    with refused(message):
        pf.ContactPatch.from_pressure(PRESSURES, 1e-3, **options)
