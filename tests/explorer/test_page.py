"""The page of the explorer and its server without a browser: controls, messages, work in the background, loopback."""

import gc
import re
import signal
import threading
import warnings
import weakref

import numpy as np
import pytest

from planarfriction.errors import FrictionError
from planarfriction.laws import LAWS, Dahl
from planarfriction.planning import holding_load
from planarfriction_explorer import pictures
from planarfriction_explorer.drawing import Drawing
from planarfriction_explorer.state import PRESETS, State, answer, to_json, to_link
from tests.support.refusals import refused

pn = pytest.importorskip("panel", reason="needs Panel, the extra [explore]")

from bokeh import events  # noqa: E402

from planarfriction_explorer.controls import CHANGED, OWN  # noqa: E402
from planarfriction_explorer.live import GivenUp, Live  # noqa: E402
from planarfriction_explorer.page import Page  # noqa: E402
from planarfriction_explorer.server import open_server  # noqa: E402
from planarfriction_explorer.views import MapView, SectionView  # noqa: E402


@pytest.fixture
def page():
    return Page()


def shown(page):
    """Wrenches of law, surface and ellipsoid that stand on the page [N, N, N mm], `[3, 3]`."""
    cells = re.findall(r"<td>(-?[\d.]+)</td>", page.numbers.object)
    return np.array(cells, dtype=float).reshape(3, 3)


def test_a_rectangle_of_two_sides_with_units(page):
    page.controls.sides.value = "12x20mm"
    drawing = page.state.drawing
    assert (drawing.width, drawing.height) == pytest.approx((0.012, 0.02))
    assert page.controls.patch.value == OWN
    page.controls.sides.value = "12x20in"
    assert "must be a length such as 60mm" in page.message.object
    assert page.state.drawing is drawing
    page.controls.patch.value = "Square"
    assert page.controls.sides.value == ""
    with refused("the rectangle must have sides of a ratio up to 64"):
        Drawing.rectangle("1x200mm")


def test_what_stands_on_the_page_is_the_answer_to_what_is_set(page):
    page.controls.patch.value = "NonConvex2"
    page.controls.load.value = 2.5
    page.controls.vx.value = 10.0
    page.controls.vy.value = -7.0
    page.controls.omega.value = -2.0
    assert (
        page.state.twist == pytest.approx((0.01, -0.007, -2.0))
        and page.state.normal_force == 2.5
    )
    found = answer(page.state)
    wrenches = np.stack([found.friction, found.surface, found.ellipsoid]) * [
        1.0,
        1.0,
        1e3,
    ]
    # Four digits are shown.
    np.testing.assert_allclose(shown(page), wrenches, atol=5e-5)
    assert (
        f"{found.force_error:.3f}" in page.numbers.object
        and f"{found.angle_error:.1f}°" in page.numbers.object
    )
    x, y = 1e3 * np.array(page.state.centre_of_rotation)
    assert (x, y) == pytest.approx(
        (-3.5, -5.0)
    ) and f"({x:.2f}, {y:.2f}) mm" in page.numbers.object


def test_a_drag_over_the_map_does_what_the_tool_says(page):
    page._follow_to(0.003, -0.004)
    assert page.state.centre_of_rotation == pytest.approx((0.003, -0.004))
    page.controls.tool.value = "slide"
    page._follow_to(0.0, 0.005)
    assert page.state.twist[:2] == pytest.approx(
        (0.0, 0.05)
    ) and page.controls.vy.value == pytest.approx(50.0)
    page.controls.tool.value = "erase"
    page._dragged(0.0, 0.0)
    assert page.state.drawing.origin == "drawn" and page.controls.patch.value == OWN
    assert page.state.drawing.pressures[10, 10] == 0.0


def test_a_file_is_loaded_and_a_wrong_one_leaves_the_map_as_it_is(page):
    before = page.state.drawing
    page.controls.file.filename = "pad.csv"
    page.controls.file.value = b"1,x\n"
    assert (
        "pad.csv: line 1" in page.message.object
        and page.message.visible
        and page.state.drawing is before
    )
    page.controls.file.value = b"0,1\n2,0\n"
    np.testing.assert_array_equal(
        page.state.drawing.pressures, [[0.0, 1.0], [2.0, 0.0]]
    )
    assert page.state.drawing.width == pytest.approx(before.width)
    assert "2 x 2 cells of 10 mm" in page.message.object and page.message.visible


def test_a_law_has_its_fields_and_a_value_that_breaks_a_rule_is_one_line(page):
    page.controls.law.value = "dahl"
    assert list(page.controls.law_values()) == ["mu_c", "sigma_0"]
    law = page.state.law
    page.controls.parameters[0].value = -1.0
    assert (
        "mu_c must be &gt; 0" in page.message.object
        and page.message.visible
        and page.state.law is law
    )
    page.controls.parameters[0].value = 0.4
    assert page.state.law.mu_c == 0.4 and not page.message.visible


