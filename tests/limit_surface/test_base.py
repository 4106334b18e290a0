"""A limit surface of one's own implements `direction` alone: the protocol and the models follow."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

import planarfriction as pf
from planarfriction._engine.published import surfaces as kernels
from planarfriction.limit_surface import LimitSurface
from tests.support.limit_surfaces import jacobian_error, scaled_jacobian

DISC = pf.ContactPatch.disc(0.01, 9)
RADIUS = float(DISC.contact_radius())
LEANING = pf.ContactPatch.line(0.02, 7, profile=np.arange(7, 0, -1))


@dataclass(frozen=True, eq=False)
class Round(LimitSurface):
    """The ellipsoid, by its direction."""

    anisotropy = "uniform"

    def direction(self, units):
        return units


@dataclass(frozen=True, eq=False)
class Superellipsoid(LimitSurface):
    """`|f|^p + |tau/r|^p = 1`."""

    exponent: float = 1.6

    def direction(self, units):
        q = self.exponent / (self.exponent - 1.0)
        speed = np.linalg.norm(units[:, :2], axis=1)
        spin = np.abs(units[:, 2])
        weights = np.stack([speed, speed, spin], axis=1) ** (q - 2.0)
        return units * weights / ((speed**q + spin**q) ** ((q - 1.0) / q))[:, None]


TWISTS = np.random.default_rng(3).normal(size=(40, 3)) * [0.01, 0.01, 1.0]


@pytest.mark.parametrize("patch", [DISC, LEANING], ids=["disc", "line"])
def test_the_direction_alone_makes_the_ellipsoid(patch):
    own = Round(patch)
    library = pf.LimitSurfaceEllipsoid(patch)
    twists = np.concatenate(
        [TWISTS, [[0.0, 0.0, 0.0], [0.01, 0.0, 0.0], [0.0, 0.0, 1.0]]]
    )
    wrenches = library.wrench(twists)
    # Rounding.
    assert own.wrench(twists) == pytest.approx(wrenches, rel=1e-13, abs=1e-16)
    assert own.dissipation(twists) == pytest.approx(
        library.dissipation(twists), rel=1e-13
    )
    assert own.twist(wrenches[:40]) == pytest.approx(
        library.twist(wrenches[:40]), rel=1e-9, abs=1e-12
    )
    slopes = library.jacobian(twists)
    # central differences over 1e-5 rad: 1e-10 of the third derivative, 1e-11 of rounding
    assert own.jacobian(twists) == pytest.approx(
        slopes, abs=1e-9 * np.abs(slopes).max()
    )


def test_what_an_asymmetry_adds_comes_from_the_base():
    leaning = DISC.with_friction_metric([[1.2, 0.1], [0.1, 0.9]], (0.1, -0.2))
    own = Round(leaning)
    library = pf.LimitSurfaceEllipsoid(leaning)
    twists = np.concatenate([TWISTS, [[0.0, 0.0, 0.0]]])
    assert own.wrench(twists) == pytest.approx(
        library.wrench(twists), rel=1e-13, abs=1e-16
    )
    slopes = library.jacobian(twists)
    assert own.jacobian(twists) == pytest.approx(
        slopes, abs=1e-9 * np.abs(slopes).max()
    )


@pytest.mark.parametrize("exponent", [1.4, 1.6, 2.0])
def test_a_superellipsoid_has_its_shape_its_normals_and_its_slopes(exponent):
    surface = Superellipsoid(DISC, exponent)
    wrench = surface.wrench(TWISTS)
    force = np.linalg.norm(wrench[:, :2], axis=1)
    torque = np.abs(wrench[:, 2]) / RADIUS
    # Rounding.
    assert force**exponent + torque**exponent == pytest.approx(1.0, rel=1e-13)
    found = surface.twist(wrench)
    assert found == pytest.approx(
        TWISTS / surface.dissipation(TWISTS)[:, None], rel=1e-7, abs=1e-9
    )
    slopes = scaled_jacobian(surface, TWISTS)
    # Of these differences.
    error = jacobian_error(surface, TWISTS, 1e-6)
    assert error < 1e-3 * np.abs(slopes).max()


def test_models_store_it_as_a_table_that_gets_finer():
    surface = Superellipsoid(DISC)
    errors = []
    scaled = np.ascontiguousarray(np.random.default_rng(0).normal(size=(500, 3)))
    scaled /= np.linalg.norm(scaled, axis=1)[:, None]
    for segments in (10, 20, 40):
        finer = type("Finer", (Superellipsoid,), {"segments": segments})(DISC)
        kind, size, data = finer.numbers
        u = np.empty_like(scaled)
        kernels.sliding_batch(kind, data, 0, size, scaled, u)
        errors.append(np.abs(u - surface.direction(scaled)).max())
    assert errors[2] < errors[1] < errors[0] and errors[1] < 5e-3
    assert surface.numbers.size == 20


def test_a_model_slides_with_it_and_its_step_agrees_with_its_rate():
    law = pf.LuGre(mu_c=0.5, sigma_0=1e5, sigma_1=0.0, sigma_2=0.0)
    surface = Superellipsoid(LEANING)
    model = pf.ReducedModelPublished(LEANING, law, surface=surface)
    twist = np.array([0.01, 0.004, 1.0])
    state, wrench = model.step(model.rest(), twist, 2.0, 10.0)
    # Of the table; mu f_N = 1.
    assert wrench == pytest.approx(surface.wrench(twist), rel=5e-3)
    assert model.wrench(state, twist, 2.0) == pytest.approx(wrench, rel=5e-3)


def test_a_surface_without_a_direction_says_what_is_missing():
    class Empty(LimitSurface):
        pass

    with pytest.raises(
        NotImplementedError, match=r"Empty has to implement direction\(units\)"
    ):
        Empty(DISC).wrench((1.0, 0.0, 0.0))


@pytest.mark.parametrize(
    "make", [pf.LimitSurfaceExact, pf.LimitSurfaceTable, pf.LimitSurfaceCells]
)
def test_the_library_s_own_say_their_direction_too(make):
    surface = make(DISC)
    units = TWISTS * [1.0, 1.0, RADIUS]
    units /= np.linalg.norm(units, axis=1)[:, None]
    at_centre = units / [1.0, 1.0, surface.contact_radius]
    wrench = surface.wrench(at_centre)
    assert -surface.direction(units) * [
        1.0,
        1.0,
        surface.contact_radius,
    ] == pytest.approx(wrench, abs=1e-14)
