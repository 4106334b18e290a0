"""The explorer in a real browser, without a window: every control, files that are no maps, two visitors at once."""

import re
import shutil
import subprocess
import sys

import numpy as np
import pytest

from planarfriction.laws import LAWS

pytestmark = [pytest.mark.slow, pytest.mark.explore]

pytest.importorskip("panel", reason="needs Panel, the extra [explore]")
playwright = pytest.importorskip(
    "playwright.sync_api", reason="needs Playwright, the extra [browser]"
)

CHROMIUM = (
    shutil.which("chromium")
    or shutil.which("chromium-browser")
    or shutil.which("google-chrome")
)
SOFTWARE_GL = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]

NEXT_ANSWER = """async (before) => {
    const find = (root) => {
        for (const each of root.querySelectorAll("*")) {
            const found = each.id === "answer" ? each : each.shadowRoot && find(each.shadowRoot);
            if (found) return found;
        }
        return null;
    };
    const begin = performance.now();
    for (;;) {
        await new Promise(requestAnimationFrame);
        const found = find(document);
        if (found && found.innerHTML !== before) return [performance.now() - begin, found.innerHTML];
        if (performance.now() - begin > 30000) return [null, before];
    }
}"""
"""Waits until the numbers are others than before: the time that took [ms], and the numbers."""

BOXES = """(wanted) => {
    const found = [], walk = (root, around) => {
        for (const each of root.children || []) {
            const style = getComputedStyle(each), inside = style.borderRadius === "8px" ? each : around;
            if (each.matches(wanted)) {
                const [one, card] = [each, inside].map((box) => box.getBoundingClientRect());
                found.push([one.left, one.right, one.top, one.bottom, card.left, card.right, style.opacity]);
            }
            if (each.shadowRoot) walk(each.shadowRoot, inside);
            walk(each, inside);
        }
    };
    walk(document.body, document.body);
    return found.filter((box) => box[1] > box[0]);
}"""
"""Finds the sides of what is wanted: left, right, top and bottom on the screen, left and right of its card; opacity."""


@pytest.fixture(scope="module")
def address():
    command = [
        sys.executable,
        "-c",
        "import sys; from planarfriction.cli import main; sys.exit(main())",
        "explore",
    ]
    with subprocess.Popen(
        [*command, "--no-browser"], stderr=subprocess.PIPE, text=True
    ) as process:
        try:
            yield re.search(r"http://localhost:\d+", process.stderr.readline())[0]
        finally:
            process.terminate()


@pytest.fixture(scope="module")
def browser():
    if CHROMIUM is None:
        pytest.skip(
            "needs Chromium: no chromium, chromium-browser or google-chrome on the path"
        )
    with playwright.sync_playwright() as driver:
        chromium = driver.chromium.launch(executable_path=CHROMIUM, args=SOFTWARE_GL)
        yield chromium
        chromium.close()


