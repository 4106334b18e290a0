"""Patch friction inside MJX: what MuJoCo's adapter does, for many environments at once, with derivatives."""

from __future__ import annotations

import copy
import dataclasses
from typing import NamedTuple

import numpy as np
import pytest

import planarfriction as pf
from tests.support.refusals import refused

jax = pytest.importorskip("jax", reason="needs the extra [mjx]")
mjx = pytest.importorskip("mujoco.mjx", reason="needs the extra [mjx]")
import jax.numpy as jnp  # noqa: E402
import mujoco  # noqa: E402

from planarfriction.adapters import mujoco as adapter  # noqa: E402
from planarfriction.adapters.mjx import Friction, PatchContact, newton, prepare  # noqa: E402
from planarfriction.adapters.mjx.friction import _in_jax  # noqa: E402
from planarfriction.coupling import CoupledPatches  # noqa: E402
from planarfriction.models.base import lever_of  # noqa: E402
from planarfriction_studies.bench import coulomb_disc  # noqa: E402
from planarfriction_studies.bench.mujoco_scenes import STARTS, Native, disc, grip  # noqa: E402
from tests.support.coupling_problems import random_bodies, random_patches, random_run  # noqa: E402

pytestmark = pytest.mark.mjx

DT = 2e-3


@pytest.fixture(autouse=True, scope="module")
def double_precision():
    before = jax.config.jax_enable_x64
    jax.config.update("jax_enable_x64", True)
    yield
    jax.config.update("jax_enable_x64", before)


def made(scene, model=None, dt=DT, **options):
    """Model, data and patches of a scene, as MJX wants them."""
    text = scene.text(
        Native(cone="pyramidal", impratio=1.0, condim=1, solref=0.02), dt, "Euler"
    )
    spec = mujoco.MjSpec.from_string(text)
    for name, value in options.items():
        setattr(spec.option, name, value)
    patches = [
        PatchContact(model or scene.model, site=site, geoms=geoms)
        for site, geoms in scene.patches
    ]
    prepare(spec, patches)
    m = spec.compile()
    return m, mujoco.MjData(m), patches


def rolled(friction, m, data, steps):
    """Rollouts of all `data` side by side: the last data, and positions `[steps + 1, E, nq]`."""
    batch = jax.tree.map(
        lambda *each: jnp.stack(each), *(mjx.put_data(m, d) for d in data)
    )
    step = jax.jit(jax.vmap(friction.step, (None, 0)))
    mx = mjx.put_model(m)
    path = [np.asarray(batch.qpos)]
    for _ in range(steps):
        batch = step(mx, batch)
        path.append(np.asarray(batch.qpos))
    return batch, np.array(path)


# ---------------------------------------------------------------------- the disc

STEPS = 380


class Discs(NamedTuple):
    m: object
    patches: list
    data: list
    friction: Friction
    end: object
    path: np.ndarray


@pytest.fixture(scope="module")
def discs():
    """From the three starts to rest, which the last of them reaches after 340 steps."""
    m, settled, patches = made(disc(*STARTS[0]))
    for _ in range(300):
        mujoco.mj_step(m, settled)
    data = [started(settled, *start) for start in STARTS]
    friction = Friction(m, patches)
    return Discs(m, patches, data, friction, *rolled(friction, m, data, STEPS))


def started(data, speed, spin):
    """Return a copy of data with a speed and a spin."""
    copied = copy.copy(data)
    copied.qvel[:] = speed, 0.0, 0.0, spin
    return copied


@pytest.mark.parametrize("e", range(3))
def test_a_disc_slides_and_spins_to_rest_where_theory_says(discs, e):
    speed, spin = STARTS[e]
    stop = coulomb_disc.stop(speed, spin)
    qpos = discs.path[-1, e]
    assert abs(np.asarray(discs.end.qvel[e])).max() < 1e-6
    # less the stepper's own v dt/2
    # Of a few discs.
    assert qpos[0] + 0.5 * DT * speed == pytest.approx(stop.distance, rel=1e-3)
    assert qpos[3] + 0.5 * DT * spin == pytest.approx(stop.angle, rel=2e-3)


