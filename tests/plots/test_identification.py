"""The figure of a fit: logs one after another in their units, and residuals over the noise."""

import numpy as np
import pytest

import planarfriction as pf
from planarfriction import identify
from planarfriction.plots import style
from planarfriction.plots.identification import _draw_loops

FIRST, SECOND = np.linspace(0.0, 1.0, 101), np.linspace(5.0, 7.0, 51)


def fitted(channel=("fx", "N")):
    """Return a made-up fit of two logs of millinewtons, 0.1 mN of noise, with two values far off in the first one."""
    off = np.zeros(101)
    off[[10, 20]] = 7e-4, -9e-4
    histories = [
        {
            "name": name,
            "time": time,
            "measured": 2e-3 * np.sin(time)[:, None] + away,
            "predicted": 2e-3 * np.sin(time)[:, None],
            "twist": np.full((len(time), 3), 1e-3),
        }
        for name, time, away in (
            ("first", FIRST, off[:, None]),
            ("second", SECOND, 1e-4),
        )
    ]
    law = pf.LuGre()
    model = pf.ReducedModel(pf.ContactPatch.disc(0.01, 5), law)
    nothing = np.full(1, np.nan)
    return identify.Identification(
        ("mu_c",),
        np.ones(1),
        nothing,
        np.eye(1),
        (),
        np.array([1e-4]),
        (channel,),
        tuple(histories),
        law,
        model,
        (1, 2),
    )


def drawn():
    return fitted().plot()


@pytest.mark.parametrize(
    ("channel", "speed", "way"),
    [
        (("fx", "N"), "velocity [m/s]", "m]"),
        (("tau", "N m"), "velocity [rad/s]", "rad]"),
    ],
)
def test_forces_stand_over_speeds_and_torques_over_spins(channel, speed, way):
    over_speed, over_way = style.new_figure(6.0, 3.0).subplots(1, 2)
    _draw_loops(over_speed, over_way, fitted(channel), 0)
    assert over_speed.get_xlabel() == speed
    assert over_way.get_xlabel().endswith(way)


def test_logs_follow_each_other_in_the_unit_of_the_label():
    figure = drawn()
    left, right = figure.axes
    assert (
        left.get_ylabel() == "fx [mN]"
        and right.get_xlabel() == "time, one after another [s]"
    )
    assert [text.get_text() for text in figure.legends[0].get_texts()] == [
        "measured",
        "fitted",
    ]
    places = [line.get_xdata() for line in left.lines]
    # A gap of 1 % of 3 s.
    for found, time in zip(
        places, (FIRST, FIRST, SECOND - 3.97, SECOND - 3.97), strict=True
    ):
        assert found == pytest.approx(time)
    assert left.lines[3].get_ydata() == pytest.approx(2.0 * np.sin(SECOND))


def test_residuals_are_over_the_noise_and_stand_at_the_rim_beyond_five_of_it():
    right = drawn().axes[1]
    assert right.get_ylim() == (-5.0, 5.0)
    inside, above, below, second = right.lines[:4]
    assert inside.get_ydata()[[9, 10, 20]] == pytest.approx([0.0, 7.0, -9.0], abs=1e-9)
    for line, marker, point in ((above, "^", (0.1, 4.8)), (below, "v", (0.2, -4.8))):
        assert line.get_marker() == marker and line.get_xydata() == pytest.approx(
            np.array([point])
        )
    assert second.get_ydata() == pytest.approx(np.ones(51)) and not len(
        right.lines[4].get_xdata()
    )
