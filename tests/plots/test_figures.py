"""Plots: what is drawn is what the numbers say, with units, and no label is cut off."""

import dataclasses
import os
import subprocess
import sys

import matplotlib.style
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_hex
from matplotlib.patches import Circle, PathPatch
from mpl_toolkits.mplot3d import Axes3D

import planarfriction as pf
from planarfriction import plots
from planarfriction._support import shown
from planarfriction._support.shown import unit_for
from planarfriction.errors import MissingExtraError
from planarfriction.patch import PUBLISHED_PATCHES
from planarfriction.plots import histories, motion, style
from planarfriction.plots.limit_surface import (
    AZIMUTH_SEGMENTS,
    POLAR_SEGMENTS,
    even_mesh,
    sample_limit_surface,
    scaled_samples,
)
from planarfriction_studies.experiments import looks
from tests.support import synthetic
from tests.support.pictures import faults
from tests.support.refusals import refused

DRAWING = 1e-9  # [mm], [N], ...: coordinates are scaled once on their way to the axes, so only rounding may differ
CUT = 1.0  # [pixel]: the box of a letter is rounded up to whole pixels


def overhang(figure):
    """Return the distance [pixel] by which labels or other parts of a figure stick out of it, 0 if none does."""
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    drawn = figure.get_tightbbox(canvas.get_renderer())
    width, height = figure.get_size_inches()
    return figure.dpi * max(
        0.0, -drawn.x0, -drawn.y0, drawn.x1 - width, drawn.y1 - height
    )


def labels(axes):
    return {axes.get_xlabel(), axes.get_ylabel()}


# ---------------------------------------------------------------------- patch


def patch_axes(figure):
    return figure.axes[0]


@pytest.mark.parametrize(
    "patch", [pf.ContactPatch.disc(0.01, 11), pf.ContactPatch.rectangle(0.04, 0.01, 12)]
)
def test_cells_are_drawn_in_their_true_size(patch):
    (cells,) = patch_axes(plots.plot_patch(patch)).collections
    drawn = np.array([polygon.vertices[:4] for polygon in cells.get_paths()])
    x, y = np.moveaxis(drawn, -1, 0)
    area = 0.5 * np.abs((x * np.roll(y, -1, 1) - y * np.roll(x, -1, 1)).sum(1))
    assert area == pytest.approx(1e6 * patch.areas, rel=1e-9)
    assert drawn.mean(axis=1) == pytest.approx(1e3 * patch.positions, abs=DRAWING)


def test_ticks_of_lengths_are_in_the_unit_of_their_label():
    axes = style.new_figure(2.0, 2.0).add_subplot()
    for largest, drawn, label, tick in (
        (0.01, 10.0, "y [mm]", "10"),
        (3.0, -2000.0, "y [m]", "\N{MINUS SIGN}2"),
    ):
        style.show_lengths(axes, largest)  # drawn in mm
        assert (axes.get_ylabel(), axes.yaxis.get_major_formatter()(drawn)) == (
            label,
            tick,
        )


def test_points_show_the_force_on_each():
    patch = pf.ContactPatch.points(
        [(0.0, 0.1), (-0.1, -0.05), (0.1, -0.05)], [1, 2, 3], name="three legs"
    )
    figure = plots.plot_patch(patch, normal_force=6.0)
    (points,) = patch_axes(figure).collections
    assert np.asarray(points.get_offsets()) == pytest.approx(
        1e3 * patch.positions, abs=DRAWING
    )
    assert np.asarray(points.get_array()) == pytest.approx([1.0, 2.0, 3.0], rel=1e-12)
    assert figure.axes[1].get_ylabel() == "normal force [N]"


def test_a_patch_that_depends_on_the_load_needs_one():
    patch = pf.ContactPatch.rectangle(
        0.02, cells=7, pressure=pf.SoftFinger(c=0.006, n=1 / 3, k=2.0, radius_max=0.01)
    )
    with refused("normal_force"):
        plots.plot_patch(patch)
    few, many = (
        (
            patch_axes(plots.plot_patch(patch, normal_force=load))
            .collections[0]
            .get_array()
            > 0
        ).sum()
        for load in (0.1, 3.0)
    )
    assert few < many


# ---------------------------------------------------------------------- limit surface


@pytest.mark.parametrize("name", ["Circle", "LineGrad", "NonConvex2"])
def test_samples_have_spin_and_slide_where_they_belong(name):
    surface = pf.LimitSurfaceCells(PUBLISHED_PATCHES[name]())
    directions, points = scaled_samples(surface, np.array([0.0, np.pi]), np.zeros(2))
    assert directions == pytest.approx(np.array([[0, 0, 1], [0, 0, -1]]), abs=1e-15)
    # A spin about the centre of pressure has the torque -mu f_N r there, by the definition of r; only summation errors
    # remain.
    assert points[:, 2] == pytest.approx([-1.0, 1.0], abs=1e-12)
    _, slide = scaled_samples(surface, np.array([np.pi / 2]), np.array([0.0]))
    assert slide == pytest.approx(np.array([[-1.0, 0.0, 0.0]]), abs=1e-12)


