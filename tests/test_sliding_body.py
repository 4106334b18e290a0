"""A body on patches as the simplest thing to step."""

import pickle

import numpy as np
import pytest

import planarfriction as pf
from planarfriction import coupling, geometry
from planarfriction._engine.coupled import bodies
from planarfriction.errors import SolverError
from planarfriction.sliding_body import BodyStep
from tests.support.refusals import refused

DISC = pf.ContactPatch.disc(radius=0.01)
GRAINED = pf.ContactPatch.rectangle(0.02, 0.01, cells=7).with_friction_metric(
    [[1.0, 0.2], [0.2, 1.5]]
)
MASS, INERTIA, PUSH = 0.2, 1e-5, 1.5


def model_of(sigma_0=1e6, **law):
    return pf.ReducedModel(
        DISC,
        pf.LuGre(
            mu_c=1.0, mu_s=1.2, v_s=1e-3, sigma_0=sigma_0, elasto_plastic=0.9, **law
        ),
    )


def travel(body, dt, load, duration=0.2):
    """Return how far a block goes that is pushed from rest."""
    state = body.rest()
    twist = np.zeros(3)
    x = 0.0
    for i in range(round(duration / dt)):
        state, twist, _ = body.step(
            state, twist, load((i + 1) * dt), dt, wrench=(PUSH, 0.0, 0.0)
        )
        x += dt * twist[0]
    return x


@pytest.mark.parametrize("sigma_0", [1e5, 1e6, 1e7])
@pytest.mark.parametrize("loads", [(2.0, 2.0), (2.0, 1.7), (1.7, 30.0)])
def test_a_pushed_block_stays_at_any_time_step(sigma_0, loads):
    """Within 1e-6 m of the solver's run, at 0.1 to 10 ms; a load jumps after half of the time."""
    model = model_of(sigma_0)
    pushed = pf.Body(MASS, INERTIA, gravity=(PUSH / MASS, 0.0))
    contact = pf.Contact(model, normal_force=pf.Signal([0.0, 0.1], loads))
    wanted = float(
        pf.simulate(pf.Scene(pushed, [contact], 0.2, rtol=1e-8, atol=1e-6)).data.x[-1]
    )
    body = pf.SlidingBody(MASS, INERTIA, model)
    for dt in (1e-4, 1e-3, 1e-2):
        assert travel(
            body, dt, lambda t: loads[0] if t < 0.1 + 1e-9 else loads[1]
        ) == pytest.approx(wanted, abs=1e-6)
    assert wanted < 1.1 * PUSH / (sigma_0 * min(loads)) + 1e-6


def four_feet(angles=0.0):
    feet = [(0.05, 0.03), (0.05, -0.03), (-0.05, 0.03), (-0.05, -0.03)]
    models = [
        model_of(),
        model_of(1e4),
        pf.DistributedModel(GRAINED, pf.LuGre()),
        model_of(),
    ]
    return pf.SlidingBody(MASS, 2e-4, models, feet, angles)


def test_wrench_is_that_of_the_models_at_the_end():
    """Friction moves the body by `dt M^-1 W`, and W are the wrenches of `step` at the twist that it moves to."""
    body = four_feet([0.3, 0.0, -1.0, 2.0])
    dt = 2e-3
    angle = 0.7
    loads = np.array([0.5, 1.0, 0.2, 0.0])
    twist = np.array([0.03, -0.01, 0.8])
    push = np.array([0.3, 0.2, 0.01])
    end = body.step(body.rest(), twist, loads, dt, push, angle)
    np.testing.assert_allclose(
        end.twist,
        twist + dt / np.array([MASS, MASS, 2e-4]) * (push + end.wrench),
        rtol=1e-12,
    )
    total = np.zeros(3)
    for model, place, turn, load in zip(
        body.patches.models, body.positions, body.angles, loads, strict=True
    ):
        arm = geometry.rotate(place, angle)
        seen = geometry.rotate(geometry.twist_at(end.twist, arm), -angle - turn)
        wrench = geometry.rotate(
            model.step(model.rest(), seen, load, dt)[1], angle + turn
        )
        total += geometry.wrench_at(wrench, -arm)
    np.testing.assert_allclose(end.wrench, total, atol=1e-5 * np.abs(total).max())
    assert (
        isinstance(end, BodyStep)
        and total[2] != 0.0
        and not body.patches.states(end.state)[3].any()
    )


