"""Boxes that come to rest on a moving carrier, and balls that roll, inside Drake."""

import math
import warnings

import numpy as np
import pytest

import planarfriction as pf

pytest.importorskip("pydrake")

from pydrake.geometry import Box, HalfSpace, Sphere
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.tree import (
    FixedOffsetFrame,
    PrismaticJoint,
    SpatialInertia,
    UnitInertia,
)

from planarfriction.adapters.drake import Friction, PatchContact, prepare
from tests.support.drake_scenes import bare, material, running

pytestmark = pytest.mark.drake

LAW = pf.LuGre(mu_c=0.4, sigma_2=0.0, elasto_plastic=0.9)
CORNERS = 0.05 * np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]])


def carried(mass, speed, dt, contact, approximation):
    """A box of 0.5 kg that is 0.1 m/s slower than its carrier, which nothing else slows down."""
    builder, plant, scene_graph = bare(dt, discrete_contact_approximation=approximation)
    carrier = plant.AddRigidBody(
        "carrier", SpatialInertia(mass, [0, 0, 0], UnitInertia.SolidBox(1, 1, 0.1))
    )
    joint = plant.AddJoint(
        PrismaticJoint("x", plant.world_frame(), carrier.body_frame(), [1, 0, 0])
    )
    deck = RigidTransform([0, 0, -0.05])
    plant.RegisterCollisionGeometry(
        carrier, deck, Box(4, 1, 0.1), "deck", material(contact, rigid=True)
    )
    box = plant.AddRigidBody(
        "box", SpatialInertia(0.5, [0, 0, 0], UnitInertia.SolidBox(0.1, 0.1, 0.04))
    )
    if contact == "hydroelastic":
        plant.RegisterCollisionGeometry(
            box, RigidTransform(), Box(0.1, 0.1, 0.04), "solid", material(contact)
        )
    else:
        for i, (x, y) in enumerate(CORNERS):
            foot = RigidTransform([x, y, -0.019])
            plant.RegisterCollisionGeometry(
                box, foot, Sphere(0.001), f"foot {i}", material(contact)
            )
    plant.AddFrame(
        FixedOffsetFrame("bottom", box.body_frame(), RigidTransform([0, 0, -0.02]))
    )
    plant.Finalize()
    plant.SetDefaultFloatingBaseBodyPose(box, RigidTransform([0, 0, 0.02 - 1e-5]))
    model = pf.ReducedModel(pf.ContactPatch.rectangle(0.1), LAW)
    patches = [PatchContact(model, frame="bottom", geometries=("carrier", "box"))]
    prepare(plant, scene_graph, patches)
    made = running(
        builder, plant, Friction.AddToBuilder(builder, plant, scene_graph, patches)
    )
    joint.set_translation_rate(made.context, speed)
    velocities = plant.GetVelocities(made.context)
    velocities[box.floating_velocities_start_in_v() + 3] = speed - 0.1
    plant.SetVelocities(made.context, velocities)
    return made


@pytest.mark.parametrize("contact", ["point", "hydroelastic"])
@pytest.mark.parametrize("approximation", ["lagged", "similar", "sap"])
@pytest.mark.parametrize(("mass", "speed"), [(20.0, 2.0), (5.0, 0.5), (20.0, 0.0)])
def test_a_box_comes_to_rest_on_a_carrier(mass, speed, approximation, contact):
    """Drake's solver leaves open a share of all that moves: friction dies out as far as this allows.

    What one step leaves open the next one takes back, so that twists swing by twice as much.
    """
    made = carried(mass, speed, 2e-3, contact, approximation)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for i in range(300):
            made.to(2e-3 * (i + 1))
            assert made.friction.GetReport(made.own).converged
    wrench = made.friction.get_wrenches_output_port().Eval(made.own)
    twist = made.friction.get_twists_output_port().Eval(made.own)
    open_end = 1e-6 * math.sqrt(mass / 0.5) * speed
    assert abs(twist[:2]).max() < 1e-6 + 2.0 * open_end
    assert abs(wrench[:2]).max() < 1e-3 + 0.5 * 4.0 * open_end / 2e-3
    assert made.plant.GetVelocities(made.context)[0] == pytest.approx(
        speed - 0.05 / (mass + 0.5), abs=1e-3
    )


def ball(turned, angle):
    builder, plant, scene_graph = bare(2e-3)
    body = plant.AddRigidBody(
        "ball", SpatialInertia(0.1, [0, 0, 0], UnitInertia.SolidSphere(0.05))
    )
    plant.RegisterCollisionGeometry(
        body, RigidTransform(), Sphere(0.05), "ball", material("point")
    )
    floor = material("point", rigid=True)
    plant.RegisterCollisionGeometry(
        plant.world_body(), RigidTransform(), HalfSpace(), "floor", floor
    )
    plant.AddFrame(
        FixedOffsetFrame("middle", body.body_frame(), RigidTransform(turned, [0, 0, 0]))
    )
    plant.mutable_gravity_field().set_gravity_vector(
        9.81 * np.array([math.sin(angle), 0.0, -math.cos(angle)])
    )
    plant.Finalize()
    plant.SetDefaultFloatingBaseBodyPose(body, RigidTransform([0, 0, 0.05 - 1e-5]))
    law = pf.LuGre(mu_c=0.5, sigma_0=1e3, sigma_1=60.0, sigma_2=0.0, elasto_plastic=0.9)
    model = pf.ReducedModel(pf.ContactPatch.disc(0.003, cells=5), law)
    patches = [
        PatchContact(
            model, frame="middle", geometries=("floor", "ball"), centre="contact"
        )
    ]
    prepare(plant, scene_graph, patches)
    return running(
        builder, plant, Friction.AddToBuilder(builder, plant, scene_graph, patches)
    )


@pytest.mark.parametrize(
    "turned", [RotationMatrix(), RotationMatrix.MakeYRotation(np.pi / 2)]
)
def test_a_ball_rolls_down_at_a_constant_acceleration(turned):
    """5/7 g sin(angle); the x axis of its frame reverses every half turn, or starts as the normal."""
    angle = math.radians(10.0)
    speeds = []
    made = ball(turned, angle)
    for i in range(600):
        made.to(2e-3 * (i + 1))
        speeds.append(made.plant.GetVelocities(made.context)[3])
    acceleration = np.diff(speeds[200:]) / 2e-3
    assert acceleration.mean() == pytest.approx(
        5.0 / 7.0 * 9.81 * math.sin(angle), rel=5e-3
    )
    assert np.ptp(acceleration) < 2e-3
