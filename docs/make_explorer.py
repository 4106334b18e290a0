"""The explorer's pictures and times: `python docs/make_explorer.py [pictures] [times]`, by default the pictures.

Writes to `docs/images` and `docs/pictures.md`. Needs the extras `explore` and `browser`, and Chromium. Times are of
this machine and this browser, which draws without a graphics processor: measure while nothing else runs.
"""

from __future__ import annotations

import contextlib
import io
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image
from playwright.sync_api import Page, sync_playwright

DOCS = Path(__file__).parent
GRAPHICS = ("--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader")
COMMAND = "import sys; from planarfriction.cli import main; sys.exit(main())"
MOVES = 200
"""Moves of the pointer that are timed."""

PLACE = """([x, y]) => {
    const view = Bokeh.index.query_one((each) => each.model.name === "map");
    const canvas = view.canvas_view.el.getBoundingClientRect();
    return [canvas.x + view.frame.x_scale.compute(x), canvas.y + view.frame.y_scale.compute(y)];
}"""
"""Position on the screen of a point of the map [mm]."""

WATCH = """() => {
    const find = (root) => {
        for (const each of root.querySelectorAll("*")) {
            const found = each.id === "answer" ? each : each.shadowRoot && find(each.shadowRoot);
            if (found) return found;
        }
        return null;
    };
    window.addEventListener("pointermove", () => { window.moved = performance.now(); }, true);
    window.begin = () => { window.before = find(document).innerHTML; };
    window.taken = async () => {
        for (let frame = 0; frame < 600; frame++) {
            await new Promise(requestAnimationFrame);
            const found = find(document);
            if (found && found.innerHTML !== window.before) return performance.now() - window.moved;
        }
        return null;
    };
}"""
"""Times from a move of the pointer to the frame in which other numbers stand on the page."""


@contextlib.contextmanager
def opened(width: int = 1280, height: int = 960) -> Iterator[Page]:
    """The page of an explorer in a browser without a window."""
    command = [sys.executable, "-c", COMMAND, "explore", "--no-browser"]
    with (
        subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as server,
        sync_playwright() as driver,
    ):
        try:
            assert server.stderr is not None
            address = next(
                found[0]
                for line in server.stderr
                if (found := re.search(r"http://localhost:\d+", line))
            )
            browser = driver.chromium.launch(
                executable_path=shutil.which("chromium"), args=GRAPHICS
            )
            page = browser.new_page(viewport={"width": width, "height": height})
            page.goto(address)
            page.locator("#answer").wait_for(timeout=60_000)
            page.wait_for_timeout(3000)
            yield page
            browser.close()
        finally:
            server.terminate()


def place(page: Page, x: float, y: float) -> tuple[float, float]:
    """Position on the screen of a point of the map [mm]."""
    return tuple(page.evaluate(PLACE, [x, y]))


def save(page: Page, name: str, **options: Any) -> None:
    """Write what is seen, each colour in 18 steps: a palette loses those of small marks."""
    with Image.open(io.BytesIO(page.screenshot(**options))) as picture:
        picture.convert("RGB").point(lambda value: 15 * round(value / 15)).save(
            DOCS / "images" / f"{name}.png", optimize=True
        )


def pictures() -> None:
    """A published patch with its models."""
    with opened() as page:
        page.locator(".patch select").select_option("NonConvex2")
        page.wait_for_timeout(2000)
        page.mouse.click(*place(page, 7, -3))
        page.get_by_text("Models", exact=True).click()
        page.get_by_text("For the patch, the law").wait_for(timeout=120_000)
        page.wait_for_timeout(4000)
        save(page, "explorer", full_page=True)


def times() -> None:
    """Put the time from pointer to numbers into the page of the docs: that of the slowest of three patches."""
    shares = []
    for name in ("Square", "Circle", "NonConvex2"):
        with opened() as page:
            page.locator(".patch select").select_option(name)
            page.wait_for_timeout(3000)
            page.evaluate(WATCH)
            taken, server = drag(page)
        assert len(taken) > 0.9 * MOVES, (
            f"only {len(taken)} of {MOVES} moves were answered"
        )
        shares.append(np.percentile(taken, (50, 95)))
        print(
            f"{name}: pointer to numbers {shares[-1].round()}, server {np.percentile(server, (50, 95)).round()} ms"
        )
    median, most = np.max(shares, axis=0)
    words = (
        f"The numbers follow the pointer after {median:.0f} ms (median; 95 % within {most:.0f} ms),\n"
        "in Chromium without a graphics processor."
    )
    path = DOCS / "pictures.md"
    pattern = r"(<!-- times -->\n\n).*?(?=\n\n|\Z)"
    text = re.sub(pattern, lambda found: found[1] + words, path.read_text(), flags=re.S)
    path.write_text(text.rstrip() + "\n", encoding="utf-8")


def drag(page: Page) -> tuple[list[float], list[float]]:
    """Times [ms] from pointer to numbers, and those in which the server found them, in one drag of `MOVES` moves."""
    taken = []
    server = []
    angles = 2.0 * np.pi * np.arange(MOVES) / 40
    page.mouse.move(*place(page, 5.0, 0.0))
    page.mouse.down()
    for radius, angle in zip(np.linspace(2.0, 8.0, MOVES), angles, strict=True):
        there = place(
            page, float(radius * np.cos(angle)), float(radius * np.sin(angle))
        )
        page.evaluate("begin()")
        page.mouse.move(*there)
        found = page.evaluate("taken()")
        if found is not None:
            taken.append(found)
            server.append(float(page.locator("#answer small").inner_text().split()[-2]))
    page.mouse.up()
    return taken, server


if __name__ == "__main__":
    for each in sys.argv[1:] or ["pictures"]:
        {"pictures": pictures, "times": times}[each]()