def test_batches():
    """Bodies of a batch move as each one alone."""
    body = four_feet()
    rng = np.random.default_rng(0)
    twists = rng.normal(size=(6, 3)) * 0.05
    pushes = rng.normal(size=(6, 3)) * [1.0, 1.0, 0.02]
    loads = rng.uniform(0.0, 1.0, (6, 4))
    angles = rng.uniform(-3.0, 3.0, 6)
    dt = np.linspace(1e-4, 1e-2, 6)
    many = body.step(body.rest(), twists, loads, dt, pushes, angles)
    for i in range(6):
        one = body.step(body.rest(), twists[i], loads[i], dt[i], pushes[i], angles[i])
        for a, b in zip(many, one, strict=True):
            np.testing.assert_array_equal(a[i], b)
    lone = pf.SlidingBody(MASS, INERTIA, model_of())
    assert lone.step(lone.rest(5), np.zeros(3), np.ones((2, 1)), 1e-3).wrench.shape == (
        2,
        5,
        3,
    )


@pytest.mark.parametrize("many", [False, True], ids=["one patch", "two patches"])
def test_inputs_of_every_kind_give_the_same_step(many):
    """Plain numbers go straight to compiled code, all others through the checks."""
    models = [model_of(), model_of(1e5)] if many else model_of()
    body = pf.SlidingBody(MASS, 1e-4, models, [(0.02, 0.0), (0.0, 0.03)][: 1 + many])
    twist = (0.03125, -0.25, 2.0)
    push = (1.0, 0.5, 0.0)
    load = [1.0, 2.0] if many else 2.0
    start = body.step(body.rest(), twist, load, 1e-3, push).state
    given = [start, twist, load, 0.0625, push, 0.0]
    wanted = body.step(*given)
    strided = np.stack([start, start], axis=-1)[:, 0]
    frozen = start.copy()
    frozen.flags.writeable = False
    for place, other in (
        *((0, each) for each in (strided, frozen, start.tolist())),
        *((1, each) for each in (list(twist), np.array(twist), np.float32(twist))),
        *((2, each) for each in (np.array(load), np.int64(load), np.float32(load))),
        *((3, each) for each in (np.array(0.0625), np.float32(0.0625))),
        *((4, each) for each in (np.array(push), [1, 0.5, 0])),
        *((5, each) for each in (0, np.float64(0.0), np.zeros(()))),
    ):
        found = body.step(*given[:place], other, *given[place + 1 :])
        assert all(map(np.array_equal, found, wanted)), (place, other)
    copied = pickle.loads(pickle.dumps(body))
    assert copied == body and all(map(np.array_equal, copied.step(*given), wanted))


@pytest.mark.parametrize("sigma_0, sigma_1", [(1e6, 800.0), (1e7, 10.0), (1e3, 800.0)])
def test_largest_step_of_a_loop_around_step(sigma_0, sigma_1):
    """A stuck block that is nudged comes to rest below that, and swings ever wider above it."""
    model = model_of(sigma_0, sigma_1=sigma_1)
    body = pf.SlidingBody(MASS, INERTIA, model)
    speeds = {}
    for share in (0.98, 1.02):
        dt = share * body.largest_step(2.0)
        state = model.rest()
        v = 1e-9
        for _ in range(400):
            state, wrench = model.step(state, (v, 0.0, 0.0), 2.0, dt)
            v += dt * wrench[0] / MASS
        speeds[share] = abs(v)
    assert speeds[0.98] < 1e-9 < 1e-7 < speeds[1.02]


