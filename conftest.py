"""Settings of a test run: Hypothesis draws the same examples each time, unless other ones are requested."""

from __future__ import annotations

import os
import signal

import pytest
from hypothesis import settings
from hypothesis.internal.conjecture import providers

from planarfriction import families

# Most of what tests of JAX take is compilation: without most passes, and without code that computes an operand again in
# each kernel that reads it.
os.environ.setdefault("JAX_DISABLE_MOST_OPTIMIZATIONS", "1")
os.environ.setdefault("XLA_FLAGS", "--xla_cpu_use_fusion_emitters=false")

settings.register_profile("repeatable", derandomize=True)
settings.register_profile("random", derandomize=False)


def pytest_configure(config) -> None:
    """A run that decides on a change must not fail for another reason; slow tests may draw new examples."""
    signal.signal(
        signal.SIGINT, signal.default_int_handler
    )  # ignored in what a shell starts in the background
    if config.getoption("--hypothesis-profile") is None:
        slow = "slow" in config.getoption("markexpr").replace("not slow", "")
        settings.load_profile("random" if slow else "repeatable")
    if settings.get_current_profile_name() == "repeatable" and hasattr(
        providers, "_get_local_constants"
    ):
        # Hypothesis draws numbers that it reads in the project's modules: those that earlier tests happened to import.
        # No setting of Hypothesis turns this off, nor does `derandomize`; a backend of our own would be as private.
        providers._get_local_constants = lambda: providers._local_constants


@pytest.fixture(autouse=True)
def members(monkeypatch):
    """Members that a test registers are forgotten after it: the next test of the process knows the library's own."""
    for family in vars(families).values():
        if isinstance(family, families.Family):
            monkeypatch.setattr(family, "_members", dict(family._members))
