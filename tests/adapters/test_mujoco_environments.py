"""Friction that differs between environments: copies of a MuJoCo model with parameters of their own."""

import copy
import dataclasses

import numpy as np
import pytest

import planarfriction as pf
from tests.support.refusals import refused

mujoco = pytest.importorskip("mujoco")

from mujoco import rollout  # noqa: E402

from planarfriction.adapters.mujoco import Friction, PatchContact, prepare  # noqa: E402
from tests.support.mujoco_misfit import step_checked  # noqa: E402

pytestmark = pytest.mark.mujoco

LAW = pf.LuGre(mu_c=0.4, mu_s=0.5, sigma_0=1e5, sigma_2=0.0, elasto_plastic=0.9)
OTHER = {
    "mu_c": 0.2,
    "mu_s": 0.3,
    "v_s": 2e-3,
    "sigma_0": 8e4,
    "sigma_1": 50.0,
    "sigma_2": 0.1,
    "breakaway_ratio": 0.7,
}
OTHER |= {"scale": 1.3, "centre_x": 0.01, "centre_y": -0.004}

BOX = """<mujoco><option timestep="0.002" integrator="implicitfast"/><worldbody>{support}
  <body name="box" pos="0 0 0.02"><freejoint/><site name="under" pos="{x} {y} -0.02"/>
  <inertial pos="0.004 0 -0.01" mass="0.3" diaginertia="1e-4 2.8e-4 3.4e-4"/>
  <geom name="box" type="box" size="0.05 0.03 0.02"/></body></worldbody></mujoco>"""

PLANE = '<geom name="under" type="plane" size="2 2 0.1"/>'
EDGE = '<geom name="under" type="box" size="0.06 0.02 0.05" pos="0 0 -0.05"/>'

KINDS = {
    "reduced": pf.ReducedModel,
    "published": pf.ReducedModelPublished,
    "cells that follow": pf.ReducedModel,
    "cells over an edge": pf.DistributedModel,
    "at a load": pf.ReducedModel,
}
PADS = {
    "at a load": pf.Pad.at_load(3.0),
    "layer": pf.Pad.layer(2e5, 2e-3),
    "with a common part": pf.Pad.measured(3e5, 0.4),
}


def _patch(scale):
    return pf.ContactPatch.rectangle(0.06 * scale, 0.04 * scale, cells=7)


def _made(kind, law=LAW, scale=1.0, centre=(0.0, 0.0)):
    follows = "follows" if "follow" in kind or "edge" in kind else "fixed"
    pad = {"pad": PADS[kind]} if kind in PADS else {}
    model = KINDS.get(kind, pf.DistributedModel)(_patch(scale), law, **pad)
    spec = mujoco.MjSpec.from_string(
        BOX.format(support=EDGE if "edge" in kind else PLANE, x=centre[0], y=centre[1])
    )
    patches = [
        PatchContact(model, site="under", geoms=("under", "box"), pressure=follows)
    ]
    prepare(spec, patches)
    return Friction(spec.compile(), patches)


def _slid(friction, m, steps=60):
    """Data of a box that slides and spins until it rests."""
    d = mujoco.MjData(m)
    d.qvel[0] = 0.3
    d.qvel[5] = 6.0
    for _ in range(steps):
        friction.step(d)
    return d


@pytest.mark.parametrize("kind", KINDS)
def test_a_copy_with_other_parameters_steps_as_a_model_made_with_them(kind):
    friction = _made(kind)
    (m,) = friction.copies({name: [value] for name, value in OTHER.items()})
    law = dataclasses.replace(
        LAW,
        elasto_plastic=pf.ElastoPlastic(OTHER["breakaway_ratio"]),
        **{
            name: value
            for name, value in OTHER.items()
            if name in LAW.numbers._fields and name != "breakaway_ratio"
        },
    )
    made = _made(kind, law, OTHER["scale"], (OTHER["centre_x"], OTHER["centre_y"]))
    for steps in (20, 60):  # while it slides, and near its end
        one = _slid(friction, m, steps)
        other = _slid(made, made.m, steps)
        # the patch is displaced in the plane of the contact, not of the face: 1e-4 of 1 cm above it
        np.testing.assert_allclose(one.qpos, other.qpos, atol=2e-6)
        np.testing.assert_allclose(friction.twists(one), made.twists(other), atol=1e-4)
        np.testing.assert_allclose(
            friction.wrenches(one), made.wrenches(other), atol=5e-4
        )
        np.testing.assert_allclose(
            friction.frame(one, 0)[0], made.frame(other, 0)[0], atol=1e-5
        )
    assert abs(one.qpos - _slid(friction, friction.m).qpos).max() > 1e-3


@pytest.mark.parametrize("kind", ["layer", "with a common part"])
def test_the_stiffness_of_a_pad_is_its_own(kind):
    """In a copy with another sigma_0 a box is held alike; `Pad.at_load` above follows."""
    friction = _made(kind, dataclasses.replace(LAW, sigma_1=0.0))
    (m,) = friction.copies({"sigma_0": [8e4]})
    ends = []
    for each in (friction.m, m):
        each.opt.gravity[0] = 1.0
        d = mujoco.MjData(each)
        for _ in range(40):
            friction.step(d)
        ends.append(d.qpos)
    assert ends[0][0] > 1e-6
    np.testing.assert_allclose(ends[0], ends[1], rtol=0.0, atol=1e-10)


