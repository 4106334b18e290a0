# pyright: reportAttributeAccessIssue=false
# (MuJoCo and JAX describe few of their names to type checkers.)
"""Discs that slide and spin in MJX, side by side: what patch friction costs over its own."""

from __future__ import annotations

import statistics
from collections.abc import Callable
from typing import Any

import numpy as np

from planarfriction_studies.bench.measurement import Measurement, line, once
from planarfriction_studies.bench.mujoco_scenes import Native, disc

ENVIRONMENTS = 16

STEPS, ROUNDS = 100, 5
"""Steps of a timed roll-out (0.2 s, in which all discs slide), and rounds in which both ways take turns."""


def discs(full: bool) -> Measurement:
    """Measure a step of one of `ENVIRONMENTS` that `vmap` steps at once, with patch friction and with MJX's own.

    In turns, both in double precision. Raises `MissingExtraError` without MJX.
    """
    from planarfriction.adapters import mjx as adapter  # before anything else: its error names the missing extra

    # isort: split
    import jax
    from mujoco import mjx

    before = jax.config.jax_enable_x64
    jax.config.update("jax_enable_x64", True)
    try:
        scene = disc(1.0, 10.0)
        text = scene.text(Native(cone="pyramidal", impratio=1.0, condim=1), 2e-3, "Euler")
        m, prepared, friction = scene.with_patches(adapter, text)
        runs = _rolled(friction.step, m, prepared), _rolled(mjx.step, *scene.native(Native()))
        times = np.array([[once(run) for run in runs] for _ in range(ROUNDS)]) / (STEPS * ENVIRONMENTS)
    finally:
        jax.config.update("jax_enable_x64", before)
    value, theirs = (statistics.median(column) * 1e6 for column in times.T)
    words = (
        f"MJX's own friction, condim 4, elliptic, impratio 10 (patch friction costs {value / theirs:.2g} times as much)"
    )
    return line(value, "us per step", words, theirs)


def _rolled(step: Callable[..., Any], m: Any, d: Any) -> Callable[[], None]:
    """Return a compiled roll-out of discs with different starts, whose contact has settled."""
    import jax
    import jax.numpy as jnp
    import mujoco
    from mujoco import mjx

    for _ in range(300):
        mujoco.mj_step(m, d)
    mx, data = mjx.put_model(m), mjx.put_data(m, d)
    speeds, spins = jnp.linspace(0.8, 1.2, ENVIRONMENTS), jnp.linspace(20.0, 5.0, ENVIRONMENTS)

    @jax.jit
    def roll(mx, speeds, spins):
        def one(speed, spin):
            start = data.replace(qvel=jnp.array([speed, 0.0, 0.0, spin]))

            def next_step(d, _):
                # in double precision MJX makes long integers of some that came in short
                return jax.tree.map(lambda after, given: after.astype(given.dtype), step(mx, d), d), None

            return jax.lax.scan(next_step, start, None, length=STEPS)[0].qpos

        return jax.vmap(one)(speeds, spins)

    def run() -> None:
        roll(mx, speeds, spins).block_until_ready()

    run()
    return run
