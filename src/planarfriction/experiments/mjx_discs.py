# pyright: reportAttributeAccessIssue=false
# (MuJoCo and JAX describe few of their names to type checkers.)
"""Discs that slide and spin in MJX, side by side: what patch friction costs over its own."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from typing import Any

from planarfriction.experiments.mujoco_scenes import Native, disc

STEPS = 100
"""Of a roll-out that is timed: 0.2 s, in which all slide."""

ROUNDS = 5


def cost(environments: int) -> tuple[float, float]:
    """Time [s] of a step of all `environments` by `vmap`, with patch friction and with MJX's own of condim 4.

    Both in double precision, measured in turns. Raises `MissingExtraError` without MJX.
    """
    adapter = _adapter()
    import jax
    from mujoco import mjx

    before = jax.config.jax_enable_x64
    jax.config.update("jax_enable_x64", True)
    try:
        m, prepared, friction = _ours(adapter)
        own, native = disc(1.0, 10.0).native(Native())
        runs = [
            _rolled(friction.step, m, prepared, environments),
            _rolled(mjx.step, own, native, environments),
        ]
        times: list[list[float]] = [[], []]
        for _ in range(ROUNDS):
            for run, spent in zip(runs, times, strict=True):
                begin = time.perf_counter()
                run()
                spent.append((time.perf_counter() - begin) / STEPS)
    finally:
        jax.config.update("jax_enable_x64", before)
    ours, theirs = map(statistics.median, times)
    return ours, theirs


def _adapter() -> Any:
    """First of all, as it says which extra is missing."""
    from planarfriction.adapters import mjx

    return mjx


def _ours(adapter: Any) -> tuple[Any, Any, Any]:
    import mujoco

    scene = disc(1.0, 10.0)
    patches = [adapter.Patch(scene.model, site=site, geoms=geoms) for site, geoms in scene.patches]
    native = Native(cone="pyramidal", impratio=1.0, condim=1, solref=0.02)
    spec = mujoco.MjSpec.from_string(scene.text(native, 2e-3, "Euler"))
    adapter.prepare(spec, patches)
    m = spec.compile()
    return m, mujoco.MjData(m), adapter.Friction(m, patches)


def _rolled(step: Callable[..., Any], m: Any, d: Any, environments: int) -> Callable[[], None]:
    """A compiled roll-out of discs with different starts, whose contact has settled."""
    import jax
    import jax.numpy as jnp
    import mujoco
    from mujoco import mjx

    for _ in range(300):
        mujoco.mj_step(m, d)
    mx, data = mjx.put_model(m), mjx.put_data(m, d)
    speeds, spins = jnp.linspace(0.8, 1.2, environments), jnp.linspace(20.0, 5.0, environments)

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
