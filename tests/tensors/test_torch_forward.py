"""Forward mode and second derivatives of PyTorch rollouts: the adjoint forwards, or one line that says what else."""

import numpy as np
import pytest

import planarfriction as pf
from tests.support.refusals import refused

torch = pytest.importorskip(
    "torch", reason="needs PyTorch: pip install 'planarfriction[torch]'"
)

from torch.autograd import forward_ad  # noqa: E402

from planarfriction.torch import ReducedModel, ReducedModelPublished, rollout  # noqa: E402

pytestmark = pytest.mark.torch

PATCH = pf.ContactPatch.from_pressure(
    np.random.default_rng(4).uniform(0.0, 1.0, (5, 6)), 0.002, name="lopsided"
)
LAW = pf.LuGre(mu_s=1.2, gamma=1.7, elasto_plastic=pf.ElastoPlastic(0.7))
T = 8

every_model = pytest.mark.parametrize("kind", ["reduced", "published", "smooth table"])


def module(kind):
    if kind == "reduced":
        return ReducedModel(PATCH, LAW, cells=9, dtype=torch.float64)
    surface = pf.LimitSurfaceTable(PATCH) if kind == "smooth table" else None
    return ReducedModelPublished(PATCH, LAW, surface, dtype=torch.float64)


def inputs(model):
    """State, twists, loads and parameters."""
    t = 1e-4 * torch.arange(T, dtype=torch.float64)
    twists = torch.stack(
        [
            2e-3 * torch.sin(900 * t) + 1e-4,
            1e-3 * torch.cos(600 * t),
            0.3 * torch.sin(450 * t),
        ],
        -1,
    )
    size = (
        [[1e-7], [2e-7], [1e-8]] if len(model.state_shape) > 1 else [1e-7, 2e-7, 1e-9]
    )
    state = torch.tensor(size, dtype=torch.float64) * torch.ones(
        model.state_shape, dtype=torch.float64
    )
    return state, twists, 1.0 + torch.cos(500 * t), model.physical().detach()


def wrenches(model, method):
    return lambda *given: (
        rollout(model, *given[:3], 1e-4, parameters=given[3], method=method).wrenches
    )


@every_model
def test_forward_mode_is_reverse_mode(kind):
    model = module(kind)
    at = inputs(model)
    every = (0, 1, 2, 3)
    forwards = torch.func.jacfwd(wrenches(model, "adjoint"), every)(*at)
    backwards = torch.func.jacrev(wrenches(model, "adjoint"), every)(*at)
    recorded = torch.func.jacfwd(wrenches(model, "eager"), every)(*at)
    for there, back, eager in zip(forwards, backwards, recorded, strict=True):
        scale = back.abs().max().item()
        torch.testing.assert_close(there, back, rtol=1e-11, atol=1e-13 * scale)
        # Sums in another order, stiff steps.
        torch.testing.assert_close(there, eager, rtol=1e-8, atol=1e-9 * scale)


def test_forward_mode_goes_through_vmap_and_dual_numbers():
    model = module("reduced")
    state, twists, loads, parameters = inputs(model)
    both = torch.stack([parameters, 1.1 * parameters])
    slope = torch.func.jacfwd(wrenches(model, "adjoint"), 3)
    together = torch.func.vmap(slope, in_dims=(None, None, None, 0))(
        state, twists, loads, both
    )
    for one, alone in zip(together, both, strict=True):
        torch.testing.assert_close(
            one, slope(state, twists, loads, alone), rtol=1e-12, atol=1e-15
        )
    with forward_ad.dual_level():
        dual = forward_ad.make_dual(parameters, torch.ones_like(parameters))
        change = forward_ad.unpack_dual(
            wrenches(model, "adjoint")(state, twists, loads, dual)
        ).tangent
    torch.testing.assert_close(
        change, slope(state, twists, loads, parameters).sum(-1), rtol=1e-12, atol=1e-12
    )


SECOND = {
    "hessian": torch.func.hessian,
    "twice back": lambda f: torch.func.jacrev(torch.func.jacrev(f)),
    "twice forwards": lambda f: torch.func.jacfwd(torch.func.jacfwd(f)),
    "back over forwards": lambda f: torch.func.jacrev(torch.func.jacfwd(f)),
    "product": lambda f: lambda x: torch.autograd.functional.hvp(f, x, x),
}


@pytest.mark.parametrize("way", SECOND)
def test_second_derivatives_by_the_adjoint_are_one_line(way):
    model = module("reduced")
    *held, parameters = inputs(model)
    with refused("use method='eager' to differentiate twice", pf.FrictionError):
        SECOND[way](lambda p: wrenches(model, "adjoint")(*held, p).square().sum())(
            parameters
        )


def test_a_hessian_vector_product_is_eager():
    model = module("reduced")
    *held, parameters = inputs(model)
    direction = parameters * torch.linspace(
        -1.0, 1.0, len(parameters), dtype=torch.float64
    )

    def loss(method):
        return lambda p: wrenches(model, method)(*held, p).square().sum()

    _, product = torch.autograd.functional.hvp(loss("eager"), parameters, direction)
    _, forwards = torch.func.jvp(
        torch.func.grad(loss("eager")), (parameters,), (direction,)
    )
    torch.testing.assert_close(
        product, forwards, rtol=1e-9, atol=1e-12 * product.abs().max().item()
    )
    slope = torch.func.grad(loss("adjoint"))
    h = 1e-5
    differences = (
        slope(parameters + h * direction) - slope(parameters - h * direction)
    ) / (2.0 * h)
    size = (product * parameters).abs().max().item()
    torch.testing.assert_close(
        product * parameters, differences * parameters, rtol=1e-5, atol=1e-7 * size
    )