def test_a_refused_value_is_told_at_its_field_beside_pale_results(page):
    page.layout()
    static = page.controls.parameters[1]
    mass = page.controls.mass
    static.value = 0.5
    assert (
        "mu_s must be >= mu_c, got mu_s=0.5, mu_c=1.0" in static.stylesheets[0]
        and "Pale" in page.message.object
    )
    assert len(page.cards) == 3 and all(
        each.css_classes == ["stale"] for each in page.cards
    )
    page.controls.parameters[0].value = 2.0  # refused too, and now the culprit
    assert (
        static.stylesheets == []
        and "mu_c=2.0" in page.controls.parameters[0].stylesheets[0]
    )
    page._try(lambda: page._follow_to(0.003, -0.004))
    # Those of the results.
    assert [each.value for each in page.controls.parameters[:2]] == [
        1.0,
        1.2,
    ]
    assert page.controls.parameters[0].stylesheets == [] and not any(
        each.css_classes for each in page.cards
    )
    mass.value = -1.0
    assert "mass must be > 0" in mass.stylesheets[0]
    page.controls.clear.clicks += 1
    page.controls.cell_size.value = 2.0  # right, while nothing presses
    assert mass.stylesheets == page.controls.cell_size.stylesheets == []
    assert "Nothing presses" in page.message.object and page.controls.mass.value == 50.0


def test_a_law_that_is_chosen_again_has_its_values(page):
    first = page.state.law
    page.controls.law.value = "dahl"
    page.controls.parameters[0].value = 0.4
    page.controls.law.value = "lugre"
    assert (
        page.state.law == first
        and first.mu_s == 1.2
        and first.elasto_plastic is not None
    )
    assert page.controls.law_values()["mu_s"] == 1.2
    page.controls.law.value = "dahl"
    assert page.state.law.mu_c == 0.4


def test_the_page_says_whether_a_part_is_held_with_its_mass_and_friction(page):
    page.controls.mass.value = 80.0
    page.controls.lever.value = 5.0
    page._show_slow()
    weight = 0.04 * 9.81
    needed = holding_load(
        (0.0, -weight, -0.005 * weight), page.state.drawing.patch, page.state.law.mu_s
    )
    assert (
        f"<b>{needed:.3g} N</b>" in page.grid.object
        and "<b>holds</b>" in page.grid.object
    )
    page.controls.parameters[0].value = 0.2
    page.controls.parameters[1].value = 0.2
    page._show_slow()
    assert "slips</span>" in page.grid.object
    page.controls.mass.value = -1.0
    assert "mass must be &gt; 0" in page.message.object


def test_each_control_says_what_it_is_in_the_unit_of_its_label(page):
    rows = page.layout().select(pn.Row)
    icons = {
        row[0]: row[1].value
        for row in rows
        if isinstance(row[1], pn.widgets.TooltipIcon)
    }
    found = [
        each
        for name, each in vars(page.controls).items()
        if isinstance(each, pn.widgets.base.Widget)
    ]
    for kind in LAWS:
        page.controls.law.value = kind
        found += page.controls.parameters
    tab = page.scenes
    found += [tab.scene, tab.model, tab.pad, tab.modulus, tab.thickness]
    for each in found:
        words = getattr(each, "description", None) or icons[each]
        unit = re.search(r"\[[^]]+\]", each.label or "")
        assert len(words) > 5 and (unit is None or unit[0] in words), each.label
    assert (
        "Stribeck speed [m/s]"
        in {each.label: each.description for each in found if each.tags}["v_s [m/s]"]
    )


OTHER = State(
    Drawing(np.ones((2, 3)), 2e-3),
    Dahl(mu_c=0.3),
    2.5,
    (0.01, -0.02, 3.0),
    0.0703,
    -0.004,
)


def test_another_state_sets_every_control(page):
    page._follow_link(to_link(OTHER))
    controls = page.controls
    assert (
        to_json(page.state) == to_json(OTHER)
        and controls.patch.value == OWN
        and controls.law.value == "dahl"
    )
    found = [
        getattr(controls, name).value
        for name in ("cell_size", "load", "mass", "lever", "vx", "vy", "omega")
    ]
    assert (
        found == [2.0, 2.5, 70.3, -4.0, 10.0, -20.0, 3.0]
        and controls.law_values()["mu_c"] == 0.3
    )
    np.testing.assert_allclose(
        shown(page)[1], answer(OTHER).surface * [1.0, 1.0, 1e3], atol=5e-5
    )
    assert "mu_c=0.3" in page.python.value and page.controls.example.value == CHANGED


