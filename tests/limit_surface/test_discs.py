"""Limit surfaces of cells that are small discs: closed forms, gradients, twists, and the patches they stand for."""

import dataclasses

import numpy as np
import pytest

import planarfriction as pf
from tests.support.limit_surfaces import gradient_error, jacobian_error, scaled_jacobian
from tests.support.refusals import refused

R = 0.01
ONE = pf.ContactPatch([[0.3, -0.2]], [1e-4], radii=[R])
FEW = pf.ContactPatch.disc(R).discs(23)
GRAIN = FEW.with_friction_metric(pf.friction_metric(0.3, 1.5, 0.7), (0.1, -0.2))
GRAINS = FEW.with_friction_metric(
    np.array(
        [pf.friction_metric(0.3 * k, 1.0 + 0.02 * k, 0.8) for k in range(FEW.cells)]
    )
)
MIXED = dataclasses.replace(
    FEW, radii=np.where(np.arange(FEW.cells) % 2, FEW.radii, 0.0)
)
FOUR = pf.ContactPatch(
    R * np.array([[1, 1], [1, -1], [-1, 1], [-1, -1]]), np.full(4, 1e-4), radii=[R] * 4
).with_friction_metric(
    np.array([pf.friction_metric(0.0, *each) for each in ((1.5, 0.7), (0.7, 1.5))] * 2)
)
"""Alike about both axes on the whole, and not above and below one: a force along it, without any torque, turns them."""
PATCHES = {
    "one": ONE,
    "few": FEW,
    "grain": GRAIN,
    "grains": GRAINS,
    "mixed": MIXED,
    "four": FOUR,
}
SCALE = np.array([1.0, 1.0, 1.0 / R])
"""Scales of twists; wrenches over it are of the order of 1."""


def some_twists(patch, count=100):
    """Twists about the centre of pressure in all proportions of slide and spin."""
    directions = np.random.default_rng(5).normal(size=(count, 3))
    x, y = patch.centre_of_pressure()
    vx, vy, omega = (directions / np.linalg.norm(directions, axis=1)[:, None] * SCALE).T
    return np.stack([vx + omega * y, vy - omega * x, omega], -1)


def surfaces(patch):
    kinds = (
        [pf.LimitSurfaceCells]
        if patch.root is not None and patch.root.ndim == 3
        else SUMS
    )
    return [kind(patch) for kind in kinds]


SUMS = [pf.LimitSurfaceCells, pf.LimitSurfaceExact]


# ---------------------------------------------------------------------- one disc


def test_friction_of_one_disc_is_within_a_hundredth_of_the_closed_form():
    q = np.concatenate([[0.0], np.geomspace(1e-4, 1e4, 4001)])
    about = np.stack(
        [q * R + ONE.positions[0, 1], -ONE.positions[0, 0] + 0.0 * q, np.ones_like(q)],
        -1,
    )
    one, exact = (kind(ONE).wrench(about) for kind in SUMS)
    torque, other = (
        each @ np.array([ONE.positions[0, 1], -ONE.positions[0, 0], 1.0])
        for each in (one, exact)
    )
    # As published for the fit of the mean speed.
    assert np.abs((one - exact)[:, :2]).max() < 0.0085
    assert np.abs(torque - other).max() < 0.0085 * R
    assert exact[0] @ [0.0, 0.0, 1.0] == pytest.approx(-2.0 / 3.0 * R, rel=1e-12)


def test_one_disc_has_a_surface_with_two_thirds_of_its_radius():
    for kind in SUMS:
        assert kind(ONE).contact_radius == pytest.approx(2.0 / 3.0 * R, rel=1e-14)
    with refused("contact radius > 0"):
        pf.LimitSurfaceCells(dataclasses.replace(ONE, radii=None))


def test_closed_forms_of_discs_add_up():
    """Two discs far apart, turned about the middle of one: its friction there, and that of a slide at the other."""
    d = 0.5
    a = 0.01
    pair = pf.LimitSurfaceExact(
        pf.ContactPatch([[0.0, 0.0], [d, 0.0]], [1e-4, 1e-4], radii=[a, a])
    )
    far = pf.LimitSurfaceExact(pf.ContactPatch([[d, 0.0]], [1e-4], radii=[a]))
    wrench = pair.wrench((0.0, 0.0, 1.0))
    wanted = 0.5 * far.wrench((0.0, 0.0, 1.0)) - [0.0, 0.0, 0.5 * 2 / 3 * a]
    assert wrench == pytest.approx(wanted, rel=1e-12, abs=1e-15)


def test_the_disc_of_an_outline_is_one_disc():
    by_outline, by_cell = (
        pf.LimitSurfaceExact(each)
        for each in (pf.ContactPatch.disc(R), pf.ContactPatch([[0, 0]], [1], radii=[R]))
    )
    twists = some_twists(pf.ContactPatch.disc(R))
    assert by_cell.wrench(twists) * SCALE == pytest.approx(
        by_outline.wrench(twists) * SCALE, abs=1e-13
    )


# ---------------------------------------------------------------------- gradients


