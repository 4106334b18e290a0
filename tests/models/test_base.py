"""Models: steady states, bounds, symmetry, and analytic Jacobians."""

import functools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import planarfriction as pf
from planarfriction import formulas, geometry
from planarfriction.patch import PUBLISHED_PATCHES
from tests.support.contacts import FEET, LAWS, SURFACES, friction_model, lengths
from tests.support.differences import differences
from tests.support.refusals import refused

PATCH = PUBLISHED_PATCHES["NonConvex2"]()
"""No symmetry: its centre of pressure is off the origin and off the cells."""
LOAD = 2.0

checked = settings(deadline=None, max_examples=25)
angles = st.floats(-math.pi, math.pi)
polars = st.floats(0.0, math.pi)
"""Polar angles of the twist's direction; 0 is a spin about the centre of pressure."""
speeds = st.floats(1e-6, 10.0)


@functools.cache
def model_of(kind, law="elasto-plastic", feet=False):
    """A model by name: "distributed" or the reduced one with a kind of limit surface."""
    return friction_model(kind, law, FEET if feet else PATCH)


every_model = pytest.mark.parametrize("kind", ["distributed", *SURFACES])
every_law = pytest.mark.parametrize("law", LAWS)


def twist_towards(patch, polar, azimuth, speed):
    """Twist about the origin with that direction, in scaled coordinates at the centre of pressure."""
    vx = speed * math.sin(polar) * math.cos(azimuth)
    vy = speed * math.sin(polar) * math.sin(azimuth)
    spin = speed * math.cos(polar) / patch.contact_radius()
    return geometry.twist_at((vx, vy, spin), -patch.centre_of_pressure())


def steady(model, twist, load=LOAD):
    """Steady state and its wrench: the end of an endless step."""
    return model.step(model.rest(), twist, load, 1e6)


# ---------------------------------------------------------------------- steady state


@every_model
@every_law
def test_rest_gives_zero(kind, law):
    model = model_of(kind, law)
    assert not model.rest().any() and model.rest().shape == model.state_shape
    assert not model.rate(model.rest(), (0, 0, 0), LOAD).any()
    assert not model.wrench(model.rest(), (0, 0, 0), LOAD).any()
    for load in (LOAD, 0.0):
        state, wrench = model.step(model.rest(), (0, 0, 0), load, 1.0)
        assert not state.any() and not wrench.any()


@every_model
@every_law
def test_steady_sliding_is_passive_and_bounded(kind, law):
    parameters = {**vars(LAWS[law]), "sigma_2": 0.0}
    model = model_of(kind, law)
    model = (
        pf.DistributedModel(PATCH, pf.LuGre(**parameters))
        if kind == "distributed"
        else pf.ReducedModelPublished(
            PATCH, pf.LuGre(**parameters), surface=model.surface
        )
    )

    @given(polars, angles, speeds)
    @checked
    def check(polar, azimuth, speed):
        twist = twist_towards(PATCH, polar, azimuth, speed)
        _, wrench = steady(model, twist)
        # Rounding; sigma_1 zdot of a steady state is sigma_1 times the rounding of v.
        slack = LOAD * (1e-12 + 1e-13 * speed * 8e2)
        assert -wrench @ twist > 0.0
        fx, fy, tau = geometry.wrench_at(wrench, PATCH.centre_of_pressure())
        # The published table blends over grid cells, outside the grid's low edges with negative weights: 0.1 %.
        bound = 1.2 * LOAD * (1.001 if kind == "published" else 1.0)
        assert math.hypot(fx, fy) <= bound + slack
        # a table's radius is that of the continuous patch, a little more than that of its cells' middles
        radius = (
            PATCH.contact_radius()
            if kind == "distributed"
            else model.surface.contact_radius
        )
        assert abs(tau) <= bound * radius + slack

    check()


