"""Laws that are functions of their own: closed forms, order, passivity, derivatives, scenes, files, refusals."""

from __future__ import annotations

import dataclasses
import importlib.util
import pickle
from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import planarfriction as pf
from planarfriction._engine.cells.rate_law import fingerprint
from planarfriction.derivatives import scene_gradient, scene_sensitivities
from planarfriction.laws.rate_law import norm, plus
from planarfriction.patch import friction_metric
from planarfriction.scenes import SolverOptions
from tests.support.differences import assert_step_jacobians, scene_slopes
from tests.support.rate_laws import BoucWen, Gum, Written
from tests.support.refusals import refused

DISC = pf.ContactPatch.disc(0.01, cells=7)
POINT = pf.ContactPatch.points([(0.0, 0.0)])


LUGRE = pf.LuGre(mu_c=0.8, mu_s=1.0, v_s=1e-3, sigma_0=1e5, sigma_1=100.0, sigma_2=0.2)


def bristles(law, rng, model) -> np.ndarray:
    """Bristles within their largest deflection."""
    angle = rng.uniform(0.0, 2.0 * np.pi, model.state_shape[1:])
    size = law.largest_deflection
    return (
        size
        * rng.uniform(0.0, 1.0, angle.shape)
        * np.array([np.cos(angle), np.sin(angle)])
    )


def directional() -> pf.ContactPatch:
    """A disc that holds better across than along."""
    return DISC.with_friction_metric(friction_metric(0.3, along=1.0, across=0.7))


# ---------------------------------------------------------------------- closed forms


def test_along_a_line_it_is_dahl():
    """With beta = 1 and n = 1 a bristle follows `z_max (1 - exp(-x/z_max))`."""
    law = BoucWen(beta=1.0, n=1.0)
    model = pf.DistributedModel(POINT, law)
    dt = 1e-5
    x = 0.0
    state = model.rest()
    for _ in range(200):
        state, wrench = model.step(state, (2e-3, 0.0, 0.0), 3.0, dt)
        x += 2e-3 * dt
    assert -wrench[0] == pytest.approx(
        3.0 * 0.4 * -np.expm1(-x / law.largest_deflection), rel=1e-5
    )


def test_steady_friction_and_rest():
    assert BoucWen().steady_friction([0.0, 1e-3, 2.0]) == pytest.approx(
        [0.4, 0.4, 0.4], rel=1e-9
    )
    speed = np.array([1e-4, 1e-3, 0.1])
    assert Written().steady_friction(speed) == pytest.approx(
        LUGRE.steady_friction(speed), rel=1e-9
    )
    assert (
        BoucWen().holds_at_rest and Written().holds_at_rest and not Gum().holds_at_rest
    )


@pytest.mark.parametrize(
    "patch", [DISC, directional()], ids=["isotropic", "directional"]
)
def test_lugre_written_down_is_lugre(patch):
    own = pf.DistributedModel(patch, Written())
    known = pf.DistributedModel(patch, LUGRE)
    rng = np.random.default_rng(1)
    state = bristles(LUGRE, rng, known)
    twist = np.array([2e-3, -1e-3, 0.3])
    assert own.rate(state, twist, 2.0) == pytest.approx(
        known.rate(state, twist, 2.0), rel=1e-12
    )
    assert own.wrench(state, twist, 2.0) == pytest.approx(
        known.wrench(state, twist, 2.0), rel=1e-12
    )
    for mine, theirs in zip(
        own.jacobians(state, twist, 2.0),
        known.jacobians(state, twist, 2.0),
        strict=True,
    ):
        assert mine == pytest.approx(
            theirs, rel=1e-10, abs=1e-10 * np.abs(theirs).max()
        )
    assert Written().rate(3e-6, [-1e-3, 2e-3]) == pytest.approx(
        LUGRE.rate(3e-6, [-1e-3, 2e-3]), rel=1e-13
    )
    two = [[1e-6, 2e-6]], [[2e-3, 1e-3]]
    assert Written().force(*two, 2.0, axis=-1) == pytest.approx(
        LUGRE.force(*two, 2.0, axis=-1), rel=1e-13
    )


