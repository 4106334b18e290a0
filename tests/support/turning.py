"""Boxes held on what turns: on a surface, a table, in the gripper of an arm, on a car; and how well they stay."""

from __future__ import annotations

from typing import Any, NamedTuple

import mujoco
import numpy as np

import planarfriction as pf
from planarfriction.adapters.mujoco import PatchContact, prepare

G = 9.81

SPEEDS, STEPS = (1.0, 2.0, 3.0, 10.0), (2e-3, 4e-3)

SURFACE = (
    """<geom name="support" type="plane" size="5 5 1" surfacevel="0 0 0 0 0 {w}"/>"""
)

TABLE = """<body><joint axis="0 0 1" armature="1e4"/><geom name="support" type="box" size="0.4 0.4 0.02" pos="0 0 -0.02"
 mass="1"/></body>"""

CAR = """<body name="car" gravcomp="1"><freejoint/><inertial pos="0 0 0" mass="1e3" diaginertia="1e3 1e3 1e3"/>
<geom name="support" type="box" size="0.4 0.4 0.02" pos="0 0 -0.02" mass="0"/></body>"""

ON_TOP = """<body pos="{x} {y} 0.03"><freejoint/><geom name="box" type="box" size="0.03 0.03 0.03" mass="0.2"/>
<site name="support" pos="0 0 -0.03"/></body>"""

ARM = """<body><joint axis="0 0 1" armature="1e4"/><geom type="capsule" size="0.01" fromto="0 0 0 0.4 0 0" mass="1"
 contype="0" conaffinity="0"/><geom name="support" type="box" size="0.02 0.005 0.02" pos="{x} 0.015 0" mass="0.1"/>
<body pos="{x} -0.015 0"><joint name="press" type="slide" axis="0 1 0"/>
<geom name="pad" type="box" size="0.02 0.005 0.02" mass="0.1"/></body></body>
<body pos="{x} 0 0"><freejoint/><geom name="box" type="box" size="0.02 0.01 0.02" mass="0.2"/>
<site name="support" pos="0 0.01 0" zaxis="0 -1 0"/><site name="pad" pos="0 -0.01 0" zaxis="0 1 0"/></body>"""


class Turning(NamedTuple):
    """A box that is held on what turns."""

    m: Any
    patches: list[PatchContact]
    qpos: np.ndarray
    qvel: np.ndarray
    ctrl: float
    """Force of the gripper [N]."""
    w: float
    support: str

    def driven(self, xp: Any, qpos: Any, qvel: Any, w: Any, dt: Any) -> Any:
        """Return the velocities where a step begins: a car goes on by chords of its circle."""
        if self.support != "car":
            return qvel
        back = -2.0 * xp.sin(0.5 * w * dt) ** 2 / dt
        along = xp.sin(w * dt) / dt
        (x, y) = qpos[:2]
        none = 0.0 * x
        own = xp.stack(
            [back * x - along * y, along * x + back * y, none, none, none, w + none]
        )
        return xp.concatenate([own, qvel[6:]])

    def places(self, times: np.ndarray, qpos: np.ndarray) -> np.ndarray:
        """Return distance [m] from the axis of the support, angle about it, and yaw, both relative to it, `[n, 3]`."""
        pose = qpos[:, -7:].astype(float)
        at = np.zeros((len(qpos), 2))
        turned = self.w * times
        if self.support in ("table", "arm"):
            turned = qpos[:, 0].astype(float)
        if self.support == "car":
            at = qpos[:, :2].astype(float)
            turned = _yaw(qpos[:, 3:7].astype(float))
        away = pose[:, :2] - at
        angle = np.arctan2(away[:, 1], away[:, 0]) - turned
        yaw = _yaw(pose[:, 3:]) - turned
        return np.stack([np.hypot(*away.T), np.unwrap(angle), np.unwrap(yaw)], axis=1)

    def bounds(self, time: float) -> tuple[float, float]:
        """Return by which share the radius may change after a time [s], and the angle [rad], without the bristles."""
        w = self.w
        dt = self.m.opt.timestep
        return 1.5 * w**4 * dt**3 * time / 8.0, 1.5 * w**3 * dt**2 * time / 6.0


def _yaw(quaternions: np.ndarray) -> np.ndarray:
    return 2.0 * np.arctan2(quaternions[:, 3], quaternions[:, 0])