@given(polars, angles, speeds)
@checked
def test_distributed_steady_state_is_coulomb_of_every_cell(polar, azimuth, speed):
    """Each cell with its own Stribeck coefficient g(|v_i|) and its viscous term."""
    model = model_of("distributed")
    twist = twist_towards(PATCH, polar, azimuth, speed)
    state, wrench = steady(model, twist)
    x, y = PATCH.positions.T
    v = np.stack([twist[0] - twist[2] * y, twist[1] + twist[2] * x])
    size = np.hypot(*v)
    g = formulas.stribeck(np, size, model.law)
    force = -(g * v / size + 0.2 * v) * PATCH.weights() * LOAD
    expected = [*force.sum(axis=1), (x * force[1] - y * force[0]).sum()]
    # Rounding of zdot times sigma_1 = 8e2.
    assert wrench == pytest.approx(expected, abs=1e-12 + 1e-12 * speed)
    # Exp(-1e6 s grip v) is nothing.
    assert state == pytest.approx(g * v / size / 1e6, rel=1e-9, abs=1e-15)


@given(polars, angles, speeds)
@checked
def test_slow_and_fast_steady_states_are_coulomb_on_the_cells_surface(
    polar, azimuth, speed
):
    """Without the Stribeck effect the distributed model slides on the limit surface of its cells."""
    law = pf.LuGre(mu_c=0.8, mu_s=0.8, sigma_2=0.0)
    _, wrench = steady(
        pf.DistributedModel(FEET, law), twist_towards(FEET, polar, azimuth, speed)
    )
    expected = pf.Coulomb(0.8).wrench(
        pf.LimitSurfaceCells(FEET), twist_towards(FEET, polar, azimuth, speed), LOAD
    )
    # Rounding, as above.
    assert wrench == pytest.approx(expected, abs=1e-12 + 1e-12 * speed)


@pytest.mark.parametrize("kind", SURFACES)
@given(polar=polars, azimuth=angles, speed=speeds)
@checked
def test_reduced_steady_state(kind, polar, azimuth, speed):
    """`W = g(v_n) W(V) f_N` of the surface, and the viscous term `sigma_2 U V`."""
    model = model_of(kind)
    twist = twist_towards(PATCH, polar, azimuth, speed)
    state, wrench = steady(model, twist)
    surface = model.surface
    centre = PATCH.centre_of_pressure()
    at_centre = geometry.twist_at(twist, centre)
    v_n = np.linalg.norm(at_centre * (1.0, 1.0, surface.contact_radius))
    viscous = geometry.wrench_at(
        0.2 * at_centre * (1.0, 1.0, PATCH.second_moment()), -centre
    )
    g = formulas.stribeck(np, v_n, model.law)
    expected = (g * surface.wrench(twist) - viscous) * LOAD
    # Of compiled loops and of NumPy.
    for got in (
        wrench,
        model.wrench(state, twist, LOAD),
    ):
        # Rounding, as above, through the offset.
        assert got == pytest.approx(expected, abs=1e-11 * (1.0 + speed))


def test_pre_sliding_stiffness():
    """Distributed: `sigma_0 diag(1, 1, <rho^2>)` about the centre of pressure; reduced: r^2 instead, as published."""
    tiny = 1e-9  # displacement per unit twist of one step
    for kind in ("distributed", "ellipsoid"):
        model = model_of(kind)
        torsional = (
            PATCH.second_moment()
            if kind == "distributed"
            else PATCH.contact_radius() ** 2
        )
        for index, stiffness in enumerate((1.0, 1.0, torsional)):
            twist = np.zeros(3)
            twist[index] = 1.0
            state, _ = model.step(
                model.rest(),
                geometry.twist_at(twist, -PATCH.centre_of_pressure()),
                LOAD,
                tiny,
            )
            wrench = geometry.wrench_at(
                model.wrench(state, (0, 0, 0), LOAD), PATCH.centre_of_pressure()
            )
            # Elastic: rounding.
            assert wrench[index] == pytest.approx(
                -LOAD * 1e6 * stiffness * tiny, rel=1e-9
            )


# ---------------------------------------------------------------------- covariance


def some_state(model, seed, size=1e-6):
    """A random state of that deflection, about where slip begins."""
    random = np.random.default_rng(seed)
    return random.normal(size=model.state_shape) * size * lengths(model)