def test_largest_step_of_several_patches():
    """Patches add up, spin has its own limit, and without load every step is stable."""
    model = model_of()
    far = [(0.1, 0.0), (-0.1, 0.0)]
    pair = pf.SlidingBody(MASS, 1.0, [model, model], far)
    assert pair.largest_step([1.0, 1.0]) == pytest.approx(
        pf.SlidingBody(MASS, 1.0, model).largest_step(2.0), rel=1e-9
    )
    light = pf.SlidingBody(MASS, 1e-4, [model, model], far)
    # A mass that the feet feel at their arm.
    equal = pf.SlidingBody(1e-4 / 1e-2, 1e9, model).largest_step(2.0)
    assert light.largest_step([1.0, 1.0]) == pytest.approx(equal, rel=1e-2)
    assert light.largest_step([[0.0, 0.0], [1.0, 1.0]])[0] == np.inf


def test_a_step_that_does_not_converge_says_so(monkeypatch):
    """The error has the results of all bodies, and tells which of them hold."""
    monkeypatch.setattr(coupling, "ITERATIONS", 0)
    body = pf.SlidingBody(MASS, INERTIA, model_of())
    with pytest.raises(
        SolverError,
        match=r"a body did not converge \(2 of 3 bodies, off by .* m/s at dt",
    ) as caught:
        body.step(
            body.rest(), [[0.1, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.2, 0.0]], 2.0, 1e-3
        )
    assert caught.value.converged.tolist() == [False, True, False]
    for of_all, alone in zip(
        caught.value.step, body.step(body.rest(), np.zeros(3), 2.0, 1e-3), strict=True
    ):
        np.testing.assert_array_equal(of_all[1], alone)
        assert len(of_all) == 3 and np.isfinite(of_all).all()


def test_energy_that_a_step_cannot_gain_says_nothing_of_its_size():
    """A tolerance follows the speeds: the same step in grams and in tons, with times and lengths as they are."""
    for scale in (1e-6, 1.0, 1e6):
        body = pf.SlidingBody(scale * MASS, scale * INERTIA, model_of())
        end = body.step(
            body.rest(), (0.0, 0.0, 0.0), scale * 1e4, 1.0, (scale * 5e3, 0.0, 0.0)
        )
        np.testing.assert_allclose(end.wrench / scale, (-5e3, 0.0, 0.0), atol=1e-5)


def on_a_turntable(mu, size, radius, spin, dt, steps):
    """Return the body and the pose of one that begins to turn with its turntable."""
    patch = pf.ContactPatch.disc(radius=size)
    body = pf.SlidingBody(MASS, 1e-4, pf.ReducedModel(patch, pf.LuGre(mu)))
    state = body.rest()
    pose = np.array([radius, 0.0, 0.0])
    twist = np.array([0.0, spin * radius, spin])
    for _ in range(steps):
        carried = (-spin * pose[1], spin * pose[0], spin)
        middle = pose[2] + 0.5 * dt * spin
        state, twist, _ = body.step(
            state, twist, MASS * 9.81, dt, angle=middle, support_velocity=carried
        )
        pose += dt * twist
    return body, pose


@pytest.mark.parametrize(
    "spin, radius, mu",
    [(1.0, 0.25, 0.3), (2.0, 0.25, 0.3), (3.0, 0.5, 1.0), (10.0, 0.02, 0.3)],
)
@pytest.mark.parametrize("dt", [2e-3, 4e-3])
def test_a_body_on_a_turntable_keeps_its_place(spin, radius, mu, dt):
    """Along tangents it would move outwards by `exp(w^2 dt T/2)`, which is 8 % at 2 rad/s; along chords not at all."""
    duration = 4.0
    body, pose = on_a_turntable(mu, 0.03, radius, spin, dt, round(duration / dt))
    turned = spin * duration
    x, y = geometry.rotate(pose[:2], -turned)
    # Bristles carry the centripetal force.
    deflection = spin**2 * radius / (9.81 * body.models.law.sigma_0)
    # and 1e-9 m/s are the tolerance of a step
    allowed = 2.0 * deflection + 1e-9 * duration
    assert abs(x - radius) < allowed and abs(y) < allowed
    assert pose[2] == pytest.approx(turned, abs=1e-7)


