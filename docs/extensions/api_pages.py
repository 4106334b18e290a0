"""A page of reference for every subject and every public module, from `__all__`: what is made public appears by itself.

Also a page with the compiled loops that the pages of the documentation name, so that these names are links.
"""

from __future__ import annotations

import importlib
import inspect
import pkgutil
import re
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

from sphinx.application import Sphinx
from sphinx.ext.napoleon import NumpyDocstring
from sphinx.pycode import ModuleAnalyzer

import planarfriction
from planarfriction._support.described import HEADING

OPTIONAL = (
    "extend",
    "torch",
    "jax",
    "warp",
    "adapters.mujoco",
    "adapters.mjx",
    "adapters.mujoco_warp",
    "adapters.drake",
)
"""Public modules that stand in no list of the package: they load a package of an extra, or are for extending it."""

ROOMS = ("bristles", "cells", "published", "coupled", "body", "compiler")
COMPILED = (*(f"_engine.{room}" for room in ROOMS), "limit_surface.loops")
"""Packages of compiled code that the pages name."""

SUBJECTS = {
    "Describe": (
        "A contact is a patch, a friction law, and a model of both.",
        "patch = pf.ContactPatch.disc(radius=0.01)\nmodel = pf.ReducedModel(patch, pf.LuGre(mu_c=0.8, mu_s=1.0))",
        (
            "patch",
            "laws",
            "pads",
            "limit_surface",
            "models",
            "extend",
            "formulas",
            "families",
            "geometry",
            "errors",
        ),
    ),
    "Simulate": (
        "A scene is a body with contacts; a solution has its motion.",
        "solution = pf.simulate(pf.scenes.in_hand(model))\nsolution.plot()",
        ("scenes", "solvers", "sweeps", "plots", "warm"),
    ),
    "Embed": (
        "Friction inside simulators, in a time-stepping loop, or in C.",
        "state, wrench = model.step(model.rest(), (0.01, 0.0, 1.0), normal_force=2.0, dt=1e-3)",
        ("sliding_body", "coupling", "environments", "export", "adapters", "warp"),
    ),
    "Learn": (
        "Rollouts and scenes have exact derivatives, in NumPy, PyTorch and JAX.",
        "wrenches = pf.rollout(model, None, twists, normal_force=2.0, dt=1e-3).wrenches",
        ("derivatives", "torch", "jax"),
    ),
    "Measure": (
        "Logs of motion and force give the parameters of a contact; models give what a tactile sensor would measure.",
        'found = pf.identify.identify_lugre(pf.Log.from_csv("log.csv"), patch)',
        ("identify", "joints", "tactile"),
    ),
    "Plan": (
        "Grip forces, in-hand motions, pushes, and controllers for parts of unknown friction.",
        "force = pf.planning.holding_load((0.0, -1.0, 0.0), patch, mu=0.8)",
        ("planning", "online"),
    ),
}
"""Subject -> a sentence, an example, and the modules and packages that belong to it."""

NAMED = re.compile(rf"(?<![\w.])(?:{'|'.join(COMPILED)})(?:\.\w+){{1,2}}")


def public_modules() -> list[str]:
    modules = [
        name
        for name in planarfriction.__all__
        if inspect.ismodule(getattr(planarfriction, name))
    ]
    return [
        "planarfriction",
        *(f"planarfriction.{name}" for name in (*modules, *OPTIONAL)),
    ]


def public_names(module: ModuleType) -> list[str]:
    """Return the names in `__all__`, or those that the module defines; modules have pages of their own."""
    own = [
        name
        for name, value in vars(module).items()
        if getattr(value, "__module__", None) == module.__name__
    ]
    names = getattr(
        module, "__all__", [name for name in own if not name.startswith("_")]
    )
    return [name for name in names if not inspect.ismodule(getattr(module, name, None))]


def heading(text: str, line: str = "=") -> list[str]:
    return [text, line * len(text), ""]


