"""The explorer without its browser: what the state answers, what is drawn of it, and the code that it becomes."""

import contextlib
import io
import re
import tomllib

import numpy as np
import pytest

import planarfriction as pf
from planarfriction.errors import FileError, FrictionError
from planarfriction.laws import LAWS
from planarfriction.patch import PUBLISHED_PATCHES
from planarfriction.plots.limit_surface import scaled_samples
from planarfriction_explorer import code, films, pictures
from planarfriction_explorer.drawing import MOST_SIDE, Drawing
from planarfriction_explorer.films import film, read_scene, ready_scene
from planarfriction_explorer.ladder import RUNGS, climb, motion
from planarfriction_explorer.state import PRESETS, State, answer, law_parameters
from tests.support.refusals import refused

PAINTED = Drawing.published("Square").painted(0.004, 0.002, radius=0.003, pressure=0.4)


def saved(pressures):
    buffer = io.BytesIO()
    np.save(buffer, pressures)
    return buffer.getvalue()


# ---------------------------------------------------------------------- drawing


@pytest.mark.parametrize("name", PUBLISHED_PATCHES)
def test_the_map_of_a_published_patch_presses_as_the_patch_does(name):
    drawing = Drawing.published(name)
    as_map = Drawing(drawing.pressures, drawing.cell_size).patch
    patch = drawing.patch
    np.testing.assert_allclose(as_map.positions, patch.positions, atol=1e-9)
    np.testing.assert_allclose(as_map.weights(), patch.weights(), rtol=1e-12)


def test_a_brush_paints_cells_in_its_radius_and_copies_the_drawing():
    before = Drawing(np.zeros((5, 7)), 1e-3)
    # A cell and its four neighbours.
    after = before.painted(0.002, 0.001, radius=1.01e-3, pressure=0.5)
    expected = np.zeros((5, 7))
    expected[1, 4:7] = expected[0, 5] = expected[2, 5] = (
        0.5  # row 0 is the top, y = 2 mm
    )
    np.testing.assert_array_equal(after.pressures, expected)
    assert not before.pressures.any() and after.origin == "drawn"


def test_a_small_brush_paints_one_cell_and_none_outside_the_map():
    blank = Drawing(np.zeros((3, 3)), 1e-3)
    assert (
        blank.painted(0.0014, -0.0014, radius=0.0, pressure=1.0).pressures[2, 2] == 1.0
    )
    assert not blank.painted(0.0016, 0.0, radius=0.0, pressure=1.0).pressures.any()


def test_a_file_is_read_and_a_path_in_its_name_left_out():
    pressures = np.array([[0.0, 1.0], [2.0, 3.0]])
    drawing = Drawing.read("C:\\maps\\pad.npy", saved(pressures), 2e-3)
    np.testing.assert_array_equal(drawing.pressures, pressures)
    assert (drawing.name, drawing.origin, drawing.width) == ("pad.npy", "file", 4e-3)


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("pad.txt", b"1,2", "pad.txt: unknown kind '.txt'"),
        ("pad.csv", b"1,2\n3,x\n", "pad.csv: line 2"),
        ("pad.png", b"no image", "pad.png: not a readable .png file"),
        ("pad", b"", "pad: unknown kind ''"),
        ("pad.csv", b"0,0\n0,0\n", "have a total > 0"),
        ("pad.csv", b"-1,2\n", "pressure must be >= 0"),
        (
            "pad.npy",
            saved(np.ones((1, MOST_SIDE + 1))),
            f"at most {MOST_SIDE} rows and columns",
        ),
    ],
)
def test_a_file_that_is_no_map_is_one_line_without_its_folder(name, content, words):
    with pytest.raises(FrictionError) as error:
        Drawing.read(name, content, 1e-3)
    assert (
        words in str(error.value)
        and "\n" not in str(error.value)
        and "/" not in str(error.value).split(":")[0]
    )


# ---------------------------------------------------------------------- state


def test_the_centre_of_rotation_is_where_it_was_put_and_does_not_move():
    state = State(twist=(0.3, 0.2, -2.0)).turning_about(0.004, -0.003)
    assert (
        state.centre_of_rotation == pytest.approx((0.004, -0.003))
        and state.twist[2] == -2.0
    )
    np.testing.assert_allclose(
        pf.geometry.twist_at(state.twist, (0.004, -0.003))[:2], 0.0, atol=1e-17
    )
    assert State(twist=(0.3, 0.2, 0.0)).centre_of_rotation is None
    assert State(twist=(0.3, 0.2, 0.0)).turning_about(0.0, 0.0).twist[2] == 1.0


