"""Patch friction inside Drake: things that hold, discs that stop where they should, contexts that go on alike."""

import dataclasses
import importlib
import sys

import numpy as np
import pytest

import planarfriction as pf
from tests.support.refusals import refused

pytest.importorskip(
    "pydrake", reason="Drake is not installed: pip install 'planarfriction[drake]'"
)

from pydrake.common.value import Value
from pydrake.geometry import (
    Box,
    CollisionFilterDeclaration,
    Cylinder,
    GeometrySet,
    Mesh,
    Sphere,
)
from pydrake.math import RigidTransform
from pydrake.multibody.math import SpatialForce
from pydrake.multibody.plant import CoulombFriction, ExternallyAppliedSpatialForce
from pydrake.multibody.tree import FixedOffsetFrame, SpatialInertia, UnitInertia
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import EventStatus
from pydrake.systems.primitives import (
    ConstantValueSource,
    ConstantVectorSource,
    LogVectorOutput,
)

from planarfriction.adapters.drake import Friction, PatchContact, prepare
from planarfriction.adapters.drake.friction import EXPECTED
from planarfriction.errors import MissingExtraError
from planarfriction_studies.bench.coulomb_disc import stop
from tests.support.drake_scenes import (
    CONTACTS,
    bare,
    gripped,
    gripper,
    material,
    on_the_floor,
    running,
    sliding,
)

pytestmark = pytest.mark.drake

LAW = pf.LuGre(mu_s=1.0, sigma_2=0.0, elasto_plastic=0.9)
PAD = pf.ReducedModel(pf.ContactPatch.disc(radius=0.01, cells=9), LAW)
BOX = pf.ReducedModel(pf.ContactPatch.rectangle(0.1, cells=9), LAW)
COULOMB = pf.LuGre(mu_c=0.3, sigma_0=1e5, sigma_1=0.0, sigma_2=0.0, elasto_plastic=0.9)
DISC = pf.DistributedModel(pf.ContactPatch.disc(radius=0.1, cells=41), COULOMB)

MISFIT = 1e-6
"""Twists [m/s] that are taken where they get no closer: Drake's own contact solver leaves 1e-8 to 1e-7 open."""


def _patches(box="box"):
    return [PatchContact(BOX, frame="bottom", geometries=("floor", box))]


# ---------------------------------------------------------------------- what comes out


@pytest.mark.parametrize("contact", CONTACTS)
@pytest.mark.parametrize("dt", [2e-3, 1e-2])
def test_a_box_on_an_incline_does_not_creep(contact, dt):
    """From the touch-down on: mean places in two times of 0.3 s, which the noise of Drake's solver does not reach."""
    run = sliding("box", contact, dt, BOX, tilt=0.3)
    places = []
    for i in range(round(0.9 / dt)):
        run.to((i + 1) * dt)
        report = run.friction.GetReport(run.own)
        assert report.converged and report.misfit <= MISFIT and report.passes <= 5
        places.append(run.plant.GetPositions(run.context)[4])
    early, late = np.split(np.array(places[round(0.3 / dt) :]), 2)
    assert abs(late.mean() - early.mean()) < 0.3 * 1e-9
    force = run.friction.get_wrenches_output_port().Eval(run.own)
    load = run.friction.get_loads_output_port()
    np.testing.assert_allclose(force[:2], [-0.2 * 9.81 * np.sin(0.3), 0.0], atol=1e-4)
    np.testing.assert_allclose(load.Eval(run.own), 0.2 * 9.81 * np.cos(0.3), atol=1e-4)


@pytest.mark.parametrize("contact", CONTACTS)
@pytest.mark.parametrize("dt", [2e-3, 1e-2])
def test_a_grip_beside_the_centre_of_mass_holds(contact, dt):
    run = gripped(contact, dt, PAD)
    places = []
    block = run.plant.GetBodyByName("block")
    for i in range(round(0.6 / dt)):
        run.to((i + 1) * dt)
        report = run.friction.GetReport(run.own)
        assert report.converged and report.misfit <= MISFIT and report.passes <= 6
        pose = run.plant.EvalBodyPoseInWorld(run.context, block)
        places.append([*pose.translation()[1:], *pose.rotation().ToQuaternion().xyz()])
    early, late = np.split(np.array(places[round(0.2 / dt) :]), 2)
    drift = abs(late.mean(axis=0) - early.mean(axis=0)) / 0.2
    assert drift[:2].max() < 1e-9 and 2.0 * np.degrees(drift[2:].max()) < 1e-6
    assert abs(places[-1][1] - 0.5) < 1e-6
    # both carry half of the weight: up, along the x axes of the two frames, which point down and up
    wrenches = run.friction.get_wrenches_output_port().Eval(run.own).reshape(2, 3)
    np.testing.assert_allclose(wrenches[:, 0], [-0.981, 0.981], atol=0.02)


