# pyright: reportAttributeAccessIssue=false
# (MuJoCo describes few of its names to type checkers.)
"""Scenes in MuJoCo in which friction decides: held, shaken, spun to rest, turned in the hand, carried on a tray.

Each comes as a model with MuJoCo's own friction at given settings, or with patches. Needs MuJoCo when it is built.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple

import numpy as np

from planarfriction.laws import LuGre
from planarfriction.models import FrictionModel, ReducedModel
from planarfriction.patch import ContactPatch
from planarfriction.scenes.ready import GRAVITY, in_hand_load

PADS = ("sphere", "box", "cylinder")

STARTS = ((1.0, 10.0), (1.0, 20.0), (1.0, 3.0))
"""Initial speeds [m/s] and spins [rad/s] of the disc."""


class Native(NamedTuple):
    """Settings of MuJoCo's own friction."""

    cone: Literal["pyramidal", "elliptic"] = "elliptic"
    impratio: float = 10.0
    noslip: int = 0
    condim: int = 4
    solref: float | None = None
    """Time constant of contacts [s]; None: that of the scene."""


@dataclass(frozen=True)
class MujocoScene:
    """A scene: its bodies, where its patches are, and what drives it."""

    body: str
    """Elements of its MJCF."""
    mu: float
    torsion: float
    """mu times the lever arm of MuJoCo's own friction against spin [m]."""
    patches: tuple[tuple[str, tuple[str, str]], ...]
    """Site and pair of geoms of each patch."""
    model: FrictionModel
    """Friction of each."""
    control: Callable[[float], Sequence[float]]
    """Controls of the actuators at a time [s]."""
    time: float = 5.0
    """Duration [s]."""
    settle: float = 0.6
    """Time [s] before it, with the controls of time 0."""
    weightless: bool = True
    """True if gravity begins after the settling time."""
    start: tuple[float, ...] | None = None
    """Velocities then; None as they are."""
    solref: float = 0.02
    """Time constant of contacts [s]."""

    def text(self, settings: Native, dt: float, integrator: str) -> str:
        """Return MJCF for settings of contacts, a time step [s] and an integrator."""
        solref = self.solref if settings.solref is None else settings.solref
        options = f'cone="{settings.cone}" impratio="{settings.impratio}" noslip_iterations="{settings.noslip}"'
        contact = f'condim="{settings.condim}" friction="{self.mu} {self.torsion} 0" solref="{solref} 1"'
        return f"""<mujoco><option timestep="{dt}" integrator="{integrator}" {options}/>
        <default><geom {contact}/></default>{self.body}</mujoco>"""

    def native(
        self, settings: Native, dt: float = 2e-3, integrator: str = "Euler"
    ) -> tuple[Any, Any]:
        """Return the model and data with MuJoCo's own friction."""
        import mujoco

        m = mujoco.MjModel.from_xml_string(self.text(settings, dt, integrator))
        return m, mujoco.MjData(m)

    def ours(
        self,
        dt: float = 2e-3,
        integrator: str = "Euler",
        solref: float | None = None,
        model: FrictionModel | None = None,
    ) -> tuple[Any, Any, Any]:
        """Return the model, data, and the friction of its patches; `model` in place of the scene's own."""
        from planarfriction.adapters import mujoco as adapter

        settings = Native(condim=1, impratio=1.0, solref=solref)
        return self.with_patches(adapter, self.text(settings, dt, integrator), model)

    def with_patches(
        self, adapter: Any, text: str, model: FrictionModel | None = None
    ) -> tuple[Any, Any, Any]:
        """Return the model of an MJCF text, data, and the friction of the scene's patches by an adapter."""
        import mujoco

        patches = [
            adapter.PatchContact(model or self.model, site=site, geoms=geoms)
            for site, geoms in self.patches
        ]
        spec = mujoco.MjSpec.from_string(text)
        adapter.prepare(spec, patches)
        m = spec.compile()
        return m, mujoco.MjData(m), adapter.Friction(m, patches)

    def begin(
        self,
        way: Native | None,
        dt: float = 2e-3,
        integrator: str = "Euler",
        model: FrictionModel | None = None,
    ) -> tuple[Any, Any, Callable[[], None]]:
        """Return model, data and a function that makes a step: with MuJoCo's own friction, for None with patches."""
        import mujoco

        if way is None:
            m, d, friction = self.ours(dt, integrator, model=model)
            return m, d, lambda: friction.step(d)
        m, d = self.native(way, dt, integrator)
        return m, d, lambda: mujoco.mj_step(m, d)

    def run(self, m: Any, d: Any, step: Callable[[], None]) -> np.ndarray:
        """Run the scene and return positions `[steps + 1, nq]` after it has settled; `step` makes a step."""
        gravity = m.opt.gravity.copy()
        dt = float(m.opt.timestep)
        if self.weightless:
            m.opt.gravity[:] = 0.0
        if m.nu:
            d.ctrl[:] = self.control(0.0)
        for _ in range(round(self.settle / dt)):
            step()
        m.opt.gravity[:] = gravity
        if self.start is not None:
            d.qvel[:] = self.start
        path = [d.qpos.copy()]
        for i in range(round(self.time / dt)):
            if m.nu:
                d.ctrl[:] = self.control(i * dt)
            step()
            path.append(d.qpos.copy())
        return np.array(path)


