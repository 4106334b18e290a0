"""Derivatives of roll-outs on patches whose shape follows the load: through F, the blend of maps and the shares."""

from __future__ import annotations

import functools

import numpy as np
import pytest

import planarfriction as pf
from planarfriction import derivatives
from planarfriction.errors import InvalidValueError

X, Y = np.meshgrid(np.arange(-3, 4) * 1e-3, np.arange(3, -4, -1) * 1e-3)
LIGHT = np.maximum(1.0 - ((X - 1e-3) ** 2 + Y**2) / 0.003**2, 0.0)
HEAVY = np.sqrt(np.maximum(1.0 - (X**2 + (Y - 1e-3) ** 2) / 0.0045**2, 0.0))
TIP = pf.ContactPatch.from_pressure({0.5: LIGHT, 4.0: HEAVY}, cell_size=1e-3)
"""Grows, flattens and moves; no cell gets its first load between the two maps."""

ELASTIC = pf.LuGre(mu_c=0.7, mu_s=1.2, gamma=1.5, elasto_plastic=pf.ElastoPlastic(0.3))
MODELS = {
    "plain": (TIP, pf.LuGre(mu_c=0.7, mu_s=1.2), 1),
    "elasto-plastic": (TIP, ELASTIC, 1),
    "parts": (TIP, ELASTIC, 3),
    "grain": (TIP.with_friction_metric(pf.friction_metric(0.6, along=0.5, across=1.0)), ELASTIC, 1),
    "asymmetric": (
        TIP.with_friction_metric(pf.friction_metric(0.6, along=0.5, across=1.0), asymmetry=[0.2, -0.1]),
        ELASTIC,
        2,
    ),
}
LOADS = np.linspace(1.031, 3.063, 12)
"""A ramp over many rungs."""

DT, T, SIZES = 1e-4, len(LOADS), np.array([1.0, 1.0, 250.0])

every_model = pytest.mark.parametrize("kind", MODELS)


@functools.cache
def model_of(kind: str, load_error: float = 3e-4) -> pf.ReducedModel:
    patch, law, parts = MODELS[kind]
    return pf.ReducedModel(patch, law, parts=parts, segments=8, speeds=6, load_error=load_error)


def drive(model: pf.ReducedModel, seed: int = 0):
    """A state, and twists that start, slide, spin and turn back."""
    random = np.random.default_rng(seed)
    return random.normal(size=model.state_shape) * 3e-7, np.cumsum(random.normal(size=(T, 3)), axis=0) * 3e-3 * SIZES


def bars_of(model: pf.ReducedModel, seed: int = 1):
    random = np.random.default_rng(seed)
    return random.normal(size=(T, 3)) * SIZES, random.normal(size=model.state_shape) * 1e6


# ---------------------------------------------------------------------- closed forms


def test_the_torque_of_a_slide_follows_the_centre_of_pressure():
    """`W = -mu f (1, 0, -y(f))` of a slide along x; y is linear in the load between two measured ones."""
    x, y = np.array([[0.01, -0.01, 0.0], [0.0, 0.002, 0.012]])
    shares = np.array([[0.6, 0.3, 0.1], [0.1, 0.3, 0.6]])
    feet = pf.ContactPatch.points(np.stack([x, y], 1))
    law = pf.LuGre(mu_c=0.8, mu_s=0.8, sigma_2=0.0)
    for parts in (1, 3):
        patch = pf.ContactPatch(feet.positions, feet.areas, pf.PressureMaps((1.0, 3.0), shares))
        model = pf.ReducedModel(patch, law, parts=parts, segments=8, speeds=6)
        load, bar = 1.6, np.array([[0.0, 0.0, 1.0]])
        found = derivatives.rollout_vjp(model, None, [[0.01, 0.0, 0.0]], load, 1e6, bar)
        low, high = shares @ y
        centre, slope = low + (load - 1.0) * (high - low) / 2.0, (high - low) / 2.0
        # Slopes of F err by 1e-10; along one direction maps are in single precision, whose part in the torque is 1e-6
        # of the pressure's radius.
        assert float(found.normal_force) == pytest.approx(0.8 * (centre + load * slope), rel=1e-6, abs=1e-8)


