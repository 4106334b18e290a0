"""The paper's model built from numbers: the NumPy values, true gradients, the right torque, scripts that run."""

import inspect

import numpy as np
import pytest

import planarfriction as pf
from tests.support.refusals import refused

torch = pytest.importorskip(
    "torch", reason="needs PyTorch: pip install 'planarfriction[torch]'"
)

import planarfriction.torch  # noqa: E402
from planarfriction.torch import reduced_planar  # noqa: E402
from planarfriction.torch.reduced_planar import (  # noqa: E402
    ReducedPlanarLuGre,
    simulate,
    smoke_test,
    tracking_loss,
)

pytestmark = pytest.mark.torch

NUMBERS = {
    "mu_c": 0.7, "mu_s": 0.9, "v_s": 2e-3, "gamma": 1.7, "sigma_0": 2e5, "sigma_1": 60.0, "sigma_2": 0.3,
}  # fmt: skip
LAW = pf.LuGre(**NUMBERS)
RING = pf.ContactPatch.points(
    [[0.03, 0.0], [-0.015, 0.015 * 3**0.5], [-0.015, -0.015 * 3**0.5]]
)
LOPSIDED = pf.ContactPatch.from_pressure(
    np.random.default_rng(4).uniform(0.0, 1.0, (5, 6)), 0.002
)
SURFACES = {
    "ellipsoid": pf.LimitSurfaceEllipsoid(LOPSIDED),
    "table": pf.LimitSurfaceTable(LOPSIDED),
    "cells": pf.LimitSurfaceCells(LOPSIDED),
    "published": pf.LimitSurfaceTablePublished(LOPSIDED),
}


def tensor(value):
    return torch.tensor(np.asarray(value), dtype=torch.float64)


def build(**options):
    return ReducedPlanarLuGre(**{**NUMBERS, "dtype": torch.float64, **options})


def profile(steps=300):
    """Slides and turns of changing direction, through rest, from below to far above the Stribeck speed."""
    t = torch.linspace(0.0, 1.0, steps, dtype=torch.float64)
    return torch.stack(
        [1e-2 * torch.sin(12 * t), 4e-3 * torch.cos(9 * t), 0.8 * torch.sin(7 * t + 1)],
        -1,
    )


def assert_equal(tensors, arrays):
    """To 1e-12 of the largest: a few dozen operations, each with a rounding of 1e-16."""
    for got, wanted in zip(tensors, arrays, strict=True):
        got = got.detach().numpy()
        assert got.shape == wanted.shape
        np.testing.assert_allclose(
            got, wanted, rtol=1e-12, atol=1e-12 * np.abs(wanted).max()
        )


def samples(count=40):
    rng = np.random.default_rng(1)
    state = rng.normal(size=(count, 3)) * [1e-6, 1e-6, 3e-8]
    twist = (
        rng.normal(size=(count, 3))
        * [1e-3, 1e-3, 0.05]
        * 10.0 ** rng.uniform(-2, 2, (count, 1))
    )
    twist[:2] = 0.0
    state[2:4] = 0.0
    return state, twist, rng.uniform(0.2, 3.0, count)


# ---------------------------------------------------------------------------------------- the interface


def test_the_interface_is_the_one_that_scripts_know():
    defaults = {
        "mu_c": 1.0,
        "mu_s": 1.2,
        "v_s": 1e-3,
        "gamma": 2.0,
        "sigma_0": 1e6,
        "sigma_1": 8e2,
        "sigma_2": 0.2,
    }
    defaults |= {"radius": 0.05, "surface": None}
    parameters = inspect.signature(ReducedPlanarLuGre).parameters.values()
    assert [
        (p.name, p.default) for p in parameters if p.kind is not p.KEYWORD_ONLY
    ] == list(defaults.items())
    assert planarfriction.torch.ReducedPlanarLuGre is ReducedPlanarLuGre
    model = ReducedPlanarLuGre()
    for name, value in defaults.items():
        if name != "surface":
            # Float32, PyTorch's default.
            assert getattr(model, name).item() == pytest.approx(value, rel=1e-6)
    assert len(list(model.parameters())) == 8


def test_shapes_of_one_contact_and_of_batches():
    model = ReducedPlanarLuGre()
    v_profile = profile(20).float()
    z = torch.zeros(3)
    v = v_profile[3]
    z_dot, wrench = model(z=z, v=v, f_n=1.0)
    assert z_dot.shape == wrench.shape == (3,) and z_dot.dtype == torch.float32
    z, wrench = model.step(z=z, v=v, f_n=1.0, dt=1e-4)
    assert z.shape == wrench.shape == (3,)
    z, wrench = model.step(
        torch.zeros(5, 1, 3), v_profile[:4], torch.ones(5, 4), dt=1e-4
    )
    assert z.shape == wrench.shape == (5, 4, 3)
    assert (
        model.steady_state_z(v_profile).shape
        == model.bristle_rate(torch.zeros(3), v_profile).shape
        == (20, 3)
    )
    assert model.force(z, z, v, 1.0).shape == (5, 4, 3)
    assert model.g(torch.ones(4, 2)).shape == (4, 2) and model.g(0.1).shape == ()
    assert simulate(model, v_profile, 1.0).shape == (20, 3)
    assert simulate(
        model, v_profile.expand(6, 20, 3), f_n=torch.ones(20), dt=1e-3
    ).shape == (6, 20, 3)
    assert tracking_loss(model, v_profile, torch.zeros(20, 3), 1.0).shape == ()