def _law(mu: float, sigma_0: float, sigma_1: float = 0.0) -> LuGre:
    return LuGre(
        mu_c=mu,
        mu_s=mu,
        sigma_0=sigma_0,
        sigma_1=sigma_1,
        sigma_2=0.0,
        elasto_plastic=0.9,
    )


def _pad(radius: float, mu: float, sigma_0: float) -> ReducedModel:
    pad = ContactPatch.disc(radius=radius, cells=21)
    return ReducedModel(pad, _law(mu, sigma_0, math.sqrt(sigma_0) * 0.8))


def _pads(place: str, geom: str, joint: str = "") -> str:
    """Return a left and a right pad on slides towards each other; `place` is theirs, less the sign of x."""
    return "".join(
        f"""<body pos="{place.format(sign)}"><joint name="{side}" type="slide" axis="{axis} 0 0" {joint}/>
        <geom name="pad {side}" {geom} contype="1" conaffinity="0"/></body>"""
        for side, sign, axis in (("left", "-", 1), ("right", "", -1))
    )


_MOTORS = '<motor joint="left"/><motor joint="right"/>'

_SHAPES = {
    "sphere": (0.01, 'type="sphere" size="0.01"'),
    "box": (0.005, 'type="box" size="0.005 0.008862 0.008862"'),
    "cylinder": (0.005, 'type="cylinder" size="0.01 0.005" euler="0 90 0"'),
}
"""Depth [m] of pads with the area of a disc of radius 0.01 m, and their geoms."""

_BLOCK = """<geom name="block" type="box" size="0.01 0.04 0.06" mass="0.2" contype="0" conaffinity="1"/>
    <site name="left" pos="-0.01 {0} 0" zaxis="1 0 0"/><site name="right" pos="0.01 {0} 0" zaxis="-1 0 0"/>"""

_HELD = ("left", ("pad left", "block")), ("right", ("pad right", "block"))


def grip(pad: str = "box") -> MujocoScene:
    """Build a block of 0.2 kg between two pads that press with 3 N, held 4 mm beside its centre of mass."""
    depth, geom = _SHAPES[pad]
    pads = _pads(f"{{}}{0.01 + depth} 0.004 0.5", f'{geom} mass="0.05"')
    # one point where a cylinder touches: several jump about from step to step, and the block rocks by 1e-4 degrees
    body = f"""<option><flag multiccd="disable"/></option>
    <worldbody><body name="block" pos="0 0 0.5"><freejoint/>{_BLOCK.format(0.004)}</body>{pads}</worldbody>
    <actuator>{_MOTORS}</actuator>"""
    return MujocoScene(
        body, 1.0, 2e-2 / 3.0, _HELD, _pad(0.01, 1.0, 1e6), lambda t: (3.0, 3.0)
    )


