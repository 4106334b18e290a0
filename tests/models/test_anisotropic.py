"""Friction that depends on the direction: closed forms, properties, the whole sphere, derivatives."""

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import planarfriction as pf
from planarfriction import geometry
from planarfriction.patch import PUBLISHED_PATCHES
from planarfriction.scenes import in_hand
from tests.support.anisotropic import (
    GRAIN,
    GRAINS,
    LEAN,
    LEANS,
    PATCHES,
    PLAIN,
    STRIBECK,
    TWIST,
    reduced,
)
from tests.support.differences import assert_rate_jacobians, assert_step_jacobians

DRY = pf.LuGre(mu_c=1.0, mu_s=1.0, sigma_2=0.0)
"""Friction coefficient 1 in steady sliding: wrenches are those of limit surfaces."""
LAWS = {
    "plain": pf.LuGre(mu_s=1.2),
    "elasto-plastic": STRIBECK,
    "gamma 1": dataclasses.replace(STRIBECK, gamma=1.0),
}
RANDOM = np.random.default_rng(6)
UNIT_TWIST = np.array([1e-8, 1e-8, 1e-6])

every_patch = pytest.mark.parametrize("name", PATCHES)
angles = st.floats(-math.pi, math.pi)
checked = settings(deadline=None, max_examples=25)


def steady(patch, twist, law=DRY):
    """Wrench of the distributed model after long sliding, per newton."""
    model = pf.DistributedModel(patch, law)
    return model.step(model.rest(), twist, 1.0, 1e3)[1]


def cell_sum(patch, twist):
    """`-sum w B' (u/|u| + a)`, written out."""
    total = np.zeros(3)
    for lever, lean, weight in zip(
        patch.levers(), patch.asymmetries(), patch.weights(), strict=True
    ):
        u = lever @ twist
        total -= weight * lever.T @ (u / np.linalg.norm(u) + lean)
    return total


def surfaces(patch, segments=20):
    kinds = [
        pf.LimitSurfaceCells(patch),
        pf.LimitSurfaceTable(patch, segments=segments),
    ]
    uniform = np.ndim(patch.metric) == 2 or patch.metric is None
    return [*kinds, pf.LimitSurfaceEllipsoid(patch)] if uniform else kinds


def close(one, other, tolerance):
    """Agreement relative to the largest entry."""
    assert np.abs(one - other).max() <= tolerance * np.abs(other).max()


# ---------------------------------------------------------------------- closed forms


@pytest.mark.parametrize("heading", [0.0, 0.4, 1.1, 0.4 + math.pi / 2, 3.0])
def test_translation_is_opposed_by_the_metric(heading):
    e = np.array([math.cos(heading), math.sin(heading)])
    force = -GRAIN @ e / math.sqrt(e @ GRAIN @ e)
    patch = PATCHES["metric"]
    x, y = patch.centre_of_pressure()
    wanted = np.array([*force, x * force[1] - y * force[0]])
    twist = 0.05 * np.array([*e, 0.0])
    found = [
        kind(patch).wrench(twist)
        for kind in (pf.LimitSurfaceCells, pf.LimitSurfaceEllipsoid)
    ]
    model = pf.ReducedModelPublished(
        patch, DRY, surface=pf.LimitSurfaceEllipsoid(patch)
    )
    found += [steady(patch, twist), model.step(model.rest(), twist, 1.0, 1e3)[1]]
    for wrench in found:
        np.testing.assert_allclose(wrench, wanted, rtol=1e-12, atol=1e-14)
    # a table interpolates what is zero in translation, the slope towards spin
    for wrench in (
        pf.LimitSurfaceTable(patch).wrench(twist),
        reduced(patch, DRY).step(np.zeros(3), twist, 1.0, 1e3)[1],
    ):
        np.testing.assert_allclose(
            wrench, wanted, rtol=1e-12, atol=1e-5 * patch.contact_radius()
        )


def test_coefficients_along_and_across_the_grain():
    for angle, coefficient in ((0.4, 1.3), (0.4 + math.pi / 2, 0.6)):
        e = np.array([math.cos(angle), math.sin(angle), 0.0])
        # At 1 m/s, sigma_1 = 8e2 amplifies what the rounding of the velocity, 1e-16, leaves of the bristles' rate.
        np.testing.assert_allclose(
            steady(PATCHES["metric"], e)[:2], -coefficient * e[:2], rtol=0.0, atol=3e-13
        )


