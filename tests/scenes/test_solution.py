"""Solutions: saved and loaded to the bit, with their scene; paths that cannot be written are found out before."""

import dataclasses
import os

import numpy as np
import pytest
import xarray as xr
from scipy.io import netcdf_file

import planarfriction as pf
from planarfriction import FrictionError, Solution
from planarfriction._support.writing import check_writable
from planarfriction.errors import FileError
from planarfriction.scenes import Statistics, in_hand
from planarfriction.scenes.solution import History, write_dataset
from tests.support import synthetic
from tests.support.refusals import refusal, refused

UNITS = {"fx": "N", "fy": "N", "tau": "N m", "normal_force": "N"}


def a_solution(name="fingers"):
    """Return a made-up solution, as a simulation returns it."""
    patch = pf.ContactPatch.disc(0.01, 5)
    scene = in_hand(
        pf.ReducedModelPublished(
            patch, pf.LuGre(mu_s=1.2), surface=pf.LimitSurfaceEllipsoid(patch)
        )
    )
    scene = dataclasses.replace(
        scene, contacts=[dataclasses.replace(scene.contacts[0], name=name)]
    )
    time = np.arange(5) * 0.01
    variables = {"x": ("time", time / 3.0, {"units": "m"})}
    random = np.random.default_rng(0)
    variables |= {
        key: (("time", "contact"), random.normal(size=(5, 1)), {"units": u})
        for key, u in UNITS.items()
    }
    data = xr.Dataset(
        variables, coords={"time": ("time", time, {"units": "s"}), "contact": [name]}
    )
    return Solution(
        data, Statistics(steps=12, wall_time=0.1 / 3), "done", "reached t_end", scene
    )


def test_a_saved_solution_comes_back_to_the_bit(tmp_path):
    solution = a_solution()
    assert solution.save(tmp_path / "run.nc") == tmp_path / "run.nc"
    again = Solution.load(tmp_path / "run.nc")
    xr.testing.assert_identical(again.data, solution.data)
    assert {name: again.data[name].attrs["units"] for name in UNITS} == UNITS
    assert again.statistics == solution.statistics
    assert (again.status, again.message) == ("done", "reached t_end")
    assert again.scene.digest() == solution.scene.digest()
    assert isinstance(again.scene.contacts[0].model, pf.ReducedModelPublished)
    again.save(tmp_path / "twice.nc")
    assert Solution.load(tmp_path / "twice.nc").data.identical(again.data)


def test_the_dataset_is_made_once_and_is_what_the_arrays_say():
    full = a_solution()
    arrays = {
        name: History(each.dims, each.values, each.attrs)
        for name, each in full.data.variables.items()
    }
    solution = dataclasses.replace(full, histories=arrays)
    assert solution.data is solution.data
    xr.testing.assert_identical(solution.data, full.data)
    assert set(solution.data.coords) == {"time", "contact"}
    assert solution.data.attrs == {"scene": solution.scene.to_json()}


def test_what_is_added_to_the_data_is_saved(tmp_path):
    solution = a_solution()
    solution.data["power"] = solution.data.x * 2.0
    solution.data.attrs["note"] = "third attempt"
    again = Solution.load(solution.save(tmp_path / "run.nc"))
    xr.testing.assert_identical(again.data, solution.data)


def test_saving_overwrites_and_leaves_nothing_else(tmp_path):
    for _ in range(2):
        a_solution().save(tmp_path / "run.nc")
    assert os.listdir(tmp_path) == ["run.nc"]


def test_saving_through_a_link_keeps_the_link(tmp_path):
    (tmp_path / "link.nc").symlink_to(tmp_path / "run.nc")
    a_solution().save(tmp_path / "link.nc")
    assert (tmp_path / "link.nc").is_symlink()
    assert Solution.load(tmp_path / "run.nc").status == "done"


def test_names_outside_ascii_and_empty_messages_survive(tmp_path):
    solution = dataclasses.replace(a_solution("Prüffinger µ"), message="")
    solution.save(tmp_path / "run.nc")
    again = Solution.load(tmp_path / "run.nc")
    assert again.data["contact"].values.tolist() == ["Prüffinger µ"]
    assert again.scene.contacts[0].name == "Prüffinger µ"
    assert again.message == ""


