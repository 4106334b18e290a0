"""The implicit step of many patches in contact space."""

import pickle

import numpy as np
import pytest
from scipy.linalg import block_diag
from scipy.optimize import fsolve

import planarfriction as pf
from planarfriction._engine.compiler import jit
from planarfriction._engine.compiler.calls import address_of, call
from planarfriction._engine.compiler.memory import place_of
from planarfriction._engine.protocol import SLOPES
from planarfriction.coupling import CoupledPatches, CoupledStep, HostStep
from planarfriction.patch import friction_metric
from tests.support.coupling_problems import random_bodies, random_patches, random_run
from tests.support.rate_laws import BoucWen
from tests.support.refusals import refused

LAW = pf.LuGre(mu_s=1.2, elasto_plastic=0.9)
PLAIN = pf.LuGre()
DISC = pf.ContactPatch.disc(radius=0.01, cells=9)
GRAINED = pf.ContactPatch.rectangle(0.02, 0.01, cells=7).with_friction_metric(
    friction_metric(0.3, along=1.0, across=0.7)
)
LOPSIDED = GRAINED.with_friction_metric(
    friction_metric(0.3, along=1.0, across=0.7), asymmetry=(0.2, 0.1)
)
ASIDE = pf.ContactPatch.polygon(
    [(0.0, 0.0), (0.03, 0.0), (0.03, 0.01), (0.01, 0.02)], cells=7
)
FINGER = pf.SoftFinger(c=0.0085, n=1 / 3, k=2.0, radius_max=0.01)
SOFT = pf.ContactPatch.disc(radius=0.01, cells=9, pressure=FINGER)
KINDS = (pf.DistributedModel, pf.ReducedModel, pf.ReducedModelPublished)

MODELS = {
    "distributed": pf.DistributedModel(DISC, LAW),
    "distributed, Stribeck exponent 1": pf.DistributedModel(
        DISC, pf.LuGre(mu_s=1.2, gamma=1.0)
    ),
    "distributed, grain": pf.DistributedModel(GRAINED, LAW),
    "distributed, asymmetric": pf.DistributedModel(LOPSIDED, LAW),
    "reduced": pf.ReducedModel(DISC, LAW),
    "reduced, plain": pf.ReducedModel(DISC, PLAIN),
    "distributed, a rate of its own": pf.DistributedModel(DISC, BoucWen()),
    "distributed, a rate of its own, grain": pf.DistributedModel(GRAINED, BoucWen()),
    "reduced, grain": pf.ReducedModel(GRAINED, LAW),
    "published": pf.ReducedModelPublished(DISC, LAW),
    "published, off its origin": pf.ReducedModelPublished(ASIDE, LAW),
    "published, grain": pf.ReducedModelPublished(
        GRAINED, LAW, surface=pf.LimitSurfaceTable(GRAINED)
    ),
}


@jit
def _called(function, record, z, v, dt, new, out):
    call(function, (record, z, v, dt, new, out))


@pytest.mark.parametrize("name", MODELS)
def test_compiled_steps_and_their_slopes_are_those_of_the_model(name):
    model = MODELS[name]
    generator = np.random.default_rng(1)
    packed = model.compiled.with_all_states([None])
    function = address_of(model.compiled.functions.slopes)
    for _ in range(40):
        twist = (
            generator.normal(size=3)
            * [1.0, 1.0, 100.0]
            * 10.0 ** generator.uniform(-5.0, -1.0)
        )
        dt = 10.0 ** generator.uniform(-5.0, -2.0)
        small = [1.0, 1.0, 0.01] if isinstance(model, pf.ReducedModelPublished) else 1.0
        state = (
            generator.uniform(-0.7, 0.7, model.state_shape)
            * model.law.largest_deflection
            * small
        )
        new = np.empty(state.size)
        out = np.empty(SLOPES)
        _called(
            function, place_of(packed.records), state.reshape(-1), twist, dt, new, out
        )
        wrench = out[:3]
        slopes = out[3:].reshape(3, 3)
        expected_state, expected = model.step(state, twist, 1.0, dt)
        expected_slopes = model.step_jacobians(state, twist, 1.0, dt).wrench_twist
        # other code for the same formulas: rounding, through exponentials of up to 1e4
        np.testing.assert_allclose(
            new.reshape(state.shape),
            expected_state,
            rtol=1e-9,
            atol=1e-12 * abs(state).max(),
        )
        np.testing.assert_allclose(wrench, expected, rtol=1e-9, atol=1e-11)
        np.testing.assert_allclose(
            slopes, expected_slopes, rtol=1e-8, atol=1e-10 * abs(expected_slopes).max()
        )


