"""The PyTorch modules: closed forms, agreement with the NumPy models, valid ranges, gradients at and off the kinks."""

import numpy as np
import pytest

import planarfriction as pf
from planarfriction.derivatives import PARAMETERS
from tests.support.refusals import refused

torch = pytest.importorskip(
    "torch", reason="needs PyTorch: pip install 'planarfriction[torch]'"
)

from planarfriction.torch import DistributedModel, ReducedModel, ReducedModelPublished  # noqa: E402

pytestmark = pytest.mark.torch

RNG = np.random.default_rng(4)
PATCH = pf.ContactPatch.from_pressure(
    RNG.uniform(0.0, 1.0, (5, 6)), 0.002, name="lopsided"
)
PLAIN = pf.LuGre(mu_s=1.2, sigma_1=30.0, gamma=1.7)
ELASTIC = pf.LuGre(
    mu_s=1.2, sigma_1=30.0, gamma=1.7, elasto_plastic=pf.ElastoPlastic(0.7)
)
LAWS = {"plain": PLAIN, "elasto-plastic": ELASTIC}
SURFACES = {
    "published": None,
    "table": pf.LimitSurfaceTable(PATCH),
    "ellipsoid": pf.LimitSurfaceEllipsoid(PATCH),
    "cells": pf.LimitSurfaceCells(PATCH),
}
STATE_SIZE, TWIST_SIZE = np.array([1e-6, 1e-6, 5e-9]), np.array([1e-3, 1e-3, 0.2])

every_law = pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
every_surface = pytest.mark.parametrize("surface", SURFACES.values(), ids=SURFACES)


def tensor(value):
    return torch.tensor(np.asarray(value), dtype=torch.float64)


def reduced(law=ELASTIC, surface=None, **options):
    return ReducedModelPublished(
        PATCH, law, surface, **{"dtype": torch.float64, **options}
    )


def distributed(law=ELASTIC, **options):
    return DistributedModel(PATCH, law, **{"dtype": torch.float64, **options})


def samples(count, rng):
    """States, twists from far below to far above the Stribeck speed, and loads; the first ones stand on kinks."""
    state = rng.normal(size=(count, 3)) * STATE_SIZE
    twist = (
        rng.normal(size=(count, 3))
        * TWIST_SIZE
        * 10.0 ** rng.uniform(-2, 2, (count, 1))
    )
    load = rng.uniform(0.2, 3.0, count)
    twist[:6] = [
        [0, 0, 0],
        [0, 0, 0.3],
        [0, 0, -0.3],
        [0, 2e-3, 0],
        [-2e-3, 0, 0],
        [1e-3, 1e-3, 0],
    ]
    state[4:8] = 0.0
    load[8] = 0.0
    return state, twist, load


def assert_equal(tensors, arrays):
    """To 1e-12 of the largest: sums of a few hundred terms, each with a rounding of 1e-16."""
    for got, wanted in zip(tensors, arrays, strict=True):
        got = got.detach().numpy()
        assert got.shape == wanted.shape
        np.testing.assert_allclose(
            got, wanted, rtol=1e-12, atol=1e-12 * np.abs(wanted).max()
        )


# ---------------------------------------------------------------------------------------- closed forms


@every_surface
def test_the_steady_torque_of_a_spin_is_bounded_by_static_friction(surface):
    # A published snippet forgets one factor r in the torque: it gives mu f_N, 100 times too much here.
    law = pf.LuGre(mu_c=0.8, mu_s=1.0, sigma_2=0.0)
    load = 2.0
    model = reduced(law, surface)
    r = model.value("contact_radius").item()
    x, y = PATCH.centre_of_pressure()
    for omega in (1e-4, 0.05, 0.2, 1.0, 50.0):
        z = model.rest()
        twist = tensor([omega * y, -omega * x, omega])  # about the centre of pressure
        for _ in range(60):
            z, wrench = model.step(z, twist, load, 1.0)
        torque = (wrench[2] - (x * wrench[1] - y * wrench[0])).item()
        g = 0.8 + 0.2 * np.exp(-((r * omega / 1e-3) ** 2))
        assert abs(torque) <= 1.0 * load * r * (1 + 1e-9)
        # the torque of a spin is mu f_N r, whatever the surface; the smooth table interpolates it at its pole exactly
        assert torque == pytest.approx(-g * load * r, rel=1e-6)


@pytest.mark.parametrize(
    "model", [reduced(PLAIN), distributed(PLAIN)], ids=["reduced", "distributed"]
)
def test_sliding_straight_has_the_friction_of_the_stribeck_curve(model):
    for speed in (1e-5, 1e-3, 0.1):
        z = model.rest()
        for _ in range(60):
            z, wrench = model.step(z, tensor([speed, 0.0, 0.0]), 3.0, 1.0)
        g = 1.0 + 0.2 * np.exp(-((speed / 1e-3) ** 1.7))
        assert wrench[0].item() == pytest.approx(-3.0 * (g + 0.2 * speed), rel=1e-12)


