"""Sweeps: the dataset, what identifies a run, resuming, failures, damaged files, kills, executors."""

from __future__ import annotations

import concurrent.futures
import dataclasses
import functools
import importlib.util
import itertools
import json
import linecache
import multiprocessing
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import planarfriction as pf
from planarfriction import sweeps
from planarfriction.errors import FileError, SweepError, SweepInterrupted
from planarfriction.sweeps import keys, records, running
from planarfriction.sweeps.settings import grid_of
from tests.support.refusals import refused

LAW = pf.LuGre(mu_s=1.2, elasto_plastic=pf.ElastoPlastic(0.9))
PATCH = pf.ContactPatch.disc(0.01, cells=7)
MODEL = pf.ReducedModel(PATCH, LAW, cells=8)
FRESH = multiprocessing.get_context("spawn")
"""Forks of a process in which other tests have started JAX can hang."""

GRIPS, MASSES = [1.0, 2.0, 3.0], [0.1, 0.2]


def grip(grip, mass=0.2, t_end=0.03):
    return pf.scenes.in_hand(MODEL, normal_force=grip, mass=mass, t_end=t_end)


def end(solution):
    return {
        name: each.values[-1]
        for name, each in solution.histories.items()
        if name in {"y", "theta"}
    }


def crossed(grip, mass):
    """Fails in the solver's input where both are large."""
    return pf.scenes.in_hand(
        MODEL, normal_force=grip if grip + mass < 3.0 else -grip, t_end=0.02
    )


@functools.cache
def reference():
    """A sweep that keeps nothing, in threads."""
    return pf.sweep(grip, {"grip": GRIPS, "mass": MASSES})


# ---------------------------------------------------------------------- the dataset


def test_a_sweep_has_a_dimension_for_each_quantity_and_all_variables():
    data = reference()
    assert dict(data.sizes) == {"grip": 3, "mass": 2, "time": 4, "contact": 1}
    assert data.grip.values.tolist() == GRIPS and data.mass.values.tolist() == MASSES
    for load in GRIPS:
        for mass in MASSES:
            alone = pf.simulate(grip(load, mass)).data
            there = data.sel(grip=load, mass=mass)
            for name in alone.data_vars:
                np.testing.assert_array_equal(
                    there[name].values, alone[name].values, err_msg=name
                )
                assert (
                    there[name].attrs == alone[name].attrs
                    and there[name].dims == alone[name].dims
                )
    assert set(data.status.values.ravel()) == {"success"} and (data.failure == "").all()
    assert len(set(data.run.values.ravel().tolist())) == 6


def test_a_measurement_is_what_it_returns():
    values = {"grip": GRIPS}
    data = pf.sweep(grip, values, measure=end)
    np.testing.assert_array_equal(
        data.y, [end(pf.simulate(grip(load)))["y"] for load in GRIPS]
    )
    number = pf.sweep(grip, values, measure=lambda solution: solution.statistics.steps)
    assert number.measured.dims == ("grip",) and number.measured.dtype.kind == "i"
    whole = pf.sweep(
        grip,
        values,
        measure=lambda solution: solution.data[["x", "fx"]].isel(
            time=slice(None, None, 3)
        ),
    )
    assert whole.fx.dims == (
        "grip",
        "time",
        "contact",
    ) and whole.time.values.tolist() == [0.0, 0.03]
    arrays = pf.sweep(
        grip,
        values,
        measure=lambda s: {"pair": np.arange(2.0), "how": s.status, "still": True},
    )
    assert (
        arrays.pair.dims == ("grip", "pair_index")
        and arrays.how.values.tolist() == ["success"] * 3
    )
    assert arrays.still.dtype == bool


