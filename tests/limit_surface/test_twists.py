"""Twists of wrenches: the certificate, what rests, what many twists share, and what cannot be found."""

from dataclasses import dataclass

import numpy as np
import pytest

import planarfriction as pf
from planarfriction._engine.compiler import jit
from planarfriction.errors import SolverError
from planarfriction.limit_surface import LimitSurface
from planarfriction.limit_surface.loops.cell_twists import cell_twists
from planarfriction.limit_surface.loops.twists import table_at
from planarfriction.patch import PUBLISHED_PATCHES
from tests.support.refusals import refused

ELL = [
    (0.0, 0.0),
    (0.03, 0.0),
    (0.03, 0.005),
    (0.005, 0.005),
    (0.005, 0.02),
    (0.0, 0.02),
]
FEET = pf.ContactPatch.points([(0.0, 0.0), (0.03, 0.01), (0.01, 0.02)], [1.0, 2.0, 1.5])
TEE = PUBLISHED_PATCHES["NonConvex2"](cells=9)
GRAIN, LEAN = pf.friction_metric(0.3, along=1.0, across=0.5), (0.2, -0.3)
PATCHES = {
    "disc": pf.ContactPatch.disc(0.01, 9),
    "ring": pf.ContactPatch.ring(0.004, 0.01, 9),
    "thin ring": pf.ContactPatch.ring(0.0095, 0.01, 41),
    "soft finger": pf.ContactPatch.disc(
        0.01, 9, pressure=pf.SoftFinger(c=0.008, k=2.0)
    ),
    "L": pf.ContactPatch.polygon(ELL, 9),
    "map": pf.ContactPatch.rectangle(
        0.02, cells=9, pressure=pf.LinearGradient((40.0, 10.0))
    ),
    "line": PUBLISHED_PATCHES["Line"](cells=9),
    "T": TEE,
    "feet": FEET,
    "grain": TEE.with_friction_metric(GRAIN, LEAN),
    "feet with a grain": FEET.with_friction_metric(GRAIN, LEAN),
    "a grain in each cell": TEE.with_friction_metric(
        np.where(
            TEE.positions[:, :1, None] > 0.0,
            GRAIN,
            pf.friction_metric(-0.5, along=0.7, across=1.2),
        ),
        np.where(TEE.positions[:, 1:] > 0.0, [0.4, 0.0], [0.0, -0.2]),
    ),
}
KINDS = {
    "cells": pf.LimitSurfaceCells,
    "exact": pf.LimitSurfaceExact,
    "table": pf.LimitSurfaceTable,
    "published table": pf.LimitSurfaceTablePublished,
    "ellipsoid": pf.LimitSurfaceEllipsoid,
}


def left_out(kind, patch):
    """Return True if a surface does not take a patch, or is a table of cells with metrics, which is not convex."""
    each = patch == "a grain in each cell"
    grained = patch in ("grain", "feet with a grain") or each
    return (kind == "published table" and grained) or (
        kind in ("exact", "ellipsoid") and each
    )


CASES = [
    pytest.param(kind, name, id=f"{kind}, {name}")
    for kind in KINDS
    for name in PATCHES
    if not left_out(kind, name)
]


def scaled_frame(surface):
    """Return the matrix that scales twists, `W_S = F'^-1 W`."""
    return surface._frame()


