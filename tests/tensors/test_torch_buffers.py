"""Buffers of PyTorch modules: each module holds its own numbers of its patch, for every method and in state dicts."""

import copy
import functools

import numpy as np
import pytest

import planarfriction as pf
from tests.support.refusals import refused

torch = pytest.importorskip(
    "torch", reason="needs PyTorch: pip install 'planarfriction[torch]'"
)

from planarfriction.torch import (  # noqa: E402
    DistributedModel,
    ReducedModel,
    ReducedModelPublished,
    rollout,
)

pytestmark = pytest.mark.torch

PATCH = pf.ContactPatch.from_pressure(
    np.random.default_rng(4).uniform(0.0, 1.0, (5, 6)), 0.002, name="lopsided"
)
OTHER = pf.ContactPatch.from_pressure(
    np.random.default_rng(4).uniform(0.0, 1.0, (5, 6)), 0.004, name="larger"
)
PLAIN, ELASTIC = (
    pf.LuGre(mu_s=1.2, gamma=1.7),
    pf.LuGre(mu_s=1.2, gamma=1.3, elasto_plastic=pf.ElastoPlastic(0.7)),
)
MODELS = {
    "reduced": functools.partial(ReducedModel, cells=12),
    "published": ReducedModelPublished,
    "distributed": DistributedModel,
}
T = 20

every_model = pytest.mark.parametrize("kind", MODELS)
every_way = pytest.mark.parametrize(
    ("kind", "method"), [(kind, m) for kind in MODELS for m in ("adjoint", "eager")]
)


def module(kind, patch=PATCH, law=ELASTIC, **options):
    return MODELS[kind](patch, law, **{"dtype": torch.float64, **options})


def twists():
    t = 1e-4 * torch.arange(T, dtype=torch.float64)
    return torch.stack(
        [
            2e-3 * torch.sin(300 * t) + 1e-4,
            1e-3 * torch.cos(200 * t),
            0.3 * torch.sin(150 * t),
        ],
        -1,
    )


def wrenches(model, method):
    return rollout(model, None, twists(), 2.0, 1e-4, method=method).wrenches


# ---------------------------------------------------------------------- own numbers


@every_way
def test_a_state_dict_carries_the_patch(kind, method):
    model = module(kind)
    other = module(kind, OTHER)
    assert not torch.allclose(
        wrenches(model, method), wrenches(other, method), rtol=1e-2
    )
    model.load_state_dict(other.state_dict())
    assert torch.equal(wrenches(model, method), wrenches(other, method))
    assert model.law() == other.law() and model.lever == other.lever


@every_way
def test_models_that_are_stacked_keep_each_its_own_patch(kind, method):
    models = [
        module(kind),
        module(kind, OTHER),
        module(kind, OTHER, pf.LuGre(0.5, 0.6, elasto_plastic=0.7, gamma=1.3)),
    ]
    parameters, buffers = torch.func.stack_module_state(models)

    def loss(parameters, buffers):
        base = copy.deepcopy(models[0])
        run = torch.func.functional_call(
            _Run(base, method), _inside({**parameters, **buffers}), ()
        )
        return run.square().sum(), run

    slopes, together = torch.func.vmap(torch.func.grad(loss, has_aux=True))(
        parameters, buffers
    )
    for i, model in enumerate(models):
        alone = wrenches(model, method)
        torch.testing.assert_close(together[i], alone, rtol=1e-12, atol=1e-14)
        alone.square().sum().backward()
        for name, parameter in model.named_parameters():
            torch.testing.assert_close(
                slopes[name][i], parameter.grad, rtol=1e-9, atol=1e-12
            )


class _Run(torch.nn.Module):
    """A rollout as what a module does."""

    def __init__(self, model, method):
        super().__init__()
        self.model = model
        self.method = method

    def forward(self):
        return wrenches(self.model, self.method)


def _inside(values):
    return {f"model.{name}": value for name, value in values.items()}


def test_the_adjoint_of_stacked_models_takes_shared_inputs():
    models = [module("reduced"), module("reduced", OTHER)]
    parameters, buffers = torch.func.stack_module_state(models)

    class Run(torch.nn.Module):
        def __init__(self, model):
            super().__init__()
            self.model = model

        def forward(self, v):
            return rollout(self.model, None, v, 2.0, 1e-4, method="adjoint").wrenches

    def slopes(parameters, buffers, v):
        values = _inside({**parameters, **buffers})
        return torch.func.jacrev(
            lambda v: torch.func.functional_call(Run(models[0]), values, (v,))[5:8]
        )(v)

    together = torch.func.vmap(slopes, in_dims=(0, 0, None))(
        parameters, buffers, twists()
    )
    for model, slope in zip(models, together, strict=True):
        alone = torch.func.jacrev(lambda v, model=model: Run(model)(v)[5:8])(twists())
        torch.testing.assert_close(slope, alone, rtol=1e-12, atol=0.0)


def test_a_single_precision_model_is_rolled_out_with_its_own_numbers():
    model = module("reduced", dtype=torch.float32)
    model.load_state_dict(module("reduced", OTHER).state_dict())
    wanted = wrenches(module("reduced", OTHER), "adjoint")
    # A law and cells of 7 digits.
    torch.testing.assert_close(wrenches(model, "adjoint"), wanted, rtol=1e-4, atol=1e-5)