def test_environments_do_what_mujoco_does(discs):
    d = copy.copy(discs.data[0])
    friction = adapter.Friction(discs.m, discs.patches)
    for i in range(1, STEPS + 1):
        friction.step(d)
        # both solve to 1e-9 m/s a step, and what is left of that adds up over all steps of 2 ms
        np.testing.assert_allclose(
            discs.path[i, 0], d.qpos, atol=STEPS * DT * 1e-9 + 1e-9
        )
    ours = discs.friction
    theirs = friction
    end = jax.tree.map(lambda each: each[0], discs.end)
    np.testing.assert_allclose(ours.loads(end), theirs.loads(d), rtol=1e-9)
    np.testing.assert_allclose(ours.wrenches(end), theirs.wrenches(d), atol=1e-6)
    assert bool(ours.report(end).converged) and float(ours.report(end).passes) == 1.0


def test_the_lever_arm_of_a_patch_counts_the_radii_of_its_discs():
    model = pf.DistributedModel(
        pf.ContactPatch.disc(0.05, 9).discs(), pf.LuGre(mu_s=1.2)
    )
    m, _, patches = made(disc(*STARTS[0]), model)
    assert model.patch.radii.all()
    np.testing.assert_array_equal(
        Friction(m, patches)._fixed.places.radius, [lever_of(model)]
    )


BALL = """<mujoco><option timestep="0.002"/><worldbody><geom name="floor" type="plane" size="9 9 .1"/>
    <body name="ball" pos="0 0 0.00998"><joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 0 1"/>
    <joint type="hinge" axis="0 0 1"/><geom name="ball" type="sphere" size="0.01" mass="0.2"/>
    <site name="ball" pos="0 0 -0.01"/></body></worldbody></mujoco>"""
"""Slides and spins on a patch; small, as it takes long to compile."""


def ball(law, pad=None):
    """Return model and patches of the ball."""
    patch = pf.ContactPatch.disc(radius=0.01, cells=5)
    face = pf.DistributedModel(patch, law, pad=pad)
    patches = [PatchContact(face, "ball", ("floor", "ball"))]
    spec = mujoco.MjSpec.from_string(BALL)
    prepare(spec, patches)
    return spec.compile(), patches


def test_a_stiffness_that_ignores_the_load_does_what_it_does_in_mujoco():
    law = pf.LuGre(mu_c=0.4, mu_s=0.5, sigma_0=1e5, elasto_plastic=0.9)
    m, patches = ball(law, pf.Pad.at_load(1.5))
    d = mujoco.MjData(m)
    d.qvel[:] = 0.05, 0.0, 1.0
    friction = Friction(m, patches)
    theirs = adapter.Friction(m, patches)
    end, path = rolled(friction, m, [d], 100)
    for i in range(1, 101):
        theirs.step(d)
        np.testing.assert_allclose(path[i, 0], d.qpos, atol=100 * DT * 1e-9 + 1e-9)
    np.testing.assert_allclose(friction.wrenches(end)[0], theirs.wrenches(d), atol=1e-6)
    assert abs(friction.states(end)[0]).max() > 1e-7


def test_data_go_from_one_into_the_other(discs):
    """The bristles are where both look for them."""
    friction = adapter.Friction(discs.m, discs.patches)
    ours = discs.friction
    d = copy.copy(discs.data[0])
    for _ in range(100):
        friction.step(d)
    there = mjx.put_data(discs.m, d)
    np.testing.assert_array_equal(np.ravel(ours.states(there)[0]), friction.state(d))
    assert abs(friction.state(d)).max() > 1e-7
    end = jax.tree.map(lambda each: each[0], discs.end)
    back = mjx.get_data(discs.m, end)
    np.testing.assert_array_equal(friction.state(back), np.ravel(ours.states(end)[0]))
    np.testing.assert_array_equal(friction.wrenches(back), ours.wrenches(end))
    assert (np.asarray(ours.states(ours.reset(end))[0]) == 0.0).all()
    later = end.replace(time=end.time + 1.0)
    assert (np.asarray(ours.states(later)[0]) == 0.0).all(), (
        "at other times than those of the step bristles rest"
    )