def test_runs_of_different_length_share_their_instants():
    def slide(speed, t_end):
        return pf.scenes.free_slide(
            MODEL, twist=(speed, 0.0, 0.0), t_end=t_end, save_every=0.01
        )

    data = pf.sweep(slide, {"speed": [0.1, 1.0], "t_end": [0.05, 0.2]})
    np.testing.assert_allclose(data.time, 0.01 * np.arange(21), atol=1e-12)
    fast = data.sel(speed=1.0, t_end=0.05)
    slow = data.sel(speed=0.1, t_end=0.2)
    # NaN where it has no instants.
    assert fast.status == "success" and fast.x.notnull().sum() == 6
    alone = pf.simulate(slide(0.1, 0.2)).data
    assert slow.status == "at rest" and len(alone.time) < 21
    # what is at rest stays there: the end of every run is in the last instant that it was to record
    assert float(slow.x[-1]) == float(alone.x[-1]) and slow.x.notnull().all()
    assert data.sel(speed=0.1, t_end=0.05).x[6:].isnull().all()


def slide(speed, t_end=0.03):
    return pf.scenes.free_slide(MODEL, twist=(speed, 0.0, 0.0), t_end=t_end)


def test_bristles_are_recorded_on_request_and_runs_without_them_do_not_count(tmp_path):
    speeds = {"speed": [0.1, 1.0]}
    pf.sweep(slide, speeds, out=tmp_path)
    reports = []
    options = {"out": tmp_path, "bristles": "all"}
    data = pf.sweep(slide, speeds, progress=reports.append, **options)
    assert reports[-1].found == 0
    alone = pf.simulate(slide(1.0), bristles="all").data.bristles_table
    there = data.bristles_table.sel(speed=1.0)
    assert there.dims == alone.dims and there.attrs == alone.attrs
    np.testing.assert_array_equal(there, alone)
    assert sweeps.finished_runs(slide, speeds, **options).identical(data)
    without = sweeps.finished_runs(slide, speeds, out=tmp_path)
    assert "bristles_table" not in without and "missing" not in without.status


def in_a_field(solution):
    return pf.tactile.read(solution, points=[[0.0, 0.0], [5e-3, 0.0]])


def test_a_measured_solution_is_kept_with_its_fields_over_common_instants(tmp_path):
    """The slow run comes to rest before it ends, and keeps its last values."""
    speeds, options = {"speed": [0.02, 1.0]}, {"bristles": "all", "out": tmp_path}
    data = pf.sweep(slide, speeds, measure=in_a_field, **options)
    slow, fast = (
        in_a_field(pf.simulate(slide(v), bristles="all")).data for v in (0.02, 1.0)
    )
    assert data.status.values.tolist() == ["at rest", "success"]
    assert len(slow.time) < len(data.time) == len(fast.time)
    for name in ("slip_ratio_table", "displacement_table", "forces_table", "x"):
        assert data[name].dims == ("speed", *fast[name].dims)
        np.testing.assert_array_equal(data[name][1], fast[name])
        np.testing.assert_array_equal(data[name][0, -1], slow[name][-1])
    assert data.slip_ratio_table.attrs == fast.slip_ratio_table.attrs
    again = pf.sweep(slide, speeds, measure=in_a_field, **options)
    assert again.identical(data) and len(list(tmp_path.glob("runs-*.npz"))) == 1


def test_values_of_any_kind_have_labels():
    def with_model(model, kind, load):
        assert type(load) is int and isinstance(model, pf.ReducedModel)
        return dataclasses.replace(
            pf.scenes.in_hand(model, normal_force=load, t_end=0.01), name=kind
        )

    other = dataclasses.replace(MODEL, law=pf.LuGre())
    values = {
        "model": {"sticky": MODEL, "plain": other},
        "kind": ["a"],
        "load": np.array([1, 2]),
    }
    data = pf.sweep(with_model, values, measure=end)
    assert data.model.values.tolist() == ["sticky", "plain"] and data.y.shape == (
        2,
        1,
        2,
    )


# ---------------------------------------------------------------------- what a run is


