"""A grip controller with its observer in C, against those of the library on the same samples."""

import ctypes
import re
import shutil
import subprocess

import numpy as np
import pytest

import planarfriction as pf
from planarfriction.online import FrictionObserver, Hold, Measurement, SlideBy
from tests.support.c_libraries import DISC, LAW, STRICT
from tests.support.refusals import refused

pytestmark = pytest.mark.skipif(shutil.which("gcc") is None, reason="needs gcc")

MODELS = {
    "ellipsoid": lambda: pf.ReducedModelPublished(
        DISC, LAW, surface=pf.LimitSurfaceEllipsoid(DISC)
    ),
    "table": lambda: pf.ReducedModelPublished(DISC, LAW),
}
COUNT = 10_000


def observer(model, **options):
    surface = (
        model.surface if isinstance(model.surface, pf.LimitSurfaceEllipsoid) else None
    )
    return FrictionObserver(model, surface=surface, drift=0.02, **options)


def compiled(model, folder, *options):
    """Export and compile a Hold; return its functions."""
    pf.export_c(model, folder, controller=Hold(observer(model)))
    command = (
        "gcc",
        *STRICT,
        *options,
        "-shared",
        "-fPIC",
        "friction_grip.c",
        "-o",
        "grip.so",
        "-lm",
    )
    subprocess.run(command, cwd=folder, check=True)
    functions = ctypes.CDLL(folder / "grip.so")
    functions.friction_grip_update.restype = ctypes.c_double
    return functions


def recorded():
    """Return samples [T, 8] of a part that slips for 0.3 s of every second; at times numbers are missing or wrong."""
    rng = np.random.default_rng(0)
    surface = pf.LimitSurfaceTable(DISC)
    time = 1e-3 * np.arange(COUNT)
    slips = time % 1.0 < 0.3
    load = 10.0 + 3.0 * np.sin(5.0 * time)
    turning = np.column_stack(
        [np.cos(3.0 * time), np.sin(3.0 * time), 150.0 * np.sin(7.0 * time)]
    )
    wrench = (
        np.where(slips, 0.7, 0.4)[:, None] * load[:, None] * surface.wrench(turning)
    )
    wrench += rng.normal(size=(COUNT, 3)) * [0.03, 0.03, 3e-4]
    velocity = np.where(slips[:, None], 0.02 * turning, 0.0) + 1e-4 * rng.normal(
        size=(COUNT, 3)
    )
    wrench[::997] = np.nan
    velocity[np.arange(COUNT) % 8 > 0] = np.nan
    load[3000:3040] = 0.0
    load[5000:5300] = 9.0
    wrench[7000:7100] = 0.0  # sensors that die for a while
    velocity[6000:6200:8], time[8000:8050], time[9000:] = (
        (0.0, 2e-3, 0.0),
        np.nan,
        1e-3 * time[9000:],
    )
    return np.column_stack([time, wrench, load, velocity])


@pytest.mark.parametrize("name", MODELS)
def test_samples(name, tmp_path):
    """Ten seconds of sticking and slipping."""
    model = MODELS[name]()
    samples = recorded()
    functions = compiled(model, tmp_path, "-O1")
    hold = Hold(observer(model))
    grip, found = (ctypes.create_string_buffer(size) for size in (4096, 4096))
    functions.friction_grip_begin(grip)
    own, wanted = np.empty((2, COUNT, 3))
    for i, each in enumerate(samples):
        wrench = np.ascontiguousarray(each[1:4])
        velocity = np.ascontiguousarray(each[5:])
        at = [one.ctypes.data_as(ctypes.c_void_p) for one in (wrench, velocity)]
        given = (
            ctypes.c_double(each[0]),
            at[0],
            ctypes.c_double(each[4]),
            None if np.isnan(velocity[0]) else at[1],
        )
        own[i, 0] = functions.friction_grip_update(grip, *given, found)
        own[i, 1:] = np.frombuffer(found, float, 5)[3:]
        wanted[i, 0] = hold.update(Measurement(each[0], wrench, each[4], velocity))
        wanted[i, 1:] = hold.estimate.mu_c, hold.estimate.mu_s
    # It learnt, and changed its grip.
    assert abs(wanted[2999, 1] / 0.7 - 1.0) < 0.1 and np.ptp(wanted[:, 0]) > 5.0

    np.testing.assert_allclose(own, wanted, rtol=1e-9)


def test_calls_and_memory(tmp_path):
    """Nothing but `math.h` is called, nothing that changes is kept, loops count, and the stack is small."""
    compiled(MODELS["table"](), tmp_path)
    command = (
        "gcc",
        "-std=c99",
        "-O2",
        "-fno-tree-loop-distribute-patterns",
        "-fstack-usage",
        "-c",
        "friction_grip.c",
    )
    subprocess.run(command, cwd=tmp_path, check=True)
    nm = subprocess.run(
        ["nm", "friction_grip.o"],
        cwd=tmp_path,
        check=True,
        capture_output=True,
        text=True,
    ).stdout
    kinds = {line.split()[-1]: line.split()[-2].lower() for line in nm.splitlines()}
    called = {each for each, kind in kinds.items() if kind == "u"}
    assert called <= {
        "atan2",
        "erfc",
        "exp",
        "hypot",
        "log",
        "pow",
        "sincos",
        "sqrt",
        "memcpy",
    }
    assert set(kinds.values()) <= {"u", "t", "r"}
    frames = [
        line.split("\t")
        for line in (tmp_path / "friction_grip.su").read_text().splitlines()
    ]
    assert (
        all(kind == "static" for *_, kind in frames)
        and sum(int(size) for _, size, _ in frames) < 4096
    )
    source = (tmp_path / "friction_grip.c").read_text()
    assert not re.search(
        r"\b(while|do|goto)\b", re.sub(r"/\*.*?\*/", "", source, flags=re.DOTALL)
    )


@pytest.mark.parametrize(
    "controller, words",
    [
        (
            lambda own: SlideBy(own, 0.01),
            "controller must be a Hold of one part .* got SlideBy",
        ),
        (
            lambda own: Hold(observer(MODELS["table"](), batch=2)),
            "controller must be a Hold of one part",
        ),
        (lambda own: 1.0, "controller must be a Hold of one part .* got float"),
    ],
)
def test_refused(controller, words, tmp_path):
    model = MODELS["table"]()
    with refused(words, pf.FrictionError):
        pf.export_c(model, tmp_path, controller=controller(observer(model)))
    assert not list(tmp_path.iterdir())
