"""Wheels and boxes in Drake move as in closed form, wherever their frames lie."""

from __future__ import annotations

import numpy as np
import pytest

import planarfriction as pf

pytest.importorskip(
    "pydrake", reason="Drake is not installed: pip install 'planarfriction[drake]'"
)

from pydrake.geometry import (
    Box,
    Capsule,
    Convex,
    Cylinder,
    Ellipsoid,
    HalfSpace,
    Sphere,
)
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.tree import (
    FixedOffsetFrame,
    PlanarJoint,
    PrismaticJoint,
    RevoluteJoint,
    SpatialInertia,
    UnitInertia,
)

from planarfriction.adapters.drake import Friction, PatchContact, prepare
from tests.support.drake_scenes import Running, bare, material, running, sliding

pytestmark = pytest.mark.drake

RADIUS, HALF, MASS, DT = 0.05, 0.02, 0.5, 2e-3
LAW = pf.LuGre(
    mu_c=0.4, mu_s=0.4, sigma_0=1e5, sigma_1=0.0, sigma_2=0.0, elasto_plastic=0.9
)
POINT = pf.ReducedModel(pf.ContactPatch.disc(radius=0.002, cells=5), LAW)
TREAD = pf.ReducedModel(pf.ContactPatch.rectangle(2.0 * HALF, 0.0005, cells=9), LAW)
"""Patch under a wheel, x along the axle."""

_ANGLES = np.linspace(0.0, 2.0 * np.pi, 720, endpoint=False)
_RIM = RADIUS * np.array([np.cos(_ANGLES), np.sin(_ANGLES), 0.0 * _ANGLES])
_UP = np.array([[0.0], [0.0], [HALF]])
SIDES = Convex(np.hstack([_RIM + _UP, _RIM - _UP]), "wheel")
"""A wheel of 720 sides."""

SHAPES = {
    "sphere": (Sphere(RADIUS), POINT, 0.4),
    "cylinder": (Cylinder(RADIUS, 2.0 * HALF), TREAD, 0.5),
    "capsule": (Capsule(RADIUS, 2.0 * HALF), TREAD, 0.5),
    "ellipsoid": (Ellipsoid(RADIUS, RADIUS, HALF), POINT, 0.5),
    "mesh": (SIDES, POINT, 0.5),
}
"""Shape with its axle along z, patch, and moment of inertia about the axle in m r^2."""

FRAMES = {
    "hub": [0.0, 0.0, 0.0],
    "tread": [RADIUS, 0.0, 0.0],
    "contact": [0.0, -RADIUS, 0.0],
}


def made(
    body: str,
    place: list[float],
    solid,
    kind: str,
    inertia,
    model,
    *,
    turned=None,
    joint=None,
    **options,
):
    """Return a running plant of a body on the floor with a patch at a place in it, free or on a joint."""
    builder, plant, scene_graph = bare(DT)
    link = plant.AddRigidBody(body, SpatialInertia(MASS, [0, 0, 0], inertia))
    plant.RegisterCollisionGeometry(
        link, RigidTransform(), solid, "solid", material(kind)
    )
    floor = material(kind, rigid=True)
    plant.RegisterCollisionGeometry(
        plant.world_body(), RigidTransform(), HalfSpace(), "floor", floor
    )
    frame = RigidTransform(turned or RotationMatrix(), place)
    plant.AddFrame(FixedOffsetFrame("place", link.body_frame(), frame))
    if joint is not None:
        upright = FixedOffsetFrame("upright", plant.world_frame(), joint)
        plant.AddJoint(
            PlanarJoint("upright", plant.AddFrame(upright), link.body_frame())
        )
    plant.Finalize()
    patches = [
        PatchContact(model, frame="place", geometries=("floor", body), **options)
    ]
    prepare(plant, scene_graph, patches)
    return running(
        builder, plant, Friction.AddToBuilder(builder, plant, scene_graph, patches)
    )


def wheel(
    shape: str, frame: str, velocity: list[float], centre: str = "auto"
) -> tuple[np.ndarray, np.ndarray]:
    """Return positions and velocities (along x, z, about -y) of an upright wheel that was set moving 0.4 s ago."""
    solid, model, share = SHAPES[shape]
    upright = RigidTransform(
        RotationMatrix.MakeXRotation(0.5 * np.pi), [0.0, 0.0, RADIUS - 1e-5]
    )
    inertia = UnitInertia.TriaxiallySymmetric(share * RADIUS**2)
    along = RotationMatrix.MakeYRotation(-0.5 * np.pi)  # its x axis, along the axle
    run = made(
        "wheel",
        FRAMES[frame],
        solid,
        "point",
        inertia,
        model,
        turned=along,
        joint=upright,
        centre=centre,
    )
    run.to(0.1)
    run.plant.SetVelocities(run.context, velocity)
    run.to(0.5)
    assert run.friction.GetReport(run.own).converged
    return run.plant.GetPositions(run.context), run.plant.GetVelocities(run.context)


