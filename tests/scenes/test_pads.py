"""Scenes with pads, in the solver."""

import numpy as np
import pytest

import planarfriction as pf
from planarfriction._engine.compiler import jit
from planarfriction._engine.compiler.calls import call
from planarfriction._engine.compiler.memory import doubles, place_of
from planarfriction._engine.protocol import SEEN_SIZE, addresses_at, calls_of
from planarfriction._engine.records.packed import rates
from planarfriction.derivatives import scene_sensitivities
from planarfriction.laws import LuGre
from planarfriction.models import DistributedModel, ReducedModel
from planarfriction.pads import Pad
from planarfriction.patch import ContactPatch
from planarfriction.scenes import Body, Contact, Scene, Signal, driven, simulate
from planarfriction.scenes.start import first_slopes, first_states
from planarfriction.sliding_body import SlidingBody
from tests.support.differences import differences
from tests.support.refusals import refused

ONE = ContactPatch.points([[-0.01, 0.0], [0.01, 0.0]])
_GRID = ContactPatch.disc(0.02, cells=4)
DISCS = ContactPatch(
    _GRID.positions, _GRID.areas, _GRID.weights(), radii=np.full(_GRID.cells, 0.005)
)


def _body(mass=0.1, inertia=1e-4):
    return Body(mass, inertia, gravity=(0.0, 0.0))


def _swinging(mean, share, rate, t_end, steps):
    time = np.linspace(0.0, t_end, steps + 1)
    return Signal(
        time, mean * (1.0 + share * np.sin(2.0 * np.pi * rate * time)), "linear"
    )


@pytest.mark.parametrize(
    ("pull", "reference", "swing", "first", "last"),
    [
        (0.6, 1.0, 0.0, 0.6, 0.6),
        (0.8, 1.0, 0.0, 0.8, 0.8),
        (0.6, None, 0.39, None, None),
        (0.8, None, None, 0.98, 1.51),
    ],
)
def test_a_body_under_a_load_that_oscillates_stays_where_it_is(
    pull, reference, swing, first, last
):
    """The published law swings, and creeps near the limit."""
    law = LuGre(mu_s=1.2, elasto_plastic=0.9)
    pad = reference and Pad.at_load(reference)
    contact = Contact(
        DistributedModel(ONE, law, pad=pad), _swinging(1.0, 0.3, 2.0, 20.0, 4000)
    )
    x = (
        1e6
        * simulate(
            Scene(_body(), contact, 20.0, force=(pull, 0.0, 0.0), save_every=0.01)
        )
        .data["x"]
        .values
    )
    if swing is not None:
        assert np.ptp(x[1850:]) == pytest.approx(swing, abs=0.01 if swing else 1e-6)
    if first is not None:
        np.testing.assert_allclose(
            x[[500, -1]], [first, last], atol=1e-6 if reference else 0.02
        )


def _explicit(model, body, load, pull, t_end, steps):
    """Integrate a contact on the body by the classical method of Runge and Kutta; return its velocity and place."""
    dt = t_end / steps
    mass = np.array([body.mass, body.mass, body.inertia])
    size = int(np.prod(model.state_shape))

    def rate(t, y):
        z = y[:size].reshape(model.state_shape)
        u = y[size : size + 3]
        f = float(load(t))
        cos = np.cos(y[-1])
        sin = np.sin(y[-1])
        turn = np.array([[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 1.0]])
        pulled = pull + turn.T @ model.wrench(z, turn @ u, f)
        return np.concatenate([model.rate(z, turn @ u, f).ravel(), pulled / mass, u])

    y = np.zeros(size + 6)
    for k in range(steps):
        t = k * dt
        a = rate(t, y)
        b = rate(t + 0.5 * dt, y + 0.5 * dt * a)
        c = rate(t + 0.5 * dt, y + 0.5 * dt * b)
        y = y + dt / 6.0 * (a + 2.0 * b + 2.0 * c + rate(t + dt, y + dt * c))
    return y[size:]


