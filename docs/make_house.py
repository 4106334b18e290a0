"""Draw the floors of the code from the import contracts in pyproject.toml: `python docs/make_house.py [FILE]`.

The words beside each floor are those of the table in docs/maintaining.md.
"""

from __future__ import annotations

import re
import sys
import textwrap
import tomllib
from pathlib import Path

import matplotlib.pyplot as plt

ROOT = Path(__file__).resolve().parents[1]
COLOURS = {
    "front": "#dbe9f6",
    "scene": "#e3f1df",
    "model": "#fdf0d5",
    "code": "#f6dede",
    "base": "#ececec",
}
GROUPS = {
    "__main__": "front",
    "scenes": "scene",
    "models": "model",
    "extend": "code",
    "geometry": "base",
}
"""First floor, from the top, of each group of floors."""


def floors() -> list[list[str]]:
    """Return the modules of each floor of the library, from the top."""
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))[
        "tool"
    ]["importlinter"]["contracts"]
    layers = next(
        each["layers"]
        for each in contracts
        if each.get("containers") == ["planarfriction"]
    )
    return [re.findall(r"\w+", layer) for layer in layers]


def words() -> dict[str, str]:
    """Return the description of each module from the table in docs/maintaining.md."""
    page = (ROOT / "docs" / "maintaining.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| (`[^|]+) \| ([^|]+) \|$", page, re.M)
    return {
        name: text.replace("`", "")
        for names, text in rows
        for name in re.findall(r"`(\w+)`", names)
    }


def draw() -> plt.Figure:
    """Draw the library's floors as boxes, and the two packages that stand on it."""
    found = floors()
    said = words()
    figure, axes = plt.subplots(
        figsize=(7.6, 0.36 * (len(found) + 3)), layout="constrained"
    )
    axes.set(xlim=(0.0, 10.0), ylim=(-len(found) - 0.1, 2.2))
    axes.axis("off")
    uppers = [("planarfriction_studies", "on its own: experiments, measured data, benchmarks"),
              ("planarfriction_explorer", "the interactive page in the browser")]  # fmt: skip
    for i, (package, text) in enumerate(uppers):
        box(axes, 5.0 * i, 1.0, 4.9, "#ffffff", package, text, stacked=True)
    colour = COLOURS["front"]
    for k, names in enumerate(found):
        colour = COLOURS[GROUPS[names[0]]] if names[0] in GROUPS else colour
        text = "; ".join(dict.fromkeys(said[name] for name in names))
        box(axes, 0.0, -float(k) - 0.45, 9.9, colour, ", ".join(names), text)
    title = "planarfriction, the library: each floor imports only from those below it"
    axes.text(0.0, 0.68, title, fontsize=9, weight="bold", va="center")
    return figure


def box(
    axes: plt.Axes,
    x: float,
    y: float,
    width: float,
    colour: str,
    title: str,
    text: str,
    stacked: bool = False,
):
    """Draw one floor with its title and its words, beside or below it."""
    height = 1.05 if stacked else 0.86
    axes.add_patch(
        plt.Rectangle(
            (x, y), width, height, facecolor=colour, edgecolor="#777777", linewidth=0.6
        )
    )
    if stacked:
        axes.text(x + 0.1, y + 0.75, title, fontsize=8.5, weight="bold", va="center")
        axes.text(x + 0.1, y + 0.32, text, fontsize=7.5, va="center")
    else:
        axes.text(
            x + 0.1,
            y + 0.43,
            textwrap.fill(title, 27),
            fontsize=8.5,
            weight="bold",
            va="center",
            linespacing=1,
        )
        axes.text(
            x + 3.0,
            y + 0.43,
            textwrap.fill(text, 84),
            fontsize=8,
            va="center",
            linespacing=1.05,
        )


if __name__ == "__main__":
    target = (
        Path(sys.argv[1])
        if len(sys.argv) > 1
        else ROOT / "docs" / "images" / "house.png"
    )
    draw().savefig(target, dpi=115)
    print(target)