@pytest.mark.slow
def test_gradients_are_differences_by_velocity_and_friction():
    """Backwards through MJX's solver, whose loop has no derivative, and through the step of the patches."""
    law = pf.LuGre(mu_s=0.5, mu_c=0.3, v_s=0.1, sigma_0=1e5, elasto_plastic=0.9)
    m, patches = ball(law)
    d = mjx.put_data(m, mujoco.MjData(m))
    mx = mjx.put_model(m)
    friction = Friction(m, patches)

    @jax.jit
    @jax.value_and_grad
    def end(numbers):
        speed, fall, spin, mu_c, v_s = numbers
        model = friction.models[0]
        own = friction.replace(
            [model.replace(parameters=model.parameters._replace(mu_c=mu_c, v_s=v_s))]
        )
        start = d.replace(qvel=jnp.stack([speed, fall, spin]))
        last, _ = jax.lax.scan(
            lambda d, _: (own.step(mx, d), None), start, None, length=4
        )
        return last.qvel @ jnp.array([1.0, 10.0, 0.01]) + own.loads(last)[0]

    at = np.array([0.1, -0.01, 10.0, 0.3, 0.1])
    slopes = end(at)[1]
    steps = 1e-5 * np.diag(abs(at))
    differences = [
        (end(at + step)[0] - end(at - step)[0]) / (2.0 * step.sum()) for step in steps
    ]
    assert abs(slopes).min() > 1e-5
    # rounding of the differences, and 1e-9 m/s of the step in contact space over 1e-5 of the numbers
    np.testing.assert_allclose(slopes, differences, rtol=1e-4, atol=1e-4)


# ---------------------------------------------------------------------- grips


@pytest.mark.slow
def test_a_grip_beside_the_centre_of_mass_holds_as_in_mujoco():
    scene = grip("sphere")
    model = pf.DistributedModel(
        pf.ContactPatch.disc(radius=0.01, cells=5), scene.model.law
    )
    m, d, patches = made(
        scene, model, integrator=mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    )
    m.dof_damping[:] = 0.5, 0.5, 0.5, 1e-4, 1e-4, 1e-4, 5.0, 5.0
    d.ctrl[:] = 3.0
    friction = Friction(m, patches)
    theirs = adapter.Friction(m, patches)
    end, path = rolled(friction, m, [d], 500)
    for _ in range(500):
        theirs.step(d)
    assert bool(friction.report(end).converged[0])
    drift = abs(path[-1, 0] - path[-101, 0])
    # 1e-3 um/s and 1e-6 degrees a second, over 0.2 s
    assert drift[:3].max() < 0.2e-9 and 2.0 * np.degrees(drift[4:7].max()) < 0.2e-6
    # the pads of MuJoCo touch where those of MJX do to 1e-9 m, bristles give 4e-7 m
    np.testing.assert_allclose(path[-1, 0], d.qpos, atol=1e-8)
    np.testing.assert_allclose(friction.loads(end)[0], theirs.loads(d), rtol=1e-5)
    np.testing.assert_allclose(
        friction.wrenches(end)[0, :, :2], theirs.wrenches(d)[:, :2], atol=1e-3
    )


# ---------------------------------------------------------------------- the step in contact space


