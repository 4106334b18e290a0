"""Figures of the experiments, drawn from made numbers: each line has its data, in the units of its axis."""

from types import SimpleNamespace

import numpy as np
import pytest

import planarfriction as pf
from planarfriction.patch import PUBLISHED_PATCHES
from planarfriction_studies.experiments import facts, looks
from planarfriction_studies.experiments.beyond import cells, contacts, tables
from planarfriction_studies.experiments.classics import run as classics
from planarfriction_studies.experiments.convergence import run as convergence
from planarfriction_studies.experiments.convergence import runs as convergence_runs
from planarfriction_studies.experiments.drift import run as drift
from planarfriction_studies.experiments.in_hand import figures
from planarfriction_studies.experiments.limit_surfaces import figures as surfaces
from planarfriction_studies.experiments.load_dependent import run as load_dependent
from planarfriction_studies.experiments.staircase import run as staircase
from planarfriction_studies.experiments.timing import run as timing
from planarfriction_studies.experiments.velocity_driven import boxes
from planarfriction_studies.experiments.velocity_driven import run as driven

TIME = np.linspace(0.0, 5.0, 501)
UNITS = {"x": 1e3, "y": 1e3, "theta": 180.0 / np.pi, "fx": 1.0, "fy": 1.0, "tau": 1e3}


def made(seed):
    """Columns of a run."""
    random = np.random.default_rng(seed)
    columns = {name: random.normal(size=len(TIME)) for name in (*UNITS, "normal_force")}
    return {"time": TIME, **columns}


def has(line, x, y):
    np.testing.assert_allclose(
        line.get_xydata(), np.stack([x, y], -1), rtol=1e-12, atol=1e-12
    )


def is_published(line, name, factor, part=slice(None)):
    curve = facts.published_curve(name)
    has(line, curve.time[part], factor * curve.values[part])


def box_of(axes, number):
    """Place, low whisker, first quartile, median, third quartile and high whisker of a box; crosses are left out."""
    lines = [line for line in axes.lines if line.get_marker() != "x"]
    whiskers = lines[5 * number : 5 * number + 2]
    median = lines[5 * number + 4]
    box = axes.patches[number].get_path().vertices[:, 1]
    low, high = (line.get_ydata() for line in whiskers)
    return [
        median.get_xdata().mean(),
        low.min(),
        box.min(),
        median.get_ydata()[0],
        box.max(),
        high.max(),
    ]


# ---------------------------------------------------------------------- parts of all


def test_boxes_and_vertices_are_where_their_numbers_say():
    _, axes = looks.panels(4.0, 3.0)
    looks.box(axes, 1.5, (1.0, 2.0, 2.5, 4.0, 7.0, 9.0), "0.5", 0.2)
    assert box_of(axes, 0) == pytest.approx([1.5, 1.0, 2.0, 2.5, 4.0, 7.0])
    assert axes.lines[-1].get_xydata().tolist() == [[1.5, 9.0]]
    curve = facts.published_curve("staircase/plain/tau")
    looks.vertices(axes, "staircase/plain/tau", 1e3, "0.5", (0.5, 0.9))
    is_published(
        axes.lines[-1],
        "staircase/plain/tau",
        1e3,
        (curve.time >= 0.5) & (curve.time <= 0.9),
    )


# ---------------------------------------------------------------------- in hand


def test_histories_of_two_runs_and_published_vertices():
    panels = {
        "load 1": {"distributed": made(0), "reduced": made(1)},
        "load 2": {"reduced": made(2)},
    }
    published = {"load 2": {"reduced": "in_hand/Circle/r2"}}
    figure = figures.histories(
        panels, ("normal_force", "x", "theta", "tau"), published=published
    )
    grid = np.reshape(figure.axes, (4, 2))
    has(grid[0, 0].lines[0], TIME, made(0)["normal_force"])
    is_published(grid[0, 1].lines[1], "in_hand/load/2", 1.0)
    for row, name in enumerate(("x", "theta", "tau"), start=1):
        first = 1 if name == "tau" else 0
        for line, run in zip(
            (*grid[row, 0].lines, grid[row, 1].lines[0]),
            map(made, range(3)),
            strict=True,
        ):
            has(line, TIME[first:], UNITS[name] * run[name][first:])
        is_published(grid[row, 1].lines[1], f"in_hand/Circle/r2/{name}", UNITS[name])
    assert [axes.get_ylabel() for axes in grid[1:, 0]] == [
        "$x$ [mm]",
        "$\\theta$ [deg]",
        "$\\tau$ [N mm]",
    ]


