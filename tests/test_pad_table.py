"""Each part of the library takes pads, or refuses them in one line, as the table of docs/pads.md says."""

import re
from pathlib import Path

import numpy as np
import pytest

import planarfriction as pf
from planarfriction.errors import FrictionError

PAGE = Path(__file__).parents[1] / "docs" / "pads.md"
LAW = pf.LuGre(mu_c=0.5, sigma_1=0.0, elasto_plastic=0.9)
PATCH = pf.ContactPatch.disc(0.01, cells=5)
PADS = {
    "own": pf.Pad.layer(shear_modulus=1e6, thickness=2e-3),
    "common": pf.Pad.measured(stiffness=2e5, common=0.4),
}
"""Pads whose cells have a stiffness of their own, without and with a common compliance."""

TWIST = np.array([1e-3, 0.0, 0.1])

BALL = """<mujoco><option timestep="0.002"/><worldbody><geom name="floor" type="plane" size="9 9 .1"/>
    <body name="ball" pos="0 0 0.00998"><joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 0 1"/>
    <joint type="hinge" axis="0 0 1"/><geom name="ball" type="sphere" size="0.01" mass="0.2"/>
    <site name="ball" pos="0 0 -0.01"/></body></worldbody></mujoco>"""


def model_on(pad):
    return pf.DistributedModel(PATCH, LAW, pad=pad)


def scene_on(pad, **options):
    body = pf.Body(0.1, 1e-4, gravity=(0.0, 0.0))
    contact = pf.Contact(model_on(pad), 1.0)
    return pf.Scene(body, contact, 0.02, (0.2, 0.0, 0.0), **options)


def steps(pad):
    model = model_on(pad)
    _, wrench = model.step(model.rest(), TWIST, 1.0, 1e-3)
    return wrench


def rollouts(pad):
    twists = np.tile(TWIST, (5, 1))
    return pf.rollout(model_on(pad), None, twists, 1.0, 1e-3).wrenches


def bodies(pad):
    body = pf.SlidingBody(0.1, 1e-4, model_on(pad))
    return body.step(body.rest(), TWIST, 1.0, 1e-3).wrench


def scenes(pad):
    return pf.simulate(scene_on(pad)).data.fx.values


def equilibrium(pad):
    return pf.simulate(scene_on(pad, start="equilibrium")).data.fx.values


def scene_derivatives(pad):
    return pf.derivatives.scene_sensitivities(scene_on(pad), ["mu"]).d_motion


def sweeps(pad):
    make = lambda load: pf.Scene(
        pf.Body(0.1, 1e-4, gravity=(0.0, 0.0)), pf.Contact(model_on(pad), load), 0.02
    )
    return pf.sweep(make, {"load": [1.0, 2.0]}).fx.values


def exported_c(pad):
    files = pf.export_c(model_on(pad), "pad")
    return np.array([len(files)])


def casadi(pad):
    pytest.importorskip("casadi", reason="needs the extra [casadi]")
    return np.array([len(pf.export_c(model_on(pad), "pad", casadi=True))])


def pytorch(pad):
    torch = pytest.importorskip("torch", reason="needs the extra [torch]")
    from planarfriction.torch import DistributedModel

    model = DistributedModel(PATCH, LAW, pad=pad)
    twist, load = torch.tensor(TWIST), torch.tensor(1.0, dtype=torch.float64)
    state = torch.zeros(model.state_shape, dtype=torch.float64)
    return model.step(state, twist, load, 1e-3)[1].detach().numpy()


def jax(pad):
    pytest.importorskip("jax", reason="needs the extra [jax]")
    from planarfriction.jax import DistributedModel

    model = DistributedModel(PATCH, LAW, pad=pad)
    return np.asarray(model.step(np.zeros(model.state_shape), TWIST, 1.0, 1e-3)[1])


def warp(pad):
    pytest.importorskip("warp", reason="needs the extra [warp]")
    from planarfriction.warp import Model

    model = Model(model_on(pad), contacts=1, device="cpu")
    return model.rest().numpy()


def patches_of(pad, kind):
    import mujoco

    patches = [kind.PatchContact(model_on(pad), "ball", ("floor", "ball"))]
    spec = mujoco.MjSpec.from_string(BALL)
    kind.prepare(spec, patches)
    return spec.compile(), patches


def in_mujoco(pad):
    mujoco = pytest.importorskip("mujoco", reason="needs the extra [mujoco]")
    from planarfriction.adapters import mujoco as kind

    m, patches = patches_of(pad, kind)
    friction, data = kind.Friction(m, patches), mujoco.MjData(m)
    data.qvel[:] = 0.05, 0.0, 1.0
    friction.step(data)
    return friction.wrenches(data)


def in_mjx(pad):
    pytest.importorskip("mujoco.mjx", reason="needs the extra [mjx]")
    from planarfriction.adapters import mjx as kind

    m, patches = patches_of(pad, kind)
    return np.array([kind.Friction(m, patches) is not None])


def in_mujoco_warp(pad):
    pytest.importorskip("mujoco_warp", reason="needs the extra [mujoco-warp]")
    from planarfriction.adapters import mujoco_warp as kind

    m, patches = patches_of(pad, kind)
    friction = kind.Friction(m, patches, worlds=1, njmax=50, nconmax=20)
    return np.array([friction is not None])


def in_drake(pad):
    pytest.importorskip("pydrake", reason="needs the extra [drake]")
    from tests.support.drake_scenes import sliding

    run = sliding("box", "point", 2e-3, model_on(pad), tilt=0.1)
    run.to(0.01)
    return run.friction.get_wrenches_output_port().Eval(run.own)


def observer(pad):
    from planarfriction.online import FrictionObserver

    return np.array([FrictionObserver(model_on(pad)) is not None])


PROBES = {
    "steps": steps,
    "rollouts": rollouts,
    "bodies": bodies,
    "scenes": scenes,
    "scenes that start in equilibrium": equilibrium,
    "derivatives of scenes": scene_derivatives,
    "sweeps": sweeps,
    "exported C": exported_c,
    "CasADi": casadi,
    "PyTorch": pytorch,
    "JAX": jax,
    "Warp": warp,
    "MuJoCo": in_mujoco,
    "MJX": in_mjx,
    "MuJoCo Warp": in_mujoco_warp,
    "Drake": in_drake,
    "friction observer": observer,
}
"""Row of the table -> what is tried."""


def rows():
    table = PAGE.read_text(encoding="utf-8").partition("## Supported pads")[2]
    table = table.partition("\n## ")[0]
    found = re.findall(r"^\| ([^|]+) \| (yes|no) \| (yes|no) \|", table, re.MULTILINE)
    return {
        name: {"own": own == "yes", "common": common == "yes"}
        for name, own, common in found
    }


@pytest.mark.parametrize("kind", PADS)
@pytest.mark.parametrize("name", PROBES)
def test_the_table_says_which_pads_are_taken(name, kind, tmp_path, monkeypatch):
    if not PAGE.is_file():
        pytest.skip("no docs beside these tests")
    monkeypatch.chdir(tmp_path)
    try:
        taken = bool(np.isfinite(PROBES[name](PADS[kind])).all())
    except FrictionError as error:
        assert "\n" not in str(error)
        taken = False
    assert taken == rows()[name][kind], name


def test_the_table_has_all_rows():
    if not PAGE.is_file():
        pytest.skip("no docs beside these tests")
    assert list(rows()) == list(PROBES)