class Visitor:
    """A page in the browser, and what stands on it."""

    def __init__(self, browser, address):
        context = browser.new_context(viewport={"width": 1500, "height": 1100})
        context.grant_permissions(["clipboard-read", "clipboard-write"], origin=address)
        self.page = context.new_page()
        self.errors = []
        self.elsewhere = []
        self.page.on("pageerror", lambda error: self.errors.append(str(error)))
        self.page.on(
            "request",
            lambda asked: (
                self.elsewhere.append(asked.url) if self._outside(asked.url) else None
            ),
        )
        self.address = address
        self.page.goto(address)
        self.page.wait_for_selector("#answer", timeout=60_000)

    def _outside(self, url):
        return not url.startswith(
            (self.address, "data:", "blob:", self.address.replace("http", "ws"))
        )

    def text(self):
        return self.page.locator("#answer").inner_text()

    def numbers(self):
        """Wrenches of law, surface and ellipsoid, `[3, 3]` [N, N, N mm]."""
        return np.array(
            [
                [float(each) for each in row.split("\t")[1:]]
                for row in self.text().splitlines()[1:4]
            ]
        )

    def message(self):
        return self.page.locator("#message").inner_text(timeout=5000)

    def code(self, kind="python"):
        return self.page.locator(f".{kind} textarea").input_value()

    def says(self, *words):
        """Return True once the code has these words, False after ten seconds: it is written after a pause."""
        for _ in range(100):
            if all(each in self.code() for each in words):
                return True
            self.page.wait_for_timeout(100)
        return False

    def after(self, act):
        """Numbers once `act` has changed them."""
        before = self.page.locator("#answer").inner_html()
        act()
        time, _ = self.page.evaluate(NEXT_ANSWER, before)
        assert time is not None, "nothing changed"
        return self.text()

    def boxes(self, wanted):
        """Return the sides of all `wanted` on the screen and of their cards, and their opacity, `[K, 7]` [px]."""
        return np.array(self.page.evaluate(BOXES, wanted), dtype=float)

    def ladder(self):
        return self.page.locator("#ladder").inner_text()

    def ladder_after(self, act, before):
        """The whole ladder once `act` has changed it."""
        act()
        for _ in range(600):
            whole = (
                self.page.locator("#ladder tr").count() == 6
                and "For the patch" in self.status()
            )
            if whole and self.ladder() != before:
                return self.ladder()
            self.page.wait_for_timeout(200)
        raise AssertionError("the ladder did not change")

    def status(self):
        return self.page.locator("#ladder-status").inner_text()

    def choose(self, control, value):
        self.page.locator(f".{control} select").select_option(value)

    def fill(self, control, value):
        field = self.page.locator(f".{control} input").first
        field.fill(value)
        field.press("Enter")

    def tool(self, name):
        self.page.locator(".tool").get_by_text(name, exact=True).click()

    def place(self, x, y):
        """Return the position on the screen of a point of the map [mm]."""
        return tuple(
            self.page.evaluate(
                """([x, y]) => {
                    const view = Bokeh.index.query_one((each) => each.model.name === "map");
                    const canvas = view.canvas_view.el.getBoundingClientRect(), frame = view.frame;
                    return [canvas.x + frame.x_scale.compute(x), canvas.y + frame.y_scale.compute(y)];
                }""",
                [x, y],
            )
        )

    def drag(self, *points):
        places = [self.place(*point) for point in points]
        self.page.mouse.move(*places[0])
        self.page.mouse.down()
        for place in places[1:]:
            self.page.mouse.move(*place, steps=4)
        self.page.mouse.up()


@pytest.fixture
def visitor(browser, address):
    """A new page; nothing may fail in it or ask another computer for anything."""
    one = Visitor(browser, address)
    yield one
    one.page.context.close()
    assert one.errors == [] and one.elsewhere == []


def test_a_drag_moves_the_centre_of_rotation_to_the_pointer(visitor):
    visitor.after(lambda: visitor.drag((0.0, 10.0), (3.0, 5.0), (5.0, -4.0)))
    visitor.page.wait_for_timeout(500)
    x, y = map(
        float, re.search(r"rotation: \((.*?), (.*?)\) mm", visitor.text()).groups()
    )
    assert (x, y) == pytest.approx((5.0, -4.0), abs=0.1)  # a pixel is 0.05 mm
    twist = re.search(
        r"twist, normal_force = \((.*?), (.*?), 1.0\)", visitor.code()
    ).groups()
    assert [float(each) for each in twist] == pytest.approx(
        [1e-3 * y, -1e-3 * x], abs=1e-5
    )


def test_a_drag_gives_the_velocity_and_friction_points_against_it(visitor):
    visitor.tool("Velocity")
    visitor.after(lambda: visitor.drag((0.0, 0.0), (0.0, 5.0)))
    visitor.page.wait_for_timeout(500)
    friction = visitor.numbers()[0]
    assert friction[1] < -0.9 and abs(friction[0]) < 0.05