def test_distances_and_shifts_are_in_millimetres():
    lines = {"one": (TIME, 1e-3 * TIME), "two": (TIME, 2e-3 * TIME)}
    figure = figures.distances(
        {"left": lines, "right": {"one": lines["two"]}}, "apart [mm]"
    )
    for line, factor in zip(
        (*figure.axes[0].lines, *figure.axes[1].lines), (1.0, 2.0, 2.0), strict=True
    ):
        has(line, TIME, factor * TIME)
    rows = {"a": {"friction": 1e-3, "grid": 2e-3}, "b": {"grid": 5e-3}}
    axes = figures.end_shifts(rows, {"grid": "0.5"}, "shift [mm]").axes[0]
    has(axes.lines[0], [1.0], [0])
    has(axes.lines[1], [2.0, 5.0], [0, 1])
    assert [line.get_color() for line in axes.lines] == [looks.REFERENCE, "0.5"]


# ---------------------------------------------------------------------- drift and staircase


@pytest.mark.parametrize("load", ["tangential", "normal"])
def test_drifts_are_in_nanometres_and_microradians(load):
    found = {
        (load, kind + law): made(i)
        for i, (kind, law) in enumerate((k, w) for k in "dr" for w in drift.LAWS)
    }
    figure = drift._motion(load, found)
    grid = np.reshape(figure.axes[:6], (3, 2))
    for column, kind in enumerate("dr"):
        for row, (name, factor) in enumerate((("x", 1e9), ("theta", 1e6)), start=1):
            lines = list(grid[row, column].lines)
            for law in drift.LAWS:
                has(lines.pop(0), TIME, factor * found[load, kind + law][name])
                if load == "tangential":
                    is_published(lines.pop(0), f"drift/{kind}{law}/{name}", factor)
            assert not lines
    above = grid[0, 1]
    beside = figure.axes[-1]
    time = np.arange(0.0, 5.0, 1e-3)
    has(above.lines[0], time, drift.drift_force(load)(time)[:, 0])
    if load == "tangential":
        has(beside.lines[0], time, 1e3 * drift.drift_force(load)(time)[:, 2])
        is_published(above.lines[1], "drift/applied/fx", 1.0, slice(None, None, 4))
        is_published(beside.lines[1], "drift/applied/tau", 1e3, slice(None, None, 4))
    else:
        has(beside.lines[0], TIME, found[load, "r"]["normal_force"])


def test_plateaus_are_drawn_for_a_second_beside_their_closed_forms():
    found = {
        ("normal", model): made(i) for i, model in enumerate(("d_ep", "r_ep", "e_ep"))
    }
    closed = {"d_ep": {"x": 2e-9, "theta": 3e-6}}
    figure = drift._plateaus(found, made(7), closed)
    part = TIME <= 1.0
    for axes, (name, factor, level) in zip(
        figure.axes, (("x", 1e9, 2.0), ("theta", 1e6, 3.0)), strict=True
    ):
        runs = [*found.values(), made(7)]
        drawn = [each for each in axes.lines if len(each.get_xdata()) > 2]
        (line,) = axes.lines[1:2]
        for each, run in zip(drawn, runs, strict=True):
            has(each, TIME[part], factor * run[name][part])
        assert line.get_ydata() == pytest.approx([level] * 2)


def test_the_staircase_is_drawn_within_its_limits():
    time = np.linspace(0.0, 5.0, 1001)
    random = np.random.default_rng(0)
    found = {
        name: random.normal(size=(1001, 3)) for name in ("plain", "bilinear", "rod")
    }
    figure = staircase._zoom(time, found, {"high": {"time": 1.2}, "low": {"time": 3.7}})
    expected = (
        (0, (0.79, 0.97)),
        (2, (0.79, 0.97)),
        (0, (1.155, 1.23)),
        (1, (3.64, 3.74)),
    )
    for axes, (column, (low, high)) in zip(figure.axes, expected, strict=True):
        part = (time >= low) & (time <= high)
        for line, values in zip(axes.lines, found.values(), strict=False):
            has(line, time[part], (1.0, 1.0, 1e3)[column] * values[part, column])
        assert axes.get_xlim() == pytest.approx((low, high))
        curve = facts.published_curve(
            f"staircase/bilinear/{('fx', 'fy', 'tau')[column]}"
        )
        shown = (curve.time >= low) & (curve.time <= high)
        has(
            axes.lines[4],
            curve.time[shown],
            (1.0, 1.0, 1e3)[column] * curve.values[shown],
        )
    whole = staircase._overview(time, found)
    has(whole.axes[2].lines[2], time, 1e3 * found["rod"][:, 2])