def test_the_poles_close_over_a_cell_in_the_centre_of_pressure():
    # Friction jumps where the centre of rotation crosses a cell: a pole off by rounding would leave a hole in the mesh.
    surface = pf.LimitSurfaceCells(PUBLISHED_PATCHES["Line"]())
    _, points = scaled_samples(
        surface, np.array([[0.0], [np.pi]]), np.linspace(0.0, 2 * np.pi, 7)[None, :]
    )
    assert (points == points[:, :1]).all()
    # Anywhere on the facet of the middle cell, whose weight it is.
    assert np.abs(points[..., :2]).max() <= 1 / 21 + 1e-12


def test_samples_are_about_the_origin_of_the_contact_frame():
    surface = pf.LimitSurfaceCells(PUBLISHED_PATCHES["LineGrad"]())
    twists, wrenches = sample_limit_surface(
        surface, np.array([1.0, 2.0]), np.array([0.5, 4.0])
    )
    assert wrenches == pytest.approx(surface.wrench(twists), abs=1e-15)
    power = -np.einsum("ni,ni->n", wrenches, twists)
    assert power == pytest.approx(surface.dissipation(twists), rel=1e-12)


def test_the_ellipsoid_beside_the_surface_is_a_sphere_in_equal_limits(monkeypatch):
    from planarfriction.plots import limit_surface

    monkeypatch.setattr(limit_surface, "POLAR_SEGMENTS", 16)
    monkeypatch.setattr(limit_surface, "AZIMUTH_SEGMENTS", 24)
    meshes = {}
    draw = Axes3D.plot_surface
    monkeypatch.setattr(
        Axes3D,
        "plot_surface",
        lambda axes, *xyz, **how: meshes.update({axes: xyz}) or draw(axes, *xyz, **how),
    )
    surface = pf.LimitSurfaceCells(PUBLISHED_PATCHES["LineGrad"]())
    figure = plots.plot_limit_surface(surface)
    own, ellipsoid = figure.axes
    soft = pf.ContactPatch.disc(
        0.02, 9, pressure=pf.SoftFinger(c=0.006, n=1 / 3, k=2.0, radius_max=0.01)
    )
    # Both at its load.
    assert (
        len(plots.plot_limit_surface(pf.LimitSurfaceCells(soft, normal_force=2.0)).axes)
        == 2
    )
    for axes in figure.axes:
        assert (axes.get_xlim(), axes.get_ylim(), axes.get_zlim()) == (
            own.get_xlim(),
        ) * 3
        assert axes.get_zlabel() == "$\\tau/r$ [-]"
    assert np.linalg.norm(meshes[ellipsoid], axis=0) == pytest.approx(
        np.ones_like(meshes[ellipsoid][0]), abs=1e-9
    )
    distance = np.linalg.norm(meshes[own], axis=0)
    assert distance.max() < np.sqrt(2) + 1e-9
    assert np.abs(distance - 1.0).max() > 0.1  # the line is not an ellipsoid
    assert overhang(figure) <= CUT


def test_a_limit_surface_can_be_drawn_alone():
    figure = plots.plot_limit_surface(
        pf.LimitSurfaceEllipsoid(pf.ContactPatch.disc(0.01, 9)), beside=None
    )
    (axes,) = figure.axes
    assert axes.get_title() == "disc: ellipsoid"
    assert overhang(figure) <= CUT


def test_the_facets_of_a_surface_are_small_where_it_is_nearly_flat():
    """Two pads: all twists about one of them have wrenches far apart; 0.28 with even angles, 0.11 so."""
    surface = pf.LimitSurfaceExact(PUBLISHED_PATCHES["NonConvex1"]())
    _, points = scaled_samples(surface, *even_mesh(surface))
    assert points.shape == (POLAR_SEGMENTS + 1, AZIMUTH_SEGMENTS + 1, 3)
    steps = [
        np.linalg.norm(np.diff(points, axis=axis), axis=-1).max() for axis in (0, 1)
    ]
    even = (
        np.linspace(0.0, np.pi, POLAR_SEGMENTS + 1)[:, None],
        np.linspace(0.0, 2 * np.pi, AZIMUTH_SEGMENTS + 1),
    )
    _, points = scaled_samples(surface, *even)
    before = [
        np.linalg.norm(np.diff(points, axis=axis), axis=-1).max() for axis in (0, 1)
    ]
    assert max(steps) < 0.5 * max(before)


