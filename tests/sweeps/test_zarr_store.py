"""Sweeps that need the extra [sweep]: zarr stores, and a dask cluster that loses a worker."""

from __future__ import annotations

import errno
import json
import os
import shutil
import signal
import time
import warnings
from concurrent.futures import Future
from pathlib import Path

import numpy as np
import pytest

import planarfriction as pf
from planarfriction import sweeps
from planarfriction.errors import FileError, SweepInterrupted
from planarfriction.sweeps import zarr_chunks
from planarfriction.sweeps.zarr_store import ZarrBookkeeper
from planarfriction.writing import making_folder
from tests.sweeps.test_running import GRIPS, MASSES, MODEL, end, grip, reference

pytestmark = pytest.mark.sweep

VALUES = {"grip": GRIPS, "mass": MASSES}


@pytest.fixture
def zarr():
    return pytest.importorskip("zarr", reason="needs zarr: pip install 'planarfriction[sweep]'")


def same(stored, data) -> None:
    """Check that a store holds the data of a sweep in memory; texts may have another type there."""
    assert set(stored.variables) == set(data.variables)
    for name, each in data.variables.items():
        there = stored[name]
        assert there.dims == each.dims and there.attrs == each.attrs, name
        np.testing.assert_array_equal(there.values.astype(each.dtype), each.values, err_msg=name)


A_RUN = 4 * 8
"""Bytes of a history of a run."""


@pytest.mark.parametrize(
    ("room", "runs"), [(2**16, (3, 2)), (5 * A_RUN, (2, 2)), (3 * A_RUN, (1, 2)), (A_RUN, (1, 1)), (1, (1, 1))]
)
def test_a_store_holds_the_same_dataset(zarr, tmp_path, monkeypatch, room, runs):
    monkeypatch.setattr(zarr_chunks, "CHUNK", room)
    path = tmp_path / "all.zarr"
    stored = pf.sweep(grip, VALUES, out=path)
    same(stored, reference())
    arrays = zarr.open_group(path, mode="r")
    assert arrays["fx"].chunks == (*runs, 4, 1) and arrays["fx"].shape == (3, 2, 4, 1)
    told: list[sweeps.Progress] = []
    same(pf.sweep(grip, VALUES, out=path, progress=told.append), reference())
    assert told[-1].found == 6


def test_measurements_of_any_kind_are_stored(zarr, tmp_path):
    def measure(solution: pf.Solution) -> dict:
        return {**end(solution), "steps": solution.statistics.steps, "how": solution.status}

    def rarely(grip: float, mass: float) -> pf.Scene:
        return pf.scenes.in_hand(MODEL, normal_force=grip if grip < 3.0 else -1.0, mass=mass, t_end=0.02)

    stored = pf.sweep(rarely, VALUES, out=tmp_path / "ends.zarr", measure=measure)
    data = pf.sweep(rarely, VALUES, measure=measure)
    assert stored.steps.isnull().sum() == 2  # of those that failed
    for name in ("y", "theta", "steps", "status", "failure"):
        np.testing.assert_array_equal(stored[name].values.astype(data[name].dtype), data[name].values)
    assert stored.how.values.tolist() == data.how.values.tolist()


def twice(solution: pf.Solution) -> dict[str, float]:
    return {name: 2.0 * value for name, value in end(solution).items()}


def test_a_run_counts_once_the_journal_says_so(zarr, tmp_path):
    path = tmp_path / "ends.zarr"
    whole = pf.sweep(grip, VALUES, out=path, measure=end).load()
    journal = path / "run" / "runs.jsonl"
    lines = journal.read_bytes().splitlines(keepends=True)
    places = [0, 7], [0], [0, 0.5], 0
    elsewhere = b"".join(json.dumps([place, *json.loads(lines[0])[1:]]).encode() + b"\n" for place in places)
    journal.write_bytes(elsewhere + b"".join(lines[:4]) + lines[4][:20])  # killed while it wrote the fifth
    told: list[sweeps.Progress] = []
    again = pf.sweep(grip, VALUES, out=path, measure=end, progress=told.append)
    assert told[-1].found == 4 and again.load().identical(whole)
    told.clear()
    assert pf.sweep(grip, VALUES, out=path, measure=end, progress=told.append).load().identical(whole)
    assert told[-1].found == 6
    told.clear()  # another measurement of the same layout: nothing of the old one counts
    pf.sweep(grip, VALUES, out=path, measure=twice, progress=told.append)
    assert told[-1].found == 0


