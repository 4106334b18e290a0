"""Patch friction inside MuJoCo: steps, callbacks and rollouts that agree, whatever else is in the model."""

import copy
import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest

import planarfriction as pf
from tests.support.refusals import refused

mujoco = pytest.importorskip("mujoco")

from mujoco import rollout  # noqa: E402

from planarfriction.adapters.mujoco import (  # noqa: E402
    Friction,
    PatchContact,
    prepare,
)
from planarfriction.adapters.mujoco.library import _SHARED  # noqa: E402
from planarfriction.adapters.mujoco.loops import step  # noqa: E402
from planarfriction_studies.bench import mujoco_scenes  # noqa: E402
from tests.support.mujoco_misfit import misfit, step_checked, twists_and_loads  # noqa: E402

pytestmark = pytest.mark.mujoco

LAW = pf.LuGre(mu_c=0.5, mu_s=0.6, elasto_plastic=0.9)
PAD = pf.ReducedModel(pf.ContactPatch.disc(radius=0.01, cells=9), LAW)
STATE = mujoco.mjtState.mjSTATE_INTEGRATION


def _made(text, patches, **options):
    spec = mujoco.MjSpec.from_string(text)
    for name, value in options.items():
        setattr(spec.option, name, value)
    prepare(spec, patches)
    m = spec.compile()
    return m, mujoco.MjData(m), Friction(m, patches)


def _held(scene, steps=100, **options):
    """A scene that has settled."""
    m, d, friction = scene.ours(**options)
    d.ctrl[:] = scene.control(0.0)
    for _ in range(steps):
        friction.step(d)
    return m, d, friction


def _saved(m, d):
    saved = np.zeros(mujoco.mj_stateSize(m, STATE))
    mujoco.mj_getState(m, d, saved, STATE)
    return saved


# ---------------------------------------------------------------------- what comes out is what was solved for


@pytest.mark.parametrize("integrator", ["Euler", "implicit", "implicitfast"])
@pytest.mark.parametrize("jacobian", ["dense", "sparse"])
def test_twists_and_loads_come_out_as_they_were_solved_for(integrator, jacobian):
    """Two moving bodies, four contact points, damped joints, friction loss and limits that are reached."""
    text = f"""<mujoco><option timestep="0.002" jacobian="{jacobian}" integrator="{integrator}"
    tolerance="1e-15"/><worldbody>
    <body name="tray"><joint name="x" type="slide" axis="1 0 0" damping="8" frictionloss="1.5" range="-0.03 0.03"/>
    <joint type="slide" axis="0 0 1" damping="30" stiffness="3000" frictionloss="0.2"/>
    <joint name="tilt" axis="0 1 0" damping="0.5" stiffness="30"/>
    <geom name="tray" type="box" size="0.2 0.1 0.005" mass="0.4" contype="1" conaffinity="0"/></body>
    <body name="box" pos="0.03 0.01 0.03"><freejoint/>
    <geom name="box" type="box" size="0.02 0.015 0.025" mass="0.3" contype="0" conaffinity="1"/>
    <site name="box" pos="0 0 -0.025" euler="0 0 30"/></body></worldbody>
    <actuator><position joint="x" kp="300" kv="5"/></actuator></mujoco>"""
    _, d, friction = _made(
        text, [PatchContact(PAD, site="box", geoms=("box", "tray"), centre="contact")]
    )
    seen = {"slid": 0.0, "passes": 0, "followed": 0.0}
    for i in range(600):
        d.ctrl[:] = 0.04 * np.sin(25.0 * d.time)
        d.xfrc_applied[2, 5] = 0.01 * np.sin(40.0 * d.time)
        step_checked(friction, d, 1e-8)
        if i > 150:
            seen["slid"] = max(seen["slid"], abs(friction.twists(d)).max())
        seen["passes"] = max(seen["passes"], friction.report(d).passes)
        seen["followed"] = max(seen["followed"], abs(friction.loads(d)[0] - 0.3 * 9.81))
    assert seen["slid"] > 0.1 and seen["passes"] > 1 and seen["followed"] > 0.5