def test_a_grip_whose_load_swings_keeps_still_with_a_fixed_stiffness():
    """Press with 3 N +- 20 % at 2 Hz: the published law lets the part swing by more."""
    swings = []
    for reference in (3.0, None):
        law = dataclasses.replace(LAW, sigma_0=1e4, sigma_1=20.0)
        pad = reference and pf.Pad.at_load(reference)
        builder, plant, scene_graph, press = gripper("point", 2e-3)
        patches = [
            PatchContact(
                dataclasses.replace(PAD, law=law, pad=pad),
                frame=side,
                geometries=(side + " pad", "block"),
                centre="contact",
            )
            for side in ("left", "right")
        ]
        prepare(plant, scene_graph, patches)
        run = running(
            builder, plant, Friction.AddToBuilder(builder, plant, scene_graph, patches)
        )
        places = []
        source = press.GetMyMutableContextFromRoot(run.simulator.get_mutable_context())
        for i in range(500):
            load = 3.0 * (1.0 + 0.2 * np.sin(4.0 * np.pi * 2e-3 * i))
            press.get_mutable_source_value(source).set_value([load, load])
            run.to((i + 1) * 2e-3)
            assert run.friction.GetReport(run.own).converged
            places.append(
                run.plant.EvalBodyPoseInWorld(
                    run.context, plant.GetBodyByName("block")
                ).translation()[2]
            )
        swings.append(np.ptp(places[250:]))
    assert swings[0] < 0.01 * swings[1]


STARTS = ((1.0, 10.0), (1.0, 20.0), (1.0, 3.0))
"""Speed [m/s] and spin [rad/s]."""


@pytest.mark.parametrize(
    ("start", "contact"),
    [(start, "point") for start in STARTS] + [((1.0, 10.0), "hydroelastic")],
)
def test_a_disc_slides_and_spins_to_rest_where_theory_says(contact, start):
    """Less the stepper's own `v dt / 2`."""
    dt = 2e-3
    (speed, spin) = start
    (_, distance, angle) = stop(*start)
    run = sliding("disc", contact, dt, DISC)
    run.to(0.2)
    run.plant.SetVelocities(run.context, [0.0, 0.0, spin, speed, 0.0, 0.0])
    poses = [run.plant.GetPositions(run.context)]
    for i in range(400):
        run.to(0.2 + (i + 1) * dt)
        poses.append(run.plant.GetPositions(run.context))
    assert abs(run.plant.GetVelocities(run.context)).max() < 1e-5
    halves = np.unwrap([np.arctan2(pose[3], pose[0]) for pose in poses], period=np.pi)
    x = [pose[4] for pose in poses]
    assert x[-1] - x[0] + 0.5 * speed * dt == pytest.approx(distance, rel=5e-4)
    assert 2.0 * (halves[-1] - halves[0]) + 0.5 * spin * dt == pytest.approx(
        angle, rel=2e-3
    )


# ---------------------------------------------------------------------- how the plant answers


def test_free_bodies_answer_as_the_joints_are_damped():
    """Differences of steps of the copy: no contact, pads on slides with damping, which Drake takes implicitly."""
    run = gripped("point", 2e-3, PAD)
    shadow = run.friction._shadow
    size = run.plant.num_velocities()
    state = run.plant.GetPositionsAndVelocities(run.context)
    state[run.plant.num_positions() - 2 : run.plant.num_positions()] = -0.1
    shadow.begin(state, {})
    rows = np.random.default_rng(1).normal(size=(6, size))
    before = shadow.step(np.zeros(size))
    assert not shadow.pushes(first=True).any()
    caused = np.array([shadow.step(row) - before for row in rows]).T
    np.testing.assert_allclose(shadow.moved(rows)[0], caused, rtol=1e-9, atol=1e-12)


