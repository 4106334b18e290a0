"""Steps that CasADi loads, with their Jacobians."""

import shutil
import subprocess

import numpy as np
import pytest

import planarfriction as pf
from tests.support.c_libraries import HUNG, MODELS, PADS, STRICT, samples
from tests.support.refusals import refused

ca = pytest.importorskip("casadi", reason="needs the extra [casadi]")
pytestmark = [
    pytest.mark.casadi,
    pytest.mark.skipif(shutil.which("gcc") is None, reason="needs gcc"),
]


@pytest.fixture(
    scope="module", params=["few", "table", "discs at a load", "half-space"]
)
def loaded(request, tmp_path_factory):
    """Return a model, its function in CasADi, inputs and the model's parameters."""
    model = (MODELS | PADS | HUNG)[request.param]()
    folder = tmp_path_factory.mktemp("casadi")
    pf.export_c(model, folder, casadi=True)
    command = [
        "gcc",
        *STRICT,
        "-O1",
        "-shared",
        "-fPIC",
        "friction.c",
        "friction_casadi.c",
        "-o",
        "friction.so",
        "-lm",
    ]
    subprocess.run(command, cwd=folder, check=True)
    step = ca.external("friction_casadi", str(folder / "friction.so"))
    law = model.law.numbers
    params = [
        law.sigma_0,
        law.sigma_1,
        law.sigma_2,
        law.mu_c,
        law.mu_s,
        law.v_s,
        law.breakaway_ratio,
    ]
    params = params[2:] if request.param in HUNG else params
    inputs = [each[1::2][:20] for each in samples(model, np.float64, 40)]
    inputs[0], inputs[2] = inputs[0].reshape(20, -1), np.maximum(inputs[2], 0.1)
    return model, step, inputs, params


def test_steps(loaded):
    model, step, inputs, params = loaded
    assert step.name_in() == ["state", "twist", "normal_force", "dt", "params"]
    for state, *given in zip(*inputs, strict=True):
        new, wrench = model.step(state.reshape(model.state_shape), *given)
        found = step(state, *given, params)
        np.testing.assert_allclose(
            found[0].full()[:, 0], new.ravel(), atol=1e-12 * np.abs(new).max()
        )
        np.testing.assert_allclose(
            found[1].full()[:, 0], wrench, atol=1e-11 * np.abs(wrench).max()
        )


def test_jacobians(loaded):
    """Derivatives of what CasADi builds from the function are those of the model, and differences."""
    model, step, inputs, params = loaded
    symbols = [
        ca.MX.sym(name, step.size_in(i)) for i, name in enumerate(step.name_in())
    ]
    _, wrench = step(*symbols)
    slopes = ca.Function(
        "slopes", symbols, [ca.jacobian(wrench, each) for each in symbols]
    )
    twice = ca.Function(
        "twice",
        symbols,
        [ca.jacobian(step(step(*symbols)[0], *symbols[1:])[1], symbols[0])],
    )
    for state, *given in zip(*inputs, strict=True):
        exact = model.step_jacobians(state.reshape(model.state_shape), *given)
        by_state, by_twist, by_load, by_dt, by_law = (
            each.full() for each in slopes(state, *given, params)
        )
        scale = np.abs(exact.wrench_twist).max()
        np.testing.assert_allclose(by_twist, exact.wrench_twist, atol=1e-9 * scale)
        np.testing.assert_allclose(
            by_load[:, 0],
            exact.wrench_load,
            # Python has differences there.
            atol=(1e-6 if model.pad else 1e-9) * np.abs(exact.wrench_load).max(),
        )
        assert by_state.shape == (3, state.size) and by_law.shape == (3, len(params))
        new, _ = (each.full() for each in step(state, *given, params))
        first = model.step_jacobians(
            new.reshape(model.state_shape), *given
        ).wrench_state.reshape(3, -1)
        own = exact.state_state  # of cells [2, 2, N], else [3, 3]
        own = (
            own
            if own.ndim == 2
            else np.block([[np.diag(each) for each in row] for row in own])
        )
        chained = step.jacobian()(state, *given, params, new, np.zeros(3))[0].full()
        np.testing.assert_allclose(
            chained, own, atol=1e-9 * max(np.abs(own).max(), 1e-6)
        )
        wanted = first @ own
        # A stuck patch has slopes of 1e6; where all has slipped they are what rounding leaves.
        scale = max(np.abs(first).max(), 1.0)
        np.testing.assert_allclose(
            twice(state, *given, params).full(), wanted, atol=1e-9 * scale
        )
        ends = [
            step(state, *given[:2], given[2] * (1.0 + sign * 1e-4), params)[1].full()
            for sign in (1.0, -1.0)
        ]
        # Of differences of equal wrenches.
        noise = 1e-8 * np.abs(ends[0]).max() / given[2]
        difference = (ends[0] - ends[1]) / (2e-4 * given[2])
        np.testing.assert_allclose(
            by_dt, difference, rtol=1e-2, atol=1e-4 * np.abs(difference).max() + noise
        )


def test_single_precision_is_refused(tmp_path):
    with refused("precision must be double for CasADi", pf.FrictionError):
        pf.export_c(MODELS["few"](), tmp_path, precision="float", casadi=True)