@pytest.mark.parametrize("beside", ["ellipsoid", None])
def test_the_surface_to_be_turned_has_the_numbers_of_the_picture(beside):
    pytest.importorskip("plotly")
    surface = pf.LimitSurfaceExact(PUBLISHED_PATCHES["LineGrad"]())
    figure = plots.interactive_limit_surface(surface, beside=beside)
    assert len(figure.data) == (1 if beside is None else 2)
    own = figure.data[0]
    mesh = np.stack([own.x, own.y, own.z], -1)
    directions = np.asarray(own.customdata)
    twists = directions[7, 11] / [1.0, 1.0, surface.contact_radius]
    centre = surface.centre_of_pressure
    wrench = pf.geometry.wrench_at(
        surface.wrench(pf.geometry.twist_at(twists, -centre)), centre
    )
    # the direction under the pointer has six digits
    assert mesh[7, 11] == pytest.approx(
        wrench / [1.0, 1.0, surface.contact_radius], abs=1e-5
    )
    # An array of three dimensions shows nothing under the pointer.
    assert isinstance(own.customdata[7][11], list)
    low, high = figure.layout.scene.zaxis.range
    assert low < mesh.min() and mesh.max() < high


def test_without_plotly_the_extra_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "plotly", None)
    with refused(
        r"plotly is not installed: run pip install 'planarfriction\[plotly\]'",
        MissingExtraError,
    ):
        plots.interactive_limit_surface(
            pf.LimitSurfaceEllipsoid(pf.ContactPatch.disc(0.01, 9))
        )


# ---------------------------------------------------------------------- histories


def test_histories_show_the_data_in_the_units_of_their_labels():
    run = synthetic.solution()
    figure = plots.plot_histories(run)
    shown = {axes.get_ylabel(): axes.get_lines()[0].get_ydata() for axes in figure.axes}
    expected = {
        "x [mm]": 1e3 * run.data["x"],
        "y [mm]": 1e3 * run.data["y"],
        "θ [°]": np.degrees(run.data["theta"]),
        "speed [mm/s]": 1e3 * np.hypot(run.data["vx"], run.data["vy"]),
        "fx [N]": run.data["fx"][:, 0],
        "fy [N]": run.data["fy"][:, 0],
        "τ [N mm]": 1e3 * run.data["tau"][:, 0],
        "normal force [N]": run.data["normal_force"][:, 0],
    }
    assert shown.keys() == expected.keys()
    for label, values in expected.items():
        assert shown[label] == pytest.approx(np.asarray(values), abs=DRAWING), label
    assert figure.legends == []


def test_histories_stand_in_columns_above_one_time():
    run = synthetic.solution()
    figure = plots.plot_histories(run)
    left, right = figure.axes[::2], figure.axes[1::2]
    for column, name in ((left, "body"), (right, "contacts")):
        places = [axes.get_position() for axes in column]
        assert np.ptp([place.x0 for place in places]) < 1e-9
        assert (np.diff([place.y0 for place in places]) < 0.0).all()
        assert column[0].get_title().startswith(name)
        assert [axes.get_xlabel() for axes in column] == ["", "", "", "time [s]"]
    assert left[0].get_position().x0 < right[0].get_position().x0
    assert [axes.get_ylabel()[0] for axes in left] == ["x", "y", "θ", "s"]
    figure = plots.plot_histories(run, panels=("fx", "x"))
    assert [axes.get_xlabel() for axes in figure.axes] == ["", "time [s]"]


def test_every_contact_has_its_line_and_its_entry():
    run = synthetic.run(contacts=3)
    figure = plots.plot_histories({"a": run, "b": run})
    force = figure.axes[1].get_lines()
    assert len(force) == 6
    for line, factor in zip(force, [1, 2, 3, 1, 2, 3], strict=True):
        assert line.get_ydata() == pytest.approx(
            factor * np.asarray(run.data["fx"][:, 0]), abs=DRAWING
        )
    (legend,) = figure.legends
    # Column by column, as matplotlib fills legends: each run has its row.
    texts = [text.get_text() for text in legend.get_texts()]
    assert texts == [f"{run}, pad {number}" for number in (1, 2, 3) for run in "ab"]
    entries = dict(zip(texts, legend.get_lines(), strict=True))
    assert to_hex(entries["b, pad 3"].get_color()) == to_hex(force[5].get_color())
    assert entries["b, pad 3"].get_linestyle() == force[5].get_linestyle()


def panels(figure):
    return {axes.get_ylabel().split(" [")[0]: axes for axes in figure.axes}


def test_what_is_nearly_nothing_looks_like_it():
    run = synthetic.solution()
    noise = 1e-10 * np.sin(50 * run.data["time"].values)
    shown = panels(plots.plot_histories(synthetic.changed(run, fy=noise[:, None])))
    # 2 % of the largest force of the panels beside it, the normal force of 2 N
    assert np.ptp(shown["fy"].get_ylim()) == pytest.approx(0.04)
    assert shown["fy"].get_ylabel() == "fy [N]"


