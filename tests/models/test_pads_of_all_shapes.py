"""Pads on half-spaces of several shapes and pressures, against a boundary element method (slow)."""

import math

import numpy as np
import pytest

import planarfriction as pf
from planarfriction import half_space
from tests.support.half_space_slip import SlippingHalfSpace

pytestmark = pytest.mark.slow

LAW = pf.LuGre(mu_c=1.0, sigma_1=0.0, sigma_2=0.0, elasto_plastic=0.9)
SIDE = 0.02
MODULUS, RATIO = 1e6, 0.42


def _dome(x, y):
    return math.sqrt(max(1.0 - 4.0 * (x * x + y * y) / SIDE**2, 0.0))


def _disc(pressure):
    return pf.ContactPatch.disc(0.5 * SIDE, 26, pressure=pressure)


def _square(pressure):
    return pf.ContactPatch.rectangle(SIDE, cells=24, pressure=pressure)


def _parabolic(x, y):
    return (1.0 - 4.0 * x * x / SIDE**2) * (1.0 - 4.0 * y * y / SIDE**2)


def _ellipse():
    angles = np.linspace(0.0, 2.0 * np.pi, 181)[:-1]
    corners = 0.5 * SIDE * np.stack([np.cos(angles), 0.5 * np.sin(angles)], -1)
    return pf.ContactPatch.polygon(
        corners, cells=36, pressure=lambda x, y: _dome(x, 2.0 * y)
    )


CASES = {
    "circle, Hertz": (lambda: _disc(_dome), 0.006, 0.025),
    "circle, uniform": (lambda: _disc(None), 0.010, 0.026),
    "square, uniform": (lambda: _square(None), 0.008, 0.032),
    "square, parabolic": (lambda: _square(_parabolic), 0.003, 0.016),
    "ellipse, Hertz": (_ellipse, 0.011, 0.056),
}
"""Patches, with the errors of force (of mu f_N) and torque (of its limit) of a prototype of the same method."""
PATHS = [
    (0.35, 0, 0), (0.65, 0, 0), (0.5, 0.5, 0), (0, 0, 0.5), (0, 0, 1.0), (0.6, 0, 0.3), (0, 0.4, 0.4), (-0.3, 0.6, 0.6)
]  # fmt: skip
"""Straight paths in about those lengths at which all slips; none is one that discs are fitted to."""


def errors(patch, model):
    """Return the largest errors of force and torque over paths."""
    sizes = patch.cell_extents()
    truth = SlippingHalfSpace(patch.positions, np.median(sizes, axis=0), MODULUS, RATIO)
    load = patch.weights()
    stuck = half_space.stuck(
        patch.positions, patch.areas, sizes, MODULUS, RATIO
    ).stiffness.diagonal()
    arm = float(load @ np.hypot(*patch.positions.T))
    unit = np.array([1.0, 1.0, arm])
    worst = np.zeros(3)
    for path in np.array(PATHS) * 1.5 * unit / stuck:
        state = model.rest()
        for _ in range(60):
            state, pull = model.step(state, path, 1.0, 1.0 / 60)
        wanted = truth.wrench(truth.tractions(path, load))
        worst = np.maximum(worst, np.abs(-pull - wanted) / unit)
    return worst[:2].max(), worst[2]


@pytest.mark.parametrize("name", CASES)
def test_wrenches_are_those_of_the_half_space(name):
    make, force, torque = CASES[name]
    patch = make()
    pad = pf.Pad.half_space(MODULUS, RATIO)
    found = errors(patch, pf.ReducedModel(patch, LAW, pad=pad))
    print(name, np.round(found, 4))
    assert found[0] < 1.2 * max(force, 0.01) and found[1] < 1.2 * torque


LEGS = (0.5, 0.0, 0.0), (0.0, 0.0, 0.8), (-0.3, 0.6, 0.0), (0.0, -0.4, -0.6)
"""Parts of a path: shift, turn, shift across, back with a turn; 12 increments each."""
TILT = 0.8
"""Change of the pressure over half the width, over its mean, to which it tilts at rest while the load falls."""
FALL = 0.4
PARTS = 8
"""Increments of that, of the shift that follows it, and steps of an increment."""


def history(patch, model):
    """Return the largest errors of force and torque along a path with a load that changes at rest."""
    sizes = patch.cell_extents()
    truth = SlippingHalfSpace(patch.positions, np.median(sizes, axis=0), MODULUS, RATIO)
    weights = patch.weights()
    stuck = half_space.stuck(
        patch.positions, patch.areas, sizes, MODULUS, RATIO
    ).stiffness.diagonal()
    arm = float(weights @ np.hypot(*patch.positions.T))
    unit = np.array([1.0, 1.0, arm])
    full = 1.5 * unit / stuck
    moves = np.concatenate(
        [np.repeat([np.array(leg) * full / 12], 12, axis=0) for leg in LEGS]
        + [np.zeros((PARTS, 3)), np.tile([0.5 * full[0] / PARTS, 0.0, 0.0], (PARTS, 1))]
    )
    changed = np.concatenate(
        [np.zeros(48), np.arange(1, PARTS + 1) / PARTS, np.ones(PARTS)]
    )
    y = patch.positions[:, 1] / (0.5 * SIDE)
    state = model.rest()
    tractions = np.zeros((patch.cells, 2))
    worst = np.zeros(3)
    before = 0.0
    for move, now in zip(moves, changed, strict=True):
        load = weights * (1.0 + TILT * now * y)
        load *= (1.0 - FALL * now) / load.sum()
        held = truth.soft @ tractions.T.ravel()
        tractions = truth.tractions(move, load, tractions, held)
        for share in np.arange(1, PARTS + 1) / PARTS:
            at = before + share * (now - before)
            force = 1.0 - FALL * at
            centre = TILT * at * (weights @ (y * patch.positions[:, 1]))
            moments = (force * centre, 0.0)
            state, pull = model.step(state, move, force, 1.0 / PARTS, moments=moments)
        worst = np.maximum(worst, np.abs(-pull - truth.wrench(tractions)) / unit)
        before = now
    return worst[:2].max(), worst[2]


@pytest.mark.parametrize("name", ["circle, Hertz", "square, uniform"])
@pytest.mark.parametrize("kind", [pf.DistributedModel, pf.ReducedModel])
def test_wrenches_along_a_history_are_those_of_the_half_space(kind, name):
    """Errors of a prototype, times 1.2: 0.018 and 0.036 with discs that were fitted to the half-space itself."""
    patch = CASES[name][0]()
    found = history(patch, kind(patch, LAW, pad=pf.Pad.half_space(MODULUS, RATIO)))
    print(kind.__name__, name, np.round(found, 4))
    assert found[0] < 0.022 and found[1] < 0.042