def test_statistics_by_name():
    assert Statistics(steps=3).as_dict() == {
        "steps": 3,
        "rejections": 0,
        "evaluations": 0,
        "jacobians": 0,
        "wall_time": 0.0,
        "compile_time": 0.0,
    }


def test_paths_that_cannot_be_written_are_found_out_without_writing(tmp_path):
    kept = tmp_path / "kept.nc"
    kept.write_bytes(b"old")
    assert check_writable(kept) == kept
    assert kept.read_bytes() == b"old"
    check_writable(tmp_path / "new.nc")
    assert not (tmp_path / "new.nc").exists()
    (tmp_path / "file").write_text("")
    for path, reason in (
        (tmp_path, "it is a folder"),
        (tmp_path / "nowhere" / "run.nc", "there is no folder"),
        (tmp_path / "file" / "run.nc", "there is no folder"),
        (tmp_path / ("n" * 300), "name too long"),
        ("/proc/run.nc", "cannot be written"),
        ("/dev/null", "it is a device"),
    ):
        assert reason in refusal(check_writable, path).lower()
        with refused("cannot be written", FrictionError):
            a_solution().save(path)


def test_files_that_are_no_solutions_get_one_line(tmp_path):
    a_solution().save(tmp_path / "good.nc")
    good = (tmp_path / "good.nc").read_bytes()
    (tmp_path / "cut.nc").write_bytes(good[:200])
    (tmp_path / "text.nc").write_text("time,x\n0,1\n")
    (tmp_path / "empty.nc").write_bytes(b"")
    (tmp_path / "hdf.nc").write_bytes(b"\x89HDF\r\n")
    xr.Dataset({"a": ("x", [1.0])}).to_netcdf(tmp_path / "other.nc", engine="scipy")
    strange = Solution.load(tmp_path / "good.nc").data.assign_attrs(
        scene="{}", statistics="{}", status="", message=""
    )
    write_dataset(strange, tmp_path / "strange.nc")
    write_dataset(strange.drop_attrs(), tmp_path / "bare.nc")
    (tmp_path / "folder.nc").mkdir()
    for name, reason in {
        "none.nc": "no such file",
        "folder.nc": "is a folder",
        "cut.nc": "not a saved solution",
        "text.nc": "not a saved solution",
        "empty.nc": "not a saved solution",
        "hdf.nc": "not a saved solution",
        "other.nc": "not a saved solution: it has no checksum",
        "bare.nc": "not a saved solution of planarfriction (no attribute 'scene')",
        "strange.nc": "the scene in this file cannot be read: scene: missing key",
    }.items():
        line = refusal(Solution.load, tmp_path / name)
        assert name in line and reason in line


# ---------------------------------------------------------------------- damage


def damaged(content, random):
    """The content with one kind of damage somewhere: bits, bytes, a lost end, a lost or repeated block, noise."""
    kind = random.integers(6)
    place = int(random.integers(len(content)))
    length = int(random.integers(1, 65))
    if kind == 0:
        return (
            content[:place]
            + bytes([content[place] ^ (1 << int(random.integers(8)))])
            + content[place + 1 :]
        )
    if kind == 1:
        return content[:place]
    if kind == 2:
        return content[:place] + content[place + length :]
    if kind == 3:
        return content[:place] + content[place : place + length] + content[place:]
    if kind == 4:
        return content[:place] + length * b"\0" + content[place + length :]
    return content[:place] + random.bytes(length) + content[place + length :]


def test_a_damaged_file_loads_as_it_was_saved_or_not_at_all(tmp_path):
    """1,500 damages, with a seed: loading gives the very same solution or one line, never another solution."""
    original = a_solution()
    path = tmp_path / "run.nc"
    good = original.save(path).read_bytes()
    random = np.random.default_rng(11)
    refused = 0
    for _ in range(1500):
        bad = damaged(good, random)
        path.write_bytes(bad)
        try:
            again = Solution.load(path)
        except FileError as error:
            assert "\n" not in str(error) and "run.nc" in str(error)
            refused += bad != good
        else:
            assert bad == good
            xr.testing.assert_identical(again.data, original.data)
    assert refused > 1400  # zeros over zeros are no damage


