"""The reduced model in PyTorch: closed forms, agreement with the compiled one, gradients at and off the kinks."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

import planarfriction as pf
from planarfriction.tensors import reduced

torch = pytest.importorskip("torch", reason="needs PyTorch: pip install 'planarfriction[torch]'")

from planarfriction.tensors.reduced import PARAMETERS  # noqa: E402
from planarfriction.torch import MomentModel, rollout, tracking_loss  # noqa: E402
from planarfriction.torch.namespace import xp  # noqa: E402

pytestmark = pytest.mark.torch

PATCH = pf.ContactPatch.from_pressure(np.random.default_rng(4).uniform(0.0, 1.0, (5, 6)), 0.002, name="lopsided")
LAWS = {
    "plain": pf.LuGre(mu_s=1.2, sigma_1=30.0, gamma=1.7),
    "elasto-plastic": pf.LuGre(mu_s=1.2, sigma_1=30.0, gamma=1.7, elasto_plastic=pf.ElastoPlastic(0.7)),
}
SMALL = {"segments": 8, "speeds": 8}
STATE_SIZE, TWIST_SIZE = 1e-6, np.array([1e-3, 1e-3, 0.2])
STEPS = (1e-6, 1e-4, 1e-2, 1e3)

every_law = pytest.mark.parametrize("law", LAWS)


def tensor(value):
    return torch.tensor(np.asarray(value), dtype=torch.float64)


def module(law="elasto-plastic", **options):
    return MomentModel(PATCH, LAWS[law], **{"dtype": torch.float64, **SMALL, **options})


def compiled(law):
    return pf.models.MomentModel(PATCH, LAWS[law], **SMALL)


def on_the_cube(model: pf.models.MomentModel) -> np.ndarray:
    """Twists at the middles of the faces, on the edges and at the corners of the cube of directions."""
    directions = np.array([d for d in itertools.product((-1.0, 0.0, 1.0), repeat=3) if any(d)])
    return 1e-3 * directions @ np.linalg.inv(model.reduction.shape_at(None).factor).T


def samples(model: pf.models.MomentModel, seed: int = 1):
    """States in stick and slip, twists from far below to far above the Stribeck speed; the first ones at kinks."""
    rng = np.random.default_rng(seed)
    corners = on_the_cube(model)
    count = len(corners) + 60
    state = rng.normal(size=(count, 3)) * STATE_SIZE * 10.0 ** rng.uniform(-2, 0.3, (count, 1))
    twist = rng.normal(size=(count, 3)) * TWIST_SIZE * 10.0 ** rng.uniform(-2, 2, (count, 1))
    load = rng.uniform(0.2, 3.0, count)
    twist[: len(corners)], state[:5], load[5] = corners, 0.0, 0.0
    twist[4], twist[-1], twist[-2], load[-3] = 0.0, 0.0, [0.0, 0.0, 0.3], 0.0
    return state, twist, load


def assert_equal(tensors, arrays, tolerance=1e-12):
    """Each component to `tolerance` of its largest value."""
    for got, wanted in zip(tensors, arrays, strict=True):
        got = got.detach().numpy()
        assert got.shape == wanted.shape
        assert (np.abs(got - wanted) <= tolerance * np.abs(wanted).max(axis=0)).all()


# ---------------------------------------------------------------------- closed forms


@every_law
def test_sliding_straight_has_the_friction_of_the_stribeck_curve(law):
    model = module(law, segments=24, speeds=16)
    for speed in (1e-5, 1e-3, 0.1):
        _, wrench = model.step(model.rest(), tensor([speed, 0.0, 0.0]), 3.0, 1e6)
        g = 1.0 + 0.2 * np.exp(-((speed / 1e-3) ** 1.7))
        assert wrench[0].item() == pytest.approx(-3.0 * (g + 0.2 * speed), rel=1e-4)  # the map: 1e-5 of it


def test_a_stuck_patch_is_a_spring():
    model, state = module(), tensor([1e-9, -2e-9, 1e-9])
    slope = torch.func.jacrev(lambda z: model.step(z, tensor([0.0] * 3), 2.0, 1e-3)[1])(state)
    np.testing.assert_allclose(slope.detach().numpy(), -2.0 * 1e6 * model.factor[0].T, rtol=1e-13, atol=1e-6)


def test_a_map_of_six_faces_is_read_as_the_odd_one_that_it_repeats():
    model, reference = module(), compiled("elasto-plastic")
    law, three, _ = model._parts_at(None)[0]
    signs = tensor([-1.0, 1.0, 1.0, -1.0])
    flat, rest = (torch.cat([part, part.flip(1, 2) * signs]) for part in (three.flat, three.rest))
    twist = tensor(samples(reference)[1])
    odd, other = (reduced.drive(xp, law, s, twist).q for s in (three, three._replace(flat=flat, rest=rest)))
    torch.testing.assert_close(odd, other, rtol=1e-12, atol=1e-20)


# ---------------------------------------------------------------------- the compiled model


@every_law
def test_it_equals_the_compiled_model(law):
    model, reference = module(law), compiled(law)
    state, twist, load = samples(reference)
    z, v, f_n = map(tensor, (state, twist, load))
    assert_equal(model(z, v, f_n), (reference.rate(state, twist, load), reference.wrench(state, twist, load)))
    for dt in STEPS:
        assert_equal(model.step(z, v, f_n, dt), reference.step(state, twist, load, dt))
    assert_equal(model.step(z[7], v[7], 2.0, 1e-4), reference.step(state[7], twist[7], 2.0, 1e-4))
    some = np.s_[:4, None]
    assert_equal(model.step(z[:5], v[some], f_n[:5], 1e-4), reference.step(state[:5], twist[some], load[:5], 1e-4))


def test_a_patch_whose_shape_follows_the_load_keeps_that_of_one_load():
    patch = pf.ContactPatch.disc(0.01, cells=9, pressure=pf.SoftFinger(c=0.005, n=1 / 3, k=2.0))
    law = LAWS["plain"]
    model = MomentModel(patch, law, 0.3, dtype=torch.float64, **SMALL)
    state, twist = [1e-7, 0.0, 2e-7], [1e-3, 0.0, 0.1]
    wanted = pf.models.MomentModel(patch, law, **SMALL, load_error=0.0).step(state, twist, 0.3, 1e-4)
    for got, want in zip(model.step(tensor(state), tensor(twist), 0.3, 1e-4), wanted, strict=True):
        np.testing.assert_allclose(got.detach().numpy(), want, rtol=1e-12, atol=1e-18)
    with pytest.raises(pf.FrictionError, match="normal_force must be"):
        MomentModel(patch, law, parts=1)


def test_float32_is_as_close_as_its_digits():
    state, twist, load = map(tensor, samples(compiled("elasto-plastic")))
    z, wrench = module(dtype=torch.float32).step(state.float(), twist.float(), load.float(), 1e-4)
    assert z.dtype == wrench.dtype == torch.float32
    exact = module().step(state, twist, load, 1e-4)[1]
    assert ((wrench - exact).abs().amax(0) / exact.abs().amax(0)).max().item() < 2e-4  # 1e-7 times steep slopes


# ---------------------------------------------------------------------- gradients


@every_law
def test_gradients_are_the_analytic_jacobians(law):
    model, reference = module(law), compiled(law)
    state, twist, load = samples(reference)
    z, v, f_n = map(tensor, (state, twist, load))
    loaded = load > 0.0  # without load: to the load alone

    def compare(got, wanted):
        for block, exact in zip(got, wanted, strict=True):
            block = block.detach().numpy()
            assert np.isfinite(block).all()
            assert np.abs(block - exact)[loaded].max() <= 2e-11 * np.abs(exact).max()

    for dt in STEPS:
        step = torch.func.jacrev(lambda z, v, f, dt=dt: model.step(z, v, f, dt), (0, 1, 2))
        new, wrench = torch.func.vmap(step)(z, v, f_n)
        compare((*new[:2], *wrench), reference.step_jacobians(state, twist, load, dt))
    rate, wrench = torch.func.vmap(torch.func.jacrev(model.forward, (0, 1, 2)))(z, v, f_n)
    compare((*rate, *wrench), reference.jacobians(state, twist, load))


def scaled_step(model):
    """One step as a function of all of its inputs and the law, in natural units."""
    inputs = tensor([STATE_SIZE] * 3 + [*TWIST_SIZE, 1.0])
    sizes = torch.cat([inputs, model.physical().detach().abs()])

    def step(x):
        x = x * sizes
        z, wrench = model.step(x[..., :3], x[..., 3:6], x[..., 6], 3e-4, parameters=x[..., 7:])
        return torch.cat([z / STATE_SIZE, wrench / tensor([1.0, 1.0, 0.005])], -1)

    return step, lambda z, v, f: torch.cat([tensor(z), tensor(v), tensor([f]), model.physical().detach()]) / sizes


@every_law
def test_gradients_agree_with_central_differences(law):
    step, point = scaled_step(module(law))
    rng = np.random.default_rng(7)
    for _ in range(6):
        x = point(0.8 * rng.normal(size=3) * STATE_SIZE, rng.normal(size=3) * TWIST_SIZE, rng.uniform(0.5, 3.0))
        jacobian = torch.func.jacrev(step)(x)
        nudge = 1e-6 * torch.eye(len(x), dtype=torch.float64)
        differences = ((step(x + nudge) - step(x - nudge)) / 2e-6).T
        torch.testing.assert_close(jacobian, differences, rtol=1e-6, atol=1e-7 * jacobian.abs().max().item())


@every_law
def test_gradients_at_kinks_are_finite(law):
    step, point = scaled_step(module(law))
    states = [[0, 0, 0], [1e-6, 0, 0], [0, 0, 1e-6], [2e-6, 0, 0]]
    twists = [[0, 0, 0], [0, 0, 0.3], [0, 0, -0.3], [2e-3, 0, 0], [0, -2e-3, 0], [1e-160, 0, 0]]
    points = torch.stack([point(z, v, f) for z in states for v in twists for f in (0.0, 1.0)])
    assert torch.func.vmap(torch.func.jacrev(step))(points).isfinite().all()


def sway(count: int) -> torch.Tensor:
    t = 1e-4 * torch.arange(count, dtype=torch.float64)
    return torch.stack([2e-3 * torch.sin(300 * t) + 1e-4, 1e-3 * torch.cos(200 * t), 0.3 * torch.sin(150 * t)], -1)


@every_law
def test_a_roll_out_is_its_steps_and_its_gradient_that_of_differences(law):
    model, twists = module(law), sway(60)
    loads = torch.linspace(0.5, 1.5, 60, dtype=torch.float64)
    z, wrenches = model.rest(), []
    for v, f_n in zip(twists, loads, strict=True):
        z, wrench = model.step(z, v, f_n, 1e-4)
        wrenches.append(wrench)
    run = rollout(model, None, twists, loads, 1e-4, method="eager")
    torch.testing.assert_close(run.wrenches, torch.stack(wrenches), rtol=1e-12, atol=1e-15)
    torch.testing.assert_close(run.state, z, rtol=1e-12, atol=1e-20)

    def value(parameters):
        wrenches = rollout(model, None, twists, loads, 1e-4, parameters=parameters, method="eager").wrenches
        return (wrenches * tensor([1.0, 1.0, 100.0])).square().sum((-2, -1))

    now = model.physical().detach()
    (gradient,) = torch.autograd.grad(value(now.requires_grad_()), now)
    nudge = 1e-6 * torch.diag(now.detach())
    ends = value(now.detach() + nudge), value(now.detach() - nudge)  # a batch of models
    slopes = (ends[0] - ends[1]) / 2e-6
    torch.testing.assert_close(gradient * now.detach(), slopes, rtol=1e-5, atol=1e-7 * slopes.abs().max().item())


@pytest.mark.parametrize("patch", ["fixed", "soft"])
@every_law
def test_the_adjoint_agrees_with_autograd(law, patch):
    soft = pf.ContactPatch.disc(0.01, cells=9, pressure=pf.SoftFinger(c=0.005, n=1 / 3, k=2.0))
    model = module(law) if patch == "fixed" else MomentModel(soft, LAWS[law], 2.0, dtype=torch.float64, **SMALL)
    twists, loads = sway(60), torch.linspace(0.5, 1.5, 60, dtype=torch.float64)
    twists[20:23], twists[30, :2], loads[40:43] = 0.0, 0.0, 0.0
    inputs = tensor([1e-7, 2e-7, -1e-7]), twists, loads, model.physical().detach().clone()
    found = []
    for method in ("adjoint", "eager"):
        free = [value.clone().requires_grad_() for value in inputs]
        run = rollout(model, *free[:3], 1e-4, parameters=free[3], method=method)
        value = (run.wrenches * tensor([1.0, 0.7, 100.0])).sum() + (run.state * tensor([1e6, 2e6, -1e6])).sum()
        found.append((run, torch.autograd.grad(value, free)))
    (compiled, adjoint), (eager, recorded) = found
    # the compiled loop orders its sums in another way; slopes of the stiff steps amplify that
    torch.testing.assert_close(compiled.wrenches, eager.wrenches, rtol=1e-10, atol=1e-12)
    torch.testing.assert_close(compiled.state, eager.state, rtol=1e-10, atol=1e-18)
    for got, wanted in zip(adjoint, recorded, strict=True):
        torch.testing.assert_close(got, wanted, rtol=1e-8, atol=1e-9 * wanted.abs().max().item())


def test_vmap_goes_through_the_adjoint():
    model, twists = module(), sway(12)
    frictions = model.physical().detach() * tensor([[1.0], [1.1], [1.3]])

    def loss(parameters):
        return rollout(model, None, twists, 2.0, 1e-4, parameters=parameters, method="adjoint").wrenches.square().sum()

    together = torch.func.vmap(torch.func.grad(loss))(frictions)
    for alone, slopes in zip(frictions, together, strict=True):
        torch.testing.assert_close(torch.func.grad(loss)(alone), slopes, rtol=1e-9, atol=1e-12)


def test_it_learns_the_law():
    twists = sway(15)
    truth = rollout(module(), None, twists, 2.0, 1e-3).wrenches.detach()
    model = module(trainable=("mu_c", "mu_s"))
    model.set(mu_c=0.8, mu_s=0.9)
    optimiser = torch.optim.Adam(model.parameters(), lr=0.1)
    losses = []
    for _ in range(4):
        optimiser.zero_grad()
        losses.append(tracking_loss(model, None, twists, 2.0, 1e-3, truth))
        losses[-1].backward()
        optimiser.step()
    assert min(losses) < 0.02 * losses[0]
    assert model.law().mu_c != 0.8 and model.law().gamma == 1.7


# ---------------------------------------------------------------------- use


def test_state_dicts_travel():
    model, other = module(), module(trainable=())
    model.set(mu_c=0.5, breakaway_ratio=0.4)
    other.load_state_dict({k: v for k, v in model.state_dict().items() if "raw" not in k})
    torch.testing.assert_close(other.physical(), model.physical().detach(), rtol=1e-12, atol=0.0)
    assert model.names == PARAMETERS
    torch.testing.assert_close(model.map, other.map)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: module(trainable=("gamma",)), "trainable must not contain gamma: the map of steady sliding"),
        (lambda: module("plain", trainable=("breakaway_ratio",)), "not contain breakaway_ratio for plain bristles"),
        (lambda: module().set(gamma=1.0), "parameter must be one of"),
        (lambda: module()(tensor([0.0]), tensor([0.0] * 3), 1.0), r"state must have shape \[..., 3\]"),
        (lambda: MomentModel("disc", LAWS["plain"], parts=1), "patch must be a ContactPatch"),
    ],
)
def test_wrong_input_is_one_line(make, message):
    with pytest.raises(pf.FrictionError, match=message) as caught:
        make()
    assert "\n" not in str(caught.value)
