"""The lesson: its answers from the library, and its five tasks as a pupil walks through them in Chromium."""

import json
import re

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import planarfriction as pf
from planarfriction.planning import holding_load
from tests.support.browser_module import MODULE, law_of
from tests.support.browser_pages import Pupil
from tests.support.repository import ROOT, script

SCRIPT = ROOT / "docs" / "browser" / "lesson.js"
PAGE = ROOT / "docs" / "static" / "lesson.html"
pytestmark = pytest.mark.skipif(
    not SCRIPT.exists(), reason="no docs beside these tests"
)

HERTZ = pf.patch.SoftFinger(c=0.01, n=0.0, k=2.0)
PADS = np.repeat([[1, 0, 1]], (3, 14, 3), axis=1).repeat(4, axis=0)
PATCHES = {
    "disc": pf.ContactPatch.disc(0.01),
    "fingertip": pf.ContactPatch.disc(0.01, pressure=HERTZ),
    "square": pf.ContactPatch.rectangle(0.02),
    "ring": pf.ContactPatch.ring(0.008, 0.01, cells=41),
    "bar": pf.ContactPatch.rectangle(0.02, 0.002, cells=(40, 4)),
    "pads": pf.ContactPatch.from_pressure(PADS, width=0.02),
}
WEIGHT = np.array([0.0, -0.1 * 9.81, -0.1 * 9.81 * 0.012])
"""Half of a plate of 0.2 kg, its centre of mass 12 mm beside the finger."""


def puck(patch, twist, mu=0.2, gravity=9.81):
    """Return distance and angle, time, and v/(omega r), where a puck has 0.1 % of its motion left: Coulomb friction."""
    surface = pf.LimitSurfaceExact(patch)
    square = patch.second_moment()
    size = lambda v: np.linalg.norm(np.multiply(v, [1.0, 1.0, np.sqrt(square)]))
    least = 1e-3 * size(np.array(twist))

    def rate(_, y):
        force = mu * gravity * surface.wrench(y[:3])
        return np.concatenate([force / [1.0, 1.0, square], y[:3]])

    def ends(_, y):
        return size(y[:3]) - least

    ends.terminal = True
    run = solve_ivp(
        rate, (0.0, 1.0), [*twist, 0.0, 0.0, 0.0], events=ends, rtol=1e-8, atol=1e-11
    )
    vx, vy, omega, x, y, angle = run.y[:, -1]
    ratio = np.hypot(vx, vy) / abs(omega) / patch.contact_radius() if omega else np.inf
    return np.hypot(x, y), angle, run.t[-1], ratio


def answers():
    """Numbers of the answers, by the names that these have in the page."""
    surfaces = {name: pf.LimitSurfaceExact(each) for name, each in PATCHES.items()}
    forces = lambda name, spins: [
        -surfaces[name].wrench((0.01, 0.0, spin))[0] for spin in spins
    ]
    disc = surfaces["disc"]
    radius = PATCHES["disc"].contact_radius()
    share = lambda c: np.abs(disc.wrench((0.0, -c, 1.0)))[1:] / [1.0, radius]
    shares = np.array([share(1e-3 * c) for c in (0.0, 4.0, 6.7, 10.0, 20.0)])
    equal = brentq(lambda c: np.subtract(*share(c)), 3e-3, 1e-2)
    both = share(equal)[0]
    twist = 0.0, -0.0085, 1.0
    pads = np.abs(surfaces["pads"].wrench(twist))[1:]
    ellipsoid = pf.LimitSurfaceEllipsoid(PATCHES["pads"])
    theirs = np.abs(ellipsoid.wrench(twist))[1:]
    slid, _, slide_time, _ = puck(PATCHES["disc"], (0.1, 0.0, 0.0))
    spun, _, spun_time, _ = puck(PATCHES["disc"], (0.1, 0.0, 10.0))
    square = PATCHES["disc"].second_moment()

    def bends(ratio):
        """Difference of the shares that slide and spin lose at a v/(omega R)."""
        fx, _, tau = disc.wrench((0.01 * ratio, 0.0, 1.0))
        return fx / (0.01 * ratio) - tau / square

    return {
        "force": forces("disc", (0.0, 1.0, 4.0, 10.0)),
        "ring": forces("ring", [10.0]),
        "bar": forces("bar", [10.0]),
        "shares": shares[:, 0],
        "torques": shares[:, 1],
        "both": [both],
        "equal": [1e3 * equal],
        "much": [100.0 * (np.sqrt(0.5) / both - 1.0)],
        "pad": [pads[0]],
        "padtorque": [1e3 * pads[1]],
        "padellipsoid": [theirs[0]],
        "padellipsoidtorque": [1e3 * theirs[1]],
        "padmuch": 100.0 * (theirs / pads - 1.0),
        **{
            f"hold{name}": [holding_load(WEIGHT, each, 0.6)]
            for name, each in PATCHES.items()
        },
        "holdellipsoid": [np.dot(ellipsoid.twist(-WEIGHT), WEIGHT) / 0.6],
        "slide": [1e3 * slid],
        "slidetime": [1e3 * slide_time],
        "spun": [1e3 * spun],
        "spuntime": [1e3 * spun_time],
        "ratio": [brentq(bends, 0.3, 1.5)],
    }


