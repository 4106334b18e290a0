"""The box of `test_pressure_follows` in MJX and in Drake."""

import numpy as np
import pytest

from tests.support.plate import Plate

PLATE, DT = Plate(), 2e-3
START = np.array([0.0, 0.5, 8.0])
"""It turns by 44 degrees; by 51 with a pressure that stays in the middle of the patch."""


def near(end):
    """Return True within 0.5 mm and 0.1 degrees of the plate, the half step of its start put back."""
    off = abs(end + 0.5 * DT * START - PLATE.stops(*START))
    return bool(off[:2].max() < 5e-4 and off[2] < np.radians(0.1))


@pytest.mark.drake
def test_in_drake_a_box_slides_as_a_plate():
    drake = pytest.importorskip("pydrake.all", reason="Drake is not installed")
    from planarfriction.adapters.drake import Friction, PatchContact, prepare

    builder = drake.DiagramBuilder()
    plant, graph = drake.AddMultibodyPlantSceneGraph(builder, time_step=DT)
    away = np.array([PLATE.centre_of_mass, 0.0, PLATE.height])
    slippery = drake.CoulombFriction(0.4, 0.4)
    unit = drake.UnitInertia(
        *(np.array(PLATE.inertia) / PLATE.mass)
    ).ShiftFromCenterOfMass(-away)
    box = plant.AddRigidBody("box", drake.SpatialInertia(PLATE.mass, away, unit))
    floor = drake.Box(2.0, 2.0, 0.1), "floor", slippery
    plant.RegisterCollisionGeometry(
        plant.world_body(), drake.RigidTransform([0.0, 0.0, -0.05]), *floor
    )
    for i, (x, y) in enumerate([(1, 1), (1, -1), (-1, 1), (-1, -1)]):
        foot = drake.RigidTransform([0.05 * x, 0.03 * y, 0.001])
        plant.RegisterCollisionGeometry(
            box, foot, drake.Sphere(0.001), f"foot {i}", slippery
        )
    plant.Finalize()
    patches = [PatchContact(PLATE.model(), frame="box", geometries=("floor", "box"))]
    prepare(plant, graph, patches)
    Friction.AddToBuilder(builder, plant, graph, patches)
    simulator = drake.Simulator(builder.Build())
    context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    plant.SetFreeBodyPose(context, box, drake.RigidTransform())
    simulator.AdvanceTo(0.2)

    def pose():
        at = plant.EvalBodyPoseInWorld(context, box)
        return np.array(
            [
                *at.multiply(np.array([away[0], 0.0, 0.0]))[:2],
                drake.RollPitchYaw(at.rotation()).yaw_angle(),
            ]
        )

    begin = pose()
    plant.SetVelocities(
        context, [0.0, 0.0, START[2], START[0], START[1] - START[2] * away[0], 0.0]
    )
    simulator.AdvanceTo(0.6)
    assert near(pose() - begin)


@pytest.mark.drake
@pytest.mark.parametrize(
    "shape, follows",
    [(lambda d: d.Box(0.1, 0.1, 0.1), True), (lambda d: d.Sphere(0.02), False)],
)
def test_in_drake_auto_follows_on_faces_and_not_on_spheres(shape, follows):
    drake = pytest.importorskip("pydrake.all", reason="Drake is not installed")
    from planarfriction.adapters.drake import PatchContact, patches

    plant, graph = drake.AddMultibodyPlantSceneGraph(
        drake.DiagramBuilder(), time_step=DT
    )
    body = plant.AddRigidBody(
        "body", drake.SpatialInertia.SolidSphereWithMass(0.1, 0.02)
    )
    at = drake.RigidTransform()
    for owner, of, name in (
        (plant.world_body(), lambda d: d.HalfSpace(), "floor"),
        (body, shape, "own"),
    ):
        plant.RegisterCollisionGeometry(
            owner, at, of(drake), name, drake.CoulombFriction(0.0, 0.0)
        )
    plant.Finalize()
    (placed,) = patches.found(
        plant,
        graph,
        [PatchContact(PLATE.model(), frame="body", geometries=("floor", "own"))],
    )
    assert placed.follows == follows


@pytest.mark.slow
@pytest.mark.mjx
def test_in_mjx_a_box_slides_as_a_plate_with_derivatives():
    jax = pytest.importorskip("jax", reason="needs the extra [mjx]")
    mjx = pytest.importorskip("mujoco.mjx", reason="needs the extra [mjx]")
    import mujoco

    from planarfriction.adapters.mjx import Friction, PatchContact, prepare
    from tests.adapters.test_pressure_follows import BOX, TABLE

    before = jax.config.jax_enable_x64
    jax.config.update("jax_enable_x64", True)
    try:
        spec = mujoco.MjSpec.from_string(f"""<mujoco><option timestep="{DT}" integrator="implicitfast"/><worldbody>
            {TABLE}<body name="box" pos="0 0 0.02"><freejoint/>{BOX}<site name="under" pos="0 0 -0.02"/></body>
            </worldbody></mujoco>""")
        patches = [PatchContact(PLATE.model(), site="under", geoms=("table", "box"))]
        prepare(spec, patches)
        m = spec.compile()
        friction = Friction(m, patches)
        mx = mjx.put_model(m)
        slide = jax.jit(
            lambda d: jax.lax.scan(
                lambda d, _: (friction.step(mx, d), None), d, None, length=200
            )[0]
        )
        d = slide(mjx.put_data(m, mujoco.MjData(m)))
        begin = np.array(d.qpos[:2])
        away = PLATE.centre_of_mass
        start = jax.numpy.array(
            [START[0], START[1] - START[2] * away, 0.0, 0.0, 0.0, START[2]]
        )
        end = np.array(slide(d.replace(qvel=start)).qpos)
        angle = 2.0 * np.arctan2(end[6], end[3])
        way = end[:2] - begin + away * np.array([np.cos(angle) - 1.0, np.sin(angle)])
        assert near(np.array([*way, angle]))

        def after(speed):
            later = d.replace(qvel=start.at[1].set(speed))
            return jax.lax.scan(
                lambda d, _: (friction.step(mx, d), None), later, None, length=5
            )[0].qpos[1]

        h = 1e-6
        at = float(start[1])
        slope = (jax.jit(after)(at + h) - jax.jit(after)(at - h)) / (2.0 * h)
        assert float(jax.jit(jax.jacfwd(after))(at)) == pytest.approx(
            float(slope), rel=1e-6
        )
    finally:
        jax.config.update("jax_enable_x64", before)