def wrenches(surface, count):
    """Wrenches in directions spread over the scaled sphere, some with a vanishing part."""
    directions = np.random.default_rng(2).normal(size=(count, 3))
    directions[: count // 4] *= [1.0, 1.0, 1e-3]
    directions[count // 4 : count // 2] *= [1e-3, 1e-3, 1.0]
    return np.concatenate([directions, np.eye(3), -np.eye(3)]) @ scaled_frame(surface)


def angles(surface, wrench, other):
    """Angles [rad] between wrenches in scaled coordinates."""
    first, second = (
        np.linalg.solve(scaled_frame(surface).T, each.T).T for each in (wrench, other)
    )
    return np.arctan2(
        np.linalg.norm(np.cross(first, second), axis=1),
        np.einsum("ni,ni->n", first, second),
    )


@pytest.mark.parametrize(("kind", "name"), CASES)
def test_the_wrench_of_the_twist_is_parallel(kind, name):
    """And the twist is of unit dissipation. Sums over cells have facets, which the next test sees."""
    surface = KINDS[kind](PATCHES[name])
    asked = wrenches(surface, 60)
    found = surface.twist(asked)
    assert surface.dissipation(found) == pytest.approx(1.0, rel=1e-12)  # rounding
    if kind != "cells" and "feet" not in name:
        # beside what many twists share, and in the table's axis, lines allow less (`CERTIFIED`)
        assert angles(surface, surface.wrench(found), asked).max() < (
            1e-5 if name == "line" else 1e-10
        )


@pytest.mark.parametrize(
    ("kind", "name"),
    [case for case in CASES if case.values[0] not in ("table", "published table")],
)
def test_no_other_twist_resists_the_wrench_with_less_dissipation(kind, name):
    """The twist found gives the wrench more power than any other of unit dissipation, also at facets and kinks."""
    surface = KINDS[kind](PATCHES[name])
    asked = wrenches(surface, 20)
    found = surface.twist(asked)
    random = np.random.default_rng(5)
    near = found[:, None] + 10.0 ** random.uniform(
        -7, 0, size=(1, 150, 1)
    ) * random.normal(size=(1, 150, 3)) * (
        np.linalg.norm(found, axis=-1)[:, None, None] * [1.0, 1.0, 1.0]
    )
    others = np.concatenate(
        [
            near.reshape(-1, 3),
            np.linalg.solve(scaled_frame(surface), random.normal(size=(3, 500))).T,
        ]
    )
    others /= surface.dissipation(others)[:, None]
    power = -np.einsum("mi,mi->m", asked, found)
    assert (
        (-asked @ others.T).max(axis=1) <= power * (1 + 1e-9)
    ).all()  # of the rounding off of kinks


@jit
def _table_at(table, v):
    return table_at(table, (0.1, 0.0, 0.0), (v[0], v[1], v[2]), np.empty(9))


def test_newton_steps_take_the_slopes_of_the_wrench():
    """Slopes that are wrong lead to the same twist, in many more steps."""
    table = pf.LimitSurfaceTable(PATCHES["map"])._table
    v = np.array([0.7, -1.1, 0.4])
    _, (xx, xy, xs, yy, ys, ss) = _table_at(table, v)
    wanted = [
        np.subtract(_table_at(table, v + d)[0], _table_at(table, v - d)[0]) / 2e-6
        for d in 1e-6 * np.eye(3)
    ]
    found = np.array([[xx, xy, xs], [xy, yy, ys], [xs, ys, ss]])
    assert found == pytest.approx(np.array(wanted), abs=1e-7)


def test_a_cell_that_rests_bears_no_more_than_its_friction():
    """Inside a facet the answer is the turn about the foot; just outside the foot slides."""
    surface = pf.LimitSurfaceCells(FEET)
    foot = 1
    place = FEET.positions[foot]
    weight = FEET.weights()[foot]
    about = np.array([place[1], -place[0], 1.0])
    turning = surface.wrench(about)
    for share, turns in ((0.9999, True), (1.0001, False)):
        held = share * weight * np.array([0.6, -0.8])
        wrench = turning + np.array([*held, place[0] * held[1] - place[1] * held[0]])
        vx, vy, omega = surface.twist(wrench)
        speed = np.hypot(vx - omega * place[1], vy + omega * place[0]) / abs(omega)
        assert (
            speed < 1e-8 * 0.03
        ) == turns  # the rounding off of kinks, against 1e-4 of friction more


def test_many_twists_share_the_wrench_of_a_line_that_slides_across_itself():
    line = pf.ContactPatch.line(0.02, 21)
    across = (
        np.array([0.0, 1.0, 0.0])
        if np.ptp(line.positions[:, 0]) > 0.0
        else np.array([1.0, 0.0, 0.0])
    )
    for kind in (pf.LimitSurfaceExact, pf.LimitSurfaceTable, pf.LimitSurfaceCells):
        surface = kind(line)
        found = surface.twist(-across)
        # CERTIFIED.
        assert surface.wrench(found) * [1.0, 1.0, 100.0] == pytest.approx(
            -across, abs=1e-5
        )


@pytest.mark.parametrize("kind", KINDS)
def test_wrenches_of_any_magnitude_and_read_only_ones_are_taken(kind):
    surface = KINDS[kind](PATCHES["L"])
    wrench = np.array([0.3, -0.2, 0.001])
    wrench.setflags(write=False)
    found = surface.twist(wrench)
    for magnitude in (1e-290, 1e290):
        assert surface.twist(magnitude * wrench) == pytest.approx(found, rel=1e-12)
    assert wrench.tolist() == [0.3, -0.2, 0.001]


@dataclass(frozen=True, eq=False)
class Turned(LimitSurface):
    """No limit surface: what it says is not the slope of any dissipation."""

    def direction(self, units):
        return np.stack([-units[:, 1], units[:, 0], units[:, 2]], axis=1)


def test_a_twist_that_is_not_found_is_an_error():
    with refused(
        r"no twist found: the wrench of the nearest one is .* rad off", SolverError
    ):
        Turned(PATCHES["disc"]).twist((1.0, 0.2, 0.001))


def test_what_is_no_number_is_no_certificate():
    surface = pf.LimitSurfaceCells(pf.ContactPatch.disc(0.01, cells=5))
    levers, spins, weights = surface._cell_rows
    wrenches = np.array([[0.3, 0.1, 1e-3]])
    found = np.empty((1, 3))
    assert (
        cell_twists(levers, spins, weights, surface._scaling, wrenches, found) < 1e-12
    )
    assert np.isnan(
        cell_twists(
            levers,
            spins,
            np.full_like(weights, np.nan),
            surface._scaling,
            wrenches,
            found,
        )
    )


def test_a_bad_wrench_among_good_ones_is_named():
    for surface in (KINDS[kind](FEET) for kind in KINDS):
        with refused("wrench must not be zero"):
            surface.twist([(1.0, 0.0, 0.0), (0.0, 0.0, 0.0)])
        with refused("wrench must be finite"):
            surface.twist([(1.0, 0.0, 0.0), (0.0, np.inf, 0.0)])


@pytest.mark.parametrize("inner", [0.0, 0.003, 0.009])
def test_even_discs_have_the_closed_form_of_their_rings(inner):
    """Against the quadrature over rings: slow and fast spins, and the centre of rotation on and beside the rim."""
    patch = (
        pf.ContactPatch.ring(inner, 0.01, 41)
        if inner
        else pf.ContactPatch.disc(0.01, 41)
    )
    surface = pf.LimitSurfaceExact(patch)
    by_rings = pf.LimitSurfaceExact(patch)
    parts = surface._parts
    object.__setattr__(
        by_rings, "__dict__", {**by_rings.__dict__, "_parts": rings_of(by_rings)}
    )
    assert type(parts) is not type(by_rings._parts)
    random = np.random.default_rng(1)
    scaled = random.normal(size=(2000, 3)) * 10.0 ** random.uniform(
        -6.0, 3.0, size=(2000, 3)
    )
    rim = 0.01 / surface.contact_radius
    scaled[:20] = [
        [1.0, 0.0, (1.0 + sign * 10.0**-k) / rim]
        for k in range(1, 11)
        for sign in (1.0, -1.0)
    ]
    scaled[20:22] = [[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]
    units = scaled / np.linalg.norm(scaled, axis=1, keepdims=True)
    h, slope = surface.sums(units)
    wanted, wanted_slope = by_rings.sums(units)
    assert h == pytest.approx(wanted, abs=1e-13)  # the thinner ring loses a digit
    # of slopes that grow with the logarithm or the reciprocal of a distance, relative to themselves
    scale = np.abs(wanted_slope).max(axis=(1, 2), keepdims=True)
    assert np.abs((slope - wanted_slope) / scale).max() < 1e-11
    spins = np.abs(units[:, 2]) > 0.0
    assert h[spins, 2] == pytest.approx(wanted[spins, 2], rel=1e-12)


def rings_of(surface):
    """The same disc as a pressure over rings."""
    from planarfriction.limit_surface import exact

    outline = surface._outline
    rule = exact._double_exponential()
    return exact.kernels.Rings(
        *rule, outline.inner, outline.outer, outline.outer, exact._EVEN
    )


def test_a_fingertip_smaller_than_its_hole_loads_the_cells_beside_it():
    ring = pf.ContactPatch.ring(0.004, 0.01, 21, pressure=pf.SoftFinger(c=0.002, k=2.0))
    surface = pf.LimitSurfaceExact(ring)
    cells = pf.LimitSurfaceCells(ring)
    # Of a cell of 1 mm, at 4 mm.
    assert surface.contact_radius == pytest.approx(cells.contact_radius, rel=0.01)
    wrench = np.array([1.0, 0.2, 0.001])
    assert (
        angles(surface, surface.wrench(surface.twist(wrench))[None], wrench[None])
        < 1e-9
    )
