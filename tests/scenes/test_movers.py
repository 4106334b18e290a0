"""Moving supports of contacts: driven pads, belts, turntables, and the ready scene with them."""

import dataclasses

import numpy as np
import pytest

import planarfriction as pf
from planarfriction.derivatives import scene_sensitivities
from planarfriction.scenes import pushed
from planarfriction.scenes.signal import displacement
from planarfriction.solvers import RODAS4
from tests.support.differences import scene_slopes
from tests.support.files import again
from tests.support.refusals import refused

LAW = pf.LuGre(mu_c=0.4, mu_s=0.5, v_s=5e-3, sigma_0=1e5, sigma_1=50.0, sigma_2=0.2)
PATCH = pf.ContactPatch.disc(0.012, cells=5)
MODELS = {
    "distributed": pf.DistributedModel(PATCH, LAW),
    "reduced": pf.ReducedModel(PATCH, LAW),
    "published": pf.ReducedModelPublished(PATCH, LAW),
}
SWAY = pf.Signal.sampled(
    [0.0, 0.1, 0.25, 0.4],
    [[0.0, 0.0, 0.0], [0.08, 0.02, 1.0], [-0.03, 0.05, -2.0], [0.0, 0.0, 0.0]],
    "linear",
)


def led(model, frame=(0.0, 0.0), mass=0.3):
    """A plate on a table, led by a pad, seen from a frame that moves with minus `frame` [m/s]."""
    body = pf.Body(mass, 4e-4, velocity=(*frame, 0.0), gravity=(0.0, 0.0))
    drift = np.array([*frame, 0.0])
    table = pf.Contact(
        model,
        3.0,
        mounted_on="body",
        position=(2e-3, 1e-3),
        name="table",
        support_velocity=drift,
    )
    sway = pf.Signal(SWAY.times, SWAY.values + drift, "linear")
    pad = pf.Contact(
        model,
        4.0,
        position=(0.03, 0.01),
        angle=0.4,
        count=2,
        name="pad",
        support_velocity=sway,
    )
    return pf.Scene(body, [table, pad], 0.4, save_every=0.02)


def test_a_displacement_is_the_integral_of_what_is_given():
    times = np.array([0.0, 0.05, 0.1, 0.2, 0.4, 0.7])
    ends = [
        0.0,
        0.02 * 0.05,
        0.04 * 0.1,
        0.04 * 0.1 + 0.1 * (0.08 + 0.5 * (-0.11 / 0.15) * 0.1),
    ]
    after = 0.04 * 0.1 + 0.15 * 0.025 - 0.15 * 0.015
    assert displacement(SWAY, times)[:, 0] == pytest.approx(
        [*ends, after, after], abs=1e-16
    )
    held = pf.Signal.sampled([0.1, 0.3], [[1.0, 0.0, 2.0], [0.0, 0.0, 0.0]])
    assert displacement(held, [0.4, 0.2])[:, 2] == pytest.approx(
        [0.4 + 0.2, 0.2 + 0.2], abs=1e-15
    )
    assert displacement(pf.Signal.constant([1.0, 0.0, 0.0]), [0.0]).tolist() == [
        [0.0, 0.0, 0.0]
    ]


@pytest.mark.parametrize("name", MODELS)
def test_motion_is_the_same_in_a_frame_that_moves(name):
    rest = pf.simulate(led(MODELS[name]), rtol=1e-7)
    frame = (0.7, -0.4)
    moved = pf.simulate(led(MODELS[name], frame), rtol=1e-7)
    time = rest.data.time.values
    assert np.abs(rest.data.x.values).max() > 1e-3  # the pad does take the plate along
    # rounding of larger velocities alone differs, and what steps of other lengths leave
    np.testing.assert_allclose(
        moved.data.x - frame[0] * time, rest.data.x, rtol=0.0, atol=1e-9
    )
    np.testing.assert_allclose(
        moved.data.y - frame[1] * time, rest.data.y, rtol=0.0, atol=1e-9
    )
    np.testing.assert_allclose(moved.data.theta, rest.data.theta, rtol=0.0, atol=1e-7)
    for contact in ("table", "pad"):
        np.testing.assert_allclose(
            moved.contact_twist(contact),
            rest.contact_twist(contact),
            rtol=0.0,
            atol=1e-6,
        )
        np.testing.assert_allclose(moved.data.fx, rest.data.fx, rtol=0.0, atol=1e-5)