def test_a_body_on_a_turntable_slides_where_friction_ends():
    """At `mu g/w^2` friction is as large as the centripetal force."""
    mu = 0.3
    spin = 2.0
    for share in (0.97, 1.03):
        radius = share * mu * 9.81 / spin**2
        _, pose = on_a_turntable(mu, 1e-3, radius, spin, 2e-3, 500)
        slid = np.hypot(*pose[:2]) - radius
        assert abs(slid) < 2e-5 if share < 1.0 else slid > 1e-3


def test_patches_of_a_host_on_a_support_that_turns():
    """The recipe for `CoupledPatches`, without the chord of the support in the free twist, is the step of a body."""
    body = four_feet([0.3, 0.0, -1.0, 2.0])
    dt = 1e-2
    angle = 0.7
    table = np.array([-0.3, 0.4, 5.0])
    twist = np.array([-0.31, 0.41, 4.0])
    loads = np.array([0.5, 1.0, 0.2, 0.3])
    end = body.step(
        body.rest(), twist, loads, dt, (0.1, 0.0, 0.0), angle, support_velocity=table
    )
    chord = geometry.chord(table, dt)
    arms = geometry.rotate(body.positions, angle)
    turns = angle + body.angles
    rows = (
        geometry.rotate(geometry.twist_at(np.eye(3)[:, None], arms), -turns)
        .transpose(1, 2, 0)
        .reshape(12, 3)
    )
    response = dt / np.array([MASS, MASS, 2e-4])
    free = twist + response * [0.1, 0.0, 0.0] - chord
    host = coupling.HostStep(
        (rows @ free).reshape(4, 3),
        loads,
        np.zeros((4, 3)),
        rows @ np.diag(response) @ rows.T,
    )
    step = body.patches.step(body.rest(), host, dt)
    np.testing.assert_allclose(end.state, step.state, atol=1e-12)
    np.testing.assert_allclose(end.wrench, rows.T @ step.wrench.ravel(), atol=1e-9)
    np.testing.assert_allclose(
        rows @ (end.twist - chord), step.twist.ravel(), atol=1e-9
    )


def test_three_equations_of_a_body_give_the_newton_steps_of_all_patches():
    """As many iterations as with the full system of a host, which a wrong slope would raise."""
    body = four_feet([0.3, 0.0, -1.0, 2.0])
    packed = body._packed
    counts = body.patches._packed.layout.slices["iterations"]
    response = 1e-3 / np.array([MASS, MASS, body.inertia])
    rows = body._to_patches
    twists = np.random.default_rng(0).normal(size=(8, 3)) * [0.05, 0.05, 1.0]
    loads = np.array([0.5, 1.0, 0.2, 0.3])
    taken = []
    for twist in twists:
        problem = np.empty(packed.scratch)
        given = np.array([*twist, *np.zeros(6), 1e-3, 0.0, *loads])
        end = np.empty(packed.states + bodies.MORE)
        start = body.rest()
        done = bodies.step_bodies(
            packed.words, start, given, packed.records, problem, end
        )
        host = coupling.HostStep(
            (rows @ twist).reshape(4, 3),
            loads,
            np.zeros((4, 3)),
            rows * response @ rows.T,
        )
        step = body.patches.step(start, host, 1e-3)
        assert done == 1
        taken.append((problem[counts].item(), step.iterations))
    alone, hosted = np.sum(taken, axis=0)
    assert hosted - 2 <= alone <= hosted + 2


def test_a_patch_that_follows_its_load():
    """The shape is that of the load of each body, as in a step of the patch with a host."""
    finger = pf.SoftFinger(c=0.01, n=1 / 3, k=2.0)
    model = pf.ReducedModel(pf.ContactPatch.disc(0.01, 7, pressure=finger), pf.LuGre())
    body = pf.SlidingBody(MASS, INERTIA, model)
    loads = np.array([0.5, 0.0, 0.9])
    twist = np.array([0.03, -0.01, 8.0])
    end = body.step(body.rest(), twist, loads, 1e-3)
    response = np.diag(1e-3 / np.array([MASS, MASS, INERTIA]))
    host = coupling.HostStep(twist[None], loads[:, None], np.zeros((1, 3)), response)
    wanted = body.patches.step(body.rest(), host, 1e-3)
    np.testing.assert_allclose(end.state, wanted.state, rtol=1e-12)
    np.testing.assert_allclose(end.wrench, wanted.wrench[:, 0], rtol=1e-12)
    assert end.wrench[2, 2] < 1.8 * 1.2 * end.wrench[0, 2] < 0.0 == end.wrench[1, 2]


