"""Pads, whose stiffness is their own: closed forms of elastic contacts, passivity, limits, and derivatives."""

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planarfriction.derivatives import (
    RolloutTangent,
    parameters_of,
    rollout_jacobian,
    rollout_jvp,
    rollout_vjp,
)
from planarfriction.errors import InvalidValueError, SolverError
from planarfriction.laws import Dahl, LuGre
from planarfriction.models import DistributedModel, ReducedModel
from planarfriction.pads import Pad
from planarfriction.patch import ContactPatch, SoftFinger

REFERENCE = 2.0
AT_LOAD = Pad.at_load(REFERENCE)
METRIC = np.array([[1.3, 0.2], [0.2, 0.8]])
_DISC = ContactPatch.disc(0.02, cells=5)


def _patch(radius, metric):
    radii = np.full(_DISC.cells, radius)
    return ContactPatch(
        _DISC.positions, _DISC.areas, _DISC.weights(), metric=metric, radii=radii
    )


PATCHES = {
    "points": _patch(0.0, None), "turned points": _patch(0.0, METRIC),
    "discs": _patch(0.004, None), "turned discs": _patch(0.004, METRIC),
}  # fmt: skip
LAWS = {
    "lugre": (LuGre, {"mu_s": 1.3}),
    "elasto-plastic": (LuGre, {"mu_s": 1.3, "elasto_plastic": 0.9}),
    "dahl": (Dahl, {}),
}  # fmt: skip


every_patch = pytest.mark.parametrize("patch", PATCHES.values(), ids=PATCHES)
every_law = pytest.mark.parametrize(("kind", "given"), LAWS.values(), ids=LAWS)


def _twists(seed, count=40):
    rng = np.random.default_rng(seed)
    return (
        rng.normal(size=(count, 3))
        * 10.0 ** rng.uniform(-5.0, -2.0, (count, 1))
        * [1.0, 1.0, 50.0]
    )


@every_patch
@every_law
@pytest.mark.parametrize("load", [REFERENCE, 3.0, 0.4])
def test_at_a_held_load_it_is_a_law_of_another_sigma_0(patch, kind, given, load):
    """With the load of the pad the published law itself, to rounding, but for its damping."""
    given = given | ({"sigma_1": 0.0} if kind is LuGre else {})
    fixed = DistributedModel(patch, kind(**given), pad=AT_LOAD)
    published = DistributedModel(patch, kind(**given, sigma_0=1e6 * REFERENCE / load))
    scale = published.law.largest_deflection
    z = fixed.rest()
    y = published.rest()
    for twist in _twists(1):
        for _ in range(4):
            (z, pull) = fixed.step(z, twist, load, 1e-3)
            (y, wanted) = published.step(y, twist, load, 1e-3)
            np.testing.assert_allclose(z, y, rtol=0.0, atol=1e-12 * scale)
            np.testing.assert_allclose(pull, wanted, rtol=1e-12, atol=1e-12)
        np.testing.assert_allclose(
            fixed.rate(z, twist, load),
            published.rate(y, twist, load),
            rtol=0.0,
            atol=1e-10 * np.abs(twist).max(),
        )
        np.testing.assert_allclose(
            fixed.wrench(z, twist, load),
            published.wrench(y, twist, load),
            rtol=1e-11,
            atol=1e-12,
        )


@every_patch
def test_a_held_contact_keeps_its_force_when_it_is_pressed_harder(patch):
    law = LuGre(elasto_plastic=0.9)
    fixed = DistributedModel(patch, law, pad=AT_LOAD)
    published = DistributedModel(patch, law)
    state, _ = fixed.step(fixed.rest(), [1e-4, 5e-5, 2e-3], REFERENCE, 1e-3)
    still, first = fixed.step(state, np.zeros(3), REFERENCE, 1e-3)
    np.testing.assert_allclose(still, state, rtol=1e-15)
    harder, pull = fixed.step(state, np.zeros(3), 2.0 * REFERENCE, 1e-3)
    np.testing.assert_allclose(harder, state, rtol=1e-15)
    np.testing.assert_allclose(pull, first, rtol=1e-13)
    np.testing.assert_allclose(
        fixed.wrench(state, np.zeros(3), 2.0 * REFERENCE), first, rtol=1e-13
    )
    np.testing.assert_allclose(
        published.step(state, np.zeros(3), 2.0 * REFERENCE, 1e-3)[1],
        2.0 * first,
        rtol=1e-13,
    )