def test_every_byte_counts(tmp_path):
    good = a_solution().save(tmp_path / "run.nc").read_bytes()
    for place in {*range(0, len(good), 7), *range(len(good) - 200, len(good))}:
        (tmp_path / "run.nc").write_bytes(
            good[:place] + bytes([good[place] ^ 1]) + good[place + 1 :]
        )
        with pytest.raises(FileError):
            Solution.load(tmp_path / "run.nc")


def test_other_programs_read_the_file(tmp_path):
    path = a_solution().save(tmp_path / "run.nc")
    random = np.random.default_rng(0)
    with xr.load_dataset(path, engine="scipy") as data:
        assert np.array_equal(data["fx"], random.normal(size=(5, 1)))
    with netcdf_file(path, mmap=False) as file:
        assert np.array_equal(file.variables["time"][:], np.arange(5) * 0.01)


def test_a_file_rewritten_by_another_program_is_refused_with_a_remedy(tmp_path):
    path = a_solution().save(tmp_path / "run.nc")
    data = xr.load_dataset(path, engine="scipy")
    data["x"] = 2.0 * data["x"]
    data.to_netcdf(tmp_path / "edited.nc", engine="scipy")
    del data.attrs["planarfriction_checksum"]
    data.to_netcdf(tmp_path / "stripped.nc", engine="scipy")
    for name, reason in (
        ("edited.nc", "changed by another program"),
        ("stripped.nc", "no checksum"),
    ):
        with refused(rf"{name}: .*{reason}.*xarray.load_dataset", FileError):
            Solution.load(tmp_path / name)
    solution = Solution.load(path)  # the way to change a solution
    solution.data["x"] = 2.0 * solution.data["x"]
    assert np.array_equal(Solution.load(solution.save(path)).data["x"], data["x"])
    assert "planarfriction_checksum" not in solution.data.attrs


def test_additions_that_no_file_can_hold_get_one_line(tmp_path):
    for name, value in (
        ("nested", {"a": 1}),
        ("object", object()),
        (3, "number as a name"),
    ):
        solution = a_solution()
        solution.save(tmp_path / "run.nc")
        solution.data.attrs[name] = value
        with refused(r"run.nc: cannot be written", FileError):
            solution.save(tmp_path / "run.nc")
        Solution.load(tmp_path / "run.nc")


UNFIT = {
    "pipe.nc": "is a device or a pipe, not a saved solution",
    "/dev/zero": "is a device or a pipe, not a saved solution",
    "a\0b": "cannot be read",
    "\udcff.nc": "no such file",
}


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="pipes and devices of POSIX")
@pytest.mark.parametrize("name", UNFIT)
def test_what_is_no_file_is_no_solution(tmp_path, name):
    if name == "pipe.nc":
        os.mkfifo(tmp_path / name)
    with refused(UNFIT[name], FileError):
        Solution.load(tmp_path / name)


@pytest.mark.parametrize(
    ("make", "units"),
    [
        (pf.ReducedModel, "m"),
        (pf.ReducedModelPublished, "m, m, m^2"),
        (pf.DistributedModel, "m"),
    ],
)
def test_recorded_states_have_the_units_of_their_model(make, units):
    model = make(pf.ContactPatch.disc(0.01, cells=5), pf.LuGre())
    data = pf.simulate(pf.scenes.free_slide(model, t_end=0.01), bristles="all").data
    (name,) = [each for each in data if each.startswith("bristles")]
    assert data[name].attrs["units"] == units


def test_a_solution_says_its_end_and_its_cost():
    said = "Solution('in-hand', success: 201 samples to t=2 s, x=0.002, y=-0.02, theta=-1.2, 1234 steps in 250 ms)"
    assert repr(synthetic.solution()) == said
