"""The page "Try it" in Chromium: its numbers are those of the Python that it shows, and its links keep its state."""

import contextlib
import io
import re

import numpy as np
import pytest

from tests.support.browser_pages import Pupil
from tests.support.repository import ROOT

PAGE = ROOT / "docs" / "static" / "try.html"
pytestmark = [
    pytest.mark.slow,
    pytest.mark.explore,
    pytest.mark.skipif(not PAGE.exists(), reason="no docs beside these tests"),
]
SHAPES = "disc", "rectangle", "fingertip", "ring", "pads", "draw"


@pytest.fixture(scope="module")
def visitor(browser):
    return Pupil(browser, PAGE)


def printed(visitor):
    """Run the code of the page, and return what it prints and its lines."""
    text = visitor.page.locator("#code").inner_text()
    assert max(map(len, text.splitlines())) <= 88
    out = io.StringIO()
    with contextlib.redirect_stdout(out):
        exec(compile(text, "try", "exec"), {})
    return [float(each) for each in re.findall(r"-?\d[\d.e+-]*", out.getvalue())]


def number(text):
    return float(text.replace("\N{MINUS SIGN}", "-"))


@pytest.mark.parametrize("shape", SHAPES)
def test_numbers_are_those_of_the_code_beside_them(visitor, shape):
    """Wrenches are exact, least grips those of the patch itself, angles and distances those of longer steps."""
    page = visitor.page
    page.evaluate("shape => state.set({...FIRST, shape, vy: 3, width: 24})", shape)
    visitor.frame()
    shown = visitor.table()[0] / [1.0, 1.0, 1e3]
    assert np.allclose(printed(visitor), shown, rtol=0.0, atol=[6e-4, 6e-4, 6e-7])

    page.locator("#to-hold").click()
    visitor.frame()
    words = page.locator("#verdict").inner_text()
    needed = float(re.search(r"needs ([\d.]+) N", words)[1])
    assert printed(visitor) == [pytest.approx(needed, rel=8e-3)]
    assert words.startswith("Holds" if needed <= 5.0 else "Slips")

    page.locator("#to-hand").click()
    visitor.frame()
    words = page.locator("#handend").inner_text()
    angle = np.radians(number(re.search(r"turned by (\S+)°", words)[1]))
    assert printed(visitor) == [pytest.approx(angle, rel=0.01, abs=1e-3)]

    page.locator("#to-puck").click()
    visitor.frame()
    words = page.locator("#puckend").inner_text()
    slid = 1e-3 * float(re.search(r"slides ([\d.]+) mm", words)[1])
    assert printed(visitor) == [pytest.approx(slid, rel=0.01)]
    assert visitor.errors == []


@pytest.mark.parametrize("width", [1280, 400])
def test_all_that_can_be_dragged(browser, width):
    visitor = Pupil(browser, PAGE, width, has_touch=width == 400)
    page = visitor.page
    before = visitor.table()
    visitor.drag("#map", (0.5, 0.5), (0.7, 0.5))
    assert (visitor.table() != before).any()
    omega, vy = page.evaluate("[state.values.omega, state.values.vy]")
    side = page.evaluate("2.2 * 2 * halfSize(state.values)")
    assert -vy / omega == pytest.approx(1e3 * 0.2 * side, rel=0.05)
    if width == 400:
        box = page.locator("#map").bounding_box()
        page.touchscreen.tap(
            box["x"] + 0.3 * box["width"], box["y"] + 0.5 * box["height"]
        )
        visitor.frame()
        assert page.evaluate("state.values.vy / state.values.omega") > 0.0
        vy = page.evaluate("state.values.vy")
    page.locator("#shape").select_option("draw")
    visitor.frame()
    map_before = page.evaluate("state.values.map")
    visitor.drag("#map", (0.4, 0.6), (0.6, 0.6))
    painted = page.evaluate("state.values.map")
    assert painted != map_before and page.evaluate("state.values.vy") == vy
    page.get_by_label("pressure to paint").fill("8")
    page.locator("#map").focus()
    page.keyboard.press("ArrowDown")
    page.keyboard.press("Enter")
    visitor.frame()
    assert page.evaluate("state.values.map") != painted
    page.get_by_role("button", name="Clear").click()
    visitor.frame()
    assert page.evaluate("contact.discs.length") == 4
    page.get_by_role("button", name="Move the centre of rotation").click()
    visitor.drag("#map", (0.5, 0.5), (0.5, 0.3))
    assert page.evaluate("contact.discs.length") == 4
    for tab in ("hold", "hand", "puck", "slide"):
        page.locator(f"#to-{tab}").click()
        visitor.frame()
        assert page.evaluate("document.documentElement.scrollWidth") <= width
        outside = page.evaluate(
            "() => [...document.querySelectorAll('button, input, select, canvas')]"
            ".filter((each) => each.offsetParent && each.getBoundingClientRect().right > innerWidth).length"
        )
        assert outside == 0
    assert visitor.errors == [] and len(visitor.asked) == 1


def test_a_link_keeps_the_state(browser):
    visitor = Pupil(browser, PAGE)
    page = visitor.page
    page.locator("#to-hold").click()
    page.locator("#shape").select_option("ring")
    visitor.frame()
    visitor.put("mass", 0.31)
    visitor.put("offset", -20)
    visitor.put("acceleration", 3)
    words = page.locator("#verdict").inner_text()
    other = Pupil(browser, PAGE)
    other.page.goto("about:blank")
    other.page.goto(page.url)
    other.page.wait_for_selector("#code:has-text('holding_load')")
    other.frame()
    assert other.page.locator("#verdict").inner_text() == words
    other.page.goto("about:blank")
    other.page.goto(
        PAGE.as_uri() + "#tab=x&map=000&mu=1e99&width=nan&grip=-5&shape=__proto__&cell="
    )
    other.page.wait_for_selector("#numbers td")
    assert np.isfinite(other.table()).all() and other.errors == []


def test_hard_settings_leave_no_error(browser):
    """Ends of all sliders, one by one: numbers stay finite."""
    visitor = Pupil(browser, PAGE)
    page = visitor.page
    ends = page.evaluate(
        "Object.entries(state.legal).filter(([, rule]) => Array.isArray(rule))"
    )
    for tab in ("slide", "hold", "hand", "puck"):
        for name, rule in ends:
            for value in rule:
                for shape in ("disc", "pads"):
                    page.evaluate(
                        "more => { state.set({...FIRST, ...more}); draw(); }",
                        {"tab": tab, "shape": shape, name: value},
                    )
        text = page.locator(f"#tab-{tab}").inner_text()
        assert "NaN" not in text and "Infinity" not in text
    assert visitor.errors == []
