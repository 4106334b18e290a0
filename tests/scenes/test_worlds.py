"""Pivoting, the turning foot and the curling stone against closed forms, published numbers and Coulomb's equations."""

import math
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp
from scipy.optimize import brentq, minimize
from scipy.special import ellipe, ellipk

import planarfriction as pf
from planarfriction.cli.run import build_scenes
from planarfriction.errors import FrictionError
from planarfriction.scenes import curling, foot, free_slide, pivot
from tests.support.refusals import refused

EXAMPLES = Path(__file__).parents[2] / "examples"
G = 9.81
COULOMB = pf.LuGre(mu_c=1.0, sigma_0=1e5, sigma_1=100.0, sigma_2=0.0)
"""Stiff bristles with one coefficient at all speeds: Coulomb friction but for the first 10 um."""

# ---------------------------------------------------------------------- pivot

MASS, ARM = 0.06, 0.06
FINGERTIP = pf.ContactPatch.disc(
    0.012, 31, pressure=pf.SoftFinger(c=0.006, n=1 / 3, k=2.0, radius_max=0.012)
)


def held_torque(load):
    """Torque [N m] that two Hertz contacts of 6 mm at 1 N hold in a spin, mu = 1: r is 3 pi/16 of their radius."""
    return 2.0 * load * 3.0 * math.pi / 16.0 * 0.006 * load ** (1.0 / 3.0)


def test_the_part_turns_as_a_pendulum_with_the_friction_of_the_pads():
    scene = pivot(pf.DistributedModel(FINGERTIP, COULOMB))
    grip = scene.contacts[0].normal_force
    start = next(t for t in grip.times if held_torque(float(grip(t))) < MASS * G * ARM)

    def rate(t, state):  # it turns one way, so that friction holds back all the time
        angle, spin = state
        load = float(grip(t))
        cos = math.cos(angle)
        sin = math.sin(angle)
        left = 1.0
        # What the pads hold of the weight and of its swing they lack in torque: an ellipse, nearly.
        for _ in range(3):
            rise = (left * held_torque(load) - MASS * G * ARM * cos) / about_pin
            along = spin**2 * ARM + G * -sin
            across = rise * ARM + G * cos
            left = math.sqrt(
                1.0 - min(MASS * math.hypot(along, across) / (2.0 * load), 0.99) ** 2
            )
        return spin, rise

    def stopped(t, state):
        return state[1]

    stopped.terminal = True
    stopped.direction = 1
    about_pin = scene.body.inertia + MASS * ARM**2
    expected = solve_ivp(
        rate, (start, 1.0), (0.0, 0.0), events=stopped, max_step=1e-3
    ).y[0, -1]
    solution = pf.simulate(scene)
    angle = float(solution.data.theta[-1])
    stays = solution.data.theta.sel(time=0.2, method="nearest")
    # Bristles of 10 um at a radius of 6 mm, and the tolerance.
    assert abs(stays) < 1e-5 and angle < -1.0
    # They slide by 1 mm, which a pin does not.
    assert angle == pytest.approx(expected, rel=0.02)
    slide = np.hypot(
        solution.data.x[-1] - ARM * math.cos(angle),
        solution.data.y[-1] - ARM * math.sin(angle),
    )
    assert 1e-4 < slide < 3e-3


@pytest.mark.parametrize(("share", "holds"), [(0.97, False), (1.03, True)])
def test_a_grip_holds_from_the_load_that_the_torque_needs(share, holds):
    """The weight asks for a hundredth of the force too, and takes 0.5 % of the torque."""
    needed = brentq(lambda load: held_torque(load) - MASS * G * ARM, 0.1, 10.0)
    scene = pivot(
        pf.DistributedModel(FINGERTIP, COULOMB),
        normal_force=share * needed,
        start="rest",
        t_end=0.5,
    )
    assert (abs(float(pf.simulate(scene).data.theta[-1])) < 0.05) == holds


# ---------------------------------------------------------------------- foot

PAD = pf.ContactPatch.disc(0.03, 15)


def yaw_bound(share, length=0.16):
    """Largest torque without a force [N m] of both pads, mu = 1: least dissipation of a unit spin about any point."""
    middle = np.array([0.5 * length, 0.0])
    cells = np.concatenate([PAD.positions - middle, PAD.positions + middle])
    loads = (
        40.0
        * G
        * np.concatenate([(1.0 - share) * PAD.weights(), share * PAD.weights()])
    )
    return minimize(
        lambda c: loads @ np.hypot(*(cells - c).T), (-0.03, 0.0), method="Nelder-Mead"
    ).fun


@pytest.mark.parametrize(("part", "turns"), [(0.98, False), (1.02, True)])
def test_a_foot_turns_where_the_torque_passes_the_least_dissipation(part, turns):
    scene = foot(
        pf.DistributedModel(PAD, COULOMB),
        share=0.3,
        torque=part * yaw_bound(0.3),
        t_end=0.5,
    )
    assert (abs(float(pf.simulate(scene).data.theta[-1])) > 0.01) == turns


