# pyright: reportArgumentType=false, reportCallIssue=false
# (Drake describes arrays to type checkers in a way that no array fits.)
"""Scenes in Drake in which friction decides: a disc that slides and spins to rest, and a box that an incline holds.

Each comes with Drake's own friction or with a patch. Needs Drake when it is built.
"""

from __future__ import annotations

import math
import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple

import numpy as np

from planarfriction.laws import LuGre
from planarfriction.models import FrictionModel, ReducedModel
from planarfriction.patch import ContactPatch
from planarfriction.scenes.ready import GRAVITY


class Way(NamedTuple):
    """Settings of a contact."""

    contact: Literal["point", "hydroelastic"]
    approximation: str = "lagged"
    """Approximation of the contact solver: tamsi, sap, similar, lagged."""
    patch: bool = False
    """True for the friction of a patch, False for Drake's own."""


@dataclass(frozen=True)
class DrakeScene:
    """A body of 0.2 kg on a floor: a disc of radius 0.1 m, or a box of 0.1 m."""

    shape: Literal["disc", "box"]
    mu: float
    tilt: float = 0.0
    """Tilt of the floor [rad]."""

    @property
    def height(self) -> float:
        """Height of the centre of mass above the bottom face [m]."""
        return 0.002 if self.shape == "disc" else 0.02

    @property
    def model(self) -> FrictionModel:
        """Friction of its patch."""
        law = LuGre(mu_c=self.mu, mu_s=self.mu, sigma_0=1e5, sigma_1=0.0, sigma_2=0.0, elasto_plastic=0.9)
        if self.shape == "disc":
            return ReducedModel(ContactPatch.disc(radius=0.1, cells=41), law, parts=1)
        return ReducedModel(ContactPatch.rectangle(0.1, cells=21), law, parts=1)

    def build(self, way: Way, dt: float) -> tuple[Any, Any, Any]:
        """Return a simulator, its plant, and the plant's context."""
        from pydrake.multibody.plant import AddMultibodyPlant, MultibodyPlantConfig
        from pydrake.systems.analysis import Simulator
        from pydrake.systems.framework import DiagramBuilder

        options = {"contact_model": "hydroelastic_with_fallback", "discrete_contact_approximation": way.approximation}
        builder = DiagramBuilder()
        plant, scene_graph = AddMultibodyPlant(MultibodyPlantConfig(time_step=dt, **options), builder)
        self._furnish(plant, way.contact)
        if way.patch:
            from planarfriction.adapters.drake import Friction, PatchContact, prepare

            patches = [PatchContact(self.model, frame="bottom", geometries=("floor", "body"))]
            prepare(plant, scene_graph, patches)
            Friction.AddToBuilder(builder, plant, scene_graph, patches)
        simulator = Simulator(builder.Build())
        return simulator, plant, plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())

    def _furnish(self, plant: Any, contact: str) -> None:
        from pydrake.geometry import Box, Cylinder, HalfSpace, Sphere
        from pydrake.math import RigidTransform
        from pydrake.multibody.tree import FixedOffsetFrame, SpatialInertia, UnitInertia

        origin, up = np.zeros(3), np.array([0.0, 0.0, 1.0])
        disc, height = self.shape == "disc", self.height
        inertia = UnitInertia.SolidCylinder(0.1, 0.004, up) if disc else UnitInertia.SolidBox(0.1, 0.1, 0.04)
        body = plant.AddRigidBody("body", SpatialInertia(0.2, origin, inertia))
        soft, rigid = self._material(contact, rigid=False), self._material(contact, rigid=True)
        if contact == "hydroelastic":
            solid = Cylinder(0.1, 0.004) if disc else Box(0.1, 0.1, 0.04)
            plant.RegisterCollisionGeometry(body, RigidTransform(), solid, "solid", soft)
        else:
            around = np.array([[1, 0], [0, 1], [-1, 0], [0, -1]])
            corners = 0.1 * around if disc else 0.05 * (around + np.roll(around, 1, axis=0))
            for i, corner in enumerate(corners):
                place = RigidTransform(np.array([*corner, 0.001 - height]))
                plant.RegisterCollisionGeometry(body, place, Sphere(0.001), f"foot {i}", soft)
        plant.RegisterCollisionGeometry(plant.world_body(), RigidTransform(), HalfSpace(), "floor", rigid)
        plant.AddFrame(FixedOffsetFrame("bottom", body.body_frame(), RigidTransform(-height * up)))
        down = GRAVITY * np.array([math.sin(self.tilt), 0.0, -math.cos(self.tilt)])
        plant.mutable_gravity_field().set_gravity_vector(down)
        plant.Finalize()
        plant.SetDefaultFloatingBaseBodyPose(body, RigidTransform((height - 1e-5) * up))

    def _material(self, contact: str, *, rigid: bool) -> Any:
        from pydrake import geometry
        from pydrake.multibody.plant import CoulombFriction

        properties = geometry.ProximityProperties()
        friction = CoulombFriction(self.mu, self.mu)
        geometry.AddContactMaterial(dissipation=5.0, point_stiffness=1e4, friction=friction, properties=properties)
        if contact == "hydroelastic" and rigid:
            geometry.AddRigidHydroelasticProperties(1.0, properties)
        elif contact == "hydroelastic":
            geometry.AddCompliantHydroelasticProperties(0.02, 1e6, properties)
        return properties


