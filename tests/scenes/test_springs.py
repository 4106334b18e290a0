"""Springs: against closed forms and an integration of our own, on files, in derivatives, at rest."""

import dataclasses
import functools

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import planarfriction as pf
from planarfriction.errors import FileError
from tests.support.differences import differences, scene_slopes
from tests.support.files import again
from tests.support.refusals import refused

LAW = pf.LuGre(mu_c=0.3, mu_s=0.4, v_s=0.01, sigma_0=1e4, sigma_1=20.0, sigma_2=0.1)
MODEL = pf.DistributedModel(
    pf.ContactPatch.points([[0.01, 0.0], [-0.01, 0.01], [0.0, -0.02]]), LAW
)
BODY = pf.Body(0.5, 2e-3, (0.01, 0.02), 0.2, (0.1, -0.2, 3.0), gravity=(0.3, 0.0))
ANCHOR = pf.Signal(
    [0.0, 0.4, 1.0], [[0.0, 0.0, 0.0], [0.1, 0.02, 0.5], [0.1, 0.02, 0.5]], "linear"
)
SPRINGS = (
    pf.Spring(40.0, 0.6, ANCHOR, (0.03, 0.01), 0.05, 1e-3),
    pf.Spring(15.0, 0.0, (-0.05, 0.1), (-0.04, 0.0)),
)


def scene(load=0.0, **changes):
    contact = pf.Contact(MODEL, load, mounted_on="body", position=(0.005, 0.0))
    whole = pf.Scene(
        BODY, [contact], 1.0, springs=SPRINGS, rtol=1e-9, atol=1e-7, save_every=0.1
    )
    return dataclasses.replace(whole, **changes)


def motion(solution):
    return np.stack(
        [
            solution.histories[name].values
            for name in ("vx", "vy", "omega", "x", "y", "theta")
        ],
        axis=-1,
    )


def newton(t, y):
    """Rates of velocity and pose from the virtual work of the stretches: no lever arm is written out."""
    velocity = y[:3]
    pose = y[3:]
    force = BODY.mass * np.array([*BODY.gravity, 0.0])
    for spring in SPRINGS:
        cos = np.cos(pose[2])
        sin = np.sin(pose[2])
        arm = np.array([[cos, -sin], [sin, cos]]) @ spring.at
        by_pose = np.array([[1.0, 0.0, -arm[1]], [0.0, 1.0, arm[0]], [0.0, 0.0, 1.0]])
        anchor = spring.anchor(t)
        rate = (spring.anchor(t + 1e-6) - spring.anchor(t)) / 1e-6
        stretch = anchor - np.array([*(pose[:2] + arm), pose[2]])
        stiffness = np.array([spring.stiffness, spring.stiffness, spring.torsion])
        damping = np.array([spring.damping, spring.damping, spring.torsion_damping])
        force = force + by_pose.T @ (
            stiffness * stretch + damping * (rate - by_pose @ velocity)
        )
    return np.concatenate([force / [BODY.mass, BODY.mass, BODY.inertia], velocity])


def test_springs_move_a_body_without_friction_as_newton_says():
    y = np.array([*BODY.velocity, *BODY.position, BODY.angle])
    expected = []
    for begin, end in ((0.0, 0.4), (0.4, 1.0)):
        part = solve_ivp(
            newton,
            (begin, end),
            y,
            method="DOP853",
            rtol=1e-11,
            atol=1e-12,
            dense_output=True,
        )
        times = np.arange(round(10 * begin) + 1, round(10 * end) + 1) / 10
        expected.append(part.sol(times).T)
        y = part.y[:, -1]
    found = motion(pf.simulate(scene()))[1:]
    # the difference quotient of the anchor at 1 s, and a tolerance of 1e-9 of 0.1 to 1 over many steps
    np.testing.assert_allclose(found, np.concatenate(expected), rtol=0.0, atol=3e-6)