# ---------------------------------------------------------------------- what comes out


def _host(generator, k, *, dt=1e-3, rank=None):
    """A random host; `rank` of its response, which is nearly singular below 3k."""
    n = 3 * k
    scale = np.tile([1.0, 1.0, 100.0], k)
    factor = generator.normal(size=(n, rank or n)) * scale[:, None]
    response = dt * (factor @ factor.T + 1e-9 * np.diag(scale**2))
    twist = (
        generator.normal(size=(k, 3))
        * [0.01, 0.01, 1.0]
        * 10.0 ** generator.uniform(-1.5, 1.0)
    )
    wrench = generator.normal(size=(k, 3)) * [0.3, 0.3, 0.002]
    return HostStep(twist, generator.uniform(0.2, 3.0, k), wrench, response)


def _checked(patches, state, host, dt, step, tolerance=1e-9):
    """The models' steps at the twists and loads that came out, and these from the wrenches."""
    change = (step.wrench - host.wrench).reshape(-1)
    for model, before, after, twist, load, wrench in zip(
        patches.models, patches.states(state), patches.states(step.state), step.twist, step.normal_force, step.wrench,
        strict=True,
    ):  # fmt: skip
        expected_state, expected = model.step(before, twist, load, dt)
        np.testing.assert_allclose(after, expected_state, rtol=1e-9, atol=1e-18)
        np.testing.assert_allclose(wrench, expected, rtol=1e-9, atol=1e-12 * load)
    gap = (host.twist + (host.twist_response @ change).reshape(-1, 3) - step.twist) * [
        1.0,
        1.0,
        0.003,
    ]
    assert abs(gap).max() <= tolerance
    if host.load_response is not None:
        caused = np.maximum(host.normal_force + host.load_response @ change, 0.0)
        np.testing.assert_allclose(step.normal_force, caused, atol=1e-6)


@pytest.mark.parametrize("k", [1, 2, 4])
def test_models_of_all_kinds_in_one_step(k):
    generator = np.random.default_rng(k)
    models = list(MODELS.values())
    for i in range(30):
        patches = CoupledPatches([models[j] for j in generator.choice(len(models), k)])
        host = _host(generator, k, rank=3 if i % 2 else None)
        state = patches.rest()
        for _ in range(3):
            step = patches.step(state, host, 1e-3)
            assert step.converged
            _checked(patches, state, host, 1e-3, step)
            state = step.state
            host = host._replace(wrench=step.wrench)


def _reference(patches, state, host, dt, start):
    """Twists by a dense solver that knows nothing of slopes."""
    states = patches.states(state)

    def gap(flat):
        twists = flat.reshape(-1, 3) / [1.0, 1.0, 100.0]
        pulled = [
            model.step(z, twist, load, dt)[1]
            for model, z, twist, load in zip(
                patches.models, states, twists, host.normal_force, strict=True
            )
        ]
        change = (np.array(pulled) - host.wrench).reshape(-1)
        left = host.twist + (host.twist_response @ change).reshape(-1, 3) - twists
        return (left * [1.0, 1.0, 0.01]).reshape(-1)

    found, _, status, _ = fsolve(
        gap, (start * [1.0, 1.0, 100.0]).reshape(-1), xtol=1e-13, full_output=True
    )
    return (
        found.reshape(-1, 3) / [1.0, 1.0, 100.0]
        if status == 1 or abs(gap(found)).max() < 1e-9
        else None
    )