def in_operations(patches):
    """`CoupledPatches.step` in operations of JAX, for a batch of problems."""
    models = [_in_jax(model) for model in patches.models]
    by_load = any(model.stiffness is not None for model in models)
    radius = jnp.array(
        [np.sqrt((model.patch.positions**2).sum(1).mean()) for model in patches.models]
    )

    @jax.jit
    @jax.vmap
    def solve(states, twist, load, response, load_response, guess, dt):
        host = newton.HostResponse(
            twist - response @ guess,
            load - load_response @ guess,
            response,
            load_response,
        )

        def unit(twists, loads):
            loads = jnp.maximum(loads, 1e-12) if by_load else jnp.ones_like(loads)
            each = zip(models, states, twists, loads, strict=True)
            return jnp.stack(
                [model.step(z, v, load, dt)[1] / load for model, z, v, load in each]
            )

        found = newton.solve(
            newton.UnitLoadFriction(unit, by_load), host, guess, radius, 1e-9, 50
        )
        return found, host.twists(found.wrench), host.loads(found.wrench)

    def step(state, host, dt):
        flat = (np.reshape(each, (len(dt), -1)) for each in (host.twist, host.wrench))
        twist, guess = flat
        return solve(
            patches.states(state),
            twist,
            host.normal_force,
            host.twist_response,
            host.load_response,
            guess,
            dt,
        )

    return step


def compare_with_compiled(seed, kinds, steps, bodies, pad=None):
    generator = np.random.default_rng(seed)
    patches = random_patches(generator, 2, kinds)
    if pad is not None:
        patches = CoupledPatches(
            [dataclasses.replace(model, pad=pad) for model in patches.models]
        )
    radius = np.array(
        [np.sqrt((model.patch.positions**2).sum(1).mean()) for model in patches.models]
    )
    lever = np.stack([np.ones(2), np.ones(2), radius], 1)
    step = in_operations(patches)
    both = 0
    rounds = 0
    for state, host, dt, theirs in random_run(
        generator, patches, random_bodies(generator, bodies, 2, 0.3), steps
    ):
        ours, twist, load = step(state, host, dt)
        good = np.asarray(ours.converged) & theirs.converged
        both += good.sum()
        # each is within 1e-9 m/s of what its wrenches cause, and friction that holds divides that by little
        assert (abs(twist - theirs.twist) * lever)[good].max() < 1e-7
        causes = np.diagonal(host.twist_response, axis1=-2, axis2=-1)[:, ::3]
        assert (abs(load - theirs.normal_force) * causes)[good].max() < 1e-7
        rounds += abs(np.asarray(ours.iterations) - theirs.iterations)[good].sum()
    assert both >= 0.999 * steps * bodies
    # Of all steps: where friction falls with speed, a step has several ends, and a last bit chooses between them.
    # Pads begin elsewhere in compiled code.
    assert rounds / both < (0.2 if pad is None else 1.0)


PADS = [pytest.param(None, marks=pytest.mark.slow), pf.Pad.at_load(1.5)]
"""Without a pad the discs above take the same steps."""


@pytest.mark.parametrize("pad", PADS)
def test_the_step_in_contact_space_is_the_compiled_one(pad):
    compare_with_compiled(1, (pf.DistributedModel,), 40, 64, pad)


@pytest.mark.slow
@pytest.mark.parametrize("kind", [pf.ReducedModel, pf.ReducedModelPublished])
def test_the_step_in_contact_space_is_the_compiled_one_for_all_models(kind):
    compare_with_compiled(3, (kind,), 100, 64)


