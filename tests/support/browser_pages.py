"""Pages from disk in Chromium, without a window and without a network."""

import shutil

import numpy as np

CHROMIUM = (
    shutil.which("chromium")
    or shutil.which("chromium-browser")
    or shutil.which("google-chrome")
)


class Pupil:
    """A page from disk in a browser without a network."""

    def __init__(self, browser, file, width=1280, height=900, **options):
        context = browser.new_context(
            viewport={"width": width, "height": height}, offline=True, **options
        )
        self.page = context.new_page()
        self.errors = []
        self.asked = []
        self.page.on("pageerror", lambda error: self.errors.append(str(error)))
        self.page.on("request", lambda one: self.asked.append(one.url))
        self.page.goto(file.as_uri())
        self.page.wait_for_selector("#numbers td")

    def frame(self):
        """Wait until all is drawn."""
        self.page.evaluate("new Promise((done) => setTimeout(done, 300))")

    def drag(self, canvas, *points):
        """Drag from one place of a canvas to others, in parts of its width and height from the top left."""
        self.page.locator(canvas).scroll_into_view_if_needed()
        box = self.page.locator(canvas).bounding_box()
        places = [
            (box["x"] + x * box["width"], box["y"] + y * box["height"])
            for x, y in points
        ]
        self.page.mouse.move(*places[0])
        self.page.mouse.down()
        for place in places:
            self.page.mouse.move(*place, steps=3)
        self.page.mouse.up()
        self.frame()

    def table(self):
        """Friction and ellipsoid: force x and y, torque [N, N, N mm]."""
        rows = self.page.locator("#numbers tr")
        return np.array(
            [
                [
                    float(each.replace("\N{MINUS SIGN}", "-"))
                    for each in rows.nth(k).inner_text().split("\t")[1:4]
                ]
                for k in (1, 2)
            ]
        )

    def put(self, name, value):
        field = self.page.locator(f"input#{name}")
        field.fill(str(value))
        field.press("Enter")
        self.frame()