def test_equal_scenes_are_one_run_and_others_are_others():
    def digest(scene, measure=None):
        return keys.Keys(measure, kept=False).key(scene)

    scene = grip(2.0)
    rebuilt = pf.Scene.from_dict(grip(2.0).to_dict())
    assert digest(scene) == digest(rebuilt) and len(digest(scene)) == 32
    pf.simulate(scene)  # what a model has built on the way is not part of it
    assert digest(scene) == digest(rebuilt)
    law = dataclasses.replace(MODEL, law=pf.LuGre(mu_s=1.2 + 1e-15))
    others = [
        grip(2.0 + 1e-15),
        dataclasses.replace(scene, rtol=2e-5),
        dataclasses.replace(scene, save_every=0.02),
        pf.scenes.in_hand(law, normal_force=2.0, t_end=0.03),
        pf.scenes.in_hand(
            pf.DistributedModel(PATCH, LAW), normal_force=2.0, t_end=0.03
        ),
        *(
            pf.scenes.in_hand(
                dataclasses.replace(MODEL, patch=patch), normal_force=2.0, t_end=0.03
            )
            for patch in (
                pf.ContactPatch.disc(0.01 + 1e-15, cells=7),
                pf.ContactPatch.disc(0.01, cells=7, name="pad"),
            )
        ),
    ]
    one = keys.Keys(None, kept=False)  # which has the digests of earlier parts
    for found in (
        set(map(digest, [scene, *others])),
        set(map(one.key, [scene, *others, scene])),
    ):
        assert len(found) == 8
    assert digest(scene, end) != digest(scene)


def measure_in(file, lines):
    """Return the function `measure` of a file with these lines."""
    file.write_text(lines)
    linecache.checkcache()
    spec = importlib.util.spec_from_file_location("mine", file)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.measure


def test_a_measurement_counts_by_its_name_and_source(tmp_path):
    text = "def measure(solution):\n    return 1.0\n"
    names = [
        keys.name_of(measure_in(tmp_path / "a.py", lines), kept=True)
        for lines in (text, "# moved\n\n" + text)
    ]
    assert names[0] == names[1] and names[0] != keys.name_of(end, kept=True)
    assert (
        keys.name_of(
            measure_in(tmp_path / "a.py", text.replace("1.0", "2.0")), kept=True
        )
        != names[0]
    )


def test_runs_of_a_nameless_measurement_are_not_kept(tmp_path):
    """They could not be found again; in memory it may be anything."""

    def near(limit):
        return lambda solution: float(solution.histories["y"].values[-1] < limit)

    for nameless in (near(1.0), functools.partial(end), lambda solution: 1.0):
        with refused("measure must be a function with a name", pf.FrictionError):
            pf.sweep(grip, {"grip": [1.0]}, out=tmp_path, measure=nameless)
    assert pf.sweep(
        grip, {"grip": [1.0]}, measure=near(1.0)
    ).measured.values.tolist() == [1.0]


def test_runs_of_a_model_that_files_do_not_know_are_not_kept(tmp_path):
    class Mine(pf.DistributedModel):
        """A class that is not registered."""

    def make(grip):
        return pf.scenes.in_hand(Mine(PATCH, LAW), normal_force=grip, t_end=0.01)

    assert (
        pf.sweep(make, {"grip": [1.0, 2.0]}, measure=end).status.values.tolist()
        == ["success"] * 2
    )
    with refused(r"model must be one of .*registered", pf.FrictionError):
        pf.sweep(make, {"grip": [1.0]}, out=tmp_path)


def test_a_run_of_another_library_does_not_count(tmp_path, monkeypatch):
    pf.sweep(grip, {"grip": [1.0]}, out=tmp_path)
    monkeypatch.setattr(keys, "library_version", lambda: "another")
    assert found(tmp_path, [1.0]) == 0


