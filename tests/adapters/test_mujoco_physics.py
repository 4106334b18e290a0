"""Patch friction inside MuJoCo against what theory, and the solver's own runs, say: held, shaken, stopped, turned."""

import dataclasses

import numpy as np
import pytest

import planarfriction as pf
from planarfriction import half_space

mujoco = pytest.importorskip("mujoco")

from planarfriction.scenes import in_hand, in_hand_load, simulate  # noqa: E402
from planarfriction_studies.bench import coulomb_disc, mujoco_scenes  # noqa: E402
from tests.support.linkage import linkage  # noqa: E402
from tests.support.mujoco_misfit import step_checked  # noqa: E402

pytestmark, SLOW = pytest.mark.mujoco, pytest.mark.slow


@pytest.mark.parametrize(
    "dt", [pytest.param(1e-3, marks=SLOW), 2e-3, pytest.param(5e-3, marks=SLOW), 1e-2]
)
@pytest.mark.parametrize("pad", mujoco_scenes.PADS)
def test_a_grip_beside_the_centre_of_mass_neither_creeps_nor_turns(pad, dt):
    scene = mujoco_scenes.grip(pad)
    m, d, friction = scene.ours(dt)
    path = scene.run(m, d, lambda: friction.step(d))
    held = path[:, :7]
    half = len(path) // 2
    moved = abs(held[-1] - held[half])
    # 1e-3 um/s and 1e-6 degrees a second, over the second half
    assert moved[:3].max() <= 1e-9 * 0.5 * scene.time
    assert 2.0 * np.degrees(moved[4:].max()) <= 1e-6 * 0.5 * scene.time
    assert abs(held[:, :3] - held[0, :3]).max() <= 1e-6
    # the weight, on two pads, and its torque about them; bristles yield so little that nothing else counts
    assert np.hypot(*friction.wrenches(d)[:, :2].T).sum() == pytest.approx(
        0.2 * 9.81, rel=1e-6
    )
    assert abs(friction.wrenches(d)[:, 2]).sum() == pytest.approx(
        0.2 * 9.81 * 4e-3, rel=1e-3
    )