@every_model
def test_a_family_that_stays_as_it_is_has_the_gradient_of_a_fixed_patch(kind):
    patch, law, parts = MODELS[kind]
    measured = pf.ContactPatch.from_pressure({0.5: HEAVY, 4.0: 2.0 * HEAVY}, cell_size=1e-3)
    fixed = pf.ContactPatch.from_pressure(HEAVY, cell_size=1e-3)
    if patch.metric is not None:
        measured, fixed = (p.with_friction_metric(patch.metric, asymmetry=patch.asymmetry) for p in (measured, fixed))
    family = pf.ReducedModel(measured, law, parts=parts, segments=8, speeds=6)
    single = pf.ReducedModel(fixed, law, parts=parts, segments=8, speeds=6)
    if not np.array_equal(family.reduction.labels, single.reduction.labels):  # split by the load and by the area
        family, single = (pf.ReducedModel(p, law, segments=8, speeds=6, parts=1) for p in (measured, fixed))
    state, twists = drive(family)
    bars = bars_of(family)
    loads = LOADS.copy()
    loads[4] = 0.0
    found, wanted = (derivatives.rollout_vjp(m, state, twists, loads, DT, *bars) for m in (family, single))
    for got, want in zip(found, wanted, strict=True):
        # weights at another load differ by rounding, and so do slopes of the shape: 1e-16 over the step of 1e-5
        assert got == pytest.approx(want, rel=1e-8, abs=1e-9 * np.abs(want).max())
    assert {rung for rung in family.reduction.load_rungs if rung > 1e-6} == {1.0, 2.0}  # no maps to move towards


# ---------------------------------------------------------------------- against differences


@pytest.mark.parametrize(("kind", "error"), [("elasto-plastic", 4e-3), ("parts", 1e-3)])
def test_a_load_that_one_rung_serves_moves_on_along_the_blend(kind, error, monkeypatch):
    """The blend of the very same rungs, read where it is as good as the nearer rung alone."""
    patch, law, parts = MODELS[kind]
    model = pf.ReducedModel(patch, law, parts=parts, segments=8, speeds=6, load_error=error)
    state, twists = drive(model, 3)
    bars = bars_of(model)
    for rung in (1.0, 2.0):
        at_rung = [part.shape.data for part in model.reduction.parts_at(rung)]
        for load in (rung * (1.0 + 1e-6), rung * (1.0 - 1e-6)):
            for part, data in zip(model.reduction.parts_at(load), at_rung, strict=True):
                assert part.shape.other is None and np.array_equal(part.shape.data, data)
            served = derivatives.rollout_vjp(model, state, twists, load, DT, *bars)
            with monkeypatch.context() as patched:
                for part in model.reduction.shapes.each:
                    patched.setattr(part.family, "_error", 1e-12)
                    patched.setattr(part.family, "_shapes", {})
                assert all(part.shape.blend > 0.0 for part in model.reduction.parts_at(load))
                ends = [pf.rollout(model, state, twists, load * (1.0 + h), DT) for h in (5e-7, -5e-7)]
            values = [(bars[0] * run.wrenches).sum() + (bars[1] * run.state).sum() for run in ends]
            # 1e-6 of the way to the next rung, and rounding of numbers near 100 by 1e-16/1e-6
            assert float(served.normal_force) == pytest.approx((values[0] - values[1]) / (1e-6 * load), rel=2e-6)


def test_steady_sliding_depends_on_the_load_as_in_the_distributed_model():
    """Over one long step, where the closure has no say."""
    patch, law, twist = TIP.refined(3), pf.LuGre(mu_c=0.7, mu_s=1.2), 3e-3 * SIZES * [1.0, 0.5, 1.0]
    exact, step = pf.DistributedModel(patch, law), 1e-5
    for parts in (1, 2):
        model = pf.ReducedModel(patch, law, parts=parts, segments=12, load_error=2e-3)
        for load in (1.3, 2.2):
            tangent = derivatives.rollout_jvp(
                model, None, twist[None], load, 1e6, derivatives.RolloutTangent(normal_force=1.0)
            )
            ends = [exact.step(exact.rest(), twist, load * (1.0 + h), 1e6)[1] for h in (step, -step)]
            wanted = (ends[0] - ends[1]) / (2.0 * step * load)
            held = ends[0] / load  # with the shape held
            error, moved = (np.abs(a - wanted) * SIZES for a in (tangent.wrenches_dot[0], held))
            # chords of the blend, and cells as areas in the one and points in the other
            assert error.max() < 0.05 * moved.max()