@every_model
def test_buffers_share_no_memory_with_what_the_caller_gave(kind):
    surface = pf.LimitSurfaceTable(PATCH) if kind == "published" else None
    model = module(kind, surface=surface) if surface else module(kind)
    before = surface.numbers.data.copy() if surface else None
    positions = PATCH.positions.copy()
    weights = PATCH.weights().copy()
    reference = {
        "reduced": functools.partial(pf.ReducedModel, cells=12),
        "published": pf.ReducedModelPublished,
        "distributed": pf.DistributedModel,
    }
    numpy_model = reference[kind](PATCH, ELASTIC)
    inputs = numpy_model.rest() + 1e-7, twists()[3].numpy(), 2.0
    wrench = numpy_model.wrench(*inputs)
    with torch.no_grad():
        for _, buffer in model.named_buffers():
            buffer.zero_()
    assert np.array_equal(PATCH.positions, positions) and np.array_equal(
        PATCH.weights(), weights
    )
    assert np.array_equal(numpy_model.wrench(*inputs), wrench)
    if surface:
        assert np.array_equal(surface.numbers.data, before)


def test_a_gradient_to_the_numbers_of_the_patch_is_eager():
    model = module("reduced")
    model.positions.requires_grad_()
    wrenches(model, None).square().sum().backward()
    assert model.positions.grad.abs().max() > 0.0
    with refused(
        "be 'eager' for a gradient to the numbers of the patch", pf.FrictionError
    ):
        wrenches(model, "adjoint")


@every_model
def test_single_precision_is_as_close_as_its_digits_however_stiff(kind):
    """Steady sliding at 1 m/s, where sigma_1 times the rounding of a rate was 3e-3 of the load."""
    law = pf.LuGre(
        mu_s=1.2,
        gamma=1.7,
        sigma_0=1e7,
        sigma_1=8e3,
        elasto_plastic=pf.ElastoPlastic(0.7),
    )
    single, double = (
        module(kind, law=law, dtype=dtype) for dtype in (torch.float32, torch.float64)
    )
    fast = (500.0 * twists()).float()
    exact = rollout(double, None, fast.double(), 1.0, 1e-3, method="eager").wrenches
    found = rollout(single, None, fast, 1.0, 1e-3, method="eager").wrenches
    steps = [single.step(single.rest(), twist, 1.0, 1e-3)[1] for twist in fast]
    assert found.dtype == steps[0].dtype == torch.float32
    lever = torch.tensor([1.0, 1.0, double.lever.item()], dtype=torch.float64)
    # A step of a millisecond forgets where it began.
    for each in (
        found,
        torch.stack(steps),
    ):
        assert (
            (each.double() - exact) / lever
        ).abs().max() < 2e-6  # parameters and results have 7 digits


# ---------------------------------------------------------------------- what does not fit


@every_model
def test_bristles_of_the_other_kind_are_refused(kind):
    model = module(kind, law=PLAIN)
    before = model.physical().clone()
    with pytest.raises(
        pf.FrictionError,
        match="state_dict must be that of plain bristles, got elasto-plastic",
    ) as caught:
        model.load_state_dict(module(kind, law=ELASTIC).state_dict())
    assert "\n" not in str(caught.value) and torch.equal(model.physical(), before)
    with refused(
        "state_dict must be that of elasto-plastic bristles, got plain",
        pf.FrictionError,
    ):
        module(kind).load_state_dict(module(kind, law=PLAIN).state_dict())
    nothing = {
        name: value for name, value in model.state_dict().items() if name != "bristles"
    }
    with pytest.raises(RuntimeError, match=r'Missing key.*"bristles"'):
        model.load_state_dict(nothing)


@pytest.mark.parametrize(
    ("model", "other", "message"),
    [
        (
            lambda: module("published", surface=pf.LimitSurfaceEllipsoid(PATCH)),
            lambda: module("published", surface=pf.LimitSurfaceCells(PATCH)),
            "state_dict must hold a limit surface of the same kind and size",
        ),
    ],
)
def test_another_size_of_the_shape_is_refused(model, other, message):
    with refused(message, pf.FrictionError):
        model().load_state_dict(other().state_dict())


# ---------------------------------------------------------------------- a bound that moves with nothing


@every_model
def test_a_dynamic_friction_trained_up_to_a_fixed_static_one_is_said(kind):
    model = module(kind, trainable=("mu_c",))
    twist = twists()
    optimiser = torch.optim.Adam(model.parameters(), lr=0.05)

    def pull():
        optimiser.zero_grad()
        wrench = model.step(model.rest(), 100.0 * twist[0], 1.0, 1.0)[1]
        (wrench[0].abs() - 2.0).square().backward()  # of more friction than mu_s gives
        optimiser.step()

    pull()
    with pytest.warns(
        UserWarning,
        match="mu_c has been trained up to mu_s, which is fixed .*: name mu_s in trainable",
    ):
        for _ in range(8):
            pull()
        assert model.law().mu_c <= model.law().mu_s == pytest.approx(1.2, rel=1e-12)
