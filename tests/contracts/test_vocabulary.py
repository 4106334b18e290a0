"""One vocabulary: the same names and arguments in every front end, and plain English in everything that is read."""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

import planarfriction as pf

MODELS = ("DistributedModel", "ReducedModel", "ReducedModelPublished")
ARGUMENTS = ["state", "twist", "normal_force", "dt"]

ROOT = Path(__file__).parents[2]
READ = ("*.md", "*.py", "*.j2", "*.ipynb", "*.toml")
"""Files whose words somebody reads: pages, sources with their docstrings and messages, templates, notebooks."""

STILTED = {
    r"\banew\b": "again",
    r"\bfor ever\b": "indefinitely, or leave it out",
    r"\bin the place of\b": "instead of, or replaces",
    r"\bhangs? together\b": "are correlated, or are related",
    r"\btold (together|poorly)\b": "determined, or distinguished",
    r"\b(not|cannot be|can be|be) told( from)?\b": "distinguished, or determined",
    r"\brest bristles\b": "relaxed bristles",
    r"\b(has|have|had) a say\b": "matters, or influences",
    r"\bgoes on where\b": "continues",
    r"\bso that (nobody|somebody|no one) has to\b": "say what it does for the reader",
    r"\bof the other sign\b": "of opposite sign",
    r"\bbreak(s|ing)? off and\b|\bbroken off\b": "interrupt",
    "\N{EM DASH}": "a comma, a colon or a full stop",
}
"""Phrases that a native speaker would not write here, and what to write."""

FIELD = {
    r"\broll-outs?\b": "rollout",
    r"\bgrains?\b": "anisotropy",
    r"\bdata leaves? open\b": "parameters that the data cannot determine",
    r"\bcompressed (patch|patches|cells)\b": "reduced quadrature",
    r"\bknows? the limit surface\b": "based on the limit surface",
    r"\bsees? each other\b": "coupled",
}
"""Words of pages that people in the field have another word for, and that word."""


def front_ends() -> list:
    """NumPy, PyTorch and JAX."""
    pytest.importorskip("torch", reason="needs PyTorch: pip install 'planarfriction[torch]'")
    pytest.importorskip("jax", reason="needs the extra [jax]")
    import planarfriction.jax
    import planarfriction.torch

    return [pf, planarfriction.torch, planarfriction.jax]


def positional(function) -> list[str]:
    """Names of the arguments that may be given by their place."""
    kinds = inspect.Parameter.POSITIONAL_ONLY, inspect.Parameter.POSITIONAL_OR_KEYWORD
    return [name for name, of in inspect.signature(function).parameters.items() if of.kind in kinds]


@pytest.mark.torch
@pytest.mark.jax
def test_every_front_end_has_the_same_models_methods_and_arguments():
    ends = front_ends()
    for name in MODELS:
        for model in (getattr(end, name) for end in ends):
            assert positional(model)[:2] == ["patch", "law"], model
            assert positional(model.rate) == positional(model.wrench) == ["self", *ARGUMENTS[:-1]], model
            assert positional(model.step) == ["self", *ARGUMENTS], model
        _, torch, jax = (positional(getattr(end, name)) for end in ends)
        assert torch == jax, name


@pytest.mark.torch
@pytest.mark.jax
def test_rollouts_share_their_arguments_and_first_results():
    ends = front_ends()
    for end in ends:
        assert positional(end.rollout) == ["model", *ARGUMENTS], end
        assert inspect.signature(end.rollout).parameters["parameters"].default is None, end
        results = inspect.signature(end.rollout).return_annotation
        assert results.split("[")[0] == "Rollout", end
    assert positional(ends[1].tracking_loss) == ["model", *ARGUMENTS, "wrenches"]
    for rollout in (pf.derivatives.Rollout, ends[1].Rollout, ends[2].Rollout):
        assert rollout._fields == ("state", "wrenches")
    for function in (pf.derivatives.rollout_states, pf.derivatives.rollout_vjp, pf.derivatives.rollout_jacobian):
        assert positional(function)[:5] == ["model", *ARGUMENTS], function
    assert pf.derivatives.RolloutVJP._fields == (*ARGUMENTS[:-1], "parameters")
    for end in ends[1:]:
        assert not hasattr(end, "simulate")  # that is for scenes
        assert {"parameters", "method"} <= set(inspect.signature(end.rollout).parameters)


def pages_and_sources() -> Iterator[Path]:
    """Everything that is read; compiled sources are left out, as a changed comment compiles all of them again."""
    yield from (ROOT / name for name in ("README.md", "CHANGELOG.md", "CONTRIBUTING.md", "pyproject.toml"))
    for folder in ("docs", "examples", "src", "tests", "studies"):
        for pattern in READ:
            yield from (ROOT / folder).rglob(pattern)


def uses(path: Path, words: dict[str, str]) -> Iterator[str]:
    """Yield each place of a file that uses one of the words, with what to write."""
    text = path.read_text(encoding="utf-8")
    for pattern, better in words.items():
        for match in re.finditer(pattern, text, re.IGNORECASE):
            line = text.count("\n", 0, match.start()) + 1
            yield f"{path.relative_to(ROOT)}:{line}: {match[0]!r}: {better}"


def test_pages_use_the_words_of_the_field():
    pages = [path for path in pages_and_sources() if path.suffix == ".md"]
    assert len(pages) > 25
    found = [each for path in pages for each in uses(path, FIELD)]
    assert not found, "\n".join(found)


def test_no_page_docstring_or_message_is_stilted():
    found, number = [], 0
    for path in pages_and_sources():
        inside = path.relative_to(ROOT)
        if path == Path(__file__) or {"kernels", "compiler", "loops"} & set(inside.parts) or not path.is_file():
            continue
        number += 1
        found += uses(path, STILTED)
    assert number > 300
    assert not found, "\n".join(found)