@pytest.mark.parametrize(
    ("shape", "frame"),
    [
        ("sphere", "hub"),
        ("sphere", "tread"),
        ("cylinder", "hub"),
        ("cylinder", "contact"),
        ("capsule", "hub"),
        ("ellipsoid", "hub"),
        pytest.param("mesh", "hub", marks=pytest.mark.slow),
    ],
)
def test_a_wheel_thrown_without_spin_rolls_on(shape, frame):
    """v = v0/(1 + I/(m r^2)): 5/7 for a sphere, 2/3 for a solid cylinder."""
    # A mesh touches in one corner, beyond the middle of its tread.
    centre = "contact" if shape == "mesh" else "auto"
    position, velocity = wheel(shape, frame, [1.0, 0.0, 0.0], centre)
    # Drake's contact points lie between the surfaces, which overlap.
    arm = RADIUS + 0.5 * position[1]
    share = SHAPES[shape][2] * (RADIUS / arm) ** 2
    near = 2e-2 if shape == "mesh" else 1e-3
    assert velocity[0] == pytest.approx(1.0 / (1.0 + share), rel=near)
    assert -velocity[2] * arm == pytest.approx(velocity[0], rel=near)


@pytest.mark.parametrize("centre", ["auto", "frame", "contact"])
def test_a_spinning_wheel_with_its_frame_at_the_hub_drives_off(centre):
    """v = w0 r/(1 + m r^2/I)."""
    _, velocity = wheel("cylinder", "hub", [0.0, 0.0, -20.0], centre)
    assert velocity[0] == pytest.approx(20.0 * RADIUS / 3.0, rel=1e-2)


def _body(plant, name: str, mass: float, inertia: float):
    """Add a body with an inertia [kg m^2] about all axes, and return it."""
    return plant.AddRigidBody(
        name,
        SpatialInertia(
            mass, [0, 0, 0], UnitInertia.TriaxiallySymmetric(inertia / mass)
        ),
    )


def _on_an_axle(plant, base, place: list[float], solid: Cylinder, mass: float) -> None:
    """Add a wheel on the floor that turns about the y axis of another body at a place in it."""
    radius = solid.radius()
    link = plant.AddRigidBody(
        "wheel",
        SpatialInertia(mass, [0, 0, 0], UnitInertia.TriaxiallySymmetric(radius**2 / 2)),
    )
    along = RigidTransform(RotationMatrix.MakeXRotation(0.5 * np.pi))
    plant.RegisterCollisionGeometry(link, along, solid, "solid", material("point"))
    floor = material("point", rigid=True)
    plant.RegisterCollisionGeometry(
        plant.world_body(), RigidTransform(), HalfSpace(), "floor", floor
    )
    frame = RigidTransform(RotationMatrix.MakeZRotation(0.5 * np.pi))
    plant.AddFrame(FixedOffsetFrame("place", link.body_frame(), frame))
    hub = plant.AddFrame(
        FixedOffsetFrame("hub", base.body_frame(), RigidTransform(place))
    )
    plant.AddJoint(RevoluteJoint("axle", hub, link.body_frame(), [0, 1, 0]))
    plant.Finalize()


def _with_patch(builder, plant, scene_graph, model) -> Running:
    patches = [PatchContact(model, frame="place", geometries=("floor", "wheel"))]
    prepare(plant, scene_graph, patches)
    return running(
        builder, plant, Friction.AddToBuilder(builder, plant, scene_graph, patches)
    )


def test_a_mecanum_roller_rolls_across_its_axis_and_holds_along_it(angle=45.0):
    """On a carrier of its own mass, thrown at an angle: v/(1 + I/(m r^2)) is left across it, and nothing along it."""
    builder, plant, scene_graph = bare(DT)
    carrier = _body(plant, "carrier", 1e-3, 1.0)
    fork = _body(plant, "fork", MASS, 1.0)
    turned = RigidTransform(
        RotationMatrix.MakeZRotation(np.radians(angle)), [0.0, 0.0, RADIUS - 1e-5]
    )
    base = plant.AddFrame(FixedOffsetFrame("base", plant.world_frame(), turned))
    plane = plant.AddJoint(PlanarJoint("plane", base, carrier.body_frame()))
    up = plant.AddJoint(
        PrismaticJoint("up", carrier.body_frame(), fork.body_frame(), [0, 0, 1])
    )
    _on_an_axle(plant, fork, [0.0, 0.0, 0.0], Cylinder(RADIUS, 2.0 * HALF), MASS)
    run = _with_patch(builder, plant, scene_graph, TREAD)
    run.to(0.1)
    turn = np.radians(angle)
    plane.set_translational_velocity(run.context, [np.cos(turn), -np.sin(turn)])
    run.to(0.9)
    across, along = plane.get_translational_velocity(run.context)
    arm = RADIUS + 0.5 * up.get_translation(run.context)
    assert across == pytest.approx(
        np.cos(turn) / (1.0 + 0.25 * (RADIUS / arm) ** 2), rel=1e-3
    )
    assert abs(along) < 1e-6


