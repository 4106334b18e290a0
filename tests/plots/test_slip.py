"""Pictures of slip: cells that slip are orange and have dots, and the load that slips is that of the contact."""

import numpy as np
import pytest
from matplotlib.colors import to_rgba

import planarfriction as pf
from planarfriction import plots
from planarfriction.plots import style
from tests.support import synthetic
from tests.support.pictures import faults
from tests.support.refusals import refused

RADIUS = 0.01
SPEED = 1e-3
LOAD = 3.0
FULL = 0.8 * 1.5 * LOAD / (np.pi * RADIUS**2) / (0.2e6 / 3e-3)
"""Displacement at which the last cell of a layer under Hertz pressure slips [m]."""


@pytest.fixture(scope="module")
def dragged():
    def pressure(x, y):
        return np.maximum(1.0 - (x * x + y * y) / RADIUS**2, 0.0) ** 0.5

    patch = pf.ContactPatch.disc(RADIUS, pressure=pressure)
    law = pf.LuGre(mu_c=0.8, sigma_1=0.0, sigma_2=0.0, elasto_plastic=0.99)
    layer = pf.Pad.layer(shear_modulus=0.2e6, thickness=3e-3)
    model = pf.ReducedModel(patch, law, pad=layer)
    t_end = 1.2 * FULL / SPEED
    scene = pf.scenes.driven(
        model, twist=(SPEED, 0.0, 0.0), normal_force=LOAD, t_end=t_end
    )
    return pf.simulate(scene, save_every=t_end / 200)


def test_the_rim_slips_first(dragged):
    """Outside the radius c with `d/d_1 = (1 - c^2)^(1/2)`, on a circle under Hertz pressure."""
    share = 0.6
    figure = plots.plot_slip(dragged, times=[share * FULL / SPEED])
    cells, course = figure.axes
    (drawn,) = cells.collections
    slips = drawn.to_rgba(drawn.get_array())[:, :3] == to_rgba(style.SLIPS)[:3]
    slips = slips.all(axis=1)
    (dots,) = cells.lines
    assert len(dots.get_xdata()) == slips.sum()
    patch = dragged.scene.contacts[0].model.patch
    distance = np.hypot(*patch.positions.T) / RADIUS
    edge = np.sqrt(1.0 - share**2)
    width = 0.02 + 1.0 / 21
    assert slips[distance > edge + width].all()
    assert not slips[distance < edge - width].any()
    words = cells.get_title()
    load = float(words.partition(": ")[2].split()[0])
    assert load == pytest.approx(100.0 * share**3, abs=4.0)
    assert course.get_xlabel() == "time [s]"


def test_instants_are_chosen_by_the_spread_of_slip(dragged):
    figure = plots.plot_slip(dragged)
    loads = [float(each.get_title().split()[2]) for each in figure.axes[:-1]]
    assert len(loads) == 4 and (np.diff(loads) > 10.0).all()
    assert faults(figure) == []


def test_what_sticks_is_drawn_at_even_times():
    run = synthetic.solution()
    figure = plots.plot_slip(run, str(run.histories["contact"].values[0]))
    assert len(figure.axes) >= 2


def test_what_a_picture_of_slip_needs_is_said_in_one_line(dragged):
    with refused("solution must be a Solution, got 5"):
        plots.plot_slip(5)
    with refused("contact must be one of patch, got 'hand'"):
        plots.plot_slip(dragged, "hand")
    with refused("times must lie between 0 and"):
        plots.plot_slip(dragged, times=[-1.0])
    with refused("times must be 1 to 6, got 0"):
        plots.plot_slip(dragged, times=[])
