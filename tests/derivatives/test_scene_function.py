"""The motion of a scene as one differentiable operation of PyTorch and JAX."""

import dataclasses

import numpy as np
import pytest

import planarfriction as pf
from planarfriction.derivatives import scene_sensitivities
from planarfriction.derivatives.scene_function import SceneFunction
from planarfriction.errors import FrictionError
from planarfriction.scenes import SolverOptions
from tests.derivatives.test_scene import model_of
from tests.support.refusals import refused

KNOTS = [0.0, 0.03, 0.06]
LOAD = np.array([1.0, 1.2, 0.9])
FORCE = np.array([[0.2, 0.0, 0.0], [0.0, 0.3, 2.0], [0.1, -0.1, 1.0]])
SCALE = np.array([1.0, 1.0, 1e-3])
"""Torques that mean as much as the forces, so that one step of differences fits both."""


def scene(stop=None):
    """A plate that slides and turns; with `stop` it comes to rest before the end."""
    body = pf.Body(0.4, 6e-4, velocity=(0.08, 0.03, 1.5), gravity=(0.0, 0.0))
    contacts = [
        pf.Contact(
            model_of("ellipsoid"),
            1.5,
            position=(3e-3, 0.0),
            mounted_on="body",
            name="own",
        ),
        pf.Contact(
            model_of("ellipsoid"), pf.Signal(KNOTS, LOAD, "linear"), name="fixed"
        ),
    ]
    end = 0.06 if stop is None else 0.4
    return pf.Scene(
        body, contacts, end, save_every=0.02 if stop is None else 0.1, stop_speed=stop
    )


SIGNALS = {"fixed.normal_force": KNOTS, "force": KNOTS}
NAMES = ("mu", "mass"), SIGNALS, ("vx", "theta")
VALUES = np.concatenate([[1.0, 1.0, 0.08, 0.0], LOAD, (FORCE * SCALE).ravel()])


def test_its_values_stand_in_the_scene():
    """Factors, start, knots; batches of one thread each give what one at a time gives."""
    function = SceneFunction(scene(), *NAMES)
    more = VALUES.copy()
    more[[0, 1, 2]] = 1.3, 0.7, 0.1
    own = scene()
    law = dataclasses.replace(own.contacts[0].model.law, mu_c=0.39, mu_s=0.52)
    changed = dataclasses.replace(
        own,
        body=dataclasses.replace(own.body, mass=0.28, velocity=(0.1, 0.03, 1.5)),
        contacts=[
            dataclasses.replace(c, model=dataclasses.replace(c.model, law=law))
            for c in own.contacts
        ],
        force=pf.Signal(KNOTS, FORCE * SCALE, "linear"),
    )
    motion, wrenches = function.run(np.stack([VALUES, more]))
    expected = scene_sensitivities(changed, (), signals=SIGNALS)
    assert motion[1] == pytest.approx(expected.motion, abs=1e-12)
    assert wrenches[1] == pytest.approx(expected.wrenches, abs=1e-9)
    alone = function.run(VALUES[None])
    np.testing.assert_array_equal(motion[0], alone[0][0])


def test_forwards_and_backwards_are_each_other_s_transpose():
    """Right to a few 1e-6 each, factors away from 1 among them."""
    function = SceneFunction(scene(), *NAMES)
    rng = np.random.default_rng(0)
    values = np.stack([VALUES, VALUES])
    values[1, :2] = 1.2, 0.8
    changes = rng.normal(size=values.shape) * np.maximum(np.abs(values), 1e-3)
    bars = tuple(rng.normal(size=(2, *shape)) for shape in function.results)
    kept = {}
    motion, _ = function.run(values, kept)
    bars = bars[0] / np.abs(motion).max(axis=1, keepdims=True), bars[1]
    for known in (kept, None):
        slopes = function.pull(values, *bars, known)
        pushed = function.push(values, changes)
        forwards = sum(
            (bar * dot).reshape(2, -1).sum(axis=1)
            for bar, dot in zip(bars, pushed, strict=True)
        )
        assert (slopes * changes).sum(axis=1) == pytest.approx(forwards, rel=1e-5)


def test_a_motion_that_ends_early_stays():
    function = SceneFunction(scene(stop=1e-3), (), {}, ("vx",))
    motion, _ = function.run(np.array([[0.08], [0.01]]))
    assert motion.shape == (2, 5, 6)
    assert (motion[0, -1] == motion[0, -2]).all()
    bar = np.zeros((2, *function.results[0]))
    bar[:, -1, 3] = 1.0
    wrenches = np.zeros((2, *function.results[1]))
    late = function.pull(np.array([[0.08], [0.01]]), bar, wrenches)
    assert (late > 0.0).all()  # a faster start goes further


def test_wrong_numbers_are_named():
    with refused("parameters must be one of mu, mass, inertia, load"):
        SceneFunction(scene(), ("r",))
    law = pf.CoulombStribeck(mu_c=0.3)
    own = dataclasses.replace(
        scene(),
        contacts=[
            pf.Contact(pf.DistributedModel(pf.ContactPatch.disc(0.01), law), 1.0)
        ],
    )
    with refused(
        "must not contain mu: CoulombStribeck has other friction coefficients too"
    ):
        SceneFunction(own, ("mu",)).run(np.array([[1.1]]))


