"""The site of the documentation builds without a warning: links, names, terms, docstrings, and every gallery script."""

import importlib.util
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
NEEDED = (
    "sphinx",
    "myst_parser",
    "sphinx_gallery",
    "sphinx_click",
    "sphinx_copybutton",
    "furo",
)

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(
        not (ROOT / "docs" / "conf.py").exists(), reason="no docs beside these tests"
    ),
    pytest.mark.skipif(
        any(importlib.util.find_spec(name) is None for name in NEEDED),
        reason="needs the extra [docs]",
    ),
]


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """The built site of a copy of the sources, so that what is generated does not land among them."""
    copy = tmp_path_factory.mktemp("copy")
    generated = (
        shutil.ignore_patterns("api", "gallery", "notebooks")
        if not (ROOT / "docs" / "gallery").exists()
        else None
    )
    shutil.copytree(ROOT / "docs", copy / "docs", ignore=generated)
    shutil.copytree(
        ROOT / "examples",
        copy / "examples",
        ignore=shutil.ignore_patterns("__pycache__"),
    )
    for name in ("CONTRIBUTING.md", "CHANGELOG.md", "README.md"):
        shutil.copy(ROOT / name, copy)
    command = [
        sys.executable,
        "-m",
        "sphinx",
        "-W",
        "--keep-going",
        "-n",
        "-q",
        "docs",
        "site",
    ]
    homes = [
        str(ROOT / "src"),
        str(ROOT / "studies" / "src"),
        os.environ.get("PYTHONPATH"),
    ]
    path = os.pathsep.join(filter(None, homes))
    done = subprocess.run(
        command,
        cwd=copy,
        env=os.environ | {"PYTHONPATH": path},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return copy / "site"


def test_equations_are_set_and_names_are_links(site):
    physics = (site / "physics.html").read_text(encoding="utf-8")
    assert "<math" in physics and "$$" not in physics
    assert 'href="api/formulas.html#planarfriction.formulas.stribeck"' in physics
    exact = (site / "exact-surfaces.html").read_text(encoding="utf-8")
    assert (
        'href="api/kernels.html#planarfriction.limit_surface.loops.closed_forms.disc_sum"'
        in exact
    )


def test_every_formula_and_loop_that_a_page_names_is_a_link(site):
    compiled = r"(?:formulas|_engine|limit_surface\.loops)\.(?!py<)[\w.]+"
    named = rf'(<a [^>]*>)?<code[^>]*><span class="pre">({compiled})</span></code>'
    found = 0
    for page in site.glob("*.html"):
        for link, name in re.findall(named, page.read_text(encoding="utf-8")):
            assert link, f"{page.name}: {name}"
            found += 1
    assert found > 40


def test_every_public_name_is_in_the_reference(site):
    import planarfriction

    pages = "".join(
        page.read_text(encoding="utf-8") for page in (site / "api").glob("*.html")
    )
    missing = [
        name
        for name in planarfriction.__all__
        if f'id="planarfriction.{name}"' not in pages
        and f'id="module-planarfriction.{name}"' not in pages
    ]
    assert not missing


def test_the_gallery_has_a_picture_for_each_script(site):
    scripts = list((ROOT / "examples" / "gallery").rglob("plot_*.py"))
    assert len(scripts) >= 30
    for path in scripts:
        needs = {
            "torch": "torch",
            "jax": "jax",
            "mujoco": "mujoco",
            "interactive": "plotly",
        }.get(path.stem.split("_")[-1])
        if needs is None or importlib.util.find_spec(needs):
            page = (
                site / "gallery" / path.parent.name / f"{path.stem}.html"
            ).read_text(encoding="utf-8")
            assert f"sphx_glr_{path.stem}_001.png" in page, path.name


def test_a_figure_that_turns_brings_its_code(site):
    pytest.importorskip("plotly")
    folder = site / "gallery" / "limit_surfaces"
    (code,) = re.findall(
        r'<script src="([^"]*plotly[^"]*)">',
        (folder / "plot_26_interactive.html").read_text("utf-8"),
    )
    assert (folder / code).resolve().is_file()
