# pyright: reportAttributeAccessIssue=false
# (MuJoCo and JAX describe few of their names to type checkers.)
"""Costs of patch friction in MuJoCo, MJX and MuJoCo Warp, beside the simulators' own friction in turns."""

from __future__ import annotations

import contextlib
import dataclasses
import logging
import statistics
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from planarfriction_studies.bench import mujoco_scenes
from planarfriction_studies.bench.measurement import Measurement, line, once
from planarfriction_studies.bench.mujoco_scenes import MujocoScene, Native

ROUNDS, STEPS = 15, 300
"""Rounds in turns, and steps of each, in MuJoCo."""

ENVIRONMENTS, THREADS = 16, 2
"""Environments of rollouts in MuJoCo and in MJX, and threads."""


def mujoco_tray(full: bool, blocks: int) -> Measurement:
    """Measure a step of a tray with so many blocks."""
    return _beside_own(mujoco_scenes.tray, blocks)


def mujoco_grip(full: bool) -> Measurement:
    """Measure a step of a grip at rest."""
    return _beside_own(mujoco_scenes.grip)


def mujoco_rollout(full: bool) -> Measurement:
    """Measure a step of a tray of two blocks, in rollouts on threads."""
    return _beside_own(mujoco_scenes.tray, 2, rolled=True)


def _beside_own(
    make: Callable[..., MujocoScene], *arguments: int, rolled: bool = False
) -> Measurement:
    """Measure a scene with patches and with MuJoCo's own friction. Raises `MissingExtraError` without MuJoCo."""
    scene = dataclasses.replace(make(*arguments), weightless=False, time=0.0)
    m, d, friction = scene.ours()  # says how to install MuJoCo
    import mujoco

    own = m, d, friction.step
    model, data = scene.native(Native())
    native = model, data, lambda data: mujoco.mj_step(model, data)
    for m, d, step in (own, native):
        scene.run(m, d, lambda d=d, step=step: step(d))
    measure = _rollouts if rolled else _steps
    with friction.install() if rolled else contextlib.nullcontext():
        value, theirs = _in_turns(*(measure(scene, *each) for each in (own, native)))
    words = f"MuJoCo's own, condim 4, elliptic, impratio 10 (patch friction costs {value / theirs:.2f} times as much)"
    return line(value * 1e6, "us per step", words, theirs * 1e6)


def _in_turns(*actions: Callable[[], float]) -> tuple[float, float]:
    """Return the median of each action's results, over rounds in which they take turns."""
    for action in actions:
        action()
    one, other = np.median(
        [[action() for action in actions] for _ in range(ROUNDS)], axis=0
    )
    return float(one), float(other)


def _steps(
    scene: MujocoScene, m: Any, d: Any, step: Callable[[Any], None]
) -> Callable[[], float]:
    """Return seconds per step, always of the same steps."""
    import mujoco

    saved = np.zeros(mujoco.mj_stateSize(m, mujoco.mjtState.mjSTATE_INTEGRATION))
    mujoco.mj_getState(m, d, saved, mujoco.mjtState.mjSTATE_INTEGRATION)
    controls = [scene.control(i * m.opt.timestep) for i in range(STEPS)]

    def action() -> float:
        mujoco.mj_setState(m, d, saved, mujoco.mjtState.mjSTATE_INTEGRATION)
        begin = time.perf_counter()
        for control in controls:
            d.ctrl[:] = control
            step(d)
        return (time.perf_counter() - begin) / STEPS

    return action


def _rollouts(scene: MujocoScene, m: Any, d: Any, _: Any) -> Callable[[], float]:
    """Return seconds per step of one environment, of `ENVIRONMENTS` on `THREADS`."""
    import mujoco
    from mujoco import rollout

    full = mujoco.mjtState.mjSTATE_FULLPHYSICS
    start = np.zeros(mujoco.mj_stateSize(m, full))
    mujoco.mj_getState(m, d, start, full)
    starts = np.tile(start, (ENVIRONMENTS, 1))
    data = [mujoco.MjData(m) for _ in range(THREADS)]
    controls = np.array([scene.control(i * m.opt.timestep) for i in range(STEPS)])
    controls = np.tile(controls, (ENVIRONMENTS, 1, 1))

    def action() -> float:
        begin = time.perf_counter()
        rollout.rollout(m, data, starts, controls)
        return (time.perf_counter() - begin) / (ENVIRONMENTS * STEPS)

    return action


MJX_STEPS, MJX_ROUNDS = 100, 5
"""Steps of a timed rollout (0.2 s, in which all discs slide), and rounds in which both ways take turns."""


