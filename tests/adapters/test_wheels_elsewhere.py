"""Wheels and boxes in MJX and MuJoCo Warp move as in closed form, wherever their sites lie."""

from __future__ import annotations

import re
import warnings

import numpy as np
import pytest

mujoco = pytest.importorskip("mujoco")

from planarfriction.adapters.mujoco import PatchContact, prepare  # noqa: E402
from tests.support.wheels import DT, RADIUS, SHAPES, box, face, on_the_floor, wheel  # noqa: E402

RACE = {
    "sphere": ("sphere", "centre"),
    "cylinder": ("cylinder", "centre"),
    "tread": ("cylinder", "tread"),
    "capsule": ("capsule", "centre"),
    "ellipsoid": ("ellipsoid", "contact"),
}
"""Shapes and sites of wheels side by side."""
BOXES = {"slides": ('pos="0 0 0.1"', 0.15), "topples": ("", 0.6)}
"""Sites and friction coefficients of boxes beside them."""


def race():
    """Return a model of all of them, and their patches."""
    wheels = [wheel(*pair, name=name, y=0.3 * i) for i, (name, pair) in enumerate(RACE.items())]
    boxes = [box(site, name=name, y=-0.3 * (i + 1)) for i, (name, (site, _)) in enumerate(BOXES.items())]
    patches = [PatchContact(SHAPES[shape][1], name, ("floor", name)) for name, (shape, _) in RACE.items()]
    patches += [PatchContact(face(mu), name, ("floor", name)) for name, (_, mu) in BOXES.items()]
    spec = mujoco.MjSpec.from_string(on_the_floor(*wheels, *boxes, options='cone="pyramidal"'))
    return prepare(spec, patches).compile(), patches


class InMjx:
    """A model in MJX."""

    def __init__(self, m, patches) -> None:
        self.jax, self.mjx = pytest.importorskip("jax"), pytest.importorskip("mujoco.mjx")
        from planarfriction.adapters.mjx import Friction

        with self.jax.enable_x64(True):
            self.friction, self.model, self.data = Friction(m, patches), self.mjx.put_model(m), self.mjx.make_data(m)
            self.jitted = self.jax.jit(lambda d: self.friction.step(self.model, d))

    def throw(self, velocity) -> None:
        with self.jax.enable_x64(True):
            self.data = self.data.replace(qvel=self.jax.numpy.asarray(velocity))

    def step(self) -> tuple[np.ndarray, np.ndarray]:
        """Return positions and velocities at the end of a step."""
        with self.jax.enable_x64(True):
            self.data = self.jitted(self.data)
            return np.asarray(self.data.qpos), np.asarray(self.data.qvel)

    def misplaced(self):
        with self.jax.enable_x64(True):
            return self.friction.misplaced(self.data)

    def read(self) -> None:
        with self.jax.enable_x64(True):
            self.friction.wrenches(self.data)


class InWarp:
    """A model in MuJoCo Warp."""

    def __init__(self, m, patches) -> None:
        pytest.importorskip("mujoco_warp")
        from planarfriction.adapters.mujoco_warp import Friction

        self.friction = Friction(m, patches, njmax=100, nconmax=60)

    def throw(self, velocity) -> None:
        self.friction.data.qvel.assign(np.array([velocity], np.float32))

    def step(self) -> tuple[np.ndarray, np.ndarray]:
        self.friction.step()
        data = self.friction.data
        return data.qpos.numpy()[0].astype(float), data.qvel.numpy()[0].astype(float)

    def misplaced(self):
        return self.friction.misplaced()

    def read(self) -> None:
        """Do nothing: `step` warns."""


HOSTS = [
    pytest.param(InMjx, marks=pytest.mark.mjx, id="mjx"),
    pytest.param(InWarp, marks=pytest.mark.mujoco_warp, id="warp"),
]


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:site topples of the contact:UserWarning")  # where it has fallen
@pytest.mark.parametrize("host", HOSTS)
def test_wheels_roll_on_and_boxes_slide_or_topple(host):
    """v = v0/(1 + I/(m r^2)); b/h = 0.2 is between the friction coefficients of the boxes (see MuJoCo's tests)."""
    running = host(*race())
    for _ in range(50):
        place, _ = running.step()
    start = place[7 * len(RACE)]
    running.throw([1.0, 0.0, 0.0, 0.0, 0.0, 0.0] * (len(RACE) + len(BOXES)))
    for _ in range(200):
        place, velocity = running.step()
    for i, (shape, _) in enumerate(RACE.values()):
        arm = 0.5 * (RADIUS + place[7 * i + 2])
        share = SHAPES[shape][2] * (RADIUS / arm) ** 2
        assert velocity[6 * i] == pytest.approx(1.0 / (1.0 + share), rel=5e-4)
        assert -velocity[6 * i + 5] * arm == pytest.approx(velocity[6 * i], rel=1e-3)
    slides, topples = place[7 * len(RACE) :].reshape(2, 7)
    assert 1.0 - 2.0 * (topples[4] ** 2 + topples[5] ** 2) < 0.5
    assert 1.0 - 2.0 * (slides[4] ** 2 + slides[5] ** 2) > 0.999
    for _ in range(200):
        place, _ = running.step()
    assert place[7 * len(RACE)] - start == pytest.approx(0.5 / (0.15 * 9.81) - 0.5 * DT, rel=2e-3)


FAULTS = {
    "beside": ('pos="0.5 0 0"', 'contact forces act beyond the patch: put the site into the contact, or use centre="co'),
    "upright": ('euler="0 90 0"', "its x axis lies along the normal of the contact, where its y axis takes its place"),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", FAULTS)
@pytest.mark.parametrize("host", HOSTS)
def test_a_site_that_is_not_in_the_contact_is_told_once(host, name):
    site, message = FAULTS[name]
    patches = [PatchContact(face(0.3), "box", ("floor", "box"))]
    spec = mujoco.MjSpec.from_string(on_the_floor(box(site), options='cone="pyramidal"'))
    running = host(prepare(spec, patches).compile(), patches)
    with pytest.warns(UserWarning, match=re.escape(f"site box of the contact between floor and box: {message}")):
        for _ in range(8):
            running.step()
        running.read()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for _ in range(8):
            running.step()
        running.read()
    assert message in running.misplaced()