def test_answers_learnt_are_differences_of_steps():
    """A box on four feet, each a patch: what pulls at one shifts the loads of all."""
    builder, plant, scene_graph = on_the_floor("box", "point", 2e-3)
    patches = [
        PatchContact(
            PAD, frame="bottom", geometries=("floor", f"foot {i}"), centre="contact"
        )
        for i in range(4)
    ]
    prepare(plant, scene_graph, patches)
    run = running(
        builder, plant, Friction.AddToBuilder(builder, plant, scene_graph, patches)
    )
    run.to(0.3)
    asking = run.friction._asking
    shadow = run.friction._shadow
    shadow.begin(run.plant.GetPositionsAndVelocities(run.context), {})
    asking._forget()

    def came_out(wrench):
        velocity = shadow.step(wrench @ asking._rows)
        pushes = shadow.pushes(first=True)
        asking._touch(pushes, np.zeros(asking._coupled.state_shape), *np.zeros((3, 12)))
        return asking._rows @ velocity, (asking._normals * pushes[:, :3]).sum(axis=1)

    came_out(np.zeros(12))
    twist, load = came_out(np.zeros(12))
    free = asking._row.response.copy()
    pull = np.tile([0.03, 0.01, 0.0], 4)
    other_twist, other_load = came_out(pull)
    assert (
        abs(other_load - load).max() > 5e-3
        and abs(free @ pull - (other_twist - twist)).max() > 1e-4
    )
    asking._learn(pull, other_twist - twist, other_load - load)
    np.testing.assert_allclose(
        asking._row.response @ pull, other_twist - twist, atol=1e-12
    )
    np.testing.assert_allclose(
        asking._row.load_response @ pull, other_load - load, atol=1e-12
    )
    np.testing.assert_allclose(asking._row.response, asking._row.response.T, atol=1e-15)
    assert np.linalg.eigvalsh(free - asking._row.response)[0] > -1e-12


def test_what_comes_out_otherwise_than_bristles_saw_is_owed_to_them(monkeypatch):
    """A box that has just touched down, with one correction alone; then a held box that owes its bristles a way."""
    run = sliding("box", "point", 2e-3, BOX, tilt=0.3)
    run.to(0.02)
    run.plant.SetVelocities(run.context, [1.0, 0.0, 0.0, 0.1, 0.0, -0.1])
    asking = run.friction._asking
    shadow = run.friction._shadow
    given = np.array([1e-4, 0.0, 0.0])
    parts = run.friction._parts
    own = run.own.get_discrete_state_vector().value().copy()
    before = [own[parts[name]] for name in ("bristles", "wrenches", "force")]
    monkeypatch.setattr("planarfriction.adapters.drake.coupled_step.MISFIT", 1.0)
    shadow.begin(run.plant.GetPositionsAndVelocities(run.context), {})
    rest = [own[parts[name]] for name in ("axes", "answers", "covers")]
    asked = asking.step(np.zeros(6), *before, given, *rest)
    came_out = asking._twists(shadow.step(asked.force))
    assert abs(asked.owed).max() > 1e-5
    np.testing.assert_allclose(asked.twists, came_out, atol=1e-9)
    np.testing.assert_allclose(
        asking._row.twist + asked.owed, came_out + given, atol=1e-9
    )
    monkeypatch.undo()
    run = sliding("box", "point", 2e-3, BOX)
    run.to(0.3)
    own = run.own.get_discrete_state_vector().value().copy()
    before = [
        own[run.friction._parts[name]] for name in ("bristles", "wrenches", "force")
    ]
    run.friction._shadow.begin(run.plant.GetPositionsAndVelocities(run.context), {})
    rest = [own[run.friction._parts[name]] for name in ("axes", "answers", "covers")]
    asked = run.friction._asking.step(np.zeros(6), *before, given, *rest)
    # Pulled back, but for what bristles give.
    np.testing.assert_allclose(asked.twists, -given, atol=2e-6)


def test_answers_that_lead_away_are_forgotten():
    """Answers of the last step that are far too stiff, as where a contact has gone: each pass would overshoot."""
    run = sliding("box", "point", 2e-3, BOX, tilt=0.3)
    run.to(0.3)
    own = run.own.get_discrete_state_vector().value().copy()
    parts = run.friction._parts
    answers = own[parts["answers"]]
    answers[1:10] *= 0.02
    run.friction._shadow.begin(run.plant.GetPositionsAndVelocities(run.context), {})
    before = [own[parts[name]] for name in ("bristles", "wrenches", "force")]
    asked = run.friction._asking.step(
        np.array([0.0, 0.0, 0.0, 0.1, 0.0, 0.0]),
        *before,
        np.zeros(3),
        own[parts["axes"]],
        answers,
        np.zeros(0),
    )
    passes, _, _, misfit, _ = asked.report
    assert passes < 10 and misfit <= MISFIT


