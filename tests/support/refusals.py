"""What every mistake of a user gets: one line that says what is wrong."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator

import pytest

from planarfriction.errors import InvalidValueError


@contextlib.contextmanager
def refused(words: str, kind: type[Exception] = InvalidValueError) -> Iterator[None]:
    """Expect an error of the library whose message is one line that holds a pattern."""
    with pytest.raises(kind, match=words) as caught:
        yield
    assert "\n" not in str(caught.value)
