"""README and docs: their Python runs and prints what they say, their links lead somewhere, their names exist."""

from __future__ import annotations

import contextlib
import dataclasses
import importlib.util
import inspect
import io
import pkgutil
import re
import runpy
from pathlib import Path
from typing import NamedTuple

import click
import matplotlib
import pytest

import planarfriction
from planarfriction import families

ROOT = Path(__file__).parents[2]
PAGES = [
    ROOT / name for name in ("README.md", "CHANGELOG.md", "CONTRIBUTING.md")
] + sorted((ROOT / "docs").glob("*.md"))
OPTIONAL = (
    "torch",
    "jax",
    "warp",
    "mujoco",
    "mujoco.mjx",
    "mujoco_warp",
    "pydrake",
    "zarr",
    "casadi",
)
"""Packages behind an extra; `planarfriction.torch`, `planarfriction.adapters.mujoco` and so on carry their names."""
RECIPES = ("pybullet", "genesis", "newton")
"""Hosts that a page has recipes for, and no extra of ours installs."""
SLOW_PAGES = ("mjx-and-warp.md", "warp-kernels.md")
"""Pages whose hosts compile for a minute."""
FAMILIES = (
    families.LAWS,
    families.MODELS,
    families.SURFACES,
    families.SHAPES,
    families.SCENES,
)
MODULES = {module.name for module in pkgutil.iter_modules(planarfriction.__path__)}