@every_patch
def test_a_bristle_beyond_its_limit_returns_when_the_load_falls(patch):
    law = LuGre(mu_c=0.8, mu_s=1.1, elasto_plastic=0.9)
    model = DistributedModel(patch, law, pad=AT_LOAD)
    bent = np.zeros(model.state_shape)
    bent[0] = np.linspace(0.1, 1.0, patch.cells) * law.mu_s / law.sigma_0
    for load in (REFERENCE, 1.0, 0.1):
        limit = law.mu_s * load / (law.sigma_0 * REFERENCE)
        state, pull = model.step(bent, np.zeros(3), load, 1e-3)
        size = np.linalg.norm(bent, axis=0)
        np.testing.assert_allclose(
            state, bent * np.minimum(limit / size, 1.0), rtol=1e-11, atol=1e-21
        )
        rate = model.rate(bent, np.zeros(3), load)
        np.testing.assert_allclose(rate[:, size <= limit], 0.0, atol=1e-15)
        assert ((rate * bent).sum(0)[size > limit] < 0.0).all()
        stiffness = law.sigma_0 * REFERENCE * patch.weights()
        wanted = -np.einsum("n,nij,in->j", stiffness, patch.levers(), state)
        np.testing.assert_allclose(pull, wanted, rtol=1e-11, atol=1e-15)


def test_a_load_from_zero_begins_without_force():
    model = ReducedModel(_DISC, LuGre(), pad=AT_LOAD)
    state, pull = model.step(model.rest() + 1e-7, np.zeros(3), 0.0, 1e-3)
    assert not state.any() and not pull.any()
    for load in (1e-300, 1e-20, 1e-9):
        state, pull = model.step(state, [1e-3, 0.0, 0.0], load, 1e-3)
        assert 0.0 < -pull[0] <= 1.01 * load
    assert np.isfinite(model.rate(model.rest() + 1e-7, [1e-3, 0.0, 0.0], 0.0)).all()


@every_patch
@pytest.mark.parametrize("ratio", [None, 0.9])
def test_stored_energy_never_grows_with_the_load(patch, ratio):
    law = LuGre(sigma_1=0.0, elasto_plastic=ratio)
    model = DistributedModel(patch, law, pad=AT_LOAD)
    rng = np.random.default_rng(2)
    shares = law.sigma_0 * REFERENCE * patch.weights()
    state = 1e-6 * rng.normal(size=model.state_shape)
    before = 0.5 * (shares * state**2).sum()
    fell = 0
    for load in rng.uniform(0.05, 8.0, 200):
        state, _ = model.step(state, np.zeros(3), load, 1e-2)
        energy = 0.5 * (shares * state**2).sum()
        assert energy <= before * (1.0 + 1e-13)
        fell += energy < 0.99 * before
        before = energy
    assert fell > 1


