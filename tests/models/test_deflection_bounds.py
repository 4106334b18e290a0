"""Largest deflections of the bristles after steps of any length (docs/physics.md, "Step at constant twist")."""

import numpy as np
import pytest

import planarfriction as pf
from planarfriction.geometry import twist_at, wrench_at
from tests.support.contacts import ELASTIC, PLAIN

LAWS = {"plain": PLAIN, "elasto-plastic": ELASTIC}
PATCHES = {
    "disc": pf.ContactPatch.disc(0.01, 9),
    "four cells": pf.ContactPatch.disc(0.01, 2),
}
CONTACTS = 500

ROUNDING = 1e-12
"""Relative error of forty steps, each of which rounds to 1e-15."""

SAMPLED = 1e-2
"""By how much the longest of 20,000 wrenches falls short of the longest of all: they lie 0.03 rad apart."""


def walked(model, patch):
    """The states on the way of many contacts, whose twists, slow and fast, jump or stay."""
    draw = np.random.default_rng(7)
    radius = float(patch.contact_radius())
    state = np.zeros((CONTACTS, *model.state_shape))
    twist = np.zeros((CONTACTS, 3))
    for number in range(40):
        fresh = (
            draw.normal(size=(CONTACTS, 3))
            * [1.0, 1.0, 1.0 / radius]
            * 10 ** draw.uniform(-5, -1, (CONTACTS, 1))
        )
        fresh[:, 2] *= 10 ** draw.uniform(-1, 1, CONTACTS)
        twist = np.where(draw.random((CONTACTS, 1)) < 0.5, fresh, twist)
        dt = 10.0 if number % 5 == 4 else 10 ** draw.uniform(-6, 0, CONTACTS)
        state = model.step(state, twist, 1.0, dt)[0]
        yield state


def longest(model, patch, scale, components):
    """The longest state on the way, in full deflections."""
    lengths = (
        np.linalg.norm(state / scale, axis=components).max()
        for state in walked(model, patch)
    )
    return max(lengths) * model.law.sigma_0 / model.law.mu_s


def longest_wrench(surface, patch):
    """The longest `h(V)` of a limit surface, of wrenches about the centre of pressure with torques over r."""
    draw = np.random.default_rng(8)
    radius = float(patch.contact_radius())
    centre = patch.centre_of_pressure()
    twists = draw.normal(size=(20_000, 3)) / [1.0, 1.0, radius]
    wrenches = wrench_at(surface.wrench(twist_at(twists, -centre)), centre) / [
        1.0,
        1.0,
        radius,
    ]
    return float(np.linalg.norm(wrenches, axis=-1).max())


@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
@pytest.mark.parametrize("patch", PATCHES.values(), ids=PATCHES)
def test_no_cell_passes_its_largest_deflection(patch, law):
    assert (
        0.9 < longest(pf.DistributedModel(patch, law), patch, 1.0, -2) <= 1.0 + ROUNDING
    )


@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
@pytest.mark.parametrize("patch", PATCHES.values(), ids=PATCHES)
@pytest.mark.parametrize(
    "kind",
    [pf.LimitSurfaceEllipsoid, pf.LimitSurfaceCells, pf.LimitSurfaceTablePublished],
    ids=lambda kind: kind.__name__,
)
def test_published_bristles_pass_it_as_far_as_their_limit_surface(kind, patch, law):
    surface = kind(patch)
    largest = (
        1.0
        if kind is pf.LimitSurfaceEllipsoid
        else (1.0 + SAMPLED) * longest_wrench(surface, patch)
    )
    scale = np.array([1.0, 1.0, patch.contact_radius()])
    reached = longest(pf.ReducedModelPublished(patch, law, surface), patch, scale, -1)
    assert 0.9 < reached <= largest * (1.0 + ROUNDING)
    if kind is pf.LimitSurfaceCells:
        assert reached < 2.0**0.5
    if kind is pf.LimitSurfaceTablePublished and patch is PATCHES["four cells"]:
        assert 1.5 < reached < 1.7