@pytest.mark.parametrize(
    "patch, ratio", [(ONE, 0.8), (DISCS, None)], ids=["points", "discs"]
)
def test_the_solver_agrees_with_a_fine_explicit_integration(patch, ratio):
    """The load falls below what the bristles hold, again and again."""
    law = LuGre(mu_s=1.2, sigma_0=1e4, sigma_1=20.0, elasto_plastic=ratio)
    pad = Pad.at_load(1.5) if patch is ONE else Pad.measured(1.5e4)
    model = DistributedModel(patch, law, pad=pad)
    body = _body(0.05, 2e-5)
    t_end = 0.1
    load = Signal(
        [0.0, 0.02, 0.04, 0.06, 0.08, 0.1], [1.5, 2.5, 0.4, 1.6, 0.5, 1.2], "linear"
    )
    pull = np.array([0.7, 0.1, 3e-3])
    wanted = _explicit(model, body, load, pull, t_end, 20_000)
    data = simulate(
        Scene(
            body,
            Contact(model, load, mounted_on="body"),
            t_end,
            force=pull,
            save_every=t_end,
            rtol=1e-8,
            atol=1e-9,
        )
    ).data
    found = np.array(
        [data[name][-1] for name in ("vx", "vy", "omega", "x", "y", "theta")]
    )
    assert np.abs(wanted[3:]).min() > 1e-5
    np.testing.assert_allclose(found, wanted, rtol=2e-4, atol=1e-9)


@pytest.mark.parametrize("patch", [ONE, DISCS], ids=["points", "discs"])
def test_a_load_that_drops_at_once_leaves_no_force_above_the_limit(patch):
    law = LuGre(elasto_plastic=0.9)
    load = Signal([0.0, 0.01, 0.02, 0.03], [2.0, 0.5, 0.0, 3.0])
    velocity = Signal([0.0, 0.005], [[2e-4, 0.0, 0.0], [0.0, 0.0, 0.0]])
    scene = Scene(
        _body(),
        Contact(DistributedModel(patch, law, pad=Pad.at_load(1.0)), load),
        0.04,
        velocity=velocity,
        save_every=1e-3,
    )
    pull = -simulate(scene).data["fx"].values[:, 0]
    np.testing.assert_allclose(pull[[6, 10]], 1.0, rtol=1e-6)  # sigma_0 f_ref 1 um
    np.testing.assert_allclose(pull[[11, 19]], 0.5, rtol=1e-4)
    assert not pull[[21, 29]].any() and np.abs(pull[31:]).max() < 1e-12


@pytest.mark.parametrize("ratio", [None, 0.9])
def test_the_force_of_a_held_contact_never_grows_with_the_load(ratio):
    law = LuGre(sigma_1=0.0, elasto_plastic=ratio)
    model = DistributedModel(DISCS, law, pad=Pad.at_load(1.0))
    loads = _swinging(1.0, 0.8, 5.0, 1.0, 1000)
    velocity = Signal([0.0, 0.001], [[8e-4, 0.0, 0.0], [0.0, 0.0, 0.0]])
    data = simulate(
        Scene(
            _body(),
            Contact(model, loads),
            1.0,
            velocity=velocity,
            save_every=2e-3,
            rtol=1e-8,
            atol=1e-8,
        )
    ).data
    force = np.abs(data["fx"].values[:, 0])
    assert 0.5 < force[1] <= 0.8 + 1e-6
    assert (np.diff(force[1:]) <= 1e-6).all() and force[-1] < 0.3


@pytest.mark.parametrize("pad", [Pad.at_load(1.0), Pad.measured(1e6)])
def test_an_equilibrium_follows_the_load(pad, patch=DISCS, load=1.3):
    """Near the limit, where some bristles are bent as far as they can be."""
    body = Body(0.1, 1e-4, (0.008, 0.0), gravity=(0.0, 0.0))

    def scene(load):
        model = DistributedModel(patch, LuGre(mu_s=1.2, elasto_plastic=0.9), pad=pad)
        return Scene(
            body, Contact(model, load), 0.01, force=(1.3, 0.4, 0.0), start="equilibrium"
        )

    slope = first_slopes(
        scene(load), np.array([load]), np.ones((1, 1)), np.zeros((1, 3))
    )[0][0]
    more, less = (
        first_states(scene(at), np.array([at]))[0] for at in (load + 1e-4, load - 1e-4)
    )
    wanted = (more - less) / 2e-4
    assert np.abs(wanted).max() > 1e-7
    np.testing.assert_allclose(
        slope, wanted, rtol=0.0, atol=1e-6 * np.abs(wanted).max()
    )