@every_patch
@pytest.mark.parametrize("ratio", [None, 0.9])
def test_no_work_comes_out_that_was_not_put_in(patch, ratio):
    """Paths of the twist are closed, whatever the loads do meanwhile; the published law gives work out in some."""
    count = 10_000
    steps = 12
    rng = np.random.default_rng(3)
    path = np.cumsum(
        rng.normal(size=(count, steps, 3))
        * [1e-6, 1e-6, 1e-4]
        * 10.0 ** rng.uniform(-2, 0, (count, 1, 1)),
        1,
    )
    path[:, -1] = 0.0
    moves = np.diff(path, axis=1, prepend=0.0)
    loads = 10.0 ** rng.uniform(-1.0, 1.0, (count, steps))
    least = {}
    for pad in (AT_LOAD, None):
        model = DistributedModel(
            patch, LuGre(sigma_1=0.0, elasto_plastic=ratio), pad=pad
        )
        state = model.rest(count)
        work = np.zeros(count)
        for move, load in zip(moves.swapaxes(0, 1), loads.T, strict=True):
            state, pull = model.step(state, move / 1e-3, load, 1e-3)
            work -= (pull * move).sum(axis=-1)
        least[pad] = work.min() / np.abs(work).max()
    assert least[AT_LOAD] > -1e-12
    assert least[None] < -1e-4


def _differences(function, size, at):
    return [
        (a - b) / (2.0 * size * at)
        for a, b in zip(
            function(at * (1.0 + size)), function(at * (1.0 - size)), strict=True
        )
    ]


@every_patch
@every_law
@pytest.mark.parametrize("load", [REFERENCE, 2.9, 0.7])
def test_derivatives_are_those_of_differences(patch, kind, given, load):
    model = DistributedModel(patch, kind(**given), pad=AT_LOAD)
    rng = np.random.default_rng(4)
    state = 4e-7 * rng.normal(size=model.state_shape)
    twist = np.array([8e-4, -3e-4, 0.03])
    slopes = model.jacobians(state, twist, load)
    step = model.step_jacobians(state, twist, load, 1e-3)
    rate, wrench = _differences(
        lambda f: (model.rate(state, twist, f), model.wrench(state, twist, f)),
        1e-6,
        load,
    )
    size = np.abs(rate).max()
    np.testing.assert_allclose(slopes.rate_load, rate, rtol=1e-5, atol=1e-6 * size)
    np.testing.assert_allclose(slopes.wrench_load, wrench, rtol=1e-5, atol=1e-8)
    of_new, of_step = _differences(
        lambda f: model.step(state, twist, f, 1e-3), 1e-6, load
    )
    np.testing.assert_allclose(
        step.state_load, of_new, rtol=1e-5, atol=1e-6 * np.abs(of_new).max()
    )
    np.testing.assert_allclose(step.wrench_load, of_step, rtol=1e-5, atol=1e-7)
    by_state = 1e-12 * rng.normal(size=state.shape)
    by_twist = 1e-9 * np.array([1.0, -2.0, 50.0])
    for found, d_state, d_twist in (
        ("state", by_state, 0.0 * by_twist),
        ("twist", 0.0 * by_state, by_twist),
    ):
        above, below = (
            model.step(state + s * d_state, twist + s * d_twist, load, 1e-3)
            for s in (1.0, -1.0)
        )
        rates = [
            model.rate(state + s * d_state, twist + s * d_twist, load)
            for s in (1.0, -1.0)
        ]
        new, pull = (0.5 * (a - b) for a, b in zip(above, below, strict=True))
        if found == "state":
            mine = (
                np.einsum("abn,bn->an", step.state_state, d_state),
                np.einsum("dan,an->d", step.wrench_state, d_state),
            )
            of_rate = np.einsum("abn,bn->an", slopes.rate_state, d_state)
        else:
            mine = (step.state_twist @ d_twist, step.wrench_twist @ d_twist)
            of_rate = slopes.rate_twist @ d_twist
        for one, other in (
            (mine[0], new),
            (mine[1], pull),
            (of_rate, 0.5 * (rates[0] - rates[1])),
        ):
            np.testing.assert_allclose(
                one, other, rtol=1e-4, atol=1e-5 * np.abs(other).max()
            )