# ---------------------------------------------------------------------- velocity-driven


def wrenches(seed):
    random = np.random.default_rng(seed)
    return {
        "time": TIME,
        **{kind: random.normal(size=(len(TIME), 3)) for kind in "dre"},
    }


def test_driven_curves_are_drawn_beside_the_published_ones():
    found = wrenches(0)
    figure = driven._page({"Circle": found}, "dr", 3.4, {"d": "", "r": ""})
    for column, (axes, name) in enumerate(
        zip(figure.axes, ("fx", "fy", "tau"), strict=True)
    ):
        for line, kind in zip(axes.lines, "dr", strict=False):
            has(line, TIME, UNITS[name] * found[kind][:, column])
        for line, kind in zip(axes.lines[2:], "dr", strict=True):
            is_published(line, f"driven/Circle/{kind}/{name}", UNITS[name])
    above, below = np.reshape(driven._profile(found).axes, (2, 3))
    time = np.arange(0.0, 5.0, 1e-3)
    for column, factor in enumerate((1e3, 1e3, 1.0)):
        has(
            above[column].lines[0],
            time,
            factor * driven.published_velocity()(time)[:, column],
        )
        has(
            below[column].lines[0],
            TIME,
            (1.0, 1.0, 1e3)[column] * found["d"][:, column],
        )


def test_boxes_of_errors_stand_beside_the_published_ones():
    errors = {"Circle": boxes.errors(wrenches(0)), "Line": boxes.errors(wrenches(1))}
    figure = driven._box_plots(errors)
    for axes, (quantity, factor) in zip(
        figure.axes, (("ft", 100.0), ("tau", 1e3)), strict=True
    ):
        lines = iter(axes.lines)
        spans = iter(axes.collections)
        for place, (shape, each) in enumerate(errors.items()):
            for offset, model in ((-0.24, "corrected"), (0.12, "ellipsoid")):
                ours = np.array([*boxes.statistics(each[quantity][model]).values()])
                published = facts.published_table("box")[f"{quantity}/{shape}/{model}"]
                theirs = np.array([published[name] for name in boxes.COLUMNS[:5]])
                for shift, numbers in ((0.0, ours), (0.12, theirs)):
                    low, first, median, third, high, *most = factor * numbers
                    at = place + offset + shift
                    for ends in ((low, high), (first, third)):
                        (line,) = next(spans).get_segments()
                        expected = np.column_stack([[at, at], ends])
                        assert line == pytest.approx(expected)
                    for value in (median, *most):
                        (found,) = next(lines).get_xydata()
                        assert found == pytest.approx([at, value])
        assert list(lines) == list(spans) == []


# ---------------------------------------------------------------------- pressure that follows the load, limit surfaces


def test_cuts_and_moments_of_a_soft_finger():
    patch = load_dependent.soft_patch(1)
    loads = np.array([1.0, 3.0])
    figure = load_dependent._profiles({1: "one"}, loads)
    cut, radius, moment = figure.axes
    grid = patch.grid
    middle = np.abs(patch.positions[:, 1]) < 1e-9
    for stairs, line, load in zip(
        cut.patches, cut.lines, (1.0, load_dependent.MEAN_LOAD, 3.0), strict=True
    ):
        values, edges, _ = stairs.get_data()
        assert values == pytest.approx(1e-3 * patch.pressure_values(load)[middle])
        assert edges[:-1] == pytest.approx(
            1e3 * (patch.positions[middle, 0] - 0.5 * grid.cell_width)
        )
        assert edges[-1] - edges[-2] == pytest.approx(1e3 * grid.cell_width)
        x, pressure = line.get_xydata().T
        assert pressure.max() == pytest.approx(values.max(), rel=1e-9)
        rim = 1e3 * load_dependent.finger(1).radius(load)
        assert x[pressure > 1e-9].max() == pytest.approx(rim, abs=x[1] - x[0])
    all_loads = np.linspace(1.0, 3.0, 101)
    r, second = load_dependent.round_moments(1, all_loads)
    has(radius.lines[0], all_loads, 1e3 * r)
    has(radius.lines[1], all_loads[::5], 1e3 * patch.contact_radius(all_loads[::5]))
    has(radius.lines[2], all_loads, 1e3 * load_dependent.finger(1).radius(all_loads))
    has(moment.lines[0], all_loads, 1e6 * second)
    has(moment.lines[1], all_loads[::5], 1e6 * patch.second_moment(all_loads[::5]))


