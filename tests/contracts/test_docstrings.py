"""Docstrings of public names: units, shapes and the errors that they raise."""

from __future__ import annotations

import ast
import dataclasses
import functools
import importlib
import inspect
import re
import textwrap
from typing import Any, NamedTuple

import pytest

import planarfriction as pf
from planarfriction._support.described import HEADING

FRONT_ENDS = {
    "torch": "torch",
    "jax": "jax",
    "adapters.mujoco": "mujoco",
    "adapters.mjx": "mujoco.mjx",
}
FRONT_ENDS |= {
    "adapters.drake": "pydrake",
    "warp": "warp",
    "adapters.mujoco_warp": "mujoco_warp",
}
MODULES = [name for name in pf.__all__ if inspect.ismodule(getattr(pf, name))]
PLAIN = [name for name in MODULES if name not in ("errors", "families", "formulas")]
OF_PYTHON = {
    "NotImplementedError",
    "AttributeError",
    "TypeError",
    "StopIteration",
    "KeyError",
}
"""Raised for Python's own protocols, or by a method that a subclass has to write."""


CHECKED_BEFORE = re.compile(
    r"identify\.Identification\.to_dict|patch\.(PerCell|PressureMaps)\.(only|repeated|ever_loaded)"
    r"|torch\.(ReducedModel\.law|ReducedPlanarLuGre\.(mu_.|v_s|gamma|sigma_.|radius))"
)
"""Functions whose checks cannot fail, since their numbers were checked when the record was made."""


class Public(NamedTuple):
    """A function, or a class as it is made, that users call."""

    name: str
    code: Any
    """The function whose body is read."""
    doc: str
    owner: type | None = None
    """The class that it belongs to."""


def members(where):
    """Public classes and functions of a module of the package, each under its full name."""
    module = importlib.import_module(f"planarfriction.{where}")
    names = getattr(module, "__all__", None) or [
        name for name in vars(module) if not name.startswith("_")
    ]
    home = "planarfriction" if hasattr(module, "__all__") else module.__name__
    for name in names:
        value = getattr(module, name)
        if callable(value) and getattr(value, "__module__", "").startswith(home):
            yield f"{where}.{name}", value


def callables(where):
    for name, value in members(where):
        if not inspect.isclass(value):
            yield Public(name, value, value.__doc__ or "")
            continue
        if dataclasses.is_dataclass(value):
            own = [
                each
                for each in dataclasses.fields(value)
                if each.name in inspect.get_annotations(value)
            ]
            checks = [
                each.metadata["check"][0] for each in own if "check" in each.metadata
            ]
            yield from (
                Public(name, check, value.__doc__ or "", value) for check in checks
            )
        for attribute, member in vars(value).items():
            code = function_of(member)
            if not inspect.isfunction(code):
                continue
            if attribute in ("__init__", "__post_init__"):
                yield Public(name, code, value.__doc__ or "", value)
            elif not attribute.startswith("_"):
                yield Public(
                    f"{name}.{attribute}", code, inspect.getdoc(member) or "", value
                )


def function_of(member):
    """The function behind a method, a property or a function that keeps its results."""
    code = (
        member.__func__ if isinstance(member, (classmethod, staticmethod)) else member
    )
    return (
        code.fget
        if isinstance(code, property)
        else inspect.unwrap(getattr(code, "func", code))
    )


@functools.cache
def tree(code):
    try:
        return ast.parse(textwrap.dedent(inspect.getsource(code)))
    except (OSError, SyntaxError):  # what `dataclass` wrote
        return ast.Module([], [])


def called(node, code, owner):
    """Return the object of this package that a name or a member stands for in a function, None for other objects."""
    if isinstance(node, ast.Name):
        return code.__globals__.get(node.id)
    if not isinstance(node, ast.Attribute):
        return None
    if (
        isinstance(node.value, ast.Name)
        and node.value.id in ("self", "cls")
        and owner is not None
    ):
        return inspect.getattr_static(owner, node.attr, None)
    home = called(node.value, code, owner)
    return (
        inspect.getattr_static(home, node.attr, None)
        if inspect.isclass(home) or inspect.ismodule(home)
        else None
    )