def found(folder, grips, **options):
    """Return the number of runs that a folder of a sweep holds."""
    told = []
    pf.sweep(grip, {"grip": grips}, out=folder, progress=told.append, **options)
    assert told[-1].done == told[-1].runs == len(grips)
    return told[-1].found


def kept(folder):
    """Return the runs in the files of a folder, by their keys."""
    runs = {}
    for file in folder.glob("runs-*.npz"):
        runs |= records.unpack(file.read_bytes())
    return runs


# ---------------------------------------------------------------------- going on


def test_a_sweep_goes_on_where_another_has_ended(tmp_path):
    values = {"grip": GRIPS, "mass": MASSES}
    pf.sweep(grip, {"mass": MASSES, "grip": GRIPS[:2]}, out=tmp_path)
    told = []
    data = pf.sweep(grip, values, out=tmp_path, progress=told.append)
    assert data.identical(reference())  # whichever came from files
    assert told[-1][:5] == (6, 6, 4, 0, 0) and str(told[-1]) == "6 of 6 runs (4 found)"
    assert kept(tmp_path).keys() == set(data.run.values.ravel().tolist())


def test_progress_is_told_twice_a_second_and_at_the_end(monkeypatch):
    clock = [100.0]
    told = []
    monkeypatch.setattr(running, "time", SimpleNamespace(monotonic=lambda: clock[0]))
    going = running.Sweeping(
        grip, {"grip": np.arange(8.0)}, None, "none", None, told.append
    )
    book = going.book
    book.found = 2
    book.failed = 1
    for passed, at_once, count in (
        (0.4, False, 0),
        (0.2, False, 1),
        (0.4, False, 1),
        (0.1, False, 2),
        (0.1, True, 3),
    ):
        clock[0] += passed
        book.new += 1
        going._tell(at_once)
        assert len(told) == count
    assert told[0][:5] == (8, 4, 2, 1, 0) and told[0].left == pytest.approx(0.6 / 2 * 4)
    assert told[2].left == pytest.approx(1.2 / 5 * 1)