def test_easier_one_way_than_the_other():
    """Along the grain with a in its direction: 1 - |a| against 1 + |a| times its coefficient."""
    along = np.array([math.cos(0.4), math.sin(0.4)])
    patch = PLAIN.with_friction_metric(GRAIN, 0.25 * along)
    for sign in (1.0, -1.0):
        force = -1.3 * sign * (1.0 + 0.25 * sign) * along
        twist = np.array([*(sign * along), 0.0])
        for wrench in (
            steady(patch, twist),
            *(surface.wrench(twist) for surface in surfaces(patch)),
        ):
            np.testing.assert_allclose(wrench[:2], force, rtol=1e-12)


def test_a_line_spins_against_its_coefficient_across():
    # Points.
    line = dataclasses.replace(pf.ContactPatch.line(0.02, 9, direction="x"), radii=None)
    grained = line.with_friction_metric(pf.friction_metric(0.0, 0.3, 0.7))
    assert grained.contact_radius() == pytest.approx(
        0.7 * line.contact_radius(), rel=1e-14
    )
    assert grained.second_moment() == pytest.approx(
        0.49 * line.second_moment(), rel=1e-14
    )
    # the viscous torque of a spin, in steady sliding beside the dry one
    viscous = dataclasses.replace(DRY, sigma_2=0.2)
    stored = reduced(grained, viscous)
    radii = (
        (pf.DistributedModel(grained, viscous), grained.contact_radius()),
        (stored, stored.surface.contact_radius),
    )
    # Of the segment itself.
    assert stored.surface.contact_radius == pytest.approx(0.7 * 0.02 / 4.0, rel=1e-13)
    for model, radius in radii:
        torque = model.step(model.rest(), (0.0, 0.0, 3.0), 1.0, 1e3)[1][2]
        assert torque == pytest.approx(
            -radius - 0.2 * 3.0 * grained.second_moment(), rel=1e-12
        )


# ---------------------------------------------------------------------- properties


def test_a_metric_of_ones_changes_nothing():
    same = PLAIN.with_friction_metric(np.eye(2), (0.0, 0.0))
    cells = PLAIN.with_friction_metric([np.eye(2)] * PLAIN.cells)
    for patch in (same, cells):
        assert not patch.anisotropic
        pairs = [(pf.DistributedModel(p, STRIBECK), reduced(p)) for p in (PLAIN, patch)]
        for plain, model in zip(*pairs, strict=True):
            state = RANDOM.normal(size=plain.state_shape) * 1e-7
            for one, other in zip(
                plain.step(state, TWIST, 2.0, 1e-4),
                model.step(state, TWIST, 2.0, 1e-4),
                strict=True,
            ):
                assert np.array_equal(one, other)
            assert np.array_equal(
                plain.wrench(state, TWIST, 2.0), model.wrench(state, TWIST, 2.0)
            )
        for plain, surface in zip(surfaces(PLAIN), surfaces(same), strict=True):
            assert np.array_equal(plain.wrench(TWIST), surface.wrench(TWIST))
    ends = [
        pf.simulate(in_hand(pf.DistributedModel(p, STRIBECK), t_end=0.3)).data.y.values
        for p in (PLAIN, same)
    ]
    assert np.array_equal(*ends)


def test_the_anisotropic_code_agrees_with_the_isotropic_one():
    """A metric one bit from ones takes the general way through every sum, and comes to the same results."""
    nearly = np.array([[1.0, 0.0], [0.0, np.nextafter(1.0, 2.0)]])
    other = np.array([nearly, *[np.eye(2)] * (PLAIN.cells - 1)])
    for metric in (nearly, other):
        patch = PLAIN.with_friction_metric(
            metric, np.full((PLAIN.cells, 2), 1e-300) if metric is other else None
        )
        pairs = [
            (pf.DistributedModel(PLAIN, STRIBECK), pf.DistributedModel(patch, STRIBECK))
        ]
        if metric is nearly:
            pairs.append((reduced(PLAIN), reduced(patch)))
        for plain, model in pairs:
            state = RANDOM.normal(size=plain.state_shape) * 5e-7
            np.testing.assert_allclose(
                model.wrench(state, TWIST, 2.0),
                plain.wrench(state, TWIST, 2.0),
                rtol=1e-13,
            )
            for one, two in zip(
                model.step(state, TWIST, 2.0, 1e-3),
                plain.step(state, TWIST, 2.0, 1e-3),
                strict=True,
            ):
                np.testing.assert_allclose(one, two, rtol=1e-13, atol=1e-22)
            names = plain.step_jacobians(state, TWIST, 2.0, 1e-3)._asdict()
            for name, value in names.items():
                close(
                    getattr(model.step_jacobians(state, TWIST, 2.0, 1e-3), name),
                    value,
                    1e-13,
                )
            runs = [
                pf.simulate(in_hand(each, t_end=0.3)).data for each in (plain, model)
            ]
            for history in ("x", "y", "theta", "fx", "tau"):
                np.testing.assert_allclose(
                    runs[1][history], runs[0][history], rtol=1e-11, atol=1e-14
                )
        for plain, surface in zip(surfaces(PLAIN), surfaces(patch), strict=False):
            np.testing.assert_allclose(
                surface.wrench(TWIST), plain.wrench(TWIST), rtol=1e-13
            )
            close(surface.jacobian(TWIST), plain.jacobian(TWIST), 1e-12)