def test_answers_are_those_of_the_library():
    """Within their last digit, and half a percent of what the largest force and torque are."""
    told = dict(re.findall(r'<b id="(\w+)">([^<]*)</b>', SCRIPT.read_text("utf-8")))
    found = answers()
    assert told.keys() == found.keys()
    for name, words in told.items():
        numbers = re.findall(r"\d+(?:\.\d+)?", words)
        assert len(numbers) == len(found[name]), name
        for number, exact in zip(numbers, found[name], strict=True):
            digit = 10.0 ** -len(number.partition(".")[2])
            assert float(number) == pytest.approx(exact, abs=0.51 * digit), name


@pytest.mark.parametrize("name", ["lesson.html", "try.html"])
def test_committed_pages_are_up_to_date(name):
    """All but the last digits of the discs, which depend on the processor: else run docs/make_wasm.py."""
    made = script("docs/make_wasm.py")
    assert name in made.PAGES
    pages = (ROOT / "docs" / "static" / name).read_text("utf-8"), made.page(name)
    found = [re.split(r"^const SHAPES = (.*);$", each, flags=re.M) for each in pages]
    assert found[0][::2] == found[1][::2]
    ours, theirs = (json.loads(each[1]) for each in found)
    assert ours.keys() == theirs.keys()
    for shape in ours:
        np.testing.assert_allclose(ours[shape], theirs[shape], rtol=0.0, atol=1e-9)


# ---------------------------------------------------------------------- in Chromium


@pytest.mark.slow
@pytest.mark.explore
@pytest.mark.parametrize("width", [1280, 420])
def test_a_pupil_finds_the_answers(browser, width):
    exact = answers()
    pupil = Pupil(browser, PAGE, width)
    page = pupil.page
    near = lambda value, wanted, off=5e-3: value == pytest.approx(wanted, abs=off)
    open_task = lambda k: (page.locator(f"#task{k} summary").click(), pupil.frame())
    press = lambda k, name: (
        page.locator(f"#task{k}").get_by_role("button", name=name, exact=True).click(),
        pupil.frame(),
    )

    press(1, "no spin")
    for spin, force in zip((0, 1, 4, 10), exact["force"], strict=True):
        pupil.put("omega", spin)
        assert near(-pupil.table()[0, 0], force)
    assert page.locator("#answer1").is_hidden() and page.locator("#show1").is_disabled()
    page.locator("#guess1").fill("about half")
    page.locator("#show1").click()
    pupil.frame()
    assert page.locator("#answer1").is_visible()
    assert "done=1" in page.url

    open_task(2)
    assert page.locator("#task1 .answer").is_hidden()
    press(2, "about the middle")
    side = 0.022  # half the width that the map shows
    for c, force, torque in zip(
        (0, 4, 6.7, 10, 20), exact["shares"], exact["torques"], strict=True
    ):
        pupil.drag("#map", (0.5, 0.5), (0.5 + 1e-3 * c / (2 * side), 0.5))
        radius = PATCHES["disc"].contact_radius()
        found = np.abs(pupil.table()[0])
        assert near(found[1], force, 0.03) and near(
            found[2] / (1e3 * radius), torque, 0.03
        )
    pupil.put("vy", -14.2)
    assert near(np.abs(pupil.table()[0, 1]), exact["both"][0], 6e-3)

    open_task(3)
    press(3, "about the right pad")
    ours, theirs = np.abs(pupil.table())
    assert near(ours[1], exact["pad"][0]) and near(ours[2], exact["padtorque"][0], 0.03)
    assert near(theirs[1], exact["padellipsoid"][0]) and near(
        theirs[2], exact["padellipsoidtorque"][0], 0.03
    )
    press(3, "above the middle")
    ours, theirs = np.abs(pupil.table())
    assert ours == pytest.approx(theirs, rel=0.02)

    open_task(4)
    for shape, name in page.evaluate("Object.entries(SHAPE_NAMES)"):
        press(4, name)
        needed = exact[f"hold{shape}"][0]
        words = page.locator("#verdict").inner_text()
        assert float(re.search(r"needs ([\d.]+) N", words)[1]) == pytest.approx(
            needed, rel=6e-3
        )
        for load, verdict in ((1.02, "Holds"), (0.98, "Slips")):
            pupil.put("load", round(needed * load, 2))
            assert page.locator("#verdict").inner_text().startswith(verdict)
    before = page.locator("#verdict").inner_text()
    pupil.drag("#section", (0.6, 0.4), (0.5, 0.5))
    assert page.locator("#verdict").inner_text() != before

    open_task(5)
    for name, slid, time in (
        ("no spin", "slide", "slidetime"),
        ("10 rad/s", "spun", "spuntime"),
    ):
        press(5, name)
        words = page.locator("#ends").inner_text()
        way, ms = re.search(r"slides ([\d.]+) mm .* in ([\d.]+) ms", words).groups()
        assert near(float(way), exact[slid][0], 0.02) and near(
            float(ms), exact[time][0], 0.3
        )
    ratio = float(
        re.search(r"v/\(ωr\) is (\d\.\d+)", page.locator("#ends").inner_text())[1]
    )
    assert near(
        ratio * PATCHES["disc"].contact_radius() / 0.01, exact["ratio"][0], 0.01
    )
    page.wait_for_timeout(500)
    page.locator("#player button").click()
    assert page.locator("#player button").inner_text().endswith("play")
    assert 0.0 < float(page.locator("#player input").input_value()) < 1.0

    assert page.evaluate("document.documentElement.scrollWidth") <= width
    assert pupil.errors == [] and len(pupil.asked) == 1
    page.context.close()