@settings(max_examples=60, deadline=None)
@given(
    st.floats(0.05, 10.0), st.floats(1e-3, 1e3), st.floats(1.0, 2.0), st.floats(0.0, 0.99),
    st.lists(st.floats(-2e-6, 2e-6), min_size=2, max_size=2),
)  # fmt: skip
def test_a_bristle_at_rest_never_holds_more_than_its_limit(
    load, reference, mu_s, ratio, bent
):
    law = LuGre(mu_s=mu_s, elasto_plastic=ratio)
    patch = ContactPatch.points([[-0.01, 0.0], [0.01, 0.0]])
    model = DistributedModel(patch, law, pad=Pad.at_load(reference))
    _, pull = model.step(
        np.repeat(np.array(bent)[:, None], 2, 1), np.zeros(3), load, 1e-3
    )
    assert math.hypot(*pull[:2]) <= mu_s * load * (1.0 + 1e-12)
    held = law.sigma_0 * reference * math.hypot(*bent)
    np.testing.assert_allclose(
        math.hypot(*pull[:2]), min(held, mu_s * load), rtol=1e-9, atol=1e-300
    )


@every_patch
@every_law
def test_at_its_load_derivatives_of_rollouts_are_the_published(patch, kind, given):
    given = given | ({"sigma_1": 0.0} if kind is LuGre else {})
    fixed = DistributedModel(patch, kind(**given), pad=AT_LOAD)
    published = DistributedModel(patch, kind(**given))
    rng = np.random.default_rng(6)
    twists = _twists(5)
    state = 1e-7 * rng.normal(size=fixed.state_shape)
    bars = rng.normal(size=(40, 3))
    found, wanted = (
        rollout_vjp(model, state, twists, REFERENCE, 1e-3, bars)
        for model in (fixed, published)
    )
    assert found.normal_force != wanted.normal_force
    for got, want in (
        (getattr(each, name) for each in (found, wanted))
        for name in ("state", "twist", "parameters")
    ):
        if got.shape == (8,):  # all but sigma_1: damping is along the velocity
            got, want = np.delete(got, 1), np.delete(want, 1)
        np.testing.assert_allclose(got, want, rtol=1e-9, atol=1e-9 * np.abs(want).max())
    slopes = (
        np.delete(
            rollout_jacobian(model, state, twists, REFERENCE, 1e-3).d_wrenches, 1, -1
        )
        for model in (fixed, published)
    )
    np.testing.assert_allclose(*slopes, rtol=1e-9, atol=1e-9)
    turned = RolloutTangent(
        state, twists, parameters=parameters_of(fixed) * (np.arange(8) != 1)
    )
    changes = (
        rollout_jvp(model, state, twists, REFERENCE, 1e-3, turned).wrenches_dot
        for model in (fixed, published)
    )
    np.testing.assert_allclose(*changes, rtol=1e-9, atol=1e-9)


# ---------------------------------------------------------------------- elastic contacts

R = 0.01
G = 1e6
NU = 0.42
QUASISTATIC = LuGre(sigma_1=0.0, sigma_2=0.0, elasto_plastic=0.9)
FULL_SHIFT = 3.0 * (2.0 - NU) / (16.0 * G * R)
"""Shift [m] of a Hertz contact of 1 N on an elastic half-space at which all slips (Cattaneo 1938; Mindlin 1949)."""
UNIT_SPIN = 1.0 / (G * R**2)
"""Unit of its rotation [rad]."""
LARGEST_TORQUE = 3.0 * np.pi / 16.0 * R
"""Torque [N m] at which all slips."""

LUBKIN = np.array(
    [(0.0, 0.0), (0.0037594459, 0.019751372), (0.018993527, 0.093920022), (0.038513879, 0.17634538),
     (0.07941921, 0.3105273), (0.12343625, 0.40973848), (0.17163735, 0.48047998), (0.22571186, 0.52857597),
     (0.28853389, 0.5591933), (0.36556995, 0.57686804), (0.46925488, 0.58554257)]
)  # fmt: skip
"""Rotation of a half-space over mu P/(G a^2), and torque over mu P a (Lubkin 1951, by quadrature)."""