def test_a_brush_paints_and_an_eraser_takes_away(visitor):
    visitor.after(lambda: visitor.choose("patch", "Circle"))
    visitor.tool("Eraser")
    visitor.after(lambda: visitor.drag((-3.0, 0.0), (3.0, 0.0)))
    visitor.page.wait_for_timeout(1000)
    assert (
        visitor.says("from_pressure([")
        and visitor.page.locator(".patch select").input_value() == "own map"
    )
    erased = visitor.code()
    visitor.tool("Brush")
    visitor.page.locator(".brush .noUi-handle").press("ArrowRight")
    visitor.page.locator(".pressure .noUi-handle").press("ArrowLeft")
    visitor.after(lambda: visitor.drag((-3.0, 0.0), (3.0, 0.0)))
    visitor.page.wait_for_timeout(1000)
    assert visitor.says(", 0.9,") and ", 0.9," not in erased


def test_what_is_on_the_screen_can_be_copied(visitor):
    visitor.page.locator(".copy-python button").click()
    assert visitor.page.evaluate("navigator.clipboard.readText()") == visitor.code()
    visitor.page.get_by_text("Scene file (TOML)").click()
    visitor.page.locator(".copy-toml button").click()
    assert 'kind = "lugre"' in visitor.page.evaluate("navigator.clipboard.readText()")


def test_a_drag_is_not_held_up_by_the_ladder(visitor):
    visitor.page.get_by_text("Models", exact=True).click()
    visitor.page.locator("#ladder").wait_for(timeout=120_000)
    # Each begins in the pause in which the models of a new law are made.
    for step in range(4):
        visitor.fill("sigma_0", str(2e5 + step))
        visitor.page.wait_for_timeout(400)
        visitor.after(lambda step=step: visitor.drag((0.0, 10.0), (3.0, 5.0 - step)))
    visitor.ladder_after(lambda: None, "")
    assert visitor.page.locator("#ladder tr").count() == 6


def test_a_scene_is_run_and_watched_while_the_page_goes_on(visitor):
    visitor.page.get_by_text("Run a scene").click()
    visitor.choose("scene", "free-slide")
    visitor.choose("model", "distributed")
    run = visitor.page.locator(".run button")
    run.click()
    visitor.page.get_by_text("Drawing:").wait_for(timeout=120_000)
    assert run.inner_text() == "Stop"
    run.click()
    visitor.page.get_by_text("Stopped.").wait_for()
    run.click()
    visitor.after(lambda: visitor.fill("load", "3"))  # meanwhile
    film = visitor.page.frame_locator("#film")
    picture = film.locator("img")
    slider = film.locator("input[type=range]")
    picture.wait_for(timeout=120_000)
    assert (
        picture.evaluate("(each) => each.naturalWidth") > 500
        and run.inner_text() == "Run"
    )
    assert (
        visitor.page.locator("#histories").evaluate("(each) => each.naturalWidth")
        > 1000
    )
    visitor.page.wait_for_timeout(1000)
    assert int(slider.input_value()) > 0  # it plays by itself
    film.get_by_title("Pause").click()
    slider.fill("40")
    shown = picture.get_attribute("src")
    film.get_by_title("Next frame").click()
    assert slider.input_value() == "41" and picture.get_attribute("src") != shown
    film.get_by_title("Play", exact=True).click()
    visitor.page.wait_for_timeout(1000)
    assert int(slider.input_value()) != 41


