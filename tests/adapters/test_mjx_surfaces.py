"""Surfaces that move and bodies that roll inside MJX and MuJoCo Warp."""

import math

import numpy as np
import pytest

import planarfriction as pf

mujoco = pytest.importorskip("mujoco")

from planarfriction.adapters.mujoco import PatchContact, prepare  # noqa: E402

G, DT, ANGLE = 9.81, 2e-3, math.radians(10.0)
BELT = """<geom name="floor" type="plane" size="5 5 1" surfacevel="0.5 0 0 0 0 0"/><body pos="0 0 0.02"><freejoint/>
<geom name="box" type="box" size="0.02 0.02 0.02" mass="0.2"/><site name="sole" pos="0 0 -0.02"/></body>"""
BALL = """<geom name="floor" type="plane" size="50 5 1"/><body pos="0 0 0.04999"><freejoint/>
<geom name="ball" type="sphere" size="0.05" mass="0.1"/><site name="ball"/></body>"""
SOLE = pf.ReducedModel(
    pf.ContactPatch.rectangle(0.04), pf.LuGre(mu_c=0.4, sigma_2=0.0, elasto_plastic=0.9)
)
SOFT = pf.LuGre(mu_c=0.5, sigma_0=1e3, sigma_1=60.0, sigma_2=0.0, elasto_plastic=0.9)
ON_BELT = [PatchContact(SOLE, "sole", ("box", "floor"))]
ROLLING = [
    PatchContact(
        pf.ReducedModel(pf.ContactPatch.disc(0.003, cells=5), SOFT),
        "ball",
        ("ball", "floor"),
    )
]


def model(text, patches, angle=0.0):
    spec = mujoco.MjSpec.from_string(
        f'<mujoco><option cone="pyramidal"/><worldbody>{text}</worldbody></mujoco>'
    )
    spec.option.gravity = G * math.sin(angle), 0.0, -G * math.cos(angle)
    return prepare(spec, patches).compile()


def in_mjx(m, patches, steps):
    """Return speeds along x."""
    jax = pytest.importorskip("jax")
    mjx = pytest.importorskip("mujoco.mjx")
    from planarfriction.adapters.mjx import Friction

    with jax.enable_x64(True):
        friction = Friction(m, patches)
        data = mjx.put_data(m, mujoco.MjData(m))
        theirs = mjx.put_model(m)
        step = jax.jit(lambda d: friction.step(theirs, d))
        speeds = []
        for _ in range(steps):
            data = step(data)
            speeds.append(float(data.qvel[0]))
    return np.array(speeds)


def in_warp(m, patches, steps):
    pytest.importorskip("mujoco_warp")
    from planarfriction.adapters.mujoco_warp import Friction

    friction = Friction(m, patches, njmax=20, nconmax=10)
    speeds = []
    for _ in range(steps):
        friction.step()
        speeds.append(float(friction.data.qvel.numpy()[0, 0]))
    return np.array(speeds)


HOSTS = [
    pytest.param(in_mjx, marks=pytest.mark.mjx, id="mjx"),
    pytest.param(in_warp, marks=pytest.mark.mujoco_warp, id="warp"),
]


@pytest.mark.slow
@pytest.mark.parametrize("host", HOSTS)
def test_a_belt_takes_a_box_along(host):
    speeds = host(model(BELT, ON_BELT), ON_BELT, 150)
    assert speeds[40] == pytest.approx(0.4 * G * 41 * DT, rel=0.02)
    np.testing.assert_allclose(speeds[-20:], 0.5, atol=5e-5)


@pytest.mark.slow
@pytest.mark.parametrize("host", HOSTS)
def test_a_ball_rolls_down_at_a_constant_acceleration(host):
    """5/7 g sin(angle), while the x axis of its site reverses twice."""
    speeds = host(model(BALL, ROLLING, ANGLE), ROLLING, 360)
    acceleration = (speeds[60:] - speeds[40:-20]) / (20 * DT)
    np.testing.assert_allclose(acceleration, 5.0 / 7.0 * G * math.sin(ANGLE), rtol=1e-2)
