"""Patch friction inside MuJoCo Warp, on Warp's CPU device: what the adapter of MuJoCo does, in many worlds.

Its own kernels and MuJoCo Warp's take a minute to compile on two processors, so most of these tests are slow ones.
"""

import dataclasses
import logging

import numpy as np
import pytest

import planarfriction as pf
from tests.support.refusals import refused

mujoco = pytest.importorskip("mujoco", reason="needs the extra [mujoco-warp]")
wp = pytest.importorskip("warp", reason="needs the extra [mujoco-warp]")
mjw = pytest.importorskip("mujoco_warp", reason="needs the extra [mujoco-warp]")

from planarfriction.adapters import mujoco as adapter  # noqa: E402
from planarfriction.adapters.mujoco_warp import Friction, PatchContact, prepare  # noqa: E402
from planarfriction_studies.bench.mujoco_scenes import (  # noqa: E402
    Native,
    capsule,
    disc,
    grip,
    plate,
    shaken,
    tray,
)
from tests.support.linkage import linkage  # noqa: E402

pytestmark = pytest.mark.mujoco_warp
SLOW = pytest.mark.slow

DT = 2e-3


@pytest.fixture(autouse=True, scope="module")
def quiet():
    before = wp.config.log_level
    wp.config.log_level = logging.ERROR
    yield
    wp.config.log_level = before


def made(scene, model=None, pressure="auto", integrator="Euler", **options):
    """Return a model, data and patches of a scene."""
    text = scene.text(Native(cone="pyramidal", impratio=1.0, condim=1), DT, integrator)
    spec = mujoco.MjSpec.from_string(text)
    for name, value in options.items():
        setattr(spec.option, name, value)
    patches = [
        PatchContact(model or scene.model, site=site, geoms=geoms, pressure=pressure)
        for site, geoms in scene.patches
    ]
    prepare(spec, patches)
    m = spec.compile()
    return m, mujoco.MjData(m), patches


class Both:
    """A scene that has settled in MuJoCo, and the same in the worlds of MuJoCo Warp."""

    def __init__(self, scene, worlds=2, parameters=None, **options):
        self.scene = scene
        self.m, self.d, patches = made(scene, **options)
        self.theirs = adapter.Friction(self.m, patches)
        self.ours = Friction(
            self.m, patches, worlds=worlds, njmax=100, nconmax=40, parameters=parameters
        )
        gravity = self.m.opt.gravity.copy()
        if scene.weightless:
            self.m.opt.gravity[:] = 0.0
        self.control(0.0)
        for _ in range(round(scene.settle / DT)):
            self.theirs.step(self.d)
        self.m.opt.gravity[:] = gravity
        if scene.start is not None:
            self.d.qvel[:] = scene.start
        data = self.ours.data
        for name in ("qpos", "qvel", "qacc_warmstart", "userdata"):
            getattr(data, name).assign(
                np.tile(getattr(self.d, name), (worlds, 1)).astype(np.float32)
            )
        data.time.fill_(self.d.time)

    def control(self, t):
        if self.m.nu:
            controls = np.array(self.scene.control(t))
            self.d.ctrl[:] = controls
            self.ours.data.ctrl.assign(
                np.tile(controls, (self.ours.data.nworld, 1)).astype(np.float32)
            )

    def run(self, seconds):
        """Return positions of all worlds [steps, E, nq] and of MuJoCo [steps, nq]."""
        ours = []
        theirs = []
        for i in range(round(seconds / DT)):
            self.control(i * DT)
            self.ours.step()
            self.theirs.step(self.d)
            ours.append(self.ours.data.qpos.numpy().astype(float))
            theirs.append(self.d.qpos.copy())
        self.ours.coupled.check()
        assert self.ours.report().converged.all()
        return np.array(ours), np.array(theirs)


# ---------------------------------------------------------------------- scenes


@pytest.mark.parametrize(
    "scene", [disc(1.0, 10.0), shaken(), plate(2)], ids=["disc", "shaken", "plate"]
)
def test_scenes_begin_to_move_as_in_mujoco(scene):
    ours, theirs = Both(scene).run(0.06)
    assert np.array_equal(ours[:, 0], ours[:, 1])
    np.testing.assert_allclose(ours[:, 0], theirs, atol=1e-6)


@SLOW
@pytest.mark.parametrize(
    "scene",
    [
        disc(1.0, 10.0),
        disc(1.0, 20.0),
        grip("sphere"),
        grip("box"),
        grip("cylinder"),
        shaken(),
        plate(1),
        plate(2),
    ],
    ids=["disc", "spun", "sphere", "box", "cylinder", "shaken", "plate 1", "plate 2"],
)
def test_scenes_move_as_in_mujoco(scene):
    """Held, shaken, spun to rest, turned in the hand; all worlds alike."""
    ours, theirs = Both(scene).run(min(scene.time, 2.0))
    assert np.array_equal(ours[:, 0], ours[:, 1])
    np.testing.assert_allclose(ours[:, 0], theirs, atol=1e-5)