def test_contact_is_lost_and_found_again():
    scene = mujoco_scenes.tray(1)
    m, d, friction = _held(scene, 200)
    m.opt.tolerance = 1e-15
    before = d.qvel.copy()
    friction.step(d)
    assert misfit(friction, d, before) < 1e-8 and abs(friction.state(d)).max() > 0.0
    d.qvel[4] = 1.0
    loads = []
    for _ in range(200):
        step_checked(friction, d, 1e-8)
        loads.append(friction.loads(d)[0])
        if loads[-1] == 0.0:
            assert (friction.wrenches(d) == 0.0).all() and (
                friction.state(d) == 0.0
            ).all()
    away = np.flatnonzero(np.array(loads) == 0.0)
    assert (
        80 < len(away) < 110
        and away[-1] < 180
        and loads[-1] == pytest.approx(0.981, rel=1e-2)
    )


@pytest.mark.parametrize(
    ("cone", "solver"),
    [("pyramidal", "Newton"), ("elliptic", "Newton"), ("elliptic", "CG")],
)
def test_other_contacts_keep_mujocos_own_friction(cone, solver):
    """A box that is dragged over the floor by another on it: MuJoCo's friction below, that of a patch between."""
    text = f"""<mujoco><option timestep="0.002" cone="{cone}" solver="{solver}" tolerance="1e-15" iterations="200"/>
    <default><geom friction="0.1 0.01 0" condim="4"/></default><worldbody>
    <geom name="floor" type="plane" size="1 1 0.1" contype="2" conaffinity="2"/>
    <body name="lower" pos="0 0 0.02"><freejoint/>
    <geom name="lower" type="box" size="0.05 0.05 0.02" mass="0.3" contype="3" conaffinity="2"/></body>
    <body name="upper" pos="0.005 0 0.06"><freejoint/>
    <geom name="upper" type="box" size="0.03 0.03 0.02" mass="0.5" contype="0" conaffinity="1"/>
    <site name="upper" pos="0 0 -0.02"/></body></worldbody></mujoco>"""
    face = pf.ReducedModel(pf.ContactPatch.rectangle(0.06, cells=9), LAW)
    _, d, friction = _made(
        text, [PatchContact(face, site="upper", geoms=("lower", "upper"))]
    )
    slid = np.zeros(2)
    for _ in range(400):
        d.qfrc_applied[6] = 6.0 * np.sin(12.0 * d.time)
        d.qfrc_applied[11] = 0.05 * np.cos(9.0 * d.time)
        step_checked(friction, d, 1e-8 if solver == "Newton" else 1e-6)
        slid = np.maximum(slid, abs(d.qvel[[0, 6]]))
    assert slid.min() > 0.05  # the lower slides on the floor
    assert friction.report(d).passes <= 4


def test_many_trees_with_sparse_jacobians_step_as_with_dense_ones():
    scene = mujoco_scenes.tray(11)
    ends = {}
    assert scene.ours()[0].nv == 68
    for jacobian in (0, 1):
        m, d, friction = scene.ours()
        m.opt.jacobian = jacobian
        d = mujoco.MjData(m)
        for _ in range(100):
            d.ctrl[:] = scene.control(d.time)
            step_checked(friction, d, 1e-8)
        ends[jacobian] = d.qpos.copy()
    # the solver's tolerance, over 100 steps
    np.testing.assert_allclose(ends[1], ends[0], atol=1e-9)


def test_models_of_all_kinds_hold_and_pads_may_differ():
    patch = pf.ContactPatch.disc(radius=0.01, cells=9)
    law = pf.LuGre(mu_c=1.0, elasto_plastic=0.9)
    scene = mujoco_scenes.grip()
    kinds = (
        pf.DistributedModel(patch, law),
        pf.ReducedModelPublished(patch, law),
        pf.ReducedModel(patch, law),
    )
    text = scene.text(mujoco_scenes.Native(solref=0.02), 2e-3, "Euler")
    for kind in kinds:
        models = PAD, kind
        patches = [
            PatchContact(model, site=s, geoms=g)
            for model, (s, g) in zip(models, scene.patches, strict=True)
        ]
        _, d, friction = _made(text, patches)
        d.ctrl[:] = 6.0
        for _ in range(200):
            step_checked(friction, d, 1e-8)
        assert abs(d.qvel).max() < 1e-6
        states = friction.coupled.states(friction.state(d))
        assert [each.shape for each in states] == [each.state_shape for each in models]