@pytest.mark.parametrize(
    "pad", [Pad.at_load(1.0), Pad.layer(0.2e6, 3e-3), Pad.measured(1e5, common=0.4)]
)
@pytest.mark.parametrize("start", ["equilibrium", "sliding"])
def test_a_scene_may_start_under_load_or_sliding(start, pad):
    """Also on discs that stand for more cells."""
    law = LuGre(sigma_1=0.0, elasto_plastic=0.9)
    model = ReducedModel(_GRID, law, pad=pad, cells=8)
    contact = Contact(model, 2.5, mounted_on="body")
    given = (
        {"force": (1.5, 0.2, 0.0)}
        if start == "equilibrium"
        else {"velocity": (0.01, 0.0, 0.3)}
    )
    data = simulate(
        Scene(_body(), contact, 0.05, start=start, save_every=0.01, **given)
    ).data
    force = np.array([data["fx"].values[:, 0], data["fy"].values[:, 0]])
    if start == "equilibrium":
        np.testing.assert_allclose(
            force.T, np.tile([-1.5, -0.2], (force.shape[1], 1)), rtol=1e-6
        )
        assert np.abs(data["x"]).max() < 1e-12
    else:
        np.testing.assert_allclose(
            force, force[:, :1] * np.ones(force.shape[1]), rtol=1e-5, atol=1e-12
        )


@pytest.mark.parametrize("ratio", [None, 0.5])
@pytest.mark.parametrize("hold", ["linear", "previous"])
def test_a_sliding_body_may_lose_its_load_and_get_it_back(hold, ratio):
    """It slows down by `int mu f_N dt/m`, but for the micrometres in which bristles bend."""
    law = LuGre(mu_c=0.5, sigma_1=1.0, sigma_2=0.0, elasto_plastic=ratio)
    load = Signal([0.0, 0.02, 0.03, 0.04, 0.1], [2.0, 0.0, 0.0, 3.0, 1.0], hold)
    body = Body(0.4, 1e-4, velocity=(0.5, 0.1, 0.0), gravity=(0.0, 0.0))
    scene = Scene(
        body,
        Contact(
            DistributedModel(DISCS, law, pad=Pad.at_load(2.0)), load, mounted_on="body"
        ),
        0.1,
        save_every=0.1,
    )
    data = simulate(scene, rtol=1e-8, atol=1e-8).data
    lost = 0.5 * {"linear": 0.02 + 0.015 + 0.12, "previous": 0.04 + 0.18}[hold] / 0.4
    found = np.hypot(0.5, 0.1) - np.hypot(data["vx"].values[-1], data["vy"].values[-1])
    assert found == pytest.approx(lost, rel=1e-4)


def test_a_pressure_that_follows_the_load_refuses():
    contact = Contact(
        DistributedModel(_GRID, LuGre(), pad=Pad.at_load(1.0)),
        1.0,
        mounted_on="body",
        pressure="follows",
    )
    with refused("pad must be None for a pressure that follows the load"):
        simulate(Scene(_body(), contact, 0.01))


HERTZ = ContactPatch.disc(
    0.01, 11, pressure=lambda x, y: np.maximum(1e-4 - x * x - y * y, 0.0) ** 0.5
)
SPRINGS = LuGre(mu_c=0.8, sigma_1=0.0, sigma_2=2.0, elasto_plastic=0.9)
FACES = {
    "half-space": ReducedModel(HERTZ, SPRINGS, pad=Pad.half_space(0.2e6, 0.45)),
    "measured": DistributedModel(DISCS, SPRINGS, pad=Pad.measured(4e3, common=0.4)),
}


@pytest.mark.parametrize("name", FACES)
def test_a_face_behind_a_common_compliance_moves_as_in_steps(name):
    """A shift with a turn under a load that falls to nothing and comes back; steps of first order, extrapolated."""
    model = FACES[name]
    twist = np.array([1e-3, -4e-4, 0.2])
    times, loads = [0.0, 0.1, 0.2, 0.25, 0.3, 0.4], [3.0, 3.0, 1.0, 0.0, 0.0, 3.0]
    scene = driven(
        model, twist=twist, normal_force=Signal(times, loads, "linear"), t_end=0.4,
        at="origin",
    )  # fmt: skip
    data = simulate(scene, save_every=0.05, rtol=1e-8, atol=1e-8, bristles="all").data
    states = data[f"bristles_{scene.contacts[0].name}"].values
    found = np.stack([data[each].values[:, 0] for each in ("fx", "fy", "tau")], -1)

    def stepped(steps):
        state = model.rest()
        kept = []
        for k in range(8 * steps):
            now = np.interp((k + 1) * 0.05 / steps, times, loads)
            state, wrench = model.step(state, twist, now, 0.05 / steps)
            if k % steps == steps - 1:
                kept.append((wrench, state[-3:]))
        return [np.array(each) for each in zip(*kept, strict=True)]

    fine = zip(stepped(1000), stepped(500), strict=True)
    (wrench, face) = (2.0 * new - old for new, old in fine)
    size = np.abs(face).max(axis=0) + 1e-9
    off = np.abs(states[1:, -3:] - face) / size
    # In a falling load, bristles lag behind their limit by r mu_s/(l sigma_0 v_r), 0.003 here, and faces by T.
    falls = np.isin(np.arange(8), [2, 3, 4])
    wrong = np.abs(found[1:] - wrench) / (0.8 * 3.0 * np.array([1.0, 1.0, 0.01]))
    assert (wrong[~falls] < 1e-4).all() and (wrong[falls] < 5e-3).all()
    assert (off[~falls] < 1e-4).all() and (off[falls] < 3e-2).all()
    assert not found[6].any() and np.abs(found[4]).max() > 0.05