def entry(full_name: str, value: Any) -> list[str]:
    """The directive that documents `value`, its members and those that it inherits from us."""
    if inspect.isclass(value):
        foreign = [
            base.__name__
            for base in value.__mro__
            if not base.__module__.startswith("planarfriction")
        ]
        return [
            f".. autoclass:: {full_name}",
            f"   :inherited-members: {', '.join(foreign)}",
            "",
        ]
    if inspect.isfunction(value) or hasattr(value, "py_func"):
        return [f".. autofunction:: {full_name}", ""]
    name = full_name.rsplit(".", 1)[-1]
    return [
        f".. py:data:: {full_name}",
        "",
        *(f"   {line}" for line in words_of(name, value)),
        "",
    ]


def words_of(name: str, value: Any) -> list[str]:
    """The words below a constant, or a bound method's own, in whichever module of the package has them."""
    if inspect.isroutine(value):
        return (inspect.getdoc(value) or "").splitlines()
    for module in list(sys.modules):
        if (
            module.startswith("planarfriction.")
            and vars(sys.modules[module]).get(name) is value
        ):
            words = ModuleAnalyzer.for_module(module).find_attr_docs().get(("", name))
            if words:
                return words
    return []


def first_sentence(value: Any) -> str:
    text = " ".join((inspect.getdoc(value) or "").split("\n\n")[0].split())
    return re.split(r"(?<=\.)\s", text)[0].rstrip(".")


def page(name: str, documented: dict[int, str]) -> list[str]:
    """A module's page; what an earlier page documents is only named, in a list at the end."""
    module = importlib.import_module(name)
    lines = [*heading(name), f".. automodule:: {name}", "   :no-members:", ""]
    elsewhere = []
    for each in public_names(module):
        value = getattr(module, each)
        known = (
            documented.setdefault(id(value), f"{name}.{each}")
            if not isinstance(value, (str, int))
            else None
        )
        if known in (None, f"{name}.{each}"):
            lines += entry(f"{name}.{each}", value)
        else:
            elsewhere.append(f"- `{known}`")
    if elsewhere:
        lines += ["Also here, and documented elsewhere:", "", *elsewhere, ""]
    return lines


def subject_page(
    subject: str, rows: list[tuple[str, str]], documented: dict[int, str]
) -> list[str]:
    """Return a subject's page: its sentence, example and modules, and the names that `planarfriction` has of them."""
    sentence, example, modules = SUBJECTS[subject]
    lines = [*heading(subject), sentence, "", ".. code-block:: python", ""]
    lines += [
        *(f"   {line}" for line in example.splitlines()),
        "",
        ".. list-table::",
        "   :widths: 25 75",
        "",
    ]
    rows = [row for row in rows if row[0].split(".")[0] in modules]
    for file, words in rows:
        lines += [f"   * - :doc:`{file}`", f"     - {words}"]
    lines += [
        "",
        ".. toctree::",
        "   :hidden:",
        "",
        *(f"   {file}" for file, _ in rows),
        "",
    ]
    for name in public_names(planarfriction):
        value = getattr(planarfriction, name)
        if not isinstance(value, str) and value.__module__.split(".")[1] in modules:
            documented[id(value)] = f"planarfriction.{name}"
            lines += entry(f"planarfriction.{name}", value)
    return lines


def kernels_page(pages: Path) -> list[str]:
    """The compiled functions and modules that the pages name, with their words and their source."""
    named = {
        name
        for path in pages.glob("*.md")
        for name in NAMED.findall(path.read_text(encoding="utf-8"))
    }
    lines = heading("Compiled loops")
    lines += [
        "Internal: no promise is made about them. They are here since the pages name them beside their equations.",
        "",
    ]
    for package in COMPILED:
        of_package = sorted(name for name in named if name.startswith(f"{package}."))
        parent = importlib.import_module(f"planarfriction.{package}")
        modules = {module.name for module in pkgutil.iter_modules(parent.__path__)}
        of_modules: dict[str, list[str]] = {}
        for name in of_package:
            first, *inner = name.removeprefix(f"{package}.").split(".")
            if first in modules:
                of_modules.setdefault(first, []).extend(inner)
            else:
                lines += entry(f"planarfriction.{name}", getattr(parent, first))
        for module_name, names in of_modules.items():
            module = importlib.import_module(f"{parent.__name__}.{module_name}")
            lines += heading(f"{package}.{module_name}", "-")
            lines += [f".. automodule:: {module.__name__}", "   :no-members:", ""]
            for each in names:
                if hasattr(module, each):
                    lines += entry(f"{module.__name__}.{each}", getattr(module, each))
    return lines