@pytest.mark.parametrize(
    "values",
    [{"normal_force": 0.0}, {"twist": (0.0, 1.0)}, {"twist": (np.nan, 0.0, 0.0)}],
)
def test_a_state_refuses_what_breaks_a_rule(values):
    with refused(next(iter(values))):
        State().changed(**values)


@pytest.mark.parametrize("kind", LAWS)
def test_the_parameters_of_a_law_make_it_again(kind):
    law = State().with_law(kind).law
    assert State().with_law(kind, **law_parameters(law)).law == law


# ---------------------------------------------------------------------- answers


@pytest.mark.parametrize(
    "drawing", [Drawing.published("NonConvex2"), PAINTED], ids=["published", "painted"]
)
@pytest.mark.parametrize(
    "law", [pf.LuGre(mu_c=0.6, mu_s=0.9, elasto_plastic=0.9), pf.Dahl(mu_c=0.4)]
)
def test_the_friction_is_that_of_a_model_that_has_slid_for_long(drawing, law):
    state = State(drawing, law, 2.0, (0.012, -0.004, 3.0))
    model = pf.DistributedModel(drawing.patch, law)
    bristles = model.rest()
    wrench = np.zeros(3)
    # 0.02 s: the slowest loaded cell slides by many times the 1 um that a bristle bends.
    for _ in range(200):
        bristles, wrench = model.step(bristles, state.twist, 2.0, 1e-4)
    np.testing.assert_allclose(answer(state).friction, wrench, rtol=1e-4, atol=2e-7)


def test_coulomb_friction_lies_on_the_limit_surface_of_its_cells():
    state = State(law=pf.Dahl(mu_c=0.5), normal_force=3.0)
    expected = 1.5 * pf.LimitSurfaceCells(state.drawing.patch).wrench(state.twist)
    found = answer(state)
    np.testing.assert_allclose(found.friction, expected, rtol=1e-12, atol=1e-15)
    np.testing.assert_allclose(
        found.surface, 1.5 * state.drawing.surface.wrench(state.twist), rtol=1e-12
    )
    assert found.power == pytest.approx(-expected @ state.twist)
    # the ellipsoid is the unit sphere in these axes, but for its radius, a sum over cells that is integrated here
    assert np.linalg.norm(found.points[2]) == pytest.approx(1.0, abs=3e-3)


def test_the_ellipsoid_is_exact_in_pure_spin_and_within_its_stated_error():
    circle = State(Drawing.published("Circle"))
    centred = answer(circle.changed(twist=(0.0, 0.0, 2.0)))
    # Its radius: see above.
    assert centred.force_error < 3e-3 and centred.angle_error < 1e-6
    worst = circle.drawing.largest_errors
    shares = np.linspace(-2.0, 2.0, 9)
    found = [answer(circle.changed(twist=(0.01 * share, 0.0, 1.0))) for share in shares]
    # 100 directions miss little of the largest.
    assert 0.1 < max(each.force_error for each in found) < 1.05 * worst[0]
    assert 5.0 < max(each.angle_error for each in found) < 1.05 * worst[1]


def test_the_error_of_the_ellipsoid_does_not_depend_on_the_law():
    twist = (0.01, -0.003, 1.0)
    one, other = (
        answer(State(law=law, twist=twist))
        for law in (pf.Dahl(), pf.LuGre(mu_s=3.0, v_s=0.1))
    )
    assert np.linalg.norm(one.friction - other.friction) > 0.1
    assert (one.force_error, one.angle_error) == (other.force_error, other.angle_error)


def test_at_rest_nothing_is_said_and_nothing_fails():
    found = answer(State(twist=(0.0, 0.0, 0.0)))
    assert (
        not found.friction.any() and not found.points.any() and found.angle_error == 0.0
    )


@pytest.mark.parametrize("load", [5e-324, 1e-320, 1e50])
def test_any_load_has_the_same_points_and_the_models_the_same_errors(load):
    one = answer(State())
    other = answer(State(normal_force=load))
    np.testing.assert_array_equal(other.points, one.points)
    # 5e-324 is the last digit.
    np.testing.assert_allclose(
        other.friction, load * one.friction, rtol=1e-12, atol=1e-323
    )
    assert other.force_error == one.force_error and all(
        each.error < 1.0 for each in climb(State(normal_force=load))
    )


