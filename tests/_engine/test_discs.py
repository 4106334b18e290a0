"""Discs: closed forms of their surface, their limits, and the loops that are written from their step."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planarfriction import ContactPatch, DistributedModel, LuGre, formulas
from planarfriction._engine.bristles import discs, points
from planarfriction._engine.cells import cell_loops, cells
from planarfriction._engine.cells.cell_blocks import LANES
from planarfriction._engine.codegen.symbolic_functions import twin

LAW = LuGre(
    mu_c=1.0,
    mu_s=1.2,
    v_s=1e-3,
    sigma_0=1e6,
    sigma_1=8e2,
    sigma_2=0.2,
    elasto_plastic=0.9,
).numbers
PLAIN = LuGre(
    mu_c=0.4, mu_s=0.6, v_s=1e-3, sigma_0=1e5, sigma_1=3e2, sigma_2=0.1
).numbers
KAPPA = math.sqrt(0.5)
SINGLE = DistributedModel(
    ContactPatch([(0.0, 0.0)], [1e-6], radii=[3e-3]),
    LuGre(mu_s=1.2, elasto_plastic=0.9),
)
"""A patch of one disc."""
SPEEDS = st.floats(-1.0, 1.0).map(lambda x: 0.05 * x)

sliding, evaluate, step, point_step = map(
    twin, (discs.sliding, discs.evaluate, discs.step, points.step)
)


def _mean_speed(q):
    """Return the mean speed of a disc of radius 1 that spins at 1 and slides at q, by quadrature."""
    radius = np.sqrt((np.arange(600) + 0.5) / 600)  # rings of equal area
    angle = 2.0 * np.pi * (np.arange(720) + 0.5) / 720
    x = radius[:, None] * np.cos(angle)
    y = radius[:, None] * np.sin(angle)
    return np.hypot(q - y, x).mean()


def _surface(q):
    """Return mean speed, force and own torque of a disc of radius 1 that spins at 1 and slides at q."""
    _, _, _, speed, (along, _, spin) = sliding((q, 0.0, KAPPA))
    return speed, along / speed, KAPPA * spin / speed


@pytest.mark.parametrize("q", [0.0, 0.1, 0.3, 0.5, 0.8, 1.0, 1.3, 2.0, 5.0, 20.0])
def test_the_surface_is_that_of_a_disc_within_its_error(q):
    """The rational function is stated to err by 0.0085 in force and torque; quadrature adds 1e-4."""
    h = 1e-4
    mean, above, below = (_mean_speed(abs(x)) for x in (q, q + h, q - h))
    force = (above - below) / (2.0 * h) if q > 0.0 else 0.0
    speed, along, torque = _surface(q)
    assert speed == pytest.approx(mean, abs=3e-3)
    assert along == pytest.approx(force, abs=9e-3)
    assert torque == pytest.approx(mean - q * force, abs=9e-3)


def test_slopes_at_pure_spin_and_far_from_the_disc_are_exact():
    assert _surface(0.0) == pytest.approx((2.0 / 3.0, 0.0, 2.0 / 3.0), rel=1e-12)
    assert _surface(1e-5)[1] == pytest.approx(1e-5, rel=1e-8)  # F' = 1
    q = 300.0  # the terms that follow are smaller by 1/q^2
    _, force, torque = _surface(q)
    assert 1.0 - force == pytest.approx(1.0 / (8.0 * q * q), rel=1e-3)
    assert torque == pytest.approx(1.0 / (4.0 * q), rel=1e-3)


@given(SPEEDS, SPEEDS, SPEEDS)
def test_friction_is_the_gradient_of_the_mean_speed(x, y, s):
    u = np.array([x, y, s])
    h = 1e-7
    size = np.abs(u).max()
    if size < 1e-4:  # differences of numbers near rounding
        return
    _, _, _, speed, pull = sliding(tuple(u))
    for k, unit in enumerate(np.eye(3)):
        above, below = (
            sliding(tuple(u + sign * h * size * unit))[3] for sign in (1.0, -1.0)
        )
        assert (above - below) / (2.0 * h * size) == pytest.approx(
            pull[k] / speed, abs=1e-6
        )
    assert np.dot(pull, u) == pytest.approx(speed * speed, rel=1e-13)


@pytest.mark.parametrize("law", [LAW, PLAIN])
def test_a_disc_without_a_radius_is_a_point(law):
    z = (3e-7, -5e-7)
    u = (2e-3, 1e-3)
    flat = (*z, 0.0), (*u, 0.0)
    point, pull = point_step(law, z, u, 1e-4)
    new, traction = step(law, *flat, 1e-4)
    assert new == pytest.approx((*point, 0.0), rel=1e-13)
    assert traction == pytest.approx((*pull, 0.0), rel=1e-13)


@pytest.mark.parametrize("law", [LAW, PLAIN])
def test_bristles_settle_where_sliding_is_steady(law):
    u = (2e-3, -1e-3, 1.5e-3)
    _, _, _, speed, pull = sliding(u)
    new, _ = step(law, (0.0, 0.0, 0.0), u, 1e3)
    size = formulas.stribeck(np, speed, law) / law.sigma_0 / speed
    assert new == pytest.approx([size * each for each in pull], rel=1e-12)
    assert evaluate(law, new, u)[0] == pytest.approx((0.0, 0.0, 0.0), abs=1e-9 * speed)


def test_a_step_is_of_second_order_in_dt():
    """From z half bent: errors of 40, 80 and 160 steps beside 5120 fall by four at each doubling."""
    u = (1e-3, 4e-4, 8e-4)
    ends = {}
    for count in (40, 80, 160, 5120):
        z = (2e-7, 0.0, -3e-7)
        for _ in range(count):
            z, _ = step(LAW, z, u, 8e-4 / count)
        ends[count] = np.array(z)
    errors = [np.abs(ends[count] - ends[5120]).max() for count in (40, 80, 160)]
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.25)
    assert errors[1] / errors[2] == pytest.approx(4.0, rel=0.25)


@pytest.mark.parametrize("elasto_plastic", [None, 0.3, 0.9])
def test_steps_of_any_size_return_no_energy(elasto_plastic):
    """A step without damping puts in `W . V dt`, of which the bristles keep no more than they gain; to rounding."""
    law = LuGre(mu_s=1.2, sigma_1=0.0, sigma_2=0.0, elasto_plastic=elasto_plastic)
    radius = 3e-3
    patch = ContactPatch([(0.0, 0.0)], [1e-6], radii=[radius])
    model = DistributedModel(patch, law)
    rng = np.random.default_rng(4)
    many = 4000
    for decade in range(-8, 3):
        z = rng.normal(size=(many, 3)) * 1e-6
        u = rng.normal(size=(many, 3)) * 10.0 ** rng.uniform(-5.0, 0.0, (many, 1))
        u[:, 2] *= 10.0 ** rng.uniform(-2.0, 2.0, many)
        dt = 10.0**decade
        twist = u / [1.0, 1.0, KAPPA * radius]
        new, wrench = model.step(z[..., None], twist, 1.0, dt)
        work = -(wrench * twist).sum(axis=1) * dt
        before, after = (0.5e6 * (each**2).sum(axis=1) for each in (z, new[..., 0]))
        assert (work + before - after >= -1e-14 * (np.abs(work) + before)).all()


@pytest.mark.parametrize("elasto_plastic", [None, 0.3, 0.9])
def test_no_step_moves_a_bristle_away_from_steady_sliding(elasto_plastic):
    """From any bristle, as after friction has fallen or risen or a spin has turned back: `|z - z_ss|` never grows.

    A third of the bristles had settled where friction was another: where it fell, a long step ends in steady sliding.
    """
    law = LuGre(mu_s=1.2, sigma_1=0.0, elasto_plastic=elasto_plastic)
    radius = 3e-3
    patch = ContactPatch([(0.0, 0.0)], [1e-6], radii=[radius])
    model = DistributedModel(patch, law)
    rng = np.random.default_rng(5)
    many = 3000
    for decade in range(-6, 0):
        u = rng.normal(size=(many, 3)) * 10.0 ** rng.uniform(-5.0, 0.5, (many, 1))
        u[:, 2] *= 10.0 ** rng.uniform(-2.0, 2.0, many)
        speed, pull = zip(*(sliding(each)[3:] for each in u), strict=True)
        grip = law.sigma_0 / formulas.stribeck(np, np.array(speed), law.numbers)
        steady = np.array(pull) / (grip * speed)[:, None]
        settled = np.arange(many) % 3 == 0
        z = np.where(settled[:, None], steady, rng.normal(size=(many, 3)) * 1e-6)
        factor = 10.0 ** rng.uniform(-2.0, 2.0, (many, 1))
        z *= factor
        twist = u / [1.0, 1.0, KAPPA * radius]
        new = model.step(z[..., None], twist, 1.0, 10.0**decade)[0][..., 0]
        before, after = (np.linalg.norm(each - steady, axis=1) for each in (z, new))
        size = np.linalg.norm(steady, axis=1)
        assert (after <= before + 1e-12 * size).all()
        fell = settled & (factor[:, 0] > 1.0)
        long = fell & (grip * speed * 10.0**decade > 300.0)
        assert (after[long] < 1e-3 * size[long]).all()


def test_what_lies_across_the_sliding_decays_more_slowly():
    """Far from a disc by the share `3/(4 q^2)`, by the mean of `1/|u|^2` over it: `(1 + 1/(2 q^2))/q^2`; within 1 %."""
    q = 100.0
    assert sliding((q, 0.0, KAPPA))[2] == pytest.approx(0.75 / q**2, rel=0.01)
    assert sliding((q, 0.0, 0.0))[2] == 0.0


def test_slopes_do_not_hang_on_the_last_bit():
    """From rest along one direction the spin of bristles has the share of the motion's, to the last bit, which decides
    nothing: their last bits move slopes by 1e-12 of the largest. So do those of a spin that is about to begin."""
    rng = np.random.default_rng(7)
    many = 200
    u = rng.normal(size=(many, 3))
    u /= np.linalg.norm(u, axis=1)[:, None]
    u[::10, 2] = 0.0
    twist = 1e-3 * u / [1.0, 1.0, KAPPA * SINGLE.patch.radii[0]]
    z = np.zeros((many, 3, 1))
    for _ in range(10):
        z, _ = SINGLE.step(z, twist, 1.0, 1.2e-4 * rng.uniform(0.8, 1.0))
    z[::10, 2] = 3e-7  # left by an earlier spin

    def slopes(z, twist):
        """Return the derivatives of the bristle by the bristle and by the twist, `[many, 9]` each."""
        found = SINGLE.step_jacobians(z, twist, 1.0, 1e-4)
        return [each.reshape(many, 9) for each in found[:2]]

    before = slopes(z, twist)
    for k in range(3):
        for sign in (-1.0, 1.0):
            bent = z.copy()
            bent[:, k] *= 1.0 + 4.0 * sign * np.finfo(float).eps
            turned = twist.copy()
            turned[:, k] += sign * 1e-18 * (twist[:, k] == 0.0)
            for old, new in zip(before, slopes(bent, turned), strict=True):
                size = np.abs(old).max(axis=1, keepdims=True)
                assert (np.abs(new - old) <= 1e-9 * size).all()


@pytest.mark.parametrize(
    "speed", [0.0, 1e-300, 1e-159, 1e-154, 1e-80, 1e-12, 1e-6, 1e6, 1e50]
)
def test_numbers_and_slopes_stay_finite_at_any_speed(speed):
    u = speed * np.array([[1, 0, 0], [0, 0, 1], [1, 1, 1], [1, 0, 1e-9]])
    twists = u / [1.0, 1.0, max(KAPPA * SINGLE.patch.radii[0], speed / 1e50)]
    for z in ((0.0, 0.0, 0.0), (1e-7, 0.0, 1e-7), (1e-200, 0.0, 1e-200)):
        state = np.broadcast_to(np.array(z)[:, None], (4, 3, 1))
        for dt in (1e-9, 1e-3, 1e3):
            assert all(
                np.isfinite(each).all()
                for each in SINGLE.step_jacobians(state, twists, 1.0, dt)
            )
            assert np.isfinite(SINGLE.step(state, twists, 1.0, dt)[1]).all()
        for each in u:
            assert np.isfinite(evaluate(LAW, z, tuple(each))).all()


@pytest.mark.parametrize("count", [1, 7, 8, 23, 24, 64, 65, 150])
def test_passes_step_as_the_function_they_come_from(count):
    """Sums run in another order, and functions are polynomials: 1e-12 of the largest term."""
    rng = np.random.default_rng(count)
    law = LuGre(
        mu_c=1.0,
        mu_s=1.2,
        v_s=1e-3,
        sigma_0=1e6,
        sigma_1=8e2,
        sigma_2=0.2,
        elasto_plastic=0.9,
    )
    places = rng.normal(size=(count, 2)) * 5e-3
    radii = rng.uniform(size=count) * 3e-3
    pressure = rng.uniform(size=count)
    patch = ContactPatch(places, np.full(count, 1e-6), pressure, radii=radii)
    twist = tuple(rng.normal(size=3) * (1e-3, 1e-3, 0.2))
    z = rng.normal(size=(3, count)) * 5e-7
    new, wrench = DistributedModel(patch, law).step(z, twist, 2.0, 1e-4)
    total = np.zeros(3)
    for i, (x, y) in enumerate(places):
        cell = x, y, KAPPA * radii[i]
        expected, traction = step(
            LAW, tuple(z[:, i]), twin(cells.DISC_POSITIONS.seen)(cell, twist), 1e-4
        )
        assert new[:, i] == pytest.approx(expected, rel=1e-11, abs=1e-18)
        total += (
            2.0
            * patch.weights()[i]
            * np.array(twin(cells.DISC_POSITIONS.wrench)(cell, traction))
        )
    assert wrench == pytest.approx(total, rel=1e-11, abs=1e-13)


def test_passes_hand_little_on():
    """A pass that handed on everything would leave the nearest cache: 64 lanes of 12 rows are 6 kB."""
    written = cell_loops.step_passes(cell_loops.KINDS[3, False, cell_loops.PLAIN])
    assert written.rows <= 30
    assert written.source.count("def pass_") == cell_loops.DISC.forward[0]
    assert LANES * written.rows * 8 <= 16384
