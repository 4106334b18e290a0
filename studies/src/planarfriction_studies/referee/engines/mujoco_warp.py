# pyright: reportAttributeAccessIssue=false
"""MuJoCo Warp with its own friction, and with patches of this library, in single precision on Warp's CPU device."""

from __future__ import annotations

import logging
from dataclasses import dataclass
from typing import Any

import numpy as np

from planarfriction_studies.referee.case import Case
from planarfriction_studies.referee.engines.mujoco import (
    ELLIPTIC,
    NOSLIP,
    STIFF,
    Mujoco,
    MujocoWorld,
)

ROOM = 400
"""Room for the contacts and for the constraints of a case."""


@dataclass(frozen=True)
class MujocoWarp(Mujoco):
    """MuJoCo Warp with options of its own friction, or with a model of patches."""

    package: str = "mujoco-warp"

    def build(self, case: Case, dt: float) -> MujocoWarpWorld:
        """Build the MJCF of a case."""
        return MujocoWarpWorld(case, *self.compiled(case, dt))


class MujocoWarpWorld(MujocoWorld):
    """A case in MuJoCo Warp, whose positions are copied to MuJoCo after each step."""

    def __init__(self, case: Case, m: Any, patches: list[Any]) -> None:
        import mujoco_warp
        import warp

        warp.config.log_level = logging.ERROR  # it reports what it compiles
        super().__init__(case, m)
        with warp.ScopedDevice("cpu"):
            model = mujoco_warp.put_model(m)
            data = mujoco_warp.put_data(m, self.d, nconmax=ROOM, njmax=ROOM)
            self.data, self._step = data, lambda: mujoco_warp.step(model, data)
            if patches:
                from planarfriction.adapters.mujoco_warp import Friction

                self._step = Friction(m, patches, model=model, data=data).step

    def step(self, wrenches: np.ndarray) -> None:
        """Make a step."""
        self.d.xfrc_applied[self.bodies] = wrenches
        self.data.xfrc_applied.assign(self.d.xfrc_applied[None].astype(np.float32))
        self._step()
        self.d.qpos[:] = self.data.qpos.numpy()[0]

    def throw(self, body: int, velocity: np.ndarray) -> None:
        """Set the velocity of the body's origin, and the angular velocity in its own axes."""
        self.d.qvel[:] = self.data.qvel.numpy()[0]
        super().throw(body, velocity)
        self.data.qvel.assign(self.d.qvel[None].astype(np.float32))


_CPU = "single precision, Warp's CPU device"

ENGINES = [
    MujocoWarp("MuJoCo Warp", f"as it comes: pyramidal cone, impratio 1, condim 3, Euler; {_CPU}"),
    MujocoWarp("MuJoCo Warp, elliptic", f"elliptic cone, impratio 10, condim 3, implicitfast; {_CPU}", ELLIPTIC,
               integrator="implicitfast"),
    MujocoWarp("MuJoCo Warp, noslip",
               f"elliptic cone, impratio 10, condim 3, implicitfast, noslip_iterations 10; {_CPU}", NOSLIP,
               integrator="implicitfast"),
    MujocoWarp("MuJoCo Warp, stiff", "elliptic cone, impratio 100, noslip_iterations 10, solref 0.004 1, condim 3, "
               f"implicitfast; {_CPU}", *STIFF),
    MujocoWarp("MuJoCo Warp, patches", f"planarfriction: ReducedModel, 21 cells across, implicitfast; {_CPU}",
               integrator="implicitfast", kind="reduced"),
]  # fmt: skip