def test_what_hardly_moves_rubs_as_what_moves_slowly():
    tiny = State(
        Drawing.published("Circle"), pf.Dahl(mu_c=0.5), twist=(5e-324, 0.0, 0.0)
    )
    np.testing.assert_allclose(answer(tiny).friction, [-0.5, 0.0, 0.0], atol=1e-15)
    assert pictures.slip_arrows(tiny) == pictures.slip_arrows(
        tiny.changed(twist=(1e-3, 0.0, 0.0))
    )
    assert State(twist=(0.01, 0.0, 1e-310)).centre_of_rotation is None


def test_the_page_says_the_power_in_milliwatts_and_torques_in_newton_millimetres():
    """0.3 N at 20 mm/s are 6 mW."""
    state = State(law=pf.Dahl(mu_c=0.3), normal_force=1.0, twist=(0.02, 0.0, 0.0))
    page = pictures.numbers_table(state, answer(state), 0.0123)
    assert (
        "Dissipated power: 6 mW" in page
        and "Answered in 12.3 ms" in page
        and "<td>-0.3000</td>" in page
    )
    turning = state.changed(twist=(0.0, 0.0, 2.0))
    assert (
        f"<td>{1e3 * answer(turning).friction[2]:.4f}</td>"
        in pictures.numbers_table(turning, answer(turning), 0.0)
    )


def test_what_does_not_press_has_no_answer():
    with refused("have a total > 0"):
        answer(State(drawing=State().drawing.cleared()))


# ---------------------------------------------------------------------- pictures


def test_the_picture_of_the_map_has_its_top_row_at_the_top():
    drawing = Drawing(np.array([[2.0, 0.0], [1.0, 1.0], [1.0, 1.0]]), 1e-3)
    columns = pictures.pressure_image(drawing)
    # Rows run upwards.
    np.testing.assert_array_equal(columns["image"][0][-1], [1.0, np.nan])
    assert [columns[key][0] for key in ("x", "y", "dw", "dh")] == [-1.0, -1.5, 2.0, 3.0]


def test_arrows_of_slip_turn_about_the_centre_on_loaded_cells():
    state = State(Drawing.published("NonConvex1")).turning_about(0.002, 0.001)
    arrows = pictures.slip_arrows(state)
    x0, y0, x1, y1 = (np.array(arrows[name]) for name in ("x0", "y0", "x1", "y1"))
    along = np.stack([x1 - x0, y1 - y0])
    lever = np.stack([x0 - 2.0, y0 - 1.0])
    assert len(x0) > 2 and np.abs(y0).max() < 1.5
    # Every second of 21 columns has an arrow, and the fastest one is as long.
    step = 2e3 * state.drawing.cell_size
    np.testing.assert_allclose(
        along,
        step * np.stack([-lever[1], lever[0]]) / np.hypot(*lever).max(),
        atol=1e-12,
    )
    assert np.diff(np.unique(x0.round(9))).min() == pytest.approx(step)
    # 0 points up.
    np.testing.assert_allclose(
        np.sin(arrows["angle"]), -along[0] / np.hypot(*along), atol=1e-12
    )
    np.testing.assert_allclose(
        np.cos(arrows["angle"]), along[1] / np.hypot(*along), atol=1e-12
    )


def test_the_force_is_drawn_as_it_acts_and_the_mark_where_nothing_moves():
    state = State(PAINTED).turning_about(0.002, -0.006)
    found = answer(state)
    arrows = pictures.wrench_arrows(state, found)
    along = np.array(
        [
            np.subtract(arrows["x1"], arrows["x0"]),
            np.subtract(arrows["y1"], arrows["y0"]),
        ]
    )
    shares = pictures.REACH * 1e3 * PAINTED.width * found.points[:, :2].T
    np.testing.assert_allclose(along, shares, rtol=1e-12)
    np.testing.assert_allclose(
        [arrows["x0"][0], arrows["y0"][0]], 1e3 * PAINTED.surface.centre_of_pressure
    )
    wide = State(Drawing(np.ones((4, 6)), 2e-3), twist=(0.01, 0.02, 0.0))
    arrows = pictures.wrench_arrows(wide, answer(wide))
    # Of 12 mm x 8 mm.
    np.testing.assert_allclose(
        np.hypot(arrows["x1"], arrows["y1"])[1:], 0.4 * 12.0, rtol=1e-9
    )
    assert pictures.points_of_interest(state) == {
        "x": [pytest.approx(2.0)],
        "y": [pytest.approx(-6.0)],
    }