@pytest.mark.parametrize(
    ("reference", "low", "high"), [(3.0, 0.0, 1e-9), (None, 1e-7, 1e-6)]
)
def test_a_grip_whose_load_swings_keeps_still_with_a_fixed_stiffness(
    reference, low, high
):
    """Beside the centre of mass, under 3 N +- 20 % at 2 Hz; the published law lets the part swing by 0.2 um."""
    scene = mujoco_scenes.grip("box")
    press = np.array(scene.control(0.0))
    scene = dataclasses.replace(
        scene,
        control=lambda t: tuple(press * (1.0 + 0.2 * np.sin(4.0 * np.pi * t))),
        time=1.0,
    )
    pad = reference and pf.Pad.at_load(reference)
    model = dataclasses.replace(scene.model, pad=pad)
    m, d, friction = scene.ours(2e-3, model=model)
    path = scene.run(m, d, lambda: step_checked(friction, d, 1e-8))
    assert low < np.ptp(path[len(path) // 2 :, :3], axis=0).max() < high
    assert np.hypot(*friction.wrenches(d)[:, :2].T).sum() == pytest.approx(
        0.2 * 9.81, rel=1e-5
    )


def test_soft_pads_give_way_by_their_stiffness():
    """Two half-spaces that stick carry a box 4 mm beside its centre: it sinks and turns by its weight, and stays."""
    scene = dataclasses.replace(mujoco_scenes.grip("box"), time=1.0)
    law = pf.LuGre(mu_c=50.0, sigma_1=0.0, elasto_plastic=0.9)
    pad = pf.Pad.half_space(1e6, 0.45)
    model = pf.ReducedModel(scene.model.patch, law, pad=pad)
    m, d, friction = scene.ours(2e-3, model=model)
    path = scene.run(m, d, lambda: step_checked(friction, d, 1e-8))
    stuck = half_space.stuck(
        model.patch.positions,
        model.patch.areas,
        model.patch.cell_extents(),
        1e6,
        0.45,
    )
    load = 0.5 * 0.2 * 9.81
    shift, _, turn = 1.0 / stuck.stiffness.diagonal()
    sunk = path[0, 2] - path[-1, 2]
    assert sunk == pytest.approx(load * (shift + 4e-3**2 * turn), rel=0.02)
    assert np.ptp(path[-50:, 2]) < 1e-9


def test_a_gripper_of_four_bar_linkages_holds():
    scene = linkage()
    m, d, friction = scene.ours()
    # Its fingers have yielded to the weight.
    held = scene.run(m, d, lambda: step_checked(friction, d, 1e-8))[100:, -7:]
    assert np.ptp(held[:, :3], axis=0).max() <= 1e-8
    assert 2.0 * np.degrees(np.ptp(held[:, 4:], axis=0).max()) <= 1e-6
    assert friction.report(d).converged


@pytest.mark.parametrize("integrator", ["Euler", "implicit", "implicitfast"])
def test_a_shaken_gripper_keeps_what_it_holds(integrator):
    scene = mujoco_scenes.shaken()
    m, d, friction = scene.ours(2e-3, integrator)
    places = []

    def step():
        step_checked(friction, d, 1e-8)
        places.append(mujoco_scenes.in_the_hand(d))

    steps = len(scene.run(m, d, step)) - 1
    assert np.ptp(places[-steps:], axis=0).max() <= 1e-6


@pytest.mark.parametrize("start", mujoco_scenes.STARTS)
def test_a_disc_slides_and_spins_to_rest_where_theory_says(start):
    """Less the stepper's own `v dt/2`; sliding and spinning end together."""
    dt = 2e-3
    (speed, spin) = start
    scene = mujoco_scenes.disc(speed, spin)
    m, d, friction = scene.ours(
        dt, model=pf.DistributedModel(scene.model.patch, scene.model.law)
    )
    velocities = []

    def step():
        friction.step(d)
        velocities.append(d.qvel[[0, 3]])

    path = scene.run(m, d, step)
    distance, angle = (
        path[-1, [0, 3]] - path[0, [0, 3]] + 0.5 * dt * np.array([speed, spin])
    )
    stop = coulomb_disc.stop(speed, spin)
    assert distance == pytest.approx(stop.distance, rel=5e-4)
    assert angle == pytest.approx(stop.angle, rel=2e-3)
    # a last motion of bristles, sqrt(mu g / sigma_0) = 5 mm/s, is left when they stop to slide
    moving = abs(np.array(velocities)) * [1.0, 0.1] > 6e-3
    last = [int(np.flatnonzero(each)[-1]) for each in moving.T]
    assert abs(last[0] - last[1]) <= 2


def test_the_exact_disc_has_the_wrench_of_its_cells():
    patch = pf.ContactPatch.disc(radius=0.1, cells=301)
    x, y = patch.positions.T
    for ratio in (1e-12, 0.4, 1.0, 3.0, 2e3):
        force, torque = coulomb_disc.wrench(ratio)
        u = np.stack([ratio * 0.1 - y, x])
        u /= np.hypot(*u)
        forces = patch.weights() * u
        assert force == pytest.approx(forces[0].sum(), abs=1e-3)  # cells of 0.7 mm
        assert torque == pytest.approx(
            (x * forces[1] - y * forces[0]).sum() / 0.1, abs=1e-3
        )


@pytest.mark.parametrize("load", [1, 2])
def test_the_published_plate_moves_in_the_hand_as_in_the_solver(load):
    scene = mujoco_scenes.plate(load)
    data = simulate(in_hand(scene.model, normal_force=in_hand_load(load))).data
    reference = np.array([float(data[name][-1]) for name in ("x", "y", "theta")])
    errors = {}
    for dt in (2e-3, 5e-4):
        m, d, friction = scene.ours(dt, solref=2.0 * dt)
        x, y, _, theta, _ = scene.run(
            m, d, lambda d=d, friction=friction: friction.step(d)
        )[-1]
        errors[dt] = abs(np.array([x + 2e-3, y, theta]) - reference)
        assert errors[dt][:2].max() <= 2.5e-3 and np.degrees(errors[dt][2]) <= 0.5
    if load == 1:  # load 2 drops at once, MuJoCo's contact within some steps
        assert errors[5e-4][:2].max() <= 0.4e-3


@pytest.mark.parametrize("sigma_1", [0.0, 300.0])
@pytest.mark.parametrize("sigma_0", [1e4, 1e6])
def test_grips_are_quiet_at_every_time_step_that_normal_contact_allows(
    sigma_0, sigma_1
):
    law = pf.LuGre(
        mu_c=1.0,
        mu_s=1.0,
        sigma_0=sigma_0,
        sigma_1=sigma_1,
        sigma_2=0.0,
        elasto_plastic=0.9,
    )
    model = pf.ReducedModel(pf.ContactPatch.disc(radius=0.01, cells=9), law)
    scene = dataclasses.replace(mujoco_scenes.grip(), time=0.8)
    for dt in (5e-4, 2e-3, 5e-3, 1e-2):
        m, d, friction = scene.ours(dt, model=model)
        path = scene.run(m, d, lambda friction=friction, d=d: friction.step(d))
        # falls onto its bristles, which hold the weight at 0.2 g / (2 x 3 N sigma_0), and turns on them
        assert abs(path[:, 2] - path[0, 2]).max() <= 2.5 * 0.2 * 9.81 / (6.0 * sigma_0)
        # what turns on soft bristles without damping of their own is damped by the implicit step alone, at 2/s or more
        tenth = len(path) // 10
        first, last = (
            np.ptp(part[:, :3], axis=0).max() for part in (path[:tenth], path[-tenth:])
        )
        assert last <= (1e-9 if sigma_1 > 0.0 else 0.3 * first), dt