def test_the_kick_at_the_start_does_not_hide_the_rest():
    run = synthetic.solution()
    force = run.data["fx"].values.copy()
    force[0] = -800.0
    shown = panels(plots.plot_histories(synthetic.changed(run, fx=force)))["fx"]
    # sines of amplitude 0.1 N and 5 % of their height above and below
    assert shown.get_ylim() == pytest.approx((-0.11, 0.11), abs=2e-3)
    assert shown.get_lines()[0].get_ydata()[0] == pytest.approx(-800.0)


# ---------------------------------------------------------------------- motion


def outlines(figure):
    """Closed lines of five corners, in mm: the outlines of the plate."""
    axes = figure.axes[0]
    drawn = [line for line in axes.lines if len(line.get_xdata()) == 5]
    return [
        (line.get_transform() - axes.transData).transform(line.get_xydata())
        for line in drawn
    ]


def test_strobe_shows_the_outline_where_the_body_is():
    run = synthetic.solution()
    figure = plots.plot_motion(run)
    drawn = outlines(figure)
    assert len(drawn) == motion.INSTANTS
    plate = 1e3 * np.vstack([synthetic.PLATE, synthetic.PLATE[:1]])
    assert drawn[0] == pytest.approx(plate + np.array([2.0, 0.0]), abs=1e-6)
    angle = -0.3 * 4.0
    turned = pf.geometry.rotate(plate, angle)
    # 1e-6 mm: the way through pixels and back loses a few digits
    assert drawn[-1] == pytest.approx(turned + np.array([2.0, -20.0]), abs=1e-6)
    assert labels(figure.axes[0]) == {"x [mm]", "y [mm]"}
    assert figure.axes[0].get_aspect() == 1.0


@pytest.mark.parametrize(
    ("mounted_on", "times"), [("world", 1), ("body", motion.INSTANTS)]
)
def test_pads_are_drawn_with_what_they_are_fixed_to(mounted_on, times):
    figure = plots.plot_motion(synthetic.run(mounted_on=mounted_on))
    axes = figure.axes[0]
    pads = [each for each in axes.patches if isinstance(each, PathPatch)]
    assert len(pads) == times
    path = pads[-1].get_path().vertices.reshape(317, 5, 2)
    assert path[:, :4].mean(axis=(0, 1)) == pytest.approx([0.0, 0.0], abs=1e-6)
    assert np.ptp(path[..., 0]) == pytest.approx(20.0, abs=1e-6)


def test_pads_and_the_path_are_drawn_where_they_are():
    scene = synthetic.scene(
        contacts=2, mounted_on="body", patch=pf.ContactPatch.rectangle(0.02, 0.01, 6)
    )
    contacts = [
        dataclasses.replace(each, angle=0.5, position=(0.03 * i, 0.01))
        for i, each in enumerate(scene.contacts)
    ]
    run = synthetic.solution(dataclasses.replace(scene, contacts=contacts))
    done = run.data["time"].values ** 1.1
    run = synthetic.changed(
        run, x=0.002 + 0.01 * done, y=-0.005 * done, theta=-0.3 * done
    )
    axes = plots.plot_motion(run).axes[0]
    poses = np.stack([run.data[name].values for name in ("x", "y", "theta")], -1)
    (path,) = axes.collections
    pieces = np.array(path.get_segments())
    assert len(pieces) == motion.PIECES - 1
    some = poses[np.linspace(0, 200, motion.PIECES).round().astype(int)]
    assert pieces[:, 0] == pytest.approx(1e3 * some[:-1, :2], abs=DRAWING)
    assert pieces[:, 1] == pytest.approx(1e3 * some[1:, :2], abs=DRAWING)
    # Half of 2^1.1 is done at 1.065 s, between the samples 106 and 107.
    strobe = poses[[0, 107, 200]]
    centres = [each.center for each in axes.patches if isinstance(each, Circle)]
    assert np.array(centres) == pytest.approx(1e3 * strobe[:, :2], abs=DRAWING)
    assert [text.get_text() for text in axes.texts] == [
        "0 s: 0°",
        "1.07 s: \N{MINUS SIGN}18.5°",
        "2 s: \N{MINUS SIGN}36.8°",
    ]
    pads = [
        (each.get_transform() - axes.transData).transform(each.get_path().vertices)
        for each in axes.patches
        if isinstance(each, PathPatch)
    ]
    for pad, (contact, pose) in zip(
        pads, ((each, pose) for pose in strobe for each in contacts), strict=True
    ):
        middle = pose[:2] + pf.geometry.rotate(np.array(contact.position), pose[2])
        assert pad.reshape(-1, 5, 2)[:, :4].mean(axis=(0, 1)) == pytest.approx(
            1e3 * middle, abs=1e-6
        )
        corner = middle + pf.geometry.rotate(np.array([0.01, 0.005]), pose[2] + 0.5)
        assert np.abs(pad - 1e3 * corner).sum(axis=1).min() < 1e-6