def test_a_store_without_a_measurement_continues(zarr, tmp_path):
    path = tmp_path / "all.zarr"
    pf.sweep(grip, VALUES, out=path)
    journal = path / "run" / "runs.jsonl"
    journal.write_bytes(b"".join(journal.read_bytes().splitlines(keepends=True)[:2]))
    told: list[sweeps.Progress] = []
    same(pf.sweep(grip, VALUES, out=path, progress=told.append), reference())
    assert told[-1].found == 2


@pytest.mark.parametrize("lines", [0, 6])
def test_a_lost_chunk_or_a_kill_before_all_arrays_were_made_is_mended(zarr, tmp_path, monkeypatch, lines):
    monkeypatch.setattr(zarr_chunks, "CHUNK", 2 * A_RUN)
    path = tmp_path / "all.zarr"
    pf.sweep(grip, VALUES, out=path)
    journal = path / "run" / "runs.jsonl"
    if lines:
        (path / "x" / "c" / "1" / "0" / "0").unlink()
    else:  # killed while it made the arrays, before any run counted
        journal.write_bytes(b"")
        shutil.rmtree(path / "x")
    told: list[sweeps.Progress] = []
    same(pf.sweep(grip, VALUES, out=path, progress=told.append), reference())
    assert (told[-1].found, told[-1].damaged) == ((4, 2) if lines else (0, 0))


def test_runs_of_a_lost_chunk_stay_lost_if_only_some_are_done_again(zarr, tmp_path, monkeypatch):
    """A kill may come when the chunk is there again, with one of its runs."""
    monkeypatch.setattr(zarr_chunks, "CHUNK", 2 * A_RUN)
    path, told = tmp_path / "all.zarr", []
    pf.sweep(grip, VALUES, out=path)
    (path / "x" / "c" / "1" / "0" / "0").unlink()

    def killed(*run):
        raise KeyboardInterrupt

    monkeypatch.setattr(ZarrBookkeeper, "look_up", killed)
    with pytest.raises(SweepInterrupted):
        pf.sweep(grip, VALUES, out=path)
    monkeypatch.undo()
    shutil.copy(path / "x" / "c" / "0" / "0" / "0", path / "x" / "c" / "1" / "0" / "0")
    same(pf.sweep(grip, VALUES, out=path, progress=told.append), reference())
    assert told[-1].found == 4


def test_a_damaged_chunk_that_is_to_be_filled_is_one_line(zarr, tmp_path):
    path = tmp_path / "ends.zarr"
    pf.sweep(grip, VALUES, out=path, measure=end)
    chunk, journal = path / "y" / "c" / "0" / "0", path / "run" / "runs.jsonl"
    chunk.write_bytes(chunk.read_bytes()[:-1] + b"?")
    journal.write_bytes(b"".join(journal.read_bytes().splitlines(keepends=True)[:2]))
    with pytest.raises(FileError, match=r"y.c.0.0: is damaged: remove it, and its runs are done again \(") as caught:
        pf.sweep(grip, VALUES, out=path, measure=end)
    assert "\n" not in str(caught.value)
    chunk.unlink()
    np.testing.assert_array_equal(pf.sweep(grip, VALUES, out=path, measure=end).y, reference().y[:, :, -1])


def test_a_store_whose_chunks_are_of_one_run_goes_on(zarr, tmp_path, monkeypatch):
    """An earlier version made them."""
    path, told = tmp_path / "all.zarr", []
    with monkeypatch.context() as patch:
        patch.setattr(zarr_chunks, "CHUNK", 1)
        pf.sweep(grip, VALUES, out=path)
    journal = path / "run" / "runs.jsonl"
    journal.write_bytes(b"".join(journal.read_bytes().splitlines(keepends=True)[:2]))
    same(pf.sweep(grip, VALUES, out=path, progress=told.append), reference())
    assert told[-1].found == 2


