"""MuJoCo's box on the slides: what a user of that simulator gets with its own contact and friction."""

from __future__ import annotations

import functools
import importlib
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from planarfriction_studies.measured.models import SlideFit
from planarfriction_studies.measured.questions import FIRST_POSES, SlideQuestion
from planarfriction_studies.measured.slide_integrator import MU, improved, parabolas

STEP = 2e-3
"""Time step, MuJoCo's default [s]."""

SETTLED = 0.2
"""Time that the box is given to come to rest on the table before it is thrown [s]."""

SCENE = """
<mujoco>
  <option timestep="{step}" cone="elliptic" impratio="10"/>
  <worldbody>
    <geom name="table" type="plane" size="2 2 0.1" condim="3" friction="{mu} 0 0"/>
    <body name="box" pos="0 0 {height}">
      <freejoint/>
      <inertial pos="0 0 0" mass="{mass}" diaginertia="{inertia} {inertia} {inertia}"/>
      <geom type="box" size="{half} {half} {height}" condim="3" friction="{mu} 0 0"/>
    </body>
  </worldbody>
</mujoco>
"""


def _mujoco() -> Any:
    """Import MuJoCo, whose names come from compiled code that type checkers do not see."""
    return importlib.import_module("mujoco")


@dataclass(frozen=True)
class MujocoBox(SlideFit):
    """A box on a plane in MuJoCo: contacts at its corners, elliptic cones, condim 3; slides only."""

    tasks = ("slides",)

    mu: float = MU

    def _answers(self, questions: Sequence[Any]) -> list[np.ndarray]:
        return [
            self._poses(question, self._start(question), question.time)
            for question in questions
        ]

    def _start(self, question: SlideQuestion) -> np.ndarray:
        """Improve the start by one Gauss-Newton step from a parabola through the first poses, as for other models."""
        time = question.time[:FIRST_POSES]
        poses_of = lambda starts: np.array(
            [self._poses(question, each, time) for each in starts]
        )
        begun = parabolas([question])
        first = question.first[None]
        return improved(poses_of, begun, first, question.inertia / question.mass)[0]

    def _poses(
        self, question: SlideQuestion, start: np.ndarray, time: np.ndarray
    ) -> np.ndarray:
        mujoco = _mujoco()
        half = 0.5 * float(np.sqrt(question.patch.areas.sum()))
        model, data, rest = _box(
            self.mu, half, question.height, question.mass, question.inertia
        )
        mujoco.mj_resetData(model, data)
        data.qpos[:] = rest
        data.qpos[:2] = start[:2]
        data.qpos[3:7] = [np.cos(0.5 * start[2]), 0.0, 0.0, np.sin(0.5 * start[2])]
        data.qvel[:] = [start[3], start[4], 0.0, 0.0, 0.0, start[5]]
        steps = int(np.ceil(time[-1] / STEP)) + 1
        rows = np.empty((steps + 1, 3))
        angle = start[2]
        rows[0] = start[:3]
        for i in range(1, steps + 1):
            mujoco.mj_step(model, data)
            w, _, _, z = data.qpos[3:7]
            turned = 2.0 * np.arctan2(z, w)
            angle += np.remainder(turned - angle + np.pi, 2.0 * np.pi) - np.pi
            rows[i] = data.qpos[0], data.qpos[1], angle
        at = STEP * np.arange(steps + 1)
        return np.stack([np.interp(time, at, column) for column in rows.T], axis=1)


@functools.lru_cache(maxsize=8)
def _box(
    mu: float, half: float, height: float, mass: float, inertia: float
) -> tuple[Any, Any, np.ndarray]:
    """Return the model, data, and the place of the box when it stands on the table."""
    mujoco = _mujoco()
    scene = SCENE.format(
        step=STEP, mu=mu, height=height, half=half, mass=mass, inertia=inertia
    )
    model = mujoco.MjModel.from_xml_string(scene)
    data = mujoco.MjData(model)
    for _ in range(int(SETTLED / STEP)):
        mujoco.mj_step(model, data)
    return model, data, data.qpos.copy()