@pytest.mark.parametrize("name", PATCHES)
def test_wrenches_are_gradients_and_jacobians_their_slopes(name):
    for surface in surfaces(PATCHES[name]):
        twists = some_twists(PATCHES[name], 20)
        jacobian = scaled_jacobian(surface, twists)
        assert gradient_error(surface, twists) < 1e-8
        assert jacobian_error(surface, twists) < 2e-8 * np.abs(jacobian).max()
        assert jacobian == pytest.approx(np.swapaxes(jacobian, 1, 2), abs=1e-12)
        along = np.einsum("mij,mj->mi", surface.jacobian(twists), twists)
        assert along == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("name", PATCHES)
def test_twist_of_a_wrench(name):
    wrenches = np.random.default_rng(6).normal(size=(100, 3))
    wrenches[:6] = np.concatenate([np.eye(3), -np.eye(3)])
    wrenches *= [1.0, 1.0, R]
    patch = PATCHES[name]
    x, y = patch.centre_of_pressure()
    wrenches[:, 2] += x * wrenches[:, 1] - y * wrenches[:, 0]
    for surface in surfaces(patch)[: 1 if name == "mixed" else 2]:
        twists = surface.twist(wrenches)
        assert surface.dissipation(twists) == pytest.approx(1.0, rel=1e-9)
        if name != "mixed":  # a point at rest bears more than sums show
            pulls = surface.wrench(twists)
            about = pulls * SCALE, wrenches * SCALE
            lengths = [np.linalg.norm(each, axis=1)[:, None] for each in about]
            assert about[0] / lengths[0] == pytest.approx(
                about[1] / lengths[1], abs=1e-9
            )


def test_radii_of_zero_are_the_sum_over_points():
    points = dataclasses.replace(FEW, radii=None)
    almost = pf.LimitSurfaceCells(
        dataclasses.replace(FEW, radii=np.full(FEW.cells, 1e-12))
    )
    twists = some_twists(FEW)
    assert almost.wrench(twists) * SCALE == pytest.approx(
        pf.LimitSurfaceCells(points).wrench(twists) * SCALE, abs=1e-9
    )


def test_dissipation_is_convex():
    for name, patch in PATCHES.items():
        for surface in surfaces(patch):
            jacobian = scaled_jacobian(surface, some_twists(patch))
            # The fit of a disc leaves -1e-4.
            assert (np.linalg.eigvalsh(-jacobian) > -1e-3).all(), name


# ---------------------------------------------------------------------- what discs stand for


def test_cells_as_discs_are_closer_to_the_outline_than_points():
    exact = pf.LimitSurfaceExact(pf.ContactPatch.disc(R))
    points = pf.ContactPatch.disc(R)
    off = [
        pf.LimitSurfaceCells(each).compare(exact).force.largest
        for each in (FEW, points, points.discs())
    ]
    assert off[0] < 0.005 and off[2] < 0.5 * off[1]


def test_one_metric_is_a_change_of_coordinates():
    """A patch with the metric M is one without, of which positions, radii and twists are seen through its root."""
    metric = pf.friction_metric(0.7, 1.6, 0.9)
    turned = FEW.with_friction_metric(metric)
    x, y = turned.lever_coordinates(*FEW.positions.T)
    plain = pf.ContactPatch(
        np.stack([x, y], -1),
        FEW.areas,
        FEW.weights() / FEW.areas,
        radii=turned.lever_radii,
    )
    twists = some_twists(FEW)
    seen = np.concatenate([twists[:, :2] @ turned.root.T, twists[:, 2:]], axis=1)
    for kind in SUMS:
        assert kind(turned).dissipation(twists) == pytest.approx(
            kind(plain).dissipation(seen), rel=1e-12
        )


def test_the_published_table_and_model_take_discs():
    for patch in (ONE, FEW):
        table = pf.LimitSurfaceTablePublished(patch)
        cells = pf.LimitSurfaceCells(patch)
        assert table.contact_radius == cells.contact_radius
        assert table.compare(cells).force.largest < 0.01  # bilinear in 4.5 degrees
        model = pf.ReducedModelPublished(
            patch, pf.LuGre(mu_c=0.5, mu_s=0.5, sigma_2=0.0)
        )
        x, y = cells.centre_of_pressure
        spin = np.array([y, -x, 1.0])
        wrench = model.step(model.rest(), 3.0 * spin, 2.0, 10.0)[1]
        assert spin @ wrench == pytest.approx(
            -0.5 * 2.0 * cells.contact_radius, rel=1e-6
        )


def test_tables_and_models_take_surfaces_of_discs():
    law = pf.LuGre()
    cells = pf.LimitSurfaceCells(FEW)
    table = pf.LimitSurfaceTable(FEW)
    assert table.compare(cells).force.largest < 1e-3
    model = pf.ReducedModelPublished(FEW, law, surface=cells)
    twist = np.array([0.01, 0.0, 1.0])
    force = model.step(model.rest(), twist, 1.0, 10.0)[1][:2]
    assert force == pytest.approx(cells.wrench(twist)[:2] * law.mu_c, rel=0.02)
