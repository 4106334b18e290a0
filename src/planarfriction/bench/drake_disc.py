# pyright: reportCallIssue=false, reportArgumentType=false
# (Drake describes lists as arrays to type checkers, and asks for arrays.)
"""A disc that slides and spins in Drake: what patch friction adds to a step (`planarfriction bench`)."""

from __future__ import annotations

import statistics
from typing import Any

import numpy as np

from planarfriction.bench.measurement import Measurement, line, once
from planarfriction.laws import LuGre
from planarfriction.models import ReducedModel
from planarfriction.patch import ContactPatch

DT = 2e-3
RADIUS, HALF = 0.1, 2e-3
"""Of the disc [m]; its mass is 0.2 kg."""

STEPS, ROUNDS = 100, 9


def measure(name: str, full: bool) -> Measurement:
    """Rounds of the disc with patch friction and with Drake's own in turns; `name` ends with the kind of contact.

    Raises `MissingExtraError` without Drake.
    """
    contact = name.rpartition(".")[2]
    runs = [_thrown(contact, patch) for patch in (True, False)]
    times = np.array([[once(run) for run in runs] for _ in range(ROUNDS)]) / STEPS
    value, plain = (statistics.median(column) * 1e6 for column in times.T)
    words = f"the plant with Drake's own friction (patch friction costs {value / plain:.1f} times as much)"
    return line(name, value, "us per step", words, plain)


def _thrown(contact: str, patch: bool) -> Any:
    """What throws the disc at 1 m/s and 10 rad/s and runs it for some steps, over and over."""
    from planarfriction.adapters.drake import Patch, PatchFriction, prepare  # says how to install Drake

    builder, plant, scene_graph = _plant(contact)
    if patch:
        law = LuGre(mu_c=0.3, sigma_0=1e5, sigma_1=0.0, sigma_2=0.0, elasto_plastic=0.9)
        model = ReducedModel(ContactPatch.disc(radius=RADIUS, cells=41), law)
        patches = [Patch(model, frame="bottom", geometries=("floor", "disc"))]
        prepare(plant, scene_graph, patches)
        PatchFriction.AddToBuilder(builder, plant, scene_graph, patches)
    return _running(plant, builder.Build())


def _running(plant: Any, diagram: Any) -> Any:
    from pydrake.systems.analysis import Simulator

    simulator = Simulator(diagram)
    context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    simulator.AdvanceTo(100.5 * DT)

    def run() -> None:
        plant.SetVelocities(context, [0.0, 0.0, 10.0, 1.0, 0.0, 0.0])
        simulator.AdvanceTo(simulator.get_context().get_time() + STEPS * DT)

    run()
    return run


def _plant(contact: str) -> tuple[Any, Any, Any]:
    from pydrake.geometry import (
        AddCompliantHydroelasticProperties,
        AddContactMaterial,
        AddRigidHydroelasticProperties,
        Cylinder,
        HalfSpace,
        ProximityProperties,
        Sphere,
    )
    from pydrake.math import RigidTransform
    from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, CoulombFriction
    from pydrake.multibody.tree import FixedOffsetFrame, SpatialInertia, UnitInertia
    from pydrake.systems.framework import DiagramBuilder

    def material() -> Any:
        properties = ProximityProperties()
        friction = CoulombFriction(0.3, 0.3)
        AddContactMaterial(dissipation=5.0, point_stiffness=1e4, friction=friction, properties=properties)
        return properties

    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, DT)
    inertia = SpatialInertia(0.2, np.zeros(3), UnitInertia.SolidCylinder(RADIUS, 2.0 * HALF, [0, 0, 1]))
    disc = plant.AddRigidBody("disc", inertia)
    feet, floor = material(), material()
    if contact == "hydroelastic":
        AddCompliantHydroelasticProperties(0.02, 1e6, feet)
        AddRigidHydroelasticProperties(1.0, floor)
        plant.RegisterCollisionGeometry(disc, RigidTransform(), Cylinder(RADIUS, 2.0 * HALF), "solid", feet)
    else:
        for i, (x, y) in enumerate(RADIUS * np.array([(1, 0), (0, 1), (-1, 0), (0, -1)])):
            place = RigidTransform([x, y, 1e-3 - HALF])
            plant.RegisterCollisionGeometry(disc, place, Sphere(1e-3), f"foot {i}", feet)
    plant.RegisterCollisionGeometry(plant.world_body(), RigidTransform(), HalfSpace(), "floor", floor)
    plant.AddFrame(FixedOffsetFrame("bottom", disc.body_frame(), RigidTransform([0, 0, -HALF])))
    plant.Finalize()
    plant.SetDefaultFloatingBaseBodyPose(disc, RigidTransform([0, 0, HALF - 1e-5]))
    return builder, plant, scene_graph