def test_a_link_that_holds_no_state_leaves_the_page_as_it_is(page):
    before = page.state
    page._try(lambda: page._follow_link("#%7B%22mass%22:-1%7D"))
    assert (
        "mass must be &gt; 0" in page.message.object
        and page.message.visible
        and page.state is before
    )
    page._try(lambda: page._follow_link(""))
    assert page.state is before and page.controls.undo.disabled


@pytest.mark.parametrize("name", PRESETS)
def test_an_example_is_shown_until_something_is_changed(page, name):
    page.controls.example.value = name
    assert (
        page.state is PRESETS[name] and shown(page).any() and not page.message.visible
    )
    page.controls.mass.value = 77.0
    assert page.controls.example.value == CHANGED and page.state.mass == 0.077
    page.controls.undo.clicks += 1
    assert (
        page.controls.example.value == name
        and page.controls.mass.value == pytest.approx(1e3 * page.state.mass)
    )


def test_undo_goes_back_step_by_step_and_a_drag_is_one(page):
    def drag(tool):
        page.controls.tool.value = tool
        for x in (0.0, 1e-3, 2e-3, 3e-3):
            if tool == "brush":
                page._dragged(x, 0.0)
            else:
                page._follow()
                # Which `_dragged` leaves to be followed in the next tick.
                page._pointer = (
                    x,
                    0.0,
                )
        page._released()

    states = [page.state]
    for tool in ("turn", "turn", "brush", "brush", "slide"):
        drag(tool)
        states.append(page.state)
    assert states[1].centre_of_rotation == pytest.approx((3e-3, 0.0))
    for value in (1.0, 2.0, 3.0):  # a slider that is dragged
        page.controls.vx.value = value
    page.controls.vx.param.trigger("value_throttled")
    states.append(page.state)
    page.controls.vx.value = 4.0
    for before in reversed(states):
        page.controls.undo.clicks += 1
        assert page.state is before
    assert page.controls.undo.disabled and page.controls.patch.value == "NonConvex1"
    page.controls.undo.clicks += 1
    assert page.state is states[0]


def test_undo_leaves_the_empty_map_and_brings_the_law_back(page):
    law = page.state.law
    page.controls.law.value = "dahl"
    page.controls.clear.clicks += 1
    page.controls.undo.clicks += 1
    assert shown(page).any() and not page.message.visible
    page.controls.undo.clicks += 1
    assert (
        page.state.law is law
        and page.controls.law.value == "lugre"
        and page.controls.law_values()["mu_s"] == 1.2
    )


def test_a_page_that_nobody_holds_is_freed():
    one = Page()
    one.controls.mass.value = 77.0
    layout = one.layout()
    kept = weakref.ref(one)
    del one, layout
    gc.collect()
    assert kept() is None


def test_an_empty_map_leaves_no_numbers_of_another_one(page):
    page.controls.clear.clicks += 1
    assert (
        "Nothing presses" in page.message.object and page.controls.tool.value == "brush"
    )
    assert page.numbers.object == page.grid.object == page.python.value == ""
    assert not page.surface.visible and not page.section.layout.visible
    page.controls.patch.value = "Line"
    assert (
        shown(page).any()
        and page.surface.visible
        and page.section.layout.visible
        and "'Line'" in page.python.value
    )
    assert str(page.state.drawing.patch.grid_error()) in page.grid.object


def test_a_scene_file_is_offered_and_a_wrong_one_is_one_line(page):
    scenes = page.scenes
    scenes.file.filename = "mine.toml"
    scenes.file.value = b"t_end ="
    assert (
        "mine.toml: not valid TOML" in page.message.object
        and scenes.scene.value == "in-hand"
    )
    scenes.file.value = page.toml.value.encode()
    assert (
        scenes.scene.value == "mine.toml"
        and not scenes.model.visible
        and not page.message.visible
    )
    scenes.pad.value = "layer"
    assert not (scenes.pad.visible or scenes.modulus.visible)
    scenes.scene.value = "free-slide"
    assert scenes.model.visible and scenes.pad.visible and scenes.thickness.visible


def test_a_pad_has_the_fields_that_it_needs(page):
    tab = page.scenes
    tab.modulus.value = 0.3
    assert tab._pad() is None and not (tab.modulus.visible or tab.thickness.visible)
    tab.pad.value = "half-space"
    assert tab.modulus.visible and not tab.thickness.visible
    assert tab._pad() == {"kind": "half-space", "shear_modulus": pytest.approx(0.3e6)}
    tab.pad.value = "layer"
    tab.thickness.value = None
    assert tab.thickness.visible and tab._pad()["thickness"] == 0.0