def test_a_store_whose_chunks_have_other_codecs_goes_on(zarr, tmp_path):
    path = tmp_path / "ends.zarr"
    whole = pf.sweep(grip, VALUES, out=path, measure=end).load()
    group = zarr.open_group(path, mode="r+")
    for name in ("y", "theta"):  # as an earlier version made them
        values, about = group[name][...], {"dimension_names": ("grip", "mass"), "fill_value": np.nan}
        del group[name]
        group.create_array(name, shape=(3, 2), dtype=float, chunks=(1, 1), compressors=None, **about)[...] = values
    journal = path / "run" / "runs.jsonl"
    journal.write_bytes(b"".join(journal.read_bytes().splitlines(keepends=True)[:2]))
    again = pf.sweep(grip, VALUES, out=path, measure=end).load()
    np.testing.assert_array_equal(again.y, whole.y)


def test_a_lost_array_is_one_line(zarr, tmp_path):
    path = tmp_path / "all.zarr"
    pf.sweep(grip, VALUES, out=path)
    shutil.rmtree(path / "omega")
    with pytest.raises(FileError, match=r"all\.zarr: has lost omega: name another path"):
        pf.sweep(grip, VALUES, out=path)


def nothing(solution: pf.Solution) -> dict:
    return {"angle": float("nan"), "word": ""}


def test_chunks_without_values_are_not_lost_ones(zarr, tmp_path):
    told: list[sweeps.Progress] = []
    for _ in range(2):
        pf.sweep(grip, VALUES, out=tmp_path / "a.zarr", measure=nothing, progress=told.append)
    assert told[-1].found == 6 and told[-1].damaged == 0


def test_a_store_is_made_whole_or_not_at_all(zarr, tmp_path, monkeypatch):
    def full(*args, **options):
        raise OSError(errno.ENOSPC, "No space left on device")

    path = tmp_path / "a.zarr"
    with monkeypatch.context() as patch:
        patch.setattr(ZarrBookkeeper, "_write", full)
        with pytest.raises(pf.errors.FileError, match=r"a\.zarr: cannot be written: No space left on device$"):
            pf.sweep(grip, VALUES, out=path, measure=end)
    assert not list(tmp_path.iterdir())
    path.mkdir()  # an empty folder may become a store
    with monkeypatch.context() as patch:
        patch.setattr(zarr_chunks.ChunkedArray, "write", full)
        with pytest.raises(pf.errors.FileError, match=r"a\.zarr: cannot be written: No space left on device$"):
            pf.sweep(grip, VALUES, out=path, measure=end)
    whole = pf.sweep(grip, VALUES, measure=end)
    same(pf.sweep(grip, VALUES, out=path, measure=end), whole)


def test_two_sweeps_do_not_write_to_one_store(zarr, tmp_path):
    def second(progress: sweeps.Progress) -> None:
        with pytest.raises(pf.errors.FileError, match="another sweep is writing to it"):
            pf.sweep(grip, VALUES, out=path, measure=end)
        told.append(progress)

    path = tmp_path / "a.zarr"
    told: list[sweeps.Progress] = []
    pf.sweep(grip, VALUES, out=path, measure=end, progress=second)
    pf.sweep(grip, VALUES, out=path, measure=end, progress=told.append)
    assert told[-1].found == 6


def test_of_two_that_make_a_store_the_first_one_stays(tmp_path):
    for name in ("first", "second"):
        with making_folder(tmp_path / "a") as part:
            (part / name).touch()
    assert [each.name for each in tmp_path.rglob("*")] == ["a", "first"]