# ---------------------------------------------------------------------- steps


@pytest.mark.parametrize("law", [BoucWen(), Written()], ids=["bouc-wen", "lugre"])
def test_steps_are_of_order_two(law):
    model = pf.DistributedModel(DISC, law)
    rng = np.random.default_rng(0)
    time = 4e-4
    start = 0.5 * bristles(law, rng, model)

    def end(steps: int) -> np.ndarray:
        state = start
        for _ in range(steps):
            state, _ = model.step(state, (4e-3, 3e-3, 0.4), 1.0, time / steps)
        return state

    exact = end(2048)
    errors = [np.abs(end(steps) - exact).max() for steps in (16, 64)]
    assert np.log2(errors[0] / errors[1]) / 2.0 > 1.8
    assert errors[1] < 1e-3 * law.largest_deflection


@given(
    st.floats(0.0, 1.0), st.floats(0.0, 6.3), st.floats(-3.0, 6.0), st.floats(-5.0, 1.0),
    st.sampled_from([(0.5, 1.0), (0.7, 1.5), (1.0, 4.0)]),
)  # fmt: skip
@settings(deadline=None, max_examples=200)
def test_no_step_stores_more_than_the_work_done(size, angle, distance, speed, shape):
    """`sigma_0 |z|^2/2` grows by less than the work of the motion, for steps of any length; bristles stay in bounds."""
    law = BoucWen(beta=shape[0], n=shape[1])
    model = pf.DistributedModel(POINT, law)
    largest = law.largest_deflection
    before = size * largest * np.array([[np.cos(angle)], [np.sin(angle)]])
    velocity = 10.0**speed
    dt = 10.0**distance * largest / velocity
    after, wrench = model.step(before, (velocity, 0.0, 0.0), 1.0, dt)
    stored = 0.5 * law.sigma_0 * ((after**2).sum() - (before**2).sum())
    assert stored <= -wrench[0] * velocity * dt + 1e-12 * law.sigma_0 * largest**2
    assert np.hypot(*after) <= largest * (1.0 + 1e-12)


def test_what_is_stiff_is_damped_in_one_step():
    """Bristles that flow within 1 us are at `z = v T` after 1 ms; of where they were 4.8/1000 is left."""
    state, _ = pf.DistributedModel(POINT, Gum(time=1e-6)).step(
        [[5e-7], [0.0]], (0.1, 0.0, 0.0), 1.0, 1e-3
    )
    assert state[0] == pytest.approx(0.1 * 1e-6, abs=0.005 * 5e-7)


def test_without_load_bristles_are_forgotten():
    model = pf.DistributedModel(DISC, BoucWen())
    state, wrench = model.step(1e-6 + model.rest(), (0.01, 0.0, 0.0), [0.0, 1.0], 1e-3)
    assert not state[0].any() and not wrench[0].any() and state[1].any()


# ---------------------------------------------------------------------- derivatives


@pytest.mark.parametrize(
    "patch", [DISC, directional()], ids=["isotropic", "directional"]
)
def test_derivatives_of_steps_are_differences(patch):
    law = BoucWen()
    model = pf.DistributedModel(patch, law)
    state = bristles(law, np.random.default_rng(2), model)
    twist = np.array([6e-3, -4e-3, 0.5])
    by_twist = np.full(3, 1e-7)
    assert_step_jacobians(model, state, twist, 2.0, 1e-4, 1e-12, by_twist, 1e-5)