def test_the_map_has_room_around_it_and_shows_each_picture():
    places = []
    view = MapView(
        lambda x, y: places.append((x, y)), lambda: places.append("released")
    )
    view.draw(OTHER.drawing)
    assert [
        (axis.start, axis.end) for axis in (view.figure.x_range, view.figure.y_range)
    ] == [(pytest.approx(-3.6), pytest.approx(3.6))] * 2  # 0.6 of 6 mm x 4 mm
    view.move(OTHER, found := answer(OTHER))
    shown = {name: dict(source.data) for name, source in view._sources.items()}
    assert shown["slip"] == pictures.slip_arrows(OTHER) and shown[
        "wrench"
    ] == pictures.wrench_arrows(OTHER, found)
    assert (
        shown["centre"] == pictures.points_of_interest(OTHER)
        and "image" in shown["map"]
    )
    for event in (
        events.Pan(view.figure, x=2.0, y=-1.0),
        events.Tap(view.figure, x=3.0, y=4.0),
    ):
        view.figure._trigger_event(event)
    assert places[:2] == [
        pytest.approx((0.002, -0.001)),
        pytest.approx((0.003, 0.004)),
    ] and places[2:] == ["released"]


def test_the_section_is_that_of_the_friction_or_is_not_seen():
    view = SectionView()
    found = answer(OTHER)
    view.move(OTHER, found)
    angle, lines = pictures.section_lines(OTHER, found)
    assert (
        view._plot.xaxis[0].axis_label == f"force at {angle:.0f}° to x [N]"
        and view.layout.visible
    )
    for name, points in lines.items():
        data = view._sources[name].data
        np.testing.assert_array_equal(
            np.stack([data["force"], data["torque"]], -1), points
        )
    view.move(OTHER, None)
    assert not view.layout.visible


# ---------------------------------------------------------------------- work in the background


class Document:
    """A stand-in for the document of a page, which lists the callbacks that work adds."""

    def __init__(self):
        self.session_context = self
        self.destroyed = False
        self.told = []

    def add_next_tick_callback(self, act):
        self.told.append(act)


@pytest.fixture
def document(monkeypatch):
    one = Document()
    monkeypatch.setattr(type(pn.state), "curdoc", one)
    return one


def finished():
    """Wait for the threads of work."""
    for each in threading.enumerate():
        if (
            each is not threading.current_thread()
            and each.daemon
            and "run" in each.name
        ):
            each.join(10.0)


def test_a_new_wish_gives_up_the_last_one_and_what_it_said_too_late(document):
    said = []
    live = Live(said.append)
    go_on = threading.Event()
    ends = []

    def first(task):
        task.tell(said.append, "first")
        go_on.wait(10.0)
        try:
            task.check()
        except GivenUp:
            ends.append("given up")
            raise

    live.now(first)
    live.now(lambda task: task.tell(said.append, "second"))
    go_on.set()
    finished()
    for act in document.told:
        act()
    assert said == ["second"] and ends == ["given up"]


def test_refused_work_is_reported_and_work_of_a_closed_page_ends(document):
    said = []
    live = Live(said.append)

    def refused(task):
        raise FrictionError("not with this law")

    live.now(refused)
    finished()
    for act in document.told:
        act()
    assert said == ["not with this law"]
    document.told.clear()
    document.destroyed = True
    live.now(lambda task: said.append("at work"))
    finished()
    assert said == ["not with this law"] and document.told == []


# ---------------------------------------------------------------------- the server


def test_the_server_is_local_and_a_taken_port_is_one_line():
    server = open_server(0)
    try:
        addresses = {each.getsockname()[0] for each in server._http._sockets.values()}
        assert addresses == {"127.0.0.1"}
        # Tornado leaves the socket that found no port to the garbage collector, which warns.
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ResourceWarning)
            with refused("port must be free"):
                open_server(server.port)
            gc.collect()
    finally:
        server.stop()
    with refused("port"):
        open_server(70000)


def test_a_server_leaves_ctrl_c_as_it_was():
    heard = signal.getsignal(signal.SIGINT)
    open_server(0).stop()
    assert signal.getsignal(signal.SIGINT) is heard


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_both_names_of_this_computer_open_a_socket():
    """The handshake of a browser at either address; a page of another site gets 403."""
    from tornado.httpclient import HTTPClientError, HTTPRequest
    from tornado.websocket import websocket_connect

    server = open_server(0)
    server.start()
    answers = {}

    async def knock():
        for origin in (
            f"http://localhost:{server.port}",
            f"http://127.0.0.1:{server.port}",
            "http://example.org",
        ):
            # Of another host: from 6.6 on Tornado itself lets in an origin that is the host.
            headers = {"Origin": origin, "Host": f"another:{server.port}"}
            request = HTTPRequest(f"ws://127.0.0.1:{server.port}/ws", headers=headers)
            try:
                (await websocket_connect(request)).close()
                answers[origin] = 101
            except HTTPClientError as error:
                answers[origin] = error.code

    try:
        server.io_loop.run_sync(knock, timeout=60)
    finally:
        server.stop()
    assert list(answers.values()) == [101, 101, 403]
