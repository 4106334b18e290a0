"""Settings of the tests of simulators."""

import os
import sys

import pytest

PLAIN = "jax_disable_most_optimizations"
"""Option of JAX that most tests set (see `conftest.py` above)."""


@pytest.fixture(autouse=True, scope="module")
def optimised():
    """Steps of simulators run longer than they compile: JAX optimises them, as it does for users."""
    before = os.environ.pop(PLAIN.upper(), None)  # JAX may be imported within
    _set(False)
    yield
    if before is not None:
        os.environ[PLAIN.upper()] = before
    _set(before == "1")


def _set(plain: bool) -> None:
    if "jax" in sys.modules:
        sys.modules["jax"].config.update(PLAIN, plain)
