"""What all attacks share: how they are declared, counted and run for an hour."""

from __future__ import annotations

import contextlib
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st

ATTACKS: dict[str, tuple[Callable[[], None], int]] = {}
"""Kind -> test and the number of its examples in a run of a minute."""

_CHECKS = list(HealthCheck)


def attack(kind: str, examples: int, *strategies: st.SearchStrategy) -> Callable:
    """Make a test of a function of what the strategies draw; without one it draws from a `random.Random`."""

    def made(function: Callable) -> Callable:
        drawn = given(*(strategies or (st.randoms(use_true_random=True),)))(function)
        test = settings(max_examples=examples, deadline=None, suppress_health_check=_CHECKS)(drawn)
        ATTACKS[f"{kind}: {function.__name__.removeprefix('test_')}"] = test, examples
        return test

    return made


def again(test: Callable, examples: int) -> Callable:
    """The test with other examples than those of every run, and more of them; what fails is not looked for twice."""
    phases = (Phase.generate, Phase.shrink)
    return settings(test, max_examples=examples, derandomize=False, database=None, phases=phases)(test)


@contextlib.contextmanager
def folder() -> Iterator[Path]:
    """Work in an empty folder, which is gone afterwards."""
    with tempfile.TemporaryDirectory() as name, contextlib.chdir(name):
        yield Path(name)