@pytest.mark.parametrize("contact", CONTACTS)
def test_twists_and_wrenches_are_in_the_axes_of_the_frame(contact):
    """A disc that slides along x and has turned by a quarter slides along -y of its frame; friction is against it."""
    run = sliding("disc", contact, 2e-3, DISC)
    run.to(0.1)
    state = run.plant.GetPositions(run.context)
    state[:4] = np.sqrt([0.5, 0.0, 0.0, 0.5])
    run.plant.SetPositions(run.context, state)
    run.plant.SetVelocities(run.context, [0.0, 0.0, 0.0, 1.0, 0.0, 0.0])
    run.to(0.11)
    twist, wrench = (
        run.friction.GetOutputPort(name).Eval(run.own)
        for name in ("twists", "wrenches")
    )
    speed = run.plant.GetVelocities(run.context)[3]
    np.testing.assert_allclose(twist, [0.0, -speed, 0.0], atol=1e-4)
    np.testing.assert_allclose(wrench[:2], [0.0, 0.3 * 0.2 * 9.81], atol=2e-2)
    assert 0.9 < speed < 1.0


def test_what_else_drives_the_plant_is_seen():
    """Forces of others, in all the ways that Drake has: the box goes off where all together pass its friction."""

    def moved(force):
        builder, plant, scene_graph = on_the_floor("box", "point", 2e-3)
        patches = _patches()
        prepare(plant, scene_graph, patches)
        pull = builder.AddSystem(ConstantVectorSource([0.0, 0.0, 0.0, force, 0.0, 0.0]))
        builder.Connect(
            pull.get_output_port(), plant.get_applied_generalized_force_input_port()
        )
        run = running(
            builder, plant, Friction.AddToBuilder(builder, plant, scene_graph, patches)
        )
        run.to(0.4)
        assert run.friction.GetReport(run.own).misfit <= MISFIT
        return run.plant.GetPositions(run.context)[
            4
        ], run.friction.get_wrenches_output_port().Eval(run.own)[0]

    slid, friction = moved(1.5)
    assert abs(slid) < 1e-4 and friction == pytest.approx(-1.5, rel=1e-3)
    slid, friction = moved(2.2)
    assert slid > 1e-2 and friction == pytest.approx(-0.2 * 9.81, rel=1e-2)


# ---------------------------------------------------------------------- the systems framework


def test_contexts_that_are_cloned_go_on_alike():
    run = sliding("disc", "point", 2e-3, DISC)
    run.to(0.1)
    run.plant.SetVelocities(run.context, [0.0, 0.0, 10.0, 1.0, 0.0, 0.0])
    run.to(0.15)
    diagram = run.simulator.get_system()
    ends = []
    others = [run.simulator.get_context().Clone() for _ in range(2)]
    for context in (run.simulator.get_mutable_context(), *others):
        Simulator(diagram, context).AdvanceTo(0.2)
        ends.append(
            (
                context.get_discrete_state(0).value(),
                run.plant.GetPositionsAndVelocities(
                    run.plant.GetMyContextFromRoot(context)
                ),
            )
        )
    ends = [np.concatenate(each) for each in ends]
    assert np.array_equal(ends[0], ends[1]) and np.array_equal(ends[1], ends[2])
    bristles = run.friction.GetBristles(run.own)
    assert [each.shape for each in bristles] == [DISC.state_shape] and abs(
        bristles[0]
    ).max() > 0.0
    run.friction.SetDefaultContext(run.own)
    assert not run.friction.GetBristles(run.own)[0].any()


def test_ports_can_be_logged_watched_and_drawn():
    builder, plant, scene_graph = on_the_floor("box", "point", 2e-3, tilt=0.3)
    patches = _patches()
    prepare(plant, scene_graph, patches)
    friction = Friction.AddToBuilder(builder, plant, scene_graph, patches)
    ports = {
        "wrenches": friction.get_wrenches_output_port(), "twists": friction.get_twists_output_port(),
        "loads": friction.get_loads_output_port(), "report": friction.get_report_output_port(),
        "generalized_force": friction.get_generalized_force_output_port(),
    }  # fmt: skip
    logs = {name: LogVectorOutput(port, builder, 2e-3) for name, port in ports.items()}
    run = running(builder, plant, friction)
    seen = []

    def watch(root):
        seen.append(friction.GetReport(friction.GetMyContextFromRoot(root)).passes)
        return EventStatus.DidNothing()

    run.simulator.set_monitor(watch)
    run.to(0.1)
    data = {
        name: log.FindLog(run.simulator.get_context()).data()
        for name, log in logs.items()
    }
    assert {name: len(each) for name, each in data.items()} == {
        "wrenches": 3, "twists": 3, "loads": 1, "report": 6, "generalized_force": 6,
    }  # fmt: skip
    assert len(seen) >= 50 and max(seen) <= 5 and data["report"][0].max() == max(seen)
    np.testing.assert_array_equal(
        data["wrenches"][:, -1], ports["wrenches"].Eval(run.own)
    )
    # what the plant gets at a step is what the wrenches of that step were
    np.testing.assert_allclose(
        data["generalized_force"][3, 5:-1], data["wrenches"][0, 6:], atol=1e-6
    )
    assert "patch_friction" in run.simulator.get_system().GetGraphvizString()
    assert "patch_friction" in str(run.simulator.get_context())


