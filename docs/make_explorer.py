"""Make the picture of the explorer: `python docs/make_explorer.py [FOLDER]`, by default in `docs/images`.

Needs the extra `explore`, Playwright and Chromium.
"""

from __future__ import annotations

import io
import re
import shutil
import subprocess
import sys
from pathlib import Path

from PIL import Image
from playwright.sync_api import sync_playwright

GRAPHICS = ("--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader")
COMMAND = "import sys; from planarfriction.cli import main; sys.exit(main())"


def main(folder: Path) -> None:
    """Open the page, choose a patch, turn about a point, and write what is seen."""
    command = [sys.executable, "-c", COMMAND, "explore", "--no-browser"]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as server, sync_playwright() as driver:
        assert server.stderr is not None
        found = re.search(r"http://localhost:\d+", server.stderr.readline())
        assert found is not None
        browser = driver.chromium.launch(executable_path=shutil.which("chromium"), args=GRAPHICS)
        page = browser.new_page(viewport={"width": 1500, "height": 1000})
        page.goto(found[0])
        page.locator("#answer").wait_for(timeout=60_000)
        page.locator(".patch select").select_option("NonConvex2")
        page.wait_for_timeout(2000)
        place = page.evaluate(
            """() => { const view = Bokeh.index.query_one((each) => each.model.type === "Figure");
            const canvas = view.canvas_view.el.getBoundingClientRect();
            return [canvas.x + view.frame.x_scale.compute(3), canvas.y + view.frame.y_scale.compute(-3)]; }"""
        )
        page.mouse.click(*place)
        page.wait_for_timeout(6000)
        folder.mkdir(parents=True, exist_ok=True)
        with Image.open(io.BytesIO(page.screenshot())) as picture:
            picture.convert("RGB").quantize(256).save(folder / "explorer.png", optimize=True)
        browser.close()
        server.terminate()


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent / "images")
