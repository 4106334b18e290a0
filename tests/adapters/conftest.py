"""Settings of the tests of simulators."""

import os
import sys

import pytest

PLAIN = "jax_disable_most_optimizations"
"""Option of JAX that most tests set (see `conftest.py` above)."""


@pytest.fixture(autouse=True, scope="module")
def optimised():
    """Steps of simulators run longer than they compile: JAX optimises them, as it does for users."""
    jax = sys.modules.get("jax")
    if jax is None:
        yield
        return
    jax.config.update(PLAIN, False)
    yield
    jax.config.update(PLAIN, os.environ.get(PLAIN.upper()) == "1")