@pytest.mark.parametrize(
    ("patch", "law"),
    [(DISC, Written()), (directional(), BoucWen())],
    ids=["viscous", "yielding"],
)
def test_derivatives_of_scenes_are_differences_and_each_other_s_transpose(patch, law):
    model = pf.DistributedModel(patch, law)
    load = pf.Signal([0.0, 0.02], [3.0, 2.0], "linear")
    contact = pf.Contact(model, load, mounted_on="body", name="own")
    force = pf.Signal([0.0, 0.02], [[0.2, 0.0, 1e-3], [0.0, 0.1, -1e-3]], "linear")
    body = pf.Body(0.3, 3e-5, velocity=(0.1, 0.02, 5.0), gravity=(0.0, 0.0))
    scene = pf.Scene(body, [contact], 0.02, force=force)  # it slides throughout
    last = np.eye(6)[0] + np.eye(6)[2]
    numbers = {"signals": {"own.normal_force": [0.0, 0.02]}, "initial": ["vx", "omega"]}
    numbers["options"] = SolverOptions(rtol=1e-8, atol=1e-8)

    def cotangent(time: np.ndarray, motion: np.ndarray) -> np.ndarray:
        return np.where(time[:, None] == time[-1], last, 0.0)

    forwards = scene_sensitivities(scene, ("mass", "r"), **numbers)
    found = scene_gradient(scene, cotangent, ("mass", "r"), **numbers).gradient
    assert found == pytest.approx(forwards.d_motion[-1].T @ last, rel=1e-5)

    def heavier(mass: float) -> pf.Scene:
        return dataclasses.replace(scene, body=dataclasses.replace(body, mass=mass))

    mass = forwards.names.index("mass")
    found = 0.3 * scene_slopes(heavier, 0.3, 3e-5)[0][-1, :3]
    largest = np.abs(found).max()
    assert forwards.d_motion[-1, :3, mass] == pytest.approx(found, abs=1e-4 * largest)


# ---------------------------------------------------------------------- scenes, files


def test_a_scene_with_it_is_read_back_from_its_file(tmp_path):
    pf.laws.register("bouc-wen", BoucWen, "bristles that yield gradually")
    scene = pf.scenes.in_hand(pf.DistributedModel(DISC, BoucWen(beta=0.6)), t_end=0.02)
    scene.to_file(tmp_path / "scene.toml")
    again = pf.Scene.from_file(tmp_path / "scene.toml")
    assert again.contacts[0].model.law == BoucWen(beta=0.6)
    assert pf.simulate(again).data.equals(pf.simulate(scene).data)


def test_a_contact_sticks_where_bristles_keep_their_deflection():
    """A block on a slope of 0.3 holds with mu = 0.4; bristles of gum cannot."""
    for law, moves in ((BoucWen(), False), (BoucWen(mu=0.25), True)):
        contact = pf.Contact(pf.DistributedModel(DISC, law), 10.0, mounted_on="body")
        scene = pf.Scene(pf.Body(1.0, 1e-3, gravity=(3.0, 0.0)), [contact], 0.2)
        assert (abs(float(pf.simulate(scene).data.x[-1])) > 1e-3) is moves
    contact = pf.Contact(pf.DistributedModel(DISC, BoucWen()), 10.0, mounted_on="body")
    scene = pf.Scene(
        pf.Body(1.0, 1e-3, gravity=(3.0, 0.0)), [contact], 0.2, start="equilibrium"
    )
    assert abs(float(pf.simulate(scene).data.x[-1])) < 1e-12
    contact = dataclasses.replace(contact, model=pf.DistributedModel(DISC, Gum()))
    with refused("start must be 'rest' or 'sliding' with a law that creeps"):
        pf.simulate(dataclasses.replace(scene, contacts=[contact]))


def test_a_law_that_was_used_goes_to_another_process():
    law = BoucWen()
    rate = law.rate(1e-6, 0.1)
    steady = law.steady_friction(0.1)
    # No address of this process.
    assert not any(isinstance(each, np.ndarray) for each in vars(law).values())
    again = pickle.loads(pickle.dumps(law))
    assert again == law
    assert again.rate(1e-6, 0.1) == rate
    assert again.steady_friction(0.1) == steady


# ---------------------------------------------------------------------- refusals


def test_what_needs_the_bristles_of_lugre_refuses_it_in_one_line():
    rule = "^law must have the bristles of LuGre for ReducedModelPublished, not a separate rate, got BoucWen$"
    with refused(rule):
        pf.ReducedModelPublished(DISC, BoucWen())
    with refused("for patches with an asymmetry"):
        pf.DistributedModel(
            DISC.with_friction_metric(np.eye(2), asymmetry=(0.2, 0.1)), BoucWen()
        )
    scene = pf.scenes.in_hand(pf.DistributedModel(DISC, BoucWen()), t_end=0.1)
    with refused("for derivatives by mu"):
        scene_sensitivities(scene, ("mu",))