def test_a_body_that_sticks_to_a_turntable_goes_round_with_it():
    model = MODELS["reduced"]
    spin = 2.0
    start = pf.Body(
        0.2, 1e-4, (0.05, 0.0), velocity=(0.0, 0.05 * spin, spin), gravity=(0.0, 0.0)
    )
    table = pf.Contact(
        model,
        0.2 * 9.81,
        mounted_on="body",
        name="table",
        support_velocity=(0.0, 0.0, spin),
    )
    run = pf.simulate(pf.Scene(start, [table], 1.0, save_every=0.1))
    time = run.data.time.values
    # it creeps outwards by the deflection of the bristles, some um at 0.2 m/s^2
    np.testing.assert_allclose(
        run.data.x, 0.05 * np.cos(spin * time), rtol=0.0, atol=2e-6
    )
    np.testing.assert_allclose(
        run.data.y, 0.05 * np.sin(spin * time), rtol=0.0, atol=2e-6
    )
    np.testing.assert_allclose(run.data.theta, spin * time, rtol=0.0, atol=1e-5)
    assert np.abs(run.contact_twist("table")).max() < 1e-3


def test_a_body_follows_a_pad_that_holds_it_and_turns():
    scene = led(MODELS["reduced"])
    light = dataclasses.replace(scene, contacts=[scene.contacts[1]])
    run = pf.simulate(light)
    way = displacement(SWAY, run.data.time.values)
    at = np.array([0.03, 0.01])  # the plate turns about the pad
    arm = pf.geometry.rotate(-at, way[:, 2])
    # bristles deflect by 5 um at most, 0.6 mrad over the contact radius; plain LuGre creeps by a little more
    np.testing.assert_allclose(run.data.theta, way[:, 2], rtol=0.0, atol=3e-3)
    np.testing.assert_allclose(
        run.data.x, at[0] + way[:, 0] + arm[:, 0], rtol=0.0, atol=1e-4
    )
    np.testing.assert_allclose(
        run.data.y, at[1] + way[:, 1] + arm[:, 1], rtol=0.0, atol=1e-4
    )
    # Bristles move, the pad does not slip.
    assert np.abs(run.contact_twist("pad")[:, :2]).max() < 1e-3


def test_order_with_something_that_moves():
    law = dataclasses.replace(LAW, v_s=0.3, sigma_0=2e3, sigma_1=5.0)
    model = pf.DistributedModel(PATCH, law)
    fast = pf.Signal.sampled([0.0, 0.4], [[0.3, 0.1, 4.0], [1.5, -0.6, 9.0]], "linear")
    pad = pf.Contact(
        model, 6.0, position=(0.02, 0.0), name="pad", support_velocity=fast
    )
    table = pf.Contact(model, 2.0, mounted_on="body", name="table")
    scene = pf.Scene(pf.Body(1.0, 2e-3, gravity=(0.0, 0.0)), [pad, table], 0.4)
    reference = pf.simulate(scene, rtol=1e-11, atol=1e-9)
    errors = []
    steps = []
    for rtol in (1e-3, 1e-7):
        run = pf.simulate(scene, rtol=rtol, atol=10.0 * rtol, method=RODAS4)
        errors.append(
            max(abs(float(run.data[n][-1] - reference.data[n][-1])) for n in ("x", "y"))
        )
        steps.append(run.statistics.steps)
    # as on scenes where nothing moves: tolerances, not steps, are set, hence the margin
    assert 3.4 < np.log(errors[0] / errors[1]) / np.log(steps[1] / steps[0]) < 5.8


def test_derivatives_follow_what_moves():
    def run(mu=1.0, mass=1.0):
        law = dataclasses.replace(LAW, mu_c=mu * LAW.mu_c, mu_s=mu * LAW.mu_s)
        return led(pf.DistributedModel(PATCH, law), mass=0.3 * mass)

    found = scene_sensitivities(
        run(), ("mu", "mass"), options=pf.scenes.SolverOptions(t_end=0.2)
    )
    for p, name in enumerate(("mu", "mass")):

        def changed(by, name=name):
            return dataclasses.replace(run(**{name: by}), t_end=0.2)

        wanted = scene_slopes(changed, 1.0, 1e-4)[0][-1, 3:]
        # central differences over 1e-4 across bristles that begin to slip
        error = np.abs(found.d_motion[-1, 3:, p] - wanted)
        assert error.max() < 2e-4 * np.abs(wanted).max()