# ---------------------------------------------------------------------------------------- the NumPy models


@every_law
@every_surface
def test_reduced_equals_the_numpy_model(law, surface):
    model = reduced(law, surface)
    reference = pf.ReducedModelPublished(PATCH, law, surface)
    state, twist, load = samples(60, np.random.default_rng(1))
    rate_and_wrench = model(tensor(state), tensor(twist), tensor(load))
    assert_equal(
        rate_and_wrench,
        (reference.rate(state, twist, load), reference.wrench(state, twist, load)),
    )
    for dt in (1e-6, 1e-4, 1e-2):
        assert_equal(
            model.step(tensor(state), tensor(twist), tensor(load), dt),
            reference.step(state, twist, load, dt),
        )


def test_one_contact_and_batches_that_broadcast():
    model = reduced()
    reference = pf.ReducedModelPublished(PATCH, ELASTIC)
    state = STATE_SIZE
    twist = TWIST_SIZE
    assert_equal(
        model.step(tensor(state), tensor(twist), 2.0, 1e-4),
        reference.step(state, twist, 2.0, 1e-4),
    )
    twists = RNG.normal(size=(4, 1, 3)) * TWIST_SIZE
    loads = RNG.uniform(0.0, 2.0, 5)
    assert_equal(
        model.step(tensor(state), tensor(twists), tensor(loads), 1e-4),
        reference.step(state, twists, loads, 1e-4),
    )


def test_a_patch_that_depends_on_the_load_keeps_its_surface_s_shape():
    patch = pf.ContactPatch.disc(
        0.01, cells=9, pressure=pf.SoftFinger(c=0.005, n=1 / 3, k=2.0)
    )
    surface = pf.LimitSurfaceTable(patch, normal_force=2.0)
    model = ReducedModelPublished(patch, PLAIN, surface, dtype=torch.float64)
    reference = pf.ReducedModelPublished(patch, PLAIN, surface, on_load_change="keep")
    state, twist, load = samples(10, np.random.default_rng(3))
    assert_equal([model.step(tensor(state), tensor(twist), tensor(load), 1e-4)[1]],
                 [reference.step(state, twist, load, 1e-4)[1]])  # fmt: skip
    model = DistributedModel(patch, PLAIN, 2.0, dtype=torch.float64)
    reference = pf.DistributedModel(patch, PLAIN)
    inputs = 1e-7 * np.ones((2, patch.cells)), twist[9], 2.0, 1e-4
    assert_equal(
        model.step(tensor(inputs[0]), tensor(inputs[1]), 2.0, 1e-4),
        reference.step(*inputs),
    )
    with refused("normal_force must be", pf.FrictionError):
        DistributedModel(patch, PLAIN)


# ---------------------------------------------------------------------------------------- parameters


@pytest.mark.filterwarnings("ignore:mu_c has been trained up to mu_s")
@pytest.mark.parametrize(
    "names",
    [PARAMETERS, ("mu_s",), ("mu_c",), ("mu_c", "mu_s", "sigma_2"), ()],
    ids=str,
)
@pytest.mark.parametrize("mu_s", [1.0, 1.3])
def test_values_go_round(names, mu_s):
    law = pf.LuGre(
        mu_c=1.0, mu_s=mu_s, sigma_1=0.0, elasto_plastic=pf.ElastoPlastic(0.0)
    )
    model = reduced(law, trainable=names)
    assert {name.split(".")[-1] for name, _ in model.named_parameters()} == set(names)
    np.testing.assert_allclose(
        model.physical().detach().numpy()[:8],
        [1e6, 0.0, 0.2, 1.0, mu_s, 1e-3, 2.0, 0.0],
        1e-12,
    )
    new = {
        "mu_c": 0.31,
        "mu_s": 0.47,
        "sigma_1": 3.3,
        "breakaway_ratio": 0.93,
        "v_s": 7e-4,
        "centre_x": -0.012,
    }
    model.set(**new)
    for name, value in new.items():
        assert model.value(name).item() == pytest.approx(value, rel=1e-12)
    assert model.law() == pf.LuGre(
        **{n: model.value(n).item() for n in PARAMETERS[:7]},
        elasto_plastic=pf.ElastoPlastic(model.value("breakaway_ratio").item()),
    )


