"""Rates and wrenches of the bristle models against their equations, written out in NumPy cell by cell."""

import numpy as np
import pytest

import planarfriction as pf
from planarfriction.patch import PUBLISHED_PATCHES

LAWS = {
    "plain": pf.LuGre(mu_s=1.2),
    "elasto-plastic": pf.LuGre(mu_s=1.2, elasto_plastic=pf.ElastoPlastic(0.5)),
    "gamma 1.5": pf.LuGre(mu_s=1.2, gamma=1.5, elasto_plastic=pf.ElastoPlastic(0.5)),
}
PATCH = PUBLISHED_PATCHES["NonConvex2"]()
LOAD = 2.0
ROUNDING = 1e-12
"""Relative: sums over 84 cells in another order, and polynomials in place of the C library's functions."""


def decay(law, z, u, speed, stretch):
    """`k = beta |v| sigma_0/g`; the bristle is full at `stretch g/sigma_0`, and `speed = |u|/stretch`."""
    g = law.mu_c + (law.mu_s - law.mu_c) * np.exp(-((speed / law.v_s) ** law.gamma))
    if law.elasto_plastic is None:
        return speed * law.sigma_0 / g
    size = np.linalg.norm(z)
    breakaway = law.elasto_plastic.breakaway_ratio
    share = (size * law.sigma_0 / (g * stretch) - breakaway) / (1.0 - breakaway)
    alpha = np.sin(0.5 * np.pi * np.clip(share, 0.0, 1.0)) ** 2
    return 0.5 * alpha * (speed + z @ u / (size * stretch)) * law.sigma_0 / g


def sample(seed):
    generator = np.random.default_rng(seed)
    return generator.normal(size=3) * [1.0, 1.0, 100.0] * 10.0 ** generator.uniform(
        -4.0, -1.0
    ), generator


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("law", LAWS)
def test_every_cell_follows_its_equation(law, seed):
    law = LAWS[law]
    (twist, generator) = sample(seed)
    model = pf.DistributedModel(PATCH, law)
    state = generator.normal(size=model.state_shape) * 1e-6
    rate = np.empty_like(state)
    wrench = np.zeros(3)
    for i, ((x, y), weight) in enumerate(
        zip(PATCH.positions, PATCH.weights(), strict=True)
    ):
        u = np.array([twist[0] - twist[2] * y, twist[1] + twist[2] * x])
        rate[:, i] = (
            u - decay(law, state[:, i], u, float(np.linalg.norm(u)), 1.0) * state[:, i]
        )
        fx, fy = (
            -weight
            * LOAD
            * (law.sigma_0 * state[:, i] + law.sigma_1 * rate[:, i] + law.sigma_2 * u)
        )
        wrench += fx, fy, x * fy - y * fx
    scale = np.abs(rate).max()
    np.testing.assert_allclose(
        model.rate(state, twist, LOAD), rate, rtol=0.0, atol=ROUNDING * scale
    )
    np.testing.assert_allclose(
        model.wrench(state, twist, LOAD), wrench, rtol=ROUNDING, atol=1e-14
    )


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("law", LAWS)
def test_the_published_model_follows_its_equation(law, seed):
    law = LAWS[law]
    (twist, generator) = sample(seed)
    surface = pf.LimitSurfaceCells(PATCH)
    model = pf.ReducedModelPublished(PATCH, law, surface=surface)
    radius = PATCH.contact_radius()
    (cx, cy) = PATCH.centre_of_pressure()
    state = generator.normal(size=3) * [1e-6, 1e-6, 1e-6 * radius]
    scale = np.array([1.0, 1.0, radius])
    centred = np.array([twist[0] - twist[2] * cy, twist[1] + twist[2] * cx, twist[2]])
    speed = float(np.linalg.norm(scale * centred))
    fx, fy, tau = surface.wrench(twist)
    u = -np.array([fx, fy, (tau - cx * fy + cy * fx) / radius]) * speed
    z = state / scale
    rate = scale * (u - decay(law, z, u, speed, float(np.linalg.norm(u)) / speed) * z)
    viscous = centred * [1.0, 1.0, PATCH.second_moment()]
    fx, fy, tau = -LOAD * (
        law.sigma_0 * state + law.sigma_1 * rate + law.sigma_2 * viscous
    )
    wrench = np.array([fx, fy, tau + cx * fy - cy * fx])
    np.testing.assert_allclose(
        model.rate(state, twist, LOAD) / scale,
        rate / scale,
        rtol=0.0,
        atol=ROUNDING * speed,
    )
    np.testing.assert_allclose(
        model.wrench(state, twist, LOAD), wrench, rtol=1e-10, atol=1e-14
    )
