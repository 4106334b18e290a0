# pyright: reportAttributeAccessIssue=false
# (MuJoCo describes few of its names to type checkers.)
"""MuJoCo with its own friction at several settings, and with patches of this library."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from planarfriction_studies.referee.case import Case
from planarfriction_studies.referee.engines import lacks, patches
from planarfriction_studies.referee.export import mjcf


@dataclass(frozen=True)
class Mujoco:
    """MuJoCo with options of its own friction, or with a model of patches."""

    name: str
    settings: str
    options: str = ""
    contact: str = 'condim="3"'
    integrator: str = "Euler"
    kind: str | None = None
    """Model of patches."""
    package: str = "mujoco"

    def cannot(self, case: Case) -> str | None:
        """Return what MuJoCo has no words for: it has no Stribeck curve, and patches have."""
        return lacks(case, anisotropy=True, stribeck=self.kind is not None)

    def build(self, case: Case, dt: float) -> MujocoWorld:
        """Build the MJCF of a case."""
        m, own = self.compiled(case, dt)
        if not own:
            return MujocoWorld(case, m)
        from planarfriction.adapters.mujoco import Friction

        return MujocoWorld(case, m, Friction(m, own))

    def compiled(self, case: Case, dt: float) -> tuple[Any, list[Any]]:
        """Return the model of a case, and its patches, for which it is prepared; none for MuJoCo's own friction."""
        import mujoco

        text = mjcf(case, dt, self.options, self.contact, self.integrator)
        if self.kind is None:
            return mujoco.MjModel.from_xml_string(text), []
        from planarfriction.adapters.mujoco import PatchContact, prepare

        spec = mujoco.MjSpec.from_string(text)
        own = [
            PatchContact(
                patches.model(contact, self.kind), site=f"patch {i}", geoms=contact.pair
            )
            for i, contact in enumerate(case.contacts)
        ]
        prepare(spec, own)
        return spec.compile(), own


class MujocoWorld:
    """A case in MuJoCo."""

    def __init__(self, case: Case, m: Any, friction: Any = None) -> None:
        import mujoco

        self.m = m
        self.d = mujoco.MjData(m)
        self.case = case
        self._step = (
            (lambda: mujoco.mj_step(m, self.d))
            if friction is None
            else (lambda: friction.step(self.d))
        )
        self.bodies = [m.body(body.name).id for body in case.moving]
        mujoco.mj_forward(m, self.d)

    def step(self, wrenches: np.ndarray) -> None:
        """Make a step."""
        self.d.xfrc_applied[self.bodies] = wrenches
        self._step()

    def poses(self) -> tuple[np.ndarray, np.ndarray]:
        """Return positions and rotations, which MuJoCo computes at the beginning of a step."""
        import mujoco

        mujoco.mj_kinematics(self.m, self.d)
        return self.d.xpos[self.bodies].copy(), self.d.xmat[self.bodies].reshape(
            -1, 3, 3
        ).copy()

    def throw(self, body: int, velocity: np.ndarray) -> None:
        """Set the velocity of the body's origin, and the angular velocity in its own axes."""
        at = self.m.jnt_dofadr[self.m.body_jntadr[self.bodies[body]]]
        rotation = self.d.xmat[self.bodies[body]].reshape(3, 3)
        lever = rotation @ np.array(self.case.moving[body].centre_of_mass)
        self.d.qvel[at : at + 3] = velocity[:3] - np.cross(velocity[3:], lever)
        self.d.qvel[at + 3 : at + 6] = rotation.T @ velocity[3:]


ELLIPTIC = 'cone="elliptic" impratio="10"'
"""Options of MuJoCo that its documentation advises against slip."""

NOSLIP = f'{ELLIPTIC} noslip_iterations="10"'
STIFF = (
    'cone="elliptic" impratio="100" noslip_iterations="10"',
    'condim="3" solref="0.004 1"',
    "implicitfast",
)
"""Options, attributes of pairs and integrator of the stiffest contacts."""

ENGINES = [
    Mujoco("MuJoCo", "as it comes: pyramidal cone, impratio 1, condim 3, Euler"),
    Mujoco("MuJoCo, elliptic", "elliptic cone, impratio 10, condim 3, implicitfast", ELLIPTIC,
           integrator="implicitfast"),
    Mujoco("MuJoCo, noslip", "elliptic cone, impratio 10, condim 3, implicitfast, noslip_iterations 10", NOSLIP,
           integrator="implicitfast"),
    Mujoco("MuJoCo, stiff",
           "elliptic cone, impratio 100, noslip_iterations 10, solref 0.004 1, condim 3, implicitfast", *STIFF),
    Mujoco(
        "MuJoCo, patches", "planarfriction: ReducedModel, 21 cells across, implicitfast",
        integrator="implicitfast", kind="reduced",
    ),
    Mujoco(
        "MuJoCo, cells", "planarfriction: DistributedModel, 21 cells across, implicitfast",
        integrator="implicitfast", kind="distributed",
    ),
]  # fmt: skip