@pytest.mark.parametrize("rank", [None, 3, 1])
def test_agrees_with_a_dense_solver(rank):
    """Laws without falling friction, where there is one solution alone; the solver starts elsewhere."""
    generator = np.random.default_rng(5)
    compared = 0
    for _ in range(16):
        k = generator.integers(1, 4)
        kinds = [KINDS[i] for i in generator.choice(3, k)]
        patches = CoupledPatches(
            [
                kind(DISC, pf.LuGre(mu_s=1.0, sigma_0=1e4, sigma_1=10.0))
                for kind in kinds
            ]
        )
        host = _host(generator, k, rank=rank)
        state = patches.rest()
        step = patches.step(state, host, 1e-3, tolerance=1e-13)
        away = 1.0 + 0.1 * generator.normal(size=step.twist.shape)
        found = _reference(patches, state, host, 1e-3, step.twist * away)
        if found is not None:
            compared += 1
            # the dense solver's error, through a response of up to 100 over its smallest eigenvalue
            np.testing.assert_allclose(step.twist, found, rtol=1e-6, atol=1e-8)
    assert compared >= 12


def test_patches_that_do_not_see_each_other_step_alone():
    generator = np.random.default_rng(3)
    models = [
        pf.ReducedModel(DISC, LAW),
        pf.DistributedModel(DISC, PLAIN),
        pf.ReducedModelPublished(DISC, LAW),
    ]
    hosts = [_host(generator, 1) for _ in models]
    fields = [
        np.concatenate(parts)
        for parts in zip(*(host[:3] for host in hosts), strict=True)
    ]
    together = CoupledPatches(models)
    both = together.step(
        together.rest(),
        HostStep(*fields, block_diag(*(host.twist_response for host in hosts))),
        1e-3,
    )
    for p, (model, host) in enumerate(zip(models, hosts, strict=True)):
        alone = CoupledPatches([model])
        step = alone.step(alone.rest(), host, 1e-3)
        np.testing.assert_allclose(both.twist[p], step.twist[0], atol=2e-9 / 0.003)
        np.testing.assert_allclose(both.wrench[p], step.wrench[0], rtol=1e-4, atol=1e-5)


def test_batches_are_singles_bit_for_bit():
    generator = np.random.default_rng(7)
    patches = random_patches(generator, 3, KINDS)
    bodies = random_bodies(generator, 400, 3, 0.05)
    for state, host, dt, step in random_run(generator, patches, bodies, 3):
        for e in range(0, 400, 57):
            alone = patches.step(
                state[e],
                HostStep(*(None if field is None else field[e] for field in host)),
                dt[e],
            )
            assert all(
                np.array_equal(one, field[e])
                for one, field in zip(alone, step, strict=True)
            )


def test_axes_broadcast():
    patches = CoupledPatches([MODELS["reduced"]])
    host = _host(np.random.default_rng(2), 1)
    many = host._replace(normal_force=np.linspace(0.5, 2.0, 4)[:, None])
    step = patches.step(patches.rest(), many, np.array([[1e-3], [1e-2]]))
    assert step.twist.shape == (2, 4, 1, 3) and step.converged.shape == (2, 4)
    assert step.state.shape == (2, 4, *patches.state_shape)
    alone = patches.step(
        patches.rest(), many._replace(normal_force=many.normal_force[2]), 1e-2
    )
    assert np.array_equal(alone.wrench, step.wrench[1, 2])
    assert patches.step(patches.rest(), host, np.empty(0)).twist.shape == (0, 1, 3)


# ---------------------------------------------------------------------- loads


def test_loads_follow_wrenches_and_vanish_at_zero():
    patches = CoupledPatches([MODELS["reduced"], MODELS["distributed"]])
    host = HostStep(
        twist=np.array([[0.05, 0.0, 0.0], [0.05, 0.0, 0.0]]),
        normal_force=np.array([2.0, 0.1]),
        wrench=np.zeros((2, 3)),
        twist_response=1e-3 / 0.2 * np.kron(np.ones((2, 2)), np.diag([1.0, 1.0, 1e4])),
        load_response=np.array(
            [[-0.3, 0.0, 0.0, 0.0, 0.0, 0.0], [0.3, 0.0, 0.0, 0.0, 0.0, 0.0]]
        ),
    )
    state = patches.rest() + 1e-8
    step = patches.step(state, host, 1e-3)
    assert step.converged and step.normal_force[0] > 2.5 and step.normal_force[1] == 0.0
    _checked(patches, state, host, 1e-3, step)
    assert (step.wrench[1] == 0.0).all() and (
        patches.states(step.state)[1] == 0.0
    ).all()