def test_twists_and_wrenches_are_in_the_axes_of_the_site():
    """Whatever tangents MuJoCo gives the contact: the weight is along the axis of the site that lies aslant."""
    scene = mujoco_scenes.tray(1)
    text = scene.text(mujoco_scenes.Native(solref=0.02), 2e-3, "Euler").replace(
        'site name="block 0" pos="0 0 -0.02"',
        'site name="block 0" pos="0 0 -0.02" euler="0 0 40"',
    )
    m, d, friction = _made(
        text, [PatchContact(PAD, site="block 0", geoms=("tray", "block 0"))]
    )
    m.opt.gravity[0] = 2.0
    for _ in range(300):
        friction.step(d)
    turned = np.radians(40.0)
    wrench = friction.wrenches(d)[0]
    np.testing.assert_allclose(
        wrench[:2], -0.1 * 2.0 * np.array([np.cos(turned), -np.sin(turned)]), atol=1e-6
    )
    d.qvel[2:4] = 3.0, 0.0
    before = d.qvel.copy()
    friction.step(d)
    vx, vy, _ = friction.twists(d)[0]
    assert vx > 1.0 and np.arctan2(-vy, vx) == pytest.approx(turned, abs=1e-2)
    np.testing.assert_allclose(
        twists_and_loads(friction, d, before)[0], friction.twists(d), atol=1e-8
    )


# ---------------------------------------------------------------------- the callback


def test_installed_friction_steps_as_step_does_and_keeps_user_data():
    scene = mujoco_scenes.shaken()
    m, d, friction = _held(scene)
    other = copy.copy(d)
    other.qfrc_applied[4] = 0.1
    d.qfrc_applied[4] = 0.1
    with friction.install() as installed:
        assert installed is friction and mujoco.get_mjcb_control() is not None
        for _ in range(100):
            mujoco.mj_step(m, other)
    assert mujoco.get_mjcb_control() is None
    for _ in range(100):
        friction.step(d)
    assert np.array_equal(d.qpos, other.qpos) and np.array_equal(
        friction.state(d), friction.state(other)
    )
    for each in (d, other):
        assert (
            each.qfrc_applied[4] == 0.1
            and (np.delete(each.qfrc_applied, 4) == 0.0).all()
        )


def test_other_models_are_left_alone_and_copies_are_not():
    scene = mujoco_scenes.grip()
    m, _, friction = _held(scene)
    same = copy.copy(m)
    bare = mujoco.MjModel.from_xml_string("<mujoco><worldbody/></mujoco>")
    other = mujoco.MjData(same)
    nothing = mujoco.MjData(bare)
    with friction.install():
        mujoco.mj_step(bare, nothing)
        other.ctrl[:] = 3.0
        for _ in range(200):
            mujoco.mj_step(same, other)
    assert np.hypot(*friction.wrenches(other)[:, :2].T).sum() > 1.0


def test_copies_are_known_by_arrays_of_the_bytes_that_these_have():
    """A byte more would be read from the array behind it, which copies need not share."""
    m = mujoco.MjModel.from_xml_string("""
        <mujoco>
          <worldbody>
            <geom name="a" size="1"/>
            <body><freejoint/><geom name="b" size="1"/><site/></body>
          </worldbody>
          <contact><pair geom1="a" geom2="b"/></contact>
          <custom><numeric name="c" data="1"/></custom>
        </mujoco>""")
    for name, (count, size) in _SHARED.items():
        entries = getattr(m, count)
        assert entries > 0
        assert len(bytes(getattr(m, name))) == entries * size, name


@pytest.mark.filterwarnings("ignore:the time of these data went on:UserWarning")
def test_another_model_of_the_same_size_is_not_served():
    """It has the same joints and user data, and pads with other friction; a model prepared for the same is a copy."""
    scene = dataclasses.replace(mujoco_scenes.grip(), model=PAD)
    friction = _held(scene)[2]
    law = dataclasses.replace(LAW, mu_c=0.4)
    m, other, slippery = scene.ours(model=pf.ReducedModel(PAD.patch, law))
    assert (m.nv, m.nuserdata) == (friction.m.nv, friction.m.nuserdata)
    with refused("d must be data of the model of the patches, or of a copy"):
        friction.step(other)
    with friction.install():
        for data in (other, mujoco.MjData(scene.ours()[0])):
            data.ctrl[:] = 3.0
            for _ in range(5):
                mujoco.mj_step(data.model, data)
            assert friction.loads(data).any() == (data is not other)
    slippery.step(other)
    friction.step(mujoco.MjData(scene.ours()[0]))