def raises(code, owner=None, seen=frozenset()):
    """Names of the errors that a function raises, itself or in what it calls of this package but compiled loops."""
    plain = r"planarfriction\.(?!_engine\.(?!records)|[\w.]+\.loops)"
    if (
        not inspect.isfunction(code)
        or code in seen
        or not re.match(plain, code.__module__)
    ):
        return set()
    found = set()
    seen = seen | {code}
    for node in ast.walk(tree(code)):
        if isinstance(node, ast.Raise) and node.exc is not None:
            made = node.exc.func if isinstance(node.exc, ast.Call) else node.exc
            found.add(ast.unparse(made))
        if isinstance(node, ast.Call):
            value = called(node.func, code, owner)
            if inspect.isclass(value):
                for name in ("__init__", "__post_init__", "__new__"):
                    found |= raises(
                        inspect.getattr_static(value, name, None), value, seen
                    )
            elif value is not None:
                mine = re.match(r"(self|cls)\.\w+$", ast.unparse(node.func))
                found |= raises(function_of(value), owner if mine else None, seen)
    return {name for name in found if name.endswith("Error")} - OF_PYTHON


def modules():
    return [
        *PLAIN,
        *(
            pytest.param(name, marks=getattr(pytest.mark, name.rpartition(".")[2]))
            for name in FRONT_ENDS
        ),
    ]


@pytest.mark.parametrize("where", modules())
def test_what_raises_says_so(where):
    if where in FRONT_ENDS:
        pytest.importorskip(FRONT_ENDS[where])
    said = [
        (each.name, raises(each.code, each.owner))
        for each in callables(where)
        if "Raises" not in each.doc
    ]
    assert not [
        (name, errors)
        for name, errors in said
        if errors and not CHECKED_BEFORE.fullmatch(name)
    ]


def records(where):
    """Public dataclasses and named tuples, as users see them."""
    kinds = [(name, value) for name, value in members(where) if inspect.isclass(value)]
    return [
        (name, value)
        for name, value in kinds
        if dataclasses.is_dataclass(value) or hasattr(value, "_fields")
    ]


def arguments(kind):
    """Names and types of the arguments of a record, but for its own."""
    if dataclasses.is_dataclass(kind):
        return [
            (each.name, str(each.type))
            for each in dataclasses.fields(kind)
            if each.init and each.name[0] != "_"
        ]
    return [(name, str(kind.__annotations__.get(name, ""))) for name in kind._fields]


@pytest.mark.parametrize("where", PLAIN)
def test_help_begins_with_a_sentence(where):
    for name, value in members(where):
        first = (inspect.getdoc(value) or "").partition("\n\n")[0]
        assert re.match(r"[A-Z]", first) and first.rstrip().endswith(
            (".", ":", "?", "`")
        ), name


@pytest.mark.parametrize("where", PLAIN)
def test_help_says_what_each_argument_is(where):
    """Numbers with their unit, arrays with their shape too."""
    for kind, value in records(where):
        said = inspect.getdoc(value) or ""
        listed = said.partition(f"\n{HEADING}:\n")[2]
        for name, of in arguments(value):
            match = re.search(
                rf"^{name}\n((?:    .*\n?|\n)+)", listed + "\n", re.MULTILINE
            )
            assert match, f"{kind}: {name}"
            if re.match(r"(float|np.ndarray)", of):
                assert re.search(r"\[[^\]]+\]|\(units of", match[1]), (
                    f"{kind}: {name} has no unit"
                )


@pytest.mark.parametrize(
    "where", [name for name in PLAIN if hasattr(getattr(pf, name), "__path__")]
)
def test_the_tab_key_shows_public_names_alone(where):
    module = getattr(pf, where)
    assert dir(module) == sorted(module.__all__) and all(
        hasattr(module, name) for name in dir(module)
    )
