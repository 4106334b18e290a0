"""Figures of the library are not pyplot's: a gallery script shows one by giving it a name, `figure = ...`.

Those of plotly turn under the mouse; their code is in the site's own files.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import matplotlib
from matplotlib.figure import Figure
from sphinx_gallery.scrapers import figure_rst

_SHOWN: dict[str, list[Any]] = {}
"""Script -> its figures that have been saved, kept so that no other takes their place in memory."""


def thicker(gallery_conf: dict[str, Any], name: str) -> None:
    """Lines that can be seen in a thumbnail, for every script."""
    del gallery_conf, name
    matplotlib.rcParams.update({"lines.linewidth": 2.0, "axes.labelsize": 11.0})


def figures(
    block: Any, block_vars: dict[str, Any], gallery_conf: dict[str, Any]
) -> str:
    """Save every figure that a variable of the script holds, once, in the order in which they were named."""
    del block
    shown = _SHOWN.setdefault(block_vars["src_file"], [])
    paths = []
    turning = ""
    for value in list(block_vars["example_globals"].values()):
        if any(value is each for each in shown):
            continue
        if isinstance(value, Figure):
            shown.append(value)
            paths.append(next(block_vars["image_path_iterator"]))
            value.savefig(paths[-1], dpi=110, facecolor="white")
        elif type(value).__module__.startswith("plotly."):
            shown.append(value)
            turning += interactive(value, block_vars, gallery_conf)
    return figure_rst(paths, gallery_conf["src_dir"]) + turning


def interactive(
    figure: Any, block_vars: dict[str, Any], gallery_conf: dict[str, Any]
) -> str:
    """A figure of plotly as raw HTML, with the script from where the site keeps it."""
    folder = Path(block_vars["target_file"]).parent
    code = Path(
        os.path.relpath(
            Path(gallery_conf["src_dir"]) / "_static" / "plotly.min.js", folder
        )
    ).as_posix()
    drawn = figure.to_html(
        full_html=False,
        include_plotlyjs=False,
        default_height="460px",
        config={"displayModeBar": False},
    )
    lines = [f'<script src="{code}"></script>', *drawn.splitlines()]
    return "\n.. raw:: html\n\n" + "".join(f"    {line}\n" for line in lines) + "\n"


def _get_sg_image_scraper() -> Any:
    """Return the scraper: the gallery asks modules named in its settings for it by this function."""
    return figures