def test_only_motion_against_the_support_counts():
    """A belt under a body at rest is a body that slides on rest, seen from the belt."""
    body = four_feet([0.3, 0.0, -1.0, 2.0])
    belt = np.array([0.2, -0.1, 0.0])
    given = {
        "normal_force": [0.5, 1.0, 0.2, 0.0],
        "dt": 2e-3,
        "wrench": (0.3, 0.2, 0.01),
        "angle": 0.7,
    }
    moved = body.step(body.rest(), (0.03, -0.01, 0.8), **given, support_velocity=belt)
    seen = body.step(body.rest(), (-0.17, 0.09, 0.8), **given)
    np.testing.assert_allclose(moved.twist, seen.twist + belt, atol=1e-12)
    np.testing.assert_allclose(moved.wrench, seen.wrench, atol=1e-9)
    many = body.step(
        body.rest(3), np.zeros(3), **given, support_velocity=np.zeros((2, 1, 3))
    )
    assert many.twist.shape == (2, 3, 3)


@pytest.mark.parametrize(
    "change, words",
    [
        ({"mass": 0.0}, "mass must be > 0"),
        ({"models": []}, "models must hold at least one"),
        ({"positions": [(0.0, 0.0)] * 2}, "positions must have shape"),
        ({"angles": np.nan}, "angles must be finite"),
    ],
)
def test_bad_bodies(change, words):
    with refused(words, pf.FrictionError):
        pf.SlidingBody(
            **{"mass": MASS, "inertia": INERTIA, "models": model_of()} | change
        )


REST = four_feet().rest()


@pytest.mark.parametrize(
    "change, words",
    [
        ({"twist": (0.0, 0.0)}, "twist must have shape"),
        ({"wrench": (np.nan, 0.0, 0.0)}, "wrench must be finite"),
        ({"normal_force": (1.0, 2.0, 3.0)}, r"normal_force must have shape \[..., 4\]"),
        (
            {"normal_force": (1.0, 2.0, 3.0, -1.0)},
            "normal_force must be finite and >= 0",
        ),
        ({"dt": -1e-3}, "dt must be >= 0"),
        ({"dt": np.ones(2), "angle": np.ones(3)}, "must broadcast"),
        ({"dt": True}, "dt must be an array of numbers and no truth value"),
        ({"dt": 10**400}, "dt must be finite"),
        ({"wrench": (1e60, 0.0, 0.0), "dt": 1e-20}, "wrench must be at most"),
        ({"wrench": (1e50, 0.0, 0.0), "dt": 1.0}, "twist, wrench and dt must give"),
        ({"state": np.zeros(3)}, "state must have shape"),
        ({"state": np.full(REST.shape, np.nan)}, "state must be finite"),
        ({"support_velocity": (0.0, 0.0)}, "support_velocity must have shape"),
        ({"support_velocity": (0.0, 0.0, np.inf)}, "support_velocity must be finite"),
    ],
)
def test_bad_steps(change, words):
    body = four_feet()
    given = {
        "state": body.rest(),
        "twist": np.zeros(3),
        "normal_force": np.ones(4),
        "dt": 1e-3,
    }
    with refused(words, pf.FrictionError):
        body.step(**given | change)


def test_an_empty_batch_is_an_empty_step():
    body = pf.SlidingBody(
        0.2, 1e-4, pf.ReducedModel(pf.ContactPatch.disc(0.01), pf.LuGre(0.3))
    )
    step = body.step(body.rest(0), np.zeros((0, 3)), np.zeros(0), 1e-3)
    assert step.twist.shape == step.wrench.shape == (0, 3)