def _hertz(x, y):
    return math.sqrt(max(1.0 - (x * x + y * y) / R**2, 0.0))


HERTZ = ContactPatch.disc(R, pressure=_hertz)


def _path(model, shift, count=100):
    """Return the wrenches of friction, the other way round, along a straight path from rest."""
    state = model.rest()
    found = []
    for _ in range(count):
        state, pull = model.step(state, shift, 1.0, 1.0 / count)
        found.append(-pull)
    return np.array(found)


def _loss(model, axis, size, count=200):
    """Return the energy lost in the second cycle of a displacement."""
    state = model.rest()
    work = 0.0
    before = np.zeros(3)
    quarter = np.ones(count // 4)
    signs = np.concatenate([quarter, -quarter, -quarter, quarter])
    for k, sign in enumerate(np.tile(signs, 2)):
        step = np.zeros(3)
        step[axis] = sign * 4.0 * size / count
        state, pull = model.step(state, step, 1.0, 1.0)
        work -= 0.5 * float((before + pull) @ step) if k >= count else 0.0
        before = pull
    return work


@pytest.fixture(scope="module")
def half_spaces():
    pad = Pad.half_space(G, NU)
    return {
        "cells": DistributedModel(HERTZ, QUASISTATIC, pad=pad),
        "discs": ReducedModel(HERTZ, QUASISTATIC, pad=pad),
    }


@pytest.mark.parametrize(
    ("kind", "shift", "torsion"), [("cells", 0.009, 0.022), ("discs", 0.015, 0.03)]
)
def test_a_hertz_contact_slips_as_cattaneo_and_lubkin_say(
    half_spaces, kind, shift, torsion
):
    model = half_spaces[kind]
    force = _path(model, (1.2 * FULL_SHIFT, 0.0, 0.0), 120)[:, 0]
    share = np.arange(1, 121) / 100.0
    wanted = 1.0 - np.clip(1.0 - share, 0.0, 1.0) ** 1.5
    np.testing.assert_allclose(force, wanted, rtol=0.0, atol=shift)
    largest = LUBKIN[-1, 0]
    torque = _path(model, (0.0, 0.0, largest * UNIT_SPIN), 200)[:, 2]
    spins = np.arange(201) / 200.0 * largest
    found = np.interp(LUBKIN[:, 0], spins, np.concatenate([[0.0], torque])) / R
    np.testing.assert_allclose(
        found, LUBKIN[:, 1], rtol=0.0, atol=torsion * LARGEST_TORQUE / R
    )


@pytest.mark.parametrize(
    ("shift", "spin", "force", "torque"),
    [
        (0.5, 0.1, 0.628897, 0.137339),
        (0.75, 0.3, 0.753013, 0.266702),
        (0.5, 0.6, 0.379738, 0.506824),
    ],
)
def test_shift_and_spin_together(half_spaces, shift, spin, force, torque):
    """Of two like bodies, by a boundary element method of 30 cells across the contact."""
    path = (shift * FULL_SHIFT, 0.0, 0.5 * spin * UNIT_SPIN)
    found = _path(half_spaces["discs"], path, 40)[-1]
    assert abs(found[0] - force) < 0.025
    assert abs(found[2] / R - torque) < 0.035 * LARGEST_TORQUE / R


def test_what_a_cycle_loses(half_spaces):
    """Mindlin and Deresiewicz 1953, for a force that goes back and forth by a share of mu P."""
    for share in (0.5, 0.875):
        size = 1.0 - (1.0 - share) ** (2.0 / 3.0)
        root = (1.0 - share) ** (2.0 / 3.0)
        lost = (
            1.8
            * (2.0 - NU)
            * (1.0 - (1.0 - share) * root - 5.0 * share / 6.0 * (1.0 + root))
        )
        lost *= 0.5 / (G * R)
        found = _loss(half_spaces["discs"], 0, size * FULL_SHIFT)
        assert 0.87 < found / lost < 1.15


@pytest.mark.parametrize(
    ("kind", "shift", "torsion"),
    [(DistributedModel, 0.015, 0.007), (ReducedModel, 0.016, 0.024)],
)
def test_a_thin_layer_slips_from_its_rim(kind, shift, torsion):
    """Under a Hertz pressure: `F = 1.5 x - x^3/2`, and the torque alike by a sum over rings."""
    patch = ContactPatch.disc(R, 31, pressure=_hertz)
    model = kind(patch, QUASISTATIC, pad=Pad.layer(G, 1e-3))
    full = 1.5 / (G / 1e-3 * math.pi * R**2)
    share = np.arange(1, 121) / 100.0
    force = _path(model, (1.2 * full, 0.0, 0.0), 120)[:, 0]
    wanted = np.where(share < 1.0, 1.5 * share - 0.5 * share**3, 1.0)
    np.testing.assert_allclose(force, wanted, rtol=0.0, atol=shift)
    r = (np.arange(4000) + 0.5) / 4000.0
    pressed = 1.5 * np.sqrt(1.0 - r * r)
    torque = _path(model, (0.0, 0.0, 3.0 * full / R), 100)[:, 2]
    for k in range(4, 100, 5):
        held = np.minimum(1.5 * 0.03 * (k + 1) * r, pressed)
        found = torque[k] / R
        assert abs(found - 2.0 * (held * r * r).mean()) < torsion * LARGEST_TORQUE / R


PADS = {
    "layer": Pad.layer(2e5, 3e-3),
    "measured": Pad.measured(4e3, 0.4),
    "half space": Pad.half_space(2e5),
}
SQUARE = ContactPatch.rectangle(0.02, cells=7)


@pytest.mark.parametrize("pad", PADS.values(), ids=PADS)
@pytest.mark.parametrize("kind", [DistributedModel, ReducedModel])
def test_energy_never_appears(pad, kind):
    """Random twists, loads and steps: what springs store grows by no more than the work."""
    common = pad.compliance(SQUARE) is not None
    law = LuGre(mu_c=0.8, mu_s=1.0, sigma_1=0.0 if common else 80.0, elasto_plastic=0.9)
    model = kind(SQUARE, law, pad=pad)
    patch = model.reduction.patch
    pieces = np.tile(model.reduction.pad.pieces(patch, law), patch.bristles)
    soft = model.compiled.compliance
    count = 500
    rng = np.random.default_rng(5)
    state = model.rest(count)

    def stored(state):
        flat = state.reshape(count, -1)
        energy = 0.5 * flat[:, : len(pieces)] ** 2 @ pieces
        if common:
            face = flat[:, -3:]
            energy += 0.5 * np.einsum("bi,ij,bj->b", face, np.linalg.pinv(soft), face)
        return energy

    before = stored(state)
    for _ in range(40):
        twist = rng.normal(size=(count, 3)) * 10.0 ** rng.uniform(-7, 0, (count, 1))
        twist *= [1.0, 1.0, 300.0]
        load = 10.0 ** rng.uniform(-3, 2, count) * (rng.random(count) > 0.1)
        dt = 10.0 ** rng.uniform(-6, -1, count)
        state, pull = model.step(state, twist, load, dt)
        work = -(pull * twist).sum(axis=1) * dt
        after = stored(state)
        assert (work + before - after >= -1e-12 * (np.abs(work) + before + after)).all()
        before = after


@pytest.mark.parametrize("pad", PADS.values(), ids=PADS)
def test_steady_sliding_does_not_see_the_pad(pad):
    plain = DistributedModel(SQUARE, QUASISTATIC)
    model = DistributedModel(SQUARE, QUASISTATIC, pad=pad)
    twist = [0.1, -0.03, 4.0]
    _, wanted = plain.step(plain.rest(), twist, 3.0, 10.0)
    state = model.rest()
    for _ in range(3):
        state, pull = model.step(state, twist, 3.0, 10.0)
    np.testing.assert_allclose(pull, wanted, rtol=1e-11, atol=1e-12)


@pytest.mark.parametrize(("name", "size"), [("measured", 10.0), ("half space", 1.0)])
def test_derivatives_of_a_step_behind_a_common_compliance_are_differences(name, size):
    """Some pieces slip, none slides on: sliding ones lie at a kink."""
    pad = PADS[name]
    model = ReducedModel(SQUARE, QUASISTATIC, cells=9, pad=pad)
    state = model.rest()
    for k in range(5):
        way = [1e-2 * math.sin(k), 8e-3 * math.cos(2.0 * k), 0.9 * math.sin(3.0 * k)]
        twist = size * np.array(way)
        state, _ = model.step(state, twist, 3.0, 1e-2)
    at = np.concatenate([state, [0.02, -0.01, 0.8, 3.0]])

    def step(numbers):
        end = model.step(numbers[:-4], numbers[-4:-1], numbers[-1], 5e-3)
        return np.concatenate(end)

    change = np.array([1e-9] * len(state) + [1e-7] * 3 + [1e-5])
    wanted = np.transpose(
        [
            (step(at + each) - step(at - each)) / (2.0 * each.sum())
            for each in np.diag(change)
        ]
    )
    slopes = model.step_jacobians(state, at[-4:-1], 3.0, 5e-3)
    n = len(state)
    for got, want in (
        (slopes.state_state, wanted[:n, :n]),
        (slopes.state_twist, wanted[:n, n:-1]),
        (slopes.state_load, wanted[:n, -1]),
        (slopes.wrench_state, wanted[n:, :n]),
        (slopes.wrench_twist, wanted[n:, n:-1]),
        (slopes.wrench_load, wanted[n:, -1]),
    ):
        np.testing.assert_allclose(got, want, rtol=0.0, atol=1e-6 * np.abs(want).max())


@pytest.fixture
def made_worse():
    """A model in whose steps Broyden's method has no slope to begin with, and the numbers of its machine form."""
    model = ReducedModel(SQUARE, QUASISTATIC, cells=9, pad=PADS["measured"])
    (contact,) = [each for _, each, _ in model.compiled.pressed(np.ones(1))]
    (stuck, _) = [each for each in contact.keepalive if each.shape == (3, 3)]
    stuck[:] = math.nan
    return model


def test_where_broyden_finds_no_face_the_search_does(made_worse):
    model = ReducedModel(SQUARE, QUASISTATIC, cells=9, pad=PADS["measured"])
    state = model.rest()
    for twist in _twists(8, 20):
        wanted = model.step(state, 30.0 * twist, 3.0, 1e-2)
        for got, want in zip(
            made_worse.step(state, 30.0 * twist, 3.0, 1e-2), wanted, strict=True
        ):
            np.testing.assert_allclose(got, want, atol=1e-12 * np.abs(want).max())
        state = wanted[0]


def test_a_face_that_nothing_finds_is_an_error(made_worse):
    made_worse.compiled._alone.patches.record.compliance[:] = math.nan
    with pytest.raises(SolverError, match="twist of a pad's face"):
        made_worse.step(made_worse.rest(), [1e-3, 0.0, 0.0], 1.0, 1e-3)


@pytest.mark.parametrize("kind", [DistributedModel, ReducedModel])
def test_a_pad_does_not_see_where_its_frame_is(kind):
    """The same square beside the origin, at the same motion; fits of discs end within 1e-4 of each other."""
    x, y = 0.04, -0.03
    corners = [
        (x + i * 0.01, y + j * 0.01) for i, j in ((-1, -1), (1, -1), (1, 1), (-1, 1))
    ]
    beside = ContactPatch.polygon(corners, cells=7)
    near, far = (
        kind(patch, QUASISTATIC, pad=PADS["half space"]) for patch in (SQUARE, beside)
    )
    vx, vy, spin = 1e-2, 2e-3, 0.5
    _, wanted = near.step(near.rest(), [vx, vy, spin], 3.0, 1e-2)
    _, found = far.step(far.rest(), [vx + spin * y, vy - spin * x, spin], 3.0, 1e-2)
    found[2] -= x * found[1] - y * found[0]
    close = 1e-9 if kind is DistributedModel else 1e-3
    np.testing.assert_allclose(found, wanted, rtol=close, atol=1e-3 * close)


def test_a_moment_moves_the_load_and_not_the_stiffness():
    """A held pad feels no moment; one that slips slips as the patch without a pad."""
    model = DistributedModel(SQUARE, QUASISTATIC, pad=PADS["layer"])
    plain = DistributedModel(SQUARE, QUASISTATIC)
    small = [1e-6, 0.0, 1e-4]
    held = [
        model.step(model.rest(), small, 3.0, 1e-3, moments=m)[1]
        for m in ((0.0, 0.0), (4e-3, 6e-3))
    ]
    np.testing.assert_allclose(*held, rtol=1e-12, atol=1e-18)
    slips = [
        each.step(each.rest(), [0.1, 0.0, 3.0], 3.0, 10.0, moments=(4e-3, 6e-3))[1]
        for each in (model, plain)
    ]
    np.testing.assert_allclose(*slips, rtol=1e-11)


LEANING = dataclasses.replace(_DISC, asymmetry=(0.3, -0.2))
TURNED = dataclasses.replace(_DISC, metric=METRIC)
SOFT = ContactPatch.disc(
    0.01, cells=9, pressure=SoftFinger(c=0.004, n=1.0 / 3.0, k=2.0)
)
L_SHAPE = ContactPatch.polygon(
    [(0, 0), (0.02, 0), (0.02, 0.01), (0.01, 0.01), (0.01, 0.02), (0, 0.02)], cells=12
)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Pad.layer(0.0, 1e-3), "shear_modulus must be > 0, got 0"),
        (lambda: Pad.layer(1e6, math.nan), "thickness must be finite"),
        (lambda: Pad.half_space(1e6, 0.6), r"poisson_ratio must be in \[0, 0.5\], got 0.6"),
        (lambda: Pad.half_space(1e6, bodies=3), "bodies must be 1 or 2, got 3"),
        (lambda: Pad.half_space(1e6, lag=0.0), "lag must be > 0, got 0"),
        (lambda: Pad.measured(-1.0), "stiffness must be > 0, got -1"),
        (lambda: Pad.measured(1e3, 1.0), r"common must be in \[0, 1\), got 1"),
        (lambda: Pad.at_load(0.0), "normal_force must be > 0, got 0"),
        (lambda: DistributedModel(_DISC, LuGre(), pad=1.0), "pad must be a Pad or None, got 1"),
        (lambda: DistributedModel(_DISC, LuGre(), pad=Pad.layer(1e6, 1.0)), "thickness must be less than the size"),
        (lambda: DistributedModel(LEANING, LuGre(), pad=AT_LOAD), "patch must have no asymmetry for a pad"),
        (lambda: DistributedModel(TURNED, LuGre(), pad=Pad.measured(1e3)), "patch must have no friction metric"),
        (lambda: DistributedModel(SOFT, LuGre(), pad=AT_LOAD), "patch must have a shape that does not depend"),
        (lambda: ReducedModel(SOFT, QUASISTATIC, pad=Pad.half_space(1e6)), "patch must have a shape that does not"),
        (lambda: DistributedModel(L_SHAPE, QUASISTATIC, pad=Pad.half_space(1e6)), "patch must have two mirrors"),
        (lambda: DistributedModel(_DISC, LuGre(), pad=Pad.measured(1e3, 0.5)), "sigma_1 must be 0 for a pad with a"),
    ],
)  # fmt: skip
def test_what_makes_no_sense_is_refused_in_one_line(make, message):
    with pytest.raises(InvalidValueError, match=message):
        make()