@pytest.mark.torch
def test_tensors_refuse_it():
    torch = pytest.importorskip("planarfriction.torch")
    with refused(r"for .*not a separate rate"):
        torch.DistributedModel(DISC, BoucWen())


def test_wrong_laws_are_refused_in_one_line():
    @dataclass(frozen=True)
    class Branches(BoucWen):
        @staticmethod
        def bristle_rate(xp, law, z, v):
            if norm(z) > law.largest_deflection:
                return v
            return plus(v, -1.0, z)

    @dataclass(frozen=True)
    class Bursts(BoucWen):
        @staticmethod
        def bristle_rate(xp, law, z, v):
            return plus(v, xp.exp(700.0) * xp.exp(700.0), z)

    @dataclass(frozen=True)
    class Misspelt(BoucWen):
        @staticmethod
        def bristle_rate(xp, law, z, v):
            return plus(v, -law.largest, z)

    @dataclass(frozen=True)
    class Joined(BoucWen):
        @staticmethod
        def bristle_rate(xp, law, z, v):
            pair = v[0], v[1]
            return pair + pair

    for wrong, words in [
        (
            Branches,
            r"bristle_rate, line \d+: `if norm\(z\) > law.largest_deflection:` asks which way .* `xp.where`",
        ),
        (Misspelt, "no attribute 'largest'"),
        (Joined, r"too many values to unpack \(expected 2\)"),
    ]:
        with refused(rf"^law must be a formula \(.*{words}.*\), got {wrong.__name__}$"):
            wrong()
    with refused("mu must be a number"):
        BoucWen(mu=True)
    with refused("largest_deflection must be"):
        BoucWen(mu=-1.0)
    model = pf.DistributedModel(POINT, Bursts())
    with refused("law must give finite rates"):
        model.step(1e-6 + model.rest(), (0.1, 0.0, 0.0), 1.0, 1e-3)


def test_machine_code_goes_by_all_that_a_law_uses(tmp_path):
    """Functions that a law calls, and the numbers that they name, are in the name of its machine code."""
    text = "from planarfriction.laws.rate_law import plus\nK = {k}\ndef more(x):\n    return {f} * x\n"
    text += "def rate(xp, law, z, v):\n    return plus(v, -more(K), z)\n"
    prints = set()
    for i, (k, f) in enumerate([(1.0, 2.0), (1.0, 3.0), (2.0, 2.0)]):
        path = tmp_path / f"own{i}.py"
        path.write_text(text.format(k=k, f=f))
        spec = importlib.util.spec_from_file_location("own", path)
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        prints |= {
            fingerprint(["a", "b"], module.rate),
            fingerprint(["a", "b"], module.rate),
        }
    assert len(prints) == 3
    assert fingerprint(["b", "a"], module.rate) not in prints


def test_machine_code_knows_numbers_of_one_name_apart(tmp_path):
    """A number of the rate and one of the same name in another module, which a function that it calls reads."""
    prints = set()
    for i, (inner, outer) in enumerate(
        [(1.0, 2.0), (2.0, 2.0), (1.0, 3.0), (2.0, 1.0)]
    ):
        texts = {
            "inner": f"K = {inner}\ndef more(x):\n    return K * x\n",
            "outer": f"K = {outer}\nmore = None\ndef rate(xp, law, z, v):\n    return v - K * more(z)\n",
        }
        modules = {}
        for name, text in texts.items():
            path = tmp_path / f"{name}{i}.py"
            path.write_text(text)
            spec = importlib.util.spec_from_file_location(name, path)
            modules[name] = importlib.util.module_from_spec(spec)
            spec.loader.exec_module(modules[name])
        modules["outer"].more = modules["inner"].more
        prints.add(fingerprint(["a"], modules["outer"].rate))
    assert len(prints) == 4