@SLOW
def test_cells():
    """Pressure follows the contact forces on cells too."""
    shape = pf.ReducedModel(pf.ContactPatch.disc(0.1), disc(1.0, 10.0).model.law)
    ours, theirs = Both(disc(1.0, 10.0), model=shape).run(0.3)
    np.testing.assert_allclose(ours[:, 0], theirs, atol=1e-5)


@SLOW
def test_implicitfast():
    ours, theirs = Both(shaken(), integrator="implicitfast").run(1.0)
    np.testing.assert_allclose(ours[:, 0], theirs, atol=1e-5)


@SLOW
def test_sparse():
    both = Both(grip("box"), jacobian=mujoco.mjtJacobian.mjJAC_SPARSE)
    assert both.ours.model.is_sparse
    ours, theirs = both.run(0.5)
    np.testing.assert_allclose(ours[:, 0], theirs, atol=1e-5)


@SLOW
@pytest.mark.parametrize("scene", [grip("box"), capsule()], ids=["grip", "capsule"])
def test_what_is_held_does_not_creep(scene):
    """Less than 0.01 um/s; MuJoCo's own friction creeps at 155 um/s on the capsule's rig (MuJoCo issue 3328)."""
    both = Both(scene)
    ours, _ = both.run(4.0)
    first = next(
        i
        for i, kind in enumerate(both.m.jnt_type)
        if kind == int(mujoco.mjtJoint.mjJNT_FREE)
    )
    height = ours[:, 0, both.m.jnt_qposadr[first] + 2]
    speed = np.polyfit(DT * np.arange(len(height) // 2), height[len(height) // 2 :], 1)[
        0
    ]
    assert abs(speed) < 1e-8


@SLOW
@pytest.mark.parametrize(
    ("reference", "low", "high"), [(3.0, 0.0, 5e-8), (None, 1e-7, 1e-6)]
)
def test_a_grip_whose_load_swings_keeps_still_with_a_fixed_stiffness(
    reference, low, high
):
    """Beside the centre of mass, under 3 N +- 20 % at 2 Hz, as in MuJoCo; speeds, as positions are too coarse."""
    scene = grip("box")
    press = np.array(scene.control(0.0))
    scene = dataclasses.replace(
        scene, control=lambda t: tuple(press * (1.0 + 0.2 * np.sin(4.0 * np.pi * t)))
    )
    pad = reference and pf.Pad.at_load(reference)
    both = Both(scene, model=dataclasses.replace(scene.model, pad=pad))
    speeds = []
    for i in range(round(1.0 / DT)):
        both.control(i * DT)
        both.ours.step()
        both.theirs.step(both.d)
        speeds.append((both.ours.data.qvel.numpy()[0, :3], both.d.qvel[:3].copy()))
    swings = np.ptp(DT * np.cumsum(speeds, axis=0)[len(speeds) // 2 :], axis=0).max(
        axis=1
    )
    assert (
        both.ours.report().converged.all()
        and (low < swings).all()
        and (swings < high).all()
    )


def test_a_disc_on_a_layer_slides_as_in_mujoco():
    """All stiffness is that of the pad, none that of the law; 0.17 m and 1.9 rad."""
    scene = disc(1.0, 10.0)
    layer = pf.Pad.layer(2e5, 2e-3)
    both = Both(scene, model=dataclasses.replace(scene.model, pad=layer))
    ours, theirs = both.run(0.25)
    assert np.ptp(theirs, axis=0).max() > 0.1
    np.testing.assert_allclose(ours[:, 0], theirs, atol=2e-6)
    wrench = both.theirs.wrenches(both.d).ravel()
    assert np.abs(both.ours.wrenches().numpy()[0] - wrench).max() < 1e-5 * 4.0
    with refused("parameters key must be one of"):
        Both(scene, model=both.theirs.patches[0].model, parameters={"sigma_0": 1e5})


@SLOW
def test_a_gripper_of_four_bar_linkages_holds():
    """Within 1 um and 0.001 degrees for 10 s, 12 mm beside the centre of mass, once its fingers have yielded."""
    both = Both(linkage())
    ours, theirs = both.run(both.scene.time)
    np.testing.assert_allclose(ours[:, 0], theirs, atol=1e-5)
    block = int(both.m.jnt_qposadr[both.m.body("block").jntadr[0]])
    moved = np.ptp(ours[round(0.2 / DT) :, 0, block : block + 7], axis=0)
    assert moved[:3].max() < 1e-6 and 2.0 * np.degrees(moved[4:].max()) < 1e-3


@SLOW
def test_blocks_on_a_shaken_tray_stay_nearer_than_without_friction():
    """MuJoCo Warp leaves MuJoCo by itself here: with the forces of MuJoCo's patches, and no friction of its own."""
    both = Both(tray())
    m, d = both.scene.native(Native("pyramidal", 1.0, condim=1), DT)
    for name in ("qpos", "qvel", "qacc_warmstart"):
        getattr(d, name)[:] = getattr(both.d, name)
    mujoco.mj_forward(m, d)
    model = mjw.put_model(m)
    data = mjw.put_data(m, d, nworld=1)
    ours = []
    without = []
    for i in range(round(both.scene.time / DT)):
        both.control(i * DT)
        before = both.d.qvel.copy()
        both.theirs.step(both.d)
        both.ours.step()
        friction = both.d.qfrc_passive + m.dof_damping * before
        for name, values in (("ctrl", both.d.ctrl), ("qfrc_applied", friction)):
            getattr(data, name).assign(values[None].astype(np.float32))
        mjw.step(model, data)
        ours.append(abs(both.ours.data.qpos.numpy()[0] - both.d.qpos).max())
        without.append(abs(data.qpos.numpy()[0] - both.d.qpos).max())
    assert max(ours) < 1e-3 < max(without)
    later = slice(round(0.1 / DT), None)
    assert (np.array(ours)[later] <= 2.0 * np.array(without)[later]).all()


@SLOW
def test_worlds():
    """64 worlds of one kind are one; with numbers of their own they are models with those."""
    mu = np.linspace(0.1, 0.5, 64)
    both = Both(disc(1.0, 10.0), worlds=64)
    ours, _ = both.run(0.2)
    assert (ours == ours[:, :1]).all()
    both = Both(disc(1.0, 10.0), worlds=64, parameters={"mu_c": mu, "mu_s": mu})
    ours, theirs = both.run(0.2)
    np.testing.assert_allclose(ours[:, 32], theirs, atol=0.05)
    assert (np.diff(ours[-1, :, 0]) < 0.0).all()  # rougher, shorter


@SLOW
def test_contacts_come_and_go_and_worlds_are_reset():
    """A disc is lifted off: its patch forgets. Reset, one world starts again and the other goes on."""
    both = Both(disc(1.0, 10.0))
    both.run(0.1)
    friction = both.ours
    data = both.ours.data
    state = friction.states().numpy()
    assert state.any(axis=1).all()
    mjw.reset_data(friction.model, data, wp.array([True, False]))
    assert not data.userdata.numpy()[0].any() and data.userdata.numpy()[1].any()
    start = data.qpos.numpy()[0].copy()
    before = data.qpos.numpy()[1].copy()
    friction.step()
    assert (
        abs(data.qpos.numpy()[0] - start).max() < 1e-4
        and data.qpos.numpy()[1, 0] > before[0]
    )
    lifted = data.qpos.numpy()
    lifted[1, 2] += 0.1
    data.qpos.assign(lifted)
    friction.step()
    assert (
        not friction.states().numpy()[1].any()
        and not friction.wrenches().numpy()[1].any()
    )
    assert friction.loads().numpy()[1] == 0.0 and friction.report().passes[1] == 0


@SLOW
def test_forward_changes_nothing():
    """`forward` plans the same step again; installed friction steps as `step` does."""
    both = Both(disc(1.0, 10.0))
    other = Both(disc(1.0, 10.0))
    for _ in range(5):
        both.ours.step()
        with other.ours.install():
            mjw.forward(other.ours.model, other.ours.data)
            mjw.step(other.ours.model, other.ours.data)
    assert np.array_equal(both.ours.data.qpos.numpy(), other.ours.data.qpos.numpy())
    assert np.array_equal(both.ours.states().numpy(), other.ours.states().numpy())
    assert other.ours.model.callback.control is None


# ---------------------------------------------------------------------- bad input

BAD = {
    "implicit": (
        {"integrator": mujoco.mjtIntegrator.mjINT_IMPLICIT},
        "integrator must be Euler, implicitfast",
    ),
    "elliptic": (
        {"cone": mujoco.mjtCone.mjCONE_ELLIPTIC},
        "cone must be pyramidal.* got elliptic",
    ),
    "noslip": (
        {"noslip_iterations": 3},
        "noslip_iterations must be 0: they would change the solution, got 3",
    ),
    "sleep": (
        {"enableflags": int(mujoco.mjtEnableBit.mjENBL_SLEEP)},
        "sleep must be disabled",
    ),
    "actuation": (
        {"disableflags": int(mujoco.mjtDisableBit.mjDSBL_ACTUATION)},
        "actuation must be enabled",
    ),
}


@pytest.mark.parametrize("name", BAD)
def test_options_that_do_not_fit_are_refused(name):
    changes, message = BAD[name]
    m, _, patches = made(disc(1.0, 10.0))
    for option, value in changes.items():
        setattr(m.opt, option, value)
    with refused(message):
        Friction(m, patches)


def test_displaced_patches_are_refused():
    m, _, patches = made(disc(1.0, 10.0))
    adapter.Friction(m, patches).parameters()["centre_x"][:] = 0.01
    with refused(
        r"centre_x must be 0: in Warp patches lie at their sites, got \[0.01\]"
    ):
        Friction(m, patches)
