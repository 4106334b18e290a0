"""Stiffness of pads from logs: intervals hold the truth; a wrong pad and what logs do not determine are said first."""

import numpy as np
import pytest

import planarfriction as pf
from planarfriction.identify import Log, PadFit, identify_pad
from tests.support.refusals import refused

RADIUS = 0.01
LOAD = 2.0
NOISE = 0.02
LAW = pf.LuGre(mu_c=0.8, sigma_1=0.0, elasto_plastic=0.9)
START = pf.LuGre(mu_c=0.5, sigma_1=0.0, elasto_plastic=0.9)
PATCH = pf.ContactPatch.disc(
    RADIUS, 9, pressure=lambda x, y: np.maximum(RADIUS**2 - x * x - y * y, 0.0) ** 0.5
)
PADS = {
    "layer": (pf.Pad.layer(0.2e6, 3e-3), pf.Pad.layer(1e6, 3e-3)),
    "half-space": (pf.Pad.half_space(0.2e6, 0.45), pf.Pad.half_space(1e6, 0.45)),
    "measured": (pf.Pad.measured(8e3, 0.6), pf.Pad.measured(2e3, 0.1)),
}
"""Pad, and the one from which a fit starts."""


def motion(samples, *parts):
    """Small cycles of shift, small cycles of rotation, and a slip that turns; a second each."""
    t = np.linspace(0.0, 1.0, samples)
    wave = 8.0 * np.pi * np.cos(8.0 * np.pi * t)
    bump = 1.2e-3 * np.sin(np.pi * t)
    known = {
        "shift": (4e-5 * wave, 0.0 * t, 0.0 * t),
        "turn": (0.0 * t, 0.0 * t, 6e-3 * wave),
        "slip": (
            bump * np.cos(t),
            bump * np.sin(3.0 * t),
            0.1 * np.sin(2.0 * np.pi * t),
        ),
    }
    return np.concatenate([np.stack(known[each], 1) for each in parts])


def exact(pad, samples, *parts):
    """The log of a pad, stepped ten times between two samples."""
    twist = motion(samples, *parts)
    dt = 1.0 / (samples - 1)
    ends = np.arange(len(twist))
    fine = np.arange(0.0, len(twist) - 1, 0.1) + 0.05
    inner = np.stack([np.interp(fine, ends, each) for each in twist.T], 1)
    model = pf.DistributedModel(PATCH, LAW, pad=pad)
    wrenches = pf.derivatives.rollout(model, None, inner, LOAD, 0.1 * dt).wrenches
    return Log(dt * ends, twist, np.vstack([np.zeros(3), wrenches[9::10]]), LOAD)


def noisy(log, seed):
    noise = NOISE * np.random.default_rng(seed).normal(size=log.wrench.shape)
    wrench = log.wrench + noise * [1.0, 1.0, 0.5 * RADIUS]
    return Log(log.time, log.twist, wrench, LOAD)


ALL = ("shift", "turn", "slip")


@pytest.mark.parametrize("name", PADS)
def test_a_log_of_small_cycles_and_slips_tells_the_pad(name):
    pad, first = PADS[name]
    found = identify_pad(noisy(exact(pad, 60, *ALL), 1), PATCH, first, START)
    assert found.verdicts == ()
    for each, value, error in zip(
        found.names, found.values, found.standard_errors, strict=True
    ):
        truth = LAW.mu_c if each == "mu_c" else getattr(pad, each)
        assert abs(value - truth) < 3.5 * error < 0.1 * abs(truth)
        low, high = found.intervals()[each]
        assert low < value < high and found.identifiable(each)
        assert f"{each} = " in str(found)
    assert found.noise == pytest.approx(
        NOISE * np.array([1.0, 1.0, 0.5 * RADIUS]), rel=0.2
    )
    assert found.law.mu_c == found.values[-1] and type(found.pad) is type(pad)