def test_shapes_follow_the_loads_that_come_out():
    models = [
        pf.ReducedModel(SOFT, LAW),
        pf.DistributedModel(SOFT, LAW),
        pf.ReducedModelPublished(SOFT, LAW),
    ]
    patches = CoupledPatches(models)
    generator = np.random.default_rng(4)
    hosts = [_host(generator, 3) for _ in range(6)]
    host = HostStep(
        *(np.stack(field) for field in zip(*(each[:4] for each in hosts), strict=True))
    )
    host.normal_force[0, 1] = 0.0
    host = host._replace(
        load_response=generator.normal(size=(6, 3, 9)) * np.tile([0.05, 0.05, 5.0], 3)
    )
    state = np.zeros((6, *patches.state_shape))
    step = patches.step(state, host, 1e-3)
    assert (
        step.converged.all() and abs(step.normal_force - host.normal_force).max() > 0.05
    )
    for e in range(6):
        one = HostStep(*(None if field is None else field[e] for field in host))
        own = CoupledStep(*(field[e] for field in step))
        _checked(patches, state[e], one, 1e-3, own)
        alone = patches.step(state[e], one, 1e-3)
        assert all(
            np.array_equal(each, other) for each, other in zip(alone, own, strict=True)
        )


@pytest.mark.parametrize("response", [0.0, 1e-12, 1e-6, 1e-3])
def test_a_load_that_follows_the_wrench_does_so_whatever_the_twist_does(response):
    """A self-energising brake on a drum that nothing slows down, or little: its load is that of the lever."""
    patches = CoupledPatches([pf.DistributedModel(SOFT, LAW)])
    lever = np.array([[-0.5, 0.0, 0.0]])
    twist, load = np.array([[0.01, 0.0, 0.5]]), np.ones(1)
    host = HostStep(twist, load, np.zeros((1, 3)), response * np.eye(3), lever)
    step = patches.step(patches.rest(), host, 1e-2)
    assert step.converged
    assert step.normal_force > 1.2
    assert step.normal_force == pytest.approx(1.0 + lever @ step.wrench[0], rel=1e-6)


# ---------------------------------------------------------------------- in time


MODELS_THAT_STICK = {
    "cells": pf.DistributedModel(DISC, LAW),
    "metric": pf.DistributedModel(
        DISC.with_friction_metric([[1.0, 0.2], [0.2, 1.5]]), LAW
    ),
    "discs": pf.ReducedModel(DISC, LAW),
    "pad": pf.DistributedModel(DISC, LAW, pad=pf.Pad.at_load(2.0)),
}


@pytest.mark.parametrize("model", MODELS_THAT_STICK.values(), ids=MODELS_THAT_STICK)
def test_one_newton_step_solves_what_sticks_or_slides_steadily(model):
    """Bristles that stick are springs and dampers; those that slide keep the wrench that they have."""
    patches = CoupledPatches([model])
    response = np.diag([1e-2, 1e-2, 50.0])
    push, none = [[1e-5, 2e-5, 1e-3]], np.zeros((1, 3))
    step = patches.step(patches.rest(), HostStep(push, [3.0], none, response), 1e-3)
    assert step.iterations <= 1
    state, twist, counts = patches.rest(), np.array([0.5, 0.0, 30.0]), []
    for _ in range(6):
        host = HostStep([twist], [3.0], none, 0.1 * response)
        step = patches.step(state, host, 1e-3)
        state, twist = step.state, step.twist[0]
        counts.append(step.iterations)
    assert twist[0] > 0.1
    assert max(counts[1:]) <= 1


