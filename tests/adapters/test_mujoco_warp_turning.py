"""Parts that a turning plane, table, gripper or car holds in MuJoCo Warp: they keep their places.

Worlds differ in the spin: 1, 2, 3 and 10 rad/s.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

mujoco = pytest.importorskip("mujoco", reason="needs the extra [mujoco-warp]")
wp = pytest.importorskip("warp", reason="needs the extra [mujoco-warp]")
pytest.importorskip("mujoco_warp", reason="needs the extra [mujoco-warp]")

from planarfriction.adapters.mujoco_warp import Friction, PatchContact, prepare  # noqa: E402
from planarfriction_studies.bench.mujoco_scenes import shaken  # noqa: E402
from tests.support.turning import rounding  # noqa: E402

pytestmark = pytest.mark.mujoco_warp

SPINS = np.array([1.0, 2.0, 3.0, 10.0])
"""Spins of the worlds [rad/s]."""

RADII = np.minimum(0.25, 0.2 * 9.81 / SPINS**2)
"""Radii at which a fifth of the friction of mu = 1 holds [m]."""

POSES = 1e-5, 1e-4
"""Shares of the radius, and angles [rad], that positions and quaternions in single precision lose in 20 s."""

MODEL = shaken().model
"""Pads of mu = 1, whose kernels other tests compile too."""

STEPS = 5000
"""Number of steps of long runs, which take a processor two or three minutes."""

_BOX = """<body name="{0}" pos="0 0 {1}"><freejoint/><geom name="{0}" type="box" size="0.03 0.03 0.01" mass="0.1"
  contype="0" conaffinity="{2}"/><site name="{0}" pos="0 0 -0.01"/></body>"""

_DECK = """<geom name="{}" type="box" size="1 1 0.05" pos="0 0 -0.05" mass="10" contype="1" conaffinity="0"/>"""


def plane(spin: float, height: float, bit: int = 1) -> str:
    """Return a plane whose surface turns, with a box on it, which touch others of the same bit only."""
    name = f"plane {spin:g}"
    return f"""<geom name="{name}" type="plane" size="2 2 .1" pos="0 0 {height}" surfacevel="0 0 0 0 0 {spin}"
      contype="{bit}" conaffinity="0"/>{_BOX.format(f"box {spin:g}", height + 0.01, bit)}"""


TABLE = f"""<body><joint name="table" axis="0 0 1"/>{_DECK.format("table")}</body>{_BOX.format("part", 0.01, 1)}"""
"""A hinged table with a box on it."""

CAR = f"""<body pos="0 0 -4"><joint name="x" type="slide" axis="1 0 0"/><joint name="y" type="slide" axis="0 1 0"/>
  <joint name="car" axis="0 0 1"/>{_DECK.format("car")}</body>{_BOX.format("parcel", -3.99, 1)}"""
"""A car that drives in a circle, with a box on it."""

PLACE = 0.5
"""Radius of the block on the arm [m]."""

ARM = f"""<body pos="0 0 4"><joint name="arm" axis="0 0 1"/><inertial pos="0 0 0" mass="10" diaginertia="1 1 1"/>
  <geom name="left" type="box" size="0.008862 0.005 0.008862" pos="{PLACE} -0.0147 0" contype="1" conaffinity="0"/>
  <body pos="{PLACE} 0.0147 0"><joint name="press" type="slide" axis="0 -1 0" damping="30"/>
  <geom name="right" type="box" size="0.008862 0.005 0.008862" mass="0.5" contype="1" conaffinity="0"/></body></body>
  <body name="block" pos="0 0 4"><freejoint/>
  <geom name="block" type="box" size="0.04 0.01 0.06" mass="0.2" contype="0" conaffinity="1"/>
  <site name="left" pos="0 -0.01 0" zaxis="0 1 0"/><site name="right" pos="0 0.01 0" zaxis="0 -1 0"/></body>"""
"""An arm that holds a block, pressed along its circle by one pad against another."""

MOTORS = (
    '<actuator><motor joint="press"/><motor joint="x"/><motor joint="y"/></actuator>'
)


class Worlds:
    """Worlds of a scene with patches between sites and geoms."""

    def __init__(
        self,
        bodies: str,
        sites: dict[str, tuple[str, str]],
        dt: float,
        worlds: int,
        more: str = "",
    ) -> None:
        text = f"""<mujoco><option timestep="{dt}"/><worldbody>{bodies}</worldbody>{more}</mujoco>"""
        spec = mujoco.MjSpec.from_string(text)
        patches = [
            PatchContact(MODEL, site=site, geoms=geoms) for site, geoms in sites.items()
        ]
        prepare(spec, patches)
        self.m = spec.compile()
        self.dt = dt
        self.friction = Friction(self.m, patches, worlds=worlds, njmax=200, nconmax=60)
        self.q = np.tile(self.m.qpos0, (worlds, 1))
        self.v = np.zeros((worlds, self.m.nv))

    def put(self, joint: str, value: Any, rate: Any) -> None:
        """Write the position and velocity of a joint in all worlds."""
        self.q[:, self.m.joint(joint).qposadr[0]] = value
        self.v[:, self.m.joint(joint).dofadr[0]] = rate

    def throw(self, body: str, spins: np.ndarray, x: Any, y: Any = 0.0) -> None:
        """Let a free body turn about the vertical axis of the world."""
        first = self.m.joint(self.m.body(body).jntadr[0]).qposadr[0]
        dof = self.m.body(body).dofadr[0]
        self.q[:, first] = x
        self.q[:, first + 1] = y
        self.v[:, dof] = -spins * y
        self.v[:, dof + 1] = spins * x
        self.v[:, dof + 5] = spins

    def run(
        self, seconds: float, control: Any = None, every: float = 0.1
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return times, and positions [times, E, nq]."""
        data = self.friction.data
        places = []
        data.qpos.assign(self.q.astype(np.float32))
        data.qvel.assign(self.v.astype(np.float32))
        for i in range(round(seconds / self.dt) + 1):
            if i % round(every / self.dt) == 0:
                places.append(data.qpos.numpy().astype(float))
            if control is not None:
                data.ctrl.assign(control(data.qpos.numpy()).astype(np.float32))
            self.friction.step()
        assert self.friction.report().converged.all()
        return every * np.arange(len(places)), np.array(places)

    def around(
        self, q: np.ndarray, body: str, turned: np.ndarray, x: Any = 0.0, y: Any = 0.0
    ) -> tuple[Any, ...]:
        """Return radius, angle and own angle of a free body, about an axis at (x, y), less that of its support."""
        first = self.m.joint(self.m.body(body).jntadr[0]).qposadr[0]
        dx = q[..., first] - x
        dy = q[..., first + 1] - y
        quaternion = q[..., first + 3 : first + 7]
        around = np.unwrap(np.arctan2(dy, dx), axis=0) - turned
        own = (
            np.unwrap(2.0 * np.arctan2(quaternion[..., 3], quaternion[..., 0]), axis=0)
            - turned
        )
        return np.hypot(dx, dy), around, own


