# pyright: reportArgumentType=false, reportCallIssue=false
# (Drake describes arrays to type checkers in a way that no array fits.)
"""Drake with its own friction, on points and on hydroelastic surfaces, and with patches of this library."""

from __future__ import annotations

import logging
from dataclasses import dataclass
from typing import Any

import numpy as np

from planarfriction_studies.referee.case import Body, Case, Shape
from planarfriction_studies.referee.engines import lacks, patches, uniform
from planarfriction_studies.referee.engines.patches import RADIUS, ROUND, SHRUNK, feet

FLOOR = 18.0
"""Side of the box that is the floor of point contact: with a half space, which has no bounds, Drake's search for pairs
of shapes that are close ends the process now and then where there are many [m]."""


@dataclass(frozen=True)
class Drake:
    """Drake with a contact model and an approximation of its solver, or with a model of patches."""

    name: str
    settings: str
    contact: str = "point"
    approximation: str = "lagged"
    stiction: float = 1e-4
    """Stiction tolerance [m/s]: speed below which Drake's own friction is less than Coulomb's."""
    kind: str | None = None
    """Model of patches."""
    package: str = "drake"

    def cannot(self, case: Case) -> str | None:
        """Return what Drake has no words for: Coulomb's law alone, but patches have more."""
        return lacks(
            case, anisotropy=self.kind is not None, stribeck=self.kind is not None
        )

    def build(self, case: Case, dt: float) -> DrakeWorld:
        """Build a discrete plant."""
        return DrakeWorld(self, case, dt)


class DrakeWorld:
    """A case in Drake."""

    def __init__(self, engine: Drake, case: Case, dt: float) -> None:
        from pydrake.math import RigidTransform
        from pydrake.multibody.plant import AddMultibodyPlant, MultibodyPlantConfig
        from pydrake.systems.analysis import Simulator
        from pydrake.systems.framework import DiagramBuilder

        # Half spaces do not touch deformable bodies.
        logging.getLogger("drake").setLevel(logging.ERROR)
        self.case = case
        self.dt = dt
        self.now = 0
        alone = all(
            len(body.shapes) == 1 and body.shapes[0].kind not in ROUND
            for body in case.bodies
        )
        contact = engine.contact if engine.kind is None or alone else "hydroelastic"
        builder = DiagramBuilder()
        config = MultibodyPlantConfig(
            time_step=dt, contact_model="hydroelastic_with_fallback",
            discrete_contact_approximation=engine.approximation, stiction_tolerance=engine.stiction,
        )  # fmt: skip
        self.plant, scene_graph = AddMultibodyPlant(config, builder)
        plant = self.plant
        plant.mutable_gravity_field().set_gravity_vector(np.array(case.gravity))
        for body in case.bodies:
            _add(plant, case, body, contact)
        self._frames()
        plant.Finalize()
        _keep_apart(scene_graph, case)
        for body in case.moving:
            if body.joint == "free":
                plant.SetDefaultFloatingBaseBodyPose(
                    plant.GetBodyByName(body.name), RigidTransform(body.position)
                )
        self.forces = builder.AddSystem(_forces(plant.num_velocities()))
        builder.Connect(
            self.forces.get_output_port(),
            plant.get_applied_generalized_force_input_port(),
        )
        if engine.kind is not None:
            from planarfriction.adapters.drake import Friction, prepare

            own = self._patches(engine.kind, contact)
            prepare(plant, scene_graph, own)
            Friction.AddToBuilder(builder, plant, scene_graph, own)
        self.simulator = Simulator(builder.Build())
        self.context = plant.GetMyMutableContextFromRoot(
            self.simulator.get_mutable_context()
        )
        self.bodies = [plant.GetBodyByName(body.name) for body in case.moving]

    def _frames(self) -> None:
        """Add a frame for each patch."""
        from pydrake.math import RigidTransform
        from pydrake.multibody.tree import FixedOffsetFrame

        for i, contact in enumerate(self.case.contacts):
            body = self.plant.GetBodyByName(self.case.shapes[contact.pair[1]][0].name)
            self.plant.AddFrame(
                FixedOffsetFrame(
                    f"patch {i}",
                    body.body_frame(),
                    RigidTransform(np.array(contact.at)),
                )
            )

    def _patches(self, kind: str, contact: str) -> list[Any]:
        """Return the patches: between bodies, whose feet belong to them, or between single surfaces."""
        from planarfriction.adapters.drake import PatchContact

        names = {
            name: body.name if contact == "point" else f"{name} solid"
            for name, (body, _) in self.case.shapes.items()
        }
        return [
            PatchContact(
                patches.model(each, kind),
                frame=f"patch {i}",
                geometries=tuple(names[one] for one in each.pair),
            )
            for i, each in enumerate(self.case.contacts)
        ]

    def step(self, wrenches: np.ndarray) -> None:
        """Make a step; forces on free bodies act at their origins, those on pads along their slides."""
        values = np.zeros(len(self.forces.values))  # pyright: ignore
        for body, own, wrench in zip(
            self.case.moving, self.bodies, wrenches, strict=True
        ):
            if body.joint == "slide":
                values[self.plant.GetJointByName(body.name).velocity_start()] = wrench[
                    2
                ]
                continue
            rotation = (
                self.plant.EvalBodyPoseInWorld(self.context, own).rotation().matrix()
            )
            lever = rotation @ np.array(body.centre_of_mass)
            at = own.floating_velocities_start_in_v()
            values[at : at + 3] = wrench[3:] + np.cross(lever, wrench[:3])
            values[at + 3 : at + 6] = wrench[:3]
        self.forces.values = values  # pyright: ignore
        self.now += 1
        self.simulator.AdvanceTo(self.now * self.dt)

    def poses(self) -> tuple[np.ndarray, np.ndarray]:
        """Return positions and rotations."""
        found = [
            self.plant.EvalBodyPoseInWorld(self.context, body) for body in self.bodies
        ]
        return np.array([x.translation() for x in found]), np.array(
            [x.rotation().matrix() for x in found]
        )

    def throw(self, body: int, velocity: np.ndarray) -> None:
        """Set the velocity of a body, which Drake wants at its origin."""
        from pydrake.multibody.math import SpatialVelocity

        rotation = (
            self.plant.EvalBodyPoseInWorld(self.context, self.bodies[body])
            .rotation()
            .matrix()
        )
        lever = rotation @ np.array(self.case.moving[body].centre_of_mass)
        own = SpatialVelocity(
            velocity[3:], velocity[:3] - np.cross(velocity[3:], lever)
        )
        self.plant.SetFreeBodySpatialVelocity(
            context=self.context, body=self.bodies[body], V_JpJc=own
        )