def test_forward_changes_nothing():
    """And neither do steps over velocities alone, nor finite differences, which begin half-way."""
    scene = mujoco_scenes.shaken()
    m, d, friction = _held(scene)
    other = copy.copy(d)
    with friction.install():
        for i in range(40):
            for each in (d, other):
                each.ctrl[:] = scene.control(d.time)
            mujoco.mj_step(m, d)
            for _ in range(i % 6):
                mujoco.mj_forward(m, other)
            if i % 7 == 0:
                mujoco.mj_forwardSkip(m, other, mujoco.mjtStage.mjSTAGE_VEL, 0)
            mujoco.mj_step(m, other)
            assert np.array_equal(_saved(m, d), _saved(m, other))
        state = friction.state(d).copy()
        for _ in range(5):
            mujoco.mj_forward(m, d)
        assert np.array_equal(friction.state(d), state)


def test_friction_counts_once_where_velocities_are_not_updated():
    m, d, friction = _held(mujoco_scenes.grip("box"))
    with friction.install():
        mujoco.mj_forward(m, d)
        passive = d.qfrc_passive.copy()
        mujoco.mj_forwardSkip(m, d, mujoco.mjtStage.mjSTAGE_VEL, 1)
    assert abs(passive).max() > 0.1
    np.testing.assert_allclose(d.qfrc_passive, passive, rtol=1e-6, atol=1e-9)


def test_derivatives_by_finite_differences_see_friction():
    """A held block falls with its pads, not through them: its velocity follows that of the gripper."""
    m, d, friction = _held(mujoco_scenes.shaken(), 300)
    before = _saved(m, d)
    a = np.zeros((2 * m.nv + m.na, 2 * m.nv + m.na))
    with friction.install():
        mujoco.mjd_transitionFD(m, d, 1e-6, True, a, None, None, None)
        mujoco.mj_setState(m, d, before, STATE)
        other = copy.copy(d)
        for each, push in ((d, 1e-6), (other, -1e-6)):
            each.qvel[0] += push
            mujoco.mj_step(m, each)
    lift = m.nv + 0
    block = m.nv + m.joint("turn").id + 5
    assert a[block, lift] == pytest.approx(
        (d.qvel - other.qvel)[block - m.nv] / 2e-6, rel=1e-4
    )


def test_data_restore_bit_for_bit():
    scene = mujoco_scenes.shaken()
    for integrator in ("Euler", "implicit", "implicitfast"):
        m, d, friction = _held(scene, integrator=integrator)
        saved = _saved(m, d)
        other = mujoco.MjData(m)
        mujoco.mj_setState(m, other, saved, STATE)
        for each in (d, other, copy.copy(d)):
            mujoco.mj_setState(m, each, saved, STATE)
            for i in range(30):
                each.ctrl[:] = scene.control(1e-3 * i)
                friction.step(each)
            assert np.array_equal(_saved(m, each), _saved(m, d))
    friction.reset(d)
    assert (friction.state(d) == 0.0).all() and (friction.wrenches(d) == 0.0).all()


def test_rollouts_agree_for_any_former_data_and_number_of_threads():
    scene = dataclasses.replace(mujoco_scenes.tray(2), time=0.0)
    m, d, friction = scene.ours()
    scene.run(m, d, lambda: friction.step(d))
    full = mujoco.mjtState.mjSTATE_FULLPHYSICS
    start = np.zeros(mujoco.mj_stateSize(m, full))
    mujoco.mj_getState(m, d, start, full)
    starts = np.tile(start, (6, 1))
    controls = np.array(
        [[scene.control(2e-3 * i + 0.1 * e) for i in range(40)] for e in range(6)]
    )
    one = mujoco.MjData(m)
    with friction.install():
        first, _ = rollout.rollout(m, one, starts, controls)
        again, _ = rollout.rollout(m, one, starts, controls)
        threads, _ = rollout.rollout(m, [one, mujoco.MjData(m)], starts, controls)
    assert np.array_equal(first, again) and np.array_equal(first, threads)
    mujoco.mj_setState(m, one, start, full)
    friction.reset(one)
    for i in range(40):
        one.ctrl[:] = controls[-1, i]
        friction.step(one)
    mujoco.mj_getState(m, one, start, full)
    # MuJoCo's solver starts elsewhere
    np.testing.assert_allclose(first[-1, -1], start, atol=1e-8)


# ---------------------------------------------------------------------- what is refused


BAD = {
    "RK4": (
        "integrator",
        1,
        "integrator must be Euler, implicit, implicitfast, got RK4",
    ),
    "noslip": (
        "noslip_iterations",
        3,
        "noslip_iterations must be 0: they would change the solution, got 3",
    ),
    "timestep": (
        "timestep",
        0.011,
        r"timestep must be at most half of solref\[0\] = 0.02 s of the pair",
    ),
}
if hasattr(mujoco.mjtIntegrator, "mjINT_DISCRETE"):
    discrete = int(mujoco.mjtIntegrator.mjINT_DISCRETE)
    BAD["discrete"] = (
        "integrator",
        discrete,
        "integrator must be Euler, implicit, implicitfast, got DISCRETE",
    )