def write(path: Path, lines: list[str]) -> None:
    """Write a page if it has changed, so that Sphinx reads no page twice."""
    text = "\n".join(lines) + "\n"
    if not path.exists() or path.read_text(encoding="utf-8") != text:
        path.write_text(text, encoding="utf-8")


def generate(app: Sphinx) -> None:
    folder = Path(app.srcdir) / "api"
    folder.mkdir(exist_ok=True)
    documented: dict[int, str] = {}
    missing = tuple(app.config.autodoc_mock_imports)
    public = [name.removeprefix("planarfriction.") for name in public_modules()[1:]]
    for subject in SUBJECTS:  # first, so that other pages only name what these document
        subject_page(subject, [], documented)
    pages = {}
    rows = []
    for file in public:
        name = f"planarfriction.{file}"
        try:
            pages[file] = page(name, documented)
        except ImportError as error:
            if not missing:
                raise error
            continue
        rows.append((file, first_sentence(importlib.import_module(name))))
    lines = [
        *heading("Python"),
        "Every public name, from its docstring, by subject.",
        "",
    ]
    lines += ["A field of the type ``Kept[A, B]`` is given as A, and kept as B.", ""]
    for subject, (sentence, *_) in SUBJECTS.items():
        pages[subject.lower()] = subject_page(subject, rows, documented)
        lines += [f"- :doc:`{subject.lower()}`: {sentence}"]
    lines += ["- :doc:`kernels`: compiled loops that these pages name.", ""]
    lines += [".. automodule:: planarfriction", "   :no-members:", ""]
    subjects = [subject.lower() for subject in SUBJECTS]
    lines += [
        ".. toctree::",
        "   :hidden:",
        "",
        *(f"   {file}" for file in (*subjects, "kernels")),
    ]
    pages |= {"kernels": kernels_page(Path(app.srcdir)), "index": lines}
    for file, lines in pages.items():
        write(folder / f"{file}.rst", lines)
    written = {f"{file}.rst" for file in pages}
    for old in {path.name for path in folder.glob("*.rst")} - written:
        (folder / old).unlink()


def as_restructured_text(
    app: Sphinx, what: str, name: str, thing: Any, options: Any, lines: list[str]
) -> None:
    """Sections in the style of NumPy, and `|v|` outside of backticks as a size, which is a substitution there.

    The words of attributes have no sections, and a colon in them is a colon.
    """
    if what == "class" and f"{HEADING}:" in lines:  # each has an entry of its own here
        del lines[lines.index(f"{HEADING}:") :]
    if what not in ("attribute", "property", "data"):
        lines[:] = NumpyDocstring(
            list(lines), app.config, app, what, name, thing, options
        ).lines()
    code = False
    for i, line in enumerate(lines):
        pieces = line.split("`")
        for k, piece in enumerate(pieces):
            code ^= k > 0
            if not code:
                pieces[k] = re.sub(r"(?<!\\)\|", r"\\|", piece)
        lines[i] = "`".join(pieces)


def with_names(
    app: Sphinx,
    what: str,
    name: str,
    thing: Any,
    options: Any,
    signature: str | None,
    returns: Any,
) -> Any:
    """Show aliases of types by their names inside other types too."""
    return signature and re.sub(
        r"TypeAliasForwardRef\('(\w+)'\)", r"\1", signature
    ), returns


def setup(app: Sphinx) -> dict[str, bool]:
    app.connect("builder-inited", generate)
    app.connect("autodoc-process-docstring", as_restructured_text)
    app.connect("autodoc-process-signature", with_names)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