def _forces(size: int) -> Any:
    """Return a system that applies its `values [size]`: generalized forces."""
    from pydrake.systems.framework import LeafSystem

    class Forces(LeafSystem):
        def __init__(self) -> None:
            super().__init__()
            self.values = np.zeros(size)
            write = lambda _, output: output.SetFromVector(self.values)
            self.DeclareVectorOutputPort("forces", size, write, {self.time_ticket()})

    return Forces()


def _add(plant: Any, case: Case, body: Body, contact: str) -> None:
    """Add a body with its shapes."""
    from pydrake.geometry import Box, Sphere
    from pydrake.math import RigidTransform
    from pydrake.multibody.tree import (
        FixedOffsetFrame,
        PrismaticJoint,
        RotationalInertia,
        SpatialInertia,
    )

    place = RigidTransform(np.array(body.position))
    fixed = body.joint == "fixed"
    inertia = RotationalInertia(*(np.ones(3) if fixed else body.moments))
    centre = np.array(body.centre_of_mass)
    mass = 1.0 if fixed else body.mass
    own = plant.AddRigidBody(
        body.name, SpatialInertia.MakeFromCentralInertia(mass, centre, inertia)
    )
    if fixed:
        plant.WeldFrames(plant.world_frame(), own.body_frame(), place)
    elif body.joint == "slide":
        frame = plant.AddFrame(
            FixedOffsetFrame(f"{body.name} at", plant.world_frame(), place)
        )
        plant.AddJoint(
            PrismaticJoint(
                body.name, frame, own.body_frame(), np.array([0.0, 0.0, 1.0])
            )
        )
    for shape in body.shapes:
        material = _material(case, shape.name, contact, rigid=fixed)
        points = feet(case, shape) if contact == "point" else ()
        solid = _geometry(shape, SHRUNK if len(points) else 0.0)
        pose = RigidTransform(_rotation(shape), shape.position)
        if shape.kind == "plane" and contact == "point":
            solid = Box(FLOOR, FLOOR, 1.0)
            pose = RigidTransform([0.0, 0.0, -0.5])
        plant.RegisterCollisionGeometry(
            own, pose, solid, f"{shape.name} solid", material
        )
        for i, point in enumerate(points):
            name = f"{shape.name} foot {i}"
            plant.RegisterCollisionGeometry(
                own, RigidTransform(point), Sphere(RADIUS), name, material
            )