if hasattr(mujoco.mjtEnableBit, "mjENBL_SLEEP"):
    BAD["sleep"] = (
        "enableflags",
        int(mujoco.mjtEnableBit.mjENBL_SLEEP),
        "sleep must be disabled",
    )


@pytest.mark.parametrize("name", BAD)
def test_options_that_do_not_fit_are_refused(name):
    option, value, message = BAD[name]
    m, _, friction = mujoco_scenes.grip().ours()
    setattr(m.opt, option, value)
    with refused(message):
        Friction(m, friction.patches)
    with refused(message), friction.install():
        pass
    assert mujoco.get_mjcb_control() is None


CHANGED = BAD | {"timestep": ("timestep", 0.015, BAD["timestep"][2])}


@pytest.mark.parametrize("name", [*CHANGED, "condim"])
def test_options_changed_at_run_time_are_refused_before_the_step(name):
    m, d, friction = _held(mujoco_scenes.grip())
    if name == "condim":
        m.pair_dim[0] = 3
        message = "pair must have condim 1 between pad left and block"
    else:
        option, value, message = CHANGED[name]
        setattr(m.opt, option, value)
    time = d.time
    with refused(message):
        friction.step(d)
    assert d.time == time and (friction.wrenches(d) == 0.0).all()
    with refused(message):
        friction.step(d)
    m.opt.integrator = 0
    m.opt.noslip_iterations = 0
    m.opt.timestep = 2e-3
    m.opt.enableflags = 0
    m.pair_dim[:] = 1
    with (
        refused("integrator"),
        friction.install(),
    ):
        friction.step(d)
        assert friction.report(d).converged
        m.opt.integrator = 1
        mujoco.mj_step(m, d)
        assert friction.report(d).iterations == -2 and not friction.report(d).converged


@pytest.mark.parametrize("integrator", ["implicit", "implicitfast"])
def test_implicit_steps_may_be_longer_than_contacts_are_stiff(integrator):
    """A quarter of what Euler takes: MuJoCo makes contacts softer (`refsafe`), unless it may not."""
    scene = dataclasses.replace(mujoco_scenes.grip(), time=1.0)
    with refused(r"or 0\.01 s with refsafe and implicit or implicitfast, got"):
        scene.ours(5e-3, "Euler", 0.004)
    m, d, friction = scene.ours(5e-3, integrator, 0.004)
    path = scene.run(m, d, lambda: friction.step(d))
    assert abs(path[-1, :3] - path[100, :3]).max() < 4e-10  # 0.0004 um
    m.opt.disableflags = int(mujoco.mjtDisableBit.mjDSBL_REFSAFE)
    with refused("timestep"):
        friction.step(d)


def test_preparing_twice_takes_user_data_once():
    text = mujoco_scenes.grip().text(mujoco_scenes.Native(solref=0.02), 2e-3, "Euler")
    patches = [
        PatchContact(PAD, site=site, geoms=geoms)
        for site, geoms in mujoco_scenes.grip().patches
    ]
    spec = mujoco.MjSpec.from_string(text)
    once = mujoco.MjSpec.from_string(text)
    spec.nuserdata = once.nuserdata = 7  # the user's own
    prepare(once, patches)
    for each in (patches, patches[:1], patches):
        prepare(spec, each)
    m = spec.compile()
    assert m.nuserdata == once.nuserdata and m.npair == 2 and len(spec.numerics) == 1
    again = mujoco.MjSpec.from_string(spec.to_xml())
    prepare(again, patches)
    assert again.nuserdata == once.nuserdata
    Friction(m, patches)


