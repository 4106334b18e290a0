"""`LimitSurface.compare`: differences that are known, in force and in velocity."""

import numpy as np
import pytest

import planarfriction as pf
from planarfriction.limit_surface.comparison import directions
from tests.support.contacts import FEET

PATCH = pf.ContactPatch.rectangle(0.1, cells=9)


def test_two_spheres_of_different_radius():
    """Ellipsoids about one centre, the other's torques larger by a factor c: every number in closed form."""
    ratio = 1.5
    reference = pf.LimitSurfaceEllipsoid(PATCH)
    surface = pf.LimitSurfaceEllipsoid(pf.ContactPatch.rectangle(0.1 * ratio, cells=9))
    found = surface.compare(reference, samples=4000)
    u = directions(4000)
    h = (
        u
        * [1.0, 1.0, ratio]
        / np.linalg.norm(u * [1.0, 1.0, ratio], axis=1)[:, None]
        * [1.0, 1.0, ratio]
        - u
    )
    normal = u / [1.0, 1.0, ratio**2]  # of fx^2 + fy^2 + (tau/(c r))^2
    cosine = np.einsum("mi,mi->m", normal, u) / np.linalg.norm(normal, axis=1)
    further = 1.0 / np.linalg.norm(u / [1.0, 1.0, ratio], axis=1) - 1.0
    expected = {
        "force": np.hypot(h[:, 0], h[:, 1]),
        "torque": np.abs(h[:, 2]),
        "angle": np.degrees(np.arccos(cosine)),
        "radius": further,
    }
    for name, values in expected.items():
        spread = getattr(found, name)
        assert spread.largest == pytest.approx(values.max(), rel=1e-9), name
        assert spread.mean == pytest.approx(values.mean(), rel=1e-9), name
        assert spread.rms == pytest.approx(np.sqrt(np.mean(values**2)), rel=1e-9), name
    # At tan = c.
    assert found.angle.largest == pytest.approx(
        np.degrees(np.arctan2(ratio - 1 / ratio, 2.0)), abs=0.01
    )


@pytest.mark.parametrize("patch", [PATCH, FEET], ids=["square", "feet"])
def test_a_surface_is_itself(patch):
    surface = pf.LimitSurfaceCells(patch)
    found = surface.compare(surface)
    assert (
        found.force.largest
        == found.torque.largest
        == found.radius.largest
        == found.angle.largest
        == 0.0
    )
    table = pf.LimitSurfaceTable(patch).compare(surface)
    assert 0.0 < table.force.rms < 0.1 and 0.0 < table.angle.rms < 10.0


def test_does_not_depend_on_the_origin():
    """The same two surfaces, both moved by the same way."""
    moved = pf.ContactPatch.points(
        FEET.positions + np.array([0.3, -0.2]), FEET.weights()
    )
    here, there = (
        pf.LimitSurfaceEllipsoid(p).compare(pf.LimitSurfaceCells(p))
        for p in (FEET, moved)
    )
    assert there.force.rms == pytest.approx(here.force.rms, rel=1e-9)
    assert there.radius.largest == pytest.approx(here.radius.largest, rel=1e-9)
    # Kinks are rounded off by 1e-10.
    assert there.angle.mean == pytest.approx(here.angle.mean, rel=1e-6)


def test_directions_are_even():
    """Means of x and x^2 over the sphere: 0 and 1/3; no two points closer than a fraction of their share."""
    u = directions(200)
    assert np.linalg.norm(u, axis=1) == pytest.approx(np.ones(200), rel=1e-14)
    assert u.mean(axis=0) == pytest.approx(np.zeros(3), abs=3e-3)
    assert u.T @ u / 200 == pytest.approx(np.eye(3) / 3, abs=3e-3)
    nearest = np.sort(np.linalg.norm(u[:, None] - u, axis=-1), axis=1)[:, 1]
    assert nearest.min() > 0.5 * np.sqrt(4.0 * np.pi / 200)


def test_prints_a_table():
    text = str(pf.LimitSurfaceEllipsoid(PATCH).compare(pf.LimitSurfaceCells(PATCH)))
    lines = text.splitlines()
    assert len(lines) == 5
    assert [line.split()[0] for line in lines] == [
        "difference",
        "force",
        "torque",
        "radius",
        "angle",
    ]