def test_damping_of_bristles_on_a_common_part_is_refused():
    friction = _made("with a common part", dataclasses.replace(LAW, sigma_1=0.0))
    _refuses(friction, "sigma_1", 1.0, "sigma_1 must be 0 for a pad with a common")


def test_rollouts_of_many_models_on_threads_have_friction_of_their_own():
    friction = _made("reduced")
    drawn = pf.randomise(
        LAW,
        {"mu_c": (0.1, 0.6), "scale": (0.5, 1.5), "centre_x": (-0.01, 0.01)},
        6,
        seed=1,
    )
    models = friction.copies(drawn)
    full = mujoco.mjtState.mjSTATE_FULLPHYSICS
    start = np.zeros((6, mujoco.mj_stateSize(friction.m, full)))
    d = mujoco.MjData(friction.m)
    d.qvel[0] = 0.3
    d.qvel[5] = 6.0
    mujoco.mj_getState(friction.m, d, start[0], full)
    start[:] = start[0]
    with friction.install():
        path, _ = rollout.rollout(
            models, [mujoco.MjData(friction.m) for _ in range(2)], start, nstep=60
        )
    alone = np.array([_slid(friction, m).qpos for m in models])
    # The solver starts elsewhere.
    np.testing.assert_allclose(path[:, -1, 1:8], alone, atol=1e-8)
    # Less far with more friction.
    assert np.corrcoef(path[:, -1, 1], drawn["mu_c"])[0, 1] < -0.8


def test_parameters_may_change_between_steps():
    friction = _made("reduced")
    m = copy.copy(friction.m)
    d = _slid(friction, m, 10)
    friction.parameters(m)["mu_c"][:] = friction.parameters(m)["mu_s"][:] = 0.1
    friction.step(d)
    forces = np.hypot(*friction.wrenches(d)[:, :2].T) / friction.loads(d)
    assert forces < 0.1 + 1e-6
    assert friction.parameters()["mu_c"] == [0.4]


@pytest.mark.parametrize(
    ("name", "value", "rule"),
    [
        ("mu_c", 0.6, "mu_s must be >= mu_c, got mu_s=0.5, mu_c=0.6"),
        ("v_s", 0.0, "v_s must be > 0, got 0.0"),
        ("sigma_0", -1.0, "sigma_0 must be > 0"),
        ("sigma_1", -1.0, "sigma_1 must be >= 0"),
        ("breakaway_ratio", 1.0, "breakaway_ratio must be >= 0 and < 1"),
        ("scale", 0.0, "scale must be > 0"),
        ("centre_y", np.nan, "centre_y must be finite"),
    ],
)
def test_numbers_out_of_range_are_refused_and_have_no_friction(name, value, rule):
    _refuses(_made("reduced"), name, value, rule)


def _refuses(friction, name, value, rule):
    with refused(rule):
        friction.copies({name: [value]})
    m = copy.copy(friction.m)
    friction.parameters(m)[name][:] = value
    d = mujoco.MjData(m)
    with refused(rule):
        friction.step(d)
    with friction.install():
        mujoco.mj_step(m, d)
        assert friction.report(d).iterations == -2 and np.isfinite(d.qpos).all()


def test_arrays_of_other_shapes_are_refused():
    friction = _made("reduced")
    with refused(r"mu_c must have shape \[\] or \[2\] or \[2, 1\]"):
        friction.copies({"v_s": [1e-3, 2e-3], "mu_c": [0.1, 0.2, 0.3]})
    with refused("parameters must hold an array"):
        friction.copies({"mu_c": 0.3})
    with refused("did you mean 'scale'"):
        friction.copies({"scal": [0.3]})


def test_a_displaced_patch_of_another_size_that_rolls_along():
    """A cylinder whose patch follows its contact: twists, loads and frames fit the motion of the bodies."""
    spec = mujoco.MjSpec.from_string("""<mujoco><option timestep="0.002" tolerance="1e-15"/><worldbody>
      <geom name="under" type="plane" size="2 2 0.1"/>
      <body name="roll" pos="0 0 0.05" euler="90 0 0"><freejoint/><site name="roll" pos="0 -0.05 0" zaxis="0 1 0"/>
      <geom name="roll" type="cylinder" size="0.05 0.03" mass="0.3"/></body></worldbody></mujoco>""")
    model = pf.ReducedModel(pf.ContactPatch.rectangle(0.004, 0.06, cells=9), LAW)
    patches = [PatchContact(model, site="roll", geoms=("under", "roll"))]
    prepare(spec, patches)
    friction = Friction(spec.compile(), patches)
    (m,) = friction.copies({"scale": [0.5], "centre_x": 0.001, "centre_y": 0.004})
    d = mujoco.MjData(m)
    d.qvel[:2] = 0.2, 0.1
    for _ in range(80):
        step_checked(friction, d, 1e-8)