def test_a_script_recovers_the_friction_and_the_radius():
    truth = build(radius=0.02)
    model = build(mu_c=0.5, mu_s=0.6, radius=0.03)
    v_profile = profile(200)
    reference = simulate(truth, v_profile, f_n=2.0, dt=1e-3).detach()
    optimiser = torch.optim.Adam(model.parameters(), lr=0.05)
    for _ in range(200):
        optimiser.zero_grad()
        loss = tracking_loss(model, v_profile, reference, f_n=2.0, dt=1e-3)
        loss.backward()
        optimiser.step()
    # an optimiser with a fixed step hovers about the optimum
    assert model.mu_c.item() == pytest.approx(0.7, rel=0.02)
    assert model.radius.item() == pytest.approx(0.02, rel=0.02)
    assert model.mu_s >= model.mu_c


# ---------------------------------------------------------------------------------------- values


@pytest.mark.parametrize("surface", [None, *SURFACES.values()], ids=["none", *SURFACES])
def test_equals_the_numpy_model(surface):
    model = build(radius=0.03) if surface is None else build(surface=surface)
    patch = RING if surface is None else LOPSIDED
    reference = pf.ReducedModelPublished(
        patch, LAW, pf.LimitSurfaceEllipsoid(RING) if surface is None else surface
    )
    state, twist, load = samples()
    z = tensor(state)
    v = tensor(twist)
    f_n = tensor(load)
    wanted = (reference.rate(state, twist, load), reference.wrench(state, twist, load))
    assert_equal(model(z, v, f_n), wanted)
    assert_equal([model.bristle_rate(z, v)], wanted[:1])
    assert_equal([model.force(z, model.bristle_rate(z, v), v, f_n)], wanted[1:])
    for dt in (1e-5, 1e-2):
        assert_equal(model.step(z, v, f_n, dt), reference.step(state, twist, load, dt))
    state = reference.rest()
    wrenches = []
    for twist in profile(50).numpy():
        state, wrench = reference.step(state, twist, 2.0, 1e-3)
        wrenches.append(wrench)
    assert_equal([simulate(model, profile(50), 2.0, 1e-3)], [np.array(wrenches)])


# ---------------------------------------------------------------------------------------- size


def test_a_surface_keeps_its_size_unless_a_radius_is_given():
    surface = SURFACES["cells"]
    r = float(LOPSIDED.contact_radius())
    assert build(surface=surface).radius.item() == pytest.approx(r, rel=1e-12)
    # As large as the default, but given.
    assert build(surface=surface, radius=0.05).radius.item() == 0.05
    assert build().radius.item() == 0.05


def test_a_given_radius_scales_the_patch_of_the_surface():
    patch = pf.ContactPatch.disc(0.01, cells=9)
    larger = pf.ContactPatch.disc(0.03, cells=9)
    model = build(
        surface=pf.LimitSurfaceCells(patch), radius=float(larger.contact_radius())
    )
    reference = pf.ReducedModelPublished(larger, LAW, pf.LimitSurfaceCells(larger))
    state, twist, load = samples()
    for got, wanted in zip(
        model.step(tensor(state), tensor(twist), tensor(load), 1e-3), reference.step(state, twist, load, 1e-3),
        strict=True,
    ):  # fmt: skip
        # the outlines of the two discs are polygons that were cut with roundings of their own
        np.testing.assert_allclose(
            got.detach(), wanted, rtol=1e-9, atol=1e-9 * np.abs(wanted).max()
        )


def test_a_new_radius_brings_its_second_moment():
    model = build(surface=SURFACES["cells"])
    form = float(LOPSIDED.second_moment() / LOPSIDED.contact_radius() ** 2)
    for radius in (0.01, 0.07):
        model.set(contact_radius=radius)
        assert model.value("second_moment").item() == pytest.approx(
            form * radius**2, rel=1e-12
        )
    model.set(mu_c=0.3)
    with torch.no_grad():
        model.physical.raw["contact_radius"].add_(1.0)
    assert model.radius.item() == pytest.approx(0.07 * np.e, rel=1e-12)
    assert model.value("second_moment").item() == pytest.approx(
        form * (0.07 * np.e) ** 2, rel=1e-12
    )


# ---------------------------------------------------------------------------------------- gradients


def test_rollouts_take_the_compiled_adjoint(monkeypatch):
    from planarfriction.torch import adjoint

    calls = []
    original = adjoint.call
    monkeypatch.setattr(
        adjoint, "call", lambda *inputs: calls.append(1) or original(*inputs)
    )
    simulate(build(), profile(5), 1.0)
    assert calls


# ---------------------------------------------------------------------------------------- what goes wrong


@pytest.mark.parametrize(
    ("numbers", "message"),
    [
        ({"mu_s": 0.5}, "mu_s must be >= mu_c"),
        ({"sigma_0": 0.0}, "sigma_0 must be"),
        ({"radius": 0.0}, "radius must be > 0"),
        ({"radius": float("nan")}, "radius must be"),
        ({"surface": "ellipsoid"}, "surface must be a limit surface"),
    ],
)
def test_numbers_out_of_range_are_one_line(numbers, message):
    with refused(message, pf.FrictionError):
        build(**numbers)


def test_smoke_test_prints_one_line_and_sees_a_torque_without_its_radius(
    capsys, monkeypatch
):
    smoke_test()
    assert capsys.readouterr().out.count("\n") == 1
    # what the published snippet does
    monkeypatch.setattr(
        reduced_planar, "simulate", lambda *a: simulate(*a) / tensor([1.0, 1.0, 0.05])
    )
    with refused("above mu_s f_n r", pf.FrictionError):
        smoke_test()