SHAKEN = 3.0
"""Time for which the gripper is shaken [s]."""


def shaken() -> MujocoScene:
    """Build the block of `grip`, pressed with 6 N, in a gripper that goes up and down and turns for 3 s, then rests."""
    depth, geom = _SHAPES["box"]
    fingers = _pads(f"{{}}{0.01 + depth} 0 0", f'{geom} mass="0.05"', 'damping="20"')
    body = f"""<worldbody><body name="arm" pos="0 0 0.5"><joint name="lift" type="slide" axis="0 0 1" damping="20"/>
    <joint name="turn" axis="1 0 0" damping="1"/><inertial pos="0 0 0.1" mass="1" diaginertia="0.01 0.01 0.01"/>
    {fingers}</body><body name="block" pos="0 0 0.5"><freejoint/>{_BLOCK.format(0.0)}</body></worldbody>
    <actuator>{_MOTORS}<position joint="lift" kp="5000" dampratio="1"/>
    <position joint="turn" kp="200" dampratio="1"/></actuator>"""

    def control(t: float) -> tuple[float, ...]:
        fades = 1.0 if t < SHAKEN else math.exp(-5.0 * (t - SHAKEN))
        lift = 0.02 * math.sin(4.0 * math.pi * t)
        turn = 0.1 * math.sin(2.6 * math.pi * t)
        return 6.0, 6.0, fades * lift, fades * turn

    return MujocoScene(body, 1.0, 2e-2 / 3.0, _HELD, _pad(0.01, 1.0, 1e6), control)


def in_the_hand(d: Any) -> np.ndarray:
    """Return the position of the block of `shaken` in the gripper's frame [m]."""
    arm = d.body("arm")
    return arm.xmat.reshape(3, 3).T @ (d.body("block").xpos - arm.xpos)


def disc(speed: float, spin: float) -> MujocoScene:
    """Build a disc of 0.2 kg and radius 0.1 m that starts with `speed` [m/s] and `spin` [rad/s] on the floor, mu 0.3.

    `coulomb_disc.stop` says where it comes to rest. It moves on joints of its plane.
    """
    i = 0.5 * 0.2 * 0.1**2
    body = f"""<worldbody><geom name="floor" type="plane" size="9 9 .1"/><body name="disc" pos="0 0 0.002">
    <joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 1 0"/><joint type="slide" axis="0 0 1"/>
    <joint type="hinge" axis="0 0 1"/><inertial pos="0 0 0" mass="0.2" diaginertia="{i / 2} {i / 2} {i}"/>
    <geom name="disc" type="cylinder" size="0.1 0.002" mass="0"/><site name="disc" pos="0 0 -0.002"/></body>
    </worldbody>"""
    return MujocoScene(
        body,
        0.3,
        0.0,
        (("disc", ("floor", "disc")),),
        ReducedModel(ContactPatch.disc(radius=0.1, cells=31), _law(0.3, 1e5)),
        lambda t: (),
        time=1.2,
        weightless=False,
        start=(speed, 0.0, 0.0, spin),
    )


