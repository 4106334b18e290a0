"""Wheels and boxes in MJX and MuJoCo Warp move as in closed form, wherever their sites lie."""

from __future__ import annotations

import re
import warnings

import numpy as np
import pytest

mujoco = pytest.importorskip("mujoco")

from planarfriction.adapters.mujoco import PatchContact, prepare  # noqa: E402
from tests.support.wheels import RADIUS, SHAPES, box, face, on_the_floor, wheel  # noqa: E402

RACE = {
    "ball": ("sphere", "centre"),
    "wheel": ("cylinder", "centre"),
    "tread": ("cylinder", "tread"),
}
"""Shapes and sites of wheels side by side."""
MU = 0.6
"""Friction coefficient under a box beside them, with its site in its middle."""


def race():
    """Return a model of all of them, and their patches."""
    wheels = [
        wheel(*pair, name=name, y=0.3 * i)
        for i, (name, pair) in enumerate(RACE.items())
    ]
    patches = [
        PatchContact(SHAPES[shape][1], name, ("floor", name))
        for name, (shape, _) in RACE.items()
    ]
    patches += [PatchContact(face(MU), "box", ("floor", "box"))]
    spec = mujoco.MjSpec.from_string(
        on_the_floor(*wheels, box(y=-0.3), options='cone="pyramidal"')
    )
    return prepare(spec, patches).compile(), patches


STEPS = 10
"""Steps that are compiled at once."""


class InMjx:
    """A model in MJX."""

    def __init__(self, m, patches) -> None:
        self.jax = pytest.importorskip("jax")
        self.mjx = pytest.importorskip("mujoco.mjx")
        from planarfriction.adapters.mjx import Friction

        with self.jax.enable_x64(True):
            self.friction = Friction(m, patches)
            self.model = self.mjx.put_model(m)
            self.data = self.mjx.make_data(m)
            self.jitted = self.jax.jit(self._steps, static_argnums=1)

    def _steps(self, d, count):
        return self.jax.lax.scan(
            lambda d, _: (self.friction.step(self.model, d), None),
            d,
            None,
            length=count,
        )[0]

    def throw(self, velocity) -> None:
        with self.jax.enable_x64(True):
            self.data = self.data.replace(qvel=self.jax.numpy.asarray(velocity))

    def steps(self, count: int) -> tuple[np.ndarray, np.ndarray]:
        """Return positions and velocities at the end of some steps."""
        with self.jax.enable_x64(True):
            for _ in range(count // STEPS):
                self.data = self.jitted(self.data, STEPS)
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

    def steps(self, count: int) -> tuple[np.ndarray, np.ndarray]:
        for _ in range(count):
            self.friction.step()
        data = self.friction.data
        return data.qpos.numpy()[0].astype(float), data.qvel.numpy()[0].astype(float)

    def misplaced(self):
        return self.friction.misplaced()

    def read(self) -> None:
        """Do nothing: steps warn."""


HOSTS = [
    pytest.param(InMjx, marks=pytest.mark.mjx, id="mjx"),
    pytest.param(InWarp, marks=pytest.mark.mujoco_warp, id="warp"),
]


@pytest.mark.mjx
def test_patches_lie_in_mjx_where_they_lie_in_mujoco():
    """Below the axle, below the middle of a box, and in the contact of a curved side, whatever side the site is on."""
    jax = pytest.importorskip("jax")
    mjx = pytest.importorskip("mujoco.mjx")
    from planarfriction.adapters import mujoco as adapter
    from planarfriction.adapters.mjx import Friction, responses

    m, patches = race()
    d = mujoco.MjData(m)
    theirs = adapter.Friction(m, patches)
    theirs.step(d)
    wanted = d.userdata[theirs._memory.centre :][: 3 * len(patches)].reshape(-1, 3)
    d = mujoco.MjData(m)
    mujoco.mj_forward(m, d)
    none = np.zeros((len(patches), 3))
    with jax.enable_x64(True):
        where = responses.geometry(
            mjx.put_model(m),
            mjx.put_data(m, d),
            Friction(m, patches)._fixed.places,
            none,
            none,
        )
        assert (
            where.at_contact.tolist() == [True, True, True, False]
            and not where.upright.any()
        )
        np.testing.assert_allclose(np.asarray(where.origin), wanted, atol=1e-7)
    np.testing.assert_allclose(
        np.linalg.norm(wanted[[0, 1]], axis=1), RADIUS, atol=1e-4
    )
    np.testing.assert_allclose(wanted[3], [0.0, 0.0, -0.1], atol=1e-4)


@pytest.mark.slow
@pytest.mark.filterwarnings(
    "ignore:site box of the contact:UserWarning"
)  # where it has fallen
@pytest.mark.parametrize("host", HOSTS)
def test_wheels_roll_on_and_a_box_topples(host):
    """v = v0/(1 + I/(m r^2)) of wheels, 5/7 and 2/3; half the width over the height of the box is below mu."""
    running = host(*race())
    running.steps(30)
    running.throw([1.0, 0.0, 0.0, 0.0, 0.0, 0.0] * (len(RACE) + 1))
    place, velocity = running.steps(200)
    for i, (shape, _) in enumerate(RACE.values()):
        arm = 0.5 * (RADIUS + place[7 * i + 2])
        share = SHAPES[shape][2] * (RADIUS / arm) ** 2
        assert velocity[6 * i] == pytest.approx(1.0 / (1.0 + share), rel=5e-4)
        assert -velocity[6 * i + 5] * arm == pytest.approx(velocity[6 * i], rel=1e-3)
    turned = place[-4:]
    assert 1.0 - 2.0 * (turned[1] ** 2 + turned[2] ** 2) < 0.5


FAULTS = {
    "beside": (
        'pos="0.5 0 0"',
        "contact forces act beyond the patch: put the site into the contact, or use centre=",
    ),
    "upright": (
        'euler="0 90 0"',
        "its x axis lies along the normal of the contact, where its y axis takes its place",
    ),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", FAULTS)
@pytest.mark.parametrize("host", HOSTS)
def test_a_site_that_is_not_in_the_contact_is_told_once(host, name):
    site, message = FAULTS[name]
    patches = [PatchContact(face(0.3), "box", ("floor", "box"))]
    spec = mujoco.MjSpec.from_string(
        on_the_floor(box(site), options='cone="pyramidal"')
    )
    running = host(prepare(spec, patches).compile(), patches)
    with pytest.warns(
        UserWarning,
        match=re.escape(f"site box of the contact between floor and box: {message}"),
    ):
        running.steps(10)
        running.read()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        running.steps(10)
        running.read()
    assert message in running.misplaced()