def test_a_motion_that_cannot_be_seen_says_how_far_it_goes():
    run = resting()
    time = run.data["time"].values
    run = synthetic.changed(
        run, x=2e-6 * time, y=-1e-6 * time, theta=np.radians(1e-3) * time
    )
    title = plots.plot_motion(run).axes[0].get_title(loc="left")
    assert title == "moves by up to 4.5 µm, rotates by up to 35 µrad"


@pytest.mark.parametrize("mounted_on", ["world", "body"])
def test_everything_drawn_is_within_the_view(mounted_on):
    run = synthetic.run(contacts=5, mounted_on=mounted_on, scale=3.0)
    figure = plots.plot_motion(run)
    figure.draw_without_rendering()
    axes = figure.axes[0]
    marks = [each for each in axes.patches if isinstance(each, PathPatch)]
    pads = [path.get_transform() - axes.transData for path in marks]
    pads = [
        back.transform(path.get_path().vertices)
        for back, path in zip(pads, marks, strict=True)
    ]
    corners = np.concatenate([*outlines(figure), *pads])
    for values, (low, high) in zip(
        corners.T, (axes.get_xlim(), axes.get_ylim()), strict=True
    ):
        assert low < values.min() and values.max() < high


def test_a_run_of_one_sample_can_be_drawn():
    run = synthetic.solution()
    short = pf.Solution(
        run.data.isel(time=slice(1)), run.statistics, "success", "", run.scene
    )
    assert len(outlines(plots.plot_motion(short))) == 1
    assert overhang(plots.plot_histories(short)) <= CUT


# ---------------------------------------------------------------------- all of them


FIGURES = {
    "patch": lambda: plots.plot_patch(
        PUBLISHED_PATCHES["LineGradX"](), normal_force=2.0
    ),
    "patch, wide": lambda: plots.plot_patch(pf.ContactPatch.rectangle(0.2, 0.01, 30)),
    "patch, points": lambda: plots.plot_patch(
        pf.ContactPatch.points([(0.0, 0.1), (-0.1, 0.0)], name="two")
    ),
    "histories": lambda: plots.plot_histories(
        {"distributed": synthetic.solution(), "reduced": synthetic.solution()}
    ),
    "histories, contacts": lambda: plots.plot_histories(synthetic.run(contacts=4)),
    "motion": lambda: plots.plot_motion(synthetic.solution()),
    "solution": lambda: synthetic.solution().plot(),
}


@pytest.mark.parametrize("name", FIGURES)
def test_no_label_is_cut_off(name):
    figure = FIGURES[name]()
    assert overhang(figure) <= CUT
    assert all(axes.has_data() for axes in figure.axes)


def test_a_label_that_is_cut_off_is_found():
    figure = style.new_figure(2.0, 2.0)
    figure.text(0.9, 0.5, "far too long for the room there is")
    assert overhang(figure) > 10


def test_notebooks_show_figures():
    assert (
        plots.plot_patch(pf.ContactPatch.rectangle(0.02, cells=3))
        ._repr_png_()
        .startswith(b"\x89PNG")
    )


WINDOW = """
import sys, types
import matplotlib
from matplotlib.backend_bases import FigureManagerBase
from matplotlib.backends.backend_agg import FigureCanvasAgg
import planarfriction as pf

shown = []
class Manager(FigureManagerBase):
    def show(self):
        shown.append(self.canvas.figure)
    @classmethod
    def start_main_loop(cls):
        shown.append("waits")
class FigureCanvas(FigureCanvasAgg):
    manager_class = Manager
screen = types.ModuleType("screen")
screen.FigureCanvas, screen.FigureManager = FigureCanvas, Manager
sys.modules["screen"] = screen

figure = pf.ContactPatch.disc(0.01, 5).plot()
size = tuple(figure.get_size_inches())
matplotlib.use("module://screen")
figure.show()
assert shown == [figure, "waits"], shown
assert tuple(figure.get_size_inches()) == size and figure.dpi == 120
from matplotlib import pyplot
pyplot.close(figure)  # the user closes the window
figure.show()
assert shown == [figure, "waits"] * 2, shown
"""


def test_a_figure_opens_its_window_and_waits():
    subprocess.run([sys.executable, "-c", WINDOW], check=True, timeout=120)


def test_without_a_screen_show_says_what_to_do():
    code = "import planarfriction as pf; pf.ContactPatch.disc(0.01, 5).plot().show()"
    asked = {"capture_output": True, "text": True, "check": True, "timeout": 120}
    done = subprocess.run(
        [sys.executable, "-c", code], env={**os.environ, "MPLBACKEND": "agg"}, **asked
    )
    assert "no window can open here (agg): use savefig" in done.stderr