@pytest.mark.parametrize("name", FACES)
def test_rates_behind_a_common_compliance_are_those_of_short_steps(name):
    """Their first order in dt, and the wrench that the displacement of the face asks for, `-C^-1 (b + T b')`."""
    model = FACES[name]
    twist, load = np.array([0.01, 0.002, 0.3]), np.array([2.0, 0.7])
    state = model.rest(2)
    for _ in range(20):
        state, _ = model.step(state, twist, load, 2e-4)
    rate = model.rate(state, twist, load)
    errors = []
    for dt in (1e-6, 1e-7):
        new, _ = model.step(state, twist, load, dt)
        errors.append(np.abs((new - state) / dt - rate).max() / np.abs(rate).max())
    assert errors[0] < 1e-3 and errors[1] == pytest.approx(0.1 * errors[0], rel=0.05)
    few = model.reduction
    compliance = few.pad.compliance(few.patch)
    wrench = model.wrench(state, twist, load)
    behind = state[:, -3:] + few.pad.lag * rate[:, -3:]
    np.testing.assert_allclose(
        -wrench @ compliance, behind, rtol=1e-9, atol=1e-9 * np.abs(behind).max()
    )


def test_a_body_between_two_half_spaces_moves_as_in_steps():
    model = FACES["half-space"]
    places = [(0.02, 0.0), (-0.02, 0.0)]
    force = (1.5, 0.3, 0.02)
    contacts = [
        Contact(model, 2.0, mounted_on="body", position=place, name=f"{place[0]}")
        for place in places
    ]
    body = _body(0.2)
    data = simulate(Scene(body, contacts, 0.05, force=force), rtol=1e-7, atol=1e-8).data
    found = [data[each].values[-1] for each in ("x", "y", "theta")]
    two = SlidingBody(0.2, 1e-4, [model, model], positions=places)

    def stepped(steps):
        state, twist, pose = two.rest(), np.zeros(3), np.zeros(3)
        dt = 0.05 / steps
        for _ in range(steps):
            state, twist, _ = two.step(
                state, twist, [2.0, 2.0], dt, wrench=force, angle=pose[2]
            )
            pose = pose + dt * twist
        return pose

    limit = 2.0 * stepped(2000) - stepped(1000)
    np.testing.assert_allclose(found, limit, rtol=5e-4)


def test_faces_in_equilibrium_share_the_load_by_their_stiffness():
    """Two pads that stick hold a pull like springs in parallel, with more of one behind its face."""
    given = {"near": (4e3, 0.4, 0.02, 2), "far": (9e3, 0.7, -0.02, 1)}
    contacts = [
        Contact(DistributedModel(DISCS, SPRINGS, pad=Pad.measured(stiffness, common)),
                2.0, position=(x, 0.0), angle=0.5 * np.pi, name=name, count=count)
        for name, (stiffness, common, x, count) in given.items()
    ]  # fmt: skip
    pull = 0.5
    scene = Scene(_body(), contacts, 0.05, force=(pull, 0.0, 0.0), start="equilibrium")
    data = simulate(scene, bristles="all").data
    moved = pull / sum(each[0] * each[-1] for each in given.values())
    for name, (stiffness, common, *_) in given.items():
        one = data.sel(contact=name)
        np.testing.assert_allclose(one.fy, stiffness * moved, rtol=1e-9)
        face = data[f"bristles_{name}"].values[:, -3:]
        np.testing.assert_allclose(face[:, 1], -common * moved, rtol=1e-9)
    assert np.abs(data[["x", "y", "theta"]].to_array()).max() < 1e-12


