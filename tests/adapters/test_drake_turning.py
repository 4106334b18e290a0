"""Parts that a turning table, gripper or car of a Drake plant holds: they keep their places."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import pytest

import planarfriction as pf

pytest.importorskip("pydrake")

from pydrake.geometry import Box, HalfSpace, Sphere
from pydrake.math import RigidTransform, RollPitchYaw, RotationMatrix
from pydrake.multibody.math import SpatialVelocity
from pydrake.multibody.tree import (
    BallRpyJoint,
    FixedOffsetFrame,
    PrismaticJoint,
    PrismaticSpring,
    RevoluteJoint,
    RpyFloatingJoint,
    SpatialInertia,
    UnitInertia,
)
from pydrake.systems.primitives import ConstantVectorSource

from planarfriction.adapters.drake import Friction, PatchContact, prepare
from tests.support.drake_scenes import Running, bare, material, running

pytestmark = pytest.mark.drake

LAW = pf.LuGre(mu_c=1.0, sigma_0=1e6, sigma_1=800.0, sigma_2=0.0, elasto_plastic=0.9)
BOX = pf.ReducedModel(pf.ContactPatch.rectangle(0.06, cells=9), LAW)
PAD = pf.ReducedModel(pf.ContactPatch.disc(0.01, cells=9), LAW)

HEAVY = 10.0
"""Mass of what turns [kg]."""

CORNERS = 0.03 * np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]])


def ample(spin, radius):
    """Return the radius, or a smaller one at which a fifth of the friction of mu = 1 holds [m]."""
    return min(radius, 0.2 * 9.81 / spin**2)


class Turning(NamedTuple):
    """A plant with a part, and the frame of its support."""

    run: Running
    part: Any
    support: Any

    def path(self, seconds, every=0.1):
        """Return the times, radii and angles of the part about the support's axis, and its own angle, as rows."""
        rows = []
        for i in range(round(seconds / every) + 1):
            self.run.to(i * every)
            pose = self.run.plant.CalcRelativeTransform(
                self.run.context, self.support, self.part.body_frame()
            )
            x, y, _ = pose.translation()
            turned = pose.rotation().matrix()
            rows.append(
                [
                    i * every,
                    np.hypot(x, y),
                    np.arctan2(y, x),
                    np.arctan2(turned[1, 0], turned[0, 0]),
                ]
            )
        return np.array(rows)


def _box(plant):
    """Add a box of 60 x 60 x 20 mm on four feet, with a frame on its bottom."""
    box = plant.AddRigidBody(
        "box", SpatialInertia(0.1, [0, 0, 0], UnitInertia.SolidBox(0.06, 0.06, 0.02))
    )
    for i, (x, y) in enumerate(CORNERS):
        foot = RigidTransform([x, y, -0.009])
        plant.RegisterCollisionGeometry(
            box, foot, Sphere(0.001), f"foot {i}", material("point")
        )
    plant.AddFrame(
        FixedOffsetFrame("bottom", box.body_frame(), RigidTransform([0, 0, -0.01]))
    )
    return box


def _turntable(plant):
    """Add a body that turns about the vertical."""
    return plant.AddRigidBody(
        "table", SpatialInertia(HEAVY, [0, 0, 0], UnitInertia.SolidSphere(1.0))
    )


def _place(made, part, place, spin):
    """Let a part turn about the vertical axis of the world."""
    plant = made.plant
    spins = np.array([0.0, 0.0, spin])
    plant.SetFreeBodyPose(made.context, part, RigidTransform(np.array(place)))
    plant.SetFreeBodySpatialVelocity(
        made.context, part, SpatialVelocity(spins, np.cross(spins, place))
    )


def table(spin, dt, **options):
    """A box on a hinged table."""
    builder, plant, scene_graph = bare(dt, **options)
    support = _turntable(plant)
    part = _box(plant)
    hinge = plant.AddJoint(
        RevoluteJoint("hinge", plant.world_frame(), support.body_frame(), [0, 0, 1])
    )
    made = _on_a_deck(builder, plant, scene_graph)
    hinge.set_angular_rate(made.context, spin)
    _place(made, part, [ample(spin, 0.25), 0.0, 0.01 - 1e-5], spin)
    return Turning(made, part, support.body_frame())