# ---------------------------------------------------------------------- the scene


def test_velocities_of_contacts_survive_files(tmp_path):
    scene = led(MODELS["published"])
    again(scene, tmp_path)
    pf.simulate(scene, t_end=0.02).save(tmp_path / "run.nc")
    assert pf.Solution.load(tmp_path / "run.nc").scene == scene


def test_velocities_of_contacts_are_checked():
    with refused(
        "support_velocity of contact 'pad' must have 3 columns", pf.FrictionError
    ):
        pf.Contact(MODELS["reduced"], 1.0, name="pad", support_velocity=(1.0, 0.0))
    body = pf.Body(1.0, 1.0)
    moving = pf.Contact(MODELS["reduced"], 1.0, name="pad", support_velocity=SWAY)
    with refused(
        "support_velocity of contact 'pad' must be None if the velocity",
        pf.FrictionError,
    ):
        pf.Scene(body, [moving], 1.0, velocity=(1.0, 0.0, 0.0))


def test_nothing_rests_while_something_moves():
    model = MODELS["reduced"]
    body = pf.Body(0.2, 1e-4, gravity=(0.0, 0.0))
    contact = pf.Contact(
        model,
        2.0,
        mounted_on="body",
        support_velocity=pf.Signal.sampled([0.0, 0.3], [[0.0] * 3, [0.1, 0, 0]]),
    )
    run = pf.simulate(pf.Scene(body, [contact], 0.5, stop_speed=1e-4))
    assert run.status == "success"
    assert float(run.data.x[-1]) == pytest.approx(0.02, rel=0.2)


def test_what_is_pulled_comes_round_and_what_is_pushed_swings_away():
    small = dataclasses.replace(LAW, mu_c=0.3, mu_s=0.3)
    # Turns nearly freely.
    pad = pf.DistributedModel(pf.ContactPatch.disc(2e-3, cells=3), small)
    turns = []
    for side in (-0.05, 0.05):
        scene = pushed(
            MODELS["reduced"], pad=pad, normal_force=4.0, position=(side, 0.01)
        )
        turns.append(np.degrees(pf.simulate(scene).data.theta.values))
    # From the line of motion to the centre of mass.
    line = np.degrees(np.arctan2(0.01, 0.05))
    assert turns[0][-1] < -2.0 * line  # pushed: further and further
    assert -line < turns[1][-1] < -0.5 * line  # pulled: towards the line


@pytest.mark.parametrize("mounted_on", ["world", "body"])
def test_a_body_that_starts_sliding_slides_against_what_moves(mounted_on):
    body = pf.Body(
        0.2, 1e-4, (0.02, -0.01), velocity=(0.3, 0.1, 2.0), gravity=(0.0, 0.0)
    )
    place = (0.01, 0.03)
    moves = (-0.1, 0.2, -3.0)
    contact = pf.Contact(
        MODELS["reduced"],
        1.0,
        mounted_on,
        place,
        angle=0.5,
        name="pad",
        support_velocity=moves,
    )
    run = pf.simulate(pf.Scene(body, [contact], 1e-6, start="sliding", save_every=1e-6))
    steady = MODELS["reduced"].step(
        MODELS["reduced"].rest(), run.contact_twist("pad")[0], 1.0, 1e6
    )[1]
    found = run.data.isel(time=0, contact=0)
    assert [float(found[name]) for name in ("fx", "fy", "tau")] == pytest.approx(
        steady, rel=1e-9
    )


def test_driven_pads_are_drawn_where_they_are(tmp_path):
    run = pf.simulate(pushed(MODELS["reduced"], t_end=0.5))
    figure = pf.plots.plot_motion(run)
    axes = figure.axes[0]
    assert axes.get_xlim()[0] < -72.0  # the pads begin 60 mm behind the centre
    motion = pf.plots.motion
    pads = [each for each in axes.patches if each.get_alpha() == motion.PAD_OPACITY]
    assert len(pads) == 2 * motion.INSTANTS
    left = [pad.get_window_extent().x0 for pad in pads[1::2]]
    assert left == sorted(left) and left[-1] > left[0] + 1.0