def test_pyplot_is_left_alone():
    code = (
        "import sys, planarfriction as pf\nfrom planarfriction import plots\n"
        "from planarfriction.plots import limit_surface\nlimit_surface.POLAR_SEGMENTS = 12\n"
        "patch = pf.ContactPatch.rectangle(0.02, cells=3)\nplots.plot_patch(patch)\n"
        "plots.plot_limit_surface(pf.LimitSurfaceEllipsoid(patch))\n"
        "assert 'matplotlib.pyplot' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code], check=True, timeout=120)


@settings(deadline=None, max_examples=25)
@given(
    kind=st.sampled_from(sorted(shown._UNITS)),
    exponent=st.floats(-8.0, 4.0),
    sign=st.sampled_from([-1.0, 1.0]),
)
def test_units_suit_the_numbers(kind, exponent, sign):
    value = sign * 10.0**exponent
    unit = unit_for(kind, np.array([0.0, value]), np.array([0.5 * value]))
    assert unit == unit_for(kind, np.array([value]))
    names = {
        "N mm": 1e3,
        "N µm": 1e6,
        "mm/s": 1e3,
        "µm/s": 1e6,
        "nm/s": 1e9,
        "deg": 180 / np.pi,
        "µrad": 1e6,
    }
    names |= {
        "m": 1,
        "mm": 1e3,
        "µm": 1e6,
        "nm": 1e9,
        "m/s": 1,
        "N": 1,
        "kN": 1e-3,
        "mN": 1e3,
        "N m": 1,
    }
    names |= {
        "GPa": 1e-9,
        "MPa": 1e-6,
        "kPa": 1e-3,
        "Pa": 1,
        "µN": 1e6,
        "nN": 1e9,
        "kN m": 1e-3,
        "N nm": 1e9,
    }
    names |= {
        "km": 1e-3,
        "km/s": 1e-3,
        "h": 1 / 3600,
        "s": 1,
        "ms": 1e3,
        "µs": 1e6,
        "ns": 1e9,
    }
    assert unit.factor == pytest.approx(names[unit.label])


def test_zero_is_shown_in_the_usual_unit():
    assert unit_for("length", np.zeros(3)).label == "mm"
    assert unit_for("torque").label == "N mm"


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: plots.plot_motion(5), "solution must be a Solution, got 5"),
        (lambda: plots.plot_solution(None), "solution must be a Solution, got None"),
        (
            lambda: plots.plot_histories("run"),
            "solutions must be a Solution or a table of them by name, got 'run'",
        ),
        (
            lambda: plots.plot_histories({"run": 5}),
            "solutions must be Solutions, under 'run' too, got 5",
        ),
        (lambda: plots.plot_histories({}), "solutions must hold at least one Solution"),
        (lambda: plots.plot_patch(5), "patch must be a ContactPatch, got 5"),
        (
            lambda: plots.plot_patch(pf.ContactPatch.disc(0.01), normal_force=[1.0]),
            "normal_force must be a number",
        ),
        (lambda: plots.plot_limit_surface(5), "surface must be a limit surface, got 5"),
        (
            lambda: plots.plot_limit_surface(
                pf.LimitSurfaceEllipsoid(pf.ContactPatch.disc(0.01)), beside="me"
            ),
            "beside must be a limit surface, \"ellipsoid\" or None, got 'me'",
        ),
    ],
)
def test_what_cannot_be_drawn_is_named_in_one_line(call, message):
    with refused(message):
        call()


# ---------------------------------------------------------------------- nothing cut, covered or empty


def changed(run, every=1.0, **values):
    """The solution with other values of some variables, and its times so many times as long."""
    run = synthetic.changed(run, **values)
    return dataclasses.replace(
        run, histories=run.data.assign_coords(time=every * run.data["time"])
    )


def scaled(by):
    """All lengths and forces so many times as large; the body and its patch stay as they are."""
    run = synthetic.solution()
    return synthetic.changed(
        run,
        **{
            name: by * run.data[name].values for name in ("x", "y", "vx", "vy", *FORCES)
        },
    )


def resting():
    run = synthetic.solution()
    return synthetic.changed(
        run,
        **{
            name: 0.0 * run.data[name].values
            for name in ("x", "y", "theta", "vx", "vy", "omega")
        },
    )