FEET = np.array([[0.05, 0.03], [0.05, -0.03], [-0.05, 0.03], [-0.05, -0.03]])


def _box(dt, t_end, model, *, push=(0.0, 0.0, 0.0), velocity=(0.0, 0.0, 0.0)):
    """Pose of a box of 0.2 kg on four patches with 0.5 N each, after semi-implicit steps in its own axes."""
    mass = np.array([0.2, 0.2, 2e-4])
    loads = np.full(4, 0.5)
    jacobian = np.concatenate(
        [[[1.0, 0.0, -y], [0.0, 1.0, x], [0.0, 0.0, 1.0]] for x, y in FEET]
    )
    response = dt * jacobian @ np.diag(1.0 / mass) @ jacobian.T
    patches = CoupledPatches([model] * 4)
    state = patches.rest()
    wrench = np.zeros((4, 3))
    velocity = np.array(velocity)
    pose = np.zeros(3)
    for _ in range(round(t_end / dt)):
        angle = pose[2] + 0.5 * dt * velocity[2]
        pushed = pf.geometry.rotate(velocity + dt * np.array(push) / mass, -angle)
        free = jacobian @ (pushed + dt * jacobian.T @ wrench.reshape(-1) / mass)
        step = patches.step(
            state, HostStep(free.reshape(4, 3), loads, wrench, response), dt
        )
        assert step.converged
        state = step.state
        wrench = step.wrench
        before = velocity
        velocity = pf.geometry.rotate(
            pushed + dt * jacobian.T @ wrench.reshape(-1) / mass, angle
        )
        pose += 0.5 * dt * (before + velocity)
    return pose


@pytest.mark.parametrize("kind", KINDS)
def test_approaches_the_solver_with_order_one(kind):
    """A box slides and turns, and is pushed: the error of its path halves with the step.

    Without damping of the bristles: as they bend from rest at 0.5 m/s it pushes 400 times as hard as friction does, for
    2 us, which shows in the path until steps are as short.
    """
    law = pf.LuGre(mu_s=1.2, sigma_1=0.0, elasto_plastic=0.9)
    model = kind(DISC, law)
    push = (0.3, -0.4, 0.01)
    velocity = (0.5, 0.1, 8.0)
    t_end = 0.024
    feet = [
        pf.Contact(model, 0.5, mounted_on="body", position=at, name=f"foot {at}")
        for at in FEET.tolist()
    ]
    body = pf.Body(0.2, 2e-4, gravity=(0.0, 0.0), velocity=velocity)
    scene = pf.Scene(body, feet, t_end=t_end, force=pf.Signal.constant(push))
    end = pf.simulate(scene, rtol=1e-9).data.isel(time=-1)
    exact = np.array([float(end[name]) for name in ("x", "y", "theta")])
    errors = [
        abs(_box(dt, t_end, model, push=push, velocity=velocity) - exact)
        for dt in (2e-3, 1e-3, 5e-4)
    ]
    assert (errors[0] < 0.03 * abs(exact)).all()
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert (abs(orders - 1.0) < 0.12).all()


@pytest.mark.parametrize("dt", [1e-4, 1e-2, 0.1])
@pytest.mark.parametrize("damping", [0.0, 800.0])
def test_what_sticks_does_not_creep(dt, damping):
    """Pushed with two thirds of what friction can hold, at any step length and without damping: it leans and stays."""
    model = pf.ReducedModel(
        DISC, pf.LuGre(mu_s=1.2, sigma_0=1e6, sigma_1=damping, elasto_plastic=0.9)
    )
    first, last = (
        _box(dt, steps * dt, model, push=(1.3, 0.0, 0.0)) for steps in (400, 800)
    )
    # steps of the tolerance, 1e-9 m/s, that do not add up
    assert abs(last - first)[:2].max() / (400 * dt) < 1e-10
    assert 0.5e-6 < last[0] < 1e-6