@checked
@given(seed=st.integers(0, 1000), polar=st.floats(0.02, 3.1), azimuth=angles)
def test_sliding_dissipates_and_is_the_gradient_of_a_convex_potential(
    seed, polar, azimuth
):
    random = np.random.default_rng(seed)
    metrics = np.array(
        [pf.friction_metric(*random.uniform(0.3, 2.0, 3)) for _ in range(PLAIN.cells)]
    )
    asymmetry = random.uniform(-0.7, 0.7, (PLAIN.cells, 2))
    patch = PLAIN.with_friction_metric(metrics, asymmetry)
    for surface in surfaces(patch):
        scale = np.array([1.0, 1.0, 1.0 / surface.contact_radius])
        twist = np.array(
            [
                math.sin(polar) * math.cos(azimuth),
                math.sin(polar) * math.sin(azimuth),
                math.cos(polar),
            ]
        )
        twist *= scale
        power = float(surface.dissipation(twist))
        assert power > 0.0
        assert power == pytest.approx(-surface.wrench(twist) @ twist, rel=1e-12)
        slope = surface.jacobian(twist) * np.outer(scale, scale)
        np.testing.assert_allclose(slope, slope.T, atol=1e-8)
        if isinstance(surface, pf.LimitSurfaceCells):
            assert np.linalg.eigvalsh(slope).max() < 1e-10
            np.testing.assert_allclose(
                surface.wrench(twist), cell_sum(patch, twist), rtol=1e-11, atol=1e-13
            )


@checked
@given(turn=angles, vx=st.floats(-1, 1), vy=st.floats(-1, 1), omega=st.floats(-50, 50))
def test_the_grain_turns_with_the_patch(turn, vx, vy, omega):
    c = math.cos(turn)
    s = math.sin(turn)
    rotation = np.array([[c, -s], [s, c]])
    turned = pf.ContactPatch.points(PLAIN.positions @ rotation.T, PLAIN.weights())
    turned = turned.with_friction_metric(
        rotation @ GRAINS @ rotation.T, LEANS @ rotation.T
    )
    twist = np.array([vx + 1e-3, vy, omega + 0.01])
    patch = PLAIN.with_friction_metric(GRAINS, LEANS)
    wanted = geometry.rotate(steady(patch, twist, STRIBECK), turn)
    np.testing.assert_allclose(
        steady(turned, geometry.rotate(twist, turn), STRIBECK),
        wanted,
        rtol=1e-9,
        atol=1e-12,
    )


# ---------------------------------------------------------------------- the whole sphere


@pytest.mark.parametrize("name", ["asymmetry", "both", "cells"])
def test_a_half_sphere_and_three_numbers_are_exact_for_all_directions(name):
    patch = PATCHES[name]
    table = pf.LimitSurfaceTable(patch, segments=6)
    polar = (np.array([1, 2, 4, 6]) * math.pi / 12)[:, None]
    azimuth = np.arange(1, 24, 5) * math.pi / 12
    nodes = np.stack(
        np.broadcast_arrays(
            np.sin(polar) * np.cos(azimuth),
            np.sin(polar) * np.sin(azimuth),
            np.cos(polar),
        ),
        -1,
    )
    upper = np.linalg.solve(table._frame(), nodes.reshape(-1, 3).T).T
    for twist in (*upper, *-upper):
        wrench = table.wrench(twist)
        back = table.wrench(-twist)
        wanted = (
            cell_sum(patch, twist)
            if name == "cells"
            else pf.LimitSurfaceExact(patch).wrench(twist)
        )
        np.testing.assert_allclose(wrench, wanted, rtol=1e-7, atol=1e-9)
        # H(-V) is not -h(V).
        assert np.abs(wrench + back).max() > 0.1 * np.abs(wrench).max()
    fixed = -2.0 * np.einsum(
        "n,nij,ni->j", patch.weights(), patch.levers(), patch.asymmetries()
    )
    np.testing.assert_allclose(
        table.wrench(upper) + table.wrench(-upper),
        np.tile(fixed, (len(upper), 1)),
        atol=1e-14,
    )


