"""Attacks: declared once, counted, and repeated for an hour if asked."""

from __future__ import annotations

import contextlib
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st


class Attack(NamedTuple):
    """A function of random things that raises where a promise is broken."""

    function: Callable[..., None]
    strategies: tuple[st.SearchStrategy, ...]
    examples: int
    """Number of examples of a minute or so; a test run, which draws the same ones each time, takes a quarter."""

    def test(self, **options: Any) -> Callable[[], None]:
        """The test that Hypothesis makes of it; seeds have no smaller ones, so that it looks for none."""
        drawn = given(*self.strategies)(self.function)
        checks = list(HealthCheck)
        return settings(
            deadline=None,
            suppress_health_check=checks,
            phases=[Phase.generate],
            **options,
        )(drawn)

    def again(self, examples: int) -> None:
        """Attack with examples of which none was seen before."""
        self.test(max_examples=examples, derandomize=False, database=None)()


ATTACKS: dict[str, Attack] = {}
"""All of them, by kind and name."""


def attack(kind: str, examples: int, *strategies: st.SearchStrategy) -> Callable:
    """Make a test of a function of what the strategies draw; without one it draws from a `random.Random`."""

    def made(function: Callable[..., None]) -> Callable[[], None]:
        whole = Attack(
            function, strategies or (st.randoms(use_true_random=True),), examples
        )
        ATTACKS[f"{kind}: {function.__name__.removeprefix('test_')}"] = whole
        return whole.test(max_examples=-(-examples // 4))

    return made


@contextlib.contextmanager
def folder() -> Iterator[Path]:
    """Work in an empty folder, which is gone afterwards."""
    with tempfile.TemporaryDirectory() as name, contextlib.chdir(name):
        yield Path(name)