FENCE = re.compile(r"^```(\w*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
LINK = re.compile(r"\]\(([^)\s]+)\)")
NAME = re.compile(r"`([A-Za-z_]\w*(?:\.\w+)+)(?:\([^`]*\))?`")
BARE_NAME = re.compile(r"\b[A-Za-z_]\w*(?:\.\w+)+")

pytestmark = pytest.mark.skipif(
    not (ROOT / "docs").is_dir(), reason="no docs beside these tests"
)


class Block(NamedTuple):
    """A fenced block of a page."""

    language: str
    text: str
    line: int
    follows_python: bool
    """Nothing but blank lines is between this block and the Python before it."""
    section: int
    """Number of `##` headings before it."""


def blocks(page):
    text = page.read_text(encoding="utf-8")
    result = []
    end = 0
    before = ""
    for match in FENCE.finditer(text):
        line = text.count("\n", 0, match.start()) + 2
        follows = before == "python" and not text[end : match.start()].strip()
        result.append(
            Block(
                match[1], match[2], line, follows, text.count("\n## ", 0, match.start())
            )
        )
        end = match.end()
        before = match[1]
    return result


def missing_packages(page):
    """Sections whose Python needs an optional package that is not installed, and which."""
    return {
        block.section: package
        for block in blocks(page)
        for package in (*OPTIONAL, *RECIPES)
        if re.search(
            rf"^(import|from) (planarfriction\.)?(adapters\.)?{package}\b",
            block.text,
            re.MULTILINE,
        )
        and not installed(package)
    }


def installed(package):
    try:
        return importlib.util.find_spec(package) is not None
    except ModuleNotFoundError:  # a part of what is not there
        return False


def unsigned_zeros(text):
    return re.sub(r"-(?=0\.0*(?!\d))", " ", text)


def prose(page):
    return FENCE.sub("", page.read_text(encoding="utf-8"))


def anchors(page):
    headings = re.findall(r"^#+ (.*)$", prose(page), re.MULTILINE)
    return {
        re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-")
        for heading in headings
    }


def ids(page):
    return page.name


@pytest.mark.parametrize(
    "page",
    [
        pytest.param(page, marks=pytest.mark.slow if page.name in SLOW_PAGES else ())
        for page in PAGES
        if any(b.language == "python" for b in blocks(page))
    ],
    ids=ids,
)
def test_the_python_of_a_page_runs_and_prints_what_the_page_says(
    page, tmp_path, monkeypatch
):
    """In order, in one namespace, in an empty folder.

    A block whose first line is `# name.toml` (or .csv) is written to that file; a `text` block right after Python is
    what the Python prints, to the last character but for the sign of zeros, which rounding decides. Sections that need
    an optional package are left out without it.
    """
    missing = missing_packages(page)
    monkeypatch.chdir(tmp_path)
    for family in FAMILIES:  # what a page registers is forgotten after it
        monkeypatch.setattr(family, "_members", dict(family._members))
    namespace = {"__name__": page.stem}
    printed = ""
    backend = matplotlib.get_backend()
    matplotlib.use("Agg")
    try:
        for block in blocks(page):
            if block.section in missing:
                continue
            if block.language == "python":
                output = io.StringIO()
                code = compile(
                    "\n" * (block.line - 1) + block.text,
                    str(page),
                    "exec",
                    dont_inherit=True,
                )
                with contextlib.redirect_stdout(output):
                    exec(code, namespace)
                printed = output.getvalue()
            elif block.language == "text" and block.follows_python:
                assert unsigned_zeros(printed) == unsigned_zeros(block.text), (
                    f"{page.name}, line {block.line}: prints\n{printed}"
                )
            elif match := re.match(r"# ([\w-]+\.(?:toml|csv))\n", block.text):
                Path(match[1]).write_text(block.text, encoding="utf-8")
    except NameError:
        if not missing:  # else a section builds on one that was left out
            raise
    finally:
        matplotlib.use(backend)
    if missing:
        pytest.skip(
            f"sections that need {', '.join(sorted(set(missing.values())))}, which is not installed"
        )


def test_members_of_ones_own_are_short():
    page = ROOT / "docs" / "write-your-own.md"
    assert (
        max(
            block.text.count("\n")
            for block in blocks(page)
            if block.language == "python"
        )
        < 60
    )


@pytest.mark.parametrize("page", PAGES, ids=ids)
def test_links_lead_somewhere(page):
    for link in LINK.findall(prose(page)):
        if link.startswith(("http://", "https://")):
            continue
        path, _, anchor = link.partition("#")
        target = (page.parent / path).resolve() if path else page
        assert target.exists(), f"{page.name}: {link}"
        if anchor and target.suffix == ".md":
            assert anchor in anchors(target), (
                f"{page.name}: {link} (headings: {sorted(anchors(target))})"
            )


@pytest.mark.parametrize("page", PAGES, ids=ids)
def test_links_to_code_lead_to_its_lines(page):
    """The script `docs/make_lines.py` sets them anew."""
    text = page.read_text(encoding="utf-8")
    assert runpy.run_path(str(ROOT / "docs" / "make_lines.py"))["updated"](text) == text


def resolve(name, package=planarfriction):
    """Return True if a package has a dotted name: modules, functions, classes and the fields of classes."""
    parts = name.split(".")
    value = package
    for i, part in enumerate(parts):
        fields = getattr(value, "__dataclass_fields__", None) or dict.fromkeys(
            getattr(value, "_fields", ())
        )
        if hasattr(value, part):
            value = getattr(value, part)
        elif part in fields:
            return i == len(parts) - 1
        else:
            try:
                value = importlib.import_module(
                    ".".join([package.__name__, *parts[: i + 1]])
                )
            except ImportError:
                return False
    return True


@pytest.mark.parametrize("page", PAGES, ids=ids)
def test_names_exist(page):
    """`formulas.stribeck`, `LuGre.mu_c` and the like: names that begin with a module or with a public name."""
    equations = "".join(block.text for block in blocks(page) if not block.language)
    for name in NAME.findall(prose(page)) + BARE_NAME.findall(equations):
        first, _, rest = name.partition(".")
        packages = [part for part in name.split(".") if part in OPTIONAL]
        if first in OPTIONAL or any(
            importlib.util.find_spec(package) is None for package in packages
        ):
            continue  # a name of that package itself, or one that cannot be looked up without it
        if first in ("pf", "planarfriction"):
            assert resolve(rest), f"{page.name}: {name}"
        elif first in ("planarfriction_studies", "planarfriction_explorer"):
            assert resolve(rest, importlib.import_module(first)), f"{page.name}: {name}"
        elif (
            first in MODULES or first in planarfriction.__all__
        ) and not name.endswith((".py", ".md")):
            assert resolve(name), f"{page.name}: {name}"


@pytest.mark.parametrize("page", PAGES, ids=ids)
def test_files_of_ours_that_a_page_names_exist(page):
    """`models/base`, `tests/support` and the like, also a function of a file: `_engine/published/surfaces.place`."""
    homes = [ROOT, ROOT / "src" / "planarfriction"]
    for name in re.findall(r"`(\w+(?:/[\w.]+)+)`", prose(page)):
        ends = (name, f"{name}.py", f"{name.rpartition('.')[0]}.py")
        ours = any((home / name.partition("/")[0]).is_dir() for home in homes)
        assert not ours or any(
            (home / end).exists() for home in homes for end in ends
        ), f"{page.name}: {name}"


@pytest.mark.parametrize("page", PAGES, ids=ids)
def test_code_of_a_page_is_not_cut_off(page):
    """A line of the site holds 88 characters of code."""
    long = [
        line
        for block in blocks(page)
        for line in block.text.splitlines()
        if len(line) > 88
    ]
    assert not long, f"{page.name}: {long[0]}"


EXPLANATION = (
    "physics",
    "discs",
    "exact-surfaces",
    "solver",
    "embedding",
)
"""Pages that give equations and say which code holds them."""


def test_every_formula_stands_on_a_page():
    from planarfriction import formulas

    text = "".join(prose(ROOT / "docs" / f"{name}.md") for name in EXPLANATION)
    own = [value for value in vars(formulas).values() if inspect.isfunction(value)]
    public = [
        each.__name__
        for each in own
        if each.__module__ == formulas.__name__ and each.__name__[0] != "_"
    ]
    missing = [name for name in public if f"`formulas.{name}`" not in text]
    assert not missing


@pytest.mark.parametrize("name", EXPLANATION)
def test_equations_say_where_they_are_in_the_code(name):
    """Each section with an equation set apart names a function, a method or a module of ours."""
    text = prose(ROOT / "docs" / f"{name}.md")
    for section in re.split(r"^(?=##+ )", text, flags=re.MULTILINE):
        named = [
            each
            for each in NAME.findall(section)
            if each.split(".")[0] in MODULES | set(planarfriction.__all__)
        ]
        assert "$$" not in section or any(map(resolve, named)), section.splitlines()[0]


def test_scene_files_page_names_every_key_and_every_member():
    from planarfriction import SoftFinger
    from planarfriction.scenes import files

    page = (ROOT / "docs" / "scene-files.md").read_text(encoding="utf-8")
    keys = {*files.SCENE_KEYS, *files.BODY_KEYS, *files.CONTACT_KEYS}
    keys |= {field.name for field in dataclasses.fields(SoftFinger)}
    parts = families.LAWS, families.PADS, families.SHAPES
    for family in (*parts, families.MODELS, families.SURFACES):
        keys |= {*family}.union(
            *(inspect.signature(make).parameters for make in family.values())
        )
    keys -= {"coefficients"}  # of a fitted quartic: nobody writes them by hand
    missing = {key for key in keys if f"`{key}`" not in page}
    assert not missing


def test_glossary_names_every_member():
    from planarfriction import families

    page = (ROOT / "docs" / "glossary.md").read_text(encoding="utf-8")
    for family in (families.MODELS, families.LAWS, families.SURFACES, families.SCENES):
        for name in family:
            assert f"`{name}`" in page and re.search(
                rf"\b{family[name].__name__}`", page
            ), name


def test_pictures_are_small_and_used():
    used = "".join(page.read_text(encoding="utf-8") for page in PAGES)
    for picture in (ROOT / "docs" / "images").glob("*"):
        assert picture.stat().st_size < (
            1_500_000 if picture.suffix == ".gif" else 200_000
        ), picture.name
        assert f"images/{picture.name}" in used, picture.name


def readme_rows():
    """Return the cells behind the words of each row of README's table of errors."""
    text = PAGES[0].read_text(encoding="utf-8")
    table = text.partition("| error against")[2].partition("\n\n")[0]
    rows = re.findall(r"^\| (.+) \|$", table, re.MULTILINE)
    return [row.split(" | ")[1:] for row in rows]


def test_readme_is_short_and_its_table_mixes_no_units():
    """Rows against what people use today, each in one unit; `make_referee` fills them, from the stored run."""
    text = PAGES[0].read_text(encoding="utf-8")
    assert text.count("\n") <= 120
    assert len(LINK.findall(prose(PAGES[0]))) <= 20
    rows = readme_rows()
    assert len(rows) == 3
    assert all(len({re.sub(r"[\d.]", "", cell) for cell in row}) == 1 for row in rows)


def test_numbers_in_the_words_of_readme_stand_on_their_pages():
    text = PAGES[0].read_text(encoding="utf-8")
    (time,) = re.findall(r"take ([0-9.]+ ms)\)", text)
    assert time in (ROOT / "docs" / "benchmarks.md").read_text(encoding="utf-8")


def test_readme_cites_what_the_citation_file_holds():
    """The entry of BibTeX in README has the words of CITATION.cff."""
    (entry,) = (b.text for b in blocks(PAGES[0]) if b.language == "bibtex")
    plain = re.sub(r"[{}]", "", entry)
    citation = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    _, _, preferred = citation.partition("preferred-citation:")
    values = re.findall(
        r"(?:title|journal|year|names|value): +\"?([^\"\n]+)", preferred
    )
    assert len(values) == 8
    assert [value for value in values if value not in plain] == []


def test_numbers_of_the_prepared_paper_stand_on_pages():
    """Those of README's first row and of its cases, and the errors of the slip-onset load."""
    paper = (ROOT / "paper.md").read_text(encoding="utf-8")
    first, _, cases = readme_rows()
    numbers = [cell.removesuffix("°") for cell in first]
    numbers += [cell.partition(" of ")[0] for cell in cases]
    page = (ROOT / "docs" / "which-model-when.md").read_text(encoding="utf-8")
    errors = re.findall(r"([\d.]+ %)[^|]*\| [\d.]+ mm", page)
    assert [each for each in numbers if not re.search(rf"\b{each}\b", paper)] == []
    assert [each for each in re.findall(r"[\d.]+ %", paper) if each not in errors] == []


def test_the_first_page_links_every_page():
    lists = (
        (ROOT / "docs" / "index.md")
        .read_text(encoding="utf-8")
        .partition("## All pages")[2]
    )
    linked = {link.removesuffix(".md") for link in LINK.findall(lists)}
    assert {page.stem for page in (ROOT / "docs").glob("*.md")} - linked == {"index"}


def test_the_page_of_commands_names_every_command():
    from planarfriction.cli.app import app

    page = (ROOT / "docs" / "cli.md").read_text(encoding="utf-8")
    names = app.list_commands(click.Context(app))
    assert [name for name in names if f"| `{name}` |" not in page] == []
