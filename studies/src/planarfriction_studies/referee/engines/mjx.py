# pyright: reportAttributeAccessIssue=false
"""MJX with its own friction, and with patches of this library, in single precision, in which JAX comes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from planarfriction_studies.referee.case import Case
from planarfriction_studies.referee.engines.mujoco import ELLIPTIC, Mujoco, MujocoWorld


@dataclass(frozen=True)
class Mjx(Mujoco):
    """MJX with options of its own friction, or with a model of patches."""

    package: str = "mujoco-mjx"

    def build(self, case: Case, dt: float) -> MjxWorld:
        """Build the MJCF of a case."""
        return MjxWorld(case, *self.compiled(case, dt))


class MjxWorld(MujocoWorld):
    """A case in MJX, whose positions are copied to MuJoCo after each step."""

    def __init__(self, case: Case, m: Any, patches: list[Any]) -> None:
        import jax
        from mujoco import mjx

        super().__init__(case, m)
        model = mjx.put_model(m)
        self.data = mjx.put_data(m, self.d)
        step = mjx.step
        if patches:
            from planarfriction.adapters.mjx import Friction

            step = Friction(m, patches).step
        self._stepped = jax.jit(
            lambda data, forces: step(model, data.replace(xfrc_applied=forces))
        )

    def step(self, wrenches: np.ndarray) -> None:
        """Make a step."""
        self.d.xfrc_applied[self.bodies] = wrenches
        self.data = self._stepped(self.data, self.d.xfrc_applied.astype(np.float32))
        self.d.qpos[:] = self.data.qpos

    def throw(self, body: int, velocity: np.ndarray) -> None:
        """Set the velocity of the body's origin, and the angular velocity in its own axes."""
        self.d.qvel[:] = self.data.qvel
        super().throw(body, velocity)
        self.data = self.data.replace(qvel=self.d.qvel.astype(np.float32))


ENGINES = [
    Mjx("MJX", "as it comes: pyramidal cone, impratio 1, condim 3, Euler; single precision"),
    Mjx("MJX, elliptic", "elliptic cone, impratio 10, condim 3, implicitfast; single precision", ELLIPTIC,
        integrator="implicitfast"),
    Mjx("MJX, patches", "planarfriction: ReducedModel, 21 cells across, implicitfast; single precision",
        integrator="implicitfast", kind="reduced"),
]  # fmt: skip