def test_fine_tables_agree_with_the_cells_on_the_whole_sphere():
    fine = PUBLISHED_PATCHES["Square"]()
    side = np.where(
        fine.positions[:, :1, None] > 0.0,
        pf.friction_metric(0.3, 1.0, 0.5),
        pf.friction_metric(-0.5, 0.7, 1.2),
    )
    patch = fine.with_friction_metric(
        side, np.where(fine.positions[:, 1:] > 0.0, [0.4, 0.0], [0.0, -0.2])
    )
    table = pf.LimitSurfaceTable(patch, segments=40)
    cells = pf.LimitSurfaceCells(patch)
    random = RANDOM.normal(size=(300, 3)) / [1.0, 1.0, cells.contact_radius]
    error = (table.wrench(random) - cells.wrench(random)) / [
        1.0,
        1.0,
        cells.contact_radius,
    ]
    assert np.median(np.abs(error).max(axis=1)) < 5e-5
    assert np.abs(error).max() < 5e-3


@every_patch
def test_the_twist_of_a_wrench_comes_back(name):
    for surface in surfaces(PATCHES[name]):
        scale = np.array([1.0, 1.0, surface.contact_radius])
        for twist in RANDOM.normal(size=(6, 3)) / scale:
            wrench = surface.wrench(twist)
            found = surface.wrench(surface.twist(3.0 * wrench))
            np.testing.assert_allclose(found / scale, wrench / scale, atol=1e-7)


def test_a_metric_per_cell_is_the_sum_of_its_parts():
    left = PLAIN.positions[:, 0] < 0.0
    metric = np.where(left[:, None, None], GRAIN, pf.friction_metric(1.0, 0.5, 0.9))
    lean = np.where(left[:, None], LEAN, [0.0, 0.1])
    whole = PLAIN.with_friction_metric(metric, lean)
    weights = PLAIN.weights()
    total = np.zeros(3)
    for part, of, a in (
        (left, GRAIN, LEAN),
        (~left, pf.friction_metric(1.0, 0.5, 0.9), [0.0, 0.1]),
    ):
        patch = pf.ContactPatch.points(
            PLAIN.positions[part], weights[part]
        ).with_friction_metric(of, a)
        total += weights[part].sum() * steady(patch, TWIST, STRIBECK)
    np.testing.assert_allclose(steady(whole, TWIST, STRIBECK), total, rtol=1e-12)


# ---------------------------------------------------------------------- models


@every_patch
@pytest.mark.parametrize("law", LAWS)
def test_jacobians_are_those_of_differences(name, law):
    model = pf.DistributedModel(PATCHES[name], LAWS[law])
    state = RANDOM.normal(size=model.state_shape) * 7e-7
    assert_rate_jacobians(model, state, TWIST, 2.0, 1e-12, UNIT_TWIST)
    assert_step_jacobians(model, state, TWIST, 2.0, 1e-4, 1e-12, UNIT_TWIST)


def test_jacobians_of_the_reduced_model():
    model = reduced(PATCHES["metric"])
    state = np.array([6e-7, 7e-7, 3e-9])
    units = np.array([1e-12, 1e-12, 1e-14])
    assert_rate_jacobians(model, state, TWIST, 2.0, units, UNIT_TWIST)
    assert_step_jacobians(model, state, TWIST, 2.0, 1e-4, units, UNIT_TWIST)


@every_patch
def test_a_cell_rests_at_its_centre(name):
    """Steady sliding: `z = (u/|u| + a) g/sigma_0` is a fixed point of the rate."""
    model = pf.DistributedModel(PATCHES[name], STRIBECK)
    u = np.moveaxis(PATCHES[name].levers() @ TWIST, 0, -1)
    speed = np.hypot(*u)
    g = STRIBECK.mu_c + (STRIBECK.mu_s - STRIBECK.mu_c) * np.exp(
        -((speed / STRIBECK.v_s) ** 2)
    )
    state = (u / speed + PATCHES[name].asymmetries().T) * g / STRIBECK.sigma_0
    np.testing.assert_allclose(model.rate(state, TWIST, 1.0), 0.0, atol=1e-14)
    np.testing.assert_allclose(model.step(state, TWIST, 1.0, 0.1)[0], state, rtol=1e-11)
