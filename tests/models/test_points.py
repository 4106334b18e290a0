"""Contacts that are a point, or nearly: soft fingers that hardly touch, and patches whose one cell carries it all."""

import numpy as np
import pytest

import planarfriction as pf
from planarfriction.scenes import Signal
from tests.support.differences import assert_step_jacobians, differences

LAW = pf.LuGre(mu_s=1.2, elasto_plastic=0.9)
SOFT = pf.ContactPatch.disc(
    0.01, 11, pressure=pf.SoftFinger(k=2.0, c=0.0085, n=1.0 / 3.0)
)
"""Below 9.8 mN only the middle of its cells is loaded."""
ASIDE = pf.ContactPatch(
    [(0.03, -0.02), (0.03, -0.01)],
    [1e-6, 1e-6],
    pf.PressureMaps((0.1, 1.0), np.array([[1.0, 0.0], [0.4, 0.6]])),
)
"""Two cells far from the frame's origin, of which the second is loaded from 0.1 N on."""


def model_of(patch):
    return pf.ReducedModelPublished(patch, LAW)


TWIST = np.array([1e-2, 2e-3, 0.5])


def run(model, load, twists, dt=1e-5):
    """Wrenches of steps from rest."""
    return pf.derivatives.rollout(model, None, twists, load, dt).wrenches


@pytest.mark.parametrize("load", [1e-300, 1e-6, 9e-3])
@pytest.mark.parametrize("patch", [SOFT, ASIDE], ids=["soft", "aside"])
def test_a_point_slides_as_one_cell_does(patch, load):
    """Also while it turns about itself, which nothing resists."""
    twists = np.stack(
        [TWIST * np.sin(0.3 * t + np.array([0.0, 1.0, 2.0])) for t in range(40)]
    )
    found = run(model_of(patch), load, twists)
    wanted = run(pf.DistributedModel(patch, LAW), load, twists)
    scale = load * np.array([1.0, 1.0, 0.03])
    np.testing.assert_allclose(found / scale, wanted / scale, rtol=0.0, atol=1e-9)


def test_jacobians_of_a_point():
    model = model_of(ASIDE)
    load = 0.05
    dt = 1e-4
    z = np.array([4e-7, -3e-7, 2e-8])
    by_twist = np.full(3, 1e-6)
    rate = model.jacobians(z, TWIST, load)
    for of, found in ((model.rate, rate.rate_twist), (model.wrench, rate.wrench_twist)):
        wanted = differences(lambda v, of=of: of(z, v, load), TWIST, by_twist)
        assert found == pytest.approx(wanted, abs=1e-4 * np.abs(wanted).max())
    assert all(np.isfinite(part).all() for part in rate)
    assert_step_jacobians(model, z, TWIST, load, dt, 1e-10, by_twist, 1e-4)


@pytest.fixture(scope="module")
def slides():
    """A body that slides and turns on a soft finger, whose load ramps to zero, rests there, and comes back."""
    load = Signal.sampled([0.0, 0.04, 0.05, 0.09], [0.4, 0.0, 0.0, 0.4], hold="linear")
    models = {
        "distributed": pf.DistributedModel(SOFT, LAW),
        "published": model_of(SOFT),
    }
    options = {
        "mass": 0.1,
        "inertia": 2e-6,
        "twist": (0.3, 0.1, 40.0),
        "normal_force": load,
        "save_every": 1e-3,
    }
    return {
        name: pf.simulate(pf.scenes.free_slide(model, t_end=0.1, **options)).data
        for name, model in models.items()
    }


def test_a_load_that_ramps_to_zero_and_back(slides):
    found = slides["published"]
    wanted = slides["distributed"]
    assert float(found.time[-1]) == pytest.approx(0.1)
    way = float(np.hypot(wanted.x[-1], wanted.y[-1]))
    # the published table errs by a percent, and with so few cells by more in the torque
    assert float(np.hypot(found.x - wanted.x, found.y - wanted.y).max()) < 1e-2 * way
    assert float(abs(found.theta - wanted.theta).max()) < 2e-2 * float(
        abs(wanted.theta).max()
    )
    lost = float(wanted.omega[0] - wanted.omega[-1])
    brake = float(found.omega[0] - found.omega[-1])
    assert brake == pytest.approx(lost, rel=0.15)
