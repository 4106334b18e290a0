"""Wheels and boxes in MJX and MuJoCo Warp move as in closed form, wherever their sites lie."""

from __future__ import annotations

import re
import warnings

import numpy as np
import pytest

mujoco = pytest.importorskip("mujoco")

from planarfriction.adapters.mujoco import PatchContact, prepare  # noqa: E402
from tests.support import wheels  # noqa: E402
from tests.support.wheels import DT, RADIUS, SHAPES, box, face, on_the_floor, wheel  # noqa: E402

RACE = {
    "ball": ("sphere", "centre"),
    "wheel": ("cylinder", "centre"),
    "tread": ("cylinder", "tread"),
}
"""Shapes and sites of wheels side by side."""

MORE = {
    "capsule": ("capsule", "centre"),
    "ellipsoid": ("ellipsoid", "centre"),
    "mesh": ("mesh", "centre"),
}
"""Shapes and sites of others, beside a roller, a caster and a car."""

MU = 0.6
"""Friction coefficient under a box beside them, with its site in its middle."""


def race(racers=RACE, *others: str, models=(), **more):
    """Return a model of all of them, and their patches; others and their patches come last."""
    bodies = [
        wheel(*pair, name=name, y=0.3 * i)
        for i, (name, pair) in enumerate(racers.items())
    ]
    models = (
        {name: SHAPES[shape][1] for name, (shape, _) in racers.items()}
        | {"box": face(MU)}
        | dict(models)
    )
    patches = [
        PatchContact(model, name, ("floor", name)) for name, model in models.items()
    ]
    options = (
        'cone="pyramidal" integrator="implicitfast"' if others else 'cone="pyramidal"'
    )
    spec = mujoco.MjSpec.from_string(
        on_the_floor(*bodies, box(y=-0.3), *others, options=options, **more)
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

    def throw(self, velocity, ctrl=()) -> None:
        with self.jax.enable_x64(True):
            qvel, ctrl = (
                self.jax.numpy.asarray(each, float) for each in (velocity, ctrl)
            )
            self.data = self.data.replace(qvel=qvel, ctrl=ctrl)

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

    def throw(self, velocity, ctrl=()) -> None:
        self.friction.data.qvel.assign(np.array([velocity], np.float32))
        self.friction.data.ctrl.assign(np.array([ctrl], np.float32))

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
        places = Friction(m, patches)._fixed.places
        geometry = jax.jit(lambda m, d: responses.geometry(m, d, places, none, none))
        where = geometry(mjx.put_model(m), mjx.put_data(m, d))
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


@pytest.mark.slow
@pytest.mark.parametrize("host", HOSTS)
def test_wheels_of_all_kinds_go_as_they_should(host):
    """In closed form, as in MuJoCo (see `test_mujoco_wheels`); a mesh rolls from edge to edge and loses a percent.

    MJX takes no mesh whose faces have more than 20 corners.
    """
    racers = {
        name: pair for name, pair in MORE.items() if name != "mesh" or host is not InMjx
    }
    start = 120.0
    speed = 0.2
    others = (
        wheels.roller(45.0, y=-0.6),
        wheels.caster(start, y=-0.9),
        wheels.car(y=-1.3),
    )
    models = {"roller": wheels.TREAD, "caster": wheels.STRIP} | wheels.CAR
    m, patches = race(racers, *others, models=models, more=wheels.MOTORS)
    running = host(m, patches)
    drives = m.body("car").dofadr[0]
    rolls = drives - 8
    turns = drives - 4
    place, _ = running.steps(30)
    swivel = m.joint("swivel").qposadr[0]
    begin = np.degrees(place[swivel]) + start
    velocity = np.zeros(m.nv)
    velocity[: 6 * len(racers) : 6] = 1.0
    velocity[rolls : rolls + 2] = np.cos(np.pi / 4.0), -np.sin(np.pi / 4.0)
    velocity[turns:drives] = wheels.drawn(begin, speed)
    running.throw(velocity, [6.0, 4.0])
    place, velocity = running.steps(50)
    for i, (shape, _) in enumerate(racers.values()):
        arm = 0.5 * (RADIUS + place[7 * i + 2])
        share = SHAPES[shape][2] * (RADIUS / arm) ** 2
        near = 2e-2 if shape == "mesh" else 1e-3
        assert velocity[6 * i] == pytest.approx(1.0 / (1.0 + share), rel=near)
        assert -velocity[6 * i + 5] * arm == pytest.approx(
            velocity[6 * i], rel=max(near, 1e-3)
        )
    place, velocity = running.steps(150)
    assert velocity[rolls : rolls + 2] == pytest.approx(
        [0.8 * np.cos(np.pi / 4.0), 0.0], abs=3e-3
    )
    swung = np.tan(0.5 * np.radians(begin)) * np.exp(-speed * 200 * DT / wheels.TRAIL)
    assert np.tan(0.5 * (np.radians(start) + place[swivel])) == pytest.approx(
        swung, rel=0.02, abs=2e-3
    )
    quaternion = place[m.joint(m.body("car").jntadr[0]).qposadr[0] + 3 :][:4]
    spun = velocity[drives + 6 :][:2]
    turned = 2.0 * np.arctan2(quaternion[3], quaternion[0])
    ahead = np.cos(turned) * velocity[drives] + np.sin(turned) * velocity[drives + 1]
    assert spun == pytest.approx([6.0, 4.0], rel=5e-3)
    assert ahead == pytest.approx(0.5 * spun.sum() * RADIUS, rel=3e-3)
    assert velocity[drives + 5] == pytest.approx(
        (spun[0] - spun[1]) * RADIUS / 0.2, abs=5e-3
    )


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