def test_a_foot_walks_sideways_on_heel_and_forefoot():
    model = pf.ReducedModel(PAD, COULOMB)
    data = pf.simulate(foot(model)).data
    x, y, theta = (np.asarray(data[name]) for name in ("x", "y", "theta"))
    heel = np.stack([x - 0.08 * np.cos(theta), y - 0.08 * np.sin(theta)])
    forefoot = np.stack([x + 0.08 * np.cos(theta), y + 0.08 * np.sin(theta)])
    middle = len(x) // 2
    assert theta[middle] > 0.2 and abs(theta[-1]) < 0.02 and y[-1] > 0.04
    assert np.hypot(*(heel[:, middle] - heel[:, 0])) < 0.2 * np.hypot(
        *(forefoot[:, middle] - forefoot[:, 0])
    )
    assert np.hypot(*(forefoot[:, -1] - forefoot[:, middle])) < 0.2 * np.hypot(
        *(heel[:, -1] - heel[:, middle])
    )
    turned = foot(model).force
    mirrored = pf.simulate(
        foot(model, torque=pf.Signal.sampled(turned.times, -turned.values[:, 2]))
    ).data
    # Of the solver's tolerance.
    assert mirrored.y[-1] == pytest.approx(-y[-1], rel=1e-3)
    assert mirrored.x[-1] == pytest.approx(x[-1], rel=1e-3)


def test_a_foot_has_two_patches_and_shares_its_weight():
    heel = pf.DistributedModel(PAD, COULOMB)
    ball = pf.DistributedModel(FINGERTIP, COULOMB)
    scene = foot(heel, forefoot=ball, mass=2.0, length=0.1, share=0.25, torque=1.5)
    assert [contact.model for contact in scene.contacts] == [heel, ball]
    assert [contact.position for contact in scene.contacts] == [
        (-0.05, 0.0),
        (0.05, 0.0),
    ]
    assert [
        float(contact.normal_force(0.0)) for contact in scene.contacts
    ] == pytest.approx([1.5 * G, 0.5 * G])
    assert scene.force(0.0).tolist() == [0.0, 0.0, 1.5]
    with refused(r"share must be in \[0, 1\], got 0 to 1.5", FrictionError):
        foot(heel, share=pf.Signal.sampled([0.0, 1.0], [0.0, 1.5]))


# ---------------------------------------------------------------------- curling stones and discs


def ring_friction(v, u):
    """Force and torque/R of a ring, mu f_N = 1, that slides with v and turns with the rim speed u: d Phi/dv, d Phi/du.

    `Phi = (2/pi)(v + u) E(m)`, `m = 4 v u/(v + u)^2`.
    """
    if v == u:
        return 2.0 / math.pi, 2.0 / math.pi
    m = 4.0 * v * u / (v + u) ** 2
    big = (v + u) * ellipe(m)
    small = (v - u) * ellipk(m)
    return (big + small) / (math.pi * v), (big - small) / (math.pi * u)


def annulus_friction(v, u, inner=0.0):
    """The same of a uniform annulus from `inner` R to R: rings weighed with their radius."""
    area = 0.5 * (1.0 - inner**2)
    at = [v / u] if inner < v / u < 1.0 else None

    def over(share):
        return quad(share, inner, 1.0, points=at)[0] / area

    return over(lambda s: s * ring_friction(v, s * u)[0]), over(
        lambda s: s**2 * ring_friction(v, s * u)[1]
    )


def terminal_ratio(gyration, inner=0.0):
    """v/(omega R) [-] that stays as it is while both stop: `F/v = T/(gyration^2 u)`."""

    def drift(ratio):
        force, torque = annulus_friction(ratio, 1.0, inner)
        return force / ratio - torque / gyration**2

    return brentq(drift, 0.02, 50.0)


def ratios(patch, gyration, start, kind=pf.DistributedModel):
    """Speed [m/s] and v/(omega R) [-] of a slide that starts with v = 1 m/s; R is 0.04 m."""
    law = pf.LuGre(mu_c=0.2, sigma_0=1e5, sigma_1=10.0, sigma_2=0.0)
    inertia = (0.04 * gyration) ** 2
    spin = 1.0 / (0.04 * start)
    scene = free_slide(
        kind(patch, law),
        mass=1.0,
        inertia=inertia,
        twist=(1.0, 0.0, spin),
        save_every=1e-3,
    )
    data = pf.simulate(scene).data.isel(time=slice(0, -1))  # the last has stopped
    return np.asarray(data.vx), np.asarray(data.vx / (0.04 * data.omega))


DISC, RING = pf.ContactPatch.disc(0.04, 31), pf.ContactPatch.ring(0.0392, 0.04, 61)


def test_the_closed_form_has_the_published_ratios():
    """0.653 for a disc, 1 for a thin ring (Farkas et al. 2003; Weidman and Malhotra 2005)."""
    assert terminal_ratio(math.sqrt(0.5)) == pytest.approx(0.653, abs=5e-4)
    assert terminal_ratio(1.0, 0.999) == pytest.approx(1.0, abs=2e-3)