def test_damaged_files_do_not_count(tmp_path):
    for load in GRIPS:
        pf.sweep(grip, {"grip": [load]}, out=tmp_path)
    data = pf.sweep(grip, {"grip": GRIPS})
    whole, cut, changed = sorted(tmp_path.glob("*.npz"))
    cut.write_bytes(cut.read_bytes()[:-40])
    content = bytearray(changed.read_bytes())
    content[len(content) // 2] ^= 1
    changed.write_bytes(bytes(content))
    (tmp_path / ".planarfriction-0123.part").write_bytes(whole.read_bytes()[:100])
    told = []
    again = pf.sweep(grip, {"grip": GRIPS}, out=tmp_path, progress=told.append)
    assert (
        told[-1].found == 1
        and told[-1].damaged == 2
        and "2 damaged and done again" in str(told[-1])
    )
    assert again.identical(data)
    assert found(tmp_path, GRIPS) == 3 and not cut.exists() and not changed.exists()


def test_a_folder_in_place_of_a_file_changes_nothing(tmp_path):
    pf.sweep(grip, {"grip": GRIPS}, out=tmp_path)
    (file,) = tmp_path.glob("*.npz")
    file.unlink()
    file.mkdir()
    with refused("cannot be written: it is a folder", FileError):
        pf.sweep(grip, {"grip": GRIPS}, out=tmp_path)
    fails = pf.sweep(crossed, {"grip": GRIPS, "mass": MASSES})
    (tmp_path / f"{fails.run.values[2, 0]}.failed.json").mkdir()
    again = pf.sweep(crossed, {"grip": GRIPS, "mass": MASSES}, out=tmp_path)
    assert again.failure.values.tolist() == fails.failure.values.tolist()


def test_files_hold_what_runs_have_left_and_nothing_is_lost():
    variables = {
        "y": records.History(("time",), np.array([0.0, -0.0, np.nan]), {"units": "m"}),
        "how many/ever φ": records.History((), np.array(3), {}),
        "file": records.History(("n",), np.array(["a", "bcd"]), {}),
    }
    other = {**variables, "file": records.History(("n",), np.array(["a", "b"]), {})}
    runs = {
        name: records.Record("success", "", each, 1.5)
        for name, each in (("a", variables), ("b", other))
    }
    runs["c"] = runs["a"]._replace(status="at rest")
    content = records.pack(runs)
    back = records.unpack(content)
    assert back.keys() == runs.keys() and records.pack(back) == content
    for key, record in runs.items():
        assert back[key][:2] == record[:2] and back[key].end == 1.5
        for name, each in record.variables.items():
            found = back[key].variables[name]
            assert found == each and found.values.dtype == each.values.dtype


def test_failures_are_recorded_with_reason_and_scene_and_are_no_end(tmp_path):
    data = pf.sweep(
        crossed, {"grip": GRIPS, "mass": MASSES}, out=tmp_path / "a", measure=end
    )
    assert data.status.values.tolist() == [
        ["success"] * 2,
        ["success"] * 2,
        ["failed"] * 2,
    ]
    assert data.y.isnull().values.tolist() == (data.status == "failed").values.tolist()
    assert "normal_force of contact 'fingers' must be >= 0, got -3.0" in str(
        data.failure.values[2, 0]
    )

    def picky(solution):
        if solution.histories["normal_force"].values[-1, 0] == 2.0:
            raise ValueError("two\nis bad")
        return 1.0

    data = pf.sweep(grip, {"grip": GRIPS}, out=tmp_path / "b", measure=picky)
    assert data.failure.values.tolist() == ["", "measure: ValueError: two is bad", ""]
    (file,) = (tmp_path / "b").glob("*.failed.json")
    kept = json.loads(file.read_text())
    assert kept["reason"] == "measure: ValueError: two is bad" and pf.Scene.from_dict(
        kept["scene"]
    ) == grip(2.0)
    assert file.name == f"{data.run.values[1]}.failed.json"
    again = found(tmp_path / "b", GRIPS, measure=picky)
    assert again == 2  # the failure is tried again


def test_a_run_that_worked_at_last_is_no_failure_any_more(tmp_path, monkeypatch):
    values = {"grip": [1.0, 2.0]}
    simulate = pf.scenes.simulate

    def full(scene, **options):
        if scene == grip(2.0):
            raise MemoryError
        return simulate(scene, **options)

    monkeypatch.setitem(vars(pf.scenes), "simulate", full)
    assert pf.sweep(grip, values, out=tmp_path).failure.values.tolist() == [
        "",
        "MemoryError",
    ]
    assert len(list(tmp_path.glob("*.failed.json"))) == 1
    monkeypatch.undo()
    assert (pf.sweep(grip, values, out=tmp_path).failure == "").all()
    assert not list(tmp_path.glob("*.failed.json"))


def test_what_does_not_fit_the_first_run_is_a_failure():
    def uneven(solution):
        return {
            "a": np.zeros(
                2 if solution.histories["normal_force"].values[-1, 0] < 3.0 else 3
            )
        }

    data = pf.sweep(grip, {"grip": GRIPS}, measure=uneven)
    assert data.failure.values.tolist() == [
        "",
        "",
        "a has shape [3] where the first run has [2]",
    ]
    assert data.a[2].isnull().all()


MEASURED = []
"""Solutions that were measured: a measurement of kept runs uses no values from around it."""


def test_ctrl_c_keeps_what_is_done(tmp_path):
    """In this process, in its main thread, while threads work."""
    main = threading.main_thread().ident

    def press(progress):
        if progress.done >= 2 and not pressed:
            pressed.append(progress.done)
            signal.pthread_kill(main, signal.SIGINT)

    def slow(solution):
        time.sleep(0.3)  # so that progress is asked for in between
        MEASURED.append(solution)
        return end(solution)

    pressed = []
    MEASURED.clear()
    values = {"grip": np.linspace(1.0, 2.0, 40)}
    with pytest.raises(SweepInterrupted) as stop:
        pf.sweep(grip, values, out=tmp_path, measure=slow, progress=press)
    done = int((stop.value.data.status == "success").sum())
    assert 2 <= done < 40 and done == len(kept(tmp_path)) == len(MEASURED)
    assert int((stop.value.data.status == "missing").sum()) == 40 - done
    assert int(stop.value.data.y.notnull().sum()) == done


KILLED = """
import sys, numpy as np, planarfriction as pf
from planarfriction.sweeps import records
from tests.sweeps import test_running as t
records.BETWEEN = 0.01
pf.sweep(t.grip, {"grip": np.linspace(1.0, 3.0, int(sys.argv[2]))}, out=sys.argv[1], measure=t.end)
"""


def kill_on_the_way(folder, runs, after):
    """Begin a sweep in another process, kill it when some runs are there; returns how many there are then.

    That they are found afterwards shows too that digests are the same in every process.
    """
    paths = os.pathsep.join([str(Path(__file__).parents[2]), *sys.path])
    environment = {
        **os.environ,
        "PYTHONPATH": paths,
        "PYTHONHASHSEED": str(runs + after),
    }
    process = subprocess.Popen(
        [sys.executable, "-c", KILLED, str(folder), str(runs)], env=environment
    )
    try:
        limit = time.monotonic() + 300.0
        while len(kept(folder)) < after:
            assert process.poll() is None and time.monotonic() < limit
            time.sleep(0.002)
    finally:
        process.kill()
        process.wait()
    return len(kept(folder))


def after_a_kill(folder, runs, after):
    there = kill_on_the_way(folder, runs, after)
    assert after <= there < runs
    grips = np.linspace(1.0, 3.0, runs).tolist()
    assert found(folder, grips, measure=end) == there  # none is lost, none is half
    assert len(kept(folder)) == runs
    data = pf.sweep(grip, {"grip": grips}, out=folder, measure=end)
    assert data.identical(pf.sweep(grip, {"grip": grips}, measure=end))


def test_a_killed_sweep_goes_on_with_the_same_bits(tmp_path):
    after_a_kill(tmp_path, 400, 30)


@pytest.mark.slow
def test_ten_thousand_runs_go_on_after_kills(tmp_path):
    for after in (500, 2000, 5000):
        kill_on_the_way(tmp_path, 10_000, after)
    after_a_kill(tmp_path, 10_000, 7000)


def test_long_sweeps_have_few_files(tmp_path, monkeypatch):
    """A file comes after half a second and a fiftieth of the time so far, and holds the runs since the last one."""
    clock = itertools.count()
    monkeypatch.setattr(records, "monotonic", lambda: 0.1 * next(clock))
    book = records.Bookkeeper(grid_of({"a": [1.0]}), tmp_path)
    for number in range(10_000):  # 1,000 s
        book.add((0,), str(number), records.Record("success", "", {}), None)
        book.flush()
    book.flush(at_once=True)
    files = list(tmp_path.glob("runs-*.npz"))
    assert 100 < len(files) < 200 and len(kept(tmp_path)) == 10_000
    assert sum(len(records.unpack(file.read_bytes())) for file in files) == 10_000


# ---------------------------------------------------------------------- executors


def test_a_ctrl_c_while_a_result_is_collected_ends_the_sweep(monkeypatch, tmp_path):
    asked = []

    def pressed(ask):
        def answer(future, timeout=None):
            asked.append(future)
            if len(asked) == 3:
                raise KeyboardInterrupt
            return ask(future, timeout)

        return answer

    for name in ("result", "exception"):
        monkeypatch.setattr(
            concurrent.futures.Future,
            name,
            pressed(getattr(concurrent.futures.Future, name)),
        )
    with pytest.raises(SweepInterrupted):
        pf.sweep(grip, {"grip": GRIPS, "mass": MASSES}, out=tmp_path, measure=end)


def test_any_executor_gives_the_same_bits():
    with concurrent.futures.ThreadPoolExecutor(3) as pool:
        data = pf.sweep(grip, {"grip": GRIPS, "mass": MASSES}, executor=pool)
    assert data.identical(reference())
    backwards = pf.sweep(grip, {"mass": MASSES[::-1], "grip": GRIPS[::-1]})
    turned = backwards.transpose("grip", "mass", ...).sel(grip=GRIPS, mass=MASSES)
    assert turned.x.identical(reference().x) and turned.run.identical(reference().run)


class Handed(concurrent.futures.ThreadPoolExecutor):
    """Records how many scenes it is handed at a time, and refuses to hand on one of them."""

    def __init__(self, refused=0.0):
        super().__init__(1)
        self.batches: list[int] = []
        self._refused = refused

    def submit(self, function, batch):
        self.batches.append(len(batch.scenes))
        if any(
            scene.contacts[0].normal_force(0.0) == self._refused
            for scene in batch.scenes
        ):
            future = concurrent.futures.Future()
            future.set_exception(TypeError("cannot pickle it"))
            return future
        return super().submit(function, batch)


def late(solution):
    """Take longer for the last runs than a worker keeps results to itself."""
    if solution.histories["normal_force"].values[-1, 0] > 2.0:
        time.sleep(1.1 * records.TURN)
    return end(solution)


def test_short_runs_are_handed_out_together_and_long_ones_alone():
    short = np.linspace(1.0, 2.0, 40).tolist()
    long = [3.0, 4.0, 5.0, 6.0]
    for grips, most, again in (
        (short, range(2, 41), 0),
        (short + long, range(2, 45), 1),
        (long, [1], 0),
    ):
        with Handed() as pool:
            data = pf.sweep(grip, {"grip": grips}, executor=pool, measure=late)
        assert max(pool.batches) in most
        assert sum(pool.batches) >= len(grips) + again
        np.testing.assert_array_equal(
            data.y, pf.sweep(grip, {"grip": grips}, measure=end).y
        )


def test_batches_become_smaller_towards_the_end():
    with Handed() as pool:
        pf.sweep(
            grip,
            {"grip": np.linspace(1.0, 2.0, 40).tolist()},
            executor=pool,
            measure=end,
        )
    # Two, if two are left: that hangs on how long the others took.
    assert pool.batches[-1] <= 2 < max(pool.batches)


class Silent(concurrent.futures.Executor):
    """Tells no number of workers, and does nothing before it is asked to; records how much it holds."""

    def __init__(self):
        self.held: list[tuple] = []
        self.batches: list[int] = []
        self.ended = False

    def submit(self, function, batch):
        future = concurrent.futures.Future()
        self.held.append((future, function, batch))
        self.batches.append(len(batch.scenes))
        return future

    def work(self):
        """Do what is held, the first of it after a while in which nothing more comes."""
        count = -1
        while count < len(self.held):
            count = len(self.held)
            time.sleep(0.3)
        self.before = count
        # What a slow machine leaves of a batch is handed out again.
        while not self.ended:
            if self.held:
                future, function, batch = self.held.pop(0)
                future.set_result(function(batch))


def test_an_executor_of_unknown_size_gets_single_runs_at_first():
    pool = Silent()
    worker = threading.Thread(target=pool.work, daemon=True)
    worker.start()
    data = pf.sweep(
        grip, {"grip": np.linspace(1.0, 2.0, 300).tolist()}, executor=pool, measure=end
    )
    pool.ended = True
    worker.join()
    assert pool.before == 64
    assert set(pool.batches[:64]) == {1} != set(pool.batches[64:])
    assert (data.status == "success").all()


def test_what_cannot_be_sent_fails_alone():
    values = {
        "grip": [
            *np.linspace(1.0, 2.0, 40).tolist(),
            3.0,
            *np.linspace(4.0, 5.0, 9).tolist(),
        ]
    }
    with Handed(refused=3.0) as pool:
        data = pf.sweep(grip, values, executor=pool, measure=end)
    assert max(pool.batches) > 1
    assert data.grip[data.status == "failed"].values.tolist() == [3.0]
    assert data.failure.sel(grip=3.0) == "TypeError: cannot pickle it"


def leave(solution):
    os._exit(1)


# Python 3.11 tells futures of a pool that broke, also those that were cancelled a moment before: its thread raises
@pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")
def test_processes_give_the_same_bits_take_no_lambda_and_may_die(tmp_path):
    with concurrent.futures.ProcessPoolExecutor(1, FRESH) as pool:
        with refused(
            "measure must be a function that other processes can import",
            pf.FrictionError,
        ):
            pf.sweep(grip, {"grip": GRIPS}, executor=pool, measure=lambda solution: 1.0)
        data = pf.sweep(grip, {"grip": GRIPS, "mass": MASSES}, executor=pool)
        with pytest.raises(SweepError, match="finished runs are kept"):
            pf.sweep(grip, {"grip": GRIPS}, executor=pool, measure=leave, out=tmp_path)
    assert data.identical(reference())
    with pytest.raises(SweepError, match="the executor ended"):  # it takes no more
        pf.sweep(grip, {"grip": GRIPS}, executor=pool)


def test_a_run_is_what_its_scene_gives_alone():
    """Parts that are kept from run to run belong to the run that uses them."""

    def make(mu, size, load):
        model = pf.ReducedModel(
            pf.ContactPatch.disc(size, cells=11), pf.LuGre(mu_c=mu, mu_s=1.2 * mu)
        )
        return pf.scenes.in_hand(
            model, normal_force=pf.Signal([0.0, 0.015], [load, 0.5 * load]), t_end=0.03
        )

    values = {"mu": [0.6, 0.9], "size": [0.01, 0.012], "load": [2.0, 3.0]}
    swept = pf.sweep(make, values)
    seen = set()
    for mu, size, load in itertools.product(*values.values()):
        scene = pf.Scene.from_dict(make(mu, size, load).to_dict())
        alone = pf.simulate(scene).histories["y"].values
        assert (swept.y.sel(mu=mu, size=size, load=load).values == alone).all()
        seen.add(alone.tobytes())
    assert len(seen) == 8


def test_models_are_built_once_for_equal_scenes():
    """A `make_scene` that makes a new model for every run shares its maps all the same."""
    seen = set()

    def make(grip):
        return pf.scenes.in_hand(
            pf.ReducedModel(PATCH, LAW, cells=8), normal_force=grip, t_end=0.01
        )

    def look(solution):
        seen.add(id(solution.scene.contacts[0].model))
        return 0.0

    pf.sweep(make, {"grip": GRIPS}, measure=look)
    assert len(seen) == 1


@pytest.mark.parametrize(
    ("seconds", "words"),
    [
        (89.0, "89 s"),
        (90.0, "2 min"),
        (5300.0, "88 min"),
        (5400.0, "1.5 h"),
        (9000.0, "2.5 h"),
    ],
)
def test_what_is_left_is_said_in_the_unit_that_one_would_use(seconds, words):
    assert (
        str(sweeps.Progress(10, 4, 1, 0, 0, seconds))
        == f"4 of 10 runs (1 found), {words} left"
    )


def test_the_first_failure_is_that_of_the_grid_whatever_ends_first():
    book = records.Bookkeeper(grid_of({"load": [1.0, 2.0]}))
    for i in (1, 0):
        book.add((i,), "", records.Record(records.FAILED, f"reason {i}", {}), None)
    assert book.first_failure() == "load=1.0: reason 0"