def test_a_link_opens_what_was_on_the_screen_and_another_one_replaces_it(
    visitor, browser
):
    visitor.after(lambda: visitor.choose("example", "L-shaped foot"))
    visitor.after(lambda: visitor.fill("mass", "70.3"))
    visitor.after(lambda: visitor.choose("law", "dahl"))
    visitor.page.locator(".link button").click()
    assert "address" in visitor.message()
    visitor.page.wait_for_function("location.hash.length > 100")
    other = Visitor(browser, visitor.address)
    first = other.text()
    # An address of the same page: no new visit.
    other.after(lambda: other.page.goto(visitor.page.url))
    assert (
        other.says("pf.Dahl(", "from_pressure(")
        and (other.numbers() == visitor.numbers()).all()
    )
    assert other.page.locator(".mass input").input_value() == "70.3"
    other.after(other.page.locator(".undo button").click)
    assert other.text().splitlines()[:4] == first.splitlines()[:4]
    other.page.reload()
    assert other.says("pf.Dahl(")
    other.page.goto(visitor.address + "/#%7B%22mass%22:-1%7D")
    assert "mass must be > 0" in other.message()
    other.page.context.close()
    assert other.errors == [] and other.elsewhere == []


def test_the_map_is_saved_as_a_picture(visitor):
    with visitor.page.expect_download() as saved:
        visitor.page.locator(".bk-tool-icon-save").click()
    assert saved.value.suggested_filename == "map.png"
    assert saved.value.path().read_bytes().startswith(b"\x89PNG")


def test_a_phone_shows_the_pictures_then_the_controls_then_the_code(visitor):
    visitor.page.set_viewport_size({"width": 400, "height": 800})
    visitor.page.wait_for_timeout(1000)
    tops = [
        visitor.page.locator(each).first.bounding_box()["y"]
        for each in (".example", ".tool", "#answer", ".load", ".python")
    ]
    assert tops == sorted(tops) and tops[1] < 400.0
    assert visitor.page.evaluate("document.documentElement.scrollWidth") <= 400
    visitor.page.locator(".mu_s .bk-description").hover()
    tooltip = visitor.page.get_by_text("Static (breakaway) coefficient").bounding_box()
    assert tooltip["x"] > 0.0 and tooltip["x"] + tooltip["width"] < 400.0


def test_a_phone_sees_what_is_wrong_at_the_field_and_below(visitor):
    visitor.page.set_viewport_size({"width": 400, "height": 800})
    before = visitor.boxes(".mu_s")[0]
    visitor.fill("mu_s", "0.5")
    line, field = visitor.page.locator("#message"), visitor.page.locator(".mu_s")
    line.wait_for()
    line = line.bounding_box()
    field = field.bounding_box()
    assert field["height"] > before[3] - before[2] + 20.0  # for the reason
    assert (
        field["y"] > 0.0
        and field["y"] + field["height"] < line["y"]
        and line["y"] + line["height"] < 800.0
    )


@pytest.mark.parametrize(
    ("width", "height"), [(1280, 720), (800, 900), (400, 800), (360, 740)]
)
def test_nothing_leaves_its_card_and_sliders_come_first(visitor, width, height):
    visitor.page.set_viewport_size({"width": width, "height": height})
    visitor.page.wait_for_timeout(1000)
    assert visitor.boxes(".vx, .vy, .omega")[:, 3].max() < height / 2
    for kind in LAWS:
        visitor.choose("law", kind)
        visitor.page.wait_for_timeout(300)
        marks = visitor.boxes(".bk-description, .bk-TooltipIcon")
        assert (
            len(marks) > 12
            and (marks[:, 0] > marks[:, 4]).all()
            and (marks[:, 1] < marks[:, 5] - 13.0).all()
        ), kind
    tabs = visitor.boxes(".bk-tab")
    assert len(tabs) == 5 and (tabs[:, 1] < tabs[:, 5]).all()
    code = visitor.page.locator(".python textarea")
    assert code.evaluate("(each) => each.scrollWidth - each.clientWidth") <= 0


def test_two_visitors_do_not_change_each_other(visitor, browser, address):
    other = Visitor(browser, address)
    before = other.text(), other.code()
    visitor.after(lambda: visitor.choose("patch", "NonConvex2"))
    visitor.after(lambda: visitor.fill("load", "5"))
    assert (other.text(), other.code()) == before
    other.after(lambda: other.choose("patch", "Line"))
    assert visitor.says("NonConvex2") and other.says("'Line'")
    other.page.context.close()
    assert other.errors == []