@every_model
@every_law
def test_turning_everything_turns_the_wrench_and_nothing_else(kind, law):
    """By any angle; by whole segments where a table is stored."""
    model = model_of(kind, law, True)
    patch = FEET

    @given(
        st.integers(-40, 40),
        st.floats(0.0, 1.0),
        polars,
        angles,
        st.floats(1e-5, 1.0),
        st.integers(0, 1000),
    )
    @settings(deadline=None, max_examples=10)
    def check(segments, rest, polar, azimuth, speed, seed):
        angle = (
            (segments + (0.0 if kind in ("table", "published") else rest))
            * 0.5
            * math.pi
            / 20
        )
        turned_patch = pf.ContactPatch.points(
            geometry.rotate(patch.positions, angle), patch.weights()
        )
        if kind == "distributed":
            turned = pf.DistributedModel(turned_patch, LAWS[law])
        else:
            turned = pf.ReducedModelPublished(
                turned_patch, LAWS[law], surface=SURFACES[kind](turned_patch)
            )
        state = np.random.default_rng(seed).normal(size=model.state_shape) * 1e-6
        twist = twist_towards(patch, polar, azimuth, speed)

        def turn(value):
            """Rotate a state: bristles are vectors, x then y; the reduced state rotates like a wrench."""
            return (
                np.swapaxes(geometry.rotate(value.T, angle), 0, 1)
                if kind == "distributed"
                else geometry.rotate(value, angle)
            )

        arguments = (state, twist, LOAD)
        turned_arguments = (turn(state), geometry.rotate(twist, angle), LOAD)
        # Rounding, times the stiffest number of each: k z with k = 1e6 v, sigma_1 zdot. Beside the spin axis the smooth
        # table divides rounding by the distance to it, at most by 1e-5.
        allowed = (1e-8 if kind == "table" else 1e-11) * (speed + 1e-3)
        assert turned.rate(*turned_arguments) == pytest.approx(
            turn(model.rate(*arguments)), abs=allowed
        )
        wrench = model.wrench(*arguments)
        turned_wrench = turned.wrench(*turned_arguments)
        assert turned_wrench == pytest.approx(
            geometry.rotate(wrench, angle), abs=1e3 * allowed
        )
        (end, wrench) = model.step(*arguments, 1e-4)
        (turned_end, turned_wrench) = turned.step(*turned_arguments, 1e-4)
        # A nanometre's millionth.
        assert turned_end == pytest.approx(turn(end), abs=1e-15)
        assert turned_wrench == pytest.approx(
            geometry.rotate(wrench, angle), abs=1e3 * allowed
        )

    check()


@every_model
def test_mirroring(kind):
    """Odd: the opposite twist of the opposite state gives the opposite wrench."""
    model = model_of(kind)
    state = some_state(model, 3)
    twist = np.array([0.01, -0.02, 3.0])
    for function in (
        model.rate,
        model.wrench,
        lambda *a: model.step(*a, 1e-4)[0],
        lambda *a: model.step(*a, 1e-4)[1],
    ):
        there = function(state, twist, LOAD)
        back = function(-state, -twist, LOAD)
        assert back == pytest.approx(-there, rel=1e-9, abs=1e-15)  # rounding


# ---------------------------------------------------------------------- Jacobians


def state_scale(model):
    """A millionth of full deflection for every entry of the state."""
    return np.broadcast_to(1e-12 * lengths(model), model.state_shape)


JACOBIAN_TWISTS = {
    "slow": (3e-4, -2e-4, 0.02),
    "mixed": (4e-3, 3e-3, 0.7),
    "spin": (1e-4, 2e-4, -1.3),
    "slide": (-0.02, 0.01, 0.11),
}


def check_slopes(model, state, twist):
    """All blocks of the Jacobians against differences."""
    got = model.jacobians(state, twist, LOAD)
    radius = model.patch.contact_radius()
    speed = np.linalg.norm(twist * (1.0, 1.0, radius))
    twist_steps = 1e-4 * speed * np.array([1.0, 1.0, 1.0 / radius])
    for of, name, natural in (
        (model.rate, "rate", 1e6 * speed),
        (model.wrench, "wrench", LOAD * 1e6 * (1 + 8e2 * speed)),
    ):
        by_state = differences(
            lambda z, of=of: of(z, twist, LOAD), state, state_scale(model)
        )
        by_twist = differences(lambda v, of=of: of(state, v, LOAD), twist, twist_steps)
        # Cell by cell: no other cell matters.
        if model.state_shape != (3,) and name == "rate":
            assert np.count_nonzero(by_state) <= 4 * model.patch.cells
            cells = np.arange(model.patch.cells)
            by_state = by_state[:, cells, :, cells].transpose(1, 2, 0)
        # Rounding over the step: 1e-16/1e-6 of the natural slope. A kink of the slope within the step (the ends of the
        # elasto-plastic range of 1e-7 m) costs 1e-12/1e-7 of its largest value.
        allowed = 1e-9 * natural + 3e-5 * np.abs(by_state).max()
        assert getattr(got, f"{name}_state") == pytest.approx(by_state, abs=allowed)
        # Tables bend at their cells, and one cell near the centre of rotation bends within its own distance.
        assert getattr(got, f"{name}_twist") == pytest.approx(
            by_twist, rel=1e-4, abs=3e-4 * np.abs(by_twist).max()
        )
    assert not got.rate_load.any()
    # Linear: rounding.
    assert got.wrench_load * LOAD == pytest.approx(
        model.wrench(state, twist, LOAD), rel=1e-12
    )