@pytest.mark.slow
@pytest.mark.explore
def test_the_keyboard_and_a_link_set_the_page(browser):
    pupil = Pupil(browser, PAGE)
    page = pupil.page
    page.locator("#map").focus()
    for _ in range(3):
        page.keyboard.press("ArrowRight")
    pupil.frame()
    assert page.evaluate("state.values.vy") == pytest.approx(-3.0)
    page.locator("#shape").select_option("ring")
    pupil.frame()
    shown = pupil.table()
    other = Pupil(browser, PAGE)
    other.page.goto(page.url)
    other.page.reload()
    other.page.wait_for_selector("#numbers td")
    assert (other.table() == shown).all()
    odd = PAGE.as_uri() + "#omega=abc&shape=nothing&mu=-3&task=77&done=zz9&load=1e99"
    other.page.goto(odd)
    other.page.reload()
    other.page.wait_for_selector("#numbers td")
    assert np.isfinite(other.table()).all() and other.errors == pupil.errors == []


@pytest.mark.slow
@pytest.mark.explore
def test_a_thousand_steps_in_chromium_are_those_of_the_library(browser):
    pupil = Pupil(browser, PAGE)
    patch = PATCHES["disc"].discs(24)
    law = pf.LuGre(mu_c=0.8, mu_s=1.2, elasto_plastic=0.9)
    rng = np.random.default_rng(0)
    twists = np.repeat(rng.normal(size=(200, 3)) * [1.0, 1.0, 100.0], 5, axis=0)
    twists *= np.repeat(10.0 ** rng.uniform(-6.0, -0.5, (200, 1)), 5, axis=0)
    loads = 10.0 ** rng.uniform(-1.0, 1.5, 1000)
    steps = 10.0 ** rng.uniform(-5.0, -2.0, 1000)
    rows = np.column_stack([patch.positions, patch.radii, patch.weights()]).tolist()
    found = pupil.page.evaluate(
        "async ([discs, law, steps]) => { const one = await Contact.of(moduleBytes(), discs, law);"
        " return steps.map(([x, y, s, load, dt]) => one.step([x, y, s], load, dt)); }",
        [rows, law_of(law), np.column_stack([twists, loads, steps]).tolist()],
    )
    model = pf.DistributedModel(patch, law)
    state = model.rest()
    for twist, load, dt, each in zip(twists, loads, steps, found, strict=True):
        state, wrench = model.step(state, twist, load, dt)
        assert (np.abs(each - wrench) / [1.0, 1.0, 0.01]).max() <= 1e-10 * load
    shapes = pupil.page.evaluate("SHAPES")
    for name, patch in PATCHES.items():
        wanted = patch.discs(24)
        own = np.array(shapes[name]) * [0.01, 0.01, 0.01, 1.0]
        rows = np.column_stack([wanted.positions, wanted.radii, wanted.weights()])
        np.testing.assert_allclose(own, rows, atol=1e-12, err_msg=name)
    assert MODULE.exists() and pupil.errors == []
