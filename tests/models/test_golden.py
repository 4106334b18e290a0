"""Numbers of every model as they were written down: a change of the code's form changes none of them by 1e-9."""

from __future__ import annotations

import functools
import json

import numpy as np
import pytest

from tests.models import golden


@functools.cache
def written() -> dict:
    return json.loads(golden.FILE.read_text(encoding="utf-8"))


def check(kind: str, name: str, found: dict[str, list[float]]) -> None:
    expected = written()[kind][name]
    assert set(expected) <= set(found)
    for part, numbers in expected.items():
        # Sensitivities choose their own steps: with elasto-plastic bristles that begin to yield they are known to 5e-4.
        rounding = 5e-4 if part == "end by start" else 1e-9
        assert found[part] == pytest.approx(
            numbers, rel=0.0, abs=rounding * np.abs(numbers).max()
        ), part


@pytest.mark.parametrize("name", golden.MODELS)
def test_steps_and_gradients(name):
    check("steps", name, golden.numbers_of(golden.MODELS[name]))


@pytest.mark.parametrize("name", golden.SOURCES["scenes"][1])
def test_scenes(name):
    check("scenes", name, golden.numbers_of_scene(golden.MODELS[name]))


@pytest.mark.torch
@pytest.mark.parametrize("name", golden.IN_TENSORS)
def test_torch(name):
    pytest.importorskip("torch")
    check("tensors", name, golden.numbers_of_torch(golden.MODELS[name]))


@pytest.mark.jax
@pytest.mark.parametrize("name", golden.IN_TENSORS)
def test_jax(name):
    pytest.importorskip("jax")
    check("tensors", name, golden.numbers_of_jax(golden.MODELS[name]))