def test_moving_the_twist_leaves_the_drawn_surface_as_it_is():
    state = State(PAINTED)
    figure = pictures.surface_figure(state)
    moved = pictures.moved(figure, answer(state))
    assert all(
        one is other
        for one, other in zip(figure["data"][:2], moved["data"][:2], strict=True)
    )
    named = [
        each["name"]
        for each in moved["data"]
        if each.get("showlegend", each["type"] != "surface")
    ]
    # Plotly leaves surfaces out by itself.
    assert named[:2] == ["limit surface", "ellipsoid"] and len(named) == 5
    for trace, point in zip(moved["data"][2:], answer(state).points, strict=True):
        assert [trace[axis][1] for axis in "xyz"] == pytest.approx(point.tolist())


@pytest.mark.parametrize("quick", [True, False])
def test_the_surface_is_that_of_the_map_and_the_wires_are_a_sphere(quick):
    shell, wires = pictures.surface_figure(State(PAINTED), quick=quick)["data"][:2]
    kind = pf.LimitSurfaceCells if quick else pf.LimitSurfaceTable
    polar = np.linspace(0.0, np.pi, 37)[:, None]
    azimuth = np.linspace(0.0, 2.0 * np.pi, 73)[None]
    _, mesh = scaled_samples(kind(PAINTED.patch), polar, azimuth)
    np.testing.assert_allclose(
        np.stack([shell[each] for each in "xyz"], -1), mesh, atol=1e-12
    )
    np.testing.assert_array_equal(shell["surfacecolor"], shell["z"])
    points = np.stack([wires[each] for each in "xyz"], -1)
    # 7 circles of 73 points and a gap, 13 half circles of 37.
    rings, spokes = np.split(points, [7 * 74])
    assert len(spokes) == 13 * 38
    np.testing.assert_allclose(
        np.linalg.norm(points[np.isfinite(points[:, 0])], axis=1), 1.0, atol=1e-9
    )
    height = rings.reshape(7, 74, 3)[:, :-1, 2]
    np.testing.assert_allclose(
        height,
        np.tile(-np.cos(np.linspace(0.0, np.pi, 7))[:, None], (1, 73)),
        atol=1e-9,
    )
    around = spokes.reshape(13, 38, 3)[:, 1:-2]
    turns = np.unwrap(np.arctan2(-around[..., 1], -around[..., 0]), axis=0)
    np.testing.assert_allclose(
        turns, np.tile(np.linspace(0.0, 2.0 * np.pi, 13)[:, None], (1, 35)), atol=1e-9
    )


def test_the_table_has_the_power_and_the_largest_errors():
    state = State(PAINTED, normal_force=3.0, twist=(0.01, 0.02, 0.0))
    found = answer(state)
    (force, angle) = PAINTED.largest_errors
    said = pictures.numbers_table(state, found, 0.0123)
    assert (
        "none, no rotation" in said
        and f"power: {1e3 * found.power:.4g} mW" in said
        and "in 12.3 ms" in said
    )
    assert (
        f"off by {found.force_error:.3f} of" in said
        and f"by {found.angle_error:.1f}° in the twist" in said
    )
    assert (
        0.0 < found.force_error < force
        and f"by up to {force:.3f} and {angle:.1f}°" in said
    )


def test_the_errors_of_the_grid_are_those_of_the_patch():
    patch = PAINTED.patch
    said = pictures.grid_line(State(PAINTED))
    assert (
        f"cells of this grid: {patch.grid_error()}; " in said
        and f"{patch.grid_error(refined=3)}.</p>" in said
    )
    assert "many cells" in pictures.grid_line(State(Drawing(np.ones((27, 27)), 1e-3)))


def test_the_examples_are_a_fingertip_an_angle_and_a_box():
    finger, foot, box = (state.drawing for state in list(PRESETS.values())[1:])
    assert (finger.width, foot.width, box.width, box.height) == pytest.approx(
        (0.014, 0.06, 0.15, 0.1)
    )
    x, y = np.meshgrid(*[np.linspace(-6.75, 6.75, 28)] * 2)
    np.testing.assert_allclose(
        finger.pressures, np.sqrt(np.clip(1 - (x**2 + y**2) / 49, 0, None)), atol=6e-4
    )
    assert (
        foot.pressures.sum() == 24 * 24 - 16 * 16 and not foot.pressures[:16, 8:].any()
    )
    np.testing.assert_allclose(
        box.pressures, np.tile(0.2 + 0.8 * np.arange(30) / 29, (20, 1)), atol=6e-4
    )


