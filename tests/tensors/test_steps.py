"""The tensor floor: it imports neither PyTorch nor JAX, and any array library can take its steps."""

import subprocess
import sys
from types import SimpleNamespace

import numpy as np
import pytest

import planarfriction as pf
from planarfriction.tensors import distributed, published, steps
from planarfriction.tensors.namespace import Namespace
from planarfriction.tensors.steps import LAW, ContactArrays

PATCH = pf.ContactPatch.from_pressure([[0.0, 3.0, 1.0], [2.0, 5.0, 0.0]], 0.005)
LAW_OF_TEST = pf.LuGre(mu_s=1.2, sigma_1=30.0, gamma=1.7, elasto_plastic=0.7)
# Which older NumPy does not call so.
NUMPY = Namespace(
    SimpleNamespace(**{**vars(np), "pow": np.power}),
    broadcast_arrays=np.broadcast_arrays,
    stop_gradient=lambda x: x,
    integers=lambda x: x.astype(int),
    widened=lambda x: x,
    narrowed=lambda result, *inputs: result,
)


def contact_of(kind):
    """Return the equations of a model, its contact over NumPy, and the model itself."""
    numbers = LAW_OF_TEST.numbers
    if kind == "distributed":
        model = pf.DistributedModel(PATCH, LAW_OF_TEST)
        cells = distributed.cells_of(model, None, float)
        return distributed, ContactArrays(numbers, cells), model
    shape = published.shape_of(PATCH, LAW_OF_TEST, None)
    values = {
        name: np.array([[value]])
        for name, value in published.values_of(LAW_OF_TEST, shape).items()
    }
    numeric = published.numbers_of(NUMPY, values, shape.surface.numbers, None)
    return (
        published,
        ContactArrays(numbers, numeric),
        pf.ReducedModelPublished(PATCH, LAW_OF_TEST),
    )


@pytest.mark.parametrize("kind", ["distributed", "published"])
def test_steps_over_numpy_are_those_of_the_compiled_models(kind):
    equations, contact, model = contact_of(kind)
    rng = np.random.default_rng(3)
    state = rng.normal(size=(40, *model.state_shape)) * (
        1e-9 if kind == "published" else 1e-6
    )
    twist = rng.normal(size=(40, 3)) * [1e-3, 1e-3, 0.2]
    load = rng.uniform(0.2, 3.0, 40)
    state[:4] = 0.0
    load[4] = 0.0
    twist[5:8] = 0.0
    found = [
        *steps.evaluate(NUMPY, equations, contact, state, twist, load),
        *steps.step(NUMPY, equations, contact, state, twist, load, np.array(1e-4)),
    ]
    wanted = [
        model.rate(state, twist, load),
        model.wrench(state, twist, load),
        *model.step(state, twist, load, 1e-4),
    ]
    for got, want in zip(found, wanted, strict=True):
        # sums of a few hundred terms, each with a rounding of 1e-16
        np.testing.assert_allclose(
            got, want, rtol=1e-12, atol=1e-12 * np.abs(want).max()
        )


def test_the_parameters_of_the_law_come_first():
    assert pf.derivatives.PARAMETERS[: len(LAW)] == LAW and LAW[-1] == "breakaway_ratio"


def test_the_floor_imports_neither_pytorch_nor_jax():
    code = (
        "import sys, pkgutil, importlib, planarfriction.tensors as floor\n"
        "for module in pkgutil.iter_modules(floor.__path__, 'planarfriction.tensors.'):\n"
        "    importlib.import_module(module.name)\n"
        "assert not {'torch', 'jax'} & set(sys.modules)\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True, timeout=120)