def turning(support: str, w: float, dt: float, integrator: str = "Euler") -> Turning:
    """Return a box on a "surface" or a "table", in the gripper of an "arm", or on a "car", that turn by w [rad/s]."""
    grip = support == "arm"
    mu = 0.3 if support in ("surface", "table") else 1.0
    x = 0.5 if grip else min(0.25, 0.7 * mu * G / w**2)
    middle = np.zeros(2)
    # On a circle of its own, about the axis from which the box is that far.
    if support == "car":
        middle = np.array([0.0, -0.6 * x])
        x = 0.8 * x
    body = {"surface": SURFACE, "table": TABLE, "car": CAR}.get(support, "") + ON_TOP
    text = (ARM if grip else body).format(w=w, x=x, y=middle[1])
    motor = '<actuator><motor joint="press"/></actuator>' if grip else ""
    spec = mujoco.MjSpec.from_string(
        f"<mujoco><worldbody>{text}</worldbody>{motor}</mujoco>"
    )
    spec.option.timestep, spec.option.integrator = (
        dt,
        getattr(mujoco.mjtIntegrator, f"mjINT_{integrator.upper()}"),
    )
    law = pf.LuGre(mu_c=mu, sigma_2=0.0, elasto_plastic=0.9)
    model = pf.ReducedModel(pf.ContactPatch.rectangle(0.04 if grip else 0.06), law)
    names = ("support", "pad") if grip else ("support",)
    patches = [PatchContact(model, name, (name, "box")) for name in names]
    m = prepare(spec, patches).compile()
    qpos = m.qpos0.copy()
    qvel = np.zeros(m.nv)
    if support == "car":
        qpos[:2] = middle
    if support in ("table", "arm"):
        qvel[0] = w
    qvel[-6:-3] = -w * (middle[1]), w * x, 0.0
    qvel[-1] = w
    return Turning(m, patches, qpos, qvel, 30.0 * grip, w, support)


def rounding(w: float, dt: float, time: float) -> float:
    """Return how far the angle of a hinge in single precision [rad] moves against its exact one, from the first second.

    Each of its steps is rounded, the more the further it has turned.
    """
    steps = np.full(round(time / dt), np.float32(dt) * np.float32(w), np.float32)
    missing = np.cumsum(steps, dtype=np.float32) - w * dt * np.arange(1, len(steps) + 1)
    return float(np.ptp(missing[round(1.0 / dt) - 1 :]))


def in_mujoco(scene: Turning, time: float) -> tuple[np.ndarray, np.ndarray]:
    """Return times and positions after each step."""
    from planarfriction.adapters.mujoco import Friction

    scene.m.opt.tolerance = (
        1e-14  # beside a heavy table, MuJoCo's solver would let 1e-7 m/s pass
    )
    d = mujoco.MjData(scene.m)
    friction = Friction(scene.m, scene.patches)
    path = []
    d.qpos[:] = scene.qpos
    d.qvel[:] = scene.qvel
    d.ctrl[:] = scene.ctrl
    for _ in range(round(time / scene.m.opt.timestep)):
        d.qvel[:] = scene.driven(np, d.qpos, d.qvel, scene.w, scene.m.opt.timestep)
        friction.step(d)
        path.append(d.qpos.copy())
    return scene.m.opt.timestep * np.arange(1, len(path) + 1), np.array(path)


def in_mjx(
    scenes: list[Turning], time: float, every: int = 50
) -> list[tuple[np.ndarray, np.ndarray]]:
    """Return times and positions of scenes on one support, side by side, every so many steps.

    They may have different speeds, but for those of surfaces, and time steps. Loops of the solver have few rounds, as
    worlds side by side always take them all: results do not need more.
    """
    import jax
    import jax.numpy as jnp
    from mujoco import mjx

    from planarfriction.adapters.mjx import Friction

    first = scenes[0]
    steps = [scene.m.opt.timestep for scene in scenes]
    first.m.opt.iterations = 2
    first.m.opt.ls_iterations = 4
    friction = Friction(first.m, first.patches)
    mx = mjx.put_model(first.m)

    def many(dt, w, d):
        own = mx.tree_replace({"opt.timestep": dt})

        def step(d, _):
            return friction.step(
                own, d.replace(qvel=first.driven(jnp, d.qpos, d.qvel, w, dt))
            ), None

        return jax.lax.scan(step, d, None, length=every)[0]

    def begun(scene):
        start = mujoco.MjData(scene.m)
        start.qpos[:] = scene.qpos
        start.qvel[:] = scene.qvel
        start.ctrl[:] = scene.ctrl
        return mjx.put_data(scene.m, start)

    run = jax.jit(jax.vmap(many))
    path = []
    d = jax.tree.map(lambda *each: jnp.stack(each), *map(begun, scenes))
    dt = jnp.array(steps)
    w = jnp.array([scene.w for scene in scenes])
    for _ in range(round(time / (every * min(steps)))):
        d = run(dt, w, d)
        path.append(np.asarray(d.qpos))
    taken = np.array(path)
    ends = [round(time / (every * each)) for each in steps]
    return [
        (every * steps[i] * np.arange(1, end + 1), taken[:end, i])
        for i, end in enumerate(ends)
    ]