def test_a_damaged_chunk_is_found_by_who_reads_it(zarr, tmp_path):
    stored = pf.sweep(grip, VALUES, out=tmp_path / "all.zarr")
    chunk = tmp_path / "all.zarr" / "x" / "c" / "0" / "0" / "0"
    content = bytearray(chunk.read_bytes())
    content[len(content) // 2] ^= 1
    chunk.write_bytes(bytes(content))
    with pytest.raises(RuntimeError, match="checksum"):
        stored.x.load()


def test_a_folder_in_the_place_of_a_chunk_is_no_chunk(zarr, tmp_path):
    path = tmp_path / "all.zarr"
    pf.sweep(grip, VALUES, out=path)
    chunk = path / "x" / "c" / "0" / "0" / "0"
    chunk.unlink()
    chunk.mkdir()
    with pytest.raises(pf.FrictionError, match=r"all\.zarr.x.c.0.0.0: cannot be written: Is a directory"):
        pf.sweep(grip, VALUES, out=path)


def test_axes_that_cannot_be_decompressed_are_told_in_one_line(zarr, tmp_path):
    path = tmp_path / "all.zarr"
    pf.sweep(grip, VALUES, out=path)
    (path / "mass" / "c" / "0").write_bytes(b"no compressed numbers")
    with pytest.raises(pf.FrictionError, match=r"all\.zarr: no zarr store of a sweep, and none can be made") as caught:
        pf.sweep(grip, VALUES, out=path)
    assert "\n" not in str(caught.value)


def test_another_grid_needs_another_store(zarr, tmp_path):
    path = tmp_path / "all.zarr"
    pf.sweep(grip, VALUES, out=path, measure=end)
    for values in ({"grip": [1.0, 2.0, 4.0], "mass": MASSES}, {"grip": GRIPS}, {"grip": GRIPS, "t_end": [0.01]}):
        with pytest.raises(pf.FrictionError, match="holds") as caught:
            pf.sweep(grip, values, out=path, measure=end)
        assert "\n" not in str(caught.value)
    (tmp_path / "file.zarr").touch()
    with pytest.raises(pf.FrictionError):
        pf.sweep(grip, VALUES, out=tmp_path / "file.zarr", measure=end)


def test_ctrl_c_keeps_what_is_in_the_store(zarr, tmp_path):
    def press(progress: sweeps.Progress) -> None:
        if progress.done >= 2 and not pressed:
            pressed.append(1)
            os.kill(os.getpid(), signal.SIGINT)

    def slow(solution: pf.Solution) -> dict[str, float]:
        time.sleep(0.3)
        return end(solution)

    pressed: list[int] = []
    values = {"grip": np.linspace(1.0, 2.0, 40)}
    with pytest.raises(SweepInterrupted) as stop:
        pf.sweep(grip, values, out=tmp_path / "a.zarr", measure=slow, progress=press)
    done = int((stop.value.data.status == "success").sum())
    assert 2 <= done < 40 and int(stop.value.data.y.notnull().sum()) == done
    assert int((stop.value.data.status == "missing").sum()) == 40 - done


def test_a_ctrl_c_while_a_result_is_collected_ends_the_sweep(monkeypatch, tmp_path):
    asked: list[Future] = []

    def pressed(ask):
        def answer(future, timeout=None):
            asked.append(future)
            if len(asked) == 3:
                raise KeyboardInterrupt
            return ask(future, timeout)

        return answer

    for name in ("result", "exception"):
        monkeypatch.setattr(Future, name, pressed(getattr(Future, name)))
    with pytest.raises(SweepInterrupted):
        pf.sweep(grip, VALUES, out=tmp_path, measure=end)


def test_without_zarr_the_extra_is_named(tmp_path, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "zarr", None)
    with pytest.raises(pf.errors.MissingExtraError, match=r"planarfriction\[sweep\]"):
        pf.sweep(grip, VALUES, out=tmp_path / "all.zarr")


def slow_end(solution: pf.Solution) -> dict[str, float]:
    time.sleep(0.02)
    return end(solution)


def test_a_dask_cluster_that_loses_a_worker_gives_the_same_bits(tmp_path):
    distributed = pytest.importorskip("distributed", reason="needs dask: pip install 'planarfriction[sweep]'")
    values = {"grip": np.linspace(1.0, 3.0, 60)}
    killed: list[int] = []

    def kill(progress: sweeps.Progress) -> None:
        if progress.done >= 5 and not killed:
            killed.append(next(iter(cluster.workers.values())).process.pid)
            os.kill(killed[0], signal.SIGKILL)

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # dask's own, about sockets and processes that end
        with (
            distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster,
            distributed.Client(cluster) as client,
        ):
            client.run(os.chdir, str(Path(__file__).parents[2]))
            data = pf.sweep(grip, values, out=tmp_path, executor=client.get_executor(), measure=slow_end, progress=kill)
    assert killed and set(data.status.values.tolist()) == {"success"}
    alone = pf.sweep(grip, values, measure=end)
    np.testing.assert_array_equal(data.y, alone.y)
    assert len(list(tmp_path.glob("*.npz"))) == 60