def test_a_half_space_that_slips_at_its_rim_starts_as_after_a_slow_pull():
    model = FACES["half-space"]
    contact = Contact(model, 2.0, name="pad")
    still = np.zeros(3)
    pull = np.array([1.1, 0.4, 3e-3])
    scene = Scene(
        _body(), contact, 0.2, force=pull, start="equilibrium", save_every=0.01
    )
    start = simulate(scene, rtol=1e-7, atol=1e-8, bristles="all").data
    speeds, places = (
        np.abs(start[names].to_array()).max() for names in (["vx", "vy"], ["x", "y"])
    )
    assert speeds < 1e-9 and places < 1e-11
    slow = Scene(
        _body(), contact, 20.0, force=Signal([0.0, 20.0], [still, pull], "linear")
    )
    end = simulate(slow, rtol=1e-7, atol=1e-8, bristles="all").data
    assert np.hypot(end.x[-1], end.y[-1]) > 5e-5
    first, last = (each.bristles_pad.values[i] for each, i in ((start, 0), (end, -1)))
    bent = np.abs(last[:-3]).max()
    ratio = pf.tactile.slip_ratio(model, last, still, 2.0)
    assert (ratio > 0.99).sum() >= 5
    np.testing.assert_allclose(first[:-3], last[:-3], atol=0.04 * bent)
    np.testing.assert_allclose(first[-3:], last[-3:], rtol=0.01)


def test_what_knows_no_common_compliance_says_so():
    model = FACES["measured"]
    scene = Scene(_body(), Contact(model, 1.0), 0.01, force=(0.1, 0.0, 0.0))
    with refused("pad must have no common compliance for derivatives of scenes"):
        scene_sensitivities(scene, ["mu"])
    with refused("moments must be None for rates on a pad"):
        model.rate(model.rest(), np.zeros(3), 1.0, moments=(1e-3, 0.0))


@jit
def _solve(calls, contact, z, v, shift, r, dv, lin, stiffness, wrench, change):
    own = addresses_at(calls)
    z = doubles(z)
    lin = doubles(lin)
    call(own.linearise, (contact, z, doubles(v), doubles(change), doubles(wrench), lin))
    call(own.factor, (contact, z, shift, lin, doubles(stiffness)))
    call(own.eliminate, (contact, z, shift, doubles(r), lin, doubles(wrench)))
    call(own.back_substitute, (contact, z, doubles(r), doubles(dv), lin, doubles(change)))  # fmt: skip


@pytest.mark.parametrize("name", FACES)
def test_what_the_solver_eliminates_is_the_solution_of_its_equations(name):
    """`(s - df/dz) dz = r + df/dV dV` and `dW = dW/dz dz + dW/dV dV`, with derivatives by differences."""
    model = FACES[name]
    load = 2.0
    rng = np.random.default_rng(7)
    state = model.rest()
    for _ in range(20):
        state, _ = model.step(state, [0.01, 0.002, 0.3], load, 2e-4)
    packed = model.reduction.compiled.packed([load])
    n = packed.states
    z = np.ascontiguousarray(state.reshape(n))
    v = np.zeros(SEEN_SIZE)
    v[:4] = 0.013, -0.004, 0.2, load

    def rate(z, v):
        return np.concatenate(rates(packed, z[None], v[None]), axis=1)[0]

    of_state = differences(lambda each: rate(each, v), z, 1e-9)
    of_twist = differences(lambda each: rate(z, np.append(each, v[3:])), v[:3], 1e-5)
    shift = 1e4
    r = rng.normal(size=n) * packed.state_scale * shift
    dv = np.zeros(6)
    dv[:3] = rng.normal(size=3) * [0.01, 0.01, 1.0]
    stiffness, wrench, change, lin = (
        np.zeros(size) for size in (18, 3, n, packed.workspace)
    )
    given = (z, v), (r, dv, lin, stiffness, wrench, change)
    first, last = (list(map(place_of, each)) for each in given)
    calls = calls_of(packed.functions)
    _solve(place_of(calls), place_of(packed.records), *first, shift, *last)

    inverse = np.linalg.inv(shift * np.eye(n) - of_state[:n])
    of_r = of_state[n:] @ inverse
    np.testing.assert_allclose(wrench, of_r @ r, rtol=1e-4, atol=1e-6)
    wanted = of_r @ of_twist[:n] + of_twist[n:]
    close = 1e-4 * np.abs(wanted).max(axis=0)
    assert (abs(stiffness[:9].reshape(3, 3) - wanted) < close).all()
    wanted = inverse @ (r + of_twist[:n] @ dv[:3])
    assert (abs(change - wanted) < 1e-4 * packed.state_scale).all()