def test_the_section_of_a_disc_ends_at_its_force_and_its_torque():
    surface = pf.LimitSurfaceExact(pf.ContactPatch.disc(0.01))
    for angle in (0.0, 0.7):  # as a disc has no direction
        right, top, left, bottom = pictures.section(surface, angle)[:-1:30]
        torque = 0.01 * 2.0 / 3.0  # of an even pressure
        # Sums over 0.01 mm.
        np.testing.assert_allclose([right, left], [[1.0, 0.0], [-1.0, 0.0]], atol=1e-5)
        np.testing.assert_allclose(
            [top, bottom], [[0.0, torque], [0.0, -torque]], rtol=1e-4, atol=1e-6
        )


def test_every_point_of_a_section_lies_on_its_surface():
    patch = pf.patch.PUBLISHED_PATCHES["NonConvex2"]()
    angle = 0.4
    ellipsoid = pf.LimitSurfaceEllipsoid(patch)
    force, torque = pictures.section(ellipsoid, angle).T
    np.testing.assert_allclose(
        force**2 + (torque / patch.contact_radius()) ** 2, 1.0, rtol=1e-12
    )
    surface = pf.LimitSurfaceExact(patch)
    force, torque = pictures.section(surface, angle).T
    wrenches = np.stack([force * np.cos(angle), force * np.sin(angle), torque], axis=1)
    wrenches = pf.geometry.wrench_at(wrenches, -surface.centre_of_pressure)
    apart = wrenches - surface.wrench(surface.twist(wrenches))
    # `CERTIFIED`.
    np.testing.assert_allclose(
        apart / [1.0, 1.0, patch.contact_radius()], 0.0, atol=1e-5
    )


@pytest.mark.parametrize(
    "twist", [(0.01, -0.02, 1.0), (0.0, 0.0, 2.0), (0.0, 0.0, 0.0)]
)
def test_the_friction_lies_in_the_section_in_its_units(twist):
    state = State(Drawing.published("Circle"), pf.Dahl(mu_c=0.5), 4.0, twist)
    found = answer(state)
    angle, lines = pictures.section_lines(state, found)
    fx, fy, tau = found.friction
    force, torque = lines["friction"][0]
    assert (force, torque) == pytest.approx((np.hypot(fx, fy), 1e3 * tau), abs=1e-12)
    assert angle == pytest.approx(np.degrees(np.arctan2(fy, fx)) if twist[0] else 0.0)
    for name in ("surface", "ellipsoid"):
        assert lines[name].max(axis=0) == pytest.approx(
            [2.0, 2e3 * state.drawing.patch.contact_radius()], rel=6e-3
        )
    if any(twist):  # Coulomb friction lies on the curve, but for the sum over the cells
        scale = [2.0, 2e3 * state.drawing.patch.contact_radius()]
        assert (
            np.linalg.norm((lines["surface"] - lines["friction"]) / scale, axis=1).min()
            < 0.03
        )


# ---------------------------------------------------------------------- code


@pytest.mark.parametrize("origin", ["published", "drawn", "file"])
def test_the_code_gives_the_numbers_on_the_screen(origin, tmp_path, monkeypatch):
    drawing = {"published": Drawing.published("LineGrad"), "drawn": PAINTED}.get(origin)
    if drawing is None:
        content = saved(np.array([[0.0, 1.0, 3.0], [1.0, 1.0, 0.1]]))
        (tmp_path / "pad.npy").write_bytes(content)
        drawing = Drawing.read("pad.npy", content, 1.5e-3)
    monkeypatch.chdir(tmp_path)
    state = State(
        drawing,
        pf.LuGre(mu_c=0.7, mu_s=0.8, elasto_plastic=0.5),
        2.5,
        (0.01, 0.02, -1.5),
    )
    expected = answer(state)
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        exec(code.python(state), {})
    *surfaces, friction = printed.getvalue().splitlines()
    for line, wrench in zip(
        surfaces, (expected.surface, expected.ellipsoid), strict=True
    ):
        # Eight digits are printed.
        np.testing.assert_allclose(
            np.fromstring(line.strip("[]"), sep=" "), wrench, atol=1e-8
        )
    np.testing.assert_allclose(
        np.fromstring(friction, sep=" "), expected.friction, rtol=1e-4, atol=2e-7
    )
    (tmp_path / "scene.toml").write_text(code.toml(state))
    scene = pf.Scene.from_file("scene.toml")
    assert scene.contacts[0].model.law == state.law and scene.velocity is not None
    np.testing.assert_array_equal(scene.velocity(0.3), state.twist)
    np.testing.assert_allclose(
        scene.contacts[0].model.patch.weights(), drawing.patch.weights(), rtol=1e-15
    )
    np.testing.assert_allclose(
        scene.contacts[0].model.patch.positions, drawing.patch.positions, rtol=1e-12
    )
    assert float(scene.contacts[0].normal_force(0.3)) == 2.5


