"""Steps in contact space that are hard to solve, or have no solution."""

import numpy as np
import pytest

import planarfriction as pf
from planarfriction.coupling import CoupledPatches, HostStep
from tests.support.coupling_problems import abrupt_run, random_bodies, random_run

LAW = pf.LuGre(mu_s=1.2, sigma_0=1e8, elasto_plastic=0.9)
"""Bristles a hundred times stiffer than published."""

PATCH = pf.ContactPatch.disc(radius=0.01, cells=9)
ELLIPSOID = pf.LimitSurfaceEllipsoid(PATCH)


def _patches(count=4):
    return CoupledPatches([pf.ReducedModelPublished(PATCH, LAW, ELLIPSOID)] * count)


def _runs(patches, height, steps):
    """Steps of 0.1 to 10 ms, of bodies that stay and of others in each; friction tilts the loads by the `height`."""
    generator = np.random.default_rng(14)
    yield from random_run(
        generator, patches, random_bodies(generator, 256, 4, height), steps
    )
    yield from abrupt_run(generator, patches, 256, height, steps)


def _excess_work(state, host, step, dt):
    """Work on the host beyond what the bristles give, as a share of both."""
    flat = step.wrench.reshape(len(dt), -1)
    count = len(dt)
    change = flat - host.wrench.reshape(count, -1)
    twist = host.twist.reshape(count, -1) + np.einsum(
        "eij,ej->ei", host.twist_response, change
    )
    work = dt * (twist * flat).sum(axis=1)
    lengths = np.array([1.0, 1.0, ELLIPSOID.contact_radius])
    squares = (
        ((z.reshape(count, 4, 3) / lengths) ** 2).sum(axis=2)
        for z in (state, step.state)
    )
    before, after = (
        0.5 * LAW.sigma_0 * (step.normal_force * each).sum(axis=1) for each in squares
    )
    return (work - (before - after)) / (abs(work) + before + after + 1e-300)


def test_what_does_not_converge_is_tried_again():
    patches = _patches()
    once = 0
    again = 0
    for state, host, dt, step in _runs(patches, 0.05, 12):
        first = patches.step(state, host, dt, iterations=50)
        once = once + (~first.converged).sum()
        again = again + (~step.converged).sum()
        assert (step.residual <= first.residual).all() and (
            step.iterations >= first.iterations
        ).all()
    assert once >= 10 and again <= once / 5


def test_what_does_not_converge_does_no_work_that_bristles_do_not_give():
    """Loads that grow faster with friction than friction with loads: some steps have no solution."""
    patches = _patches()
    lost = 0
    wrong = 0
    for state, host, dt, step in _runs(patches, 3.0, 6):
        first = patches.step(state, host, dt, iterations=50)
        lost += (~step.converged).sum()
        wrong += (_excess_work(state, host, first, dt)[~first.converged] > 1e-9).sum()
        assert (_excess_work(state, host, step, dt)[~step.converged] <= 1e-9).all()
    assert lost >= 1 and wrong >= 50


def test_wrenches_that_would_do_more_work_are_scaled_to_do_the_least():
    """The work of `s W` on the host, `s W.V_0 + s^2 W.A W`, is least at s = 1 where its slope is 0 there."""
    patches = _patches()
    least = 0
    for height in (1.0, 10.0):
        for _, host, _, step in _runs(patches, height, 6):
            lost = ~step.converged
            a = host.twist_response[lost]
            w, before, twist = (
                each[lost].reshape(-1, 12)
                for each in (step.wrench, host.wrench, host.twist)
            )
            begin = (w * (twist - np.einsum("eij,ej->ei", a, before))).sum(axis=1)
            bends = np.einsum("ei,eij,ej->e", w, a, w)
            least += (abs(begin + 2.0 * bends) < 1e-9 * abs(begin)).sum()
    # Others stay as they are, or let their bristles go.
    assert least >= 2


@pytest.mark.parametrize(
    ("growth", "speed"),
    [(0.5, 1e-3), (0.5, 1.0), (2.0, 1e-3), (10.0, 1e-3), (10.0, 1.0)],
)
def test_a_wedge_that_jams_stops(speed, growth):
    """The load grows by so many newtons for each of friction, which is 1.2 N for each of load: above 1/1.2 it jams."""
    patches = _patches(1)
    response = np.diag([1e-3, 1e-3, 10.0])
    jam = np.array([[-growth, 0.0, 0.0]])
    host = HostStep(
        np.array([[speed, 0.0, 0.0]]), np.ones(1), np.zeros((1, 3)), response, jam
    )
    step = patches.step(patches.rest(), host, 1e-3)
    assert step.converged
    if growth > 1.0 or speed < 0.1:
        # bristles of 12 nm hold what the body loses in the step
        assert 0.0 <= step.twist[0, 0] <= 1.2e-8 / 1e-3
        np.testing.assert_allclose(
            step.wrench[0, 0], -speed / response[0, 0], rtol=0.02
        )