def _rotation(shape: Shape) -> Any:
    """Return the rotation of the z axis to the axis of the shape, which is x or z."""
    from pydrake.math import RotationMatrix

    return RotationMatrix.MakeYRotation(0.5 * np.pi if shape.axis[0] else 0.0)


def _geometry(shape: Shape, shrunk: float) -> Any:
    from pydrake.geometry import Box, Capsule, Cylinder, HalfSpace, Sphere

    if shape.kind == "plane":
        return HalfSpace()
    if shape.kind == "box":
        return Box(*(2.0 * (shape.half - [0.0, 0.0, shrunk])))
    if shape.kind == "sphere":
        return Sphere(*shape.size)
    radius, length = shape.size
    return (
        Capsule(radius, length)
        if shape.kind == "capsule"
        else Cylinder(radius, length - 2.0 * shrunk)
    )


def _material(case: Case, shape: str, contact: str, *, rigid: bool) -> Any:
    """Return contact properties: of two coefficients a and b, Drake takes `2 a b/(a + b)`."""
    from pydrake import geometry
    from pydrake.multibody.plant import CoulombFriction

    mu = next(each.mu[0] for each in case.contacts if shape in each.pair)
    if not uniform(case):
        mu = 1.0 if rigid else mu / (2.0 - mu)
    properties = geometry.ProximityProperties()
    friction = CoulombFriction(mu, mu)
    geometry.AddContactMaterial(
        dissipation=5.0, point_stiffness=1e4, friction=friction, properties=properties
    )
    if contact == "hydroelastic" and rigid:
        geometry.AddRigidHydroelasticProperties(1.0, properties)
    elif contact == "hydroelastic":
        geometry.AddCompliantHydroelasticProperties(0.02, 1e6, properties)
    return properties


def _keep_apart(scene_graph: Any, case: Case) -> None:
    """Let the shapes of contacts collide alone."""
    from pydrake.geometry import CollisionFilterDeclaration, GeometrySet, Role

    inspector = scene_graph.model_inspector()
    ids: dict[str, list[Any]] = {name: [] for name in case.shapes}
    for found in inspector.GetAllGeometryIds(Role.kProximity):
        ids[
            inspector.GetName(found)
            .split("::")[-1]
            .rsplit(" solid", 1)[0]
            .rsplit(" foot ", 1)[0]
        ].append(found)
    pairs = {frozenset(contact.pair) for contact in case.contacts}
    names = list(ids)
    apart = CollisionFilterDeclaration()
    for i, one in enumerate(names):
        for other in names[i + 1 :]:
            if frozenset((one, other)) not in pairs:
                apart.ExcludeBetween(GeometrySet(ids[one]), GeometrySet(ids[other]))
    scene_graph.collision_filter_manager().Apply(apart)


_FEET = "feet at the corners for point contact, 1e4 N/m"

ENGINES = [
    Drake("Drake", f"as it comes: lagged (a convex approximation), stiction tolerance 1e-4 m/s; {_FEET}"),
    Drake("Drake, SAP", f"sap; {_FEET}", approximation="sap"),
    Drake("Drake, TAMSI", f"tamsi, stiction tolerance 1e-6 m/s; {_FEET}", approximation="tamsi", stiction=1e-6),
    Drake(
        "Drake, surfaces", "lagged, stiction tolerance 1e-6 m/s, hydroelastic surfaces of 1e6 Pa, resolution 20 mm",
        "hydroelastic", stiction=1e-6,
    ),
    Drake(
        "Drake, patches", f"planarfriction: ReducedModel, 21 cells across; {_FEET}; hydroelastic: L, capsule and balls",
        kind="reduced",
    ),
]  # fmt: skip
