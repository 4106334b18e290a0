"""Saved solutions with other bytes: what was saved, to the last bit, or one line that names the file."""

from __future__ import annotations

import functools
import random
from pathlib import Path

import numpy as np
from attack import attack, folder
from judge import Broken, judge
from mutation import mutated_bytes

import planarfriction as pf


@functools.cache
def solution() -> pf.Solution:
    model = pf.ReducedModelPublished(pf.ContactPatch.disc(0.01, 5), pf.LuGre(mu_s=1.2))
    return pf.simulate(pf.scenes.in_hand(model, t_end=0.1), bristles="all")


@functools.cache
def saved() -> bytes:
    with folder() as here:
        return Path(solution().save(here / "solution.nc")).read_bytes()


def same(first: pf.Solution, second: pf.Solution) -> bool:
    """To the last bit, with its scene; notes in the attributes apart."""
    if (
        set(first.data.variables) != set(second.data.variables)
        or first.scene.digest() != second.scene.digest()
    ):
        return False
    alike = all(
        np.array_equal(first.data[name].values, second.data[name].values)
        for name in first.data.variables
    )
    return (
        alike
        and first.data.attrs["scene"] == second.data.attrs["scene"]
        and first.status == second.status
    )


def test_the_untouched_file_is_the_solution():
    with folder() as here:
        path = here / "solution.nc"
        path.write_bytes(saved())
        assert same(pf.Solution.load(path), solution())


@attack("solution files", 300)
def test_a_file_with_other_bytes(draw: random.Random) -> None:
    data = saved()
    changed = flipped(data, draw) if draw.random() < 0.6 else mutated_bytes(data, draw)
    with folder() as here:
        path = here / "solution.nc"
        path.write_bytes(changed)
        loaded = judge(
            "solution files", lambda: pf.Solution.load(path), names=("solution.nc",)
        )
    if loaded is not None and not same(loaded, solution()):
        raise Broken("the file was damaged, and loads as something else")


def flipped(data: bytes, draw: random.Random) -> bytes:
    """A few bits of a disk or a wire."""
    result = bytearray(data)
    for _ in range(draw.choice([1, 1, 2, 8])):
        result[draw.randrange(len(result))] ^= 1 << draw.randrange(8)
    return bytes(result)