@pytest.mark.parametrize("kind", KINDS[:2])
@pytest.mark.parametrize("dt", [1e-4, 2e-3])
def test_energy_never_grows(kind, dt):
    """Without pushes: that of motion and of the bristles together."""
    generator = np.random.default_rng(6)
    law = pf.LuGre(mu_s=1.2, elasto_plastic=0.9)
    models = [kind(DISC, law)] * 3
    patches = CoupledPatches(models)
    bodies = random_bodies(generator, 20, 3)
    bodies = bodies._replace(
        dt=np.full(20, dt), response=bodies.response / bodies.dt[:, None, None] * dt
    )
    rigid = np.einsum(
        "eia,ea,eja->eij", bodies.jacobian, dt / bodies.mass, bodies.jacobian
    )
    velocity = generator.normal(size=(20, 3)) * [0.3, 0.3, 0.0] + [0.0, 0.0, 3.0]
    state = np.zeros((20, *patches.state_shape))
    wrench = np.zeros((20, 3, 3))
    energies = []
    for _ in range(300):
        bent = np.stack(
            [
                (z**2 * _weights(models[0])).reshape(20, -1).sum(-1)
                for z in patches.states(state)
            ],
            1,
        )
        energies.append(
            0.5 * (bodies.mass * velocity**2).sum(-1)
            + 0.5 * law.sigma_0 * (bodies.load * bent).sum(-1)
        )
        pulled = np.einsum("eia,ei->ea", bodies.jacobian, wrench.reshape(20, -1))
        free = np.einsum(
            "eia,ea->ei", bodies.jacobian, velocity + dt * pulled / bodies.mass
        ).reshape(20, 3, 3)
        step = patches.step(state, HostStep(free, bodies.load, wrench, rigid), dt)
        assert step.converged.all()
        state = step.state
        wrench = step.wrench
        velocity = (
            velocity
            + dt
            * np.einsum("eia,ei->ea", bodies.jacobian, wrench.reshape(20, -1))
            / bodies.mass
        )
    energies = np.array(energies)
    # the tolerance of the twists, 1e-9 m/s, against speeds of 0.3 m/s
    assert (np.diff(energies, axis=0) <= 1e-6 * energies[0]).all() and (
        energies <= 1.000001 * energies[0]
    ).all()
    assert (energies[-1] < 0.9 * energies[0]).all()


def _weights(model):
    few = model.reduction
    return few.patch.weights() if isinstance(few, pf.DistributedModel) else 1.0


# ---------------------------------------------------------------------- Newton's method


@pytest.mark.parametrize(
    "seed, sets, environments, steps, height",
    [
        (11, 1, 100, 12, 0.0),
        pytest.param(12, 3, 210, 40, 0.0, marks=pytest.mark.slow),
        pytest.param(12, 3, 210, 40, 0.05, marks=pytest.mark.slow),
    ],
)
def test_few_iterations_and_no_step_is_lost(seed, sets, environments, steps, height):
    """Slow: a hundred thousand steps."""
    generator = np.random.default_rng(seed)
    found = []
    for k in (1, 2, 3, 4):
        for _ in range(sets):
            patches = random_patches(generator, k)
            bodies = random_bodies(generator, environments, k, height)
            run = random_run(generator, patches, bodies, steps)
            found += [(step.iterations, step.residual) for *_, step in run]
    counts, residuals = np.array(found).swapaxes(0, 1)
    assert counts.mean() < 5.0 and np.percentile(counts, 99) <= 15
    assert (residuals > 1e-6).mean() <= 1e-3


def test_what_does_not_converge_says_so_and_has_the_best_found():
    patches = CoupledPatches([MODELS["reduced"]])
    host = _host(np.random.default_rng(2), 1)
    full = patches.step(patches.rest(), host, 1e-3)
    for most in range(int(full.iterations) + 1):
        step = patches.step(patches.rest(), host, 1e-3, iterations=most)
        assert step.iterations <= most and step.converged == (step.residual <= 1e-9)
        _checked(patches, patches.rest(), host, 1e-3, step, step.residual + 1e-14)
    assert (
        step.converged
        and not patches.step(patches.rest(), host, 1e-3, iterations=0).converged
    )


# ---------------------------------------------------------------------- input