FORCES = ("fx", "fy", "tau", "normal_force")
LONG = "a name that is rather long for a plate in the hand of somebody"
AWKWARD = {
    "microseconds": lambda: changed(synthetic.solution(), 1e-6),
    "days": lambda: changed(synthetic.solution(), 1e5),
    "one sample": lambda: dataclasses.replace(
        synthetic.solution(), histories=synthetic.solution().data.isel(time=[0])
    ),
    "tiny": lambda: scaled(1e-9),
    "far": lambda: synthetic.changed(
        synthetic.solution(), x=3e4 * np.linspace(0.0, 1.0, 201)
    ),
    "no outline": lambda: synthetic.run(mounted_on="body", outline=None),
    "legs": lambda: synthetic.run(
        patch=pf.ContactPatch.points([(0.0, 0.1), (-0.1, -0.05)])
    ),
    "long names": lambda: synthetic.run(contacts=3, name=LONG),
}


@pytest.mark.parametrize(
    "name", ["microseconds", "one sample", "tiny", "far", "no outline", "legs"]
)
def test_nothing_is_wrong_with_the_picture_of_a_motion(name):
    assert faults(plots.plot_motion(AWKWARD[name]())) == []


@pytest.mark.parametrize("name", ["days", "tiny", "long names"])
def test_nothing_is_wrong_with_histories(name):
    assert faults(plots.plot_histories(AWKWARD[name]())) == []


def test_one_sample_is_seen():
    lines = plots.plot_histories(AWKWARD["one sample"]()).axes[0].get_lines()
    assert [line.get_marker() for line in lines] == ["o"]


@pytest.mark.parametrize(
    "labels",
    [[f"mu_c = {i / 100:.2f}, mass = {i}" for i in range(30)], [LONG, 2 * LONG]],
)
def test_many_runs_and_long_names_of_them_fit(labels):
    runs = {
        label: synthetic.solution(scale=1.0 + 0.1 * i) for i, label in enumerate(labels)
    }
    figure = plots.plot_histories(runs)
    assert faults(figure) == []
    assert len(figure.axes[1].get_lines()) == len(labels)
    assert len(figure.legends[0].get_texts()) == min(len(labels), histories.NAMED)


PATCHES = {
    "one cell": lambda: (pf.ContactPatch.rectangle(0.01, 0.01, cells=1), 1.0),
    "one point": lambda: (pf.ContactPatch.points([(0.0, 0.0)]), 1.0),
    "wide": lambda: (pf.ContactPatch.rectangle(0.4, 0.004, cells=40), 2.0),
    "tall": lambda: (pf.ContactPatch.rectangle(0.004, 0.4, cells=5), 2.0),
    "line": lambda: (PUBLISHED_PATCHES["Line"](), None),
    "map": lambda: (
        pf.ContactPatch.from_pressure(
            np.ones((90, 120)), cell_size=1e-4, name=LONG + " there"
        ),
        123456.789,
    ),
    "without load": lambda: (pf.ContactPatch.disc(0.01, 11), 0.0),
    "nanometres": lambda: (tiny_patch(), 1e-9),
}


def tiny_patch():
    with pytest.warns(UserWarning, match="are its lengths in metres"):
        return pf.ContactPatch.disc(1e-9, 11)


@pytest.mark.parametrize("name", PATCHES)
def test_nothing_is_wrong_with_the_picture_of_a_patch(name):
    patch, load = PATCHES[name]()
    assert faults(plots.plot_patch(patch, normal_force=load)) == []


def test_a_model_has_its_colour_in_every_figure():
    patch = pf.ContactPatch.disc_published(0.01, 7)
    law = pf.LuGre(mu_s=1.2)
    models = {
        "a": pf.DistributedModel(patch, law),
        "b": pf.ReducedModelPublished(patch, law),
        "c": pf.ReducedModel(patch, law),
    }
    scene = synthetic.scene()
    runs = {
        name: synthetic.solution(
            dataclasses.replace(scene, contacts=[pf.Contact(model, 2.0, name="pad")])
        )
        for name, model in models.items()
    }
    drawn = [
        line.get_color() for line in plots.plot_histories(runs).axes[0].get_lines()
    ]
    assert drawn == [style.DISTRIBUTED, style.PUBLISHED, style.REDUCED]
    assert tuple(drawn) == (looks.DISTRIBUTED, looks.PUBLISHED, looks.REDUCED)


def test_a_body_that_is_tiny_beside_its_path_is_drawn_larger_and_says_so():
    figure = plots.plot_motion(AWKWARD["far"]())
    times = float(figure.axes[0].get_title(loc="left").split()[2])
    plate = outlines(figure)[0]
    assert np.ptp(plate, axis=0) == pytest.approx(
        times * np.array([150.0, 80.0]), rel=1e-6
    )
    # 30 km along x, and less along y.
    assert labels(figure.axes[0]) == {
        "x [km]",
        "y [km]",
    }
    assert plots.plot_motion(synthetic.solution()).axes[0].get_title(loc="left") == ""
    assert (
        plots.plot_motion(resting()).axes[0].get_title(loc="left") == "it does not move"
    )


