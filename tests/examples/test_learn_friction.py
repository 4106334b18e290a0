"""The example that learns friction from markers: its labels, and that markers tell more than the force."""

import numpy as np
import pytest

import planarfriction as pf
from tests.support.repository import script

torch = pytest.importorskip(
    "torch", reason="needs PyTorch: pip install 'planarfriction[torch]'"
)

pytestmark = pytest.mark.torch


@pytest.fixture(scope="module")
def example():
    return script("examples/learn_friction.py")


@pytest.fixture(scope="module")
def tip(example):
    return example.fingertip()


def test_markers_before_slip_tell_friction_better_than_the_force(example):
    torch.set_num_threads(1)
    found = example.run(count=200, steps=1500)
    assert found.slips == 200 and 1e6 < found.size < 3e6
    assert found.net < 0.17 < found.mean
    assert found.net < 0.8 * found.force


def test_labels_are_those_of_the_slip(example, tip):
    """The plate hangs still until its grip falls, and the force at the onset is near the limit of friction."""
    slips = example.Slips(tip)
    scene = slips.scene(3)
    found = slips.labels(pf.simulate(scene, bristles="all"))
    mu, weight = slips.friction(3), scene.body.mass * 9.81
    clock = example.FRAME * np.arange(len(found["normal_force"]))
    assert example.SETTLED < found["incipient"] < found["onset"] < example.END
    still = np.searchsorted(clock, example.SETTLED)
    assert 2.0 * found["wrench"][still, 1] == pytest.approx(weight, rel=0.03)
    load = np.interp(found["onset"], clock, found["normal_force"])
    force = np.interp(found["onset"], clock, np.hypot(*found["wrench"][:, :2].T))
    assert 0.8 < force / (mu * load) < 1.02
    middle = found["markers"][still].mean(axis=0)
    assert abs(middle[1]) > 10.0 * abs(middle[0])


def test_the_network_does_not_see_friction_in_its_inputs(example):
    """Frames end before the slip, and hold markers and loads alone."""
    clock = example.FRAME * np.arange(61)
    onset = 0.305
    import xarray as xr

    ramp = np.tile(clock, (4, 1))
    data = xr.Dataset(
        {
            "normal_force": (("case", "time"), ramp + 1.0),
            "wrench": (("case", "time", "k"), np.ones((4, 61, 3))),
            "markers": (("case", "time", "p", "xy"), np.zeros((4, 61, 16, 2))),
            "onset": (("case",), [onset, onset, onset, np.nan]),
        }
    )
    seen, mu = example.frames(data, np.arange(1.0, 5.0), 200, 0)
    assert sorted(set(mu)) == [1.0, 2.0, 3.0]
    at = seen.normal_force - 1.0
    assert at.min() == pytest.approx(example.SETTLED)
    assert at.max() == pytest.approx(0.29)


def test_it_prints_its_errors(example, capsys, tmp_path):
    example.main(["--slips", "20", "--steps", "2", "--out", str(tmp_path)])
    assert (tmp_path / "slips.nc").stat().st_size > 10_000
    assert "friction from markers" in capsys.readouterr().out
