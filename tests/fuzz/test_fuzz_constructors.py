"""Everything public with one wrong argument: it works, or says in one line which argument is wrong."""

from __future__ import annotations

import functools
from typing import Any

import legal
import matplotlib.pyplot as plt
import nasty
import numpy as np
from attack import attack, folder
from hypothesis import strategies as st
from judge import CASES, Broken, judge
from working import use

from planarfriction import families

FAMILIES = (
    families.LAWS,
    families.MODELS,
    families.SURFACES,
    families.SHAPES,
    families.SCENES,
)


@functools.cache
def targets() -> dict[str, legal.Target]:
    return {target.name: target for target in legal.targets()}


def places() -> st.SearchStrategy[tuple[str, str]]:
    """A target and one of its arguments."""
    return st.sampled_from(
        [
            (name, each)
            for name in targets()
            for each in targets()[name].arguments
            if each not in ("self", legal.UNCHECKED.get(name))
        ]
    )


def called(target: legal.Target, **changed: Any) -> Any:
    """Call the target with legal arguments but for the changed ones, and use what it gives."""
    arguments = {
        name: legal.made(value) for name, value in target.arguments.items()
    } | changed
    own = [arguments.pop("self")] if "self" in arguments else []
    before = [dict(family._members) for family in FAMILIES]
    try:
        result = target.call(*own, **arguments)
        use(result)
    finally:
        plt.close("all")
        # What was registered is forgotten.
        for family, members in zip(FAMILIES, before, strict=True):
            family._members = members
    return (result,)


@functools.cache
def compiled(name: str) -> None:
    """Call the target once with legal arguments: compilation must not count against a wrong argument."""
    before = CASES["constructors: legal, refused"]
    with folder():
        judge("constructors: legal", lambda: called(targets()[name]), compiles=True)
    if CASES["constructors: legal, refused"] > before:
        raise Broken(
            "legal arguments are refused, so that wrong ones are refused for another reason"
        )


def numeric(value: Any) -> bool:
    """Return True if a legal argument is made of numbers, so that a text or a date instead of it must be refused."""
    if isinstance(value, (tuple, list)):
        return bool(value) and all(numeric(each) for each in value)
    return isinstance(value, (float, int, np.ndarray))


def test_legal_arguments_are_legal():
    wrong = []
    for name in targets():
        try:
            compiled(name)
        except Broken as broken:
            wrong.append(f"{name}: {broken}")
    assert not wrong, "\n".join(wrong)


@attack("constructors", 2000, st.deferred(places), nasty.nasty())
def test_one_wrong_argument(place, drawn) -> None:
    (name, argument) = place
    (what, make) = drawn
    target = targets()[name]
    compiled(name)
    names = tuple(each for each in target.arguments if each != "self")
    # Messages name the file or the key instead.
    if argument in (
        "path",
        "folder",
        "data",
        "make_scene",
    ):
        names = ()
    try:
        with folder():
            result = judge(
                "constructors",
                lambda: called(target, **{argument: make()}),
                names=names,
            )
        if (
            result is not None
            and what in nasty.WRONG
            and numeric(legal.made(target.arguments[argument]))
        ):
            raise Broken("is taken for numbers")
    except Broken as broken:
        raise Broken(f"{name}({argument}=<{what}>): {broken}") from broken
