"""The documentation site: `make docs` builds it from these pages, the docstrings and the scripts of the gallery."""

from __future__ import annotations

import importlib.util
import os
import sys
from pathlib import Path

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE / "extensions"), str(HERE)]
os.environ.setdefault("PYTHONHASHSEED", "0")

import count_words  # noqa: E402
import matplotlib  # noqa: E402

matplotlib.use("Agg")

from sphinx.util import logging  # noqa: E402

import planarfriction  # noqa: E402
from planarfriction.cli.app import app  # noqa: E402

app.add_installed()  # `sphinx_click` does not ask for commands that other packages add

project = "planarfriction"
author = "the authors of planarfriction"
copyright = author
version = release = planarfriction.__version__

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx.ext.viewcode",
    "sphinx_click",
    "sphinx_copybutton",
    "sphinx_gallery.gen_gallery",
    "api_pages",
    "code_links",
    "mathml",
    "repository_links",
]
exclude_patterns = [
    "extensions",
    "gallery/**.ipynb",
    "gallery/**.py",
    "notebooks/**.ipynb",
    "notebooks/**.py",
]
suppress_warnings = [
    "config.cache",  # sphinx-gallery keeps functions in its settings
]

smartquotes = False  # options of commands have two hyphens

# -- pages in Markdown: colon fences, so that the Python of a page stays easy to find for the tests

myst_enable_extensions = [
    "amsmath",
    "attrs_block",
    "attrs_inline",
    "colon_fence",
    "deflist",
    "dollarmath",
]
myst_heading_anchors = 4
html_math_renderer = (
    "mathml"  # by docutils: nothing is loaded from elsewhere when a page is read
)

# -- API from docstrings, whose `code` is in single backticks

default_role = "literal"
autodoc_member_order = "bysource"
autodoc_typehints_format = "short"
autodoc_preserve_defaults = True
# By its name, not as the union that it is.
autodoc_type_aliases = {"ArrayLike": "ArrayLike"}
python_maximum_signature_line_length = 90
autodoc_default_options = {"members": True}
napoleon_google_docstring = napoleon_numpy_docstring = (
    False  # `api_pages` applies it where there are sections
)
napoleon_use_rtype = False
OPTIONAL = ("torch", "jax", "warp", "mujoco", "mujoco_warp", "pydrake")
MISSING = [name for name in OPTIONAL if importlib.util.find_spec(name) is None]
autodoc_mock_imports = MISSING

nitpicky = True
nitpick_ignore_regex = [
    # Types in signatures, the only references that no one writes: of other libraries, since no inventory of theirs is
    # downloaded for a link, and of ours where they are no one's to make, and so stand in no `__all__`.
    (r"py:class", r".*"),
    (
        r"py:.*",
        r"(np|numpy|xr|xarray|matplotlib|scipy|torch|jax|jaxlib|warp|wp|numba|mujoco\w*|mjw|pydrake)\..*",
    ),
]

# -- the gallery: every script is run, and again when it has changed

ENDS = {"torch": "torch", "jax": "jax", "mujoco": "mujoco", "plotly": "interactive"}
"""Package -> how the names of scripts end that need it: without it they are left out."""
WITHOUT = "|".join(
    f"_{end}" for name, end in ENDS.items() if importlib.util.find_spec(name) is None
)
NOTEBOOK = """\
%matplotlib inline
# Colab and other new environments: install the library first. It is not on PyPI yet.
# %pip install /path/to/a/clone"""
"""First cell of every notebook."""
THEMES = ("patches", "laws", "limit_surfaces", "motion", "derivatives", "hosts")
sphinx_gallery_conf = {
    "examples_dirs": ["../examples/gallery", "../examples/notebooks"],
    "gallery_dirs": ["gallery", "notebooks"],
    "filename_pattern": r"\.py$",
    "ignore_pattern": rf"__init__\.py{f'|({WITHOUT}).py$' if WITHOUT else ''}",
    "capture_repr": (),
    "image_scrapers": ("figure_scraper",),
    "reset_modules": ("matplotlib", "figure_scraper.thicker"),
    "remove_config_comments": True,
    "min_reported_time": 10,
    "show_signature": False,
    "download_all_examples": False,
    "first_notebook_cell": NOTEBOOK,
    "write_computation_times": False,
    "nested_sections": False,
    "subsection_order": [*(f"../examples/gallery/{theme}" for theme in THEMES), "*"],
    "within_subsection_order": "FileNameSortKey",
    "abort_on_example_error": False,
}

# -- looks

html_theme = "furo"
html_title = f"planarfriction {version}"
html_static_path = ["static"]
# For figures that turn: nothing is loaded from elsewhere.
if plotly := importlib.util.find_spec("plotly"):
    html_static_path.append(
        str(Path(plotly.origin or "").parent / "package_data" / "plotly.min.js")
    )
html_css_files = ["site.css"]
html_show_sphinx = False
html_copy_source = False
copybutton_prompt_text = "$ "


def count(app, failed):
    """Print the words of prose of each page, as `docs/count_words.py` counts them."""
    for line in count_words.report():
        logging.getLogger("planarfriction").info(line)


def setup(app):
    """Tables of numbers in files have no words to colour."""
    from pygments.lexers.special import TextLexer

    app.add_lexer("csv", TextLexer)
    app.connect("build-finished", count)