def angles(spin, dt):
    """A box on a table that both turn by roll, pitch and yaw about skew axes: steps of these are no steady turns."""
    builder, plant, scene_graph = bare(dt)
    support = _turntable(plant)
    part = _box(plant)
    skew = RollPitchYaw(-1.2, 0.7, 1.0).ToRotationMatrix()
    base = plant.AddFrame(
        FixedOffsetFrame("skew", plant.world_frame(), RigidTransform(skew, np.zeros(3)))
    )
    ball = plant.AddJoint(BallRpyJoint("ball", base, support.body_frame()))
    free = plant.AddJoint(RpyFloatingJoint("free", base, part.body_frame()))
    made = _on_a_deck(builder, plant, scene_graph)
    axis = skew.inverse() @ np.array([0.0, 0.0, spin])
    place = np.array([ample(spin, 0.25), 0.0, 0.01 - 1e-5])
    ball.set_angles(made.context, RollPitchYaw(skew.inverse()).vector())
    ball.set_angular_velocity(made.context, axis)
    free.SetPose(made.context, RigidTransform(skew.inverse(), skew.inverse() @ place))
    free.set_angular_velocity(made.context, axis)
    free.set_translational_velocity(
        made.context, np.cross(axis, skew.inverse() @ place)
    )
    return Turning(made, part, support.body_frame())


def _on_a_deck(builder, plant, scene_graph):
    """Return the plant with a deck on its table, and a patch between this and its box."""
    deck = material("point", rigid=True)
    plant.RegisterCollisionGeometry(
        plant.GetBodyByName("table"), RigidTransform(), HalfSpace(), "deck", deck
    )
    plant.Finalize()
    patches = [PatchContact(BOX, frame="bottom", geometries=("table", "box"))]
    prepare(plant, scene_graph, patches)
    return running(
        builder, plant, Friction.AddToBuilder(builder, plant, scene_graph, patches)
    )


def car(spin, dt):
    """A box on a car that drives in a circle, on springs that keep it there."""
    builder, plant, scene_graph = bare(dt)
    support = _turntable(plant)
    part = _box(plant)
    base = plant.world_frame()
    slides = []
    for name, axis in (("x", [1, 0, 0]), ("y", [0, 1, 0])):
        body = plant.AddRigidBody(
            name, SpatialInertia(HEAVY, [0, 0, 0], UnitInertia.SolidSphere(1.0))
        )
        slides.append(
            plant.AddJoint(PrismaticJoint(name, base, body.body_frame(), axis))
        )
        base = body.body_frame()
    hinge = plant.AddJoint(
        RevoluteJoint("hinge", base, support.body_frame(), [0, 0, 1])
    )
    for slide, mass in zip(slides, (3.0 * HEAVY, 2.0 * HEAVY), strict=True):
        plant.AddForceElement(PrismaticSpring(slide, 0.0, mass * spin**2))
    made = _on_a_deck(builder, plant, scene_graph)
    orbit = ample(spin, 0.5)
    slides[0].set_translation(made.context, orbit)
    slides[1].set_translation_rate(made.context, spin * orbit)
    hinge.set_angular_rate(made.context, spin)
    _place(made, part, [1.3 * orbit, 0.2 * orbit, 0.01 - 1e-5], spin)
    return Turning(made, part, support.body_frame())


def arm(spin, dt, reach=0.014):
    """A block at the end of an arm, pressed along its circle by one pad against another.

    Pads press with 30 N where they are 6 mm in the block: they close if they begin further away.
    """
    builder, plant, scene_graph = bare(dt)
    radius = 0.5 if spin < 10.0 else 0.1
    block = plant.AddRigidBody(
        "block", SpatialInertia(0.2, [0, 0, 0], UnitInertia.SolidBox(0.08, 0.02, 0.12))
    )
    solid = Box(0.08, 0.02, 0.12)
    plant.RegisterCollisionGeometry(
        block, RigidTransform(), solid, "block", material("point", rigid=True)
    )
    support = _turntable(plant)
    hinge = plant.AddJoint(
        RevoluteJoint("hinge", plant.world_frame(), support.body_frame(), [0, 0, 1])
    )
    for side, sign in (("left", -1.0), ("right", 1.0)):
        pad = plant.AddRigidBody(
            side + " pad",
            SpatialInertia(0.05, [0, 0, 0], UnitInertia.SolidSphere(0.01)),
        )
        plant.RegisterCollisionGeometry(
            pad, RigidTransform(), Sphere(0.01), side + " pad", material("point")
        )
        place = RigidTransform([radius, reach * sign, 0.5])
        base = plant.AddFrame(
            FixedOffsetFrame(side + " base", support.body_frame(), place)
        )
        if side == "left":
            plant.WeldFrames(base, pad.body_frame())
        else:
            press = plant.AddJoint(
                PrismaticJoint("press", base, pad.body_frame(), [0, -1, 0], damping=3.0)
            )
            plant.AddJointActuator("press", press)
        turned = RigidTransform(
            RotationMatrix.MakeXRotation(sign * np.pi / 2), [0, 0.01 * sign, 0]
        )
        plant.AddFrame(FixedOffsetFrame(side, block.body_frame(), turned))
    plant.Finalize()
    force = builder.AddSystem(ConstantVectorSource([30.0]))
    builder.Connect(force.get_output_port(), plant.get_actuation_input_port())
    patches = [
        PatchContact(
            PAD, frame=side, geometries=(side + " pad", "block"), centre="contact"
        )
        for side in ("left", "right")
    ]
    prepare(plant, scene_graph, patches)
    made = running(
        builder, plant, Friction.AddToBuilder(builder, plant, scene_graph, patches)
    )
    hinge.set_angular_rate(made.context, spin)
    _place(made, block, [radius, 0.0, 0.5], spin)
    return Turning(made, block, support.body_frame())