def _changed(**fields):
    host = HostStep(np.zeros((1, 3)), np.ones(1), np.zeros((1, 3)), np.eye(3))
    return host._replace(**fields)


BAD = {
    "a state of another shape": (
        {"state": np.zeros(4)},
        r"state must have shape \[..., 3\], got shape \[4\]",
    ),
    "NaN in the state": (
        {"state": np.full(3, np.nan)},
        "state must be finite, got nan",
    ),
    "NaN in the twist": (
        {"twist": np.full((1, 3), np.nan)},
        "twist must be finite, got nan",
    ),
    "a twist for two": (
        {"twist": np.zeros((2, 3))},
        r"twist must have shape \[..., 1, 3\], got shape \[2, 3\]",
    ),
    "a negative load": (
        {"normal_force": [-1.0]},
        "normal_force must be >= 0, got -1.0",
    ),
    "a load that is a text": (
        {"normal_force": "1"},
        "normal_force must be an array of numbers, got '1'",
    ),
    "an infinite guess": (
        {"wrench": np.full((1, 3), np.inf)},
        "wrench must be finite, got inf",
    ),
    "a negative response": (
        {"twist_response": -np.eye(3)},
        "twist_response must have a diagonal >= 0, got -1.0",
    ),
    "a small response": (
        {"twist_response": np.eye(2)},
        r"twist_response must have shape \[..., 3, 3\]",
    ),
    "a response of loads for two": (
        {"load_response": np.zeros((2, 3))},
        r"load_response must have shape \[..., 1, 3\]",
    ),
    "a negative step": ({"dt": -1e-3}, "dt must be >= 0, got -0.001"),
    "no tolerance": ({"tolerance": 0.0}, "tolerance must be > 0, got 0.0"),
    "half an iteration": (
        {"iterations": 0.5},
        "iterations must be an integer >= 0, got 0.5",
    ),
    "batches that do not fit": (
        {"state": np.zeros((2, 3)), "dt": np.ones(3)},
        "batch axes must broadcast",
    ),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_input_is_refused_in_one_line(name):
    wrong, message = BAD[name]
    given = {"state": np.zeros(3), "dt": 1e-3, **wrong}
    options = {
        key: given.pop(key) for key in ("tolerance", "iterations") if key in given
    }
    state = given.pop("state")
    dt = given.pop("dt")
    patches = CoupledPatches([MODELS["published"]])
    with refused(message):
        patches.step(state, _changed(**given), dt, **options)


class _Uncompiled(pf.models.FrictionModel):
    state_shape = (3,)


@pytest.mark.parametrize(
    ("models", "message"),
    [
        (
            MODELS["reduced"],
            "models must be a list of friction models, one for each patch",
        ),
        ([], "models must hold at least one, got none"),
        (
            ["reduced"],
            "models must be friction models, one for each patch, got 'reduced'",
        ),
        (
            [_Uncompiled(DISC, LAW)],
            r"model must have compiled steps \(it has no machine form\)",
        ),
    ],
)
def test_models_are_checked(models, message):
    with refused(message):
        CoupledPatches(models)


def test_a_host_is_a_host_step_and_states_are_views():
    patches = CoupledPatches([MODELS["published"], MODELS["distributed"]])
    with refused("host must be a HostStep, got tuple"):
        patches.step(patches.rest(), (1, 2), 1e-3)  # pyright: ignore[reportArgumentType]
    with refused(r"state must be an array of shape \[..., 157\]"):
        patches.states(np.zeros(3))
    state = patches.rest()
    one, other = patches.states(state)
    one[:] = 1.0
    other[0, 2] = 2.0
    assert state[:3].sum() == 3.0 and other.shape == (2, 77) and state[5] == 2.0


def test_copies_are_equal_and_step_alike():
    patches = CoupledPatches([MODELS["reduced"], MODELS["distributed"]])
    host = _host(np.random.default_rng(8), 2)
    copy = pickle.loads(pickle.dumps(patches))
    assert copy == patches and hash(copy) == hash(patches)
    assert copy.step(copy.rest(), host, 1e-3) == patches.step(
        patches.rest(), host, 1e-3
    )
