"""Notebook views: the rows beside a picture are numbers of the record, and the picture is drawn from its data."""

import dataclasses

import numpy as np
import pytest

import planarfriction as pf
from planarfriction.plots import notebook
from tests.support import synthetic

SOFT = pf.ContactPatch.disc(0.02, 9, pressure=pf.SoftFinger(c=0.006, n=1 / 3, k=2.0))
MAP = pf.ContactPatch.from_pressure(
    np.array([[9.0, 0.0, 2.0], [1.0, 1.0, 1.0]]), (2e-3, 1e-3), name="map"
)


@pytest.fixture
def shown(monkeypatch):
    """Figure, title and rows of a record, as they would be put beside each other."""
    monkeypatch.setattr(
        notebook, "_beside", lambda figure, title, rows: (figure, title, rows)
    )
    return lambda record: record._repr_html_()


def test_a_patch_has_its_pressure_in_rows_and_columns(shown):
    figure, title, rows = shown(MAP)
    (image,) = figure.axes[0].images
    pixels = np.ma.filled(image.get_array(), np.nan)
    assert pixels / np.nansum(pixels) == pytest.approx(
        np.array([[9.0, np.nan, 2.0], [1.0, 1.0, 1.0]]) / 14.0, nan_ok=True
    )
    assert image.get_extent() == pytest.approx((0.0, 6e-3, 0.0, 2e-3))
    x, y = 1e3 * MAP.centre_of_pressure()
    assert (title, rows["cells"], rows["size"]) == (
        "ContactPatch 'map'",
        "5",
        "6 x 2 mm",
    )
    assert (
        rows["centre of pressure"]
        == f"({x:.2f}, {y:.2f}) mm"
        != f"({y:.2f}, {x:.2f}) mm"
    )
    assert rows["contact radius"] == f"{1e3 * MAP.contact_radius():.4g} mm"
    assert "shown at" not in rows


def test_points_have_sizes_and_shades_by_their_load(shown):
    figure, _, rows = shown(
        pf.ContactPatch.points([(0.0, 0.1), (-0.1, -0.05), (0.1, -0.05)], [1, 2, 4])
    )
    (points,) = figure.axes[0].collections
    assert np.asarray(points.get_offsets()) == pytest.approx(
        np.array([(0.0, 0.1), (-0.1, -0.05), (0.1, -0.05)])
    )
    assert points.get_sizes() == pytest.approx([15.0, 30.0, 60.0])
    assert np.asarray(points.get_array()) == pytest.approx(
        np.array([1.0, 2.0, 4.0]) / 7.0
    )
    assert rows["size"] == "200 x 150 mm"


def test_a_patch_that_follows_the_load_is_shown_at_a_newton(shown):
    figure, _, rows = shown(SOFT)
    assert rows["shown at"] == "1 N"
    assert rows["contact radius"] == f"{1e3 * SOFT.contact_radius(1.0):.4g} mm"
    weights = np.ma.compressed(
        np.ma.masked_invalid(figure.axes[0].images[0].get_array())
    )
    assert (weights > 0.0).sum() == (SOFT.weights(1.0) > 0.0).sum() < SOFT.cells


@pytest.mark.parametrize(
    "surface", [pf.LimitSurfaceExact(MAP), pf.LimitSurfaceExact(SOFT, normal_force=2.0)]
)
def test_the_section_of_a_surface_is_its_own(shown, surface):
    figure, title, rows = shown(surface)
    force, torque = figure.axes[0].lines[0].get_xydata().T
    turn = 0.7  # of 120 steps, the 13.37th: two neighbours hold it
    centre = surface.centre_of_pressure
    radius = surface.contact_radius
    twist = pf.geometry.twist_at(
        np.array([np.cos(turn), 0.0, np.sin(turn) / radius]), -centre
    )
    fx, _, tau = pf.geometry.wrench_at(surface.wrench(twist), centre)
    place = 120 * turn / (2.0 * np.pi)
    assert np.interp(place, np.arange(121), force) == pytest.approx(fx, abs=2e-3)
    assert np.interp(place, np.arange(121), torque) == pytest.approx(
        tau / radius, abs=2e-3
    )
    assert rows["contact radius"] == f"{1e3 * radius:.4g} mm"
    assert (title, rows["patch"]) == (
        "LimitSurfaceExact",
        f"{surface.patch.name!r} of {surface.patch.cells} cells",
    )


def test_a_law_is_drawn_up_to_five_stribeck_speeds(shown):
    law = pf.LuGre(mu_c=0.4, mu_s=0.9, v_s=2e-3, sigma_2=3.0)
    figure, title, rows = shown(law)
    speed, friction = figure.axes[0].lines[0].get_xydata().T
    assert (speed[0], speed[-1]) == pytest.approx((0.0, 10.0))
    assert friction == pytest.approx(law.steady_friction(1e-3 * speed), rel=1e-12)
    assert friction[0] == pytest.approx(0.9) and figure.axes[0].get_ylim()[0] == 0.0
    assert title == "LuGre"
    assert (rows["mu_c"], rows["v_s"], rows["sigma_2"]) == ("0.4", "0.002 m/s", "3 s/m")


def test_models_scenes_and_solutions_have_their_numbers(shown):
    law = pf.LuGre(mu_s=1.2)
    _, title, rows = shown(pf.DistributedModel(MAP, law))
    assert title == "DistributedModel"
    assert rows == {
        "patch": "'map' of 5 cells",
        "law": repr(law),
        "state": "[2, 5] [m]",
    }
    scene = synthetic.scene(contacts=2)
    _, title, rows = shown(scene)
    assert title == "Scene 'in-hand'"
    assert (rows["duration"], rows["body"]) == (
        "2 s, from rest",
        "0.2 kg, 0.0005 kg m²",
    )
    assert rows["contact 'pad 2'"].endswith("on the world, 2 N")
    run = synthetic.solution()
    run = dataclasses.replace(run, histories=run.data.isel(time=slice(51)))
    figure, title, rows = shown(run)
    assert (title, rows["samples"], rows["cost"]) == (
        "Solution 'in-hand'",
        "51, to 0.5 s",
        "1234 steps, 250 ms",
    )
    assert rows["end"] == f"(2.00, -1.25) mm, rotated by {np.degrees(-0.075):.2f} deg"
    assert (
        rows["status"] == "success: reached the end" and len(figure.axes[0].lines) == 3
    )