@pytest.mark.parametrize(
    ("name", "parts", "unknown"),
    [
        ("measured", ("shift",), {"common", "mu_c"}),
        ("measured", ("shift", "turn"), set()),
        ("half-space", ("shift",), {"mu_c"}),
    ],
)
def test_what_is_not_identifiable_comes_before_the_numbers(name, parts, unknown):
    """Small shifts alone do not tell what is common, nor friction; rotations in which the rim slips tell both."""
    pad, first = PADS[name]
    found = identify_pad(noisy(exact(pad, 60, *parts), 2), PATCH, first, START)
    assert {each for each in found.names if not found.identifiable(each)} == unknown
    lines = str(found).splitlines()
    said = len(unknown)
    assert all(": not identifiable, add " in each for each in lines[:said])
    assert all(" = " in each for each in lines[said:])
    assert not any(line.startswith(f"{each} =") for line in lines for each in unknown)


WRONG = {
    "another pad": lambda log: (log, PATCH, PADS["half-space"][1]),
    "another patch": lambda log: (log, pf.ContactPatch.disc(0.02, 9), PADS["layer"][1]),
    "another law": lambda log: (dragged(log), PATCH, PADS["layer"][1]),
}


def dragged(log):
    """With a viscous friction that the law does not have."""
    viscous = np.array([15.0, 15.0, 1.5e-3]) * log.twist
    return Log(log.time, log.twist, log.wrench - viscous, LOAD)


@pytest.mark.parametrize("wrong", WRONG.values(), ids=WRONG)
def test_a_model_that_does_not_fit_is_said_before_the_numbers(wrong):
    log = noisy(exact(PADS["layer"][0], 60, *ALL), 1)
    found = identify_pad(*wrong(log), START)
    first = found.verdicts[0]
    assert (first.parameter, first.identifiable) == ("fit", False)
    assert str(found).startswith("fit: neighbouring residuals are correlated")


def test_residuals_that_are_small_do_not_count():
    """A log without noise leaves the pattern of steps between its samples."""
    found = identify_pad(
        exact(PADS["layer"][0], 60, *ALL), PATCH, PADS["layer"][1], START
    )
    assert found.verdicts == ()


@pytest.mark.slow
@pytest.mark.parametrize(("name", "samples"), [("layer", 150), ("measured", 100)])
def test_intervals_hold_the_stiffness_in_95_of_100_noisy_logs(name, samples):
    pad, first = PADS[name]
    twist = motion(samples, *ALL)
    dt = 1.0 / (samples - 1)
    middle = 0.5 * (twist[1:] + twist[:-1])
    model = pf.DistributedModel(PATCH, LAW, pad=pad)
    wrenches = pf.derivatives.rollout(model, None, middle, LOAD, dt).wrenches
    time = dt * np.arange(len(twist))
    clean = Log(time, twist, np.vstack([np.zeros(3), wrenches]), LOAD)
    inside = 0
    for seed in range(100):
        found = identify_pad(noisy(clean, seed), PATCH, first, START)
        low, high = found.intervals()[found.names[0]]
        inside += low <= getattr(pad, found.names[0]) <= high
    assert 90 <= inside <= 97


def test_bad_input_is_refused_in_one_line():
    log = exact(PADS["layer"][0], 12, "shift")
    with refused("pad must be a Pad.layer, Pad.half_space or Pad.measured"):
        identify_pad(log, PATCH, pf.Pad.at_load(1.0), LAW)
    with refused("law must be a LuGre"):
        identify_pad(log, PATCH, PADS["layer"][0], pf.Coulomb(0.5))
    with refused("log must be a Log or a list of them"):
        identify_pad(3, PATCH, PADS["layer"][0], LAW)
    with refused("patch must be a ContactPatch"):
        identify_pad(log, 3, PADS["layer"][0], LAW)
    with refused("sigma_1 must be 0"):
        identify_pad(log, PATCH, PADS["half-space"][0], pf.LuGre())
    one = identify_pad(log, PATCH, PADS["layer"][0], LAW)
    assert isinstance(one, PadFit)
    with refused("name must be one of"):
        one.identifiable("stiffness")
