"""Sweeps beside what the extra [sweep] brings: datasets as zarr stores, and a dask cluster that loses a worker."""

import os
import signal
import time
import warnings
from pathlib import Path

import numpy as np
import pytest

import planarfriction as pf
from planarfriction import sweeps
from planarfriction.sweeps import records
from tests.sweeps.test_running import GRIPS, MASSES, end, grip, kept, reference

pytestmark = pytest.mark.sweep

VALUES = {"grip": GRIPS, "mass": MASSES}


def stored(data, path):
    """Return a dataset as xarray reads it from the zarr store that it has written."""
    pytest.importorskip(
        "zarr", reason="needs zarr: pip install 'planarfriction[sweep]'"
    )
    import xarray as xr

    data.to_zarr(path, zarr_format=2, consolidated=False)
    return xr.open_zarr(path, consolidated=False)


def same(there, data):
    """Check that a store holds the data of a sweep."""
    assert set(there.variables) == set(data.variables)
    for name, each in data.variables.items():
        assert there[name].dims == each.dims and there[name].attrs == each.attrs, name
        np.testing.assert_array_equal(
            there[name].values.astype(each.dtype), each.values, err_msg=name
        )


@pytest.mark.parametrize("measure", [None, end])
def test_a_folder_becomes_a_store_finished_or_not(tmp_path, measure):
    half = {"grip": GRIPS[:2], "mass": MASSES}
    pf.sweep(grip, half, out=tmp_path / "runs", measure=measure)
    some = sweeps.finished_runs(grip, VALUES, out=tmp_path / "runs", measure=measure)
    assert some.status.values.tolist() == [
        ["success"] * 2,
        ["success"] * 2,
        ["missing"] * 2,
    ]
    same(stored(some, tmp_path / "some.zarr"), some)
    data = pf.sweep(grip, VALUES, out=tmp_path / "runs", measure=measure)
    same(stored(data, tmp_path / "all.zarr"), data)
    assert data.identical(
        reference() if measure is None else pf.sweep(grip, VALUES, measure=measure)
    )


def slow_end(solution):
    time.sleep(0.02)
    return end(solution)


def test_a_dask_cluster_that_loses_a_worker_gives_the_same_bits(tmp_path):
    distributed = pytest.importorskip(
        "distributed", reason="needs dask: pip install 'planarfriction[sweep]'"
    )
    values = {"grip": np.linspace(1.0, 3.0, 60)}
    killed = []

    def kill(progress):
        if progress.done >= 5 and not killed:
            killed.append(next(iter(cluster.workers.values())).process.pid)
            os.kill(killed[0], signal.SIGKILL)

    with warnings.catch_warnings():
        # Dask's own, about sockets and processes that end.
        warnings.simplefilter("ignore")
        with (
            distributed.LocalCluster(
                n_workers=2, threads_per_worker=1, dashboard_address=None
            ) as cluster,
            distributed.Client(cluster) as client,
        ):
            client.run(os.chdir, str(Path(__file__).parents[2]))
            data = pf.sweep(
                grip,
                values,
                out=tmp_path,
                executor=client.get_executor(),
                measure=slow_end,
                progress=kill,
            )
    assert killed and set(data.status.values.tolist()) == {"success"}
    assert data.identical(
        pf.sweep(grip, values, out=tmp_path / "alone", measure=slow_end)
    )
    here, alone = (
        records.pack(dict(sorted(kept(folder).items())))
        for folder in (tmp_path, tmp_path / "alone")
    )
    assert here == alone