@pytest.mark.parametrize("column", [0, 1])
def test_points_of_a_section_are_those_of_its_twists(column):
    surface = pf.LimitSurfaceCells(PUBLISHED_PATCHES["NonConvex2"]())
    found = surfaces._points_of(surface, column, 8, closed=False).T
    for point, angle in zip(found, 2.0 * np.pi * np.arange(8) / 8, strict=True):
        twist = np.array([0.0, 0.0, np.cos(angle) / surface.contact_radius])
        twist[column] = np.sin(angle)
        centre = surface.centre_of_pressure
        wrench = pf.geometry.wrench_at(
            surface.wrench(pf.geometry.twist_at(twist, -centre)), centre
        )
        assert point == pytest.approx(
            [wrench[column], wrench[2] / surface.contact_radius], abs=1e-6
        ), angle


# ---------------------------------------------------------------------- beyond the paper


def test_errors_of_surfaces_are_boxes_in_newtons_and_newton_millimetres():
    random = np.random.default_rng(0)
    kinds = list(tables.KINDS)[:2]
    errors = {
        "Circle": {
            f"{kind}/{what}": random.random(50)
            for kind in kinds
            for what in ("force", "torque")
        }
    }
    for axes, (what, factor) in zip(
        tables.surface_errors(errors).axes,
        (("force", 1.0), ("torque", 1e3)),
        strict=True,
    ):
        for i, kind in enumerate(kinds):
            parts = factor * np.percentile(
                errors["Circle"][f"{kind}/{what}"], [5, 25, 50, 75, 95]
            )
            assert box_of(axes, i) == pytest.approx([0.15 * (i - 0.5), *parts])


def test_the_spin_of_line_and_disc_and_the_drift_on_grooves():
    place = np.linspace(0.0, 0.01, 11)
    random = np.random.default_rng(0)
    shapes = ("Line", "Circle")
    kinds = ("sum", "exact")
    names = [
        f"{shape}/{kind}{end}"
        for shape in shapes
        for kind in kinds
        for end in ("", ", force")
    ]
    stairs = {"place": place, **{name: random.random(11) for name in names}}
    line, disc = np.reshape(tables.staircase(stairs).axes, (2, 2))
    for column, (end, factor) in enumerate((("", 1e3), (", force", 1.0))):
        has(line[column].lines[0], 1e3 * place, factor * stairs[f"Line/sum{end}"])
        has(line[column].lines[1], 1e3 * place, factor * stairs[f"Line/exact{end}"])
        apart = (
            1e3 * factor * (stairs[f"Circle/sum{end}"] - stairs[f"Circle/exact{end}"])
        )
        has(disc[column].lines[0], 1e3 * place, apart)
    numbers = {
        "slope": np.radians([31.0, 35.0, 40.0]),
        **{kind: [0.1, 0.2, 0.3] for kind in contacts.GROOVED_MODELS},
    }
    closed, *models = tables.grooves(numbers).axes[0].lines
    assert closed.get_xydata()[-1] == pytest.approx(
        [40.0, np.degrees(contacts.closed_drift(np.radians(40.0)))]
    )
    for each in models:
        has(each, [31.0, 35.0, 40.0], np.degrees([0.1, 0.2, 0.3]))


# ---------------------------------------------------------------------- convergence


def test_the_profile_of_velocities_is_drawn_in_centimetres_and_radians():
    _, axes = looks.panels(4.0, 3.0)
    convergence._draw_profile(axes)
    profile = convergence_runs.profile()
    for i, (name, factor) in enumerate((("vx", 1e2), ("vy", 1e2), ("omega", 1.0))):
        has(axes.lines[2 * i], profile.times, factor * profile.values[:, i])
        is_published(axes.lines[2 * i + 1], f"convergence/velocity/{name}", factor)


