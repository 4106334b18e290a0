"""Every function of the compiled core says what its arguments are."""

import ast
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[2] / "src/planarfriction"
FOLDERS = "_engine", "derivatives"
MOST = 9
"""Arguments of a function at most, constants by keyword apart: more of them are a record."""


def functions(folder):
    trees = (
        (each.name, ast.parse(each.read_text()))
        for each in sorted((PACKAGE / folder).rglob("*.py"))
    )
    return [
        (name, node)
        for name, tree in trees
        for node in ast.walk(tree)
        if isinstance(node, ast.FunctionDef)
    ]


@pytest.mark.parametrize("folder", FOLDERS)
def test_every_argument_and_result_is_annotated(folder):
    bare = []
    for file, node in functions(folder):
        every = [
            *node.args.posonlyargs,
            *node.args.args,
            *node.args.kwonlyargs,
            node.args.vararg,
            node.args.kwarg,
        ]
        names = [
            each.arg
            for each in every
            if each and each.annotation is None and each.arg not in ("self", "cls")
        ]
        if names or node.returns is None:
            bare.append(f"{file}: {node.name} {names}")
    assert not bare


def test_functions_take_few_arguments():
    counts = {
        (file, node.name): len(node.args.posonlyargs + node.args.args)
        for file, node in functions("_engine")
    }
    assert max(counts.values()) <= MOST, counts