def test_a_mass_on_a_spring_swings_as_a_cosine():
    body = pf.Body(2.0, 1e-2, (0.1, 0.0), 0.3, gravity=(0.0, 0.0))
    swing = scene(
        body=body,
        springs=pf.Spring(8.0, torsion=0.36),
        t_end=10.0,
        rtol=1e-10,
        atol=1e-8,
    )
    found = pf.simulate(swing).histories
    time = found["time"].values
    np.testing.assert_allclose(
        found["x"].values, 0.1 * np.cos(2.0 * time), rtol=0.0, atol=1e-7
    )
    np.testing.assert_allclose(
        found["theta"].values, 0.3 * np.cos(6.0 * time), rtol=0.0, atol=1e-6
    )


def test_stiff_springs_do_not_shorten_the_steps():
    """The solver takes springs implicitly: a thousand times the rate of its steps, it follows the anchor."""
    body = pf.Body(0.5, 2e-3, gravity=(0.0, 0.0))
    tied = pf.Spring(
        1e8,
        1e4,
        pf.Signal([0.0, 1.0], [[0.0, 0.0], [0.1, 0.0]], "linear"),
        torsion=1e5,
        torsion_damping=20.0,
    )
    solution = pf.simulate(scene(2.0, body=body, springs=tied, rtol=1e-5, atol=2e-4))
    assert solution.statistics.steps < 400  # decay of the spring: 1e-4 s and 5e-5 s
    np.testing.assert_allclose(
        solution.histories["x"].values,
        0.1 * solution.histories["time"].values,
        atol=2e-6,
    )


def test_forces_of_springs_are_the_slope_of_their_energy():
    pose = np.array([0.02, -0.01, 0.4])
    spring = SPRINGS[0]

    def energy(pose):
        cos = np.cos(pose[2])
        sin = np.sin(pose[2])
        x, y, angle = spring.anchor(0.3)
        at = pose[0] + cos * 0.03 - sin * 0.01, pose[1] + sin * 0.03 + cos * 0.01
        return 0.5 * (
            40.0 * ((x - at[0]) ** 2 + (y - at[1]) ** 2) + 0.05 * (angle - pose[2]) ** 2
        )

    slope = differences(energy, pose, 1e-4)
    np.testing.assert_allclose(spring.pull(0.3, pose), -slope, rtol=1e-7, atol=1e-9)


@pytest.mark.parametrize("name", ["mass", "inertia", "x", "y", "theta", "omega"])
def test_derivatives_with_springs_are_those_of_differences(name):
    from planarfriction.derivatives import scene_gradient, scene_sensitivities

    whole = scene(2.0)
    kind = (
        {"parameters": [name]} if name in ("mass", "inertia") else {"initial": [name]}
    )
    given = {"parameters": [], **kind}
    found = scene_sensitivities(whole, **given)
    make = functools.partial(changed, whole, name)
    wanted = scene_slopes(make, 0.0, 1e-4)[0][-1]
    scale = np.array([1.0, 1.0, 50.0, 0.1, 0.1, 5.0])
    np.testing.assert_allclose(
        found.d_motion[-1, :, 0] / scale, wanted / scale, rtol=1e-3, atol=1e-4
    )
    weights = np.array([1.0, -2.0, 0.1, 3.0, 1.0, 0.5])
    back = scene_gradient(
        whole,
        lambda time, _: weights * (np.arange(len(time)) == len(time) - 1)[:, None],
        **given,
    )
    np.testing.assert_allclose(back.gradient, weights @ found.d_motion[-1], rtol=1e-4)


def changed(whole, name, by):
    body = whole.body
    if name in ("mass", "inertia"):
        gravity = body.gravity
        body = dataclasses.replace(
            body, **{name: getattr(body, name) * (1.0 + by)}, gravity=gravity
        )
    elif name == "theta":
        body = dataclasses.replace(body, angle=body.angle + by)
    elif name == "omega":
        body = dataclasses.replace(
            body, velocity=(*body.velocity[:2], body.velocity[2] + by)
        )
    else:
        place = np.array(body.position) + by * np.array([name == "x", name == "y"])
        body = dataclasses.replace(body, position=place)
    return dataclasses.replace(whole, body=body)


# ------------------------------------------------------------------ records and files


