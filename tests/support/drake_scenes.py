"""Plants for the tests of patch friction inside Drake."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from pydrake.geometry import (
    AddCompliantHydroelasticProperties,
    AddContactMaterial,
    AddRigidHydroelasticProperties,
    Box,
    Cylinder,
    HalfSpace,
    ProximityProperties,
    Sphere,
)
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import (
    AddMultibodyPlant,
    CoulombFriction,
    MultibodyPlantConfig,
)
from pydrake.multibody.tree import (
    FixedOffsetFrame,
    PrismaticJoint,
    SpatialInertia,
    UnitInertia,
)
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource

import planarfriction as pf
from planarfriction.adapters.drake import Friction, PatchContact, prepare

CONTACTS = ("point", "hydroelastic")


class Running(NamedTuple):
    """A plant with patch friction in a simulator."""

    simulator: Any
    plant: Any
    context: Any
    """Context of the plant."""
    friction: Any
    own: Any
    """Context of the friction."""

    def to(self, time: float) -> None:
        self.simulator.AdvanceTo(time)


def bare(dt: float, **options: Any) -> tuple[Any, Any, Any]:
    """A builder, a plant and a scene graph."""
    builder = DiagramBuilder()
    options = {
        "contact_model": "hydroelastic_with_fallback",
        "discrete_contact_approximation": "lagged",
        **options,
    }
    return builder, *AddMultibodyPlant(
        MultibodyPlantConfig(time_step=dt, **options), builder
    )


def running(builder: Any, plant: Any, friction: Any = None) -> Running:
    simulator = Simulator(builder.Build())
    root = simulator.get_mutable_context()
    own = None if friction is None else friction.GetMyMutableContextFromRoot(root)
    return Running(
        simulator, plant, plant.GetMyMutableContextFromRoot(root), friction, own
    )


def material(contact: str, *, rigid: bool = False) -> ProximityProperties:
    properties = ProximityProperties()
    AddContactMaterial(
        dissipation=5.0,
        point_stiffness=1e4,
        friction=CoulombFriction(0.5, 0.5),
        properties=properties,
    )
    if contact == "hydroelastic" and rigid:
        AddRigidHydroelasticProperties(1.0, properties)
    elif contact == "hydroelastic":
        AddCompliantHydroelasticProperties(0.02, 1e6, properties)
    return properties


def on_the_floor(
    shape: str, contact: str, dt: float, *, tilt: float = 0.0, **options: Any
) -> tuple[Any, Any, Any]:
    """A "disc" of 0.1 m radius or a "box" of 0.1 m, of 0.2 kg, on a floor tilted by an angle; frame "bottom"."""
    builder, plant, scene_graph = bare(dt, **options)
    half = 0.002 if shape == "disc" else 0.02
    inertia = (
        UnitInertia.SolidCylinder(0.1, 0.004, [0, 0, 1])
        if shape == "disc"
        else UnitInertia.SolidBox(0.1, 0.1, 0.04)
    )
    body = plant.AddRigidBody(shape, SpatialInertia(0.2, [0, 0, 0], inertia))
    if contact == "hydroelastic":
        solid = Cylinder(0.1, 0.004) if shape == "disc" else Box(0.1, 0.1, 0.04)
        plant.RegisterCollisionGeometry(
            body, RigidTransform(), solid, "solid", material(contact)
        )
    else:
        corners = 0.1 * np.array([[1, 0], [0, 1], [-1, 0], [0, -1]])
        if shape == "box":
            corners = 0.05 * np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]])
        for i, corner in enumerate(corners):
            place = RigidTransform([*corner, 0.001 - half])
            plant.RegisterCollisionGeometry(
                body, place, Sphere(0.001), f"foot {i}", material(contact)
            )
    world = plant.world_body()
    plant.RegisterCollisionGeometry(
        world, RigidTransform(), HalfSpace(), "floor", material(contact, rigid=True)
    )
    plant.AddFrame(
        FixedOffsetFrame("bottom", body.body_frame(), RigidTransform([0, 0, -half]))
    )
    gravity = 9.81 * np.array([np.sin(tilt), 0.0, -np.cos(tilt)])
    plant.mutable_gravity_field().set_gravity_vector(gravity)
    plant.Finalize()
    place = plant.GetBodyByName(shape)
    plant.SetDefaultFloatingBaseBodyPose(place, RigidTransform([0, 0, half - 1e-5]))
    return builder, plant, scene_graph


def sliding(
    shape: str, contact: str, dt: float, model: pf.models.FrictionModel, **options: Any
) -> Running:
    """`on_the_floor` with a patch under it."""
    builder, plant, scene_graph = on_the_floor(shape, contact, dt, **options)
    patches = [PatchContact(model, frame="bottom", geometries=("floor", shape))]
    prepare(plant, scene_graph, patches)
    return running(
        builder, plant, Friction.AddToBuilder(builder, plant, scene_graph, patches)
    )


def gripper(contact: str, dt: float) -> tuple[Any, Any, Any, Any]:
    """A block of 0.2 kg between two pads on slides that press with 3 N each, 4 mm beside its centre of mass.

    Frames "left" and "right" are on the block; the fourth is what presses.
    """
    builder, plant, scene_graph = bare(dt)
    block = plant.AddRigidBody(
        "block", SpatialInertia(0.2, [0, 0, 0], UnitInertia.SolidBox(0.02, 0.08, 0.12))
    )
    plant.RegisterCollisionGeometry(
        block,
        RigidTransform(),
        Box(0.02, 0.08, 0.12),
        "block",
        material(contact, rigid=True),
    )
    for side, sign in (("left", -1.0), ("right", 1.0)):
        pad = plant.AddRigidBody(
            side + " pad",
            SpatialInertia(0.05, [0, 0, 0], UnitInertia.SolidSphere(0.01)),
        )
        shape = Sphere(0.01) if contact == "point" else Box(0.02, 0.018, 0.018)
        plant.RegisterCollisionGeometry(
            pad, RigidTransform(), shape, side + " pad", material(contact)
        )
        base = plant.AddFrame(
            FixedOffsetFrame(
                side + " base",
                plant.world_frame(),
                RigidTransform([0.02 * sign, 0.004, 0.5]),
            )
        )
        joint = plant.AddJoint(
            PrismaticJoint(side, base, pad.body_frame(), [-sign, 0, 0], damping=3.0)
        )
        plant.AddJointActuator(side, joint)
        turned = RigidTransform(
            RotationMatrix.MakeYRotation(-sign * np.pi / 2), [0.01 * sign, 0.004, 0]
        )
        plant.AddFrame(FixedOffsetFrame(side, block.body_frame(), turned))
    plant.Finalize()
    plant.SetDefaultFloatingBaseBodyPose(block, RigidTransform([0, 0, 0.5]))
    press = builder.AddSystem(ConstantVectorSource([3.0, 3.0]))
    builder.Connect(press.get_output_port(), plant.get_actuation_input_port())
    return builder, plant, scene_graph, press


def gripped(contact: str, dt: float, model: pf.models.FrictionModel) -> Running:
    builder, plant, scene_graph, _ = gripper(contact, dt)
    patches = [
        PatchContact(
            model, frame=side, geometries=(side + " pad", "block"), centre="contact"
        )
        for side in ("left", "right")
    ]
    prepare(plant, scene_graph, patches)
    return running(
        builder, plant, Friction.AddToBuilder(builder, plant, scene_graph, patches)
    )