@pytest.mark.parametrize("pad", PADS)
def test_derivatives_of_the_step_in_contact_space_are_differences(pad):
    """A patch slides and spins under a changing load: derivatives to the host's numbers and to friction."""
    patch = pf.ContactPatch.disc(radius=0.01, cells=5)
    model = _in_jax(pf.DistributedModel(patch, pf.LuGre(mu_s=1.2), pad=pad))
    response = 0.01 * np.array([[1.0, 0.1, 0.0], [0.1, 1.0, 0.0], [0.0, 0.0, 1e4]])
    load_response = np.array([[0.2, -0.1, 3.0]])

    def problem(numbers):
        twist = numbers[:3]
        load = numbers[3:4]
        mu_c = numbers[4]
        share = numbers[5]
        own = model.replace(parameters=model.parameters._replace(mu_c=mu_c))

        def unit(twists, loads):
            return (
                own.step(jnp.full((1, *own.rest().shape), 1e-7), twists, loads, 1e-3)[1]
                / loads[:, None]
            )

        return newton.UnitLoadFriction(unit, True), newton.HostResponse(
            twist, load, share * response, share * load_response
        )

    @jax.jit
    @jax.value_and_grad
    def power(numbers):
        found = newton.solve(
            *problem(jax.lax.stop_gradient(numbers)),
            jnp.zeros(3),
            jnp.array([0.01]),
            1e-13,
            50,
        )
        unit, host = problem(numbers)
        wrench = newton.fitting(unit, host, found.wrench)
        return wrench @ jnp.array([1.0, -2.0, 100.0]) + host.loads(wrench)[0]

    at = np.array([0.05, 0.02, 5.0, 2.0, 1.0, 1.0])
    slopes = power(at)[1]
    steps = 1e-6 * np.diag(at)
    differences = [
        (power(at + step)[0] - power(at - step)[0]) / (2.0 * step.sum())
        for step in steps
    ]
    # rounding, 1e-13 over 1e-6 of the numbers, where friction falls by 10 N s/m
    np.testing.assert_allclose(slopes, differences, rtol=1e-5, atol=1e-5)


# ---------------------------------------------------------------------- bad input

BAD = {
    "RK4": (
        {"integrator": mujoco.mjtIntegrator.mjINT_RK4},
        "integrator must be Euler, implicitfast, got RK4",
    ),
    "implicit": (
        {"integrator": mujoco.mjtIntegrator.mjINT_IMPLICIT},
        "integrator must be Euler, implicitfast, got IMPLICIT",
    ),
    "elliptic": (
        {"cone": mujoco.mjtCone.mjCONE_ELLIPTIC},
        "cone must be pyramidal: .* got elliptic",
    ),
    "noslip": (
        {"noslip_iterations": 3},
        "noslip_iterations must be 0: they would change the solution, got 3",
    ),
}


@pytest.mark.parametrize("name", BAD)
def test_options_that_do_not_fit_are_refused(name):
    options, message = BAD[name]
    m, _, patches = made(disc(1.0, 10.0), **options)
    with refused(message):
        Friction(m, patches)


def test_what_does_not_fit_is_refused_in_one_line():
    scene = disc(1.0, 10.0)
    m, d, patches = made(scene)
    site, geoms = scene.patches[0]
    finger = pf.SoftFinger(c=6e-3, n=1.0 / 3.0, k_per_newton=2.0, radius_max=0.01)
    soft = pf.DistributedModel(
        pf.ContactPatch.rectangle(0.02, cells=9, pressure=finger), scene.model.law
    )
    for wrong, message in (
        ([patches[0], patches[0]], "patches must have each pair of geoms once"),
        (
            [PatchContact(scene.model, site="nowhere", geoms=geoms)],
            "site must be in the model, got nowhere",
        ),
        (
            [PatchContact(scene.model, site=site, geoms=("floor", "none"))],
            "geoms must be in the model, got none",
        ),
        (
            [PatchContact(soft, site=site, geoms=geoms)],
            "model must have a shape that does not change with the load",
        ),
    ):
        with refused(message):
            Friction(m, wrong)
    m.pair_dim[0] = 3
    with refused("pair must have condim 1 between floor and disc"):
        Friction(m, patches)
    m.pair_dim[0] = 1
    friction = Friction(m, patches)
    mx = mjx.put_model(m)
    there = mjx.put_data(m, d)
    two = jax.tree.map(lambda each: jnp.stack([each, each]), there)
    with refused(r"models must be models of .*: [A-Za-z]+, got"):
        friction.replace([scene.model])
    with refused(r"userdata must have shape \[\d+\]: of one environment"):
        friction.step(mx, two)
    with refused(r"precision must be float64, that of JAX .*, got data of float32"):
        friction.step(mx, there.replace(qpos=there.qpos.astype("float32")))