def plate(load: Literal[1, 2] = 1) -> MujocoScene:
    """Build the published in-hand run: a plate held upright between two pads slips and turns as the grip varies.

    Its plane is that of x and y, gravity is along -y; positions are x (less 2 mm), y, z, the angle, and that of the
    upper pad.
    """
    body = f"""<option gravity="0 {-GRAVITY} 0"/><worldbody>
    <geom name="lower" type="sphere" size="0.01" pos="0 0 -0.012" contype="1" conaffinity="0"/>
    <site name="lower" pos="0 0 -0.002"/>
    <body name="plate" pos="0.002 0 0"><joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 1 0"/>
    <joint type="slide" axis="0 0 1"/><joint type="hinge" axis="0 0 1"/>
    <inertial pos="0 0 0" mass="0.2" diaginertia="1e-3 1e-3 {0.2 / 12.0 * (0.15**2 + 0.08**2)}"/>
    <geom name="plate" type="box" size="0.075 0.04 0.002" mass="0" contype="0" conaffinity="1"/></body>
    <body name="upper" pos="0 0 0.012"><joint name="press" type="slide" axis="0 0 -1"/>
    <geom name="upper" type="sphere" size="0.01" mass="0.01" contype="1" conaffinity="0"/>
    <site name="upper" pos="0 0 -0.01"/></body></worldbody>
    <actuator><motor joint="press"/></actuator>"""
    force = in_hand_load(load)
    pads = (("lower", ("lower", "plate")), ("upper", ("upper", "plate")))
    own = ReducedModel(
        ContactPatch.disc(radius=0.01, cells=21), LuGre(mu_s=1.2, elasto_plastic=0.9)
    )
    control = lambda t: (float(force(t)),)
    # solref: the pads press with what the motor gives
    return MujocoScene(
        body, 1.0, 2e-2 / 3.0, pads, own, control, time=2.0, solref=0.004
    )


def tray(blocks: int = 2) -> MujocoScene:
    """Build a tray shaken to and fro, first in the positions, with `blocks` of 0.1 kg on it, which slip and turn."""
    places = [(0.1 * (i % 4 - 1.5), 0.1 * (i // 4 - 0.5)) for i in range(blocks)]
    carried = "".join(
        f"""<body name="block {i}" pos="{x} {y} 0.025"><freejoint/>
        <geom name="block {i}" type="box" size="0.02 0.02 0.02" mass="0.1" contype="0" conaffinity="1"/>
        <site name="block {i}" pos="0 0 -0.02"/></body>"""
        for i, (x, y) in enumerate(places)
    )
    body = f"""<worldbody><body name="tray"><joint name="x" type="slide" axis="1 0 0" damping="20"/>
    <joint name="y" type="slide" axis="0 1 0" damping="20"/>
    <geom name="tray" type="box" size="0.25 0.15 0.005" mass="1" contype="1" conaffinity="0"/></body>
    {carried}</worldbody>
    <actuator><position joint="x" kp="5000" dampratio="1"/><position joint="y" kp="5000" dampratio="1"/></actuator>"""
    patches = tuple((f"block {i}", ("tray", f"block {i}")) for i in range(blocks))
    control = lambda t: (
        0.02 * math.sin(6.0 * math.pi * t),
        0.02 * math.sin(4.6 * math.pi * t),
    )
    model = _pad(0.02, 0.4, 1e5)
    return MujocoScene(
        body,
        0.4,
        0.006,
        patches,
        model,
        control,
        time=2.0,
        settle=0.4,
        weightless=False,
    )


def capsule() -> MujocoScene:
    """Build a capsule of 45 g pinched between two flat pads that move into it by 2 mm: it touches along lines.

    Source: MuJoCo issue 3328.
    """
    pads = _pads(
        "{}0.014 0 0.2", 'type="box" size="0.01 0.02 0.02" mass="0.1"', 'damping="20"'
    )
    body = f"""<worldbody>{pads}<body name="capsule" pos="0 0 0.2" euler="90 0 0"><freejoint/>
    <geom name="capsule" type="capsule" size="0.004 0.02" mass="0.045" contype="0" conaffinity="1"/>
    <site name="left" pos="-0.004 0 0" zaxis="1 0 0"/><site name="right" pos="0.004 0 0" zaxis="-1 0 0"/></body>
    </worldbody>
    <actuator><position joint="left" kp="2000"/><position joint="right" kp="2000"/></actuator>"""
    # the sites' x axes lie along the capsule
    line = ReducedModel(
        ContactPatch.rectangle(0.04, 5e-4, cells=21), _law(0.7, 1e6, 800.0)
    )
    patches = (("left", ("pad left", "capsule")), ("right", ("pad right", "capsule")))
    return MujocoScene(
        body, 0.7, 0.005, patches, line, lambda t: (6e-3, 6e-3), settle=1.0
    )
