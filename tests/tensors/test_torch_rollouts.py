"""Rollouts of the PyTorch modules: eager against the adjoint, batches, training, clear refusals."""

import numpy as np
import pytest

import planarfriction as pf
from tests.support.refusals import refused

torch = pytest.importorskip(
    "torch", reason="needs PyTorch: pip install 'planarfriction[torch]'"
)

from planarfriction.torch import (  # noqa: E402
    DistributedModel,
    ReducedModelPublished,
    rollout,
    tracking_loss,
)

pytestmark = pytest.mark.torch

RNG = np.random.default_rng(4)
PATCH = pf.ContactPatch.from_pressure(
    RNG.uniform(0.0, 1.0, (5, 6)), 0.002, name="lopsided"
)
LAWS = {
    "plain": pf.LuGre(mu_s=1.2, sigma_1=30.0),
    "elasto-plastic": pf.LuGre(
        mu_s=1.2, sigma_1=30.0, elasto_plastic=pf.ElastoPlastic(0.9)
    ),
}
SURFACES = {
    "published": None,
    "table": pf.LimitSurfaceTable(PATCH),
    "ellipsoid": pf.LimitSurfaceEllipsoid(PATCH),
    "cells": pf.LimitSurfaceCells(PATCH),
}
DT = 1e-4


def tensor(value):
    return torch.tensor(np.asarray(value), dtype=torch.float64)


def reduced(law="elasto-plastic", surface="published", **options):
    return ReducedModelPublished(
        PATCH, LAWS[law], SURFACES[surface], **{"dtype": torch.float64, **options}
    )


