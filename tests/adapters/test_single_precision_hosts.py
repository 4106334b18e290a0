"""Friction of boxes that moments tilt, in MJX and MuJoCo Warp in single precision: that of double precision."""

import numpy as np
import pytest

import planarfriction as pf

mujoco = pytest.importorskip("mujoco")

from planarfriction.adapters import mujoco as adapter  # noqa: E402
from planarfriction.adapters.mujoco import PatchContact, prepare  # noqa: E402

WEIGHT, HALF, COUNT, STEPS = 0.3 * 9.81, (0.05, 0.03), 40, 5

LIMIT = 1e-4
"""Largest error of wrenches in the weight."""

BOX = """<mujoco><option timestep="0.002" tolerance="1e-12" cone="pyramidal"/><worldbody>
<geom name="floor" type="plane" size="2 2 0.1"/><body pos="0 0 0.01999"><freejoint/><site name="box" pos="0 0 -0.02"/>
<inertial pos="0 0 0" mass="0.3" diaginertia="1e-4 3e-4 3e-4"/>
<geom name="box" type="box" size="0.05 0.03 0.02"/></body></worldbody></mujoco>"""


def scene():
    """Return a model of a box on nine feet, its patch, and start positions, velocities and applied forces of worlds.

    Torques lift a side in about half of the worlds.
    """
    x, y = (
        part.ravel()
        for part in np.meshgrid(
            np.linspace(-0.05, 0.05, 3), np.linspace(-0.03, 0.03, 3)
        )
    )
    law = pf.LuGre(mu_c=0.4, mu_s=0.5, sigma_2=0.0, elasto_plastic=0.9)
    feet = pf.DistributedModel(pf.ContactPatch.points(np.stack([x, y], -1)), law)
    patches = [PatchContact(feet, "box", ("floor", "box"))]
    spec = mujoco.MjSpec.from_string(BOX)
    m = prepare(spec, patches).compile()
    d = mujoco.MjData(m)
    friction = adapter.Friction(m, patches)
    for _ in range(300):
        friction.step(d)
    rng = np.random.default_rng(28)
    qvel = (
        rng.normal(size=(COUNT, 6))
        * (0.2, 0.2, 0.0, 0.0, 0.0, 5.0)
        * 10.0 ** rng.uniform(-4.0, 0.0, (COUNT, 1))
    )
    force = (
        rng.normal(size=(COUNT, 6)) * WEIGHT * (0.3, 0.3, 0.0, HALF[1], HALF[0], 0.01)
    )
    return (
        m,
        patches,
        *(np.float32(each) for each in (np.tile(d.qpos, (COUNT, 1)), qvel, force)),
    )


def in_double(m, patches, qpos, qvel, force):
    """Return wrenches after a few steps of MuJoCo `[worlds, 3]`."""
    found = []
    for each in zip(qpos, qvel, force, strict=True):
        d = mujoco.MjData(m)
        friction = adapter.Friction(m, patches)
        d.qpos[:], d.qvel[:], d.qfrc_applied[:] = each
        for _ in range(STEPS):
            friction.step(d)
        found.append(friction.wrenches(d)[0].copy())
    return np.array(found)


def in_mjx(precision, m, patches, qpos, qvel, force):
    """Return the same of MJX."""
    jax = pytest.importorskip("jax")
    mjx = pytest.importorskip("mujoco.mjx")
    from planarfriction.adapters.mjx import Friction

    with jax.enable_x64(precision == "float64"):
        friction = Friction(m, patches)
        mx = mjx.put_model(m)
        start = mjx.make_data(m)

        def run(qpos, qvel, force):
            d = start.replace(qpos=qpos, qvel=qvel, qfrc_applied=force)
            d = jax.lax.scan(
                lambda d, _: (friction.step(mx, d), None), d, None, length=STEPS
            )[0]
            return friction.wrenches(d)[0]

        return np.asarray(
            jax.jit(jax.vmap(run))(
                *(each.astype(precision) for each in (qpos, qvel, force))
            )
        )


def in_warp(m, patches, qpos, qvel, force):
    """Return the same of MuJoCo Warp."""
    pytest.importorskip("mujoco_warp")
    from planarfriction.adapters.mujoco_warp import Friction

    friction = Friction(m, patches, worlds=COUNT, njmax=40, nconmax=20)
    for name, each in (("qpos", qpos), ("qvel", qvel), ("qfrc_applied", force)):
        getattr(friction.data, name).assign(each)
    for _ in range(STEPS):
        friction.step()
    return friction.wrenches().numpy().astype(float)


def worst(found, wanted):
    """Return the largest error of a wrench in the weight, torques over half a width."""
    return float(abs((found - wanted) / (WEIGHT * np.array([1.0, 1.0, HALF[0]]))).max())


@pytest.mark.slow
@pytest.mark.mjx
def test_mjx_in_single_precision():
    given = scene()
    wanted = in_mjx("float64", *given)
    assert worst(wanted, in_double(*given)) < 1e-3  # that of the two solvers
    found = in_mjx("float32", *given)
    print(f"\nMJX: {worst(found, wanted):.1e} of the weight")
    assert found.dtype == np.float32 and worst(found, wanted) < LIMIT


@pytest.mark.slow
@pytest.mark.mujoco_warp
def test_mujoco_warp_in_single_precision():
    given = scene()
    off = worst(in_warp(*given), in_double(*given))
    print(f"\nMuJoCo Warp: {off:.1e} of the weight")
    assert off < LIMIT