@pytest.mark.slow
def test_a_caster_swings_behind_its_pivot():
    """Drawn at a constant speed it follows a tractrix: tan(phi/2) falls as exp(-v t/a) behind the pivot."""
    trail = 0.04
    speed = 0.2
    radius = 0.5 * RADIUS
    builder, plant, scene_graph = bare(DT)
    pivot = _body(plant, "pivot", 1e3, 1.0)
    arm = _body(plant, "arm", 1e-3, 1e-6)
    fork = _body(plant, "fork", 0.5, 1e-4)
    drawn = plant.AddJoint(
        PrismaticJoint("drawn", plant.world_frame(), pivot.body_frame(), [1, 0, 0])
    )
    swivel = plant.AddJoint(
        RevoluteJoint("swivel", pivot.body_frame(), arm.body_frame(), [0, 0, 1])
    )
    plant.AddJoint(PrismaticJoint("up", arm.body_frame(), fork.body_frame(), [0, 0, 1]))
    _on_an_axle(plant, fork, [-trail, 0.0, radius], Cylinder(radius, 0.004), 0.01)
    run = _with_patch(
        builder,
        plant,
        scene_graph,
        pf.ReducedModel(pf.ContactPatch.rectangle(0.0005, cells=3), LAW),
    )
    swivel.set_angle(run.context, np.radians(120.0))
    run.to(0.1)
    begin = swivel.get_angle(run.context)
    drawn.set_translation_rate(run.context, speed)
    swivel.set_angular_rate(run.context, -speed / trail * np.sin(begin))
    plant.GetJointByName("axle").set_angular_rate(
        run.context, speed * np.cos(begin) / radius
    )
    for i in range(1, 31):
        run.to(0.1 + 0.02 * i)
        wanted = np.tan(0.5 * begin) * np.exp(-speed * 0.02 * i / trail)
        assert np.tan(0.5 * swivel.get_angle(run.context)) == pytest.approx(
            wanted, rel=0.02, abs=2e-3
        )


def box(mu: float, place: list[float], turned=None) -> Running:
    """Return a box of 40 x 40 x 200 mm at rest."""
    inertia = UnitInertia.SolidBox(0.04, 0.04, 0.2)
    law = pf.LuGre(
        mu_c=mu, mu_s=mu, sigma_0=1e5, sigma_1=0.0, sigma_2=0.0, elasto_plastic=0.9
    )
    model = pf.ReducedModel(pf.ContactPatch.rectangle(0.04, cells=9), law)
    run = made(
        "box",
        place,
        Box(0.04, 0.04, 0.2),
        "hydroelastic",
        inertia,
        model,
        turned=turned,
    )
    run.plant.SetPositions(run.context, [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0999])
    run.to(0.1)
    return run


@pytest.mark.filterwarnings(
    "ignore:frame place of the contact:UserWarning"
)  # where the box has fallen
@pytest.mark.parametrize(
    "place", [[0.0, 0.0, 0.0], [0.0, 0.0, -0.1]], ids=["body", "face"]
)
def test_a_box_topples_where_friction_is_beyond_its_half_width_over_its_height(place):
    """b/h = 0.2: it falls at mu = 0.6, and slides on at 0.08, by v0^2/(2 mu g) less the stepper's own v0 dt/2.

    Friction that sets in tilts a box on a compliant floor by twice what it does in the end.
    """
    for mu, speed in ((0.08, 0.5), (0.6, 1.0)):
        run = box(mu, place)
        run.plant.SetVelocities(run.context, [0.0, 0.0, 0.0, speed, 0.0, 0.0])
        start = run.plant.GetPositions(run.context)[4]
        body = run.plant.GetBodyByName("box")
        upright = 1.0
        for i in range(1, 41):
            run.to(0.1 + 0.02 * i)
            upright = (
                run.plant.EvalBodyPoseInWorld(run.context, body)
                .rotation()
                .matrix()[2, 2]
            )
            if upright < 0.5:
                break
        assert (upright < 0.5) == (mu > 0.2)
        if mu < 0.2:
            slid = run.plant.GetPositions(run.context)[4] - start
            assert slid == pytest.approx(
                0.5 * speed**2 / (mu * 9.81) - 0.5 * speed * DT, rel=5e-3
            )


def test_a_frame_that_is_not_in_the_contact_is_told_once():
    with pytest.warns(
        UserWarning,
        match="frame place of the contact between floor and box: contact forces",
    ) as told:
        box(0.4, [0.05, 0.0, 0.0])
    assert len(told) == 1
    along = RotationMatrix.MakeYRotation(0.5 * np.pi)
    with pytest.warns(
        UserWarning,
        match="frame place of .*: its x axis lies along the normal of the contact",
    ) as told:
        box(0.4, [0.0, 0.0, 0.0], along)
    assert len(told) == 1


def test_a_port_that_is_fixed_after_the_friction_was_added_is_named():
    run = sliding(
        "box",
        "point",
        DT,
        pf.ReducedModel(pf.ContactPatch.rectangle(0.1, cells=9), LAW),
    )
    run.to(0.1)
    run.plant.get_applied_generalized_force_input_port().FixValue(
        run.context, [0.0, 0.0, 0.0, 2.0, 0.0, 0.0]
    )
    with pytest.warns(
        UserWarning, match="one of its input ports was fixed after AddToBuilder"
    ):
        run.to(0.12)