INCLINE = DrakeScene("box", 1.0, 0.3)
DISC = DrakeScene("disc", 0.3)

SETTLED = 0.3
"""Time [s] after which a body lies on the floor."""


def creep(way: Way, dt: float, duration: float = 3.0) -> dict[str, float]:
    """Return the speed [m/s] of the box down the incline: mean places of the two halves of the last two thirds."""
    simulator, plant, context = INCLINE.build(way, dt)
    places = []
    for i in range(round(duration / dt)):
        simulator.AdvanceTo((i + 1) * dt)
        places.append(plant.GetPositions(context)[4])
    early, late = np.array_split(places[len(places) // 3 :], 2)
    return {"creep": float(late.mean() - early.mean()) / (duration / 3.0)}


def slide(way: Way, start: tuple[float, float], dt: float = 2e-3) -> tuple[float, float]:
    """Return the distance [m] and angle [rad] of the disc to rest, from a speed [m/s] and a spin [rad/s]."""
    from pydrake.multibody.math import SpatialVelocity

    simulator, plant, context = DISC.build(way, dt)
    simulator.AdvanceTo(SETTLED)
    body = plant.GetBodyByName("body")
    before = plant.GetPositions(context)[4:6].copy()
    velocity = SpatialVelocity(np.array([0.0, 0.0, start[1]]), np.array([start[0], 0.0, 0.0]))
    plant.SetFreeBodySpatialVelocity(context=context, body=body, V_JpJc=velocity)
    turned = 0.0
    for i in range(round(1.2 / dt)):
        simulator.AdvanceTo(SETTLED + (i + 1) * dt)
        turned += dt * float(plant.GetVelocities(context)[2])
    return float(np.hypot(*(plant.GetPositions(context)[4:6] - before))), turned


def cost(ways: Mapping[str, Way], *, steps: int, rounds: int, dt: float = 2e-3) -> dict[str, float]:
    """Measure the time of a step of the box on the incline by name [s]: the least of `rounds`, in turns."""
    simulators = {name: INCLINE.build(way, dt)[0] for name, way in ways.items()}
    for simulator in simulators.values():
        simulator.AdvanceTo(SETTLED)
    least = dict.fromkeys(simulators, math.inf)
    for i in range(rounds):
        for name, simulator in simulators.items():
            start = time.process_time()
            simulator.AdvanceTo(SETTLED + (i + 1) * steps * dt)
            least[name] = min(least[name], (time.process_time() - start) / steps)
    return least