def test_what_is_connected_later_is_refused_by_drake():
    builder, plant, scene_graph = on_the_floor("box", "point", 2e-3)
    patches = _patches()
    prepare(plant, scene_graph, patches)
    Friction.AddToBuilder(builder, plant, scene_graph, patches)
    late = builder.AddSystem(ConstantVectorSource(np.zeros(6)))
    with pytest.raises((RuntimeError, SystemExit), match=r"AlreadyWired|already"):
        builder.Connect(
            late.get_output_port(), plant.get_applied_generalized_force_input_port()
        )
    assert builder.IsConnectedOrExported(plant.get_applied_spatial_force_input_port())


def test_friction_is_added_once():
    """Drake itself would end the process."""
    builder, plant, scene_graph = on_the_floor("box", "point", 2e-3)
    prepare(plant, scene_graph, _patches())
    Friction.AddToBuilder(builder, plant, scene_graph, _patches())
    with refused("plant must have no patch friction yet"):
        Friction.AddToBuilder(builder, plant, scene_graph, _patches())


@pytest.mark.parametrize("contact", CONTACTS)
def test_parameters_changed_in_a_context_are_noticed(contact):
    """The plant slides with ten times the mass, or as it is: a state that is set surprises once."""
    run = sliding("disc", contact, 2e-3, DISC)
    warned = "parameters in its context are not those"
    run.to(0.1)
    run.plant.SetVelocities(run.context, [0.0, 0.0, 0.0, 0.5, 0.0, 0.0])
    run.to(0.102)
    report = run.friction.GetReport(run.own)
    assert report.surprise == pytest.approx(0.5, rel=1e-3) and report.converged
    run.to(0.12)
    assert run.friction.GetReport(run.own).surprise < EXPECTED
    run.plant.GetBodyByName("disc").SetMass(run.context, 2.0)
    with pytest.warns(UserWarning, match=warned):
        run.to(0.14)
    report = run.friction.GetReport(run.own)
    assert report.surprise > 100.0 * EXPECTED and not report.converged


def test_spatial_forces_are_seen():
    builder, plant, scene_graph = on_the_floor("box", "point", 2e-3)
    patches = _patches()
    prepare(plant, scene_graph, patches)
    pull = ExternallyAppliedSpatialForce()
    pull.body_index = plant.GetBodyByName("box").index()
    pull.p_BoBq_B = np.zeros(3)
    pull.F_Bq_W = SpatialForce(np.zeros(3), np.array([0.0, 1.2, 0.0]))
    source = builder.AddSystem(
        ConstantValueSource(Value[list[ExternallyAppliedSpatialForce]]([pull]))
    )
    builder.Connect(
        source.get_output_port(), plant.get_applied_spatial_force_input_port()
    )
    run = running(
        builder, plant, Friction.AddToBuilder(builder, plant, scene_graph, patches)
    )
    run.to(0.3)
    assert run.friction.GetReport(run.own).misfit <= MISFIT
    assert run.friction.get_wrenches_output_port().Eval(run.own)[1] == pytest.approx(
        -1.2, rel=1e-3
    )


# ---------------------------------------------------------------------- bad input


def _refused(message, patches, *, ready=True, scene=None):
    builder, plant, scene_graph = (
        on_the_floor("box", "point", 2e-3) if scene is None else scene
    )
    if ready:
        prepare(plant, scene_graph, _patches())
    with refused(message):
        Friction.AddToBuilder(builder, plant, scene_graph, patches)