@every_model
@every_law
@pytest.mark.parametrize("twist", JACOBIAN_TWISTS.values(), ids=JACOBIAN_TWISTS)
def test_jacobians_are_the_slopes(kind, law, twist):
    model = model_of(kind, law, feet=kind == "distributed")
    # Full deflection is 1 to 1.2 micrometres, the elasto-plastic range begins at 0.5 or 0.9 of it.
    for seed, deflection in enumerate((0.4e-6, 0.8e-6, 0.95e-6, 1.1e-6, 1.3e-6)):
        state = some_state(model, seed)
        if kind != "distributed":
            state *= deflection / np.linalg.norm(
                state / (1.0, 1.0, PATCH.contact_radius())
            )
        check_slopes(model, state, np.array(twist))


@every_model
@every_law
def test_jacobians_at_undeflected_bristles(kind, law):
    model = model_of(kind, law, feet=True)
    twist = np.array([4e-3, 3e-3, 0.7])
    state = model.rest()
    steps = state_scale(model)
    got = model.jacobians(state, twist, LOAD)
    expected = differences(lambda z: model.rate(z, twist, LOAD), state, steps)
    if kind == "distributed":
        cells = np.arange(model.patch.cells)
        expected = expected[:, cells, :, cells].transpose(1, 2, 0)
    # Plain: linear in z. Elasto-plastic: nothing slips near z = 0. Rounding of v = 5e-3 over 1e-12, of 1e6 v.
    assert got.rate_state == pytest.approx(expected, rel=1e-8, abs=1e-5)


@every_model
@every_law
def test_jacobians_at_rest_are_finite_and_elastic(kind, law):
    model = model_of(kind, law)
    for state in (model.rest(), some_state(model, 5)):
        got = model.jacobians(state, np.zeros(3), LOAD)
        assert all(np.isfinite(block).all() for block in got)
        assert not got.rate_state.any()  # nothing decays at rest
    at_rest = model.jacobians(model.rest(), np.zeros(3), LOAD)
    # d wrench/d z = -sigma_0: the spring.
    unit = model.wrench(model.rest() + 1e-7, (0, 0, 0), LOAD)
    spring = at_rest.wrench_state.reshape(3, -1).sum(axis=1) * 1e-7
    assert spring == pytest.approx(unit, rel=1e-9)  # rounding
    # d wrench/d V of a slow twist, the damper: sigma_1 + sigma_2, negative definite.
    damping = at_rest.wrench_twist
    assert np.linalg.eigvalsh(0.5 * (damping + damping.T)).max() < 0.0


@pytest.mark.parametrize("front", [None, "planarfriction.torch", "planarfriction.jax"])
def test_batches_at_rest(front):
    patch = pf.ContactPatch.disc(0.01, 5)
    law = pf.LuGre()
    module = pf if front is None else pytest.importorskip(front, exc_type=ImportError)
    for model in (module.DistributedModel(patch, law), module.ReducedModel(patch, law)):
        for batch, axes in (
            ((), ()),
            (64, (64,)),
            ((64,), (64,)),
            ([2, 3], (2, 3)),
            (0, (0,)),
        ):
            assert tuple(model.rest(batch).shape) == (*axes, *model.state_shape)
        for wrong in (-1, 1.5, "many", (2, -1), 10**9, (1,) * 40, None):
            with refused("batch must"):
                model.rest(wrong)
