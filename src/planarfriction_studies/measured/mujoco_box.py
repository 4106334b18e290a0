"""MuJoCo's box on the slides: what a user of that simulator gets with its own contact and friction."""

from __future__ import annotations

import dataclasses
import importlib
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from planarfriction_studies.measured import fitting, slide_integrator
from planarfriction_studies.measured.questions import FIRST_POSES, Case, SlideQuestion

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
class MujocoBox:
    """A box on a plane in MuJoCo: contacts at its corners, elliptic cones, condim 3; slides only."""

    mu: float = fitting.MU
    _made: dict[float, Any] = field(default_factory=dict, repr=False, compare=False)

    def __call__(self, question: SlideQuestion) -> np.ndarray:
        """Return poses of one slide."""
        if question.task != "slides":
            raise NotImplementedError
        begun = self._start(question)
        return self._poses(question, begun, question.time)

    def answer_all(self, questions: Sequence[Any]) -> list[np.ndarray]:
        """Return poses of all slides."""
        return [self(question) for question in questions]

    def fit(self, cases: Sequence[Case]) -> MujocoBox:
        """Fit the friction coefficient to the training slides."""
        if cases[0].question.task != "slides":
            return self
        radius = cases[0].question.patch.contact_radius()
        predict = lambda values, asked: dataclasses.replace(self, mu=float(values[0]), _made={}).answer_all(asked)  # noqa: E731
        return dataclasses.replace(
            self, mu=float(fitting.fit_slides(predict, [fitting.MU], cases, radius)[0]), _made={}
        )

    def fitted_values(self) -> dict[str, float]:
        """Return the fitted numbers by name."""
        return {"mu": self.mu}

    def _start(self, question: SlideQuestion) -> np.ndarray:
        """Improve the start by one Gauss-Newton step from a parabola through the first poses, as for the other
        models."""
        begun, time = slide_integrator.parabolas([question])[0], question.time[:FIRST_POSES]
        weights = np.array([1.0, 1.0, np.sqrt(question.inertia / question.mass)])
        poses = self._poses(question, begun, time)
        slopes = np.zeros((FIRST_POSES, 3, 6))
        slopes[:, [0, 1, 2], [0, 1, 2]] = 1.0
        for i, change in enumerate(slide_integrator.CHANGES):
            moved = begun + change * np.eye(6)[3 + i]
            slopes[:, :, 3 + i] = (self._poses(question, moved, time) - poses) / change
        rows, off = (slopes * weights[:, None]).reshape(-1, 6), ((question.first - poses) * weights).ravel()
        return begun + np.linalg.lstsq(rows, off, rcond=None)[0]

    def _poses(self, question: SlideQuestion, start: np.ndarray, time: np.ndarray) -> np.ndarray:
        mujoco = _mujoco()
        model, data, rest = self._box(question)
        mujoco.mj_resetData(model, data)
        data.qpos[:] = rest
        data.qpos[:2] = start[:2]
        data.qpos[3:7] = [np.cos(0.5 * start[2]), 0.0, 0.0, np.sin(0.5 * start[2])]
        data.qvel[:] = [start[3], start[4], 0.0, 0.0, 0.0, start[5]]
        steps = int(np.ceil(time[-1] / STEP)) + 1
        rows, angle = np.empty((steps + 1, 3)), start[2]
        rows[0] = start[:3]
        for i in range(1, steps + 1):
            mujoco.mj_step(model, data)
            w, _, _, z = data.qpos[3:7]
            turned = 2.0 * np.arctan2(z, w)
            angle += np.remainder(turned - angle + np.pi, 2.0 * np.pi) - np.pi
            rows[i] = data.qpos[0], data.qpos[1], angle
        at = STEP * np.arange(steps + 1)
        return np.stack([np.interp(time, at, column) for column in rows.T], axis=1)

    def _box(self, question: SlideQuestion) -> tuple[Any, Any, np.ndarray]:
        """Return the model, data, and the place of the box when it stands on the table."""
        if self.mu not in self._made:
            mujoco = _mujoco()
            half = 0.5 * float(np.sqrt(question.patch.areas.sum()))
            scene = SCENE.format(
                step=STEP, mu=self.mu, height=question.height, half=half, mass=question.mass, inertia=question.inertia
            )
            model = mujoco.MjModel.from_xml_string(scene)
            data = mujoco.MjData(model)
            for _ in range(int(SETTLED / STEP)):
                mujoco.mj_step(model, data)
            self._made[self.mu] = model, data, data.qpos.copy()
        return self._made[self.mu]
