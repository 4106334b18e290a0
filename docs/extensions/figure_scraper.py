"""Figures of the library are not pyplot's: a gallery script shows one by giving it a name, `figure = ...`."""

from __future__ import annotations

from typing import Any

from matplotlib.figure import Figure
from sphinx_gallery.scrapers import figure_rst

_SHOWN: dict[str, list[Figure]] = {}
"""Script -> its figures that have been saved, kept so that no other takes their place in memory."""


def figures(block: Any, block_vars: dict[str, Any], gallery_conf: dict[str, Any]) -> str:
    """Save every figure that a variable of the script holds, once, in the order in which they were named."""
    del block
    shown, paths = _SHOWN.setdefault(block_vars["src_file"], []), []
    for value in list(block_vars["example_globals"].values()):
        if isinstance(value, Figure) and not any(value is each for each in shown):
            shown.append(value)
            paths.append(next(block_vars["image_path_iterator"]))
            value.savefig(paths[-1], dpi=110, facecolor="white")
    return figure_rst(paths, gallery_conf["src_dir"])


def _get_sg_image_scraper() -> Any:
    """What the gallery asks a module for that its settings name."""
    return figures