@pytest.mark.filterwarnings("ignore:mu_c has been trained up to mu_s")
@pytest.mark.parametrize(
    "names", [PARAMETERS, ("mu_s",), ("mu_c",)], ids=["all", "mu_s", "mu_c"]
)
@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
def test_no_optimiser_can_leave_the_valid_range(names, dtype):
    model = reduced(trainable=names, dtype=dtype)
    rng = np.random.default_rng(6)
    for size in (0.0, 1e-3, 1.0, 30.0, 1e6):
        for _ in range(20):
            with torch.no_grad():
                for raw in model.parameters():
                    raw.copy_(torch.tensor(size * rng.normal()))
            values = dict(zip(PARAMETERS, model.physical().tolist(), strict=True))
            assert np.isfinite(list(values.values())).all()
            for name in (
                "sigma_0",
                "mu_c",
                "v_s",
                "gamma",
                "contact_radius",
                "second_moment",
            ):
                assert values[name] > 0.0, name
            assert values["sigma_1"] >= 0.0 and values["sigma_2"] >= 0.0
            assert (
                values["mu_s"] >= values["mu_c"]
                and 0.0 <= values["breakaway_ratio"] < 1.0
            )


def test_a_value_on_its_bound_has_a_gradient_and_can_leave_it():
    law = pf.LuGre(mu_c=1.0, mu_s=1.0, sigma_1=0.0, sigma_2=0.0)
    model = reduced(law, trainable=("mu_s", "sigma_1", "sigma_2"))
    model.physical().sum().backward()
    assert all(raw.grad.item() > 0.0 for raw in model.parameters())


def test_weights_stay_a_pressure_distribution():
    model = distributed(trainable=("weights",))
    np.testing.assert_allclose(
        model.weights.detach().numpy(), PATCH.weights(), rtol=1e-12
    )
    with torch.no_grad():
        model.raw_weights.add_(50.0 * torch.randn(PATCH.cells, dtype=torch.float64))
    assert (model.weights >= 0.0).all() and model.weights.sum().item() == pytest.approx(
        1.0, rel=1e-12
    )


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: reduced(trainable=("mu_x",)), "trainable must be one of"),
        (
            lambda: reduced(PLAIN, trainable=("breakaway_ratio",)),
            "not contain breakaway_ratio for plain bristles",
        ),
        (
            lambda: distributed(trainable=("contact_radius",)),
            "trainable must be one of",
        ),
        (lambda: reduced("lugre"), "law must be a friction law of bristles"),
        (lambda: ReducedModelPublished("disc", PLAIN), "patch must be a ContactPatch"),
        (lambda: reduced().set(mu_s=0.1), "mu_s must be >= mu_c"),
        (lambda: reduced().set(mu=0.1), "parameter must be one of"),
        (lambda: reduced().set(sigma_0=-1.0), "sigma_0 must be > 0"),
        (
            lambda: reduced()(tensor([0.0]), tensor([0.0] * 3), 1.0),
            r"state must have shape \[..., 3\]",
        ),
        (
            lambda: reduced()(tensor([0.0] * 3), tensor([0.0]), 1.0),
            r"twist must have shape \[..., 3\]",
        ),
        (
            lambda: reduced()(*[tensor([0.0] * 3)] * 2, 1.0, parameters=tensor([1.0])),
            "parameters must have shape",
        ),
    ],
)
def test_wrong_input_is_one_line(make, message):
    with refused(message, pf.FrictionError):
        make()


def test_state_dicts_travel():
    model = reduced()
    other = reduced(pf.LuGre(mu_c=0.2, mu_s=0.2, elasto_plastic=pf.ElastoPlastic(0.1)))
    other.load_state_dict(model.state_dict())
    assert torch.equal(other.physical(), model.physical())


# ---------------------------------------------------------------------------------------- gradients

SIZES = tensor([*STATE_SIZE, *TWIST_SIZE, 1.0])


def scaled_step(model):
    """One step as a function of all of its inputs in natural units, wrench and state in natural units too."""
    names = len(model.names)
    sizes = torch.cat([SIZES, model.physical().detach().abs().clamp(min=1e-3)])

    def step(x):
        x = x * sizes
        z, wrench = model.step(
            x[..., :3], x[..., 3:6], x[..., 6], 3e-4, parameters=x[..., 7 : 7 + names]
        )
        return torch.cat([z / SIZES[:3], wrench / tensor([1.0, 1.0, 0.005])], -1)

    return (
        step,
        lambda z, v, f: (
            torch.cat([tensor(z), tensor(v), tensor([f]), model.physical().detach()])
            / sizes
        ),
    )


