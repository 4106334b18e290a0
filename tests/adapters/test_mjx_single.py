"""Patch friction in MJX in single precision: where double precision goes, without creep."""

import numpy as np
import pytest

import planarfriction as pf

jax = pytest.importorskip("jax", reason="needs the extra [mjx]")
mjx = pytest.importorskip("mujoco.mjx", reason="needs the extra [mjx]")
import jax.numpy as jnp  # noqa: E402
import mujoco  # noqa: E402

from planarfriction.adapters import mujoco as adapter  # noqa: E402
from planarfriction.adapters.mjx import Friction, PatchContact, newton, prepare  # noqa: E402
from planarfriction.adapters.mjx.friction import ITERATIONS, TOLERANCE  # noqa: E402

pytestmark = pytest.mark.mjx

BOX = """<mujoco><option timestep="0.002" tolerance="1e-12"/><worldbody>
    <geom name="table" type="plane" size="2 2 0.1"/><body pos="0 0 0.02"><freejoint/>
    <site name="under" pos="0 0 -0.02"/>
    <inertial pos="0 0 -0.01" mass="0.3" diaginertia="1e-4 3e-4 3e-4"/>
    <geom name="box" type="box" size="0.05 0.03 0.02"/></body></worldbody></mujoco>"""


@pytest.fixture(autouse=True, scope="module")
def single_precision():
    before = jax.config.jax_enable_x64
    jax.config.update("jax_enable_x64", False)
    yield
    jax.config.update("jax_enable_x64", before)


def test_a_box_slides_and_rests_as_in_double_precision():
    """With stiff bristles, friction that falls with speed, and a pressure that follows its load."""
    law = pf.LuGre(mu_c=0.4, mu_s=0.5, elasto_plastic=0.9)
    face = pf.DistributedModel(pf.ContactPatch.rectangle(0.1, 0.06, cells=5), law)
    patches = [PatchContact(face, site="under", geoms=("table", "box"))]
    spec = mujoco.MjSpec.from_string(BOX)
    prepare(spec, patches)
    m = spec.compile()
    theirs = adapter.Friction(m, patches)
    d = mujoco.MjData(m)
    for _ in range(200):
        theirs.step(d)
    d.qvel[:] = 0.3, 0.2, 0.0, 0.0, 0.0, 6.0
    ours = Friction(m, patches)
    mx = mjx.put_model(m)

    def one(x, _):
        x = ours.step(mx, x)
        report = ours.report(x)
        return x, (
            x.qpos,
            x.qvel,
            ours.wrenches(x)[0],
            report.converged,
            report.iterations,
        )

    end, (qpos, qvel, wrench, converged, iterations) = jax.jit(
        lambda x: jax.lax.scan(one, x, None, length=300)
    )(mjx.put_data(m, d))
    assert qpos.dtype == jnp.float32 and end.userdata.dtype == jnp.float32
    path = []
    for _ in range(300):
        theirs.step(d)
        path.append([d.qpos.copy(), d.qvel.copy(), theirs.wrenches(d)[0].copy()])
    positions, speeds, wrenches = (np.array(each) for each in zip(*path, strict=True))
    # what single precision leaves of the response of the host; a simulator may miss by 1e-4 m/s at a decimetre
    np.testing.assert_allclose(qpos, positions, atol=1e-5)
    np.testing.assert_allclose(qvel[:, :3], speeds[:, :3], atol=1e-4)
    np.testing.assert_allclose(qvel[:, 3:], speeds[:, 3:], atol=1e-3)
    np.testing.assert_allclose(wrench[5:], wrenches[5:], atol=1e-3)
    assert np.mean(converged) > 0.99 and np.mean(iterations) < 4.0
    creep = abs(qpos[-1] - qpos[-101])[:2].max() / 0.2
    assert creep < 2e-8  # m/s


@pytest.mark.parametrize("steep", [1.0, 30.0, 1000.0])
def test_steep_friction_is_solved_to_its_rounding(steep):
    """Bristles that a step stretches by `steep` times what the host gives in turn make that much of the last digit."""
    random = np.random.default_rng(3)
    twists = jnp.array(random.normal(size=(50, 3)) * 0.01, dtype=jnp.float32)

    def solved(twist):
        host = newton.HostResponse(
            twist, jnp.ones(1), 0.02 * jnp.eye(3), jnp.zeros((1, 3))
        )
        stiff = newton.UnitLoadFriction(lambda v, load: -50.0 * steep * v, False)
        return newton.solve(
            stiff, host, jnp.zeros(3), jnp.full(1, 0.02), TOLERANCE, ITERATIONS
        )

    found = jax.jit(jax.vmap(solved))(twists)
    assert found.converged.all() and found.iterations.max() <= 2
    right = -50.0 * steep / (1.0 + steep) * np.asarray(twists)
    np.testing.assert_allclose(found.wrench, right, rtol=1e-6 * (1.0 + steep))