def test_the_first_page_shows_where_an_ellipsoid_fails():
    found = answer(State())
    assert (
        found.force_error > 0.4 and Drawing.published("Circle").largest_errors[0] < 0.2
    )


def test_a_drag_is_code_of_six_digits():
    state = State(twist=(0.1 / 3.0, -0.0, 2.0 / 3.0))
    assert "twist, normal_force = (0.0333333, -0.0, 0.666667), 1.0" in code.python(
        state
    )
    assert code.scene(state).velocity(0.3)[2] == 0.666667


def test_the_geom_of_mujoco_has_the_half_axes_of_the_ellipsoid():
    state = State(law=pf.LuGre(mu_c=0.5))
    radius = state.drawing.patch.contact_radius()
    found = re.search(r'friction="(\S+) (\S+) 0"', code.mujoco(state))
    assert found and np.array(found.groups(), dtype=float) == pytest.approx(
        [0.5, 0.5 * radius], rel=1e-5
    )


@pytest.mark.parametrize("kind", LAWS)
def test_the_code_of_every_law_makes_that_law(kind):
    state = State().with_law(kind, mu_c=0.3)
    line = next(
        line for line in code.python(state).splitlines() if line.startswith("law = ")
    )
    assert eval(line.removeprefix("law = "), {"pf": pf}) == state.law
    assert tomllib.loads(code.toml(state))["contact"][0]["law"]["kind"] == kind


# ---------------------------------------------------------------------- runs


def test_the_ladder_moves_with_the_twist_and_turns_round():
    state = State(twist=(0.01, -0.02, 3.0))
    np.testing.assert_allclose(motion(state)(0.08), state.twist)
    np.testing.assert_allclose(motion(state)(0.18), np.negative(state.twist))
    np.testing.assert_allclose(motion(state)(0.0125), np.multiply(0.25, state.twist))
    np.testing.assert_allclose(motion(state)(0.125), 0.0, atol=1e-12)


def test_the_error_of_a_rung_is_a_distance_in_units_of_the_limit():
    state = State(
        Drawing(np.array([[1.0, 2.0, 0.5]]), 4e-3),
        pf.Dahl(mu_c=0.5),
        3.0,
        (0.01, -0.02, 3.0),
    )
    found = {each.name: each for each in climb(state)}["reduced, as published"]
    runs = []
    for kind in (pf.DistributedModel, pf.ReducedModelPublished):
        model = kind(state.drawing.patch, state.law)
        wrenches = []
        bristles = model.rest()
        for middle in np.arange(5e-4, 0.2, 1e-3):
            bristles, wrench = model.step(bristles, motion(state)(middle), 3.0, 1e-3)
            wrenches.append(wrench)
        runs.append(np.array(wrenches))
    scale = 0.5 * 3.0 * np.array([1.0, 1.0, state.drawing.surface.contact_radius])
    expected = np.sqrt((((runs[1] - runs[0]) / scale) ** 2).sum(axis=1).mean())
    # Wrenches in the middle of steps of a millisecond.
    assert found.error == pytest.approx(expected, rel=0.05)


def test_models_are_compared_with_the_distributed_one():
    """A mask of 18 cells: as discs they are more than points, and differ from them by what a cell's size is worth."""
    rungs = {
        each.name: each
        for each in climb(State(Drawing.published("NonConvex1"), State().law))
    }
    assert list(rungs) == list(RUNGS) and rungs["distributed"].error == 0.0
    assert [each.states for each in rungs.values()] == [36, 54, 54, 24, 3]
    # Of mu_c f_N.
    assert (
        0.0 < rungs["reduced"].error < 0.02 < rungs["reduced, as published"].error < 0.2
    )