@pytest.mark.parametrize("patch", [DISC, RING], ids=["disc", "ring"])
def test_discs_and_rings_stop_sliding_and_turning_together(patch):
    """From a tenth more, the same or a tenth less, they come closer to the ratio of the closed form."""
    inner, gyration = (
        (0.0, math.sqrt(0.5))
        if patch is DISC
        else (0.98, math.sqrt(0.5 * (1.0 + 0.98**2)))
    )
    final = terminal_ratio(gyration, inner)
    for start in (0.9, 1.0, 1.1):
        speed, ratio = ratios(patch, gyration, start * final, pf.DistributedModel)
        # LuGre is Coulomb down to there: bristles of 2 um.
        late = ratio[speed > 0.02][-1]
        # 31 cells across stand for a disc.
        assert abs(late / final - 1.0) < 0.006 + 0.12 * abs(start - 1.0)


@pytest.mark.parametrize("gyration", [0.4, 0.6, 0.9])
def test_the_radius_of_gyration_decides_what_lasts_longer(gyration):
    """Below 1/2 the spin dies first, above sqrt(2/3) the slide, between them they die together (uniform disc)."""
    speed, ratio = ratios(DISC, gyration, 1.0, pf.DistributedModel)
    early = ratio[speed > 0.3][-1]
    late = ratio[speed > 0.01][-1]
    if gyration < 0.5:
        assert late > 2.0 * early > 2.0
    elif gyration > math.sqrt(2.0 / 3.0):
        assert late < 0.6 * early < 0.6
    else:
        assert late == pytest.approx(terminal_ratio(gyration), rel=0.01)


def test_a_stone_goes_as_far_and_turns_as_much_as_coulombs_equations_say():
    scene = build_scenes("curling", ["reduced"])["reduced"]
    solution = pf.simulate(scene)
    radius = 0.0615
    gyration = 0.14 / math.sqrt(2.0)

    def rate(t, state):
        v = max(state[0], 1e-12)
        u = max(state[1], 1e-12)
        force, torque = ring_friction(v, u)
        return (
            -0.01 * G * force,
            -0.01 * G * torque * (radius / gyration) ** 2,
            state[0],
            state[1] / radius,
        )

    def stopped(t, state):
        return state[1] - 1e-4

    stopped.terminal = True
    ran = solve_ivp(
        rate,
        (0.0, 60.0),
        (2.2, 1.5 * radius, 0.0, 0.0),
        events=stopped,
        rtol=1e-9,
        atol=1e-9,
    )
    path, turn = ran.y[2:, -1]
    data = solution.data
    assert solution.status == "at rest"
    # The first micrometres, and a band of 6 mm.
    assert float(data.x[-1]) == pytest.approx(path, rel=2e-4)
    assert float(data.theta[-1]) == pytest.approx(turn, rel=5e-3)
    # It does not curl: what is left is the lag of bristles that turn.
    assert abs(float(data.y[-1])) < 2e-4 * path
    # A heavy rim: at the end it turns on the spot.
    assert float(data.vx[-3] / data.omega[-3]) < 0.5 * radius


# ---------------------------------------------------------------------- command line


def test_scenes_bring_their_patch_and_their_law():
    (stone,) = build_scenes("curling", []).values()
    assert stone.contacts[0].model.law.mu_c == 0.01
    assert stone.contacts[0].model.patch.contact_radius() == pytest.approx(
        0.0615, rel=1e-3
    )
    (part,) = build_scenes("pivot", ["reduced"], t_end=0.5).values()
    assert part.t_end == 0.5 and part.contacts[0].model.patch.depends_on_load
    (standing,) = build_scenes("foot", [], patch="Square").values()
    assert standing.contacts[1].model.patch.area() == pytest.approx(0.06**2, rel=1e-12)
    assert standing.contacts[0].model.law.mu_s == 1.2


# ---------------------------------------------------------------------- examples


@pytest.mark.parametrize("make", [pivot, foot, curling])
def test_the_example_of_a_scene_is_that_scene(make):
    path = EXAMPLES / f"{make.__name__}.toml"
    if not path.exists():
        pytest.skip("no examples beside these tests")
    scene = pf.Scene.from_file(path)
    ready = make(scene.contacts[0].model)
    assert scene.contacts[-1].model == ready.contacts[-1].model
    t = np.linspace(0.0, scene.t_end, 400) + 1e-4
    for ours, its in zip(scene.contacts, ready.contacts, strict=True):
        assert ours.normal_force(t) == pytest.approx(its.normal_force(t), rel=1e-12)
        assert (ours.name, ours.position, ours.count) == (
            its.name,
            its.position,
            its.count,
        )
    if ready.force is not None:
        assert scene.force(t).tolist() == ready.force(t).tolist()
    for name in ("t_end", "save_every", "stop_speed", "start", "name"):
        assert getattr(scene, name) == getattr(ready, name)
    for name in ("mass", "inertia", "position", "velocity", "gravity"):
        assert getattr(scene.body, name) == pytest.approx(
            getattr(ready.body, name), rel=1e-12
        )