def _check(
    found: tuple[Any, ...],
    times: np.ndarray,
    spins: np.ndarray,
    dt: float,
    start: float,
    hinge: Any = 0.0,
) -> None:
    """Compare with what the second order of steps leaves, the deflection of the bristles, and single precision.

    The angle of a hinge is rounded by `hinge` more [rad].
    """
    chosen = times > start - 1e-9
    lasts = np.ptp(times[chosen])
    radius, around, own = (np.ptp(each[chosen], axis=0) for each in found)
    size = found[0][0]
    elastic = (
        4e-7  # m: bristles of the third of a millionth of a metre, stretched by a fifth
    )
    assert (
        radius < size * (1.5 * spins**4 * dt**3 * lasts / 8.0 + POSES[0]) + elastic
    ).all()
    angle = 1.5 * spins**3 * dt**2 * lasts / 6.0 + POSES[1] + hinge
    assert (around < angle + elastic / size).all() and (
        own < angle + elastic / size
    ).all()


def test_parts_on_a_table_and_a_plane_keep_their_places():
    """Steps along tangents would take them 0.54 % further out in 0.3 s: by a factor of `exp(w^2 dt T / 2)`."""
    spins = SPINS[2:3]
    dt = 4e-3
    sites = {"part": ("table", "part"), "box 3": ("plane 3", "box 3")}
    worlds = Worlds(TABLE + plane(3.0, -4.0), sites, dt, 1)
    worlds.put("table", 0.0, spins)
    for body in ("part", "box 3"):
        worlds.throw(body, spins, RADII[2])
    times, q = worlds.run(0.4)
    _check(worlds.around(q, "part", q[..., 0]), times, spins, dt, 0.1)
    _check(worlds.around(q, "box 3", times[:, None] * spins), times, spins, dt, 0.1)


