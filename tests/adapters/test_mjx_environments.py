"""Friction that differs between environments in MJX: arrays under `vmap`, with derivatives."""

import numpy as np
import pytest

import planarfriction as pf
from tests.support.refusals import refused

jax = pytest.importorskip("jax", reason="needs the extra [mjx]")
mjx = pytest.importorskip("mujoco.mjx", reason="needs the extra [mjx]")
import jax.numpy as jnp  # noqa: E402
import mujoco  # noqa: E402

from planarfriction.adapters import mujoco as adapter  # noqa: E402
from planarfriction.adapters.mjx import Friction, PatchContact, prepare  # noqa: E402

pytestmark = pytest.mark.mjx

LAW = pf.LuGre(
    mu_c=0.3, mu_s=0.4, v_s=0.01, sigma_0=1e5, sigma_1=10.0, elasto_plastic=0.9
)

BALLS = """<mujoco><option timestep="0.002"/><worldbody><geom name="floor" type="plane" size="9 9 .1"/>
    <body pos="0 0 0.00998"><joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 1 0"/>
    <joint type="slide" axis="0 0 1"/><joint type="hinge" axis="0 0 1"/><inertial pos="0 0 0" mass="0.4"
    diaginertia="1e-4 1e-4 1e-4"/>
    <geom name="one" type="sphere" size="0.01" pos="-0.02 0 0"/><site name="one" pos="-0.02 0 -0.01"/>
    <geom name="two" type="sphere" size="0.01" pos="0.02 0 0"/><site name="two" pos="0.02 0 -0.01"/></body>
    </worldbody></mujoco>"""
"""Slides and spins on two patches of the same model."""

DRAWN = {
    "mu_c": [0.2, 0.35, 0.3],
    "mu_s": [0.25, 0.4, 0.6],
    "v_s": [1e-2, 2e-2, 1e-3],
    "scale": [0.7, 1.0, 1.4],
}
DRAWN |= {
    "centre_x": [0.0, 0.002, -0.003],
    "centre_y": [0.001, 0.0, 0.004],
    "sigma_1": [10.0, 0.0, 50.0],
}


@pytest.fixture(autouse=True, scope="module")
def double_precision():
    before = jax.config.jax_enable_x64
    jax.config.update("jax_enable_x64", True)
    yield
    jax.config.update("jax_enable_x64", before)


@pytest.fixture(scope="module")
def made():
    face = pf.DistributedModel(pf.ContactPatch.disc(radius=0.01, cells=5), LAW)
    patches = [PatchContact(face, name, ("floor", name)) for name in ("one", "two")]
    spec = mujoco.MjSpec.from_string(BALLS)
    prepare(spec, patches)
    m = spec.compile()
    d = mujoco.MjData(m)
    d.qvel[:] = 0.2, 0.0, 0.0, 8.0
    return m, d, adapter.Friction(m, patches), Friction(m, patches)


@pytest.mark.slow
def test_environments_with_friction_of_their_own_step_as_copies_in_mujoco(made):
    m, d, theirs, ours = made
    mx = mjx.put_model(m)
    steps = 40

    def rolled(parameters):
        friction = ours.with_parameters(parameters)
        return jax.lax.scan(
            lambda d, _: (friction.step(mx, d), None),
            mjx.put_data(m, d),
            None,
            length=steps,
        )[0]

    ends = jax.jit(jax.vmap(rolled))(
        {name: jnp.array(values) for name, values in DRAWN.items()}
    )
    for e, model in enumerate(theirs.copies(DRAWN)):
        alone = mujoco.MjData(model)
        alone.qvel[:] = d.qvel
        for _ in range(steps):
            theirs.step(alone)
        # both solve to 1e-9 m/s a step
        np.testing.assert_allclose(ends.qpos[e], alone.qpos, atol=2e-9)
        np.testing.assert_allclose(
            ours.wrenches(ends)[e], theirs.wrenches(alone), atol=1e-6
        )
        np.testing.assert_allclose(
            ours.twists(ends)[e], theirs.twists(alone), atol=1e-7
        )
    assert np.ptp(ends.qpos[:, 0]) > 1e-3


@pytest.mark.slow
def test_derivatives_by_the_parameters_of_one_patch_are_differences(made):
    m, d, _, ours = made
    mx = mjx.put_model(m)
    base = {"mu_c": 0.3, "scale": 1.2, "centre_y": 0.001}

    def slid(values):
        own = {
            name: jnp.stack([value, jnp.asarray(base[name])])
            for name, value in zip(base, values, strict=True)
        }
        friction = ours.with_parameters(own)
        last = friction.step(mx, friction.step(mx, mjx.put_data(m, d)))
        return last.qvel @ jnp.array([1.0, 1.0, 0.0, 0.02])

    at = np.array([0.25, 1.1, 0.002])
    found = jax.jit(
        jax.vmap(lambda values, along: jax.jvp(slid, (values,), (along,)), (0, 0))
    )
    _, slopes = found(np.tile(at, (3, 1)), np.eye(3))
    steps = 1e-5 * np.diag(at)
    more, less = (found(at + sign * steps, np.eye(3))[0] for sign in (1.0, -1.0))
    differences = (more - less) / (2.0 * steps.sum(axis=1))
    assert abs(slopes).min() > 1e-4
    # 1e-9 m/s of the step in contact space over 1e-5 of the numbers
    np.testing.assert_allclose(slopes, differences, rtol=1e-3, atol=2e-4)


def test_numbers_of_the_model_of_mujoco_count(made):
    _, _, theirs, ours = made
    assert ours.parameters == {}
    (other,) = theirs.copies({"mu_s": [[0.5, 0.6]]})
    friction = Friction(other, theirs.patches)
    assert list(friction.parameters) == ["mu_s"]
    np.testing.assert_array_equal(friction.parameters["mu_s"], [0.5, 0.6])
    again = friction.replace(friction.models)
    np.testing.assert_array_equal(again.parameters["mu_s"], [0.5, 0.6])


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"mu": 0.3}, "parameters key must be one of"),
        (
            {"mu_c": np.ones(3)},
            r"mu_c must be a number or have shape \[2\]: see jax.vmap, got \[3\]",
        ),
        ({"mu_c": 0.5}, "mu_s must be >= mu_c, got mu_s=0.4, mu_c=0.5"),
        ({"scale": [1.0, -1.0]}, "scale must be > 0, got -1.0"),
    ],
)
def test_parameters_that_do_not_fit_are_refused(made, parameters, message):
    with refused(message):
        made[3].with_parameters(parameters)