@every_law
@every_surface
def test_gradients_agree_with_central_differences(law, surface):
    step, point = scaled_step(reduced(law, surface))
    rng = np.random.default_rng(7)
    for _ in range(5):
        x = point(
            0.8 * rng.normal(size=3) * STATE_SIZE,
            rng.normal(size=3) * TWIST_SIZE,
            rng.uniform(0.5, 3.0),
        )
        jacobian = torch.func.jacrev(step)(x)
        nudge = 1e-6 * torch.eye(len(x), dtype=torch.float64)
        differences = ((step(x + nudge) - step(x - nudge)) / 2e-6).T
        # differences of numbers of order 1 to 100 have an error of 1e-16/1e-6 and 1e-12 times the third derivative
        torch.testing.assert_close(
            jacobian, differences, rtol=1e-5, atol=1e-7 * jacobian.abs().max().item()
        )


@every_law
@every_surface
def test_gradients_at_kinks_are_finite_and_the_same_in_batches(law, surface):
    step, point = scaled_step(reduced(law, surface))
    states = [[0, 0, 0], [1e-6, 0, 0], [0, 0, 5e-9], [2e-6, 0, 0]]
    twists = [
        [0, 0, 0],
        [0, 0, 0.3],
        [0, 0, -0.3],
        [2e-3, 0, 0],
        [0, -2e-3, 0],
        [1e-160, 0, 0],
    ]
    points = torch.stack(
        [point(z, v, f) for z in states for v in twists for f in (0.0, 1.0)]
    )
    jacobians = torch.func.vmap(torch.func.jacrev(step))(points)
    assert jacobians.isfinite().all()
    for x, jacobian in zip(points[::5], jacobians[::5], strict=True):
        torch.testing.assert_close(
            torch.func.jacrev(step)(x), jacobian, rtol=1e-12, atol=1e-12
        )


def test_gradients_of_rates_are_finite_at_kinks():
    for model in (reduced(), reduced(PLAIN, SURFACES["cells"]), distributed()):
        z = model.rest(3).requires_grad_()
        v = tensor([[0, 0, 0], [0, 0, 1.0], [1.0, 0, 0]]).requires_grad_()
        rate, wrench = model(z, v, tensor([0.0, 1.0, 1.0]))
        gradients = torch.autograd.grad(
            rate.sum() * 1e3 + wrench.sum(), [z, v, *model.parameters()]
        )
        assert all(gradient.isfinite().all() for gradient in gradients)


def test_second_derivatives():
    # Off the kinks the lookups' own backward is differentiable: a Hessian agrees with differences of gradients.
    for surface in (None, SURFACES["table"]):
        step, point = scaled_step(reduced(surface=surface))
        x = point([3e-7, 4e-7, 2e-9], [6e-4, -3e-4, 0.15], 1.0)
        gradient = torch.func.grad(lambda y, step=step: step(y).square().sum())
        hessian = torch.func.jacrev(gradient)(x)
        nudge = 1e-6 * torch.eye(len(x), dtype=torch.float64)
        differences = torch.stack(
            [(gradient(x + n) - gradient(x - n)) / 2e-6 for n in nudge]
        )
        torch.testing.assert_close(
            hessian, differences, rtol=1e-4, atol=1e-6 * hessian.abs().max().item()
        )


@pytest.mark.filterwarnings("ignore::DeprecationWarning")
@pytest.mark.parametrize(
    "make", [distributed, lambda: ReducedModel(PATCH, ELASTIC, cells=8), reduced]
)
def test_steps_compile_in_one_piece(make):
    model = make()
    _, twist, load = (tensor(a) for a in samples(10, np.random.default_rng(8)))
    state = torch.full_like(model.rest(10), 1e-7)
    compiled = torch.compile(
        lambda *given: model.step(*given, 1e-4), backend="eager", fullgraph=True
    )
    for got, wanted in zip(
        compiled(state, twist, load), model.step(state, twist, load, 1e-4), strict=True
    ):
        torch.testing.assert_close(got, wanted, rtol=1e-12, atol=1e-18)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::DeprecationWarning")
@pytest.mark.parametrize("backend", ["eager", "inductor"])
@every_surface
def test_compiles_in_one_piece(backend, surface):
    model = reduced(surface=surface)
    state, twist, load = (tensor(a) for a in samples(10, np.random.default_rng(9)))
    compiled = torch.compile(model, backend=backend, fullgraph=True)
    for got, wanted in zip(
        compiled(state, twist, load), model(state, twist, load), strict=True
    ):
        torch.testing.assert_close(got, wanted, rtol=1e-12, atol=1e-15)
    compiled(state, twist, load)[1].square().sum().backward()
    assert all(raw.grad.isfinite() for raw in model.parameters())


def test_arrays_that_are_read_backwards_are_copied():
    twist = np.array([1.0, 0.0, 0.01])
    model = distributed()
    given, wanted = (
        model.step(model.rest(), each, 1.0, 1e-3)[1]
        for each in (twist[::-1], twist[::-1].copy())
    )
    assert torch.equal(given, wanted)