BALL = """<geom name="floor" type="plane" size="5 5 1"/><body name="ball" pos="0 0 0.04999"><freejoint/>
  <geom name="ball" type="sphere" size="0.05" mass="0.2"/><site name="ball"/></body>"""


def test_a_ball_that_spins_rolls_straight():
    """Its contact moves along with it: the material below turns aside, by half of 10 rad/s in 4 ms, 4 mm in 0.2 m."""
    worlds = Worlds(BALL, {"ball": ("floor", "ball")}, 4e-3, 1)
    worlds.v[:] = 1.0, 0.0, 0.0, 0.0, 20.0, 10.0
    x, y = worlds.run(0.2)[1][-1, 0, :2]
    assert x == pytest.approx(0.2, abs=2e-3)
    assert abs(y) < 1e-5


@pytest.mark.slow
@pytest.mark.parametrize("dt", [2e-3, 4e-3])
def test_parts_on_planes_keep_their_places_for_long(dt):
    sites = {f"box {spin:g}": (f"plane {spin:g}", f"box {spin:g}") for spin in SPINS}
    worlds = Worlds(
        "".join(plane(spin, -float(i), 2**i) for i, spin in enumerate(SPINS)),
        sites,
        dt,
        1,
    )
    for name, spin, radius in zip(sites, SPINS, RADII, strict=True):
        worlds.throw(name, spin, radius)
    times, q = worlds.run(STEPS * dt)
    for name, spin in zip(sites, SPINS, strict=True):
        _check(
            worlds.around(q, name, times[:, None] * spin),
            times,
            np.array([spin]),
            dt,
            1.0,
        )


@pytest.mark.slow
@pytest.mark.parametrize("dt", [2e-3, 4e-3])
def test_parts_on_a_table_a_car_and_an_arm_keep_their_places_for_long(dt):
    sites = {"part": ("table", "part"), "parcel": ("car", "parcel")}
    sites |= {side: (side, "block") for side in ("left", "right")}
    worlds = Worlds(TABLE + CAR + ARM, sites, dt, len(SPINS), MOTORS)
    for joint in ("table", "car", "arm"):
        worlds.put(joint, 0.0, SPINS)
    worlds.put("x", RADII, 0.0)
    worlds.put("y", 0.0, SPINS * RADII)
    worlds.throw("part", SPINS, RADII)
    worlds.throw("parcel", SPINS, 1.3 * RADII, 0.2 * RADII)
    worlds.throw("block", SPINS, PLACE)
    x, y, car, arm = (
        worlds.m.joint(name).qposadr[0] for name in ("x", "y", "car", "arm")
    )

    def control(q: np.ndarray) -> np.ndarray:
        """Press with 30 N, and pull the car towards the middle of its circle."""
        return np.stack(
            [
                np.full(len(q), 30.0),
                *(-10.0 * SPINS**2 * q[:, place] for place in (x, y)),
            ],
            axis=1,
        )

    times, q = worlds.run(STEPS * dt, control)
    hinge = np.array([rounding(spin, dt, STEPS * dt) for spin in SPINS])
    table = np.unwrap(q[..., worlds.m.joint("table").qposadr[0]], axis=0)
    _check(worlds.around(q, "part", table), times, SPINS, dt, 1.0, hinge)
    _check(
        worlds.around(q, "parcel", q[..., car], q[..., x], q[..., y]),
        times,
        SPINS,
        dt,
        1.0,
        hinge,
    )
    # pads pull at the hinge, and change how it is rounded
    _check(worlds.around(q, "block", q[..., arm]), times, SPINS, dt, 1.0, 1.5 * hinge)