def _check(made, spin, dt, seconds, start):
    """Compare the path with what the second order of the steps leaves, and the deflection of the bristles."""
    path = made.path(seconds)
    times, radius, around, own = path[path[:, 0] > start - 1e-9].T
    lasts = times[-1] - times[0]
    # M, where the load is the weight of the part.
    elastic = 2.0 * spin**2 / 9.81 / LAW.sigma_0
    assert np.ptp(radius) < 1.5 * radius[0] * spin**4 * dt**3 * lasts / 8.0 + elastic
    assert np.ptp(around) < 1.5 * spin**3 * dt**2 * lasts / 6.0 + elastic / radius[0]
    assert np.ptp(own) < 1.5 * spin**3 * dt**2 * lasts / 6.0 + elastic / radius[0]


@pytest.mark.parametrize("scene", [table, car, arm], ids=lambda scene: scene.__name__)
def test_what_is_held_keeps_its_place(scene):
    """Steps along tangents would take it 0.7 % further out in 0.4 s: by a factor of `exp(w^2 dt T / 2)`."""
    _check(scene(3.0, 4e-3), 3.0, 4e-3, 0.6, 0.2)


def test_pads_that_close_while_they_turn_do_not_turn_what_they_hold():
    """Along the normal, which turns with them: along one that stands still, 6 mm would turn the block by 0.01."""
    assert np.ptp(arm(3.0, 4e-3, reach=0.02).path(0.2)[:, 3]) < 2e-4


def test_a_ball_that_spins_rolls_straight():
    """Its contact moves along with it: the material below turns aside, by half of 10 rad/s in 4 ms, 4 mm in 0.2 m."""
    builder, plant, scene_graph = bare(4e-3)
    ball = plant.AddRigidBody(
        "ball", SpatialInertia(0.2, [0, 0, 0], UnitInertia.SolidSphere(0.05))
    )
    plant.RegisterCollisionGeometry(
        ball, RigidTransform(), Sphere(0.05), "ball", material("point")
    )
    floor = material("point", rigid=True)
    plant.RegisterCollisionGeometry(
        plant.world_body(), RigidTransform(), HalfSpace(), "floor", floor
    )
    plant.Finalize()
    patches = [PatchContact(PAD, frame="ball", geometries=("floor", "ball"))]
    prepare(plant, scene_graph, patches)
    run = running(
        builder, plant, Friction.AddToBuilder(builder, plant, scene_graph, patches)
    )
    plant.SetFreeBodyPose(run.context, ball, RigidTransform([0.0, 0.0, 0.0499]))
    plant.SetFreeBodySpatialVelocity(
        run.context, ball, SpatialVelocity([0.0, 20.0, 10.0], [1.0, 0.0, 0.0])
    )
    run.to(0.2)
    x, y, _ = plant.GetFreeBodyPose(run.context, ball).translation()
    assert x == pytest.approx(0.2, abs=2e-3)
    assert abs(y) < 1e-6


@pytest.mark.parametrize(
    "options",
    [{"use_sampled_output_ports": False}, {"discrete_contact_approximation": "sap"}],
)
def test_all_kinds_of_discrete_plants_keep_places(options):
    _check(table(3.0, 4e-3, **options), 3.0, 4e-3, 0.4, 0.2)


def test_joints_whose_rates_are_no_velocities_keep_places():
    """Roll, pitch and yaw: their steps are no steady turns. Of third order are 1e-5 of the radius here."""
    path = angles(3.0, 4e-3).path(0.6)[2:]
    assert np.ptp(path[:, 1]) < 5e-5 * path[0, 1] and np.ptp(path[:, 2]) < 2e-4


@pytest.mark.slow
@pytest.mark.parametrize("dt", [2e-3, 4e-3])
@pytest.mark.parametrize("spin", [1.0, 2.0, 3.0, 10.0])
@pytest.mark.parametrize("scene", [table, car, arm], ids=lambda scene: scene.__name__)
def test_what_is_held_keeps_its_place_for_long(scene, spin, dt):
    _check(scene(spin, dt), spin, dt, 20.0, 1.0)