def test_springs_in_files_come_back_to_the_last_bit(tmp_path):
    again(scene(1.0), tmp_path)
    assert scene(1.0, springs=()).digest() != scene(1.0).digest()
    # Digests of scenes without springs stay.
    assert "spring" not in scene(1.0, springs=()).to_dict()


def test_a_spring_is_one_table_in_a_file():
    data = scene(1.0).to_dict() | {"spring": {"stiffness": 3, "anchor": [0.1, 0.2]}}
    (spring,) = pf.Scene.from_dict(data).springs
    assert spring == pf.Spring(3.0, anchor=(0.1, 0.2, 0.0))


@pytest.mark.parametrize(
    ("spring", "words"),
    [
        ({"damping": 1.0}, r"\[spring\]: missing key 'stiffness'"),
        ({"stiffness": -1.0}, r"\[spring\]: stiffness must be >= 0"),
        (
            {"stiffness": 1.0, "dampin": 2.0},
            r"\[spring\]: unknown key 'dampin' \(did you mean 'damping'\?\)",
        ),
        ({"stiffness": 1.0, "anchor": 2.0}, r"\[spring\]: anchor must have 3 columns"),
        ([], r"spring must be one or more tables \[\[spring\]\]"),
    ],
)
def test_mistakes_in_files_are_named_in_one_line(spring, words):
    with refused(words, FileError):
        pf.Scene.from_dict(scene(1.0).to_dict() | {"spring": spring})


def test_what_springs_refuse():
    with refused("springs must be a list of Spring"):
        scene(springs=[3.0])
    with refused("springs must be none if the velocity is prescribed"):
        scene(velocity=(0.1, 0.0, 0.0))


def test_a_scene_tells_its_springs_and_stops_at_their_anchors():
    assert "body of 0.5 kg, 0.002 kg m^2, on 2 springs;" in repr(scene())
    assert "on a spring;" in repr(scene(springs=SPRINGS[:1])) and "spring" not in repr(
        scene(springs=())
    )
    np.testing.assert_array_equal(scene().breaks(), [0.0, 0.4, 1.0])


# ------------------------------------------------------------------ rest


def test_a_body_in_equilibrium_with_its_springs_stays_in_place():
    body = dataclasses.replace(BODY, velocity=(0.0, 0.0, 0.0), gravity=(0.0, 0.0))
    law = dataclasses.replace(LAW, elasto_plastic=0.9)
    contact = pf.Contact(pf.DistributedModel(MODEL.patch, law), 40.0, mounted_on="body")
    springs = (pf.Spring(40.0, at=(0.03, 0.01), torsion=0.05), SPRINGS[1])
    found = pf.simulate(
        scene(body=body, contacts=contact, springs=springs, start="equilibrium")
    ).histories
    assert np.ptp(found["x"].values) < 1e-9 and np.ptp(found["theta"].values) < 1e-8
    pull = sum(spring.pull(0.0, [0.01, 0.02, 0.2]) for spring in springs)
    cos = np.cos(0.2)
    sin = np.sin(0.2)
    friction = np.array([found[name].values[-1, 0] for name in ("fx", "fy", "tau")])
    turned = (
        cos * friction[0] - sin * friction[1],
        sin * friction[0] + cos * friction[1],
        friction[2],
    )
    # Contact frame at the centre of mass, turned with the body.
    np.testing.assert_allclose(turned, -pull, rtol=1e-6)


def test_a_body_does_not_rest_while_an_anchor_still_moves():
    body = pf.Body(0.5, 2e-3, gravity=(0.0, 0.0))
    late = pf.Signal([0.5, 0.6], [[0.0, 0.0], [0.2, 0.0]], "linear")
    solution = pf.simulate(
        scene(
            5.0,
            body=body,
            springs=pf.Spring(40.0, 1.0, late),
            t_end=3.0,
            stop_speed=1e-4,
        )
    )
    time = solution.histories["time"].values
    assert (
        solution.status == "at rest"
        and 0.6 < time[-1] < 3.0
        and solution.histories["x"].values[-1] > 0.05
    )
