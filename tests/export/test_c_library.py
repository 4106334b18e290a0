"""C libraries against the compiled steps that they are traced from."""

import ctypes
import shutil
import subprocess

import numpy as np
import pytest

import planarfriction as pf

pytestmark = pytest.mark.skipif(shutil.which("gcc") is None, reason="needs gcc")

DISC = pf.ContactPatch.disc(0.01)
METRIC = pf.ContactPatch.rectangle(0.02, 0.01).with_friction_metric([[1.0, 0.2], [0.2, 1.5]])
LAW = pf.LuGre(mu_s=1.2, elasto_plastic=0.9)
MODELS = {
    "few": lambda: pf.ReducedModel(DISC, LAW),
    "plain": lambda: pf.ReducedModel(DISC, pf.LuGre(mu_s=1.2)),
    "one": lambda: pf.ReducedModel(DISC, LAW, parts=1),
    "three": lambda: pf.ReducedModel(DISC, LAW, parts=3),
    "distributed": lambda: pf.DistributedModel(METRIC, LAW),
    "table": lambda: pf.ReducedModelPublished(DISC, LAW),
    "potential": lambda: pf.ReducedModelPublished(METRIC, LAW, surface=pf.LimitSurfaceTable(METRIC)),
    "ellipsoid": lambda: pf.ReducedModelPublished(DISC, LAW, surface=pf.LimitSurfaceEllipsoid(DISC)),
}
STRICT = "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-O2", "-fPIC"
KINDS = {"double": (ctypes.c_double, float), "float": (ctypes.c_float, np.float32)}


def library(model, folder, precision):
    """Compile a model as C99 and as C++17 without a warning, and load it."""
    _, source = pf.export_c(model, folder, precision=precision)
    made = folder / "friction.so"
    subprocess.run(["gcc", "-std=c99", *STRICT, "-shared", "-o", made, source, "-lm"], check=True)
    subprocess.run(["gcc", "-x", "c++", "-std=c++17", *STRICT, "-c", "-o", folder / "cpp.o", source], check=True)
    step, (real, _) = ctypes.CDLL(made).friction_step_default, KINDS[precision]
    step.argtypes = [ctypes.c_void_p, ctypes.c_void_p, real, real, ctypes.c_void_p]
    return step


def samples(model, kind, count=3000):
    """Draw states, twists, loads and steps from rest to slip, rounded to a precision."""
    rng = np.random.default_rng(0)
    twist = rng.normal(size=(count, 3)) * [1.0, 1.0, 150.0] * 10.0 ** rng.uniform(-6.0, -0.5, (count, 1))
    load, dt = 10.0 ** rng.uniform(-2.0, 2.0, count), 10.0 ** rng.uniform(-5.0, -2.0, count)
    load[::50], twist[::70] = 0.0, 0.0
    state, _ = model.step(np.broadcast_to(model.rest(), (count, *model.state_shape)), twist[::-1], 1.0, 1e-3)
    return [np.ascontiguousarray(each.astype(kind).astype(float)) for each in (state, twist, load, dt)]


@pytest.mark.parametrize("precision", KINDS)
@pytest.mark.parametrize("name", MODELS)
def test_steps(name, precision, tmp_path):
    model, (_, kind) = MODELS[name](), KINDS[precision]
    step = library(model, tmp_path, precision)
    state, twist, load, dt = samples(model, kind)
    new, wrench = model.step(state, twist, load, dt)
    states, twists, found = state.astype(kind), twist.astype(kind), np.empty(wrench.shape, kind)
    for i in range(len(load)):
        assert step(states[i].ctypes.data, twists[i].ctypes.data, load[i], dt[i], found[i].ctypes.data) == 0
    # errors of the wrench beside the largest per load: damping alone gives 100 f_N at 0.3 m/s
    lever = [1.0, 1.0, model.patch.contact_radius()]
    off = np.abs(found - wrench) / lever / np.maximum(load, 1e-9)[:, None]
    largest = (np.abs(wrench) / lever / np.maximum(load, 1e-9)[:, None]).max()
    assert (np.abs(states - new).max() / LAW.largest_deflection) < (1e-11 if precision == "double" else 1e-3)
    assert off.max() / largest < (1e-12 if precision == "double" else 1e-4)
    assert np.quantile(off.max(axis=1), 0.999) / largest < (1e-12 if precision == "double" else 1e-5)
    assert np.all(states[load == 0.0] == 0.0) and np.all(found[load == 0.0] == 0.0)


@pytest.mark.parametrize("place, value", [("twist", np.nan), ("state", np.inf), ("load", -1.0), ("dt", np.nan)])
def test_bad_numbers(place, value, tmp_path):
    model = MODELS["few"]()
    step = library(model, tmp_path, "double")
    given = {"state": model.rest(), "twist": np.array([0.01, 0.0, 1.0]), "load": np.ones(1), "dt": np.full(1, 1e-3)}
    given[place].flat[0] = value
    before, wrench = given["state"].copy(), np.full(3, 7.0)
    pointers = given["state"].ctypes.data, given["twist"].ctypes.data
    assert step(*pointers, given["load"][0], given["dt"][0], wrench.ctypes.data) == 2
    assert np.array_equal(given["state"], before, equal_nan=True) and np.all(wrench == 7.0)


@pytest.mark.parametrize(
    "options, words",
    [
        ({"name": "2d"}, "name must be a C identifier"),
        ({"precision": "half"}, "precision must be one of double, float"),
    ],
)
def test_bad_options(options, words, tmp_path):
    with pytest.raises(pf.FrictionError, match=words):
        pf.export_c(MODELS["few"](), tmp_path, **options)
    assert not list(tmp_path.iterdir())


def test_models_without_source(tmp_path):
    soft = pf.ReducedModel(pf.ContactPatch.disc(0.01, pressure=pf.SoftFinger(k=2.0, c=0.009, n=1.0 / 3.0)), LAW)
    with pytest.raises(pf.FrictionError, match="model must have a patch whose shape does not depend on the load"):
        pf.export_c(soft, tmp_path)
    with pytest.raises(pf.FrictionError, match="model must be one of DistributedModel"):
        pf.export_c(object(), tmp_path)