def test_unprepared_models_and_unknown_names_are_refused():
    scene = mujoco_scenes.grip()
    m, _, friction = scene.ours()
    patches = friction.patches
    pads = ("pad left", "block")
    bare, _ = scene.native(mujoco_scenes.Native())
    with refused(r"pair must be in the model \(prepare adds it\)"):
        Friction(bare, patches)
    text = scene.text(mujoco_scenes.Native(solref=0.02), 2e-3, "Euler")
    spec = mujoco.MjSpec.from_string(text)
    prepare(spec, patches)
    spec.pairs[0].condim = 3
    with refused(r"pair must have condim 1 between .* got 3"):
        Friction(spec.compile(), patches)
    spec.pairs[0].condim = 1
    spec.nuserdata = 5
    with refused(r"nuserdata must be at least \d+ \(prepare adds them\), got 5"):
        Friction(spec.compile(), patches)
    soft = pf.ContactPatch.rectangle(
        0.02, cells=9, pressure=pf.SoftFinger(c=0.01, n=0.3, k=2.0)
    )
    for wrong, message in (
        (
            [patches[0], patches[0]],
            "patches must have each pair of geoms once, got block, pad left",
        ),
        ([], "patches must be a list of PatchContact, not empty"),
        (
            patches[0],
            "patches must be a list of PatchContact, not empty, got PatchContact",
        ),
        (
            [PatchContact(PAD, site="left", geoms=("block", "block"))],
            "geoms must be on two bodies",
        ),
        (
            [PatchContact(PAD, site="nowhere", geoms=pads)],
            "site must be in the model, got nowhere",
        ),
        (
            [PatchContact(PAD, site="left", geoms=("pad left", "nothing"))],
            "geoms must be in the model, got nothing",
        ),
        (
            [PatchContact(PAD, site="left", geoms=("pad left", "pad right"))],
            "site must be on the body of one of the geoms",
        ),
        (
            [PatchContact(pf.ReducedModel(soft, LAW), "left", pads)],
            "model must have a shape that does not change with",
        ),
        ([PAD], "patches must be patches"),
    ):
        with refused(message):
            Friction(m, wrong)
    for wrong, message in (
        (
            [PatchContact(PAD, site="nowhere", geoms=pads)],
            "site must be in the model, got nowhere",
        ),
        (
            [PatchContact(PAD, site="left", geoms=("pad left", "nothing"))],
            "geoms must be in the model, got nothing",
        ),
        ([patches[0], patches[0]], "patches must have each pair of geoms once"),
    ):
        with refused(message):
            prepare(mujoco.MjSpec.from_string(text), wrong)
    with refused("centre must be one of auto, site, contact"):
        PatchContact(PAD, site="L", geoms=pads, centre="middle")


def test_one_callback_at_a_time():
    _, _, friction = mujoco_scenes.grip().ours()
    refused = pytest.raises(
        pf.errors.FrictionError, match="a control callback is installed already"
    )
    with friction.install(), refused, friction.install():
        pass
    mujoco.set_mjcb_control(lambda m, d: None)
    try:
        with refused, friction.install():
            pass
    finally:
        mujoco.set_mjcb_control(None)


def test_a_state_that_is_not_finite_is_told():
    _, d, friction = _held(mujoco_scenes.grip())
    friction.state(d)[1] = np.nan
    with refused("state must be finite"):
        friction.step(d)
    assert not friction.report(d).converged and (friction.state(d) == 0.0).all()
    friction.step(d)
    assert friction.report(d).converged


def test_new_pairs_have_what_their_geoms_say_and_old_ones_what_they_say():
    text = mujoco_scenes.grip().text(mujoco_scenes.Native(solref=0.008), 2e-3, "Euler")
    patches = [PatchContact(PAD, site="left", geoms=("pad left", "block"))]
    m, _, _ = _made(text, patches)
    assert m.pair_solref[0, 0] == 0.008 and m.pair_dim[0] == 1
    pair = '<contact><pair geom1="block" geom2="pad left" solref="0.03 1" condim="4"/></contact></mujoco>'
    m, _, _ = _made(text.replace("</mujoco>", pair), patches)
    assert m.npair == 1 and m.pair_solref[0, 0] == 0.03 and m.pair_dim[0] == 1


@pytest.mark.parametrize("settled", [True, False])
def test_a_solved_step_is_converged_only_if_the_constraints_settled(
    settled, monkeypatch
):
    monkeypatch.setattr(step, "copy", lambda source, target, count: None)
    rows = dict.fromkeys(("wrench", "new", "twist", "load", "after"))
    numbers = {name: np.zeros(1) for name in ("iterations", "passes", "residual")}
    own = SimpleNamespace(
        host=SimpleNamespace(count=0, states=0),
        kept=SimpleNamespace(**rows, **numbers, converged=np.zeros(1)),
        problem=SimpleNamespace(**rows, **numbers, converged=np.ones(1)),
    )
    step._remember.py_func(own, None, 3.0, 30, settled)
    assert bool(own.kept.converged[0]) is settled