def test_errors_over_counts_are_drawn_beside_the_published_ones():
    counts = [5, 7, 11]
    random = np.random.default_rng(0)
    family = convergence_runs.FAMILIES[0]
    case = ("LineGrad", "p1")
    errors = {case: {name: random.random((3, 2)) for name in convergence_runs.FAMILIES}}
    figure = convergence._errors_over_counts(family, counts, errors)
    for i, (axes, quantity) in enumerate(
        zip(figure.axes[:2], convergence.QUANTITIES, strict=True)
    ):
        has(axes.lines[0], counts, errors[case][family][:, i])
        is_published(axes.lines[1], f"convergence/{family}/LineGrad/p1/{quantity}", 1.0)
    radii = {"mask": np.array([-0.1, 0.2, -0.3]), "cut": np.array([0.01, -0.02, 0.03])}
    lines = (
        convergence._radius_errors(counts, radii, np.array([0.5, 0.6, 0.7]))
        .axes[0]
        .lines
    )
    for line, values in zip(
        lines,
        (np.abs(radii["mask"]), [0.5, 0.6, 0.7], np.abs(radii["cut"])),
        strict=True,
    ):
        has(line, counts, values)


# ---------------------------------------------------------------------- classics and timing


def test_the_classics_are_drawn_in_the_units_of_their_axes():
    names = ["stick-slip", "presliding"]
    names += [f"break-away, {rate:g} N/s" for rate in classics.RATES]
    names += [f"lag, {frequency:g} rad/s" for frequency in classics.FREQUENCIES]
    found = {
        name: made(i) | {"vx": np.random.default_rng(90 + i).random(501)}
        for i, name in enumerate(names)
    }
    hunted = {"time": TIME, "x": np.sin(TIME), "force": np.cos(TIME)}
    slip, loop, away, lag, hunting, force = classics._figure(found, hunted).axes
    has(slip.lines[0], TIME, found["stick-slip"]["x"])
    has(slip.lines[1], TIME, classics.PULL * TIME)
    has(loop.lines[0], 1e6 * found["presliding"]["x"], -found["presliding"]["fx"])
    has(
        away.lines[0],
        classics.RATES,
        [-found[f"break-away, {rate:g} N/s"]["fx"].min() for rate in classics.RATES],
    )
    last = TIME >= 2.5
    for line, frequency in zip(lag.lines, classics.FREQUENCIES, strict=True):
        run = found[f"lag, {frequency:g} rad/s"]
        has(line, 1e3 * run["vx"][last], -run["fx"][last])
    has(hunting.lines[0], TIME, hunted["x"])
    assert hunting.lines[1].get_ydata() == pytest.approx([classics.GOAL] * 2)
    has(force.lines[0], TIME, hunted["force"])


def test_times_over_errors_have_bars_from_quartile_to_quartile():
    entry = {"tolerance": 1e-6, "error": 2e-7, "evaluations": 321.0, "repeats": 5}
    entry |= dict(zip(timing.TIMES, (0.02, 0.018, 0.025), strict=True))
    problem = type(
        "Problem", (), {"name": "case", "window": SimpleNamespace(states=12)}
    )()
    (axes,) = timing._figure({problem: {"RODAS4": [entry]}}).axes
    has(axes.lines[0], [2e-7], [0.02])
    (bar,) = axes.collections[0].get_segments()
    assert bar[:, 1] == pytest.approx([0.018, 0.025])
    table = timing._points_table(problem, {"RODAS4": [entry]})
    assert (
        list(table.rows[0]) == ["RODAS4, 1e-06", "2.0e-07", "20 (18 to 25)", 321, 5]
        and "12 states" in table.note
    )
    data = timing._dataset({"RODAS4": [entry]})
    assert float(data["time"][0]) == 0.02 and data["solver"].values.tolist() == [
        "RODAS4"
    ]


def test_errors_of_few_discs_are_drawn_over_their_number():
    random = np.random.default_rng(0)
    names = ("8 discs", "16 discs", "published", "all")
    errors = {name: {words: random.random() for words in cells.LINES} for name in names}
    lines = cells.figure(errors).axes[0].lines
    for i, words in enumerate(cells.LINES):
        has(
            lines[2 * i], [8, 16], [errors["8 discs"][words], errors["16 discs"][words]]
        )
        assert lines[2 * i + 1].get_ydata() == pytest.approx(
            [errors["published"][words]] * 2
        )