def test_names_that_are_not_there_and_patches_that_do_not_fit_are_refused():
    def patch(**changes):
        return PatchContact(
            **{
                "model": BOX,
                "frame": "bottom",
                "geometries": ("floor", "box"),
                **changes,
            }
        )

    _refused(
        "frame must be a frame of the plant, got nowhere", [patch(frame="nowhere")]
    )
    _refused(
        "geometries must be a collision geometry or body of the plant, got lid",
        [patch(geometries=("floor", "lid"))],
    )
    _refused(
        "frame must be on the body of one of the geometries",
        [patch(geometries=("floor", "floor"))],
    )
    _refused(
        "patches must have each pair of geometries once, got floor and box",
        [patch(), patch(geometries=("foot 0", "floor"))],
    )
    _refused("patches must hold at least one, got none", [])
    _refused("patches must be a list of patches", patch())
    _refused(
        r"friction must be 0 on floor and box, on one of the two \(prepare does that\), got 0.5",
        [patch()],
        ready=False,
    )
    with refused("centre must be one of auto, frame, contact"):
        patch(centre="middle")
    with refused("geometries must be the names of two geometries or bodies, got floor"):
        patch(geometries="floor")


def test_plants_that_do_not_fit_are_refused():
    scene = on_the_floor("box", "point", 0.0)
    _refused(
        "time_step must be > 0: friction is for discrete plants, got 0",
        _patches(),
        scene=scene,
    )
    _refused(
        "plant must be finalized, got one that is not",
        _patches(),
        ready=False,
        scene=bare(2e-3),
    )
    scene = on_the_floor("box", "point", 2e-3)
    scene[0].ExportInput(scene[1].get_applied_generalized_force_input_port())
    _refused(
        "plant must have no exported input .*, got applied_generalized_force",
        _patches(),
        scene=scene,
    )
    _, plant, scene_graph = scene = on_the_floor("box", "point", 2e-3)
    bodies = [plant.GetBodyByName(name) for name in ("box", "world")]
    both = GeometrySet(
        [each for body in bodies for each in plant.GetCollisionGeometriesForBody(body)]
    )
    scene_graph.collision_filter_manager().Apply(
        CollisionFilterDeclaration().ExcludeWithin(both)
    )
    message = (
        r"geometries must be able to collide \(a collision filter keeps them apart\)"
    )
    _refused(message, _patches(), scene=scene)


def test_a_state_that_is_not_finite_stops_the_run():
    run = sliding("box", "point", 2e-3, BOX)
    run.to(0.01)
    state = run.context.get_mutable_discrete_state_vector()
    state.SetAtIndex(10, np.nan)
    with refused("state must be finite, got nan in that of the plant"):
        run.to(0.02)


def test_a_name_that_means_two_geometries_is_refused_with_both():
    builder, plant, scene_graph = bare(2e-3)
    for name in ("one", "two"):
        body = plant.AddRigidBody(
            name, SpatialInertia(1.0, [0, 0, 0], UnitInertia.SolidSphere(0.1))
        )
        plant.RegisterCollisionGeometry(
            body, RigidTransform(), Sphere(0.1), "ball", CoulombFriction(0.0, 0.0)
        )
    plant.Finalize()
    message = (
        r"geometries must be one geometry \(.*one::ball or .*two::ball\), got ball"
    )
    _refused(
        message,
        [PatchContact(PAD, frame="one", geometries=("ball", "two"))],
        ready=False,
        scene=(builder, plant, scene_graph),
    )


def test_without_drake_the_extra_is_named(monkeypatch):
    for name in [name for name in sys.modules if name.partition(".")[0] == "pydrake"]:
        monkeypatch.setitem(sys.modules, name, None)
    for name in [
        name for name in sys.modules if name.startswith("planarfriction.adapters.drake")
    ]:
        monkeypatch.delitem(sys.modules, name)
    with refused(r"pip install 'planarfriction\[drake\]'", MissingExtraError):
        importlib.import_module("planarfriction.adapters.drake")


# ---------------------------------------------------------------------- pressures of contact surfaces


TABLE = RigidTransform([0, -0.2, -0.05]), Box(0.4, 0.4, 0.1)