# ---------------------------------------------------------------------- PyTorch


def test_pytorch_agrees_with_differences():
    torch = pytest.importorskip("torch")
    from planarfriction.torch import simulate_scene

    scale = torch.from_numpy(SCALE)

    def motion(mu, load, force, vx):
        signals = {"fixed.normal_force": (KNOTS, load), "force": (KNOTS, force * scale)}
        found = simulate_scene(
            scene(), {"mu": mu}, signals=signals, initial={"vx": vx}, save_every=0.06
        )
        return found.motion[..., -1, :], found.wrenches[..., -1, :, :2]

    inputs = ([1.0, 1.1], LOAD, FORCE, 0.08)
    tensors = [
        torch.tensor(value, dtype=torch.float64, requires_grad=True) for value in inputs
    ]
    assert motion(*tensors)[0].shape == (2, 6)
    # the step of the differences is a thousandth, whose square is what they are off by
    options = {
        "eps": 1e-4,
        "atol": 1e-5,
        "rtol": 1e-4,
        "check_batched_grad": False,
        "fast_mode": True,
    }
    assert torch.autograd.gradcheck(motion, tensors, check_forward_ad=True, **options)


def test_pytorch_maps_and_goes_forwards():
    torch = pytest.importorskip("torch")
    from planarfriction.torch import simulate_scene

    def end(vx):
        return simulate_scene(scene(), initial={"vx": vx}, save_every=0.06).motion[-1]

    one = torch.tensor(0.08, dtype=torch.float64)
    two = torch.tensor([0.08, 0.1], dtype=torch.float64)
    backwards = torch.func.jacrev(end)(one)
    forwards = torch.func.jacfwd(end)(one)
    assert backwards.numpy() == pytest.approx(forwards.numpy(), rel=1e-5, abs=1e-7)
    mapped = torch.func.vmap(torch.func.grad(lambda v: end(v).sum()))(two)
    assert mapped[0].item() == pytest.approx(forwards.sum().item(), rel=1e-5)
    with refused("first derivatives", FrictionError):
        torch.func.grad(torch.func.grad(lambda v: end(v).sum()))(one)


def test_pytorch_names_wrong_numbers():
    torch = pytest.importorskip("torch")
    from planarfriction.torch import simulate_scene

    with refused("mu must be > 0, got -1"):
        simulate_scene(scene(), {"mu": torch.tensor(-1.0)})
    with refused(r"values of force must have shape \[..., 3, 3\], got shape \[3\]"):
        simulate_scene(scene(), signals={"force": (KNOTS, torch.ones(3))})
    with refused("signals of force must be a pair of times and values"):
        simulate_scene(scene(), signals={"force": torch.ones(3)})
    with refused("the numbers of a scene must have axes that broadcast"):
        simulate_scene(scene(), {"mu": torch.ones(2), "mass": torch.ones(3)})


# ---------------------------------------------------------------------- JAX


def test_jax_agrees_with_the_derivatives_forwards():
    jax = pytest.importorskip("jax")
    import jax.numpy as jnp

    from planarfriction.jax import simulate_scene

    with jax.enable_x64(True):

        def motion(mu, load, vx):
            signals = {"fixed.normal_force": (KNOTS, load)}
            found = simulate_scene(
                scene(),
                {"mu": mu},
                signals=signals,
                initial={"vx": vx},
                save_every=0.06,
            )
            return found.motion[..., -1, :]

        at = jnp.array(1.0), jnp.array(LOAD), jnp.array(0.08)
        expected = scene_sensitivities(
            scene(),
            ("mu",),
            signals={"fixed.normal_force": KNOTS},
            initial=("vx",),
            options=SolverOptions(save_every=0.06),
        ).d_motion[-1]
        for transform in (jax.jacrev, jax.jacfwd, lambda *f: jax.jit(jax.jacrev(*f))):
            by_mu, by_load, by_vx = transform(motion, (0, 1, 2))(*at)
            found = np.concatenate([by_mu[:, None], by_vx[:, None], by_load], axis=1)
            assert found == pytest.approx(
                expected, rel=1e-5, abs=1e-6 * np.abs(expected).max()
            )
        mapped = jax.vmap(jax.grad(lambda v: motion(at[0], at[1], v).sum()))(
            jnp.array([0.08, 0.1])
        )
        assert mapped[0] == pytest.approx(expected[:, 1].sum(), rel=1e-5)
        with refused("first derivatives only", FrictionError):
            jax.grad(jax.grad(lambda v: motion(at[0], at[1], v).sum()))(0.08)
        with refused("mu must be > 0"):
            motion(-1.0, at[1], at[2])
        for number in (0.0, -1.0):
            with refused("mu must be > 0"):
                jax.grad(lambda mu: motion(mu, at[1], at[2])[0])(number)