def mjx_discs(full: bool) -> Measurement:
    """Measure a step of one of `ENVIRONMENTS` that `vmap` steps at once, with patch friction and with MJX's own.

    In turns, both in double precision. Raises `MissingExtraError` without MJX.
    """
    # Before anything else: its error names the missing extra.
    from planarfriction.adapters import (
        mjx as adapter,
    )

    # isort: split
    import jax
    from mujoco import mjx

    before = jax.config.jax_enable_x64
    jax.config.update("jax_enable_x64", True)
    try:
        scene = mujoco_scenes.disc(1.0, 10.0)
        text = scene.text(
            Native(cone="pyramidal", impratio=1.0, condim=1), 2e-3, "Euler"
        )
        m, prepared, friction = scene.with_patches(adapter, text)
        runs = (
            _rolled(friction.step, m, prepared),
            _rolled(mjx.step, *scene.native(Native())),
        )
        times = np.array([[once(run) for run in runs] for _ in range(MJX_ROUNDS)]) / (
            MJX_STEPS * ENVIRONMENTS
        )
    finally:
        jax.config.update("jax_enable_x64", before)
    value, theirs = (statistics.median(column) * 1e6 for column in times.T)
    times = f"patch friction costs {value / theirs:.2g} times as much"
    words = f"MJX's own friction, condim 4, elliptic, impratio 10 ({times})"
    return line(value, "us per step", words, theirs)


WORLDS, NJMAX = 64, 200
"""Worlds of MuJoCo Warp, and the room for the constraints of each."""


def mujoco_warp(full: bool, scene: MujocoScene) -> Measurement:
    """Measure a step of one of `WORLDS` in MuJoCo Warp on Warp's CPU device, with patch friction and with its own.

    In turns, after steps in which contacts settle. Raises `MissingExtraError` without MuJoCo Warp.
    """
    # Before anything else: its error names the extra.
    from planarfriction.adapters import (
        mujoco_warp as adapter,
    )

    # isort: split
    import mujoco
    import mujoco_warp as mjw
    import warp as wp

    wp.config.log_level = logging.ERROR  # it reports what it compiles
    text = scene.text(Native(cone="pyramidal", impratio=1.0, condim=1), 2e-3, "Euler")
    spec = mujoco.MjSpec.from_string(text)
    patches = [
        adapter.PatchContact(scene.model, site=site, geoms=geoms)
        for site, geoms in scene.patches
    ]
    adapter.prepare(spec, patches)
    m = spec.compile()
    friction = adapter.Friction(m, patches, worlds=WORLDS, njmax=NJMAX)
    own, d = scene.native(Native(cone="pyramidal", impratio=1.0))
    model = mjw.put_model(own)
    data = mjw.put_data(own, d, nworld=WORLDS, njmax=NJMAX)
    for each in (friction.data, data):
        if m.nu:
            each.ctrl.assign(
                np.tile(scene.control(0.0), (WORLDS, 1)).astype(np.float32)
            )
        if scene.start is not None:
            each.qvel.assign(np.tile(scene.start, (WORLDS, 1)).astype(np.float32))
    runs = friction.step, lambda: mjw.step(model, data)
    for run in runs * 100:
        run()
    wp.synchronize()
    times = np.array([[once(run) for run in runs] for _ in range(STEPS)]) / WORLDS
    value, theirs = (statistics.median(column) * 1e6 for column in times.T)
    words = f"MuJoCo Warp's own friction, condim 4, pyramidal (patch friction costs {value / theirs:.2g} times as much)"
    return line(value, "us per step", words, theirs)


def _rolled(step: Callable[..., Any], m: Any, d: Any) -> Callable[[], None]:
    """Return a compiled rollout of discs with different starts, whose contact has settled."""
    import jax
    import jax.numpy as jnp
    import mujoco
    from mujoco import mjx

    for _ in range(300):
        mujoco.mj_step(m, d)
    mx = mjx.put_model(m)
    data = mjx.put_data(m, d)
    speeds = jnp.linspace(0.8, 1.2, ENVIRONMENTS)
    spins = jnp.linspace(20.0, 5.0, ENVIRONMENTS)

    @jax.jit
    def roll(mx, speeds, spins):
        def one(speed, spin):
            start = data.replace(qvel=jnp.array([speed, 0.0, 0.0, spin]))

            def next_step(d, _):
                # in double precision MJX makes long integers of some that came in short
                return jax.tree.map(
                    lambda after, given: after.astype(given.dtype), step(mx, d), d
                ), None

            return jax.lax.scan(next_step, start, None, length=MJX_STEPS)[0].qpos

        return jax.vmap(one)(speeds, spins)

    def run() -> None:
        roll(mx, speeds, spins).block_until_ready()

    run()
    return run