def spun(
    shape, height, model, beyond=0.0, hint=0.005, rolling=0.0, time=2e-3, table=TABLE, **options
):  # fmt: skip
    """Return wrench, load, covers and contact surface of a shape of 0.2 kg that spins, `beyond` an edge in y.

    It may roll along x, so fast.
    """
    builder, plant, scene_graph = bare(2e-3)
    inertia = SpatialInertia(0.2, [0, 0, 0], UnitInertia.SolidSphere(0.05))
    body = plant.AddRigidBody("body", inertia)
    compliant = material("hydroelastic")
    compliant.UpdateProperty("hydroelastic", "resolution_hint", hint)
    plant.RegisterCollisionGeometry(body, RigidTransform(), shape, "solid", compliant)
    rigid = material("hydroelastic", rigid=True)
    plant.RegisterCollisionGeometry(plant.world_body(), *table, "table", rigid)
    bottom = RigidTransform([0, 0, -height])
    plant.AddFrame(FixedOffsetFrame("bottom", body.body_frame(), bottom))
    plant.Finalize()
    start = RigidTransform([0, beyond, height - 1e-5])
    plant.SetDefaultFloatingBaseBodyPose(plant.GetBodyByName("body"), start)
    contact = {"frame": "bottom", "geometries": ("body", "table"), **options}
    patches = [PatchContact(model, pressure="surface", **contact)]
    prepare(plant, scene_graph, patches)
    friction = Friction.AddToBuilder(builder, plant, scene_graph, patches)
    run = running(builder, plant, friction)
    run.to(0.1)
    plant.SetVelocities(run.context, [0, rolling / height, 20.0, rolling, 0, 0])
    run.to(0.1 + time)
    wrench = friction.get_wrenches_output_port().Eval(run.own)
    load = friction.get_loads_output_port().Eval(run.own)[0]
    results = plant.get_contact_results_output_port().Eval(run.context)
    surface = results.hydroelastic_contact_info(0).contact_surface()
    assert friction.GetReport(run.own).converged
    return wrench, load, friction._read(run.own, "covers"), surface


def test_a_ball_presses_as_its_contact_surface_does():
    """Its pressure falls as 1 - (r/a)^2: the mean arm of a spin is 8/15 a."""
    law = dataclasses.replace(COULOMB, sigma_0=1e6)
    patch = pf.ContactPatch.rectangle(0.02, cells=24)
    model = pf.DistributedModel(patch, law)
    where = {"beyond": -0.2, "centre": "contact"}
    (*_, torque), load, _, surface = spun(Sphere(0.05), 0.05, model, **where)
    radius = np.sqrt(surface.total_area() / np.pi)
    assert torque == pytest.approx(-8.0 / 15.0 * 0.3 * load * radius, rel=0.01)


@pytest.mark.parametrize(("few", "close"), [(False, 0.01), (True, 0.06)])
def test_a_ball_that_rolls_presses_other_cells_all_the_time(few, close):
    """Its spin goes on as that of a ball that rests, 40 mm from where it began."""
    law = dataclasses.replace(COULOMB, sigma_0=1e5)
    patch = pf.ContactPatch.rectangle(0.02, cells=24)
    kind = pf.ReducedModel if few else pf.DistributedModel
    where = {"beyond": -0.2, "centre": "contact", "rolling": 0.2, "time": 0.2}
    (*_, torque), load, _, surface = spun(Sphere(0.05), 0.05, kind(patch, law), **where)
    radius = np.sqrt(surface.total_area() / np.pi)
    assert torque == pytest.approx(-8.0 / 15.0 * 0.3 * load * radius, rel=close)


@pytest.mark.parametrize("few", [False, True])
def test_a_disc_over_an_edge_acts_with_the_part_that_is_borne(few):
    """As a disc does that is pressed by a plane, within what Drake's pressure at the rim is off."""
    patch = pf.ContactPatch.disc(0.05, cells=21)
    kind = pf.ReducedModel if few else pf.DistributedModel
    shape = Cylinder(0.05, 0.02)
    model = kind(patch, COULOMB)
    (*_, torque), load, covers, _ = spun(shape, 0.01, model, -0.02, 0.02)
    assert covers[patch.positions[:, 1] > 0.023].max() == 0.0
    assert covers[abs(patch.positions[:, 1]) < 0.01].min() > 0.5
    wanted = pressed_by_a_plane(pf.ContactPatch.disc(0.05, cells=201), 0.02, load)
    assert torque == pytest.approx(wanted[1], rel=0.03)


def pressed_by_a_plane(patch, end, load):
    """Return force and torque of a spin, mu = 0.3, of the part of a patch up to y = `end` under a plane of pressure."""
    places = patch.positions[patch.positions[:, 1] < end]
    pressed = load * pf.ContactPatch.points(places).weights(1.0, moments=(0.0, 0.0))
    arms = np.hypot(*places.T)
    return 0.3 * (pressed * places[:, 1] / arms).sum(), -0.3 * (pressed * arms).sum()