# ---------------------------------------------------------------------- ends of the range


def test_without_load_the_slope_is_the_wrench_per_newton_of_a_small_one():
    model = model_of("parts")
    state, twists = drive(model, 7)
    loads = LOADS.copy()
    loads[4] = 0.0
    bar = np.ones((T, 3)) * (np.arange(T) == 4)[:, None]
    found = derivatives.rollout_vjp(model, state, twists, loads, DT, bar)
    before = derivatives.rollout_states(model, state, twists, loads, DT).states[4]
    small = model.step(before, twists[4], 1e-6, DT)[1].sum() / 1e-6
    assert found.normal_force[4] == pytest.approx(small, rel=1e-9)
    assert not found.twist.any() and not found.normal_force[:4].any()
    alone = derivatives.rollout_vjp(model, before, twists[4:5], 0.0, DT, bar[4:5])
    assert float(alone.normal_force) == pytest.approx(small, rel=1e-9)


def test_a_contact_that_shrinks_to_a_point_has_finite_slopes():
    pair = pf.ContactPatch.points([(0.0, 0.0), (0.011, 0.0)])
    patch = pf.ContactPatch(pair.positions, pair.areas, pf.SoftFinger(c=0.01, n=1.0, k=2.0))
    model = pf.ReducedModel(patch, ELASTIC, segments=8, speeds=6, parts=1)
    loads = np.array([1.1 * (1.0 - 1e-7), 1.1, 1.1 * (1.0 + 5e-6), 1.105, 0.5, 5e-324])
    twists = np.tile([1e-3, 1e-3, 0.1], (len(loads), 1))
    found = derivatives.rollout_vjp(model, None, twists, loads, DT, np.ones((len(loads), 3)))
    assert all(np.isfinite(g).all() for g in found)
    # a point has a wrench in proportion to its load
    ends = [pf.rollout(model, None, twists, loads + h * (np.arange(6) == 4), DT).wrenches.sum() for h in (1e-3, -1e-3)]
    assert found.normal_force[4] == pytest.approx((ends[0] - ends[1]) / 2e-3, rel=1e-9)


def test_a_contact_that_has_just_ceased_to_be_a_point_looks_ahead_alone():
    """Up to a share of 1e-6 of the other foot it is a point, behind that its radius goes on from 11 um."""
    pair = pf.ContactPatch.points([(0.0, 0.0), (0.011, 0.0)])
    patch = pf.ContactPatch(pair.positions, pair.areas, pf.PressureMaps((1.0, 2.0), [[1.0, 0.0], [1.0, 2e-6]]))
    model = pf.ReducedModel(patch, ELASTIC, segments=8, speeds=6, parts=1)
    low, high = 1.4, 1.6
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if model.reduction.shape_at(middle).contact_radius == 0.0 else (low, middle)
    load, twist, bar = high * (1.0 + 2e-6), [[0.0, 0.0, 0.1]], [[0.0, 0.0, 1.0]]
    found = derivatives.rollout_vjp(model, None, twist, load, DT, bar)
    ends = [pf.rollout(model, None, twist, load * (1.0 + h), DT).wrenches[0, 2] for h in (1e-6, -1e-6)]
    # the radius bends by 1e-5 of itself over the step; rounding is 1e-16 over 1e-6
    assert float(found.normal_force) == pytest.approx((ends[0] - ends[1]) / (2e-6 * load), rel=1e-4)


def test_a_map_for_each_load_is_refused_in_one_line():
    model = pf.ReducedModel(TIP, ELASTIC, segments=8, speeds=6, load_error=0.0, parts=1)
    state, twists = drive(model)
    with pytest.raises(InvalidValueError, match=r"^load_error must be > 0 for derivatives .*, got 0.0$") as caught:
        derivatives.rollout_jvp(model, state, twists, LOADS, DT)
    assert "\n" not in str(caught.value)
    assert pf.rollout(model, state, twists[:2], LOADS[:2], DT).wrenches.shape == (2, 3)
