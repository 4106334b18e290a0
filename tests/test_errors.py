"""Messages stay on one line and short, and errors travel between processes with what they know."""

import numpy as np
import pytest

from planarfriction import errors
from tests.support.refusals import refused


def test_values_of_messages_are_cut_to_eighty_characters():
    assert (
        errors.shown(80 * "a") == 80 * "a"
        and errors.shown(81 * "a") == 77 * "a" + "..."
    )
    assert errors.shown("a\nb") == "'a\\nb'" and errors.shown("a  b") == "a b"
    assert errors.shown(list(range(12))).endswith("10, 11]") and errors.shown(
        list(range(13))
    ).endswith("11, ...]")
    assert errors.shown({"a": np.float64(1.5)}) == "{'a': np.float64(1.5)}"
    assert errors.shown(10**5000) == "int that is too long to show"


def test_messages_about_files_lose_their_middle():
    assert errors.one_line(300 * "a") == 300 * "a"
    cut = errors.one_line(150 * "a" + "x" + 150 * "b")
    assert cut == 145 * "a" + " ... " + 150 * "b"
    assert (
        errors.one_line("a\x1b\nb") == "a\\x1b\\nb"
        and str(errors.FileError("a\tb")) == "a\\tb"
    )


def test_packages_that_lack_are_named_and_errors_of_our_own_are_not_hidden():
    told = r"^torch is not installed: .*\[torch\]'; for the processor"
    with (
        refused(told, errors.MissingExtraError),
        errors.needing("torch", "torch"),
    ):
        raise ImportError("no", name="torch._C")
    with (
        refused(r"\[jax\]'$", errors.MissingExtraError),
        errors.needing("jax", "jax"),
    ):
        raise ImportError("no", name="jaxlib")
    with (
        pytest.raises(ImportError, match="gone") as caught,
        errors.needing("jax", "jax"),
    ):
        raise ImportError("gone", name="planarfriction.gone")
    assert type(caught.value) is ImportError