def fine_table(file, side=0.01):
    """Return a table of 0.12 x 0.16 x 0.1 m up to y = 0 with faces of `side`: Drake's own boxes have few."""
    corners, triangles = [], []
    x, y, z = np.diag([0.12, 0.16, 0.1])
    low = np.array([-0.06, -0.16, -0.1])
    high = low + x + y + z
    faces = (low, y, x), (low, x, z), (low, z, y), (high, -x, -y), (high, -z, -x), (high, -y, -z)  # fmt: skip
    for corner, along, across in faces:
        (m, n) = (round(np.linalg.norm(each) / side) for each in (along, across))
        first = len(corners) + 1
        for i, j in np.ndindex(m + 1, n + 1):
            corners.append(corner + along * i / m + across * j / n)
        for i, j in np.ndindex(m, n):
            k = first + i * (n + 1) + j
            triangles += [(k, k + n + 1, k + n + 2), (k, k + n + 2, k + 1)]
    lines = [f"v {a:.6f} {b:.6f} {c:.6f}" for a, b, c in corners]
    file.write_text("\n".join([*lines, *(f"f {a} {b} {c}" for a, b, c in triangles)]))
    return RigidTransform(), Mesh(str(file))


@pytest.mark.parametrize(("few", "close"), [(False, 0.01), (True, 0.02)])
def test_a_box_over_an_edge_acts_with_the_part_that_is_borne(few, close, tmp_path):
    """Three and four tenths of it are over the edge; the force of a spin is in the friction of all of it."""
    patch = pf.ContactPatch.rectangle(0.06, 0.1, (12, 20))
    model = (pf.ReducedModel if few else pf.DistributedModel)(patch, COULOMB)
    table = fine_table(tmp_path / "table.obj")
    for over in (0.02, 0.01):
        shape = Box(0.06, 0.1, 0.02), 0.01
        wrench, load, *_ = spun(*shape, model, -over, table=table)
        whole = pf.ContactPatch.rectangle(0.06, 0.1, (120, 200))
        force, torque = pressed_by_a_plane(whole, over, load)
        assert wrench[2] == pytest.approx(torque, rel=close)
        assert wrench[0] == pytest.approx(
            force, abs=(0.05 if few else 0.01) * 0.3 * load
        )


@pytest.mark.parametrize("patches", [True, False])
def test_a_box_tips_over_an_edge_where_it_does_without_patches(patches):
    """On springs of 10 MPa over 20 mm, which a plane of pressure leaves at 0.4875 of the box; Drake's at 0.48."""
    stiff, side, high, weight = 1e7 / 0.02, 0.06, 0.02, 0.2 * 9.81
    least = (np.sqrt(2.0 * weight / (stiff * side)) / (6.0 * high)) ** (2.0 / 3.0)
    assert 0.5 - 3.0 * high * least / 0.1 == pytest.approx(0.4875, abs=1e-3)
    for over, tips in ((0.47, False), (0.49, True)):
        builder, plant, scene_graph = bare(2e-3)
        unit = UnitInertia.SolidBox(0.06, 0.1, 0.04)
        body = plant.AddRigidBody("body", SpatialInertia(0.2, [0, 0, 0], unit))
        soft, rigid = material("hydroelastic"), material("hydroelastic", rigid=True)
        soft.UpdateProperty("hydroelastic", "hydroelastic_modulus", 1e7)
        for each in (soft, rigid):
            each.UpdateProperty("material", "hunt_crossley_dissipation", 100.0)
        add = plant.RegisterCollisionGeometry
        add(body, RigidTransform(), Box(0.06, 0.1, 0.04), "solid", soft)
        add(plant.world_body(), *TABLE, "table", rigid)
        bottom = RigidTransform([0, 0, -0.02])
        plant.AddFrame(FixedOffsetFrame("bottom", body.body_frame(), bottom))
        plant.Finalize()
        start = RigidTransform([0, 0.1 * (over - 0.5), 0.02])
        plant.SetDefaultFloatingBaseBodyPose(body, start)
        model = pf.ReducedModel(pf.ContactPatch.rectangle(0.06, 0.1, (9, 15)), LAW)
        contact = PatchContact(
            model, frame="bottom", geometries=("body", "table"), pressure="surface"
        )
        if patches:
            prepare(plant, scene_graph, [contact])
            Friction.AddToBuilder(builder, plant, scene_graph, [contact])
        simulator = Simulator(builder.Build())
        simulator.AdvanceTo(0.8)
        context = plant.GetMyContextFromRoot(simulator.get_context())
        turn = plant.EvalBodyPoseInWorld(context, body).rotation().matrix()
        assert (abs(np.arctan2(turn[2, 1], turn[1, 1])) > 0.15) == tips


def test_contact_surfaces_press_cells_alone():
    model = pf.ReducedModelPublished(pf.ContactPatch.disc(0.05), COULOMB)
    with refused("loads.*without cells"):
        spun(Sphere(0.05), 0.05, model)