def test_the_turn_of_a_round_body_shows():
    angle = np.linspace(0.0, 2.0 * np.pi, 40)[:-1]
    scene = synthetic.scene(outline=0.05 * np.stack([np.cos(angle), np.sin(angle)], -1))
    lines = motion.body_lines(synthetic.solution(scene))
    assert len(lines) == 2 and lines[1] == pytest.approx(
        np.array([[0.0, 0.0], [0.05, 0.0]])
    )
    assert len(motion.body_lines(synthetic.solution())) == 1


def test_figures_have_the_size_and_the_panels_that_are_asked_for():
    run = synthetic.solution()
    figure = plots.plot_histories(
        {"a": run, "b": run}, panels=("y", "theta"), size=(3.5, 3.0)
    )
    assert tuple(figure.get_size_inches()) == (3.5, 3.0)
    assert [axes.get_ylabel().partition(" [")[0] for axes in figure.axes] == ["y", "θ"]
    assert overhang(figure) <= CUT
    patch = pf.ContactPatch.disc(0.01)
    for small in (
        plots.plot_motion(run, size=(3.5, 3.0)),
        plots.plot_patch(patch, size=(3.5, 3.0)),
    ):
        assert tuple(small.get_size_inches()) == (3.5, 3.0)
        assert overhang(small) <= CUT


def test_all_histories_fit_into_a_column_of_a_paper():
    with matplotlib.style.context("planarfriction.plots.print"):
        figure = plots.plot_histories(
            {"a": synthetic.solution(), "b": synthetic.solution()}, size=(3.5, 3.0)
        )
        assert faults(figure) == []
    assert [figure.axes[i].get_title() for i in range(2)] == ["body", "contacts"]


def test_figures_draw_into_axes_of_a_users_own():
    run = synthetic.solution()
    figure = style.new_figure(9.0, 3.0)
    left, middle, right = figure.subplots(1, 3)
    assert plots.plot_histories(run, panels=["fx"], axes=right) is figure
    assert plots.plot_motion(run, ax=middle) is figure
    assert plots.plot_patch(pf.ContactPatch.disc(0.01), ax=left) is figure
    assert right.get_lines()
    assert middle.get_lines()
    assert left.collections
    space = style.new_figure(3.0, 3.0).add_subplot(projection="3d")
    assert (
        plots.plot_limit_surface(
            pf.LimitSurfaceEllipsoid(pf.ContactPatch.disc(0.01)), ax=space
        )
        is space.figure
    )
    assert len(space.collections) == 1


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"size": (0.0, 3.0)}, "size must be > 0"),
        ({"size": 3.0}, "size must have shape"),
        ({"axes": 3}, "axes must be axes of matplotlib"),
        ({"panels": ["z"]}, "panels"),
        ({"panels": []}, "panels must name at least one of x, y, theta"),
        ({"size": (1e9, 3.0)}, "size must be in inches, each side at most 100"),
    ],
)
def test_wrong_sizes_axes_and_panels_are_refused(options, message):
    with refused(message, pf.FrictionError):
        plots.plot_histories(synthetic.solution(), **options)


def test_axes_of_three_dimensions_are_refused_in_the_plane():
    space = style.new_figure(3.0, 3.0).add_subplot(projection="3d")
    calls = [
        lambda: plots.plot_histories(synthetic.solution(), panels=["x"], axes=space),
        lambda: plots.plot_motion(synthetic.solution(), ax=space),
        lambda: plots.plot_patch(pf.ContactPatch.disc(0.01), ax=space),
    ]
    for call in calls:
        with refused("must be those of a plane", pf.FrictionError):
            call()
    flat = style.new_figure(3.0, 3.0).add_subplot()
    with refused("ax must have three dimensions", pf.FrictionError):
        plots.plot_limit_surface(
            pf.LimitSurfaceEllipsoid(pf.ContactPatch.disc(0.01)), ax=flat
        )


def test_axes_are_as_many_as_panels():
    axes = style.new_figure(3.0, 3.0).subplots(2)
    with refused("axes must be one for each of 1 panels, got 2", pf.FrictionError):
        plots.plot_histories(synthetic.solution(), panels=["x"], axes=axes)
    with refused("size must be left out with axes", pf.FrictionError):
        plots.plot_histories(
            synthetic.solution(), panels=["x"], axes=axes[:1], size=(3.0, 3.0)
        )


@pytest.mark.parametrize(("sheet", "points"), [("print", 8.0), ("talk", 16.0)])
def test_style_sheets_come_with_the_library(sheet, points):
    with matplotlib.style.context(f"planarfriction.plots.{sheet}"):
        figure = plots.plot_histories(
            {"a model of some name": synthetic.solution(), "b": synthetic.solution()}
        )
        assert figure.axes[0].yaxis.label.get_size() == pytest.approx(points)
        assert overhang(figure) <= CUT