def profile(steps):
    """Slip to and fro and spin, with rests, stick, straight slides and pure spins between."""
    t = np.linspace(0.0, 1.0, steps)
    v = np.stack([3e-3 * np.sin(6 * t), 2e-3 * np.cos(5 * t), 0.4 * np.sin(9 * t)], -1)
    for place, twist in {
        1: (0, 0, 0),
        2: (0, 1e-3, 0),
        3: (-2e-3, 0, 0),
        4: (0, 0, 0.3),
        6: (1e-7, 0, 0),
    }.items():
        v[place * steps // 8 : (place + 1) * steps // 8] = twist
    loads = 1.0 + 0.5 * np.sin(7 * t)
    loads[steps // 2 : steps // 2 + 3] = loads[-1] = 0.0
    return v, loads


def gradients(model, method, *, centred=False):
    """Gradients of a weighted sum of all wrenches and of the last state to the state, twists, loads and parameters."""
    v, loads = profile(80)
    rng = np.random.default_rng(5)
    parameters = model.physical().detach().clone()
    if centred:
        parameters[-2:] = (
            0.0  # a pure spin is then about the centre of pressure: on the pole of the table
        )
    sizes = (
        tensor([1e6, 2e6, 1e8]) if model.state_shape == (3,) else tensor([[1e6], [2e6]])
    )
    inputs = [
        0.1 / sizes * tensor(np.ones(model.state_shape)),
        tensor(v),
        tensor(loads),
        parameters,
    ]
    inputs = [value.requires_grad_() for value in inputs]
    result = rollout(model, *inputs[:3], DT, parameters=inputs[3], method=method)
    weights = tensor(rng.normal(size=v.shape) * [1.0, 1.0, 100.0])
    value = (weights * result.wrenches).sum() + (result.state * sizes).sum()
    return result, torch.autograd.grad(value, inputs)


@pytest.mark.parametrize(
    ("surface", "centred"), [*((name, False) for name in SURFACES), ("table", True)]
)
@pytest.mark.parametrize("law", LAWS)
def test_the_adjoint_agrees_with_autograd(law, surface, centred):
    agree(reduced(law, surface), centred)


@pytest.mark.parametrize("law", LAWS)
def test_the_adjoint_of_cells_agrees_with_autograd(law):
    agree(DistributedModel(PATCH, LAWS[law], dtype=torch.float64))


def agree(model, centred=False):
    (compiled, adjoint), (eager, recorded) = (
        gradients(model, m, centred=centred) for m in ("adjoint", "eager")
    )
    torch.testing.assert_close(
        compiled.wrenches, eager.wrenches, rtol=1e-12, atol=1e-12
    )
    torch.testing.assert_close(compiled.state, eager.state, rtol=1e-12, atol=1e-18)
    for got, wanted in zip(adjoint, recorded, strict=True):
        assert wanted.isfinite().all()
        # element by element for the parameters, of the largest element along a sequence: gradients there span decades
        floor = 0.0 if got.shape in ((8,), (12,)) else 1e-9 * wanted.abs().max().item()
        torch.testing.assert_close(got, wanted, rtol=1e-9, atol=max(floor, 1e-15))


@pytest.mark.parametrize("method", ["adjoint", "eager"])
def test_the_gradient_of_a_load_at_zero_is_one_sided(method):
    # The wrench per unit load that the smallest load would have; nothing else passes a step without load.
    model = reduced()
    v = tensor([[1e-3, 0.0, 0.1]] * 3)
    load = tensor([1.0, 0.0, 1.0]).requires_grad_()
    (gradient,) = torch.autograd.grad(
        rollout(model, None, v, load, DT, method=method).wrenches[1].sum(), load
    )
    small = (
        rollout(model, None, v, tensor([1.0, 1e-9, 1.0]), DT, method=method)
        .wrenches[1]
        .sum()
        .item()
        / 1e-9
    )
    assert gradient[1].item() == pytest.approx(small, rel=1e-7)
    assert gradient[0] == gradient[2] == 0.0


@pytest.mark.parametrize("method", ["adjoint", "eager"])
def test_batches_broadcast(method):
    model = reduced()
    v, loads = profile(24)
    twists = tensor(v * RNG.uniform(0.5, 2.0, (4, 1, 1)))
    z = tensor(RNG.normal(size=(5, 1, 3)) * [1e-7, 1e-7, 1e-9])
    for load in (
        1.5,
        tensor(loads),
        tensor(loads).expand(4, 24),
        tensor([[1.0], [2.0], [0.0], [0.5]]),
    ):
        wrenches = rollout(model, z, twists, load, DT, method=method).wrenches
        assert wrenches.shape == (5, 4, 24, 3)
        rows = torch.broadcast_to(
            tensor(load) if isinstance(load, float) else load, (4, 24)
        )
        alone = rollout(model, z[3, 0], twists[2], rows[2], DT, method="eager").wrenches
        torch.testing.assert_close(wrenches[3, 2], alone, rtol=1e-12, atol=1e-14)
    parameters = model.physical().detach() * tensor(RNG.uniform(1.0, 1.02, (4, 12)))
    wrenches = rollout(
        model, None, twists, 1.5, DT, parameters=parameters, method=method
    ).wrenches
    alone = rollout(
        model, None, twists[1], 1.5, DT, parameters=parameters[1], method="eager"
    ).wrenches
    torch.testing.assert_close(wrenches[1], alone, rtol=1e-12, atol=1e-14)


@pytest.mark.parametrize("method", ["adjoint", "eager"])
def test_vmap(method):
    model = reduced()
    v, _ = profile(16)
    twists = tensor(v * RNG.uniform(0.5, 2.0, (3, 1, 1)))
    parameters = model.physical().detach()

    def loss(twist, load, p):
        return (
            rollout(model, None, twist, load, DT, parameters=p, method=method)
            .wrenches.square()
            .sum()
        )

    together = torch.func.vmap(
        torch.func.grad(loss, argnums=2), in_dims=(0, None, None)
    )(twists, 2.0, parameters)
    load = tensor([1.0, 2.0, 3.0])
    by_load = torch.func.vmap(
        torch.func.grad(loss, argnums=1), in_dims=(None, 0, None)
    )(twists[0], load, parameters)
    for i in range(3):
        alone = parameters.clone().requires_grad_()
        loss(twists[i], 2.0, alone).backward()
        torch.testing.assert_close(together[i], alone.grad, rtol=1e-9, atol=1e-15)
        alone = load[i].clone().requires_grad_()
        loss(twists[0], alone, parameters).backward()
        torch.testing.assert_close(by_load[i], alone.grad, rtol=1e-9, atol=1e-15)

    def wrenches(p):
        return rollout(
            model, None, twists, 1.0, DT, parameters=p, method=method
        ).wrenches

    jacobian = torch.func.jacrev(wrenches)(parameters)
    assert jacobian.shape == (3, 16, 3, 12)
    rows = parameters.clone().requires_grad_()
    wrenches(rows)[1, 5, 2].backward()
    torch.testing.assert_close(jacobian[1, 5, 2], rows.grad, rtol=1e-9, atol=1e-15)


def test_gradients_to_raw_parameters_agree_with_central_differences():
    model = reduced(
        trainable=(
            "mu_c",
            "mu_s",
            "sigma_0",
            "sigma_2",
            "v_s",
            "breakaway_ratio",
            "contact_radius",
        )
    )
    t = np.linspace(0.0, 1.0, 50)
    v = tensor(
        np.stack(
            [
                3e-3 * np.sin(6 * t + 0.3),
                2e-3 * np.cos(5 * t),
                0.4 * np.sin(9 * t + 1.0),
            ],
            -1,
        )
    )
    value = lambda: (
        rollout(model, None, v, 2.0, DT).wrenches * tensor([1.0, 0.7, 150.0])
    ).sum()
    gradients = torch.autograd.grad(value(), list(model.parameters()))
    for parameter, gradient in zip(model.parameters(), gradients, strict=True):
        ends = []
        with torch.no_grad():
            for nudge in (1e-6, -2e-6):
                parameter += nudge
                ends.append(value().item())
            parameter += 1e-6
        assert gradient.item() == pytest.approx(
            (ends[0] - ends[1]) / 2e-6, rel=1e-5, abs=1e-6
        )


def test_the_tracking_loss_is_a_mean_over_the_samples_with_load():
    model = reduced()
    v = tensor([[0.01, 0.0, 0.0]] * 4)
    load = tensor([1.0, 2.0, 0.0, 4.0])
    wrenches = rollout(model, None, v, load, DT).wrenches.detach()
    off = wrenches + tensor([0.3, 0.0, 0.4 * model.lever]) * load[:, None]
    off[2] = 7.0  # a sensor's offset without load says nothing about friction
    assert tracking_loss(model, None, v, load, DT, wrenches).item() == 0.0
    assert tracking_loss(model, None, v, load, DT, off).item() == pytest.approx(
        0.25, rel=1e-12
    )
    # The published table smooths it.
    assert model.lever == pytest.approx(PATCH.contact_radius(), rel=0.05)


def test_second_derivatives_need_the_eager_roll_out():
    model = reduced()
    v = tensor(profile(8)[0])
    raw = model.physical.raw["mu_c"]

    def slope(method):
        wrenches = rollout(model, None, v, 1.0, DT, method=method).wrenches
        return torch.autograd.grad(wrenches.square().sum(), [raw], create_graph=True)[0]

    with refused("method='eager'", pf.FrictionError):
        slope("adjoint").backward()
    slope("eager").backward()
    assert raw.grad.isfinite()


def test_a_gradient_to_the_time_step_is_eager():
    model = reduced("plain", "ellipsoid")
    v = tensor([[1e-3, 0.0, 0.0]] * 3)
    dt = tensor(1e-4).requires_grad_()
    rollout(model, None, v, 1.0, dt).wrenches[:, 0].sum().backward()
    ends = [
        rollout(model, None, v, 1.0, 1e-4 + h).wrenches[:, 0].sum().item()
        for h in (1e-9, -1e-9)
    ]
    assert dt.grad.item() == pytest.approx((ends[0] - ends[1]) / 2e-9, rel=1e-5)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            {"method": "adjont"},
            r"method must be one of adjoint, eager, got 'adjont' \(did you mean 'adjoint'\?\)",
        ),
        (
            {"method": "adjoint", "dt": torch.tensor(1e-4, requires_grad=True)},
            "be 'eager' for a gradient to dt",
        ),
        ({"dt": tensor([1e-4, 1e-4])}, "dt must be one number"),
        ({"state": tensor([0.0, 0.0])}, r"state must have shape \[..., 3\]"),
        ({"twist": tensor([0.0, 0.0, 0.0])}, r"twist must have shape \[..., T, 3\]"),
        (
            {"normal_force": tensor([1.0, 2.0])},
            r"normal_force must broadcast with \[..., 4\]",
        ),
        ({"normal_force": -1.0}, "normal_force must be >= 0"),
        ({"twist": tensor([[0.0, np.nan, 0.0]] * 4)}, "twist must be finite"),
        (
            {"model": pf.DistributedModel(PATCH, LAWS["plain"])},
            r"model must be one of planarfriction.torch \(DistributedModel, ReducedModel, ReducedModelPublished\)",
        ),
    ],
)
def test_wrong_input_is_one_line(change, message):
    given = {
        "model": reduced(),
        "state": None,
        "twist": tensor([[0.0] * 3] * 4),
        "normal_force": 1.0,
        "dt": DT,
    }
    with refused(message, pf.FrictionError):
        rollout(**{**given, **change})


def test_a_missing_package_names_its_extra(monkeypatch):
    import builtins
    import sys

    for name in [
        name for name in sys.modules if name.startswith("planarfriction.torch")
    ]:
        monkeypatch.delitem(sys.modules, name)
    original = builtins.__import__

    def without_torch(name, *rest):
        if name == "torch":
            raise ImportError("No module named 'torch'")
        return original(name, *rest)

    monkeypatch.setattr(builtins, "__import__", without_torch)
    with refused(
        r"torch is not installed: run pip install 'planarfriction\[torch\]'",
        pf.FrictionError,
    ):
        import planarfriction.torch  # noqa: F401
