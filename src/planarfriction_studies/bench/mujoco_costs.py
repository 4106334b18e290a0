# pyright: reportAttributeAccessIssue=false
# (MuJoCo describes few of its names to type checkers.)
"""Costs of patch friction in MuJoCo, beside MuJoCo's own in turns: a tray of blocks, a grip at rest, roll-outs."""

from __future__ import annotations

import contextlib
import dataclasses
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from planarfriction_studies.bench import mujoco_scenes
from planarfriction_studies.bench.measurement import Measurement, line
from planarfriction_studies.bench.mujoco_scenes import MujocoScene, Native

ROUNDS, STEPS = 15, 300
"""Rounds in turns, and steps of each."""

ENVIRONMENTS, THREADS = 16, 2


def tray(full: bool, blocks: int) -> Measurement:
    """Measure a step of a tray with so many blocks."""
    return _beside_own(mujoco_scenes.tray, blocks)


def grip(full: bool) -> Measurement:
    """Measure a step of a grip at rest."""
    return _beside_own(mujoco_scenes.grip)


def rollout(full: bool) -> Measurement:
    """Measure a step of a tray of two blocks, in roll-outs on threads."""
    return _beside_own(mujoco_scenes.tray, 2, rolled=True)


def _beside_own(make: Callable[..., MujocoScene], *arguments: int, rolled: bool = False) -> Measurement:
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
    one, other = np.median([[action() for action in actions] for _ in range(ROUNDS)], axis=0)
    return float(one), float(other)


def _steps(scene: MujocoScene, m: Any, d: Any, step: Callable[[Any], None]) -> Callable[[], float]:
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
    starts, data = np.tile(start, (ENVIRONMENTS, 1)), [mujoco.MjData(m) for _ in range(THREADS)]
    controls = np.array([scene.control(i * m.opt.timestep) for i in range(STEPS)])
    controls = np.tile(controls, (ENVIRONMENTS, 1, 1))

    def action() -> float:
        begin = time.perf_counter()
        rollout.rollout(m, data, starts, controls)
        return (time.perf_counter() - begin) / (ENVIRONMENTS * STEPS)

    return action