def test_a_scene_is_run_with_the_contact_on_the_screen():
    state = State(Drawing.published("Line"), pf.Dahl(mu_c=0.4))
    (contact,) = ready_scene(state, "free-slide", "reduced").contacts
    assert isinstance(contact.model, pf.ReducedModel) and contact.model.law == state.law
    np.testing.assert_array_equal(
        contact.model.patch.positions, state.drawing.patch.positions
    )
    with refused("reduced-published", FrictionError):
        ready_scene(state, "free-slide", "reduce")


def test_a_ready_scene_is_run_on_a_pad():
    layer = {"kind": "layer", "shear_modulus": 0.2e6, "thickness": 1e-3}
    (contact,) = ready_scene(State(), "in-hand", "reduced", layer).contacts
    assert contact.model.pad == pf.Pad.layer(0.2e6, 1e-3) and contact.count == 2
    with refused(
        "pad must be left out of a contact whose model has none", FrictionError
    ):
        ready_scene(State(), "in-hand", "reduced-published", layer)
    with refused("shear_modulus must be > 0", FrictionError):
        ready_scene(State(), "in-hand", "reduced", layer | {"shear_modulus": 0.0})


def test_a_film_is_one_file_beside_its_histories_and_can_be_cancelled(monkeypatch):
    monkeypatch.setattr(films, "DPI", 20.0)  # quick to draw
    monkeypatch.setattr("planarfriction.plots.animation.LEAST_FRAMES", 6)
    scene = ready_scene(State(Drawing.published("Line")), "free-slide", "reduced")
    told = []
    page, histories = film(scene, lambda doing, share: told.append((doing, share)))
    assert (
        page.count("data:image/png;base64") >= 6
        and "anim-slider" in page
        and "http" not in page
    )
    assert {doing for doing, _ in told} == {"simulating", "drawing"} and told[-1][
        1
    ] == pytest.approx(1.0)
    assert histories == pf.plots.plot_histories(pf.simulate(scene))._repr_png_()

    def stop(doing, share):
        if doing == "drawing":
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        film(scene, stop)


@pytest.mark.parametrize("suffix", [".toml", ".json"])
def test_a_scene_file_is_the_scene_that_it_was_written_from(suffix, tmp_path):
    scene = code.scene(State(PAINTED))
    path = tmp_path / f"mine{suffix}"
    scene.to_file(path)
    assert read_scene(f"C:\\scenes\\mine{suffix}", path.read_bytes()) == scene


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("scene.txt", b"t_end = 1", "scene.txt: a scene file ends in .toml or .json"),
        ("scene.toml", b"t_end = ", "scene.toml: not valid TOML"),
        ("scene.toml", b"\xff\xfe", "scene.toml: not a text file"),
        ("scene.toml", b"t_end = 1.0\n", "scene.toml: missing"),
        ("scene.json", b"[]", "scene.json: "),
        ("scene", b"", "scene: a scene file ends in"),
    ],
)
def test_a_file_that_is_no_scene_is_one_line_with_its_name(name, content, words):
    with pytest.raises(FrictionError) as error:
        read_scene(name, content)
    assert (
        words in str(error.value)
        and "\n" not in str(error.value)
        and "/tmp" not in str(error.value)
    )


def test_files_named_by_a_scene_are_relative_to_the_start_folder(tmp_path, monkeypatch):
    drawing = Drawing.read("pad.npy", saved(np.ones((2, 2))), 1e-3)
    text = code.toml(State(drawing)).encode()
    monkeypatch.chdir(tmp_path)
    with refused(r"pad\.npy: no such file", FrictionError):
        read_scene("scene.toml", text)
    (tmp_path / "pad.npy").write_bytes(saved(np.ones((2, 2))))
    assert read_scene("scene.toml", text).contacts[0].model.patch.cells == 4


def test_without_panel_the_command_names_the_extra(monkeypatch, capsys):
    from planarfriction.cli import main

    monkeypatch.setitem(__import__("sys").modules, "panel", None)
    assert main(["explore", "--no-browser"]) == 2
    assert "planarfriction[explore]" in capsys.readouterr().err
    with refused("unknown kind", FileError):
        Drawing.read("x.exe", b"", 1e-3)
